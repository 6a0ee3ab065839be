//! The scene of a bake and the bytes that it was read from.

use super::super::args::SceneArgs;
use super::super::{inputs, output};
use crate::bake::part;
use crate::scene::{LoadOptions, Scene};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

/// The bytes of a glTF file.
pub struct Source {
    /// For messages.
    pub name: String,
    /// `None` for the built-in scene.
    pub file: Option<Bytes>,
}

/// A file in memory.
pub struct Bytes {
    pub bytes: Vec<u8>,
    /// Where the files are that it names; `None` for standard input.
    pub folder: Option<PathBuf>,
    /// The files that it names.
    files: Vec<PathBuf>,
    /// What the scene is called.
    stem: String,
}

impl Source {
    /// Reads the file; no output can replace it or what it names from then on.
    ///
    /// # Errors
    /// `Io` where it cannot be read, `Usage` where a file is needed and there is none.
    pub fn read(args: &SceneArgs, needs_file: bool) -> Result<Source> {
        let path = &args.scene;
        if path == Path::new("hall") {
            if needs_file {
                let text = "the built-in scene is no glTF file; --gltf needs one";
                return Err(Error::Usage(text.into()));
            }
            return Ok(Source {
                name: "hall".into(),
                file: None,
            });
        }
        if inputs::is_dash(path) {
            return Ok(Source {
                name: inputs::STDIN.into(),
                file: Some(Bytes {
                    bytes: inputs::read_stdin()?,
                    folder: None,
                    files: Vec::new(),
                    stem: inputs::STDIN.into(),
                }),
            });
        }
        let bytes = Scene::read_file(path)?;
        inputs::protect_scene(path);
        let stem = path.file_stem().unwrap_or(path.as_os_str());
        Ok(Source {
            name: path.display().to_string(),
            file: Some(Bytes {
                bytes,
                folder: Some(path.parent().unwrap_or(Path::new("")).to_owned()),
                files: inputs::files_of_scene(path),
                stem: stem.to_string_lossy().into_owned(),
            }),
        })
    }

    /// The scene, for ambient obscurance alone without `colors`; its warnings are told.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub fn scene(&self, args: &SceneArgs, colors: bool) -> Result<Scene> {
        let Some(file) = &self.file else {
            return args.load(colors);
        };
        let options = LoadOptions {
            colors,
            animation: args.view.animation.clone(),
            scene: args.gltf_scene.clone(),
        };
        let folder = file.folder.as_deref();
        let mut scene = Scene::from_bytes_with(&self.name, &file.bytes, folder, &options)?;
        scene.name.clone_from(&file.stem);
        for warning in &scene.warnings {
            output::warn(&format!("{}: {warning}", scene.name));
        }
        Ok(scene)
    }

    /// Bytes of the file and of those that it names.
    pub fn size(&self) -> u64 {
        let Some(file) = &self.file else {
            return 0;
        };
        let others = file.files.iter().filter_map(|path| path.metadata().ok());
        let others = others.filter(std::fs::Metadata::is_file);
        file.bytes.len() as u64 + others.map(|metadata| metadata.len()).sum::<u64>()
    }

    /// What tells a bake of this scene with these settings from others.
    pub fn key(&self, settings: &str) -> u64 {
        let Some(file) = &self.file else {
            return part::key(self.name.as_bytes(), settings);
        };
        let mut key = part::key(&file.bytes, settings);
        for path in &file.files {
            if let Ok(bytes) = std::fs::read(path) {
                key = part::key(&bytes, &format!("{key:016x}"));
            }
        }
        key
    }
}
