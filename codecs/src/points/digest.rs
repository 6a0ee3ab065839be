//! What a `points` track adds to the state digest (`spec/points.md` §6).

use super::{Bucket, Cell, EMPTY};
use crate::digest::StateDigest;
use crate::transforms::Transform;

impl StateDigest {
    /// Adds a `points` track: its id, its last transform, its buckets and its cells.
    pub fn track(
        &mut self,
        id: u32,
        transform: Option<&Transform>,
        buckets: &[Bucket],
        cells: &[Cell],
    ) {
        self.header(id, transform);
        self.buckets(buckets, cells);
    }

    pub(super) fn buckets(&mut self, buckets: &[Bucket], cells: &[Cell]) {
        for (index, bucket) in buckets.iter().enumerate() {
            self.bucket(index as u32, bucket, |c| {
                cells.get(c as usize).copied().unwrap_or(Cell::FREE)
            });
        }
    }

    /// A bucket that names a cell; an empty one adds nothing.
    pub(super) fn bucket(&mut self, index: u32, bucket: &Bucket, cell: impl Fn(u32) -> Cell) {
        let used = bucket.0.iter().take_while(|&&entry| entry != EMPTY);
        let count = used.clone().count() as u32;
        if count == 0 {
            return;
        }
        self.word(index);
        self.word(count);
        for &entry in used {
            let Cell { key, points } = cell(entry);
            self.word(key);
            points.iter().for_each(|&point| self.word(point));
        }
    }
}
