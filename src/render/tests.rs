//! Both ways of drawing against a brute-force search over all triangles.

use super::gbuffer::{FirstHit, NONE, Visibility};
use super::view::View;
use super::*;
use crate::points::sample::tests::Random;
use crate::scene::{
    Alpha, CameraPose, Deformed, Instance, Material, Mesh, Node, Pose, Scene, Texture, TextureRef,
    Wrap, camera,
};
use glam::{Affine2, Affine3A, Quat, Vec2, Vec3};

const SIZE: (u32, u32) = (160, 90);

fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, material: u32) -> Mesh {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for t in &triangles {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        t.iter()
            .for_each(|i| normals[*i as usize] += (b - a).cross(c - a));
    }
    Mesh {
        normals: normals
            .into_iter()
            .map(|n| n.normalize_or(Vec3::Y))
            .collect(),
        uvs: vec![
            positions
                .iter()
                .map(|p| Vec2::new(p.x + p.z, p.y - p.z) * 0.5)
                .collect(),
        ],
        materials: vec![material; triangles.len()],
        positions,
        triangles,
        ..Mesh::default()
    }
}

fn quad(material: u32) -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let positions = vec![
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    mesh(positions, vec![[0, 1, 2], [0, 2, 3]], material)
}

/// Corner bits x, y, z; faces wound outwards. One face is left open, so that insides are seen.
fn open_box(material: u32) -> Mesh {
    let positions = (0..8)
        .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32) - 0.5)
        .collect();
    let faces = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let split = |f: [u32; 4]| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]];
    mesh(
        positions,
        faces.into_iter().flat_map(split).collect(),
        material,
    )
}

/// Floor, boxes (plain, mirrored, squeezed), a mask, a pane of glass and a deformed sheet.
pub(super) fn scene() -> Scene {
    let material = |alpha, double_sided, base_color_texture| Material {
        alpha,
        double_sided,
        base_color_texture,
        ..Material::default()
    };
    let checker = Texture {
        width: 4,
        height: 4,
        texels: (0..16)
            .map(|i| [200, 150, 90, if (i + i / 4) % 2 == 0 { 255 } else { 0 }])
            .collect(),
        wrap_s: Wrap::Mirror,
        wrap_t: Wrap::Repeat,
    };
    let place = |scale: Vec3, angle: f32, at: Vec3| {
        let rotation = Quat::from_axis_angle(Vec3::new(0.3, 1.0, 0.2).normalize(), angle);
        (scale, rotation, at)
    };
    let floor = (
        Vec3::splat(4.0),
        Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2),
        Vec3::ZERO,
    );
    let placed = [
        (0, floor),
        (1, place(Vec3::ONE, 0.4, Vec3::new(-1.2, 0.8, 0.0))),
        (
            1,
            place(Vec3::new(-1.0, 1.0, 1.0), 0.7, Vec3::new(1.0, 0.7, -0.6)),
        ),
        (
            1,
            place(Vec3::new(0.4, 1.5, 0.7), 2.4, Vec3::new(0.0, 0.9, -1.9)),
        ),
        (2, place(Vec3::splat(0.8), 0.2, Vec3::new(0.2, 0.9, 0.9))),
        (3, place(Vec3::splat(1.5), 0.1, Vec3::new(0.0, 1.0, 1.6))),
        (4, place(Vec3::splat(0.9), 0.5, Vec3::new(2.2, 1.0, 0.8))),
    ];
    // The mask is read by a second set of coordinates, turned, and fades by its vertices.
    let mut lattice = quad(2);
    let set = lattice.uvs[0].iter().map(|uv| *uv * 0.7).collect();
    lattice.uvs.push(set);
    lattice.colors = [1.0, 0.2, 0.3, 0.2].map(|a| Vec3::ONE.extend(a)).to_vec();
    let turned = TextureRef {
        texture: 0,
        set: 1,
        transform: Affine2::from_angle(0.4),
    };
    let mut scene = Scene {
        name: "test".into(),
        meshes: vec![quad(0), open_box(1), lattice, quad(3), quad(0)],
        materials: vec![
            material(Alpha::Opaque, true, None),
            material(Alpha::Opaque, false, None),
            material(Alpha::Mask { cutoff: 0.5 }, true, Some(turned)),
            material(Alpha::Blend, true, None),
        ],
        textures: vec![checker],
        ..Scene::default()
    };
    for (i, (mesh, (scale, rotation, translation))) in placed.into_iter().enumerate() {
        scene.nodes.push(Node {
            name: i.to_string(),
            parent: None,
            translation,
            rotation,
            scale,
            matrix: None,
            morph_weights: Vec::new(),
        });
        scene.instances.push(Instance {
            name: i.to_string(),
            mesh,
            node: Some(i),
            offset: Affine3A::IDENTITY,
            ..Instance::default()
        });
    }
    scene
}

/// The scene's pose with the last instance bent by `bend`.
pub(super) fn bent(scene: &Scene, bend: f32) -> Pose {
    let mut pose = scene.pose(0.0);
    let mesh = &scene.meshes[scene.instances[6].mesh];
    let bent = |p: &Vec3| *p + Vec3::Z * (p.x * p.y * bend);
    pose.deformed[6] = Some(Deformed {
        positions: mesh.positions.iter().map(bent).collect(),
        normals: mesh
            .normals
            .iter()
            .map(|n| (*n + Vec3::X * bend * 0.3).normalize())
            .collect(),
        tangents: Vec::new(),
    });
    pose
}

pub(super) fn eye() -> CameraPose {
    camera::look_at(Vec3::new(0.4, 1.9, 4.6), Vec3::new(0.2, 0.7, 0.0), 0.8)
}

/// Every triangle of the scene against every ray, in f64.
fn brute_force(scene: &Scene, pose: &Pose, view: &View) -> Vec<FirstHit> {
    let origin = view.camera.eye().as_dvec3();
    let see = |i: u32| {
        let d = view.direction(i % view.width, i / view.width).as_dvec3();
        let mut best = (
            f64::INFINITY,
            FirstHit {
                instance: NONE,
                triangle: NONE,
            },
        );
        for (k, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            let positions = pose.deformed[k]
                .as_ref()
                .map_or(&mesh.positions, |deformed| &deformed.positions);
            for (j, t) in mesh.triangles.iter().enumerate() {
                let m = pose.world_from_mesh[k];
                let [a, b, c] = t.map(|v| m.transform_point3(positions[v as usize]).as_dvec3());
                let (e1, e2) = (b - a, c - a);
                let det = e1.dot(d.cross(e2));
                let u = (origin - a).dot(d.cross(e2)) / det;
                let v = d.dot((origin - a).cross(e1)) / det;
                let t = e2.dot((origin - a).cross(e1)) / det;
                if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < best.0) {
                    continue;
                }
                let material = &scene.materials[mesh.materials[j] as usize];
                let back = (det < 0.0) != (m.matrix3.determinant() < 0.0);
                let hole = scene.alpha_is_hole(instance.mesh, j, u as f32, v as f32);
                if hole || back && !material.double_sided {
                    continue;
                }
                best = (
                    t,
                    FirstHit {
                        instance: k as u32,
                        triangle: j as u32,
                    },
                );
            }
        }
        best.1
    };
    (0..view.width * view.height).map(see).collect()
}

fn check(scene: &Scene, pose: &Pose, view: &View, visibility: &Visibility) {
    let expected = brute_force(scene, pose, view);
    let wrong = expected
        .iter()
        .zip(&visibility.seen)
        .filter(|(a, b)| a != b)
        .count();
    let share = wrong as f64 / expected.len() as f64;
    assert!(
        share < 0.005,
        "{:.2} % of pixels see something else",
        share * 100.0
    );
    for instance in [0, 1, 2, 3, 4, 6, NONE] {
        let seen = expected.iter().filter(|s| s.instance == instance).count();
        assert!(seen > 20, "instance {instance} covers {seen} pixels");
    }
    assert!(
        !expected.iter().any(|s| s.instance == 5),
        "glass is not drawn"
    );
}

#[test]
fn the_device_sees_what_brute_force_sees() {
    let Some(gpu) = gpu::for_test() else { return };
    let scene = scene();
    let pose = bent(&scene, 0.5);
    let mut raster = Raster::new(&gpu, &scene, &pose).unwrap();
    for bend in [0.5, -0.4] {
        let pose = bent(&scene, bend);
        let view = View::new(&eye(), SIZE.0, SIZE.1);
        let seen = raster.draw(&gpu, &pose, &view).unwrap();
        check(&scene, &pose, &view, &seen);
    }
    // Another size, with rows that need padding.
    let view = View::new(&eye(), 101, 57);
    let seen = raster.draw(&gpu, &pose, &view).unwrap();
    check(&scene, &pose, &view, &seen);
    let huge = View::new(&eye(), 1 << 20, 1);
    assert!(raster.draw(&gpu, &pose, &huge).is_err());
}

#[test]
fn primary_rays_see_what_brute_force_sees() {
    let scene = scene();
    let pose = bent(&scene, 0.5);
    let view = View::new(&eye(), SIZE.0, SIZE.1);
    let tracer = Tracer::new(&scene, &pose);
    check(
        &scene,
        &pose,
        &view,
        &Visibility::trace(&scene, &pose, &tracer, &view),
    );
}

#[test]
fn fragments_lie_on_their_ray_and_face_the_viewer() {
    let scene = scene();
    let pose = bent(&scene, 0.5);
    let view = View::new(&eye(), SIZE.0, SIZE.1);
    let tracer = Tracer::new(&scene, &pose);
    let seen = Visibility::trace(&scene, &pose, &tracer, &view);
    let gbuffer = GBuffer::resolve(&scene, &pose, Lookup::Posed(&pose), &view, &seen);
    for (i, f) in (0..).zip(&gbuffer.fragments) {
        if f.instance == NONE {
            continue;
        }
        let d = view.direction(i % view.width, i / view.width);
        let offset = f.position - view.camera.eye();
        assert!(offset.cross(d).length() < 1e-4 * offset.length(), "{f:?}");
        assert!((offset.dot(view.forward()) - f.depth).abs() < 1e-4);
        assert!(f.geometric_normal.dot(d) <= 0.0, "{f:?}");
        assert!(f.normal.dot(f.geometric_normal) > 0.0);
        let m = pose.world_from_mesh[f.instance as usize];
        assert!(m.transform_point3(f.lookup_position).distance(f.position) < 1e-4);
    }
    assert!((0.5..1.0).contains(&gbuffer.coverage()));
}

#[test]
fn light_is_looked_up_where_the_lookup_pose_had_the_surface() {
    let scene = scene();
    let (now, before) = (bent(&scene, 0.5), bent(&scene, -0.4));
    let view = View::new(&eye(), SIZE.0, SIZE.1);
    let tracer = Tracer::new(&scene, &now);
    let seen = Visibility::trace(&scene, &now, &tracer, &view);
    let resolve = |lookup| GBuffer::resolve(&scene, &now, lookup, &view, &seen).fragments;
    let (posed, other, rest) = (
        resolve(Lookup::Posed(&now)),
        resolve(Lookup::Posed(&before)),
        resolve(Lookup::Rest),
    );
    let mut deformed = 0;
    for ((now, before), rest) in posed.iter().zip(&other).zip(&rest) {
        assert_eq!(now.position, before.position);
        if now.instance == 6 {
            // The sheet is z = bend * x * y at its corners; triangles between them are flat, but the
            // bend scales every height alike.
            assert!((now.lookup_position.z * -0.4 - before.lookup_position.z * 0.5).abs() < 1e-4);
            assert_eq!(rest.lookup_position.z, 0.0);
            assert_eq!(rest.lookup_normal.abs(), Vec3::Z);
            assert!(now.lookup_normal.distance(before.lookup_normal) > 0.1);
            deformed += 1;
        } else {
            assert_eq!((now, before), (before, rest));
        }
    }
    assert!(deformed > 20);
}

#[test]
fn both_machines_make_the_same_picture() {
    if gpu::for_test().is_none() {
        return;
    }
    let scene = scene();
    let pose = scene.pose(0.0);
    let draw = |backend| {
        let mut renderer = Renderer::new(&scene, backend).unwrap();
        renderer.frame(&pose, Lookup::Rest, &eye(), 96, 54).unwrap()
    };
    let (a, b) = (draw(Backend::Gpu), draw(Backend::Cpu));
    let close = |a: &[u8; 3], b: &[u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) < 3);
    let (pa, pb) = (a.composite(None), b.composite(None));
    let same = pa
        .rgb
        .iter()
        .zip(&pb.rgb)
        .filter(|(a, b)| close(a, b))
        .count();
    assert!(same * 100 > pa.rgb.len() * 99, "{same} of {}", pa.rgb.len());
    let positions = a.gbuffer.fragments.iter().zip(&b.gbuffer.fragments);
    let alike = positions
        .filter(|(a, b)| a.instance == b.instance && a.position.distance(b.position) < 1e-3);
    assert!(alike.count() * 100 > pa.rgb.len() * 99);
}

#[test]
fn sizes_and_poses_that_do_not_fit_are_errors() {
    let scene = scene();
    let pose = scene.pose(0.0);
    let mut renderer = Renderer::new(&scene, Backend::Cpu).unwrap();
    for (width, height) in [(0, 9), (9, 0), (u32::MAX, 9), (9, MAX_SIDE + 1)] {
        let frame = renderer.frame(&pose, Lookup::Rest, &eye(), width, height);
        assert!(frame.is_err(), "{width}x{height}");
    }
    let other = Pose::default();
    assert!(renderer.frame(&other, Lookup::Rest, &eye(), 9, 9).is_err());
    assert!(
        renderer
            .frame(&pose, Lookup::Posed(&other), &eye(), 9, 9)
            .is_err()
    );
}

#[test]
fn ao_darkens_reflected_light_alone() {
    let mut random = Random::new(4);
    let shades: Vec<Shade> = (0..8)
        .map(|_| Shade {
            lit: random.vec() * 0.5,
            emitted: random.vec() * 0.4,
        })
        .collect();
    let closed = composite::composite(4, 2, &shades, Some(&[0.0; 8]));
    let emitted: Vec<_> = shades.iter().map(|s| s.emitted).collect();
    assert_eq!(closed, Picture::from_linear(4, 2, &emitted));
    let open = composite::composite(4, 2, &shades, Some(&[1.0; 8]));
    assert_eq!(open, composite::composite(4, 2, &shades, None));
}
