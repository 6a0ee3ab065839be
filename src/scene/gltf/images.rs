//! Decodes PNG, JPEG and WebP images into textures.
//!
//! An image is decoded once, however many textures show it, and only when a material needs it.
//! Large ones are halved (each texel the mean of those it covers, as stored) until they are at most
//! [`MAX_SIDE`] wide and high and all together have at most [`MAX_TEXELS`].

use super::{Document, Read, buffers, get};
use crate::scene::{Scene, Texture, Wrap};
use ::gltf::json;
use json::texture::WrappingMode;
use json::validation::Checked;
use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::Arc;

/// Texels that the images of a scene may have after halving: 1 GiB.
const MAX_TEXELS: usize = 1 << 28;
/// Texels along a side after halving.
const MAX_SIDE: u32 = 4096;
/// Texels along a side of an image that is decoded at all.
const MAX_DECODED_SIDE: u32 = 16_384;
/// Bytes that a decoder may allocate.
const MAX_DECODER_BYTES: u64 = 1 << 30;

/// The images that were decoded so far.
#[derive(Default)]
pub(super) struct Images {
    /// By image, or why one cannot be used.
    decoded: RefCell<BTreeMap<usize, Read<Texture>>>,
    /// Times that an image was halved.
    halvings: Cell<usize>,
}

/// Reads a texture. `None`, with a warning, when none of its images can be used.
pub(super) fn texture(document: &Document, index: json::Index<json::Texture>) -> Option<Texture> {
    let source = document.optional(get(&document.root.textures, index, "texture"))?;
    let mut reason = format!("texture {} has no PNG, JPEG or WebP image", index.value());
    let mut out = None;
    for image in sources(source) {
        match decoded(document, image) {
            Ok(texture) => {
                out = Some(texture);
                break;
            }
            Err(failed) => reason = failed,
        }
    }
    let Some(mut out) = out else {
        return document.optional(Err(reason));
    };
    if let Some(sampler) = source.sampler
        && let Some(sampler) =
            document.optional(get(&document.root.samplers, sampler, "texture sampler"))
    {
        out.wrap_s = wrap(&sampler.wrap_s);
        out.wrap_t = wrap(&sampler.wrap_t);
    }
    Some(out)
}

/// The images of a texture, the best first.
fn sources(texture: &json::Texture) -> Vec<usize> {
    let extensions = texture.extensions.as_ref();
    let webp = extensions
        .and_then(|e| e.others.get("EXT_texture_webp"))
        .and_then(|e| e.get("source")?.as_u64())
        .map(|source| source as usize);
    // The crate marks a texture without a source by the largest index.
    let plain = Some(texture.source.value()).filter(|s| *s != u32::MAX as usize);
    webp.into_iter().chain(plain).collect()
}

/// An image with the default wrap modes.
fn decoded(document: &Document, image: usize) -> Read<Texture> {
    let images = &document.images;
    if let Some(known) = images.decoded.borrow().get(&image) {
        return known.clone();
    }
    let made = decode(document, image).map(|mut texture| {
        while texture.width.max(texture.height) > MAX_SIDE {
            texture = halve(&texture);
            images.halvings.set(images.halvings.get() + 1);
        }
        texture
    });
    images.decoded.borrow_mut().insert(image, made.clone());
    made
}

/// Warns about a texture that is not needed if all its images lack a file or a sound header.
pub(super) fn check(document: &Document, index: json::Index<json::Texture>) {
    let Ok(source) = get(&document.root.textures, index, "texture") else {
        return document.warn(format!("texture {} is not there", index.value()));
    };
    let mut reason = format!("texture {} has no PNG, JPEG or WebP image", index.value());
    for image in sources(source) {
        match check_image(document, image) {
            Ok(()) => return,
            Err(failed) => reason = failed,
        }
    }
    document.optional(Err::<(), _>(reason));
}

fn check_image(document: &Document, index: usize) -> Read<()> {
    if let Some(image) = document.root.images.get(index)
        && let Some(uri) = &image.uri
        && !uri.starts_with("data:")
    {
        let what = format!("image {index}");
        return buffers::find(uri, document.folder, &what).map(|_| ());
    }
    let bytes = bytes(document, index)?;
    let dimensions = reader(&bytes, index)?.into_dimensions();
    dimensions.map(|_| ()).map_err(|e| failed(index, &e))
}

/// The file of an image.
fn bytes<'d>(document: &'d Document, index: usize) -> Read<Cow<'d, [u8]>> {
    let what = format!("image {index}");
    let images = &document.root.images;
    let image = images
        .get(index)
        .ok_or_else(|| format!("{what} is named but there are only {}", images.len()))?;
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => buffers::resolve(uri, document.folder, &what).map(Cow::Owned),
        (None, Some(view)) => {
            let view = document.view(view).map_err(|e| format!("{what}: {e}"))?;
            Ok(Cow::Borrowed(view.0))
        }
        (None, None) => Err(format!("{what} has neither a URI nor a buffer view")),
    }
}

fn failed(index: usize, reason: &dyn std::fmt::Display) -> String {
    let reason = super::shorten(&reason.to_string(), 128);
    format!("image {index} cannot be decoded: {reason}")
}

fn reader(bytes: &[u8], index: usize) -> Read<image::ImageReader<Cursor<&[u8]>>> {
    let mut reader = image::ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| failed(index, &e))?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_DECODED_SIDE);
    limits.max_image_height = Some(MAX_DECODED_SIDE);
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    Ok(reader)
}

fn decode(document: &Document, index: usize) -> Read<Texture> {
    let bytes = bytes(document, index)?;
    let image = reader(&bytes, index)?.decode();
    let image = image.map_err(|e| failed(index, &e))?.into_rgba8();
    let (width, height) = image.dimensions();
    if width == 0 || height == 0 {
        return Err(format!("image {index} is empty"));
    }
    Ok(Texture {
        width,
        height,
        texels: image.pixels().map(|p| p.0).collect(),
        ..Texture::default()
    })
}

/// Says whether images were halved.
pub(super) fn report(document: &Document) {
    let halvings = document.images.halvings.get();
    if halvings > 0 {
        document.warn(format!(
            "large images were halved ({halvings} times): at most {MAX_SIDE} texels a side and \
             {MAX_TEXELS} of all images are kept"
        ));
    }
}

/// Halves the largest images until all have at most [`MAX_TEXELS`] together.
pub(super) fn fit(document: &Document, scene: &mut Scene) {
    fit_within(document, scene, MAX_TEXELS);
}

fn fit_within(document: &Document, scene: &mut Scene, most: usize) {
    let mut decoded = document.images.decoded.borrow_mut();
    let texels = |t: &Texture| t.texels.len();
    let mut total: usize = decoded.values().flatten().map(texels).sum();
    while total > most
        && let Some(largest) = decoded.values_mut().flatten().max_by_key(|t| texels(t))
        && texels(largest) > 1
    {
        let smaller = halve(largest);
        total -= texels(largest) - texels(&smaller);
        let old = std::mem::replace(largest, smaller);
        for texture in &mut scene.textures {
            if Arc::ptr_eq(&texture.texels, &old.texels) {
                (texture.width, texture.height) = (largest.width, largest.height);
                texture.texels = Arc::clone(&largest.texels);
            }
        }
        document
            .images
            .halvings
            .set(document.images.halvings.get() + 1);
    }
}

/// The image at half its width and height, each at least 1.
fn halve(texture: &Texture) -> Texture {
    let (width, height) = ((texture.width / 2).max(1), (texture.height / 2).max(1));
    // The texels that one of `count` covers of `all`.
    let span = |at: u32, all: u32, count: u32| (at * all / count)..((at + 1) * all / count);
    let mut texels = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut covered) = ([0u32; 4], 0);
            for row in span(y, texture.height, height) {
                let start = row as usize * texture.width as usize;
                for column in span(x, texture.width, width) {
                    let texel = texture.texels[start + column as usize];
                    for (sum, value) in sum.iter_mut().zip(texel) {
                        *sum += u32::from(value);
                    }
                    covered += 1;
                }
            }
            texels.push(sum.map(|s| ((s + covered / 2) / covered) as u8));
        }
    }
    Texture {
        width,
        height,
        texels: texels.into(),
        ..*texture
    }
}

fn wrap(mode: &Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_takes_means_of_whole_texels() {
        let texture = Texture {
            width: 3,
            height: 2,
            texels: [[0; 4], [4; 4], [8; 4], [2; 4], [6; 4], [255; 4]].into(),
            wrap_s: Wrap::Clamp,
            ..Texture::default()
        };
        let half = halve(&texture);
        // The odd column belongs to its neighbour.
        assert_eq!((half.width, half.height), (1, 1));
        assert_eq!(half.texels[0], [46; 4]);
        assert_eq!(half.wrap_s, Wrap::Clamp);
        assert_eq!(halve(&half).texels, half.texels);
    }
}
