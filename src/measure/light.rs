//! Pictures of a scene by indirect light from probes, and their scores against path-traced ones, as
//! in Tables 1 to 3 of DDISH-GI.
//!
//! All methods shade the same first hits ([`FirstHits`]) and add the same direct light, of punctual
//! lights with ray-traced shadows: what differs between two pictures is indirect light alone.

use super::ddgi::{self, Ddgi};
use super::metrics::{Difference, Values, compare_pictures};
use crate::codec::{Compression, Decoder, Encoder, EncoderConfig, Event, GroupStart, Limits};
use crate::models::Source as _;
use crate::probes::client::ProbesVolume;
use crate::probes::dering::{Keep, dering};
use crate::probes::ggx;
use crate::probes::sample::{
    DIELECTRIC, Field, IncomingLight, Indirect, incoming_light, reflected, trilinear,
    visibility_weighted,
};
use crate::probes::server::{self, Server, fit};
use crate::probes::sh::{self, L2};
use crate::probes::source::{Packing, Source};
use crate::probes::volume::{Volume, spiral};
use crate::render::Picture;
use crate::render::light::Interpolation;
use crate::render::tone::develop;
use crate::render::view::View;
use crate::scene::CameraPose;
use crate::trace::path::{PathTracer, Paths, Random, Vertex};
use crate::{Error, Result};
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use std::time::Instant;

/// Metres by which an expansion at a surface stands off it.
const BESIDE: f32 = 0.01;
/// Streams of random numbers that are used here alone.
const ITSELF: u32 = 0x17;
const TRUTH: u32 = 0x71;
/// Frames of the baseline before those that count.
pub const WARM_UP: u32 = 32;

/// The first hit of each pixel's centre, and the direct light there.
pub struct FirstHits {
    pub width: u32,
    pub height: u32,
    /// Row by row from the top; none where the sky is seen.
    surfaces: Vec<Option<Vertex>>,
    /// Emission and punctual lights, or the sky.
    direct: Vec<Vec3>,
}

impl FirstHits {
    /// Whether each pixel sees geometry, row by row from the top.
    pub fn geometry(&self) -> impl Iterator<Item = bool> {
        self.surfaces.iter().map(Option::is_some)
    }

    pub fn new(paths: &PathTracer, camera: &CameraPose, width: u32, height: u32) -> FirstHits {
        let view = View::new(camera, width, height);
        let eye = Vec3::from(camera.world_from_camera.translation);
        let see = |i: usize| {
            let (x, y) = (i as u32 % width.max(1), i as u32 / width.max(1));
            let direction = view.direction(x, y);
            match paths.first(eye, direction, true).0 {
                Some(surface) => {
                    let light = surface.emitted + surface.unlit + paths.direct(&surface);
                    (Some(surface), light)
                }
                None => (None, paths.sky().radiance(direction)),
            }
        };
        let pixels = (0..width as usize * height as usize).into_par_iter();
        let (surfaces, direct) = pixels.map(see).unzip();
        FirstHits {
            width,
            height,
            surfaces,
            direct,
        }
    }

    /// Direct light alone.
    pub fn direct(&self) -> &[Vec3] {
        &self.direct
    }

    /// Indirect light of each pixel; none in the sky.
    pub fn indirect(&self, light: impl Fn(&Vertex) -> Indirect + Sync) -> Vec<Indirect> {
        self.numbered(|_, surface| light(surface))
    }

    /// The same by a method that draws random numbers: it is told the pixel's number.
    pub fn numbered(&self, light: impl Fn(u32, &Vertex) -> Indirect + Sync) -> Vec<Indirect> {
        let pixels = self.surfaces.par_iter().enumerate();
        pixels
            .map(|(i, surface)| match surface {
                Some(surface) => light(i as u32, surface),
                None => Indirect::default(),
            })
            .collect()
    }

    /// Every `step`-th pixel of every `step`-th row.
    pub fn every(&self, step: u32) -> FirstHits {
        let (width, height) = (self.width.div_ceil(step), self.height.div_ceil(step));
        FirstHits {
            width,
            height,
            surfaces: self.pick(&self.surfaces, step),
            direct: self.pick(&self.direct, step),
        }
    }

    /// The values of those pixels among `values` of all.
    pub fn pick<T: Copy>(&self, values: &[T], step: u32) -> Vec<T> {
        let rows = values.chunks(self.width as usize).step_by(step as usize);
        let pixels = rows.flat_map(|row| row.iter().step_by(step as usize));
        pixels.copied().collect()
    }

    /// Direct light and `indirect`, linear radiance.
    pub fn lit(&self, indirect: &[Indirect]) -> Vec<Vec3> {
        let pixels = self.direct.iter().zip(indirect);
        pixels
            .map(|(direct, i)| *direct + i.diffuse + i.glossy)
            .collect()
    }

    /// The picture of linear radiance.
    pub fn picture(&self, radiance: &[Vec3], exposure: f32) -> Picture {
        Picture::from_linear(self.width, self.height, &develop(radiance, exposure))
    }

    /// PSNR and SSIM of the pictures that two fields of radiance make.
    ///
    /// # Errors
    /// As [`compare_pictures`].
    pub fn score(
        &self,
        radiance: &[Vec3],
        reference: &[Vec3],
        exposure: f32,
    ) -> Result<Difference> {
        let [a, b] = [radiance, reference].map(|light| self.picture(light, exposure));
        compare_pictures(&a, &b, Values::Srgb)
    }
}

/// Indirect light of a surface by the probes of `field`, which lie in `volume`.
pub fn from_probes(
    field: &Field,
    volume: &Volume,
    interpolation: Interpolation,
    surface: &Vertex,
) -> Indirect {
    let (n, v) = (surface.normal, surface.view);
    let x = volume.to_grid(surface.position);
    let radiance = match interpolation {
        Interpolation::Trilinear => trilinear(field, x),
        Interpolation::VisibilityWeighted => {
            visibility_weighted(field, x, surface.geometric_normal, v)
        }
    };
    shaded(
        surface,
        &incoming_light(&radiance, n, v, surface.bsdf.alpha.sqrt()),
    )
}

/// The same by the baseline, whose glossy light is about the same direction.
pub fn from_ddgi(ddgi: &Ddgi, surface: &Vertex) -> Indirect {
    let (n, v) = (surface.normal, surface.view);
    let about = ggx::lobe_direction(n, v, surface.bsdf.alpha.sqrt());
    let light = IncomingLight {
        irradiance: ddgi.irradiance(surface.position, n, v),
        filtered: ddgi.glossy(surface.position, n, about, v),
    };
    shaded(surface, &light)
}

/// The same by an expansion at the surface itself, of `rays` paths: what probes could do if there were
/// one everywhere. What is left of its error is not interpolation's.
pub fn from_itself(paths: &PathTracer, surface: &Vertex, number: u32, rays: u32) -> Indirect {
    let origin = surface.position + surface.geometric_normal * BESIDE;
    let directions: Vec<Vec3> = (0..rays as usize)
        .map(|i| spiral(i, rays as usize))
        .collect();
    let look = |(sample, direction): (u32, &Vec3)| {
        let random = Random::new(ITSELF, number, sample);
        paths
            .radiance(origin, *direction, random, &Paths::default())
            .radiance
    };
    let samples: Vec<Vec3> = (0..rays).zip(&directions).map(look).collect();
    let fitted = fit(2, &directions, &samples).radiance;
    let mut radiance: L2 = std::array::from_fn(|i| fitted[i]);
    dering(&mut radiance, Keep::Irradiance);
    let (n, v) = (surface.normal, surface.view);
    shaded(
        surface,
        &incoming_light(&radiance, n, v, surface.bsdf.alpha.sqrt()),
    )
}

/// The same by `samples` paths from the surface: the reference.
pub fn from_paths(paths: &PathTracer, surface: &Vertex, number: u32, samples: u32) -> Indirect {
    let mut sum = [Vec3::ZERO; 2];
    for sample in 0..samples {
        let mut random = Random::new(TRUTH, number, sample);
        let bounces = Paths::default().max_bounces;
        let parts = paths.scattered_parts(surface, &mut random, bounces);
        sum.iter_mut().zip(parts).for_each(|(s, part)| *s += part);
    }
    let [diffuse, glossy] = sum.map(|s| s / samples.max(1) as f32);
    Indirect { diffuse, glossy }
}

fn shaded(surface: &Vertex, light: &IncomingLight) -> Indirect {
    let bsdf = &surface.bsdf;
    let cosine = surface.normal.dot(surface.view);
    let environment = ggx::environment(cosine, bsdf.alpha.sqrt());
    let coat = [bsdf.f0, Vec3::splat(bsdf.f90)];
    reflected(light, bsdf.diffuse, coat, environment)
}

/// The baseline on the probes of `volume` once its light has settled. Each bounce needs as many frames
/// as the one before; forgetting fast at first, all of them are there before the `frames` that count.
/// Returns the mean milliseconds of one of these, too.
///
/// `disabled` marks the probes inside geometry that light nothing; the rays of the others then end at
/// backs of surfaces. Without, they pass them, and all probes are kept.
pub fn settled_ddgi(
    paths: &PathTracer,
    volume: &Volume,
    server: &server::Options,
    disabled: Option<Vec<bool>>,
    frames: u32,
    step: &dyn Fn(),
) -> (Ddgi, f64) {
    let mut ddgi = Ddgi::new(ddgi::Options {
        origin: volume.origin,
        spacing: volume.lattice.spacing,
        dims: UVec3::from(volume.lattice.dims.map(u32::from)),
        rays: server.samples,
        hysteresis: 0.6,
        seed: server.seed,
    });
    let through = disabled.is_none();
    ddgi.disable(disabled.unwrap_or_default());
    let arrive = |origin, direction| ddgi_end(paths, origin, direction, through);
    for _ in 0..WARM_UP {
        ddgi.update(arrive);
        step();
    }
    ddgi.set_hysteresis(server.hysteresis.share());
    let clock = Instant::now();
    for _ in 0..frames {
        ddgi.update(arrive);
        step();
    }
    let ms = clock.elapsed().as_secs_f64() * 1e3 / f64::from(frames.max(1));
    (ddgi, ms)
}

/// A decoded volume and the size of its keyframe.
pub struct DecodedVolume {
    pub volume: ProbesVolume<'static>,
    /// Bytes of the keyframe's record without the visibility block, and of the block.
    pub bytes_first: u64,
    pub bytes_visibility: u64,
}

/// Encodes the server's state as one keyframe in `packing` and decodes it. Sizes are those of the record under
/// zstd, and what the visibility block adds to it.
///
/// # Errors
/// Those of the codec.
pub fn through_a_stream(source: &mut Source, packing: Packing) -> Result<DecodedVolume> {
    source.pack_as(packing);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
    encoder.group(&mut bytes, GroupStart::Keyframes)?;
    encoder.tracks(&mut bytes, &[source.track()])?;
    let strongest = Compression::Zstd {
        level: 19,
        lazy: false,
    };
    let start = bytes.len();
    source.write_keyframe(&mut encoder, strongest, &mut bytes)?;
    let bytes_first = source.bytes_of_light(source.sent(), strongest)?;
    let bytes_visibility = ((bytes.len() - start) as u64).saturating_sub(bytes_first);
    encoder.commit(&mut bytes, 0, None)?;
    encoder.end(&mut bytes)?;
    let mut decoder = Decoder::new(Limits::default());
    let mut rest = &bytes[..];
    loop {
        let (used, event) = decoder.push(rest)?;
        rest = &rest[used..];
        if matches!(event, Event::End | Event::NeedInput) {
            break;
        }
    }
    let volume = decoder.tracks().first();
    let volume =
        volume.and_then(|live| ProbesVolume::new(&decoder, live).map(ProbesVolume::into_owned));
    let volume = volume.ok_or_else(|| Error::Invalid("the stream has no volume".into()))?;
    Ok(DecodedVolume {
        volume,
        bytes_first,
        bytes_visibility,
    })
}

/// The end of a ray of the baseline's probes, which may go `through` backs of surfaces.
pub fn ddgi_end(paths: &PathTracer, origin: Vec3, direction: Vec3, through: bool) -> ddgi::End {
    let (surface, back) = paths.first(origin, direction, through);
    let Some(surface) = surface else {
        return ddgi::End {
            distance: f32::INFINITY,
            back_face: false,
            position: origin,
            normal: -direction,
            radiance: paths.sky().radiance(direction),
            diffuse: Vec3::ZERO,
            glossy: Vec3::ZERO,
        };
    };
    let bsdf = &surface.bsdf;
    let cosine = surface.normal.dot(surface.view);
    let [scale, bias] = ggx::environment(cosine, bsdf.alpha.sqrt());
    ddgi::End {
        distance: surface.distance,
        // Rays that pass the backs of surfaces end at a front.
        back_face: back && !through,
        position: surface.position,
        normal: surface.normal,
        radiance: surface.emitted + paths.direct(&surface),
        diffuse: bsdf.diffuse * (1.0 - (DIELECTRIC * scale + bias)),
        glossy: bsdf.f0 * scale + bsdf.f90 * bias,
    }
}

/// Indirect light by a server's own expansions, of whatever degree, unquantised and trilinear; absent
/// probes count for nothing.
pub fn from_expansions(server: &Server, surface: &Vertex) -> Indirect {
    let (n, v) = (surface.normal, surface.view);
    let volume = server.volume();
    let roughness = surface.bsdf.alpha.sqrt();
    let lobe = ggx::lobe(roughness);
    let about = sh::basis(ggx::lobe_direction(n, v, roughness));
    let facing = sh::basis(n);
    let (mut irradiance, mut glossy, mut weights) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for corner in volume.lattice.corners(volume.to_grid(surface.position)) {
        if !server.is_present(corner.probe) {
            continue;
        }
        weights += corner.weight;
        for (i, c) in server.radiance(corner.probe).iter().enumerate() {
            let degree = sh::degree_of(i);
            irradiance += *c * (corner.weight * sh::COSINE[degree] * facing[i]);
            // Above degree 2 the cosine's, of which the lobe is near.
            let factor = lobe.get(degree).copied();
            let factor = factor.unwrap_or(sh::COSINE[degree] / std::f32::consts::PI);
            glossy += *c * (corner.weight * factor * about[i]);
        }
    }
    if weights <= 0.0 {
        return Indirect::default();
    }
    let [irradiance, filtered] = [irradiance, glossy].map(|sum| (sum / weights).max(Vec3::ZERO));
    let light = IncomingLight {
        irradiance,
        filtered,
    };
    shaded(surface, &light)
}
