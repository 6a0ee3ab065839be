//! Meshes that break bakes, and whole bakes of small scenes.

use super::*;
use crate::obscurance::shapes::{cuboid, faceted, flat, floor, inside_out, scene};
use crate::scene::{Alpha, Material, Mesh};
use glam::{DVec3, Vec3};

/// Fits one function of the position, sampled without noise. Only sites for which `is_valid` holds
/// count.
fn fit_function(
    mesh: Mesh,
    is_valid: impl Fn(DVec3) -> bool,
    f: impl Fn(DVec3) -> f64,
) -> (Shape, fit::Fit) {
    let (scene, pose) = scene(vec![mesh]);
    let shape = Shape::new(&scene, &pose, 0);
    let sites = place::place(&scene, 0, &shape, Sampling::default());
    let at = |site: &Site| -> DVec3 {
        let corners = shape.corners(site.triangle as usize);
        (0..3).map(|k| corners[k] * site.weights()[k]).sum()
    };
    let gathers: Vec<Gather> = sites
        .iter()
        .map(|site| Gather {
            values: [f(at(site)) as f32, 0.0, 0.0, 0.0],
            back_share: if is_valid(at(site)) { 0.0 } else { 1.0 },
        })
        .collect();
    let samples = valid_samples(&sites, &gathers, 1);
    let default = mean(samples.clone(), 1);
    let fit = fit(&shape, samples, 1, 1.0, &default);
    for value in &fit.values[0] {
        assert!((0.0..=1.0).contains(value), "{value}");
    }
    (shape, fit)
}

fn errors(shape: &Shape, fit: &fit::Fit, f: impl Fn(DVec3) -> f64) -> f64 {
    let positions = shape.positions.iter().zip(&fit.values[0]);
    positions
        .map(|(p, v)| (f(*p) - v).abs())
        .fold(0.0, f64::max)
}

fn quads(corners: &[[[f32; 3]; 4]]) -> Mesh {
    let faces = corners.iter().flat_map(|q| {
        let [a, b, c, d] = q.map(Vec3::from);
        [[a, b, c], [a, c, d]]
    });
    faceted(&faces.collect::<Vec<_>>())
}

#[test]
fn linear_functions_are_reproduced() {
    let f = |p: DVec3| 0.2 + 0.05 * p.x + 0.02 * p.z;
    let (shape, fit) = fit_function(floor(Vec3::ZERO, 8.0, 8), |_| true, f);
    assert!(errors(&shape, &fit, f) < 1e-3);
    assert_eq!((fit.report.parts, fit.report.inexact), (1, 0));
}

#[test]
fn hidden_vertices_take_the_values_of_their_neighbours() {
    let (shape, fit) = fit_function(floor(Vec3::ZERO, 8.0, 16), |p| p.x < 3.2, |_| 0.7);
    assert!(fit.report.filled.from_neighbours > 100);
    assert_eq!(fit.report.filled.from_default, 0);
    assert!(errors(&shape, &fit, |_| 0.7) < 1e-6);
    // And where the values differ they stay within those of the visible part.
    let f = |p: DVec3| 0.3 + 0.05 * p.z;
    let (_, fit) = fit_function(floor(Vec3::ZERO, 8.0, 16), |p| p.x < 3.2, f);
    for value in &fit.values[0] {
        assert!((0.29..0.71).contains(value), "{value}");
    }
}

#[test]
fn creases_keep_two_values() {
    let floor = [[0.0; 3], [0.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, 0.0]];
    let wall = [[0.0; 3], [0.0, 2.0, 0.0], [0.0, 2.0, 2.0], [0.0, 0.0, 2.0]];
    let on_floor = |p: DVec3| f64::from(u8::from(p.x > p.y));
    let (shape, fit) = fit_function(quads(&[floor, wall]), |_| true, on_floor);
    assert_eq!((shape.variables(), fit.report.parts), (8, 2));
    for (normal, value) in shape.normals.iter().zip(&fit.values[0]) {
        let expected = f64::from(u8::from(normal.y > 0.5));
        assert!((value - expected).abs() < 1e-9, "{normal} {value}");
    }
}

#[test]
fn folded_edges_do_not_smooth_across() {
    // One row of vertices is in the fold; the others are a cell away from it on either side.
    let n = 9;
    let positions = (0..3 * n).map(|i: u32| {
        let z = (i % n) as f32;
        [
            Vec3::new(2.0, 0.0, z),
            Vec3::new(0.0, 0.0, z),
            Vec3::new(0.0, 2.0, z),
        ][(i / n) as usize]
    });
    let cells = (0..2 * n).filter(|i| i % n != n - 1);
    let triangles = cells.flat_map(|a| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]);
    let mesh = flat(positions.collect(), triangles.collect(), Vec3::Y);
    // Bends at the fold as far as a value can.
    let f = |p: DVec3| (p.x + p.y) / 2.0;
    let (shape, fit) = fit_function(mesh, |_| true, f);
    let error = errors(&shape, &fit, f);
    assert!(error < 1e-3, "{error}");
}

#[test]
fn vertices_that_texture_seams_split_are_one() {
    let mut mesh = floor(Vec3::ZERO, 2.0, 2);
    mesh.positions.push(mesh.positions[4]);
    mesh.normals.push(Vec3::new(0.01, 1.0, 0.0).normalize());
    mesh.triangles[3] = mesh.triangles[3].map(|v| if v == 4 { 9 } else { v });
    let (shape, _) = fit_function(mesh, |_| true, |_| 0.5);
    assert_eq!(shape.variable_of[9], shape.variable_of[4]);
    assert_eq!(shape.variables(), 9);
}

#[test]
fn parts_without_a_valid_sample_take_the_mean_of_the_others() {
    let mut mesh = floor(Vec3::ZERO, 4.0, 4);
    let other = floor(Vec3::new(100.0, 0.0, 0.0), 4.0, 4);
    let first = mesh.positions.len() as u32;
    mesh.triangles
        .extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    mesh.materials.extend(other.materials);
    mesh.positions.extend(other.positions);
    mesh.normals.extend(other.normals);
    let (_, fit) = fit_function(mesh.clone(), |p| p.x < 50.0, |_| 0.4);
    assert_eq!(fit.report.filled.from_default, 25);
    assert!(fit.values[0].iter().all(|v| (v - 0.4).abs() < 1e-6));
    let (_, fit) = fit_function(mesh, |_| false, |_| 0.4);
    assert_eq!(fit.report.filled.from_default, 50);
    assert!(fit.values[0].iter().all(|v| *v == 1.0));
}

#[test]
fn degenerate_and_coincident_triangles_change_nothing() {
    let f = |p: DVec3| 0.2 + 0.05 * p.x + 0.02 * p.z;
    let plain = floor(Vec3::ZERO, 8.0, 4);
    let with = |extra: &[[u32; 3]]| {
        let mut mesh = plain.clone();
        mesh.triangles.extend(extra);
        mesh.materials.resize(mesh.triangles.len(), 0);
        fit_function(mesh, |_| true, f)
    };
    let again: Vec<[u32; 3]> = plain.triangles.clone();
    let turned: Vec<[u32; 3]> = again.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    for extra in [
        // No area: a corner twice, three corners in a line.
        &[[0, 0, 1], [3, 3, 3], [0, 1, 2]][..],
        &again,
        &turned,
        // Three triangles at each edge, one of them upright.
        &[[0, 1, 7], [1, 0, 7]],
    ] {
        let (shape, fit) = with(extra);
        assert!(errors(&shape, &fit, f) < 1e-3, "{extra:?}");
        assert_eq!(fit.report.inexact, 0);
    }
}

#[test]
fn t_junctions_agree_on_what_their_samples_say() {
    // A large quad whose edge at x = 2 carries the corners of four small ones.
    let mut faces = vec![[[0.0; 3], [0.0, 0.0, 4.0], [2.0, 0.0, 4.0], [2.0, 0.0, 0.0]]];
    for i in 0..4 {
        let (a, b) = (i as f32, i as f32 + 1.0);
        faces.push([[2.0, 0.0, a], [2.0, 0.0, b], [3.0, 0.0, b], [3.0, 0.0, a]]);
    }
    let f = |p: DVec3| 0.2 + 0.1 * p.x + 0.05 * p.z;
    let (shape, fit) = fit_function(quads(&faces), |_| true, f);
    assert!(errors(&shape, &fit, f) < 1e-3);
}

/// The needle has 50,000 times the area of a triangle of the strip. With hinges weighted by the sum of
/// the areas the first cell would take its slope (an error of 0.08) whatever its own samples say.
#[test]
fn huge_triangle_leaves_its_tiny_neighbours_their_own_values() {
    let mut positions: Vec<Vec3> = (0..9)
        .flat_map(|i| [0.0f32, 0.02].map(|x| Vec3::new(x, 0.0, 0.02 * i as f32)))
        .collect();
    let mut triangles: Vec<[u32; 3]> = (0..8u32)
        .flat_map(|i| {
            [
                [2 * i, 2 * i + 2, 2 * i + 1],
                [2 * i + 1, 2 * i + 2, 2 * i + 3],
            ]
        })
        .collect();
    positions.push(Vec3::new(0.01, 0.0, -1000.0));
    triangles.push([1, 18, 0]);
    let f = |p: DVec3| if p.z < 0.0 { 0.2 } else { 0.2 + 4.0 * p.z };
    let (shape, fit) = fit_function(flat(positions, triangles, Vec3::Y), |_| true, f);
    for (p, value) in shape.positions.iter().zip(&fit.values[0]) {
        let error = (value - f(*p)).abs();
        assert!(error < if p.z > 0.07 { 0.02 } else { 0.06 }, "{p} {value}");
    }
}

#[test]
fn steps_stay_within_bounds() {
    let step = |p: DVec3| f64::from(u8::from(p.x > 3.9));
    let (_, fit) = fit_function(floor(Vec3::ZERO, 8.0, 16), |_| true, step);
    assert!(fit.report.at_bounds > 0);
    assert_eq!(fit.report.inexact, 0);
}

#[test]
fn samples_stand_for_all_of_the_area() {
    let (scene, pose) = scene(vec![cuboid(Vec3::ZERO, Vec3::new(0.1, 2.0, 30.0))]);
    let shape = Shape::new(&scene, &pose, 0);
    let sampling = Sampling {
        density: 10.0,
        max_per_face: 7,
    };
    let sites = place::place(&scene, 0, &shape, sampling);
    let total: f64 = sites.iter().map(|site| site.area).sum();
    assert!((total - 2.0 * (0.2 + 3.0 + 60.0)).abs() < 1e-4);
    for t in 0..shape.triangles.len() {
        let count = sites
            .iter()
            .filter(|site| site.triangle == t as u32)
            .count();
        assert_eq!(count, ((shape.areas[t] * 10.0).ceil() as usize).min(7));
    }
    for site in &sites {
        assert!(site.u >= 0.0 && site.v >= 0.0 && site.u + site.v <= 1.0);
    }
}

/// A box that stands in a floor, a sheet of glass, and a body inside out.
fn mixed() -> (Scene, Pose) {
    let (mut scene, pose) = scene(vec![
        floor(Vec3::new(-4.0, 0.0, -4.0), 8.0, 16),
        cuboid(Vec3::new(-1.0, -0.5, -1.0), Vec3::new(1.0, 2.0, 1.0)),
        floor(Vec3::new(-4.0, 5.0, -4.0), 8.0, 2),
        inside_out(cuboid(Vec3::new(50.0, 0.0, 0.0), Vec3::new(51.0, 1.0, 1.0))),
    ]);
    scene.materials.push(Material {
        alpha: Alpha::Blend,
        ..Material::default()
    });
    scene.meshes[2].materials.fill(1);
    (scene, pose)
}

fn quick() -> Settings {
    Settings {
        rays: 64,
        sampling: Sampling {
            density: 16.0,
            max_per_face: 4,
        },
        ..Settings::default()
    }
}

#[test]
fn scene_of_traps_bakes_to_sound_values() {
    let (scene, pose) = mixed();
    let tracer = Tracer::new(&scene, &pose);
    let (bake, _) = super::bake(&scene, &pose, &tracer, &quick()).expect("sound settings");
    assert_eq!(bake.instances.len(), 4);
    for (instance, mesh) in bake.instances.iter().zip(&scene.meshes) {
        assert_eq!(instance.values.len(), 2);
        for values in &instance.values {
            assert_eq!(values.len(), mesh.positions.len());
            assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
        }
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        let [short, long] = [0, 1].map(|kernel| mean(&instance.values[kernel]));
        assert!(
            long <= short + 1e-6,
            "far blockers count at the long distance"
        );
    }
    let floor = &bake.instances[0];
    // What is under the box is inside it.
    assert!(floor.report.invalid > 0);
    assert!(floor.report.fit.filled.from_neighbours > 0);
    let value = |at: Vec3| {
        let found = scene.meshes[0]
            .positions
            .iter()
            .position(|p| p.distance(at) < 1e-3);
        floor.values[0][found.expect("a corner of the grid")]
    };
    assert!(value(Vec3::new(-4.0, 0.0, -4.0)) > 0.97);
    assert!(value(Vec3::new(-1.5, 0.0, 0.0)) < 0.9);
    assert!(value(Vec3::ZERO) > 0.5, "no pull to black under the box");
    assert!(bake.instances[2].values.iter().flatten().all(|v| *v == 1.0));
    assert_eq!(bake.instances[2].report.fit.filled.see_through, 9);
}

#[test]
fn values_do_not_depend_on_threads() {
    let (scene, pose) = mixed();
    let tracer = Tracer::new(&scene, &pose);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.expect("a thread pool");
        let bake = pool.install(|| super::bake(&scene, &pose, &tracer, &quick()));
        bake.expect("sound settings").0
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn unsound_settings_are_refused() {
    let (scene, pose) = mixed();
    let tracer = Tracer::new(&scene, &pose);
    let refused = |settings: Settings| {
        let message = super::bake(&scene, &pose, &tracer, &settings).map(|_| ());
        assert!(message.is_err(), "{settings:?}");
    };
    for number in [-1.0, f64::NAN, f64::INFINITY] {
        refused(Settings {
            alpha: number,
            ..quick()
        });
        refused(Settings {
            sampling: Sampling {
                density: number,
                max_per_face: 4,
            },
            ..quick()
        });
    }
    refused(Settings { rays: 0, ..quick() });
}

#[test]
fn baselines_agree_on_a_constant() {
    let (scene, pose) = scene(vec![floor(Vec3::ZERO, 8.0, 4)]);
    let tracer = Tracer::new(&scene, &pose);
    let kernels = Settings::default().kernels;
    let obscurance = Obscurance::new(&scene, &tracer, &kernels, 16).expect("sound kernels");
    let shape = Shape::new(&scene, &pose, 0);
    let sites = place::place(&scene, 0, &shape, Sampling::default());
    let gathers = trace(&obscurance, &pose, 0, &sites);
    let samples = valid_samples(&sites, &gathers, kernels.len());
    for values in [
        baseline::at_vertices(&obscurance, &pose, 0, &shape),
        baseline::splat(&shape, samples, kernels.len()),
    ] {
        assert_eq!((values.len(), values[0].len()), (2, 25));
        assert!(values.iter().flatten().all(|v| (v - 1.0).abs() < 1e-9));
    }
}
