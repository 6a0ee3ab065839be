//! The model of one region from its samples.
//!
//! For a fixed centre the terms of Eq. 4 are linear: one factorisation serves all channels. As the
//! paper does, the centre of mass of the valid samples and the centre of the box are tried; a search
//! about the better one may follow.

use super::basis::{COUNT, SQUARE};
use super::dense::{self, MAX, Matrix};
use super::model::{Derivatives, Model};
use super::samples::{Channels, MAX_SIGNALS, RegionSamples, Sample};
use super::stored::LARGEST;
use crate::trace::Aabb;
use glam::Vec3;

/// What is added to the diagonal, as a share of 1: directions that the samples do not determine get no
/// derivative.
const RIDGE: f64 = 1e-9;
/// Samples that a parameter of a channel needs.
const PER_TERM: usize = 2;
/// Steps of the search for a centre, in half extents: from the first, halved down to the last.
const STEPS: [f32; 2] = [0.25, 0.03];

/// How the valid samples of a region lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// In space, on both sides of a centre along each axis: all forms can be fitted.
    Space,
    /// In space, but on one side only, or too few for Eq. 4.
    OneSided,
    /// In a plane: no derivative across it.
    Plane,
    /// On a line, or too few for a gradient in space.
    Line,
    /// In one place, or too few or too close for any derivative.
    Point,
    /// There are none.
    Empty,
}

impl Layout {
    /// The richest derivatives that can be fitted.
    pub fn richest(self) -> Derivatives {
        match self {
            Layout::Space => Derivatives::Sided,
            Layout::OneSided | Layout::Plane | Layout::Line => Derivatives::Gradient,
            Layout::Point | Layout::Empty => Derivatives::None,
        }
    }
}

/// Which centres of Eq. 4 are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centres {
    Box,
    Mass,
    /// The better of the two, as in the paper.
    Both,
    /// The best that a search finds from the better of the two. It lowers the error by a few per cent, but
    /// nearly every region then stores a centre, 12 bytes.
    Search,
}

/// A model with its mean squared error over the samples, summed over signals and averaged over normals.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    pub model: Model,
    pub residual: f64,
}

impl Fitted {
    /// Whether the format holds its coefficients. Samples in a thin layer of a box may have a steeper
    /// slope.
    fn is_storable(&self) -> bool {
        let mut terms = self.model.terms.iter().flatten();
        terms.all(|term| term.abs() <= LARGEST)
    }
}

/// Fits the derivatives that the samples allow, from none to the richest.
pub fn fit(bounds: Aabb, samples: &RegionSamples, centres: Centres) -> (Layout, Vec<Fitted>) {
    let middle = Model::middle(&bounds);
    let constant = Normal::new(&bounds, middle, Derivatives::None, &samples.samples);
    if samples.samples.is_empty() {
        // Open: nothing is known.
        let mut open = [0.0; MAX_SIGNALS * COUNT];
        (0..MAX_SIGNALS).for_each(|signal| open[signal * COUNT] = 1.0);
        let model = Model {
            bounds,
            centre: middle,
            derivatives: Derivatives::None,
            terms: vec![open],
        };
        let residual = 0.0;
        return (Layout::Empty, vec![Fitted { model, residual }]);
    }
    let mut fitted = vec![constant.solve()];
    let gradient = Normal::new(&bounds, middle, Derivatives::Gradient, &samples.samples);
    let count = samples.samples.len();
    let enough = |derivatives: Derivatives| count >= PER_TERM * derivatives.terms();
    let layout = match gradient.rank() {
        4 if enough(Derivatives::Gradient) => Layout::OneSided,
        3 if enough(Derivatives::Gradient) => Layout::Plane,
        2.. if enough(Derivatives::None) && count >= 2 * PER_TERM => Layout::Line,
        _ => return (Layout::Point, fitted),
    };
    let gradient = gradient.solve();
    if !gradient.is_storable() {
        return (Layout::Point, fitted);
    }
    fitted.push(gradient);
    if layout != Layout::OneSided || !enough(Derivatives::Sided) {
        return (layout, fitted);
    }
    let at = |centre: Vec3| {
        let normal = Normal::new(&bounds, centre, Derivatives::Sided, &samples.samples);
        let determined = normal.rank() == Derivatives::Sided.terms();
        determined
            .then(|| normal.solve())
            .filter(Fitted::is_storable)
    };
    let better = |best: Option<Fitted>, next: Option<Fitted>| match (best, next) {
        (Some(best), Some(next)) if next.residual >= best.residual => Some(best),
        (best, next) => next.or(best),
    };
    let mass = samples.centre_of_mass().clamp(bounds.min, bounds.max);
    let best = match centres {
        Centres::Box => at(middle),
        Centres::Mass => at(mass),
        Centres::Both | Centres::Search => better(at(mass), at(middle)),
    };
    let Some(mut best) = best else {
        return (layout, fitted);
    };
    if centres == Centres::Search {
        let half = 0.5 * (bounds.max - bounds.min);
        let mut step = STEPS[0];
        while step >= STEPS[1] {
            let from = best.model.centre;
            let before = best.residual;
            for side in 0..6 {
                let mut to = from;
                to[side / 2] += [-step, step][side % 2] * half[side / 2];
                let to = to.clamp(bounds.min, bounds.max);
                if let Some(next) = better(Some(best.clone()), at(to)) {
                    best = next;
                }
            }
            if best.residual >= before {
                step *= 0.5;
            }
        }
    }
    fitted.push(best);
    (Layout::Space, fitted)
}

/// The normal equations of a model.
struct Normal {
    /// Without its terms.
    model: Model,
    matrix: Matrix,
    right: [Channels; MAX],
    /// Mean squares of the channels.
    squares: Channels,
}

impl Normal {
    fn new(bounds: &Aabb, centre: Vec3, derivatives: Derivatives, samples: &[Sample]) -> Normal {
        let model = Model {
            bounds: *bounds,
            centre,
            derivatives,
            terms: Vec::new(),
        };
        let mut right = [[0.0; MAX_SIGNALS * COUNT]; MAX];
        let mut squares = [0.0; MAX_SIGNALS * COUNT];
        let weight = 1.0 / samples.len().max(1) as f64;
        for sample in samples {
            let features = model.features(sample.position);
            for (right, feature) in right.iter_mut().zip(features) {
                for (right, value) in right.iter_mut().zip(sample.channels) {
                    *right += weight * feature * value;
                }
            }
            for (square, value) in squares.iter_mut().zip(sample.channels) {
                *square += weight * value * value;
            }
        }
        let matrix = gram(&model, samples);
        Normal {
            model,
            matrix,
            right,
            squares,
        }
    }

    fn rank(&self) -> usize {
        dense::rank(&self.matrix, self.model.derivatives.terms())
    }

    fn solve(mut self) -> Fitted {
        let n = self.model.derivatives.terms();
        let mut matrix = self.matrix;
        (1..n).for_each(|i| matrix[i][i] += RIDGE);
        let terms = dense::solve(&matrix, n, &self.right);
        let mut residual = 0.0;
        for (channel, square) in self.squares.iter().enumerate() {
            // |y|^2 - x.b, less what the ridge takes of it.
            let explained = |i: usize| {
                let (x, b) = (terms[i][channel], self.right[i][channel]);
                x * b + if i > 0 { RIDGE * x * x } else { 0.0 }
            };
            let fitted: f64 = (0..n).map(explained).sum();
            residual += SQUARE[channel % COUNT] * (square - fitted).max(0.0);
        }
        self.model.terms = terms[..n].to_vec();
        Fitted {
            model: self.model,
            residual,
        }
    }
}

/// Mean products of the features of a model over samples; 0 where there are none.
pub fn gram(model: &Model, samples: &[Sample]) -> Matrix {
    let mut matrix = [[0.0; MAX]; MAX];
    let weight = 1.0 / samples.len().max(1) as f64;
    for sample in samples {
        let features = model.features(sample.position);
        for (row, a) in matrix.iter_mut().zip(features) {
            for (cell, b) in row.iter_mut().zip(features) {
                *cell += weight * a * b;
            }
        }
    }
    matrix
}

/// Mean squared error of a model over samples, as [`Fitted::residual`].
pub fn residual(model: &Model, samples: &[Sample]) -> f64 {
    let sum: f64 = samples
        .iter()
        .map(|sample| {
            let channels = model.channels(sample.position);
            distance(&channels, &sample.channels)
        })
        .sum();
    sum / samples.len().max(1) as f64
}

/// Mean square over the normals of the difference between two functions of the normal, summed over
/// signals.
pub fn distance(a: &Channels, b: &Channels) -> f64 {
    let pairs = a.iter().zip(b).enumerate();
    pairs
        .map(|(i, (a, b))| SQUARE[i % COUNT] * (a - b) * (a - b))
        .sum()
}
