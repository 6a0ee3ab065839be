//! Pseudo-random numbers, the same on every machine.

/// A generator with its state.
pub struct Draw(pub u64);

impl Draw {
    /// 0 to `bound - 1`.
    pub fn below(&mut self, bound: u32) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 33) % u64::from(bound)) as u32
    }

    /// As [`Draw::below`] of a positive bound.
    pub fn below_i32(&mut self, bound: i32) -> i32 {
        self.below(bound.unsigned_abs()) as i32
    }

    /// -1 to 1.
    pub fn signed(&mut self) -> f64 {
        f64::from(self.below(1 << 20)) / f64::from(1 << 19) - 1.0
    }
}
