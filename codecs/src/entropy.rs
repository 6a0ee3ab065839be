//! An adaptive binary range coder (after LZMA; Martin, "Range encoding", 1979): `spec/probes.md` §6.
//!
//! One walk over the syntax serves both directions: a [`Coder`] is told each bit and says what it
//! is, an encoder by writing it, a decoder by reading it and not listening.

use alloc::vec::Vec;

use crate::error::ErrorKind;

/// Below this the range is renormalised by a byte.
const TOP: u32 = 1 << 24;
/// Bytes of `code`, all of which a decoder reads before the first bit.
const CODE_BYTES: usize = 4;

/// How probable a bit of one sort is to be 0, in units of 2^-16.
///
/// It never reaches an end: `p -= p >> SHIFT` leaves `p` as it is from `2^SHIFT - 1` down, and
/// likewise at the other end. So it is 31 to 65505, and a range of 2^24 or more is split into two
/// parts that are both above 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Context(u16);

/// The probability that a context comes to rest at after many zeros.
const SURE: u32 = 65_536 - 31;

/// How slowly a probability follows. In probes the mean of two, of shifts 4 and 7, took 0.4 % fewer
/// bytes; so did a shift of 6, which learns more slowly what the start did not know.
const SHIFT: u32 = 5;

impl Context {
    /// A context that starts at a probability in 1/256, above 0.
    pub(crate) const fn new(probability: u8) -> Context {
        Context((probability as u16) << 8 | 128)
    }

    #[inline(always)]
    fn probability(self) -> u32 {
        self.0.into()
    }

    #[inline(always)]
    fn adapt(&mut self, bit: bool) {
        // Towards 65536 after a 0, towards 0 after a 1.
        let up = ((65536 - u32::from(self.0)) >> SHIFT) as u16;
        let down = self.0 >> SHIFT;
        self.0 = if bit { self.0 - down } else { self.0 + up };
    }
}

/// One direction of the range coder.
pub(crate) trait Coder {
    /// A bit of the sort that a context is kept for. Returns what it is.
    fn bit(&mut self, context: usize, bit: bool) -> bool;

    /// A bit that is as likely as not.
    fn bypass_bit(&mut self, bit: bool) -> bool;

    /// A number of 1 or more as an Exp-Golomb code: how many bits follow its highest one, in unary and at
    /// most `longest`, then those bits. `prefix` gives the context of a bit of the unary part by how many
    /// came before it, and `suffix` that of the first bit which follows by how many there are; the others
    /// are bypass bits. Returns the number.
    #[inline(always)]
    fn exp_golomb(
        &mut self,
        longest: usize,
        prefix: impl Fn(usize) -> usize,
        suffix: impl Fn(usize) -> usize,
        wanted: u32,
    ) -> u32 {
        let wanted_length = wanted.max(1).ilog2() as usize;
        let mut length = 0;
        while length < longest && self.bit(prefix(length), length < wanted_length) {
            length += 1;
        }
        let mut number = 1;
        for below in (0..length).rev() {
            let bit = wanted >> below & 1 == 1;
            let bit = match below + 1 == length {
                true => self.bit(suffix(length), bit),
                false => self.bypass_bit(bit),
            };
            number = number << 1 | u32::from(bit);
        }
        number
    }

    /// A context is as sure of a 0 as it gets, so that another 0 leaves it as it is. A writer, which
    /// takes bits one by one, never says so.
    fn is_sure(&self, _context: usize) -> bool {
        false
    }

    /// Takes the zeros that come next in contexts that are sure, up to `most`. Returns how many. In
    /// a reader they cost a step for each byte, not for each bit.
    fn zeros(&mut self, _most: usize) -> usize {
        0
    }
}

/// Reads bits from bytes.
pub(crate) struct Reader<'a> {
    contexts: &'a mut [Context],
    bytes: &'a [u8],
    /// Bytes taken, some of them perhaps beyond the end.
    taken: usize,
    range: u32,
    code: u32,
    /// The model's error for bytes that no writer writes.
    fault: ErrorKind,
}

impl<'a> Reader<'a> {
    /// A reader of `bytes`.
    ///
    /// # Errors
    /// `fault` where the code is not below the range, which no writer writes.
    pub(crate) fn new(
        bytes: &'a [u8],
        contexts: &'a mut [Context],
        fault: ErrorKind,
    ) -> Result<Reader<'a>, ErrorKind> {
        let mut reader = Reader {
            contexts,
            bytes,
            taken: 0,
            range: u32::MAX,
            code: 0,
            fault,
        };
        for _ in 0..CODE_BYTES {
            reader.code = reader.code << 8 | reader.byte();
        }
        match reader.code < reader.range {
            true => Ok(reader),
            false => Err(fault),
        }
    }

    /// The next byte; 0 beyond the end.
    #[inline(always)]
    fn byte(&mut self) -> u32 {
        let byte = self.bytes.get(self.taken).copied().unwrap_or(0);
        self.taken += 1;
        byte.into()
    }

    /// Splits the range: 0 is the lower part, `bound` wide.
    #[inline(always)]
    fn split(&mut self, bound: u32) -> bool {
        let bit = self.code >= bound;
        if bit {
            self.code -= bound;
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < TOP {
            self.range <<= 8;
            self.code = self.code << 8 | self.byte();
        }
        bit
    }

    /// The bytes were read neither by more than `code` holds, nor in part.
    pub(crate) fn end(&self) -> Result<(), ErrorKind> {
        let whole = self.bytes.len() <= self.taken;
        if whole && self.taken <= self.bytes.len() + CODE_BYTES {
            Ok(())
        } else {
            Err(self.fault)
        }
    }
}

impl Coder for Reader<'_> {
    #[inline(always)]
    fn bit(&mut self, context: usize, _: bool) -> bool {
        let probability = self.contexts[context].probability();
        let bit = self.split((self.range >> 16) * probability);
        self.contexts[context].adapt(bit);
        bit
    }

    #[inline(always)]
    fn bypass_bit(&mut self, _: bool) -> bool {
        self.split(self.range >> 1)
    }

    #[inline(always)]
    fn is_sure(&self, context: usize) -> bool {
        self.contexts[context].probability() == SURE
    }

    fn zeros(&mut self, most: usize) -> usize {
        let mut done = 0;
        while done < most {
            // A 0 takes the range from `high * 2^16` and what is below to `high * SURE`, and so
            // `high` to `high - ceil(high * (2^16 - SURE) / 2^16)`. That step is the same down to
            // `same`; where `high` is above `split`, the bit is a 0 and the range needs no byte.
            let high = self.range >> 16;
            let step = (high * (65536 - SURE)).div_ceil(65536);
            let same = ((step - 1) << 16) / (65536 - SURE);
            let split = (self.code / SURE).max(TOP / SURE);
            let last = same.max(split);
            if high > last {
                let bits = (high - last).div_ceil(step).min((most - done) as u32);
                self.range = (high - (bits - 1) * step) * SURE;
                done += bits as usize;
            } else if self.code < high * SURE {
                self.split(high * SURE);
                done += 1;
            } else {
                break;
            }
        }
        done
    }
}

/// Appends bytes that a [`Reader`] turns into the same bits.
pub(crate) struct Writer<'a> {
    contexts: &'a mut [Context],
    out: &'a mut Vec<u8>,
    /// Length of `out` before.
    start: usize,
    /// Lowest number of the range; bit 32 is a carry into bytes that were written.
    low: u64,
    range: u32,
    /// Bytes that a reader takes.
    taken: usize,
}

impl<'a> Writer<'a> {
    pub(crate) fn new(out: &'a mut Vec<u8>, contexts: &'a mut [Context]) -> Writer<'a> {
        Writer {
            contexts,
            start: out.len(),
            out,
            low: 0,
            range: u32::MAX,
            taken: CODE_BYTES,
        }
    }

    #[inline(always)]
    fn split(&mut self, bound: u32, bit: bool) -> bool {
        if bit {
            self.low += u64::from(bound);
            self.range -= bound;
        } else {
            self.range = bound;
        }
        while self.range < TOP {
            self.range <<= 8;
            self.shift();
            self.taken += 1;
        }
        bit
    }

    /// Moves the highest byte of `low` out.
    fn shift(&mut self) {
        if self.low >> 32 != 0 {
            // The carry runs through bytes of 255. It ends before the start, since the whole
            // number is below 1.
            for byte in self.out[self.start..].iter_mut().rev() {
                *byte = byte.wrapping_add(1);
                if *byte != 0 {
                    break;
                }
            }
        }
        self.out.push((self.low >> 24) as u8);
        self.low = (self.low & 0x00ff_ffff) << 8;
    }

    /// Ends with the number of the range that has most zeros at its end, and leaves zeros out that a
    /// reader adds by itself.
    pub(crate) fn end(mut self) {
        let top = self.low + u64::from(self.range);
        let mut value = self.low;
        for bits in 1..32 {
            let mask = (1u64 << bits) - 1;
            let rounded = (self.low + mask) & !mask;
            if rounded < top {
                value = rounded;
            }
        }
        self.low = value;
        (0..CODE_BYTES).for_each(|_| self.shift());
        let least = self.start + self.taken - CODE_BYTES;
        while self.out.len() > least && self.out.last() == Some(&0) {
            self.out.pop();
        }
    }
}

impl Coder for Writer<'_> {
    #[inline(always)]
    fn bit(&mut self, context: usize, bit: bool) -> bool {
        let probability = self.contexts[context].probability();
        self.split((self.range >> 16) * probability, bit);
        self.contexts[context].adapt(bit);
        bit
    }

    #[inline(always)]
    fn bypass_bit(&mut self, bit: bool) -> bool {
        self.split(self.range >> 1, bit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn draw(state: &mut u64) -> u32 {
        *state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (*state >> 32) as u32
    }

    /// Bits of four sorts, each with its own probability of a 1 in 2^16, and even ones.
    fn bits(seed: u64, count: usize, ones: [u32; 4]) -> Vec<(usize, bool)> {
        let mut state = seed;
        let bit = |_| {
            let sort = draw(&mut state) as usize % 5;
            let one = ones.get(sort).copied().unwrap_or(1 << 15);
            (sort, draw(&mut state) >> 16 < one)
        };
        (0..count).map(bit).collect()
    }

    fn code(coder: &mut impl Coder, bits: &[(usize, bool)]) -> Vec<(usize, bool)> {
        let each = |&(sort, bit): &(usize, bool)| match sort {
            0..4 => (sort, coder.bit(sort, bit)),
            _ => (sort, coder.bypass_bit(bit)),
        };
        bits.iter().map(each).collect()
    }

    #[test]
    fn bits_come_back_in_few_bytes() {
        let cases = [
            [1 << 15; 4],
            [0; 4],
            [1 << 16; 4],
            [1, 1 << 16, 65_535, 300],
            [2000, 60_000, 9000, 20],
        ];
        for (seed, ones) in (0..).zip(cases) {
            for count in [0, 1, 2, 7, 100, 20_000] {
                for initial in [1, 128, 255] {
                    let bits = bits(seed, count, ones);
                    let mut bytes = vec![7];
                    let mut contexts = [Context::new(initial); 4];
                    let mut writer = Writer::new(&mut bytes, &mut contexts);
                    code(&mut writer, &bits);
                    writer.end();
                    let mut contexts = [Context::new(initial); 4];
                    let mut reader =
                        Reader::new(&bytes[1..], &mut contexts, ErrorKind::ProbesEntropy).unwrap();
                    let unknown: Vec<_> = bits.iter().map(|&(sort, _)| (sort, false)).collect();
                    assert_eq!(code(&mut reader, &unknown), bits);
                    assert_eq!(reader.end(), Ok(()));
                    assert_eq!(bytes[0], 7, "a carry left its bytes");
                    // Entropy, plus what an estimate that never rests wastes, plus the start.
                    let entropy = |one: u32| {
                        let p = f64::from(one) / 65536.0;
                        let h = |p: f64| if p > 0.0 { -p * p.log2() } else { 0.0 };
                        h(p) + h(1.0 - p)
                    };
                    let sum: f64 = ones.iter().map(|&one| entropy(one)).sum();
                    let wanted = count as f64 / 5.0 * (sum * 1.03 + 1.0 + 4.0 * 0.025) / 8.0;
                    let took = bytes.len() as f64;
                    assert!(
                        took < wanted * 1.02 + 70.0,
                        "{took} bytes, {wanted:.0} wanted"
                    );
                }
            }
        }
    }

    /// A longer or shorter section is refused: there is one length for each string of bits, up to
    /// zeros that a reader adds.
    #[test]
    fn bytes_left_or_missing_are_found() {
        for (seed, count) in [(1, 0), (2, 1), (3, 50), (4, 3000)] {
            let bits = bits(seed, count, [3000, 500, 60_000, 30_000]);
            let mut bytes = Vec::new();
            let contexts = [Context::new(128); 4];
            let mut own = contexts;
            let mut writer = Writer::new(&mut bytes, &mut own);
            code(&mut writer, &bits);
            writer.end();
            let taken = {
                let mut own = contexts;
                let mut reader = Reader::new(&bytes, &mut own, ErrorKind::ProbesEntropy).unwrap();
                code(&mut reader, &bits);
                reader.taken
            };
            for length in 0..bytes.len() + 9 {
                let mut cut = bytes.clone();
                cut.resize(length, 0);
                let mut own = contexts;
                let mut reader = Reader::new(&cut, &mut own, ErrorKind::ProbesEntropy).unwrap();
                let got = code(&mut reader, &bits);
                let ended = reader.end().is_ok();
                if length >= bytes.len() {
                    assert_eq!(got, bits);
                    assert_eq!(ended, length <= taken);
                } else if got == bits {
                    // Only zeros that had to stay were cut.
                    assert!(!ended);
                }
            }
        }
    }

    /// Zeros that are taken together leave a reader as it would be after each by itself.
    #[test]
    fn runs_of_zeros_are_those_of_single_bits() {
        let mut state = 9;
        for case in 0..300 {
            // Few ones among zeros, or bytes of any kind, small ones first.
            let bytes: Vec<u8> = (0..40)
                .map(|at| match case % 3 {
                    0 => 0,
                    1 => (draw(&mut state) >> (24 + at % 8)) as u8,
                    _ => draw(&mut state) as u8 & if at < case % 5 { 0 } else { 255 },
                })
                .collect();
            let mut contexts = [Context(SURE as u16)];
            let mut reader = Reader::new(&bytes, &mut contexts, ErrorKind::ProbesEntropy).unwrap();
            let mut other = [Context(SURE as u16)];
            let mut single = Reader::new(&bytes, &mut other, ErrorKind::ProbesEntropy).unwrap();
            for _ in 0..200 {
                let most = 1 + (draw(&mut state) >> (draw(&mut state) % 32)) as usize % 100_000;
                let taken = reader.zeros(most);
                for _ in 0..taken {
                    assert!(!single.bit(0, false));
                }
                let got = (reader.range, reader.code, reader.taken);
                assert_eq!(got, (single.range, single.code, single.taken));
                if taken < most {
                    assert!(reader.bit(0, false) && single.bit(0, false));
                    reader.contexts[0] = Context(SURE as u16);
                    single.contexts[0] = Context(SURE as u16);
                }
                if reader.taken > 2000 {
                    break;
                }
            }
        }
    }

    /// The claim at [`Context`].
    #[test]
    fn probabilities_stay_off_the_ends() {
        for initial in [1, 128, 255] {
            for bit in [false, true] {
                let mut context = Context::new(initial);
                for _ in 0..100_000 {
                    context.adapt(bit);
                    assert!((31..=65_505).contains(&context.probability()));
                }
            }
        }
        let mut context = Context::new(128);
        (0..100_000).for_each(|_| context.adapt(true));
        assert_eq!(context.probability(), 31);
        (0..100_000).for_each(|_| context.adapt(false));
        assert_eq!(context.probability(), 65_505);
    }
}
