//! Materials: metallic-roughness factors and textures, and where each texture is read.

use super::{Document, Read, clean_name, finite, images};
use crate::scene::{Alpha, Material, Scene, SpecularGlossiness, TextureRef};
use ::gltf::json;
use glam::{Affine2, Mat2, Vec2, Vec3, Vec4};
use json::extensions::texture::TextureTransform;
use json::material::AlphaMode;
use json::validation::Checked;

/// Sets of texture coordinates that a mesh may keep.
const MAX_UV_SETS: u32 = 16;

/// The textures that materials name, each decoded when it is first named.
struct Textures<'d> {
    document: &'d Document<'d>,
    /// glTF texture -> scene texture; the inner `None` is one without a usable image.
    known: Vec<Option<Option<usize>>>,
}

impl Textures<'_> {
    fn index(&mut self, scene: &mut Scene, index: json::Index<json::Texture>) -> Option<usize> {
        if let Some(Some(done)) = self.known.get(index.value()) {
            return *done;
        }
        let made = images::texture(self.document, index).map(|texture| {
            scene.textures.push(texture);
            images::fit(self.document, scene);
            scene.textures.len() - 1
        });
        if let Some(known) = self.known.get_mut(index.value()) {
            *known = Some(made);
        }
        made
    }
    /// A texture, the set of coordinates it is read by, and their transform, whose own set goes
    /// first. `what` names it in warnings.
    fn reference(
        &mut self,
        scene: &mut Scene,
        index: json::Index<json::Texture>,
        set: u32,
        transform: Option<&TextureTransform>,
        what: &str,
    ) -> Option<TextureRef> {
        let set = transform.and_then(|t| t.tex_coord).unwrap_or(set);
        let transform = transform.map_or(Affine2::IDENTITY, affine);
        if set >= MAX_UV_SETS || !transform.is_finite() {
            scene.warnings.push(format!(
                "{what} is left out: its texture coordinates are out of bounds (set {set}, \
                 {MAX_UV_SETS} sets are read)"
            ));
            return None;
        }
        self.index(scene, index).map(|texture| TextureRef {
            texture,
            set: set as usize,
            transform,
        })
    }

    fn of(
        &mut self,
        scene: &mut Scene,
        info: &json::texture::Info,
        what: &str,
    ) -> Option<TextureRef> {
        let extensions = info.extensions.as_ref();
        let transform = extensions.and_then(|e| e.texture_transform.as_ref());
        self.reference(scene, info.index, info.tex_coord, transform, what)
    }

    /// [`Textures::of`] a texture that is needed; of another, only warns if it cannot be found.
    fn of_if(
        &mut self,
        is_needed: bool,
        scene: &mut Scene,
        info: &json::texture::Info,
        what: &str,
    ) -> Option<TextureRef> {
        if is_needed {
            return self.of(scene, info, what);
        }
        images::check(self.document, info.index);
        None
    }
}

/// `KHR_texture_transform` as a map of coordinates: translation * rotation * scale.
fn affine(transform: &TextureTransform) -> Affine2 {
    let (sin, cos) = transform.rotation.0.sin_cos();
    let [x, y] = transform.scale.0;
    Affine2 {
        matrix2: Mat2::from_cols(Vec2::new(cos, -sin) * x, Vec2::new(sin, cos) * y),
        translation: transform.offset.0.into(),
    }
}

/// Fills `scene.materials` and `scene.textures`. One default material follows the file's own, for
/// primitives that name none.
pub(super) fn read(document: &Document, scene: &mut Scene) {
    let root = &document.root;
    let mut textures = Textures {
        document,
        known: vec![None; root.textures.len()],
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
        let has_holes = source.alpha_mode != Checked::Valid(AlphaMode::Opaque);
        let colors = document.options.colors;
        if let Some(info) = &pbr.base_color_texture {
            let what = format!("the base colour texture of material {name}");
            material.base_color_texture = textures.of_if(colors || has_holes, scene, info, &what);
        }
        if let Some(info) = &pbr.metallic_roughness_texture {
            let what = format!("the metallic-roughness texture of material {name}");
            material.metallic_roughness_texture = textures.of_if(colors, scene, info, &what);
        }
        if let Some(info) = &source.normal_texture {
            let what = format!("the normal texture of material {name}");
            // The crate has no type for the extension here.
            let extension = info.extensions.as_ref();
            let extension = extension.and_then(|e| e.others.get("KHR_texture_transform"));
            let transform: Option<TextureTransform> =
                extension.and_then(|e| json::deserialize::from_value(e.clone()).ok());
            material.normal_texture =
                textures.reference(scene, info.index, info.tex_coord, transform.as_ref(), &what);
            material.normal_scale = info.scale;
        }
        if let Some(info) = &source.emissive_texture
            && material.emissive != Vec3::ZERO
        {
            let what = format!("the emissive texture of material {name}");
            material.emissive_texture = textures.of_if(colors, scene, info, &what);
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
            Checked::Invalid => {
                let text = format!("material {name} has an unknown alpha mode; it is opaque");
                scene.warnings.push(text);
                Alpha::Opaque
            }
        };
        let extended = read_extensions(source, &mut textures, scene, &mut material, &name);
        document.optional(extended);
        let cutoff = match material.alpha {
            Alpha::Mask { cutoff } => cutoff,
            _ => 0.0,
        };
        let factors = [
            material.roughness,
            material.metallic,
            material.normal_scale,
            cutoff,
        ];
        let are_finite = material.base_color.is_finite()
            && material.emissive.is_finite()
            && factors.iter().all(|f| f.is_finite());
        if !are_finite {
            let text =
                format!("a factor of material {name} is not finite; material {name} was left out");
            scene.warnings.push(text);
            material = Material::default();
        }
        material.name = name;
        scene.materials.push(material);
    }
    scene.materials.push(Material {
        name: "default".to_owned(),
        ..Material::default()
    });
}

/// Transmission, unlit and specular-glossiness.
fn read_extensions(
    source: &json::Material,
    textures: &mut Textures,
    scene: &mut Scene,
    material: &mut Material,
    name: &str,
) -> Read<()> {
    let Some(extensions) = &source.extensions else {
        return Ok(());
    };
    if let Some(transmission) = &extensions.transmission {
        let factor = transmission.transmission_factor.0;
        finite(&[factor], &format!("a transmission of material {name}"))?;
        material.transmission = factor.clamp(0.0, 1.0);
        if material.transmission > 0.0
            && let Some(info) = &transmission.transmission_texture
        {
            let what = format!("the transmission texture of material {name}");
            material.transmission_texture = textures.of(scene, info, &what);
        }
        if material.transmission > 0.0 && material.emissive != Vec3::ZERO {
            material.transmission = 0.0;
            let text = format!("material {name} shines, so its transmission is left out");
            scene.warnings.push(text);
        }
    }
    if let Some(factors) = &extensions.pbr_specular_glossiness {
        material.base_color = Vec4::from(factors.diffuse_factor.0);
        let colors = textures.document.options.colors;
        material.base_color_texture = match &factors.diffuse_texture {
            Some(info) => {
                let what = format!("the diffuse texture of material {name}");
                let is_needed = colors || material.alpha != Alpha::Opaque;
                textures.of_if(is_needed, scene, info, &what)
            }
            None => None,
        };
        material.metallic_roughness_texture = None;
        let texture = match &factors.specular_glossiness_texture {
            Some(info) => {
                let what = format!("the specular-glossiness texture of material {name}");
                textures.of_if(colors, scene, info, &what)
            }
            None => None,
        };
        let [r, g, b] = factors.specular_factor.0;
        let glossiness = factors.glossiness_factor.0;
        finite(
            &[r, g, b, glossiness],
            &format!("a specular factor of material {name}"),
        )?;
        material.specular_glossiness = Some(SpecularGlossiness {
            specular: Vec3::new(r, g, b),
            glossiness,
            texture,
        });
    }
    if extensions.unlit.is_some() {
        // The base colour is all that the extension leaves.
        *material = Material {
            base_color: material.base_color,
            base_color_texture: material.base_color_texture,
            alpha: material.alpha,
            double_sided: material.double_sided,
            unlit: true,
            ..Material::default()
        };
    }
    Ok(())
}
