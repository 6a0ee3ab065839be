//! f16 and integers in units of 2^-24, the smallest f16 above 0: all f16 are such integers.

/// Bits of the largest finite f16, 65504.
const LARGEST: u64 = 0x7bff;

/// The nearest f16, ties to even, at most the largest finite one in magnitude.
#[inline]
pub(super) fn f16_from_units(units: i64) -> u16 {
    let magnitude = units.unsigned_abs();
    // Eleven bits are kept: below 2^11 all of them, which are the bits of a denormal f16 or of the
    // first ones that are not.
    let shift = (magnitude | 1024).ilog2() - 10;
    let half = (1u64 << shift) >> 1;
    let odd = (magnitude >> shift) & half.min(1);
    let kept = magnitude.saturating_add(half.saturating_sub(1) + odd) >> shift;
    // A carry into the twelfth bit is one into the exponent.
    let bits = ((u64::from(shift) << 10) + kept).min(LARGEST) as u16;
    bits | (((units < 0) as u16) << 15)
}

/// The value of a finite f16. The exponent of an infinity counts like any other.
#[inline]
pub(super) fn units_from_f16(bits: u16) -> i64 {
    let exponent = u32::from(bits >> 10 & 31);
    let mantissa = i64::from(bits & 1023);
    let magnitude = match exponent {
        0 => mantissa,
        _ => (mantissa | 1024) << (exponent - 1),
    };
    if bits >> 15 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// The value of the bits of an f16.
pub fn f32_from_f16(bits: u16) -> f32 {
    if bits >> 10 & 31 == 31 {
        let sign = u32::from(bits >> 15) << 31;
        return f32::from_bits(sign | 0x7f80_0000 | u32::from(bits & 1023) << 13);
    }
    // Exact: eleven bits, and a power of two. Of -0 the sign is lost on the way.
    let magnitude = units_from_f16(bits & 0x7fff) as f32 / 16_777_216.0;
    if bits >> 15 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// Bits of an f16 near a value: to within half a step, at most 65504 in magnitude, 0 of what is not
/// a number.
pub fn f16_from_f32(value: f32) -> u16 {
    f16_from_units(round(f64::from(value) * 16_777_216.0))
}

/// The nearest integer, ties away from 0, within 64 bits; 0 of what is not a number.
pub(super) fn round(value: f64) -> i64 {
    (if value < 0.0 {
        value - 0.5
    } else {
        value + 0.5
    }) as i64
}
