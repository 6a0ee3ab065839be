//! `regions`: ambient obscurance in boxes of the world, for objects that move (Sloan et al. 2013, §2.3;
//! `spec/regions.md`).

mod contexts;
mod decode;
mod digest;
mod encode;
mod packed;
mod parameters;
mod quantize;
mod raw;
mod region;
mod state;

pub use encode::Update;
pub use quantize::Content;
pub use region::{Derivatives, Form, Pair, Region};
pub use state::State;

pub(crate) use decode::Store;

use crate::Decoder;
use crate::container::record_type;
use crate::models::signals::Signals;
use crate::models::{Descriptor, LookupSpace, Model};
use crate::session::track::Track;

/// The model's entry in the registry.
pub(crate) const DESCRIPTOR: Descriptor = Descriptor {
    name: "regions",
    number: 5,
    record_type: record_type::REGIONS,
    codings: &["raw", "packed"],
    spaces: &[LookupSpace::Mesh],
    read: |coding, reader| Ok(Model::Regions(RegionSet::read(coding, reader)?)),
    track_bytes: decode::TRACK_BYTES,
};

impl Track {
    /// The parameters of a `regions` track; none of another model.
    pub fn region_set(&self) -> Option<&RegionSet> {
        let Model::Regions(set) = &self.model else {
            return None;
        };
        Some(set)
    }
}

impl Decoder {
    /// State of the `regions` tracks as of the last commit.
    pub fn regions(&self) -> &State {
        &self.session.models.regions.state
    }
}

/// Most regions of a track.
pub const MOST_REGIONS: u32 = 1 << 20;
/// Most coefficients of a region.
pub const MOST_COEFFICIENTS: usize = 7 * 9 * 2;

/// What a track of the model declares, once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionSet {
    /// What the values are.
    pub signals: Signals,
    /// Regions, 1 to [`MOST_REGIONS`].
    pub count: u32,
    /// Pairs of coefficients that all regions together may have: 1 to 63 for each region.
    pub capacity: u32,
    /// A coefficient is a value / 32767, times two to this power: 0 to 3.
    pub exponent: u8,
    /// A value is a code times this, 1 to 32767.
    pub step: u16,
    /// How regions are coded.
    pub coding: Coding,
}

/// How regions are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// `raw`: 40 bytes a region and two bytes a code.
    Raw,
    /// `packed`: codes predicted from the regions before, entropy-coded.
    Packed,
}

impl RegionSet {
    /// What a value of 1 stands for: 2^exponent / 32767.
    pub fn scale(&self) -> f32 {
        (1u32 << self.exponent.min(3)) as f32 / 32767.0
    }
}

#[cfg(all(test, feature = "std"))]
mod tests;
