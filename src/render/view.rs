//! A camera over a raster: the ray through a pixel and the matrix of the same projection, so that
//! primary rays and rasterisation see the same picture.

use crate::scene::CameraPose;
use glam::{Mat4, Vec3, Vec4};

/// A pinhole camera that looks at `width` x `height` square pixels, the first at the top left.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub width: u32,
    pub height: u32,
    /// World position of the eye.
    pub origin: Vec3,
    /// Unit, where the camera looks.
    pub forward: Vec3,
    /// From the picture's centre to its right and top edge at distance 1.
    right: Vec3,
    up: Vec3,
    pub znear: f32,
    /// Reversed depth without a far plane: 1 at `znear`, 0 at infinity.
    pub clip_from_world: Mat4,
}

impl View {
    pub fn new(camera: &CameraPose, width: u32, height: u32) -> Self {
        let aspect = width as f32 / height.max(1) as f32;
        let tan = (camera.yfov * 0.5).tan();
        let m = camera.world_from_camera.matrix3;
        let projection = Mat4::from_cols(
            Vec4::new(1.0 / (tan * aspect), 0.0, 0.0, 0.0),
            Vec4::new(0.0, 1.0 / tan, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 0.0, -1.0),
            Vec4::new(0.0, 0.0, camera.znear, 0.0),
        );
        Self {
            width,
            height,
            origin: camera.world_from_camera.translation.into(),
            forward: Vec3::from(-m.z_axis),
            right: Vec3::from(m.x_axis) * tan * aspect,
            up: Vec3::from(m.y_axis) * tan,
            znear: camera.znear,
            clip_from_world: projection * Mat4::from(camera.world_from_camera.inverse()),
        }
    }

    /// Unit direction from the eye through the centre of pixel (x, y).
    pub fn direction(&self, x: u32, y: u32) -> Vec3 {
        let s = (x as f32 + 0.5) / self.width as f32 * 2.0 - 1.0;
        let t = 1.0 - (y as f32 + 0.5) / self.height as f32 * 2.0;
        (self.forward + self.right * s + self.up * t).normalize()
    }
}
