//! The tables against their integrals, and the integrals against other ways to them.

use super::integrate;
use super::*;

#[test]
#[ignore = "writes src/probes/ggx/table.rs"]
fn write_the_tables() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/probes/ggx/table.rs");
    std::fs::write(path, integrate::source()).expect("the table is written");
}

#[test]
fn the_environment_table_is_what_the_generator_makes() {
    let made = integrate::environment_table(integrate::ENVIRONMENT_SAMPLES);
    for (i, (stored, made)) in ENVIRONMENT.iter().zip(made).enumerate() {
        for (s, m) in stored.iter().zip(made) {
            assert!((f64::from(*s) - m).abs() < 1e-5, "{i}: {s} {m}");
        }
    }
}

#[test]
fn the_environment_is_within_its_stated_error() {
    let mut worst = [0.0f32; 2];
    for k in 0..31 {
        for i in 0..31 {
            let at = |i: usize| (i as f32 + 0.5) / 31.0;
            let (n_v, roughness) = (at(i).powi(2), at(k));
            let exact = integrate::environment(f64::from(n_v), f64::from(roughness), 256);
            let got = environment(n_v, roughness);
            for c in 0..2 {
                let part = &mut worst[usize::from(roughness >= 0.1)];
                *part = part.max((got[c] - exact[c] as f32).abs());
            }
        }
    }
    println!("error of the environment BRDF: {worst:?}");
    for (w, stated) in worst.iter().zip(ENVIRONMENT_ERROR) {
        assert!(*w <= stated && *w > 0.5 * stated, "{worst:?}");
    }
}

/// The same means by plain quadrature of `D(theta / 2) cos(theta)` over the sphere.
#[test]
fn the_lobe_is_the_distribution_about_the_mirror_direction() {
    for roughness in [0.2, 0.5, 0.8, 1.0] {
        let a2 = f64::powi(roughness, 4);
        let (mut total, mut sums) = (0.0, [0.0; 2]);
        let n = 400_000;
        for i in 0..n {
            let x = (i as f64 + 0.5) / n as f64;
            let n_h2 = 0.5 * (1.0 + x);
            let weight = x / (n_h2 * (a2 - 1.0) + 1.0).powi(2);
            total += weight;
            sums[0] += weight * x;
            sums[1] += weight * (1.5 * x * x - 0.5);
        }
        let k = integrate::lobe(roughness);
        assert!((k[1] - sums[0] / total).abs() < 1e-5, "{roughness}");
        assert!((k[2] - sums[1] / total).abs() < 1e-5, "{roughness}");
    }
}

#[test]
fn the_lobe_of_ggx_widens_from_a_mirror_to_the_cosine() {
    assert_eq!(integrate::lobe(0.0), [1.0; 5]);
    for i in 0..64 {
        let (a, b) = (
            integrate::lobe(f64::from(i) / 64.0),
            integrate::lobe(f64::from(i + 1) / 64.0),
        );
        assert!((1..=4).all(|l| b[l] < a[l] && (l == 4 || b[l + 1] < b[l])));
    }
    // At roughness 1, D is constant: the factors are A_l / pi.
    let rough = integrate::lobe(1.0);
    assert!((rough[1] - 2.0 / 3.0).abs() < 1e-5 && (rough[2] - 0.25).abs() < 1e-5);
}

/// A second way to the environment BRDF: the BRDF itself, over the hemisphere of light.
#[test]
fn the_environment_is_the_integral_of_the_brdf() {
    let n = 600;
    for (n_v, roughness) in [(0.9f64, 0.6f64), (0.3, 0.5), (0.6, 1.0)] {
        let alpha = roughness * roughness;
        let v = [(1.0 - n_v * n_v).sqrt(), 0.0, n_v];
        let mut sums = [0.0; 2];
        for i in 0..n {
            for k in 0..n {
                let z = (i as f64 + 0.5) / n as f64;
                let (sin, cos) = (std::f64::consts::TAU * (k as f64 + 0.5) / n as f64).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let l = [r * cos, r * sin, z];
                let sum: [f64; 3] = std::array::from_fn(|c| v[c] + l[c]);
                let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
                // |v + l| = 2 v.h.
                let fresnel = (1.0 - 0.5 * length).powi(5);
                let f = integrate::brdf_cosine(sum[2] / length, z, n_v, alpha);
                sums[0] += f * (1.0 - fresnel);
                sums[1] += f * fresnel;
            }
        }
        let scale = std::f64::consts::TAU / (n * n) as f64;
        let got = integrate::environment(n_v, roughness, 256);
        for c in 0..2 {
            assert!((got[c] - sums[c] * scale).abs() < 1e-3, "{n_v} {roughness}");
        }
    }
}

#[test]
fn a_mirror_reflects_all_and_nothing_more_than_all() {
    let [a, b] = environment(1.0, 0.0);
    assert!((a - 1.0).abs() < 1e-3 && b.abs() < 1e-3);
    for i in 0..=40 {
        for k in 0..=40 {
            let [a, b] = environment(i as f32 / 40.0, k as f32 / 40.0);
            assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0001);
        }
    }
}

#[test]
fn the_lobe_leaves_the_mirror_direction_for_the_normal() {
    let (n, v) = (Vec3::Z, Vec3::new(0.8, 0.0, 0.6));
    assert!((lobe_direction(n, v, 0.0) - Vec3::new(-0.8, 0.0, 0.6)).length() < 1e-6);
    assert!((lobe_direction(n, v, 1.0) - n).length() < 1e-6);
    assert!((lobe_direction(n, n, 0.5) - n).length() < 1e-6);
}
