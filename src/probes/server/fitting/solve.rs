//! Least squares with a ridge, by conjugate gradients on the normal equations.

use super::rows::Rows;
use crate::probes::sh::{L2, L2_COUNT};
use glam::{DVec3, Vec3};

/// Most iterations, and the reduction of the residual at which they end.
const ITERATIONS: usize = 64;
const TOLERANCE: f64 = 1e-3;

/// The change d of all probes that minimises
/// `sum_r weights[r] |M_r d - wanted_r|² + ridge |d|²`, the three channels independently. `start` is a
/// guess, such as the last solution.
///
/// Conjugate gradients with the diagonal as preconditioner (Shewchuk 1994, *An Introduction to the
/// Conjugate Gradient Method Without the Agonizing Pain*, B3). All sums have a fixed order: the
/// result does not depend on the number of threads.
pub fn solve(rows: &Rows, weights: &[f32], wanted: &[Vec3], ridge: f32, start: Vec<L2>) -> Vec<L2> {
    let apply = |x: &[L2]| {
        let mut at = rows.look_up(x);
        at.iter_mut().zip(weights).for_each(|(v, w)| *v *= *w);
        let mut sums = rows.spread(&at);
        for (sum, x) in sums.iter_mut().zip(x) {
            for (i, s) in sum.iter_mut().enumerate() {
                *s += x[i] * ridge;
            }
        }
        sums
    };
    let diagonal = rows.diagonal(weights);
    let precondition = |r: &[L2]| -> Vec<L2> {
        let probe = |(r, d): (&L2, &[f32; L2_COUNT])| {
            std::array::from_fn(|i| {
                let d = d[i] + ridge;
                if d > 0.0 { r[i] / d } else { Vec3::ZERO }
            })
        };
        r.iter().zip(&diagonal).map(probe).collect()
    };

    let weighted: Vec<Vec3> = wanted.iter().zip(weights).map(|(v, w)| *v * *w).collect();
    let right = rows.spread(&weighted);
    let target = dot(&right, &precondition(&right)) * (TOLERANCE * TOLERANCE);
    let mut x = start;
    let mut residual = apply(&x);
    for (r, b) in residual.iter_mut().zip(&right) {
        *r = std::array::from_fn(|i| b[i] - r[i]);
    }
    let mut z = precondition(&residual);
    let mut along = z.clone();
    let mut size = dot(&residual, &z);
    for _ in 0..ITERATIONS {
        if size.cmple(target).all() {
            break;
        }
        let image = apply(&along);
        let step = ratio(size, dot(&along, &image));
        add(&mut x, &along, step);
        add(&mut residual, &image, -step);
        z = precondition(&residual);
        let before = size;
        size = dot(&residual, &z);
        let keep = ratio(size, before);
        for (a, z) in along.iter_mut().zip(&z) {
            *a = std::array::from_fn(|i| z[i] + a[i] * keep);
        }
    }
    x
}

/// The scalar product of each channel.
fn dot(a: &[L2], b: &[L2]) -> DVec3 {
    let probe = |(a, b): (&L2, &L2)| -> DVec3 {
        let products = a.iter().zip(b);
        products.map(|(a, b)| a.as_dvec3() * b.as_dvec3()).sum()
    };
    a.iter().zip(b).map(probe).sum()
}

/// `a / b` of each channel; 0 for a channel that is solved.
fn ratio(a: DVec3, b: DVec3) -> Vec3 {
    let channel = |i: usize| {
        if b[i] > 0.0 {
            (a[i] / b[i]) as f32
        } else {
            0.0
        }
    };
    Vec3::from([0, 1, 2].map(channel))
}

fn add(to: &mut [L2], what: &[L2], factor: Vec3) {
    for (t, w) in to.iter_mut().zip(what) {
        for (t, w) in t.iter_mut().zip(w) {
            *t += *w * factor;
        }
    }
}
