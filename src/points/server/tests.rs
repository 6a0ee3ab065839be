//! What the server refuses and how instances share points.

use super::*;
use crate::points::place::Density;
use crate::scene::Scene;
use crate::scene::{Instance, Material, Mesh, Node, Skin};
use glam::Vec3;
use glam::{Mat4, Quat};

fn node(parent: Option<usize>, scale: f32) -> Node {
    Node {
        name: String::new(),
        parent,
        translation: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        scale: Vec3::splat(scale),
        matrix: None,
        morph_weights: Vec::new(),
    }
}

/// One square of a metre with one joint, and skins that bind it at the given sizes.
fn bound_at(sizes: &[f32]) -> Scene {
    let mesh = Mesh {
        positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| Vec3::new(x, y, 0.0))
            .to_vec(),
        normals: vec![Vec3::Z; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        materials: vec![0; 2],
        joints: vec![[0; 4]; 4],
        weights: vec![glam::Vec4::X; 4],
        ..Mesh::default()
    };
    Scene {
        name: "bound".into(),
        meshes: vec![mesh],
        materials: vec![Material::default()],
        // A frame and below it a joint for each.
        nodes: sizes
            .iter()
            .enumerate()
            .flat_map(|(i, &s)| [node(None, 1.0), node(Some(2 * i), s)])
            .collect(),
        skins: (0..sizes.len())
            .map(|i| Skin {
                joints: vec![2 * i + 1],
                inverse_bind: vec![Mat4::IDENTITY],
            })
            .collect(),
        instances: (0..sizes.len())
            .map(|i| Instance {
                name: i.to_string(),
                node: Some(2 * i),
                skin: Some(i),
                ..Instance::default()
            })
            .collect(),
        ..Scene::default()
    }
}

fn server(world: &World, candidates: f32) -> Result<Server> {
    let options = Options {
        density: Density {
            candidates,
            thinning: 2.0,
        },
        ..Options::default()
    };
    Server::new(world, options)
}

#[test]
fn skins_of_other_sizes_have_points_of_their_own() {
    let scene = bound_at(&[4.0, 1.0, 4.0]);
    let world = World::new(&scene, 0.0);
    let server = server(&world, 100.0).expect("a server");
    let points: Vec<usize> = server.tracks().iter().map(Track::points).collect();
    assert_eq!(points, [800, 50, 800]);
    let same = |a: usize, b: usize| {
        Arc::ptr_eq(&server.tracks()[a].template, &server.tracks()[b].template)
    };
    assert!(
        same(0, 2) && !same(0, 1),
        "only skins of one size share points"
    );
}

#[test]
fn nothing_is_dropped_where_skins_differ_in_size() {
    let scene = bound_at(&[8.0, 1.0]);
    let world = World::new(&scene, 0.0);
    let mut server = server(&world, 1000.0).expect("a server");
    server.start(&world, &mut |_, _| {});
    assert!(server.tracks().iter().all(|t| t.store.dropped_points == 0));
}

#[test]
fn more_surface_than_memory_holds_is_refused_before_it_is_placed() {
    for size in [1e4, 1e18] {
        let scene = bound_at(&[size]);
        let error = server(&World::new(&scene, 0.0), 1000.0)
            .map(drop)
            .expect_err("refused")
            .to_string();
        assert!(error.contains("candidates"), "{error}");
    }
}
