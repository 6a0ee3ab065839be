//! How large a scene is, and the default lengths that follow from it.

use super::{Pose, Scene};
use glam::Vec3;
use rayon::prelude::*;

/// Share of the scene's corners that lies outside of its box on either side of each axis.
const OUTLIERS: f64 = 0.05;
/// Scenes from a piece of furniture to a building, metres across: lengths are those of the paper.
const FURNITURE: f32 = 4.0;
const BUILDING: f32 = 40.0;
/// Scenes larger than this are landscapes, or not in metres.
const LANDSCAPE: f32 = 250.0;
/// What those are taken for: a scene so many metres across.
const REFERENCE_SIZE: f32 = 10.0;

/// The factor on lengths that are chosen for a scene of 4 to 40 m, given a scene's size.
///
/// Smaller scenes have them in proportion, and so do larger ones up to 250 m. Numbers beyond that are
/// most often centimetres or millimetres: the scene is taken for one of 10 m.
pub fn length_scale(size: f32) -> f32 {
    if !(size > 0.0 && size.is_finite()) {
        1.0
    } else if size < FURNITURE {
        size / FURNITURE
    } else if size <= BUILDING {
        1.0
    } else if size <= LANDSCAPE {
        size / BUILDING
    } else {
        size / REFERENCE_SIZE
    }
}

impl Scene {
    /// Diagonal of [`Scene::typical_bounds`] at the animation's start; 0 for an empty scene.
    pub fn size(&self) -> f32 {
        *self.cache.size.get_or_init(|| {
            let bounds = self.typical_bounds(&self.pose(0.0));
            bounds.map_or(0.0, |(min, max)| (max - min).length())
        })
    }

    /// [`length_scale`] of the scene's size.
    pub fn length_scale(&self) -> f32 {
        length_scale(self.size())
    }

    /// The box that most of the scene lies in: per axis, from the 5th to the 95th percentile of the
    /// corners of all triangles, each weighted by the square root of its triangle's area. So neither
    /// a large ground plane of two triangles nor a small object of a million decides alone. `None`
    /// for a scene without triangles.
    pub fn typical_bounds(&self, pose: &Pose) -> Option<(Vec3, Vec3)> {
        let mut corners: Vec<(Vec3, f32)> = Vec::new();
        self.for_each_triangle(pose, |[a, b, c]| {
            let weight = (b - a).cross(c - a).length().sqrt();
            if weight.is_finite() {
                corners.extend([a, b, c].map(|p| (p, weight)));
            }
        });
        if corners.is_empty() {
            return None;
        }
        let total: f64 = corners.iter().map(|c| f64::from(c.1)).sum();
        let (mut min, mut max) = (Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            // By weight, too, so that the order does not depend on the sort.
            corners.par_sort_unstable_by(|a, b| {
                let by_place = a.0[axis].total_cmp(&b.0[axis]);
                by_place.then(a.1.total_cmp(&b.1))
            });
            let mut below = 0.0;
            let mut at = |share: f64, from: usize| {
                for (i, (p, weight)) in corners.iter().enumerate().skip(from) {
                    if below + f64::from(*weight) >= share * total {
                        return (p[axis], i);
                    }
                    below += f64::from(*weight);
                }
                (corners[corners.len() - 1].0[axis], corners.len())
            };
            let (low, from) = at(OUTLIERS, 0);
            (min[axis], max[axis]) = (low, at(1.0 - OUTLIERS, from).0);
        }
        Some((min, max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Mesh};

    /// Boxes of two triangles a side: smallest corner and size.
    fn boxes(all: &[(Vec3, Vec3)]) -> Scene {
        let mut mesh = Mesh::default();
        for (min, size) in all {
            let first = mesh.positions.len() as u32;
            let corner = |i: u32| *min + *size * Vec3::from([0, 1, 2].map(|b| (i >> b & 1) as f32));
            mesh.positions.extend((0..8).map(corner));
            for [a, b, c, d] in [
                [0, 4, 6, 2],
                [1, 3, 7, 5],
                [0, 1, 5, 4],
                [2, 6, 7, 3],
                [0, 2, 3, 1],
                [4, 5, 7, 6],
            ] {
                mesh.triangles.push([first + a, first + b, first + c]);
                mesh.triangles.push([first + a, first + c, first + d]);
            }
        }
        mesh.normals = vec![Vec3::Y; mesh.positions.len()];
        mesh.materials = vec![0; mesh.triangles.len()];
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance::default()],
            ..Scene::default()
        }
    }

    #[test]
    fn lengths_follow_the_size_of_small_and_large_scenes() {
        for (size, scale) in [
            (5.7, 1.0),
            (38.0, 1.0),
            (0.4, 0.1),
            (80.0, 2.0),
            (6000.0, 600.0),
        ] {
            assert!((length_scale(size) - scale).abs() < 1e-6 * scale, "{size}");
        }
        assert_eq!(Scene::default().length_scale(), 1.0);
        let room = boxes(&[(Vec3::ZERO, Vec3::new(5.0, 3.0, 4.0))]).size();
        let in_millimetres = boxes(&[(Vec3::ZERO, Vec3::new(5e3, 3e3, 4e3))]).size();
        assert!((in_millimetres / room - 1000.0).abs() < 0.01);
    }

    #[test]
    fn a_far_object_and_a_large_ground_do_not_decide_the_size() {
        let room = (Vec3::ZERO, Vec3::new(8.0, 3.0, 6.0));
        let tables = (0..60).map(|i| {
            let at = Vec3::new((i % 8) as f32, 0.0, (i / 8) as f32 * 0.7);
            (at, Vec3::splat(0.8))
        });
        let mut all: Vec<(Vec3, Vec3)> = tables.chain([room]).collect();
        let plain = boxes(&all).size();
        all.push((Vec3::new(900.0, 0.0, 0.0), Vec3::splat(0.5)));
        let stray = boxes(&all).size();
        assert!((stray - plain).abs() < 0.1 * plain, "{plain} {stray}");
    }
}
