//! Holes in alpha-masked triangles.

use crate::scene::{Alpha, Scene, Texture, Wrap};
use glam::Vec2;

/// Whether a MASK material has a hole at barycentrics `u`, `v` (weights of the second and third
/// vertex) of a triangle: the texture's nearest texel, times the base colour's alpha, is below the
/// cutoff (glTF 2.0, 3.9.4).
pub fn is_hole(scene: &Scene, mesh: usize, triangle: u32, u: f32, v: f32) -> bool {
    let hole = || {
        let mesh = scene.meshes.get(mesh)?;
        let material = scene
            .materials
            .get(*mesh.materials.get(triangle as usize)? as usize)?;
        let Alpha::Mask { cutoff } = material.alpha else {
            return None;
        };
        let mut alpha = material.base_color.w;
        if let Some(texture) = material
            .base_color_texture
            .and_then(|t| scene.textures.get(t))
        {
            let [a, b, c] = mesh
                .triangles
                .get(triangle as usize)?
                .map(|i| mesh.uvs.get(i as usize).copied());
            let uv = a? * (1.0 - u - v) + b? * u + c? * v;
            alpha *= texel_alpha(texture, uv)?;
        }
        Some(alpha < cutoff)
    };
    hole().unwrap_or(false)
}

fn texel_alpha(texture: &Texture, uv: Vec2) -> Option<f32> {
    let x = texel(uv.x, texture.width, texture.wrap_s);
    let y = texel(uv.y, texture.height, texture.wrap_t);
    let texel = texture
        .texels
        .get(y as usize * texture.width as usize + x as usize)?;
    Some(f32::from(texel[3]) / 255.0)
}

fn texel(coordinate: f32, size: u32, wrap: Wrap) -> u32 {
    let wrapped = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Mirror => 1.0 - ((0.5 * coordinate - (0.5 * coordinate).floor()) * 2.0 - 1.0).abs(),
        Wrap::Clamp => coordinate.clamp(0.0, 1.0),
    };
    ((wrapped * size as f32) as u32).min(size.saturating_sub(1))
}
