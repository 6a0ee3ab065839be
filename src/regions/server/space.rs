//! The space that objects can be in: a grid of cells, flooded from where cameras stand.
//!
//! A cell is reached if it has a point that a reached neighbour's point sees. Sight decides, not
//! whether a cell holds geometry: walls thinner than a cell keep two rooms apart, and doors of a cell's
//! width let through. Cells with nothing below them are left out where a camera has a floor: the
//! void about a building is no place for objects.

use super::graph::segment;
use crate::scene::{Pose, Scene};
use crate::trace::{Aabb, Ray, Tracer};
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use std::collections::VecDeque;

/// Metres above the highest surface, for scenes of a size of 4 to 40 m.
const HEADROOM: f32 = 2.0;
/// Points of a cell that are tried, in cells from its middle: the middle, then the corners of a cube.
const TRIES: usize = 9;
/// Most cells along an axis.
const MAX_SIDE: f32 = 1024.0;

/// The flooded cells.
#[derive(Clone, Debug, Default)]
pub struct Space {
    origin: Vec3,
    dims: UVec3,
    cell: f32,
    /// A free point per cell, x fastest; `None` where the flood did not come.
    points: Vec<Option<Vec3>>,
}

impl Space {
    /// Floods about `cells` cells from the eyes of all cameras (from the one that frames the scene, if there
    /// is none) and from `seeds`. Empty where nothing is free about them, or the scene is.
    pub fn flood(
        scene: &Scene,
        pose: &Pose,
        tracer: &Tracer,
        seeds: &[Vec3],
        cells: usize,
    ) -> Space {
        let Some(bounds) = bounds(scene, pose) else {
            return Space::default();
        };
        let size = bounds.max - bounds.min;
        let cell = (size.x * size.y * size.z / cells.max(1) as f32)
            .cbrt()
            .max(size.max_element() / MAX_SIDE);
        if !(cell > 0.0 && cell.is_finite()) {
            return Space::default();
        }
        let dims = (size / cell).ceil().as_uvec3().max(UVec3::ONE);
        let mut space = Space {
            // The grid stands in the middle of the box.
            origin: bounds.centre() - 0.5 * cell * dims.as_vec3(),
            dims,
            cell,
            points: vec![None; dims.element_product() as usize],
        };
        let mut eyes: Vec<Vec3> = pose.cameras.iter().map(|camera| camera.eye()).collect();
        if eyes.is_empty() {
            eyes.push(scene.framing_camera(pose).eye());
        }
        // Eyes outside look in at the nearest point of the box.
        let inset = 1e-3 * cell;
        let entries = eyes.iter().filter_map(|&eye| {
            let inside = eye.clamp(bounds.min + inset, bounds.max - inset);
            let sees = inside == eye || !tracer.occluded(&segment(eye, inside));
            sees.then_some(inside)
        });
        let starts: Vec<Vec3> = entries.chain(seeds.iter().copied()).collect();
        let floors = starts.iter().any(|p| has_floor(tracer, *p));
        space.spread(tracer, &starts, floors);
        space
    }

    fn spread(&mut self, tracer: &Tracer, starts: &[Vec3], floors: bool) {
        let mut queue = VecDeque::new();
        for &start in starts {
            let Some(index) = self.index_at(start) else {
                continue;
            };
            if self.points[index].is_none() && (!floors || has_floor(tracer, start)) {
                self.points[index] = Some(start);
                queue.push_back(index);
            }
        }
        while let Some(index) = queue.pop_front() {
            let Some(from) = self.points[index] else {
                continue;
            };
            for next in self.neighbours(index) {
                if self.points[next].is_some() {
                    continue;
                }
                let middle = self.middle(next);
                let found = (0..TRIES)
                    .map(|i| middle + self.cell * offset(i))
                    .find(|&to| {
                        !tracer.occluded(&segment(from, to)) && (!floors || has_floor(tracer, to))
                    });
                if found.is_some() {
                    self.points[next] = found;
                    queue.push_back(next);
                }
            }
        }
    }

    /// Edge of a cell in metres.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    pub fn dims(&self) -> UVec3 {
        self.dims
    }

    /// Cells that were reached.
    pub fn reached(&self) -> usize {
        self.points.iter().flatten().count()
    }

    /// The free point of a cell, by its place in the grid.
    pub fn point(&self, at: UVec3) -> Option<Vec3> {
        self.points[self.index(at)]
    }

    /// The box of the cells from `low` to `high`, both included.
    pub fn bounds_of(&self, low: UVec3, high: UVec3) -> Aabb {
        Aabb {
            min: self.origin + self.cell * low.as_vec3(),
            max: self.origin + self.cell * (high + 1).as_vec3(),
        }
    }

    /// Per cell and axis: whether its point and that of the next cell see each other.
    pub fn passages(&self, tracer: &Tracer) -> Vec<[bool; 3]> {
        (0..self.points.len())
            .into_par_iter()
            .map(|index| {
                let at = self.place(index);
                std::array::from_fn(|axis| {
                    if at[axis] + 1 >= self.dims[axis] {
                        return false;
                    }
                    let mut next = at;
                    next[axis] += 1;
                    match (self.points[index], self.point(next)) {
                        (Some(from), Some(to)) => !tracer.occluded(&segment(from, to)),
                        _ => false,
                    }
                })
            })
            .collect()
    }

    /// Whether a point lies in the space: it sees the free point of its cell or of a cell about it.
    /// Where the grid ends, so does the space.
    pub fn sees(&self, tracer: &Tracer, p: Vec3) -> bool {
        let Some(index) = self.index_at(p) else {
            return false;
        };
        let at = self.place(index);
        let (low, high) = (at.saturating_sub(UVec3::ONE), at + 1);
        let high = high.min(self.dims - 1);
        let free = |index: usize| {
            self.points[index].is_some_and(|point| !tracer.occluded(&segment(p, point)))
        };
        free(index)
            || (low.z..=high.z).any(|z| {
                (low.y..=high.y).any(|y| {
                    (low.x..=high.x).any(|x| {
                        let other = self.index(UVec3::new(x, y, z));
                        other != index && free(other)
                    })
                })
            })
    }

    /// Whether any cell that the box overlaps was reached.
    pub fn overlaps(&self, bounds: &Aabb) -> bool {
        if self.points.is_empty() || bounds.is_empty() {
            return false;
        }
        let low = ((bounds.min - self.origin) / self.cell).floor();
        let high = ((bounds.max - self.origin) / self.cell).floor();
        let last = self.dims.as_vec3() - 1.0;
        if !(low.cmple(last).all() && high.cmpge(Vec3::ZERO).all()) {
            return false;
        }
        let low = low.clamp(Vec3::ZERO, last).as_uvec3();
        let high = high.clamp(Vec3::ZERO, last).as_uvec3();
        (low.z..=high.z).any(|z| {
            (low.y..=high.y)
                .any(|y| (low.x..=high.x).any(|x| self.point(UVec3::new(x, y, z)).is_some()))
        })
    }

    pub(super) fn index(&self, at: UVec3) -> usize {
        ((at.z * self.dims.y + at.y) * self.dims.x + at.x) as usize
    }

    pub(super) fn place(&self, index: usize) -> UVec3 {
        let index = index as u32;
        let rows = index / self.dims.x;
        UVec3::new(index % self.dims.x, rows % self.dims.y, rows / self.dims.y)
    }

    fn index_at(&self, p: Vec3) -> Option<usize> {
        if self.points.is_empty() || !p.is_finite() {
            return None;
        }
        let at = (p - self.origin) / self.cell;
        let inside = at.cmpge(Vec3::ZERO).all() && at.cmplt(self.dims.as_vec3()).all();
        inside.then(|| self.index(at.as_uvec3().min(self.dims - 1)))
    }

    fn middle(&self, index: usize) -> Vec3 {
        self.origin + self.cell * (self.place(index).as_vec3() + 0.5)
    }

    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let (at, dims) = (self.place(index), self.dims);
        let strides = [1, dims.x as usize, (dims.x * dims.y) as usize];
        (0..6).filter_map(move |side| {
            let axis = side / 2;
            if side % 2 == 0 {
                (at[axis] > 0).then(|| index - strides[axis])
            } else {
                (at[axis] + 1 < dims[axis]).then(|| index + strides[axis])
            }
        })
    }
}

/// The box about the scene, with headroom; geometry farther outside of its typical box than that is
/// large, such as a sky dome, does not count.
fn bounds(scene: &Scene, pose: &Pose) -> Option<Aabb> {
    let (min, max) = scene.bounds(pose)?;
    let (low, high) = scene.typical_bounds(pose)?;
    let around = Vec3::splat((high - low).length());
    let bounds = Aabb {
        min: min.max(low - around),
        max: max.min(high + around) + Vec3::Y * (HEADROOM * scene.length_scale()),
    };
    let is_box = bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty();
    // Flat scenes have a room of some width, too.
    is_box.then(|| bounds.grown(1e-3 * (bounds.max - bounds.min).max_element()))
}

fn offset(i: usize) -> Vec3 {
    let side = |bit: usize| {
        if (i - 1) >> bit & 1 == 0 {
            -0.3125
        } else {
            0.3125
        }
    };
    match i {
        0 => Vec3::ZERO,
        _ => Vec3::new(side(0), side(1), side(2)),
    }
}

fn has_floor(tracer: &Tracer, p: Vec3) -> bool {
    tracer.occluded(&Ray {
        origin: p,
        direction: Vec3::NEG_Y,
        t_max: f32::INFINITY,
    })
}
