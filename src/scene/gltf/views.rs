//! Buffer views: ranges of buffers (glTF 2.0, section 3.6.1), decompressed where they have to be.

use super::{Document, Read, get};
use ::gltf::json;

impl Document<'_> {
    /// The bytes of a buffer view and its stride.
    ///
    /// Where the compressed data of a view cannot be read, its uncompressed copy stands in if the
    /// file has one.
    pub(super) fn view(
        &self,
        index: json::Index<json::buffer::View>,
    ) -> Read<(&[u8], Option<usize>)> {
        let view = get(&self.root.buffer_views, index, "buffer view")?;
        let place = format!("buffer view {}", index.value());
        let plain = || {
            let offset = view.byte_offset.map_or(0, |o| o.0);
            self.range(view.buffer.value(), offset, view.byte_length.0, &place)
        };
        let bytes = match self.decompressed(index.value(), &place) {
            None => plain()?,
            Some(Ok(bytes)) => bytes,
            Some(Err(reason)) => {
                let bytes = plain().map_err(|_| reason.clone())?;
                self.warn(format!("{reason}; its uncompressed copy was read"));
                bytes
            }
        };
        let stride = view.byte_stride.map(|s| s.0);
        if stride == Some(0) {
            self.warn(format!(
                "{place} has a stride of 0; it was read as tightly packed"
            ));
        }
        Ok((bytes, stride.filter(|s| *s > 0)))
    }

    /// A range of a buffer; `place` says in messages what is there.
    pub(super) fn range(
        &self,
        buffer: usize,
        offset: u64,
        length: u64,
        place: &str,
    ) -> Read<&[u8]> {
        let buffer = self
            .buffers
            .get(buffer)
            .ok_or_else(|| format!("{place} names buffer {buffer}, which is not there"))?;
        let buffer = buffer.as_ref().map_err(String::clone)?;
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        start
            .checked_add(length)
            .and_then(|end| buffer.get(start..end))
            .ok_or_else(|| {
                format!(
                    "{place} reaches beyond its buffer of {} bytes",
                    buffer.len()
                )
            })
    }
}
