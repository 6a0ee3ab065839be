//! A glTF file that is being changed: its JSON, and the buffer to which new data goes.

use super::json::Json;
use crate::base64;
use crate::scene::GltfFile as File;
use crate::scene::gltf::file;
use crate::{Error, Result};
use serde_json::json;

/// Bytes to which all new data is aligned: vertex attributes need it (glTF 2.0, section 3.6.2.4).
const ALIGNMENT: usize = 4;

/// Images by their first bytes.
const IMAGES: [(&[u8], &str); 5] = [
    (b"\x89PNG", "image/png"),
    (b"\xFF\xD8\xFF", "image/jpeg"),
    (b"RIFF", "image/webp"),
    (b"\xABKTX 20", "image/ktx2"),
    (b"DDS ", "image/vnd-ms.dds"),
];

/// A changed file. All that the file keeps elsewhere was taken in, so that it may be written anywhere.
///
/// No index changes: extensions that are not known here may hold indices of their own.
pub struct Document {
    root: Json,
    /// The contents of buffer [`Document::buffer`].
    data: Vec<u8>,
    /// The buffer that grows: the first one, unless it has no data of its own.
    buffer: usize,
    /// Chunks of unknown kinds.
    further_chunks: Vec<([u8; 4], Vec<u8>)>,
    /// What could not be taken in, one sentence each.
    pub warnings: Vec<String>,
}

impl Document {
    /// # Errors
    /// A sentence for what cannot be read.
    pub fn new(file: &File) -> std::result::Result<Document, String> {
        let (text, blob) = file.chunks()?;
        let root = Json::parse(&text).map_err(|e| format!("its JSON cannot be read: {e}"))?;
        let kind = |kind: &[u8]| kind.first_chunk().copied().unwrap_or_default();
        let further_chunks = file.further_chunks();
        let mut document = Document {
            root,
            data: Vec::new(),
            buffer: 0,
            further_chunks: further_chunks
                .into_iter()
                .map(|(k, bytes)| (kind(k), bytes.to_vec()))
                .collect(),
            warnings: Vec::new(),
        };
        document.take_buffers(file, blob);
        document.take_images(file);
        Ok(document)
    }

    pub fn root(&mut self) -> &mut Json {
        &mut self.root
    }

    /// An element of one of the root's arrays.
    pub fn element(&mut self, array: &str, index: usize) -> Option<&mut Json> {
        self.root.get(array)?.item(index)
    }

    /// Number of elements of one of the root's arrays.
    pub fn count(&mut self, array: &str) -> usize {
        let items = self.root.get(array).and_then(Json::items);
        items.map_or(0, |items| items.len())
    }

    /// Appends an element to one of the root's arrays; returns its index.
    pub fn push(&mut self, array: &str, element: impl Into<Json>) -> usize {
        let index = self.count(array);
        let array = self.root.member(array, Json::array());
        if let Some(items) = array.items() {
            items.push(element.into());
        }
        index
    }

    /// Takes the first buffer in as the one that grows, and the files of the others.
    fn take_buffers(&mut self, file: &File, blob: Option<&[u8]>) {
        let mut first = None;
        for index in 0..self.count("buffers") {
            let Some(buffer) = self.element("buffers", index) else {
                continue;
            };
            let uri = buffer.get("uri").and_then(|uri| uri.string());
            let what = format!("buffer {index}");
            let bytes = match &uri {
                None if index == 0 => blob.map(<[u8]>::to_vec),
                None => None,
                Some(uri) if index > 0 && uri.starts_with("data:") => None,
                Some(uri) => match file.resolve(uri, &what) {
                    Ok(bytes) => Some(bytes),
                    Err(reason) => {
                        self.warnings
                            .push(format!("{reason}; it stays where it was"));
                        None
                    }
                },
            };
            let Some((bytes, buffer)) = bytes.zip(self.element("buffers", index)) else {
                continue;
            };
            match index {
                0 => {
                    buffer.remove("uri");
                    first = Some(bytes);
                }
                _ => buffer.set("uri", &data_uri(&bytes)[..]),
            }
        }
        match first {
            Some(bytes) => self.data = bytes,
            None => self.buffer = self.push("buffers", json!({"byteLength": 0})),
        }
    }

    /// Takes in the files of images.
    fn take_images(&mut self, file: &File) {
        for index in 0..self.count("images") {
            let image = self.element("images", index);
            let uri = image.and_then(|image| image.get("uri")?.string());
            let Some(uri) = uri.filter(|uri| !uri.starts_with("data:")) else {
                continue;
            };
            let read = file.resolve(&uri, &format!("image {index}"));
            let read = read.and_then(|bytes| {
                let known = IMAGES.iter().find(|(magic, _)| bytes.starts_with(magic));
                let (_, mime) =
                    known.ok_or_else(|| format!("image {index} is of an unknown kind"))?;
                Ok((bytes, *mime))
            });
            match read {
                Ok((bytes, mime)) => {
                    let view = self.push_view(&bytes, json!({}));
                    if let Some(image) = self.element("images", index) {
                        image.remove("uri");
                        image.set("bufferView", view);
                        image.set("mimeType", mime);
                    }
                }
                Err(reason) => self
                    .warnings
                    .push(format!("{reason}; it stays where it was")),
            }
        }
    }

    /// Appends data with a buffer view about it that has these other properties; returns its index.
    pub fn push_view(&mut self, bytes: &[u8], properties: serde_json::Value) -> usize {
        self.data
            .resize(self.data.len().next_multiple_of(ALIGNMENT), 0);
        let mut view = json!({
            "buffer": self.buffer, "byteOffset": self.data.len(), "byteLength": bytes.len(),
        });
        self.data.extend_from_slice(bytes);
        if let (Some(view), serde_json::Value::Object(properties)) =
            (view.as_object_mut(), properties)
        {
            view.extend(properties);
        }
        self.push("bufferViews", view)
    }

    /// Ends the changes: the length of the buffer that grew is written down.
    fn finish(&mut self) {
        self.data
            .resize(self.data.len().next_multiple_of(ALIGNMENT), 0);
        let (index, length) = (self.buffer, self.data.len());
        if length == 0 && index + 1 == self.count("buffers") {
            // Nothing was added to a file without data.
            if let Some(buffers) = self.root.get("buffers").and_then(Json::items) {
                buffers.pop();
            }
            if self.count("buffers") == 0 {
                self.root.remove("buffers");
            }
        } else if let Some(buffer) = self.element("buffers", index) {
            buffer.set("byteLength", length);
        }
    }

    /// The bytes of a binary file.
    ///
    /// # Errors
    /// `Invalid` for more than such a file can hold.
    pub fn to_glb(mut self) -> Result<Vec<u8>> {
        self.finish();
        if self.buffer > 0 && !self.data.is_empty() {
            // Only the first buffer can be the binary chunk.
            let uri = data_uri(&std::mem::take(&mut self.data));
            if let Some(buffer) = self.root.get("buffers").and_then(|b| b.item(self.buffer)) {
                buffer.set("uri", &uri[..]);
            }
        }
        let mut text = self.root.to_text().into_bytes();
        text.resize(text.len().next_multiple_of(ALIGNMENT), b' ');
        let mut chunks: Vec<(&[u8], &[u8])> = vec![(file::CHUNK_JSON, &text)];
        if !self.data.is_empty() {
            chunks.push((file::CHUNK_BIN, &self.data));
        }
        let further = self.further_chunks.iter();
        chunks.extend(further.map(|(kind, bytes)| (&kind[..], &bytes[..])));
        let length = 12 + chunks.iter().map(|(_, c)| 8 + c.len()).sum::<usize>();
        let Ok(length) = u32::try_from(length) else {
            return Err(Error::Invalid(format!(
                "the file would have {length} bytes, more than a .glb can; name a .gltf instead"
            )));
        };
        let mut out = Vec::with_capacity(length as usize);
        out.extend_from_slice(file::MAGIC);
        out.extend(2u32.to_le_bytes());
        out.extend(length.to_le_bytes());
        for (kind, content) in chunks {
            out.extend((content.len() as u32).to_le_bytes());
            out.extend_from_slice(kind);
            out.extend_from_slice(content);
        }
        Ok(out)
    }

    /// The text of a JSON file, and the contents of the file `buffer` beside it.
    pub fn to_gltf(mut self, buffer: &str) -> (String, Vec<u8>) {
        self.finish();
        let index = self.buffer;
        if !self.data.is_empty()
            && let Some(element) = self.element("buffers", index)
        {
            element.set("uri", &percent_encoded(buffer)[..]);
        }
        (self.root.to_text(), self.data)
    }
}

fn data_uri(bytes: &[u8]) -> String {
    "data:application/octet-stream;base64,".to_owned() + &base64::encode(bytes)
}

/// A file's name as a URI.
fn percent_encoded(name: &str) -> String {
    let mut uri = String::new();
    for byte in name.bytes() {
        match byte {
            b'-' | b'.' | b'_' | b'~' => uri.push(char::from(byte)),
            _ if byte.is_ascii_alphanumeric() => uri.push(char::from(byte)),
            _ => uri += &format!("%{byte:02X}"),
        }
    }
    uri
}
