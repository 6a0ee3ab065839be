//! Where points are placed, and which are left out: small and flat things, things that grow, and thin
//! layers.

use crate::tiny::{Served, Tiny, cuboid, floor};
use dapple::client::Client;
use dapple::codec::Limits;
use dapple::models::ModelOptions;
use dapple::points::place::Density;
use dapple::points::server::Options;
use dapple::rng::Rng;
use dapple::scene::{ChannelValues, Interpolation, Scene};
use glam::{Quat, Vec3};

/// Few rays, so that tests are quick.
fn options(scene: &Scene) -> Options {
    Options {
        rays: 64,
        visibility: false,
        ..Options::for_scene(scene)
    }
}

/// Sampled minus ray-traced AO at random places of an instance that are seen from outside: those that
/// lie in no other body.
fn errors(server: &Served, instance: usize, seen: impl Fn(Vec3) -> bool) -> Vec<f32> {
    let scene = server.world.scene();
    let track = server
        .tracks()
        .iter()
        .find(|t| t.instance == instance)
        .expect("the instance has points");
    let mut rng = Rng::new(5);
    let mut errors = Vec::new();
    for k in 0..2000 {
        let at = server.random_surface(instance, k, &mut rng);
        if seen(at.position) {
            let truth = server.traced_ao(&at, 0.6 * scene.length_scale(), k);
            errors.push(server.sampled_ao(track, &at) - truth);
        }
    }
    errors
}

fn rms(errors: &[f32]) -> f32 {
    (errors.iter().map(|e| e * e).sum::<f32>() / errors.len() as f32).sqrt()
}

/// A box of a metre on a floor of four, all lengths times `unit`.
fn still_life(unit: f32) -> Scene {
    let mut tiny = Tiny::new("still", 0.0);
    let nodes = [
        tiny.place("floor", floor(2.0), Vec3::ZERO),
        tiny.place("box", cuboid(Vec3::splat(0.5)), Vec3::Y * 0.5 * unit),
    ];
    for node in nodes {
        tiny.0.nodes[node].scale = Vec3::splat(unit);
    }
    tiny.0
}

/// Visible parts of the floor of [`still_life`], near the box.
fn beside_the_box(unit: f32) -> impl Fn(Vec3) -> bool {
    move |p: Vec3| {
        let p = p / unit;
        p.y > 0.01 || (p.x.abs().max(p.z.abs()) > 0.5 && p.x.abs().max(p.z.abs()) < 1.0)
    }
}

#[test]
fn ao_is_as_good_in_any_unit() {
    let mut last = None;
    for unit in [1.0, 0.01, 0.001, 1000.0] {
        let scene = still_life(unit);
        let mut server = Served::new(&scene, options(&scene));
        server.start();
        let points: usize = server.tracks().iter().map(|t| t.points()).sum();
        assert!(
            (2_000..1_500_000).contains(&points),
            "{unit}: {points} points"
        );
        let error = rms(&errors(&server, 0, beside_the_box(unit)));
        assert!(error < 0.04, "{unit}: {error}");
        if unit < 1.0 {
            let same = (points, (error * 1e3).round());
            assert_eq!(*last.get_or_insert(same), same, "{unit}");
        }
    }
}

#[test]
fn small_objects_have_points_on_all_sides() {
    let mut tiny = Tiny::new("speck", 0.0);
    tiny.place("floor", floor(3.0), Vec3::ZERO);
    tiny.place("speck", cuboid(Vec3::splat(0.01)), Vec3::Y * 0.3);
    let scene = tiny.0;
    let server = Served::new(&scene, options(&scene));
    let points = server.tracks()[1].points();
    assert!((60..=70).contains(&points), "{points}");
    let given = Options {
        density: Density {
            candidates: 1024.0,
            thinning: 2.0,
        },
        fitted: false,
        ..options(&scene)
    };
    let server = Served::new(&scene, given);
    assert_eq!(server.tracks()[1].points(), 2);
}

#[test]
fn an_object_that_grows_has_the_points_of_its_largest_pose() {
    for interpolation in [Interpolation::Linear, Interpolation::Step] {
        let mut scene = still_life(1.0);
        scene.duration = 2.0;
        scene.channels.push(dapple::scene::Channel {
            node: 1,
            interpolation,
            times: vec![0.0, 1.0, 2.0],
            values: ChannelValues::Scale(vec![Vec3::ZERO, Vec3::ONE, Vec3::ONE]),
        });
        let still = still_life(1.0);
        let wanted = Served::new(&still, options(&still));
        let options = Options {
            threshold: 0.0,
            ..options(&scene)
        };
        let mut server = Served::new(&scene, options);
        assert_eq!(
            server.tracks()[1].points(),
            wanted.tracks()[1].points(),
            "{interpolation:?}"
        );
        server.start();
        // Its own AO changes with its size, wherever the floor is.
        server.tick(1.0, None);
        for instance in [0, 1] {
            let error = rms(&errors(&server, instance, beside_the_box(1.0)));
            assert!(error < 0.05, "{interpolation:?} {instance}: {error}");
        }
        // The span that is encoded counts alone.
        let short = Options {
            span: 0.5,
            ..options
        };
        let shown = Served::new(&scene, short).tracks().len();
        assert_eq!(
            shown,
            if interpolation == Interpolation::Step {
                1
            } else {
                2
            }
        );
    }
}

#[test]
fn what_is_flattened_has_points_and_casts_ao() {
    // A floor made of a box that is flattened, at rest or by its animation.
    for animated in [false, true] {
        let mut tiny = Tiny::new("flat", 0.0);
        let flat = tiny.place("flat", cuboid(Vec3::new(2.0, 0.3, 2.0)), Vec3::ZERO);
        tiny.place("box", cuboid(Vec3::splat(0.5)), Vec3::Y * 0.8);
        tiny.0.nodes[flat].rotation = Quat::from_rotation_y(0.4);
        let flattened = Vec3::new(1.0, 0.0, 1.0);
        if animated {
            tiny.0.duration = 2.0;
            let scales = ChannelValues::Scale(vec![Vec3::ONE, flattened, flattened]);
            tiny.animate(flat, Interpolation::Linear, &[0.0, 1.0, 2.0], scales);
        } else {
            tiny.0.nodes[flat].scale = flattened;
        }
        let scene = tiny.0;
        let mut server = Served::new(&scene, options(&scene));
        server.start();
        server.tick(1.0, None);
        // Its upper side, which closes the lower side of the box.
        let below = |p: Vec3| p.y.abs() < 1e-6 && p.x.abs().max(p.z.abs()) < 1.0;
        let found = errors(&server, 0, below);
        assert!(
            found.len() > 100 && rms(&found) < 0.06,
            "{animated}: {}",
            rms(&found)
        );
        let closed = server.world.tracer().ambient_occlusion(
            Vec3::Y * 0.01,
            Vec3::NEG_Y,
            Vec3::NEG_Y,
            64,
            0.6,
            1,
        );
        assert_eq!(closed, 0.0, "{animated}");

        // The stream of it is one that decoders take.
        let job = dapple::stream::Job {
            models: vec![ModelOptions::Points(options(&scene))],
            view: dapple::stream::View::Fixed(scene.framing_camera(server.world.pose())),
            frames: 2,
            rate: dapple::codec::TickRate {
                numerator: 1,
                denominator: 1,
            },
            start: 0.0,
            limits: Limits::default(),
            keyframe_interval: 0,
            compression: dapple::codec::Compression::None,
        };
        let mut bytes = Vec::new();
        let mut stream = dapple::stream::Stream::start(&scene, job, &mut bytes, &mut |_, _| {})
            .expect("started");
        while stream.next_frame(&mut bytes).expect("a frame").is_some() {}
        stream.finish(&mut bytes).expect("finished");
        let mut client = Client::of_scene(&scene, Limits::default());
        assert_eq!(client.push(&bytes).expect("decoded"), 2);
    }
}

#[test]
fn thin_layers_darken_nothing_beside_them() {
    for height in [0.0005, 0.001] {
        let mut tiny = Tiny::new("decal", 0.0);
        tiny.place("floor", floor(1.0), Vec3::ZERO);
        tiny.place("decal", floor(0.4), Vec3::Y * height);
        let scene = tiny.0;
        let options = Options {
            rays: 128,
            ..options(&scene)
        };
        let mut server = Served::new(&scene, options);
        server.start();
        // What can be seen from above.
        let found = errors(&server, 0, |p| p.x.abs().max(p.z.abs()) > 0.4 + height);
        let darkest = found.iter().copied().fold(0.0, f32::min);
        assert!(found.len() > 500 && darkest > -0.1, "{height}: {darkest}");
    }
}

#[test]
fn contact_shadows_keep_their_depth() {
    let scene = still_life(1.0);
    let options = Options {
        rays: 128,
        ..options(&scene)
    };
    let mut server = Served::new(&scene, options);
    server.start();
    // A rim of 2 cm about the box, where half of the sky is closed.
    let found = errors(&server, 0, |p| {
        let beside = p.x.abs().max(p.z.abs());
        p.y < 0.01 && beside > 0.5 && beside < 0.55
    });
    let mean = found.iter().sum::<f32>() / found.len() as f32;
    assert!(found.len() > 10 && mean.abs() < 0.03, "{mean}");
}
