//! Probe volumes as a client holds them: the decoder's texels beside what they mean, ready for the
//! sampler on the CPU ([`ProbeVolume::radiance`]) and for a device ([`device`]).

pub mod device;

use crate::codec::probes::{TEXELS, f16_from_f32};
use crate::probes::client::{self, ProbesVolume};
use crate::probes::lattice::Lattice;
use crate::probes::sample::Field;
use crate::probes::sh::L2;
use crate::probes::visibility::Visibility;
use crate::{Error, Result};
use glam::{Affine3A, Vec3};

pub use crate::codec::probes::Texel;

/// The probes of one volume.
#[derive(Clone, Copy, Debug)]
pub struct ProbeVolume<'a> {
    pub lattice: Lattice,
    /// Rigid: a place in the world to grid space.
    pub grid_from_world: Affine3A,
    /// Values are f16 times two to this.
    pub exponent: i8,
    /// [`TEXELS`] planes of one texel a probe, as [`client::radiance`] takes them.
    pub texels: &'a [Texel],
    /// Whether each probe is present.
    pub present: &'a [bool],
    pub visibility: Option<Visibility<'a>>,
}

impl<'a> ProbeVolume<'a> {
    /// A decoded volume.
    pub fn of(volume: &'a ProbesVolume) -> ProbeVolume<'a> {
        ProbeVolume {
            lattice: volume.lattice(),
            grid_from_world: volume.grid_from_world(),
            exponent: volume.volume.exponent,
            texels: &volume.texels,
            present: &volume.present,
            visibility: volume.visibility(),
        }
    }

    /// That every probe has its texels, its presence, and its visibility where there is any.
    ///
    /// # Errors
    /// [`Error::Invalid`] says what is missing.
    pub fn check(&self) -> Result<()> {
        let count = self.lattice.count();
        let side = self.visibility.map_or(0, |v| v.side as usize);
        let blocks = self.visibility.map_or(0, |v| v.texels.len());
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
        client::scale(self.exponent)
    }

    /// The expansions of all probes, for [`ProbeVolume::field`].
    pub fn radiance(&self) -> Vec<L2> {
        client::radiance(self.texels, self.lattice.count(), self.exponent)
    }

    /// What the CPU's sampler looks up in. `radiance` is [`ProbeVolume::radiance`].
    pub fn field<'r>(&self, radiance: &'r [L2]) -> Field<'r>
    where
        'a: 'r,
    {
        Field {
            lattice: self.lattice,
            radiance,
            present: self.present,
            visibility: self.visibility,
        }
    }

    /// Squared distance in metres of a place in the world from the volume's box.
    fn distance_squared(&self, world: Vec3) -> f32 {
        let x = self.grid_from_world.transform_point3(world);
        x.distance_squared(x.clamp(Vec3::ZERO, self.lattice.extent()))
    }
}

/// The volume that lights a place in the world: the first of those that hold it, else the nearest.
pub fn volume_at(volumes: &[ProbeVolume], world: Vec3) -> Option<usize> {
    let mut best: Option<(f32, usize)> = None;
    for (i, volume) in volumes.iter().enumerate() {
        let distance = volume.distance_squared(world);
        if best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, i));
        }
    }
    best.map(|(_, i)| i)
}

/// Texels that hold expansions as the format would without coding them: the nearest f16.
pub fn texels(radiance: &[L2], exponent: i8) -> Vec<Texel> {
    let scale = client::scale(exponent).recip();
    let count = radiance.len();
    let mut texels = vec![[0; 4]; TEXELS * count];
    for (p, expansion) in radiance.iter().enumerate() {
        for (v, value) in expansion.iter().flat_map(Vec3::to_array).enumerate() {
            texels[v / 4 * count + p][v % 4] = f16_from_f32(value * scale);
        }
    }
    texels
}

/// The least exponent, not below 0, with which all values of these expansions fit.
pub fn exponent(radiance: &[L2]) -> i8 {
    let peak = radiance
        .iter()
        .flatten()
        .map(|c| c.abs().max_element())
        .fold(0.0, f32::max);
    (0i8..=64)
        .find(|e| peak <= 65504.0 * client::scale(*e))
        .unwrap_or(64)
}

#[cfg(test)]
#[path = "probes/tests.rs"]
pub(super) mod tests;
