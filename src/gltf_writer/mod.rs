//! Writes baked values into a copy of the glTF file that they were baked for.
//!
//! - [`json`]: JSON of which only what changes is taken apart.
//! - [`document`]: the file being changed; new data goes to the end of one buffer.
//! - [`attributes`]: values per vertex as `_AO`, and per instance for `EXT_mesh_gpu_instancing`.
//! - `colors`: values multiplied into `COLOR_0`.
//! - `occlusion`: values as a texture, drawn by `raster`.
//! - [`stream`]: a whole stream.
//!
//! Whatever the file has beyond that stays as it was, what this program does not understand included.

pub mod attributes;
mod colors;
pub mod document;
pub mod json;
mod occlusion;
mod raster;
pub mod stream;
#[cfg(test)]
mod tests;

pub use attributes::{NAME, Options, write};
pub use document::Document;
pub use json::Json;

/// Where values go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Target {
    /// The vertex attribute `_AO`.
    #[default]
    Attribute,
    /// That, and multiplied into the vertex attribute `COLOR_0`.
    Color,
    /// An occlusion texture where a mesh has coordinates for one, `_AO` elsewhere.
    Occlusion,
}

/// What was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Nodes whose meshes have values now.
    pub instances: usize,
    /// Meshes that were copied, since their instances have different values.
    pub copies: usize,
    /// Vertices with values, of all meshes.
    pub vertices: usize,
    /// Occlusion textures.
    pub textures: usize,
    /// Instances of `EXT_mesh_gpu_instancing`, each with one value.
    pub gpu_instances: usize,
    /// The file had attributes of this name before.
    pub replaced: bool,
    /// What was done otherwise than asked, one sentence each.
    pub notes: Vec<String>,
}
