//! Expected content of tracks, worked out a second time from the specification, and its digest, so
//! that no vector depends on what our decoder gives.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

use crate::models::Expected;
use crate::models::entry::Entry;
use crate::stream_builder::{floats, words};

/// The content of a track after a commit.
#[derive(Clone, Debug)]
pub struct TrackContent {
    pub entry: Entry,
    pub transform: Option<[f32; 12]>,
    pub state: Expected,
}

impl TrackContent {
    /// An empty track.
    pub fn new(entry: &Entry) -> TrackContent {
        TrackContent {
            entry: entry.clone(),
            transform: None,
            state: Expected::new(&entry.parameters),
        }
    }

    /// Empties the track, as a group that starts from keyframes does.
    pub fn clear(&mut self) {
        *self = TrackContent::new(&self.entry);
    }

    fn digest(&self, digest: &mut XxHash64) {
        let transform = u32::from(self.transform.is_some());
        digest.write(&words(&[self.entry.id, transform]));
        digest.write(&floats(&self.transform.unwrap_or_default()));
        self.state.get().digest(digest);
    }
}

/// Digest of a state, its tracks by ascending id (`spec/container.md` §7).
pub fn digest(tracks: &[TrackContent]) -> u64 {
    let mut digest = XxHash64::with_seed(0);
    tracks
        .iter()
        .for_each(|content| content.digest(&mut digest));
    digest.finish()
}
