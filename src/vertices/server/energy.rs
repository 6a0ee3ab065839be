//! The error that the values of a mesh minimise (Sloan et al. 2013, Eq. 2; Kavan et al. 2011):
//!
//! ```text
//! E(x) = sum over samples of w_s (f_s - g_x(p_s))^2 + alpha * sum over interior edges of GD^2
//! ```
//!
//! `g_x` interpolates the values over the triangles, w_s is the area that a sample stands for. Half
//! its gradient is `A x - b`.
//!
//! To this comes a slight pull of the corners of a triangle to each other, [`PULL`] times the area of
//! its samples. It decides what the samples and the hinges leave open (a triangle with one sample
//! and no neighbour), makes A positive definite, and biases what they do decide by about as much.

use super::hinge::hinges;
use super::place::Site;
use super::shape::Shape;
use super::sparse::{Builder, Symmetric};

/// Weight of the pull between the corners of a triangle per area of its samples.
pub(super) const PULL: f64 = 1e-6;

/// A valid sample: where it is, and its values by each signal.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    pub site: &'a Site,
    pub values: &'a [f32],
}

/// The system of a mesh.
#[derive(Clone, Debug)]
pub struct Energy {
    pub matrix: Symmetric,
    /// One per signal.
    pub rights: Vec<Vec<f64>>,
    /// Variables of which a triangle has a valid sample. The others have a zero row.
    pub is_sampled: Vec<bool>,
}

impl Energy {
    /// Of `signals` numbers a sample.
    pub fn new<'a>(
        shape: &Shape,
        samples: impl Iterator<Item = Sample<'a>>,
        signals: usize,
        alpha: f64,
    ) -> Energy {
        let size = shape.variables();
        let mut builder = Builder::new(size);
        let mut rights = vec![vec![0.0; size]; signals];
        // One block a triangle: there are more samples than triangles.
        let mut blocks = vec![[[0.0f64; 3]; 3]; shape.triangles.len()];
        let mut areas = vec![0.0f64; shape.triangles.len()];
        for Sample { site, values } in samples {
            let triangle = site.triangle as usize;
            let weights = site.weights();
            for (row, a) in blocks[triangle].iter_mut().zip(weights) {
                for (entry, b) in row.iter_mut().zip(weights) {
                    *entry += site.area * a * b;
                }
            }
            areas[triangle] += site.area;
            for (right, value) in rights.iter_mut().zip(values) {
                for (variable, weight) in shape.triangles[triangle].into_iter().zip(weights) {
                    right[variable as usize] += site.area * weight * f64::from(*value);
                }
            }
        }
        let mut is_sampled = vec![false; size];
        let sampled = shape.triangles.iter().zip(&mut blocks).zip(&areas);
        for ((triangle, block), area) in sampled.filter(|(_, area)| **area > 0.0) {
            triangle.iter().for_each(|v| is_sampled[*v as usize] = true);
            for (i, row) in block.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += PULL * area * if i == j { 2.0 } else { -1.0 };
                }
            }
            builder.add_block(*triangle, *block);
        }
        for hinge in hinges(shape) {
            let known = |v: &u32| is_sampled[*v as usize];
            if hinge.weight > 0.0 && alpha > 0.0 && hinge.variables.iter().all(known) {
                builder.add_square(hinge.variables, hinge.coefficients, alpha * hinge.weight);
            }
        }
        Energy {
            matrix: builder.build(size),
            rights,
            is_sampled,
        }
    }
}
