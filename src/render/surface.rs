//! Attributes at a place on a triangle: position, normal with its map, base colour.

use crate::scene::{Deformed, Material, Mesh, Scene, Texture, Wrap};
use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec4};

/// The three corners of a triangle in mesh space, of the mesh itself or of posed vertices.
pub struct Corners {
    pub positions: [Vec3; 3],
    normals: [Vec3; 3],
    /// xyz and handedness, where the mesh has them.
    tangents: Option<[Vec4; 3]>,
}

impl Corners {
    pub fn new(mesh: &Mesh, deformed: Option<&Deformed>, corners: [u32; 3]) -> Self {
        let corners = corners.map(|i| i as usize);
        let (positions, normals) = match deformed {
            Some(d) => (&d.positions, &d.normals),
            None => (&mesh.positions, &mesh.normals),
        };
        let posed = deformed.map(|d| &d.tangents).filter(|t| !t.is_empty());
        let tangents = (!mesh.tangents.is_empty()).then(|| {
            corners.map(|i| match posed {
                Some(tangents) => tangents[i].extend(mesh.tangents[i].w),
                None => mesh.tangents[i],
            })
        });
        Self {
            positions: corners.map(|i| positions[i]),
            normals: corners.map(|i| normals[i]),
            tangents,
        }
    }

    pub fn position(&self, w: Vec3) -> Vec3 {
        mix(self.positions, w)
    }
}

fn mix(v: [Vec3; 3], w: Vec3) -> Vec3 {
    v[0] * w.x + v[1] * w.y + v[2] * w.z
}

/// Weights of the corners where the line meets the triangle's plane, clamped to the triangle: a
/// rasterised pixel centre can lie a rounding error outside of it.
pub fn barycentrics(origin: Vec3, direction: Vec3, a: Vec3, b: Vec3, c: Vec3) -> Vec3 {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return Vec3::splat(1.0 / 3.0);
    }
    let s = origin - a;
    let v = s.dot(p) / determinant;
    let w = direction.dot(s.cross(e1)) / determinant;
    let weights = Vec3::new(1.0 - v - w, v, w).max(Vec3::ZERO);
    weights / weights.element_sum()
}

/// Texture coordinates, or zero where the mesh has none.
pub fn uv(mesh: &Mesh, corners: [u32; 3], w: Vec3) -> Vec2 {
    if mesh.uvs.is_empty() {
        return Vec2::ZERO;
    }
    let [a, b, c] = corners.map(|i| mesh.uvs[i as usize]);
    a * w.x + b * w.y + c * w.z
}

/// The normal map's direction in tangent space; `None` without a map.
pub fn normal_map(scene: &Scene, material: &Material, uv: Vec2) -> Option<Vec3> {
    let texture = &scene.textures[material.normal_texture?];
    let n = texel(texture, uv, |t| linear8(t)).truncate() * 2.0 - 1.0;
    Some(n * Vec3::new(material.normal_scale, material.normal_scale, 1.0))
}

/// Unit normal in mesh space, with the normal map's direction applied.
pub fn normal(corners: &Corners, w: Vec3, bump: Option<Vec3>) -> Vec3 {
    let smooth = mix(corners.normals, w);
    let [a, b, c] = corners.positions;
    let smooth = smooth
        .try_normalize()
        .unwrap_or_else(|| (b - a).cross(c - a).normalize_or_zero());
    let (Some(bump), Some(t)) = (bump, corners.tangents) else {
        return smooth;
    };
    let tangent = mix(t.map(Vec4::truncate), w);
    let bitangent = smooth.cross(tangent) * t[0].w;
    (tangent * bump.x + bitangent * bump.y + smooth * bump.z).normalize_or(smooth)
}

/// A normal where `m` takes points, not normalised: the inverse transpose by way of cofactors.
/// Mirroring keeps outside out.
pub fn transform_normal(m: &Affine3A, normal: Vec3) -> Vec3 {
    let m = &m.matrix3;
    let cofactors = Mat3A::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    cofactors * normal * m.determinant().signum()
}

/// Linear base colour and alpha.
pub fn base_color(scene: &Scene, material: &Material, uv: Vec2) -> Vec4 {
    match material
        .base_color_texture
        .and_then(|i| scene.textures.get(i))
    {
        Some(texture) => material.base_color * texel(texture, uv, |t| srgb8(t)),
        None => material.base_color,
    }
}

/// Bilinear lookup in the space that `decode` gives.
fn texel(texture: &Texture, uv: Vec2, decode: impl Fn([u8; 4]) -> Vec4) -> Vec4 {
    let size = Vec2::new(texture.width as f32, texture.height as f32);
    let p = uv * size - 0.5;
    let base = p.floor();
    let f = p - base;
    let fetch = |dx: f32, dy: f32| {
        let x = wrap(base.x + dx, texture.width, texture.wrap_s);
        let y = wrap(base.y + dy, texture.height, texture.wrap_t);
        let texel = texture.texels.get(y * texture.width as usize + x);
        decode(texel.copied().unwrap_or([255; 4]))
    };
    let top = fetch(0.0, 0.0).lerp(fetch(1.0, 0.0), f.x);
    let bottom = fetch(0.0, 1.0).lerp(fetch(1.0, 1.0), f.x);
    top.lerp(bottom, f.y)
}

fn wrap(i: f32, size: u32, mode: Wrap) -> usize {
    let n = i64::from(size.max(1));
    let i = i as i64;
    let i = match mode {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => {
            let i = i.rem_euclid(2 * n);
            if i < n { i } else { 2 * n - 1 - i }
        }
    };
    i as usize
}

fn linear8(t: [u8; 4]) -> Vec4 {
    Vec4::from(t.map(f32::from)) / 255.0
}

fn srgb8(t: [u8; 4]) -> Vec4 {
    let [r, g, b, a] = t;
    let c = [r, g, b].map(super::image::linear_from_srgb8);
    Vec4::new(c[0], c[1], c[2], f32::from(a) / 255.0)
}
