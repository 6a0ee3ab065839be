//! The payload of a `vertices` record, read: decoded when it comes beside the committed values, and
//! copied over them at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::mem;
use core::ops::Range;

use super::state::{Place, Plan};
use super::{State, sections};
use crate::error::ErrorKind;
use crate::memory::reserve::reserve_bounded;
use crate::models::ModelKind;
use crate::models::payload_header::{Base, PayloadHeader, ShapeErrors};
use crate::models::state::{ModelState, PendingView, Rollback};
use crate::session::digest::StateDigest;
use crate::session::track::{self, Track, TrackState};

const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
    size: ErrorKind::VerticesSize,
    reserved: ErrorKind::VerticesReserved,
};

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Store {
    pub(crate) state: State,
    staged: Vec<Staged>,
    plan: Option<Plan>,
    work: u64,
}

/// A track of the pending frame, whose values are decoded.
struct Staged {
    /// Index in the state's list of places.
    place: usize,
    /// Where its payload starts in those of the frame.
    payload: usize,
}

impl Store {
    /// What is kept of a track beside its values.
    pub(super) const TRACK_BYTES: usize = size_of::<Place>() + size_of::<Staged>();
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
        _max_bytes: u64,
        max_tracks: usize,
    ) -> Result<(), ErrorKind> {
        match self.plan.take() {
            Some(plan) => self.state.add(tracks, plan, max_tracks),
            None => Ok(()),
        }
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.remove(removed);
    }

    fn stage(
        &mut self,
        payloads: &mut [u8],
        payload: Range<usize>,
        _base: Base,
        tracks: &mut [TrackState],
    ) -> Result<(), ErrorKind> {
        let payload_bytes = &payloads[payload.clone()];
        let mut header = PayloadHeader::read_keyframe(payload_bytes, SHAPE_ERRORS)?;
        let mut at = header.bytes();
        for i in 0..header.count {
            let entry = header.entry(payload_bytes, i, ModelKind::Vertices, tracks)?;
            let [size, reserved] = entry.numbers;
            if reserved != 0 {
                return Err(ErrorKind::VerticesReserved);
            }
            let state = &mut self.state;
            let place = state.index_of(entry.id).ok_or(ErrorKind::UnknownTrack)?;
            let Place { vertices, .. } = &state.places[place];
            let section = payload_bytes[at..].get(..size as usize);
            let section =
                section.filter(|section| section.len() as u64 == sections::bytes(vertices));
            let section = section.ok_or(ErrorKind::VerticesSize)?;
            at += section.len();
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            let values = state.places[place].values();
            sections::read(vertices, section, &mut state.next[values])?;
            self.work += state.places[place].work();
            tracks[entry.slot].staged = Some(self.staged.len() as u32);
            self.staged.push(Staged {
                place,
                payload: payload.start,
            });
        }
        if at != payload_bytes.len() {
            return Err(ErrorKind::VerticesSize);
        }
        Ok(())
    }

    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]) {
        let first = match to {
            Rollback::ToPayload(kept) => self.staged.partition_point(|s| s.payload < kept),
            Rollback::Frame => 0,
        };
        for staged in self.staged.drain(first..) {
            let id = self.state.places[staged.place].id;
            if let Some(at) = track::find(tracks, id) {
                tracks[at].staged = None;
            }
        }
    }

    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32 {
        let mut count = 0;
        for staged in self.staged.drain(..) {
            let place = &self.state.places[staged.place];
            count += place.vertices.count;
            self.work += place.work();
            self.state.apply(staged.place);
        }
        if pending.emptied {
            for track in tracks {
                if track.staged.is_none()
                    && track.filled
                    && let Some(index) = self.state.index_of(track.track.id)
                {
                    self.work += self.state.places[index].work();
                    self.state.open(index);
                }
            }
        }
        if pending.removes {
            self.state.remove(|id| track::is_removed(tracks, id));
        }
        self.state.dirty.merge();
        count
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
        match pending {
            Some(_) if track.staged.is_some() => digest.bytes(&self.state.next[place.values()]),
            Some(pending) if pending.emptied => digest.open_values(place.vertices.values()),
            _ => digest.bytes(&self.state.values[place.values()]),
        }
    }

    fn take_work(&mut self) -> u64 {
        mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        self.state.dirty.clear();
    }

    fn reset(&mut self) {
        self.staged.clear();
        self.state.reset();
    }
}
