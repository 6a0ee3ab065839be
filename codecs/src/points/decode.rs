//! The payload of a `points` record (coding `cells`), read: checked when it comes, kept packed, and
//! written into the state at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::ops::Range;

use super::check::check_track;
use super::sections::{BUCKET_BYTES, Sections, StagedTrack, apply_buckets, apply_cells, word};
use super::state::region;
use super::{Bucket, CELL_POINTS, Cell, State, StateDigest};
use crate::error::Fault;
use crate::room::{grown, make_room};
use crate::track::LiveTrack;

/// Bytes before the entries of a payload, and of an entry.
const HEAD_BYTES: usize = 16;
const ENTRY_BYTES: usize = 12;

/// Payloads of the frame in the making, and what is in them.
#[derive(Default)]
pub(crate) struct StagedPoints {
    /// The first `used` bytes are payloads; the rest is kept from earlier frames.
    bytes: Vec<u8>,
    used: usize,
    tracks: Vec<StagedTrack>,
}

/// Content of a frame, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) buckets: u32,
    pub(crate) cells: u32,
}

impl StagedPoints {
    /// What a track takes in the list of those that are staged.
    pub(crate) const TRACK_BYTES: usize = size_of::<StagedTrack>();

    /// Bytes staged so far.
    pub(crate) fn used(&self) -> usize {
        self.used
    }

    /// Room for a payload, to be filled and then handed to [`StagedPoints::stage`]. The frame has
    /// no more than `most` bytes.
    pub(crate) fn room(&mut self, bytes: usize, most: usize) -> &mut [u8] {
        let end = self.used + bytes;
        if self.used == 0 && self.bytes.capacity() < bytes {
            // Nothing in it to copy.
            let wanted = grown(self.bytes.capacity(), bytes, most);
            self.bytes = Vec::new();
            self.bytes.reserve_exact(wanted);
        }
        if self.bytes.len() < end {
            let more = end - self.bytes.len();
            make_room(&mut self.bytes, more, most);
            self.bytes.resize(end, 0);
        }
        &mut self.bytes[self.used..end]
    }

    /// Bytes that are reserved.
    #[cfg(test)]
    pub(super) fn room_bytes(&self) -> usize {
        self.bytes.capacity()
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
        let live_tracks = tracks.len();
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
            make_room(&mut self.tracks, 1, live_tracks);
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
            if live.staged || (emptied && live.filled) {
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
            if live.staged {
                live.filled = true;
            } else if emptied && live.filled {
                state.empty_track(live.track.grid(), live.first_bucket, live.first_cell);
                live.filled = false;
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
