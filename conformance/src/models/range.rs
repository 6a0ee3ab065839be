//! The range coder of packed content (`spec/probes.md` §6.2) from the writer's side, as it is defined
//! and not as it is fast: the lowest number of the range is one long number.

/// A bit, and what its bound depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bit {
    /// In a context, by its number.
    In(usize, bool),
    /// As likely as not.
    Even(bool),
}

/// Bytes of bits in all lengths that they may have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coded {
    /// All bytes that a decoder takes.
    whole: Vec<u8>,
    /// Zeros among them that may be left out at the end: 3 or 4.
    zeros: usize,
}

impl Coded {
    /// As short as may be.
    pub fn short(&self) -> Vec<u8> {
        self.whole[..self.whole.len() - self.zeros].to_vec()
    }

    /// As long as may be.
    pub fn whole(&self) -> Vec<u8> {
        self.whole.clone()
    }
}

/// Codes bits in contexts that start at these numbers b.
pub fn code(initial: &[u8], bits: &[Bit]) -> Coded {
    let estimates = initial.iter().map(|&b| 256 * u32::from(b) + 128);
    let mut estimates: Vec<u32> = estimates.collect();
    // The lowest number of the range, highest byte first. Its last four bytes are as `code` is.
    let mut low = vec![0u8; 4];
    let mut range = u32::MAX;
    for &bit in bits {
        let (bound, one) = match bit {
            Bit::In(context, one) => ((range >> 16) * estimates[context], one),
            Bit::Even(one) => (range / 2, one),
        };
        if one {
            add(&mut low, bound);
            range -= bound;
        } else {
            range = bound;
        }
        if let Bit::In(context, one) = bit {
            let estimate = &mut estimates[context];
            match one {
                true => *estimate -= *estimate >> 5,
                false => *estimate += (65536 - *estimate) >> 5,
            }
        }
        while range < 1 << 24 {
            range <<= 8;
            low.push(0);
        }
    }
    // A number of the range that ends in as many zeros as there may be.
    for zeros in [4, 3] {
        let mut whole = low.clone();
        let below = (1u64 << (8 * zeros)) - 1;
        let tail = low[low.len() - 4..].iter();
        let tail = tail.fold(0u64, |tail, &byte| tail << 8 | u64::from(byte));
        let up = (below + 1 - (tail & below)) & below;
        if up >= u64::from(range) {
            continue;
        }
        add(&mut whole, up as u32);
        return Coded { whole, zeros };
    }
    // The range is 2^24 or more, so three zeros fit.
    Coded {
        whole: low,
        zeros: 0,
    }
}

/// Adds to a long number. The sum is below 1, so no carry leaves it.
fn add(number: &mut [u8], term: u32) {
    let mut carry = u64::from(term);
    for byte in number.iter_mut().rev() {
        carry += u64::from(*byte);
        *byte = carry as u8;
        carry >>= 8;
    }
}
