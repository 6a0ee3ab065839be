//! A set of small numbers, one bit each, that is walked in ascending order.

use alloc::vec::Vec;

use crate::error::ErrorKind;
use crate::memory::reserve::filled;

/// Numbers below a bound. Clearing it and walking it take a step for each 64 numbers between the
/// smallest and the largest one, and none where it is empty.
pub(crate) struct IndexSet {
    words: Vec<u64>,
    /// Words outside `first..end` are 0.
    first: usize,
    end: usize,
}

impl IndexSet {
    /// The empty set of numbers below `bound`.
    pub(crate) fn new(bound: usize) -> Result<IndexSet, ErrorKind> {
        Ok(IndexSet {
            words: filled(bound.div_ceil(64), 0)?,
            first: 0,
            end: 0,
        })
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.next(0).is_none()
    }

    /// Adds a number. Returns whether it is new.
    #[inline]
    pub(crate) fn insert(&mut self, index: usize) -> bool {
        let (at, bit) = (index / 64, 1 << (index % 64));
        let word = &mut self.words[at];
        let new = *word & bit == 0;
        *word |= bit;
        if self.first == self.end {
            (self.first, self.end) = (at, at + 1);
        } else {
            self.first = self.first.min(at);
            self.end = self.end.max(at + 1);
        }
        new
    }

    pub(crate) fn contains(&self, index: usize) -> bool {
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    pub(crate) fn remove(&mut self, index: usize) {
        self.words[index / 64] &= !(1 << (index % 64));
    }

    /// The smallest number from `from` on.
    #[inline]
    pub(crate) fn next(&self, from: usize) -> Option<usize> {
        let mut at = from / 64;
        let mut mask = u64::MAX << (from % 64);
        if at < self.first {
            (at, mask) = (self.first, u64::MAX);
        }
        while at < self.end {
            let word = self.words[at] & mask;
            if word != 0 {
                return Some(64 * at + word.trailing_zeros() as usize);
            }
            (at, mask) = (at + 1, u64::MAX);
        }
        None
    }

    /// The smallest number from `from` on that is not in the set; the bound or more where all are.
    pub(crate) fn next_missing(&self, from: usize) -> usize {
        let mut at = from / 64;
        let mut mask = u64::MAX << (from % 64);
        while at < self.words.len() {
            let word = !self.words[at] & mask;
            if word != 0 {
                return 64 * at + word.trailing_zeros() as usize;
            }
            (at, mask) = (at + 1, u64::MAX);
        }
        64 * at
    }

    /// Calls `visit` with each number, in ascending order.
    #[inline]
    pub(crate) fn each(&self, mut visit: impl FnMut(usize)) {
        let mut at = self.next(0);
        while let Some(index) = at {
            visit(index);
            at = self.next(index + 1);
        }
    }

    pub(crate) fn clear(&mut self) {
        self.words[self.first..self.end].fill(0);
        (self.first, self.end) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    #[test]
    fn numbers_come_back_in_order() {
        let mut set = IndexSet::new(1000).unwrap();
        assert!(set.is_empty());
        for index in [700, 3, 64, 63, 128, 3] {
            set.insert(index);
        }
        let walk = |set: &IndexSet| {
            let mut found = Vec::new();
            set.each(|index| found.push(index));
            found
        };
        assert_eq!(walk(&set), [3, 63, 64, 128, 700]);
        assert_eq!(set.next_missing(63), 65);
        set.remove(64);
        assert_eq!(walk(&set), [3, 63, 128, 700]);
        set.clear();
        assert_eq!(walk(&set), vec![0usize; 0]);
        set.insert(999);
        assert_eq!(set.next(0), Some(999));
        assert_eq!(set.next_missing(999), 1000);
    }
}
