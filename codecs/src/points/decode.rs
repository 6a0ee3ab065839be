//! The payload of a `points` record (coding `cells`), read: checked when it comes, kept packed, and
//! written into the state at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::ops::Range;

use super::state::region;
use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY, State, StateDigest};
use crate::error::Fault;
use crate::track::LiveTrack;

/// Bytes before the entries of a payload, and of an entry.
const HEAD_BYTES: usize = 16;
const ENTRY_BYTES: usize = 12;
const BUCKET_BYTES: usize = 4 * BUCKET_ENTRIES;

/// Payloads of the frame in the making, and what is in them.
#[derive(Default)]
pub(crate) struct StagedPoints {
    /// The first `used` bytes are payloads; the rest is kept from earlier frames.
    bytes: Vec<u8>,
    used: usize,
    tracks: Vec<StagedTrack>,
}

/// Where a track's sections lie in [`StagedPoints::bytes`].
struct StagedTrack {
    /// Index in the decoder's list of tracks.
    slot: usize,
    keyframe: bool,
    /// Ascending indices (turned from gaps in place).
    bucket_indices: Range<usize>,
    buckets: Range<usize>,
    cell_indices: Range<usize>,
    keys: Range<usize>,
    points: Range<usize>,
}

/// Content of a frame, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) buckets: u32,
    pub(crate) cells: u32,
}

impl StagedPoints {
    /// Bytes staged so far.
    pub(crate) fn used(&self) -> usize {
        self.used
    }

    /// Room for a payload, to be filled and then handed to [`StagedPoints::stage`].
    pub(crate) fn room(&mut self, bytes: usize) -> &mut [u8] {
        let end = self.used + bytes;
        if self.bytes.len() < end {
            self.bytes.reserve_exact(end - self.bytes.len());
            self.bytes.resize(end, 0);
        }
        &mut self.bytes[self.used..end]
    }

    /// Checks the payload in the room and keeps it. `emptied`: the frame starts from nothing.
    /// After a fault the caller must [`StagedPoints::revert`] the frame.
    pub(crate) fn stage(
        &mut self,
        bytes: usize,
        emptied: bool,
        last_frame: Option<u32>,
        state: &mut State,
        tracks: &mut [LiveTrack],
    ) -> Result<(), Fault> {
        let end = self.used + bytes;
        let payload = &self.bytes[self.used..end];
        let (count, flags, base, reserved) = match payload
            .first_chunk::<HEAD_BYTES>()
            .map(|head| head.as_chunks::<4>().0)
        {
            Some(&[a, b, c, d]) => (word(a), word(b), word(c), word(d)),
            _ => return Err(Fault::PointsSize),
        };
        let keyframe = flags == 1;
        if flags > 1 || reserved != 0 || (keyframe && base != 0) {
            return Err(Fault::PointsReserved);
        }
        if !keyframe && (emptied || last_frame != Some(base)) {
            return Err(Fault::MissingBase);
        }
        let table = HEAD_BYTES as u64 + u64::from(count) * ENTRY_BYTES as u64;
        if table > bytes as u64 {
            return Err(Fault::PointsSize);
        }
        let mut at = self.used + table as usize;
        let mut above = 0u64;
        for i in 0..count as usize {
            let entry = self.used + HEAD_BYTES + i * ENTRY_BYTES;
            let field = |k: usize| {
                let start = entry + 4 * k;
                let b = &self.bytes[start..start + 4];
                u32::from_le_bytes([b[0], b[1], b[2], b[3]])
            };
            let (id, bucket_count, cell_count) = (field(0), field(1), field(2));
            if u64::from(id) < above {
                return Err(Fault::EntryOrder);
            }
            above = u64::from(id) + 1;
            let slot = tracks.binary_search_by_key(&id, |t| t.track.id);
            let slot = slot.map_err(|_| Fault::UnknownTrack)?;
            let live = &mut tracks[slot];
            if live.removed {
                return Err(Fault::UnknownTrack);
            }
            if live.staged {
                return Err(Fault::TrackTwice);
            }
            let point_bytes = live.track.grid().widths.bits() as usize / 8 * CELL_POINTS;
            let mut section = |items: u32, item: usize| -> Result<Range<usize>, Fault> {
                let length = u64::from(items) * item as u64;
                if length > (end - at) as u64 {
                    return Err(Fault::PointsSize);
                }
                let start = at;
                at += length as usize;
                Ok(start..at)
            };
            let staged = StagedTrack {
                slot,
                keyframe,
                bucket_indices: section(bucket_count, 4)?,
                buckets: section(bucket_count, BUCKET_BYTES)?,
                cell_indices: section(cell_count, 4)?,
                keys: section(cell_count, 4)?,
                points: section(cell_count, point_bytes)?,
            };
            let padding = section((staged.points.len().wrapping_neg() & 3) as u32, 1)?;
            if self.bytes[padding].iter().any(|&b| b != 0) {
                return Err(Fault::PointsReserved);
            }
            // Marked before it is checked, so that a fault reverts it.
            live.staged = true;
            let checked = check_track(&mut self.bytes, &staged, emptied, state, live);
            self.tracks.push(staged);
            checked?;
        }
        if at != end {
            return Err(Fault::PointsSize);
        }
        self.used = end;
        Ok(())
    }

    /// Drops the frame. `emptied`: it had started from nothing.
    pub(crate) fn revert(&mut self, emptied: bool, state: &mut State, tracks: &mut [LiveTrack]) {
        for live in tracks.iter_mut() {
            if live.staged || emptied {
                let cells = region(live.first_cell, live.track.grid().cell_capacity);
                let homes = state.next_homes[cells.clone()].iter_mut();
                for (home, cell) in homes.zip(&state.cells[cells]) {
                    *home = live.hasher.home(cell.key);
                }
            }
            live.staged = false;
        }
        self.clear();
    }

    fn clear(&mut self) {
        self.used = 0;
        self.tracks.clear();
    }

    /// Writes the frame into the state. `emptied`: tracks without content become empty.
    pub(crate) fn apply(
        &mut self,
        emptied: bool,
        state: &mut State,
        tracks: &mut [LiveTrack],
    ) -> Counts {
        let mut counts = Counts::default();
        for staged in &self.tracks {
            let live = &tracks[staged.slot];
            let sections = Sections::new(&self.bytes, staged);
            counts.buckets += sections.bucket_indices.len() as u32;
            counts.cells += sections.cell_indices.len() as u32;
            apply_buckets(&sections, staged.keyframe, state, live);
            match live.track.grid().widths.bits() {
                16 => apply_cells::<2, 14>(&sections, staged.keyframe, state, live),
                24 => apply_cells::<3, 21>(&sections, staged.keyframe, state, live),
                _ => apply_cells::<4, 28>(&sections, staged.keyframe, state, live),
            }
        }
        for live in tracks.iter_mut() {
            if emptied && !live.staged {
                state.empty_track(live.track.grid(), live.first_bucket, live.first_cell);
            }
            live.staged = false;
        }
        self.clear();
        counts
    }

    /// Puts the tracks in order, as [`StagedPoints::digest_track`] needs them.
    pub(crate) fn sort(&mut self) {
        self.tracks.sort_unstable_by_key(|staged| staged.slot);
    }

    /// Adds to `digest` a track as it will be after the frame.
    pub(crate) fn digest_track(
        &self,
        slot: usize,
        live: &LiveTrack,
        emptied: bool,
        state: &State,
        digest: &mut StateDigest,
    ) {
        let grid = live.track.grid();
        let staged = self
            .tracks
            .binary_search_by_key(&slot, |staged| staged.slot);
        let staged = staged.ok().map(|at| &self.tracks[at]);
        let sections = staged.map(|staged| Sections::new(&self.bytes, staged));
        let fresh = emptied || staged.is_some_and(|staged| staged.keyframe);
        let size = grid.widths.bits() as usize / 8;
        let cell = |index: u32| {
            let found = sections
                .as_ref()
                .and_then(|s| Some((s, s.find_cell(index)?)));
            match found {
                Some((s, at)) => s.cell(at, size),
                None if fresh => Cell::FREE,
                None => state.cells[(live.first_cell + index) as usize],
            }
        };
        for index in 0..grid.bucket_count {
            let found = sections.as_ref().and_then(|s| s.find_bucket(index));
            let bucket = match found {
                Some(bucket) => bucket,
                None if fresh => Bucket::EMPTY,
                None => state.buckets[(live.first_bucket + index) as usize],
            };
            digest.bucket(index, &bucket, cell);
        }
    }
}

/// A track's sections as arrays of little-endian items.
struct Sections<'a> {
    bucket_indices: &'a [[u8; 4]],
    buckets: &'a [[u8; BUCKET_BYTES]],
    cell_indices: &'a [[u8; 4]],
    keys: &'a [[u8; 4]],
    points: &'a [u8],
}

impl<'a> Sections<'a> {
    fn new(bytes: &'a [u8], staged: &StagedTrack) -> Self {
        Sections {
            bucket_indices: bytes[staged.bucket_indices.clone()].as_chunks().0,
            buckets: bytes[staged.buckets.clone()].as_chunks().0,
            cell_indices: bytes[staged.cell_indices.clone()].as_chunks().0,
            keys: bytes[staged.keys.clone()].as_chunks().0,
            points: &bytes[staged.points.clone()],
        }
    }

    fn find_bucket(&self, index: u32) -> Option<Bucket> {
        let at = self
            .bucket_indices
            .binary_search_by_key(&index, |&b| word(b))
            .ok()?;
        Some(bucket(&self.buckets[at]))
    }

    fn find_cell(&self, index: u32) -> Option<usize> {
        self.cell_indices
            .binary_search_by_key(&index, |&b| word(b))
            .ok()
    }

    /// The cell at a position in the section, whose points take `size` bytes each.
    fn cell(&self, at: usize, size: usize) -> Cell {
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

fn word(bytes: [u8; 4]) -> u32 {
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

/// Turns gaps into indices, in place.
fn gaps_to_indices(bytes: &mut [u8], bound: u32, fault: Fault) -> Result<(), Fault> {
    let mut next = 0u64;
    for gap in bytes.as_chunks_mut::<4>().0 {
        let index = next + u64::from(word(*gap));
        if index >= u64::from(bound) {
            return Err(fault);
        }
        *gap = (index as u32).to_le_bytes();
        next = index + 1;
    }
    Ok(())
}

fn check_track(
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
    let homes = &mut state.next_homes[region(live.first_cell, grid.cell_capacity)];
    if staged.keyframe && !emptied {
        homes.fill(EMPTY);
    }
    let buckets = (!staged.keyframe && !emptied)
        .then(|| &state.buckets[region(live.first_bucket, grid.bucket_count)]);
    match grid.widths.bits() {
        16 => check_cells::<2, 14>(&sections, live, buckets, homes)?,
        24 => check_cells::<3, 21>(&sections, live, buckets, homes)?,
        _ => check_cells::<4, 28>(&sections, live, buckets, homes)?,
    }
    check_buckets(&sections, homes)
}

/// Keys inside the grid; points within their width, used ones first; free cells without points. In
/// a delta, which has `committed` buckets: cells that changed their key are no longer named by the
/// bucket of the old one.
fn check_cells<const B: usize, const S: usize>(
    sections: &Sections<'_>,
    live: &LiveTrack,
    committed: Option<&[Bucket]>,
    next_homes: &mut [u32],
) -> Result<(), Fault> {
    let grid = live.track.grid();
    // The volume is at most 2^32 - 1.
    let volume = grid.volume() as u32;
    let top = grid.widths.bits() - 1;
    let cells = sections.cell_indices.iter().zip(sections.keys);
    for ((index, key), cell) in cells.zip(sections.points.as_chunks::<S>().0) {
        let (index, key) = (word(*index), word(*key));
        if key >= volume && key != EMPTY {
            return Err(Fault::CellKey);
        }
        let points = points::<B, S>(cell);
        // Two tests over all seven points at once: a used point is its highest bit and whatever is
        // below, and after an unused one there is none.
        let mut used = 0u32;
        let mut wrong = 0u32;
        for (i, &point) in points.iter().enumerate() {
            let present = u32::from(point != 0);
            used |= present << i;
            wrong |= point >> top ^ present;
        }
        if wrong != 0 {
            return Err(Fault::PointBits);
        }
        if used & (used + 1) != 0 {
            return Err(Fault::PointCompact);
        }
        if key == EMPTY && used != 0 {
            return Err(Fault::FreeCell);
        }
        let home = live.hasher.home(key);
        let next = next_homes.get_mut(index as usize).ok_or(Fault::CellIndex)?;
        let old_home = core::mem::replace(next, home);
        if old_home != home
            && old_home != EMPTY
            && let Some(buckets) = committed
        {
            let bucket = sections
                .find_bucket(old_home)
                .unwrap_or(buckets[old_home as usize]);
            if bucket.0.contains(&index) {
                return Err(Fault::CellMoved);
            }
        }
    }
    Ok(())
}

/// Entries used first, inside the track, named once, and of cells whose key hashes here.
fn check_buckets(sections: &Sections<'_>, next_homes: &[u32]) -> Result<(), Fault> {
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
        let count = used.count_ones() as usize;
        for (i, &entry) in entries.iter().enumerate().take(count) {
            match next_homes.get(entry as usize) {
                None => return Err(Fault::BucketEntry),
                Some(&home) if home != index => return Err(Fault::EntryHash),
                Some(_) => {}
            }
            if entries[..i].contains(&entry) {
                return Err(Fault::BucketTwice);
            }
        }
    }
    Ok(())
}

fn apply_buckets(sections: &Sections<'_>, fresh: bool, state: &mut State, live: &LiveTrack) {
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

fn apply_cells<const B: usize, const S: usize>(
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
