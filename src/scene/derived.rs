//! What follows from a scene's data and is worth computing once: which nodes can move, how each
//! skin's joints hang below its frame, which meshes need alpha tests.

use super::{ChannelValues, Material, Mesh, Scene};
use glam::Vec3;
use std::hash::Hasher;
use std::sync::OnceLock;
use twox_hash::XxHash64;

/// Filled on first use. A clone starts empty, so that a changed clone is evaluated afresh.
#[derive(Debug, Default)]
pub struct Cache {
    derived: OnceLock<Derived>,
    /// [`Scene::mesh_hash`].
    hashes: OnceLock<Vec<u64>>,
    /// [`Scene::size`].
    pub(super) size: OnceLock<f32>,
}

impl Clone for Cache {
    fn clone(&self) -> Self {
        Cache::default()
    }
}

#[derive(Debug)]
pub(super) struct Derived {
    /// Whether the node's world transform can change: a channel moves it or an ancestor.
    pub node_moves: Vec<bool>,
    /// One per instance.
    pub deforms: Vec<bool>,
    pub deform_changes: Vec<bool>,
    /// The chain of joints of each skinned instance.
    pub chains: Vec<Option<JointChain>>,
    /// One per mesh: whether any triangle has a material with holes.
    pub mesh_has_holes: Vec<bool>,
}

/// The nodes between a skinned instance's frame and its joints, parents first.
#[derive(Debug)]
pub(super) struct JointChain {
    /// (node, position of its parent in this list; `None` when the parent is the frame).
    pub nodes: Vec<(usize, Option<usize>)>,
    /// Position in `nodes` of each joint of the skin.
    pub joints: Vec<usize>,
}

impl Scene {
    pub(super) fn derived(&self) -> &Derived {
        self.cache.derived.get_or_init(|| derive(self))
    }

    /// Tells meshes apart: XXH64 of what gives a mesh its shapes, that is positions, triangles, joints
    /// and weights of its vertices, and displacements of positions.
    pub fn mesh_hash(&self, mesh: usize) -> u64 {
        let hashes = self.cache.hashes.get_or_init(|| {
            let meshes = self.meshes.iter();
            meshes.map(hash).collect()
        });
        hashes.get(mesh).copied().unwrap_or(0)
    }

    /// Whether the instance's `world_from_mesh` can ever change: a channel moves its node or an
    /// ancestor of it.
    pub fn is_moving_instance(&self, instance: usize) -> bool {
        match self.instances.get(instance).and_then(|i| i.node) {
            Some(node) => self.derived().node_moves[node],
            None => false,
        }
    }

    /// Whether [`super::Pose::deformed`] holds vertices for the instance (it is skinned, or morphed
    /// by weights that are not all zero for ever).
    pub fn is_deformed_instance(&self, instance: usize) -> bool {
        self.derived().deforms.get(instance).is_some_and(|d| *d)
    }

    /// Whether the instance's vertices can ever change in mesh space: a channel moves a joint
    /// relative to the instance's frame, or a morph weight.
    pub fn is_deforming_instance(&self, instance: usize) -> bool {
        self.derived()
            .deform_changes
            .get(instance)
            .is_some_and(|d| *d)
    }

    /// Whether the instance's surface can ever move: it is moving or deforming.
    pub fn can_move(&self, instance: usize) -> bool {
        self.is_moving_instance(instance) || self.is_deforming_instance(instance)
    }

    /// Whether any triangle of the mesh needs [`Scene::alpha_is_hole`].
    pub fn mesh_has_holes(&self, mesh: usize) -> bool {
        self.derived().mesh_has_holes.get(mesh).is_some_and(|d| *d)
    }
}

fn hash(mesh: &Mesh) -> u64 {
    let mut hash = XxHash64::with_seed(0);
    let mut part = |count: usize, numbers: &mut dyn Iterator<Item = u32>| {
        hash.write(&(count as u64).to_le_bytes());
        for number in numbers {
            hash.write(&number.to_le_bytes());
        }
    };
    let bits = |position: &Vec3| position.to_array().map(f32::to_bits);
    let positions = &mesh.positions;
    part(positions.len(), &mut positions.iter().flat_map(bits));
    let triangles = &mesh.triangles;
    part(triangles.len(), &mut triangles.iter().flatten().copied());
    let joints = mesh.joints.iter().flatten();
    part(
        mesh.joints.len(),
        &mut joints.map(|joint| u32::from(*joint)),
    );
    let weights = mesh.weights.iter().flat_map(|weight| weight.to_array());
    part(mesh.weights.len(), &mut weights.map(f32::to_bits));
    for target in &mesh.morph_targets {
        let positions = &target.positions;
        part(positions.len(), &mut positions.iter().flat_map(bits));
    }
    hash.finish()
}

fn derive(scene: &Scene) -> Derived {
    let mut own_channel = vec![false; scene.nodes.len()];
    let mut weight_channel = vec![false; scene.nodes.len()];
    for channel in &scene.channels {
        match channel.values {
            ChannelValues::MorphWeights { .. } => weight_channel[channel.node] = true,
            _ => own_channel[channel.node] = true,
        }
    }
    let mut node_moves = own_channel.clone();
    for (i, node) in scene.nodes.iter().enumerate() {
        node_moves[i] |= node.parent.is_some_and(|p| node_moves[p]);
    }

    let mut deforms = Vec::with_capacity(scene.instances.len());
    let mut deform_changes = Vec::with_capacity(scene.instances.len());
    let mut chains = Vec::with_capacity(scene.instances.len());
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let chain = instance
            .skin
            .map(|skin| joint_chain(scene, skin, instance.node));
        let morph_node = instance.morph_node.or(instance.node);
        let weights_animated = morph_node.is_some_and(|n| weight_channel[n]);
        let weights_set = morph_weights(scene, instance.mesh, morph_node)
            .iter()
            .any(|w| *w != 0.0);
        let morphs = !mesh.morph_targets.is_empty() && (weights_animated || weights_set);
        let joints_move = chain
            .as_ref()
            .is_some_and(|c| c.nodes.iter().any(|(n, _)| own_channel[*n]));
        deforms.push(chain.is_some() || morphs);
        deform_changes.push(joints_move || (morphs && weights_animated));
        chains.push(chain);
    }
    let mesh_has_holes = scene
        .meshes
        .iter()
        .map(|mesh| {
            mesh.materials.iter().any(|m| {
                scene
                    .materials
                    .get(*m as usize)
                    .is_some_and(Material::has_holes)
            })
        })
        .collect();
    Derived {
        node_moves,
        deforms,
        deform_changes,
        chains,
        mesh_has_holes,
    }
}

/// The resting morph weights of an instance: its node's, or else its mesh's.
pub(super) fn morph_weights(scene: &Scene, mesh: usize, node: Option<usize>) -> &[f32] {
    match node.map(|n| &scene.nodes[n].morph_weights) {
        Some(weights) if !weights.is_empty() => weights,
        _ => &scene.meshes[mesh].morph_weights,
    }
}

fn joint_chain(scene: &Scene, skin: usize, frame: Option<usize>) -> JointChain {
    // Nodes are stored parents first, so ascending order is a valid order for the chain.
    let mut wanted = Vec::new();
    for joint in &scene.skins[skin].joints {
        let mut node = Some(*joint);
        while let Some(n) = node {
            if Some(n) == frame {
                break;
            }
            wanted.push(n);
            node = scene.nodes[n].parent;
        }
    }
    wanted.sort_unstable();
    wanted.dedup();
    let position = |node: usize| wanted.binary_search(&node).ok();
    let nodes = wanted
        .iter()
        .map(|n| (*n, scene.nodes[*n].parent.and_then(position)))
        .collect();
    let joints = scene.skins[skin]
        .joints
        .iter()
        .map(|j| position(*j).unwrap_or(0))
        .collect();
    JointChain { nodes, joints }
}
