//! The client's side of a `probes` track: what the decoder holds, for the sampler.

use super::lattice::Lattice;
use super::sample::Field;
use super::sh::L2;
use super::visibility::Visibility;
use crate::codec::probes::{Texel, Volume, f32_from_f16};
use crate::codec::{Decoder, Model, TrackState};
use glam::{Affine3A, Mat3A, Vec3};

/// What values of a volume are multiplied by: two to its exponent.
pub fn scale(exponent: i8) -> f32 {
    2f32.powi(exponent.into())
}

/// The expansions of `count` probes, from [`TEXELS`](crate::codec::probes::TEXELS) planes of one texel a
/// probe: value v of probe p (channel c of coefficient lm is `3 * lm + c`) is component `v % 4` of texel
/// `v / 4 * count + p`, an f16 times [`scale`]. What is missing is 0.
pub fn radiance(texels: &[Texel], count: usize, exponent: i8) -> Vec<L2> {
    let scale = scale(exponent);
    let value = |probe: usize, v: usize| {
        let texel = texels.get(v / 4 * count + probe);
        f32_from_f16(texel.map_or(0, |t| t[v % 4])) * scale
    };
    let expansion =
        |probe| std::array::from_fn(|lm| Vec3::from([0, 1, 2].map(|c| value(probe, 3 * lm + c))));
    (0..count).map(expansion).collect()
}

/// One volume as it was decoded.
#[derive(Clone, Debug)]
pub struct ProbesVolume {
    pub volume: Volume,
    /// As the decoder holds them: [`crate::codec::probes::State`].
    pub texels: Vec<Texel>,
    radiance: Vec<L2>,
    pub present: Vec<bool>,
    visibility: Option<Vec<[u8; 2]>>,
}

impl ProbesVolume {
    /// The volume of a track as of the last commit; `None` for a track of another model.
    pub fn new(decoder: &Decoder, live: &TrackState) -> Option<ProbesVolume> {
        let Model::Probes(volume) = live.track.model else {
            return None;
        };
        let state = decoder.probes();
        let texels = state.texels_of(live);
        Some(ProbesVolume {
            texels: texels.to_vec(),
            radiance: radiance(texels, volume.count(), volume.exponent),
            present: state.probes_of(live).iter().map(|p| p.level > 0).collect(),
            visibility: state
                .visibility_of(live)
                .map(|bytes| bytes.as_chunks::<2>().0.to_vec()),
            volume,
        })
    }

    /// Where its probes stand in grid space.
    pub fn lattice(&self) -> Lattice {
        Lattice {
            dims: self.volume.dims,
            spacing: Vec3::from(self.volume.spacing),
        }
    }

    /// How far its probes see, where that has come.
    pub fn visibility(&self) -> Option<Visibility<'_>> {
        self.visibility.as_deref().map(|texels| Visibility {
            side: self.volume.visibility.side.into(),
            range: self.volume.visibility.range,
            texels,
        })
    }

    /// Grid space from the world, for a volume whose mesh space that is.
    pub fn grid_from_world(&self) -> Affine3A {
        let rows = self.volume.grid_from_mesh;
        let matrix = Mat3A::from_cols_array_2d(&rows.map(|[x, y, z, _]| [x, y, z])).transpose();
        Affine3A {
            matrix3: matrix,
            translation: rows.map(|row| row[3]).into(),
        }
    }

    /// What the sampler looks at.
    pub fn field(&self) -> Field<'_> {
        Field {
            lattice: self.lattice(),
            radiance: &self.radiance,
            present: &self.present,
            visibility: self.visibility(),
        }
    }
}
