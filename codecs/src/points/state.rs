//! The decoded state of all `points` tracks: two arrays that upload to a GPU as they are.

use alloc::vec::Vec;
use core::hash::Hasher as _;

use super::{Bucket, Cell, EMPTY, Grid};
use crate::error::{Failure, Fault, Limit};
use crate::ranges::FreeRanges;
use crate::track::{LiveTrack, Track};
use crate::transforms::Transform;

/// Runs of dirty items that are closer than this become one: a small gap costs less than a second
/// upload call.
const MERGE_GAP: u32 = 64;
/// Above this many runs, neighbours are merged with ever larger gaps.
const MAX_RANGES: usize = 256;

/// Items `start..end` of an array that changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirtyRange {
    /// First item.
    pub start: u32,
    /// One past the last item.
    pub end: u32,
}

/// All buckets and cells of all tracks, as of the last commit.
///
/// A track's buckets start at its `first_bucket`, its cells at its `first_cell`; a bucket's entries
/// count from `first_cell`. In every committed state each entry is inside its track and names a
/// cell whose key hashes to that bucket, so a lookup is bounded and needs no checks of its own.
#[derive(Default)]
pub struct State {
    pub(super) buckets: Vec<Bucket>,
    pub(super) cells: Vec<Cell>,
    /// The bucket that each cell's key hashes to after the frame in the making, [`EMPTY`] for a free
    /// cell. Hashing runs over the cells in order, and the checks of bucket entries, which jump,
    /// read four bytes a cell. Agrees with `cells` between frames.
    pub(super) next_homes: Vec<u32>,
    free_buckets: FreeRanges,
    free_cells: FreeRanges,
    pub(super) dirty_buckets: DirtyList,
    pub(super) dirty_cells: DirtyList,
}

impl State {
    /// Buckets of all tracks.
    pub fn buckets(&self) -> &[Bucket] {
        &self.buckets
    }

    /// Cells of all tracks.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// The buckets of a track; none where the track is not of this state.
    pub fn buckets_of(&self, live: &LiveTrack) -> &[Bucket] {
        part(
            &self.buckets,
            live.first_bucket,
            live.track.grid().bucket_count,
        )
    }

    /// The cells of a track, free ones too; none where the track is not of this state.
    pub fn cells_of(&self, live: &LiveTrack) -> &[Cell] {
        part(
            &self.cells,
            live.first_cell,
            live.track.grid().cell_capacity,
        )
    }

    /// The cells that a bucket of a track names, in its order.
    pub fn cells_in<'s>(
        &'s self,
        live: &LiveTrack,
        bucket: &'s Bucket,
    ) -> impl Iterator<Item = &'s Cell> + use<'s> {
        let cells = self.cells_of(live);
        let used = bucket.0.iter().take_while(|&&entry| entry != EMPTY);
        used.filter_map(|&entry| cells.get(entry as usize))
    }

    /// Buckets that changed since [`crate::Decoder::clear_dirty`]: ascending, merged, few. A track
    /// that was added or removed counts as changed.
    pub fn dirty_buckets(&self) -> &[DirtyRange] {
        &self.dirty_buckets.ranges
    }

    /// Cells that changed since [`crate::Decoder::clear_dirty`].
    pub fn dirty_cells(&self) -> &[DirtyRange] {
        &self.dirty_cells.ranges
    }

    pub(crate) fn clear_dirty(&mut self) {
        self.dirty_buckets.ranges.clear();
        self.dirty_cells.ranges.clear();
    }

    /// Sorts and merges the dirty ranges.
    pub(crate) fn settle_dirty(&mut self) {
        self.dirty_buckets.settle();
        self.dirty_cells.settle();
    }

    /// Room for tracks, whose buckets are empty and cells free. Returns the first bucket and the
    /// first cell of each; on a failure nothing has changed and nothing was reserved.
    pub(crate) fn add_tracks(
        &mut self,
        tracks: &[Track],
        limit: u64,
    ) -> Result<Vec<(u32, u32)>, Failure> {
        let mut places = Vec::with_capacity(tracks.len());
        if tracks.is_empty() {
            return Ok(places);
        }
        let mut free_buckets = self.free_buckets.clone();
        let mut free_cells = self.free_cells.clone();
        let mut buckets_end = self.buckets.len() as u64;
        let mut cells_end = self.cells.len() as u64;
        for grid in tracks.iter().map(Track::grid) {
            let first_bucket = place(&mut free_buckets, &mut buckets_end, grid.bucket_count);
            let first_cell = place(&mut free_cells, &mut cells_end, grid.cell_capacity);
            let asked = buckets_end * 32 + cells_end * 36;
            if asked > limit || buckets_end.max(cells_end) > u64::from(u32::MAX) {
                return Err(Failure::limit(
                    Fault::StateLimit,
                    Limit::StateBytes,
                    asked,
                    limit,
                ));
            }
            places.push((first_bucket as u32, first_cell as u32));
        }
        self.free_buckets = free_buckets;
        self.free_cells = free_cells;
        // What an earlier stream left may be too much of one kind for this one.
        let buckets = (self.buckets.capacity() as u64).max(buckets_end);
        let cells = (self.cells.capacity() as u64).max(cells_end);
        if buckets * 32 + cells * 36 > limit {
            self.buckets.shrink_to_fit();
            self.cells.shrink_to_fit();
            self.next_homes.shrink_to_fit();
        }
        // Exact: an array that doubled would break the promise of the limit.
        let new_buckets = buckets_end as usize - self.buckets.len();
        let new_cells = cells_end as usize - self.cells.len();
        self.buckets.reserve_exact(new_buckets);
        self.cells.reserve_exact(new_cells);
        self.next_homes.reserve_exact(new_cells);
        self.buckets.resize(buckets_end as usize, Bucket::EMPTY);
        self.cells.resize(cells_end as usize, Cell::FREE);
        self.next_homes.resize(cells_end as usize, EMPTY);
        for (grid, &(first_bucket, first_cell)) in tracks.iter().map(Track::grid).zip(&places) {
            self.touch(grid, first_bucket, first_cell);
        }
        self.settle_dirty();
        Ok(places)
    }

    /// Empties a track's region and gives it back.
    pub(crate) fn remove_track(&mut self, grid: &Grid, first_bucket: u32, first_cell: u32) {
        self.empty_track(grid, first_bucket, first_cell);
        self.free_buckets.give(first_bucket, grid.bucket_count);
        self.free_cells.give(first_cell, grid.cell_capacity);
    }

    /// All buckets empty, all cells free.
    pub(crate) fn empty_track(&mut self, grid: &Grid, first_bucket: u32, first_cell: u32) {
        let buckets = region(first_bucket, grid.bucket_count);
        let cells = region(first_cell, grid.cell_capacity);
        self.buckets[buckets].fill(Bucket::EMPTY);
        self.cells[cells.clone()].fill(Cell::FREE);
        self.next_homes[cells].fill(EMPTY);
        self.touch(grid, first_bucket, first_cell);
    }

    /// The frame in the making starts with all cells of a track free.
    pub(crate) fn expect_nothing(&mut self, grid: &Grid, first_cell: u32) {
        self.next_homes[region(first_cell, grid.cell_capacity)].fill(EMPTY);
    }

    /// The whole of a track is dirty.
    fn touch(&mut self, grid: &Grid, first_bucket: u32, first_cell: u32) {
        self.dirty_buckets
            .add(first_bucket, first_bucket + grid.bucket_count);
        self.dirty_cells
            .add(first_cell, first_cell + grid.cell_capacity);
    }

    /// Forgets all tracks; keeps the memory.
    pub(crate) fn reset(&mut self) {
        self.buckets.clear();
        self.cells.clear();
        self.next_homes.clear();
        self.free_buckets.clear();
        self.free_cells.clear();
        self.clear_dirty();
    }
}

/// A free range of `length` items, or the end of the array, which moves on.
fn place(free: &mut FreeRanges, end: &mut u64, length: u32) -> u64 {
    if let Some(start) = free.take(length) {
        return start.into();
    }
    let start = *end;
    *end += u64::from(length);
    start
}

/// A track's region, or nothing where it is not all there.
fn part<T>(items: &[T], first: u32, count: u32) -> &[T] {
    let from = items.get(first as usize..).unwrap_or(&[]);
    from.get(..count as usize).unwrap_or(&[])
}

/// The range of a track's region.
pub(super) fn region(first: u32, count: u32) -> core::ops::Range<usize> {
    first as usize..first as usize + count as usize
}

/// Ranges that changed, in the order they came; settled into ascending order.
#[derive(Default)]
pub(super) struct DirtyList {
    ranges: Vec<DirtyRange>,
}

impl DirtyList {
    /// Adds `start..end`, growing the last range if it is near and before.
    #[inline]
    pub(super) fn add(&mut self, start: u32, end: u32) {
        if let Some(last) = self.ranges.last_mut()
            && start >= last.start
            && start <= last.end.saturating_add(MERGE_GAP)
        {
            last.end = last.end.max(end);
            return;
        }
        if self.ranges.len() >= 4 * MAX_RANGES {
            self.settle();
        }
        self.ranges.push(DirtyRange { start, end });
    }

    fn settle(&mut self) {
        if self.ranges.len() < 2 {
            return;
        }
        self.ranges.sort_unstable_by_key(|r| (r.start, r.end));
        let mut gap = MERGE_GAP;
        loop {
            self.ranges.dedup_by(|next, kept| {
                let near = next.start <= kept.end.saturating_add(gap);
                if near {
                    kept.end = kept.end.max(next.end);
                }
                near
            });
            if self.ranges.len() <= MAX_RANGES {
                return;
            }
            gap = gap.saturating_mul(4);
        }
    }
}

/// Computes the digest of a state track by track, in ascending order of id (`spec/points.md`,
/// state digest). It covers what a lookup can reach and not where cells happen to lie, so a
/// server with an allocation of its own gets the same number.
pub struct StateDigest(twox_hash::XxHash64);

impl Default for StateDigest {
    fn default() -> Self {
        StateDigest::new()
    }
}

impl StateDigest {
    /// A digest of no tracks.
    pub fn new() -> StateDigest {
        StateDigest(twox_hash::XxHash64::with_seed(0))
    }

    /// Adds a track: its id, its last transform, its buckets and its cells.
    pub fn track(
        &mut self,
        id: u32,
        transform: Option<&Transform>,
        buckets: &[Bucket],
        cells: &[Cell],
    ) {
        self.header(id, transform);
        for (index, bucket) in buckets.iter().enumerate() {
            self.bucket(index as u32, bucket, |c| {
                cells.get(c as usize).copied().unwrap_or(Cell::FREE)
            });
        }
    }

    pub(crate) fn header(&mut self, id: u32, transform: Option<&Transform>) {
        self.0.write(&id.to_le_bytes());
        self.0.write(&u32::from(transform.is_some()).to_le_bytes());
        for value in transform
            .copied()
            .unwrap_or(Transform::ZERO)
            .world_from_grid
            .as_flattened()
        {
            self.0.write(&value.to_le_bytes());
        }
    }

    /// A bucket that names a cell; an empty one adds nothing.
    pub(super) fn bucket(&mut self, index: u32, bucket: &Bucket, cell: impl Fn(u32) -> Cell) {
        let used = bucket.0.iter().take_while(|&&entry| entry != EMPTY);
        let count = used.clone().count() as u32;
        if count == 0 {
            return;
        }
        self.0.write(&index.to_le_bytes());
        self.0.write(&count.to_le_bytes());
        for &entry in used {
            let Cell { key, points } = cell(entry);
            self.0.write(&key.to_le_bytes());
            for point in points {
                self.0.write(&point.to_le_bytes());
            }
        }
    }

    /// The digest.
    pub fn finish(&self) -> u64 {
        self.0.finish()
    }
}
