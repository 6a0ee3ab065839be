//! Small scenes made in code, for tests that need to know what moves where.

// Each test program uses a part of it.
#![allow(dead_code)]

use dapple::points::sample::{Fallback, sample, to_grid};
use dapple::points::server::{Options, Server, Tick, Track};
use dapple::rng::Rng;
use dapple::scene::camera::look_at;
use dapple::scene::{
    Camera, Channel, ChannelValues, Instance, Interpolation, Material, Mesh, MorphTarget, Node,
    Scene, Surface,
};
use dapple::world::World;
use glam::{Quat, Vec3};

/// A scene under construction.
pub struct Tiny(pub Scene);

impl Tiny {
    pub fn new(name: &str, duration: f32) -> Tiny {
        Tiny(Scene {
            name: name.into(),
            materials: vec![Material::default()],
            duration,
            ..Scene::default()
        })
    }

    /// A node at `at` that shows `mesh`; returns the node.
    pub fn place(&mut self, name: &str, mesh: Mesh, at: Vec3) -> usize {
        let scene = &mut self.0;
        scene.meshes.push(mesh);
        scene.nodes.push(Node {
            name: name.into(),
            parent: None,
            translation: at,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
            matrix: None,
            morph_weights: Vec::new(),
        });
        scene.instances.push(Instance {
            name: name.into(),
            mesh: scene.meshes.len() - 1,
            node: Some(scene.nodes.len() - 1),
            ..Instance::default()
        });
        scene.nodes.len() - 1
    }

    /// Animates a node.
    pub fn animate(
        &mut self,
        node: usize,
        interpolation: Interpolation,
        times: &[f32],
        values: ChannelValues,
    ) {
        let times = times.to_vec();
        self.0.channels.push(Channel {
            node,
            interpolation,
            times,
            values,
        });
    }

    /// Moves a node from key to key.
    pub fn slide(&mut self, node: usize, interpolation: Interpolation, keys: &[(f32, Vec3)]) {
        let (times, positions): (Vec<f32>, Vec<Vec3>) = keys.iter().copied().unzip();
        self.animate(
            node,
            interpolation,
            &times,
            ChannelValues::Translation(positions),
        );
    }

    pub fn camera(&mut self, name: &str, eye: Vec3, target: Vec3) {
        let pose = look_at(eye, target, 1.0);
        self.0.cameras.push(Camera {
            name: name.into(),
            node: None,
            yfov: pose.yfov,
            znear: pose.znear,
            world_from_camera: pose.world_from_camera,
        });
    }
}

/// A box about the origin, its faces outwards.
pub fn cuboid(half: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let normal = axes[axis] * sign;
            let u = axes[(axis + 1) % 3];
            quad(
                &mut mesh,
                normal * half,
                u * half,
                normal.cross(u) * half,
                normal,
            );
        }
    }
    mesh
}

/// A level square, `2 * half` wide, that faces up.
pub fn floor(half: f32) -> Mesh {
    let mut mesh = Mesh::default();
    quad(
        &mut mesh,
        Vec3::ZERO,
        Vec3::Z * half,
        Vec3::X * half,
        Vec3::Y,
    );
    mesh
}

/// A box whose morph target is twice as high, standing on its bottom.
pub fn growing_cuboid(half: Vec3) -> Mesh {
    let mut mesh = cuboid(half);
    let up = |p: &Vec3| {
        if p.y > 0.0 {
            Vec3::Y * 2.0 * half.y
        } else {
            Vec3::ZERO
        }
    };
    mesh.morph_targets = vec![MorphTarget {
        positions: mesh.positions.iter().map(up).collect(),
        normals: Vec::new(),
    }];
    mesh.morph_weights = vec![0.0];
    mesh
}

fn quad(mesh: &mut Mesh, centre: Vec3, u: Vec3, v: Vec3, normal: Vec3) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([
        centre - u - v,
        centre + u - v,
        centre + u + v,
        centre - u + v,
    ]);
    mesh.normals.extend([normal; 4]);
    mesh.triangles
        .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh.materials.extend([0, 0]);
}

/// A floor, two walls and a box that stands on it, 0.2 m deep in no wall: nothing moves.
pub fn corner() -> Tiny {
    let mut tiny = Tiny::new("corner", 0.0);
    tiny.place("floor", floor(2.0), Vec3::ZERO);
    tiny.place(
        "wall x",
        cuboid(Vec3::new(0.1, 1.0, 2.0)),
        Vec3::new(-2.1, 1.0, 0.0),
    );
    tiny.place(
        "wall z",
        cuboid(Vec3::new(2.0, 1.0, 0.1)),
        Vec3::new(0.0, 1.0, -2.1),
    );
    tiny.place("box", cuboid(Vec3::splat(0.4)), Vec3::new(0.5, 0.4, 0.5));
    tiny.camera("all", Vec3::new(4.0, 4.0, 4.0), Vec3::ZERO);
    tiny
}

/// The corner with a second box that slides past the first for one second of ten, and then lies
/// still.
pub fn passing() -> Tiny {
    let mut tiny = corner();
    tiny.0.name = "passing".into();
    tiny.0.duration = 10.0;
    let node = tiny.place(
        "mover",
        cuboid(Vec3::splat(0.3)),
        Vec3::new(-1.5, 0.35, -0.5),
    );
    let keys = [
        (0.0, Vec3::new(-1.5, 0.35, -0.5)),
        (1.0, Vec3::new(1.2, 0.35, -0.45)),
    ];
    tiny.slide(node, Interpolation::Linear, &keys);
    tiny.camera("away", Vec3::new(4.0, 4.0, 4.0), Vec3::splat(8.0));
    tiny
}

/// A server of `points` and the world that it alone follows.
pub struct Served<'s> {
    pub world: World<'s>,
    pub server: Server,
}

impl<'s> Served<'s> {
    /// The scene at time 0, no point traced.
    pub fn new(scene: &'s Scene, options: Options) -> Served<'s> {
        let world = World::new(scene, 0.0);
        let server = Server::new(&world, options).expect("a server");
        Served { world, server }
    }

    pub fn start(&mut self) -> Tick {
        self.server.start(&self.world, &mut |_, _| {})
    }

    pub fn tick(&mut self, time: f64, camera: Option<&dapple::scene::CameraPose>) -> Tick {
        self.world.camera = camera.copied();
        self.server.advance(&mut self.world, time)
    }

    /// A random place on triangle `k` of an instance, counted round its mesh.
    pub fn random_surface(&self, instance: usize, k: usize, rng: &mut Rng) -> Surface {
        let scene = self.world.scene();
        let triangles = scene.meshes[scene.instances[instance].mesh].triangles.len();
        let (mut u, mut v) = (rng.unit(), rng.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        scene.surface(self.world.pose(), instance, k % triangles, u, v)
    }

    /// Ray-traced AO within `distance` metres.
    pub fn traced_ao(&self, at: &Surface, distance: f32, seed: usize) -> f32 {
        let (position, face) = (at.position, at.geometric_normal);
        let tracer = self.world.tracer();
        tracer.ambient_occlusion(position, face, at.normal, 256, distance, seed as u32)
    }

    /// AO as a client samples it from the points of a track.
    pub fn sampled_ao(&self, track: &Track, at: &Surface) -> f32 {
        let store = &track.store;
        let (grid, buckets, cells) = (store.grid(), store.buckets(), store.cells());
        let (x, n) = to_grid(grid, at.mesh_position, at.mesh_normal);
        sample(grid, buckets, cells, x, n, Fallback::Fill).ao
    }
}

impl std::ops::Deref for Served<'_> {
    type Target = Server;

    fn deref(&self) -> &Server {
        &self.server
    }
}
