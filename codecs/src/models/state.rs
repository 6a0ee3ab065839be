//! What a session asks of a model's state.

use core::ops::Range;

use crate::error::ErrorKind;
use crate::models::payload_header::Base;
use crate::session::digest::StateDigest;
use crate::session::track::{Track, TrackState};

/// The pending frame at its commit, or for a digest of the state that it leaves.
#[derive(Clone, Copy)]
pub(crate) struct PendingView<'a> {
    /// All payloads of its model records.
    pub(crate) payloads: &'a [u8],
    /// It starts from an empty state.
    pub(crate) emptied: bool,
    /// Some tracks end with it.
    pub(crate) removes: bool,
}

/// How much of the pending frame is dropped.
#[derive(Clone, Copy)]
pub(crate) enum Rollback {
    /// The content of the payloads from this byte on; what came before it stays staged.
    ToPayload(usize),
    /// All of it.
    Frame,
}

/// A model's share of the state, and its content of the pending frame.
///
/// A session calls `stage` for each payload of a frame and then `commit`, or `rollback`. It passes its list
/// of tracks, of all models, ids ascending. `stage` and `rollback` set [`TrackState::staged`]; everything else
/// in the list is to read.
pub(crate) trait ModelState {
    /// Plans memory for tracks, those of other models left out. Returns the bytes of decoded state that
    /// there will be, or none where there are more items than indices count.
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind>;

    /// Adds the tracks of the last plan, empty. The model may have `max_bytes` of state, which the plan is
    /// within, and `max_tracks` tracks.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`], with some of the tracks added perhaps; the caller removes them.
    fn add(&mut self, tracks: &[Track], max_bytes: u64, max_tracks: usize)
    -> Result<(), ErrorKind>;

    /// Forgets the tracks whose ids `removed` picks, in one pass, and frees their memory for others.
    fn remove(&mut self, removed: &dyn Fn(u32) -> bool);

    /// The pending frame starts with all tracks empty. Models whose checks read the committed state alone
    /// have nothing to do.
    fn begin_empty(&mut self, _tracks: &[TrackState]) {}

    /// Checks a payload and keeps what is in it. `payloads` has all payloads of the pending frame. After
    /// an error the caller must roll back.
    fn stage(
        &mut self,
        payloads: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [TrackState],
    ) -> Result<(), ErrorKind>;

    /// Drops staged content.
    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]);

    /// Writes the frame into the state: what is staged, tracks that it leaves empty, and removals. Returns
    /// how many items the frame carried.
    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32;

    /// Adds a track's content to `digest`: as it is committed, or as the pending frame leaves it.
    fn digest(
        &self,
        track: &TrackState,
        pending: Option<PendingView<'_>>,
        digest: &mut StateDigest,
    );

    /// Steps of work since the last call ([`crate::Decoder::work`]).
    fn take_work(&mut self) -> u64;

    /// What changed has been uploaded.
    fn clear_dirty(&mut self);

    /// Forgets all tracks.
    fn reset(&mut self);
}
