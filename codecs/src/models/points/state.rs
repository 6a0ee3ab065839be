//! The decoded state of all `points` tracks: two arrays that upload to a GPU as they are.

use alloc::vec::Vec;
use core::ops::Range;

use super::{Bucket, Cell, EMPTY, Grid, Hasher};
use crate::dirty::{Buffer, Dirty, DirtyList};
use crate::error::ErrorKind;
use crate::memory::free_ranges::FreeRanges;
use crate::memory::reserve::{reserve_bounded, reserve_exact};
use crate::session::track::{Track, TrackState};

/// Dirty ranges of each array.
const MAX_DIRTY: usize = 256;

/// Where a track lies in the arrays of a [`State`].
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub(super) id: u32,
    /// The track's parameters.
    pub grid: Grid,
    /// Index of its first bucket in [`State::buckets`].
    pub first_bucket: u32,
    /// Index of its first cell in [`State::cells`].
    pub first_cell: u32,
    pub(super) hasher: Hasher,
}

impl Place {
    /// Its buckets in the arrays.
    pub(super) fn buckets(&self) -> Range<usize> {
        region(self.first_bucket, self.grid.bucket_count)
    }

    /// Steps of work that emptying it takes ([`crate::Decoder::work`]).
    pub(super) fn work(&self) -> u64 {
        let (buckets, cells) = (self.grid.bucket_count, self.grid.cell_capacity);
        state_bytes(buckets.into(), cells.into()) / 64
    }

    /// Its cells.
    pub(super) fn cells(&self) -> Range<usize> {
        region(self.first_cell, self.grid.cell_capacity)
    }
}

/// Where planned tracks will lie.
pub(super) struct Plan {
    /// First bucket and first cell of each.
    places: Vec<(u32, u32)>,
    free_buckets: FreeRanges,
    free_cells: FreeRanges,
    buckets_end: u64,
    cells_end: u64,
}

/// All buckets and cells of all tracks, as of the last commit.
///
/// A track's buckets start at the `first_bucket` of its [`Place`], its cells at the `first_cell`; a
/// bucket's entries count from `first_cell`. In every committed state each entry is inside its track and names a
/// cell whose key hashes to that bucket, so a lookup is bounded and needs no checks of its own.
#[derive(Default)]
pub struct State {
    pub(super) buckets: Vec<Bucket>,
    pub(super) cells: Vec<Cell>,
    /// The bucket that each cell's key hashes to after the pending frame, [`EMPTY`] for a free
    /// cell. Hashing runs over the cells in order, and the checks of bucket entries, which jump,
    /// read four bytes a cell. Agrees with `cells` between frames.
    pub(super) next_homes: Vec<u32>,
    /// Ids ascending.
    pub(super) places: Vec<Place>,
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

    /// Where a track lies; none where it is not of this state.
    pub fn place_of(&self, track: &TrackState) -> Option<&Place> {
        Some(&self.places[self.index_of(track.track.id)?])
    }

    pub(super) fn index_of(&self, id: u32) -> Option<usize> {
        self.places.binary_search_by_key(&id, |place| place.id).ok()
    }

    /// The buckets of a track; none where the track is not of this state.
    pub fn buckets_of(&self, track: &TrackState) -> &[Bucket] {
        self.place_of(track)
            .map_or(&[], |place| &self.buckets[place.buckets()])
    }

    /// The cells of a track, free ones too; none where the track is not of this state.
    pub fn cells_of(&self, track: &TrackState) -> &[Cell] {
        self.place_of(track)
            .map_or(&[], |place| &self.cells[place.cells()])
    }

    /// The cells that a bucket of a track names, in its order.
    pub fn cells_in<'s>(
        &'s self,
        track: &TrackState,
        bucket: &'s Bucket,
    ) -> impl Iterator<Item = &'s Cell> + use<'s> {
        let cells = self.cells_of(track);
        let used = bucket.0.iter().take_while(|&&entry| entry != EMPTY);
        used.filter_map(|&entry| cells.get(entry as usize))
    }

    /// What changed since [`crate::Decoder::clear_dirty`], at most 256 ranges of each array. A track that was
    /// added or removed counts as changed.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        let buckets = (Buffer::PointsBuckets, self.dirty_buckets.ranges());
        let cells = (Buffer::PointsCells, self.dirty_cells.ranges());
        [buckets, cells].into_iter().flat_map(|(buffer, ranges)| {
            ranges.iter().map(move |&range| Dirty {
                buffer,
                track: None,
                range,
            })
        })
    }

    pub(super) fn clear_dirty(&mut self) {
        self.dirty_buckets.clear();
        self.dirty_cells.clear();
    }

    /// Sorts and merges the dirty ranges.
    pub(super) fn merge_dirty(&mut self) {
        self.dirty_buckets.merge();
        self.dirty_cells.merge();
    }

    /// Plans places for the tracks of the model. Returns the bytes of state with them too, or none
    /// where there are more items than indices count. Nothing is reserved
    /// for them.
    pub(super) fn plan(&self, tracks: &[Track]) -> Result<(Plan, Option<u64>), ErrorKind> {
        let mut places = Vec::new();
        reserve_exact(&mut places, tracks.len())?;
        // Each track gives one range back when it is removed.
        let most = self.places.len() + tracks.len();
        let mut plan = Plan {
            places,
            free_buckets: self.free_buckets.copy(most)?,
            free_cells: self.free_cells.copy(most)?,
            buckets_end: self.buckets.len() as u64,
            cells_end: self.cells.len() as u64,
        };
        for grid in grids(tracks).map(|(_, grid)| grid) {
            let (buckets, cells) = (grid.bucket_count, grid.cell_capacity);
            let first_bucket = place(&mut plan.free_buckets, &mut plan.buckets_end, buckets);
            let first_cell = place(&mut plan.free_cells, &mut plan.cells_end, cells);
            plan.places.push((first_bucket as u32, first_cell as u32));
        }
        let counted = plan.buckets_end.max(plan.cells_end) <= u64::from(u32::MAX);
        let bytes = state_bytes(plan.buckets_end, plan.cells_end);
        Ok((plan, counted.then_some(bytes)))
    }

    /// Takes in the tracks of a plan: their buckets are empty and their cells free. There may be
    /// `most` bytes of state and `limit` tracks.
    pub(super) fn add(
        &mut self,
        tracks: &[Track],
        plan: Plan,
        most: u64,
        limit: usize,
    ) -> Result<(), ErrorKind> {
        // What an earlier stream left may be too much of one kind for this one.
        let buckets = (self.buckets.capacity() as u64).max(plan.buckets_end);
        let cells = (self.cells.capacity() as u64).max(plan.cells_end);
        if state_bytes(buckets, cells) > most {
            self.buckets.shrink_to_fit();
            self.cells.shrink_to_fit();
            self.next_homes.shrink_to_fit();
        }
        // Exact: an array that doubled would break the promise of the limit.
        let (buckets_end, cells_end) = (plan.buckets_end as usize, plan.cells_end as usize);
        let new_buckets = buckets_end - self.buckets.len();
        let new_cells = cells_end - self.cells.len();
        reserve_exact(&mut self.buckets, new_buckets)?;
        reserve_exact(&mut self.cells, new_cells)?;
        reserve_exact(&mut self.next_homes, new_cells)?;
        reserve_bounded(&mut self.places, plan.places.len(), limit)?;
        self.dirty_buckets.reserve(MAX_DIRTY)?;
        self.dirty_cells.reserve(MAX_DIRTY)?;
        // From here on nothing fails.
        self.free_buckets = plan.free_buckets;
        self.free_cells = plan.free_cells;
        self.buckets.resize(buckets_end, Bucket::EMPTY);
        self.cells.resize(cells_end, Cell::FREE);
        self.next_homes.resize(cells_end, EMPTY);
        for ((id, grid), (first_bucket, first_cell)) in grids(tracks).zip(plan.places) {
            let place = Place {
                id,
                grid: *grid,
                first_bucket,
                first_cell,
                hasher: Hasher::new(grid),
            };
            self.touch(&place);
            self.places.push(place);
        }
        self.merge_dirty();
        Ok(())
    }

    /// Empties the regions of the tracks that `removed` picks by their ids, and frees them.
    pub(super) fn remove(&mut self, removed: impl Fn(u32) -> bool) {
        for index in 0..self.places.len() {
            let place = self.places[index];
            if removed(place.id) {
                self.empty(index);
                self.free_buckets
                    .give(place.first_bucket, place.grid.bucket_count);
                self.free_cells
                    .give(place.first_cell, place.grid.cell_capacity);
            }
        }
        self.places.retain(|place| !removed(place.id));
        self.free_buckets.merge();
        self.free_cells.merge();
    }

    /// All buckets empty, all cells free.
    pub(super) fn empty(&mut self, index: usize) {
        let place = self.places[index];
        self.buckets[place.buckets()].fill(Bucket::EMPTY);
        self.cells[place.cells()].fill(Cell::FREE);
        self.next_homes[place.cells()].fill(EMPTY);
        self.touch(&place);
    }

    /// The pending frame starts with all cells of a track free.
    pub(super) fn begin_empty(&mut self, index: usize) {
        let place = self.places[index];
        self.next_homes[place.cells()].fill(EMPTY);
    }

    /// The pending frame starts with the cells that a track has.
    pub(super) fn begin_committed(&mut self, index: usize) {
        let place = &self.places[index];
        let homes = self.next_homes[place.cells()].iter_mut();
        for (home, cell) in homes.zip(&self.cells[place.cells()]) {
            *home = place.hasher.home(cell.key);
        }
    }

    /// The whole of a track is dirty.
    fn touch(&mut self, place: &Place) {
        let (buckets, cells) = (place.first_bucket, place.first_cell);
        self.dirty_buckets
            .add(buckets, buckets + place.grid.bucket_count);
        self.dirty_cells
            .add(cells, cells + place.grid.cell_capacity);
    }

    /// Forgets all tracks; keeps the memory.
    pub(super) fn reset(&mut self) {
        self.places.clear();
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

/// Bytes that count against the limit of decoded state.
pub(super) fn state_bytes(buckets: u64, cells: u64) -> u64 {
    buckets * 32 + cells * 36
}

/// The tracks of the model, with their ids.
fn grids(tracks: &[Track]) -> impl Iterator<Item = (u32, &Grid)> {
    tracks
        .iter()
        .filter_map(|track| Some((track.id, track.grid()?)))
}

/// The range of a track's region.
fn region(first: u32, count: u32) -> Range<usize> {
    first as usize..first as usize + count as usize
}
