//! Repairs and completes mesh data at load: degenerate triangles, missing normals, tangents.

use super::{Mesh, MorphTarget, TextureRef};
use glam::{Vec2, Vec3, Vec4};

/// A triangle is degenerate when its doubled area is below this share of its longest edge squared:
/// single-precision corners cannot tell its normal from noise.
const DEGENERATE: f32 = 1e-7;

fn is_degenerate([a, b, c]: [Vec3; 3]) -> bool {
    // Scaled to its longest edge, so that tiny triangles do not underflow.
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let longest = ab.abs().max(bc.abs()).max(ca.abs()).max_element();
    if longest <= 0.0 || !longest.is_finite() {
        return true;
    }
    let (ab, bc, ca) = (ab / longest, bc / longest, ca / longest);
    let edge = ab
        .length_squared()
        .max(bc.length_squared())
        .max(ca.length_squared());
    ab.cross(ca).length() <= DEGENERATE * edge
}

/// Drops triangles without area. A triangle that a morph target opens stays.
pub(super) fn drop_degenerate(mesh: &mut Mesh) {
    let Mesh {
        positions,
        morph_targets,
        triangles,
        ..
    } = mesh;
    triangles.retain(|t| {
        let corners = t.map(|v| positions[v as usize]);
        if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
            return false;
        }
        let opened = |target: &MorphTarget| {
            let moved = [0, 1, 2].map(|i| corners[i] + target.positions[t[i] as usize]);
            !is_degenerate(moved)
        };
        !is_degenerate(corners) || morph_targets.iter().any(opened)
    });
}

/// Drops vertices that no triangle uses; the others keep their order.
pub(super) fn compact(mesh: &mut Mesh) {
    let mut used = vec![false; mesh.positions.len()];
    for v in mesh.triangles.iter().flatten() {
        used[*v as usize] = true;
    }
    if used.iter().all(|u| *u) {
        return;
    }
    let keep: Vec<u32> = (0..used.len() as u32)
        .filter(|v| used[*v as usize])
        .collect();
    let mut new_of = vec![0; used.len()];
    for (new, old) in keep.iter().enumerate() {
        new_of[*old as usize] = new as u32;
    }
    for v in mesh.triangles.iter_mut().flatten() {
        *v = new_of[*v as usize];
    }
    pick(mesh, &keep);
}

/// Rebuilds every vertex array from the named old vertices.
fn pick(mesh: &mut Mesh, from: &[u32]) {
    fn gather<T: Copy>(values: &mut Vec<T>, from: &[u32]) {
        if !values.is_empty() {
            *values = from.iter().map(|v| values[*v as usize]).collect();
        }
    }
    gather(&mut mesh.positions, from);
    gather(&mut mesh.file_vertices, from);
    gather(&mut mesh.normals, from);
    for set in &mut mesh.uvs {
        gather(set, from);
    }
    gather(&mut mesh.colors, from);
    gather(&mut mesh.tangents, from);
    gather(&mut mesh.joints, from);
    gather(&mut mesh.weights, from);
    for target in &mut mesh.morph_targets {
        gather(&mut target.positions, from);
        gather(&mut target.normals, from);
    }
    if from.is_empty() {
        let triangles = std::mem::take(&mut mesh.triangles);
        let dropped_triangles = mesh.dropped_triangles;
        *mesh = Mesh {
            triangles,
            dropped_triangles,
            ..Mesh::default()
        };
    }
}

/// Gives a mesh without normals flat ones, as glTF 2.0 (section 3.7.2.1) asks; vertices are split.
pub(super) fn make_flat(mesh: &mut Mesh) {
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    pick(mesh, &corners);
    for (i, t) in mesh.triangles.iter_mut().enumerate() {
        let first = i as u32 * 3;
        *t = [first, first + 1, first + 2];
    }
    mesh.normals = Vec::with_capacity(corners.len());
    for corners in mesh.positions.chunks_exact(3) {
        let normal = unit_cross(corners[1] - corners[0], corners[2] - corners[0]);
        mesh.normals.extend([normal.unwrap_or(Vec3::Y); 3]);
    }
}

/// Brings normals to unit length; one of no length is replaced by the mean of its faces.
pub(super) fn repair(mesh: &mut Mesh) {
    let mut faces: Option<Vec<Vec3>> = None;
    for v in 0..mesh.normals.len() {
        let normal = mesh.normals[v];
        // Tiny but sound normals would underflow when squared.
        let largest = normal.abs().max_element();
        if largest > 0.0
            && let Some(n) = (normal / largest).try_normalize()
        {
            mesh.normals[v] = n;
            continue;
        }
        let faces = faces.get_or_insert_with(|| face_normals(&mesh.positions, &mesh.triangles));
        mesh.normals[v] = faces[v];
    }
}

/// Area-weighted normals of the faces about each vertex.
pub(super) fn face_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let cross = (b - a).cross(c - a);
        for v in t {
            sums[*v as usize] += cross;
        }
    }
    sums.iter()
        .map(|s| s.try_normalize().unwrap_or(Vec3::Y))
        .collect()
}

fn unit_cross(a: Vec3, b: Vec3) -> Option<Vec3> {
    let scale = a.abs().max(b.abs()).max_element();
    if scale <= 0.0 {
        return None;
    }
    (a / scale).cross(b / scale).try_normalize()
}

/// Tangents for a normal map, from the coordinates that it is read by; none if the mesh lacks these.
///
/// A tangent is the direction of growing u on the faces about a vertex, made orthogonal to its normal. Handedness is that of the majority of the area; vertices on a seam of
/// a mirrored mapping are not split (MikkTSpace would), which tilts normals along the seam only.
pub(super) fn generate_tangents(mesh: &mut Mesh, texture: &TextureRef) {
    let mut along_u = vec![Vec3::ZERO; mesh.positions.len()];
    let mut handed = vec![0.0f32; mesh.positions.len()];
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [p0, p1, p2] = t.map(|v| mesh.positions[v as usize]);
        let Some([w0, w1, w2]) = mesh.corner_uvs(texture, i) else {
            return;
        };
        let (e1, e2): (Vec3, Vec3) = (p1 - p0, p2 - p0);
        let (d1, d2): (Vec2, Vec2) = (w1 - w0, w2 - w0);
        let det = d1.perp_dot(d2);
        let Some(direction) = ((e1 * d2.y - e2 * d1.y) * det.signum()).try_normalize() else {
            continue;
        };
        let area = e1.cross(e2).length();
        for v in t {
            along_u[*v as usize] += direction * area;
            // Normal maps have +Y up while v grows downwards: the bitangent is along falling v.
            handed[*v as usize] -= det.signum() * area;
        }
    }
    mesh.tangents = (0..mesh.positions.len())
        .map(|v| {
            let normal = mesh.normals[v];
            let tangent = (along_u[v] - normal * normal.dot(along_u[v]))
                .try_normalize()
                .unwrap_or_else(|| normal.any_orthonormal_vector());
            Vec4::from((tangent, if handed[v] < 0.0 { -1.0 } else { 1.0 }))
        })
        .collect();
}
