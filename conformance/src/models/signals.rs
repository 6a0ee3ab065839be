//! The signals block that the baked models share, `spec/obscurance.md` §3.

use std::fmt::Write as _;

use dapple_codec::signals::Signals;

#[cfg(feature = "generate")]
use crate::stream_builder::floats as float_bytes;
use crate::text::{commas, floats};

/// Its fields in the line of the parameters of a dump: number of signals, kinds, distances, share.
pub fn dump(signals: &Signals, out: &mut String) {
    let _ = write!(out, "{} ", signals.count);
    commas(signals.kernels, out, |kernel, out| {
        write!(out, "{}", kernel.kind)
    });
    let [first, second] = signals.kernels;
    floats(&[first.distance, second.distance, signals.share], out);
}

/// The block as it will stand there.
#[cfg(feature = "generate")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignalsBlock {
    pub count: u8,
    pub kinds: [u8; 2],
    pub reserved: u8,
    pub distances: [f32; 2],
    pub share: f32,
}

#[cfg(feature = "generate")]
impl SignalsBlock {
    /// One signal of the exponential kernel of 2 m.
    pub const ONE: SignalsBlock = SignalsBlock {
        count: 1,
        kinds: [1, 0],
        reserved: 0,
        distances: [2.0, 0.0],
        share: 0.0,
    };

    /// Two signals, of 2 m and of 300 m.
    pub const TWO: SignalsBlock = SignalsBlock {
        count: 2,
        kinds: [1, 1],
        reserved: 0,
        distances: [2.0, 300.0],
        share: 0.75,
    };

    /// One signal that is the blend of those.
    pub const BLENDED: SignalsBlock = SignalsBlock {
        count: 1,
        ..SignalsBlock::TWO
    };

    /// The 16 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![self.count, self.kinds[0], self.kinds[1], self.reserved];
        bytes.extend(float_bytes(&self.distances));
        bytes.extend(float_bytes(&[self.share]));
        bytes
    }

    /// The blend of signals at a point (O-010), in real numbers.
    pub fn blend(&self, signals: &[f64]) -> f64 {
        match signals {
            &[a, b] => a + (b - a) * f64::from(self.share),
            _ => signals[0],
        }
    }
}
