//! Reads glTF 2.0 files, by way of the `gltf` crate's JSON types.
//!
//! The crate's accessor and buffer helpers panic on files that lie about indices and sizes, and its
//! validation refuses required extensions that we do understand. So only its JSON types are used,
//! and every index, offset and count is checked here, where the error can say what is wrong.
//!
//! A part that cannot be used is left out with a warning that names it, and the rest is loaded. Only
//! a file of which nothing can be drawn is an error.

mod accessor;
mod animations;
mod buffers;
mod container;
pub mod file;
mod hierarchy;
mod images;
mod lenient;
#[cfg(test)]
mod lenient_tests;
#[cfg(test)]
mod material_tests;
mod materials;
mod meshes;
mod meshopt;
#[cfg(test)]
mod meshopt_tests;
mod nodes;
mod skins;
#[cfg(test)]
mod tests;
mod transparency;
mod views;

pub use buffers::uri_paths;
pub use file::{Elements, File, STREAM_EXTENSION};

use super::{LoadOptions, Scene};
use crate::{Error, Result};
use ::gltf::json;
use std::cell::{Cell, RefCell};
use std::path::Path;

/// An error before the file's name is known: one sentence.
type Read<T> = std::result::Result<T, String>;

/// Files larger than this are not read.
const MAX_FILE_BYTES: u64 = 4 << 30;

/// What a file may make us hold beyond what its own bytes can describe: accessors may be shared by
/// many meshes, so a small file can name a large scene.
const SHARED_ELEMENTS: usize = 1 << 20;

/// Most warnings that are kept of one file.
const MAX_WARNINGS: usize = 64;

/// Extensions that are honoured. All others have no effect and give a warning.
const HONOURED: [&str; 12] = [
    STREAM_EXTENSION,
    "EXT_mesh_gpu_instancing",
    meshopt::NAMES[0],
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    meshopt::NAMES[1],
    "KHR_texture_transform",
];

/// Extensions that may be required and still be ignored, by a part of the name: a scene without
/// them has the same shape.
const SHAPELESS: [&str; 6] = [
    "_animation_",
    "_audio",
    "_lights_",
    "_materials_",
    "_texture_",
    "_xmp",
];

const DRACO: &str = "KHR_draco_mesh_compression";

/// Writes a file anew without compressed meshes.
const DECOMPRESS: &str = "npx @gltf-transform/cli copy IN.glb OUT.glb";

/// Commands that convert what is not read.
const CONVERTERS: [(&str, &str); 2] = [
    (DRACO, DECOMPRESS),
    (
        "KHR_texture_basisu",
        "npx @gltf-transform/cli ktxdecompress IN.glb OUT.glb",
    ),
];

/// A parsed file with its buffers.
struct Document<'a> {
    root: json::Root,
    buffers: Vec<Read<std::borrow::Cow<'a, [u8]>>>,
    decoded: meshopt::Decoded,
    folder: Option<&'a Path>,
    options: &'a LoadOptions,
    /// Vertices, triangles, keys and instances that may still be made.
    budget: Cell<usize>,
    images: images::Images,
    warnings: Warnings,
    /// Why the first piece of geometry was left out.
    lost: RefCell<Option<String>>,
}

/// Sentences about what was left out, each once.
#[derive(Default)]
struct Warnings {
    kept: RefCell<Vec<String>>,
    more: Cell<usize>,
}

impl Warnings {
    fn add(&self, text: String) {
        let mut kept = self.kept.borrow_mut();
        if kept.contains(&text) {
            return;
        }
        if kept.len() < MAX_WARNINGS {
            kept.push(text);
        } else {
            self.more.set(self.more.get() + 1);
        }
    }

    fn into_sentences(self) -> Vec<String> {
        let mut sentences = self.kept.into_inner();
        if self.more.get() > 0 {
            sentences.push(format!("{} more warnings are not shown", self.more.get()));
        }
        sentences
    }
}

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene> {
    let bytes = read_file(path)?;
    let name = path.display().to_string();
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut scene = from_bytes(&name, &bytes, Some(folder), options)?;
    if let Some(stem) = path.file_stem() {
        scene.name = stem.to_string_lossy().into_owned();
    }
    Ok(scene)
}

pub(super) fn read_file(path: &Path) -> Result<Vec<u8>> {
    let io = |source| Error::Io {
        path: path.to_owned(),
        source,
    };
    let metadata = std::fs::metadata(path).map_err(io)?;
    check_file(&metadata).map_err(|message| Error::Scene {
        name: path.display().to_string(),
        message,
    })?;
    std::fs::read(path).map_err(io)
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

pub(super) fn from_bytes(
    name: &str,
    bytes: &[u8],
    folder: Option<&Path>,
    options: &LoadOptions,
) -> Result<Scene> {
    let mut scene = read(bytes, folder, options).map_err(|message| Error::Scene {
        name: name.to_owned(),
        message,
    })?;
    scene.name = name.to_owned();
    Ok(scene)
}

fn read(bytes: &[u8], folder: Option<&Path>, options: &LoadOptions) -> Read<Scene> {
    let document = document(bytes, folder, options)?;
    let mut scene = Scene::default();
    let order = hierarchy::order(&document)?;
    nodes::read(&document, &order, &mut scene);
    materials::read(&document, &mut scene);
    images::report(&document);
    let meshes = meshes::read(&document, &order, &mut scene);
    transparency::resolve(&mut scene);
    skins::read(&document, &order, &mut scene);
    nodes::place(&document, &order, &meshes, &mut scene);
    animations::read(&document, &order, &mut scene)?;
    if scene.instances.is_empty() {
        return Err(match document.lost.into_inner() {
            Some(reason) => format!("nothing of it can be drawn: {reason}"),
            None => "the scene has no triangles".to_owned(),
        });
    }
    let mut warnings = document.warnings.into_sentences();
    warnings.append(&mut scene.warnings);
    scene.warnings = warnings;
    super::paths::shorten_paths(&mut scene);
    Ok(scene)
}

fn document<'a>(
    bytes: &'a [u8],
    folder: Option<&'a Path>,
    options: &'a LoadOptions,
) -> Read<Document<'a>> {
    let warnings = Warnings::default();
    let (text, blob) = container::split(bytes)?;
    let root = lenient::read(text, &|text| warnings.add(text))?;
    check_version_and_extensions(&root, &warnings)?;
    let buffers = buffers::load(&root, blob, folder, &|text| warnings.add(text));
    let held: usize = buffers.iter().flatten().map(|b| b.len()).sum();
    Ok(Document {
        decoded: meshopt::Decoded::new(&root),
        root,
        buffers,
        folder,
        options,
        budget: Cell::new(held.saturating_add(SHARED_ELEMENTS)),
        images: images::Images::default(),
        warnings,
        lost: RefCell::new(None),
    })
}

fn check_version_and_extensions(root: &json::Root, warnings: &Warnings) -> Read<()> {
    if !root.asset.version.starts_with("2.") && root.asset.version != "2" {
        return Err(format!(
            "it is glTF version {}; only version 2 is read",
            shorten(&root.asset.version, 16)
        ));
    }
    let required = &root.extensions_required;
    for name in root.extensions_used.iter().chain(required) {
        if HONOURED.contains(&name.as_str()) {
            continue;
        }
        let hint = conversion(name);
        let shown = shorten(name, 64);
        if required.contains(name) && !SHAPELESS.iter().any(|part| name.contains(part)) {
            return Err(format!(
                "it requires the extension {shown}, which is not supported{hint}"
            ));
        }
        warnings.add(format!("the extension {shown} has no effect{hint}"));
    }
    Ok(())
}

/// What to do about an extension that is not supported, for the end of a message.
fn conversion(extension: &str) -> String {
    match CONVERTERS.iter().find(|(known, _)| *known == extension) {
        Some((_, command)) => format!("; convert the file with `{command}`"),
        None => String::new(),
    }
}

impl Document<'_> {
    fn warn(&self, text: String) {
        self.warnings.add(text);
    }

    /// Warns about an optional part that is left out, and gives `None` for it.
    fn optional<T>(&self, part: Read<T>) -> Option<T> {
        part.map_err(|reason| self.warn(format!("{reason}; it was left out")))
            .ok()
    }

    /// Warns about geometry that is left out, and gives `None` for it.
    fn geometry<T>(&self, part: Read<T>) -> Option<T> {
        part.map_err(|reason| {
            self.lost.borrow_mut().get_or_insert(reason.clone());
            self.warn(format!("{reason}; it was left out"));
        })
        .ok()
    }

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
    if index.value() == u32::MAX as usize {
        return Err(format!("no {what} is named"));
    }
    items.get(index.value()).ok_or_else(|| {
        format!(
            "{what} {} is named but there are only {}",
            index.value(),
            items.len()
        )
    })
}

/// Text for messages: at most `most` characters, on one line.
fn shorten(text: &str, most: usize) -> String {
    let visible = |c: char| if c.is_control() { '_' } else { c };
    text.chars().take(most).map(visible).collect()
}

/// A name for messages and paths: short, and on one line.
fn clean_name(name: Option<&String>, fallback: &str, index: usize) -> String {
    match name {
        Some(name) if !name.is_empty() => shorten(name, 128).replace('/', "_"),
        _ => format!("{fallback}{index}"),
    }
}

/// The index of the one among `names` that is called `wanted`, or that has this number.
fn find_named(wanted: &str, names: &[String], noun: &str) -> Read<usize> {
    if let Some(found) = names.iter().position(|n| n == wanted) {
        return Ok(found);
    }
    if let Ok(number) = wanted.parse::<usize>()
        && number < names.len()
    {
        return Ok(number);
    }
    let wanted = shorten(wanted, 64);
    Err(match names.len() {
        0 => format!("it has no {noun} {wanted}, nor any other"),
        _ => format!("it has no {noun} {wanted}; it has {}", names.join(", ")),
    })
}

fn finite<const N: usize>(values: &[f32; N], what: &str) -> Read<()> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(format!("{what} is not a finite number"))
    }
}
