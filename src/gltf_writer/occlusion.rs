//! Values as an occlusion texture.

use super::attributes::Writer;
use super::json::Json;
use super::raster::Canvas;
use crate::bake::signals::shown;
use crate::scene::Mesh;
use serde_json::json;

/// Most sets of texture coordinates that are tried.
const MAX_SETS: usize = 8;

/// Draws an instance's values into a texture of their own and gives it to the materials of a mesh of
/// the file, each of which is copied.
///
/// # Errors
/// Why the mesh cannot have such a texture: no set of coordinates without overlaps in [0, 1], or an
/// occlusion texture that is there already.
pub(super) fn write(writer: &mut Writer, index: usize, instance: usize) -> Result<(), String> {
    let mesh = &writer.scene.meshes[writer.scene.instances[instance].mesh];
    let parts = mesh.file.iter().flat_map(|file| &file.primitives);
    let parts: Vec<usize> = parts.map(|part| part.primitive).collect();
    for &part in &parts {
        let material = material_of(writer, index, part);
        let material = material.and_then(|m| writer.document.element("materials", m));
        if material.is_some_and(|m| m.get("occlusionTexture").is_some()) {
            return Err("a material has an occlusion texture already".into());
        }
    }
    let (set, canvas) = draw(writer, index, instance, mesh, &parts)?;
    let side = writer.options.texture_side;
    let png = png(&canvas.into_texels(), side)?;
    let view = writer.document.push_view(&png, json!({}));
    let image = json!({"bufferView": view, "mimeType": "image/png"});
    let source = writer.document.push("images", image);
    let sampler = sampler(writer);
    let texture = json!({"source": source, "sampler": sampler});
    let texture = writer.document.push("textures", texture);
    let mut copies: Vec<(Option<usize>, usize)> = Vec::new();
    for part in parts {
        let material = material_of(writer, index, part);
        let known = copies.iter().find(|(original, _)| *original == material);
        let copy = match known {
            Some((_, copy)) => *copy,
            None => {
                let original = material.and_then(|m| writer.document.element("materials", m));
                let mut copy = original.cloned().unwrap_or(Json::object());
                copy.set(
                    "occlusionTexture",
                    json!({"index": texture, "texCoord": set}),
                );
                let copy = writer.document.push("materials", copy);
                copies.push((material, copy));
                copy
            }
        };
        if let Some(primitive) = writer.primitive(index, part) {
            primitive.set("material", copy);
        }
    }
    Ok(())
}

fn material_of(writer: &mut Writer, mesh: usize, primitive: usize) -> Option<usize> {
    writer.primitive(mesh, primitive)?.get("material")?.index()
}

/// The sampler of all occlusion textures: linear with mipmaps, clamped.
fn sampler(writer: &mut Writer) -> usize {
    let document = &mut writer.document;
    *writer.sampler.get_or_insert_with(|| {
        let sampler = json!({"magFilter": 9729, "minFilter": 9987, "wrapS": 33071, "wrapT": 33071});
        document.push("samplers", sampler)
    })
}

/// The first set of coordinates that has room for the values, and the values drawn by it. The first set
/// is tried last: it is the one in which exporters repeat and mirror textures.
fn draw(
    writer: &mut Writer,
    index: usize,
    instance: usize,
    mesh: &Mesh,
    parts: &[usize],
) -> Result<(usize, Canvas), String> {
    let mut reason = "no texture coordinates".to_owned();
    for set in (1..MAX_SETS).chain([0]) {
        let name = format!("TEXCOORD_{set}");
        let mut coordinates = Vec::new();
        for &part in parts {
            let attributes = writer.attributes(index, part);
            let accessor = attributes.and_then(|a| a.get(&name)?.index());
            let read = accessor.and_then(|a| writer.file.coordinates(a, &name).ok());
            coordinates.extend(read);
        }
        if coordinates.len() < parts.len() {
            continue;
        }
        match draw_set(writer, instance, mesh, &coordinates) {
            Ok(canvas) => return Ok((set, canvas)),
            Err(what) => reason = format!("by {name} {what}"),
        }
    }
    Err(reason)
}

/// Draws by one set of coordinates: a list per primitive, by vertex of the file.
fn draw_set(
    writer: &Writer,
    instance: usize,
    mesh: &Mesh,
    coordinates: &[Vec<[f32; 2]>],
) -> Result<Canvas, &'static str> {
    let signals = &writer.baked.instances[instance].vertices;
    let value = |vertex: usize| {
        let signals: Vec<u8> = signals.iter().map(|signal| signal[vertex]).collect();
        shown(&signals, writer.blend())
    };
    let primitives = mesh.file.iter().flat_map(|file| &file.primitives);
    let primitives: Vec<_> = primitives.zip(coordinates).collect();
    let place = |vertex: usize| {
        let at = primitives.partition_point(|(part, _)| part.vertices.end <= vertex);
        let (_, coordinates) = primitives.get(at)?;
        coordinates
            .get(mesh.file_vertices[vertex] as usize)
            .copied()
    };
    let mut canvas = Canvas::new(writer.options.texture_side);
    for triangle in &mesh.triangles {
        let vertices = triangle.map(|v| v as usize);
        let [Some(a), Some(b), Some(c)] = vertices.map(place) else {
            return Err("not every vertex has coordinates");
        };
        let corners = [a, b, c];
        if !corners.iter().flatten().all(|x| (0.0..=1.0).contains(x)) {
            return Err("triangles reach outside 0 to 1");
        }
        let [a, b, c] = corners.map(|corner| corner.map(f64::from));
        if (b[0] - a[0]) * (c[1] - a[1]) == (b[1] - a[1]) * (c[0] - a[0]) {
            return Err("triangles have no area");
        }
        if !canvas.draw(corners, vertices.map(value)) {
            return Err("triangles overlap");
        }
    }
    match canvas.is_empty() {
        true => Err("all triangles are smaller than a texel"),
        false => Ok(canvas),
    }
}

/// A gray PNG.
fn png(texels: &[u8], side: u32) -> Result<Vec<u8>, String> {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(texels, side, side, image::ExtendedColorType::L8)
        .map_err(|e| format!("its texture cannot be written ({e})"))?;
    Ok(bytes)
}
