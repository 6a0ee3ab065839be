//! A camera over a raster.

use crate::scene::CameraPose;
use glam::{Mat4, Vec3};

/// A camera that looks at `width` x `height` square pixels, the first at the top left.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub camera: CameraPose,
    pub width: u32,
    pub height: u32,
}

impl View {
    pub fn new(camera: &CameraPose, width: u32, height: u32) -> Self {
        Self {
            camera: *camera,
            width,
            height,
        }
    }

    /// Unit direction from the eye through the centre of pixel (x, y).
    pub fn direction(&self, x: u32, y: u32) -> Vec3 {
        self.camera
            .ray(x as f32 + 0.5, y as f32 + 0.5, self.width, self.height)
    }

    /// Unit, where the camera looks.
    pub fn forward(&self) -> Vec3 {
        -Vec3::from(self.camera.world_from_camera.matrix3.z_axis)
    }

    pub fn clip_from_world(&self) -> Mat4 {
        self.camera.view_projection(self.width, self.height)
    }
}
