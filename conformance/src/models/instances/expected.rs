//! Expected content of tracks of `instances`, worked out a second time from `spec/instances.md`.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

use super::writer::{self, Instance, Section, Table};
use crate::models::ExpectedState;
use crate::stream_builder::words;

/// The entries of a track.
#[derive(Clone, Debug)]
pub struct Entries {
    pub table: Table,
    /// None, or as many as the table has.
    pub instances: Vec<Instance>,
}

/// What a frame makes of a track.
#[derive(Clone, Debug)]
pub struct Content {
    pub id: u32,
    pub instances: Vec<Instance>,
    /// With all zeros at the end of packed entries.
    pub whole: bool,
}

impl Content {
    /// Entries of a track.
    pub fn new(id: u32, instances: Vec<Instance>) -> Content {
        Content {
            id,
            instances,
            whole: false,
        }
    }
}

impl Entries {
    /// No entries.
    pub fn new(table: &Table) -> Entries {
        Entries {
            table: table.clone(),
            instances: Vec::new(),
        }
    }

    /// The section that makes the entries what `content` says.
    pub fn section(&self, content: &Content) -> Section {
        let bytes = match self.table.is_packed {
            true => {
                let coded = writer::packed(&self.table, &content.instances);
                match content.whole {
                    true => coded.whole(),
                    false => coded.short(),
                }
            }
            false => writer::raw(&self.table, &content.instances),
        };
        Section {
            id: content.id,
            bytes,
            ..Section::default()
        }
    }
}

impl ExpectedState for Entries {
    /// `spec/instances.md` §7.
    fn digest(&self, digest: &mut XxHash64) {
        digest.write(&words(&[self.instances.len() as u32]));
        for instance in &self.instances {
            digest.write(&instance.key.to_le_bytes());
            for codes in &instance.codes[..usize::from(self.table.signals)] {
                for code in codes {
                    let value = (code * i32::from(self.table.step)) as i16;
                    digest.write(&value.to_le_bytes());
                }
            }
        }
    }
}
