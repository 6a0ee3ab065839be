//! Free regions inside one large array, so that tracks which come and go reuse their places.

use alloc::vec::Vec;

/// Free regions `(start, length)`, ascending, never touching.
#[derive(Default)]
pub(crate) struct Regions {
    free: Vec<(u32, u32)>,
}

impl Regions {
    /// Takes `length` items from the first region that has them.
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

    /// Gives a region back.
    pub(crate) fn give(&mut self, start: u32, length: u32) {
        let at = self.free.partition_point(|&(s, _)| s < start);
        self.free.insert(at, (start, length));
        if at + 1 < self.free.len() && start + length == self.free[at + 1].0 {
            self.free[at].1 += self.free.remove(at + 1).1;
        }
        if at > 0 && self.free[at - 1].0 + self.free[at - 1].1 == start {
            self.free[at - 1].1 += self.free.remove(at).1;
        }
    }

    pub(crate) fn clear(&mut self) {
        self.free.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_merge_again() {
        let mut regions = Regions::default();
        regions.give(0, 30);
        let taken = [regions.take(10), regions.take(10), regions.take(10)];
        assert_eq!(taken, [Some(0), Some(10), Some(20)]);
        assert_eq!(regions.take(1), None);
        regions.give(20, 10);
        regions.give(0, 10);
        assert_eq!(regions.take(11), None);
        regions.give(10, 10);
        assert_eq!(regions.free, [(0, 30)]);
    }
}
