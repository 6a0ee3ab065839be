//! Keys of grid cells, and the hash that finds their bucket (PSAO Eq. 1).

use super::{EMPTY, Grid};

impl Grid {
    /// The dense index of a grid cell, `x + Dx * (y + Dy * z)`. Exact for cells inside `dims`.
    pub fn key(&self, cell: [u32; 3]) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        cell[0].wrapping_add(dx.wrapping_mul(cell[1].wrapping_add(dy.wrapping_mul(cell[2]))))
    }

    /// The grid cell of a dense index.
    pub fn cell_of(&self, key: u32) -> [u32; 3] {
        let [dx, dy, _] = self.dims.map(|d| u32::from(d).max(1));
        [key % dx, key / dx % dy, key / dx / dy]
    }

    /// `H = x + y * Dx * 17 + z * Dx * Dy * 31`, modulo 2^32 (Eq. 1).
    pub fn hash(&self, cell: [u32; 3]) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        let y = cell[1].wrapping_mul(dx.wrapping_mul(17));
        let z = cell[2].wrapping_mul(dx.wrapping_mul(dy).wrapping_mul(31));
        cell[0].wrapping_add(y).wrapping_add(z)
    }

    /// The bucket of a grid cell: Eq. 1 modulo the bucket count.
    pub fn bucket(&self, cell: [u32; 3]) -> u32 {
        self.hash(cell) % self.bucket_count.max(1)
    }

    /// The bucket of a dense index.
    pub fn bucket_of_key(&self, key: u32) -> u32 {
        self.bucket(self.cell_of(key))
    }
}

/// [`Grid::bucket_of_key`] with its three divisions turned into multiplications.
///
/// With `Y = key / Dx = y + Dy z` and `z = key / (Dx Dy)`, Eq. 1 is `key + Y * 16 Dx + z * 14 Dx Dy`
/// modulo 2^32: both divisions start from the key, and no remainder is needed.
#[derive(Clone, Copy, Debug)]
pub struct Hasher {
    row: Divisor,
    slice: Divisor,
    row_factor: u32,
    slice_factor: u32,
    buckets: Divisor,
}

impl Hasher {
    /// Prepares the constants of a grid.
    pub fn new(grid: &Grid) -> Hasher {
        let [dx, dy, _] = grid.dims.map(|d| u32::from(d).max(1));
        Hasher {
            row: Divisor::new(dx),
            // A product of two 16-bit numbers.
            slice: Divisor::new(dx * dy),
            row_factor: dx.wrapping_mul(16),
            slice_factor: dx.wrapping_mul(dy).wrapping_mul(14),
            buckets: Divisor::new(grid.bucket_count.max(1)),
        }
    }

    /// The bucket of a dense index.
    #[inline]
    pub fn bucket_of_key(&self, key: u32) -> u32 {
        let rows = self.row.div(key);
        let slices = self.slice.div(key);
        let hash = key
            .wrapping_add(rows.wrapping_mul(self.row_factor))
            .wrapping_add(slices.wrapping_mul(self.slice_factor));
        self.buckets.rem(hash)
    }

    /// The bucket of a cell's key; [`EMPTY`] for a free cell.
    #[inline]
    pub(super) fn home(&self, key: u32) -> u32 {
        if key == EMPTY {
            EMPTY
        } else {
            self.bucket_of_key(key)
        }
    }
}

/// Exact division of 32-bit numbers by a constant, through its 64-bit reciprocal (Lemire, Kaser,
/// Kurz, "Faster remainder by direct computation", 2019).
#[derive(Clone, Copy, Debug)]
struct Divisor {
    value: u32,
    /// ceil(2^64 / value); 0 stands for 2^64, that is for a value of 1.
    reciprocal: u64,
}

impl Divisor {
    fn new(value: u32) -> Divisor {
        Divisor {
            value,
            reciprocal: (u64::MAX / u64::from(value)).wrapping_add(1),
        }
    }

    #[inline]
    fn div(&self, number: u32) -> u32 {
        if self.reciprocal == 0 {
            return number;
        }
        ((u128::from(self.reciprocal) * u128::from(number)) >> 64) as u32
    }

    #[inline]
    fn rem(&self, number: u32) -> u32 {
        number.wrapping_sub(self.div(number).wrapping_mul(self.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reciprocals_divide_exactly() {
        let mut state = 1u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 32) as u32
        };
        for value in [1, 2, 3, 7, 255, 65535, 65536, 65537, u32::MAX - 1, u32::MAX] {
            let divisor = Divisor::new(value);
            let edges = [
                0,
                1,
                value - 1,
                value,
                value.wrapping_add(1),
                u32::MAX - 1,
                u32::MAX,
            ];
            for number in edges.into_iter().chain((0..10_000).map(|_| next())) {
                assert_eq!(divisor.div(number), number / value);
                assert_eq!(divisor.rem(number), number % value);
            }
        }
        for _ in 0..100_000 {
            let (value, number) = ((next() >> (next() % 32)).max(1), next());
            let divisor = Divisor::new(value);
            assert_eq!(divisor.div(number), number / value);
            assert_eq!(divisor.rem(number), number % value);
        }
    }
}
