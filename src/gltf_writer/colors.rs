//! Values multiplied into vertex colours.

use super::attributes::{Group, Writer};
use crate::bake::signals::shown;
use crate::scene::Elements;
use gltf::json::accessor::ComponentType;
use serde_json::json;

const NAME: &str = "COLOR_0";

/// Multiplies the values of a group of primitives into its colours, which are made where there are none.
/// Colours stay of their type, and alpha stays as it is.
pub(super) fn multiply(writer: &mut Writer, mesh: usize, group: &Group) {
    let blend = writer.blend();
    let shown: Vec<f32> = group.values().map(|v| shown(&v, blend)).collect();
    let Some(&first) = group.primitives.first() else {
        return;
    };
    let attributes = writer.attributes(mesh, first);
    let known = attributes.and_then(|a| a.get(NAME)?.index());
    let colors = match known.map(|accessor| writer.file.elements(accessor, NAME)) {
        None => Elements {
            bytes: vec![255; 4 * shown.len()],
            component: ComponentType::U8,
            components: 4,
            normalized: true,
        },
        Some(Ok(colors)) => colors,
        Some(Err(reason)) => return writer.written.notes.push(format!("{reason}; it stays")),
    };
    let size = colors.component.size() * colors.components;
    if colors.bytes.len() != size * shown.len() || !(3..=4).contains(&colors.components) {
        let text = format!("{NAME} of mesh {mesh} is no colour per vertex; it stays");
        return writer.written.notes.push(text);
    }
    let mut bytes = Vec::with_capacity(size.next_multiple_of(4) * shown.len());
    for (color, &factor) in colors.bytes.chunks_exact(size).zip(&shown) {
        for (i, number) in color.chunks_exact(colors.component.size()).enumerate() {
            match (i, number) {
                (3, alpha) => bytes.extend_from_slice(alpha),
                (_, &[a]) => bytes.push(scaled(u32::from(a), factor) as u8),
                (_, &[a, b]) => {
                    let value = u32::from(u16::from_le_bytes([a, b]));
                    bytes.extend((scaled(value, factor) as u16).to_le_bytes());
                }
                (_, &[a, b, c, d]) => {
                    let value = f32::from_le_bytes([a, b, c, d]);
                    bytes.extend((value * factor).to_le_bytes());
                }
                (_, other) => bytes.extend_from_slice(other),
            }
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    let stride = size.next_multiple_of(4);
    let view = json!({"byteStride": stride, "target": super::attributes::VERTICES});
    let view = writer.document.push_view(&bytes, view);
    let mut accessor = json!({
        "bufferView": view,
        "componentType": colors.component.as_gl_enum(),
        "count": shown.len(),
        "type": if colors.components == 3 { "VEC3" } else { "VEC4" },
    });
    if colors.normalized {
        accessor["normalized"] = true.into();
    }
    let accessor = writer.document.push("accessors", accessor);
    for &primitive in &group.primitives {
        writer.set_attribute(mesh, primitive, NAME, accessor);
    }
}

/// A share of an unsigned integer, to the nearest.
fn scaled(value: u32, factor: f32) -> u32 {
    (f64::from(value) * f64::from(factor)).round() as u32
}
