//! Where on an instance obscurance is sampled.

use crate::rng::Rng;
use crate::scene::{Pose, Scene, Surface};
use glam::Vec3;

/// Of so many successive samples one is held out.
const HOLD_OUT: u32 = 4;

/// A sample's place on an instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    pub triangle: u32,
    /// Barycentric weights of the second and third corner.
    pub u: f32,
    pub v: f32,
    /// Square metres that it stands for.
    pub area: f64,
    /// Picks its rays.
    pub seed: u32,
    /// It tells the error of a fit, and does not enter it.
    pub held_out: bool,
}

impl Site {
    /// Barycentric weights of the three corners.
    pub fn weights(&self) -> [f32; 3] {
        [1.0 - self.u - self.v, self.u, self.v]
    }

    /// The surface there, on the front of its triangle.
    pub fn surface(&self, scene: &Scene, pose: &Pose, instance: usize) -> Surface {
        scene.surface(pose, instance, self.triangle as usize, self.u, self.v)
    }
}

/// At most `count` samples on the fronts of an instance, spread evenly by area in the world, one in each of
/// `count` equal parts of it. Those that fall into the holes of MASK materials are left out. See-through
/// triangles have none; an instance without area has none at all.
///
/// Every fourth is held out. Samples follow the order of the triangles, so that those held out lie everywhere.
/// They depend on the instance and the seed alone, whatever else is in the scene.
pub fn place(scene: &Scene, pose: &Pose, instance: usize, count: u32, seed: u64) -> Vec<Site> {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let world = &pose.world_from_mesh[instance];
    let positions = pose.shape(scene, instance);
    let mut total = 0.0;
    // Area up to and with each triangle that takes samples.
    let mut running: Vec<(f64, usize)> = Vec::new();
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let material = scene.material_of(instance, index);
        let corners = triangle.map(|v| world.transform_point3(positions[v as usize]));
        let area = area(corners);
        if area > 0.0 && !material.is_some_and(|m| m.is_see_through()) {
            total += area;
            running.push((total, index));
        }
    }
    if running.is_empty() {
        return Vec::new();
    }
    let mut random = Rng::new(Rng::new(seed).draw());
    let part = total / f64::from(count);
    let mut sites = Vec::with_capacity(count as usize);
    for k in 0..count {
        let at = (f64::from(k) + random.unit_f64()) * part;
        let found = running.partition_point(|r| r.0 <= at);
        let triangle = running[found.min(running.len() - 1)].1;
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let seed = random.draw() as u32;
        if scene.alpha_is_hole(scene.instances[instance].mesh, triangle, u, v) {
            continue;
        }
        sites.push(Site {
            triangle: triangle as u32,
            u,
            v,
            area: part,
            seed,
            held_out: k % HOLD_OUT == HOLD_OUT - 1,
        });
    }
    sites
}

/// Square metres of a triangle; 0 where it is not finite.
fn area([a, b, c]: [Vec3; 3]) -> f64 {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let area = 0.5 * (b - a).cross(c - a).length();
    if area.is_finite() { area } else { 0.0 }
}
