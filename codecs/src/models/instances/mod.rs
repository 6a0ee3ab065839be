//! `instances`: ambient obscurance of whole mesh instances, a scalar or a linear function over the
//! bounds of the mesh (`spec/instances.md`).

mod decode;
mod digest;
mod encode;
mod packed;
mod parameters;
mod quantize;
mod raw;
mod state;

use core::hash::Hasher as _;

pub use encode::Update;
pub use state::State;

pub(crate) use decode::Store;

use crate::Decoder;
use crate::container::record_type;
use crate::models::signals::Signals;
use crate::models::{Descriptor, LookupSpace, Model};
use crate::session::track::Track;

/// The model's entry in the registry.
pub(crate) const DESCRIPTOR: Descriptor = Descriptor {
    name: "instances",
    number: 4,
    record_type: record_type::INSTANCES,
    codings: &["raw", "packed"],
    spaces: &[LookupSpace::Mesh],
    read: |coding, reader| Ok(Model::Instances(Table::read(coding, reader)?)),
    track_bytes: decode::TRACK_BYTES,
};

impl Track {
    /// The table of an `instances` track; none of another model.
    pub fn instance_table(&self) -> Option<&Table> {
        let Model::Instances(table) = &self.model else {
            return None;
        };
        Some(table)
    }
}

impl Decoder {
    /// State of the `instances` tracks as of the last commit.
    pub fn instances(&self) -> &State {
        &self.session.models.instances.state
    }
}

/// Coefficients of a signal: of 1, and of x, y and z over the bounds of the mesh.
pub const COEFFICIENTS: usize = 4;

/// The four coefficients of a signal, signed and normalised: 32767 stands for 2 to the exponent.
/// A vertex attribute `snorm16x4`, or WGSL `vec2<u32>` in a storage buffer.
pub type Value = [i16; COEFFICIENTS];

/// What a track of the model declares, once: a table with an entry for each instance of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table {
    /// What the values are.
    pub signals: Signals,
    /// Entries, 1 to 2^24.
    pub count: u32,
    /// A coefficient of 32767 is two to this power, 0 to 3.
    pub exponent: u8,
    /// Step of the quantiser in 1/32767 of that, 1 to 32767.
    pub step: u16,
    /// How entries are coded.
    pub coding: Coding,
}

/// How entries are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// `raw`: keys and codes as they are.
    Raw,
    /// `packed`: entropy-coded.
    Packed,
}

/// The function that an entry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Form {
    /// One number; its other coefficients are 0.
    Scalar,
    /// Four numbers.
    Linear,
}

/// An entry as it is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// [`key`] of the path of the mesh instance.
    pub key: u64,
    /// Whether it is a scalar.
    pub form: Form,
    /// Codes of each signal, which the step multiplies; 0 where the form or the track has none.
    pub codes: [[i16; COEFFICIENTS]; 2],
}

/// The key of a mesh instance: XXH64 of its path.
pub fn key(path: &str) -> u64 {
    let mut hash = twox_hash::XxHash64::with_seed(0);
    hash.write(path.as_bytes());
    hash.finish()
}

impl Form {
    /// Coefficients of a signal that are coded.
    pub fn coefficients(self) -> usize {
        match self {
            Form::Scalar => 1,
            Form::Linear => COEFFICIENTS,
        }
    }
}

impl Table {
    /// Signals of an entry, 1 or 2.
    fn signals(&self) -> usize {
        usize::from(self.signals.count)
    }

    /// The largest magnitude of a code.
    fn most(&self) -> i32 {
        i32::from(i16::MAX) / i32::from(self.step)
    }
}

#[cfg(all(test, feature = "std"))]
mod tests;
