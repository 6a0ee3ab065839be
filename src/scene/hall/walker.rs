//! A figure of capsules that walks round an ellipse: one skin, a walk cycle and a path as keys.

use super::shapes::{Shape, two_joints};
use crate::scene::{Channel, ChannelValues, Instance, Interpolation, Node, Scene, Skin};
use glam::{Mat4, Quat, Vec3};
use std::f32::consts::TAU;

/// The path: half axes along X and Z in metres, and its centre.
const PATH: (f32, f32) = (2.4, 0.85);
const CENTRE: Vec3 = Vec3::new(1.0, 0.0, 0.0);
/// Walk cycles (two steps each) a lap; one lap a loop.
const CYCLES: f32 = 8.0;
const LEG: f32 = 0.87;
/// Within this distance of a joint a limb follows its parent, too.
const BLEND: f32 = 0.08;

struct Bone {
    name: &'static str,
    parent: Option<usize>,
    /// Joint position in the figure's space, metres.
    at: Vec3,
    /// Capsules: from, to (relative to the joint), radii, material slot.
    limbs: &'static [(Vec3, Vec3, f32, f32, usize)],
}

const fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

const CLOTH: usize = 0;
const SHIRT: usize = 1;
const SKIN: usize = 2;
const SHOE: usize = 3;

/// The figure stands at the origin, looks along +Z, +X is its left.
#[rustfmt::skip]
const BONES: [Bone; 16] = [
    Bone { name: "hips", parent: None, at: v(0.0, 0.96, 0.0), limbs: &[(v(-0.06, 0.0, 0.0), v(0.06, 0.0, 0.0), 0.125, 0.125, CLOTH)] },
    Bone { name: "spine", parent: Some(0), at: v(0.0, 1.06, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, 0.16, 0.0), 0.12, 0.13, SHIRT)] },
    Bone { name: "chest", parent: Some(1), at: v(0.0, 1.22, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, 0.15, 0.0), 0.135, 0.12, SHIRT), (v(-0.14, 0.17, 0.0), v(0.14, 0.17, 0.0), 0.075, 0.075, SHIRT)] },
    Bone { name: "neck", parent: Some(2), at: v(0.0, 1.45, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, 0.08, 0.01), 0.05, 0.05, SKIN)] },
    Bone { name: "head", parent: Some(3), at: v(0.0, 1.55, 0.01), limbs: &[(v(0.0, 0.05, 0.01), v(0.0, 0.13, 0.0), 0.095, 0.1, SKIN)] },
    Bone { name: "upper_arm_l", parent: Some(2), at: v(0.2, 1.39, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.02, -0.29, 0.0), 0.06, 0.048, SHIRT)] },
    Bone { name: "forearm_l", parent: Some(5), at: v(0.22, 1.10, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.24, 0.0), 0.046, 0.036, SKIN)] },
    Bone { name: "hand_l", parent: Some(6), at: v(0.22, 0.84, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.08, 0.0), 0.042, 0.034, SKIN)] },
    Bone { name: "upper_arm_r", parent: Some(2), at: v(-0.2, 1.39, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(-0.02, -0.29, 0.0), 0.06, 0.048, SHIRT)] },
    Bone { name: "forearm_r", parent: Some(8), at: v(-0.22, 1.10, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.24, 0.0), 0.046, 0.036, SKIN)] },
    Bone { name: "hand_r", parent: Some(9), at: v(-0.22, 0.84, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.08, 0.0), 0.042, 0.034, SKIN)] },
    Bone { name: "thigh_l", parent: Some(0), at: v(0.1, 0.93, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.42, 0.0), 0.09, 0.065, CLOTH)] },
    Bone { name: "shin_l", parent: Some(11), at: v(0.1, 0.51, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.41, 0.0), 0.063, 0.045, CLOTH)] },
    Bone { name: "foot_l", parent: Some(12), at: v(0.1, 0.09, 0.0), limbs: &[(FOOT.0, FOOT.1, FOOT_RADIUS, FOOT_RADIUS, SHOE)] },
    Bone { name: "thigh_r", parent: Some(0), at: v(-0.1, 0.93, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.42, 0.0), 0.09, 0.065, CLOTH)] },
    Bone { name: "shin_r", parent: Some(14), at: v(-0.1, 0.51, 0.0), limbs: &[(v(0.0, 0.0, 0.0), v(0.0, -0.41, 0.0), 0.063, 0.045, CLOTH)] },
];
/// The right foot, kept apart so that the left one's numbers are shared.
const FOOT_R: Bone = Bone {
    name: "foot_r",
    parent: Some(15),
    at: v(-0.1, 0.09, 0.0),
    limbs: &[(FOOT.0, FOOT.1, FOOT_RADIUS, FOOT_RADIUS, SHOE)],
};
/// Heel and ball of a foot, relative to the ankle.
const FOOT: (Vec3, Vec3) = (v(0.0, -0.04, -0.05), v(0.0, -0.04, 0.15));
const FOOT_RADIUS: f32 = 0.05;
const HIPS: usize = 0;
const FOOT_L_INDEX: usize = 13;
const FOOT_R_INDEX: usize = 16;

fn bones() -> Vec<&'static Bone> {
    BONES.iter().chain([&FOOT_R]).collect()
}

/// Adds the walker to the scene: a node that follows the path, the joints below it, mesh and skin.
/// `materials` are those of trousers, shirt, skin and shoes.
pub(super) fn add(scene: &mut Scene, materials: [u32; 4], times: &[f32]) {
    let bones = bones();
    let carrier = scene.nodes.len();
    let joint = |bone: usize| carrier + 1 + bone;
    scene.nodes.push(node("walker", None, Vec3::ZERO));
    for bone in &bones {
        let above = bone.parent.map_or(Vec3::ZERO, |p| bones[p].at);
        let parent = bone.parent.map_or(carrier, joint);
        scene
            .nodes
            .push(node(bone.name, Some(parent), bone.at - above));
    }
    let mut shape = Shape::default();
    for (i, bone) in bones.iter().enumerate() {
        for (from, to, ra, rb, slot) in bone.limbs {
            let along = shape.capsule(bone.at + *from, bone.at + *to, *ra, *rb, materials[*slot]);
            let parent = bone.parent.unwrap_or(i) as u16;
            for distance in along {
                let share = (0.5 - 0.5 * distance / BLEND).clamp(0.0, 0.5);
                // Sideways limbs (hips, shoulders) and feet are rigid.
                let rigid = i == HIPS || from.x != 0.0 || *slot == SHOE;
                let share = if rigid { 0.0 } else { share };
                let (joints, weights) = two_joints(i as u16, parent, share);
                shape.mesh.joints.push(joints);
                shape.mesh.weights.push(weights);
            }
        }
    }
    scene.meshes.push(shape.finish("walker"));
    scene.skins.push(Skin {
        joints: (0..bones.len()).map(joint).collect(),
        inverse_bind: bones
            .iter()
            .map(|b| Mat4::from_translation(-b.at))
            .collect(),
    });
    scene.instances.push(Instance {
        name: "walker/body".to_owned(),
        mesh: scene.meshes.len() - 1,
        node: Some(carrier),
        skin: Some(scene.skins.len() - 1),
        ..Instance::default()
    });
    animate(scene, &bones, carrier, times);
}

fn node(name: &str, parent: Option<usize>, translation: Vec3) -> Node {
    Node {
        name: name.to_owned(),
        parent,
        translation,
        rotation: Quat::IDENTITY,
        scale: Vec3::ONE,
        matrix: None,
        morph_weights: Vec::new(),
    }
}

/// Position and heading on the ellipse after a share of its length; and that length.
struct Path {
    /// Angle of the ellipse's parameter at equal steps of length.
    angles: Vec<f32>,
    length: f32,
}

impl Path {
    fn new() -> Path {
        const FINE: usize = 4096;
        let at = |a: f32| Vec3::new(PATH.0 * a.cos(), 0.0, PATH.1 * a.sin());
        let mut lengths = vec![0.0f64];
        for i in 0..FINE {
            let (a, b) = (
                i as f32 / FINE as f32 * TAU,
                (i + 1) as f32 / FINE as f32 * TAU,
            );
            lengths.push(lengths[i] + f64::from((at(b) - at(a)).length()));
        }
        let total = lengths[FINE];
        let mut angles = Vec::with_capacity(FINE + 1);
        let mut k = 0;
        for i in 0..=FINE {
            let wanted = total * i as f64 / FINE as f64;
            while k + 1 < FINE && lengths[k + 1] < wanted {
                k += 1;
            }
            let f = (wanted - lengths[k]) / (lengths[k + 1] - lengths[k]);
            angles.push((k as f64 + f) as f32 / FINE as f32 * TAU);
        }
        Path {
            angles,
            length: total as f32,
        }
    }

    fn at(&self, share: f32) -> (Vec3, Quat) {
        let last = self.angles.len() - 1;
        let x = share.fract() * last as f32;
        let i = (x as usize).min(last - 1);
        let a = self.angles[i] + (self.angles[i + 1] - self.angles[i]) * (x - i as f32);
        let heading = Vec3::new(-PATH.0 * a.sin(), 0.0, PATH.1 * a.cos());
        (
            CENTRE + Vec3::new(PATH.0 * a.cos(), 0.0, PATH.1 * a.sin()),
            Quat::from_rotation_y(heading.x.atan2(heading.z)),
        )
    }
}

/// Rotations of all joints at a phase of the walk cycle; `swing` is the thighs' half angle.
/// Positive angles about +X swing what hangs down backwards.
fn stride(bones: &[&Bone], phase: f32, swing: f32) -> Vec<Quat> {
    let leg = |phase: f32| {
        let thigh = -swing * phase.sin() - 0.05;
        let knee = 0.12 + 0.85 * phase.cos().max(0.0).powi(2);
        (thigh, knee, -0.75 * (thigh + knee))
    };
    let (left, right) = (leg(phase), leg(phase + TAU * 0.5));
    let arm = |phase: f32| {
        (
            -0.75 * swing * phase.sin() + 0.05,
            -0.35 - 0.2 * phase.sin(),
        )
    };
    let (arm_l, arm_r) = (arm(phase + TAU * 0.5), arm(phase));
    let twist = 0.12 * phase.sin();
    bones
        .iter()
        .map(|bone| {
            let x = Quat::from_rotation_x;
            match bone.name {
                "hips" => Quat::from_rotation_y(-twist),
                "spine" => x(0.06),
                "chest" => Quat::from_rotation_y(2.0 * twist),
                "neck" => Quat::from_rotation_y(-twist),
                "upper_arm_l" => Quat::from_rotation_z(0.08) * x(arm_l.0),
                "upper_arm_r" => Quat::from_rotation_z(-0.08) * x(arm_r.0),
                "forearm_l" => x(arm_l.1),
                "forearm_r" => x(arm_r.1),
                "thigh_l" => x(left.0),
                "shin_l" => x(left.1),
                "foot_l" => x(left.2),
                "thigh_r" => x(right.0),
                "shin_r" => x(right.1),
                "foot_r" => x(right.2),
                _ => Quat::IDENTITY,
            }
        })
        .collect()
}

/// Height of the lowest sole above the floor, with the hips at their resting height.
fn sole(bones: &[&Bone], rotations: &[Quat]) -> f32 {
    let mut frames: Vec<(Quat, Vec3)> = Vec::with_capacity(bones.len());
    for (bone, rotation) in bones.iter().zip(rotations) {
        frames.push(match bone.parent {
            Some(p) => {
                let (q, at) = frames[p];
                (q * *rotation, at + q * (bone.at - bones[p].at))
            }
            None => (*rotation, bone.at),
        });
    }
    let mut lowest = f32::INFINITY;
    for (q, at) in [frames[FOOT_L_INDEX], frames[FOOT_R_INDEX]] {
        for end in [FOOT.0, FOOT.1] {
            lowest = lowest.min((at + q * end).y - FOOT_RADIUS);
        }
    }
    lowest
}

fn animate(scene: &mut Scene, bones: &[&Bone], carrier: usize, times: &[f32]) {
    let path = Path::new();
    // The feet then move back under the body as fast as the body moves on.
    let swing = (path.length / CYCLES / (4.0 * LEG)).min(0.9).asin();
    let duration = times.last().copied().unwrap_or(1.0);
    let mut carried = (Vec::new(), Vec::new());
    let mut hips = Vec::new();
    let mut turned: Vec<Vec<Quat>> = vec![Vec::new(); bones.len()];
    for time in times {
        let share = time / duration;
        let (position, heading) = path.at(share);
        carried.0.push(position);
        carried.1.push(heading);
        let rotations = stride(bones, share * CYCLES * TAU, swing);
        hips.push(bones[HIPS].at - Vec3::Y * sole(bones, &rotations));
        for (list, rotation) in turned.iter_mut().zip(rotations) {
            list.push(rotation);
        }
    }
    let mut channel = |node, values| {
        scene.channels.push(Channel {
            node,
            interpolation: Interpolation::Linear,
            times: times.to_vec(),
            values,
        });
    };
    channel(carrier, ChannelValues::Translation(carried.0));
    channel(carrier, ChannelValues::Rotation(carried.1));
    channel(carrier + 1 + HIPS, ChannelValues::Translation(hips));
    for (bone, rotations) in turned.into_iter().enumerate() {
        if rotations.iter().any(|r| *r != Quat::IDENTITY) {
            channel(carrier + 1 + bone, ChannelValues::Rotation(rotations));
        }
    }
}
