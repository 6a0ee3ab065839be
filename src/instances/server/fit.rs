//! The global function of an instance from its samples (Eq. 3), by each rung of the ladder.
//!
//! ```text
//! minimise over y   sum_i w_i (f_i - G_y(u_i) L_i)^2,   G_y(u) = y0 + y1 u_x + y2 u_y + y3 u_z
//! ```
//!
//! f is obscurance in the scene, L local obscurance, w_i the area that a sample stands for, and u the place in
//! the box of the mesh, -1 to 1 on each axis. Written about the mean place m of the samples (by w L^2),
//! `G(u) = s + g . (u - m)`, s and g separate: s is the best scalar, and the slope g solves three equations of
//! its own. So the ladder costs one pass, and what regularises the slope pulls the linear function towards the
//! scalar and not towards zero:
//!
//! - [`PULL_SCALAR`] draws s to 1, which counts only where local obscurance is near zero everywhere.
//! - [`PULL_SLOPE`] draws g to 0. Where the samples lie in a plane, on a line or in a point, the slope across them
//!   is exactly 0.

use glam::{DMat3, DVec3};

/// Weight of the pull of the scalar to 1, as a share of the area of the samples.
const PULL_SCALAR: f64 = 1e-4;

/// Weight of the pull of the slope to 0, as a share of `sum w L^2`. Samples spread evenly over the box have a variance
/// of 1/3 on each axis: their slope loses 0.3 %.
const PULL_SLOPE: f64 = 1e-3;

/// Variance of the samples' places (by w L^2), on an axis of their own, below which a slope along it counts as given up:
/// a tenth of the half extent.
const THIN: f64 = 1e-2;

/// Largest coefficient: what the format holds.
pub const MAX_COEFFICIENT: f64 = 8.0;

/// `c[0] + c[1] u_x + c[2] u_y + c[3] u_z`.
pub type Linear = [f64; 4];

/// The function that changes nothing.
pub const ONE: Linear = [1.0, 0.0, 0.0, 0.0];

/// The value of a global function, at least 0.
pub fn evaluate(c: &Linear, u: DVec3) -> f64 {
    (c[0] + c[1] * u.x + c[2] * u.y + c[3] * u.z).max(0.0)
}

/// What a client shows: `clamp(G(u) * L, 0, 1)`.
pub fn shown(c: &Linear, u: DVec3, local: f64) -> f64 {
    (evaluate(c, u) * local).clamp(0.0, 1.0)
}

/// One signal at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Place in the box of the mesh, -1 to 1 on each axis.
    pub at: DVec3,
    /// Area that it stands for.
    pub weight: f64,
    /// Local obscurance.
    pub local: f64,
    /// Obscurance in the scene.
    pub gold: f64,
    pub held_out: bool,
}

/// A function and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    pub global: Linear,
    /// Root mean square error of what is shown, by weight, over the held-out samples; over all of them where none
    /// is held out; 0 without samples.
    pub error: f64,
}

/// All rungs of one signal of an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Local obscurance as it is.
    pub none: Rung,
    pub scalar: Rung,
    pub linear: Rung,
    /// Axes along which the samples spread, 0 to 3. Below 3 the linear function is constant along the others.
    pub spread: u32,
}

/// Fits one signal. Without samples all rungs are 1.
pub fn fit(samples: &[Sample]) -> Fit {
    let any_fitted = samples.iter().any(|s| !s.held_out && s.weight > 0.0);
    let any_held_out = samples.iter().any(|s| s.held_out && s.weight > 0.0);
    let fitted = samples.iter().filter(|s| !s.held_out || !any_fitted);
    let (scalar, linear, spread) = solve(fitted);
    let rung = |global: Linear| Rung {
        global,
        error: error(
            samples.iter().filter(|s| s.held_out || !any_held_out),
            |s| shown(&global, s.at, s.local),
        ),
    };
    Fit {
        none: rung(ONE),
        scalar: rung(scalar),
        linear: rung(linear),
        spread,
    }
}

/// Root mean square error of a function of samples, by weight; 0 without samples.
pub fn error<'a>(samples: impl Iterator<Item = &'a Sample>, value: impl Fn(&Sample) -> f64) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for sample in samples {
        sum += sample.weight * (value(sample) - sample.gold).powi(2);
        weight += sample.weight;
    }
    if weight > 0.0 {
        (sum / weight).sqrt()
    } else {
        0.0
    }
}

/// The best scalar, the best linear function, and the axes along which the samples spread.
fn solve<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> (Linear, Linear, u32) {
    let (mut area, mut mass, mut product, mut moment) = (0.0, 0.0, 0.0, DVec3::ZERO);
    for s in samples.clone() {
        let weight = s.weight * s.local * s.local;
        area += s.weight;
        mass += weight;
        product += s.weight * s.local * s.gold;
        moment += weight * s.at;
    }
    let pull = PULL_SCALAR * area;
    if mass + pull <= 0.0 {
        return (ONE, ONE, 0);
    }
    let s = ((product + pull) / (mass + pull)).min(MAX_COEFFICIENT);
    let scalar = [s, 0.0, 0.0, 0.0];
    if mass <= 0.0 {
        return (scalar, scalar, 0);
    }
    let mean = moment / mass;
    let (mut spread, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for sample in samples {
        let from_mean = sample.at - mean;
        let weighted = sample.weight * sample.local * from_mean;
        let outer = DMat3::from_cols(
            from_mean * weighted.x,
            from_mean * weighted.y,
            from_mean * weighted.z,
        );
        spread += outer * sample.local;
        right += weighted * (sample.gold - s * sample.local);
    }
    // Near-zero local values say little of a slope, as of the scalar.
    let ridge = PULL_SLOPE * mass + pull;
    let slope = (spread + DMat3::from_diagonal(DVec3::splat(ridge))).inverse() * right;
    let c0 = s - slope.dot(mean);
    let largest = slope.abs().max_element();
    let fits = c0.abs() <= MAX_COEFFICIENT && largest <= MAX_COEFFICIENT;
    let linear = match fits {
        true => [c0, slope.x, slope.y, slope.z],
        false => scalar,
    };
    (scalar, linear, rank(spread * (1.0 / mass)))
}

/// Eigenvalues of a symmetric positive semidefinite matrix that are above [`THIN`], by its minors: the matrix less
/// THIN has as many negative eigenvalues as its leading minors, 1 before them, change sign.
fn rank(covariance: DMat3) -> u32 {
    let m = covariance - DMat3::from_diagonal(DVec3::splat(THIN));
    let minor2 = m.x_axis.x * m.y_axis.y - m.x_axis.y * m.y_axis.x;
    let minors = [1.0, m.x_axis.x, minor2, m.determinant()];
    let is_negative = |pair: &[f64]| (pair[0] < 0.0) != (pair[1] < 0.0);
    3 - minors.windows(2).filter(|pair| is_negative(pair)).count() as u32
}
