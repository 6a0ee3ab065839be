//! Paths in rooms whose light can be reckoned by hand.

use super::*;
use crate::scene::{Instance, LightKind, LightPose, Material, Mesh, Node, Scene};
use glam::Quat;
use std::f32::consts::{PI, TAU};

/// A scene of one instance a mesh, at rest. `materials` are named by the meshes' triangles.
pub(crate) fn scene(meshes: Vec<Mesh>, materials: Vec<Material>) -> Scene {
    let instances = (0..meshes.len())
        .map(|mesh| Instance {
            mesh,
            node: Some(0),
            ..Instance::default()
        })
        .collect();
    Scene {
        meshes,
        materials,
        nodes: vec![Node {
            name: String::new(),
            parent: None,
            translation: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
            matrix: None,
            morph_weights: Vec::new(),
        }],
        instances,
        ..Scene::default()
    }
}

fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, material: u32) -> Mesh {
    let mut mesh = Mesh {
        normals: vec![Vec3::Y; positions.len()],
        materials: vec![material; triangles.len()],
        positions,
        triangles,
        ..Mesh::default()
    };
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        for v in t {
            mesh.normals[*v as usize] = normal;
        }
    }
    mesh
}

/// A parallelogram whose front looks along `x` cross `y`.
pub(crate) fn quad(centre: Vec3, x: Vec3, y: Vec3, material: u32) -> Mesh {
    let corners = [-x - y, x - y, x + y, y - x].map(|d| centre + d);
    mesh(corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]], material)
}

/// Six quads that face inwards, of half extent `half` about the origin.
pub(crate) fn room(half: f32, material: u32) -> Vec<Mesh> {
    [
        (Vec3::X, Vec3::Z, Vec3::Y),
        (-Vec3::X, Vec3::Y, Vec3::Z),
        (Vec3::Y, Vec3::X, Vec3::Z),
        (-Vec3::Y, Vec3::Z, Vec3::X),
        (Vec3::Z, Vec3::Y, Vec3::X),
        (-Vec3::Z, Vec3::X, Vec3::Y),
    ]
    .map(|(at, x, y)| {
        assert_eq!(x.cross(y), -at);
        quad(at * half, x * half, y * half, material)
    })
    .to_vec()
}

/// A ball of flat triangles with shading normals of the sphere; the front outside, or inside.
fn ball(radius: f32, rings: u32, inside: bool, material: impl Fn(Vec3) -> u32) -> Mesh {
    let around = 2 * rings;
    let at = |r: u32, a: u32| {
        let (theta, phi) = (PI * r as f32 / rings as f32, TAU * a as f32 / around as f32);
        let sin = if r.is_multiple_of(rings) {
            0.0
        } else {
            theta.sin()
        };
        Vec3::new(sin * phi.cos(), theta.cos(), -sin * phi.sin())
    };
    let mut ball = Mesh::default();
    for r in 0..rings {
        for a in 0..around {
            let [p, q, s, t] =
                [(r, a), (r + 1, a), (r, a + 1), (r + 1, a + 1)].map(|(r, a)| at(r, a));
            for (keep, corners) in [(r + 1 < rings, [s, q, t]), (r > 0, [p, q, s])] {
                if !keep {
                    continue;
                }
                let first = ball.positions.len() as u32;
                ball.positions.extend(corners.map(|c| c * radius));
                ball.normals
                    .extend(corners.map(|c| if inside { -c } else { c }));
                ball.triangles.push(if inside {
                    [first, first + 2, first + 1]
                } else {
                    [first, first + 1, first + 2]
                });
                ball.materials
                    .push(material((corners[0] + corners[1] + corners[2]) / 3.0));
            }
        }
    }
    ball
}

pub(super) fn material(albedo: f32, emissive: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        emissive: Vec3::splat(emissive),
        metallic: 0.0,
        ..Material::default()
    }
}

/// Mean and standard error of what `draw` gives for samples 0..n.
pub(super) fn mean(n: u32, draw: impl Fn(u32) -> f32) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let x = f64::from(draw(i));
        sum += x;
        squares += x * x;
    }
    let n = f64::from(n);
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / n).sqrt())
}

pub(super) fn everywhere(random: &mut Random) -> Vec3 {
    let [u, v] = random.pair();
    let (z, phi) = (2.0 * u - 1.0, TAU * v);
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

#[test]
fn a_white_lambert_ball_vanishes_in_a_white_sky() {
    let scene = scene(vec![ball(1.0, 12, false, |_| 0)], vec![material(1.0, 0.0)]);
    let pose = scene.rest_pose();
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::uniform(Vec3::ONE)).without_coats();
    let eye = Vec3::new(0.2, 0.4, 3.0);
    for i in 0..200 {
        let aim = Vec3::new(
            (i % 15) as f32 / 10.0 - 0.7,
            (i / 15) as f32 / 10.0 - 0.6,
            0.0,
        );
        let direction = (aim - eye).normalize();
        let arrived = path.radiance(eye, direction, Random::new(1, i, 0), &Paths::default());
        // Interpolated normals lean directions below the flat triangles: those are lost. A ray
        // that leaves meets the sky at once.
        let seen = arrived.radiance.x;
        assert!(seen == 0.0 || (seen - 1.0).abs() < 1e-5, "{i}: {seen}");
    }
}

#[test]
fn a_white_metal_plate_in_a_white_sky_shows_its_albedo() {
    for roughness in [0.1, 0.5, 1.0] {
        let metal = Material {
            metallic: 1.0,
            roughness,
            ..material(1.0, 0.0)
        };
        let plate = quad(Vec3::ZERO, Vec3::X, Vec3::Y, 0);
        let scene = scene(vec![plate], vec![metal]);
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, Sky::uniform(Vec3::ONE));
        let bsdf = Bsdf::new(Vec3::ONE, 1.0, roughness);
        for view in [Vec3::new(0.3, 0.1, 1.0), Vec3::new(0.9, 0.0, 0.3)].map(Vec3::normalize) {
            // The albedo by uniform directions, which knows nothing of the sampling.
            let (albedo, error) = mean(1 << 18, |i| {
                let light = everywhere(&mut Random::new(9, 0, i));
                4.0 * PI * bsdf.evaluate(Vec3::Z, view, light).x
            });
            let (seen, noise) = mean(1 << 12, |i| {
                let random = Random::new(1, 0, i);
                path.radiance(view * 2.0, -view, random, &Paths::default())
                    .radiance
                    .x
            });
            assert!(
                (seen - albedo).abs() < 5.0 * (error + noise),
                "{roughness} {view}: {seen} +- {noise}, {albedo} +- {error}"
            );
        }
    }
}

/// All walls shine: after each bounce the same again, times the albedo.
#[test]
fn a_room_of_shining_walls_is_a_geometric_series() {
    for albedo in [0.2, 0.5, 0.9] {
        let scene = scene(room(2.0, 0), vec![material(albedo, 1.5)]);
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, Sky::default()).without_coats();
        let n = 1 << 14;
        for bounces in [1, 2, 32] {
            let paths = Paths {
                max_bounces: bounces,
                ..Paths::default()
            };
            let (seen, noise) = mean(n, |i| {
                let mut random = Random::new(2, i, 0);
                let direction = everywhere(&mut random);
                path.radiance(Vec3::new(0.3, -0.2, 0.5), direction, random, &paths)
                    .radiance
                    .x
            });
            let a = f64::from(albedo);
            let exact = 1.5 * (1.0 - a.powi(bounces as i32 + 1)) / (1.0 - a);
            assert!(
                (seen - exact).abs() < 4.0 * noise && noise < 0.02 * exact,
                "albedo {albedo}, {bounces} bounces: {seen} +- {noise}, {exact}"
            );
        }
    }
}

/// Inside of a sphere every place sends the same light to every other (the integrating sphere): a
/// patch of radiance L over a share s of it gives L rho s / (1 - rho) everywhere.
#[test]
fn a_patch_in_an_integrating_sphere() {
    let (albedo, shining) = (0.6f32, 5.0f32);
    let patch = |p: Vec3| u32::from(p.y > 0.8);
    let shell = ball(3.0, 48, true, patch);
    let area = |only: bool| -> f64 {
        let of = |(t, m): (&[u32; 3], &u32)| {
            let [a, b, c] = t.map(|v| shell.positions[v as usize]);
            let area = f64::from(0.5 * (b - a).cross(c - a).length());
            if only && *m == 0 { 0.0 } else { area }
        };
        shell.triangles.iter().zip(&shell.materials).map(of).sum()
    };
    let share = area(true) / area(false);
    let scene = scene(
        vec![shell],
        vec![material(albedo, 0.0), material(albedo, shining)],
    );
    let pose = scene.rest_pose();
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::default()).without_coats();
    let exact = f64::from(shining * albedo / (1.0 - albedo)) * share;
    for (name, direction) in [("side", Vec3::X), ("bottom", Vec3::NEG_Y)] {
        let (seen, noise) = mean(1 << 14, |i| {
            // Spread over the wall: flat triangles do not lie quite on the sphere.
            let mut random = Random::new(3, i, 0);
            let towards = (direction + 0.4 * everywhere(&mut random)).normalize();
            path.radiance(Vec3::ZERO, towards, random, &Paths::default())
                .radiance
                .x
        });
        assert!(
            (seen - exact).abs() < 4.0 * noise + 0.004 * exact && noise < 0.02 * exact,
            "{name}: {seen} +- {noise}, {exact}"
        );
    }
}

/// A shining square over a floor that is rough or glossy: shadow rays alone, scattered rays alone
/// and both together see the same light.
#[test]
fn both_ways_to_an_emitter_agree() {
    for (metallic, roughness) in [(0.0, 1.0), (1.0, 0.3)] {
        let floor = Material {
            metallic,
            roughness,
            ..material(0.8, 0.0)
        };
        let lamp = quad(Vec3::new(0.0, 1.0, 0.0), Vec3::X * 0.4, Vec3::Z * 0.4, 1);
        let ground = quad(Vec3::ZERO, Vec3::Z * 9.0, Vec3::X * 9.0, 0);
        let scene = scene(vec![ground, lamp], vec![floor, material(0.0, 4.0)]);
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, Sky::default());
        let direction = Vec3::new(1.2, -1.0, 0.1).normalize();
        let origin = Vec3::new(0.1, 0.0, 0.1) - direction * 2.0;
        let vertex = path.first(origin, direction, true).0.expect("the floor");
        let n = 1 << 16;
        let both = mean(n, |i| {
            path.scattered(&vertex, &mut Random::new(4, 0, i), 1, true)
                .x
        });
        let by_shadow_rays = mean(n, |i| {
            let mut random = Random::new(5, 0, i);
            let source = path
                .emitters
                .sample(&scene, random.unit(), random.pair())
                .expect("the lamp");
            let way = source.position - vertex.position;
            let direction = way.normalize();
            let geometry = -direction.dot(source.normal) / way.length_squared();
            let f = vertex.bsdf.evaluate(vertex.normal, vertex.view, direction);
            (f * source.radiance * geometry.max(0.0) / source.density).x
        });
        let by_scattering = mean(n, |i| {
            let Some(next) = vertex.scatter(&mut Random::new(6, 0, i)) else {
                return 0.0;
            };
            match path.first(vertex.origin, next.direction, false).0 {
                Some(hit) => (next.weight * hit.emitted).x,
                None => 0.0,
            }
        });
        for (name, other) in [
            ("shadow rays", by_shadow_rays),
            ("scattering", by_scattering),
        ] {
            let bound = 4.0 * (both.1 + other.1);
            assert!(
                (both.0 - other.0).abs() < bound,
                "{roughness} {name}: {both:?} {other:?}"
            );
        }
        assert!(
            both.1 <= by_shadow_rays.1.max(by_scattering.1),
            "weights make noise"
        );
    }
}

/// The density that a hit emitter reports is that of drawing it: over all directions it adds up
/// to one.
#[test]
fn densities_of_emitters_integrate_to_one() {
    let a = quad(Vec3::new(0.0, 1.0, 0.0), Vec3::X * 0.4, Vec3::Z * 0.6, 0);
    let b = quad(Vec3::new(1.5, 0.5, 0.0), Vec3::Z * 0.3, Vec3::Y * 0.3, 1);
    let scene = scene(vec![a, b], vec![material(0.0, 4.0), material(0.0, 9.0)]);
    let pose = scene.rest_pose();
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::default());
    let (sum, noise) = mean(1 << 16, |i| {
        let direction = everywhere(&mut Random::new(1, 0, i));
        let Some(hit) = path.first(Vec3::ZERO, direction, false).0 else {
            return 0.0;
        };
        let cosine = hit.geometric_normal.dot(hit.view);
        assert!(hit.emitted != Vec3::ZERO, "both face the origin");
        4.0 * PI * hit.density * hit.distance * hit.distance / cosine
    });
    assert!(
        (sum - 1.0).abs() < 4.0 * noise && noise < 0.02,
        "{sum} +- {noise}"
    );
}

fn lamps() -> Vec<LightPose> {
    [
        (LightKind::Point, Vec3::new(0.5, 1.0, 0.2), 3.0),
        (LightKind::Point, Vec3::new(-0.9, 0.4, -0.6), 1.0),
        (LightKind::Directional, Vec3::ZERO, 0.7),
        (
            LightKind::Spot {
                inner: 0.3,
                outer: 0.7,
            },
            Vec3::new(0.0, 1.5, 0.0),
            8.0,
        ),
    ]
    .map(|(kind, position, power)| LightPose {
        position,
        direction: Vec3::new(0.1, -1.0, 0.2).normalize(),
        kind,
        intensity: Vec3::new(1.0, 0.8, 0.5) * power,
        range: f32::INFINITY,
    })
    .to_vec()
}

#[test]
fn one_light_at_a_time_adds_up_to_all() {
    let shade = quad(Vec3::new(0.3, 0.5, 0.1), Vec3::X * 0.1, Vec3::Z * 0.1, 0);
    let ground = quad(Vec3::ZERO, Vec3::Z * 9.0, Vec3::X * 9.0, 0);
    let scene = scene(vec![ground, shade], vec![material(0.8, 0.0)]);
    let mut pose = scene.rest_pose();
    pose.lights = lamps();
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::default());
    for x in [0.0, 0.05, 0.1, 0.4] {
        let eye = Vec3::new(x, 2.0, 1.0);
        let direction = (Vec3::new(x, 0.0, 0.0) - eye).normalize();
        let vertex = path.first(eye, direction, true).0.expect("the floor");
        let all = f64::from(path.direct(&vertex).x);
        let (sum, noise) = mean(1 << 14, |i| {
            path.one_light(&vertex, Random::new(1, 0, i).unit()).x
        });
        assert!(
            (sum - all).abs() <= 4.0 * noise + 1e-5 * all,
            "{x}: {sum} +- {noise}, {all}"
        );
    }
}

/// The error of a mean falls at least with the square root of the number of samples, to the end:
/// a bias would stop it.
#[test]
fn the_error_falls_with_the_square_root_of_the_samples() {
    let mut meshes = room(2.0, 0);
    meshes.push(quad(
        Vec3::new(0.0, 1.5, 0.0),
        Vec3::X * 0.5,
        Vec3::Z * 0.5,
        1,
    ));
    meshes.push(ball(0.6, 12, false, |_| 0));
    let scene = scene(meshes, vec![material(0.6, 0.0), material(0.2, 8.0)]);
    let pose = scene.rest_pose();
    let tracer = Tracer::new(&scene, &pose);
    // Without coats: rare bright paths would make the measured slope itself uncertain.
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::default()).without_coats();
    const STREAMS: u32 = 96;
    const MOST: u32 = 1 << 11;
    // Each stream is an estimate of its own of the same three rays' light.
    let rays = [
        Vec3::new(0.9, -0.5, 0.3),
        Vec3::new(-0.2, -0.7, -1.0),
        Vec3::new(-1.0, 0.2, 0.1),
    ];
    let origin = Vec3::new(0.9, 0.3, 1.1);
    let mut squared = [0.0f64; 12];
    for direction in rays.map(Vec3::normalize) {
        let runs: Vec<Vec<f64>> = (0..STREAMS)
            .map(|stream| {
                let mut sum = 0.0;
                let mut means = Vec::new();
                for i in 0..MOST {
                    let random = Random::new(7, stream, i);
                    let x = f64::from(
                        path.radiance(origin, direction, random, &Paths::default())
                            .radiance
                            .x,
                    );
                    sum += x;
                    if (i + 1).is_power_of_two() {
                        means.push(sum / f64::from(i + 1));
                    }
                }
                means
            })
            .collect();
        let truth = runs.iter().map(|r| r[r.len() - 1]).sum::<f64>() / f64::from(STREAMS);
        for run in &runs {
            for (level, mean) in run.iter().enumerate() {
                squared[level] += (mean - truth).powi(2);
            }
        }
    }
    // Slope of log rms over log n from 4 samples on, by least squares.
    let points: Vec<(f64, f64)> = squared
        .iter()
        .enumerate()
        .skip(2)
        .map(|(level, s)| (level as f64, 0.5 * s.log2()))
        .collect();
    let n = points.len() as f64;
    let (mx, my) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let slope = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
        / points.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>();
    println!("slope {slope}");
    // Independent numbers would give -0.5; spread evenly they do a little better.
    assert!(
        (-0.75..=-0.47).contains(&slope),
        "slope {slope}: {points:?}"
    );
}

#[test]
fn a_sealed_room_is_dark() {
    let scene = scene(room(2.0, 0), vec![material(0.8, 0.0)]);
    let mut pose = scene.rest_pose();
    pose.lights = lamps();
    for light in &mut pose.lights {
        light.position *= 10.0;
    }
    let tracer = Tracer::new(&scene, &pose);
    let path = PathTracer::new(&scene, &pose, &tracer, Sky::uniform(Vec3::ONE));
    for i in 0..20_000 {
        let mut random = Random::new(1, i, 0);
        let direction = everywhere(&mut random);
        let origin = everywhere(&mut random) * 1.9;
        let arrived = path.radiance(origin, direction, random, &Paths::default());
        assert_eq!(arrived.radiance, Vec3::ZERO, "{origin} {direction}");
        assert!(!arrived.back_face && arrived.distance.is_finite());
    }
}

#[test]
fn backs_are_passed_and_told() {
    let near = quad(Vec3::new(0.0, 0.0, 1.0), Vec3::Y, Vec3::X, 0);
    let far = quad(Vec3::new(0.0, 0.0, 3.0), Vec3::Y, Vec3::X, 1);
    let (forth, back) = (Vec3::NEG_Z, Vec3::Z);
    let light = Sky::uniform(Vec3::splat(0.25));
    let look = |double_sided: bool, cull: bool, origin: Vec3, direction: Vec3| {
        let first = Material {
            double_sided,
            ..material(0.0, 2.0)
        };
        let scene = scene(
            vec![near.clone(), far.clone()],
            vec![first, material(0.0, 3.0)],
        );
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        let path = PathTracer::new(&scene, &pose, &tracer, light).without_coats();
        let paths = Paths {
            max_bounces: 0,
            cull_back_faces: cull,
        };
        let arrived = path.radiance(origin, direction, Random::new(0, 0, 0), &paths);
        (arrived.radiance.x, arrived.distance, arrived.back_face)
    };
    let (front, behind) = (Vec3::ZERO, Vec3::new(0.0, 0.0, 4.0));
    // Both quads face -Z: from the origin one sees the first one's front.
    assert_eq!(look(false, true, front, back), (2.0, 1.0, false));
    // From behind both are passed, and the sky is seen.
    assert_eq!(
        look(false, true, behind, forth),
        (0.25, f32::INFINITY, true)
    );
    assert_eq!(look(false, false, behind, forth), (0.0, 1.0, true));
    // A double-sided one stops the ray and shines to both sides.
    assert_eq!(look(true, true, behind, forth), (2.0, 3.0, true));
    assert_eq!(
        look(true, true, Vec3::new(0.0, 0.0, 2.0), forth),
        (2.0, 1.0, false)
    );
    // A back behind the hit does not count.
    assert_eq!(look(true, true, front, back), (2.0, 1.0, false));
}

/// A hit's side is what the surface's normal says, also where the instance is mirrored.
#[test]
fn the_side_of_a_hit_is_that_of_the_normal() {
    for scale in [Vec3::ONE, Vec3::new(-1.0, 2.0, 0.5)] {
        let mut scene = scene(vec![ball(1.0, 8, false, |_| 0)], vec![material(0.5, 0.0)]);
        scene.nodes[0].scale = scale;
        let pose = scene.rest_pose();
        let tracer = Tracer::new(&scene, &pose);
        for i in 0..500 {
            let mut random = Random::new(1, i, 0);
            let origin = everywhere(&mut random) * 3.0 * random.unit();
            let direction = everywhere(&mut random);
            let ray = Ray {
                origin,
                direction,
                t_max: f32::INFINITY,
            };
            let Some(hit) = tracer.closest(&ray) else {
                continue;
            };
            let at = (hit.instance as usize, hit.triangle as usize);
            let surface = scene.surface(&pose, at.0, at.1, hit.u, hit.v);
            assert_eq!(hit.back, surface.geometric_normal.dot(direction) > 0.0);
            let (front, nearest_back) = tracer.closest_front(&ray);
            if hit.back {
                assert_eq!(nearest_back, hit.t);
                assert!(front.is_none_or(|f| f.t > hit.t && !f.back));
            } else {
                assert_eq!(front, Some(hit));
            }
        }
    }
}
