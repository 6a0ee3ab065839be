//! The metallic-roughness material of glTF 2.0 (appendix B): a Lambert base under a GGX coat.
//!
//! ```text
//! f = (1 - F) c / pi + F D V
//! c = base colour * (1 - metallic)          F = f0 + (1 - f0) (1 - v.h)^5    (Schlick 1994)
//! f0 = mix(0.04, base colour, metallic)     D: GGX of alpha = roughness^2    (Walter et al. 2007)
//! V = G2 / (4 n.v n.l), Smith, height-correlated                             (Heitz 2014)
//! ```
//!
//! All that shades uses these functions, whether it samples paths or lights a rasterised picture
//! directly, so that methods differ in light and never in material. The coat scatters once: what
//! it loses by shadowing itself is lost (at most the share that its tests integrate).

use crate::trace::sampler::Frame;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Smoother materials are shaded as this smooth. Below it a highlight is smaller than `f32` tells
/// half vectors apart, and a point light's is no size that a picture could show.
pub const MIN_ROUGHNESS: f32 = 0.04;

/// Least cosine between a shading normal and the direction it is seen from.
const MIN_VIEW_COSINE: f32 = 0.01;

/// Bounds of the share of samples that go to the coat where there is a base below it, too.
const LOBE_SHARE: std::ops::RangeInclusive<f32> = 0.1..=0.9;

/// Weight of linear sRGB in what is seen (ITU-R BT.709).
pub fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// A material at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    /// Albedo of the Lambert base.
    pub diffuse: Vec3,
    /// Reflectance of the coat seen along its normal.
    pub f0: Vec3,
    /// The same at grazing angles: 1, or 0 where there is no coat.
    pub f90: f32,
    /// Width of the GGX distribution: squared roughness.
    pub alpha: f32,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// Unit, towards where light comes from.
    pub direction: Vec3,
    /// f * cos / pdf.
    pub weight: Vec3,
    /// Per steradian, of both lobes together.
    pub pdf: f32,
}

/// The shading normal as it is used for a view: leaned towards the viewer where interpolation or a
/// normal map has turned it away from a surface that is seen all the same. Both unit length.
pub fn seen_normal(normal: Vec3, view: Vec3) -> Vec3 {
    let cosine = normal.dot(view);
    if cosine >= MIN_VIEW_COSINE {
        return normal;
    }
    (normal + view * (MIN_VIEW_COSINE - cosine)).normalize_or(view)
}

impl Bsdf {
    /// Reflects nothing.
    pub const BLACK: Bsdf = Bsdf {
        diffuse: Vec3::ZERO,
        f0: Vec3::ZERO,
        f90: 0.0,
        alpha: 1.0,
    };

    pub fn new(base_color: Vec3, metallic: f32, roughness: f32) -> Bsdf {
        let metallic = metallic.clamp(0.0, 1.0);
        Bsdf {
            diffuse: base_color * (1.0 - metallic),
            f0: Vec3::splat(0.04).lerp(base_color, metallic),
            f90: 1.0,
            alpha: roughness.clamp(MIN_ROUGHNESS, 1.0).powi(2),
        }
    }

    /// The same material without its coat: Lambert's alone.
    pub fn without_coat(self) -> Bsdf {
        Bsdf {
            f0: Vec3::ZERO,
            f90: 0.0,
            ..self
        }
    }

    /// f * cos: what reaches `view` of light from `light` per irradiance that faces it. Unit
    /// directions, both away from the surface; zero where one is below it.
    pub fn evaluate(&self, normal: Vec3, view: Vec3, light: Vec3) -> Vec3 {
        self.evaluate_with_pdf(normal, view, light).0
    }

    /// [`Bsdf::evaluate`], and the density with which [`Bsdf::sample`] gives `light`.
    pub fn evaluate_with_pdf(&self, normal: Vec3, view: Vec3, light: Vec3) -> (Vec3, f32) {
        let (nv, nl) = (normal.dot(view), normal.dot(light));
        if nv <= 0.0 || nl <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let half = (view + light).normalize_or(normal);
        let d = self.distribution(normal, half);
        let (masked_v, masked_l) = (self.lambda(nv), self.lambda(nl));
        let fresnel = self.fresnel(view.dot(half));
        // V = 1 / (2 (nl * masked_v + nv * masked_l))
        let coat = fresnel * (0.5 * d * nl / (nl * masked_v + nv * masked_l));
        let base = (Vec3::ONE - fresnel) * self.diffuse * (nl / PI);
        let share = self.coat_share(nv);
        // D_v(h) / (4 v.h) with G1 = 2 nv / (nv + masked_v)
        let coat_pdf = 0.5 * d / (nv + masked_v);
        let pdf = share * coat_pdf + (1.0 - share) * (nl / PI);
        (coat + base, pdf)
    }

    /// Draws where light comes from: the lobe by `choice`, the direction by `u`, all uniform in
    /// [0, 1). The coat's half vector is one of those visible from `view` (Dupuy and Benyoub 2023,
    /// *Sampling Visible GGX Normals with Spherical Caps*). `None` for what the material swallows.
    pub fn sample(&self, normal: Vec3, view: Vec3, choice: f32, u: [f32; 2]) -> Option<Scattered> {
        let frame = Frame::about(normal);
        let local = frame.to_local(view);
        if local.z <= 0.0 {
            return None;
        }
        let direction = if choice < self.coat_share(local.z) {
            let half = self.visible_half(local, u);
            half * (2.0 * local.dot(half)) - local
        } else {
            let (sin, cos) = (TAU * u[1]).sin_cos();
            let r = u[0].sqrt();
            Vec3::new(r * cos, r * sin, (1.0 - u[0]).sqrt())
        };
        if direction.z <= 0.0 {
            return None;
        }
        let direction = frame.to_world(direction).normalize_or(normal);
        let (f, pdf) = self.evaluate_with_pdf(normal, view, direction);
        (pdf > 0.0).then(|| Scattered {
            direction,
            weight: f / pdf,
            pdf,
        })
    }

    /// A half vector, +Z the normal, from the distribution of those that `view` sees.
    fn visible_half(&self, view: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched =
            Vec3::new(view.x * self.alpha, view.y * self.alpha, view.z).normalize_or(Vec3::Z);
        let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (TAU * u[0]).sin_cos();
        let half = Vec3::new(r * cos, r * sin, z) + stretched;
        Vec3::new(half.x * self.alpha, half.y * self.alpha, half.z.max(0.0)).normalize_or(Vec3::Z)
    }

    /// D(h). The sine comes from the cross product: 1 - (n.h)^2 would lose narrow lobes to rounding.
    fn distribution(&self, normal: Vec3, half: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let cosine = normal.dot(half);
        let d = cosine * cosine * a2 + normal.cross(half).length_squared();
        a2 / (PI * d * d)
    }

    /// sqrt(alpha^2 + (1 - alpha^2) cos^2), which Smith's masking is made of.
    fn lambda(&self, cosine: f32) -> f32 {
        let a2 = self.alpha * self.alpha;
        (a2 + (1.0 - a2) * cosine * cosine).sqrt()
    }

    fn fresnel(&self, cosine: f32) -> Vec3 {
        let m = (1.0 - cosine).clamp(0.0, 1.0);
        let m2 = m * m;
        self.f0 + (Vec3::splat(self.f90) - self.f0) * (m2 * m2 * m)
    }

    /// The share of samples that go to the coat: about its share of the light.
    fn coat_share(&self, nv: f32) -> f32 {
        let coat = luminance(self.fresnel(nv));
        let base = luminance(self.diffuse) * (1.0 - coat);
        if base <= 0.0 || coat <= 0.0 {
            return f32::from(u8::from(base <= 0.0));
        }
        (coat / (coat + base)).clamp(*LOBE_SHARE.start(), *LOBE_SHARE.end())
    }
}

#[cfg(test)]
#[path = "bsdf_tests.rs"]
mod tests;
