//! From samples of radiance to an expansion in spherical harmonics.
//!
//! The directions of a frame are one even spread (a spherical Fibonacci lattice), turned at random
//! for every probe and frame. The expansion is the least-squares fit to the samples: light that the
//! expansion can hold comes back exactly from any spread, so that a uniform room has no noise at
//! all, and what it cannot hold, averaged over turns, goes nowhere: a linear map that commutes with
//! all rotations keeps the degrees apart (Schur's lemma). The plain sum `4 pi / n sum Y L` is
//! unbiased, too, but mixes the degrees in every frame.

use crate::probes::sh::{self, MAX_COUNT};
use glam::{DVec3, Mat3, Quat, Vec3};
use std::f64::consts::PI;

/// Samples a coefficient below which the fit is too loose and the plain sum is taken.
const LEAST: usize = 4;

/// An expansion and how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// `(degree + 1)²` coefficients.
    pub radiance: Vec<Vec3>,
    /// Variance, summed over coefficients and channels, as far as the samples of one frame tell: too
    /// high rather than too low, for an even spread errs less than a random one.
    pub noise: f32,
}

/// A rotation that is any with the same chance, from three numbers in 0..1 (Shoemake 1992, *Uniform
/// Random Rotations*).
pub fn rotation([a, b, c]: [f32; 3]) -> Mat3 {
    let (s1, c1) = (std::f32::consts::TAU * b).sin_cos();
    let (s2, c2) = (std::f32::consts::TAU * c).sin_cos();
    let (r1, r2) = ((1.0 - a).sqrt(), a.sqrt());
    Mat3::from_quat(Quat::from_xyzw(r1 * s1, r1 * c1, r2 * s2, r2 * c2).normalize())
}

/// The expansion of degree `degree` that fits samples best.
pub fn fit(degree: usize, directions: &[Vec3], samples: &[Vec3]) -> Estimate {
    let n = sh::count(degree);
    let weight = 4.0 * PI / samples.len().max(1) as f64;
    let mut gram = [[0.0f64; MAX_COUNT]; MAX_COUNT];
    let mut sums = [DVec3::ZERO; MAX_COUNT];
    for (d, value) in directions.iter().zip(samples) {
        let y = sh::basis(*d).map(f64::from);
        for i in 0..n {
            for (g, y_k) in gram[i][..=i].iter_mut().zip(&y) {
                *g += weight * y[i] * y_k;
            }
            sums[i] += weight * y[i] * value.as_dvec3();
        }
    }
    if samples.len() >= LEAST * n {
        solve(&mut gram, &mut sums, n);
    }
    let radiance: Vec<Vec3> = sums[..n].iter().map(|s| s.as_vec3()).collect();
    let residual: f64 = directions
        .iter()
        .zip(samples)
        .map(|(d, value)| f64::from((sh::evaluate(&radiance, *d) - *value).length_squared()))
        .sum();
    let freedom = samples.len().saturating_sub(n).max(1) as f64;
    let noise = n as f64 * weight * residual / freedom;
    Estimate {
        radiance,
        noise: noise as f32,
    }
}

/// Solves `gram x = sums` in place by Cholesky's decomposition. `gram` holds the lower triangle. Where
/// it is not positive definite, `sums` stays.
fn solve(gram: &mut [[f64; MAX_COUNT]; MAX_COUNT], sums: &mut [DVec3; MAX_COUNT], n: usize) {
    for i in 0..n {
        for k in 0..=i {
            let dot: f64 = (0..k).map(|j| gram[i][j] * gram[k][j]).sum();
            let rest = gram[i][k] - dot;
            if i != k {
                gram[i][k] = rest / gram[k][k];
            } else if rest > 1e-9 {
                gram[i][i] = rest.sqrt();
            } else {
                return;
            }
        }
    }
    for i in 0..n {
        let dot: DVec3 = (0..i).map(|j| gram[i][j] * sums[j]).sum();
        sums[i] = (sums[i] - dot) / gram[i][i];
    }
    for i in (0..n).rev() {
        let dot: DVec3 = (i + 1..n).map(|j| gram[j][i] * sums[j]).sum();
        sums[i] = (sums[i] - dot) / gram[i][i];
    }
}
