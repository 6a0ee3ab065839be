//! CRC-32C: in hardware through the `crc32c` crate with `hardware-crc`, eight table look-ups for eight bytes
//! without.

/// Reflected Castagnoli polynomial.
const POLYNOMIAL: u32 = 0x82f6_3b78;

const TABLES: [[u32; 256]; 8] = tables();

const fn tables() -> [[u32; 256]; 8] {
    let mut tables = [[0u32; 256]; 8];
    let mut i = 0;
    while i < 256 {
        let mut crc = i as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 {
                (crc >> 1) ^ POLYNOMIAL
            } else {
                crc >> 1
            };
            bit += 1;
        }
        tables[0][i] = crc;
        i += 1;
    }
    let mut t = 1;
    while t < 8 {
        let mut i = 0;
        while i < 256 {
            let previous = tables[t - 1][i];
            tables[t][i] = (previous >> 8) ^ tables[0][(previous & 0xff) as usize];
            i += 1;
        }
        t += 1;
    }
    tables
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
    let mut crc = !crc;
    let (chunks, rest) = bytes.as_chunks::<8>();
    for c in chunks {
        let low = crc ^ u32::from_le_bytes([c[0], c[1], c[2], c[3]]);
        crc = TABLES[7][(low & 0xff) as usize]
            ^ TABLES[6][(low >> 8 & 0xff) as usize]
            ^ TABLES[5][(low >> 16 & 0xff) as usize]
            ^ TABLES[4][(low >> 24) as usize]
            ^ TABLES[3][c[4] as usize]
            ^ TABLES[2][c[5] as usize]
            ^ TABLES[1][c[6] as usize]
            ^ TABLES[0][c[7] as usize];
    }
    for &byte in rest {
        crc = (crc >> 8) ^ TABLES[0][((crc ^ u32::from(byte)) & 0xff) as usize];
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
