use super::*;
use crate::points::sample::tests::Random;
use crate::render::gpu;
use crate::render::raster::Raster;
use crate::render::tests::{bent, scene};
use crate::scene::Scene;
use crate::trace::offset::offset_origin;

fn light(kind: LightKind, position: Vec3, direction: Vec3) -> LightPose {
    LightPose {
        position,
        direction: direction.normalize(),
        kind,
        intensity: Vec3::new(9.0, 7.0, 5.0),
        range: f32::INFINITY,
    }
}

/// The test scene under a sun, two spots (one too wide for one map) and a lamp.
pub(in crate::render) fn lamps() -> (Scene, Pose) {
    let scene = scene();
    let mut pose = bent(&scene, 0.5);
    let spot = |outer| LightKind::Spot { inner: 0.2, outer };
    pose.lights = vec![
        light(
            LightKind::Directional,
            Vec3::ZERO,
            Vec3::new(-0.4, -1.0, -0.3),
        ),
        light(
            spot(0.6),
            Vec3::new(2.5, 3.0, 2.0),
            Vec3::new(-2.0, -2.4, -1.7),
        ),
        light(LightKind::Point, Vec3::new(-0.3, 2.3, 0.4), Vec3::Y),
        light(
            spot(1.4),
            Vec3::new(-2.0, 2.5, 2.0),
            Vec3::new(1.0, -1.5, -1.0),
        ),
    ];
    (scene, pose)
}

fn plan(scene: &Scene, pose: &Pose, side: u32) -> Plan {
    Plan::new(pose, scene.bounds(pose).unwrap(), side)
}

#[test]
fn lights_get_the_faces_they_need() {
    let (scene, pose) = lamps();
    let plan = plan(&scene, &pose, 100);
    assert_eq!(plan.side, 128);
    assert_eq!(plan.of_light, [(0, 1), (1, 1), (2, 6), (8, 6)]);
    assert_eq!(plan.faces.len(), 14);
    // 512 MiB are 14 maps of 2048 texels a side and no more than 7 of 4096.
    assert_eq!(
        Plan::new(&pose, (Vec3::ZERO, Vec3::ONE), 1 << 14).side,
        2048
    );
    for face in &plan.faces {
        let basis = glam::Mat3::from_cols(face.right, face.up, -face.forward);
        assert!((basis.determinant() - 1.0).abs() < 1e-5, "{face:?}");
    }
}

/// The matrix that draws, the lookup's projection and the twin's rays are one projection.
#[test]
fn one_projection_three_ways() {
    let (scene, pose) = lamps();
    let plan = plan(&scene, &pose, 128);
    let mut random = Random::new(5);
    for face in &plan.faces {
        let matrix = face.clip_from_world();
        for i in 0..200 {
            let (x, y) = (i * 7 % 128, i * 11 % 128);
            let ray = face.ray(x, y, 128);
            let t = random.unit() * 3.0 + 0.05;
            let p = ray.origin + ray.direction * t;
            let (at, depth) = face.project(face.local(p - face.origin), 128);
            assert!(at.distance(Vec2::new(x as f32, y as f32) + 0.5) < 1e-2);
            assert!((depth - face.depth(t)).abs() < 1e-4 * face.depth(t).abs().max(1.0));
            let ndc = matrix.project_point3(p);
            let raster = Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * 128.0;
            assert!(raster.distance(at) < 1e-2, "{raster} {at}");
            assert!((ndc.z - depth).abs() < 1e-4 * depth.abs().max(1.0));
        }
    }
}

/// A box all around the corners of which none is outside its map, with room for the filter.
#[test]
fn the_sun_sees_all_of_the_scene() {
    let (min, max) = (Vec3::new(-3.0, 0.0, -9.0), Vec3::new(40.0, 5.0, 2.0));
    let mut random = Random::new(2);
    for _ in 0..50 {
        let sun = light(LightKind::Directional, Vec3::ZERO, random.direction());
        let pose = Pose {
            lights: vec![sun],
            ..Pose::default()
        };
        let plan = Plan::new(&pose, (min, max), 256);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min } else { max }[axis];
            let p = Vec3::new(pick(0), pick(1), pick(2));
            let face = &plan.faces[0];
            let (at, depth) = face.project(face.local(p - face.origin), 256);
            assert!(at.min_element() >= GUARD && at.max_element() <= 256.0 - GUARD);
            assert!((0.0..1.0).contains(&depth), "{depth}");
        }
    }
}

#[test]
fn the_device_draws_what_rays_find() {
    let Some(gpu) = gpu::for_test() else { return };
    let (scene, pose) = lamps();
    let raster = Raster::new(&gpu, &scene, &pose).unwrap();
    let plan = plan(&scene, &pose, 128);
    let mut pass = device::ShadowPass::new(&gpu).unwrap();
    let maps = pass.draw(&gpu, &raster, &pose, &plan).unwrap();
    let drawn = device::read(&gpu, maps).unwrap();
    let traced = trace(plan, &Tracer::new(&scene, &pose));
    assert_eq!(drawn.len(), traced.depths.len());
    let (mut wrong, mut strange) = (0, 0);
    let mut covered = 0;
    for (face, (a, b)) in drawn
        .chunks(128 * 128)
        .zip(traced.depths.chunks(128 * 128))
        .enumerate()
    {
        for (i, (drawn, found)) in a.iter().zip(b).enumerate() {
            covered += usize::from(*found > 0.0);
            if (drawn - found).abs() <= 1e-5 + 1e-4 * found {
                continue;
            }
            // At an outline a texel's centre may fall to either side: then it has the depth of a
            // neighbour, or lies between those of two.
            let (x, y) = (i as i32 % 128, i as i32 / 128);
            let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            let near = near.map(|(x, y)| traced.depth(face, x, y));
            let (low, high) = near.fold((1.0f32, 0.0f32), |(l, h), d| (l.min(d), h.max(d)));
            wrong += 1;
            if *drawn < low * 0.99 - 1e-3 || *drawn > high * 1.01 + 1e-3 {
                println!("face {face} at {x}, {y}: {drawn}, not {found} within {low} to {high}");
                strange += 1;
            }
        }
    }
    assert!(covered > drawn.len() / 4, "{covered}");
    let share = wrong as f64 / drawn.len() as f64;
    println!("{wrong} of {} texels at outlines differ", drawn.len());
    // One or two are of a face that is seen edge-on and that no neighbour shows.
    assert!(share < 2e-3 && strange <= 2, "{share}, {strange}");
}

/// Places all over the scene: the looked-up shadow against the ray's.
#[test]
fn shadows_are_where_rays_say() {
    let (scene, pose) = lamps();
    let tracer = Tracer::new(&scene, &pose);
    let maps = trace(plan(&scene, &pose, 1024), &tracer);
    let mut random = Random::new(9);
    // Lit places that the map leaves no light, dark ones that it leaves all, and those that are
    // more wrong than right.
    for (l, light) in pose.lights.iter().enumerate() {
        let (mut acne, mut leaks, mut wrong, mut lit, mut dark) = (0, 0, 0, 0, 0);
        for _ in 0..20_000 {
            let instance = random.bits() as usize % scene.instances.len();
            let mesh = &scene.meshes[scene.instances[instance].mesh];
            let triangle = random.bits() as usize % mesh.triangles.len();
            let (mut u, mut v) = (random.unit(), random.unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let surface = scene.surface(&pose, instance, triangle, u, v);
            let to = light.ray(surface.position);
            let surface = surface.facing(-to.direction);
            if to.falloff <= 0.0
                || scene.alpha_is_hole(scene.instances[instance].mesh, triangle, u, v)
            {
                continue;
            }
            let n = surface.geometric_normal;
            let open = !tracer.occluded(&Ray {
                origin: offset_origin(surface.position, n, tracer.reach()),
                direction: to.direction,
                t_max: to.distance,
            });
            let share = maps.lit(l, surface.position, n);
            lit += usize::from(open);
            dark += usize::from(!open);
            acne += usize::from(open && share <= 0.0);
            leaks += usize::from(!open && share >= 1.0);
            wrong += usize::from(open != (share > 0.5));
        }
        println!(
            "light {l}: {lit} lit, {dark} dark; {acne} darkened, {leaks} leak, {wrong} are wrong"
        );
        assert!(lit > 500 && dark > 500);
        let all = (lit + dark) as f64;
        assert!(acne as f64 / all < 1e-3 && leaks as f64 / all < 1e-3);
        assert!(wrong as f64 / all < 1e-2);
    }
}

/// A plane alone never shades itself, however light grazes it; not by a texel's width.
#[test]
fn a_plane_does_not_shade_itself() {
    let (scene, _) = lamps();
    let mut scene = scene;
    // Only the floor.
    scene.instances.truncate(1);
    let mut pose = scene.pose(0.0);
    let mut random = Random::new(31);
    for turn in 0..24 {
        let height = 0.05 + 0.3 * turn as f32;
        let position = Vec3::new(random.vec().x, height, random.vec().z);
        let grazing = Vec3::new(random.vec().x + 0.1, -0.02 * (turn + 1) as f32, 0.4);
        let outer = LightKind::Spot {
            inner: 0.1,
            outer: 0.9,
        };
        pose.lights = vec![
            light(LightKind::Directional, Vec3::ZERO, grazing),
            light(LightKind::Point, position, Vec3::Y),
            light(outer, position, grazing),
        ];
        let tracer = Tracer::new(&scene, &pose);
        let maps = trace(plan(&scene, &pose, 64), &tracer);
        for _ in 0..2000 {
            let p = (random.vec() * 2.0 - 1.0) * Vec3::new(3.9, 0.0, 3.9);
            for (l, light) in pose.lights.iter().enumerate() {
                let to = light.ray(p);
                if to.falloff > 0.0 && to.direction.y > GRAZING {
                    let open = maps.lit(l, p, Vec3::Y);
                    assert!(open > 0.999, "light {l}, {turn}, {p}: {open}");
                }
            }
        }
    }
}

/// Maps that are kept are those that would be drawn.
#[test]
fn what_moves_is_drawn_again() {
    let Some(gpu) = gpu::for_test() else { return };
    let (scene, pose) = lamps();
    let raster = Raster::new(&gpu, &scene, &pose).unwrap();
    let mut kept = device::ShadowPass::new(&gpu).unwrap();
    let mut lamp_moves = pose.clone();
    lamp_moves.lights[2].position.x += 0.3;
    let mut box_moves = lamp_moves.clone();
    box_moves.world_from_mesh[1].translation.y += 0.2;
    let mut sheet_bends = bent(&scene, -0.4);
    sheet_bends.lights = pose.lights.clone();
    let mut last = Vec::new();
    for pose in [&pose, &lamp_moves, &box_moves, &sheet_bends, &pose] {
        let plan = plan(&scene, pose, 64);
        let draw = |pass: &mut device::ShadowPass| {
            let maps = pass.draw(&gpu, &raster, pose, &plan).unwrap();
            device::read(&gpu, maps).unwrap()
        };
        let maps = draw(&mut kept);
        assert!(maps == draw(&mut device::ShadowPass::new(&gpu).unwrap()));
        assert!(maps != last);
        last = maps;
    }
}
