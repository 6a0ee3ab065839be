//! Where on the faces obscurance is sampled.

use super::shape::Shape;
use crate::rng::Rng;
use crate::scene::{Alpha, Pose, Scene, Surface};

/// How many samples a face takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Samples per square metre; a face with an area takes at least one.
    pub density: f64,
    /// Most samples of a face. Coarse faces far away would else take most of them (section 2.1); each
    /// sample is weighted by the area that it stands for.
    pub max_per_face: u32,
}

impl Default for Sampling {
    fn default() -> Self {
        Sampling {
            density: 64.0,
            max_per_face: 16,
        }
    }
}

/// A sample's place on a mesh.
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
}

impl Site {
    /// Barycentric weights of the three corners.
    pub fn weights(&self) -> [f64; 3] {
        let (u, v) = (f64::from(self.u), f64::from(self.v));
        [1.0 - u - v, u, v]
    }

    /// The surface there, on the front of its triangle.
    pub fn surface(&self, scene: &Scene, pose: &Pose, instance: usize) -> Surface {
        scene.surface(pose, instance, self.triangle as usize, self.u, self.v)
    }
}

/// The samples of an instance, face by face. Those of a face form a lattice that is shifted by a
/// number of its own. None lie in the holes of MASK materials, whose area nothing stands for.
///
/// All are on the front, by the winding, also on double-sided faces: a vertex has one value for both
/// sides. Exporters mark closed bodies and the walls of rooms double-sided, and a mean with what the other
/// side sees, the outside of a room, would be right for neither.
///
/// Deterministic: a face keeps its samples whatever else is in the scene before it.
pub fn place(scene: &Scene, instance: usize, shape: &Shape, sampling: Sampling) -> Vec<Site> {
    let mesh = scene.instances[instance].mesh;
    let mut sites = Vec::new();
    for (t, &area) in shape.areas.iter().enumerate() {
        if !shape.receives[t] {
            continue;
        }
        let wanted = (area * sampling.density).ceil();
        let count = (wanted as u32).clamp(1, sampling.max_per_face.max(1));
        let material = scene.material_of(instance, t);
        let masked = material.is_some_and(|m| matches!(m.alpha, Alpha::Mask { .. }));
        let shift = face_seed(instance, t);
        for k in 0..count {
            let (u, v) = on_triangle(lattice(k, count, shift));
            if masked && scene.alpha_is_hole(mesh, t, u, v) {
                continue;
            }
            sites.push(Site {
                triangle: t as u32,
                u,
                v,
                area: area / f64::from(count),
                seed: (shift as u32).wrapping_add(k),
            });
        }
    }
    sites
}

/// Point `k` of a Fibonacci lattice of `count` points in the unit square, shifted.
fn lattice(k: u32, count: u32, shift: u64) -> [f64; 2] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let fraction = |bits: u64| (bits as u32) as f64 / 4_294_967_296.0;
    let a = (f64::from(k) + fraction(shift)) / f64::from(count);
    let b = (f64::from(k) * GOLDEN + fraction(shift >> 32)).fract();
    [a, b]
}

/// Maps the unit square to barycentric weights of the second and third corner; keeps areas.
fn on_triangle([a, b]: [f64; 2]) -> (f32, f32) {
    let r = a.sqrt();
    ((r * (1.0 - b)) as f32, (r * b) as f32)
}

/// Random bits of a face, the same whatever else is in the scene.
pub(super) fn face_seed(instance: usize, triangle: usize) -> u64 {
    Rng::new((instance as u64) << 32 | triangle as u64).draw()
}
