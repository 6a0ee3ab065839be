//! Coarse visibility (PSAO §3.3): points outside an extended field of view are skipped.

use crate::scene::CameraPose;
use crate::trace::Aabb;
use glam::Vec3;

/// A view pyramid without near and far planes.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    eye: Vec3,
    /// Inward unit normals of the four sides.
    sides: [Vec3; 4],
}

impl Frustum {
    /// The camera's view, each half angle widened by `margin` radians and kept below a right angle.
    pub fn new(camera: &CameraPose, aspect: f32, margin: f32) -> Frustum {
        let most = 89f32.to_radians();
        let vertical = (camera.yfov * 0.5 + margin).min(most);
        let horizontal = (((camera.yfov * 0.5).tan() * aspect).atan() + margin).min(most);
        let m = camera.world_from_camera.matrix3;
        let (right, up, back) = (
            Vec3::from(m.x_axis),
            Vec3::from(m.y_axis),
            Vec3::from(m.z_axis),
        );
        let side = |axis: Vec3, half: f32| axis * half.cos() - back * half.sin();
        Frustum {
            eye: camera.world_from_camera.translation.into(),
            sides: [
                side(right, horizontal),
                side(-right, horizontal),
                side(up, vertical),
                side(-up, vertical),
            ],
        }
    }

    pub fn contains(&self, p: Vec3) -> bool {
        self.sides.iter().all(|n| n.dot(p - self.eye) >= 0.0)
    }

    /// False only for boxes that lie wholly outside one side.
    pub fn touches(&self, bounds: &Aabb) -> bool {
        let (centre, half) = (bounds.centre() - self.eye, (bounds.max - bounds.min) * 0.5);
        self.sides
            .iter()
            .all(|n| n.dot(centre) + n.abs().dot(half) >= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;

    #[test]
    fn sees_ahead_and_only_ahead() {
        let camera = CameraPose {
            world_from_camera: Affine3A::from_translation(Vec3::new(1.0, 2.0, 3.0)),
            yfov: 60f32.to_radians(),
            znear: 0.1,
        };
        let exact = Frustum::new(&camera, 1.0, 0.0);
        let wide = Frustum::new(&camera, 1.0, 15f32.to_radians());
        let at = |degrees: f32| {
            Vec3::new(1.0, 2.0, 3.0)
                + Vec3::new(degrees.to_radians().sin(), 0.0, -degrees.to_radians().cos())
        };
        for (degrees, in_exact, in_wide) in [
            (0.0, true, true),
            (29.0, true, true),
            (31.0, false, true),
            (44.0, false, true),
            (46.0, false, false),
            (180.0, false, false),
        ] {
            assert_eq!(exact.contains(at(degrees)), in_exact, "{degrees}");
            assert_eq!(wide.contains(at(-degrees)), in_wide, "{degrees}");
            let b = Aabb {
                min: at(degrees) - 0.001,
                max: at(degrees) + 0.001,
            };
            assert_eq!(wide.touches(&b), in_wide, "{degrees}");
        }
    }
}
