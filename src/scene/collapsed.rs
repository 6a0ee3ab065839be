//! Instances whose transform leaves nothing of them.

use super::Scene;
use glam::Affine3A;

/// Scales below this share of the largest count as zero.
const FLAT: f32 = 1e-6;

impl Scene {
    /// A sentence about instances that are scaled to a line or a point for the whole animation.
    pub(super) fn collapsed(&self) -> Option<String> {
        let largest = self.largest_placement(0.0, f64::INFINITY);
        let mut gone = self
            .instances
            .iter()
            .zip(&largest)
            .filter(|(_, world)| leaves_a_line(world));
        let (first, _) = gone.next()?;
        let others = match gone.count() {
            0 => String::new(),
            n => format!(" (and {n} more)"),
        };
        Some(format!(
            "{}{others} is scaled to zero along two axes or more: nothing of it can be seen",
            first.name
        ))
    }
}

fn leaves_a_line(world: &Affine3A) -> bool {
    let m = world.matrix3;
    let size = [m.x_axis, m.y_axis, m.z_axis]
        .map(|a| a.length())
        .into_iter()
        .fold(0.0, f32::max);
    // In units of the size: products of small scales would underflow.
    let m = m * (1.0 / size.max(f32::MIN_POSITIVE));
    let faces = [
        m.x_axis.cross(m.y_axis),
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
    ];
    faces.iter().all(|face| face.length() < FLAT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn two_zero_scales_leave_a_line() {
        for (scale, line) in [
            (Vec3::ONE, false),
            (Vec3::splat(1e-9), false),
            (Vec3::new(1.0, 0.0, 1.0), false),
            (Vec3::new(0.0, 3.0, 0.0), true),
            (Vec3::ZERO, true),
        ] {
            assert_eq!(leaves_a_line(&Affine3A::from_scale(scale)), line, "{scale}");
        }
    }
}
