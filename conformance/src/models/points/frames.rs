//! Frames of tracks of `points`.

use std::collections::BTreeMap;

use super::expected::Cells;
use super::writer::{Grid, Part, points};
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::Expected;
use crate::models::entry::Entry;
use crate::stream_builder::kind;

/// Widths of a point of 32, 24 and 16 bits that are customary.
pub const WIDTHS: [[u8; 3]; 3] = [[5, 4, 8], [4, 3, 5], [2, 2, 5]];

impl Frames {
    /// A `points` record with a keyframe of each track in it.
    pub fn keyframe(self, parts: &[Part]) -> Frames {
        self.points(true, parts)
    }

    /// A `points` record with a delta on the last frame of each track in it.
    pub fn delta(self, parts: &[Part]) -> Frames {
        self.points(false, parts)
    }

    fn points(mut self, keyframe: bool, parts: &[Part]) -> Frames {
        let payload = self.payload(keyframe, parts);
        for part in parts {
            if let Some(track) = self.pending_mut(part.id) {
                track.cells_mut().write(keyframe, part);
            }
        }
        self.content(kind::POINTS, &payload)
    }

    /// The payload that [`Frames::keyframe`] or [`Frames::delta`] would put.
    pub fn payload(&self, keyframe: bool, parts: &[Part]) -> Vec<u8> {
        points(self.base(keyframe), parts)
    }

    /// The stream with a `points` record that must be refused, all else after it as it would be,
    /// and the offset of the error: the first byte after the record's header.
    pub fn refused(self, payload: &[u8]) -> (usize, Vec<u8>) {
        self.refused_of(kind::POINTS, payload)
    }
}

impl TrackContent {
    /// The state of a track of `points`.
    ///
    /// # Panics
    /// If the track is of another model.
    pub fn cells(&self) -> &Cells {
        let Expected::Points(cells) = &self.state else {
            panic!("track {} is not of points", self.entry.id);
        };
        cells
    }

    /// As [`TrackContent::cells`], to change it.
    ///
    /// # Panics
    /// If the track is of another model.
    pub fn cells_mut(&mut self) -> &mut Cells {
        let Expected::Points(cells) = &mut self.state else {
            panic!("track {} is not of points", self.entry.id);
        };
        cells
    }
}

/// A small grid of 4 x 3 x 2 cubes, 5 buckets and room for 12 cells.
///
/// `x + 3 y + 2 z` modulo 5 is the bucket of a cube.
pub fn entry(id: u32, widths: [u8; 3]) -> Entry {
    let grid = Grid {
        widths,
        capacity: 12,
        ..Grid::default()
    };
    Entry::of_grid(id, grid)
}

/// The `i`th of many points that all differ in some field; any two fields of one differ in period.
pub fn point(entry: &Entry, i: u32) -> u32 {
    let [p, n, a] = entry.grid().widths.map(|bits| (1u32 << bits) - 1);
    entry.grid().point(
        [i & p, (i * 3 + 1) & p, (i * 5 + 2) & p],
        [(i * 7 + 1) & n, (i * 11 + 3) & n],
        (i * 37 + 5) & a,
    )
}

/// So many points from the `i`th on.
pub fn some(entry: &Entry, i: u32, count: u32) -> Vec<u32> {
    (i..i + count).map(|i| point(entry, i)).collect()
}

/// A part with cells, each named by the bucket of its key, in the order of the cells.
pub fn filled(entry: &Entry, cells: &[(u32, u32, Vec<u32>)]) -> Part {
    let mut part = Part::of(entry);
    let mut buckets: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (index, key, points) in cells {
        part = part.cell(*index, *key, points);
        buckets
            .entry(entry.grid().bucket(*key))
            .or_default()
            .push(*index);
    }
    part.buckets = buckets.into_iter().collect();
    part
}
