//! Skins, and the frame in which a skinned instance lives.

use super::hierarchy::Order;
use super::{Document, Read, get};
use crate::scene::{Scene, Skin};
use glam::Mat4;

/// Fills `scene.skins`, in the file's order. One that cannot be used has no joints.
pub(super) fn read(document: &Document, order: &Order, scene: &mut Scene) {
    for i in 0..document.root.skins.len() {
        let skin = document.optional(read_skin(document, order, i));
        scene.skins.push(skin.unwrap_or(Skin {
            joints: Vec::new(),
            inverse_bind: Vec::new(),
        }));
    }
}

fn read_skin(document: &Document, order: &Order, index: usize) -> Read<Skin> {
    let root = &document.root;
    let skin = &root.skins[index];
    if skin.joints.is_empty() {
        return Err(format!("skin {index} has no joints"));
    }
    document.spend(skin.joints.len(), &format!("skin {index}"))?;
    let joints: Read<Vec<usize>> = skin
        .joints
        .iter()
        .map(|j| {
            let joint = get(&root.nodes, *j, "node").map(|_| order.of_source[j.value()]);
            joint.map_err(|reason| format!("a joint of skin {index} is missing: {reason}"))
        })
        .collect();
    let joints = joints?;
    let inverse_bind = match skin.inverse_bind_matrices {
        Some(accessor) => {
            let what = format!("the inverse bind matrices of skin {index}");
            let mut matrices = document.floats::<16>(accessor, &what)?;
            if matrices.len() < joints.len() {
                return Err(format!(
                    "{what} are {} for {} joints",
                    matrices.len(),
                    joints.len()
                ));
            }
            matrices.truncate(joints.len());
            matrices.iter().map(Mat4::from_cols_array).collect()
        }
        None => vec![Mat4::IDENTITY; joints.len()],
    };
    Ok(Skin {
        joints,
        inverse_bind,
    })
}

/// Whether the mesh can have the skin.
pub(super) fn check(scene: &Scene, mesh: usize, skin: usize, node: usize) -> Read<()> {
    let joints = scene.skins[skin].joints.len();
    let mesh = &scene.meshes[mesh];
    if mesh.joints.is_empty() {
        return Err(format!(
            "node {node} has a skin but its mesh {} has no joints",
            mesh.name
        ));
    }
    let highest = mesh.joints.iter().flatten().max().copied().unwrap_or(0);
    if usize::from(highest) >= joints {
        return Err(format!(
            "mesh {} names joint {highest} but the skin of node {node} has {joints}",
            mesh.name
        ));
    }
    Ok(())
}

/// The node above the common root joint, or, where several joints hang side by side, the node that
/// they hang under. `None` stands for the world.
pub(super) fn frame(scene: &Scene, skin: usize) -> Option<usize> {
    let joints = &scene.skins[skin].joints;
    let mut common = joints.first().copied();
    for joint in joints {
        // Parents come first, so the larger index of two nodes cannot be an ancestor of the other.
        let mut other = Some(*joint);
        while let (Some(a), Some(b)) = (common, other) {
            match a.cmp(&b) {
                std::cmp::Ordering::Equal => break,
                std::cmp::Ordering::Greater => common = scene.nodes[a].parent,
                std::cmp::Ordering::Less => other = scene.nodes[b].parent,
            }
        }
        if other.is_none() {
            common = None;
        }
    }
    match common {
        Some(node) if joints.contains(&node) => scene.nodes[node].parent,
        other => other,
    }
}
