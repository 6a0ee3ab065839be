//! Expected content of tracks of `regions`, worked out a second time from `spec/regions.md`.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

use super::writer::{self, Region, Section, Set};
use crate::models::ExpectedState;
use crate::stream_builder::words;

/// The regions of a track.
#[derive(Clone, Debug)]
pub struct Regions {
    pub set: Set,
    /// All regions, or none.
    pub regions: Vec<Region>,
}

impl Regions {
    /// No regions.
    pub fn new(set: &Set) -> Regions {
        Regions {
            set: set.clone(),
            regions: Vec::new(),
        }
    }

    /// The section that makes the regions what `content` says.
    pub fn section(&self, content: &Content) -> Section {
        let regions = &content.regions;
        let head = match self.set.is_packed {
            true => writer::packed_head(regions),
            false => regions.iter().flat_map(Region::bytes).collect(),
        };
        let codes = if self.set.is_packed {
            let coded = writer::coded(&self.set, content.follow, regions);
            match content.whole {
                true => coded.whole(),
                false => coded.short(),
            }
        } else {
            let codes = regions
                .iter()
                .flat_map(|region| writer::codes(&region.codes));
            codes.collect()
        };
        Section {
            id: content.id,
            head,
            codes,
            ..Section::default()
        }
    }
}

impl ExpectedState for Regions {
    /// `spec/regions.md` §9.
    fn digest(&self, digest: &mut XxHash64) {
        digest.write(&words(&[self.regions.len() as u32]));
        for region in &self.regions {
            digest.write(&region.bytes());
            let values = region.codes.iter();
            let values: Vec<i32> = values.map(|code| code * i32::from(self.set.step)).collect();
            digest.write(&writer::codes(&values));
            digest.write(&[0; 2][..2 * (values.len() % 2)]);
        }
    }
}

/// What a track's regions are after a frame.
#[derive(Clone, Debug)]
pub struct Content {
    pub id: u32,
    pub regions: Vec<Region>,
    /// Classes that are predicted, where they are packed.
    pub follow: [bool; 3],
    /// With all zeros at the end of packed codes.
    pub whole: bool,
}

impl Content {
    /// Regions of a track, means predicted.
    pub fn new(id: u32, regions: Vec<Region>) -> Content {
        Content {
            id,
            regions,
            follow: [true, false, false],
            whole: false,
        }
    }
}
