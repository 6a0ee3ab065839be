//! The update loop in small scenes that are traced.

use super::tests::plain;
use super::*;
use crate::probes::sample::{Field, trilinear, visibility_weighted};
use crate::probes::sh::Y0;
use crate::probes::volume::INSET;
use crate::scene::{Instance, Material, Mesh, Pose, Scene};
use crate::trace::path::{PathTracer, Sky};
use crate::trace::{Aabb, Ray, Tracer};
use glam::{Affine3A, UVec3};

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
) -> impl Fn(Vec3, Vec3, Draw) -> IncomingRadiance + Sync + 'a {
    move |origin, direction, _| {
        let ray = Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        };
        let Some(hit) = tracer.closest(&ray) else {
            return IncomingRadiance {
                radiance: Vec3::ZERO,
                distance: f32::INFINITY,
                back_face: false,
            };
        };
        let (instance, triangle) = (hit.instance as usize, hit.triangle as usize);
        let at = scene.surface(pose, instance, triangle, hit.u, hit.v);
        let back_face = at.geometric_normal.dot(direction) > 0.0;
        let value = if back_face { 0.0 } else { glow(at.position) };
        IncomingRadiance {
            radiance: Vec3::splat(value),
            distance: hit.t,
            back_face,
        }
    }
}

/// The nearest surface; all materials are single-sided.
fn nearest<'a>(tracer: &'a Tracer) -> impl Fn(Vec3, Vec3) -> Nearest + Sync + 'a {
    move |origin, direction| {
        let ray = Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        };
        let hit = tracer.closest(&ray);
        Nearest {
            distance: hit.map_or(f32::INFINITY, |hit| hit.t),
            back_face: hit.is_some_and(|hit| hit.back),
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

/// The same box with `Kept`: all probes are present, and the one in the box sees the room.
#[test]
fn kept_probes_are_all_present() {
    let (low, high) = (Vec3::splat(-0.7), Vec3::splat(0.7));
    let room = cuboid(Vec3::splat(-2.0), Vec3::splat(2.0), true);
    let (scene, pose) = scene(vec![room, cuboid(low, high, false)]);
    let tracer = Tracer::new(&scene, &pose);
    let paths = PathTracer::new(&scene, &pose, &tracer, Sky::uniform(Vec3::ONE));
    let over = Aabb {
        min: Vec3::splat(-1.5),
        max: Vec3::splat(1.5),
    };
    let volume = Volume::over(over, [3, 3, 3]).expect("a volume");
    let see = |inside| {
        let options = Options {
            inside,
            visibility: 8,
            ..plain()
        };
        let mut server = Server::new(volume, options).expect("a server");
        server.measure_geometry(|origin, direction| match inside {
            InsideGeometry::Disabled => nearest(&tracer)(origin, direction),
            InsideGeometry::Kept => Nearest {
                distance: paths
                    .first(origin, direction, true)
                    .0
                    .map_or(f32::INFINITY, |vertex| vertex.distance),
                back_face: false,
            },
        });
        (0..2).for_each(|_| {
            crate::probes::source::update(&mut server, &paths);
        });
        let present = (0..27).filter(|p| server.is_present(*p)).count();
        // From the middle to a metre ahead, beyond the box's face.
        let share = server.visibility().expect("a block").share(13, Vec3::X);
        (present, share)
    };
    assert_eq!(see(InsideGeometry::Kept), (27, 1.0));
    let (present, share) = see(InsideGeometry::Disabled);
    assert!(present == 26 && share < 0.01, "{present} {share}");
}

#[test]
fn the_visibility_block_knows_the_walls() {
    let (low, high) = (Vec3::new(-1.0, -2.0, -3.0), Vec3::new(1.0, 2.0, 3.0));
    let (scene, pose) = scene(vec![cuboid(low, high, true)]);
    let tracer = Tracer::new(&scene, &pose);
    let over = Aabb {
        min: 0.8 * low,
        max: 0.8 * high,
    };
    for side in [8, 16] {
        let options = Options {
            visibility: side,
            ..plain()
        };
        let volume = Volume::over(over, [3, 3, 3]).expect("a volume");
        let mut server = Server::new(volume, options).expect("a server");
        assert!(server.visibility().is_none(), "not measured yet");
        server.measure_geometry(nearest(&tracer));
        let see = server.visibility().expect("a block");
        for p in 0..27 {
            let at = volume.position(p);
            for axis in 0..3 {
                let (d, distance) = (Vec3::AXES[axis], high[axis] - at[axis]);
                // No place farther than this asks the probe.
                let asked = match volume.lattice.place(p)[axis] {
                    2 => server.range(),
                    _ => volume.lattice.spacing[axis],
                };
                let ahead = (0.9 * distance).min(asked);
                let before = see.share(p, d * ahead);
                // Down a corridor the blur takes in the walls beside it.
                assert!(ahead > 2.0 || before > 0.5, "{p} {axis}: {before}");
                if 1.25 * distance + 0.1 < asked {
                    let behind = see.share(p, d * (1.25 * distance + 0.1));
                    assert!(behind < 1e-3, "{p} {axis}: {behind}");
                }
            }
        }
    }
}

/// A grid that is aligned with a room: probes lie in its floor and walls, to a rounding error.
#[test]
fn probes_in_a_face_see_its_open_side() {
    let floor = cuboid(Vec3::new(-3.0, -0.2, -3.0), Vec3::new(3.0, 0.0, 3.0), false);
    let (scene, pose) = scene(vec![floor]);
    let tracer = Tracer::new(&scene, &pose);
    for lift in [-1e-3, -1e-7, 0.0, 1e-7, 1e-3] {
        let over = Aabb {
            min: Vec3::new(-1.0, lift, -1.0),
            max: Vec3::new(1.0, 1.0 + lift, 1.0),
        };
        let volume = Volume::over(over, [3, 2, 3]).expect("a volume");
        let mut server = Server::new(volume, plain()).expect("a server");
        server.measure_geometry(nearest(&tracer));
        server.update(|origin, direction, _| {
            assert!(origin.y > 1e-3 && origin.y < 1.1, "{origin}");
            let met = nearest(&tracer)(origin, direction);
            IncomingRadiance {
                radiance: Vec3::ONE,
                distance: met.distance,
                back_face: met.back_face,
            }
        });
        for p in 0..18 {
            assert!(server.is_present(p), "{lift}: {p}");
        }
    }
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
    server.measure_geometry(nearest(&tracer));
    (0..16).for_each(|_| {
        server.update(&arrive);
    });
    let radiance: Vec<L2> = (0..128).map(|p| server.l2(p)).collect();
    let present: Vec<bool> = (0..128).map(|p| server.is_present(p)).collect();
    assert!(present.iter().all(|p| *p));
    for visibility_step in [1, 8] {
        let options = Options {
            visibility_step,
            ..options
        };
        let mut server = Server::new(volume, options).expect("a server");
        server.measure_geometry(nearest(&tracer));
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
                worst = worst.max(visibility_weighted(&field, x, n, v)[0].x * Y0);
                plainly = plainly.max(trilinear(&field, x)[0].x * Y0);
            }
        }
        println!(
            "dark room of 1 beside one of 1000, step {visibility_step}: at most {worst}, trilinear {plainly}"
        );
        assert!(worst < 3.0 && plainly > 300.0);
    }
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
