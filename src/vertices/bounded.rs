//! Least squares with bounds: the minimum of `1/2 x^T A x - b^T x` over `0 <= x <= 1`.
//!
//! Clamping the free minimum leaves a scar: a vertex next to one that wanted 1.2 was pulled down to
//! make up for it. The bounded minimum has none; at each variable either the gradient is zero or the
//! variable is at a bound that the gradient pushes against.
//!
//! Each step is a truncated Newton step (after Gräser and Kornhuber 2009, *Multigrid Methods for
//! Obstacle Problems*). Sweeps of projected Gauss-Seidel tell which variables belong at a bound; the
//! others are solved for exactly with those held; what leaves the bounds is cut off, and the energy is
//! minimised along the way there. No part ever raises the energy and the sweeps alone converge, so
//! that the sets of variables cannot cycle, as those of plain active set methods did in rooms full
//! of furniture. A few steps are enough: once the sets are right a step is exact.

use super::cholesky::Factor;
use super::dissect::Tree;
use super::sparse::Symmetric;

/// Most steps.
const MAX_STEPS: usize = 60;

/// Sweeps before each Newton step.
const SWEEPS: usize = 3;

/// The minimum counts as found when no variable moves further in a sweep.
const SMALL_CHANGE: f64 = 1e-9;

/// The minimum and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounded {
    /// In 0..=1.
    pub x: Vec<f64>,
    /// Variables at a bound.
    pub at_bounds: usize,
    /// How far a variable moved in the last sweep: about 1e-9 or less, unless the steps were used up.
    pub change: f64,
    pub steps: usize,
}

impl Bounded {
    /// This is the minimum, up to rounding.
    pub fn is_exact(&self) -> bool {
        self.change <= SMALL_CHANGE
    }
}

/// Solves for one right-hand side. `factor` is that of the whole matrix, which is positive definite.
pub fn solve(matrix: &Symmetric, tree: &Tree, factor: &Factor, b: &[f64]) -> Bounded {
    let mut x = b.to_vec();
    factor.solve(tree, &mut x);
    let within = |x: &f64| (-SMALL_CHANGE..=1.0 + SMALL_CHANGE).contains(x);
    let mut change = if x.iter().all(within) {
        0.0
    } else {
        f64::INFINITY
    };
    x.iter_mut().for_each(|x| *x = x.clamp(0.0, 1.0));
    let mut steps = 0;
    while change > SMALL_CHANGE && steps < MAX_STEPS {
        steps += 1;
        for _ in 0..SWEEPS {
            change = sweep(matrix, b, &mut x);
        }
        if change > SMALL_CHANGE {
            newton(matrix, tree, b, &mut x);
        }
    }
    Bounded {
        at_bounds: x.iter().filter(|x| is_bound(**x)).count(),
        x,
        change,
        steps,
    }
}

fn is_bound(x: f64) -> bool {
    x <= 0.0 || x >= 1.0
}

/// Each variable in turn goes to its own minimum within the bounds. Returns the greatest move.
fn sweep(matrix: &Symmetric, b: &[f64], x: &mut [f64]) -> f64 {
    let mut change = 0.0f64;
    for i in 0..x.len() {
        let step = (b[i] - matrix.row_times(i, x)) / matrix.diagonal(i);
        let new = (x[i] + step).clamp(0.0, 1.0);
        change = change.max((new - x[i]).abs());
        x[i] = new;
    }
    change
}

/// Goes towards the minimum with the variables that are at a bound held there, as far as the bounds
/// and the energy allow.
fn newton(matrix: &Symmetric, tree: &Tree, b: &[f64], x: &mut [f64]) {
    let is_held: Vec<bool> = x.iter().map(|x| is_bound(*x)).collect();
    let Some(factor) = Factor::new(matrix, tree, &|i| is_held[i]) else {
        return;
    };
    let descent: Vec<f64> = (0..x.len())
        .map(|i| b[i] - matrix.row_times(i, x))
        .collect();
    let mut way: Vec<f64> = (0..x.len())
        .map(|i| if is_held[i] { 0.0 } else { descent[i] })
        .collect();
    factor.solve(tree, &mut way);
    for (way, x) in way.iter_mut().zip(&*x) {
        *way = (x + *way).clamp(0.0, 1.0) - x;
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let curvature: f64 = (0..x.len())
        .map(|i| way[i] * matrix.row_times(i, &way))
        .sum();
    if curvature > 0.0 {
        let share = (dot(&descent, &way) / curvature).clamp(0.0, 1.0);
        for (x, way) in x.iter_mut().zip(&way) {
            *x = (*x + share * way).clamp(0.0, 1.0);
        }
    }
}
