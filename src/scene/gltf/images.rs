//! Decodes PNG and JPEG images into textures.

use super::{Document, Read, buffers, get};
use crate::scene::{Texture, Wrap};
use ::gltf::json;
use json::texture::WrappingMode;
use json::validation::Checked;

/// Texels a scene may hold: 1 GiB.
pub(super) const MAX_TEXELS: u64 = 1 << 28;
const MAX_SIDE: u32 = 16_384;

/// Reads a texture; `None` when it has no image of a kind that glTF itself defines.
pub(super) fn texture(
    document: &Document,
    index: json::Index<json::Texture>,
) -> Read<Option<Texture>> {
    let root = &document.root;
    let texture = get(&root.textures, index, "texture")?;
    // The crate marks a texture without a source by the largest index.
    if texture.source.value() == u32::MAX as usize {
        return Ok(None);
    }
    let image = get(&root.images, texture.source, "image")?;
    let what = format!("image {}", texture.source.value());
    let owned;
    let bytes = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => {
            owned = buffers::resolve(uri, document.folder, &what)?;
            &owned[..]
        }
        (None, Some(view)) => document.view(view)?.0,
        (None, None) => return Err(format!("{what} has neither a URI nor a buffer view")),
    };
    let mut out = decode(document, bytes, &what)?;
    if let Some(sampler) = texture.sampler {
        let sampler = get(&root.samplers, sampler, "sampler")?;
        out.wrap_s = wrap(&sampler.wrap_s);
        out.wrap_t = wrap(&sampler.wrap_t);
    }
    Ok(Some(out))
}

fn decode(document: &Document, bytes: &[u8], what: &str) -> Read<Texture> {
    let failed = |e: image::ImageError| format!("{what} cannot be decoded: {e}");
    let reader = || -> Read<_> {
        let mut reader = image::ImageReader::new(std::io::Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|e| format!("{what} cannot be read: {e}"))?;
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        reader.limits(limits);
        Ok(reader)
    };
    let (width, height) = reader()?.into_dimensions().map_err(failed)?;
    let texels = u64::from(width) * u64::from(height);
    match document.texel_budget.get().checked_sub(texels) {
        Some(left) => document.texel_budget.set(left),
        None => {
            return Err(format!(
                "{what} has {width} x {height} texels, too many beside the others; \
                 save the scene with smaller textures"
            ));
        }
    }
    let image = reader()?.decode().map_err(failed)?.into_rgba8();
    let (width, height) = image.dimensions();
    if width == 0 || height == 0 {
        return Err(format!("{what} is empty"));
    }
    Ok(Texture {
        width,
        height,
        texels: image.pixels().map(|p| p.0).collect(),
        ..Texture::default()
    })
}

fn wrap(mode: &Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
