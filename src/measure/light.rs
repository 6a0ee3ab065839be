//! Pictures of a scene by indirect light from probes, and their scores against path-traced ones, as
//! in Tables 1 to 3 of DDISH-GI.
//!
//! All methods look at the same surfaces ([`Seen`]) and add the same direct light, of punctual
//! lights with ray-traced shadows: what differs between two pictures is indirect light alone.

use super::ddgi::{self, Ddgi};
use super::metrics::{Difference, Values, compare_pictures};
use crate::Result;
use crate::probes::ggx;
use crate::probes::sample::{DIELECTRIC, Field, Indirect, resistant, trilinear};
use crate::probes::server::Server;
use crate::probes::sh;
use crate::probes::volume::Volume;
use crate::render::Picture;
use crate::render::light::Interpolation;
use crate::render::tone::develop;
use crate::render::view::View;
use crate::scene::CameraPose;
use crate::trace::path::bsdf::Bsdf;
use crate::trace::path::{PathTracer, Vertex};
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;

/// What the pixels' centres see, and the light there that no method looks up.
pub struct Seen {
    pub width: u32,
    pub height: u32,
    /// Row by row from the top; none where the sky is seen.
    surfaces: Vec<Option<Vertex>>,
    /// Emission and punctual lights, or the sky.
    direct: Vec<Vec3>,
}

impl Seen {
    pub fn new(paths: &PathTracer, camera: &CameraPose, width: u32, height: u32) -> Seen {
        let view = View::new(camera, width, height);
        let eye = Vec3::from(camera.world_from_camera.translation);
        let see = |i: usize| {
            let (x, y) = (i as u32 % width.max(1), i as u32 / width.max(1));
            let direction = view.direction(x, y);
            match paths.first(eye, direction, true).0 {
                Some(surface) => {
                    let light = surface.emitted + paths.direct(&surface);
                    (Some(surface), light)
                }
                None => (None, paths.sky().radiance(direction)),
            }
        };
        let pixels = (0..width as usize * height as usize).into_par_iter();
        let (surfaces, direct) = pixels.map(see).unzip();
        Seen {
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
        let pixels = self.surfaces.par_iter();
        pixels
            .map(|surface| surface.as_ref().map_or(Indirect::default(), &light))
            .collect()
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
        Interpolation::Resistant => resistant(field, x, surface.geometric_normal, v),
    };
    let roughness = surface.bsdf.alpha.sqrt();
    let lobe = ggx::lobe_direction(n, v, roughness);
    let glossy = sh::convolved(&radiance, &ggx::lobe(roughness), lobe).max(Vec3::ZERO);
    let irradiance = sh::irradiance(&radiance, n).max(Vec3::ZERO);
    reflected(&surface.bsdf, n.dot(v), irradiance, glossy)
}

/// The same by the baseline.
pub fn from_ddgi(ddgi: &Ddgi, surface: &Vertex) -> Indirect {
    let (n, v) = (surface.normal, surface.view);
    let irradiance = ddgi.irradiance(surface.position, n, v);
    let mirrored = 2.0 * n.dot(v) * n - v;
    let glossy = ddgi.glossy(surface.position, n, mirrored, v);
    reflected(&surface.bsdf, n.dot(v), irradiance, glossy)
}

/// What a material makes of irradiance and of light that was filtered for its lobe: the split sum.
fn reflected(bsdf: &Bsdf, cosine: f32, irradiance: Vec3, glossy: Vec3) -> Indirect {
    let [scale, bias] = ggx::environment(cosine, bsdf.alpha.sqrt());
    Indirect {
        diffuse: bsdf.diffuse * irradiance * ((1.0 - (DIELECTRIC * scale + bias)) / PI),
        glossy: glossy * (bsdf.f0 * scale + bsdf.f90 * bias),
    }
}

/// The end of a ray of the baseline's probes.
pub fn ddgi_end(paths: &PathTracer, origin: Vec3, direction: Vec3, cull: bool) -> ddgi::End {
    let (surface, back) = paths.first(origin, direction, cull);
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
        back_face: back && !cull,
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
    let mirrored = sh::basis(ggx::lobe_direction(n, v, roughness));
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
            glossy += *c * (corner.weight * lobe[degree] * mirrored[i]);
        }
    }
    if weights <= 0.0 {
        return Indirect::default();
    }
    let [irradiance, glossy] = [irradiance, glossy].map(|sum| (sum / weights).max(Vec3::ZERO));
    reflected(&surface.bsdf, n.dot(v), irradiance, glossy)
}
