//! `probes`: incident radiance as spherical harmonics in volumes of probes (DDISH-GI,
//! `spec/probes.md`).

mod contexts;
mod decode;
mod digest;
mod encode;
mod f16;
mod fill;
mod map_contexts;
mod maps;
mod packed;
mod parameters;
mod quantize;
mod raw;
mod state;
mod values;

pub use crate::dirty::DirtyRange;
pub use crate::models::payload_header::Coverage;
pub use encode::Update;
pub use f16::{f16_from_f32, f32_from_f16};
pub use quantize::Tolerance;
pub use state::State;

pub(crate) use decode::Store;

use crate::Decoder;
use crate::container::record_type;
use crate::models::{Descriptor, LookupSpace, Model};
use crate::session::track::Track;

/// The model's entry in the registry.
pub(crate) const DESCRIPTOR: Descriptor = Descriptor {
    name: "probes",
    number: 2,
    record_type: record_type::PROBES,
    codings: &["raw", "packed"],
    spaces: &[LookupSpace::Mesh],
    read: |coding, reader| Ok(Model::Probes(Volume::read(coding, reader)?)),
    track_bytes: Store::TRACK_BYTES,
};

impl Track {
    /// The volume of a `probes` track; none of another model.
    pub fn volume(&self) -> Option<&Volume> {
        let Model::Probes(volume) = &self.model else {
            return None;
        };
        Some(volume)
    }
}

impl Decoder {
    /// State of the `probes` tracks as of the last commit.
    pub fn probes(&self) -> &State {
        &self.session.models.probes.state
    }
}

/// Coefficients of spherical harmonics of degrees 0 to 2, in the order (0,0); (1,-1), (1,0), (1,1);
/// (2,-2) to (2,2).
pub const COEFFICIENTS: usize = 9;
/// Numbers of a probe: three for each coefficient.
pub const CODES: usize = 3 * COEFFICIENTS;
/// Texels of four numbers that a probe takes; the 28th number is 0.
pub const TEXELS: usize = 7;

/// A texel of a visibility map: mean and deviation.
type MapTexel = [u8; 2];
/// The texel of an open map, in which nothing is seen within the range.
const OPEN: MapTexel = [255, 0];

/// Four f16: WGSL `vec2<u32>` in a storage buffer, or a texel of `rgba16float`.
pub type Texel = [u16; 4];

/// What a track of the model declares, once: one irradiance volume, a grid of probes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Rows of a 3x4 matrix, grid space from mesh space: metres, rigid, origin at the first probe.
    /// The axes of the spherical harmonics are those of grid space.
    pub grid_from_mesh: [[f32; 4]; 3],
    /// Probes along x, y, z, each at least 1; their product is at most 2^24.
    pub dims: [u16; 3],
    /// Metres between probes along x, y, z.
    pub spacing: [f32; 3],
    /// A decoded value is an f16 times two to this power, -64 to 64.
    pub exponent: i8,
    /// What is known of the distances around each probe.
    pub visibility: Visibility,
    /// How probes are coded.
    pub coding: Coding,
}

/// Distances around a probe in an octahedral map: two bytes a texel, the mean and the deviation, so
/// that 255 stands for `range`. All 0 for a volume without maps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Visibility {
    /// Texels along a side of the map: 0 where there is none, 4, 8 or 16.
    pub side: u8,
    /// Metres; above 0 where there is a map, and 0 where not.
    pub range: f32,
    /// Steps of means and of deviations: in the coding `packed`, where there is a map, each byte is a
    /// multiple of its step, or 255 ([`Volume::quantize_visibility`]). 1 to 255 there, and 0 elsewhere.
    pub steps: [u8; 2],
}

/// How probes of a volume are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// `raw`: f16 as they are, 56 bytes a probe.
    Raw,
    /// `packed`: logarithmic luma of degree 0, all else relative to it, entropy-coded.
    Packed(Steps),
}

/// Steps of the quantiser, for degrees 0, 1 and 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Of luma: that of degree 0 in 1/256 of an octave, 1 to 2560; others as for chroma.
    pub luma: [u16; 3],
    /// Of chroma: in 1/4096 of the luma of degree 0, 1 to 32768.
    pub chroma: [u16; 3],
}

/// A probe as it is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Probe {
    /// Degrees that are there: 0 for an absent probe, 1 for degree 0 alone, 2, or 3.
    pub level: u8,
    /// Codes, 0 above the level. `packed`: degree by degree, first luma of each coefficient, then
    /// both chroma (Co, Cg) of each. `raw`: the bits of an f16, R, G, B of each coefficient.
    pub codes: [i16; CODES],
}

impl Probe {
    /// A probe that is not there: inside geometry, say.
    pub const ABSENT: Probe = Probe {
        level: 0,
        codes: [0; CODES],
    };

    /// The same probe with fewer degrees.
    pub fn cut(mut self, level: u8) -> Probe {
        self.level = self.level.min(level);
        self.codes[codes_below(self.level)..].fill(0);
        self
    }
}

impl Volume {
    /// Number of probes.
    pub fn count(&self) -> usize {
        self.dims.iter().map(|&d| usize::from(d)).product()
    }

    /// Index of a probe: `x + Dx * (y + Dy * z)`.
    pub fn index(&self, [x, y, z]: [u32; 3]) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        x + dx * (y + dy * z)
    }

    /// Bytes of its visibility block; 0 where it has none.
    pub fn visibility_bytes(&self) -> u64 {
        let side = u64::from(self.visibility.side);
        self.probes() * side * side * 2
    }

    /// Rounds a visibility block to the bytes that the volume can have. In the coding `raw` it has all.
    pub fn quantize_visibility(&self, block: &mut [u8]) {
        let planes = self.visibility.steps.map(maps::Plane::new);
        for texel in block.as_chunks_mut::<2>().0 {
            *texel = [0, 1].map(|plane| planes[plane].nearest(texel[plane]));
        }
    }

    fn probes(&self) -> u64 {
        self.dims.iter().map(|&d| u64::from(d)).product()
    }
}

/// A group of codes of one degree: luma, or chroma.
#[derive(Clone, Copy)]
struct Group {
    /// Degree.
    degree: usize,
    /// First code and the one after the last.
    start: usize,
    end: usize,
}

/// Groups in the order of coding; a probe of level l has the first 2 l of them.
const GROUPS: [Group; 6] = {
    const fn group(degree: usize, start: usize, end: usize) -> Group {
        Group { degree, start, end }
    }
    [
        group(0, 0, 1),
        group(0, 1, 3),
        group(1, 3, 6),
        group(1, 6, 12),
        group(2, 12, 17),
        group(2, 17, 27),
    ]
};

/// Codes of a probe of a level.
fn codes_below(level: u8) -> usize {
    [0, 3, 12, 27][usize::from(level.min(3))]
}

#[cfg(all(test, feature = "std"))]
mod tests;
