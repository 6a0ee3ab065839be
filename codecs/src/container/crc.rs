//! CRC-32C: in hardware through the `crc32c` crate with `hardware-crc`, eight table look-ups for eight bytes
//! without.

use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use core::sync::atomic::{AtomicBool, AtomicU32};

/// Reflected Castagnoli polynomial.
#[cfg_attr(all(feature = "hardware-crc", not(test)), allow(dead_code))]
const POLYNOMIAL: u32 = 0x82f6_3b78;

/// The tables of [`portable`], filled at their first use: they would be a quarter of the program that a
/// browser loads.
#[cfg_attr(all(feature = "hardware-crc", not(test)), allow(dead_code))]
static TABLES: [[AtomicU32; 256]; 8] = [const { [const { AtomicU32::new(0) }; 256] }; 8];
#[cfg_attr(all(feature = "hardware-crc", not(test)), allow(dead_code))]
static FILLED: AtomicBool = AtomicBool::new(false);

/// Fills the tables. Threads that do so at the same time write the same.
#[cold]
#[cfg_attr(all(feature = "hardware-crc", not(test)), allow(dead_code))]
fn fill() {
    for (i, entry) in TABLES[0].iter().enumerate() {
        let mut crc = i as u32;
        for _ in 0..8 {
            crc = (crc >> 1) ^ (POLYNOMIAL & (crc & 1).wrapping_neg());
        }
        entry.store(crc, Relaxed);
    }
    for tables in TABLES.windows(2) {
        for (entry, previous) in tables[1].iter().zip(&tables[0]) {
            let previous = previous.load(Relaxed);
            let low = TABLES[0][(previous & 0xff) as usize].load(Relaxed);
            entry.store((previous >> 8) ^ low, Relaxed);
        }
    }
    FILLED.store(true, Release);
}

/// Bytes that are copied at once: small enough to stay in a core's second cache, large enough for
/// the hardware's three interleaved sums.
const COPY_BLOCK: usize = 64 << 10;

/// CRC-32C of `bytes`.
pub(crate) fn crc32c(bytes: &[u8]) -> u32 {
    append(0, bytes)
}

/// CRC-32C of `from`, copied to `to` on the way, so that it comes from memory once. The lengths
/// must be equal.
pub(crate) fn crc32c_copy(from: &[u8], to: &mut [u8]) -> u32 {
    let blocks = from.chunks(COPY_BLOCK).zip(to.chunks_mut(COPY_BLOCK));
    blocks.fold(0, |crc, (from, to)| {
        to.copy_from_slice(from);
        append(crc, from)
    })
}

/// The CRC-32C of what `crc` is of, and then `bytes`.
#[cfg(feature = "hardware-crc")]
fn append(crc: u32, bytes: &[u8]) -> u32 {
    crc32c::crc32c_append(crc, bytes)
}

#[cfg(not(feature = "hardware-crc"))]
fn append(crc: u32, bytes: &[u8]) -> u32 {
    portable(crc, bytes)
}

/// Slicing by eight.
#[cfg_attr(all(feature = "hardware-crc", not(test)), allow(dead_code))]
fn portable(crc: u32, bytes: &[u8]) -> u32 {
    if !FILLED.load(Acquire) {
        fill();
    }
    let table = |t: usize, byte: u32| TABLES[t][(byte & 0xff) as usize].load(Relaxed);
    let mut crc = !crc;
    let (chunks, rest) = bytes.as_chunks::<8>();
    for c in chunks {
        let low = crc ^ u32::from_le_bytes([c[0], c[1], c[2], c[3]]);
        crc = table(7, low)
            ^ table(6, low >> 8)
            ^ table(5, low >> 16)
            ^ table(4, low >> 24)
            ^ table(3, c[4].into())
            ^ table(2, c[5].into())
            ^ table(1, c[6].into())
            ^ table(0, c[7].into());
    }
    for &byte in rest {
        crc = (crc >> 8) ^ table(0, crc ^ u32::from(byte));
    }
    !crc
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    #[test]
    fn check_value_of_the_catalogue() {
        assert_eq!(portable(0, b"123456789"), 0xe306_9283);
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
    }

    #[test]
    fn both_ways_agree_at_every_length_and_alignment() {
        let bytes: Vec<u8> = (0..300u32).map(|i| (i * i * 31 + 7) as u8).collect();
        for start in 0..9 {
            for end in start..bytes.len() {
                assert_eq!(portable(0, &bytes[start..end]), crc32c(&bytes[start..end]));
            }
        }
    }

    #[test]
    fn a_copy_in_blocks_is_whole_and_has_the_same_sum() {
        let bytes: Vec<u8> = (0..3 * COPY_BLOCK as u32 + 5)
            .map(|i| ((i * 31) >> 3) as u8)
            .collect();
        for length in [
            0,
            1,
            COPY_BLOCK - 1,
            COPY_BLOCK,
            COPY_BLOCK + 1,
            bytes.len(),
        ] {
            let from = &bytes[..length];
            let mut to = alloc::vec![0; length];
            assert_eq!(crc32c_copy(from, &mut to), crc32c(from));
            assert!(to == from);
            let half = portable(0, &from[..length / 2]);
            assert_eq!(portable(half, &from[length / 2..]), crc32c(from));
        }
    }
}
