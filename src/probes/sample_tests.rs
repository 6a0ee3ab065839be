//! What interpolation and shading must hold to whatever the probes say.

use super::*;
use crate::probes::visibility::texel_direction;

const GRID: Lattice = Lattice {
    dims: [3, 2, 4],
    spacing: Vec3::new(1.0, 2.0, 0.5),
};

fn uniform(value: Vec3) -> L2 {
    let mut c = [Vec3::ZERO; 9];
    c[0] = value / sh::Y0;
    c
}

fn places() -> impl Iterator<Item = (Vec3, Vec3, Vec3)> {
    (0..500u32).map(|i| {
        let s = |k: u32| (i.wrapping_mul(k) % 1009) as f32 / 1009.0;
        let unit = |a: u32| Vec3::new(s(a) - 0.5, s(a + 3) - 0.5, s(a + 8) - 0.49).normalize();
        let x = Vec3::new(s(7), s(11), s(23)) * GRID.extent() * 1.4 - 0.2;
        (x, unit(31), unit(101))
    })
}

fn close(a: &L2, b: &L2, tolerance: f32) -> bool {
    a.iter()
        .zip(b)
        .all(|(a, b)| (*a - *b).abs().max_element() <= tolerance)
}

#[test]
fn trilinear_reproduces_what_is_linear_and_clamps_outside() {
    let value = |p: Vec3| uniform(p * 0.3 + 1.0);
    let radiance: Vec<L2> = (0..GRID.count()).map(|i| value(GRID.position(i))).collect();
    let field = Field {
        lattice: GRID,
        radiance: &radiance,
        present: &[],
        visibility: None,
    };
    for (x, ..) in places() {
        let nearest = x.clamp(Vec3::ZERO, GRID.extent());
        assert!(close(&trilinear(&field, x), &value(nearest), 1e-4));
    }
}

/// Weights that are means leave a uniform field alone, whatever is absent or hidden.
#[test]
fn uniform_light_comes_through_anything() {
    let light = uniform(Vec3::new(3.0, 1.0, 0.2));
    let radiance = vec![light; GRID.count()];
    let texels: Vec<[u8; 2]> = (0..GRID.count() * 64)
        .map(|i| [(i * 31 % 256) as u8, (i % 9) as u8])
        .collect();
    for absent in 0..4 {
        let present: Vec<bool> = (0..GRID.count()).map(|i| i * 7 % 4 >= absent).collect();
        let field = Field {
            lattice: GRID,
            radiance: &radiance,
            present: &present,
            visibility: Some(Visibility {
                side: 8,
                range: 2.0,
                texels: &texels,
            }),
        };
        for (x, n, v) in places() {
            assert!(close(&visibility_weighted(&field, x, n, v), &light, 1e-4));
        }
    }
}

/// Two rooms of which each has one column of probes and a thin wall between them, at x = 0.5.
#[test]
fn a_sealed_dark_room_stays_dark() {
    let lattice = Lattice {
        dims: [2, 2, 2],
        spacing: Vec3::ONE,
    };
    let side = 16;
    let bright = 1000.0;
    let radiance: Vec<L2> = (0..8)
        .map(|i| uniform(Vec3::splat(if i % 2 == 0 { bright } else { 1.0 })))
        .collect();
    let range = 2.0;
    let texels: Vec<[u8; 2]> = (0..8 * 256)
        .map(|t| {
            let towards_wall = if t / 256 % 2 == 0 { 1.0 } else { -1.0 };
            let cosine = texel_direction(t % 256, side).x * towards_wall;
            let distance = if cosine > 0.0 { 0.5 / cosine } else { range };
            [(distance.min(range) / range * 255.0) as u8, 2]
        })
        .collect();
    let visibility = Some(Visibility {
        side,
        range,
        texels: &texels,
    });
    let mut field = Field {
        lattice,
        radiance: &radiance,
        present: &[true; 8],
        visibility,
    };
    let mut worst: f32 = 0.0;
    for i in 0..200 {
        let x = Vec3::new(0.51 + 0.4 * (i % 10) as f32 / 10.0, 0.3, i as f32 / 200.0);
        for n in [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::Z] {
            let c = visibility_weighted(&field, x, n, Vec3::X);
            worst = worst.max(c[0].x * sh::Y0 / bright);
        }
    }
    println!("a dark room of 0.001 beside a bright one: {worst}");
    assert!(worst < 0.0015, "{worst}");
    // Without the visibility block it is not dark at all: validity alone does not pass.
    field.visibility = None;
    let leak = visibility_weighted(&field, Vec3::new(0.51, 0.3, 0.5), Vec3::Y, Vec3::X);
    assert!(leak[0].x * sh::Y0 > 0.2 * bright);
}

#[test]
fn absent_probes_are_left_out_and_filled_where_there_is_no_other() {
    let radiance: Vec<L2> = (0..GRID.count())
        .map(|i| uniform(Vec3::splat(if i % 3 == 1 { 50.0 } else { 2.0 })))
        .collect();
    let present: Vec<bool> = (0..GRID.count()).map(|i| i % 3 != 1).collect();
    let field = |present| Field {
        lattice: GRID,
        radiance: &radiance,
        present,
        visibility: None,
    };
    for (x, n, v) in places() {
        // Next to an absent probe a present one is never far.
        if (x.x - 1.0).abs() > 0.01 {
            let c = visibility_weighted(&field(&present), x, n, v);
            assert!((c[0].x * sh::Y0 - 2.0).abs() < 1e-3);
        }
    }
    let at = GRID.position(1);
    let c = visibility_weighted(&field(&[]), at, Vec3::Y, Vec3::Y);
    assert!((c[0].x * sh::Y0 - 50.0).abs() < 1e-3, "the fill");
}

/// No jump anywhere: where probes go out of sight, out of the block, or are absent.
#[test]
fn the_result_is_continuous() {
    let radiance: Vec<L2> = (0..GRID.count())
        .map(|i| uniform(Vec3::splat((i * 13 % 7) as f32)))
        .collect();
    let present: Vec<bool> = (0..GRID.count()).map(|i| i % 5 != 0).collect();
    let texels = vec![[80, 20]; GRID.count() * 16];
    let field = Field {
        lattice: GRID,
        radiance: &radiance,
        present: &present,
        visibility: Some(Visibility {
            side: 4,
            range: 2.0,
            texels: &texels,
        }),
    };
    let (from, to) = (Vec3::new(0.05, 0.1, 0.07), Vec3::new(1.93, 1.88, 1.41));
    let steps = 200_000;
    let mut last: Option<f32> = None;
    for i in 0..=steps {
        let x = from.lerp(to, i as f32 / steps as f32);
        let c = visibility_weighted(&field, x, Vec3::Y, Vec3::Z)[0].x * sh::Y0;
        if let Some(last) = last {
            assert!((c - last).abs() < 0.02, "{x}: {last} {c}");
        }
        last = Some(c);
    }
}

/// The white furnace: uniform light of 1 leaves no white surface brighter than 1; a smooth metal
/// gives all of it back; and the diffuse part is what the gloss leaves.
#[test]
fn no_light_is_made() {
    let light = uniform(Vec3::ONE);
    for (_, n, v) in places() {
        let v = if v.dot(n) < 0.0 { -v } else { v };
        for roughness in [0.0, 0.1, 0.4, 0.8, 1.0] {
            for metallic in [0.0, 0.5, 1.0] {
                let white = Material {
                    base_color: Vec3::ONE,
                    metallic,
                    roughness,
                };
                let got = shade(&light, &white, n, v);
                let sum = (got.diffuse + got.glossy).x;
                assert!(sum <= 1.0 + 1e-3, "{roughness} {metallic}: {sum}");
                if metallic == 0.0 {
                    assert!(
                        (sum - 1.0).abs() < 1e-3,
                        "a dielectric loses nothing: {sum}"
                    );
                }
                if roughness == 0.0 && n.dot(v) > 0.1 {
                    assert!(sum > 0.99, "{sum}");
                }
            }
        }
    }
}

#[test]
fn materials_reflect_as_they_should() {
    let mut light = uniform(Vec3::ONE);
    light[3] = Vec3::splat(1.0);
    let (n, v) = (Vec3::Z, Vec3::new(-0.6, 0.0, 0.8));
    let at = |metallic, roughness| {
        let base_color = Vec3::new(1.0, 0.5, 0.0);
        let material = Material {
            base_color,
            metallic,
            roughness,
        };
        shade(&light, &material, n, v)
    };
    let metal = at(1.0, 0.2);
    assert_eq!(metal.diffuse, Vec3::ZERO);
    assert!(metal.glossy.x > 1.9 * metal.glossy.y);
    // A mirror sees the light in the mirror direction, 0.8 of what it has of degree 1.
    let mirror = at(1.0, 0.0).glossy.x;
    let expected = 1.0 + 0.8 * 0.488_602_5 * 0.6;
    assert!((mirror - expected).abs() < 0.01 * expected);
    // Rougher is duller where the light comes from.
    assert!(at(1.0, 0.8).glossy.x < at(1.0, 0.4).glossy.x);
    // Negative lobes of an expansion make no negative light.
    let ringing: L2 = std::array::from_fn(|i| Vec3::splat(if i == 3 { -9.0 } else { 0.0 }));
    let rough = Material {
        base_color: Vec3::ONE,
        metallic: 0.0,
        roughness: 0.3,
    };
    let dark = shade(&ringing, &rough, Vec3::X, Vec3::X);
    assert_eq!((dark.diffuse, dark.glossy), (Vec3::ZERO, Vec3::ZERO));
}
