//! Skins, and the frame in which a skinned instance lives.

use super::nodes::Order;
use super::{Document, Read, get};
use crate::scene::{Scene, Skin};
use glam::Mat4;

/// Fills `scene.skins`, in the file's order.
pub(super) fn read(document: &Document, order: &Order, scene: &mut Scene) -> Read<()> {
    let root = &document.root;
    for (i, skin) in root.skins.iter().enumerate() {
        if skin.joints.is_empty() {
            return Err(format!("skin {i} has no joints"));
        }
        let joints: Read<Vec<usize>> = skin
            .joints
            .iter()
            .map(|j| get(&root.nodes, *j, "joint").map(|_| order.of_source[j.value()]))
            .collect();
        let joints = joints?;
        let inverse_bind = match skin.inverse_bind_matrices {
            Some(accessor) => {
                let what = format!("the inverse bind matrices of skin {i}");
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
        scene.skins.push(Skin {
            joints,
            inverse_bind,
        });
    }
    Ok(())
}

/// Whether the mesh can wear the skin.
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
