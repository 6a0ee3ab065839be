//! Probe rays into texels.

use super::{Ddgi, End};
use glam::Vec3;

/// How sharply a ray's distance counts for texels off its direction (G3D, RTXGI).
const SHARPNESS: i32 = 50;

impl Ddgi {
    /// The texels of a probe after `rays`: directions and what was found there.
    pub(super) fn blend(&self, probe: usize, rays: &[(Vec3, End)]) -> (Vec<Vec3>, Vec<[f32; 2]>) {
        let fresh = self.frame == 0;
        let keep = if fresh { 0.0 } else { self.options.hysteresis };
        let old = &self.irradiance[probe * self.irradiance_map.texels()..];
        let irradiance = self.irradiance_map.directions.iter().zip(old);
        let irradiance = irradiance.map(|(texel, old)| {
            let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
            // The back of a surface has no light of its own (RTXGI).
            for (direction, end) in rays.iter().filter(|(_, end)| !end.back_face) {
                let weight = texel.dot(*direction).max(0.0);
                weights += weight;
                sum += end.radiance * weight;
            }
            match weights > 0.0 {
                // The weights of all directions are those of a cosine, whose integral is pi.
                true => (std::f32::consts::PI * sum / weights).lerp(*old, keep),
                false => *old,
            }
        });
        let reach = self.reach();
        let old = &self.visibility[probe * self.visibility_map.texels()..];
        let visibility = self.visibility_map.directions.iter().zip(old);
        let visibility = visibility.map(|(texel, old)| {
            let (mut sum, mut weights) = ([0.0; 2], 0.0);
            for (direction, end) in rays {
                let weight = texel.dot(*direction).max(0.0).powi(SHARPNESS);
                // The back of a surface is taken for near, so that a probe in a wall is seen by few.
                let distance = match end.back_face {
                    true => 0.2 * end.distance,
                    false => end.distance.min(reach),
                };
                weights += weight;
                sum[0] += weight * distance;
                sum[1] += weight * distance * distance;
            }
            match weights > 1e-6 {
                true => [0, 1].map(|i| sum[i] / weights * (1.0 - keep) + old[i] * keep),
                false => *old,
            }
        });
        (irradiance.collect(), visibility.collect())
    }
}
