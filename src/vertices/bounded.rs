//! Least squares with bounds: the minimum of `1/2 x^T A x - b^T x` over `0 <= x <= 1`.
//!
//! Clamping the free minimum leaves a scar: a vertex next to one that wanted 1.2 was pulled down to
//! make up for it. The bounded minimum has none; at each variable either the gradient is zero or the
//! variable is at a bound that the gradient pushes against.
//!
//! Primal-dual active set method (Hintermüller, Ito and Kunisch 2002, *The Primal-Dual Active Set
//! Strategy as a Semismooth Newton Method*): variables that leave the interval are fixed at its end,
//! those that are pulled off their end are let go, and the others are solved for exactly. It is
//! exact when the sets repeat, which takes a few steps. It may cycle in theory; projected
//! Gauss-Seidel, which always descends, then takes over.

use super::cholesky::Factor;
use super::dissect::Tree;
use super::sparse::Symmetric;

/// Steps after which the active sets are taken to cycle.
const MAX_STEPS: usize = 30;

/// How far a variable may leave the interval, and the energy's gradient over its diagonal push from a
/// bound, before it counts: rounding would make the active sets flicker.
const SLACK: f64 = 1e-9;

/// Sweeps of the fallback, and the change of a variable at which it ends.
const MAX_SWEEPS: usize = 2000;
const SMALL_CHANGE: f64 = 1e-7;

/// Where a variable stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Free,
    AtZero,
    AtOne,
}

/// The minimum and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounded {
    /// In 0..=1.
    pub x: Vec<f64>,
    /// Variables at a bound.
    pub at_bounds: usize,
    /// The active sets repeated: this is the minimum, up to rounding.
    pub is_exact: bool,
}

/// Solves for one right-hand side. `factor` is that of the whole matrix, which is positive definite.
pub fn solve(matrix: &Symmetric, tree: &Tree, factor: &Factor, b: &[f64]) -> Bounded {
    let mut x = b.to_vec();
    factor.solve(tree, &mut x);
    let mut states = vec![State::Free; x.len()];
    for _ in 0..MAX_STEPS {
        let next = next_states(matrix, b, &x, &states);
        if next == states {
            return finish(x, &states, true);
        }
        states = next;
        let Some(solved) = solve_free(matrix, tree, b, &states) else {
            break;
        };
        x = solved;
    }
    x.iter_mut().for_each(|x| *x = x.clamp(0.0, 1.0));
    descend(matrix, b, &mut x);
    let states: Vec<State> = x.iter().map(|&x| at_bound(x)).collect();
    finish(x, &states, false)
}

fn at_bound(x: f64) -> State {
    match x {
        x if x <= 0.0 => State::AtZero,
        x if x >= 1.0 => State::AtOne,
        _ => State::Free,
    }
}

fn next_states(matrix: &Symmetric, b: &[f64], x: &[f64], states: &[State]) -> Vec<State> {
    let next = |(i, state): (usize, &State)| {
        // Positive where the energy grows with the variable.
        let gradient = || (matrix.row_times(i, x) - b[i]) / matrix.diagonal(i);
        match state {
            State::Free if x[i] < -SLACK => State::AtZero,
            State::Free if x[i] > 1.0 + SLACK => State::AtOne,
            State::AtZero if gradient() < -SLACK => State::Free,
            State::AtOne if gradient() > SLACK => State::Free,
            state => *state,
        }
    };
    states.iter().enumerate().map(next).collect()
}

/// The minimum over the free variables with the others at their bounds.
fn solve_free(matrix: &Symmetric, tree: &Tree, b: &[f64], states: &[State]) -> Option<Vec<f64>> {
    let factor = Factor::new(matrix, tree, &|i| states[i] != State::Free)?;
    let mut x: Vec<f64> = (0..b.len())
        .map(|i| match states[i] {
            State::AtZero => 0.0,
            State::AtOne => 1.0,
            State::Free => {
                let at_one = matrix.row(i).filter(|&(j, _)| states[j] == State::AtOne);
                b[i] - at_one.map(|(_, value)| value).sum::<f64>()
            }
        })
        .collect();
    factor.solve(tree, &mut x);
    Some(x)
}

/// Projected Gauss-Seidel: each variable in turn goes to its own minimum within the bounds.
fn descend(matrix: &Symmetric, b: &[f64], x: &mut [f64]) {
    for _ in 0..MAX_SWEEPS {
        let mut change = 0.0f64;
        for i in 0..x.len() {
            let step = (b[i] - matrix.row_times(i, x)) / matrix.diagonal(i);
            let new = (x[i] + step).clamp(0.0, 1.0);
            change = change.max((new - x[i]).abs());
            x[i] = new;
        }
        if change < SMALL_CHANGE {
            return;
        }
    }
}

fn finish(mut x: Vec<f64>, states: &[State], is_exact: bool) -> Bounded {
    for (x, state) in x.iter_mut().zip(states) {
        *x = match state {
            State::AtZero => 0.0,
            State::AtOne => 1.0,
            State::Free => x.clamp(0.0, 1.0),
        };
    }
    Bounded {
        at_bounds: states.iter().filter(|&&s| s != State::Free).count(),
        x,
        is_exact,
    }
}
