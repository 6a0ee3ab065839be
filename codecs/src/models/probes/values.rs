//! From codes to f16, in integers (`spec/probes.md` §7).

use super::f16::f16_from_units;
use super::{CODES, Coding, GROUPS, Probe, Steps, Volume};

/// `round(2^(15 + i / 256))`: but for the first one no such power is near half an integer.
pub(super) const POWERS: [u32; 256] = powers();

/// The largest code of degree 0 in luma times its step: 40 octaves from 2^-24 up.
pub(super) const MOST_LOG: i32 = 40 * 256 - 1;
/// The largest magnitude of any other code times its step, eight times the luma of degree 0.
pub(super) const MOST_RELATIVE: i32 = 32768;

impl Volume {
    /// The 27 values of a probe: bits of f16, R, G, B of each coefficient. Those of an absent probe
    /// are 0; what a decoder shows in its place is filled in from others.
    pub fn values(&self, probe: &Probe) -> [u16; CODES] {
        match self.coding {
            Coding::Raw => probe.codes.map(|code| code as u16),
            Coding::Packed(steps) => values(&Scales::new(&steps), probe),
        }
    }
}

/// Steps, ready for use.
#[derive(Clone, Copy)]
pub(super) struct Scales(pub(super) [i32; 6]);

impl Scales {
    pub(super) fn new(steps: &Steps) -> Scales {
        Scales(steps.flat().map(i32::from))
    }
}

/// Luma of degree 0 in units of 2^-24, from its code times its step.
#[inline]
pub(super) fn log_luma(code: i32) -> i64 {
    if code <= 0 {
        return 0;
    }
    (i64::from(POWERS[code as usize % 256]) << (code / 256)) >> 15
}

/// Any other luma or chroma, from its code times its step.
#[inline]
pub(super) fn relative(luma: i64, code: i32) -> i64 {
    (luma * i64::from(code)) >> 12
}

/// All values of a packed probe.
#[inline]
pub(super) fn values(scales: &Scales, probe: &Probe) -> [u16; CODES] {
    let mut values = [0; CODES];
    let luma = log_luma(i32::from(probe.codes[0]) * scales.0[0]);
    if luma == 0 {
        return values;
    }
    for degree in 0..usize::from(probe.level.min(3)) {
        let (lumas, chromas) = (GROUPS[2 * degree], GROUPS[2 * degree + 1]);
        let (luma_scale, chroma_scale) = (scales.0[2 * degree], scales.0[2 * degree + 1]);
        for i in 0..lumas.end - lumas.start {
            let code = |at: usize| i32::from(probe.codes[at]);
            let y = match degree {
                0 => luma,
                _ => relative(luma, code(lumas.start + i) * luma_scale),
            };
            let co = relative(luma, code(chromas.start + 2 * i) * chroma_scale);
            let cg = relative(luma, code(chromas.start + 2 * i + 1) * chroma_scale);
            let rgb = [y + co - cg, y + cg, y - co - cg];
            let first = 3 * (degree * degree + i);
            for (value, units) in values[first..first + 3].iter_mut().zip(rgb) {
                // Radiance from all around is not negative.
                *value = f16_from_units(if degree == 0 { units.max(0) } else { units });
            }
        }
    }
    values
}

/// By integer square roots: 2^(i/256) is the product of 2^(1/2), 2^(1/4), ... 2^(1/256) for the bits
/// of i.
const fn powers() -> [u32; 256] {
    // Roots in units of 2^-60, rounded down; eight factors lose less than 2^-56 in all.
    let mut roots = [0u128; 8];
    let mut root = 2u128 << 60;
    let mut k = 0;
    while k < 8 {
        root = isqrt(root << 60);
        roots[k] = root;
        k += 1;
    }
    let mut table = [0; 256];
    let mut i = 0;
    while i < 256 {
        let mut power = 1u128 << 60;
        let mut k = 0;
        while k < 8 {
            if i >> (7 - k) & 1 == 1 {
                power = (power * roots[k]) >> 60;
            }
            k += 1;
        }
        table[i] = ((power + (1 << 44)) >> 45) as u32;
        i += 1;
    }
    table
}

/// The square root, rounded down.
const fn isqrt(value: u128) -> u128 {
    let mut root = 0u128;
    let mut bit = 1u128 << 63;
    while bit > 0 {
        let next = root | bit;
        if next * next <= value {
            root = next;
        }
        bit >>= 1;
    }
    root
}
