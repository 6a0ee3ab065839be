//! `--gltf`: values in a copy of the scene.

use super::super::gltf_output::GltfOutput;
use super::super::output;
use super::source::Source;
use crate::bake::Baked;
use crate::gltf_writer::{self, Options, Target};
use crate::scene::{GltfFile, LoadOptions, Scene};
use crate::{Error, Result};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "glTF")]
pub struct GltfArgs {
    /// Write a copy of the scene with the values in it: a .glb, or a .gltf with a .bin of the same name
    /// beside it.
    #[arg(long, value_name = "FILE")]
    pub gltf: Option<PathBuf>,
    /// Where the values go.
    #[arg(long, value_name = "WHERE", default_value = "attribute")]
    pub into: Target,
    /// Texels a side of an occlusion texture.
    #[arg(long, value_name = "TEXELS", default_value = "512",
        value_parser = clap::value_parser!(u32).range(8..=8192))]
    pub texture_size: u32,
}

/// Outputs that were started.
pub struct Gltf {
    output: GltfOutput,
    options: Options,
}

/// Figures of what was written.
#[derive(Clone, Debug, Default, Serialize)]
pub struct GltfFigures {
    pub file: String,
    /// Of all files together.
    pub bytes: u64,
    /// Of the source, with the files that it names.
    pub source_bytes: u64,
    pub instances: usize,
    pub mesh_copies: usize,
    pub vertices: usize,
    pub textures: usize,
    pub gpu_instances: usize,
}

impl GltfArgs {
    /// Starts the output, if one is asked for.
    ///
    /// # Errors
    /// `Usage` for a name that does not end with .glb or .gltf; as [`NewFile::create`].
    pub fn create(&self, source: &Source) -> Result<Option<Gltf>> {
        let Some(path) = self.gltf.as_deref().filter(|_| source.file.is_some()) else {
            return Ok(None);
        };
        Ok(Some(Gltf {
            output: GltfOutput::create(path)?,
            options: Options {
                target: self.into,
                texture_side: self.texture_size,
            },
        }))
    }
}

impl Gltf {
    /// Writes the copy; what was done otherwise than asked is told as warnings.
    ///
    /// # Errors
    /// `Scene` for a source that cannot be taken apart, `Io` where the copy cannot be written.
    pub fn write(self, source: &Source, scene: &Scene, baked: &Baked) -> Result<GltfFigures> {
        let Some(file) = &source.file else {
            return Ok(GltfFigures::default());
        };
        let failed = |message| Error::Scene {
            name: source.name.clone(),
            message,
        };
        let options = LoadOptions::default();
        let opened = GltfFile::open(&file.bytes, file.folder.as_deref(), &options);
        let opened = opened.map_err(failed)?;
        let (document, written) =
            gltf_writer::write(&opened, scene, baked, self.options).map_err(failed)?;
        let path = self.output.path();
        for text in document.warnings.iter().chain(&written.notes) {
            output::warn(&format!("{}: {text}", path.display()));
        }
        if written.replaced {
            output::warn(&format!(
                "{}: attributes {} that the scene had were replaced",
                path.display(),
                gltf_writer::NAME
            ));
        }
        let path = path.display().to_string();
        let bytes = self.output.write(document)?;
        Ok(GltfFigures {
            file: path,
            bytes,
            source_bytes: source.size(),
            instances: written.instances,
            mesh_copies: written.copies,
            vertices: written.vertices,
            textures: written.textures,
            gpu_instances: written.gpu_instances,
        })
    }
}
