//! What a `points` track adds to the state digest (`spec/points.md` §6).

use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY};
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
        if bucket.0[0] == EMPTY {
            return;
        }
        // All of it at once: the hash takes 32 bytes in the time of one word.
        let mut words = [0u32; 2 + BUCKET_ENTRIES * (1 + CELL_POINTS)];
        let (head, content) = words.split_at_mut(2);
        let mut count = 0;
        for (to, &entry) in content.as_chunks_mut().0.iter_mut().zip(&bucket.0) {
            if entry == EMPTY {
                break;
            }
            let words: [u32; 1 + CELL_POINTS] = bytemuck::cast(cell(entry));
            *to = words.map(u32::to_le);
            count += 1;
        }
        head.copy_from_slice(&[index.to_le(), (count as u32).to_le()]);
        let used = 2 + count * (1 + CELL_POINTS);
        self.bytes(bytemuck::cast_slice(&words[..used]));
    }
}
