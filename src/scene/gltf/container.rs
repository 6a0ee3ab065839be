//! The binary container (glTF 2.0, section 4.4).

use super::Read;

pub(crate) const MAGIC: &[u8] = b"glTF";
pub(crate) const CHUNK_JSON: &[u8] = b"JSON";
pub(crate) const CHUNK_BIN: &[u8] = b"BIN\0";

/// Splits a file into its JSON text and its binary chunk. A file without the binary magic is taken
/// for JSON.
pub(super) fn split(bytes: &[u8]) -> Read<(&[u8], Option<&[u8]>)> {
    if bytes.is_empty() {
        return Err("the file is empty".to_owned());
    }
    if !bytes.starts_with(MAGIC) {
        let text = trim(bytes);
        return match text.first() {
            Some(b'{') => Ok((text, None)),
            _ => Err("it is neither a binary nor a JSON glTF file".to_owned()),
        };
    }
    let version = word(bytes, 4)?;
    if version != 2 {
        return Err(format!(
            "it is a binary glTF container of version {version}; only version 2 is read"
        ));
    }
    let length = word(bytes, 8)? as usize;
    if length > bytes.len() {
        return Err(format!(
            "it is cut short: {length} bytes are announced, {} are there",
            bytes.len()
        ));
    }
    let mut rest = bytes.get(12..length).unwrap_or_default();
    let json = chunk(&mut rest)?;
    let Some((CHUNK_JSON, json)) = json else {
        return Err("its first chunk is not JSON".to_owned());
    };
    match chunk(&mut rest)? {
        Some((CHUNK_BIN, data)) => Ok((trim(json), Some(data))),
        // Chunks of other kinds are to be ignored.
        _ => Ok((trim(json), None)),
    }
}

/// The chunks of a binary file after those that [`split`] gives, which are of unknown kinds.
pub(super) fn further_chunks(bytes: &[u8]) -> Vec<(&[u8], &[u8])> {
    let length = word(bytes, 8).unwrap_or(0) as usize;
    let mut rest = match bytes.starts_with(MAGIC) {
        true => bytes.get(12..length).unwrap_or_default(),
        false => &[],
    };
    let mut chunks = Vec::new();
    while let Ok(Some(chunk)) = chunk(&mut rest) {
        chunks.push(chunk);
    }
    let known = match chunks.get(1) {
        Some((CHUNK_BIN, _)) => 2,
        _ => 1,
    };
    chunks.split_off(known.min(chunks.len()))
}

/// JSON text without what writers put around it: a byte order mark, blanks, NUL padding.
fn trim(text: &[u8]) -> &[u8] {
    let mut text = text.trim_ascii_start();
    text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    while let Some((b'\0', rest)) = text.split_last() {
        text = rest;
    }
    text.trim_ascii()
}

/// Takes one chunk off: its type and content.
fn chunk<'a>(rest: &mut &'a [u8]) -> Read<Option<(&'a [u8], &'a [u8])>> {
    if rest.is_empty() {
        return Ok(None);
    }
    let length = word(rest, 0)? as usize;
    let end = length.saturating_add(8);
    let (Some(kind), Some(data)) = (rest.get(4..8), rest.get(8..end)) else {
        return Err(format!(
            "it is cut short: a chunk of {length} bytes has {} left",
            rest.len().saturating_sub(8)
        ));
    };
    *rest = &rest[end..];
    Ok(Some((kind, data)))
}

fn word(bytes: &[u8], at: usize) -> Read<u32> {
    match bytes.get(at..).and_then(|b| b.first_chunk()) {
        Some(b) => Ok(u32::from_le_bytes(*b)),
        None => Err("it is cut short in a header".to_owned()),
    }
}
