//! What clients see of probes, from `spec/probes.md` §7 and §8 alone: slowly, and in another way
//! than the decoder.

use std::hash::Hasher as _;

use twox_hash::XxHash64;

use super::expected::Probes;
use crate::models::probes::writer::{GROUPS, Probe, Volume};

/// The lines of the dump with the digests of a volume's values and visibility.
pub fn lines(id: u32, content: &Probes) -> Vec<String> {
    let volume = &content.volume;
    let mut digest = XxHash64::with_seed(0);
    for (values, probe) in shown(volume, &content.probes).iter().zip(&content.probes) {
        for (&value, &code) in values.iter().zip(&probe.codes) {
            // Raw values are shown as they came, -0 too.
            let own = !volume.is_packed() && probe.level > 0;
            let bits = if own { code as u16 } else { bits(value) };
            digest.write(&bits.to_le_bytes());
        }
    }
    let mut lines = vec![format!("values {id} {:016x}", digest.finish())];
    if let Some(bytes) = &content.visibility {
        let digest = XxHash64::oneshot(0, bytes);
        lines.push(format!("visibility {id} {digest:016x}"));
    }
    lines
}

/// 27 values of a probe, in units of 2^-24 after rounding.
type Values = [i64; 27];

/// Most steps from an absent probe that is filled to a present one.
const REACH: usize = 4;

/// Values of all probes, absent ones within reach filled in (B-060).
pub fn shown(volume: &Volume, probes: &[Probe]) -> Vec<Values> {
    let mut values: Vec<Values> = probes.iter().map(|p| of_probe(volume, p)).collect();
    let mut near: Vec<bool> = probes.iter().map(|p| p.level > 0).collect();
    // Each round fills what is one step from what was filled before it.
    for _ in 0..REACH {
        let border: Vec<usize> = (0..probes.len())
            .filter(|&p| !near[p] && around(volume, p).any(|n| near[n]))
            .collect();
        let filled = border.iter().map(|&p| {
            let from: Vec<usize> = around(volume, p).filter(|&n| near[n]).collect();
            std::array::from_fn(|v| {
                let sum: i64 = from.iter().map(|&n| values[n][v]).sum();
                round(sum.div_euclid(from.len() as i64))
            })
        });
        let filled: Vec<Values> = filled.collect();
        for (&p, filled) in border.iter().zip(filled) {
            values[p] = filled;
            near[p] = true;
        }
    }
    values
}

fn around(volume: &Volume, probe: usize) -> impl Iterator<Item = usize> {
    let after = volume.next_to(probe, false);
    volume.next_to(probe, true).into_iter().chain(after)
}

/// Values of a probe (B-050 to B-053).
pub fn of_probe(volume: &Volume, probe: &Probe) -> Values {
    if !volume.is_packed() {
        return probe.codes.map(|code| units(code as u16));
    }
    let mut values = [0; 27];
    let e = probe.codes[0] * i32::from(volume.steps[0]);
    if e == 0 {
        return values;
    }
    // 2^15 to 2^16 in f64 is right far beyond the 0.001 by which none of these is near a tie.
    let power = 2f64.powf(15.0 + f64::from(e % 256) / 256.0).round() as i64;
    let luma = (power << (e / 256)) >> 15;
    let relative = |group: usize, at: usize| {
        let code = i64::from(probe.codes[GROUPS[group] + at]);
        (luma * code * i64::from(volume.steps[group])).div_euclid(4096)
    };
    for lm in 0..9 {
        let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2][lm];
        let at = lm - degree * degree;
        let y = if lm == 0 {
            luma
        } else {
            relative(2 * degree, at)
        };
        let co = relative(2 * degree + 1, 2 * at);
        let cg = relative(2 * degree + 1, 2 * at + 1);
        for (c, value) in [y + co - cg, y + cg, y - co - cg].into_iter().enumerate() {
            values[3 * lm + c] = round(if lm == 0 { value.max(0) } else { value });
        }
    }
    values
}

/// Bits of an f16 as a multiple of 2^-24.
fn units(bits: u16) -> i64 {
    let (exponent, fraction) = (bits >> 10 & 31, i64::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction,
        _ => (1024 + fraction) << (exponent - 1),
    };
    if bits & 0x8000 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// The nearest f16, the even one of two, at most 65504 in magnitude.
fn round(value: i64) -> i64 {
    let magnitude = value.abs();
    // The largest f16 that is not above.
    let (mut low, mut high) = (0u16, 0x7bff);
    while low < high {
        let middle = low + (high - low).div_ceil(2);
        if units(middle) <= magnitude {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    let below = magnitude - units(low);
    let above = if low == 0x7bff {
        i64::MAX
    } else {
        units(low + 1) - magnitude
    };
    let up = above < below || (above == below && low & 1 == 1);
    value.signum() * units(low + u16::from(up))
}

/// Bits of a rounded value.
fn bits(value: i64) -> u16 {
    let magnitude = value.unsigned_abs();
    let length = 64 - magnitude.leading_zeros();
    let bits = match length {
        0..=10 => magnitude,
        _ => (u64::from(length - 10) << 10) | (magnitude >> (length - 11) & 1023),
    };
    bits as u16 | if value < 0 { 0x8000 } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_f16_is_itself() {
        for pattern in (0..0x7c00).chain(0x8001..0xfc00) {
            assert_eq!(bits(units(pattern)), pattern);
            assert_eq!(round(units(pattern)), units(pattern));
        }
    }

    #[test]
    fn ties_go_to_even() {
        let one = 1 << 24;
        assert_eq!(round(one + (1 << 13)), one);
        assert_eq!(round(one + (3 << 13)), one + (1 << 15));
        assert_eq!(round(-one - (1 << 13) - 1), -one - (1 << 14));
        assert_eq!(round(i64::MAX / 4), 65504 << 24);
        assert_eq!(round(i64::MIN / 4), -65504 << 24);
    }
}
