//! The tracer against a loop over all triangles, and against geometry that can be reckoned by hand.

use super::*;
use crate::rng::Rng;
use crate::scene::{Alpha, Deformed, Instance, Material, Mesh, Texture};
use glam::{Mat3, Quat, Vec2};

/// Random numbers of the shapes that the tests need.
struct Random(Rng);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        (self.0.draw() % n as u64) as usize
    }
    /// In -1..1.
    fn signed(&mut self) -> f32 {
        (self.0.draw() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
    fn unit(&mut self) -> f32 {
        self.0.unit()
    }
    fn vec(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
    fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vec();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
    fn rotation(&mut self) -> Quat {
        Quat::from_axis_angle(self.direction(), 3.0 * self.signed())
    }
}

fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    Mesh {
        materials: vec![0; triangles.len()],
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// A mesh without shared vertices.
fn soup(corners: Vec<[Vec3; 3]>) -> Mesh {
    let triangles = (0..corners.len() as u32)
        .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
        .collect();
    mesh(corners.into_iter().flatten().collect(), triangles)
}

fn quad(half: f32, cells: u32) -> Mesh {
    let n = cells + 1;
    let at = |i: u32| (i as f32 / cells as f32 * 2.0 - 1.0) * half;
    let positions = (0..n * n)
        .map(|i| Vec3::new(at(i % n), 0.0, at(i / n)))
        .collect();
    let triangles = (0..cells * cells)
        .flat_map(|i| {
            let a = i / cells * n + i % cells;
            [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]
        })
        .collect();
    mesh(positions, triangles)
}

fn cuboid(half: Vec3) -> Mesh {
    let positions = (0..8)
        .map(|i| {
            half * Vec3::new(
                [-1.0, 1.0][i & 1],
                [-1.0, 1.0][i >> 1 & 1],
                [-1.0, 1.0][i >> 2],
            )
        })
        .collect();
    let triangles = [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    mesh(positions, triangles.to_vec())
}

fn sphere(radius: f32, rings: u32) -> Mesh {
    let around = 2 * rings;
    let positions = (0..=rings)
        .flat_map(|r| (0..around).map(move |a| (r, a)))
        .map(|(r, a)| {
            let theta = std::f32::consts::PI * r as f32 / rings as f32;
            let phi = std::f32::consts::TAU * a as f32 / around as f32;
            let sin = if r % rings == 0 { 0.0 } else { theta.sin() };
            radius * Vec3::new(sin * phi.cos(), theta.cos(), -sin * phi.sin())
        })
        .collect();
    let triangles = (0..rings)
        .flat_map(|r| (0..around).map(move |a| (r, a)))
        .flat_map(|(r, a)| {
            let (i, j) = (r * around + a, r * around + (a + 1) % around);
            let (upper, lower) = ([i, i + around, j], [j, i + around, j + around]);
            // At the poles one of the two is no triangle.
            let keep = [(r + 1 < rings).then_some(lower), (r > 0).then_some(upper)];
            keep.into_iter().flatten()
        })
        .collect();
    mesh(positions, triangles)
}

fn scene(meshes: Vec<Mesh>, placed: &[(usize, Affine3A)]) -> (Scene, Pose) {
    let instances = placed
        .iter()
        .enumerate()
        .map(|(i, &(mesh, _))| Instance {
            name: format!("{i}"),
            mesh,
            ..Instance::default()
        })
        .collect();
    let scene = Scene {
        meshes,
        materials: vec![Material::default()],
        instances,
        ..Scene::default()
    };
    let pose = Pose {
        world_from_mesh: placed.iter().map(|p| p.1).collect(),
        deformed: vec![None; placed.len()],
        ..Pose::default()
    };
    (scene, pose)
}

impl Tracer<'_> {
    /// Every instance, every triangle: no boxes.
    fn brute_force(&self, ray: &Ray) -> Option<Hit> {
        let world = self.world_ray(ray)?;
        let mut best: Option<Hit> = None;
        for (i, placed) in self.instances.iter().enumerate() {
            let Some(placed) = placed else { continue };
            self.blases[placed.blas as usize].brute_force(&placed.ray(&world), ray.t_max, |hit| {
                let TriangleHit {
                    t,
                    triangle,
                    u,
                    v,
                    back,
                    ..
                } = hit;
                let found = Hit {
                    t,
                    instance: i as u32,
                    triangle,
                    u,
                    v,
                    back,
                };
                if (!hit.masked || self.is_opaque(i as u32, &hit, false))
                    && best.is_none_or(|b| found.precedes(&b))
                {
                    best = Some(found);
                }
            });
        }
        best
    }
}

/// Meshes that break tracers: slivers, needles, coincident and degenerate triangles, axis-aligned
/// planes, tiny and huge ones.
fn nasty_meshes(r: &mut Random) -> Vec<Mesh> {
    let mut any = Vec::new();
    let mut slivers = Vec::new();
    let mut double = Vec::new();
    for i in 0..60 {
        let a = r.vec();
        any.push([a, a + 0.4 * r.vec(), a + 0.4 * r.vec()]);
        let (along, across) = (r.direction(), r.direction());
        slivers.push([
            a,
            a + along,
            a + 0.5 * along + across * 10f32.powi(-(i % 8)),
        ]);
        let t = [a, a + 0.7 * r.vec(), a + 0.7 * r.vec()];
        double.extend([t, t, [t[1], t[2], t[0]]]);
    }
    double.extend([
        [Vec3::ONE; 3],
        [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X],
        [Vec3::ZERO, Vec3::ZERO, Vec3::Y],
    ]);
    let scaled = |m: &Mesh, s: f32| Mesh {
        positions: m.positions.iter().map(|p| *p * s).collect(),
        ..m.clone()
    };
    let any = soup(any);
    vec![
        scaled(&any, 1e-5),
        scaled(&any, 3e4),
        any,
        soup(slivers),
        soup(double),
        quad(1.0, 8),
        cuboid(Vec3::new(0.5, 0.25, 1.0)),
        sphere(0.75, 6),
    ]
}

/// A ray that likes trouble: zero components, along edges, through vertices, in planes.
fn nasty_ray(r: &mut Random, scene: &Scene, pose: &Pose, size: f32) -> Ray {
    let instance = r.below(scene.instances.len());
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let triangle = mesh.triangles[r.below(mesh.triangles.len())];
    let corner = |k: usize| {
        pose.world_from_mesh[instance].transform_point3(mesh.positions[triangle[k] as usize])
    };
    let mut origin = r.vec() * size;
    let mut direction = r.direction();
    match r.below(8) {
        0 => {
            let (u, v) = (r.unit(), r.unit());
            let on = corner(0).lerp(corner(1), u).lerp(corner(2), v);
            direction = (on - origin).normalize_or(Vec3::X);
        }
        1 => direction = (corner(r.below(3)) - origin).normalize_or(Vec3::X),
        2 => {
            origin = corner(0) + (corner(0) - corner(1)) * r.unit();
            direction = (corner(1) - corner(0)).normalize_or(Vec3::X);
        }
        3 => {
            direction = [
                Vec3::X,
                Vec3::Y,
                Vec3::Z,
                Vec3::NEG_X,
                Vec3::NEG_Y,
                Vec3::NEG_Z,
            ][r.below(6)];
            origin = corner(r.below(3)) - direction * r.unit() * size;
        }
        4 => {
            direction[r.below(3)] = [0.0, -0.0, 1e-30, -1e-39][r.below(4)];
            origin = corner(r.below(3)) - direction * r.unit() * size;
        }
        5 => origin = origin.round(),
        6 => {
            origin *= 100.0;
            direction = (corner(0) - origin).normalize_or(Vec3::X);
        }
        _ => {}
    }
    let t_max = [f32::INFINITY, size, size * r.unit() + 1e-6][r.below(3)];
    Ray {
        origin,
        direction,
        t_max,
    }
}

fn nasty_transform(r: &mut Random) -> Affine3A {
    let scale = match r.below(6) {
        0 => return Affine3A::IDENTITY,
        1 => Vec3::ONE,
        2 => Vec3::splat(0.3),
        3 => Vec3::new(1.0, -1.0, 1.0),
        4 => Vec3::new(3.0, 0.01, 0.5),
        _ => return Affine3A::from_translation(r.vec().round()),
    };
    Affine3A::from_scale_rotation_translation(scale, r.rotation(), r.vec() * 2.0)
}

/// Runs `check` on nasty rays; returns how many hit.
fn for_nasty_rays(rays: usize, mut check: impl FnMut(&mut Tracer, &Ray) -> bool) -> usize {
    let mut r = Random(Rng::new(7));
    let mut hits = 0;
    let rounds = 80;
    for round in 0..rounds {
        let meshes = nasty_meshes(&mut r);
        let (size, shift) = [(2.0, 0.0), (2.0, 150.0), (1e-5, 0.0), (6e4, 0.0)][round % 4];
        let placed: Vec<_> = match round % 4 {
            2 => vec![(0, Affine3A::IDENTITY)],
            3 => vec![
                (1, Affine3A::IDENTITY),
                (1, Affine3A::from_quat(r.rotation())),
            ],
            _ => (0..6)
                .map(|_| {
                    let mut to = nasty_transform(&mut r);
                    to.translation += glam::Vec3A::new(shift, 0.0, -shift);
                    (2 + r.below(meshes.len() - 2), to)
                })
                .collect(),
        };
        let (scene, pose) = scene(meshes, &placed);
        let mut tracer = Tracer::new(&scene, &pose);
        for _ in 0..rays / rounds {
            let mut ray = nasty_ray(&mut r, &scene, &pose, size);
            if r.below(2) == 0 {
                ray.origin += Vec3::new(shift, 0.0, -shift);
            }
            hits += usize::from(check(&mut tracer, &ray));
        }
    }
    hits
}

#[test]
fn no_hit_is_lost_and_none_is_invented() {
    let rays = 1_200_000;
    let hits = for_nasty_rays(rays, |tracer, ray| {
        let expected = tracer.brute_force(ray);
        assert_eq!(tracer.closest(ray), expected, "{ray:?}");
        assert_eq!(tracer.occluded(ray), expected.is_some(), "{ray:?}");
        expected.is_some()
    });
    // The rays must be worth something.
    assert!(hits > rays / 4 && hits < rays - rays / 20, "{hits}");
}

#[test]
fn portable_and_wide_vectors_agree_to_the_bit() {
    for_nasty_rays(100_000, |tracer, ray| {
        let wide = tracer.closest(ray);
        let occluded = tracer.occluded(ray);
        let ao =
            |t: &Tracer| t.ambient_occlusion(ray.origin, ray.direction, ray.direction, 4, 0.6, 5);
        let wide_ao = ao(tracer);
        let detected = tracer.avx2.take();
        let portable = tracer.closest(ray);
        assert_eq!(wide, portable);
        if let (Some(a), Some(b)) = (wide, portable) {
            assert_eq!(
                [a.t, a.u, a.v].map(f32::to_bits),
                [b.t, b.u, b.v].map(f32::to_bits)
            );
        }
        assert_eq!(tracer.occluded(ray), occluded);
        assert_eq!(ao(tracer), wide_ao);
        tracer.avx2 = detected;
        wide.is_some()
    });
}

/// An independent test in double precision: signed volumes.
fn exact(ray: &Ray, [a, b, c]: [Vec3; 3]) -> Option<(f64, f64)> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3() - o);
    let volumes = [d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a))];
    let total: f64 = volumes.iter().sum();
    let margin = volumes
        .map(|v| v / total)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let n = (b - a).cross(c - a);
    let t = a.dot(n) / d.dot(n);
    (t > 0.0 && t.is_finite()).then_some((t, margin))
}

#[test]
fn agrees_with_double_precision() {
    let mut r = Random(Rng::new(3));
    let corners: Vec<[Vec3; 3]> = (0..300)
        .map(|_| {
            let a = r.vec();
            [a, a + 0.5 * r.vec(), a + 0.5 * r.vec()]
        })
        .collect();
    let (scene, pose) = scene(vec![soup(corners.clone())], &[(0, Affine3A::IDENTITY)]);
    let tracer = Tracer::new(&scene, &pose);
    let mut hits = 0;
    for _ in 0..20_000 {
        let ray = Ray {
            origin: 2.0 * r.vec(),
            direction: r.direction(),
            t_max: f32::INFINITY,
        };
        let near: Vec<(f64, f64)> = corners.iter().filter_map(|c| exact(&ray, *c)).collect();
        // Within rounding of an edge either answer is right.
        if near.iter().any(|(_, margin)| margin.abs() < 1e-4) {
            continue;
        }
        let expected = near
            .iter()
            .filter(|(_, m)| *m > 0.0)
            .map(|(t, _)| *t)
            .fold(f64::INFINITY, f64::min);
        match tracer.closest(&ray) {
            Some(hit) => {
                hits += 1;
                assert!(
                    (f64::from(hit.t) - expected).abs() < 1e-3 * expected.max(0.1),
                    "{} {expected}",
                    hit.t
                );
            }
            None => assert!(expected.is_infinite()),
        }
    }
    assert!(hits > 1000);
}

#[test]
fn ties_go_to_the_lowest_instance_and_triangle() {
    let mut twice = quad(1.0, 4);
    twice.triangles.extend(twice.triangles.clone());
    twice.materials.extend(twice.materials.clone());
    let (scene, pose) = scene(vec![twice], &[(0, Affine3A::IDENTITY); 3]);
    let tracer = Tracer::new(&scene, &pose);
    let mut r = Random(Rng::new(1));
    for _ in 0..1000 {
        let origin = Vec3::new(0.99 * r.signed(), 1.0, 0.99 * r.signed());
        let hit = tracer
            .closest(&Ray {
                origin,
                direction: Vec3::NEG_Y,
                t_max: 2.0,
            })
            .unwrap();
        assert_eq!((hit.t, hit.instance), (1.0, 0));
        assert!(hit.triangle < 32);
    }
}

#[test]
fn ambient_occlusion_is_the_share_of_single_rays() {
    let mut r = Random(Rng::new(11));
    let meshes = nasty_meshes(&mut r);
    let placed: Vec<_> = (0..20)
        .map(|_| (2 + r.below(6), nasty_transform(&mut r)))
        .collect();
    let (scene, pose) = scene(meshes, &placed);
    let tracer = Tracer::new(&scene, &pose);
    let patterns = Patterns::new(64);
    let mut sum = 0.0;
    for seed in 0..3000 {
        let (position, normal, smooth) = (2.0 * r.vec(), r.direction(), r.direction());
        let smooth = (normal + 0.4 * smooth).normalize();
        let distance = 0.05 + r.unit();
        let ao = tracer.ambient_occlusion(position, normal, smooth, 64, distance, seed);
        let origin = offset::offset_origin(position, normal, tracer.reach());
        let (directions, turn) = patterns.pick(seed);
        let frame = sampler::Frame::new(smooth, turn);
        let open = directions
            .iter()
            .map(|d| frame.to_world(*d))
            .filter(|&direction| {
                direction.dot(normal) > 0.0
                    && !tracer.occluded(&Ray {
                        origin,
                        direction,
                        t_max: distance,
                    })
            })
            .count();
        assert_eq!(ao, open as f32 / 64.0);
        sum += ao / 3000.0;
    }
    assert!((0.1..0.9).contains(&sum), "{sum}");
}

/// Points on a mesh's faces, made as a server makes them: barycentrics in mesh space, then placed.
fn points_on(mesh: &Mesh, to: &Affine3A, r: &mut Random) -> Option<(Vec3, Vec3)> {
    let [a, b, c] =
        mesh.triangles[r.below(mesh.triangles.len())].map(|i| mesh.positions[i as usize]);
    let (mut u, mut v) = (r.unit(), r.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let p = a + (b - a) * u + (c - a) * v;
    let n = Mat3::from(to.matrix3).inverse().transpose() * (b - a).cross(c - a);
    Some((to.transform_point3(p), n.try_normalize()?))
}

#[test]
fn convex_surfaces_never_shade_themselves() {
    let mut r = Random(Rng::new(5));
    let meshes = [
        quad(50.0, 3),
        quad(0.3, 8),
        sphere(1.0, 12),
        sphere(80.0, 8),
        cuboid(Vec3::new(10.0, 0.1, 3.0)),
    ];
    for round in 0..60 {
        let i = round % meshes.len();
        let far = [0.0, 1.0, 100.0, 200.0][round / 5 % 4];
        let scale = Vec3::new(1.0, [1.0, 0.2][round % 2], 1.0);
        let to =
            Affine3A::from_scale_rotation_translation(scale, r.rotation(), r.direction() * far);
        let (scene, pose) = scene(meshes.to_vec(), &[(i, to)]);
        let tracer = Tracer::new(&scene, &pose);
        for seed in 0..300 {
            let Some((p, n)) = points_on(&meshes[i], &to, &mut r) else {
                continue;
            };
            let ao = tracer.ambient_occlusion(p, n, n, 64, 0.6, seed);
            assert_eq!(ao, 1.0, "mesh {i} at {p} normal {n}");
        }
    }
}

#[test]
fn a_millimetre_crevice_is_dark() {
    let mut r = Random(Rng::new(9));
    let floor = quad(2.0, 4);
    let half = Vec3::new(1.0, 0.1, 1.0);
    for far in [0.0, 10.0, 100.0, 200.0] {
        let base = Affine3A::from_rotation_translation(r.rotation(), r.direction() * far);
        let above = base * Affine3A::from_translation(Vec3::new(0.0, half.y + 0.001, 0.0));
        let (scene, pose) = scene(vec![floor.clone(), cuboid(half)], &[(0, base), (1, above)]);
        let tracer = Tracer::new(&scene, &pose);
        let up = base.transform_vector3(Vec3::Y);
        let ao = |x: f32, y: f32, n: Vec3| {
            tracer.ambient_occlusion(
                base.transform_point3(Vec3::new(x, y, 0.1)),
                n,
                n,
                128,
                0.6,
                1,
            )
        };
        assert!(ao(0.0, 0.0, up) < 0.01, "floor under the box, {far} m away");
        assert!(
            ao(0.0, 0.001, -up) < 0.01,
            "under side of the box, {far} m away"
        );
        // 2 cm outside, the box's side hides a bit less than half of the sky.
        let beside = ao(1.02, 0.0, up);
        assert!((0.45..0.65).contains(&beside), "{beside}");
        assert_eq!(ao(1.9, 0.0, up), 1.0);
    }
}

#[test]
fn occlusion_matches_a_closed_form() {
    // A point at height h under a disk-like plate of radius R much larger than the rays' reach d:
    // blocked are the directions with h / cos <= d, a share of 1 - (h / d)^2.
    let (scene, pose) = scene(vec![quad(5.0, 1)], &[(0, Affine3A::IDENTITY)]);
    let tracer = Tracer::new(&scene, &pose);
    for h in [0.1f32, 0.3, 0.5] {
        let mean = (0..200)
            .map(|s| {
                tracer.ambient_occlusion(Vec3::new(0.3, -h, 0.2), Vec3::Y, Vec3::Y, 128, 0.6, s)
            })
            .sum::<f32>()
            / 200.0;
        assert!((mean - (h / 0.6).powi(2)).abs() < 0.002, "{h}: {mean}");
    }
    // Normals that lean 60 degrees over: a quarter of the cosine-weighted sky is below the horizon.
    let lean = Vec3::new(0.0, 0.5, 0.75f32.sqrt());
    let mean = (0..200)
        .map(|s| tracer.ambient_occlusion(Vec3::new(0.3, 0.0, 0.2), Vec3::Y, lean, 128, 0.6, s))
        .sum::<f32>()
        / 200.0;
    assert!((mean - 0.75).abs() < 0.002, "{mean}");
}

#[test]
fn poses_are_followed() {
    let mut r = Random(Rng::new(21));
    let meshes = vec![sphere(0.5, 6), cuboid(Vec3::ONE), quad(3.0, 4)];
    let placed: Vec<_> = (0..12).map(|i| (i % 3, nasty_transform(&mut r))).collect();
    let (scene, first) = scene(meshes, &placed);
    let mut tracer = Tracer::new(&scene, &first);
    assert_eq!(tracer.update(&first), Work::default());
    let mut pose = first.clone();
    for frame in 0..12 {
        pose = pose.clone();
        pose.world_from_mesh[3] = nasty_transform(&mut r);
        // Swell from frame to frame, a wild shuffle at frame 6, back to rest at the end.
        let rest = &scene.meshes[0].positions;
        let positions: Vec<Vec3> = rest
            .iter()
            .map(|p| {
                if frame == 6 {
                    20.0 * r.vec()
                } else {
                    *p * (1.0 + 0.1 * frame as f32) + 0.02 * r.vec()
                }
            })
            .collect();
        pose.deformed[0] = (frame < 11).then(|| Deformed {
            positions,
            ..Deformed::default()
        });
        let work = tracer.update(&pose);
        assert_eq!(work.refitted, 1);
        assert!(work.moved <= 1);
        assert_eq!(work.rebuilt, usize::from(frame == 6), "frame {frame}");
        assert_eq!(tracer.update(&pose), Work::default());
        let fresh = Tracer::new(&scene, &pose);
        for _ in 0..3000 {
            let ray = nasty_ray(&mut r, &scene, &pose, 2.0);
            assert_eq!(tracer.closest(&ray), fresh.closest(&ray));
            assert_eq!(tracer.occluded(&ray), fresh.occluded(&ray));
        }
    }
}

#[test]
fn holes_let_rays_through_and_glass_stops_none() {
    let (mut scene, pose) = scene(
        vec![quad(1.0, 1), quad(1.0, 1)],
        &[
            (0, Affine3A::IDENTITY),
            (1, Affine3A::from_translation(Vec3::NEG_Y)),
        ],
    );
    let positions = &scene.meshes[0].positions;
    let uv = |p: &Vec3| Vec2::new(p.x + 1.0, p.z + 1.0) / 2.0;
    scene.meshes[0].uvs = vec![positions.iter().map(uv).collect()];
    // The left half of the upper sheet is a hole.
    scene.textures.push(Texture {
        width: 2,
        height: 1,
        texels: [[255, 255, 255, 10], [255; 4]].into(),
        ..Texture::default()
    });
    scene.materials[0] = Material {
        alpha: Alpha::Mask { cutoff: 0.5 },
        base_color_texture: Some(0.into()),
        ..Material::default()
    };
    scene.materials.push(Material::default());
    scene.meshes[1].materials = vec![1; 2];
    let down = |x: f32| Ray {
        origin: Vec3::new(x, 0.5, 0.1),
        direction: Vec3::NEG_Y,
        t_max: 1.0,
    };
    let far = |x: f32| Ray {
        t_max: 5.0,
        ..down(x)
    };
    {
        let tracer = Tracer::new(&scene, &pose);
        assert!(tracer.occluded(&down(0.5)) && !tracer.occluded(&down(-0.5)));
        assert_eq!(tracer.closest(&far(0.5)).unwrap().instance, 0);
        assert_eq!(tracer.closest(&far(-0.5)).unwrap().instance, 1);
        let ao = |x: f32| {
            tracer.ambient_occlusion(Vec3::new(x, -0.01, 0.0), Vec3::Y, Vec3::Y, 64, 0.3, 0)
        };
        assert_eq!((ao(0.5), ao(-0.5)), (0.0, 1.0));
    }
    scene.materials[1].alpha = Alpha::Blend;
    let tracer = Tracer::new(&scene, &pose);
    assert_eq!(tracer.closest(&far(-0.5)), None);
    assert!(tracer.bounds(1).is_empty());
}

#[test]
fn what_is_flattened_stops_rays() {
    let flat = Affine3A::from_scale_rotation_translation(
        Vec3::new(2.0, 0.0, 1.0),
        Quat::from_rotation_x(0.3),
        Vec3::Y * 0.25,
    );
    let (s, pose) = scene(vec![quad(1.0, 2)], &[(0, flat)]);
    let mut tracer = Tracer::new(&s, &pose);
    let down = Ray {
        origin: Vec3::new(1.2, 1.25, 0.0),
        direction: Vec3::NEG_Y,
        t_max: 9.0,
    };
    let hit = tracer.closest(&down).expect("a hit");
    assert!(
        (hit.t - 1.0).abs() < 1e-5 && tracer.occluded(&down),
        "{hit:?}"
    );
    // And again once it is not flat any more.
    let mut pose = pose.clone();
    pose.world_from_mesh[0] = Affine3A::IDENTITY;
    tracer.update(&pose);
    assert!(!tracer.occluded(&down));
}

#[test]
fn what_cannot_be_traced_is_not_hit() {
    let singular = Affine3A::from_scale(Vec3::new(1.0, 0.0, 0.0));
    let mut nan = Affine3A::IDENTITY;
    nan.translation.x = f32::NAN;
    let mut bad = quad(1.0, 2);
    bad.positions[4] = Vec3::NAN;
    bad.triangles.push([0, 1, 99]);
    let (s, pose) = scene(
        vec![quad(1.0, 2), Mesh::default(), bad],
        &[
            (0, singular),
            (0, nan),
            (1, Affine3A::IDENTITY),
            (2, Affine3A::IDENTITY),
        ],
    );
    let mut tracer = Tracer::new(&s, &pose);
    let down = Ray {
        origin: Vec3::new(0.2, 1.0, 0.3),
        direction: Vec3::NEG_Y,
        t_max: 9.0,
    };
    assert_eq!(
        (tracer.closest(&down), tracer.occluded(&down)),
        (None, false)
    );
    let mut pose = pose.clone();
    pose.world_from_mesh[1] = Affine3A::IDENTITY;
    tracer.update(&pose);
    assert!(tracer.occluded(&down));
    for ray in [
        Ray {
            origin: Vec3::NAN,
            ..down
        },
        Ray {
            direction: Vec3::ZERO,
            ..down
        },
        Ray {
            direction: Vec3::new(0.0, f32::NEG_INFINITY, 0.0),
            ..down
        },
        Ray {
            t_max: f32::NAN,
            ..down
        },
        Ray { t_max: 0.0, ..down },
        Ray {
            t_max: -1.0,
            ..down
        },
    ] {
        assert_eq!(
            (tracer.closest(&ray), tracer.occluded(&ray)),
            (None, false),
            "{ray:?}"
        );
    }
    assert!(tracer.occluded(&Ray {
        t_max: f32::INFINITY,
        ..down
    }));
    assert_eq!(
        tracer.ambient_occlusion(Vec3::NAN, Vec3::Y, Vec3::Y, 8, 1.0, 0),
        1.0
    );
    assert!(!tracer.within(99, Vec3::ZERO, 1.0));
    // A pose that is too short leaves the rest out.
    tracer.update(&Pose::default());
    assert!(!tracer.occluded(&down));
    let nothing = Scene::default();
    assert_eq!(Tracer::new(&nothing, &Pose::default()).closest(&down), None);
}

#[test]
fn within_never_misses() {
    let mut r = Random(Rng::new(31));
    let meshes = nasty_meshes(&mut r);
    let placed: Vec<_> = (0..8)
        .map(|i| (2 + i % 6, nasty_transform(&mut r)))
        .collect();
    let (scene, pose) = scene(meshes, &placed);
    let tracer = Tracer::new(&scene, &pose);
    let mut refused = 0;
    for round in 0..40_000 {
        let i = round % 8;
        let mesh = &scene.meshes[scene.instances[i].mesh];
        let [a, b, c] =
            mesh.triangles[r.below(mesh.triangles.len())].map(|k| mesh.positions[k as usize]);
        let on = pose.world_from_mesh[i].transform_point3(a.lerp(b, r.unit()).lerp(c, r.unit()));
        let distance = 0.3 * r.unit();
        let point = on + r.direction() * distance;
        assert!(tracer.within(i, point, distance * 1.00001 + 1e-6));
        assert!(tracer.bounds(i).distance_squared(on) == 0.0);
        refused += usize::from(!tracer.within(i, 3.0 * r.vec(), 0.1));
    }
    // It also says no: that is its use.
    assert!(refused > 20_000, "{refused}");
}

#[test]
fn threads_change_nothing() {
    let mut r = Random(Rng::new(41));
    let meshes = nasty_meshes(&mut r);
    let placed: Vec<_> = (0..20)
        .map(|_| (2 + r.below(6), nasty_transform(&mut r)))
        .collect();
    let (scene, pose) = scene(meshes, &placed);
    let points: Vec<(Vec3, Vec3)> = (0..2000).map(|_| (2.0 * r.vec(), r.direction())).collect();
    let with = |threads: usize| -> Vec<f32> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let tracer = Tracer::new(&scene, &pose);
            points
                .par_iter()
                .enumerate()
                .map(|(i, (p, n))| tracer.ambient_occlusion(*p, *n, *n, 32, 0.6, i as u32))
                .collect()
        })
    };
    let one = with(1);
    assert_eq!(one, with(4));
    assert_eq!(one, with(3));
}

/// Real scenes, with masks, skins and coincident triangles, against the loop over all triangles.
#[test]
fn real_scenes_lose_no_hit() {
    let folder = std::env::var_os("DAPPLE_SCENES").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"),
        Into::into,
    );
    for (name, time, rays) in [
        ("sponza_boulders", 3.0, 250),
        ("robot_lab", 2.0, 250),
        ("quake_e1m1", 0.0, 4000),
        ("morph_stress_test", 0.5, 10_000),
    ] {
        let file = folder.join(format!("{name}.glb"));
        if !file.exists() {
            println!("skipped: {} is absent", file.display());
            continue;
        }
        let scene = Scene::load(&file).unwrap();
        let mut tracer = Tracer::new(&scene, &scene.pose(0.0));
        let pose = scene.pose(time);
        tracer.update(&pose);
        let mut r = Random(Rng::new(51));
        let mut hits = 0;
        for _ in 0..rays {
            let instance = r.below(scene.instances.len());
            let mesh = &scene.meshes[scene.instances[instance].mesh];
            let positions = pose.deformed[instance]
                .as_ref()
                .map_or(&mesh.positions, |d| &d.positions);
            let triangle = mesh.triangles[r.below(mesh.triangles.len())];
            let corner = |k: usize| {
                pose.world_from_mesh[instance].transform_point3(positions[triangle[k] as usize])
            };
            // Half of them start at a vertex, the others run into one.
            let direction = r.direction();
            let origin = if r.below(2) == 0 {
                corner(0)
            } else {
                corner(1) - direction
            };
            let ray = Ray {
                origin,
                direction,
                t_max: [0.6, 5.0, f32::INFINITY][r.below(3)],
            };
            let expected = tracer.brute_force(&ray);
            assert_eq!(tracer.closest(&ray), expected, "{name} {ray:?}");
            assert_eq!(tracer.occluded(&ray), expected.is_some(), "{name} {ray:?}");
            hits += usize::from(expected.is_some());
        }
        assert!(hits > rays / 4, "{name}: {hits}");
    }
}
