//! The payload of a `points` record (coding `cells`), read: checked when it comes, kept packed, and
//! written into the state at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::ops::Range;

use super::check::check_track;
use super::sections::{BUCKET_BYTES, Sections, StagedTrack, apply_buckets, apply_cells};
use super::state::Plan;
use super::{Bucket, CELL_POINTS, Cell, State};
use crate::content::{Base, Head, ShapeErrors};
use crate::digest::StateDigest;
use crate::error::ErrorKind;
use crate::frame::FrameInfo;
use crate::model::ModelKind;
use crate::part;
use crate::reserve::reserve_bounded;
use crate::track::{LiveTrack, Track};

const FAULTS: ShapeErrors = ShapeErrors {
    size: ErrorKind::PointsSize,
    reserved: ErrorKind::PointsReserved,
};

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Part {
    pub(crate) state: State,
    staged: Vec<StagedTrack>,
    plan: Option<Plan>,
    work: u64,
}

impl Part {
    /// What is kept of a track: its place, and that it is staged.
    pub(crate) const TRACK_BYTES: usize = size_of::<super::Place>() + size_of::<StagedTrack>();
}

impl part::Part for Part {
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind> {
        let (plan, bytes) = self.state.plan(tracks)?;
        self.plan = Some(plan);
        Ok(bytes)
    }

    fn add(&mut self, tracks: &[Track], most: u64, limit: usize) -> Result<(), ErrorKind> {
        match self.plan.take() {
            Some(plan) => self.state.add(tracks, plan, most, limit),
            None => Ok(()),
        }
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.remove(removed);
    }

    fn empty(&mut self, id: u32) {
        if let Some(index) = self.state.index_of(id) {
            self.work += self.state.places[index].work();
            self.state.empty(index);
        }
    }

    fn expect_nothing(&mut self, id: u32) {
        if let Some(index) = self.state.index_of(id) {
            self.work += self.state.places[index].work();
            self.state.expect_nothing(index);
        }
    }

    fn stage(
        &mut self,
        frame: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [LiveTrack],
    ) -> Result<(), ErrorKind> {
        let mut head = Head::read(&frame[payload.clone()], base, FAULTS)?;
        let end = payload.end;
        let mut at = payload.start + head.bytes();
        for i in 0..head.count {
            let entry = head.entry(&frame[payload.clone()], i, ModelKind::Points, tracks)?;
            let [bucket_count, cell_count] = entry.numbers;
            let place = self
                .state
                .index_of(entry.id)
                .ok_or(ErrorKind::UnknownTrack)?;
            let widths = self.state.places[place].grid.widths;
            let point_bytes = widths.bits() as usize / 8 * CELL_POINTS;
            let mut section = |items: u32, item: usize| -> Result<Range<usize>, ErrorKind> {
                let length = u64::from(items) * item as u64;
                if length > (end - at) as u64 {
                    return Err(ErrorKind::PointsSize);
                }
                let start = at;
                at += length as usize;
                Ok(start..at)
            };
            let staged = StagedTrack {
                place,
                keyframe: head.keyframe,
                bucket_indices: section(bucket_count, 4)?,
                buckets: section(bucket_count, BUCKET_BYTES)?,
                cell_indices: section(cell_count, 4)?,
                keys: section(cell_count, 4)?,
                points: section(cell_count, point_bytes)?,
            };
            let padding = section((staged.points.len().wrapping_neg() & 3) as u32, 1)?;
            if frame[padding].iter().any(|&b| b != 0) {
                return Err(ErrorKind::PointsReserved);
            }
            // Marked before it is checked, so that a fault reverts it.
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            let live = &mut tracks[entry.slot];
            live.staged = true;
            let checked = check_track(frame, &staged, base.emptied, live.filled, &mut self.state);
            self.staged.push(staged);
            checked?;
        }
        if at != end {
            return Err(ErrorKind::PointsSize);
        }
        Ok(())
    }

    fn staged(&self) -> usize {
        self.staged.len()
    }

    fn unstage(&mut self, kept: usize, emptied: bool, tracks: &mut [LiveTrack]) {
        for staged in self.staged.drain(kept..) {
            let id = self.state.places[staged.place].id;
            if let Ok(slot) = tracks.binary_search_by_key(&id, |live| live.track.id) {
                tracks[slot].staged = false;
            }
            match emptied {
                true => self.state.expect_nothing(staged.place),
                false => self.state.expect_committed(staged.place),
            }
        }
    }

    fn revert(&mut self, emptied: bool, tracks: &[LiveTrack]) {
        for live in tracks {
            if (live.staged || (emptied && live.filled))
                && let Some(index) = self.state.index_of(live.track.id)
            {
                self.work += self.state.places[index].work();
                self.state.expect_committed(index);
            }
        }
        self.staged.clear();
    }

    fn seal(&mut self) {
        self.staged.sort_unstable_by_key(|staged| staged.place);
    }

    fn apply(&mut self, frame: &[u8], info: &mut FrameInfo) {
        for staged in &self.staged {
            let place = self.state.places[staged.place];
            if staged.keyframe {
                self.work += place.work();
            }
            let sections = Sections::new(frame, staged);
            info.buckets += sections.bucket_indices.len() as u32;
            info.cells += sections.cell_indices.len() as u32;
            let (fresh, state) = (staged.keyframe, &mut self.state);
            apply_buckets(&sections, fresh, state, &place);
            match place.grid.widths.bits() {
                16 => apply_cells::<2, 14>(&sections, fresh, state, &place),
                24 => apply_cells::<3, 21>(&sections, fresh, state, &place),
                _ => apply_cells::<4, 28>(&sections, fresh, state, &place),
            }
        }
        self.staged.clear();
    }

    fn digest(&self, id: u32, digest: &mut StateDigest) {
        if let Some(index) = self.state.index_of(id) {
            let place = &self.state.places[index];
            digest.looked_at(place.grid.bucket_count as usize);
            digest.buckets(
                &self.state.buckets[place.buckets()],
                &self.state.cells[place.cells()],
            );
        }
    }

    fn digest_staged(&self, id: u32, frame: &[u8], emptied: bool, digest: &mut StateDigest) {
        let Some(index) = self.state.index_of(id) else {
            return;
        };
        let place = &self.state.places[index];
        digest.looked_at(place.grid.bucket_count as usize);
        let staged = self
            .staged
            .binary_search_by_key(&index, |staged| staged.place);
        let staged = staged.ok().map(|at| &self.staged[at]);
        let sections = staged.map(|staged| Sections::new(frame, staged));
        let fresh = emptied || staged.is_some_and(|staged| staged.keyframe);
        let size = place.grid.widths.bits() as usize / 8;
        let cell = |index: u32| {
            let found = sections
                .as_ref()
                .and_then(|s| Some((s, s.find_cell(index)?)));
            match found {
                Some((s, at)) => s.cell(at, size),
                None if fresh => Cell::FREE,
                None => self.state.cells[(place.first_cell + index) as usize],
            }
        };
        for index in 0..place.grid.bucket_count {
            let found = sections.as_ref().and_then(|s| s.find_bucket(index));
            let bucket = match found {
                Some(bucket) => bucket,
                None if fresh => Bucket::EMPTY,
                None => self.state.buckets[(place.first_bucket + index) as usize],
            };
            digest.bucket(index, &bucket, cell);
        }
    }

    fn settle(&mut self) {
        self.state.settle_dirty();
    }

    fn take_work(&mut self) -> u64 {
        core::mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        self.state.clear_dirty();
    }

    fn reset(&mut self) {
        self.staged.clear();
        self.state.reset();
    }
}
