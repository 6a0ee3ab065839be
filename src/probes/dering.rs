//! Takes the ringing out of an expansion where it makes light negative, and only there.
//!
//! An expansion of degree 2 that is cut from a bright small emitter swings below zero on the far
//! side. All of it but its mean is scaled by the largest share that lifts the least value to zero, for
//! each probe by itself. Windows that damp degree 2 more than degree 1 (Sloan 2017, *Deringing
//! Spherical Harmonics*) look smoother, but err more: `dapple stability --case ringing` has both. The
//! paper uses no window since one for all costs detail everywhere; most probes need none and keep
//! every bit.
//!
//! The minimum is found for certain. On the sphere an expansion of degree 2 is
//! `c + b.d + d.A d`, A symmetric; its minimum over unit d is a trust-region problem, which has no
//! duality gap: in the eigenvectors of A it is the maximum over `mu <= smallest eigenvalue` of
//! `c + mu - sum b_i^2 / (4 (e_i - mu))`, a concave function of one variable. Any mu gives a lower
//! bound, so that what the search leaves over errs to the safe side. With A = 0 this is `c - |b|`.

use super::sh::{COSINE, L2, Y0};
use glam::{DMat3, DVec3};

/// What must not be negative.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// Irradiance on any normal: what diffuse shading looks up. Costs less detail, for the cosine
    /// damps degree 2 already.
    #[default]
    Irradiance,
    /// Radiance from any direction: with it every lobe's reflection is non-negative, too.
    Radiance,
}

impl Keep {
    /// The factors that take an expansion of radiance to the quantity.
    fn factors(self) -> [f64; 3] {
        match self {
            Keep::Irradiance => std::array::from_fn(|l| f64::from(COSINE[l])),
            Keep::Radiance => [1.0; 3],
        }
    }
}

/// Halvings of the search for mu: the bound is flat at its maximum, where its error is the square of
/// what is left.
const DUAL_STEPS: usize = 26;
/// How far above zero the least value is put, relative to the mean: rounding of the result to
/// f32 stays below.
const MARGIN: f64 = 1e-6;

/// The least value of one channel's expansion over all directions, in its unit.
pub fn minimum(c: &[f32; 9]) -> f32 {
    least(c, [1.0; 3]) as f32
}

/// Scales degrees 1 and 2 of `radiance` if the quantity to keep is negative anywhere, all channels alike
/// so that hue stays; returns the share that is left of them. Where it is not, nothing is touched and
/// the share is 1. A channel whose mean is not positive holds no light and becomes 0.
pub fn dering(radiance: &mut L2, keep: Keep) -> f32 {
    let factors = keep.factors();
    let mut share: f64 = 1.0;
    for k in 0..3 {
        let channel: [f32; 9] = std::array::from_fn(|i| radiance[i][k]);
        if bound(&channel, factors) > 0.0 {
            continue;
        }
        let least = least(&channel, factors);
        if least >= 0.0 {
            continue;
        }
        if channel[0] <= 0.0 {
            radiance.iter_mut().for_each(|c| c[k] = 0.0);
            continue;
        }
        // The least value is linear in the share: mean + share (least - mean).
        let mean = factors[0] * f64::from(Y0) * f64::from(channel[0]);
        share = share.min((1.0 - MARGIN) * mean / (mean - least));
    }
    let share = share as f32;
    if share < 1.0 {
        radiance[1..].iter_mut().for_each(|c| *c *= share);
    }
    share
}

/// A quick lower bound of [`least`], which settles most probes: no degree falls below
/// minus the length of its coefficients times the root of `(2 l + 1) / 4 pi` (Unsoeld's theorem).
fn bound(c: &[f32; 9], factors: [f64; 3]) -> f64 {
    let length = |c: &[f32]| c.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt();
    factors[0] * 0.282_094_79 * f64::from(c[0])
        - factors[1] * 0.488_602_52 * length(&c[1..4])
        - factors[2] * 0.630_783_14 * length(&c[4..])
}

/// The least value of an expansion whose degrees are multiplied by `factors`.
fn least(c: &[f32; 9], factors: [f64; 3]) -> f64 {
    let c: [f64; 9] = std::array::from_fn(|i| f64::from(c[i]) * factors[super::sh::degree_of(i)]);
    if c.iter().any(|c| !c.is_finite()) {
        return f64::NEG_INFINITY;
    }
    let constant = 0.282_094_791_773_878_14 * c[0];
    let linear = DVec3::new(c[3], c[1], c[2]) * 0.488_602_511_902_919_9;
    let (off, axis) = (0.546_274_215_296_039_5, 0.315_391_565_252_520_05);
    let (xx, yy) = (off * c[8] - axis * c[6], -off * c[8] - axis * c[6]);
    let (xy, yz, xz) = (off * c[4], off * c[5], off * c[7]);
    let quadratic = DMat3::from_cols(
        DVec3::new(xx, xy, xz),
        DVec3::new(xy, yy, yz),
        DVec3::new(xz, yz, 2.0 * axis * c[6]),
    );
    constant + lowest_on_sphere(quadratic, linear)
}

/// The minimum of `d.A d + b.d` over unit vectors d.
fn lowest_on_sphere(a: DMat3, b: DVec3) -> f64 {
    let (values, vectors) = eigen(a);
    let b2: [f64; 3] = std::array::from_fn(|i| vectors.col(i).dot(b).powi(2));
    let smallest = values.iter().fold(f64::INFINITY, |m, v| m.min(*v));
    let part = |numerator: f64, denominator: f64| {
        if numerator == 0.0 {
            0.0
        } else {
            numerator / denominator
        }
    };
    // Distances below the smallest eigenvalue: mu = smallest - t, t >= 0. At t = |b| / 2 the sum
    // of the derivative's terms is at most 1, so that the maximum lies in between.
    let dual = |t: f64| {
        let taken: f64 = (0..3)
            .map(|i| part(b2[i], 4.0 * (values[i] - smallest + t)))
            .sum();
        smallest - t - taken
    };
    let rises = |t: f64| {
        let sum: f64 = (0..3)
            .map(|i| part(b2[i], 4.0 * (values[i] - smallest + t).powi(2)))
            .sum();
        sum > 1.0
    };
    let (mut low, mut high) = (0.0, 0.5 * b.length());
    for _ in 0..DUAL_STEPS {
        let middle = 0.5 * (low + high);
        if rises(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    dual(high)
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by Jacobi's rotations.
fn eigen(mut a: DMat3) -> ([f64; 3], DMat3) {
    let mut vectors = DMat3::IDENTITY;
    for _ in 0..6 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a.col(q)[p];
            if off == 0.0 {
                continue;
            }
            let theta = (a.col(q)[q] - a.col(p)[p]) / (2.0 * off);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cos = 1.0 / (t * t + 1.0).sqrt();
            let sin = t * cos;
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = cos;
            turn.col_mut(q)[q] = cos;
            turn.col_mut(p)[q] = -sin;
            turn.col_mut(q)[p] = sin;
            a = turn.transpose() * a * turn;
            vectors *= turn;
        }
    }
    ([a.x_axis.x, a.y_axis.y, a.z_axis.z], vectors)
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::probes::sh::{evaluate_l2, irradiance, project};
    use crate::rng::Rng;
    use glam::Vec3;

    fn directions() -> impl Iterator<Item = Vec3> {
        let n = 20_000;
        (0..n).map(move |i| {
            let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
            let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        })
    }

    fn random(rng: &mut Rng, size: f32) -> [f32; 9] {
        std::array::from_fn(|i| {
            if i == 0 {
                3.0
            } else {
                (rng.unit() - 0.5) * size
            }
        })
    }

    fn grey(c: &[f32; 9]) -> L2 {
        std::array::from_fn(|i| Vec3::splat(c[i]))
    }

    /// A delta of radiance from one direction over a uniform field.
    fn emitter(direction: Vec3, power: Vec3) -> L2 {
        let mut c = [Vec3::ZERO; 9];
        project(&mut c, direction.normalize(), power, 1.0);
        c[0] += Vec3::splat(0.05);
        c
    }

    #[test]
    fn the_minimum_is_the_lowest_value_found() {
        let mut rng = Rng::new(7);
        for k in 0..200 {
            let mut c = random(&mut rng, 4.0);
            if k % 5 == 0 {
                c[1..4].fill(0.0);
            }
            if k % 7 == 0 {
                c[4..].fill(0.0);
            }
            if k % 11 == 0 {
                // A linear part along an eigenvector that is not the lowest one's: the hard case.
                c = [3.0, 0.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
            }
            let g = grey(&c);
            let found = directions()
                .map(|d| evaluate_l2(&g, d).x)
                .fold(f32::INFINITY, f32::min);
            let got = minimum(&c);
            // 20,000 directions are 0.014 apart at most; a field of this size curves by 20.
            assert!(
                got <= found + 1e-5 && got > found - 2e-3,
                "{k}: {got} {found}"
            );
            assert!(bound(&c, [1.0; 3]) <= f64::from(got) + 1e-6);
        }
    }

    #[test]
    fn the_minimum_of_degree_1_is_closed() {
        let c = [2.0, 0.3, -0.4, 1.2, 0.0, 0.0, 0.0, 0.0, 0.0];
        let expected = Y0 * 2.0 - 0.488_602_5 * 1.3;
        assert!((minimum(&c) - expected).abs() < 1e-6);
    }

    #[test]
    fn what_is_not_negative_keeps_every_bit() {
        let mut rng = Rng::new(1);
        let mut kept = 0;
        for _ in 0..2000 {
            let c = random(&mut rng, 1.5);
            let mut g = grey(&c);
            let before = g;
            let negative = minimum(&c) < 0.0;
            let share = dering(&mut g, Keep::Radiance);
            assert_eq!(share < 1.0, negative);
            assert_eq!(g != before, negative);
            kept += usize::from(!negative);
        }
        assert!((200..1800).contains(&kept), "{kept} tell nothing");
    }

    #[test]
    fn nothing_is_negative_afterwards_and_no_more_is_taken_than_needed() {
        for (k, keep) in [Keep::Irradiance, Keep::Radiance].into_iter().enumerate() {
            let mut c = emitter(Vec3::new(1.0, 2.0, -0.5), Vec3::new(5.0, 0.5, 0.01));
            let before = c;
            let value = |c: &L2, d: Vec3| match keep {
                Keep::Irradiance => irradiance(c, d),
                Keep::Radiance => evaluate_l2(c, d),
            };
            let lowest = |c: &L2| {
                directions()
                    .map(|d| value(c, d).min_element())
                    .fold(f32::INFINITY, f32::min)
            };
            assert!(lowest(&c) < -0.01, "{k}");
            let share = dering(&mut c, keep);
            let after = lowest(&c);
            assert!((-1e-6..2e-3).contains(&after), "{keep:?}: {after}");
            assert_eq!(c[0], before[0], "the mean stays");
            // A hundredth more leaves it negative.
            let mut more = before.map(|c| c * (1.01 * share));
            more[0] = before[0];
            assert!(lowest(&more) < 0.0, "{keep:?}");
        }
    }

    #[test]
    fn irradiance_costs_less_than_radiance() {
        let c = emitter(Vec3::Y, Vec3::ONE);
        let share = |keep| dering(&mut c.clone(), keep);
        assert!(share(Keep::Irradiance) > 1.5 * share(Keep::Radiance));
    }

    #[test]
    fn no_light_stays_none() {
        let mut c = [Vec3::ZERO; 9];
        assert_eq!(dering(&mut c, Keep::Radiance), 1.0);
        // A channel that holds negative light alone is emptied, the others stay.
        c[0] = Vec3::new(1.0, -1.0, 0.0);
        c[3] = Vec3::new(0.1, 0.1, 0.0);
        assert_eq!(dering(&mut c, Keep::Radiance), 1.0);
        assert_eq!(
            (c[0], c[3]),
            (Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.1, 0.0, 0.0))
        );
    }
}
