//! What the baked models share: every record of theirs is a keyframe, and replaces the content of a
//! track as a whole. A section is decoded when it comes, beside the committed content, and takes its
//! place at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::mem;
use core::ops::Range;

use crate::error::ErrorKind;
use crate::memory::reserve::reserve_bounded;
use crate::models::ModelKind;
use crate::models::payload_header::{Base, PayloadHeader, ShapeErrors};
use crate::models::state::{ModelState, PendingView, Rollback};
use crate::session::digest::StateDigest;
use crate::session::track::{self, Track, TrackState};

/// The decoded state of a baked model. Tracks have indices, which stay until one is removed.
pub(crate) trait BakedState: Default {
    const MODEL: ModelKind;
    const SHAPE_ERRORS: ShapeErrors;
    /// Where added tracks will lie.
    type Plan;

    /// As [`ModelState::plan`], with the plan itself.
    fn plan(&self, tracks: &[Track]) -> Result<(Self::Plan, Option<u64>), ErrorKind>;

    /// As [`ModelState::add`]. There may be `max_tracks` tracks.
    fn add(
        &mut self,
        tracks: &[Track],
        plan: Self::Plan,
        max_tracks: usize,
    ) -> Result<(), ErrorKind>;

    /// As [`ModelState::remove`].
    fn remove(&mut self, removed: &dyn Fn(u32) -> bool);

    /// Index of the track of an id.
    fn index_of(&self, id: u32) -> Option<usize>;

    /// Id of the track of an index.
    fn id_of(&self, index: usize) -> u32;

    /// Decodes a section into the pending content of a track, and adds its steps to `work`. After an
    /// error the caller discards the content.
    fn read(&mut self, index: usize, section: &[u8], work: &mut u64) -> Result<(), ErrorKind>;

    /// Drops the pending content of a track.
    fn discard(&mut self, index: usize);

    /// Makes the pending content of a track the committed one, and adds its steps to `work`. Returns how
    /// many items it has.
    fn apply(&mut self, index: usize, work: &mut u64) -> u32;

    /// Makes a track as one without content, and adds its steps to `work`.
    fn empty(&mut self, index: usize, work: &mut u64);

    /// All of a frame is applied.
    fn end_commit(&mut self) {}

    /// Adds a track's content to `digest`.
    fn digest(&self, index: usize, content: Content, digest: &mut StateDigest);

    /// What changed has been uploaded.
    fn clear_dirty(&mut self);
}

/// Which content of a track.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Content {
    Committed,
    Pending,
    /// That of a track without content.
    None,
}

/// The state of a baked model, and what the pending frame has for it.
pub(crate) struct BakedStore<S: BakedState> {
    pub(crate) state: S,
    staged: Vec<Staged>,
    plan: Option<S::Plan>,
    work: u64,
}

/// A track of the pending frame, whose section is decoded.
pub(crate) struct Staged {
    /// Its index in the state.
    index: usize,
    /// Where its payload starts in those of the frame.
    payload: usize,
}

impl<S: BakedState> Default for BakedStore<S> {
    fn default() -> Self {
        BakedStore {
            state: S::default(),
            staged: Vec::new(),
            plan: None,
            work: 0,
        }
    }
}

impl<S: BakedState> ModelState for BakedStore<S> {
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
        let errors = S::SHAPE_ERRORS;
        let bytes = &payloads[payload.clone()];
        let mut header = PayloadHeader::read_keyframe(bytes, errors)?;
        let mut at = header.bytes();
        for i in 0..header.count {
            let entry = header.entry(bytes, i, S::MODEL, tracks)?;
            let [size, reserved] = entry.numbers;
            if reserved != 0 {
                return Err(errors.reserved);
            }
            let section = bytes[at..].get(..size as usize).ok_or(errors.size)?;
            at += section.len();
            let index = self.state.index_of(entry.id);
            let index = index.ok_or(ErrorKind::UnknownTrack)?;
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            // Kept before the section is looked at, so that an error rolls it back.
            tracks[entry.slot].staged = Some(self.staged.len() as u32);
            self.staged.push(Staged {
                index,
                payload: payload.start,
            });
            self.state.read(index, section, &mut self.work)?;
        }
        match at == bytes.len() {
            true => Ok(()),
            false => Err(errors.size),
        }
    }

    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]) {
        let first = match to {
            Rollback::ToPayload(kept) => self.staged.partition_point(|s| s.payload < kept),
            Rollback::Frame => 0,
        };
        for staged in self.staged.drain(first..) {
            self.state.discard(staged.index);
            if let Some(at) = track::find(tracks, self.state.id_of(staged.index)) {
                tracks[at].staged = None;
            }
        }
    }

    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32 {
        let mut items = 0u32;
        for staged in self.staged.drain(..) {
            items = items.saturating_add(self.state.apply(staged.index, &mut self.work));
        }
        if pending.emptied {
            let emptied = tracks.iter().filter(|t| t.staged.is_none() && t.filled);
            for track in emptied {
                if let Some(index) = self.state.index_of(track.track.id) {
                    self.state.empty(index, &mut self.work);
                }
            }
        }
        if pending.removes {
            self.state.remove(&|id| track::is_removed(tracks, id));
        }
        self.state.end_commit();
        items
    }

    fn digest(
        &self,
        track: &TrackState,
        pending: Option<PendingView<'_>>,
        digest: &mut StateDigest,
    ) {
        if let Some(index) = self.state.index_of(track.track.id) {
            let content = match pending {
                Some(_) if track.staged.is_some() => Content::Pending,
                Some(pending) if pending.emptied => Content::None,
                _ => Content::Committed,
            };
            self.state.digest(index, content, digest);
        }
    }

    fn take_work(&mut self) -> u64 {
        mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        self.state.clear_dirty();
    }

    /// Gives the memory of all tracks back, too: the next stream may need it for other models.
    fn reset(&mut self) {
        *self = BakedStore::default();
    }
}
