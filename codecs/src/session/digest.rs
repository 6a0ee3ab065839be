//! The state digest (`spec/container.md` §7): what every track of whatever model begins with.

use core::hash::Hasher as _;

use crate::session::transforms::Transform;

/// Computes the digest of a state track by track, in ascending order of id (`spec/container.md` §7).
/// It covers what a lookup can reach and not how a decoder keeps it, so a server with arrays of its
/// own gets the same number.
pub struct StateDigest {
    hash: twox_hash::XxHash64,
    /// Bytes that were read for it.
    read: u64,
}

impl Default for StateDigest {
    fn default() -> Self {
        StateDigest::new()
    }
}

impl StateDigest {
    /// A digest of no tracks.
    pub fn new() -> StateDigest {
        StateDigest {
            hash: twox_hash::XxHash64::with_seed(0),
            read: 0,
        }
    }

    /// Starts a track: its id and its last transform. The model's content follows.
    pub(crate) fn header(&mut self, id: u32, transform: Option<&Transform>) {
        self.word(id);
        self.word(u32::from(transform.is_some()));
        let transform = transform.copied().unwrap_or(Transform::ZERO);
        for value in transform.world_from_grid.as_flattened() {
            self.bytes(&value.to_le_bytes());
        }
    }

    pub(crate) fn word(&mut self, word: u32) {
        self.bytes(&word.to_le_bytes());
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.hash.write(bytes);
        self.read += bytes.len() as u64;
    }

    /// Counts `items` of a state that were looked at, each of some 64 bytes.
    pub(crate) fn looked_at(&mut self, items: usize) {
        self.read += 64 * items as u64;
    }

    /// Steps of work so far ([`crate::Decoder::work`]).
    pub(crate) fn work(&self) -> u64 {
        self.read / 64
    }

    /// The digest.
    pub fn finish(&self) -> u64 {
        self.hash.finish()
    }
}
