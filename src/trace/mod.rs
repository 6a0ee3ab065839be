//! Ray tracing on the CPU: one BVH per mesh, one over the instances.

use crate::scene::{Pose, Scene};
use glam::Vec3;

/// A ray in world space. `direction` is unit length; `t` is in metres.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub t_max: f32,
}

/// The nearest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third vertex.
    pub u: f32,
    pub v: f32,
}

/// The acceleration structures of a scene at one pose.
pub struct Tracer<'s> {
    scene: &'s Scene,
}

impl<'s> Tracer<'s> {
    pub fn new(scene: &'s Scene, _pose: &Pose) -> Self {
        Tracer { scene }
    }
    /// Follows the scene to another pose. Only what moved or deformed is touched.
    pub fn update(&mut self, _pose: &Pose) {
        let _ = self.scene;
        todo!()
    }
    /// Whether anything opaque lies on the ray.
    pub fn occluded(&self, _ray: &Ray) -> bool {
        todo!()
    }
    /// The nearest opaque intersection.
    pub fn closest(&self, _ray: &Ray) -> Option<Hit> {
        todo!()
    }
    /// Share of `rays` cosine-distributed rays about `normal` that travel `distance` metres
    /// unhindered: 1 is open, 0 is closed. `seed` picks the rotation of the sequence.
    pub fn ambient_occlusion(&self, _position: Vec3, _geometric_normal: Vec3, _normal: Vec3, _rays: u32, _distance: f32, _seed: u32) -> f32 {
        todo!()
    }
}
