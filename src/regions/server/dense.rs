//! Symmetric systems of at most seven unknowns, for all channels at once.

use super::samples::Channels;

/// Most unknowns: the terms of Eq. 4.
pub const MAX: usize = 7;

pub type Matrix = [[f64; MAX]; MAX];

/// Share of a column's square that must not follow from the others for it to count in the rank.
const DETERMINED: f64 = 1e-3;

/// The numerical rank of the leading `n` x `n` part of a matrix of inner products: Cholesky's
/// decomposition of it with unit diagonal, with pivoting.
pub fn rank(matrix: &Matrix, n: usize) -> usize {
    let scale: [f64; MAX] = std::array::from_fn(|i| match matrix[i][i] {
        d if d > 0.0 => 1.0 / d.sqrt(),
        _ => 0.0,
    });
    let mut rest: Matrix =
        std::array::from_fn(|i| std::array::from_fn(|j| matrix[i][j] * scale[i] * scale[j]));
    let mut left: Vec<usize> = (0..n).collect();
    for rank in 0..n {
        // The constant comes first, so that columns are judged by how they vary.
        let best = match rank {
            0 => 0,
            _ => (0..left.len())
                .max_by(|&a, &b| rest[left[a]][left[a]].total_cmp(&rest[left[b]][left[b]]))
                .unwrap_or(0),
        };
        let pivot = left.remove(best);
        let value = rest[pivot][pivot];
        if value.is_nan() || value <= DETERMINED {
            return rank;
        }
        for &i in &left {
            for &j in &left {
                rest[i][j] -= rest[i][pivot] * rest[pivot][j] / value;
            }
        }
    }
    n
}

/// Solves the leading `n` x `n` part of a positive definite system for all channels.
pub fn solve(matrix: &Matrix, n: usize, right: &[Channels; MAX]) -> [Channels; MAX] {
    let mut l = *matrix;
    let mut x = *right;
    for i in 0..n {
        for k in 0..=i {
            let dot: f64 = (0..k).map(|j| l[i][j] * l[k][j]).sum();
            let rest = l[i][k] - dot;
            l[i][k] = if i == k {
                rest.max(f64::MIN_POSITIVE).sqrt()
            } else {
                rest / l[k][k]
            };
        }
    }
    for i in 0..n {
        for (j, factor) in l[i][..i].iter().enumerate() {
            subtract(&mut x, i, j, *factor);
        }
        x[i].iter_mut().for_each(|x| *x /= l[i][i]);
    }
    for i in (0..n).rev() {
        for (j, row) in l.iter().enumerate().take(n).skip(i + 1) {
            subtract(&mut x, i, j, row[i]);
        }
        x[i].iter_mut().for_each(|x| *x /= l[i][i]);
    }
    x[n..].fill([0.0; _]);
    x
}

fn subtract(x: &mut [Channels; MAX], from: usize, row: usize, factor: f64) {
    let row = x[row];
    for (x, y) in x[from].iter_mut().zip(row) {
        *x -= factor * y;
    }
}
