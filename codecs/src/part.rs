//! What a session asks of a model.

use core::ops::Range;

use crate::content::Base;
use crate::digest::StateDigest;
use crate::error::ErrorKind;
use crate::frame::FrameInfo;
use crate::track::{LiveTrack, Track};

/// A model's share of the state: its tracks are known by their ids, and its content comes in payloads
/// of the pending frame.
pub(crate) trait Part {
    /// Plans room for tracks, those of other models left out. Returns the bytes of decoded state
    /// that there will be, or none where there are more items than indices count.
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind>;

    /// Takes in the tracks of the last plan, empty. The model may have `most` bytes of state, which
    /// the plan is within, and `limit` tracks.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`], with some of the tracks taken in perhaps; the caller removes them.
    fn add(&mut self, tracks: &[Track], most: u64, limit: usize) -> Result<(), ErrorKind>;

    /// Forgets the tracks whose ids `removed` picks, in one pass, and frees their memory for others.
    fn remove(&mut self, removed: &dyn Fn(u32) -> bool);

    /// Empties a track.
    fn empty(&mut self, id: u32);

    /// The pending frame starts with a track empty.
    fn expect_nothing(&mut self, id: u32);

    /// Checks a payload and keeps what is in it. `frame` has all payloads of the frame in the
    /// making. Marks tracks as staged. After a fault the caller must revert the frame.
    fn stage(
        &mut self,
        frame: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [LiveTrack],
    ) -> Result<(), ErrorKind>;

    /// How many tracks of the pending frame have content.
    fn staged(&self) -> usize;

    /// Drops the content of all tracks of the pending frame but the first `kept`.
    fn unstage(&mut self, kept: usize, emptied: bool, tracks: &mut [LiveTrack]);

    /// Drops the pending frame.
    fn revert(&mut self, emptied: bool, tracks: &[LiveTrack]);

    /// All content of the frame is there: [`Part::digest_staged`] and [`Part::apply`] come.
    fn seal(&mut self);

    /// Writes the frame into the state, and counts what is in it.
    fn apply(&mut self, frame: &[u8], info: &mut FrameInfo);

    /// Adds a track's committed content to `digest`.
    fn digest(&self, id: u32, digest: &mut StateDigest);

    /// Adds a track's content to `digest` as it will be after the frame.
    fn digest_staged(&self, id: u32, frame: &[u8], emptied: bool, digest: &mut StateDigest);

    /// The frame is in the state, with tracks removed.
    fn settle(&mut self);

    /// Steps of work since the last call ([`crate::Decoder::work`]).
    fn take_work(&mut self) -> u64;

    /// What changed has been uploaded.
    fn clear_dirty(&mut self);

    /// Forgets all tracks.
    fn reset(&mut self);
}
