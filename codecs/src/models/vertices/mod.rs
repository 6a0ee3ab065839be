//! `vertices`: ambient obscurance at the vertices of meshes (`spec/vertices.md`).

mod decode;
mod digest;
mod encode;
mod parameters;
mod quantize;
mod remap;
mod sections;
mod state;

pub use crate::models::signals::{Kernel, Signals};
pub use encode::Update;
pub use quantize::{dithered, nearest};
pub use remap::remap;
pub use state::State;

pub(crate) use decode::Store;

use crate::Decoder;
use crate::container::record_type;
use crate::models::{Descriptor, LookupSpace, Model};
use crate::session::track::Track;

/// The model's entry in the registry.
pub(crate) const DESCRIPTOR: Descriptor = Descriptor {
    name: "vertices",
    number: 3,
    record_type: record_type::VERTICES,
    codings: &["raw", "packed"],
    spaces: &[LookupSpace::Mesh],
    read: |coding, reader| Ok(Model::Vertices(Vertices::read(coding, reader)?)),
    track_bytes: decode::TRACK_BYTES,
};

/// Most vertices of a track.
pub const MOST_VERTICES: u32 = 1 << 28;

/// What a track of the model declares, once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertices {
    /// What a value is.
    pub signals: Signals,
    /// Vertices, 1 to [`MOST_VERTICES`].
    pub count: u32,
    /// Bits of a value: 8 or 5.
    pub bits: u8,
    /// Which vertex has which value: [`Vertices::FILE_ORDER`] or [`Vertices::DISTINCT_ORDER`].
    pub order: u8,
    /// How values are coded.
    pub coding: Coding,
}

/// How values of a track are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// `raw`: values as they are, 5 bits each in five.
    Raw,
    /// `packed`: the difference to the vertex before, a byte each, signal by signal: for the
    /// compression of the record.
    Packed,
}

impl Vertices {
    /// The vertices of the mesh in the order of its file.
    pub const FILE_ORDER: u8 = 0;
    /// The distinct vertices of the mesh, in the order of [`remap`].
    pub const DISTINCT_ORDER: u8 = 1;

    /// Values of a track: a signal of a vertex each.
    pub fn values(&self) -> usize {
        self.count as usize * usize::from(self.signals.count)
    }

    /// The largest code: 255 or 31.
    pub(crate) fn most(&self) -> u8 {
        ((1u32 << self.bits) - 1) as u8
    }
}

impl Track {
    /// The parameters of a `vertices` track; none of another model.
    pub fn vertices(&self) -> Option<&Vertices> {
        let Model::Vertices(vertices) = &self.model else {
            return None;
        };
        Some(vertices)
    }
}

impl Decoder {
    /// State of the `vertices` tracks as of the last commit.
    pub fn vertices(&self) -> &State {
        &self.session.models.vertices.state
    }
}

#[cfg(all(test, feature = "std"))]
mod tests;
