//! Free ranges inside one large array, so that tracks which come and go reuse their places.

use alloc::vec::Vec;

use crate::error::ErrorKind;
use crate::memory::reserve::reserve_exact;
use crate::memory::sort::sort_by_key;

/// Free ranges `(start, length)`, ascending, never touching.
#[derive(Default)]
pub(crate) struct FreeRanges {
    free: Vec<(u32, u32)>,
}

impl FreeRanges {
    /// The same ranges, with memory for `more` that are given back.
    pub(crate) fn copy(&self, more: usize) -> Result<FreeRanges, ErrorKind> {
        let mut free = Vec::new();
        reserve_exact(&mut free, self.free.len() + more)?;
        free.extend_from_slice(&self.free);
        Ok(FreeRanges { free })
    }

    /// Takes `length` items from the first range that has them.
    pub(crate) fn take(&mut self, length: u32) -> Option<u32> {
        let at = self.free.iter().position(|&(_, l)| l >= length)?;
        let (start, rest) = self.free[at];
        if rest == length {
            self.free.remove(at);
        } else {
            self.free[at] = (start + length, rest - length);
        }
        Some(start)
    }

    /// Gives a range back, for use once [`FreeRanges::merge`] has put it in its place.
    pub(crate) fn give(&mut self, start: u32, length: u32) {
        self.free.push((start, length));
    }

    /// Sorts and merges, so that many ranges that are given back cost one pass.
    pub(crate) fn merge(&mut self) {
        sort_by_key(&mut self.free, |&range| range);
        self.free.dedup_by(|next, kept| {
            let touch = kept.0 + kept.1 == next.0;
            if touch {
                kept.1 += next.1;
            }
            touch
        });
    }

    pub(crate) fn clear(&mut self) {
        self.free.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_merge_again() {
        let mut ranges = FreeRanges::default();
        ranges.give(0, 30);
        ranges.merge();
        let taken = [ranges.take(10), ranges.take(10), ranges.take(10)];
        assert_eq!(taken, [Some(0), Some(10), Some(20)]);
        assert_eq!(ranges.take(1), None);
        ranges.give(20, 10);
        ranges.give(0, 10);
        ranges.merge();
        assert_eq!(ranges.take(11), None);
        ranges.give(10, 10);
        ranges.merge();
        assert_eq!(ranges.free, [(0, 30)]);
    }
}
