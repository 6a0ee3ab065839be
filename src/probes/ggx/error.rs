//! How far the split sum with a zonal lobe is from the integral it stands for.
//!
//! The light is a random non-negative field of degree 2: a mean of squares of fields of degree 1,
//! which are of degree 2 exactly. The truth is the whole reflected integral of that light, GGX with
//! height-correlated Smith and Schlick's Fresnel; nothing of the split sum is in it, so that the
//! error holds all three of its sins: one lobe for every view, cut to degree 2, and light and BRDF
//! averaged apart.

use super::{environment, integrate, lobe, lobe_direction};
use crate::probes::sh::{L2, convolved, project};
use crate::rng::Rng;
use glam::Vec3;

/// Which direction the zonal lobe is centred on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The mirror direction, as in the paper.
    Mirror,
    /// [`lobe_direction`].
    Dominant,
}

/// Errors over many lights, relative to the root mean square of the exact values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    pub rms: f64,
    pub max: f64,
}

/// Half vectors a side of the exact integral's grid.
const SAMPLES: usize = 64;

/// A random light of degree 2, nowhere negative, of mean 1; black somewhere more often than not.
pub fn light(rng: &mut Rng) -> L2 {
    let mut signed = || rng.unit() * 2.0 - 1.0;
    let squares: [(f32, Vec3); 2] = std::array::from_fn(|_| {
        let tilt = Vec3::new(signed(), signed(), signed()) * 2.0;
        (signed(), tilt)
    });
    let field = |d: Vec3| -> f32 { squares.iter().map(|(a, b)| (a + b.dot(d)).powi(2)).sum() };
    // The vertices of an icosahedron integrate degree 5 exactly; the field times a basis function
    // has degree 4.
    let golden = 0.5 * (1.0 + 5f32.sqrt());
    let mut c = [Vec3::ZERO; 9];
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        for v in [
            Vec3::new(0.0, s, t * golden),
            Vec3::new(s, t * golden, 0.0),
            Vec3::new(t * golden, 0.0, s),
        ] {
            let d = v.normalize();
            project(&mut c, d, Vec3::splat(field(d)), std::f32::consts::PI / 3.0);
        }
    }
    let mean = c[0].x * crate::probes::sh::Y0;
    c.map(|c| c / mean.max(1e-6))
}

/// The error over `lights` random lights of a surface of normal reflectance `f0` seen at cosine
/// `n_v`, each light turned at random by being drawn so.
pub fn error(roughness: f32, n_v: f32, f0: f32, axis: Axis, lights: usize, seed: u64) -> Error {
    let n_v = n_v.clamp(1e-3, 1.0);
    let v = Vec3::new((1.0 - n_v * n_v).sqrt(), 0.0, n_v);
    let alpha = f64::from(roughness * roughness).max(1e-6);
    let samples = integrate::reflections(f64::from(n_v), alpha, SAMPLES);
    // The light is linear in its coefficients, and so is what is reflected of it.
    let mut exact = [Vec3::ZERO; 9];
    for s in samples {
        let fresnel = f64::from(f0) + (1.0 - f64::from(f0)) * s.schlick;
        let value = Vec3::splat((s.weight * fresnel) as f32);
        project(&mut exact, s.direction, value, 1.0);
    }
    let direction = match axis {
        Axis::Mirror => lobe_direction(Vec3::Z, v, 0.0),
        Axis::Dominant => lobe_direction(Vec3::Z, v, roughness),
    };
    let factors = lobe(roughness);
    let [scale, bias] = environment(n_v, roughness);
    let mut rng = Rng::new(seed);
    let (mut squares, mut truth, mut max) = (0.0, 0.0, 0.0f64);
    for _ in 0..lights {
        let light = light(&mut rng);
        let expected: f64 = (0..9).map(|i| f64::from(light[i].x * exact[i].x)).sum();
        let got = convolved(&light, &factors, direction).x.max(0.0) * (f0 * scale + bias);
        let difference = f64::from(got) - expected;
        squares += difference * difference;
        truth += expected * expected;
        max = max.max(difference.abs());
    }
    let size = (truth / lights.max(1) as f64).sqrt();
    Error {
        rms: (squares / lights.max(1) as f64).sqrt() / size,
        max: max / size,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probes::dering::minimum;
    use crate::probes::sh::evaluate_l2;

    #[test]
    fn lights_are_of_degree_2_non_negative_and_of_mean_1() {
        let mut rng = Rng::new(3);
        let mut dark = 0;
        for _ in 0..500 {
            let c = light(&mut rng);
            assert!((c[0].x * crate::probes::sh::Y0 - 1.0).abs() < 1e-5);
            let lowest = minimum(&c.map(|c| c.x));
            assert!(lowest > -1e-4, "{lowest}");
            dark += usize::from(lowest < 0.2);
            assert!(evaluate_l2(&c, Vec3::X).x >= -1e-4);
        }
        assert!(dark > 250, "{dark}");
    }

    /// At normal incidence on a smooth surface the lobe is the BRDF's own.
    #[test]
    fn what_the_split_sum_gets_right_is_right() {
        for roughness in [0.1, 0.2] {
            let e = error(roughness, 1.0, 1.0, Axis::Mirror, 100, 1);
            assert!(e.rms < 0.01, "{roughness}: {e:?}");
        }
        // At roughness 0.8 the masking alone moves it.
        let rough = error(0.8, 1.0, 1.0, Axis::Mirror, 100, 1);
        assert!(rough.rms < 0.06 && rough.max >= rough.rms, "{rough:?}");
    }

    /// The reason for [`lobe_direction`].
    #[test]
    fn leaning_to_the_normal_pays_on_rough_surfaces_at_an_angle() {
        for roughness in [0.5, 0.8] {
            let mirror = error(roughness, 0.5, 1.0, Axis::Mirror, 200, 2);
            let dominant = error(roughness, 0.5, 1.0, Axis::Dominant, 200, 2);
            assert!(dominant.rms < mirror.rms, "{dominant:?} {mirror:?}");
        }
    }
}
