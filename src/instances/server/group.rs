//! Which meshes stand in a scene several times, and each object alone in a scene of its own.

use crate::scene::{Instance, Pose, Scene};
use crate::trace::Aabb;
use glam::{Affine3A, Vec3};

/// Most parts of an object. A node with more children is a place in the scene and no object.
const MAX_PARTS: usize = 16;

/// Parts belong together where their places relative to each other differ by less than this share of their
/// size between instances: files have 32-bit floats.
const SAME_PLACE: f32 = 1e-3;

/// A mesh and its instances.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Two or more, ascending.
    pub instances: Vec<usize>,
    /// The instance of median scale, at the size of which the object is baked alone.
    pub median: usize,
    /// Metres per unit of the mesh, of that instance: the cube root of the volume of a unit cube.
    pub scale: f32,
    /// What stands at the same place beside every instance: the leaves beside a trunk.
    pub companions: Vec<Companion>,
}

/// A part of the object that a mesh belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Companion {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// From the space of its mesh to that of the group's.
    pub placement: Affine3A,
}

/// Meshes with at least two instances, in the order of the meshes. Deformed instances count for none,
/// since their shape is not their mesh's, and neither do those that are flattened.
pub fn groups(scene: &Scene, pose: &Pose) -> Vec<Group> {
    let mut by_mesh = vec![Vec::new(); scene.meshes.len()];
    for (index, instance) in scene.instances.iter().enumerate() {
        let scale = scale(&pose.world_from_mesh[index]);
        let usable = scale > 0.0 && scale.is_finite();
        if usable && !scene.is_deformed_instance(index) {
            by_mesh[instance.mesh].push(index);
        }
    }
    let several = by_mesh.into_iter().enumerate();
    several
        .filter(|(_, instances)| instances.len() > 1)
        .map(|(mesh, instances)| {
            let mut sorted = instances.clone();
            let scale_of = |i: &usize| scale(&pose.world_from_mesh[*i]);
            sorted.sort_by(|a, b| scale_of(a).total_cmp(&scale_of(b)));
            let median = sorted[sorted.len() / 2];
            Group {
                mesh,
                companions: companions(scene, pose, &instances),
                instances,
                median,
                scale: scale_of(&median),
            }
        })
        .collect()
}

impl Group {
    /// The object alone: a scene of which instance 0 is the group's mesh and the others are its companions,
    /// and its pose. The object has the size and the orientation of the median instance, since distances of
    /// obscurance are metres in the world; it stands at the origin.
    pub fn alone(&self, scene: &Scene, pose: &Pose) -> (Scene, Pose) {
        let mut world = pose.world_from_mesh[self.median];
        world.translation = glam::Vec3A::ZERO;
        let own = Companion {
            mesh: self.mesh,
            placement: Affine3A::IDENTITY,
        };
        let parts: Vec<Companion> = std::iter::once(own)
            .chain(self.companions.iter().copied())
            .collect();
        let alone = Scene {
            name: scene.name.clone(),
            meshes: parts.iter().map(|p| scene.meshes[p.mesh].clone()).collect(),
            materials: scene.materials.clone(),
            textures: scene.textures.clone(),
            instances: (0..parts.len())
                .map(|mesh| Instance {
                    name: format!("{mesh}"),
                    mesh,
                    ..Instance::default()
                })
                .collect(),
            ..Scene::default()
        };
        let pose = Pose {
            world_from_mesh: parts.iter().map(|p| world * p.placement).collect(),
            deformed: vec![None; parts.len()],
            ..Pose::default()
        };
        (alone, pose)
    }
}

/// Metres per unit, by volume.
fn scale(world: &Affine3A) -> f32 {
    world.matrix3.determinant().abs().cbrt()
}

/// Parts that stand beside all of these instances in the same way. Candidates are what hangs below the same
/// node, below the instance's own node, or on the node above.
fn companions(scene: &Scene, pose: &Pose, instances: &[usize]) -> Vec<Companion> {
    let mut by_node = vec![Vec::new(); scene.nodes.len()];
    let mut by_parent = vec![Vec::new(); scene.nodes.len()];
    for (index, instance) in scene.instances.iter().enumerate() {
        let Some(node) = instance.node else { continue };
        if scene.is_deformed_instance(index) {
            continue;
        }
        by_node[node].push(index);
        if let Some(parent) = scene.nodes[node].parent {
            by_parent[parent].push(index);
        }
    }
    // (mesh, placement in the space of the instance's mesh).
    let beside = |instance: usize| -> Vec<Companion> {
        let Some(node) = scene.instances[instance].node else {
            return Vec::new();
        };
        let mut others: Vec<usize> = by_parent[node].clone();
        if let Some(parent) = scene.nodes[node].parent {
            others.extend(&by_parent[parent]);
            others.extend(&by_node[parent]);
        }
        others.retain(|other| *other != instance);
        if others.len() >= MAX_PARTS {
            return Vec::new();
        }
        let inverse = pose.world_from_mesh[instance].inverse();
        let place = |other: usize| Companion {
            mesh: scene.instances[other].mesh,
            placement: inverse * pose.world_from_mesh[other],
        };
        others.into_iter().map(place).collect()
    };
    let mut found = beside(instances[0]);
    for &instance in &instances[1..] {
        if found.is_empty() {
            break;
        }
        let here = beside(instance);
        found.retain(|a| here.iter().any(|b| is_same(scene, a, b)));
    }
    found
}

/// Whether two parts are one mesh at one place: the corners of its box agree.
fn is_same(scene: &Scene, a: &Companion, b: &Companion) -> bool {
    if a.mesh != b.mesh {
        return false;
    }
    let bounds = Aabb::of(scene.meshes[a.mesh].positions.iter().copied());
    let size = a.placement.transform_vector3(bounds.max - bounds.min);
    (0..8).all(|corner| {
        let pick = |axis: usize| [bounds.min, bounds.max][corner >> axis & 1][axis];
        let p = Vec3::new(pick(0), pick(1), pick(2));
        let gap = a.placement.transform_point3(p) - b.placement.transform_point3(p);
        gap.length() <= SAME_PLACE * size.length()
    })
}
