//! Moves scenes that lie far from the origin of their coordinates to it.
//!
//! An `f32` has 24 bits: 1000 km from the origin its steps are 6 cm, and rays would start 2 m off the
//! surface that they leave. So the scene's middle becomes its origin on load, and transforms are put
//! together in `f64`. Meshes whose vertices lie far from their own origin are moved likewise.

use super::Scene;
use glam::{DVec3, Vec3};

/// A scene or a mesh is far away when its middle is so many times the scene's size from the origin.
/// There, rays start 1/5000 of the size off a surface.
const FAR: f32 = 100.0;

impl Scene {
    /// The scene with its origin, and the origins of its meshes, where they are not far away from
    /// what they hold ([`Scene::origin`], [`super::Mesh::origin`]). Says so in [`Scene::warnings`].
    pub(super) fn recentred(mut self) -> Scene {
        // The far scene's own size is lost in the coordinates' steps, and so is that of a scene
        // whose meshes are far away. What was moved may be moved again, by less.
        for _ in 0..2 {
            let Some((min, max)) = self.typical_bounds(&self.pose(0.0)) else {
                return self;
            };
            let (middle, size) = ((min + max) * 0.5, (max - min).length());
            let far = |p: Vec3| p.is_finite() && p.abs().max_element() > FAR * size;
            if far(middle) {
                self.origin += middle.as_dvec3();
            }
            let scales = self.largest_scales();
            for (mesh, scale) in self.meshes.iter_mut().zip(scales) {
                let (low, high) = bounds(&mesh.positions);
                let middle = (low + high) * 0.5;
                if far(middle * scale) {
                    mesh.positions.iter_mut().for_each(|p| *p -= middle);
                    mesh.origin += middle;
                }
            }
            self.cache = super::derived::Cache::default();
        }
        if self.origin != DVec3::ZERO {
            let [x, y, z] = self.origin.to_array();
            self.warnings.push(format!(
                "it lies far from the origin of its coordinates: transforms in the stream count from \
                 ({x}, {y}, {z})"
            ));
        }
        let moved = self.meshes.iter().filter(|m| m.origin != Vec3::ZERO);
        let moved = moved.count();
        if moved > 0 {
            self.warnings.push(format!(
                "the vertices of {moved} of its meshes lie far from their origins: mesh space in the \
                 stream counts from the middle of the mesh"
            ));
        }
        self
    }

    /// The largest scale of any instance of each mesh at the animation's start. Skins may bind a mesh
    /// at another size: those of quantised files do, by their inverse bind matrices.
    fn largest_scales(&self) -> Vec<f32> {
        let mut scales = vec![0.0f32; self.meshes.len()];
        let pose = self.pose(0.0);
        for (i, (instance, world)) in self.instances.iter().zip(&pose.world_from_mesh).enumerate() {
            let m = world.matrix3;
            let scale = [m.x_axis, m.y_axis, m.z_axis].map(|a| a.length());
            let scale = scale.into_iter().fold(0.0, f32::max);
            let deformed = pose.deformed.get(i).and_then(Option::as_ref);
            let bound = deformed.map_or(1.0, |deformed| {
                extent(&deformed.positions) / extent(&self.meshes[instance.mesh].positions)
            });
            scales[instance.mesh] = scales[instance.mesh].max(scale * bound);
        }
        scales
    }
}

fn bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let all = positions.iter();
    all.fold(none, |(low, high), p| (low.min(*p), high.max(*p)))
}

/// Diagonal of the box about positions.
fn extent(positions: &[Vec3]) -> f32 {
    let (low, high) = bounds(positions);
    low.distance(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Channel, ChannelValues, Instance, Interpolation, Mesh, Node};
    use glam::{Affine3A, Quat};

    /// A triangle of a few metres whose vertices are moved by `inner`, below a node at `outer`.
    fn triangle(inner: Vec3, outer: Vec3) -> Scene {
        let node = |translation| Node {
            name: String::new(),
            parent: None,
            translation,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
            matrix: None,
            morph_weights: Vec::new(),
        };
        Scene {
            meshes: vec![Mesh {
                positions: [Vec3::ZERO, Vec3::X * 4.0, Vec3::Z * 3.0]
                    .map(|p| p + inner)
                    .to_vec(),
                normals: vec![Vec3::Y; 3],
                triangles: vec![[0, 2, 1]],
                materials: vec![0],
                ..Mesh::default()
            }],
            nodes: vec![node(outer)],
            instances: vec![Instance {
                node: Some(0),
                ..Instance::default()
            }],
            cameras: vec![Camera {
                name: "eye".into(),
                node: None,
                yfov: 1.0,
                znear: 0.1,
                world_from_camera: Affine3A::from_translation(inner + outer + Vec3::Y),
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn far_nodes_and_far_vertices_come_to_the_origin() {
        let far = Vec3::new(1e6, 0.0, -2e6);
        for (inner, outer) in [(Vec3::ZERO, far), (far, Vec3::ZERO), (-far, far * 2.0)] {
            let scene = triangle(inner, outer).recentred();
            let pose = scene.pose(0.0);
            let (min, max) = scene.bounds(&pose).expect("a triangle");
            assert!(min.abs().max(max.abs()).max_element() < 4.0, "{min} {max}");
            assert_eq!(max - min, Vec3::new(4.0, 0.0, 3.0));
            // Cameras come along; coordinates of the file are the scene's plus its origin.
            let eye = pose.cameras[0].eye();
            assert!((eye - min).abs_diff_eq(Vec3::Y, 1e-3), "{eye} {min}");
            let corner = scene.origin + min.as_dvec3();
            assert!(
                corner.abs_diff_eq((inner + outer).as_dvec3(), 1e-3),
                "{corner}"
            );
            assert_eq!(scene.warnings.len(), 1 + usize::from(inner != Vec3::ZERO));
        }
    }

    #[test]
    fn far_animations_come_along() {
        let mut scene = triangle(Vec3::ZERO, Vec3::X * 1e6);
        scene.duration = 1.0;
        scene.channels = vec![Channel {
            node: 0,
            interpolation: Interpolation::Linear,
            times: vec![0.0, 1.0],
            values: ChannelValues::Translation(vec![Vec3::X * 1e6, Vec3::X * 1e6 + Vec3::Z * 8.0]),
        }];
        let scene = scene.recentred();
        let at = |time| scene.pose(time).world_from_mesh[0].translation;
        assert!((at(0.5) - at(0.0)).abs_diff_eq(glam::Vec3A::Z * 4.0, 1e-6));
        assert!(at(0.0).abs().max_element() < 4.0);
    }

    #[test]
    fn scenes_about_their_origin_stay_as_they_are() {
        let scene = triangle(Vec3::ZERO, Vec3::new(30.0, 2.0, -90.0)).recentred();
        assert_eq!(scene.origin, DVec3::ZERO);
        assert_eq!(scene.meshes[0].origin, Vec3::ZERO);
        assert!(scene.warnings.is_empty());
    }
}
