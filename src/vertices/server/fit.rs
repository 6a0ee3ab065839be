//! Values of all vertices of a mesh from samples on its faces.

use super::bounded;
use super::cholesky::Factor;
use super::dissect::Tree;
use super::energy::{Energy, Sample};
use super::fill::{Filled, fill};
use super::shape::Shape;
use super::sparse::Symmetric;
use glam::DVec3;
use rayon::prelude::*;

/// Numbers of a factor (8 bytes each) beyond which a part is not solved: 4 GiB. A surface of a
/// million vertices takes a tenth to a half of that; triangles that connect vertices at random may take any amount.
const MAX_FACTOR: usize = 1 << 29;

/// Values and how they were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fit {
    /// In 0..=1: per signal, per variable of the shape.
    pub values: Vec<Vec<f64>>,
    pub report: FitReport,
}

/// What [`fit`] met, in numbers of variables unless it says otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FitReport {
    /// Connected parts with samples.
    pub parts: usize,
    /// At 0 or 1, summed over the signals.
    pub at_bounds: usize,
    /// Parts whose bounded minimum was not reached in the steps allowed ([`bounded`]), summed over the
    /// signals.
    pub inexact: usize,
    /// Parts that were too entangled to solve and have the mean of the samples about each vertex.
    pub averaged: usize,
    /// Without a sample.
    pub filled: Filled,
}

/// Fits `signals` functions to samples. `default` is what parts without a valid sample take.
pub fn fit<'a>(
    shape: &Shape,
    samples: impl Iterator<Item = Sample<'a>>,
    signals: usize,
    alpha: f64,
    default: &[f64],
) -> Fit {
    let energy = Energy::new(shape, samples, signals, alpha);
    let Energy {
        matrix,
        rights,
        is_sampled,
    } = &energy;
    let mut parts = matrix.components();
    parts.retain(|part| is_sampled[part[0] as usize]);
    let mut place = vec![0; matrix.size()];
    for part in &parts {
        for (i, &variable) in part.iter().enumerate() {
            place[variable as usize] = i as u32;
        }
    }
    let solved: Vec<Part> = parts
        .par_iter()
        .map(|part| {
            let matrix = matrix.restrict(part, &place);
            let positions: Vec<DVec3> = part.iter().map(|&i| shape.positions[i as usize]).collect();
            let rights = rights
                .iter()
                .map(|right| part.iter().map(|&i| right[i as usize]).collect());
            solve_part(&matrix, &positions, rights.collect())
        })
        .collect();
    let mut fit = Fit {
        values: vec![vec![0.0; matrix.size()]; signals],
        report: FitReport {
            parts: parts.len(),
            ..FitReport::default()
        },
    };
    for (part, solved) in parts.iter().zip(solved) {
        for (all, own) in fit.values.iter_mut().zip(&solved.values) {
            for (&variable, value) in part.iter().zip(own) {
                all[variable as usize] = *value;
            }
        }
        fit.report.at_bounds += solved.at_bounds;
        fit.report.inexact += solved.inexact;
        fit.report.averaged += usize::from(solved.is_averaged);
    }
    fit.report.filled = fill(shape, &mut fit.values, is_sampled, default);
    fit
}

#[derive(Default)]
struct Part {
    values: Vec<Vec<f64>>,
    at_bounds: usize,
    inexact: usize,
    is_averaged: bool,
}

fn solve_part(matrix: &Symmetric, positions: &[DVec3], rights: Vec<Vec<f64>>) -> Part {
    let tree = Tree::new(matrix, positions);
    let factor = (tree.factor_len() <= MAX_FACTOR)
        .then(|| Factor::new(matrix, &tree, &|_| false))
        .flatten();
    let mut part = Part::default();
    for right in rights {
        let values = match &factor {
            Some(factor) => {
                let bounded = bounded::solve(matrix, &tree, factor, &right);
                part.at_bounds += bounded.at_bounds;
                part.inexact += usize::from(!bounded.is_exact());
                bounded.x
            }
            None => {
                part.is_averaged = true;
                average(matrix, &right)
            }
        };
        part.values.push(values);
    }
    part
}

/// The mean of the samples about each vertex. Rows of hinges and pulls add up to zero, those of the
/// samples to their weight, and the right-hand side to weight times value.
fn average(matrix: &Symmetric, right: &[f64]) -> Vec<f64> {
    let ones = vec![1.0; right.len()];
    let mean = |(i, right): (usize, &f64)| (right / matrix.row_times(i, &ones)).clamp(0.0, 1.0);
    right.iter().enumerate().map(mean).collect()
}
