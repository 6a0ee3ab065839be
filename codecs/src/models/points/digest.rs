//! What a `points` track adds to the state digest (`spec/points.md` §6).

use super::{Bucket, Cell, EMPTY};
use crate::session::digest::StateDigest;
use crate::session::transforms::Transform;

impl StateDigest {
    /// Adds a `points` track: its id, its last transform, its buckets and its cells.
    pub fn points(
        &mut self,
        id: u32,
        transform: Option<&Transform>,
        buckets: &[Bucket],
        cells: &[Cell],
    ) {
        self.header(id, transform);
        self.points_content(buckets, cells);
    }

    pub(super) fn points_content(&mut self, buckets: &[Bucket], cells: &[Cell]) {
        for (index, bucket) in buckets.iter().enumerate() {
            self.points_bucket(index as u32, bucket, |c| {
                cells.get(c as usize).copied().unwrap_or(Cell::FREE)
            });
        }
    }

    /// A bucket that names a cell; an empty one adds nothing.
    pub(super) fn points_bucket(
        &mut self,
        index: u32,
        bucket: &Bucket,
        cell: impl Fn(u32) -> Cell,
    ) {
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
