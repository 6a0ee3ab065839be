//! The client's sampler: the light at a surface position from the probes about it, and what a
//! material makes of it (DDISH-GI §3.2, Appendix A). Up to [`incoming_light`] it is the format's
//! (`spec/probes.md` §12), whose query vectors hold it, and its twin on a device.
//!
//! Everything is in grid space ([`super::lattice`]). Two interpolations: [`trilinear`], which a
//! texture unit does, and [`visibility_weighted`], which keeps light from coming through walls. Both are
//! means of the probes' expansions, so that what is non-negative at every probe is so in between.

use super::ggx;
use super::lattice::{Corner, Lattice};
use super::sh::{self, L2};
use super::visibility::Visibility;
use glam::Vec3;
use std::f32::consts::PI;

/// Share of the smallest spacing by which a point is lifted along its normal, and towards the
/// viewer, before a probe is asked whether it sees it: `0.75 * 0.3` times 0.2 and 0.8 (Majercik et
/// al. 2021, *Scaling Probe-Based Real-Time Dynamic Global Illumination for Production*, Eq. 2). What
/// a probe knows of distances is blurred by a texel's angle, so that a surface would shade itself.
/// SHARED with the client's shader.
pub const NORMAL_BIAS: f32 = 0.045;
/// See [`NORMAL_BIAS`]. SHARED with the client's shader.
pub const VIEW_BIAS: f32 = 0.18;
/// The least weight of a probe on the far side of the surface: the wrap `((1 + cos) / 2)^2 + 0.2` of
/// Majercik 2019. A probe behind the tangent plane still says something about the light in front,
/// and at a grazing surface there may be no other. SHARED with the client's shader.
pub const WRAP: f32 = 0.2;
/// What a probe counts that does not see the point, relative to one that does. Not 0, so that where
/// none sees it the result is their mean and comes without a jump; so small that a sun of 1e5
/// behind a wall adds 0.1. SHARED with the client's shader.
pub const UNSEEN: f32 = 1e-6;
/// What an absent probe counts: less than any present one. Where all eight are absent the result is
/// the fill that the format makes for them. SHARED with the client's shader.
pub const ABSENT: f32 = 1e-12;
/// Normal reflectance of a dielectric (glTF 2.0 §3.9.6: index of refraction 1.5).
pub const DIELECTRIC: f32 = 0.04;

/// The probes of a volume as decoded.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    pub lattice: Lattice,
    /// Radiance at each probe, absent ones filled by the format's rule.
    pub radiance: &'a [L2],
    /// Whether each probe is present.
    pub present: &'a [bool],
    pub visibility: Option<Visibility<'a>>,
}

/// The light at `x` by trilinear interpolation; outside the volume, that of the nearest point of its
/// box. Absent probes count with what the format fills them with. A probe beyond `radiance` is black.
pub fn trilinear(field: &Field, x: Vec3) -> L2 {
    let mut sum = [Vec3::ZERO; sh::L2_COUNT];
    for corner in field.lattice.corners(x) {
        add(&mut sum, field, corner.probe, corner.weight);
    }
    sum
}

/// The light at `x` with unit normal `n`, seen from unit direction `v`, by the probes that can tell:
///
/// `weight = trilinear * (((1 + cos) / 2)^2 + WRAP) * max(visibility, UNSEEN)`, where cos is between n
/// and the direction to the probe, visibility is [`Visibility::share`] of the biased point
/// `x + (NORMAL_BIAS n + VIEW_BIAS v) * smallest spacing`, 1 for a volume without; [`ABSENT`] in
/// place of the last factor for an absent probe.
///
/// The weights are normalised, and never all vanish: where no probe sees the point it gets their
/// mean without visibility, where all are absent their fill.
pub fn visibility_weighted(field: &Field, x: Vec3, n: Vec3, v: Vec3) -> L2 {
    let corners = visibility_weights(field, x, n, v);
    let mut sum = [Vec3::ZERO; sh::L2_COUNT];
    let mut total = 0.0;
    for corner in corners {
        total += corner.weight;
        add(&mut sum, field, corner.probe, corner.weight);
    }
    sum.map(|c| c / total)
}

/// The corners of [`visibility_weighted`] and their weights before normalisation; those of
/// [`trilinear`] where all vanish. The radiance of `field` is not looked at.
pub fn visibility_weights(field: &Field, x: Vec3, n: Vec3, v: Vec3) -> [Corner; 8] {
    let lattice = &field.lattice;
    let seen_at = x + (n * NORMAL_BIAS + v * VIEW_BIAS) * lattice.spacing.min_element();
    let corners = lattice.corners(x);
    let weighted = corners.map(|corner| {
        let probe = lattice.position(corner.probe);
        let cosine = (probe - x).normalize_or(n).dot(n);
        let wrap = (0.5 + 0.5 * cosine).powi(2) + WRAP;
        let trust = if !field.present.get(corner.probe).is_some_and(|p| *p) {
            ABSENT
        } else if let Some(visibility) = &field.visibility {
            visibility.share(corner.probe, seen_at - probe).max(UNSEEN)
        } else {
            1.0
        };
        Corner {
            weight: corner.weight * wrap * trust,
            ..corner
        }
    });
    let total: f32 = weighted.iter().map(|corner| corner.weight).sum();
    if total > 0.0 { weighted } else { corners }
}

fn add(sum: &mut L2, field: &Field, probe: usize, weight: f32) {
    if let Some(radiance) = field.radiance.get(probe) {
        for (s, c) in sum.iter_mut().zip(radiance) {
            *s += *c * weight;
        }
    }
}

/// What indirect light needs to know of a glTF metallic-roughness material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Linear RGB.
    pub base_color: Vec3,
    pub metallic: f32,
    pub roughness: f32,
}

/// Light that reaches a surface, linear RGB: the result of the format's sampler.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct IncomingLight {
    pub irradiance: Vec3,
    /// Mean radiance over the glossy lobe.
    pub filtered: Vec3,
}

/// Light that reaches a surface of unit normal `n` and of `roughness` 0 to 1, seen from unit
/// direction `v`: irradiance about n, and the mean over the glossy lobe about [`ggx::lobe_direction`].
/// Where an expansion rings below zero, it counts as zero.
pub fn incoming_light(radiance: &L2, n: Vec3, v: Vec3, roughness: f32) -> IncomingLight {
    let direction = ggx::lobe_direction(n, v, roughness);
    let filtered = sh::convolved(radiance, &ggx::lobe(roughness), direction);
    IncomingLight {
        irradiance: sh::irradiance(radiance, n).max(Vec3::ZERO),
        filtered: filtered.max(Vec3::ZERO),
    }
}

/// Radiance towards the viewer, linear RGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Indirect {
    pub diffuse: Vec3,
    pub glossy: Vec3,
}

/// Indirect light of a surface of unit normal `n` seen from unit direction `v`.
///
/// `f0 = mix(0.04, base_color, metallic)`; glossy: what arrives over the lobe times
/// `f0 * scale + bias`; diffuse: `base_color (1 - metallic) / pi` times irradiance, times what the
/// dielectric's gloss leaves, `1 - (0.04 * scale + bias)`, so that no light is made.
pub fn shade(radiance: &L2, material: &Material, n: Vec3, v: Vec3) -> Indirect {
    let roughness = material.roughness.clamp(0.0, 1.0);
    let metallic = material.metallic.clamp(0.0, 1.0);
    let base = material.base_color * (1.0 - metallic);
    let f0 = Vec3::splat(DIELECTRIC).lerp(material.base_color, metallic);
    let environment = ggx::environment(n.dot(v), roughness);
    reflected(
        &incoming_light(radiance, n, v, roughness),
        base,
        [f0, Vec3::ONE],
        environment,
    )
}

/// What a material makes of light that arrives: the split sum. `base` is the albedo of its Lambert base,
/// `f0` and `f90` are the coat's reflectance along the normal and at grazing angles, scale and bias
/// come from [`ggx::environment`].
pub fn reflected(
    light: &IncomingLight,
    base: Vec3,
    [f0, f90]: [Vec3; 2],
    [scale, bias]: [f32; 2],
) -> Indirect {
    let left = 1.0 - (DIELECTRIC * scale + bias);
    Indirect {
        diffuse: base * light.irradiance * (left / PI),
        glossy: light.filtered * (f0 * scale + f90 * bias),
    }
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
