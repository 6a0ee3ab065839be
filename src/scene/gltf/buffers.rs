//! Where the file's bytes come from: the binary chunk, data URIs and files beside it.

use super::{Read, check_file, shorten};
use ::gltf::json;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Loads every buffer of the file, or says what is wrong with it.
pub(super) fn load<'a>(
    root: &json::Root,
    blob: Option<&'a [u8]>,
    folder: Option<&Path>,
    warn: &dyn Fn(String),
) -> Vec<Read<Cow<'a, [u8]>>> {
    let load = |i: usize, buffer: &json::Buffer| -> Read<Cow<'a, [u8]>> {
        let what = format!("buffer {i}");
        let bytes = match (&buffer.uri, blob) {
            (Some(uri), _) => Cow::Owned(resolve(uri, folder, &what)?),
            (None, Some(blob)) if i == 0 => Cow::Borrowed(blob),
            (None, _) => return Err(format!("{what} has neither a URI nor a binary chunk")),
        };
        let length = buffer.byte_length.0;
        if (bytes.len() as u64) < length {
            warn(format!(
                "{what} is {length} bytes long but {} are there",
                bytes.len()
            ));
        }
        Ok(bytes)
    };
    let numbered = root.buffers.iter().enumerate();
    numbered.map(|(i, buffer)| load(i, buffer)).collect()
}

/// The bytes behind a URI: base64 data, or a file in (or below, or beside) the scene's folder.
pub(super) fn resolve(uri: &str, folder: Option<&Path>, what: &str) -> Read<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((header, payload)) = data.split_once(',') else {
            return Err(format!("the data URI of {what} has no comma"));
        };
        if !header.trim_end().ends_with(";base64") {
            return Err(format!("the data URI of {what} is not base64"));
        }
        return decode_base64(payload.as_bytes())
            .ok_or_else(|| format!("the data URI of {what} is not valid base64"));
    }
    let path = find(uri, folder, what)?;
    let failed = |e: &dyn std::fmt::Display| {
        format!("{what}: {}: {e}", shorten(&path.to_string_lossy(), 256))
    };
    std::fs::read(&path).map_err(|e| failed(&e))
}

/// Paths in `folder` that a relative URI may name, the likeliest first: percent-decoded, with the
/// separators of Windows, which some exporters write, as those of a URI, and as it stands.
pub fn uri_paths(folder: &Path, uri: &str) -> [PathBuf; 3] {
    let decoded = percent_decode(uri);
    let slashed = decoded.replace('\\', "/");
    [&decoded, slashed.trim(), uri].map(|name| folder.join(name))
}

/// The file that a URI names.
pub(super) fn find(uri: &str, folder: Option<&Path>, what: &str) -> Read<PathBuf> {
    let shown = shorten(uri, 80);
    let decoded = percent_decode(uri);
    let slashed = decoded.replace('\\', "/");
    let is_scheme = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
    let has_scheme = uri
        .split_once(':')
        .is_some_and(|(scheme, _)| !scheme.is_empty() && scheme.chars().all(is_scheme));
    let is_absolute = |path: &str| Path::new(path).is_absolute();
    if has_scheme || is_absolute(&slashed) || is_absolute(&decoded) {
        return Err(format!(
            "{what} is at {shown}; only data URIs and relative paths are read"
        ));
    }
    let Some(folder) = folder else {
        return Err(format!(
            "{what} is in the file {shown}, which cannot be looked up here"
        ));
    };
    let paths = uri_paths(folder, uri);
    let path = paths.iter().find(|path| path.is_file());
    let path = path.unwrap_or(&paths[1]);
    let failed = |e: String| format!("{what}: {}: {e}", shorten(&path.to_string_lossy(), 256));
    let metadata = std::fs::metadata(path).map_err(|e| failed(e.to_string()))?;
    check_file(&metadata).map_err(failed)?;
    Ok(path.clone())
}

fn percent_decode(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let digit = |at: usize| bytes.get(at).and_then(|b| (*b as char).to_digit(16));
        match (bytes[i], digit(i + 1), digit(i + 2)) {
            (b'%', Some(hi), Some(lo)) => {
                out.push((hi * 16 + lo) as u8);
                i += 3;
            }
            (byte, _, _) => {
                out.push(byte);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Line breaks and blanks between the letters are skipped.
fn decode_base64(text: &[u8]) -> Option<Vec<u8>> {
    let letters: Vec<u8>;
    let text = if text.iter().any(u8::is_ascii_whitespace) {
        let is_letter = |c: &u8| !c.is_ascii_whitespace();
        letters = text.iter().copied().filter(is_letter).collect();
        &letters
    } else {
        text
    };
    let text = text.strip_suffix(b"=").unwrap_or(text);
    let text = text.strip_suffix(b"=").unwrap_or(text);
    if text.len() % 4 == 1 {
        return None;
    }
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0u32;
        for c in group {
            let value = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        bits <<= 6 * (4 - group.len());
        out.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_and_percent_signs() {
        assert_eq!(decode_base64(b"").as_deref(), Some(&b""[..]));
        assert_eq!(decode_base64(b"TWFu").as_deref(), Some(&b"Man"[..]));
        assert_eq!(decode_base64(b"TWE=").as_deref(), Some(&b"Ma"[..]));
        assert_eq!(decode_base64(b"TQ==").as_deref(), Some(&b"M"[..]));
        assert_eq!(decode_base64(b"T\r\nW Fu\t").as_deref(), Some(&b"Man"[..]));
        assert_eq!(decode_base64(b"TWE*"), None);
        assert_eq!(decode_base64(b"TWFuT"), None);
        assert_eq!(percent_decode("a%20b%2"), "a b%2");
    }

    #[test]
    fn only_files_are_read() {
        for uri in ["../../../../../../../../../../../dev/zero", "."] {
            let error = resolve(uri, Some(Path::new("/tmp")), "buffer 0").unwrap_err();
            assert!(
                error.contains("name a file") || error.contains("No such"),
                "{error}"
            );
        }
    }

    #[test]
    fn other_schemes_are_refused() {
        for uri in ["http://a/b.bin", "file:///etc/passwd", "/etc/passwd"] {
            let error = resolve(uri, Some(Path::new(".")), "buffer 0").unwrap_err();
            assert!(error.contains("relative"), "{error}");
        }
    }
}
