//! The glossy lobe of the format's sampler against traced light, beside others.
//!
//! Receivers are the first hits of rays from probes, as if seen from there. Each has its light from
//! the probes, as a client looks it up, and the truth: the whole integral over GGX with Smith masking and
//! Schlick's Fresnel, of paths, for surfaces of given roughness and reflectance. The receiver's own material
//! counts for nothing, so that all materials are held to the light of the scene.

use super::metrics::psnr;
use crate::probes::ggx::{self, integrate};
use crate::probes::sample::{Field, visibility_weighted};
use crate::probes::sh::{L2, convolved};
use crate::probes::volume::{Volume, spiral};
use crate::render::tone::tone;
use crate::trace::path::bsdf::luminance;
use crate::trace::path::{PathTracer, Paths, Random, Vertex};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

/// Roughnesses of the materials.
pub const ROUGHNESSES: [f32; 7] = [0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0];
/// Normal reflectances: a dielectric and a metal.
pub const REFLECTANCES: [f32; 2] = [0.04, 1.0];
/// Paths a side of the truth's grid over visible normals, of which those below the horizon are left
/// out.
const SIDE: usize = 10;
/// Metres to a receiver: nearer ones are within geometry.
const NEAREST: f32 = 0.05;
/// Directions that receivers are drawn from.
const DIRECTIONS: usize = 4096;
/// A stream of random numbers that is used here alone.
const TRUTH: u32 = 0x10be;
/// Logarithmic mean of the shown luminance, and the share of the mean that is added before its logarithm,
/// as for pictures.
const KEY: f32 = 0.18;
const BLACK: f32 = 1e-3;

/// A lobe: what it leaves of each degree, and about which direction it is, by normal, view and roughness.
pub struct Lobe {
    pub name: &'static str,
    pub factors: fn(f32) -> [f32; 3],
    pub about: fn(Vec3, Vec3, f32) -> Vec3,
}

/// The format's, the zonal fit to GGX about either direction, and the cosine's.
pub const LOBES: [Lobe; 5] = [
    Lobe {
        name: "the format's",
        factors: ggx::lobe,
        about: ggx::lobe_direction,
    },
    Lobe {
        name: "GGX",
        factors: ggx_factors,
        about: ggx::lobe_direction,
    },
    Lobe {
        name: "GGX, mirror direction",
        factors: ggx_factors,
        about: mirror,
    },
    Lobe {
        name: "cosine",
        factors: cosine_factors,
        about: ggx::lobe_direction,
    },
    Lobe {
        name: "cosine, mirror direction",
        factors: cosine_factors,
        about: mirror,
    },
];

fn ggx_factors(roughness: f32) -> [f32; 3] {
    let exact = integrate::lobe(f64::from(roughness));
    std::array::from_fn(|l| exact[l] as f32)
}

fn cosine_factors(_: f32) -> [f32; 3] {
    ggx::lobe(1.0)
}

fn mirror(n: Vec3, v: Vec3, _: f32) -> Vec3 {
    ggx::lobe_direction(n, v, 0.0)
}

/// A place on a surface, with what the probes say and what is right.
struct Receiver {
    radiance: L2,
    normal: Vec3,
    view: Vec3,
    /// By [`ROUGHNESSES`], then [`REFLECTANCES`].
    truth: Vec<[Vec3; REFLECTANCES.len()]>,
}

/// Errors of one material.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    pub roughness: f32,
    pub reflectance: f32,
    /// Of each lobe: mean squared difference of sRGB values after the tone curve, at the exposure of the
    /// right light, and the mean luminance over the right one.
    pub lobes: Vec<(f64, f64)>,
}

/// Scores `lobes` at about `count` receivers of the `present` probes of a volume.
pub fn scores(
    paths: &PathTracer,
    field: &Field,
    volume: &Volume,
    present: &[usize],
    count: usize,
    lobes: &[Lobe],
) -> Vec<Score> {
    let receivers: Vec<Receiver> = (0..count)
        .into_par_iter()
        .filter_map(|i| {
            // Even over probes, and over directions for each.
            let probe = *present.get(i % present.len().max(1))?;
            let direction = spiral((i * 7919 + probe * 31) % DIRECTIONS, DIRECTIONS);
            let eye = volume.origin + volume.lattice.position(probe);
            let surface = paths.first(eye, direction, true).0?;
            let near = surface.distance < NEAREST;
            (!near).then(|| receiver(paths, field, volume, &surface, i as u32))
        })
        .collect();
    let materials =
        (0..ROUGHNESSES.len()).flat_map(|r| (0..REFLECTANCES.len()).map(move |f| (r, f)));
    materials
        .map(|(r, f)| score(&receivers, lobes, r, f))
        .collect()
}

fn receiver(
    paths: &PathTracer,
    field: &Field,
    volume: &Volume,
    surface: &Vertex,
    number: u32,
) -> Receiver {
    let (n, v) = (surface.normal, surface.view);
    let n_v = n.dot(v).clamp(1e-3, 1.0);
    let tangent = (v - n * n_v).normalize_or(n.any_orthonormal_vector());
    let across = n.cross(tangent);
    let origin = surface.position + surface.geometric_normal * 1e-3;
    let all = Paths {
        cull_back_faces: false,
        ..Paths::default()
    };
    let truth = |roughness: &f32| {
        let alpha = f64::from(roughness * roughness);
        let mut sums = [Vec3::ZERO; REFLECTANCES.len()];
        for (i, q) in integrate::reflections(f64::from(n_v), alpha, SIDE).enumerate() {
            let d = tangent * q.direction.x + across * q.direction.y + n * q.direction.z;
            let d = d.normalize_or(n);
            if d.dot(surface.geometric_normal) <= 0.0 {
                continue;
            }
            let random = Random::new(TRUTH, number, i as u32);
            let light = paths.radiance(origin, d, random, &all).radiance;
            for (sum, f0) in sums.iter_mut().zip(REFLECTANCES) {
                let fresnel = f64::from(f0) + f64::from(1.0 - f0) * q.schlick;
                *sum += light * (q.weight * fresnel) as f32;
            }
        }
        sums
    };
    let x = volume.to_grid(surface.position);
    Receiver {
        radiance: visibility_weighted(field, x, surface.geometric_normal, v),
        normal: n,
        view: v,
        truth: ROUGHNESSES.iter().map(truth).collect(),
    }
}

fn score(receivers: &[Receiver], lobes: &[Lobe], r: usize, f: usize) -> Score {
    let (roughness, reflectance) = (ROUGHNESSES[r], REFLECTANCES[f]);
    let count = receivers.len().max(1) as f32;
    let right: Vec<Vec3> = receivers.iter().map(|x| x.truth[r][f]).collect();
    let luminances = || right.iter().map(|c| luminance(*c).max(0.0));
    let mean = luminances().sum::<f32>() / count;
    let black = (BLACK * mean).max(f32::MIN_POSITIVE);
    let logarithms = luminances().map(|l| (l + black).ln()).sum::<f32>();
    let exposure = KEY / (logarithms / count).exp();
    let shown = |c: Vec3| srgb(tone((c * exposure).max(Vec3::ZERO)));
    let of_lobe = |lobe: &Lobe| {
        let factors = (lobe.factors)(roughness);
        let (mut squares, mut luminance_sum) = (0.0, 0.0);
        for (x, right) in receivers.iter().zip(&right) {
            let about = (lobe.about)(x.normal, x.view, roughness);
            let [scale, bias] = ggx::environment(x.normal.dot(x.view), roughness);
            let filtered = convolved(&x.radiance, &factors, about).max(Vec3::ZERO);
            let got = filtered * (reflectance * scale + bias);
            luminance_sum += f64::from(luminance(got));
            squares += f64::from((shown(got) - shown(*right)).length_squared()) / 3.0;
        }
        let count = f64::from(count);
        (
            squares / count,
            luminance_sum / (f64::from(mean.max(f32::MIN_POSITIVE)) * count),
        )
    };
    Score {
        roughness,
        reflectance,
        lobes: lobes.iter().map(of_lobe).collect(),
    }
}

fn srgb(linear: Vec3) -> Vec3 {
    linear.map(|c| match c <= 0.003_130_8 {
        true => 12.92 * c,
        false => 1.055 * c.powf(1.0 / 2.4) - 0.055,
    })
}

/// PSNR in dB of a lobe over all of `scores`, by the mean squared error.
pub fn mean(scores: &[Score], lobe: usize) -> f64 {
    let errors = scores.iter().map(|s| s.lobes[lobe].0);
    psnr(errors.sum::<f64>() / scores.len().max(1) as f64)
}
