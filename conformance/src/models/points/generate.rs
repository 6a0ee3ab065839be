//! The model `points`: its parameters, its records and what they leave.

mod bases;
mod changes;
mod content;
mod grids;
mod layout;
mod order;
mod parameters;
pub mod queries;
mod tracks;
mod widths;

use crate::generate::Draft;
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::points::frames::{WIDTHS, entry, filled, some};
use crate::models::points::writer::Part;
use crate::stream_builder::Pack;

/// Folder of these vectors.
const AREA: &str = "points";

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query too near to a threshold.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    parameters::add(drafts);
    layout::add(drafts);
    bases::add(drafts);
    content::add(drafts);
    order::add(drafts);
    widths::add(drafts);
    changes::add(drafts);
    tracks::add(drafts);
    grids::add(drafts);
    queries::add(drafts)
}

/// Content of a track of [`entry`]: the first bucket with cells 0 and 2, the last one with cells 4
/// to 11, two of each of its four cubes. First and last cells and buckets of the track are in use.
fn content(entry: &Entry) -> Part {
    let keys = [(0, 0), (2, 6)].into_iter();
    let full = [5, 5, 11, 11, 14, 14, 21, 21];
    let keys = keys.chain((4..12).zip(full));
    let cells: Vec<_> = keys
        .map(|(cell, key)| (cell, key, some(entry, cell, cell % 3)))
        .collect();
    filled(entry, &cells)
}

/// A track of customary widths with content in the first frame.
fn started(widths: [u8; 3]) -> (Frames, Entry) {
    let entry = entry(7, widths);
    let frames = Frames::new(std::slice::from_ref(&entry))
        .keyframe(&[content(&entry)])
        .commit();
    (frames, entry)
}

/// Where in a stream a part with a fault stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// In the first frame.
    Keyframe,
    /// In a delta on [`content`].
    Delta,
    /// In the second track of the first frame's record.
    SecondTrack,
    /// In the second track of a delta.
    SecondDelta,
    /// In the first frame, packed.
    Packed(Pack),
}

impl Place {
    fn name(self) -> &'static str {
        match self {
            Place::Keyframe => "keyframe",
            Place::Delta => "delta",
            Place::SecondTrack => "second-track",
            Place::SecondDelta => "second-delta",
            Place::Packed(Pack::Lz4) => "lz4",
            Place::Packed(Pack::Zstd(_)) => "zstd",
            Place::Packed(Pack::None) => "plain",
        }
    }

    fn words(self) -> &'static str {
        match self {
            Place::Keyframe => "a keyframe",
            Place::Delta => "a delta",
            Place::SecondTrack => "the second track of a keyframe",
            Place::SecondDelta => "the second track of a delta",
            Place::Packed(_) => "a packed keyframe",
        }
    }

    fn is_delta(self) -> bool {
        matches!(self, Place::Delta | Place::SecondDelta)
    }

    fn is_second(self) -> bool {
        matches!(self, Place::SecondTrack | Place::SecondDelta)
    }

    /// The track with the fault; its id is 2, and 1 that of the track before it.
    fn entry(self) -> Entry {
        let widths = match self {
            Place::Delta => WIDTHS[1],
            Place::SecondTrack => WIDTHS[2],
            _ => WIDTHS[0],
        };
        entry(2, widths)
    }

    /// The stream up to the record with the fault, the parts of it, and what the record's other
    /// parts are.
    fn stream(self) -> (Frames, Entry, Vec<Part>) {
        let (first, own) = (entry(1, WIDTHS[0]), self.entry());
        let (entries, before) = match self.is_second() {
            true => (
                vec![first.clone(), own.clone()],
                vec![filled(&first, &[(1, 3, some(&first, 9, 1))])],
            ),
            false => (vec![own.clone()], Vec::new()),
        };
        let mut frames = Frames::new(&entries);
        if let Place::Packed(pack) = self {
            frames = frames.packed(pack);
        }
        if self.is_delta() {
            let mut parts = before.clone();
            parts.push(content(&own));
            frames = frames.keyframe(&parts).commit();
        }
        (frames, own, before)
    }

    /// A stream with [`content`] altered, and the offset of its fault.
    fn with_part(self, change: impl FnOnce(&Entry, &mut Part)) -> (usize, Vec<u8>) {
        let (frames, own, mut parts) = self.stream();
        let mut part = content(&own);
        change(&own, &mut part);
        parts.push(part);
        let payload = frames.payload(!self.is_delta(), &parts);
        frames.refused(&payload)
    }

    /// A stream with the payload of [`content`] altered, and the offset of its fault.
    fn with_payload(self, change: impl FnOnce(&mut Vec<u8>, &Sections)) -> (usize, Vec<u8>) {
        let (frames, own, mut parts) = self.stream();
        parts.push(content(&own));
        let mut payload = frames.payload(!self.is_delta(), &parts);
        let sections = Sections::last(&parts);
        change(&mut payload, &sections);
        frames.refused(&payload)
    }
}

/// Offsets in a payload at which a part's sections end; all are relative to its start.
struct Sections {
    /// Offset of the part's entry in the table.
    entry: usize,
    table: usize,
    bucket_gaps: usize,
    buckets: usize,
    cell_gaps: usize,
    keys: usize,
    points: usize,
}

impl Sections {
    /// Of the last part.
    fn last(parts: &[Part]) -> Sections {
        let table = 16 + 12 * parts.len();
        let mut end = table;
        let mut sections = None;
        for part in parts {
            let (b, c) = (part.buckets.len(), part.cells.len());
            let bucket_gaps = end + 4 * b;
            let buckets = bucket_gaps + 32 * b;
            let cell_gaps = buckets + 4 * c;
            let keys = cell_gaps + 4 * c;
            let points = keys + 7 * part.point_bytes * c;
            end = points.next_multiple_of(4);
            sections = Some((bucket_gaps, buckets, cell_gaps, keys, points));
        }
        let (bucket_gaps, buckets, cell_gaps, keys, points) = sections.unwrap_or_default();
        Sections {
            entry: table - 12,
            table,
            bucket_gaps,
            buckets,
            cell_gaps,
            keys,
            points,
        }
    }
}
