//! The contexts of packed probes (`spec/probes.md` §6.4), and their bits as bytes.

pub use crate::models::range::{Bit, Coded};

/// The numbers b of the contexts (§6.4).
pub const INITIAL: [u8; 257] = [
    196, 117, 69, 17, 251, 247, 129, 4, 251, 251, 128, 128, 128, 128, 128, 128, //
    128, 183, 128, 148, 128, 85, 128, 34, 128, 215, 217, 183, 180, 137, 121, 80, //
    51, 113, 139, 99, 97, 70, 53, 45, 25, 199, 206, 172, 167, 146, 122, 105, //
    68, 179, 168, 148, 128, 112, 83, 81, 46, 235, 228, 204, 186, 174, 139, 127, //
    83, 33, 128, 14, 128, 14, 128, 13, 128, 137, 68, 51, 40, 45, 33, 21, //
    28, 128, 25, 5, 4, 4, 4, 4, 4, 128, 40, 128, 14, 64, 5, 18, //
    4, 128, 21, 30, 4, 10, 4, 8, 4, 128, 130, 51, 53, 64, 17, 32, //
    12, 128, 128, 128, 128, 179, 56, 14, 4, 176, 146, 96, 50, 218, 158, 100, //
    50, 203, 171, 127, 75, 229, 185, 148, 92, 128, 128, 128, 128, 122, 71, 61, //
    46, 42, 25, 24, 23, 137, 100, 92, 72, 75, 53, 49, 42, 198, 135, 125, //
    95, 121, 214, 248, 123, 234, 251, 138, 140, 160, 179, 147, 173, 195, 215, 218, //
    227, 235, 180, 240, 233, 229, 199, 112, 121, 226, 228, 227, 214, 207, 168, 249, //
    238, 220, 152, 98, 163, 246, 239, 224, 198, 160, 164, 251, 226, 136, 97, 188, //
    182, 26, 56, 108, 171, 203, 207, 154, 196, 206, 211, 198, 144, 49, 96, 154, //
    193, 217, 218, 177, 203, 201, 200, 190, 200, 101, 163, 194, 217, 222, 221, 218, //
    208, 201, 195, 148, 200, 205, 216, 211, 219, 218, 221, 152, 195, 160, 198, 174, //
    196,
];

/// Codes bits.
pub fn code(bits: &[Bit]) -> Coded {
    crate::models::range::code(&INITIAL, bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use twox_hash::XxHash64;

    #[test]
    fn contexts_start_as_the_specification_says() {
        assert_eq!(XxHash64::oneshot(0, &INITIAL), 0xc258_a0d4_7c1b_432e);
    }

    /// The decoder of §6.2, in the words of its clauses.
    fn decode(bytes: &[u8], kinds: &[Bit]) -> (Vec<Bit>, usize) {
        let mut taken = 0;
        let mut next = || {
            taken += 1;
            u32::from(bytes.get(taken - 1).copied().unwrap_or(0))
        };
        let mut code = (0..4).fold(0, |code, _| code << 8 | next());
        let mut range = u32::MAX;
        let mut estimates = INITIAL.map(|b| 256 * u32::from(b) + 128);
        let mut bits = Vec::new();
        for kind in kinds {
            let bound = match *kind {
                Bit::In(context, _) => (range >> 16) * estimates[context],
                Bit::Even(_) => range / 2,
            };
            let one = code >= bound;
            (code, range) = match one {
                true => (code - bound, range - bound),
                false => (code, bound),
            };
            while range < 1 << 24 {
                range <<= 8;
                code = code << 8 | next();
            }
            bits.push(match *kind {
                Bit::In(context, _) => {
                    let estimate = &mut estimates[context];
                    match one {
                        true => *estimate -= *estimate >> 5,
                        false => *estimate += (65536 - *estimate) >> 5,
                    }
                    Bit::In(context, one)
                }
                Bit::Even(_) => Bit::Even(one),
            });
        }
        (bits, taken)
    }

    #[test]
    fn bits_come_back() {
        let mut state = 1u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as usize
        };
        for count in [0, 1, 30, 5000] {
            for odds in [2, 50, 60_000] {
                let bits: Vec<Bit> = (0..count)
                    .map(|_| match draw() % 5 {
                        0 => Bit::Even(draw() % 2 == 0),
                        _ => Bit::In(draw() % 257, draw() % odds == 0),
                    })
                    .collect();
                let coded = code(&bits);
                for bytes in [coded.short(), coded.whole()] {
                    let (found, taken) = decode(&bytes, &bits);
                    assert_eq!(found, bits);
                    assert_eq!(taken, coded.whole().len());
                }
            }
        }
    }
}
