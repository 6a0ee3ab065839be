//! The light of a rasterised picture, DDISH-GI §3.2: direct light of punctual lights through shadow
//! maps, diffuse and glossy indirect light from probes, emission; each by itself, so that methods
//! can be held to the parts of a path-traced picture.
//!
//! [`device`] runs it as compute passes over the G-buffer; the functions here are its twin. The
//! material is the path tracer's ([`Bsdf`]), and so are the lights: a scene without any is dark.
//! Light of emissive surfaces is the probes' business.

pub mod device;

use super::gbuffer::{Fragment, GBuffer, NONE};
use super::probes::volume_at;
use super::shadow::Maps;
use super::view::View;
use crate::probes::client::ProbesVolume;
use crate::probes::sample::{self, Field, Material};
use crate::scene::{LightPose, Pose};
use crate::trace::path::bsdf::{Bsdf, seen_normal};
use crate::trace::path::{PathTracer, Sky};
use crate::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;
use std::time::Duration;

pub use crate::probes::sample::Indirect;

/// How light is interpolated between probes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Interpolation {
    /// [`sample::trilinear`]: what a texture unit does.
    #[cfg_attr(feature = "cli", value(help = "As a texture unit does"))]
    Trilinear = 0, // SHARED with `light.wgsl`
    /// [`sample::visibility_weighted`]: light does not come through walls.
    #[cfg_attr(
        feature = "cli",
        value(help = "With the visibility block, so that light does not leak through walls")
    )]
    #[default]
    VisibilityWeighted = 1, // SHARED
}

/// Where indirect light comes from.
#[derive(Clone, Copy, Debug)]
pub enum Source<'a> {
    /// Nowhere: direct light alone.
    None,
    /// Volumes of probes. Each place is lit by the first volume that holds it, else by the nearest.
    Probes {
        volumes: &'a [ProbesVolume<'a>],
        interpolation: Interpolation,
        /// Darkens the light of probes where they see no detail.
        occlusion: Option<Occlusion<'a>>,
    },
    /// Another method has found it, a value a pixel.
    Supplied(&'a [Indirect]),
}

/// Strength of ambient occlusion on the light of probes that is right on average
/// (`dapple chart --model points,probes`).
pub const OCCLUSION_STRENGTH: f32 = 0.5;

/// Ambient occlusion of another model on the light of probes. Probes know what is a spacing away; of
/// what is nearer, AO of a short distance knows. Diffuse and glossy light are multiplied alike.
#[derive(Clone, Copy, Debug)]
pub struct Occlusion<'a> {
    /// A value a pixel, 1 where nothing is near.
    pub ao: &'a [f32],
    /// 0 to 1: none of it to all of it, usually [`OCCLUSION_STRENGTH`].
    pub strength: f32,
}

impl Occlusion<'_> {
    /// The factor on the indirect light of a pixel.
    pub fn factor(&self, pixel: usize) -> f32 {
        1.0 - self.strength * (1.0 - self.ao.get(pixel).copied().unwrap_or(1.0))
    }
}

/// Linear radiance towards the eye by where it comes from, one value a pixel, row by row from the
/// top.
#[derive(Clone, Debug, PartialEq)]
pub struct Lit {
    pub width: u32,
    pub height: u32,
    /// Punctual lights, reflected by base and coat.
    pub direct: Vec<Vec3>,
    /// Indirect light reflected by the base.
    pub diffuse: Vec<Vec3>,
    /// Indirect light reflected by the coat.
    pub glossy: Vec<Vec3>,
    /// Of the surface itself; of the sky where no surface is seen.
    pub emitted: Vec<Vec3>,
}

impl Lit {
    /// All of it: what [`super::tone::develop`] takes.
    pub fn radiance(&self) -> Vec<Vec3> {
        (0..self.direct.len())
            .map(|i| self.direct[i] + self.diffuse[i] + self.glossy[i] + self.emitted[i])
            .collect()
    }

    /// What the path tracer calls its indirect part.
    pub fn indirect(&self) -> Vec<Vec3> {
        let pairs = self.diffuse.iter().zip(&self.glossy);
        pairs.map(|(d, g)| *d + *g).collect()
    }
}

/// How long each stage took, waiting for it to end. On a device with its submission and without
/// reading back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timings {
    /// Uploading pixels, lights and probes; 0 on the CPU.
    pub upload: Duration,
    /// Drawing those shadow maps that changed since the last call, or tracing all of them.
    pub shadows: Duration,
    pub direct: Duration,
    pub indirect: Duration,
    /// Reading back the result.
    pub read: Duration,
}

/// A question to the passes: 64 bytes, as in `light.wgsl`.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Pixel {
    pub position: [f32; 3],
    /// Index of the volume, [`NO_VOLUME`] or [`SKY`].
    pub volume: u32,
    pub geometric_normal: [f32; 3],
    pub roughness: f32,
    pub normal: [f32; 3],
    pub metallic: f32,
    pub base_color: [f32; 3],
    /// Factor on indirect light: [`Occlusion::factor`].
    pub open: f32,
}

/// No volume lights it. SHARED with `light.wgsl`.
pub(super) const NO_VOLUME: u32 = u32::MAX;
/// There is no surface that reflects light. SHARED.
pub(super) const SKY: u32 = u32::MAX - 1;

/// A source of indirect light is complete and of this picture.
pub(super) fn check(gbuffer: &GBuffer, source: &Source) -> Result<()> {
    match source {
        Source::None => Ok(()),
        Source::Probes {
            volumes, occlusion, ..
        } => {
            volumes.iter().try_for_each(ProbesVolume::check)?;
            match occlusion {
                Some(o) if o.ao.len() != gbuffer.fragments.len() => {
                    Err(misfit("ambient occlusion", o.ao.len(), gbuffer))
                }
                _ => Ok(()),
            }
        }
        Source::Supplied(light) if light.len() == gbuffer.fragments.len() => Ok(()),
        Source::Supplied(light) => Err(misfit("indirect light", light.len(), gbuffer)),
    }
}

fn misfit(what: &str, pixels: usize, gbuffer: &GBuffer) -> Error {
    Error::Invalid(format!(
        "{what} of {pixels} pixels does not fit a picture of {}",
        gbuffer.fragments.len()
    ))
}

pub(super) fn pixels(gbuffer: &GBuffer, source: &Source) -> Vec<Pixel> {
    let (volumes, occlusion) = match source {
        Source::Probes {
            volumes, occlusion, ..
        } => (*volumes, *occlusion),
        _ => (&[][..], None),
    };
    let pixel = |(i, f): (usize, &Fragment)| Pixel {
        position: f.position.to_array(),
        volume: if f.instance == NONE || f.unlit {
            SKY
        } else {
            volume_at(volumes, f.position).map_or(NO_VOLUME, |v| v as u32)
        },
        geometric_normal: f.geometric_normal.to_array(),
        roughness: f.roughness,
        normal: f.normal.to_array(),
        metallic: f.metallic,
        base_color: f.base_color.to_array(),
        open: occlusion.map_or(1.0, |o| o.factor(i)),
    };
    gbuffer
        .fragments
        .par_iter()
        .enumerate()
        .map(pixel)
        .collect()
}

/// Emission of what is seen, and the sky.
pub(super) fn emitted(gbuffer: &GBuffer, view: &View, sky: &Sky) -> Vec<Vec3> {
    let one = |(i, f): (usize, &Fragment)| {
        if f.instance != NONE {
            return f.emissive;
        }
        let (x, y) = (i as u32 % view.width, i as u32 / view.width);
        sky.radiance(view.direction(x, y))
    };
    gbuffer.fragments.par_iter().enumerate().map(one).collect()
}

/// Light of a surface by punctual lights. Twin of `direct` in `light.wgsl`.
pub(super) fn direct(pixel: &Pixel, eye: Vec3, lights: &[LightPose], maps: &Maps) -> Vec3 {
    if pixel.volume == SKY {
        return Vec3::ZERO;
    }
    let position = Vec3::from(pixel.position);
    let geometric_normal = Vec3::from(pixel.geometric_normal);
    let v = (eye - position).normalize_or(geometric_normal);
    let n = seen_normal(pixel.normal.into(), v);
    let bsdf = Bsdf::new(pixel.base_color.into(), pixel.metallic, pixel.roughness);
    let mut sum = Vec3::ZERO;
    for (i, light) in lights.iter().enumerate() {
        let to = light.ray(position);
        if to.falloff <= 0.0 || to.direction.dot(geometric_normal) <= 0.0 {
            continue;
        }
        let f = bsdf.evaluate(n, v, to.direction);
        let open = maps.lit(i, position, geometric_normal);
        sum += f * light.intensity * (to.falloff * open);
    }
    sum
}

/// Direct light as windows and what else transmits leave it: shadow maps know of neither tint nor
/// shares, so rays are traced. The same for the device and its twin.
pub(super) fn transmit(direct: &mut [Vec3], gbuffer: &GBuffer, view: &View, paths: &PathTracer) {
    let eye = view.camera.eye();
    direct
        .par_iter_mut()
        .zip(&gbuffer.fragments)
        .for_each(|(light, fragment)| {
            if fragment.instance == NONE {
                return;
            }
            // From just before the surface, so that it is the one that is found.
            let direction = (fragment.position - eye).normalize_or(view.forward());
            let distance = fragment.position.distance(eye);
            let origin = eye + direction * (distance - 1e-3 * distance);
            let seen = paths.first(origin, direction, true).0;
            if let Some(vertex) = seen.filter(|v| v.distance < 2e-3 * distance) {
                *light = (*light + paths.transmitted(&vertex)).max(Vec3::ZERO);
            }
        });
}

/// Light of a surface by the probes of its volume. Twin of `indirect` in `light.wgsl`.
pub(super) fn indirect(
    pixel: &Pixel,
    eye: Vec3,
    volumes: &[ProbesVolume],
    fields: &[Field],
    interpolation: Interpolation,
) -> Indirect {
    let number = pixel.volume as usize;
    let (Some(volume), Some(field)) = (volumes.get(number), fields.get(number)) else {
        return Indirect::default();
    };
    let position = Vec3::from(pixel.position);
    let v = (eye - position).normalize_or(pixel.geometric_normal.into());
    let n = seen_normal(pixel.normal.into(), v);
    let grid = &volume.grid_from_world;
    let x = grid.transform_point3(position);
    let [n, v, facing] = [n, v, pixel.geometric_normal.into()].map(|d| grid.transform_vector3(d));
    let radiance = match interpolation {
        Interpolation::Trilinear => sample::trilinear(field, x),
        // Which probes see a place is a matter of geometry, not of a normal map.
        Interpolation::VisibilityWeighted => sample::visibility_weighted(field, x, facing, v),
    };
    let material = Material {
        base_color: pixel.base_color.into(),
        metallic: pixel.metallic,
        roughness: pixel.roughness,
    };
    let Indirect { diffuse, glossy } = sample::shade(&radiance, &material, n, v);
    Indirect {
        diffuse: diffuse * pixel.open,
        glossy: glossy * pixel.open,
    }
}

/// Light of all pixels on the CPU: direct, then diffuse and glossy.
pub(super) fn on_cpu(
    pixels: &[Pixel],
    eye: Vec3,
    pose: &Pose,
    maps: &Maps,
    source: &Source,
    timings: &mut Timings,
) -> (Vec<Vec3>, Vec<Indirect>) {
    let clock = std::time::Instant::now();
    let light = |p: &Pixel| direct(p, eye, &pose.lights, maps);
    let by_lights = pixels.par_iter().map(light).collect();
    timings.direct = clock.elapsed();
    let by_probes = match source {
        Source::None => vec![Indirect::default(); pixels.len()],
        Source::Supplied(light) => light.to_vec(),
        Source::Probes {
            volumes,
            interpolation,
            ..
        } => {
            let clock = std::time::Instant::now();
            let fields: Vec<_> = volumes.iter().map(ProbesVolume::field).collect();
            let light = |p: &Pixel| indirect(p, eye, volumes, &fields, *interpolation);
            let light = pixels.par_iter().map(light).collect();
            timings.indirect = clock.elapsed();
            light
        }
    };
    (by_lights, by_probes)
}

#[cfg(test)]
#[path = "light/tests.rs"]
mod tests;
