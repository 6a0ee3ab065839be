//! The sections of one track in a `points` payload, and how they are written into the state.

use core::ops::Range;

use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, Place, State};

pub(super) const BUCKET_BYTES: usize = 4 * BUCKET_ENTRIES;

/// Where a track's sections lie in the staged bytes.
pub(super) struct StagedTrack {
    /// Index in the state's list of places.
    pub(super) place: usize,
    /// Where its payload starts in those of the frame.
    pub(super) payload: usize,
    pub(super) keyframe: bool,
    /// Ascending indices (turned from gaps in place).
    pub(super) bucket_indices: Range<usize>,
    pub(super) buckets: Range<usize>,
    pub(super) cell_indices: Range<usize>,
    pub(super) keys: Range<usize>,
    pub(super) points: Range<usize>,
}

/// A track's sections as arrays of little-endian items.
pub(super) struct Sections<'a> {
    pub(super) bucket_indices: &'a [[u8; 4]],
    pub(super) buckets: &'a [[u8; BUCKET_BYTES]],
    pub(super) cell_indices: &'a [[u8; 4]],
    pub(super) keys: &'a [[u8; 4]],
    pub(super) points: &'a [u8],
}

impl<'a> Sections<'a> {
    pub(super) fn new(bytes: &'a [u8], staged: &StagedTrack) -> Self {
        Sections {
            bucket_indices: bytes[staged.bucket_indices.clone()].as_chunks().0,
            buckets: bytes[staged.buckets.clone()].as_chunks().0,
            cell_indices: bytes[staged.cell_indices.clone()].as_chunks().0,
            keys: bytes[staged.keys.clone()].as_chunks().0,
            points: &bytes[staged.points.clone()],
        }
    }

    pub(super) fn find_bucket(&self, index: u32) -> Option<Bucket> {
        find(self.bucket_indices, index).map(|at| bucket(&self.buckets[at]))
    }

    pub(super) fn find_cell(&self, index: u32) -> Option<usize> {
        find(self.cell_indices, index)
    }

    /// The cell at a position in the section, whose points take `size` bytes each: 2, 3 or 4.
    #[inline]
    pub(super) fn cell(&self, at: usize, size: usize) -> Cell {
        let of_cell = &self.points[at * CELL_POINTS * size..];
        let points = match size {
            2 => of_cell.first_chunk().map(points::<2, 14>),
            3 => of_cell.first_chunk().map(points::<3, 21>),
            _ => of_cell.first_chunk().map(points::<4, 28>),
        };
        Cell {
            key: word(self.keys[at]),
            points: points.unwrap_or([0; CELL_POINTS]),
        }
    }
}

/// Position of an index among ascending ones. Those of a keyframe have no gaps as a rule, and need no search.
#[inline]
fn find(indices: &[[u8; 4]], index: u32) -> Option<usize> {
    let (first, last) = (word(*indices.first()?), word(*indices.last()?));
    if (last - first) as usize + 1 == indices.len() {
        return (first..=last)
            .contains(&index)
            .then(|| (index - first) as usize);
    }
    indices.binary_search_by_key(&index, |&b| word(b)).ok()
}

pub(super) fn word(bytes: [u8; 4]) -> u32 {
    u32::from_le_bytes(bytes)
}

#[inline]
pub(super) fn bucket(bytes: &[u8; BUCKET_BYTES]) -> Bucket {
    let mut entries = [0; BUCKET_ENTRIES];
    for (entry, bytes) in entries.iter_mut().zip(bytes.as_chunks::<4>().0) {
        *entry = word(*bytes);
    }
    Bucket(entries)
}

/// The seven points of a cell, `B` bytes each, `S = 7 B` in all.
#[inline(always)]
pub(super) fn points<const B: usize, const S: usize>(cell: &[u8; S]) -> [u32; CELL_POINTS] {
    // Spelled out for each width, so that every point is one load.
    core::array::from_fn(|i| match B {
        2 => u32::from(u16::from_le_bytes([cell[2 * i], cell[2 * i + 1]])),
        // The last one from the byte before it, as the cell ends there.
        3 if 3 * i + 4 > S => {
            word([
                cell[3 * i - 1],
                cell[3 * i],
                cell[3 * i + 1],
                cell[3 * i + 2],
            ]) >> 8
        }
        3 => {
            word([
                cell[3 * i],
                cell[3 * i + 1],
                cell[3 * i + 2],
                cell[3 * i + 3],
            ]) & 0xff_ffff
        }
        _ => word([
            cell[4 * i],
            cell[4 * i + 1],
            cell[4 * i + 2],
            cell[4 * i + 3],
        ]),
    })
}

pub(super) fn apply_buckets(
    sections: &Sections<'_>,
    keyframe: bool,
    state: &mut State,
    place: &Place,
) {
    let buckets = &mut state.buckets[place.buckets()];
    let items = sections.bucket_indices.iter().zip(sections.buckets);
    let items = items.map(|(index, bytes)| (word(*index), bucket(bytes)));
    write(
        items,
        keyframe.then_some(Bucket::EMPTY),
        buckets,
        place.first_bucket,
        |start, end| {
            state.dirty_buckets.add(start, end);
        },
    );
}

pub(super) fn apply_cells<const B: usize, const S: usize>(
    sections: &Sections<'_>,
    keyframe: bool,
    state: &mut State,
    place: &Place,
) {
    let cells = &mut state.cells[place.cells()];
    let items = sections.cell_indices.iter().zip(sections.keys);
    let items = items
        .zip(sections.points.as_chunks::<S>().0)
        .map(|((index, key), points_)| {
            (
                word(*index),
                Cell {
                    key: word(*key),
                    points: points::<B, S>(points_),
                },
            )
        });
    write(
        items,
        keyframe.then_some(Cell::FREE),
        cells,
        place.first_cell,
        |start, end| {
            state.dirty_cells.add(start, end);
        },
    );
}

/// Writes items at their ascending indices. With an `empty` item all others become that. Reports
/// the runs that changed, counted from `first`.
#[inline(always)]
fn write<T: Copy>(
    items: impl Iterator<Item = (u32, T)>,
    empty: Option<T>,
    array: &mut [T],
    first: u32,
    mut dirty: impl FnMut(u32, u32),
) {
    if let Some(empty) = empty {
        let mut next = 0;
        for (index, item) in items {
            array[next..index as usize].fill(empty);
            array[index as usize] = item;
            next = index as usize + 1;
        }
        array[next..].fill(empty);
        dirty(first, first + array.len() as u32);
        return;
    }
    // An empty run at the start, which `dirty` never sees.
    let (mut start, mut end) = (0, 0);
    for (index, item) in items {
        array[index as usize] = item;
        if index != end {
            if start < end {
                dirty(first + start, first + end);
            }
            start = index;
        }
        end = index + 1;
    }
    if start < end {
        dirty(first + start, first + end);
    }
}
