//! Surfaces that shine: a table of their triangles to send shadow rays to.
//!
//! A triangle is drawn with a probability proportional to its area times the luminance of its
//! radiance. So the density of a point depends on its material alone, and a ray that happens upon
//! an emitter knows the density that it would have been drawn with.

use super::bsdf::luminance;
use crate::scene::{Alpha, Pose, Scene};
use crate::trace::Tracer;
use glam::Vec3;

/// All emissive triangles at one pose.
pub struct Emitters {
    triangles: Vec<Triangle>,
    /// Power up to and with each triangle, over that of all.
    cumulative: Vec<f64>,
    /// Sum of area times luminance.
    power: f64,
}

struct Triangle {
    instance: u32,
    triangle: u32,
    corner: Vec3,
    edges: [Vec3; 2],
    /// Unit, of the front.
    normal: Vec3,
    radiance: Vec3,
    double_sided: bool,
}

/// A place on an emitter.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    pub position: Vec3,
    /// Unit, of the front.
    pub normal: Vec3,
    pub radiance: Vec3,
    /// Whether the back shines, too.
    pub double_sided: bool,
    /// Per square metre.
    pub density: f32,
}

impl Emitters {
    /// Those of a scene at a pose, at which `tracer` stands. What no ray can hit is left out (BLEND
    /// materials, instances without extent), since light is found by rays, too.
    pub fn new(scene: &Scene, pose: &Pose, tracer: &Tracer) -> Emitters {
        let shines: Vec<bool> = scene
            .materials
            .iter()
            .map(|m| luminance(m.emissive) > 0.0 && m.alpha != Alpha::Blend)
            .collect();
        let mut all = Emitters {
            triangles: Vec::new(),
            cumulative: Vec::new(),
            power: 0.0,
        };
        for (i, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            if tracer.bounds(i).is_empty() || !mesh.materials.iter().any(|m| shines[*m as usize]) {
                continue;
            }
            let positions = pose.shape(scene, i);
            let world = &pose.world_from_mesh[i];
            let mirrored = world.matrix3.determinant() < 0.0;
            for (t, corners) in mesh.triangles.iter().enumerate() {
                let material = mesh.materials[t] as usize;
                if !shines[material] {
                    continue;
                }
                let [a, b, c] = corners.map(|v| world.transform_point3(positions[v as usize]));
                let edges = [b - a, c - a];
                let cross = edges[0].cross(edges[1]);
                let Some(normal) = cross.try_normalize() else {
                    continue;
                };
                let material = &scene.materials[material];
                let power = 0.5 * f64::from(cross.length() * luminance(material.emissive));
                if !(power > 0.0 && power.is_finite()) {
                    continue;
                }
                all.power += power;
                all.cumulative.push(all.power);
                all.triangles.push(Triangle {
                    instance: i as u32,
                    triangle: t as u32,
                    corner: a,
                    edges,
                    normal: if mirrored { -normal } else { normal },
                    radiance: material.emissive,
                    double_sided: material.double_sided,
                });
            }
        }
        for sum in &mut all.cumulative {
            *sum /= all.power;
        }
        all
    }

    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The density per square metre with which a point of this radiance is drawn.
    pub fn density(&self, radiance: Vec3) -> f32 {
        (f64::from(luminance(radiance)) / self.power) as f32
    }

    /// Draws a place: the triangle by `choice`, the point on it by `u`, all uniform in [0, 1).
    /// `None` where there are no emitters or the place is a hole of a MASK material.
    pub fn sample(&self, scene: &Scene, choice: f32, u: [f32; 2]) -> Option<Source> {
        let at = self.cumulative.partition_point(|c| *c <= f64::from(choice));
        let t = self
            .triangles
            .get(at.min(self.triangles.len().wrapping_sub(1)))?;
        let r = u[0].sqrt();
        let (v, w) = (r * (1.0 - u[1]), r * u[1]);
        let mesh = scene.instances[t.instance as usize].mesh;
        if scene.alpha_is_hole(mesh, t.triangle as usize, v, w) {
            return None;
        }
        Some(Source {
            position: t.corner + t.edges[0] * v + t.edges[1] * w,
            normal: t.normal,
            radiance: t.radiance,
            double_sided: t.double_sided,
            density: self.density(t.radiance),
        })
    }
}
