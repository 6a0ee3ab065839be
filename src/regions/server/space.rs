//! The space that objects can be in: a grid of cells, flooded from where cameras stand.
//!
//! A cell is reached if it has a free point that a reached neighbour's point sees. Sight decides, not
//! whether a cell holds geometry: walls thinner than a cell keep two rooms apart, and doors of a cell's
//! width let through. A point is free unless the rays along the axes tell that it lies inside
//! geometry. It must also have a floor, for the void about a building is no place for objects; where more than
//! twice as much is reached so, a roof and three walls will do (there are rooms whose floor is missing); and
//! where nothing is, anything. Cells under a roof count four times: a building is its rooms and not what is
//! on top of them.
//!
//! A scene without cameras is flooded from everywhere. Of the parts that hang together, that of the camera
//! that frames the scene is kept, or the largest, if it has more than eight times as much.

use super::graph::segment;
use crate::scene::{Pose, Scene};
use crate::trace::{Aabb, Ray, Tracer};
use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// Metres above the highest surface, for scenes of a size of 4 to 40 m.
const HEADROOM: f32 = 2.0;
/// Points of a cell that are tried, in cells from its middle: the middle, then the corners of a cube.
const TRIES: usize = 9;
/// What a cell with something above it counts where parts are compared.
const COVERED: usize = 4;
/// How many times as large as the framing camera's part another must be to be taken there.
const SMALLEST: usize = 8;
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
    /// Floods about `cells` cells from the eyes of all cameras and from `seeds`; from everywhere, if there
    /// are none of either. Empty where nothing is free about them, or the scene is.
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
        let space = Space {
            // The grid stands in the middle of the box.
            origin: bounds.centre() - 0.5 * cell * dims.as_vec3(),
            dims,
            cell,
            points: vec![None; dims.element_product() as usize],
        };
        let eyes = pose.cameras.iter().filter_map(|camera| {
            // Eyes outside look in at the nearest point of the box.
            let (eye, inset) = (camera.eye(), 1e-3 * cell);
            let inside = eye.clamp(bounds.min + inset, bounds.max - inset);
            let sees = inside == eye || !tracer.occluded(&segment(eye, inside));
            sees.then_some(inside)
        });
        let starts: Vec<Vec3> = eyes.chain(seeds.iter().copied()).collect();
        let fill = |place: Place| {
            let probe = Probe {
                scene,
                tracer,
                place,
            };
            let mut space = space.clone();
            if starts.is_empty() {
                space.flood_all(&probe, scene.framing_camera(pose).eye());
            } else {
                starts.iter().for_each(|start| {
                    space.spread(&probe, *start);
                });
            }
            let all: Vec<usize> = (0..space.points.len())
                .filter(|i| space.points[*i].is_some())
                .collect();
            (space.weight(tracer, &all), space)
        };
        let (floors, rooms) = (fill(Place::Floor), fill(Place::Room));
        let better = if rooms.0 > 2 * floors.0 {
            rooms
        } else {
            floors
        };
        match better.0 {
            0 => fill(Place::Anywhere).1,
            _ => better.1,
        }
    }

    /// Floods from all cells, and keeps one part.
    fn flood_all(&mut self, probe: &Probe, eye: Vec3) {
        let mut parts = vec![self.spread(probe, eye)];
        for start in 0..self.points.len() {
            if self.points[start].is_none() {
                parts.push(self.spread(probe, self.middle(start)));
            }
        }
        let sizes: Vec<usize> = parts.iter().map(|p| self.weight(probe.tracer, p)).collect();
        // The first of equals: the eye's.
        let largest = (0..sizes.len()).rev().max_by_key(|i| sizes[*i]);
        let largest = largest.unwrap_or(0);
        let kept = match sizes[0] * SMALLEST >= sizes[largest] {
            true => 0,
            false => largest,
        };
        for (_, part) in parts.iter().enumerate().filter(|(i, _)| *i != kept) {
            part.iter().for_each(|i| self.points[*i] = None);
        }
    }

    /// The number of some cells, those under a roof counting more.
    fn weight(&self, tracer: &Tracer, part: &[usize]) -> usize {
        let covered = part.par_iter().filter(|i| {
            let point = self.points[**i];
            point.is_some_and(|p| tracer.occluded(&ray(p, Vec3::Y)))
        });
        part.len() + (COVERED - 1) * covered.count()
    }

    /// Floods from a point, and gives the cells that were reached.
    fn spread(&mut self, probe: &Probe, start: Vec3) -> Vec<usize> {
        let mut reached = Vec::new();
        let first = self.index_at(start);
        let first = first.filter(|i| self.points[*i].is_none() && probe.is_free(start));
        if let Some(first) = first {
            self.points[first] = Some(start);
            reached.push(first);
        }
        let mut next = 0;
        while let Some(&index) = reached.get(next) {
            next += 1;
            let Some(from) = self.points[index] else {
                continue;
            };
            for neighbour in self.neighbours(index) {
                if self.points[neighbour].is_some() {
                    continue;
                }
                let middle = self.middle(neighbour);
                let found = (0..TRIES)
                    .map(|i| middle + self.cell * offset(i))
                    .find(|&to| !probe.tracer.occluded(&segment(from, to)) && probe.is_free(to));
                if found.is_some() {
                    self.points[neighbour] = found;
                    reached.push(neighbour);
                }
            }
        }
        reached
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

    /// The box of the cells from `low` to `high`, both included, its faces moved to the walls where there
    /// are some: a face with a surface before every cell, at most a cell beyond it, goes to the farthest.
    pub fn fitted_bounds_of(&self, tracer: &Tracer, low: UVec3, high: UVec3) -> Aabb {
        let grid = self.bounds_of(low, high);
        let mut bounds = grid;
        for side in 0..6 {
            let axis = side / 2;
            let (mut first, mut last) = (low, high);
            let mut direction = Vec3::ZERO;
            direction[axis] = [-1.0, 1.0][side % 2];
            let face = match side % 2 {
                0 => {
                    last[axis] = low[axis];
                    grid.min[axis]
                }
                _ => {
                    first[axis] = high[axis];
                    grid.max[axis]
                }
            };
            let farthest = (first.z..=last.z)
                .flat_map(|z| (first.y..=last.y).map(move |y| (y, z)))
                .flat_map(|(y, z)| (first.x..=last.x).map(move |x| UVec3::new(x, y, z)))
                .filter_map(|at| self.point(at))
                .map(|origin| {
                    let to_face = (face - origin[axis]) * direction[axis];
                    let ray = Ray {
                        origin,
                        direction,
                        t_max: to_face + self.cell,
                    };
                    tracer
                        .closest(&ray)
                        .map_or(f32::INFINITY, |hit| hit.t - to_face)
                })
                .reduce(f32::max);
            if let Some(beyond) = farthest.filter(|beyond| beyond.is_finite()) {
                match side % 2 {
                    0 => bounds.min[axis] -= beyond,
                    _ => bounds.max[axis] += beyond,
                }
            }
        }
        bounds
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

    /// The cells that were reached, by their boxes.
    pub fn cells(&self) -> impl Iterator<Item = Aabb> {
        let reached = (0..self.points.len()).filter(|i| self.points[*i].is_some());
        reached.map(|i| self.bounds_of(self.place(i), self.place(i)))
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

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin,
        direction,
        t_max: f32::INFINITY,
    }
}

/// What must be about a point.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Anywhere,
    Floor,
    /// A floor, or a roof and walls on three sides.
    Room,
}

struct Probe<'t, 's> {
    scene: &'s Scene,
    tracer: &'t Tracer<'s>,
    place: Place,
}

impl Probe<'_, '_> {
    /// Whether a point lies outside geometry, as far as rays along the axes tell: at most one in four
    /// of them meets the back of something, and not the one down. And whether it is in its place.
    fn is_free(&self, p: Vec3) -> bool {
        let (mut backs, mut walls) = (0, 0);
        let (mut floor, mut roof) = (false, false);
        for (axis, sign) in [
            (1, -1.0),
            (1, 1.0),
            (0, -1.0),
            (0, 1.0),
            (2, -1.0),
            (2, 1.0),
        ] {
            let mut direction = Vec3::ZERO;
            direction[axis] = sign;
            let hit = self.tracer.closest(&ray(p, direction));
            let back = hit.is_some_and(|hit| {
                let (instance, triangle) = (hit.instance as usize, hit.triangle as usize);
                hit.back && !self.scene.is_double_sided(instance, triangle)
            });
            backs += u32::from(back);
            match (axis, sign < 0.0) {
                (1, true) if back => return false,
                (1, true) => floor = hit.is_some(),
                (1, false) => roof = hit.is_some(),
                _ => walls += u32::from(hit.is_some()),
            }
        }
        let is_in_place = match self.place {
            Place::Anywhere => true,
            Place::Floor => floor,
            Place::Room => floor || roof && walls >= 3,
        };
        is_in_place && 4 * backs <= 6
    }
}
