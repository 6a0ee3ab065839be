//! Entries of `track` records, byte by byte: the fields that all models share, and the parameters of
//! one.

use super::Parameters;
use crate::stream_builder::{floats, words};

/// An entry of a `track` record with all its fields as they will stand there.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Size of the entry; `None` for the one that fits.
    pub size: Option<u32>,
    pub id: u32,
    pub model: u16,
    pub coding: u16,
    pub space: u8,
    pub has_hash: u8,
    /// Length of the path; `None` for the one that fits.
    pub path_length: Option<u16>,
    pub application: u64,
    pub hash: u64,
    pub aabb: [f32; 6],
    pub parameters: Parameters,
    pub path: Vec<u8>,
    /// Bytes after the path; `None` for zeros to a multiple of four.
    pub padding: Option<Vec<u8>>,
}

impl Entry {
    /// An entry of a model in one of its codings.
    pub fn of(id: u32, model: u16, coding: u16, parameters: Parameters) -> Entry {
        Entry {
            size: None,
            id,
            model,
            coding,
            space: 0,
            has_hash: 0,
            path_length: None,
            application: 0,
            hash: 0,
            aabb: [0.0, 0.0, 0.0, 2.0, 1.5, 1.0],
            parameters,
            path: b"a".to_vec(),
            padding: None,
        }
    }

    /// The bytes of the entry, with its padding.
    pub fn bytes(&self) -> Vec<u8> {
        let mut rest = Vec::new();
        rest.extend(self.id.to_le_bytes());
        rest.extend(self.model.to_le_bytes());
        rest.extend(self.coding.to_le_bytes());
        rest.extend([self.space, self.has_hash]);
        let path_length = self.path_length.unwrap_or(self.path.len() as u16);
        rest.extend(path_length.to_le_bytes());
        rest.extend(self.application.to_le_bytes());
        rest.extend(self.hash.to_le_bytes());
        rest.extend(floats(&self.aabb));
        rest.extend(self.parameters.bytes());
        rest.extend(&self.path);
        match &self.padding {
            Some(padding) => rest.extend(padding),
            None => rest.resize(rest.len().next_multiple_of(4), 0),
        }
        let size = self.size.unwrap_or(rest.len() as u32 + 4);
        [&size.to_le_bytes()[..], &rest].concat()
    }
}

/// Payload of a `track` record.
pub fn tracks(entries: &[Entry]) -> Vec<u8> {
    let mut payload = words(&[entries.len() as u32, 0]);
    payload.extend(entries.iter().flat_map(Entry::bytes));
    payload
}
