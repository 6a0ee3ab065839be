//! Cameras: which one to use, and how a pixel becomes a ray.
//!
//! One convention for rays and rasterisation: pixel (0, 0) is the upper left; the centre of pixel
//! (x, y) is at (x + 0.5, y + 0.5); clip space is wgpu's, with depth reversed (1 at the near plane,
//! 0 at infinity).

use super::{CameraPose, Pose, Scene};
use crate::{Error, Result};
use glam::{Affine3A, Mat4, Vec3, Vec4};

/// Vertical field of view of cameras that the scene does not define: 50 degrees.
pub const DEFAULT_YFOV: f32 = 0.872_664_6;
/// Near plane of cameras that the scene does not define, in a scene of [`Scene::length_scale`] 1.
const DEFAULT_ZNEAR: f32 = 0.05;

/// A camera at `eye` that looks at `target`, +Y up. `yfov` in radians.
///
/// An eye on its target looks along -Z.
pub fn look_at(eye: Vec3, target: Vec3, yfov: f32) -> CameraPose {
    let backward = (eye - target).try_normalize().unwrap_or(Vec3::Z);
    let right = Vec3::Y.cross(backward).try_normalize().unwrap_or(Vec3::X);
    let up = backward.cross(right);
    CameraPose {
        world_from_camera: Affine3A::from_mat3_translation(
            glam::Mat3::from_cols(right, up, backward),
            eye,
        ),
        yfov,
        znear: DEFAULT_ZNEAR,
    }
}

impl CameraPose {
    /// World space, metres.
    pub fn eye(&self) -> Vec3 {
        self.world_from_camera.translation.into()
    }

    /// Unit direction, in the world, through a point of the picture, in pixels: (x + 0.5, y + 0.5)
    /// is the centre of a pixel. The ray starts at [`CameraPose::eye`].
    pub fn ray(&self, px: f32, py: f32, width: u32, height: u32) -> Vec3 {
        let (w, h) = (width.max(1) as f32, height.max(1) as f32);
        let tan = (self.yfov * 0.5).tan();
        let x = (2.0 * px / w - 1.0) * tan * (w / h);
        let y = (1.0 - 2.0 * py / h) * tan;
        self.world_from_camera
            .transform_vector3(Vec3::new(x, y, -1.0))
            .normalize_or(Vec3::NEG_Z)
    }

    /// Camera from world.
    pub fn view(&self) -> Mat4 {
        Mat4::from(self.world_from_camera.inverse())
    }

    /// Clip from camera: infinite, depth reversed.
    pub fn projection(&self, width: u32, height: u32) -> Mat4 {
        let aspect = width.max(1) as f32 / height.max(1) as f32;
        let f = 1.0 / (self.yfov * 0.5).tan();
        Mat4::from_cols(
            Vec4::new(f / aspect, 0.0, 0.0, 0.0),
            Vec4::new(0.0, f, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 0.0, -1.0),
            Vec4::new(0.0, 0.0, self.znear, 0.0),
        )
    }

    /// Clip from world.
    pub fn view_projection(&self, width: u32, height: u32) -> Mat4 {
        self.projection(width, height) * self.view()
    }
}

impl Scene {
    /// Distance of the near plane that suits the scene's size: 5 cm in rooms and buildings.
    pub fn near_plane(&self) -> f32 {
        DEFAULT_ZNEAR * self.length_scale()
    }

    /// [`look_at`] with the scene's own near plane.
    pub fn look_at(&self, eye: Vec3, target: Vec3, yfov: f32) -> CameraPose {
        CameraPose {
            znear: self.near_plane(),
            ..look_at(eye, target, yfov)
        }
    }

    /// The index of the camera of that name, or of that number. The empty name is the first
    /// camera. `None` for the empty name in a scene without cameras: use [`Scene::framing_camera`].
    ///
    /// # Errors
    ///
    /// [`Error::Invalid`] names the cameras there are.
    pub fn find_camera(&self, name: &str) -> Result<Option<usize>> {
        if name.is_empty() {
            return Ok((!self.cameras.is_empty()).then_some(0));
        }
        if let Some(found) = self.cameras.iter().position(|c| c.name == name) {
            return Ok(Some(found));
        }
        if let Ok(number) = name.parse::<usize>()
            && number < self.cameras.len()
        {
            return Ok(Some(number));
        }
        let names: Vec<&str> = self.cameras.iter().map(|c| c.name.as_str()).collect();
        Err(Error::Invalid(if names.is_empty() {
            format!(
                "scene {} has no cameras; leave the camera out or give an eye and a target",
                self.name
            )
        } else {
            format!(
                "scene {} has no camera {name}; it has {}",
                self.name,
                names.join(", ")
            )
        }))
    }

    /// The camera of that name or number at a pose, or one that frames the scene.
    pub fn camera(&self, pose: &Pose, name: &str) -> Result<CameraPose> {
        match self.find_camera(name)? {
            Some(index) => Ok(pose.cameras[index]),
            None => Ok(self.framing_camera(pose)),
        }
    }

    /// The box about all instances at a pose; `None` for a scene without triangles.
    pub fn bounds(&self, pose: &Pose) -> Option<(Vec3, Vec3)> {
        let mut bounds: Option<(Vec3, Vec3)> = None;
        self.for_each_triangle(pose, |corners| {
            for p in corners {
                let (min, max) = bounds.get_or_insert((p, p));
                *min = min.min(p);
                *max = max.max(p);
            }
        });
        bounds
    }

    /// Calls back with the world-space corners of every triangle, counter-clockwise seen from
    /// outside also where an instance is mirrored.
    pub fn for_each_triangle(&self, pose: &Pose, mut each: impl FnMut([Vec3; 3])) {
        for (i, instance) in self.instances.iter().enumerate() {
            let mesh = &self.meshes[instance.mesh];
            let world = pose.world_from_mesh[i];
            let positions = match pose.deformed.get(i).and_then(|d| d.as_ref()) {
                Some(deformed) => &deformed.positions,
                None => &mesh.positions,
            };
            let mirrored = world.matrix3.determinant() < 0.0;
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| world.transform_point3(positions[v as usize]));
                each(if mirrored { [a, c, b] } else { [a, b, c] });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_and_matrices_agree() {
        let camera = look_at(Vec3::new(3.0, 2.0, 5.0), Vec3::new(-1.0, 0.5, 0.0), 0.9);
        let (w, h) = (480, 270);
        let clip_from_world = camera.view_projection(w, h);
        for (px, py) in [(0.0, 0.0), (480.0, 270.0), (240.0, 135.0), (12.5, 200.5)] {
            let mut last_depth = 2.0;
            for t in [camera.znear * 3.0, 1.0, 40.0] {
                let p = camera.eye() + camera.ray(px, py, w, h) * t;
                let clip = clip_from_world * p.extend(1.0);
                let ndc = clip / clip.w;
                assert!(((ndc.x + 1.0) * 240.0 - px).abs() < 0.02, "{ndc}");
                assert!(((1.0 - ndc.y) * 135.0 - py).abs() < 0.02, "{ndc}");
                assert!(ndc.z > 0.0 && ndc.z < last_depth, "{ndc}");
                last_depth = ndc.z;
            }
        }
        let centre = camera.ray(240.0, 135.0, w, h);
        let to_target = (Vec3::new(-1.0, 0.5, 0.0) - camera.eye()).normalize();
        assert!(centre.abs_diff_eq(to_target, 1e-5));
    }

    #[test]
    fn looking_straight_down_is_no_accident() {
        let camera = look_at(Vec3::Y, Vec3::ZERO, 1.0);
        assert!(camera.ray(0.5, 0.5, 1, 1).abs_diff_eq(Vec3::NEG_Y, 1e-6));
        assert!((camera.world_from_camera.matrix3.determinant() - 1.0).abs() < 1e-5);
    }
}
