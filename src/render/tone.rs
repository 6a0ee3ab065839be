//! From radiance to what a picture can show: one curve for every method, so that an error of light
//! is the same error of the picture whatever made it.

use glam::Vec3;

/// Radiance that the curve shows as white at exposure 1.
pub const WHITE: f32 = 6.0;

/// Extended Reinhard curve per channel at exposure 1 (Reinhard et al. 2002, Eq. 4), to 0..=1 in
/// linear light. Darkness stays as it is, [`WHITE`] and what is brighter becomes 1.
pub fn tone(c: Vec3) -> Vec3 {
    (c * (Vec3::ONE + c / (WHITE * WHITE)) / (Vec3::ONE + c)).min(Vec3::ONE)
}

/// Linear radiance times `exposure` through [`tone`]: what [`super::Picture::from_linear`] encodes.
/// What is negative, as a sum of spherical harmonics may be, becomes 0.
pub fn develop(radiance: &[Vec3], exposure: f32) -> Vec<Vec3> {
    radiance
        .iter()
        .map(|c| tone((*c * exposure).max(Vec3::ZERO)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_monotone_from_black_to_white() {
        assert_eq!(tone(Vec3::ZERO), Vec3::ZERO);
        assert!((tone(Vec3::splat(WHITE)).x - 1.0).abs() < 1e-6);
        assert_eq!(tone(Vec3::splat(1e5)), Vec3::ONE);
        let mut last = -1.0;
        for i in 0..1000 {
            let shown = tone(Vec3::splat(i as f32 * 0.01)).x;
            assert!(shown >= last, "{i}");
            last = shown;
        }
        // A dark radiance is shown as it is.
        assert!((tone(Vec3::splat(1e-3)).x - 1e-3).abs() < 2e-6);
    }

    #[test]
    fn exposure_scales_and_the_negative_is_black() {
        let shown = develop(&[Vec3::new(-1.0, 0.5, 1.0)], 2.0);
        assert_eq!(shown, [tone(Vec3::new(0.0, 1.0, 2.0))]);
    }
}
