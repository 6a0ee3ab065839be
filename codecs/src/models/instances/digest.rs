//! What an `instances` track adds to the state digest (`spec/instances.md` §8).

use super::Value;
use super::state::Entries;
use crate::session::digest::StateDigest;
use crate::session::transforms::Transform;

impl StateDigest {
    /// Adds an `instances` track: its id, its last transform, and its entries: keys, and as many
    /// values for each as the track has signals.
    pub fn instances(
        &mut self,
        id: u32,
        transform: Option<&Transform>,
        keys: &[u64],
        values: &[Value],
    ) {
        self.header(id, transform);
        self.entries(keys, values);
    }

    pub(super) fn instances_content(&mut self, entries: &Entries) {
        self.entries(&entries.keys, &entries.values);
    }

    pub(super) fn instances_no_content(&mut self) {
        self.entries(&[], &[]);
    }

    fn entries(&mut self, keys: &[u64], values: &[Value]) {
        self.word(keys.len() as u32);
        let signals = values.len() / keys.len().max(1);
        for (index, key) in keys.iter().enumerate() {
            self.bytes(&key.to_le_bytes());
            for number in values[index * signals..][..signals].as_flattened() {
                self.bytes(&number.to_le_bytes());
            }
        }
    }
}
