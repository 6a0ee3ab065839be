//! Inputs of a command: scenes from files or standard input, and what must not be written over.

use crate::scene::{LoadOptions, Scene, uri_paths};
use crate::{Error, Result, files};
use serde_json::Value;
use std::fs::File;
use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};

/// Most bytes of a scene that are read from standard input; no binary glTF file is larger.
const MAX_STDIN_BYTES: u64 = 1 << 32;
/// Bytes before the JSON text of a binary glTF file.
const GLB_HEADER: usize = 20;

/// Whether a path is `-`, which stands for standard input or output.
pub fn is_dash(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The name of a scene from standard input.
pub const STDIN: &str = "standard input";

/// A scene from standard input, which has no files beside it.
///
/// # Errors
/// As [`Scene::from_bytes_with`] and [`read_stdin`].
pub fn scene_from_stdin(options: &LoadOptions) -> Result<Scene> {
    Scene::from_bytes_with(STDIN, &read_stdin()?, None, options)
}

/// The bytes of a scene from standard input.
///
/// # Errors
/// `Io` where it cannot be read, `Usage` for a terminal, `Scene` for more than a scene has.
pub fn read_stdin() -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let stdin = std::io::stdin();
    if stdin.is_terminal() {
        let text = "standard input (-) is a terminal; redirect it from a file or a pipe";
        return Err(Error::Usage(text.into()));
    }
    let limited = &mut stdin.lock().take(MAX_STDIN_BYTES + 1);
    limited
        .read_to_end(&mut bytes)
        .map_err(|source| Error::Io {
            path: STDIN.into(),
            source,
        })?;
    if bytes.len() as u64 > MAX_STDIN_BYTES {
        return Err(Error::Scene {
            name: STDIN.into(),
            message: format!("it has more than {MAX_STDIN_BYTES} bytes"),
        });
    }
    Ok(bytes)
}

/// Keeps a scene's file and the files that it names from being written over.
pub fn protect_scene(path: &Path) {
    files::protect(path);
    files_of_scene(path).iter().for_each(|p| files::protect(p));
}

/// The files that a glTF file may name, whether they are there or not.
pub fn files_of_scene(path: &Path) -> Vec<PathBuf> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let json = json(path);
    let names = json.iter().flat_map(uris);
    let paths = names.flat_map(|name| uri_paths(folder, name));
    let mut paths: Vec<PathBuf> = paths.collect();
    paths.sort();
    paths.dedup();
    paths
}

/// The JSON of a glTF file; `None` where it has none.
fn json(path: &Path) -> Option<Value> {
    let mut file = File::open(path).ok()?;
    let mut head = Vec::new();
    let limited = &mut (&mut file).take(GLB_HEADER as u64);
    limited.read_to_end(&mut head).ok()?;
    let mut text = Vec::new();
    if head.starts_with(b"glTF") {
        let length: [u8; 4] = head.get(12..16)?.try_into().ok()?;
        let length = u64::from(u32::from_le_bytes(length));
        file.take(length).read_to_end(&mut text).ok()?;
    } else {
        text = head;
        file.read_to_end(&mut text).ok()?;
    }
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&text);
    let end = text.iter().rposition(|b| *b != 0)?;
    serde_json::from_slice(&text[..=end]).ok()
}

/// All `uri`s in the JSON of a scene that may name files: of buffers, images and extensions.
fn uris(json: &Value) -> Vec<&str> {
    match json {
        Value::Array(items) => items.iter().flat_map(uris).collect(),
        Value::Object(members) => members
            .iter()
            .flat_map(|(key, value)| match value {
                Value::String(uri) if key == "uri" && !uri.starts_with("data:") => vec![&uri[..]],
                _ => uris(value),
            })
            .collect(),
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::NewFile;

    #[test]
    fn files_of_a_scene_are_protected() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("maps")).expect("a folder");
        for name in ["a b.bin", "colour.png", "maps/stone.png", "other.png"] {
            std::fs::write(at(name), b"data").expect("written");
        }
        let text = r#"{"buffers":[{"uri":"a%20b.bin"}],
            "images":[{"uri":"colour.png"},{"uri":"data:,"},{"uri":"gone.png"},
            {"uri":"maps\\stone.png"}]}"#;
        let mut binary = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        binary.extend_from_slice(&(text.len() as u32).to_le_bytes());
        binary.extend_from_slice(b"JSON");
        binary.extend_from_slice(text.as_bytes());
        binary.extend_from_slice(b"\0\0\0\0BIN\0");
        for (name, bytes) in [("a.gltf", text.as_bytes()), ("a.glb", &binary)] {
            std::fs::write(at(name), bytes).expect("written");
            let json = json(&at(name)).expect("JSON");
            assert_eq!(
                uris(&json),
                ["a%20b.bin", "colour.png", "gone.png", r"maps\stone.png"]
            );
        }
        protect_scene(&at("a.gltf"));
        for name in ["a.gltf", "a b.bin", "colour.png", "maps/stone.png"] {
            assert!(NewFile::create(&at(name)).is_err(), "{name}");
        }
        for name in ["a.glb", "other.png", "gone.png"] {
            assert!(NewFile::create(&at(name)).is_ok(), "{name}");
        }
    }
}
