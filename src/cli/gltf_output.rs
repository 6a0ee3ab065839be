//! A glTF file as an output: a .glb, or a .gltf with a .bin of the same name beside it.

use super::inputs;
use crate::files::NewFile;
use crate::gltf_writer::Document;
use crate::{Error, Result};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Files that were started.
pub struct GltfOutput {
    path: PathBuf,
    file: NewFile,
    /// The buffer beside a .gltf, and its name.
    buffer: Option<(NewFile, String)>,
}

impl GltfOutput {
    /// Starts the output.
    ///
    /// # Errors
    /// `Usage` for a name that does not end with .glb or .gltf; as [`NewFile::create`].
    pub fn create(path: &Path) -> Result<GltfOutput> {
        let extension = path.extension().unwrap_or_default();
        let is_text = extension.eq_ignore_ascii_case("gltf");
        if inputs::is_dash(path) || !(is_text || extension.eq_ignore_ascii_case("glb")) {
            return Err(Error::Usage(format!(
                "{}: name a file that ends with .glb or .gltf",
                path.display()
            )));
        }
        let buffer = match is_text {
            true => {
                let path = path.with_extension("bin");
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                Some((NewFile::create(&path)?, name.into_owned()))
            }
            false => None,
        };
        Ok(GltfOutput {
            path: path.to_owned(),
            file: NewFile::create(path)?,
            buffer,
        })
    }

    /// The path of the .glb or .gltf.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the files; returns the bytes of all together.
    ///
    /// # Errors
    /// `Invalid` for more than a .glb can hold, `Io` where a file cannot be written.
    pub fn write(mut self, document: Document) -> Result<u64> {
        let bytes = match self.buffer.take() {
            None => {
                let bytes = document.to_glb()?;
                put(self.file, &bytes)?;
                bytes.len()
            }
            Some((file, name)) => {
                let (text, buffer) = document.to_gltf(&name);
                put(file, &buffer)?;
                put(self.file, text.as_bytes())?;
                text.len() + buffer.len()
            }
        };
        Ok(bytes as u64)
    }
}

fn put(mut file: NewFile, bytes: &[u8]) -> Result<()> {
    file.write_all(bytes).map_err(|e| file.error(e))?;
    file.finish()
}
