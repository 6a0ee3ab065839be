//! Volumes of probes in a picture: which volume lights a place, and their upload to a device
//! ([`device`]).

pub mod device;

use crate::codec::probes::{TEXELS, f16_from_f32};
use crate::probes::client::{self, ProbesVolume};
use crate::probes::sh::L2;
use glam::Vec3;

pub use crate::codec::probes::Texel;

/// The volume that lights a place in the world: the first of those that hold it, else the nearest.
pub fn volume_at(volumes: &[ProbesVolume], world: Vec3) -> Option<usize> {
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
