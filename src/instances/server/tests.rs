//! The fit against functions that are known.

use super::fit::{self, Sample, evaluate, fit as fit_samples};
use super::*;
use crate::obscurance::shapes::{faceted, flat, floor, inside_out};
use crate::obscurance::{Kernel, Obscurance};
use crate::rng::Rng;
use crate::scene::{Instance, Material, Mesh, Node, Pose, Scene};
use crate::trace::Tracer;
use glam::{Affine3A, DVec3, Quat, Vec3};

/// `count` samples at random places that `place` makes of three numbers in -1..=1.
fn samples(
    count: usize,
    place: impl Fn([f64; 3]) -> DVec3,
    local: impl Fn(DVec3) -> f64,
    gold: impl Fn(DVec3, f64) -> f64,
) -> Vec<Sample> {
    let mut random = Rng::new(7);
    (0..count)
        .map(|i| {
            let at = place(std::array::from_fn(|_| 2.0 * random.unit_f64() - 1.0));
            let local = local(at);
            Sample {
                at,
                weight: 0.5 + random.unit_f64(),
                local,
                gold: gold(at, local),
                held_out: i % 4 == 3,
            }
        })
        .collect()
}

#[test]
fn linear_function_is_recovered() {
    let truth = [0.6, 0.1, -0.2, 0.25];
    let local = |u: DVec3| 0.55 + 0.4 * (9.0 * u.x + 4.0 * u.z).sin();
    let all = samples(400, DVec3::from_array, local, |u, l| {
        l * evaluate(&truth, u)
    });
    let fit = fit_samples(&all);
    assert_eq!(fit.spread, 3);
    for (got, expected) in fit.linear.global.iter().zip(truth) {
        assert!((got - expected).abs() < 2e-3, "{got} {expected}");
    }
    assert!(fit.linear.error < 1e-3, "{fit:?}");
    assert!(fit.scalar.error > 20.0 * fit.linear.error, "{fit:?}");
    assert!(fit.none.error > 2.0 * fit.scalar.error, "{fit:?}");
}

/// A constant needs no slope, whatever the local signal.
#[test]
fn scalar_is_recovered_and_has_no_slope() {
    let local = |u: DVec3| (0.5 + 0.5 * u.y * u.x).max(0.0);
    let all = samples(200, DVec3::from_array, local, |_, l| 0.7 * l);
    let fit = fit_samples(&all);
    assert!((fit.scalar.global[0] - 0.7).abs() < 1e-3);
    for c in &fit.linear.global[1..] {
        assert!(c.abs() < 1e-3, "{fit:?}");
    }
}

/// In a plane, on a line and in a point the function does not change across the samples, however strongly
/// it does along them; in a point it is the scalar.
#[test]
fn singular_layouts_have_no_slope_across() {
    type Layout = fn([f64; 3]) -> DVec3;
    let layouts: [(u32, Layout); 3] = [
        (2, |[x, y, _]| DVec3::new(x, y, 0.5)),
        (1, |[x, _, _]| DVec3::new(x, -0.25, 0.5)),
        (0, |_| DVec3::new(0.3, -0.25, 0.5)),
    ];
    for (spread, place) in layouts {
        let gold = |u: DVec3, l: f64| l * (0.5 + 0.2 * u.x + 0.1 * u.y);
        let fit = fit_samples(&samples(100, place, |_| 0.8, gold));
        assert_eq!(fit.spread, spread);
        let slope = &fit.linear.global[1..];
        assert!(slope[2].abs() < 1e-12, "{fit:?}");
        assert!(spread > 1 || slope[1].abs() < 1e-12, "{fit:?}");
        assert!(spread > 0 || slope[0].abs() < 1e-12, "{fit:?}");
        if spread == 0 {
            assert!((fit.linear.global[0] - fit.scalar.global[0]).abs() < 1e-12);
        }
        assert!(fit.linear.error <= fit.scalar.error + 1e-9, "{fit:?}");
        assert!(fit.linear.error < 2e-3, "{fit:?}");
    }
}

/// A slanted plane is as singular as one along the axes.
#[test]
fn slanted_plane_has_no_slope_across() {
    let normal = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    let place = |p: [f64; 3]| {
        let p = DVec3::from_array(p);
        p - normal * p.dot(normal)
    };
    let gold = |u: DVec3, l: f64| l * (0.5 + 0.2 * u.x);
    let fit = fit_samples(&samples(100, place, |_| 0.8, gold));
    assert_eq!(fit.spread, 2);
    let slope = DVec3::from_slice(&fit.linear.global[1..]);
    assert!(slope.dot(normal).abs() < 1e-12, "{fit:?}");
    assert!(slope.length() > 0.1);
}

#[test]
fn dark_objects_and_no_samples_keep_one() {
    let dark = samples(50, DVec3::from_array, |_| 0.0, |_, _| 0.4);
    for all in [&dark[..], &[]] {
        let fit = fit_samples(all);
        for rung in [fit.none, fit.scalar, fit.linear] {
            assert_eq!(rung.global, fit::ONE);
        }
    }
    // Nearly dark: no coefficient beyond what a file holds.
    let nearly = samples(50, DVec3::from_array, |_| 1e-3, |u, _| 0.4 + 0.3 * u.x);
    let fit = fit_samples(&nearly);
    let coefficients = [fit.scalar.global, fit.linear.global].concat();
    assert!(coefficients.iter().all(|c| c.abs() <= fit::MAX_COEFFICIENT));
}

#[test]
fn held_out_samples_do_not_enter_the_fit() {
    let mut all = samples(80, DVec3::from_array, |_| 0.8, |_, l| 0.5 * l);
    let before = fit_samples(&all);
    all.iter_mut()
        .filter(|s| s.held_out)
        .for_each(|s| s.gold = 0.0);
    let after = fit_samples(&all);
    assert_eq!(before.linear.global, after.linear.global);
    assert!(before.scalar.error < 1e-3 && (after.scalar.error - 0.4).abs() < 1e-3);
}

/// Leaves of 20 cm that face up, on a winding stair of 8 m, so that none is above another.
fn stair() -> Mesh {
    let leaf = |k: usize| {
        let at = Vec3::new((k % 9) as f32 - 4.0, k as f32 / 10.0, (k / 9) as f32 - 4.0);
        [
            at,
            at + Vec3::new(0.0, 0.0, 0.2),
            at + Vec3::new(0.2, 0.0, 0.0),
        ]
    };
    faceted(&std::array::from_fn::<_, 80, _>(leaf))
}

fn instance(mesh: usize, node: Option<usize>) -> Instance {
    Instance {
        name: format!("{mesh} {node:?}"),
        mesh,
        node,
        ..Instance::default()
    }
}

/// Under a wide ceiling, upward leaves have a known obscurance that is nearly linear in height.
#[test]
fn ceiling_over_leaves_gives_its_integral() {
    let ceiling = inside_out(floor(Vec3::new(-2000.0, 0.0, -2000.0), 4000.0, 1));
    let scene = Scene {
        meshes: vec![stair(), ceiling],
        materials: vec![Material::default()],
        instances: vec![instance(0, None), instance(1, None)],
        ..Scene::default()
    };
    let height = 10.0f32;
    let pose = Pose {
        world_from_mesh: vec![
            Affine3A::IDENTITY,
            Affine3A::from_translation(Vec3::new(0.0, height, 0.0)),
        ],
        deformed: vec![None; 2],
        ..Pose::default()
    };
    let tracer = Tracer::new(&scene, &pose);
    let kernels = [30.0, 300.0].map(|half_distance| Kernel::Exponential { half_distance });
    let obscurance = Obscurance::new(&scene, &tracer, &kernels, 256).expect("kernels");
    let context = Context {
        scene: &scene,
        pose: &pose,
        obscurance: &obscurance,
        samples: 256,
        signals: &|values| values.to_vec(),
    };
    let local = vec![vec![1.0; scene.meshes[0].positions.len()]; 2];
    let solved = solve(&context, 0, &local);
    assert_eq!((solved.samples, solved.invalid), (256, 0));
    for (half_distance, fit) in [30.0, 300.0].iter().zip(&solved.fits) {
        let truth = |y: f64| {
            let h = f64::from(height) - y;
            let rho = |i: u32| {
                let u = (f64::from(i) + 0.5) / 2e4;
                1.0 - 0.5f64.powf(h / u.sqrt() / half_distance)
            };
            (0..20_000).map(rho).sum::<f64>() / 2e4
        };
        let mut worst = 0.0f64;
        for k in 0..=20 {
            let u = f64::from(k) / 10.0 - 1.0;
            let y = 0.5 * 7.9 * (u + 1.0);
            // The leaves' heights and places go together: any place of the height will do.
            let leaf = (10.0 * y).round().clamp(0.0, 79.0) as usize;
            let at = Vec3::new((leaf % 9) as f32 - 3.9, y as f32, (leaf / 9) as f32 - 3.9);
            let unit = super::solve::UnitBox::new(&scene.meshes[0].positions);
            let got = evaluate(&fit.linear.global, unit.place(at));
            worst = worst.max((got - truth(y)).abs());
        }
        let range = truth(0.0) - truth(7.9);
        assert!(worst < 0.05 * range, "{worst} of {range}");
        assert!(fit.linear.error < 0.1 * fit.scalar.error, "{fit:?}");
        assert!(fit.scalar.error < 0.5 * fit.none.error, "{fit:?}");
    }
    // The same on any number of threads.
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().expect("threads");
        assert_eq!(solved, pool.install(|| solve(&context, 0, &local)));
    }
}

/// An instance inside geometry has no valid sample, and keeps 1.
#[test]
fn instance_inside_geometry_keeps_one() {
    use crate::obscurance::shapes::{cuboid, scene};
    let inner = cuboid(Vec3::splat(-0.5), Vec3::splat(0.5));
    let (scene, pose) = scene(vec![inner, cuboid(Vec3::splat(-2.0), Vec3::splat(2.0))]);
    let tracer = Tracer::new(&scene, &pose);
    let kernels = [Kernel::Exponential { half_distance: 2.0 }];
    let obscurance = Obscurance::new(&scene, &tracer, &kernels, 32).expect("kernels");
    let context = Context {
        scene: &scene,
        pose: &pose,
        obscurance: &obscurance,
        samples: 40,
        signals: &|values| values.to_vec(),
    };
    let solved = solve(&context, 0, &[vec![1.0; scene.meshes[0].positions.len()]]);
    assert_eq!((solved.samples, solved.invalid), (0, 40));
    assert_eq!(solved.fits[0].linear.global, fit::ONE);
}

/// A node at `parent` with a scale and a place.
fn node(parent: Option<usize>, at: Vec3, scale: f32) -> Node {
    Node {
        name: String::new(),
        parent,
        translation: at,
        rotation: Quat::from_rotation_y(at.x),
        scale: Vec3::splat(scale),
        matrix: None,
        morph_weights: Vec::new(),
    }
}

/// Three trees of two parts, and a lone plank.
fn grove() -> Scene {
    let part = || flat(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]], Vec3::Z);
    let mut scene = Scene {
        meshes: vec![part(), part(), part()],
        materials: vec![Material::default()],
        ..Scene::default()
    };
    for (tree, scale) in [0.5, 2.0, 1.0].into_iter().enumerate() {
        let root = scene.nodes.len();
        scene
            .nodes
            .push(node(None, Vec3::X * tree as f32 * 5.0, scale));
        scene.nodes.push(node(Some(root), Vec3::ZERO, 0.1));
        scene.nodes.push(node(Some(root), Vec3::Y, 0.2));
        scene.instances.push(instance(0, Some(root + 1)));
        scene.instances.push(instance(1, Some(root + 2)));
    }
    scene.nodes.push(node(None, Vec3::Z, 1.0));
    scene.instances.push(instance(2, Some(9)));
    scene
}

#[test]
fn groups_have_the_parts_that_always_go_together() {
    let mut scene = grove();
    let pose = scene.rest_pose();
    let found = groups(&scene, &pose);
    let meshes: Vec<usize> = found.iter().map(|g| g.mesh).collect();
    assert_eq!(meshes, [0, 1]);
    assert_eq!(found[0].instances, [0, 2, 4]);
    assert_eq!(found[0].median, 4);
    assert!((found[0].scale - 0.1).abs() < 1e-6);
    assert_eq!(found[0].companions.len(), 1);
    assert_eq!(found[0].companions[0].mesh, 1);

    let (alone, at) = found[0].alone(&scene, &pose);
    assert_eq!(alone.instances.len(), 2);
    // Distances between the parts are those of the median instance in the world.
    let gap = |pose: &Pose, a: usize, b: usize| {
        (pose.world_from_mesh[a].translation - pose.world_from_mesh[b].translation).length()
    };
    assert!((gap(&at, 0, 1) - gap(&pose, 4, 5)).abs() < 1e-5);
    assert_eq!(at.world_from_mesh[0].translation, glam::Vec3A::ZERO);

    // One tree with its leaves elsewhere, and the object falls into two.
    scene.nodes[5].translation = Vec3::Z;
    let pose = scene.rest_pose();
    assert!(groups(&scene, &pose)[0].companions.is_empty());
}
