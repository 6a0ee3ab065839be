//! Integrals of GGX: those behind [`super::environment`], and the lobe that is as wide as GGX.

use super::ENVIRONMENT_SIDE;
use glam::Vec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Intervals of Simpson's rule. The integrand is analytic: 2,000 differ from 16,000 by less than
/// 1e-12.
const INTERVALS: usize = 2000;
/// Half vectors a side of the environment BRDF's grid; twice as many differ by less than 5e-4, at
/// low roughness.
pub const ENVIRONMENT_SAMPLES: usize = 128;

/// The factors of degree 0 to 4 of the prefiltered GGX lobe: the means of Legendre's polynomials
/// over it.
///
/// Half vectors of D(h) n.h lie at `tan(theta) = alpha sqrt(u / (1 - u))`, u uniform. With n = v = r
/// the reflection is at twice that angle, and weighs its cosine to the normal (Karis 2013). The
/// substitution `u = tanh(w)^2` makes the integrand smooth at any roughness:
/// `cos(theta)^2 = 1 / (1 + alpha^2 sinh(w)^2)`, and the reflection is on the horizon at
/// `sinh(w) = 1 / alpha`.
pub fn lobe(roughness: f64) -> [f64; 5] {
    let alpha = roughness * roughness;
    if alpha == 0.0 {
        return [1.0; 5];
    }
    let end = (1.0 / alpha).asinh();
    let mut sums = [0.0; 5];
    for i in 0..=INTERVALS {
        let w = end * i as f64 / INTERVALS as f64;
        let simpson = match i {
            0 | INTERVALS => 1.0,
            _ if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let x = 2.0 / (1.0 + (alpha * w.sinh()).powi(2)) - 1.0;
        let weight = simpson * x.max(0.0) * w.tanh() / w.cosh().powi(2);
        let legendre = [
            1.0,
            x,
            1.5 * x * x - 0.5,
            2.5 * x.powi(3) - 1.5 * x,
            4.375 * x.powi(4) - 3.75 * x * x + 0.375,
        ];
        for (sum, p) in sums.iter_mut().zip(legendre) {
            *sum += weight * p;
        }
    }
    sums.map(|s| s / sums[0])
}

/// Scale and bias of the split sum's second factor: the white albedo of GGX with height-correlated
/// Smith masking seen at cosine `n_v`, split by Schlick's Fresnel into `f0 * scale + bias`.
///
/// Integrated over visible normals (Heitz 2018, *Sampling the GGX Distribution of Visible
/// Normals*), for which the weight is `G2 / G1 <= 1`, by the midpoint rule.
pub fn environment(n_v: f64, roughness: f64, samples: usize) -> [f64; 2] {
    let alpha = (roughness * roughness).max(1e-6);
    let mut sums = [0.0; 2];
    for sample in reflections(n_v.max(1e-4), alpha, samples) {
        sums[0] += sample.weight * (1.0 - sample.schlick);
        sums[1] += sample.weight * sample.schlick;
    }
    sums
}

/// A direction of light and its share in what is reflected of uniform light.
#[derive(Clone, Copy, Debug)]
pub struct Reflection {
    /// To the light; the normal is z, the viewer has no y.
    pub direction: Vec3,
    /// Without Fresnel.
    pub weight: f64,
    /// `(1 - v.h)^5`.
    pub schlick: f64,
}

/// The quadrature behind [`environment`]: `samples`² directions, less those below the horizon.
pub fn reflections(
    n_v: f64,
    alpha: f64,
    samples: usize,
) -> impl Iterator<Item = Reflection> + Clone {
    let v = [(1.0 - n_v * n_v).sqrt(), 0.0, n_v];
    let masking = masking(n_v, alpha);
    (0..samples * samples).filter_map(move |index| {
        // Crowded at the rim, where normals turn fast: u = 1 - s².
        let s = ((index / samples) as f64 + 0.5) / samples as f64;
        let phi = TAU * ((index % samples) as f64 + 0.5) / samples as f64;
        let h = visible_normal(v, alpha, 1.0 - s * s, phi);
        let v_h = v[0] * h[0] + v[2] * h[2];
        let n_l = 2.0 * v_h * h[2] - n_v;
        (n_l > 0.0).then(|| Reflection {
            direction: Vec3::from([0, 1, 2].map(|i| (2.0 * v_h * h[i] - v[i]) as f32)),
            weight: 2.0 * s * masking_shadowing(n_l, n_v, alpha)
                / (masking * (samples * samples) as f64),
            schlick: (1.0 - v_h.clamp(0.0, 1.0)).powi(5),
        })
    })
}

/// A normal out of those visible from `v`, the direction of `u` and angle `phi` on the projected
/// hemisphere. `v` has no y: the first tangent lies in its plane.
fn visible_normal(v: [f64; 3], alpha: f64, u: f64, phi: f64) -> [f64; 3] {
    let stretched = [alpha * v[0], v[2]];
    let length = stretched[0].hypot(stretched[1]);
    let [vx, vz] = stretched.map(|c| c / length);
    let (r, s) = (u.sqrt(), 0.5 * (1.0 + vz));
    let (sin, cos) = phi.sin_cos();
    // Tangents: t1 = y, t2 = v x t1 = (-vz, 0, vx).
    let t1 = r * cos;
    let t2 = (1.0 - s) * (1.0 - t1 * t1).sqrt() + s * r * sin;
    let up = (1.0 - t1 * t1 - t2 * t2).max(0.0).sqrt();
    let h = [
        alpha * (-vz * t2 + vx * up),
        alpha * t1,
        (vx * t2 + vz * up).max(0.0),
    ];
    let length = (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
    h.map(|c| c / length)
}

/// Smith's Lambda of GGX.
fn lambda(cosine: f64, alpha: f64) -> f64 {
    let tan2 = (1.0 - cosine * cosine) / (cosine * cosine);
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// G1.
fn masking(cosine: f64, alpha: f64) -> f64 {
    1.0 / (1.0 + lambda(cosine, alpha))
}

/// G2, height-correlated.
pub fn masking_shadowing(n_l: f64, n_v: f64, alpha: f64) -> f64 {
    1.0 / (1.0 + lambda(n_l, alpha) + lambda(n_v, alpha))
}

/// The BRDF times the cosine to the light, without Fresnel: `D G2 / (4 n.v)`.
pub fn brdf_cosine(n_h: f64, n_l: f64, n_v: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let d = a2 / (2.0 * FRAC_PI_2 * (n_h * n_h * (a2 - 1.0) + 1.0).powi(2));
    d * masking_shadowing(n_l, n_v, alpha) / (4.0 * n_v)
}

/// [`environment`] at `x = i / (ENVIRONMENT_SIDE - 1)`: n.v = x² within a row, roughness x from row
/// to row.
pub fn environment_table(samples: usize) -> Vec<[f64; 2]> {
    let at = |i: usize| i as f64 / (ENVIRONMENT_SIDE - 1) as f64;
    (0..ENVIRONMENT_SIDE * ENVIRONMENT_SIDE)
        .map(|i| {
            let (n_v, roughness) = (at(i % ENVIRONMENT_SIDE).powi(2), at(i / ENVIRONMENT_SIDE));
            environment(n_v, roughness, samples)
        })
        .collect()
}

/// The source text of `table.rs`.
pub fn source() -> String {
    use std::fmt::Write;
    let mut text = String::from(
        "//! Generated by `cargo test --lib probes::ggx -- --ignored write_the_tables`.\n\n\
         /// Scale and bias at n.v `(i % 32 / 31)²` and roughness `i / 32 / 31`.\n\
         #[rustfmt::skip]\n\
         pub const ENVIRONMENT: [[f32; 2]; super::ENVIRONMENT_SIDE * super::ENVIRONMENT_SIDE] = [\n",
    );
    for row in environment_table(ENVIRONMENT_SAMPLES).chunks(4) {
        let row: Vec<String> = row
            .iter()
            .map(|[a, b]| format!("[{a:.5}, {b:.5}]"))
            .collect();
        let _ = writeln!(text, "    {},", row.join(", "));
    }
    text.push_str("];\n");
    text
}
