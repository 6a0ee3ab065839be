//! Decompresses buffer views (`EXT_meshopt_compression` and `KHR_meshopt_compression`).
//!
//! Both extensions are read alike: each mode and filter of either, and both versions of the vertex
//! codec. The decoders are those of meshoptimizer itself.

use super::{Document, Read};
use ::gltf::json::{self, Value};
use ::meshopt::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, ffi,
};
use std::cell::{Cell, OnceCell};

/// The two names of the extension.
pub(super) const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Most bytes that the compressed views of a file may have together once they are decoded. A byte
/// may stand for a thousand, so the file's size is no bound.
const MAX_DECODED_BYTES: usize = 1 << 30;

/// Most bytes of an element (both extensions, "JSON schema updates").
const MAX_STRIDE: usize = 256;

/// The views that were decoded so far.
pub(super) struct Decoded {
    /// By view. Words, so that the data are aligned for the decoders.
    views: Vec<OnceCell<Read<Vec<u32>>>>,
    /// Bytes that were decoded, in vain or not.
    bytes: Cell<usize>,
}

impl Decoded {
    pub(super) fn new(root: &json::Root) -> Decoded {
        Decoded {
            views: vec![OnceCell::new(); root.buffer_views.len()],
            bytes: Cell::new(0),
        }
    }
}

#[derive(Clone, Copy)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// The extension's object, checked against what both extensions demand of it.
struct Layout {
    buffer: usize,
    offset: u64,
    length: u64,
    stride: usize,
    count: usize,
    mode: Mode,
    filter: Filter,
}

impl Document<'_> {
    /// The decoded bytes of a buffer view; `None` where it is not compressed.
    pub(super) fn decompressed(&self, index: usize, place: &str) -> Option<Read<&[u8]>> {
        let extensions = self.root.buffer_views.get(index)?.extensions.as_ref()?;
        let found = NAMES.iter().find_map(|name| extensions.others.get(*name))?;
        let decoded = self.decoded.views.get(index)?.get_or_init(|| {
            let words = read_layout(found).and_then(|layout| self.decompress(&layout));
            words.map_err(|reason| format!("{place} cannot be decompressed: {reason}"))
        });
        Some(match decoded {
            Ok(words) => Ok(bytemuck::cast_slice(words)),
            Err(reason) => Err(reason.clone()),
        })
    }

    fn decompress(&self, layout: &Layout) -> Read<Vec<u32>> {
        let place = "its compression";
        let data = self.range(layout.buffer, layout.offset, layout.length, place)?;
        let decoded = &self.decoded.bytes;
        let bytes = layout.count.checked_mul(layout.stride);
        let all = bytes.and_then(|bytes| bytes.checked_add(decoded.get()));
        let (Some(bytes), Some(all)) = (bytes, all.filter(|all| *all <= MAX_DECODED_BYTES)) else {
            return Err(format!(
                "it is to have {} elements of {} bytes, with which the compressed views of the file \
                 would be larger than {MAX_DECODED_BYTES} bytes",
                layout.count, layout.stride
            ));
        };
        decoded.set(all);
        let mut words = decode(layout, data, bytes)?;
        apply_filter(layout, &mut words);
        // What is decoded counts as data of the file.
        self.budget.set(self.budget.get().saturating_add(bytes));
        Ok(words)
    }
}

fn read_layout(object: &Value) -> Read<Layout> {
    let number = |key: &str| {
        let value = object.get(key);
        let value = value.ok_or_else(|| format!("its compression has no {key}"))?;
        let value = value.as_u64();
        value.ok_or_else(|| format!("the {key} of its compression is no whole number"))
    };
    let size = |key: &str| Ok::<_, String>(usize::try_from(number(key)?).unwrap_or(usize::MAX));
    let word = |key: &str| object.get(key).map(|value| value.as_str().unwrap_or("?"));
    let mode = match word("mode") {
        Some("ATTRIBUTES") => Mode::Attributes,
        Some("TRIANGLES") => Mode::Triangles,
        Some("INDICES") => Mode::Indices,
        _ => return Err("its compression mode is not known".to_owned()),
    };
    let filter = match word("filter") {
        None | Some("NONE") => Filter::None,
        Some("OCTAHEDRAL") => Filter::Octahedral,
        Some("QUATERNION") => Filter::Quaternion,
        Some("EXPONENTIAL") => Filter::Exponential,
        Some("COLOR") => Filter::Color,
        _ => return Err("its compression filter is not known".to_owned()),
    };
    let (stride, count) = (size("byteStride")?, size("count")?);
    let is_stride_right = match (mode, filter) {
        (Mode::Attributes, Filter::None | Filter::Exponential) => {
            stride > 0 && stride <= MAX_STRIDE && stride.is_multiple_of(4)
        }
        (Mode::Attributes, Filter::Octahedral | Filter::Color) => matches!(stride, 4 | 8),
        (Mode::Attributes, Filter::Quaternion) => stride == 8,
        (Mode::Triangles | Mode::Indices, Filter::None) => matches!(stride, 2 | 4),
        _ => return Err("indices have no compression filter".to_owned()),
    };
    if !is_stride_right {
        return Err(format!(
            "a stride of {stride} bytes does not go with its mode and filter"
        ));
    }
    if matches!(mode, Mode::Triangles) && !count.is_multiple_of(3) {
        return Err(format!("{count} indices are no whole triangles"));
    }
    Ok(Layout {
        buffer: size("buffer")?,
        offset: match object.get("byteOffset") {
            Some(_) => number("byteOffset")?,
            None => 0,
        },
        length: number("byteLength")?,
        stride,
        count,
        mode,
        filter,
    })
}

/// Decodes `data` into `bytes` bytes, which are `count * stride`; zeros fill up the last word.
fn decode(layout: &Layout, data: &[u8], bytes: usize) -> Read<Vec<u32>> {
    let mut words = vec![0u32; bytes.div_ceil(4)];
    let out = words.as_mut_ptr().cast();
    let decoder = match layout.mode {
        Mode::Attributes => ffi::meshopt_decodeVertexBuffer,
        Mode::Triangles => ffi::meshopt_decodeIndexBuffer,
        Mode::Indices => ffi::meshopt_decodeIndexSequence,
    };
    // SAFETY: `out` has room for `count` elements of `stride` bytes and is aligned for words; `data`
    // is read within its length. The decoders assert of `stride` and `count` what `read_layout`
    // checks, and take any data ("safe to use for untrusted input").
    let code = unsafe { decoder(out, layout.count, layout.stride, data.as_ptr(), data.len()) };
    match code {
        0 => Ok(words),
        -1 => Err("its data are not of the mode that it names".to_owned()),
        _ => Err("its data are cut short or damaged".to_owned()),
    }
}

fn apply_filter(layout: &Layout, words: &mut [u32]) {
    match (layout.filter, layout.stride) {
        (Filter::None, _) => {}
        (Filter::Octahedral, 4) => decode_filter_oct::<i8>(bytemuck::cast_slice_mut(words)),
        (Filter::Octahedral, _) => decode_filter_oct::<i16>(bytemuck::cast_slice_mut(words)),
        (Filter::Quaternion, _) => decode_filter_quat(bytemuck::cast_slice_mut(words)),
        (Filter::Exponential, _) => decode_filter_exp::<1>(bytemuck::cast_slice_mut(words)),
        (Filter::Color, 4) => decode_filter_color::<u8>(bytemuck::cast_slice_mut(words)),
        (Filter::Color, _) => decode_filter_color::<u16>(bytemuck::cast_slice_mut(words)),
    }
}
