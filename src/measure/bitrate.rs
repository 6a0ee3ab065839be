//! Bytes to Mbit/s.

/// Mean rate in Mbit/s (10^6 bits) of `bytes` that carry `frames` frames at `fps` frames a second.
/// `None` for no frame or a rate that is not positive and finite.
pub fn mbit_per_second(bytes: u64, frames: u64, fps: f64) -> Option<f64> {
    let usable = frames > 0 && fps.is_finite() && fps > 0.0;
    usable.then(|| bytes as f64 * 8.0 * fps / frames as f64 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_megabyte_in_a_second_is_eight_megabits() {
        assert_eq!(mbit_per_second(1_000_000, 60, 60.0), Some(8.0));
        assert_eq!(mbit_per_second(1_000_000, 120, 60.0), Some(4.0));
        assert_eq!(mbit_per_second(0, 1, 60.0), Some(0.0));
        for (frames, fps) in [
            (0, 60.0),
            (1, 0.0),
            (1, -1.0),
            (1, f64::NAN),
            (1, f64::INFINITY),
        ] {
            assert_eq!(mbit_per_second(1, frames, fps), None);
        }
    }
}
