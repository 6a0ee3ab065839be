//! What a `vertices` track adds to the state digest (`spec/vertices.md` §7).

use super::state::OPEN;
use crate::session::digest::StateDigest;
use crate::session::transforms::Transform;

impl StateDigest {
    /// Adds a `vertices` track: its id, its last transform and its values as a decoder gives them.
    pub fn vertices(&mut self, id: u32, transform: Option<&Transform>, values: &[u8]) {
        self.header(id, transform);
        self.bytes(values);
    }

    /// The values of a track that is open.
    pub(super) fn open_values(&mut self, count: usize) {
        let chunk = [OPEN; 64];
        let mut left = count;
        while left > 0 {
            let now = left.min(chunk.len());
            self.bytes(&chunk[..now]);
            left -= now;
        }
    }
}
