//! Obscurance around instances: spherical harmonics at the corners of a grid that is there only where
//! instances are (section 2.2). It serves the bake and no client.
//!
//! The grid has two levels: bricks of 4 x 4 x 4 corners in a map, and in each brick a mask of the corners that
//! are present, whose values stand in one array. Whatever the place inside an instance's box, the eight
//! corners around it are present.

use crate::obscurance::sphere::{self, Expansion};
use crate::obscurance::{MAX_KERNELS, Obscurance};
use crate::rng::Rng;
use crate::trace::Aabb;
use crate::{Error, Result};
use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Corners along the edge of a brick.
const EDGE: i32 = 4;

/// Most corners of a volume: half an hour of rays on two cores, and 1 GB.
pub const MAX_CORNERS: usize = 1 << 22;

/// Which corners are present.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Metres between corners.
    spacing: f64,
    bricks: BTreeMap<[i32; 3], Brick>,
    count: usize,
}

/// 64 corners.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Brick {
    /// Bit `x + 4 y + 16 z`: the corner is present.
    present: u64,
    /// Number of present corners in the bricks before.
    first: usize,
}

/// The corner below a place, and the way from it to the next on each axis, 0 to 1.
fn cell(spacing: f64, p: Vec3) -> (IVec3, DVec3) {
    let at = p.as_dvec3() / spacing;
    let corner = at.floor();
    (corner.as_ivec3(), at - corner)
}

/// A corner's brick and its bit there.
fn split(corner: IVec3) -> ([i32; 3], u32) {
    let brick = corner.to_array().map(|x| x.div_euclid(EDGE));
    let inside = corner.to_array().map(|x| x.rem_euclid(EDGE));
    let bit = inside[0] + EDGE * (inside[1] + EDGE * inside[2]);
    (brick, bit as u32)
}

impl Layout {
    /// The corners around every place in any of the boxes, which are finite; empty boxes count for none.
    ///
    /// # Errors
    /// `Invalid` for a spacing that is not a positive number of metres, or that gives more than [`MAX_CORNERS`].
    pub fn new(boxes: &[Aabb], spacing: f32) -> Result<Layout> {
        if !(spacing > 0.0 && spacing.is_finite()) {
            return Err(Error::Invalid(format!(
                "the spacing of the volume is {spacing} m; it must be a positive number of metres"
            )));
        }
        let spacing = f64::from(spacing);
        let too_many = || {
            Error::Invalid(format!(
                "a volume with a spacing of {spacing} m has more than {MAX_CORNERS} corners around these instances"
            ))
        };
        let mut layout = Layout {
            spacing,
            bricks: BTreeMap::new(),
            count: 0,
        };
        let mut present = 0usize;
        for b in boxes.iter().filter(|b| !b.is_empty()) {
            let extent = ((b.max - b.min).as_dvec3() / spacing + 2.0).element_product();
            let far = f64::from(b.reach()) / spacing;
            if extent > MAX_CORNERS as f64 || far > 1e9 {
                return Err(too_many());
            }
            let (min, max) = (cell(spacing, b.min).0, cell(spacing, b.max).0 + 1);
            for z in min.z..=max.z {
                for y in min.y..=max.y {
                    for x in min.x..=max.x {
                        let (brick, bit) = split(IVec3::new(x, y, z));
                        let brick = layout.bricks.entry(brick).or_default();
                        present += usize::from(brick.present >> bit & 1 == 0);
                        brick.present |= 1 << bit;
                    }
                }
            }
            if present > MAX_CORNERS {
                return Err(too_many());
            }
        }
        for brick in layout.bricks.values_mut() {
            brick.first = layout.count;
            layout.count += brick.present.count_ones() as usize;
        }
        Ok(layout)
    }

    /// Number of corners.
    pub fn len(&self) -> usize {
        self.count
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The number of a corner, if it is present.
    fn number(&self, corner: IVec3) -> Option<usize> {
        let (brick, bit) = split(corner);
        let brick = self.bricks.get(&brick)?;
        let below = brick.present & ((1 << bit) - 1);
        (brick.present >> bit & 1 == 1).then(|| brick.first + below.count_ones() as usize)
    }

    /// The corners around a place and their weights; `None` where one is absent.
    pub fn around(&self, p: Vec3) -> Option<[(usize, f64); 8]> {
        if !p.is_finite() {
            return None;
        }
        let (corner, t) = cell(self.spacing, p);
        let mut found = [(0, 0.0); 8];
        for (i, found) in found.iter_mut().enumerate() {
            let step = IVec3::new(i as i32 & 1, i as i32 >> 1 & 1, i as i32 >> 2);
            let along = |axis: usize| match step[axis] {
                0 => 1.0 - t[axis],
                _ => t[axis],
            };
            *found = (self.number(corner + step)?, along(0) * along(1) * along(2));
        }
        Some(found)
    }

    /// World space, in the order of their numbers.
    fn corners(&self) -> Vec<IVec3> {
        let mut corners = Vec::with_capacity(self.count);
        for (brick, Brick { present, .. }) in &self.bricks {
            let base = IVec3::from_array(*brick) * EDGE;
            for bit in (0..64).filter(|bit| present >> bit & 1 == 1) {
                let inside = IVec3::new(bit % EDGE, bit / EDGE % EDGE, bit / (EDGE * EDGE));
                corners.push(base + inside);
            }
        }
        corners
    }
}

/// Obscurance at the corners of a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    pub layout: Layout,
    kernels: usize,
    /// Per corner and kernel.
    expansions: Vec<Expansion>,
    /// Whether each corner is outside geometry.
    valid: Vec<bool>,
}

impl Volume {
    /// Traces all corners, with as many rays each as `obscurance` has ([`crate::obscurance::VOLUME_RAYS`] in the paper).
    pub fn new(layout: Layout, obscurance: &Obscurance) -> Volume {
        let kernels = obscurance.kernels().len();
        let traced: Vec<([Expansion; MAX_KERNELS], bool)> = layout
            .corners()
            .par_iter()
            .map(|corner| {
                let position = (corner.as_dvec3() * layout.spacing).as_vec3();
                // A corner keeps its rays whatever others there are.
                let [x, y, z] = corner.to_array().map(|x| u64::from(x as u32));
                let seed = Rng::new(x ^ y << 21 ^ z << 42).draw() as u32;
                let (expansions, gather) = obscurance.about_point(position, seed);
                (expansions, gather.is_valid())
            })
            .collect();
        Volume {
            layout,
            kernels,
            expansions: traced
                .iter()
                .flat_map(|t| t.0[..kernels].iter().copied())
                .collect(),
            valid: traced.iter().map(|t| t.1).collect(),
        }
    }

    /// Corners inside geometry.
    pub fn invalid(&self) -> usize {
        self.valid.iter().filter(|valid| !**valid).count()
    }

    /// Obscurance of a surface with this unit normal, in 0..=1, by each kernel; 0 beyond their number. Corners inside
    /// geometry have no part in the interpolation. `None` where a corner is absent, or none is outside.
    pub fn at(&self, p: Vec3, normal: Vec3) -> Option<[f32; MAX_KERNELS]> {
        let mut around = self.layout.around(p)?;
        for (corner, weight) in &mut around {
            if !self.valid[*corner] {
                *weight = 0.0;
            }
        }
        let total: f64 = around.iter().map(|(_, weight)| weight).sum();
        if total <= 0.0 {
            return None;
        }
        let mut values = [0.0; MAX_KERNELS];
        for (kernel, value) in values[..self.kernels].iter_mut().enumerate() {
            let at = |corner: usize| {
                f64::from(sphere::evaluate(
                    &self.expansions[corner * self.kernels + kernel],
                    normal,
                ))
            };
            let sum: f64 = around.iter().map(|(corner, w)| w * at(*corner)).sum();
            *value = (sum / total).clamp(0.0, 1.0) as f32;
        }
        Some(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obscurance::Kernel;
    use crate::obscurance::shapes::{cuboid, floor, scene};
    use crate::trace::Tracer;

    /// Boxes of all sizes, some of which share bricks, some below zero.
    fn boxes() -> Vec<Aabb> {
        let mut random = Rng::new(3);
        let mut within =
            |size: f32| Vec3::from_array(std::array::from_fn(|_| size * random.unit()));
        (0..40)
            .map(|i| {
                let min = within(60.0) - 30.0;
                let max = min + within([0.0, 0.5, 4.0, 11.0][i % 4]);
                Aabb { min, max }
            })
            .collect()
    }

    #[test]
    fn all_corners_around_places_in_the_boxes_are_present() {
        let boxes = boxes();
        for spacing in [0.3, 1.0, 2.5] {
            let layout = Layout::new(&boxes, spacing).expect("few corners");
            let corners = layout.corners();
            let mut random = Rng::new(9);
            for b in &boxes {
                for i in 0..60 {
                    // Corners and edges of the box, too.
                    let mut pick = |low: f32, high: f32| match i % 3 {
                        0 => [low, high][(random.draw() & 1) as usize],
                        _ => (low + (high - low) * random.unit()).min(high),
                    };
                    let p = Vec3::new(
                        pick(b.min.x, b.max.x),
                        pick(b.min.y, b.max.y),
                        pick(b.min.z, b.max.z),
                    );
                    let around = layout.around(p).expect("all eight");
                    let mean: DVec3 = around
                        .iter()
                        .map(|(number, w)| corners[*number].as_dvec3() * *w)
                        .sum();
                    let gap = (mean * layout.spacing).as_vec3() - p;
                    assert!(gap.length() < 1e-4, "{gap}");
                }
            }
            // And no corner that no box needs.
            let needed = corners.iter().filter(|corner| {
                let at = (corner.as_dvec3() * layout.spacing).as_vec3();
                boxes
                    .iter()
                    .any(|b| b.grown(1.001 * spacing).distance_squared(at) == 0.0)
            });
            assert_eq!(needed.count(), layout.len());
        }
    }

    #[test]
    fn numbers_are_those_of_the_corners_in_order() {
        let layout = Layout::new(&boxes(), 1.0).expect("few corners");
        for (number, corner) in layout.corners().into_iter().enumerate() {
            assert_eq!(layout.number(corner), Some(number));
        }
        assert!(layout.around(Vec3::splat(1e4)).is_none());
        assert!(layout.around(Vec3::NAN).is_none());
        assert!(Layout::new(&[], 1.0).expect("none").is_empty());
    }

    #[test]
    fn bad_spacings_are_refused() {
        for spacing in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-6] {
            assert!(Layout::new(&boxes(), spacing).is_err(), "{spacing}");
        }
    }

    /// Beside a wall the volume gives what rays from the surface find; corners inside the wall take no part.
    #[test]
    fn volume_beside_a_wall_follows_direct_rays() {
        let wall = cuboid(Vec3::new(0.0, -1.0, -20.0), Vec3::new(3.0, 20.0, 20.0));
        let ground = floor(Vec3::new(-50.0, 0.0, -50.0), 100.0, 1);
        let (scene, pose) = scene(vec![wall, ground]);
        let tracer = Tracer::new(&scene, &pose);
        let kernels = [Kernel::Exponential {
            half_distance: 20.0,
        }];
        let obscurance = Obscurance::new(&scene, &tracer, &kernels, 1024).expect("kernels");
        let b = Aabb {
            min: Vec3::new(-4.0, 0.5, -1.0),
            max: Vec3::new(-0.1, 4.0, 1.0),
        };
        let layout = Layout::new(&[b], 0.5).expect("few corners");
        let volume = Volume::new(layout, &obscurance);
        assert!(volume.invalid() > 0);
        for (p, normal) in [
            (Vec3::new(-2.2, 2.1, 0.3), Vec3::X),
            (Vec3::new(-2.2, 2.1, 0.3), Vec3::Y),
            (Vec3::new(-0.4, 1.3, 0.3), -Vec3::X),
            (Vec3::new(-0.4, 1.3, 0.3), -Vec3::Y),
        ] {
            let got = volume.at(p, normal).expect("inside the box")[0];
            let direct = obscurance.about(p, normal, normal, 5).values[0];
            assert!((got - direct).abs() < 0.04, "{p} {normal}: {got} {direct}");
        }
        assert!(volume.at(Vec3::new(-40.0, 1.0, 0.0), Vec3::Y).is_none());
    }
}
