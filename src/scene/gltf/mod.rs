//! Reads glTF 2.0 files, by way of the `gltf` crate's JSON types.
//!
//! The crate's accessor and buffer helpers panic on files that lie about indices and sizes, and its
//! validation refuses required extensions that we do understand. So only its JSON types are used,
//! and every index, offset and count is checked here, where the error can say what is wrong.

mod accessor;
mod animations;
mod buffers;
mod container;
mod images;
#[cfg(test)]
mod material_tests;
mod materials;
mod meshes;
mod nodes;
mod skins;
#[cfg(test)]
mod tests;
mod transparency;

use super::Scene;
use crate::{Error, Result};
use ::gltf::json;
use std::cell::Cell;
use std::path::Path;

/// An error before the file's name is known: one sentence.
type Read<T> = std::result::Result<T, String>;

/// Files larger than this are not read.
const MAX_FILE_BYTES: u64 = 4 << 30;

/// What a file may make us hold beyond what its own bytes can describe: accessors may be shared by
/// many meshes, so a small file can name a large scene.
const SHARED_ELEMENTS: usize = 1 << 20;

/// Extensions a file may require. Others of `KHR_materials_*` only change looks that this crate
/// does not model, and are accepted with a warning.
const SUPPORTED_EXTENSIONS: [&str; 8] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// A parsed file with its buffers.
struct Document<'a> {
    root: json::Root,
    buffers: Vec<std::borrow::Cow<'a, [u8]>>,
    folder: Option<&'a Path>,
    /// Vertices, triangles, keys and instances that may still be made.
    budget: Cell<usize>,
    /// Texels that may still be decoded.
    texel_budget: Cell<u64>,
}

pub(super) fn load(path: &Path) -> Result<Scene> {
    let io = |source| Error::Io {
        path: path.to_owned(),
        source,
    };
    let metadata = std::fs::metadata(path).map_err(io)?;
    let name = path.display().to_string();
    if let Err(message) = check_file(&metadata) {
        return Err(Error::Scene { name, message });
    }
    let bytes = std::fs::read(path).map_err(io)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scene = from_bytes(&name, &bytes, Some(folder))?;
    if let Some(stem) = path.file_stem() {
        scene.name = stem.to_string_lossy().into_owned();
    }
    Ok(scene)
}

/// Refuses what is not a file of a size that can be read; a device may never end.
fn check_file(metadata: &std::fs::Metadata) -> Read<()> {
    if !metadata.is_file() {
        return Err("it is a folder or a device; name a file".to_owned());
    }
    match metadata.len() {
        size if size > MAX_FILE_BYTES => Err(format!(
            "the file has {size} bytes; at most {MAX_FILE_BYTES} are read"
        )),
        _ => Ok(()),
    }
}

pub(super) fn from_bytes(name: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Scene> {
    let mut scene = read(bytes, folder).map_err(|message| Error::Scene {
        name: name.to_owned(),
        message,
    })?;
    scene.name = name.to_owned();
    Ok(scene)
}

fn read(bytes: &[u8], folder: Option<&Path>) -> Read<Scene> {
    let (text, blob) = container::split(bytes)?;
    let root: json::Root =
        json::deserialize::from_slice(text).map_err(|e| format!("its JSON cannot be read: {e}"))?;
    let mut scene = Scene::default();
    check_version_and_extensions(&root, &mut scene.warnings)?;
    let buffers = buffers::load(&root, blob, folder)?;
    let held: usize = buffers.iter().map(|b| b.len()).sum();
    let document = Document {
        root,
        buffers,
        folder,
        budget: Cell::new(held.saturating_add(SHARED_ELEMENTS)),
        texel_budget: Cell::new(images::MAX_TEXELS),
    };
    let order = nodes::order(&document)?;
    nodes::read(&document, &order, &mut scene)?;
    materials::read(&document, &mut scene)?;
    let meshes = meshes::read(&document, &order, &mut scene)?;
    transparency::resolve(&mut scene);
    skins::read(&document, &order, &mut scene)?;
    nodes::place(&document, &order, &meshes, &mut scene)?;
    animations::read(&document, &order, &mut scene)?;
    if scene.instances.is_empty() {
        return Err("the scene has no triangles".to_owned());
    }
    super::paths::shorten_paths(&mut scene);
    Ok(scene)
}

fn check_version_and_extensions(root: &json::Root, warnings: &mut Vec<String>) -> Read<()> {
    if !root.asset.version.starts_with("2.") {
        let version: String = root.asset.version.chars().take(16).collect();
        return Err(format!(
            "it is glTF version {version}; only version 2 is read"
        ));
    }
    for extension in &root.extensions_required {
        if SUPPORTED_EXTENSIONS.contains(&extension.as_str()) {
            continue;
        }
        if extension.starts_with("KHR_materials_") {
            warnings.push(format!("{extension} is not honoured"));
            continue;
        }
        let mend = match extension.as_str() {
            "KHR_draco_mesh_compression" | "EXT_meshopt_compression" => {
                "; save the file without mesh compression"
            }
            "KHR_texture_basisu" | "EXT_texture_webp" => "; save its images as PNG or JPEG",
            _ => "",
        };
        let extension: String = extension.chars().take(64).collect();
        return Err(format!(
            "it requires the extension {extension}, which is not supported{mend}"
        ));
    }
    Ok(())
}

impl Document<'_> {
    /// Takes `count` elements from the budget.
    fn spend(&self, count: usize, what: &str) -> Read<()> {
        match self.budget.get().checked_sub(count) {
            Some(left) => {
                self.budget.set(left);
                Ok(())
            }
            None => Err(format!(
                "{what} asks for {count} elements, more than the file's data can stand for"
            )),
        }
    }
}

/// Looks an index of the file up.
fn get<'t, T>(items: &'t [T], index: json::Index<T>, what: &str) -> Read<&'t T> {
    items.get(index.value()).ok_or_else(|| {
        format!(
            "{what} {} is named but there are only {}",
            index.value(),
            items.len()
        )
    })
}

/// A name for messages and paths: short, and on one line.
fn clean_name(name: Option<&String>, fallback: &str, index: usize) -> String {
    match name {
        Some(name) if !name.is_empty() => name
            .chars()
            .take(128)
            .map(|c| if c.is_control() || c == '/' { '_' } else { c })
            .collect(),
        _ => format!("{fallback}{index}"),
    }
}

fn finite<const N: usize>(values: &[f32; N], what: &str) -> Read<()> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(format!("{what} is not a finite number"))
    }
}
