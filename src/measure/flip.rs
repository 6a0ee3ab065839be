//! LDR-FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020), by
//! NVIDIA's implementation.

use crate::render::image::Picture;
use crate::{Error, Result};

/// Pixels a degree of visual angle: a 0.69 m wide 4K display seen from 0.7 m, the default of the
/// published implementation. FLIP depends on it; figures are comparable only where it is the same.
pub const PIXELS_PER_DEGREE: f32 = nv_flip::DEFAULT_PIXELS_PER_DEGREE;

/// Largest picture compared: 8K. FLIP holds about a hundred bytes a pixel.
pub const MAX_PIXELS: usize = 7680 * 4320;

/// FLIP error of each pixel, 0..=1, of two sRGB pictures.
///
/// # Errors
/// `Invalid` where the sizes differ, a picture is empty, or larger than [`MAX_PIXELS`].
pub fn error_map(picture: &Picture, reference: &Picture) -> Result<Vec<f32>> {
    Ok(compute(picture, reference)?.to_vec())
}

/// Mean of an error map over all pixels, or over those of a mask; 0 where there are none.
pub fn mean(errors: &[f32], mask: Option<&[bool]>) -> f64 {
    let inside = |i: usize| mask.is_none_or(|mask| mask[i]);
    let (mut sum, mut count) = (0.0, 0u64);
    for (_, &error) in errors.iter().enumerate().filter(|(i, _)| inside(*i)) {
        sum += f64::from(error);
        count += 1;
    }
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// The error map in the colours of the published tool (magma: black 0, white 1).
///
/// # Errors
/// As [`error_map`].
pub fn error_picture(picture: &Picture, reference: &Picture) -> Result<Picture> {
    let map = compute(picture, reference)?.apply_color_lut(&nv_flip::magma_lut());
    let rgb = map
        .to_vec()
        .chunks_exact(3)
        .map(|p| [p[0], p[1], p[2]])
        .collect();
    Ok(Picture {
        width: picture.width,
        height: picture.height,
        rgb,
    })
}

fn compute(picture: &Picture, reference: &Picture) -> Result<nv_flip::FlipImageFloat> {
    let pixels = picture.width as usize * picture.height as usize;
    let usable = (picture.width, picture.height) == (reference.width, reference.height)
        && (1..=MAX_PIXELS).contains(&pixels)
        && picture.rgb.len() == pixels
        && reference.rgb.len() == pixels;
    if !usable {
        return Err(Error::Invalid(format!(
            "FLIP compares pictures of one size and at most {MAX_PIXELS} pixels, not {}x{} with \
             {}x{}",
            picture.width, picture.height, reference.width, reference.height
        )));
    }
    let image = |p: &Picture| {
        nv_flip::FlipImageRgb8::with_data(p.width, p.height, bytemuck::cast_slice(&p.rgb))
    };
    Ok(nv_flip::flip(
        image(reference),
        image(picture),
        PIXELS_PER_DEGREE,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_on_white_is_near_one_and_equal_is_zero() {
        let (white, black) = (
            Picture::filled(32, 32, [255; 3]),
            Picture::filled(32, 32, [0; 3]),
        );
        let errors = error_map(&black, &white).expect("compared");
        assert!(
            (mean(&errors, None) - 0.97).abs() < 0.03,
            "{}",
            mean(&errors, None)
        );
        assert!(
            error_map(&white, &white)
                .expect("compared")
                .iter()
                .all(|&e| e == 0.0)
        );
        let shown = error_picture(&white, &white).expect("compared");
        assert!(shown.rgb.iter().flatten().all(|&c| c < 8));
    }

    #[test]
    fn a_local_error_stays_local_and_the_mask_counts() {
        let a = Picture::filled(60, 60, [128; 3]);
        let mut b = a.clone();
        b.rgb[5 * 60 + 5] = [255, 0, 0];
        let errors = error_map(&b, &a).expect("compared");
        assert!(errors[5 * 60 + 5] > 0.1);
        let far: Vec<bool> = (0..3600).map(|i| i / 60 > 40).collect();
        assert_eq!(mean(&errors, Some(&far)), 0.0);
        assert!(mean(&errors, None) > 0.0);
        assert_eq!(mean(&errors, Some(&[false; 3600])), 0.0);
    }

    #[test]
    fn sizes_are_checked() {
        let a = Picture::filled(4, 4, [1; 3]);
        assert!(error_map(&a, &Picture::filled(4, 5, [1; 3])).is_err());
        assert!(error_map(&Picture::default(), &Picture::default()).is_err());
        assert!(
            error_map(
                &a,
                &Picture {
                    rgb: vec![[1; 3]; 3],
                    ..a
                }
            )
            .is_err()
        );
    }
}
