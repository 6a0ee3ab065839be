//! The built-in scene: a hall, open to the sky, with columns, a dais behind thin railings, rolling
//! boulders, a walker, plants and gratings with holes, and a floor with a normal map.
//!
//! Everything is made by code, the same on every call: 20 x 6 x 12 m, Y up, the floor at 0, the
//! long side along X. It loops after [`DURATION`] seconds.

mod building;
mod furniture;
mod rolling;
mod shapes;
mod textures;
mod walker;

use super::camera::look_at;
use super::{
    Alpha, Camera, Channel, ChannelValues, Instance, Interpolation, Light, LightKind, Material,
    Mesh, Node, Scene, TextureRef, normals,
};
use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};
use rolling::Lane;
use shapes::Shape;
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
        building::add(&mut scene);
        furniture::add(&mut scene);
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
        base_color_texture: Some(TextureRef::from(texture)),
        alpha: Alpha::Mask { cutoff: 0.5 },
        double_sided: true,
        ..plain(name, 1.0, 1.0, 1.0, 0.8)
    };
    vec![
        Material {
            base_color_texture: Some(0.into()),
            normal_texture: Some(1.into()),
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
