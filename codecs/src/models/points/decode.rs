//! The payload of a `points` record (coding `cells`), read: checked when it comes, kept packed, and
//! written into the state at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::ops::Range;

use super::check::check_track;
use super::sections::{BUCKET_BYTES, Sections, StagedTrack, apply_buckets, apply_cells};
use super::state::Plan;
use super::{Bucket, CELL_POINTS, Cell, Place, State};
use crate::error::ErrorKind;
use crate::memory::reserve::reserve_bounded;
use crate::memory::sort::sort_by_key;
use crate::models::ModelKind;
use crate::models::payload_header::{Base, PayloadHeader, ShapeErrors};
use crate::models::state::{ModelState, PendingView, Rollback};
use crate::session::digest::StateDigest;
use crate::session::track::{self, Track, TrackState};

const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
    size: ErrorKind::PointsSize,
    reserved: ErrorKind::PointsReserved,
};

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Store {
    pub(crate) state: State,
    /// In the order in which the content came.
    staged: Vec<StagedTrack>,
    plan: Option<Plan>,
    /// The pending frame starts with all tracks empty.
    emptied: bool,
    work: u64,
}

impl Store {
    /// What is kept of a track: its place, and that it is staged.
    pub(super) const TRACK_BYTES: usize = size_of::<super::Place>() + size_of::<StagedTrack>();

    fn write_staged(&mut self, payloads: &[u8]) -> u32 {
        let mut cells = 0;
        sort_by_key(&mut self.staged, |staged| staged.place);
        for staged in &self.staged {
            let place = self.state.places[staged.place];
            if staged.keyframe {
                self.work += place.work();
            }
            let sections = Sections::new(payloads, staged);
            cells += sections.cell_indices.len() as u32;
            let (keyframe, state) = (staged.keyframe, &mut self.state);
            apply_buckets(&sections, keyframe, state, &place);
            match place.grid.widths.bits() {
                16 => apply_cells::<2, 14>(&sections, keyframe, state, &place),
                24 => apply_cells::<3, 21>(&sections, keyframe, state, &place),
                _ => apply_cells::<4, 28>(&sections, keyframe, state, &place),
            }
        }
        self.staged.clear();
        cells
    }

    /// Digest of a track's content as the pending frame leaves it.
    fn digest_pending(
        &self,
        place: &Place,
        staged: Option<&StagedTrack>,
        pending: PendingView<'_>,
        digest: &mut StateDigest,
    ) {
        let sections = staged.map(|staged| Sections::new(pending.payloads, staged));
        let from_empty = pending.emptied || staged.is_some_and(|staged| staged.keyframe);
        let size = place.grid.widths.bits() as usize / 8;
        let cell = |index: u32| {
            let found = sections
                .as_ref()
                .and_then(|s| Some((s, s.find_cell(index)?)));
            match found {
                Some((s, at)) => s.cell(at, size),
                None if from_empty => Cell::FREE,
                None => self.state.cells[(place.first_cell + index) as usize],
            }
        };
        for index in 0..place.grid.bucket_count {
            let found = sections.as_ref().and_then(|s| s.find_bucket(index));
            let bucket = match found {
                Some(bucket) => bucket,
                None if from_empty => Bucket::EMPTY,
                None => self.state.buckets[(place.first_bucket + index) as usize],
            };
            digest.points_bucket(index, &bucket, cell);
        }
    }
}

impl ModelState for Store {
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind> {
        let (plan, bytes) = self.state.plan(tracks)?;
        self.plan = Some(plan);
        Ok(bytes)
    }

    fn add(
        &mut self,
        tracks: &[Track],
        max_bytes: u64,
        max_tracks: usize,
    ) -> Result<(), ErrorKind> {
        match self.plan.take() {
            Some(plan) => self.state.add(tracks, plan, max_bytes, max_tracks),
            None => Ok(()),
        }
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.remove(removed);
    }

    fn begin_empty(&mut self, tracks: &[TrackState]) {
        self.emptied = true;
        for track in tracks.iter().filter(|track| track.filled) {
            if let Some(index) = self.state.index_of(track.track.id) {
                self.work += self.state.places[index].work();
                self.state.begin_empty(index);
            }
        }
    }

    fn stage(
        &mut self,
        payloads: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [TrackState],
    ) -> Result<(), ErrorKind> {
        let mut header = PayloadHeader::read(&payloads[payload.clone()], base, SHAPE_ERRORS)?;
        let end = payload.end;
        let mut at = payload.start + header.bytes();
        for i in 0..header.count {
            let entry = header.entry(&payloads[payload.clone()], i, ModelKind::Points, tracks)?;
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
                payload: payload.start,
                keyframe: header.keyframe,
                bucket_indices: section(bucket_count, 4)?,
                buckets: section(bucket_count, BUCKET_BYTES)?,
                cell_indices: section(cell_count, 4)?,
                keys: section(cell_count, 4)?,
                points: section(cell_count, point_bytes)?,
            };
            let padding = section((staged.points.len().wrapping_neg() & 3) as u32, 1)?;
            if payloads[padding].iter().any(|&b| b != 0) {
                return Err(ErrorKind::PointsReserved);
            }
            // Marked before it is checked, so that an error rolls it back.
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            let track = &mut tracks[entry.slot];
            track.staged = Some(self.staged.len() as u32);
            let checked = check_track(
                payloads,
                &staged,
                base.emptied,
                track.filled,
                &mut self.state,
            );
            self.staged.push(staged);
            checked?;
        }
        if at != end {
            return Err(ErrorKind::PointsSize);
        }
        Ok(())
    }

    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]) {
        match to {
            Rollback::ToPayload(kept) => {
                let first = self.staged.partition_point(|staged| staged.payload < kept);
                for staged in self.staged.drain(first..) {
                    let id = self.state.places[staged.place].id;
                    if let Some(at) = track::find(tracks, id) {
                        tracks[at].staged = None;
                    }
                    match self.emptied {
                        true => self.state.begin_empty(staged.place),
                        false => self.state.begin_committed(staged.place),
                    }
                }
            }
            Rollback::Frame => {
                for track in tracks {
                    if (track.staged.is_some() || (self.emptied && track.filled))
                        && let Some(index) = self.state.index_of(track.track.id)
                    {
                        self.work += self.state.places[index].work();
                        self.state.begin_committed(index);
                    }
                }
                self.staged.clear();
                self.emptied = false;
            }
        }
    }

    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32 {
        let cells = self.write_staged(pending.payloads);
        if pending.emptied {
            for track in tracks {
                if track.staged.is_none()
                    && track.filled
                    && let Some(index) = self.state.index_of(track.track.id)
                {
                    self.work += self.state.places[index].work();
                    self.state.empty(index);
                }
            }
        }
        if pending.removes {
            self.state.remove(|id| track::is_removed(tracks, id));
        }
        self.state.merge_dirty();
        self.emptied = false;
        cells
    }

    fn digest(
        &self,
        track: &TrackState,
        pending: Option<PendingView<'_>>,
        digest: &mut StateDigest,
    ) {
        let Some(place) = self.state.place_of(track) else {
            return;
        };
        digest.looked_at(place.grid.bucket_count as usize);
        match pending {
            None => {
                let buckets = &self.state.buckets[place.buckets()];
                digest.points_content(buckets, &self.state.cells[place.cells()]);
            }
            Some(pending) => {
                let staged = track.staged.map(|at| &self.staged[at as usize]);
                self.digest_pending(place, staged, pending, digest);
            }
        }
    }

    fn take_work(&mut self) -> u64 {
        core::mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        self.state.clear_dirty();
    }

    fn reset(&mut self) {
        self.staged.clear();
        self.emptied = false;
        self.state.reset();
    }
}
