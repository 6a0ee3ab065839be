//! The client's view of the model `probes`: volumes, for the samplers on the CPU
//! ([`ProbesVolume::field`]) and on a device.

use super::lattice::Lattice;
use super::sample::Field;
use super::sh::L2;
use super::visibility::Visibility;
use crate::client::Client;
use crate::codec::probes::{TEXELS, Texel, f32_from_f16};
use crate::codec::{Decoder, Model, TrackState};
use crate::{Error, Result};
use glam::{Affine3A, Mat3A, Vec3};
use std::borrow::Cow;

/// What values of a volume are multiplied by: two to its exponent.
pub fn scale(exponent: i8) -> f32 {
    2f32.powi(exponent.into())
}

/// The expansions of `count` probes, from [`TEXELS`] planes of one texel a
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

/// The probes of a client as of its last frame.
pub struct ProbesView<'c> {
    pub volumes: Vec<ProbesVolume<'c>>,
}

impl<'c> ProbesView<'c> {
    pub fn new(client: &'c Client) -> ProbesView<'c> {
        let decoder = client.decoder();
        let tracks = decoder.tracks().iter();
        ProbesView {
            volumes: tracks
                .filter_map(|track| ProbesVolume::new(decoder, track))
                .collect(),
        }
    }
}

/// The probes of one volume. Large arrays are the decoder's own, unless
/// [`ProbesVolume::into_owned`] copies them.
#[derive(Clone, Debug)]
pub struct ProbesVolume<'a> {
    /// Where its probes stand in grid space.
    pub lattice: Lattice,
    /// Rigid: a place in the world to grid space.
    pub grid_from_world: Affine3A,
    /// Values are f16 times two to this.
    pub exponent: i8,
    /// [`TEXELS`] planes of one texel a probe, as [`radiance`] takes them.
    pub texels: Cow<'a, [Texel]>,
    /// Whether each probe is present.
    pub present: Cow<'a, [bool]>,
    radiance: Vec<L2>,
    blocks: Option<Blocks<'a>>,
}

/// [`Visibility`] that may own its texels.
#[derive(Clone, Debug)]
struct Blocks<'a> {
    side: u32,
    range: f32,
    texels: Cow<'a, [[u8; 2]]>,
}

impl<'a> ProbesVolume<'a> {
    /// The volume of a track as of the last commit, in a mesh space that is the world; `None` for a
    /// track of another model.
    pub fn new(decoder: &'a Decoder, track: &TrackState) -> Option<ProbesVolume<'a>> {
        let Model::Probes(volume) = track.track.model else {
            return None;
        };
        let state = decoder.probes();
        let rows = volume.grid_from_mesh;
        let matrix = Mat3A::from_cols_array_2d(&rows.map(|[x, y, z, _]| [x, y, z])).transpose();
        let present: Vec<bool> = state.probes_of(track).iter().map(|p| p.level > 0).collect();
        Some(ProbesVolume::from_parts(
            Lattice {
                dims: volume.dims,
                spacing: Vec3::from(volume.spacing),
            },
            Affine3A {
                matrix3: matrix,
                translation: rows.map(|row| row[3]).into(),
            },
            volume.exponent,
            state.texels_of(track),
            present,
            state.visibility_of(track).map(|bytes| Visibility {
                side: volume.visibility.side.into(),
                range: volume.visibility.range,
                texels: bytes.as_chunks::<2>().0,
            }),
        ))
    }

    /// A volume of given arrays; [`ProbesVolume::check`] tells whether they fit.
    pub fn from_parts(
        lattice: Lattice,
        grid_from_world: Affine3A,
        exponent: i8,
        texels: impl Into<Cow<'a, [Texel]>>,
        present: impl Into<Cow<'a, [bool]>>,
        visibility: Option<Visibility<'a>>,
    ) -> ProbesVolume<'a> {
        let texels = texels.into();
        ProbesVolume {
            radiance: radiance(&texels, lattice.count(), exponent),
            lattice,
            grid_from_world,
            exponent,
            texels,
            present: present.into(),
            blocks: visibility.map(|v| Blocks {
                side: v.side,
                range: v.range,
                texels: v.texels.into(),
            }),
        }
    }

    /// A copy that outlives the decoder.
    pub fn into_owned(self) -> ProbesVolume<'static> {
        ProbesVolume {
            lattice: self.lattice,
            grid_from_world: self.grid_from_world,
            exponent: self.exponent,
            texels: self.texels.into_owned().into(),
            present: self.present.into_owned().into(),
            radiance: self.radiance,
            blocks: self.blocks.map(|b| Blocks {
                texels: b.texels.into_owned().into(),
                ..b
            }),
        }
    }

    /// That every probe has its texels, its presence, and its visibility where there is any.
    ///
    /// # Errors
    /// [`Error::Invalid`] says what is missing.
    pub fn check(&self) -> Result<()> {
        let count = self.lattice.count();
        let visibility = self.visibility();
        let side = visibility.map_or(0, |v| v.side as usize);
        let blocks = visibility.map_or(0, |v| v.texels.len());
        let wrong = |what: &str, there: usize, needed: usize| {
            Err(Error::Invalid(format!(
                "a volume of {count} probes needs {needed} {what} and has {there}"
            )))
        };
        if count == 0 {
            return Err(Error::Invalid("a volume needs a probe".into()));
        }
        if self.texels.len() != TEXELS * count {
            return wrong("texels", self.texels.len(), TEXELS * count);
        }
        if self.present.len() != count {
            return wrong("marks of presence", self.present.len(), count);
        }
        if blocks != side * side * count {
            return wrong("texels of visibility", blocks, side * side * count);
        }
        Ok(())
    }

    /// What a shader multiplies texels by.
    pub fn scale(&self) -> f32 {
        scale(self.exponent)
    }

    /// The expansions of all probes.
    pub fn radiance(&self) -> &[L2] {
        &self.radiance
    }

    /// How far its probes see, where that has come.
    pub fn visibility(&self) -> Option<Visibility<'_>> {
        self.blocks.as_ref().map(|b| Visibility {
            side: b.side,
            range: b.range,
            texels: &b.texels,
        })
    }

    /// What the sampler looks up in.
    pub fn field(&self) -> Field<'_> {
        Field {
            lattice: self.lattice,
            radiance: &self.radiance,
            present: &self.present,
            visibility: self.visibility(),
        }
    }

    /// Squared distance in metres of a place in the world from the volume's box.
    pub fn distance_squared(&self, world: Vec3) -> f32 {
        let x = self.grid_from_world.transform_point3(world);
        x.distance_squared(x.clamp(Vec3::ZERO, self.lattice.extent()))
    }
}
