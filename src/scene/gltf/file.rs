//! What a writer of glTF files needs of the reader: parts of a file as they are stored.

use super::{Document, Read, buffers, container, document, get};
use crate::scene::LoadOptions;
use ::gltf::json;
use json::accessor::{ComponentType, Type};
use json::validation::Checked;
use std::borrow::Cow;
use std::path::Path;

pub(crate) use container::{CHUNK_BIN, CHUNK_JSON, MAGIC};

/// The extension by which a file has a stream in it (`spec/gltf.md`).
pub const STREAM_EXTENSION: &str = "DAPPLE_stream";

/// A glTF file in memory.
pub struct File<'a> {
    bytes: &'a [u8],
    folder: Option<&'a Path>,
    document: Document<'a>,
}

/// An accessor's elements, tightly packed: decompressed, sparse substitution done.
#[derive(Clone, Debug)]
pub struct Elements {
    pub bytes: Vec<u8>,
    pub component: ComponentType,
    /// Components of an element.
    pub components: usize,
    pub normalized: bool,
}

impl<'a> File<'a> {
    /// # Errors
    /// A sentence for what is no glTF 2.0.
    pub fn open(
        bytes: &'a [u8],
        folder: Option<&'a Path>,
        options: &'a LoadOptions,
    ) -> Read<File<'a>> {
        let document = document(bytes, folder, options)?;
        Ok(File {
            bytes,
            folder,
            document,
        })
    }

    /// The JSON text and the binary chunk.
    ///
    /// # Errors
    /// As [`File::open`].
    pub fn chunks(&self) -> Read<(Cow<'a, str>, Option<&'a [u8]>)> {
        let (text, blob) = container::split(self.bytes)?;
        Ok((String::from_utf8_lossy(text), blob))
    }

    /// The kinds and contents of a binary file's chunks after those of [`File::chunks`].
    pub fn further_chunks(&self) -> Vec<(&'a [u8], &'a [u8])> {
        container::further_chunks(self.bytes)
    }

    /// The bytes behind a URI of the file; `what` names it in messages.
    ///
    /// # Errors
    /// A sentence where they cannot be read.
    pub fn resolve(&self, uri: &str, what: &str) -> Read<Vec<u8>> {
        buffers::resolve(uri, self.folder, what)
    }

    /// The stream in the file; `None` where it has none.
    ///
    /// # Errors
    /// A sentence where it cannot be read.
    pub fn stream(&self) -> Read<Option<Cow<'_, [u8]>>> {
        let extensions = self.document.root.extensions.as_ref();
        let Some(extension) = extensions.and_then(|e| e.others.get(STREAM_EXTENSION)) else {
            return Ok(None);
        };
        let index = |value: &serde_json::Value| u32::try_from(value.as_u64()?).ok();
        match (extension.get("bufferView"), extension.get("uri")) {
            (Some(view), None) => {
                let view = index(view)
                    .ok_or_else(|| format!("the buffer view of {STREAM_EXTENSION} is no index"))?;
                let (bytes, _) = self.document.view(json::Index::new(view))?;
                Ok(Some(Cow::Borrowed(bytes)))
            }
            (None, Some(serde_json::Value::String(uri))) => {
                let bytes = self.resolve(uri, "the stream")?;
                Ok(Some(Cow::Owned(bytes)))
            }
            _ => Err(format!(
                "{STREAM_EXTENSION} names neither a buffer view nor a URI, or both"
            )),
        }
    }

    /// The elements of an accessor; `what` names it in messages.
    ///
    /// # Errors
    /// A sentence where they cannot be read.
    pub fn elements(&self, accessor: usize, what: &str) -> Read<Elements> {
        let index = json::Index::new(u32::try_from(accessor).unwrap_or(u32::MAX));
        let components = match get(&self.document.root.accessors, index, "accessor")?.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec2) => 2,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            _ => return Err(format!("{what} is neither a number nor a vector")),
        };
        let packed = self.document.packed(index, components, what)?;
        Ok(Elements {
            bytes: packed.bytes,
            component: packed.component,
            components,
            normalized: packed.normalized,
        })
    }

    /// Texture coordinates.
    ///
    /// # Errors
    /// A sentence where they cannot be read or are not finite.
    pub fn coordinates(&self, accessor: usize, what: &str) -> Read<Vec<[f32; 2]>> {
        let index = json::Index::new(u32::try_from(accessor).unwrap_or(u32::MAX));
        self.document.floats::<2>(index, what)
    }
}
