//! Light at a place from the eight probes around it.

use super::Ddgi;
use glam::{UVec3, Vec3};

/// Places are looked up this share of the smallest spacing off their surface, against its own
/// shadow (the first paper's self-shadow bias, with G3D's constants). As in RTXGI, the biased place
/// decides both the trilinear weights and what a probe sees.
const BIAS: f32 = 0.3 * 0.75;
/// Of which so much along the normal, and the rest towards the viewer.
const BIAS_NORMAL: f32 = 0.2;
const BIAS_VIEW: f32 = 0.8;
/// Least weight by visibility, so that no place has none at all.
const LEAST: f32 = 0.05;
/// Weights below this are crushed smoothly: eyes see small ones in the dark.
const CRUSHED: f32 = 0.2;

impl Ddgi {
    /// Irradiance of a surface at `position` with unit `normal`, seen from unit direction `view`.
    pub fn irradiance(&self, position: Vec3, normal: Vec3, view: Vec3) -> Vec3 {
        self.interpolate(position, normal, view, normal)
    }

    /// Radiance that a glossy surface reflects, before its environment BRDF: the irradiance of one
    /// that faces `direction`, as radiance ("Scaling", glossy reflections; any roughness).
    pub fn glossy(&self, position: Vec3, normal: Vec3, direction: Vec3, view: Vec3) -> Vec3 {
        self.interpolate(position, normal, view, direction) / std::f32::consts::PI
    }

    /// Irradiance of a surface that faces `facing`, with the weights of one with normal `normal`.
    fn interpolate(&self, position: Vec3, normal: Vec3, view: Vec3, facing: Vec3) -> Vec3 {
        let o = &self.options;
        let biased =
            position + (normal * BIAS_NORMAL + view * BIAS_VIEW) * (o.spacing.min_element() * BIAS);
        let last = (o.dims - UVec3::ONE).as_vec3();
        let at = ((biased - o.origin) / o.spacing).clamp(Vec3::ZERO, last);
        let corner = at.floor().min((last - 1.0).max(Vec3::ZERO));
        let fraction = at - corner;
        let facing_texels = self.irradiance_map.around(facing);
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for i in 0..8u32 {
            let offset = UVec3::new(i & 1, i >> 1 & 1, i >> 2);
            let cell = (corner.as_uvec3() + offset).min(o.dims - UVec3::ONE);
            let probe = (cell.x + o.dims.x * (cell.y + o.dims.y * cell.z)) as usize;
            if self.disabled.get(probe).is_some_and(|d| *d) {
                continue;
            }
            let probe_position = o.origin + cell.as_vec3() * o.spacing;

            // Smooth back-face test: probes behind the surface count little.
            let to_probe = (probe_position - position).normalize_or_zero();
            let wrap = (to_probe.dot(normal) + 1.0) * 0.5;
            let mut weight = wrap * wrap + 0.2;

            // Chebyshev: how likely the probe sees the place.
            let from_probe = biased - probe_position;
            let distance = from_probe.length();
            if distance > 0.0 {
                let texels = self.visibility_map.around(from_probe / distance);
                let map = &self.visibility[probe * self.visibility_map.texels()..];
                let moment = |m: usize| -> f32 { texels.iter().map(|(t, w)| map[*t][m] * w).sum() };
                let (mean, square) = (moment(0), moment(1));
                if distance > mean {
                    let variance = (square - mean * mean).abs();
                    let beyond = distance - mean;
                    let chebyshev = variance / (variance + beyond * beyond);
                    weight *= chebyshev.powi(3).max(LEAST);
                }
            }
            weight = weight.max(1e-6);
            if weight < CRUSHED {
                weight *= weight * weight / (CRUSHED * CRUSHED);
            }
            let near =
                offset.as_vec3() * fraction + (Vec3::ONE - offset.as_vec3()) * (1.0 - fraction);
            weight *= near.element_product();

            let map = &self.irradiance[probe * self.irradiance_map.texels()..];
            let light: Vec3 = facing_texels.iter().map(|(t, w)| map[*t] * *w).sum();
            // Square roots are blended (G3D): contrast counts as the eye sees it.
            sum += weight * light.max(Vec3::ZERO).map(f32::sqrt);
            weights += weight;
        }
        if weights <= 0.0 {
            return Vec3::ZERO;
        }
        let root = sum / weights;
        root * root
    }
}
