//! Paths through windows, off unlit surfaces, from textured emitters and from lamps in a plane.

use super::tests::{everywhere, material, mean, quad, room, scene};
use super::*;
use crate::scene::{LightKind, LightPose, Material, Mesh, Scene, Texture};
use glam::Vec2;
use std::f32::consts::PI;

fn lamp(position: Vec3) -> LightPose {
    LightPose {
        position,
        direction: Vec3::NEG_Y,
        kind: LightKind::Point,
        intensity: Vec3::ONE,
        range: f32::INFINITY,
    }
}

/// A quad of 2 m in the plane `y`, its front down, textured from 0 to 1.
fn ceiling(y: f32, material: u32) -> Mesh {
    let mut mesh = quad(Vec3::Y * y, Vec3::X, Vec3::Z, material);
    mesh.uvs = vec![vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]];
    mesh
}

fn window(transmission: f32, tint: Vec3) -> Material {
    Material {
        base_color: tint.extend(1.0),
        transmission,
        window: transmission >= 0.5,
        ..material(1.0, 0.0)
    }
}

#[test]
fn windows_tint_the_light_that_they_let_through() {
    let tint = Vec3::new(0.9, 0.5, 0.2);
    let sky = Sky::uniform(Vec3::ONE);
    for transmission in [1.0, 0.7, 0.3] {
        let floor = quad(Vec3::ZERO, Vec3::Z, Vec3::X, 0);
        let pane = quad(Vec3::Y, Vec3::Z * 50.0, Vec3::X * 50.0, 1);
        let open = scene(vec![floor.clone()], vec![material(0.5, 0.0)]);
        let shut = scene(
            vec![floor, pane],
            vec![material(0.5, 0.0), window(transmission, tint)],
        );
        let down = |scene: &Scene, sun: bool| {
            let mut pose = scene.rest_pose();
            if sun {
                pose.lights = vec![lamp(Vec3::new(0.1, 4.0, 0.2))];
            }
            let tracer = Tracer::new(scene, &pose);
            let sky = if sun { Sky::default() } else { sky };
            let path = PathTracer::new(scene, &pose, &tracer, sky).without_coats();
            let vertex = path.first(Vec3::Y * 0.5, Vec3::NEG_Y, true).0;
            let vertex = vertex.expect("the floor");
            let direct = path.direct(&vertex);
            let through = mean(1 << 12, |i| {
                path.radiance(
                    Vec3::Y * 0.5,
                    Vec3::Y,
                    Random::new(3, 0, i),
                    &Paths {
                        max_bounces: 0,
                        cull_back_faces: false,
                    },
                )
                .radiance
                .y
            });
            (direct, through)
        };
        let expected = down(&open, true).0 * tint * transmission;
        let direct = down(&shut, true).0;
        assert!(
            direct.abs_diff_eq(expected, 1e-5),
            "{transmission}: {direct} {expected}"
        );
        let (passed, noise) = down(&shut, false).1;
        let expected = f64::from(transmission * tint.y);
        assert!(
            (passed - expected).abs() <= 4.0 * noise + 1e-6,
            "{transmission}: {passed} +- {noise}, {expected}"
        );
    }
}

/// Light of an emitter through a window by shadow rays and by scattering adds up to that without the
/// window, times its colour.
#[test]
fn emitters_are_seen_through_windows() {
    let pane = quad(Vec3::Y * 0.5, Vec3::Z * 50.0, Vec3::X * 50.0, 2);
    let floor = quad(Vec3::ZERO, Vec3::Z * 9.0, Vec3::X * 9.0, 0);
    let materials = vec![
        material(0.5, 0.0),
        material(0.0, 4.0),
        window(0.6, Vec3::new(0.5, 0.5, 0.5)),
    ];
    let light = |panes: Vec<Mesh>| {
        let mut meshes = vec![floor.clone(), ceiling(1.0, 1)];
        meshes.extend(panes);
        let scene = scene(meshes, materials.clone());
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, Sky::default()).without_coats();
        let vertex = path.first(Vec3::Y * 0.3, Vec3::NEG_Y, true).0;
        let vertex = vertex.expect("the floor");
        mean(1 << 14, |i| {
            path.scattered(&vertex, &mut Random::new(4, 0, i), 1, true)
                .x
        })
    };
    let (open, noise) = light(Vec::new());
    let (shut, more) = light(vec![pane]);
    assert!(
        (shut - 0.3 * open).abs() < 4.0 * (noise + more),
        "{shut} +- {more}, {open}"
    );
}

#[test]
fn cameras_and_occlusion_pass_windows() {
    let pane = quad(Vec3::Y, Vec3::Z, Vec3::X, 0);
    for (transmission, passes) in [(1.0, true), (0.3, false)] {
        let scene = scene(vec![pane.clone()], vec![window(transmission, Vec3::ONE)]);
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let ray = Ray {
            origin: Vec3::new(0.1, 2.0, 0.2),
            direction: Vec3::NEG_Y,
            t_max: f32::INFINITY,
        };
        assert_eq!(tracer.occluded(&ray), !passes);
        assert_eq!(tracer.closest(&ray).is_none(), passes);
        assert!(tracer.closest_or_window(&ray).is_some());
    }
}

#[test]
fn unlit_surfaces_are_shown_and_light_nothing() {
    let poster = Material {
        unlit: true,
        ..material(0.6, 0.0)
    };
    let scene = scene(room(1.0, 0), vec![poster]);
    let mut pose = scene.rest_pose();
    pose.lights = vec![lamp(Vec3::ZERO)];
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::uniform(Vec3::ONE));
    let vertex = path
        .first(Vec3::splat(0.1), Vec3::X, true)
        .0
        .expect("a wall");
    assert_eq!(vertex.unlit, Vec3::splat(0.6));
    assert_eq!(path.direct(&vertex) + vertex.emitted, Vec3::ZERO);
    for i in 0..100 {
        let mut random = Random::new(7, 0, i);
        let direction = everywhere(&mut random);
        let arrived = path.radiance(Vec3::ZERO, direction, random, &Paths::default());
        assert_eq!(arrived.radiance, Vec3::ZERO);
    }
}

/// A ceiling of which a texture lets only a tenth shine.
fn strip() -> (Scene, Vec3) {
    let floor = quad(Vec3::Y * -1.0, Vec3::Z * 9.0, Vec3::X * 9.0, 0);
    let shining = Material {
        emissive_texture: Some(0.into()),
        ..material(0.0, 4.0)
    };
    let mut scene = scene(
        vec![floor, ceiling(0.0, 1)],
        vec![material(0.8, 0.0), shining],
    );
    let mut texels = vec![[0, 0, 0, 255]; 20];
    texels[..2].fill([255; 4]);
    scene.textures.push(Texture {
        width: 20,
        height: 1,
        texels: texels.into(),
        ..Texture::default()
    });
    (scene, Vec3::new(-0.6, -1.0, 0.1))
}

/// Shadow rays alone, scattered rays alone and both together see the same light, and shadow rays go
/// to what shines.
#[test]
fn emissive_textures_shine_by_texel() {
    let (scene, place) = strip();
    let pose = scene.rest_pose();
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::default());
    let up = |x: f32| {
        let origin = Vec3::new(x, -0.5, 0.1);
        path.first(origin, Vec3::Y, true)
            .0
            .expect("the ceiling")
            .emitted
            .x
    };
    assert_eq!(up(0.0), 0.0);
    assert!(up(-0.9) > 3.9, "{}", up(-0.9));
    let direction = Vec3::new(0.3, -1.0, 0.1).normalize();
    let vertex = path.first(place - direction * 0.5, direction, true).0;
    let vertex = vertex.expect("the floor");
    let n = 1 << 14;
    let both = mean(n, |i| {
        path.scattered(&vertex, &mut Random::new(4, 0, i), 1, true)
            .x
    });
    let mut dark = 0;
    let by_shadow_rays = mean(n, |i| {
        let mut random = Random::new(5, 0, i);
        let source = path.emitters.sample(&scene, random.unit(), random.pair());
        let source = source.expect("a place");
        let way = source.position - vertex.position;
        let direction = way.normalize();
        let geometry = -direction.dot(source.normal) / way.length_squared();
        let f = vertex.bsdf.evaluate(vertex.normal, vertex.view, direction);
        (f * source.radiance * geometry.max(0.0) / source.density).x
    });
    for i in 0..1000 {
        let mut random = Random::new(8, 0, i);
        let source = path.emitters.sample(&scene, random.unit(), random.pair());
        dark += u32::from(source.expect("a place").radiance == Vec3::ZERO);
    }
    let by_scattering = mean(n, |i| {
        let Some(next) = vertex.scatter(&mut Random::new(6, 0, i)) else {
            return 0.0;
        };
        match path.first(vertex.origin, next.direction, false).0 {
            Some(hit) => (next.weight * hit.emitted).x,
            None => 0.0,
        }
    });
    for other in [by_shadow_rays, by_scattering] {
        let bound = 4.0 * (both.1 + other.1);
        assert!((both.0 - other.0).abs() < bound, "{both:?} {other:?}");
    }
    assert!(both.0 > 0.0 && dark < 300, "{dark} of 1000 places are dark");
    let (sum, noise) = mean(1 << 14, |i| {
        let direction = everywhere(&mut Random::new(1, 0, i));
        let Some(hit) = path.first(Vec3::Y * -0.5, direction, false).0 else {
            return 0.0;
        };
        let cosine = hit.geometric_normal.dot(hit.view);
        4.0 * PI * hit.density * hit.distance * hit.distance / cosine
    });
    assert!((sum - 1.0).abs() < 4.0 * noise, "{sum} +- {noise}");
}

#[test]
fn lamps_in_the_plane_of_a_ceiling_are_not_hidden_by_it() {
    let scene = scene(room(2.7, 0), vec![material(0.7, 0.0)]);
    for height in [2.7, 2.699_999_8, 2.700_000_3] {
        let mut pose = scene.rest_pose();
        pose.lights = vec![lamp(Vec3::new(0.3, height, -0.2))];
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, Sky::default()).without_coats();
        for i in 0..500 {
            let mut direction = everywhere(&mut Random::new(2, 0, i));
            direction.y = -direction.y.abs() - 0.05;
            let vertex = path.first(Vec3::ZERO, direction.normalize(), true).0;
            let vertex = vertex.expect("a wall");
            let to = lamp(Vec3::new(0.3, height, -0.2)).ray(vertex.position);
            let cosine = to.direction.dot(vertex.normal).max(0.0);
            let expected = 0.7 / PI * to.falloff * cosine;
            let direct = path.direct(&vertex).x;
            assert!(
                (direct - expected).abs() < 1e-5,
                "{}: {direct} {expected}",
                vertex.position
            );
        }
    }
}

#[test]
fn emitters_in_the_plane_of_a_ceiling_are_not_hidden_by_it() {
    for first in [true, false] {
        let mut meshes = room(2.7, 0);
        let lamp = quad(Vec3::new(0.1, 2.7, -0.3), Vec3::X * 0.7, Vec3::Z * 0.7, 1);
        meshes.insert(if first { 0 } else { 6 }, lamp);
        let scene = scene(meshes, vec![material(0.0, 0.0), material(0.0, 5.0)]);
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, Sky::default());
        assert_eq!(path.hidden_emitters, !first);
        let paths = Paths {
            max_bounces: 0,
            ..Paths::default()
        };
        for i in 0..500 {
            let mut random = Random::new(2, 0, i);
            let [x, z] = random.pair();
            let lamp = Vec3::new(-0.55 + 1.3 * x, 2.7, -0.95 + 1.3 * z);
            let direction = lamp.normalize();
            let arrived = path.radiance(Vec3::ZERO, direction, random, &paths);
            assert_eq!(arrived.radiance.x, 5.0, "{lamp}");
        }
    }
}
