//! Boxes that cover the free space of a scene.
//!
//! Greedy: the largest cube of cells that no box covers yet is grown on its six sides, while what is
//! added is free and half of it new. Boxes may overlap, and hold some cells that are not free: the
//! samples of a region tell them apart. No wall that reads as one cuts a box: where more than half of the
//! passages across a plane of the layer are closed, it is not added. In the end the faces move to walls
//! that are near.

use super::space::Space;
use crate::trace::{Aabb, Tracer};
use glam::UVec3;

/// Share of a layer that must be free to be added.
const FREE: f64 = 0.9;
/// Share of a layer that no box covered before.
const NEW: f64 = 0.5;
/// Share of the passages across a plane that may be closed.
const CLOSED: f64 = 0.5;

/// Boxes of a space, in the order in which they were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cover {
    pub boxes: Vec<Aabb>,
    /// Share of the reached cells that some box holds.
    pub share: f64,
}

/// At most `most` boxes, none of which adds fewer than `least` cells.
pub fn cover(space: &Space, tracer: &Tracer, most: usize, least: usize) -> Cover {
    let passages = &space.passages(tracer);
    let mut grid = Grid {
        space,
        passages,
        open: (0..passages.len())
            .map(|i| space.point(space.place(i)).is_some())
            .collect(),
        sizes: Vec::new(),
    };
    let reached = grid.open.iter().filter(|open| **open).count();
    let mut left = reached;
    let mut boxes = Vec::new();
    while boxes.len() < most && left > 0 {
        let cube = grid.largest_cube();
        let (low, high) = grid.grow(cube);
        let new = grid.take(low, high);
        if new < least.max(1) {
            break;
        }
        left -= new;
        boxes.push(space.fitted_bounds_of(tracer, low, high));
    }
    Cover {
        boxes,
        share: 1.0 - left as f64 / reached.max(1) as f64,
    }
}

struct Grid<'a> {
    space: &'a Space,
    passages: &'a [[bool; 3]],
    /// Reached, and in no box yet.
    open: Vec<bool>,
    sizes: Vec<u16>,
}

impl Grid<'_> {
    /// The first of the largest cubes of open cells, all of whose passages are open.
    fn largest_cube(&mut self) -> (UVec3, UVec3) {
        let dims = self.space.dims();
        let strides = [1, dims.x as usize, (dims.x * dims.y) as usize];
        self.sizes.clear();
        self.sizes.resize(self.open.len(), 0);
        let (mut best, mut size) = (UVec3::ZERO, 0);
        for index in 0..self.open.len() {
            if !self.open[index] {
                continue;
            }
            let at = self.space.place(index);
            let joined =
                (0..3).all(|axis| at[axis] > 0 && self.passages[index - strides[axis]][axis]);
            // As in the largest square of ones in a matrix.
            let around = if joined {
                (1..8usize)
                    .map(|corner| {
                        let back: usize = (0..3)
                            .filter(|axis| corner >> axis & 1 != 0)
                            .map(|axis| strides[axis])
                            .sum();
                        self.sizes[index - back]
                    })
                    .min()
                    .unwrap_or(0)
            } else {
                0
            };
            self.sizes[index] = around + 1;
            if around + 1 > size {
                (best, size) = (at, around + 1);
            }
        }
        (best + 1 - u32::from(size), best)
    }

    /// Adds the layer with the most new cells until none may be added.
    fn grow(&self, (mut low, mut high): (UVec3, UVec3)) -> (UVec3, UVec3) {
        loop {
            let best = (0..6)
                .filter_map(|side| self.new_cells(low, high, side).map(|new| (new, side)))
                .max_by_key(|&(new, side)| (new, std::cmp::Reverse(side)));
            match best {
                Some((_, side)) if is_low(side) => low[side / 2] -= 1,
                Some((_, side)) => high[side / 2] += 1,
                None => return (low, high),
            }
        }
    }

    /// New cells of the layer on a side of a box; `None` where it may not be added.
    fn new_cells(&self, low: UVec3, high: UVec3, side: usize) -> Option<usize> {
        let axis = side / 2;
        let (mut first, mut last) = (low, high);
        // The layer, and the lower of the two cells of each passage into it.
        let into = if is_low(side) {
            first[axis] = low[axis].checked_sub(1)?;
            first[axis]
        } else {
            first[axis] = high[axis] + 1;
            (first[axis] < self.space.dims()[axis]).then_some(high[axis])?
        };
        last[axis] = first[axis];
        let (mut cells, mut free, mut new) = (0, 0, 0);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut closed = [
            vec![0usize; (last[u] - first[u]) as usize],
            vec![0usize; (last[v] - first[v]) as usize],
        ];
        for j in first[v]..=last[v] {
            for i in first[u]..=last[u] {
                let mut at = first;
                (at[u], at[v]) = (i, j);
                let index = self.space.index(at);
                let mut before = at;
                before[axis] = into;
                cells += 1;
                free += usize::from(self.passages[self.space.index(before)][axis]);
                new += usize::from(self.open[index]);
                if i < last[u] {
                    closed[0][(i - first[u]) as usize] += usize::from(!self.passages[index][u]);
                }
                if j < last[v] {
                    closed[1][(j - first[v]) as usize] += usize::from(!self.passages[index][v]);
                }
            }
        }
        let across = [
            (last[v] - first[v] + 1) as f64,
            (last[u] - first[u] + 1) as f64,
        ];
        let walled = closed
            .iter()
            .zip(across)
            .any(|(planes, across)| planes.iter().any(|c| *c as f64 > CLOSED * across));
        let share = |count: usize| count as f64 / cells as f64;
        (share(free) >= FREE && share(new) >= NEW && !walled).then_some(new)
    }

    /// Marks the cells of a box, and says how many were open.
    fn take(&mut self, low: UVec3, high: UVec3) -> usize {
        let mut new = 0;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let index = self.space.index(UVec3::new(x, y, z));
                    new += usize::from(std::mem::take(&mut self.open[index]));
                }
            }
        }
        new
    }
}

/// Sides are -x, +x, -y, +y, -z, +z.
fn is_low(side: usize) -> bool {
    side & 1 == 0
}
