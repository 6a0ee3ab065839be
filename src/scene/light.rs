//! Punctual lights: where their light comes from at a place, and how much it is.
//!
//! The falloffs are those of KHR_lights_punctual, for all that shades: pictures, shadows, paths.

use super::{Alpha, Instance, LightKind, LightPose, Scene};
use glam::Vec3;

/// The light of one punctual light at a place, before anything shadows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightRay {
    /// Unit, towards the light; zero in the very place of the light.
    pub direction: Vec3,
    /// Metres to the light; infinite for a directional one.
    pub distance: f32,
    /// Times [`LightPose::intensity`] it is the irradiance of a surface that faces the light.
    pub falloff: f32,
}

/// Metres below which light grows no more: nothing is nearer than 1 cm to a lamp, and what is casts
/// no shadow, as in a shadow map. So a lamp in the plane of a ceiling is not hidden by rounding.
pub const NEAREST: f32 = 0.01;

const NEAREST_SQUARED: f32 = 1e-4;

impl LightPose {
    /// How the light arrives at a place: inverse square with the extension's window at
    /// [`LightPose::range`], and the cone of a spot.
    pub fn ray(&self, position: Vec3) -> LightRay {
        let (direction, distance, attenuation) = match self.kind {
            LightKind::Directional => (-self.direction, f32::INFINITY, 1.0),
            LightKind::Point | LightKind::Spot { .. } => {
                let offset = self.position - position;
                let d2 = offset.length_squared().max(NEAREST_SQUARED);
                let window = (1.0 - (d2 / (self.range * self.range)).powi(2)).clamp(0.0, 1.0);
                (offset.normalize_or_zero(), offset.length(), window / d2)
            }
        };
        let cone = match self.kind {
            LightKind::Spot { inner, outer } => {
                let (inner, outer) = (inner.cos(), outer.cos());
                let t = (self.direction.dot(-direction) - outer) / (inner - outer).max(1e-3);
                t.clamp(0.0, 1.0).powi(2)
            }
            _ => 1.0,
        };
        LightRay {
            direction,
            distance,
            falloff: attenuation * cone,
        }
    }
}

impl Scene {
    /// Whether any material lets a share of light through.
    pub fn transmits(&self) -> bool {
        self.materials.iter().any(|m| m.transmission > 0.0)
    }

    /// Whether anything in the scene sends light to other surfaces: a punctual light with an
    /// intensity, or an emissive surface.
    pub fn has_light(&self) -> bool {
        let shines = |m: &u32| {
            let material = self.materials.get(*m as usize);
            material.is_some_and(|m| m.emissive.max_element() > 0.0 && m.alpha != Alpha::Blend)
        };
        let drawn = |i: &Instance| self.meshes[i.mesh].materials.iter().any(shines);
        self.lights.iter().any(|l| l.intensity.max_element() > 0.0)
            || self.instances.iter().any(drawn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lamp(kind: LightKind) -> LightPose {
        LightPose {
            position: Vec3::new(0.0, 3.0, 0.0),
            direction: Vec3::NEG_Y,
            kind,
            intensity: Vec3::ONE,
            range: f32::INFINITY,
        }
    }

    #[test]
    fn a_point_light_falls_off_with_the_square() {
        let ray = lamp(LightKind::Point).ray(Vec3::new(0.0, 1.0, 0.0));
        assert_eq!(
            ray,
            LightRay {
                direction: Vec3::Y,
                distance: 2.0,
                falloff: 0.25
            }
        );
        let ranged = LightPose {
            range: 2.0,
            ..lamp(LightKind::Point)
        };
        assert_eq!(ranged.ray(Vec3::new(0.0, 0.5, 0.0)).falloff, 0.0);
    }

    #[test]
    fn a_spot_is_bright_inside_and_dark_outside_of_its_cone() {
        let spot = lamp(LightKind::Spot {
            inner: 0.2,
            outer: 0.4,
        });
        let at = |angle: f32| spot.ray(Vec3::new(angle.tan(), 2.0, 0.0));
        let full = |angle: f32| angle.cos().powi(2);
        assert!((at(0.1).falloff - full(0.1)).abs() < 1e-6);
        assert_eq!(at(0.45).falloff, 0.0);
        assert!(at(0.3).falloff > 0.0 && at(0.3).falloff < full(0.3));
    }

    #[test]
    fn the_sun_is_as_bright_everywhere() {
        let ray = lamp(LightKind::Directional).ray(Vec3::splat(1e4));
        assert_eq!(
            (ray.direction, ray.distance, ray.falloff),
            (Vec3::Y, f32::INFINITY, 1.0)
        );
    }
}
