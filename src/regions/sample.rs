//! The client's sampler: the ambient obscurance of an object at a place (`spec/regions.md` §10, whose
//! query vectors hold it), and its twin on a device, `embed/shaders/wgsl/regions.wgsl`.
//!
//! Positions and normals are in the track's space, which is the world unless it has a transform.

use crate::codec::regions::{Derivatives, Pair, Region, RegionSet};
use glam::{Vec2, Vec3};

/// The regions of a track as decoded.
#[derive(Clone, Copy, Debug)]
pub struct Regions<'a> {
    pub regions: &'a [Region],
    pub pairs: &'a [Pair],
    /// What a value of 1 stands for: [`RegionSet::scale`].
    pub scale: f32,
    /// Share of the second signal.
    pub share: f32,
}

impl<'a> Regions<'a> {
    /// Regions and their coefficients with the parameters of their track.
    pub fn new(set: &RegionSet, regions: &'a [Region], pairs: &'a [Pair]) -> Regions<'a> {
        Regions {
            regions,
            pairs,
            scale: set.scale(),
            share: set.signals.share,
        }
    }

    /// Index of the region of a place, by a look at each of them: the one whose box is nearest, of those
    /// the one of least volume, of those the first. `None` without regions.
    pub fn find(&self, p: Vec3) -> Option<usize> {
        let keys = self.regions.iter().map(|region| Key::of(region, p));
        let mut best: Option<(usize, Key)> = None;
        for (at, key) in keys.enumerate() {
            if best.is_none_or(|(_, best)| key.is_before(best)) {
                best = Some((at, key));
            }
        }
        best.map(|(at, _)| at)
    }

    /// AO at a place with unit normal `n` by the region of an index; 1 where there is none of the index.
    pub fn sample(&self, region: usize, p: Vec3, n: Vec3) -> f32 {
        let Some(region) = self.regions.get(region) else {
            return 1.0;
        };
        let Some(form) = region.form() else {
            return 1.0;
        };
        let u = offsets(region, p);
        let signals = usize::from(form.signals);
        let count = form.polynomials();
        // The row of each axis on this side of the centre.
        let rows = match form.derivatives {
            Derivatives::Constant => [0; 3],
            Derivatives::Gradient => [1, 2, 3],
            Derivatives::Sided => [0, 1, 2].map(|axis| 1 + 2 * axis + usize::from(u[axis] < 0.0)),
        };
        let first = 2 * region.first as usize;
        let coefficients = |row: usize, k: usize| {
            let at = first + (row * count + k) * signals;
            let value = |at: usize| {
                let value = self.pairs.get(at / 2).map_or(0, |pair| pair[at % 2]);
                f32::from(value) * self.scale
            };
            Vec2::new(value(at), value(at + signals - 1))
        };
        let mut sum = Vec2::ZERO;
        for (k, polynomial) in polynomials(n).into_iter().take(count).enumerate() {
            let mut c = coefficients(0, k);
            if form.derivatives != Derivatives::Constant {
                for axis in 0..3 {
                    c += coefficients(rows[axis], k) * u[axis];
                }
            }
            sum += c * polynomial;
        }
        let signal = sum.clamp(Vec2::ZERO, Vec2::ONE);
        signal.x + (signal.y - signal.x) * self.share
    }

    /// AO at a place with unit normal `n`; 1 without regions.
    pub fn ao(&self, p: Vec3, n: Vec3) -> f32 {
        self.find(p).map_or(1.0, |region| self.sample(region, p, n))
    }
}

/// What decides between the boxes of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Key {
    pub(super) distance_squared: f32,
    pub(super) volume: f32,
}

impl Key {
    pub(super) fn of(region: &Region, p: Vec3) -> Key {
        let (min, max) = (Vec3::from(region.min), Vec3::from(region.max));
        let size = max - min;
        Key {
            distance_squared: distance_squared(min, max, p),
            volume: size.x * size.y * size.z,
        }
    }

    pub(super) fn is_before(self, other: Key) -> bool {
        match self.distance_squared == other.distance_squared {
            true => self.volume < other.volume,
            false => self.distance_squared < other.distance_squared,
        }
    }
}

/// Squared distance of a place from a box; 0 within.
pub(super) fn distance_squared(min: Vec3, max: Vec3, p: Vec3) -> f32 {
    let away = p - p.max(min).min(max);
    away.x * away.x + away.y * away.y + away.z * away.z
}

/// How far a place is from the centre, in half extents, along each axis; 0 along one without extent.
fn offsets(region: &Region, p: Vec3) -> Vec3 {
    let (min, max) = (Vec3::from(region.min), Vec3::from(region.max));
    let half = (max - min) * 0.5;
    let away = p.max(min).min(max) - Vec3::from(region.centre);
    Vec3::select(half.cmpgt(Vec3::ZERO), away / half, Vec3::ZERO)
}

/// The nine polynomials of a unit normal, of degree 0, 1 and 2.
pub fn polynomials(n: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = n;
    [
        1.0,
        y,
        z,
        x,
        x * y,
        y * z,
        3.0 * z * z - 1.0,
        x * z,
        x * x - y * y,
    ]
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
