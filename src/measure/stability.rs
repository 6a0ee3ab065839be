//! How steady a method is over time, and how much noise its reference has.

use super::metrics::{Field, common_mask, mean_square};
use crate::Result;

/// Two successive frames of one method.
#[derive(Clone, Copy, Debug)]
pub struct FramePair<'a> {
    pub before: Field<'a>,
    pub after: Field<'a>,
}

/// Flicker: the root mean square of the method's frame difference minus the reference's, in units
/// of the field, over the pixels that show geometry in all four. 0 for a method whose error does
/// not change from frame to frame, however large it is.
///
/// # Errors
/// `Invalid` where sizes differ, a value is not finite, or no pixel is left.
pub fn flicker(method: &FramePair, reference: &FramePair) -> Result<f64> {
    let mask = common_mask(&[
        &method.before,
        &method.after,
        &reference.before,
        &reference.after,
    ])?;
    let step = |pair: &FramePair, i: usize| {
        f64::from(pair.after.values[i]) - f64::from(pair.before.values[i])
    };
    Ok(mean_square(&mask, |i| step(method, i) - step(reference, i)).sqrt())
}

/// Root mean square noise of a reference, estimated from two independent halves of its samples.
///
/// The reference is the mean of the halves A and B, each of variance v: A - B has variance 2 v and
/// the mean v / 2, so its noise is rms(A - B) / 2. The halves must not share a sample; with a
/// low-discrepancy sequence that both halves split, this over-states the noise.
///
/// # Errors
/// `Invalid` where sizes differ, a value is not finite, or no pixel is left.
pub fn noise_of_mean(half_a: &Field, half_b: &Field) -> Result<f64> {
    let mask = common_mask(&[half_a, half_b])?;
    let difference = |i: usize| f64::from(half_a.values[i]) - f64::from(half_b.values[i]);
    Ok(mean_square(&mask, difference).sqrt() / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [bool; 4] = [true, true, true, false];

    fn field(values: &[f32; 4]) -> Field<'_> {
        Field {
            width: 2,
            height: 2,
            values,
            mask: &ALL,
        }
    }

    #[test]
    fn a_constant_error_does_not_flicker() {
        let reference = FramePair {
            before: field(&[0.5, 0.25, 1.0, 0.0]),
            after: field(&[0.75; 4]),
        };
        let method = FramePair {
            before: field(&[0.25, 0.0, 0.75, 9.0]),
            after: field(&[0.5; 4]),
        };
        assert_eq!(flicker(&method, &reference).expect("flicker"), 0.0);
    }

    #[test]
    fn flicker_by_hand() {
        let still = FramePair {
            before: field(&[0.5; 4]),
            after: field(&[0.5; 4]),
        };
        let method = FramePair {
            before: field(&[0.5; 4]),
            after: field(&[0.5, 0.5, 0.8, 0.0]),
        };
        let expected = (0.3f64 * 0.3 / 3.0).sqrt();
        assert!((flicker(&method, &still).expect("flicker") - expected).abs() < 1e-7);
    }

    #[test]
    fn noise_of_two_halves_is_that_of_their_mean() {
        // Halves of 8 uniform samples in 0..1 each: the mean of 16 has variance 1 / (12 * 16).
        let (width, height) = (200, 100);
        let mask = vec![true; width * height];
        let mut state = 7u32;
        let mut half = || -> Vec<f32> {
            (0..width * height)
                .map(|_| {
                    let sum: f32 = (0..8)
                        .map(|_| {
                            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                            let word = (state >> (state >> 28).wrapping_add(4)) ^ state;
                            (word.wrapping_mul(277_803_737) >> 8) as f32 / (1 << 24) as f32
                        })
                        .sum();
                    sum / 8.0
                })
                .collect()
        };
        let (a, b) = (half(), half());
        let field = |values| Field {
            width: 200,
            height: 100,
            values,
            mask: &mask,
        };
        let noise = noise_of_mean(&field(&a), &field(&b)).expect("noise");
        let expected = (1.0f64 / 192.0).sqrt();
        assert!(
            (noise / expected - 1.0).abs() < 0.02,
            "{noise} against {expected}"
        );
    }
}
