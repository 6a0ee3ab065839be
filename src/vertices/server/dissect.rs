//! The order of elimination: nested dissection by position (George 1973, *Nested Dissection of a
//! Regular Finite Element Mesh*).
//!
//! The variables are halved across the longest side of their box. Those of one half that touch the
//! other separate the rest; they are eliminated last, and the halves are taken apart in the same
//! way. The variables of a mesh have positions, which makes this simpler than an order from the
//! graph alone, and the tree of separators is at once the plan of the elimination ([`super::cholesky`]).

use super::sparse::Symmetric;
use glam::DVec3;

/// Sets up to this size are not taken apart: their block is nearly full anyway.
const LEAF: usize = 24;

/// Variables that are eliminated together.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Their places in the order: `first..first + count`.
    pub first: usize,
    pub count: usize,
    /// Places after these, ascending, that elimination up to here ties them to.
    pub rows: Vec<u32>,
    /// The two halves, numbers of nodes before this one.
    pub children: Option<[usize; 2]>,
    /// The first node of the subtree; it ends with this one.
    pub subtree: usize,
}

/// An order of elimination, children before parents.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    pub nodes: Vec<Node>,
    /// The variable at each place.
    pub order: Vec<u32>,
    /// The place of each variable.
    pub place: Vec<u32>,
}

impl Tree {
    pub fn new(matrix: &Symmetric, positions: &[DVec3]) -> Tree {
        let mut variables: Vec<u32> = (0..matrix.size() as u32).collect();
        let mut dissection = Dissection {
            matrix,
            positions,
            side: vec![0; matrix.size()],
            stamp: 0,
            tree: Tree::default(),
        };
        dissection.divide(&mut variables);
        let mut tree = dissection.tree;
        tree.place = vec![0; matrix.size()];
        for (place, &variable) in tree.order.iter().enumerate() {
            tree.place[variable as usize] = place as u32;
        }
        tree.find_rows(matrix);
        tree
    }

    fn find_rows(&mut self, matrix: &Symmetric) {
        for n in 0..self.nodes.len() {
            let node = &self.nodes[n];
            let end = (node.first + node.count) as u32;
            let mut rows: Vec<u32> = self.order[node.first..end as usize]
                .iter()
                .flat_map(|&variable| matrix.columns(variable as usize))
                .map(|&variable| self.place[variable as usize])
                .collect();
            for child in node.children.into_iter().flatten() {
                rows.extend(&self.nodes[child].rows);
            }
            rows.retain(|&row| row >= end);
            rows.sort_unstable();
            rows.dedup();
            self.nodes[n].rows = rows;
        }
    }

    /// Numbers that the factor holds.
    pub fn factor_len(&self) -> usize {
        let block = |node: &Node| (node.count + node.rows.len()).saturating_mul(node.count);
        self.nodes
            .iter()
            .fold(0, |sum, node| sum.saturating_add(block(node)))
    }
}

struct Dissection<'a> {
    matrix: &'a Symmetric,
    positions: &'a [DVec3],
    /// The stamp that each variable was given last.
    side: Vec<u32>,
    stamp: u32,
    tree: Tree,
}

impl Dissection<'_> {
    /// Appends the nodes of a set; returns the last of them.
    fn divide(&mut self, set: &mut [u32]) -> usize {
        let subtree = self.tree.nodes.len();
        let Some((mut left, mut right, separator)) = self.halve(set) else {
            return self.push(set, None, subtree);
        };
        let children = [self.divide(&mut left), self.divide(&mut right)];
        self.push(&separator, Some(children), subtree)
    }

    fn push(&mut self, set: &[u32], children: Option<[usize; 2]>, subtree: usize) -> usize {
        let tree = &mut self.tree;
        tree.nodes.push(Node {
            first: tree.order.len(),
            count: set.len(),
            rows: Vec::new(),
            children,
            subtree,
        });
        tree.order.extend(set);
        tree.nodes.len() - 1
    }

    /// Two halves that do not touch and what separates them; `None` where it is not worth it.
    fn halve(&mut self, set: &mut [u32]) -> Option<(Vec<u32>, Vec<u32>, Vec<u32>)> {
        if set.len() <= LEAF {
            return None;
        }
        let at = |i: u32| self.positions[i as usize];
        let (lo, hi) = set
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), &i| {
                (lo.min(at(i)), hi.max(at(i)))
            });
        let axis = (hi - lo).max_position();
        let middle = set.len() / 2;
        set.select_nth_unstable_by(middle, |&a, &b| {
            at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b))
        });
        let (left, right) = set.split_at_mut(middle);
        // `select_nth` leaves the halves in an order that is its own affair.
        left.sort_unstable();
        right.sort_unstable();
        let stamps = [self.stamp + 1, self.stamp + 2];
        self.stamp += 2;
        for (half, stamp) in [&*left, &*right].into_iter().zip(stamps) {
            half.iter().for_each(|&i| self.side[i as usize] = stamp);
        }
        let touches = |i: u32, stamp: u32| {
            let columns = self.matrix.columns(i as usize);
            columns.iter().any(|&j| self.side[j as usize] == stamp)
        };
        let part = |half: &[u32], other: u32| -> (Vec<u32>, Vec<u32>) {
            half.iter().partition(|&&i| touches(i, other))
        };
        let (left_edge, left_rest) = part(left, stamps[1]);
        let (right_edge, right_rest) = part(right, stamps[0]);
        let (left, right, separator) = if left_edge.len() <= right_edge.len() {
            (left_rest, right.to_vec(), left_edge)
        } else {
            (left.to_vec(), right_rest, right_edge)
        };
        (!left.is_empty() && !right.is_empty()).then_some((left, right, separator))
    }
}
