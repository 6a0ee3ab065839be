//! Samples of a region: obscurance as a function of the normal at a lattice of points, and at points of
//! its own to test with.

use super::basis::{self, COUNT};
use super::space::Space;
use crate::obscurance::Obscurance;
use crate::rng::Rng;
use crate::trace::{Aabb, Tracer};
use crate::{Error, Result};
use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// Samples along an axis.
pub const SIDE: usize = 8;
/// Most kernels of a region: the format's signals.
pub const MAX_SIGNALS: usize = 2;
/// Held-out points of a region, and normals at each.
pub const HELD_OUT: usize = 64;
pub const NORMALS: usize = 8;
/// Points that are tried for each held-out one.
const TRIES: usize = 4;

/// Channels of a sample: [`COUNT`] functions of the normal per signal.
pub type Channels = [f64; MAX_SIGNALS * COUNT];

/// Obscurance at a point for any normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    pub position: Vec3,
    /// Coefficients of the polynomials of [`basis`], signal by signal.
    pub channels: Channels,
}

/// Obscurance at a point for some normals.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    pub position: Vec3,
    pub normals: [Vec3; NORMALS],
    /// Per signal.
    pub values: [[f32; NORMALS]; MAX_SIGNALS],
}

/// What was sampled of a region.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionSamples {
    pub bounds: Aabb,
    /// 1 or 2.
    pub signals: usize,
    /// Bit x + 8 y + 64 z: whether the lattice has a valid sample there.
    pub valid: [u64; SIDE],
    /// The valid samples, in order of their bits.
    pub samples: Vec<Sample>,
    pub held_out: Vec<HeldOut>,
}

/// Samples a box: at the middle of each of its 8x8x8 cells, and at random points between.
///
/// Points outside the space are invalid, and so are those inside geometry
/// ([`crate::obscurance::Gather::is_valid`]). The result depends on the scene, the space and the
/// box alone.
///
/// # Errors
/// `Invalid` for more kernels than the format has signals.
pub fn sample(
    obscurance: &Obscurance,
    tracer: &Tracer,
    space: &Space,
    bounds: Aabb,
) -> Result<RegionSamples> {
    let signals = obscurance.kernels().len();
    if signals > MAX_SIGNALS {
        return Err(Error::Invalid(format!(
            "{signals} distances of obscurance; a region has at most {MAX_SIGNALS}"
        )));
    }
    let seed = seed(&bounds);
    let found: Vec<Option<Sample>> = (0..SIDE * SIDE * SIDE)
        .into_par_iter()
        .map(|i| {
            let position = lattice(&bounds, i);
            let visible = space.sees(tracer, position);
            let ray_seed = Rng::new(seed ^ i as u64).draw() as u32;
            visible
                .then(|| expansion(obscurance, position, ray_seed))
                .flatten()
        })
        .collect();
    let mut valid = [0u64; SIDE];
    for (i, sample) in found.iter().enumerate() {
        valid[i / 64] |= u64::from(sample.is_some()) << (i % 64);
    }
    let tested: Vec<Option<HeldOut>> = (0..TRIES * HELD_OUT)
        .into_par_iter()
        .map(|i| {
            // Where most points are valid, the tries after the first are not needed.
            let enough = found.iter().flatten().count() * TRIES >= found.len() * 3;
            if enough && i >= 2 * HELD_OUT {
                return None;
            }
            let mut random = Rng::new(!seed ^ (i as u64) << 32);
            let at = Vec3::new(random.unit(), random.unit(), random.unit());
            let position = bounds.min + at * (bounds.max - bounds.min);
            let visible = space.sees(tracer, position);
            visible
                .then(|| held_out(obscurance, position, &mut random))
                .flatten()
        })
        .collect();
    Ok(RegionSamples {
        bounds,
        signals,
        valid,
        samples: found.into_iter().flatten().collect(),
        held_out: tested.into_iter().flatten().take(HELD_OUT).collect(),
    })
}

impl RegionSamples {
    /// The middle of the valid samples, else of the box.
    pub fn centre_of_mass(&self) -> Vec3 {
        match self.samples.len() {
            0 => self.bounds.centre(),
            count => {
                let sum: glam::DVec3 = self.samples.iter().map(|s| s.position.as_dvec3()).sum();
                (sum / count as f64).as_vec3()
            }
        }
    }
}

/// The middle of a cell of the lattice.
pub fn lattice(bounds: &Aabb, i: usize) -> Vec3 {
    let at = UVec3::new(
        (i % SIDE) as u32,
        (i / SIDE % SIDE) as u32,
        (i / SIDE / SIDE) as u32,
    );
    bounds.min + (at.as_vec3() + 0.5) / SIDE as f32 * (bounds.max - bounds.min)
}

/// Picks the rays of a box by its corners.
fn seed(bounds: &Aabb) -> u64 {
    let corners = bounds
        .min
        .to_array()
        .into_iter()
        .chain(bounds.max.to_array());
    corners.fold(0, |seed, x| Rng::new(seed ^ u64::from(x.to_bits())).draw())
}

/// Obscurance at a point, convolved with the clamped cosine; `None` inside geometry.
fn expansion(obscurance: &Obscurance, position: Vec3, seed: u32) -> Option<Sample> {
    let mut sums = [0.0f64; MAX_SIGNALS * COUNT];
    let mut whole = [0.0f64; COUNT];
    let gather = obscurance.in_volume(position, seed, |direction, visible| {
        let values = basis::values(direction).map(f64::from);
        for (whole, value) in whole.iter_mut().zip(values) {
            *whole += value;
        }
        for (signal, visible) in visible.iter().enumerate() {
            for (sum, value) in sums[signal * COUNT..].iter_mut().zip(values) {
                *sum += f64::from(*visible) * value;
            }
        }
    });
    if !gather.is_valid() {
        return None;
    }
    let rays = f64::from(obscurance.rays());
    let mut channels = [0.0; MAX_SIGNALS * COUNT];
    for signal in 0..obscurance.kernels().len() {
        // The mean is known; what the rays say of the other functions is the rest. So a sample
        // that is equally open on all sides is exact.
        let mean = sums[signal * COUNT] / rays;
        channels[signal * COUNT] = mean;
        for i in 1..COUNT {
            let rest = (sums[signal * COUNT + i] - mean * whole[i]) / rays;
            channels[signal * COUNT + i] = basis::COSINE[i] * rest;
        }
    }
    Some(Sample { position, channels })
}

/// Obscurance at a point for random normals, from rays over the sphere; `None` inside geometry.
fn held_out(obscurance: &Obscurance, position: Vec3, random: &mut Rng) -> Option<HeldOut> {
    let seed = random.draw() as u32;
    let normals: [Vec3; NORMALS] = std::array::from_fn(|_| direction(random));
    let mut sums = [[0.0f64; NORMALS]; MAX_SIGNALS];
    let mut weights = [0.0f64; NORMALS];
    let gather = obscurance.in_volume(position, seed, |direction, visible| {
        for (i, normal) in normals.iter().enumerate() {
            let cosine = f64::from(normal.dot(direction).max(0.0));
            weights[i] += cosine;
            for (sums, visible) in sums.iter_mut().zip(visible) {
                sums[i] += cosine * f64::from(*visible);
            }
        }
    });
    let mean = |sums: [f64; NORMALS]| {
        std::array::from_fn(|i| (sums[i] / weights[i].max(f64::MIN_POSITIVE)) as f32)
    };
    gather.is_valid().then(|| HeldOut {
        position,
        normals,
        values: sums.map(mean),
    })
}

/// A random unit vector.
pub fn direction(random: &mut Rng) -> Vec3 {
    let z = 2.0 * random.unit() - 1.0;
    let (sin, cos) = (std::f32::consts::TAU * random.unit()).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}
