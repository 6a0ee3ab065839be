//! Regions of small scenes.

use super::basis::COUNT;
use super::*;
use crate::obscurance::shapes::{cuboid, floor, inside_out, scene};
use crate::rng::Rng;
use crate::scene::{CameraPose, Mesh, camera};
use crate::trace::Aabb;
use glam::Vec3;

fn aabb(min: [f32; 3], max: [f32; 3]) -> Aabb {
    Aabb {
        min: min.into(),
        max: max.into(),
    }
}

/// A room seen from within.
fn room(bounds: Aabb) -> Mesh {
    inside_out(cuboid(bounds.min, bounds.max))
}

fn eye(at: Vec3) -> CameraPose {
    camera::look_at(at, at + Vec3::X, 1.0)
}

fn settings(rays: u32) -> Settings {
    Settings {
        rays,
        cells: 4096,
        ..Settings::default()
    }
}

fn given(boxes: &[Aabb]) -> Given {
    let name = |(i, b): (usize, &Aabb)| Region {
        name: format!("{i}"),
        bounds: *b,
    };
    Given {
        regions: boxes.iter().enumerate().map(name).collect(),
        links: None,
    }
}

/// A plane at an endless distance to its edges blocks half of the sphere: (1 + n . y) / 2, which is linear
/// in the normal (section 2.3).
#[test]
fn one_occluding_plane_is_a_function_of_degree_one() {
    let plane = floor(Vec3::new(-1e5, 0.0, -1e5), 2e5, 1);
    let (scene, mut pose) = scene(vec![plane]);
    pose.cameras = vec![eye(Vec3::Y)];
    let tracer = Tracer::new(&scene, &pose);
    let kernels = [Kernel::CutOff { distance: 1e4 }];
    let obscurance = Obscurance::new(&scene, &tracer, &kernels, 1024).expect("sound");
    let bounds = aabb([-1.0, 0.2, -1.0], [1.0, 1.2, 1.0]);
    let space = Space::flood(&scene, &pose, &tracer, &[bounds.centre()], 1 << 15);
    let samples = sample(&obscurance, &tracer, &space, bounds).expect("one kernel");
    assert_eq!(samples.samples.len(), 512);
    for s in &samples.samples {
        let expected = [0.5, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (i, (got, expected)) in s.channels.iter().zip(expected).enumerate() {
            // One sample of 1,024 rays.
            assert!((got - expected).abs() < 0.02, "{i}: {got}");
        }
    }
    let fit = fit_region(bounds, &samples, 0.97, Centres::Both);
    let error = |derivatives, degree| {
        let form = Form {
            derivatives,
            degree,
            signals: 1,
        };
        let rung = fit.rungs.iter().find(|rung| rung.form == form);
        rung.and_then(|rung| rung.error).expect("held-out samples")
    };
    // The root mean square of n . y / 2 is 1 / sqrt(12); nothing of it is left from degree 1 on.
    assert!((error(Derivatives::None, 0) - 12f64.sqrt().recip()).abs() < 0.02);
    assert!(error(Derivatives::None, 1) < 0.006);
    assert!(error(Derivatives::None, 2) < 0.006);
}

#[test]
fn open_space_is_one() {
    let (scene, mut pose) = scene(vec![floor(Vec3::ZERO, 4.0, 1)]);
    pose.cameras = vec![eye(Vec3::ONE)];
    let tracer = Tracer::new(&scene, &pose);
    // What is above the reach of the floor.
    let kernels = [0.2, 0.3].map(|distance| Kernel::CutOff { distance });
    let obscurance = Obscurance::new(&scene, &tracer, &kernels, 100).expect("sound");
    let space = Space::flood(&scene, &pose, &tracer, &[], 4096);
    let bounds = aabb([1.0, 0.4, 1.0], [3.0, 1.4, 3.0]);
    let samples = sample(&obscurance, &tracer, &space, bounds).expect("two kernels");
    assert_eq!(samples.samples.len(), 512);
    for s in &samples.samples {
        for (i, channel) in s.channels.iter().enumerate() {
            let expected = if i % COUNT == 0 { 1.0 } else { 0.0 };
            assert!((channel - expected).abs() < 1e-12, "{i}: {channel}");
        }
    }
    let fit = fit_region(bounds, &samples, 0.5, Centres::Both);
    assert!(fit.rungs.iter().all(|rung| rung.error < Some(1e-6)));
}

/// The common case that the six derivatives are for (section 2.3).
#[test]
fn six_derivatives_beat_a_gradient_in_a_room() {
    let walls = aabb([0.0, 0.0, 0.0], [6.0, 3.0, 8.0]);
    let (scene, mut pose) = scene(vec![room(walls)]);
    pose.cameras = vec![eye(walls.centre())];
    let tracer = Tracer::new(&scene, &pose);
    let settings = settings(256);
    let obscurance =
        Obscurance::new(&scene, &tracer, &settings.kernels, settings.rays).expect("sound");
    let space = Space::flood(&scene, &pose, &tracer, &[], settings.cells);
    let samples = sample(&obscurance, &tracer, &space, walls).expect("two kernels");
    assert_eq!(samples.samples.len(), 512);
    assert_eq!(samples.valid, [u64::MAX; 8]);
    let fit = fit_region(walls, &samples, 0.97, Centres::Both);
    let error = |derivatives, degree| {
        let form = Form {
            derivatives,
            degree,
            signals: 2,
        };
        let rung = fit.rungs.iter().find(|rung| rung.form == form);
        rung.and_then(|rung| rung.error).expect("held-out samples")
    };
    let [none, gradient, sided] = Derivatives::ALL.map(|d| error(d, 2));
    assert!(
        sided < 0.8 * gradient && gradient < none,
        "{sided} {gradient} {none}"
    );
    // By symmetry the mean over the normals has no gradient.
    let [none, gradient, sided] = Derivatives::ALL.map(|d| error(d, 0));
    assert!(
        sided < none && (gradient / none - 1.0).abs() < 0.01,
        "{sided} {gradient} {none}"
    );
    // What falls to one side falls to the other.
    let mean = |i: usize| fit.models[2].terms[i][0];
    for axis in 0..3 {
        let (up, down) = (mean(1 + 2 * axis), mean(2 + 2 * axis));
        assert!(
            up < 0.0 && down > 0.0 && (up + down).abs() < 0.1 * down,
            "{up} {down}"
        );
    }
}

/// Two rooms with a wall of no thickness between them, which has a door.
fn two_rooms(door: bool) -> (crate::scene::Scene, Pose) {
    let wall = |z: [f32; 2]| cuboid(Vec3::new(4.0, 0.0, z[0]), Vec3::new(4.02, 3.0, z[1]));
    let mut meshes = vec![room(aabb([0.0, 0.0, 0.0], [8.0, 3.0, 4.0]))];
    match door {
        true => meshes.extend([wall([0.0, 1.5]), wall([2.5, 4.0])]),
        false => meshes.push(wall([0.0, 4.0])),
    }
    let (scene, mut pose) = scene(meshes);
    pose.cameras = vec![eye(Vec3::new(2.1, 1.5, 2.1))];
    (scene, pose)
}

#[test]
fn regions_cover_rooms_that_a_door_joins() {
    let (scene, pose) = two_rooms(true);
    let tracer = Tracer::new(&scene, &pose);
    let settings = settings(16);
    let plan = plan(&scene, &pose, &tracer, None, &settings).expect("free space");
    assert!(plan.covered > Some(0.95), "{:?}", plan.covered);
    let regions = &plan.graph.regions;
    assert!(regions.len() < 20, "{}", regions.len());
    // The walls of the room hold all of them to a cell.
    let cell = plan.space.cell();
    let around = aabb([0.0, 0.0, 0.0], [8.0, 3.0, 4.0]).grown(1.01 * cell);
    for region in regions {
        assert_eq!(around.union(&region.bounds), around);
    }
    // No box reaches far through the wall on both sides, but for one through the door.
    for region in regions {
        let Aabb { min, max } = region.bounds;
        let through = min.x < 4.0 - 2.0 * cell && max.x > 4.0 + 2.0 * cell;
        assert!(!through || (min.z > 1.0 && max.z < 3.0), "{region:?}");
    }
    assert!(!plan.graph.links.is_empty());
    // All are joined.
    let mut joined = vec![0];
    for _ in 0..regions.len() {
        for link in &plan.graph.links {
            let [a, b] = link.regions.map(|i| joined.contains(&i));
            if a != b {
                joined.push(link.regions[usize::from(a)]);
            }
            assert!(link.area > 0.0 && link.regions[0] < link.regions[1]);
        }
    }
    assert_eq!(joined.len(), regions.len());
    let again = super::plan(&scene, &pose, &tracer, None, &settings).expect("free space");
    assert_eq!(again.graph, plan.graph);
}

#[test]
fn space_ends_at_walls_without_doors() {
    let (scene, pose) = two_rooms(false);
    let tracer = Tracer::new(&scene, &pose);
    let plan = plan(&scene, &pose, &tracer, None, &settings(16)).expect("free space");
    assert!(plan.space.sees(&tracer, Vec3::new(3.9, 0.1, 0.1)));
    assert!(!plan.space.sees(&tracer, Vec3::new(4.1, 0.1, 0.1)));
    assert!(!plan.space.sees(&tracer, Vec3::splat(f32::NAN)));
    let cell = plan.space.cell();
    assert!(
        plan.graph
            .regions
            .iter()
            .all(|r| r.bounds.max.x < 4.0 + 2.0 * cell)
    );
}

#[test]
fn links_have_the_area_that_is_open() {
    let boxes = [
        aabb([0.0, 0.0, 0.0], [4.0, 3.0, 4.0]),
        aabb([4.0, 0.0, 0.0], [8.0, 3.0, 4.0]),
    ];
    for (door, area) in [(true, 3.0), (false, 0.0)] {
        let (scene, pose) = two_rooms(door);
        let tracer = Tracer::new(&scene, &pose);
        let plan = plan(&scene, &pose, &tracer, Some(given(&boxes)), &settings(16));
        let links = plan.expect("sound regions").graph.links;
        if !door {
            assert!(links.is_empty());
            continue;
        }
        let sum: f32 = links.iter().map(|link| link.area).sum();
        assert!((sum - area).abs() < 0.1, "{sum}");
        for link in &links {
            assert!(link.regions == [0, 1] && link.centre.x == 4.0);
            assert!((1.5..2.5).contains(&link.centre.z), "{link:?}");
        }
    }
}

#[test]
fn boundaries_are_where_the_smaller_box_ends() {
    let large = aabb([0.0, 0.0, 0.0], [4.0, 3.0, 4.0]);
    let areas = |b: Aabb| -> Vec<(usize, f32)> {
        let both = graph::boundaries(&large, &b);
        let other = graph::boundaries(&b, &large);
        assert_eq!(both, other);
        both.iter().map(|b| (b.axis, b.area())).collect()
    };
    // Beside it, of a door's size.
    assert_eq!(areas(aabb([4.0, 0.0, 1.0], [5.0, 2.0, 2.0])), [(0, 2.0)]);
    // Half in it, and with it on the floor.
    let overlaps = areas(aabb([3.5, 0.0, 1.0], [4.5, 2.0, 2.0]));
    assert_eq!(overlaps, [(0, 2.0), (1, 0.5), (2, 1.0), (2, 1.0)]);
    // Within it.
    let within = areas(aabb([1.0, 1.0, 1.0], [2.0, 2.0, 2.0]));
    assert_eq!(within.len(), 6);
    // An edge, and apart.
    assert!(areas(aabb([4.0, 3.0, 0.0], [5.0, 4.0, 4.0])).is_empty());
    assert!(areas(aabb([4.5, 0.0, 0.0], [5.0, 3.0, 4.0])).is_empty());
}

#[test]
fn samples_inside_geometry_and_behind_walls_are_invalid() {
    let (scene, pose) = two_rooms(false);
    let tracer = Tracer::new(&scene, &pose);
    let settings = settings(64);
    let obscurance =
        Obscurance::new(&scene, &tracer, &settings.kernels, settings.rays).expect("sound");
    let space = Space::flood(&scene, &pose, &tracer, &[], settings.cells);
    // Reaches through the wall, and through the outer wall.
    let bounds = aabb([-2.0, 0.0, 0.0], [6.0, 3.0, 4.0]);
    let samples = sample(&obscurance, &tracer, &space, bounds).expect("two kernels");
    for i in 0..512 {
        let p = samples::lattice(&bounds, i);
        let valid = samples.valid[i / 64] >> (i % 64) & 1 != 0;
        assert_eq!(valid, (0.0..4.0).contains(&p.x), "{p}");
    }
    assert_eq!(samples.samples.len(), 256);
    assert_eq!(samples.held_out.len(), samples::HELD_OUT);
    assert!(
        samples
            .held_out
            .iter()
            .all(|h| (0.0..4.0).contains(&h.position.x))
    );
}

#[test]
fn bake_is_the_same_on_any_number_of_threads() {
    let (scene, pose) = two_rooms(true);
    let settings = settings(32);
    let bake = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().expect("threads").install(|| {
            let tracer = Tracer::new(&scene, &pose);
            let sided = Derivatives::Sided;
            let (_, bake, _) = super::bake(&scene, &pose, &tracer, None, sided, &settings)
                .expect("sound settings");
            bake
        })
    };
    let (one, three) = (bake(1), bake(3));
    assert_eq!(one.regions, three.regions);
    assert_eq!(one.energies, three.energies);
    assert!(!one.regions.is_empty());
    let energies = &one.energies;
    assert!(energies.windows(2).all(|e| e[1].total() <= e[0].total()));
}

#[test]
fn values_of_a_bake_are_near_the_truth() {
    let walls = aabb([0.0, 0.0, 0.0], [6.0, 3.0, 8.0]);
    let (scene, mut pose) = scene(vec![room(walls)]);
    pose.cameras = vec![eye(walls.centre())];
    let tracer = Tracer::new(&scene, &pose);
    let settings = settings(256);
    let sided = Derivatives::Sided;
    let (_, bake, _) = super::bake(
        &scene,
        &pose,
        &tracer,
        Some(given(&[walls])),
        sided,
        &settings,
    )
    .expect("sound");
    let truth = Obscurance::new(&scene, &tracer, &settings.kernels, 1024).expect("sound");
    let mut random = Rng::new(3);
    let mut sum = 0.0;
    for _ in 0..200 {
        let at = Vec3::new(random.unit(), random.unit(), random.unit());
        let p = walls.min + (0.1 + 0.8 * at) * (walls.max - walls.min);
        let n = samples::direction(&mut random);
        let want = truth.about(p, n, n, random.draw() as u32).values;
        let got = model::evaluate(&bake.regions[0].model.channels(p), 2, n);
        sum += (got[1] - f64::from(want[1])).powi(2) / 200.0;
    }
    assert!(sum.sqrt() < 0.01, "{}", sum.sqrt());
    assert_eq!(bake.regions[0].model.terms[0].len(), 2 * COUNT);
}

#[test]
fn unsound_settings_are_refused() {
    let (scene, pose) = two_rooms(true);
    let tracer = Tracer::new(&scene, &pose);
    let bake = |change: &dyn Fn(&mut Settings)| {
        let mut settings = settings(4);
        change(&mut settings);
        super::bake(&scene, &pose, &tracer, None, Derivatives::None, &settings).map(|_| ())
    };
    assert!(bake(&|_| ()).is_ok());
    let third = Kernel::CutOff { distance: 1.0 };
    assert!(bake(&|s| s.kernels.push(third)).is_err());
    assert!(bake(&|s| s.kernels.clear()).is_err());
    assert!(bake(&|s| s.small = f64::NAN).is_err());
    assert!(bake(&|s| s.regularise.beta = -1.0).is_err());
    assert!(bake(&|s| s.blend.long = 2.0).is_err());
    let (empty, pose) = crate::obscurance::shapes::scene(vec![]);
    let tracer = Tracer::new(&empty, &pose);
    let none = super::bake(
        &empty,
        &pose,
        &tracer,
        None,
        Derivatives::None,
        &settings(4),
    );
    assert!(none.is_err());
}

#[test]
fn files_of_regions_say_what_is_wrong_with_them() {
    let good = r#"{"regions": [{"name": "a", "min": [0, 0, 0], "max": [4, 3, 4]},
        {"name": "b", "min": [4, 0, 0], "max": [8, 3, 4]}], "links": [["b", "a"], ["a", "b"]]}"#;
    let parsed = file::parse("r.json", good).expect("a sound file");
    assert_eq!(
        parsed.regions[1].bounds,
        aabb([4.0, 0.0, 0.0], [8.0, 3.0, 4.0])
    );
    let links = parsed.links.as_ref().expect("links are named");
    assert_eq!(links.len(), 1);
    assert_eq!(links[0], [0, 1]);
    for (from, to, says) in [
        ("regions", "rooms", "unknown field `rooms`"),
        ("\"max\": [4, 3, 4]", "\"max\": [4, 3]", "invalid length 2"),
        ("[4, 3, 4]", "[4, 3, 1e99]", "no finite number"),
        ("[4, 3, 4]", "[4, 3, NaN]", "expected value"),
        ("[4, 3, 4]", "[4, -3, 4]", "greater than its max"),
        (
            "\"name\": \"b\"",
            "\"name\": \"a\"",
            "two regions have the name",
        ),
        (
            "[\"a\", \"b\"]",
            "[\"a\", \"c\"]",
            "\"c\", which is not there",
        ),
        ("[\"a\", \"b\"]", "[\"a\", \"a\"]", "to itself"),
        ("\"min\": [4", "\"min\": [5", "share no boundary"),
        ("}", "", "at line"),
    ] {
        let bad = good.replace(from, to);
        let error = file::parse("r.json", &bad).expect_err(says).to_string();
        assert!(
            error.starts_with("r.json: ") && error.contains(says),
            "{error}"
        );
        assert!(!error.contains('\n'));
    }
    assert!(file::parse("r.json", r#"{"regions": []}"#).is_err());
    let (scene, pose) = two_rooms(true);
    let tracer = Tracer::new(&scene, &pose);
    let away = given(&[
        aabb([0.0, 0.0, 0.0], [4.0, 3.0, 4.0]),
        aabb([90.0, 0.0, 0.0], [91.0, 1.0, 1.0]),
    ]);
    let error = plan(&scene, &pose, &tracer, Some(away), &settings(4)).map(|_| ());
    let error = error.expect_err("nothing is there").to_string();
    assert_eq!(error, "region \"1\" overlaps no free space of the scene");
}

/// A grid is seldom in line with the walls.
#[test]
fn boxes_end_at_the_walls() {
    let walls = aabb([0.07, 0.0, 0.0], [6.31, 2.9, 8.05]);
    let (scene, mut pose) = scene(vec![room(walls)]);
    pose.cameras = vec![eye(walls.centre())];
    let tracer = Tracer::new(&scene, &pose);
    let plan = plan(&scene, &pose, &tracer, None, &settings(4)).expect("free space");
    assert_eq!(plan.graph.regions.len(), 1);
    let Aabb { min, max } = plan.graph.regions[0].bounds;
    assert!(min.distance(walls.min) < 1e-4 && max.distance(walls.max) < 1e-4);
}

#[test]
fn scenes_without_cameras_keep_one_space() {
    let small = room(aabb([10.0, 0.0, 0.0], [11.0, 2.0, 2.0]));
    let large = room(aabb([0.0, 0.0, 0.0], [8.0, 3.0, 4.0]));
    let (scene, pose) = scene(vec![small, large]);
    let tracer = Tracer::new(&scene, &pose);
    let space = Space::flood(&scene, &pose, &tracer, &[], 4096);
    assert!(space.sees(&tracer, Vec3::new(1.0, 1.0, 1.0)));
    assert!(!space.sees(&tracer, Vec3::new(10.5, 1.0, 1.0)));
    // Nothing below it, and above ceilings whose back it sees.
    assert!(!space.sees(&tracer, Vec3::new(9.0, 1.0, 1.0)));
    assert!(!space.sees(&tracer, Vec3::new(1.0, 3.5, 1.0)));
}

#[test]
fn regions_that_no_model_fits_are_divided() {
    // A low part and a high part behind it.
    let low = cuboid(Vec3::new(4.0, 0.5, 0.0), Vec3::new(8.0, 3.0, 4.0));
    let bounds = aabb([0.0, 0.0, 0.0], [8.0, 3.0, 4.0]);
    let (scene, mut pose) = scene(vec![room(bounds), low]);
    pose.cameras = vec![eye(Vec3::new(2.1, 1.5, 2.1))];
    let tracer = Tracer::new(&scene, &pose);
    let mut settings = settings(64);
    // In a closed room 300 m is dark everywhere.
    settings.kernels = [1.0, 3.0]
        .map(|half_distance| Kernel::Exponential { half_distance })
        .to_vec();
    let obscurance =
        Obscurance::new(&scene, &tracer, &settings.kernels, settings.rays).expect("sound");
    let space = Space::flood(&scene, &pose, &tracer, &[], settings.cells);
    let mut divide = |tolerance, depth| {
        settings.tolerance = tolerance;
        let name = "r".to_string();
        let region = Region { name, bounds };
        split::sample_and_split(&obscurance, &tracer, &space, region, &settings, depth)
            .expect("two kernels")
    };
    assert_eq!(divide(1.0, 2).len(), 1);
    assert_eq!(divide(0.0, 0).len(), 1);
    let parts = divide(0.01, 1);
    assert_eq!(parts.len(), 2);
    // Between the two parts, which is the middle.
    assert_eq!(parts[0].0.bounds.max.x, 4.0);
    assert_eq!((&parts[0].0.name[..], &parts[1].0.name[..]), ("r.0", "r.1"));
    assert_eq!(
        parts[0].1,
        sample(&obscurance, &tracer, &space, parts[0].0.bounds).expect("sound")
    );
}

/// The floor of a room may lie in another file.
#[test]
fn rooms_without_a_floor_are_space() {
    let mut open = room(aabb([0.0, 0.0, 0.0], [8.0, 3.0, 4.0]));
    let is_floor = |t: &[u32; 3]| t.iter().all(|v| open.positions[*v as usize].y == 0.0);
    let keep: Vec<bool> = open.triangles.iter().map(|t| !is_floor(t)).collect();
    let mut kept = keep.iter();
    open.triangles.retain(|_| kept.next() == Some(&true));
    let mut kept = keep.iter();
    open.materials.retain(|_| kept.next() == Some(&true));
    let (scene, pose) = scene(vec![open]);
    let tracer = Tracer::new(&scene, &pose);
    let space = Space::flood(&scene, &pose, &tracer, &[], 4096);
    assert!(space.sees(&tracer, Vec3::new(1.0, 1.0, 1.0)));
    assert!(!space.sees(&tracer, Vec3::new(1.0, 4.0, 1.0)));
}
