//! A simple forward shade: sun and sky, no shadows, one diffuse lobe. It gives ambient occlusion a
//! picture to stand in; it is no lighting model.
//!
//! Colour is linear sRGB. What a surface reflects (`lit`) and what shines by itself or lies behind
//! everything (`emitted`) are kept apart, for AO darkens the former alone.

use super::gbuffer::{Fragment, Lookup, NONE, Visibility, fragment};
use super::tone::tone;
use super::view::View;
use crate::scene::{LightKind, LightPose, Pose, Scene};
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Radiosity of the sky above and the ground below a surface.
const SKY: Vec3 = Vec3::new(0.42, 0.47, 0.55);
const GROUND: Vec3 = Vec3::new(0.27, 0.25, 0.22);
/// Background at the horizon and at the zenith.
const HORIZON: Vec3 = Vec3::new(0.72, 0.78, 0.84);
const ZENITH: Vec3 = Vec3::new(0.28, 0.44, 0.70);
/// Sub-pixels per axis of the supersampled colour: 4 a pixel (PSAO §4.1).
pub const SUBPIXELS: u32 = 2;

/// Colour of one place or pixel before AO.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shade {
    /// Reflected radiance: what AO is multiplied onto.
    pub lit: Vec3,
    /// Emission and background: what AO leaves alone.
    pub emitted: Vec3,
}

/// The lights of a pose, or a default sun where it has none.
pub fn lights(pose: &Pose) -> Vec<LightPose> {
    if !pose.lights.is_empty() {
        return pose.lights.clone();
    }
    vec![LightPose {
        position: Vec3::ZERO,
        direction: Vec3::new(-0.35, -1.0, -0.55).normalize(),
        kind: LightKind::Directional,
        intensity: Vec3::new(1.0, 0.95, 0.86) * 1.6,
        range: f32::INFINITY,
    }]
}

/// Shades what a ray in `direction` saw.
pub fn shade(fragment: &Fragment, direction: Vec3, lights: &[LightPose]) -> Shade {
    if fragment.instance == NONE {
        let up = direction.y.clamp(0.0, 1.0).sqrt();
        return Shade {
            lit: Vec3::ZERO,
            emitted: HORIZON.lerp(ZENITH, up),
        };
    }
    let normal = fragment.normal;
    let mut light = GROUND.lerp(SKY, normal.y * 0.5 + 0.5);
    for l in lights {
        light += irradiance(l, fragment.position, normal) / PI;
    }
    Shade {
        lit: fragment.base_color * light,
        emitted: fragment.emissive,
    }
}

/// Irradiance from one light, unshadowed.
fn irradiance(light: &LightPose, position: Vec3, normal: Vec3) -> Vec3 {
    let ray = light.ray(position);
    light.intensity * (ray.falloff * normal.dot(ray.direction).max(0.0))
}

/// Shades a visibility buffer of [`SUBPIXELS`] times the picture's size per axis and averages the
/// sub-pixels in linear light.
///
/// The tone curve is applied to each sub-pixel, before the average and before AO, so that bright
/// edges stay smooth and an AO error stays proportional in the picture. The sky passes as it is.
pub fn supersampled(scene: &Scene, pose: &Pose, fine_view: &View, fine: &Visibility) -> Vec<Shade> {
    let lights = lights(pose);
    let width = (fine.width / SUBPIXELS) as usize;
    let height = (fine.height / SUBPIXELS) as usize;
    let mut out = vec![Shade::default(); width * height];
    out.par_chunks_mut(width.max(1))
        .enumerate()
        .for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let mut sum = Shade::default();
                for sub in 0..SUBPIXELS * SUBPIXELS {
                    let px = x as u32 * SUBPIXELS + sub % SUBPIXELS;
                    let py = y as u32 * SUBPIXELS + sub / SUBPIXELS;
                    let seen = fine.seen[(py * fine.width + px) as usize];
                    let direction = fine_view.direction(px, py);
                    let fragment = fragment(scene, pose, Lookup::Rest, fine_view, direction, seen);
                    let shade = shade(&fragment, direction, &lights);
                    sum.lit += tone(shade.lit);
                    sum.emitted += if seen.instance == NONE {
                        shade.emitted
                    } else {
                        tone(shade.emitted)
                    };
                }
                let samples = (SUBPIXELS * SUBPIXELS) as f32;
                *out = Shade {
                    lit: sum.lit / samples,
                    emitted: sum.emitted / samples,
                };
            }
        });
    out
}
