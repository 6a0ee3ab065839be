//! IEEE 754 binary16, which [`f32`] holds exactly.

/// The value of the bits of an f16.
pub fn f32_from_f16(bits: u16) -> f32 {
    let sign = u32::from(bits >> 15) << 31;
    let (exponent, mantissa) = (u32::from(bits >> 10 & 31), u32::from(bits & 1023));
    let magnitude = match exponent {
        0 => mantissa as f32 / 16_777_216.0,
        31 => f32::from_bits(0x7f80_0000 | mantissa << 13),
        _ => f32::from_bits((exponent + 112) << 23 | mantissa << 13),
    };
    f32::from_bits(magnitude.to_bits() | sign)
}

/// The nearest finite f16, ties to even; 0 of what is not a number.
pub fn f16_from_f32(value: f32) -> u16 {
    let magnitude = value.abs().min(65504.0);
    if magnitude.is_nan() || value.is_nan() {
        return 0;
    }
    // To the step of f16 at this size, which is 2^-24 at least: exact in f64, whose own rounding is
    // to even.
    let exponent = (magnitude.to_bits() >> 23) as i32 - 127;
    let step = f64::from((exponent - 10).max(-24)).exp2();
    let steps = (f64::from(magnitude) / step).round_ties_even();
    let rounded = (steps * step) as f32;
    let bits = if rounded < 6.103_515_6e-5 {
        steps as u16
    } else {
        let bits = rounded.min(65504.0).to_bits();
        ((bits >> 13) - (112 << 10)) as u16
    };
    bits | u16::from(value.is_sign_negative()) << 15
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finite_f16_comes_back_and_neighbours_round_to_the_nearest() {
        for bits in 0..=u16::MAX {
            if bits >> 10 & 31 == 31 {
                assert!(!f32_from_f16(bits).is_finite());
                continue;
            }
            let value = f32_from_f16(bits);
            assert_eq!(f16_from_f32(value), bits, "{value}");
            if bits & 0x7fff < 0x7bff {
                let next = f32_from_f16(bits + 1);
                let third = value + (next - value) * 0.4;
                assert_eq!(f16_from_f32(third), bits, "{third}");
                let half = 0.5 * (value + next);
                assert_eq!(f16_from_f32(half), bits + (bits & 1), "{half}");
            }
        }
        assert_eq!(f32_from_f16(0x3c00), 1.0);
        assert_eq!(f32_from_f16(0xc000), -2.0);
        assert_eq!(f16_from_f32(f32::INFINITY), 0x7bff);
        assert_eq!(f16_from_f32(f32::NAN), 0);
    }
}
