//! The scene at a time: node transforms, skinning and morphing.

use super::animation::Sample;
use super::derived::{self, Derived, JointChain};
use super::{CameraPose, ChannelValues, Deformed, LightPose, Mesh, Node, Pose, Scene};
use glam::{Affine3A, DAffine3, DVec3, Mat3A, Mat4, Quat, Vec3, Vec3A};
use rayon::prelude::*;

/// Most times that are looked at to find where instances are largest.
const MAX_SCALE_KEYS: usize = 1024;

/// The local state of all nodes, as animation leaves it.
struct Locals {
    from_local: Vec<Affine3A>,
    /// Morph weights of nodes whose weights a channel drives.
    weights: Vec<Option<Vec<f32>>>,
}

impl Node {
    /// Parent from local at rest.
    pub fn local(&self) -> Affine3A {
        match self.matrix {
            Some(m) => affine(&m),
            None => Affine3A::from_scale_rotation_translation(
                self.scale,
                self.rotation,
                self.translation,
            ),
        }
    }
}

/// The affine part of a matrix whose last row is (0, 0, 0, 1).
pub(super) fn affine(m: &Mat4) -> Affine3A {
    Affine3A::from_mat4(*m)
}

/// The matrix that takes normals where `m` takes points, up to length: the inverse transpose by way
/// of cofactors, which also serves singular matrices. Mirroring included.
pub fn normal_matrix(m: &Mat3A) -> Mat3A {
    let cofactors = Mat3A::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    if m.determinant() < 0.0 {
        -cofactors
    } else {
        cofactors
    }
}

impl Scene {
    /// Evaluates everything that moves at `time` seconds. Playback loops at [`Scene::duration`];
    /// before its first key and after its last a channel holds.
    pub fn pose(&self, time: f64) -> Pose {
        let mut pose = Pose::default();
        self.pose_into(time, &mut pose);
        pose
    }

    /// The scene at rest: no animation applied, nodes and morph weights as the file states them.
    pub fn rest_pose(&self) -> Pose {
        let mut pose = Pose::default();
        self.evaluate(None, &mut pose);
        pose
    }

    /// [`Scene::pose`] into a pose that is used again, so that its buffers are.
    pub fn pose_into(&self, time: f64, pose: &mut Pose) {
        let duration = f64::from(self.duration);
        let wrapped = if duration > 0.0 && time.is_finite() {
            time.rem_euclid(duration)
        } else {
            0.0
        };
        self.evaluate(Some(wrapped), pose);
        pose.time = time;
    }

    fn evaluate(&self, time: Option<f64>, pose: &mut Pose) {
        pose.time = 0.0;
        let derived = self.derived();
        let locals = self.locals(time);
        let world = self.worlds(&locals);
        self.place_meshes(&world, &mut pose.world_from_mesh);
        let placed = |node: Option<usize>, below: &Affine3A| -> Affine3A {
            (self.world_of(&world, node) * below.as_daffine3()).as_affine3a()
        };
        pose.cameras.clear();
        pose.cameras.extend(self.cameras.iter().map(|c| CameraPose {
            world_from_camera: rigid(&match c.node {
                Some(_) => placed(c.node, &Affine3A::IDENTITY),
                None => placed(None, &c.world_from_camera),
            }),
            yfov: c.yfov,
            znear: c.znear,
        }));
        pose.lights.clear();
        pose.lights.extend(self.lights.iter().map(|l| {
            let frame = placed(l.node, &Affine3A::IDENTITY);
            LightPose {
                position: frame.translation.into(),
                direction: Vec3::from(-frame.matrix3.z_axis)
                    .try_normalize()
                    .unwrap_or(Vec3::NEG_Y),
                kind: l.kind,
                intensity: l.intensity,
                range: l.range,
            }
        }));
        self.deform(derived, &locals, pose);
    }

    /// World from each node, world space counting from [`Scene::origin`].
    fn worlds(&self, locals: &Locals) -> Vec<DAffine3> {
        let mut world: Vec<DAffine3> = Vec::with_capacity(self.nodes.len());
        for (node, local) in self.nodes.iter().zip(&locals.from_local) {
            world.push(self.world_of(&world, node.parent) * local.as_daffine3());
        }
        world
    }

    fn world_of(&self, world: &[DAffine3], node: Option<usize>) -> DAffine3 {
        match node {
            Some(node) => world[node],
            None => DAffine3::from_translation(-self.origin),
        }
    }

    fn place_meshes(&self, world: &[DAffine3], out: &mut Vec<Affine3A>) {
        out.clear();
        out.extend(self.instances.iter().map(|i| {
            let frame = self.world_of(world, i.node) * i.offset.as_daffine3();
            let origin = self.meshes[i.mesh].origin.as_dvec3();
            // Skinned vertices are carried there by their joints.
            let moved = i.skin.is_none() && origin != DVec3::ZERO;
            let frame = match moved {
                true => frame * DAffine3::from_translation(origin),
                false => frame,
            };
            frame.as_affine3a()
        }));
    }

    /// World from mesh of each instance where it is largest within `span` seconds from `time` on:
    /// at one of the keys of the animated scales, or at the start. The length of the columns counts.
    pub fn largest_placement(&self, time: f64, span: f64) -> Vec<Affine3A> {
        let mut largest = self.pose(time).world_from_mesh;
        let size = |m: &Affine3A| {
            let m = m.matrix3;
            m.x_axis.length_squared() + m.y_axis.length_squared() + m.z_axis.length_squared()
        };
        let mut placed = Vec::new();
        for key in self.scale_keys(time, span) {
            let world = self.worlds(&self.locals(Some(key)));
            self.place_meshes(&world, &mut placed);
            for (largest, placed) in largest.iter_mut().zip(&placed) {
                if size(placed) > size(largest) * (1.0 + 1e-4) {
                    *largest = *placed;
                }
            }
        }
        largest
    }

    /// Times within the animation at which an animated scale has a key, and the end of the span; at
    /// most [`MAX_SCALE_KEYS`].
    fn scale_keys(&self, time: f64, span: f64) -> Vec<f64> {
        let duration = f64::from(self.duration);
        let scales = self.channels.iter().filter_map(|c| match &c.values {
            ChannelValues::Scale(values) => Some((&c.times, values)),
            _ => None,
        });
        // Exporters write scales that never change.
        let changing = scales.filter(|(_, values)| {
            let still = |v: &Vec3| v.abs_diff_eq(values[0], 1e-4 * values[0].abs().max_element());
            !values.iter().all(still)
        });
        let mut keys: Vec<f64> = changing
            .flat_map(|(times, _)| times.iter().map(|t| f64::from(*t)))
            .collect();
        if keys.is_empty() || duration <= 0.0 {
            return Vec::new();
        }
        keys.retain(|key| {
            let inside = (0.0..=duration).contains(key);
            // The last key is shown at the animation's end, not when it starts again.
            let after = key - time.rem_euclid(duration);
            let after = if after < 0.0 { after + duration } else { after };
            inside && (span >= duration || after <= span)
        });
        if span < duration {
            keys.push((time + span).rem_euclid(duration));
        }
        keys.sort_unstable_by(f64::total_cmp);
        keys.dedup();
        let step = keys.len().div_ceil(MAX_SCALE_KEYS).max(1);
        keys.into_iter().step_by(step).collect()
    }

    fn locals(&self, time: Option<f64>) -> Locals {
        let mut locals = Locals {
            from_local: Vec::new(),
            weights: vec![None; self.nodes.len()],
        };
        let Some(time) = time else {
            locals.from_local = self.nodes.iter().map(Node::local).collect();
            return locals;
        };
        let mut trs: Vec<Option<(Vec3, Quat, Vec3)>> = vec![None; self.nodes.len()];
        let mut weights = Vec::new();
        for channel in &self.channels {
            let node = &self.nodes[channel.node];
            let Some(sample) = channel.sample(time, &mut weights) else {
                continue;
            };
            let slot =
                trs[channel.node].get_or_insert((node.translation, node.rotation, node.scale));
            match sample {
                Sample::Translation(t) => slot.0 = t,
                Sample::Rotation(r) => slot.1 = r,
                Sample::Scale(s) => slot.2 = s,
                Sample::MorphWeights => locals.weights[channel.node] = Some(weights.clone()),
            }
        }
        locals.from_local = self
            .nodes
            .iter()
            .zip(&trs)
            .map(|(node, trs)| match trs {
                Some((t, r, s)) if node.matrix.is_none() => {
                    Affine3A::from_scale_rotation_translation(*s, *r, *t)
                }
                _ => node.local(),
            })
            .collect();
        locals
    }

    /// Fills `pose.deformed`. Instances are independent, so threads cannot change the result.
    fn deform(&self, derived: &Derived, locals: &Locals, pose: &mut Pose) {
        pose.deformed.resize(self.instances.len(), None);
        pose.deformed
            .par_iter_mut()
            .enumerate()
            .filter(|(i, out)| derived.deforms[*i] || out.is_some())
            .for_each(|(i, out)| {
                if !derived.deforms[i] {
                    *out = None;
                    return;
                }
                let instance = &self.instances[i];
                let mesh = &self.meshes[instance.mesh];
                let out = out.get_or_insert_default();
                let node = instance.morph_node.or(instance.node);
                let weights = match node.and_then(|n| locals.weights[n].as_deref()) {
                    Some(weights) => weights,
                    None => derived::morph_weights(self, instance.mesh, node),
                };
                morph(mesh, weights, out);
                if let (Some(skin), Some(chain)) = (instance.skin, &derived.chains[i]) {
                    let skin = &self.skins[skin];
                    let palette = joint_matrices(chain, &skin.inverse_bind, locals, mesh.origin);
                    skin_vertices(mesh, &palette, out);
                }
            });
    }
}

/// Keeps rotation and translation of a camera's transform.
fn rigid(m: &Affine3A) -> Affine3A {
    let forward = m.matrix3.z_axis.try_normalize().unwrap_or(Vec3A::Z);
    let side = m.matrix3.y_axis.cross(forward);
    let side = side
        .try_normalize()
        .unwrap_or_else(|| forward.any_orthonormal_vector());
    let up = forward.cross(side);
    Affine3A::from_mat3_translation(
        glam::Mat3::from_cols(side.into(), up.into(), forward.into()),
        m.translation.into(),
    )
}

/// Base vertices plus weighted displacements (glTF 2.0, section 3.7.2.2).
fn morph(mesh: &Mesh, weights: &[f32], out: &mut Deformed) {
    out.positions.clone_from(&mesh.positions);
    out.normals.clone_from(&mesh.normals);
    out.tangents.clear();
    out.tangents
        .extend(mesh.tangents.iter().map(|t| t.truncate()));
    let mut normals_moved = false;
    for (target, weight) in mesh.morph_targets.iter().zip(weights) {
        if *weight == 0.0 {
            continue;
        }
        for (p, d) in out.positions.iter_mut().zip(&target.positions) {
            *p += *d * *weight;
        }
        for (n, d) in out.normals.iter_mut().zip(&target.normals) {
            *n += *d * *weight;
        }
        normals_moved |= !target.normals.is_empty();
    }
    if normals_moved {
        for (n, rest) in out.normals.iter_mut().zip(&mesh.normals) {
            *n = n.try_normalize().unwrap_or(*rest);
        }
    }
}

/// Joint matrices in the space of the skin's frame. Only the chain below the frame enters, so that
/// a figure that is carried along keeps its vertices bit for bit.
/// `origin` is that of the mesh.
fn joint_matrices(
    chain: &JointChain,
    inverse_bind: &[Mat4],
    locals: &Locals,
    origin: Vec3,
) -> Vec<Affine3A> {
    let mut frame_from: Vec<Affine3A> = Vec::with_capacity(chain.nodes.len());
    for (node, parent) in &chain.nodes {
        let local = locals.from_local[*node];
        frame_from.push(match parent {
            Some(parent) => frame_from[*parent] * local,
            None => local,
        });
    }
    chain
        .joints
        .iter()
        .enumerate()
        .map(|(i, at)| match inverse_bind.get(i) {
            Some(bind) => frame_from[*at] * affine(bind),
            None => frame_from[*at],
        })
        .map(|joint| match origin {
            Vec3::ZERO => joint,
            _ => {
                (joint.as_daffine3() * DAffine3::from_translation(origin.as_dvec3())).as_affine3a()
            }
        })
        .collect()
}

/// Linear blend skinning of what [`morph`] left in `out`.
fn skin_vertices(mesh: &Mesh, palette: &[Affine3A], out: &mut Deformed) {
    let vertices = mesh.joints.iter().zip(&mesh.weights).enumerate();
    for (v, (joints, weights)) in vertices {
        let mut linear = Mat3A::ZERO;
        let mut translation = Vec3A::ZERO;
        for (joint, weight) in joints.iter().zip(weights.to_array()) {
            if weight != 0.0 {
                let m = &palette[usize::from(*joint)];
                linear += m.matrix3 * weight;
                translation += m.translation * weight;
            }
        }
        let to_vec3 = |v: Vec3A| Vec3::from(v);
        out.positions[v] = to_vec3(linear * Vec3A::from(out.positions[v]) + translation);
        let normal = normal_matrix(&linear) * Vec3A::from(out.normals[v]);
        // A collapsed joint leaves no direction: the resting normal is as good as any.
        if let Some(n) = normal.try_normalize() {
            out.normals[v] = to_vec3(n);
        }
        if let Some(tangent) = out.tangents.get_mut(v)
            && let Some(t) = (linear * Vec3A::from(*tangent)).try_normalize()
        {
            *tangent = to_vec3(t);
        }
    }
}
