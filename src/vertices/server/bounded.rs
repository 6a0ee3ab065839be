//! Least squares with bounds: the minimum of `1/2 x^T A x - b^T x` over `0 <= x <= 1`.
//!
//! Clamping the free minimum leaves a scar: a vertex next to one that wanted 1.2 was pulled down to
//! make up for it. The bounded minimum has none; at each variable either the gradient is zero or the
//! variable is at a bound that the gradient pushes against.
//!
//! A step begins with sweeps of projected Gauss-Seidel, which let variables off their bounds that the
//! energy pulls away. The others are solved for exactly with those at the bounds held; variables that
//! leave the interval are held at its end, too, and the rest is solved for again. The step goes
//! towards that point as far as the energy falls. (A truncated Newton method after Gräser and Kornhuber
//! 2009, *Multigrid Methods for Obstacle Problems*.) Mostly a few steps are enough.
//!
//! Where they are not, because variables are held together that do not belong there together, further
//! steps hold one after the other: each solve is followed to the first bound in its way. Then every
//! step ends at the least point of a face of the bounds, no point has more energy than the
//! last, and no face comes twice.

use super::cholesky::Factor;
use super::dissect::Tree;
use super::sparse::Symmetric;

/// Most steps, and how many of them hold variables together.
const MAX_STEPS: usize = 200;
const QUICK_STEPS: usize = 12;

/// Most rounds in which variables are held, in a step.
const MAX_HOLDS: usize = 100;

/// Sweeps at the start of a step.
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
            match steps <= QUICK_STEPS {
                true => newton(matrix, tree, b, &mut x),
                false => descend_face(matrix, tree, b, &mut x),
            }
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

/// Goes towards the least point of a face of the bounds, as far as the energy falls.
fn newton(matrix: &Symmetric, tree: &Tree, b: &[f64], x: &mut [f64]) {
    let Some(aim) = aim(matrix, tree, b, x) else {
        return;
    };
    let way: Vec<f64> = aim.iter().zip(&*x).map(|(aim, x)| aim - x).collect();
    let (mut descent, mut curvature) = (0.0, 0.0);
    for (i, way_i) in way.iter().enumerate() {
        descent += way_i * (b[i] - matrix.row_times(i, x));
        curvature += way_i * matrix.row_times(i, &way);
    }
    if curvature > 0.0 {
        let share = (descent / curvature).clamp(0.0, 1.0);
        for (x, way) in x.iter_mut().zip(&way) {
            *x = (*x + share * way).clamp(0.0, 1.0);
        }
    }
}

/// The minimum with the variables held that are at a bound, and those that would leave.
fn aim(matrix: &Symmetric, tree: &Tree, b: &[f64], x: &[f64]) -> Option<Vec<f64>> {
    let mut held = at_bounds(x);
    for _ in 0..MAX_HOLDS {
        let mut aim = solve_held(matrix, tree, b, &held)?;
        let mut leaves = false;
        for (aim, held) in aim.iter_mut().zip(&mut held) {
            let inside = aim.clamp(0.0, 1.0);
            if (inside - *aim).abs() > SMALL_CHANGE {
                *held = Some(inside);
                leaves = true;
            }
            *aim = inside;
        }
        if !leaves {
            return Some(aim);
        }
    }
    None
}

/// Goes to the least point of the face that the variables at a bound span, or of the first face of it
/// that is in the way, and so on.
fn descend_face(matrix: &Symmetric, tree: &Tree, b: &[f64], x: &mut [f64]) {
    let mut held = at_bounds(x);
    for _ in 0..MAX_HOLDS {
        let Some(aim) = solve_held(matrix, tree, b, &held) else {
            return;
        };
        let mut first = (1.0, None);
        for (i, (aim, x)) in aim.iter().zip(&*x).enumerate() {
            let inside = aim.clamp(0.0, 1.0);
            let share = (inside - x) / (aim - x);
            if (inside - aim).abs() > SMALL_CHANGE && share < first.0 {
                first = (share, Some((i, inside)));
            }
        }
        for (x, aim) in x.iter_mut().zip(&aim) {
            *x = (*x + first.0 * (aim - *x)).clamp(0.0, 1.0);
        }
        let Some((i, bound)) = first.1 else {
            return;
        };
        x[i] = bound;
        held[i] = Some(bound);
    }
}

/// The values of the variables that are at a bound.
fn at_bounds(x: &[f64]) -> Vec<Option<f64>> {
    x.iter().map(|&x| is_bound(x).then_some(x)).collect()
}

/// The minimum with some variables held.
fn solve_held(
    matrix: &Symmetric,
    tree: &Tree,
    b: &[f64],
    held: &[Option<f64>],
) -> Option<Vec<f64>> {
    let factor = Factor::new(matrix, tree, &|i| held[i].is_some())?;
    let right = |i: usize| {
        let row = matrix.row(i);
        let of_held = row.filter_map(|(j, value)| Some(value * held[j]?));
        held[i].unwrap_or_else(|| b[i] - of_held.sum::<f64>())
    };
    let mut x: Vec<f64> = (0..held.len()).map(right).collect();
    factor.solve(tree, &mut x);
    Some(x)
}
