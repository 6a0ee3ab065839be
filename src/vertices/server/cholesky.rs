//! Cholesky factors of sparse matrices, `A = L L^T`, by the multifrontal method (Duff and Reid 1983,
//! *The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations*).
//!
//! Each node of the tree ([`super::dissect`]) adds what its children left over to its own rows of
//! the matrix, eliminates its variables in that dense block, and leaves the rest to its parent.
//!
//! Written here because of what else there is: the crate `faer` costs 195 s of processor time to
//! build without its default features, and its results depend on the processor (fused
//! multiply-add), which those of this crate do not.

use super::dissect::Tree;
use super::sparse::Symmetric;

/// Subtrees with fewer variables are not worth a thread.
const PARALLEL: usize = 4096;

/// A Cholesky factor in the order of a [`Tree`].
#[derive(Clone, Debug)]
pub struct Factor {
    /// One per node, by columns: its rows and those that it is tied to, of its own columns.
    blocks: Vec<Vec<f64>>,
}

impl Factor {
    /// Factors a matrix that the tree was made for. Variables for which `fixed` holds are left out:
    /// their rows and columns count as those of the identity. `None` unless what remains is
    /// positive definite.
    pub fn new(
        matrix: &Symmetric,
        tree: &Tree,
        fixed: &(impl Fn(usize) -> bool + Sync),
    ) -> Option<Factor> {
        let mut blocks = vec![Vec::new(); tree.nodes.len()];
        if let Some(root) = tree.nodes.len().checked_sub(1) {
            let assembly = Assembly {
                matrix,
                tree,
                fixed,
            };
            assembly.eliminate(root, &mut blocks)?;
        }
        Some(Factor { blocks })
    }

    /// Replaces `b` by the solution of `A x = b`.
    pub fn solve(&self, tree: &Tree, b: &mut [f64]) {
        let mut x: Vec<f64> = tree.order.iter().map(|&i| b[i as usize]).collect();
        for (node, block) in tree.nodes.iter().zip(&self.blocks) {
            let size = node.count + node.rows.len();
            for j in 0..node.count {
                let column = &block[j * size..][..size];
                let value = x[node.first + j] / column[j];
                x[node.first + j] = value;
                for i in j + 1..node.count {
                    x[node.first + i] -= column[i] * value;
                }
                for (row, l) in node.rows.iter().zip(&column[node.count..]) {
                    x[*row as usize] -= l * value;
                }
            }
        }
        for (node, block) in tree.nodes.iter().zip(&self.blocks).rev() {
            let size = node.count + node.rows.len();
            for j in (0..node.count).rev() {
                let column = &block[j * size..][..size];
                let mut value = x[node.first + j];
                for i in j + 1..node.count {
                    value -= column[i] * x[node.first + i];
                }
                for (row, l) in node.rows.iter().zip(&column[node.count..]) {
                    value -= l * x[*row as usize];
                }
                x[node.first + j] = value / column[j];
            }
        }
        for (&variable, x) in tree.order.iter().zip(x) {
            b[variable as usize] = x;
        }
    }
}

struct Assembly<'a, F> {
    matrix: &'a Symmetric,
    tree: &'a Tree,
    fixed: &'a F,
}

impl<F: Fn(usize) -> bool + Sync> Assembly<'_, F> {
    /// Factors the subtree that ends with node `n`, whose blocks these are. Returns what is left
    /// over for the parent: the lower triangle of a square over the node's rows, by columns.
    fn eliminate(&self, n: usize, blocks: &mut [Vec<f64>]) -> Option<Vec<f64>> {
        let node = &self.tree.nodes[n];
        let (own, size) = (node.count, node.count + node.rows.len());
        let mut front = vec![0.0; size * size];
        let (last, blocks) = blocks.split_last_mut()?;
        if let Some([left, right]) = node.children {
            let (first, second) = blocks.split_at_mut(left + 1 - node.subtree);
            let above = self.tree.nodes[self.tree.nodes[n].subtree].first;
            let (a, b) = if node.first - above >= PARALLEL {
                rayon::join(
                    || self.eliminate(left, first),
                    || self.eliminate(right, second),
                )
            } else {
                (self.eliminate(left, first), self.eliminate(right, second))
            };
            self.add_rest(n, left, &a?, &mut front);
            self.add_rest(n, right, &b?, &mut front);
        }
        self.add_matrix(n, &mut front);
        factor_front(&mut front, size, own)?;
        let mut rest = Vec::with_capacity((size - own) * (size - own));
        for column in front[own * size..].chunks_exact(size) {
            rest.extend_from_slice(&column[own..]);
        }
        front.truncate(size * own);
        front.shrink_to_fit();
        *last = front;
        Some(rest)
    }

    /// Where a place in the order stands in a node's front.
    fn local(&self, n: usize, place: u32) -> usize {
        let node = &self.tree.nodes[n];
        let end = node.first + node.count;
        match place as usize {
            place if place < end => place - node.first,
            _ => node.count + node.rows.partition_point(|&row| row < place),
        }
    }

    fn add_rest(&self, n: usize, child: usize, rest: &[f64], front: &mut [f64]) {
        let node = &self.tree.nodes[n];
        let size = node.count + node.rows.len();
        let rows = &self.tree.nodes[child].rows;
        let places: Vec<usize> = rows.iter().map(|&row| self.local(n, row)).collect();
        for (c, &column) in places.iter().enumerate() {
            let from = &rest[c * rows.len()..][..rows.len()];
            for r in c..rows.len() {
                front[column * size + places[r]] += from[r];
            }
        }
    }

    fn add_matrix(&self, n: usize, front: &mut [f64]) {
        let node = &self.tree.nodes[n];
        let size = node.count + node.rows.len();
        for c in 0..node.count {
            let variable = self.tree.order[node.first + c] as usize;
            if (self.fixed)(variable) {
                front[c * size + c] += 1.0;
                continue;
            }
            for (other, value) in self.matrix.row(variable) {
                let place = self.tree.place[other];
                if place as usize >= node.first + c && !(self.fixed)(other) {
                    front[c * size + self.local(n, place)] += value;
                }
            }
        }
    }
}

/// Eliminates the first `own` of `size` variables in the lower triangle of a dense matrix, stored
/// by columns: those columns become the factor's, the others what is left over.
fn factor_front(front: &mut [f64], size: usize, own: usize) -> Option<()> {
    for c in 0..size {
        let (done, column) = front.split_at_mut(c * size);
        let column = &mut column[c..size];
        let earlier = c.min(own);
        let mut j = 0;
        // Four columns at a time: the target is then read and written a quarter as often.
        while j + 4 <= earlier {
            let [a, b, d, e] = [0, 1, 2, 3].map(|k| &done[(j + k) * size + c..][..size - c]);
            let [fa, fb, fd, fe] = [a[0], b[0], d[0], e[0]];
            for ((((x, a), b), d), e) in column.iter_mut().zip(a).zip(b).zip(d).zip(e) {
                *x -= fa * a + fb * b + fd * d + fe * e;
            }
            j += 4;
        }
        for j in j..earlier {
            let a = &done[j * size + c..][..size - c];
            let f = a[0];
            for (x, a) in column.iter_mut().zip(a) {
                *x -= f * a;
            }
        }
        if c < own {
            let pivot = column[0];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let root = pivot.sqrt();
            column[0] = root;
            column[1..].iter_mut().for_each(|x| *x /= root);
        }
    }
    Some(())
}
