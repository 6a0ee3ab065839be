//! The update loop against fields that are known and small scenes that are traced.

use super::*;
use crate::probes::lattice::Lattice;
use crate::probes::sample::{Field, resistant, trilinear};
use crate::probes::sh::{Y0, basis, evaluate_l2, project};
use crate::probes::volume::INSET;
use crate::scene::{Instance, Material, Mesh, Pose, Scene};
use crate::trace::{Aabb, Ray, Tracer};
use glam::{Affine3A, UVec3};

fn volume(dims: [u16; 3]) -> Volume {
    let spacing = Vec3::splat(0.5);
    Volume {
        lattice: Lattice { dims, spacing },
        origin: Vec3::new(-1.0, 2.0, 0.5),
    }
}

fn server(dims: [u16; 3], options: Options) -> Server {
    Server::new(volume(dims), options).expect("a server")
}

fn plain() -> Options {
    Options {
        threshold: 0.0,
        visibility: 0,
        ..Options::default()
    }
}

fn light(radiance: Vec3) -> Arrived {
    Arrived {
        radiance,
        distance: 1.0,
        back_face: false,
    }
}

fn rng(draw: Draw) -> Rng {
    let Draw {
        probe,
        frame,
        sample,
    } = draw;
    Rng::new(u64::from(probe) << 40 ^ u64::from(frame) << 20 ^ u64::from(sample))
}

/// Uniform noise of mean 1 and standard deviation 0.58 about a value.
fn noisy(value: f32, draw: Draw) -> Arrived {
    light(Vec3::splat(value * 2.0 * rng(draw).unit()))
}

#[test]
fn a_white_room_is_its_expansion_to_the_last_bits() {
    for degree in 0..=4 {
        let options = Options { degree, ..plain() };
        let mut server = server([2, 2, 2], options);
        for _ in 0..3 {
            server.update(|_, _, _| light(Vec3::new(2.0, 1.0, 0.5)));
            for probe in 0..8 {
                let c = server.radiance(probe);
                assert_eq!(c.len(), (degree + 1) * (degree + 1));
                assert!((c[0] - Vec3::new(2.0, 1.0, 0.5) / Y0).length() < 2e-6);
                assert!(c[1..].iter().all(|c| c.length() < 2e-6));
            }
        }
    }
}

#[test]
fn light_that_the_expansion_holds_comes_back_from_few_samples() {
    let field = |d: Vec3| Vec3::new(2.0 + d.x, 1.0 - d.y * d.z, 3.0 * d.z * d.z);
    let options = Options {
        samples: 40,
        ..plain()
    };
    let mut server = server([3, 1, 1], options);
    server.update(|_, d, _| light(field(d)));
    for probe in 0..3 {
        for d in [Vec3::X, Vec3::Y, Vec3::new(0.6, 0.0, -0.8)] {
            assert!((evaluate_l2(&server.l2(probe), d) - field(d)).length() < 1e-4);
        }
    }
}

/// A small lamp, most of which no expansion of degree 2 holds: over many turns the rest cancels.
#[test]
fn light_that_it_does_not_hold_leaves_no_bias() {
    let axis = Vec3::new(0.36, 0.48, 0.8);
    let cut: f32 = 0.95;
    // The exact expansion of the cap: by Legendre's integrals over cosine 0.95 to 1.
    let p1 = 0.5 * (1.0 - cut * cut);
    let p2 = 0.5 * ((1.0 - cut.powi(3)) - (1.0 - cut));
    let band = [1.0 - cut, p1, p2].map(|p| p * std::f32::consts::TAU);
    let y = basis(axis);
    let options = Options {
        hysteresis: Hysteresis::Fixed(0.998),
        ..plain()
    };
    let probes = 16;
    let mut server = server([probes, 1, 1], options);
    let mut sums = [0.0f64; 9];
    let frames = 200;
    let share = 1.0 / f64::from(probes) / f64::from(frames);
    for _ in 0..frames {
        server.update(|_, d, _| {
            light(if d.dot(axis) > cut {
                Vec3::ONE
            } else {
                Vec3::ZERO
            })
        });
        for probe in &server.probes {
            let estimate = &probe.history;
            for (s, c) in sums.iter_mut().zip(estimate.recent()) {
                *s += f64::from(c.x) * share;
            }
        }
    }
    for (i, s) in sums.iter().enumerate() {
        let expected = f64::from(band[i.isqrt()] * y[i]);
        assert!((s - expected).abs() < 3e-3, "{i}: {s} {expected}");
    }
}

/// The estimate's own noise, too, falls with the samples, and says about as much as there is.
#[test]
fn variance_falls_with_samples() {
    let spread = |samples| {
        let options = Options { samples, ..plain() };
        let mut server = server([8, 8, 8], options);
        server.update(|_, _, draw| noisy(1.0, draw));
        let count = server.probes.len() as f32;
        let truth = Vec3::splat(1.0 / Y0);
        let variance = |p: usize| {
            let c = server.radiance(p);
            (c[0] - truth).length_squared() + c[1..].iter().map(|c| c.length_squared()).sum::<f32>()
        };
        let measured = (0..512).map(variance).sum::<f32>() / count;
        let stated = server.probes.iter().map(|p| p.history.noise()).sum::<f32>() / count;
        (measured, stated)
    };
    let (few, many) = (spread(64), spread(1024));
    let ratio = few.0 / many.0;
    assert!((12.0..21.0).contains(&ratio), "{ratio}");
    for (measured, stated) in [few, many] {
        let ratio = stated / measured;
        assert!((0.85..1.2).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_step_is_answered_by_the_power_of_the_hysteresis() {
    for a in [0.8, 0.95, 0.99, 0.998] {
        let options = Options {
            hysteresis: Hysteresis::Fixed(a),
            ..plain()
        };
        let mut server = server([1, 1, 1], options);
        server.update(|_, _, _| light(Vec3::ZERO));
        for n in 1..=60 {
            server.update(|_, _, _| light(Vec3::ONE));
            let got = server.radiance(0)[0].x * Y0;
            let expected = 1.0 - a.powi(n);
            assert!((got - expected).abs() < 1e-4, "{a}, {n}: {got} {expected}");
        }
    }
}

#[test]
fn adaptive_hysteresis_is_quick_where_light_changes_and_calm_where_not() {
    let options = Options {
        samples: 64,
        hysteresis: Hysteresis::Adaptive(0.99),
        ..plain()
    };
    let mut server = server([8, 4, 2], options);
    // Half of the probes see a light go out at frame 150.
    let value = |draw: Draw| {
        if draw.probe < 32 && draw.frame >= 150 {
            0.3
        } else {
            1.0
        }
    };
    let mut drops = 0;
    let mut spread = 0.0f32;
    for frame in 0..300u32 {
        let tick = server.update(|_, _, draw| noisy(value(draw), draw));
        let light = |p: usize| server.radiance(p)[0].x * Y0;
        if frame < 150 {
            assert_eq!(tick.dropped, 0, "noise is no change: {frame}");
        } else {
            drops += tick.dropped;
        }
        if frame == 154 {
            for p in 0..32 {
                assert!((light(p) - 0.3).abs() < 0.08, "{p}: {}", light(p));
            }
        }
        if frame >= 150 {
            for p in 32..64 {
                spread = spread.max((light(p) - 1.0).abs());
            }
        }
    }
    // One drop a probe, two where the first came half way.
    assert!((32..64).contains(&drops), "{drops}");
    // 64 samples of 0.58 over about 200 frames: 0.005.
    assert!(spread < 0.03, "{spread}");
}

#[test]
fn one_lucky_path_is_no_change() {
    let options = Options {
        samples: 64,
        hysteresis: Hysteresis::Adaptive(0.99),
        ..plain()
    };
    let mut server = server([4, 4, 4], options);
    for frame in 0..200 {
        let tick = server.update(|_, _, draw| {
            // One path in 40 frames finds a lamp and brings forty times what all others do.
            let lucky = draw.sample == 7 && (draw.frame + 3 * draw.probe) % 40 == 39;
            let mut arrived = noisy(1.0, draw);
            if lucky {
                arrived.radiance += 40.0 * 64.0 * 0.1;
            }
            arrived
        });
        assert_eq!(tick.dropped, 0, "{frame}");
    }
}

#[test]
fn what_does_not_change_is_not_sent() {
    let options = Options {
        threshold: 0.01,
        ..plain()
    };
    let mut server = server([4, 1, 1], options);
    let first = server.update(|_, _, draw| light(Vec3::splat(draw.probe as f32)));
    assert_eq!((first.changed, first.present, first.rays), (4, 4, 1024));
    for frame in 1..20 {
        let tick = server.update(|_, _, draw| {
            let grows = if draw.probe == 2 {
                1.0 + 0.2 * frame as f32
            } else {
                1.0
            };
            light(Vec3::splat(draw.probe as f32 * grows))
        });
        assert!(tick.changed <= 1);
        assert_eq!(tick.changed == 1, server.is_changed(2));
    }
    // What was given out is never farther from the truth than the threshold.
    let (out, mean) = (server.radiance(2)[0], server.probes[2].history.mean[0]);
    assert!((out - mean).length() < 0.02 * mean.length() && out.x > 2.0 / Y0);
}

#[test]
fn threads_change_nothing() {
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let options = Options {
                hysteresis: Hysteresis::Adaptive(0.95),
                visibility: 4,
                ..Options::default()
            };
            let mut server = server([5, 4, 3], options);
            for _ in 0..12 {
                server.update(|o, d, draw| Arrived {
                    radiance: (d + o) * rng(draw).unit(),
                    distance: rng(draw).unit() * 2.0,
                    back_face: draw.probe % 7 == 0,
                });
            }
            let light: Vec<Vec3> = (0..60).flat_map(|p| server.radiance(p).to_vec()).collect();
            let present: Vec<bool> = (0..60).map(|p| server.is_present(p)).collect();
            (light, present, server.codes.clone())
        })
    };
    assert_eq!(run(1), run(2));
    assert!(run(1).1.contains(&false) && run(1).1.contains(&true));
}

#[test]
fn light_that_is_no_number_is_none() {
    let mut server = server([1, 1, 1], plain());
    server.update(|_, _, draw| {
        light(Vec3::splat(match draw.sample {
            3 => f32::NAN,
            5 => f32::INFINITY,
            _ => 1.0,
        }))
    });
    assert!(server.radiance(0).iter().all(|c| c.is_finite()));
    assert!((server.radiance(0)[0].x * Y0 - 1.0).abs() < 0.05);
}

#[test]
fn options_out_of_range_are_refused() {
    let refused = |options| {
        Server::new(volume([1, 1, 1]), options)
            .err()
            .map(|e| e.to_string())
    };
    let base = Options::default();
    let cases = [
        (Options { samples: 0, ..base }, "sample"),
        (Options { degree: 5, ..base }, "degrees"),
        (
            Options {
                visibility: 5,
                ..base
            },
            "texels",
        ),
        (
            Options {
                hysteresis: Hysteresis::Fixed(0.5),
                ..base
            },
            "hysteresis",
        ),
        (
            Options {
                hysteresis: Hysteresis::Adaptive(f32::NAN),
                ..base
            },
            "hysteresis",
        ),
    ];
    for (options, word) in cases {
        let message = refused(options).expect("refused");
        assert!(message.contains(word), "{message}");
    }
    let bounds = Aabb {
        min: Vec3::ZERO,
        max: Vec3::ONE,
    };
    assert!(Volume::over(bounds, [0, 1, 1]).is_err());
    assert!(Volume::over(bounds, [4096, 4096, 2]).is_err());
    assert!(Volume::over(Aabb::EMPTY, [1, 1, 1]).is_err());
}

/// A box, its faces outward; inward if `inside`.
fn cuboid(min: Vec3, max: Vec3, inside: bool) -> Mesh {
    let corner = |i: usize| {
        let pick = UVec3::new(i as u32 & 1, i as u32 >> 1 & 1, i as u32 >> 2).as_vec3();
        min + (max - min) * pick
    };
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles: Vec<[u32; 3]> = faces
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .map(|[a, b, c]| if inside { [a, c, b] } else { [a, b, c] })
        .collect();
    Mesh {
        positions: (0..8).map(corner).collect(),
        normals: vec![Vec3::Y; 8],
        materials: vec![0; triangles.len()],
        triangles,
        ..Mesh::default()
    }
}

fn scene(meshes: Vec<Mesh>) -> (Scene, Pose) {
    let instances = (0..meshes.len())
        .map(|mesh| Instance {
            name: mesh.to_string(),
            mesh,
            ..Instance::default()
        })
        .collect();
    let pose = Pose {
        world_from_mesh: vec![Affine3A::IDENTITY; meshes.len()],
        deformed: vec![None; meshes.len()],
        ..Pose::default()
    };
    let scene = Scene {
        meshes,
        materials: vec![Material::default()],
        instances,
        ..Scene::default()
    };
    (scene, pose)
}

/// Surfaces that glow by a formula of their position, black from behind.
fn glowing<'a>(
    scene: &'a Scene,
    pose: &'a Pose,
    tracer: &'a Tracer,
    glow: impl Fn(Vec3) -> f32 + Sync + 'a,
) -> impl Fn(Vec3, Vec3, Draw) -> Arrived + Sync + 'a {
    move |origin, direction, _| {
        let ray = Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        };
        let Some(hit) = tracer.closest(&ray) else {
            return Arrived {
                radiance: Vec3::ZERO,
                distance: f32::INFINITY,
                back_face: false,
            };
        };
        let (instance, triangle) = (hit.instance as usize, hit.triangle as usize);
        let at = scene.surface(pose, instance, triangle, hit.u, hit.v);
        let back_face = at.geometric_normal.dot(direction) > 0.0;
        let value = if back_face { 0.0 } else { glow(at.position) };
        Arrived {
            radiance: Vec3::splat(value),
            distance: hit.t,
            back_face,
        }
    }
}

#[test]
fn probes_in_a_solid_box_are_found_and_stay_found() {
    let (low, high) = (Vec3::new(-1.1, -2.0, -0.7), Vec3::new(1.3, 0.2, 0.7));
    // The box stands on the floor, which is seen from inside it: its own bottom lies in it.
    let room = cuboid(Vec3::splat(-2.0), Vec3::splat(2.0), true);
    let (scene, pose) = scene(vec![room, cuboid(low, high, false)]);
    let tracer = Tracer::new(&scene, &pose);
    let over = Aabb {
        min: Vec3::splat(-1.8),
        max: Vec3::splat(1.8),
    };
    let volume = Volume::over(over, [7, 7, 7]).expect("a volume");
    let mut server = Server::new(volume, plain()).expect("a server");
    let arrive = glowing(&scene, &pose, &tracer, |_| 1.0);
    let inside = |p: usize| {
        let x = volume.position(p);
        x.cmpgt(low).all() && x.cmplt(high).all()
    };
    let expected = (0..343).filter(|p| !inside(*p)).count();
    assert!(expected < 340);
    for frame in 0..20 {
        let tick = server.update(&arrive);
        for p in 0..343 {
            assert_eq!(server.is_present(p), !inside(p), "{frame}: {p}");
        }
        assert_eq!(tick.present, expected);
        // Those inside are asked now and then only.
        assert!(frame == 0 || tick.rays < 256 * 343);
    }
}

/// A probe at the edge of the decision keeps it.
#[test]
fn presence_does_not_flicker() {
    let mut server = server(
        [4, 4, 4],
        Options {
            samples: 256,
            ..plain()
        },
    );
    let mut turns = 0;
    let mut last = Vec::new();
    for _ in 0..200 {
        server.update(|_, _, draw| Arrived {
            radiance: Vec3::ONE,
            distance: 100.0,
            back_face: rng(draw).unit() < 0.25,
        });
        let now: Vec<bool> = (0..64).map(|p| server.is_present(p)).collect();
        turns += now.iter().zip(&last).filter(|(a, b)| a != b).count();
        last = now;
    }
    assert!(turns < 10, "{turns} of 12,800");
    // But what is plainly inside is found, and what comes out again, too.
    for (share, expected) in [(0.5, false), (0.1, true)] {
        for _ in 0..40 {
            server.update(|_, _, draw| Arrived {
                radiance: Vec3::ONE,
                distance: 100.0,
                back_face: rng(draw).unit() < share,
            });
        }
        assert!((0..64).all(|p| server.is_present(p) == expected));
    }
}

#[test]
fn the_visibility_block_knows_the_walls_and_is_frozen() {
    let (low, high) = (Vec3::new(-1.0, -2.0, -3.0), Vec3::new(1.0, 2.0, 3.0));
    let (scene, pose) = scene(vec![cuboid(low, high, true)]);
    let tracer = Tracer::new(&scene, &pose);
    let over = Aabb {
        min: 0.8 * low,
        max: 0.8 * high,
    };
    let options = Options {
        visibility: 16,
        visibility_frames: 12,
        ..plain()
    };
    let volume = Volume::over(over, [3, 3, 3]).expect("a volume");
    let mut server = Server::new(volume, options).expect("a server");
    let arrive = glowing(&scene, &pose, &tracer, |_| 1.0);
    let mut frozen = Vec::new();
    for frame in 0..15 {
        let tick = server.update(&arrive);
        assert_eq!(tick.visibility_changed, frame < 12);
        if frame == 11 {
            frozen = server.codes.clone();
        }
    }
    assert_eq!(server.codes, frozen);
    // Distances to walls straight ahead, of every probe, in metres: the texel's own blur is 10
    // degrees, which lengthens them.
    let range = server.range();
    for p in 0..27 {
        let at = volume.position(p);
        for axis in 0..3 {
            let (d, distance) = (Vec3::AXES[axis], high[axis] - at[axis]);
            let see = server.visibility().expect("a block");
            let distance = distance.min(range);
            // A point before the wall is seen, one well behind it is not.
            let before = see.share(p, d * (0.9 * distance));
            // Down a corridor the blur takes in the walls beside it.
            assert!(distance > 2.0 || before > 0.5, "{p} {axis}: {before}");
            if distance < 0.7 * range {
                let behind = see.share(p, d * (1.25 * distance + 0.1));
                assert!(behind < 0.05, "{p} {axis}: {behind}");
            }
        }
    }
    server.geometry_changed();
    assert!(server.update(&arrive).visibility_changed);
}

/// Two rooms with a wall of 20 cm between them, one bright, one dark, traced from end to end.
#[test]
fn no_light_comes_through_a_wall() {
    let room = cuboid(Vec3::new(-4.0, -2.0, -2.0), Vec3::new(4.0, 2.0, 2.0), true);
    let wall = cuboid(Vec3::new(-0.1, -2.1, -2.1), Vec3::new(0.1, 2.1, 2.1), false);
    let (scene, pose) = scene(vec![room, wall]);
    let tracer = Tracer::new(&scene, &pose);
    let over = Aabb {
        min: Vec3::new(-3.5, -1.5, -1.5),
        max: Vec3::new(3.5, 1.5, 1.5),
    };
    let volume = Volume::over(over, [8, 4, 4]).expect("a volume");
    let options = Options {
        visibility: 16,
        ..plain()
    };
    let mut server = Server::new(volume, options).expect("a server");
    let arrive = glowing(
        &scene,
        &pose,
        &tracer,
        |x| if x.x > 0.0 { 1000.0 } else { 1.0 },
    );
    (0..16).for_each(|_| {
        server.update(&arrive);
    });
    let radiance: Vec<L2> = (0..128).map(|p| server.l2(p)).collect();
    let present: Vec<bool> = (0..128).map(|p| server.is_present(p)).collect();
    assert!(present.iter().all(|p| *p));
    let field = Field {
        lattice: volume.lattice,
        radiance: &radiance,
        present: &present,
        visibility: server.visibility(),
    };
    let (mut worst, mut plainly) = (0.0f32, 0.0f32);
    for i in 0..400 {
        let s = |k: usize| (i * k % 401) as f32 / 401.0 * 3.8 - 1.9;
        // On the wall itself, on the floor by the wall, and in the middle of the room.
        for (x, n) in [
            (Vec3::new(-0.1, s(17), s(57)), Vec3::NEG_X),
            (Vec3::new(-0.15 - 0.4 * s(91).abs(), -2.0, s(57)), Vec3::Y),
            (Vec3::new(-2.0 + s(17), s(57), s(91)), Vec3::Y),
        ] {
            let x = volume.to_grid(x);
            let v = (n + Vec3::NEG_X).normalize();
            worst = worst.max(resistant(&field, x, n, v)[0].x * Y0);
            plainly = plainly.max(trilinear(&field, x)[0].x * Y0);
        }
    }
    println!("dark room of 1 beside one of 1000: at most {worst}, trilinear {plainly}");
    assert!(worst < 3.0 && plainly > 300.0);
}

#[test]
fn a_volume_fits_the_inside_of_a_room() {
    let inner = (Vec3::new(-4.0, 0.0, -2.0), Vec3::new(4.0, 3.0, 2.0));
    let shell = (inner.0 - 0.5, inner.1 + 0.5);
    let meshes = vec![
        cuboid(inner.0, inner.1, true),
        cuboid(shell.0, shell.1, false),
    ];
    let (scene, mut pose) = scene(meshes);
    pose.cameras.push(crate::scene::camera::look_at(
        Vec3::new(1.0, 1.0, 0.5),
        Vec3::ZERO,
        1.0,
    ));
    let tracer = Tracer::new(&scene, &pose);
    let dims = [9, 4, 1];
    let volume = Volume::fit(&scene, &pose, &tracer, dims).expect("a volume");
    let end = volume.origin + volume.lattice.extent();
    for axis in 0..2 {
        let inset = INSET * volume.lattice.spacing[axis];
        assert!((volume.origin[axis] - inset - inner.0[axis]).abs() < 0.05);
        assert!((end[axis] + inset - inner.1[axis]).abs() < 0.05);
    }
    assert!(volume.origin.z.abs() < 0.05 && end.z == volume.origin.z);
    let nothing = Scene::default();
    let pose = Pose::default();
    let tracer = Tracer::new(&nothing, &pose);
    assert!(Volume::fit(&nothing, &pose, &tracer, dims).is_err());
}

#[test]
fn projecting_by_hand_agrees() {
    let mut by_hand = [Vec3::ZERO; 9];
    let mut directions = Vec::new();
    let mut samples = Vec::new();
    for i in 0..4000 {
        let d = spiral(i, 4000);
        let value = Vec3::splat((3.0 * d.x).exp());
        project(&mut by_hand, d, value, 4.0 * std::f32::consts::PI / 4000.0);
        directions.push(d);
        samples.push(value);
    }
    let estimate = projection::fit(2, &directions, &samples);
    for (a, b) in by_hand.iter().zip(&estimate.radiance) {
        assert!((*a - *b).length() < 0.02, "{a} {b}");
    }
}
