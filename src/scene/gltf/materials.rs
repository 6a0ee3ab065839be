//! Metallic-roughness materials.
//!
//! Base colour and normal textures are kept. Emissive and metallic-roughness textures enter by
//! their mean: light of low frequency does not see more of them.

use super::{Document, Read, clean_name, finite, images};
use crate::scene::texture::srgb_to_linear;
use crate::scene::{Alpha, Material, Scene, Texture};
use ::gltf::json;
use glam::{Vec3, Vec4};
use json::material::AlphaMode;
use json::validation::Checked;

/// Fills `scene.materials` and `scene.textures`. One default material follows the file's own, for
/// primitives that name none.
pub(super) fn read(document: &Document, scene: &mut Scene) -> Read<()> {
    let root = &document.root;
    // glTF texture -> scene texture, decoded once.
    let mut known: Vec<Option<Option<usize>>> = vec![None; root.textures.len()];
    let mut kept = |scene: &mut Scene, index: json::Index<json::Texture>| {
        if let Some(Some(done)) = known.get(index.value()) {
            return Read::Ok(*done);
        }
        let made = match images::texture(document, index)? {
            Some(texture) => {
                scene.textures.push(texture);
                Some(scene.textures.len() - 1)
            }
            None => {
                let text = format!("texture {} has no PNG or JPEG image", index.value());
                scene.warnings.push(text);
                None
            }
        };
        known[index.value()] = Some(made);
        Ok(made)
    };
    for (i, source) in root.materials.iter().enumerate() {
        let name = clean_name(source.name.as_ref(), "material", i);
        let pbr = &source.pbr_metallic_roughness;
        let mut material = Material {
            base_color: Vec4::from(pbr.base_color_factor.0),
            roughness: pbr.roughness_factor.0,
            metallic: pbr.metallic_factor.0,
            emissive: Vec3::from(source.emissive_factor.0),
            double_sided: source.double_sided,
            ..Material::default()
        };
        if let Some(info) = &pbr.base_color_texture {
            material.base_color_texture = kept(scene, info.index)?;
        }
        if let Some(info) = &source.normal_texture {
            material.normal_texture = kept(scene, info.index)?;
            material.normal_scale = info.scale;
        }
        if let Some(info) = &pbr.metallic_roughness_texture
            && let Some(texture) = images::texture(document, info.index)?
        {
            let mean = mean(&texture, |v| f32::from(v) / 255.0);
            material.roughness *= mean.y;
            material.metallic *= mean.z;
        }
        if let Some(info) = &source.emissive_texture
            && material.emissive != Vec3::ZERO
            && let Some(texture) = images::texture(document, info.index)?
        {
            material.emissive *= mean(&texture, srgb_to_linear);
        }
        if let Some(strength) = source
            .extensions
            .as_ref()
            .and_then(|e| e.emissive_strength.as_ref())
        {
            material.emissive *= strength.emissive_strength.0;
        }
        material.alpha = match &source.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => Alpha::Opaque,
            Checked::Valid(AlphaMode::Mask) => Alpha::Mask {
                cutoff: source.alpha_cutoff.map_or(0.5, |c| c.0),
            },
            Checked::Valid(AlphaMode::Blend) => Alpha::Blend,
            Checked::Invalid => return Err(format!("material {name} has an unknown alpha mode")),
        };
        let cutoff = match material.alpha {
            Alpha::Mask { cutoff } => cutoff,
            _ => 0.0,
        };
        finite(
            &material.base_color.to_array(),
            &format!("a base colour of material {name}"),
        )?;
        finite(
            &material.emissive.to_array(),
            &format!("an emission of material {name}"),
        )?;
        finite(
            &[
                material.roughness,
                material.metallic,
                material.normal_scale,
                cutoff,
            ],
            &format!("a factor of material {name}"),
        )?;
        material.name = name;
        scene.materials.push(material);
    }
    scene.materials.push(Material {
        name: "default".to_owned(),
        ..Material::default()
    });
    Ok(())
}

fn mean(texture: &Texture, decode: impl Fn(u8) -> f32) -> Vec3 {
    let mut sum = [0.0f64; 3];
    for texel in &texture.texels {
        for (sum, value) in sum.iter_mut().zip(texel) {
            *sum += f64::from(decode(*value));
        }
    }
    let count = texture.texels.len().max(1) as f64;
    Vec3::from(sum.map(|s| (s / count) as f32))
}

/// How a primitive's texture coordinates are found: the set, and the transform of
/// `KHR_texture_transform` that is applied to them when they are loaded.
pub(super) struct UvSource {
    pub set: u32,
    /// Offset, rotation (radians), scale.
    pub transform: Option<([f32; 2], f32, [f32; 2])>,
}

/// The coordinates of a material's base colour texture, or else of its normal texture.
pub(super) fn uv_source(document: &Document, material: Option<usize>) -> UvSource {
    let source = material.and_then(|m| document.root.materials.get(m));
    let base = source.and_then(|m| m.pbr_metallic_roughness.base_color_texture.as_ref());
    let set = match (base, source.and_then(|m| m.normal_texture.as_ref())) {
        (Some(info), _) => info.tex_coord,
        (None, Some(info)) => info.tex_coord,
        (None, None) => 0,
    };
    let transform = base
        .and_then(|info| info.extensions.as_ref())
        .and_then(|e| e.texture_transform.as_ref());
    UvSource {
        set: transform.and_then(|t| t.tex_coord).unwrap_or(set),
        transform: transform.map(|t| (t.offset.0, t.rotation.0, t.scale.0)),
    }
}
