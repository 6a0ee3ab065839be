//! The built-in scene: a hall, open to the sky, with columns, a dais behind thin railings, rolling
//! boulders, a walker, plants and gratings with holes, and a floor with a normal map.
//!
//! Everything is made by code, the same on every call: 20 x 6 x 12 m, Y up, the floor at 0, the
//! long side along X. It loops after [`DURATION`] seconds.

mod rolling;
mod shapes;
mod textures;
mod walker;

use super::camera::look_at;
use super::{
    Alpha, Camera, Channel, ChannelValues, Instance, Interpolation, Light, LightKind, Material,
    Mesh, Node, Scene, normals,
};
use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};
use rolling::Lane;
use shapes::{Shape, random};
use std::f32::consts::TAU;

/// Length of the loop in seconds, and keys a second.
const DURATION: f32 = 8.0;
const KEYS_A_SECOND: f32 = 60.0;

/// Half length, half width and height of the hall, metres.
const HALF_X: f32 = 10.0;
const HALF_Z: f32 = 6.0;
const HEIGHT: f32 = 6.0;
/// The columns stand on the lines z = -3 and z = 3.
const COLUMN_Z: f32 = 3.0;
const COLUMN_X: [f32; 6] = [-7.5, -4.5, -1.5, 1.5, 4.5, 7.5];
/// The dais fills the end of the hall up to this x.
const DAIS_X: f32 = -7.0;
const DAIS_HEIGHT: f32 = 0.9;
const STEPS: usize = 5;
const STAIR_HALF_WIDTH: f32 = 1.5;

/// Materials, in the order of [`materials`].
const FLOOR: u32 = 0;
const PLASTER: u32 = 1;
const STONE: u32 = 2;
const WOOD: u32 = 3;
const IRON: u32 = 4;
const BOULDER_GREY: u32 = 5;
const BOULDER_RED: u32 = 6;
const BRONZE: u32 = 7;
const CLOTH_RED: u32 = 8;
const CLOTH_BLUE: u32 = 9;
const CLOTH_OCHRE: u32 = 10;
const GRATING: u32 = 11;
const FROND: u32 = 12;
const POT: u32 = 13;
const TROUSERS: u32 = 14;
const SHIRT: u32 = 15;
const SKIN: u32 = 16;
const SHOES: u32 = 17;

impl Scene {
    /// The built-in scene, `hall`: 60 Hz over a loop of 8 s, cameras `main` (moving) and `corner`.
    pub fn hall() -> Scene {
        let mut scene = Scene {
            name: "hall".to_owned(),
            textures: vec![
                textures::floor_color(),
                textures::floor_normals(),
                textures::grating(),
                textures::frond(),
            ],
            materials: materials(),
            duration: DURATION,
            ..Scene::default()
        };
        let keys = (DURATION * KEYS_A_SECOND) as usize;
        let times: Vec<f32> = (0..=keys).map(|i| i as f32 / KEYS_A_SECOND).collect();
        building(&mut scene);
        furniture(&mut scene);
        boulders(&mut scene, &times);
        walker::add(&mut scene, [TROUSERS, SHIRT, SKIN, SHOES], &times);
        cameras_and_sun(&mut scene, &times);
        scene
    }
}

fn materials() -> Vec<Material> {
    let plain = |name: &str, r: f32, g: f32, b: f32, roughness: f32| Material {
        name: name.to_owned(),
        base_color: Vec4::new(r, g, b, 1.0),
        roughness,
        metallic: 0.0,
        ..Material::default()
    };
    let cloth = |name, r, g, b| Material {
        double_sided: true,
        ..plain(name, r, g, b, 0.95)
    };
    let masked = |name, texture| Material {
        base_color_texture: Some(texture),
        alpha: Alpha::Mask { cutoff: 0.5 },
        double_sided: true,
        ..plain(name, 1.0, 1.0, 1.0, 0.8)
    };
    vec![
        Material {
            base_color_texture: Some(0),
            normal_texture: Some(1),
            ..plain("floor", 1.0, 1.0, 1.0, 0.6)
        },
        plain("plaster", 0.74, 0.66, 0.54, 0.95),
        plain("stone", 0.70, 0.67, 0.60, 0.85),
        plain("wood", 0.30, 0.17, 0.09, 0.7),
        plain("iron", 0.09, 0.09, 0.10, 0.5),
        plain("grey boulder", 0.42, 0.41, 0.39, 0.9),
        plain("red boulder", 0.46, 0.25, 0.17, 0.9),
        plain("bronze", 0.55, 0.36, 0.16, 0.4),
        cloth("red cloth", 0.50, 0.06, 0.05),
        cloth("blue cloth", 0.07, 0.14, 0.40),
        cloth("ochre cloth", 0.62, 0.40, 0.09),
        masked("grating", 2),
        masked("frond", 3),
        plain("pot", 0.55, 0.27, 0.16, 0.8),
        plain("trousers", 0.10, 0.13, 0.22, 0.9),
        plain("shirt", 0.75, 0.33, 0.08, 0.9),
        plain("skin", 0.62, 0.40, 0.28, 0.7),
        plain("shoes", 0.06, 0.05, 0.05, 0.6),
    ]
}

/// A node that only stands somewhere.
fn place(scene: &mut Scene, name: &str, position: Vec3, turn: f32, scale: f32) -> usize {
    scene.nodes.push(Node {
        name: name.to_owned(),
        parent: None,
        translation: position,
        rotation: Quat::from_rotation_y(turn),
        scale: Vec3::splat(scale),
        matrix: None,
        morph_weights: Vec::new(),
    });
    scene.nodes.len() - 1
}

fn add_mesh(scene: &mut Scene, mesh: Mesh) -> usize {
    scene.meshes.push(mesh);
    scene.meshes.len() - 1
}

fn add_instance(scene: &mut Scene, mesh: usize, node: usize) {
    scene.instances.push(Instance {
        name: scene.nodes[node].name.clone(),
        mesh,
        node: Some(node),
        ..Instance::default()
    });
}

/// One mesh that stands where it was modelled.
fn add_fixed(scene: &mut Scene, shape: Shape, name: &str) {
    let mesh = add_mesh(scene, shape.finish(name));
    let node = place(scene, name, Vec3::ZERO, 0.0, 1.0);
    add_instance(scene, mesh, node);
}

fn building(scene: &mut Scene) {
    let mut floor = Shape::default();
    floor.quad(
        Vec3::new(-HALF_X, 0.0, HALF_Z),
        Vec3::X * HALF_X * 2.0,
        Vec3::NEG_Z * HALF_Z * 2.0,
        FLOOR,
    );
    // The texture covers two metres.
    floor.mesh.uvs.iter_mut().for_each(|uv| *uv *= 0.5);
    normals::generate_tangents(&mut floor.mesh);
    add_fixed(scene, floor, "floor");

    let mut walls = Shape::default();
    let mut gratings = Shape::default();
    for side in [-1.0, 1.0] {
        window_wall(&mut walls, &mut gratings, side);
        let corner = Vec3::new(side * HALF_X, 0.0, -side * HALF_Z);
        walls.quad(
            corner,
            Vec3::Z * (2.0 * side * HALF_Z),
            Vec3::Y * HEIGHT,
            PLASTER,
        );
    }
    add_fixed(scene, walls, "walls");
    add_fixed(scene, gratings, "gratings");

    let mut roof = Shape::default();
    for side in [-1.0f32, 1.0] {
        let (near, far) = (side * COLUMN_Z, side * HALF_Z);
        roof.quad(
            Vec3::new(-HALF_X, HEIGHT, near.min(far)),
            Vec3::X * HALF_X * 2.0,
            Vec3::Z * COLUMN_Z,
            WOOD,
        );
        roof.cuboid(
            Vec3::new(-HALF_X, HEIGHT - 0.45, near - 0.25),
            Vec3::new(HALF_X, HEIGHT + 0.1, near + 0.25),
            STONE,
        );
        for i in 0..10 {
            let x = -9.0 + 2.0 * i as f32;
            let (inner, outer) = (near + 0.25 * side, far);
            roof.cuboid(
                Vec3::new(x - 0.07, HEIGHT - 0.2, inner.min(outer)),
                Vec3::new(x + 0.07, HEIGHT, inner.max(outer)),
                WOOD,
            );
        }
    }
    for x in COLUMN_X {
        roof.cuboid(
            Vec3::new(x - 0.12, HEIGHT - 0.3, -COLUMN_Z + 0.25),
            Vec3::new(x + 0.12, HEIGHT, COLUMN_Z - 0.25),
            WOOD,
        );
    }
    add_fixed(scene, roof, "roof");

    let mut column = Shape::default();
    column.cuboid(
        Vec3::new(-0.45, 0.0, -0.45),
        Vec3::new(0.45, 0.18, 0.45),
        STONE,
    );
    #[rustfmt::skip]
    let profile = [
        (0.42, 0.18), (0.44, 0.22), (0.44, 0.26), (0.40, 0.31), (0.36, 0.33), (0.36, 0.33),
        (0.34, 0.40), (0.33, 1.60), (0.315, 3.0), (0.29, 4.6), (0.28, 4.95), (0.28, 4.95),
        (0.33, 4.98), (0.33, 5.03), (0.29, 5.06), (0.29, 5.06), (0.31, 5.15), (0.42, 5.31),
    ];
    column.lathe(Vec3::ZERO, &profile, 28, STONE);
    column.cuboid(
        Vec3::new(-0.45, 5.31, -0.45),
        Vec3::new(0.45, 5.55, 0.45),
        STONE,
    );
    let column = add_mesh(scene, column.finish("column"));
    for side in ["left", "right"] {
        let z = if side == "left" { COLUMN_Z } else { -COLUMN_Z };
        for (i, x) in COLUMN_X.iter().enumerate() {
            let node = place(
                scene,
                &format!("column_{side}_{i}"),
                Vec3::new(*x, 0.0, z),
                0.0,
                1.0,
            );
            add_instance(scene, column, node);
        }
    }
    dais(scene);
}

/// A long wall with five windows, their reveals, and a grating in each.
fn window_wall(walls: &mut Shape, gratings: &mut Shape, side: f32) {
    const DEPTH: f32 = 0.4;
    let (low, high) = (1.3, 4.4);
    let z = side * HALF_Z;
    // Faces of the wall look inwards: u x v must point to the middle.
    let mut panel = |x0: f32, x1: f32, y0: f32, y1: f32| {
        let (start, u) = if side < 0.0 {
            (x0, x1 - x0)
        } else {
            (x1, x0 - x1)
        };
        walls.quad(
            Vec3::new(start, y0, z),
            Vec3::X * u,
            Vec3::Y * (y1 - y0),
            PLASTER,
        );
    };
    panel(-HALF_X, HALF_X, 0.0, low);
    panel(-HALF_X, HALF_X, high, HEIGHT);
    let mut from = -HALF_X;
    let centres = [-6.0, -3.0, 0.0, 3.0, 6.0f32];
    for x in centres {
        panel(from, x - 0.75, low, high);
        from = x + 0.75;
    }
    panel(from, HALF_X, low, high);
    let out = Vec3::Z * (side * DEPTH);
    for x in centres {
        let (left, right) = (x - 0.75, x + 0.75);
        let (a, b) = (Vec3::new(left, low, z), Vec3::new(right, low, z));
        let (wide, tall) = (Vec3::X * 1.5, Vec3::Y * (high - low));
        let mut reveal = |corner: Vec3, u: Vec3, v: Vec3, towards: Vec3| {
            if u.cross(v).dot(towards) > 0.0 {
                walls.quad(corner, u, v, STONE);
            } else {
                walls.quad(corner, v, u, STONE);
            }
        };
        reveal(a, wide, out, Vec3::Y);
        reveal(a + tall, wide, out, Vec3::NEG_Y);
        reveal(a, tall, out, Vec3::X);
        reveal(b, tall, out, Vec3::NEG_X);
        let first = gratings.mesh.uvs.len();
        gratings.quad(a + out * 0.6, wide, tall, GRATING);
        // A hole every quarter metre.
        for uv in &mut gratings.mesh.uvs[first..] {
            *uv *= 4.0;
        }
    }
}

fn dais(scene: &mut Scene) {
    let mut stone = Shape::default();
    let top = Vec3::Y * DAIS_HEIGHT;
    stone.quad(
        Vec3::new(-HALF_X, 0.0, HALF_Z) + top,
        Vec3::X * (HALF_X + DAIS_X),
        Vec3::NEG_Z * HALF_Z * 2.0,
        STONE,
    );
    stone.quad(
        Vec3::new(DAIS_X, 0.0, HALF_Z),
        Vec3::NEG_Z * HALF_Z * 2.0,
        top,
        STONE,
    );
    let tread = 0.3;
    for step in 0..STEPS - 1 {
        let rise = DAIS_HEIGHT / STEPS as f32;
        let x = DAIS_X + tread * (STEPS - 1 - step) as f32;
        stone.cuboid(
            Vec3::new(x - tread, 0.0, -STAIR_HALF_WIDTH),
            Vec3::new(x, rise * (step + 1) as f32, STAIR_HALF_WIDTH),
            STONE,
        );
    }
    stone.cuboid(
        Vec3::new(-9.1, DAIS_HEIGHT, -0.45),
        Vec3::new(-8.2, DAIS_HEIGHT + 0.7, 0.45),
        STONE,
    );
    add_fixed(scene, stone, "dais");

    let mut railings = Shape::default();
    for side in [-1.0, 1.0] {
        let z0 = side * (STAIR_HALF_WIDTH + 0.03);
        let edge = Vec3::new(DAIS_X - 0.06, DAIS_HEIGHT, z0);
        railing(&mut railings, edge, Vec3::Z * (side * HALF_Z * 0.995 - z0));
        // Down the stair.
        let foot = Vec3::new(DAIS_X + tread * (STEPS - 1) as f32, 0.0, z0);
        railing(&mut railings, foot, edge - foot);
        for (a, b) in [(-4.5, -1.5), (1.5, 4.5)] {
            let start = Vec3::new(a + 0.45, 0.0, side * COLUMN_Z);
            railing(&mut railings, start, Vec3::X * (b - a - 0.9));
        }
    }
    add_fixed(scene, railings, "railings");
}

/// Bars of 2.4 cm every 12 cm under a handrail of 5 cm, 0.95 m high.
fn railing(shape: &mut Shape, from: Vec3, along: Vec3) {
    const TALL: f32 = 0.95;
    const BAR: f32 = 0.012;
    let count = (along.length() / 0.12).round().max(1.0) as usize;
    for i in 0..=count {
        let foot = from + along * (i as f32 / count as f32);
        let half = if i == 0 || i == count { 0.02 } else { BAR };
        let half = Vec3::new(half, 0.0, half);
        shape.cuboid(foot - half, foot + half + Vec3::Y * TALL, IRON);
    }
    let across = along.cross(Vec3::Y).normalize_or(Vec3::X);
    let ends = along.normalize_or(Vec3::X) * 0.03;
    for (height, wide, thick) in [(TALL, 0.05, 0.04), (0.09, 0.024, 0.024)] {
        let base = from - ends + Vec3::Y * height - across * (wide / 2.0);
        let (u, v, w) = (along + ends * 2.0, across * wide, Vec3::Y * thick);
        shape.quad(base + w, v, u, IRON);
        shape.quad(base, u, v, IRON);
        shape.quad(base, w, u, IRON);
        shape.quad(base + v, u, w, IRON);
        shape.quad(base, v, w, IRON);
        shape.quad(base + u, w, v, IRON);
    }
}

fn furniture(scene: &mut Scene) {
    let mut bench = Shape::default();
    bench.cuboid(Vec3::new(-0.9, 0.42, -0.2), Vec3::new(0.9, 0.48, 0.2), WOOD);
    for x in [-0.75, 0.65] {
        bench.cuboid(
            Vec3::new(x, 0.0, -0.16),
            Vec3::new(x + 0.1, 0.42, 0.16),
            STONE,
        );
    }
    let bench = add_mesh(scene, bench.finish("bench"));
    for (i, (x, side)) in [(-3.0, 1.0), (3.0, 1.0), (-3.0, -1.0), (3.0, -1.0f32)]
        .iter()
        .enumerate()
    {
        let at = Vec3::new(*x, 0.0, side * 5.65);
        let node = place(scene, &format!("bench_{i}"), at, 0.0, 1.0);
        add_instance(scene, bench, node);
    }

    let mut knot = Shape::default();
    let curve = |t: f32| {
        let (a, b) = (t * TAU * 2.0, t * TAU * 3.0);
        let r = 0.42 + 0.17 * b.cos();
        Vec3::new(r * a.cos(), 0.17 * b.sin(), r * a.sin())
    };
    knot.ring_tube(curve, 0.085, 160, 12, BRONZE);
    let knot = add_mesh(scene, knot.finish("knot"));
    let node = place(
        scene,
        "knot",
        Vec3::new(-8.65, DAIS_HEIGHT + 1.35, 0.0),
        0.4,
        1.0,
    );
    // Stood on edge.
    scene.nodes[node].rotation *= Quat::from_rotation_z(1.45);
    add_instance(scene, knot, node);

    for (i, (z, material)) in [(-2.2, CLOTH_BLUE), (0.0, CLOTH_RED), (2.2, CLOTH_OCHRE)]
        .into_iter()
        .enumerate()
    {
        let mesh = add_mesh(scene, banner(material));
        let at = Vec3::new(-HALF_X + 0.18, 1.9, z);
        let node = place(scene, &format!("banner_{i}"), at, 0.0, 1.0);
        add_instance(scene, mesh, node);
    }

    let mut pot = Shape::default();
    #[rustfmt::skip]
    let profile = [
        (0.0, 0.0), (0.17, 0.0), (0.17, 0.0), (0.25, 0.18), (0.28, 0.34), (0.25, 0.44),
        (0.25, 0.44), (0.29, 0.46), (0.29, 0.50), (0.29, 0.50), (0.24, 0.50), (0.24, 0.50),
        (0.23, 0.43), (0.23, 0.43), (0.0, 0.42),
    ];
    pot.lathe(Vec3::ZERO, &profile, 24, POT);
    let pot = add_mesh(scene, pot.finish("pot"));
    let plant = add_mesh(scene, plant());
    for (i, (x, z)) in [(9.1, -4.9), (9.1, 4.9), (-6.2, -2.3), (-6.2, 2.3)]
        .iter()
        .enumerate()
    {
        for (name, mesh) in [("pot", pot), ("plant", plant)] {
            let at = Vec3::new(*x, 0.0, *z);
            let turn = i as f32 * 1.3;
            let node = place(scene, &format!("{name}_{i}"), at, turn, 1.0);
            add_instance(scene, mesh, node);
        }
    }
}

/// A cloth of 1.3 x 3.2 m that hangs in folds along Z, in front of the wall at -X.
fn banner(material: u32) -> Mesh {
    let mut shape = Shape::default();
    let (columns, rows) = (24u32, 10u32);
    for j in 0..=rows {
        for i in 0..=columns {
            let (s, t) = (i as f32 / columns as f32, j as f32 / rows as f32);
            // Folds deepen towards the hem.
            let depth = 0.07 * (1.0 - t) + 0.015;
            let (sin, cos) = (s * TAU * 3.0).sin_cos();
            let slope = depth * cos * TAU * 3.0 / 1.3;
            // +Z runs to the left when one looks at the wall.
            let at = Vec3::new(depth * sin, 3.2 * t, 0.65 - 1.3 * s);
            let normal = Vec3::new(1.0, 0.0, slope).normalize();
            shape.vertex(at, normal, Vec2::new(s, 1.0 - t));
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let (b, c) = (a + 1, a + columns + 1);
            shape.triangle([a, b, c + 1], material);
            shape.triangle([a, c + 1, c], material);
        }
    }
    shape.finish("banner")
}

/// Fronds that rise from the pot's earth and bend over.
fn plant() -> Mesh {
    const FRONDS: i32 = 13;
    const PIECES: i32 = 5;
    let mut shape = Shape::default();
    for k in 0..FRONDS {
        let (sin, cos) = ((k as f32 + 0.6 * random(k, 1, 1)) / FRONDS as f32 * TAU).sin_cos();
        let (out, side) = (Vec3::new(cos, 0.0, sin), Vec3::new(-sin, 0.0, cos));
        let length = 0.75 + 0.45 * random(k, 2, 1);
        let lean = 0.35 + 0.5 * random(k, 3, 1);
        let mut at = Vec3::new(0.0, 0.43, 0.0) + out * 0.05;
        let mut last: Option<(u32, u32)> = None;
        for i in 0..=PIECES {
            let t = i as f32 / PIECES as f32;
            let (s, c) = (lean * (0.4 + 1.9 * t)).sin_cos();
            let ahead = out * s + Vec3::Y * c;
            let normal = (side.cross(ahead) * -1.0).normalize_or(Vec3::Y);
            let left = shape.vertex(at - side * 0.17, normal, Vec2::new(0.0, 1.0 - t));
            let right = shape.vertex(at + side * 0.17, normal, Vec2::new(1.0, 1.0 - t));
            if let Some((l, r)) = last {
                shape.triangle([l, left, right], FROND);
                shape.triangle([l, right, r], FROND);
            }
            last = Some((left, right));
            at += ahead * (length / PIECES as f32);
        }
    }
    shape.finish("plant")
}

fn boulders(scene: &mut Scene, times: &[f32]) {
    let fine = add_mesh(scene, shapes::boulder(3, 3.3, BOULDER_GREY));
    let coarse = add_mesh(scene, shapes::boulder(2, 8.1, BOULDER_RED));
    #[rustfmt::skip]
    let lanes = [
        (fine, Lane { from: Vec3::new(-3.8, 0.0, -1.85), to: Vec3::new(4.6, 0.0, -1.85), radius: 0.50, phase: 0.10, trips: 1.0 }),
        (coarse, Lane { from: Vec3::new(4.4, 0.0, 1.85), to: Vec3::new(-4.2, 0.0, 1.85), radius: 0.42, phase: 0.35, trips: 1.0 }),
        (fine, Lane { from: Vec3::new(-5.0, 0.0, -4.55), to: Vec3::new(7.6, 0.0, -4.55), radius: 0.60, phase: 0.0, trips: 1.0 }),
        (coarse, Lane { from: Vec3::new(-5.5, 0.0, 4.55), to: Vec3::new(0.4, 0.0, 4.55), radius: 0.34, phase: 0.55, trips: 1.0 }),
        (fine, Lane { from: Vec3::new(6.1, 0.0, -1.9), to: Vec3::new(6.1, 0.0, 1.9), radius: 0.36, phase: 0.25, trips: 1.0 }),
        (coarse, Lane { from: Vec3::new(8.0, 0.0, 4.55), to: Vec3::new(2.2, 0.0, 4.55), radius: 0.45, phase: 0.8, trips: 1.0 }),
    ];
    for (i, (mesh, lane)) in lanes.into_iter().enumerate() {
        let node = place(scene, &format!("boulder_{i}"), lane.from, 0.0, lane.radius);
        add_instance(scene, mesh, node);
        let channels = rolling::channels(&lane, &scene.meshes[mesh], node, times);
        if let (ChannelValues::Translation(t), ChannelValues::Rotation(r)) =
            (&channels[0].values, &channels[1].values)
        {
            // At rest it lies where the loop begins.
            scene.nodes[node].translation = t[0];
            scene.nodes[node].rotation = r[0];
        }
        scene.channels.extend(channels);
    }
}

fn cameras_and_sun(scene: &mut Scene, times: &[f32]) {
    let main = place(scene, "main", Vec3::ZERO, 0.0, 1.0);
    let (mut translations, mut rotations) = (Vec::new(), Vec::new());
    for time in times {
        let (sin, cos) = (time / DURATION * TAU).sin_cos();
        let eye = Vec3::new(8.4 + 0.5 * cos, 1.95 + 0.15 * sin, 1.0 * sin);
        let target = Vec3::new(-4.0, 1.25, -0.4 * sin);
        let view = look_at(eye, target, 1.0).world_from_camera;
        translations.push(eye);
        rotations.push(Quat::from_mat3a(&view.matrix3).normalize());
    }
    scene.nodes[main].translation = translations[0];
    scene.nodes[main].rotation = rotations[0];
    for values in [
        ChannelValues::Translation(translations),
        ChannelValues::Rotation(rotations),
    ] {
        scene.channels.push(Channel {
            node: main,
            interpolation: Interpolation::Linear,
            times: times.to_vec(),
            values,
        });
    }
    let corner = look_at(Vec3::new(9.6, 4.5, 2.2), Vec3::new(-1.5, 0.5, -1.2), 1.0);
    let yfov = 58.0f32.to_radians();
    for (name, node, world_from_camera) in [
        ("main", Some(main), Affine3A::IDENTITY),
        ("corner", None, corner.world_from_camera),
    ] {
        scene.cameras.push(Camera {
            name: name.to_owned(),
            node,
            yfov,
            znear: 0.05,
            world_from_camera,
        });
    }
    let sun = place(scene, "sun", Vec3::new(0.0, 20.0, 0.0), 0.0, 1.0);
    let towards = Vec3::new(-0.42, -1.0, 0.34).normalize();
    scene.nodes[sun].rotation = Quat::from_rotation_arc(Vec3::NEG_Z, towards);
    scene.lights.push(Light {
        name: "sun".to_owned(),
        node: Some(sun),
        kind: LightKind::Directional,
        intensity: Vec3::new(3.2, 2.9, 2.5),
        range: f32::INFINITY,
    });
}

#[cfg(test)]
mod tests;
