//! Obscurance against integrals.

use super::shapes::{cuboid, floor, inside_out, scene};
use super::*;
use crate::scene::{Alpha, Material, Mesh, Pose, Scene};
use crate::trace::Tracer;
use glam::{Vec3, Vec4};

const KERNELS: [Kernel; 3] = [
    Kernel::Exponential { half_distance: 2.0 },
    Kernel::Exponential {
        half_distance: 300.0,
    },
    Kernel::CutOff { distance: 1.5 },
];

/// Mean over seeds, so that the error is that of the method and not of one pattern.
fn mean(seeds: u32, at: impl Fn(u32) -> Gather) -> [f64; MAX_KERNELS] {
    let mut sums = [0.0; MAX_KERNELS];
    for seed in 0..seeds {
        for (sum, value) in sums.iter_mut().zip(at(seed).values) {
            *sum += f64::from(value) / f64::from(seeds);
        }
    }
    sums
}

fn rho(kernel: Kernel, x: f64) -> f64 {
    match kernel {
        Kernel::Exponential { half_distance } => 1.0 - 0.5f64.powf(x / f64::from(half_distance)),
        Kernel::CutOff { distance } => f64::from(u8::from(x > f64::from(distance))),
    }
}

/// Mean of `f` over the unit interval by the midpoint rule.
fn midpoint(n: u32, f: impl Fn(f64) -> f64) -> f64 {
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
    (0..n).map(|i| f(at(i))).sum::<f64>() / f64::from(n)
}

/// Mean over the cosine-weighted hemisphere about +Y of `f(direction)`.
fn hemisphere(n: u32, f: impl Fn([f64; 3]) -> f64) -> f64 {
    midpoint(n, |u| {
        let (r, y) = (u.sqrt(), (1.0 - u).sqrt());
        midpoint(n, |v| {
            let (sin, cos) = (std::f64::consts::TAU * v).sin_cos();
            f([r * cos, y, r * sin])
        })
    })
}

fn check(got: [f64; MAX_KERNELS], expected: impl Fn(Kernel) -> f64, tolerance: f64) {
    for (kernel, got) in KERNELS.into_iter().zip(got) {
        let expected = expected(kernel);
        assert!(
            (got - expected).abs() < tolerance,
            "{kernel:?}: {got} {expected}"
        );
    }
}

fn with<R>(scene: &Scene, pose: &Pose, rays: u32, f: impl FnOnce(&Obscurance) -> R) -> R {
    let tracer = Tracer::new(scene, pose);
    f(&Obscurance::new(scene, &tracer, &KERNELS, rays).expect("sound kernels"))
}

/// A plane that is large against the distances seen from it, 2 km a side.
fn plane() -> Mesh {
    floor(Vec3::new(-1000.0, 0.0, -1000.0), 2000.0, 1)
}

#[test]
fn points_above_a_plane_see_its_integral() {
    let (scene, pose) = scene(vec![plane()]);
    with(&scene, &pose, 256, |obscurance| {
        for h in [0.3f32, 1.0, 4.0] {
            let p = Vec3::new(0.1, h, 0.2);
            // Facing the plane, at distance h / cos(theta); cos^2 is uniform under these rays.
            let down = mean(64, |seed| obscurance.about(p, -Vec3::Y, -Vec3::Y, seed));
            let facing = |k: Kernel| midpoint(100_000, |u| rho(k, f64::from(h) / u.sqrt()));
            check(down, facing, 2e-3);
            // Over the sphere the cosine itself is uniform; the upper half is open.
            let all = mean(64, |seed| obscurance.in_volume(p, seed, |_, _| ()));
            let half = |k: Kernel| 0.5 + 0.5 * midpoint(100_000, |u| rho(k, f64::from(h) / u));
            check(all, half, 2e-3);
            let up = obscurance.about(p, Vec3::Y, Vec3::Y, 7);
            assert_eq!(up.values[..3], [1.0; 3]);
        }
        let on = obscurance.about(Vec3::new(3.0, 0.0, 5.0), Vec3::Y, Vec3::Y, 7);
        assert_eq!(
            (on.values[..3].to_vec(), on.back_share),
            (vec![1.0; 3], 0.0)
        );
    });
}

/// A single plane below is exact in degree 1 for the cut-off of ambient occlusion far away: half the sphere is open
/// (section 2.3). For distances in between the expansion stays near what rays about each normal find.
#[test]
fn expansion_above_a_plane_follows_the_normal() {
    let (scene, pose) = scene(vec![plane()]);
    with(&scene, &pose, 4096, |obscurance| {
        let p = Vec3::new(0.1, 1e-3, 0.2);
        let (expansions, gather) = obscurance.about_point(p, 3);
        assert_eq!(expansions[2][0], gather.values[2]);
        for normal in [Vec3::Y, Vec3::X, -Vec3::Y, Vec3::new(0.6, 0.8, 0.0)] {
            let got = sphere::evaluate(&expansions[2], normal);
            let expected = 0.5 + 0.5 * normal.y;
            assert!((got - expected).abs() < 5e-3, "{normal}: {got} {expected}");
        }
        let p = Vec3::new(0.1, 1.0, 0.2);
        let (expansions, _) = obscurance.about_point(p, 4);
        for normal in [Vec3::Y, Vec3::X, -Vec3::Y, Vec3::new(0.6, -0.8, 0.0)] {
            let direct = mean(8, |seed| obscurance.about(p, normal, normal, seed));
            for k in 0..2 {
                let got = f64::from(sphere::evaluate(&expansions[k], normal));
                assert!(
                    (got - direct[k]).abs() < 0.05,
                    "{normal} {k}: {got} {direct:?}"
                );
            }
        }
    });
    let open = with(&scene, &pose, 8, |o| o.about_point(Vec3::NAN, 1).0);
    assert_eq!(open[0][..2], [1.0, 0.0]);
}

#[test]
fn closed_box_gives_the_integral_over_its_distances() {
    let (min, max) = (Vec3::new(-2.0, 0.0, -1.0), Vec3::new(3.0, 2.5, 1.5));
    let (scene, pose) = scene(vec![inside_out(cuboid(min, max))]);
    with(&scene, &pose, 256, |obscurance| {
        let p = Vec3::new(0.5, 0.0, 0.25);
        let distance = |d: [f64; 3]| {
            (0..3)
                .map(|i| {
                    let side = if d[i] > 0.0 { max[i] } else { min[i] };
                    f64::from(side - p[i]) / d[i]
                })
                .fold(f64::INFINITY, f64::min)
        };
        let got = mean(64, |seed| obscurance.about(p, Vec3::Y, Vec3::Y, seed));
        check(got, |k| hemisphere(1000, |d| rho(k, distance(d))), 3e-3);
        let gather = obscurance.about(p, Vec3::Y, Vec3::Y, 1);
        assert_eq!(gather.back_share, 0.0);
        assert!(gather.is_valid());
    });
}

/// The rays that meet a wall at right angles, `s` metres away, within D are those with a share of
/// their direction along its normal above c = s / D: a segment of the disk below the hemisphere.
#[test]
fn right_angle_under_the_cut_off_is_a_segment_of_the_disk() {
    let wall = super::shapes::faceted(&[
        [
            Vec3::new(0.0, 0.0, -500.0),
            Vec3::new(0.0, 0.0, 500.0),
            Vec3::new(0.0, 900.0, 0.0),
        ],
        [
            Vec3::new(0.0, 0.0, 500.0),
            Vec3::new(0.0, 0.0, -500.0),
            Vec3::new(0.0, 900.0, 0.0),
        ],
    ]);
    let (scene, pose) = scene(vec![plane(), wall]);
    with(&scene, &pose, 256, |obscurance| {
        for s in [0.001f32, 0.3, 0.9, 1.49, 1.6] {
            let p = Vec3::new(s, 0.0, 0.0);
            let got = mean(256, |seed| obscurance.about(p, Vec3::Y, Vec3::Y, seed))[2];
            let c = f64::from(s / 1.5).min(1.0);
            let expected = 1.0 - (c.acos() - c * (1.0 - c * c).sqrt()) / std::f64::consts::PI;
            assert!((got - expected).abs() < 2e-3, "{s}: {got} {expected}");
        }
    });
}

#[test]
fn inside_of_a_body_is_invalid_unless_double_sided() {
    let (mut scene, pose) = scene(vec![cuboid(Vec3::ZERO, Vec3::ONE)]);
    let p = Vec3::splat(0.4);
    let gathers = |scene: &Scene| {
        with(scene, &pose, 256, |obscurance| {
            [
                obscurance.about(p, Vec3::Y, Vec3::Y, 1),
                obscurance.in_volume(p, 1, |_, _| ()),
            ]
        })
    };
    for gather in gathers(&scene) {
        assert_eq!(gather.back_share, 1.0);
        assert!(!gather.is_valid());
    }
    scene.materials[0].double_sided = true;
    for gather in gathers(&scene) {
        assert_eq!(gather.back_share, 0.0);
        assert!(gather.is_valid());
        assert!(gather.values[2] < 1e-6, "all walls are within the cut-off");
    }
}

#[test]
fn threshold_itself_is_valid() {
    let gather = |back_share| Gather {
        back_share,
        ..Gather::default()
    };
    assert!(gather(0.25).is_valid());
    assert!(!gather(0.2501).is_valid());
}

#[test]
fn glass_stops_no_ray_and_masks_stop_it_where_they_are_solid() {
    let lid = || floor(Vec3::new(-1000.0, 1.0, -1000.0), 2000.0, 1);
    let (mut scene, pose) = scene(vec![lid()]);
    let open = |scene: &Scene| {
        with(scene, &pose, 64, |obscurance| {
            obscurance.about(Vec3::ZERO, Vec3::Y, Vec3::Y, 3).values[2]
        })
    };
    scene.materials[0].double_sided = true;
    let solid = open(&scene);
    assert!(solid < 0.6);
    let mask = |alpha: f32| Material {
        base_color: Vec4::new(1.0, 1.0, 1.0, alpha),
        double_sided: true,
        alpha: Alpha::Mask { cutoff: 0.5 },
        ..Material::default()
    };
    scene.materials[0] = mask(0.6);
    assert_eq!(open(&scene), solid);
    scene.materials[0] = mask(0.4);
    assert_eq!(open(&scene.clone()), 1.0);
    scene.materials[0] = Material {
        alpha: Alpha::Blend,
        ..Material::default()
    };
    assert_eq!(open(&scene.clone()), 1.0);
}

#[test]
fn directions_of_a_volume_point_are_uniform_over_the_sphere() {
    let (scene, pose) = scene(vec![plane()]);
    with(&scene, &pose, 1024, |obscurance| {
        let mut moments = [0.0f64; 9];
        let mut count = 0;
        for seed in 0..16 {
            obscurance.in_volume(Vec3::Y, seed, |d, visible| {
                assert!((d.length() - 1.0).abs() < 1e-5);
                assert_eq!(visible.len(), KERNELS.len());
                let d = d.as_dvec3().to_array();
                for i in 0..9 {
                    moments[i] += d[i / 3] * d[i % 3];
                }
                count += 1;
            });
        }
        assert_eq!(count, 16 * 1024);
        for (i, moment) in moments.iter().enumerate() {
            let expected = if i % 4 == 0 { 1.0 / 3.0 } else { 0.0 };
            let got = moment / f64::from(count);
            assert!((got - expected).abs() < 2e-3, "{i}: {got}");
        }
    });
}

#[test]
fn unsound_requests_are_refused_and_points_that_are_none_are_open() {
    let (scene, pose) = scene(vec![plane()]);
    let tracer = Tracer::new(&scene, &pose);
    let new = |kernels: &[Kernel], rays| Obscurance::new(&scene, &tracer, kernels, rays);
    assert!(new(&[], 16).is_err());
    assert!(new(&[KERNELS[0]; 5], 16).is_err());
    assert!(new(&[Kernel::CutOff { distance: -1.0 }], 16).is_err());
    assert!(new(&KERNELS, 0).is_err());
    assert!(new(&KERNELS, gather::MAX_RAYS + 1).is_err());
    let obscurance = new(&KERNELS, 16).expect("sound");
    let nowhere = Vec3::new(f32::NAN, 0.0, 0.0);
    let gather = obscurance.about(nowhere, Vec3::Y, Vec3::Y, 0);
    assert_eq!(gather.values, [1.0, 1.0, 1.0, 0.0]);
    let gather = obscurance.in_volume(nowhere, 0, |_, _| panic!("no ray leaves it"));
    assert_eq!(gather.values, [1.0, 1.0, 1.0, 0.0]);
}
