//! Glossy reflection of light in spherical harmonics: the split sum, whose first factor is a
//! convolution with a zonal fit to the GGX lobe (DDISH-GI Appendix A) and whose second is a table.
//!
//! The lobe is that of prefiltered environment maps (Karis 2013, *Real Shading in Unreal Engine
//! 4*): n = v = r, half vectors of D(h) n.h, their reflections weighed by the cosine to the normal.
//! It is symmetric about the mirror direction, so that a table of one variable and one number a
//! degree is all there is; alpha is roughness squared as in glTF. Its integral is 1, which is
//! degree 0 to the bit; what of the light a surface takes is the environment BRDF's.
//!
//! A table and linear interpolation, not a closed form: the integral has one, with a logarithm, but
//! it cancels near roughness 1, and a shader reads 64 entries sooner than it takes a logarithm.

#[cfg(feature = "encode")]
pub mod error;
#[cfg(any(test, feature = "encode"))]
pub mod integrate;
mod table;

use super::sh::MAX_DEGREE;
use glam::Vec3;
use std::f32::consts::PI;

pub use table::{ENVIRONMENT, LOBE};

/// Roughnesses of [`LOBE`], 0 to 1 evenly.
pub const LOBE_ENTRIES: usize = 64;
/// The most that [`lobe`] errs by from the integral, of any degree up to 2 and up to 4.
pub const LOBE_ERROR: [f32; 2] = [1.5e-4, 3.5e-4];
/// Cosines, and roughnesses, of [`ENVIRONMENT`].
pub const ENVIRONMENT_SIDE: usize = 32;
/// The most that [`environment`] errs by from the integral: below roughness 0.1, where all grazing
/// light is gained or lost within n.v = roughness², and from there on.
pub const ENVIRONMENT_ERROR: [f32; 2] = [7e-2, 5.1e-3];

/// The factors by which a lobe of this roughness, 0 to 1, multiplies degree 0 to 4: those of Eq. 1,
/// `sqrt(4 pi / (2 l + 1)) g_l`. SHARED with the client's shader.
pub fn lobe(roughness: f32) -> [f32; MAX_DEGREE + 1] {
    let at = roughness.clamp(0.0, 1.0) * (LOBE_ENTRIES - 1) as f32;
    let entry = (at as usize).min(LOBE_ENTRIES - 2);
    let f = at - entry as f32;
    let (a, b) = (LOBE[entry], LOBE[entry + 1]);
    let mut factors = [1.0; MAX_DEGREE + 1];
    for l in 0..MAX_DEGREE {
        factors[l + 1] = a[l] + (b[l] - a[l]) * f;
    }
    factors
}

/// The lobe's zonal coefficients `g_l`, as in the paper's Figure 3.
pub fn zonal(roughness: f32) -> [f32; MAX_DEGREE + 1] {
    let factors = lobe(roughness);
    std::array::from_fn(|l| factors[l] * ((2 * l + 1) as f32 / (4.0 * PI)).sqrt())
}

/// Scale and bias of the environment BRDF: a surface of normal reflectance f0 reflects
/// `f0 * scale + bias` of uniform light. Linear between entries over `x = sqrt(n_v)` and
/// `y = roughness`, as a texture of `ENVIRONMENT_SIDE`² texels sampled at `(xy * 31 + 0.5) / 32`.
/// The root gives grazing angles, where all change is, their share of the entries. SHARED with the
/// client's shader.
pub fn environment(n_v: f32, roughness: f32) -> [f32; 2] {
    let top = (ENVIRONMENT_SIDE - 1) as f32;
    let place = |x: f32| {
        let at = x.clamp(0.0, 1.0) * top;
        let cell = (at as usize).min(ENVIRONMENT_SIDE - 2);
        (cell, at - cell as f32)
    };
    let ((i, fx), (k, fy)) = (place(n_v.max(0.0).sqrt()), place(roughness));
    let entry = |i: usize, k: usize| ENVIRONMENT[k * ENVIRONMENT_SIDE + i];
    std::array::from_fn(|c| {
        let row = |k: usize| entry(i, k)[c] + (entry(i + 1, k)[c] - entry(i, k)[c]) * fx;
        row(k) + (row(k + 1) - row(k)) * fy
    })
}

/// The direction about which the lobe is centred: the mirror direction, drawn towards the normal as
/// roughness grows, for the real lobe leans that way (Lagarde and de Rousiers 2014, *Moving
/// Frostbite to PBR*, page 69, whose roughness is alpha). `n` and `v`, to the viewer, are unit. SHARED with the client's shader.
pub fn lobe_direction(n: Vec3, v: Vec3, roughness: f32) -> Vec3 {
    let mirror = n * (2.0 * n.dot(v)) - v;
    let alpha = (roughness * roughness).clamp(0.0, 1.0);
    let smooth = 1.0 - alpha;
    let share = smooth * (smooth.sqrt() + alpha);
    (n + (mirror - n) * share).normalize_or(n)
}

#[cfg(test)]
mod tests;
