//! Expected content of tracks of `points`, worked out a second time from `spec/points.md`.

use std::collections::BTreeMap;
use std::hash::Hasher as _;

use dapple_codec::points::EMPTY;
use twox_hash::XxHash64;

use super::writer::Part;
use crate::models::ExpectedState;
use crate::stream_builder::words;

/// The buckets and cells of a track.
#[derive(Clone, Debug, Default)]
pub struct Cells {
    /// Entries of each bucket that has been written.
    pub buckets: BTreeMap<u32, Vec<u32>>,
    /// Key and points of each cell that has been written.
    pub cells: BTreeMap<u32, (u32, Vec<u32>)>,
}

impl Cells {
    /// Applies a part of a keyframe or delta.
    pub fn write(&mut self, keyframe: bool, part: &Part) {
        if keyframe {
            *self = Cells::default();
        }
        self.buckets.extend(part.buckets.iter().cloned());
        for (index, key, points) in &part.cells {
            self.cells.insert(*index, (*key, points.clone()));
        }
    }

    /// Key and used points of each cell that a bucket names, in its order.
    pub fn named(&self, bucket: u32) -> impl Iterator<Item = (u32, &[u32])> {
        let entries = self.buckets.get(&bucket).into_iter().flatten();
        let used = entries.take_while(|&&entry| entry != EMPTY);
        used.map(|entry| {
            let (key, points) = &self.cells[entry];
            let used = points.iter().take_while(|&&point| point != 0).count();
            (*key, &points[..used])
        })
    }
}

impl ExpectedState for Cells {
    /// `spec/points.md` §6.
    fn digest(&self, digest: &mut XxHash64) {
        for &bucket in self.buckets.keys() {
            let count = self.named(bucket).count() as u32;
            if count == 0 {
                continue;
            }
            digest.write(&words(&[bucket, count]));
            for (key, points) in self.named(bucket) {
                let mut all = [0; 7];
                all[..points.len()].copy_from_slice(points);
                digest.write(&words(&[key]));
                digest.write(&words(&all));
            }
        }
    }
}
