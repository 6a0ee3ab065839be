//! The sections of one track in a `points` payload: checked against the state, then written into it.

use core::ops::Range;

use super::state::region;
use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY, Hasher, State};
use crate::error::Fault;
use crate::track::LiveTrack;

pub(super) const BUCKET_BYTES: usize = 4 * BUCKET_ENTRIES;

/// Where a track's sections lie in the staged bytes.
pub(super) struct StagedTrack {
    /// Index in the decoder's list of tracks.
    pub(super) slot: usize,
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
        let at = self
            .bucket_indices
            .binary_search_by_key(&index, |&b| word(b))
            .ok()?;
        Some(bucket(&self.buckets[at]))
    }

    pub(super) fn find_cell(&self, index: u32) -> Option<usize> {
        self.cell_indices
            .binary_search_by_key(&index, |&b| word(b))
            .ok()
    }

    /// The cell at a position in the section, whose points take `size` bytes each.
    pub(super) fn cell(&self, at: usize, size: usize) -> Cell {
        let mut points = [0; CELL_POINTS];
        let start = at * CELL_POINTS * size;
        for (point, bytes) in points
            .iter_mut()
            .zip(self.points[start..].chunks_exact(size))
        {
            *point = bytes
                .iter()
                .rev()
                .fold(0, |word, &byte| word << 8 | u32::from(byte));
        }
        Cell {
            key: word(self.keys[at]),
            points,
        }
    }
}

pub(super) fn word(bytes: [u8; 4]) -> u32 {
    u32::from_le_bytes(bytes)
}

#[inline]
fn bucket(bytes: &[u8; BUCKET_BYTES]) -> Bucket {
    let mut entries = [0; BUCKET_ENTRIES];
    for (entry, bytes) in entries.iter_mut().zip(bytes.as_chunks::<4>().0) {
        *entry = word(*bytes);
    }
    Bucket(entries)
}

/// The seven points of a cell, `B` bytes each, `S = 7 B` in all.
#[inline(always)]
fn points<const B: usize, const S: usize>(cell: &[u8; S]) -> [u32; CELL_POINTS] {
    // Spelled out for each width, so that every point is one load.
    core::array::from_fn(|i| match B {
        2 => u32::from(u16::from_le_bytes([cell[2 * i], cell[2 * i + 1]])),
        3 => {
            let low = u16::from_le_bytes([cell[3 * i], cell[3 * i + 1]]);
            u32::from(low) | u32::from(cell[3 * i + 2]) << 16
        }
        _ => word([
            cell[4 * i],
            cell[4 * i + 1],
            cell[4 * i + 2],
            cell[4 * i + 3],
        ]),
    })
}

/// Turns gaps into indices, in place. After a fault the bytes mean nothing.
fn gaps_to_indices(bytes: &mut [u8], bound: u32, fault: Fault) -> Result<(), Fault> {
    let mut next = 0u64;
    for gap in bytes.as_chunks_mut::<4>().0 {
        let index = next + u64::from(word(*gap));
        *gap = (index as u32).to_le_bytes();
        next = index + 1;
    }
    // They ascend, so the last one is the largest.
    if next <= u64::from(bound) {
        Ok(())
    } else {
        Err(fault)
    }
}

pub(super) fn check_track(
    bytes: &mut [u8],
    staged: &StagedTrack,
    emptied: bool,
    state: &mut State,
    live: &LiveTrack,
) -> Result<(), Fault> {
    let grid = live.track.grid();
    let bucket_gaps = &mut bytes[staged.bucket_indices.clone()];
    gaps_to_indices(bucket_gaps, grid.bucket_count, Fault::BucketIndex)?;
    let cell_gaps = &mut bytes[staged.cell_indices.clone()];
    gaps_to_indices(cell_gaps, grid.cell_capacity, Fault::CellIndex)?;
    let sections = Sections::new(bytes, staged);
    let keys = &mut state.next_keys[region(live.first_cell, grid.cell_capacity)];
    if staged.keyframe && !emptied {
        keys.fill(EMPTY);
    }
    let buckets = (!staged.keyframe && !emptied)
        .then(|| &state.buckets[region(live.first_bucket, grid.bucket_count)]);
    match grid.widths.bits() {
        16 => check_cells::<2, 14>(&sections, live, buckets, keys)?,
        24 => check_cells::<3, 21>(&sections, live, buckets, keys)?,
        _ => check_cells::<4, 28>(&sections, live, buckets, keys)?,
    }
    check_buckets(&sections, &live.hasher, keys)
}

/// Keys inside the grid; points within their width, used ones first; free cells without points. In
/// a delta, which has `committed` buckets: cells that changed their key are no longer named by the
/// bucket of the old one.
fn check_cells<const B: usize, const S: usize>(
    sections: &Sections<'_>,
    live: &LiveTrack,
    committed: Option<&[Bucket]>,
    next_keys: &mut [u32],
) -> Result<(), Fault> {
    // The volume is at most 2^32 - 1.
    let volume = live.track.grid().volume() as u32;
    let cells = sections.cell_indices.iter().zip(sections.keys);
    for ((index, key), cell) in cells.zip(sections.points.as_chunks::<S>().0) {
        let (index, key) = (word(*index), word(*key));
        if key >= volume && key != EMPTY {
            return Err(Fault::CellKey);
        }
        check_points(points::<B, S>(cell), 1 << (8 * B - 1), key == EMPTY)?;
        let next = next_keys.get_mut(index as usize).ok_or(Fault::CellIndex)?;
        let old = core::mem::replace(next, key);
        if old != key
            && old != EMPTY
            && let Some(buckets) = committed
        {
            let old_home = live.hasher.bucket_of_key(old);
            let moved = key == EMPTY || live.hasher.bucket_of_key(key) != old_home;
            let named = || match sections.find_bucket(old_home) {
                Some(bucket) => bucket.0.contains(&index),
                None => buckets[old_home as usize].0.contains(&index),
            };
            if moved && named() {
                return Err(Fault::CellMoved);
            }
        }
    }
    Ok(())
}

/// Each point is 0 or has the bit `there`, no point stands after a 0, and a free cell has none.
#[inline(always)]
fn check_points(points: [u32; CELL_POINTS], there: u32, free: bool) -> Result<(), Fault> {
    // Without branches, since how many points a cell has is anyone's guess. `p | -p` has the bit if
    // p is not 0; then p must have it, and so must the point before.
    let mut before = if free { 0 } else { there };
    let mut wrong = 0;
    for point in points {
        wrong |= (point | point.wrapping_neg()) & !(point & before);
        before = point;
    }
    if wrong & there == 0 {
        return Ok(());
    }
    if points.iter().any(|&p| p != 0 && p & there == 0) {
        return Err(Fault::PointBits);
    }
    let used = points.iter().take_while(|&&p| p != 0).count();
    if points[used..].iter().any(|&p| p != 0) {
        return Err(Fault::PointCompact);
    }
    Err(Fault::FreeCell)
}

/// Entries used first, inside the track, named once, and of cells whose key hashes here.
fn check_buckets(sections: &Sections<'_>, hasher: &Hasher, next_keys: &[u32]) -> Result<(), Fault> {
    for (index, bytes) in sections.bucket_indices.iter().zip(sections.buckets) {
        let index = word(*index);
        let Bucket(entries) = bucket(bytes);
        let mut used = 0u32;
        for (i, &entry) in entries.iter().enumerate() {
            used |= u32::from(entry != EMPTY) << i;
        }
        if used & (used + 1) != 0 {
            return Err(Fault::BucketCompact);
        }
        let twice = names_twice(&entries);
        let count = used.count_ones() as usize;
        for (i, &entry) in entries.iter().enumerate().take(count) {
            match next_keys.get(entry as usize) {
                None => return Err(Fault::BucketEntry),
                Some(&key) if key == EMPTY || hasher.bucket_of_key(key) != index => {
                    return Err(Fault::EntryHash);
                }
                Some(_) => {}
            }
            if twice && entries[..i].contains(&entry) {
                return Err(Fault::BucketTwice);
            }
        }
    }
    Ok(())
}

/// Whether two used entries are equal. Every entry against those one to four places on, all round,
/// is every pair, in four steps of eight lanes.
#[inline(always)]
fn names_twice(entries: &[u32; BUCKET_ENTRIES]) -> bool {
    let mut twice = 0;
    for shift in 1..=BUCKET_ENTRIES / 2 {
        for i in 0..BUCKET_ENTRIES {
            let same = entries[i] == entries[(i + shift) % BUCKET_ENTRIES];
            twice |= u32::from(same & (entries[i] != EMPTY));
        }
    }
    twice != 0
}

pub(super) fn apply_buckets(
    sections: &Sections<'_>,
    fresh: bool,
    state: &mut State,
    live: &LiveTrack,
) {
    let buckets = &mut state.buckets[region(live.first_bucket, live.track.grid().bucket_count)];
    let items = sections.bucket_indices.iter().zip(sections.buckets);
    let items = items.map(|(index, bytes)| (word(*index), bucket(bytes)));
    write(
        items,
        fresh.then_some(Bucket::EMPTY),
        buckets,
        live.first_bucket,
        |start, end| {
            state.dirty_buckets.add(start, end);
        },
    );
}

pub(super) fn apply_cells<const B: usize, const S: usize>(
    sections: &Sections<'_>,
    fresh: bool,
    state: &mut State,
    live: &LiveTrack,
) {
    let cells = &mut state.cells[region(live.first_cell, live.track.grid().cell_capacity)];
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
        fresh.then_some(Cell::FREE),
        cells,
        live.first_cell,
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
