//! Glossy reflection of light in spherical harmonics: the split sum (Karis 2013, *Real Shading in Unreal
//! Engine 4*). Its first factor is the mean radiance over a lobe about [`lobe_direction`], its second a
//! table of what a surface reflects of uniform light, GGX with roughness squared as in glTF.
//!
//! The lobe is wider than a zonal fit to GGX (DDISH-GI Appendix A, [`integrate::lobe`]), which is a mirror
//! at roughness 0: an expansion of degree 2 has no detail for a mirror to show. Of light that comes
//! from a window or a lamp it has rings, and a narrow lobe finds their dark parts. The width was
//! chosen against traced light (`lobe.md` of `dapple chart --model probes`).

#[cfg(any(test, feature = "encode"))]
pub mod integrate;
mod table;

use glam::Vec3;

pub use table::ENVIRONMENT;

/// Factors of degree 0 to 2 of the glossy lobe at roughness 0. SHARED with the client's shader.
pub const LOBE_SMOOTH: [f32; 3] = [1.0, 0.8, 0.5];
/// At roughness 1: the cosine's. SHARED with the client's shader.
pub const LOBE_ROUGH: [f32; 3] = [1.0, 2.0 / 3.0, 0.25];

/// Cosines, and roughnesses, of [`ENVIRONMENT`].
pub const ENVIRONMENT_SIDE: usize = 32;
/// The most that [`environment`] errs by from the integral: below roughness 0.1, where all grazing
/// light is gained or lost within n.v = roughness², and from there on.
pub const ENVIRONMENT_ERROR: [f32; 2] = [7e-2, 5.1e-3];

/// The factors by which the lobe of this roughness, 0 to 1, multiplies degree 0 to 2. SHARED with the
/// client's shader.
pub fn lobe(roughness: f32) -> [f32; 3] {
    let share = roughness.clamp(0.0, 1.0);
    std::array::from_fn(|l| LOBE_SMOOTH[l] + (LOBE_ROUGH[l] - LOBE_SMOOTH[l]) * share)
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
