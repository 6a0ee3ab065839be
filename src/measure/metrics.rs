//! The error of a picture, or of a field of ambient occlusion, against its reference.

use serde::Serialize;

use super::{flip, ssim};
use crate::render::image::Picture;
use crate::{Error, Result};

/// Values that pictures and fields are compared in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Values {
    /// The 8-bit sRGB codes over 255: what a display is sent. The usual choice for PSNR and SSIM.
    #[default]
    Srgb,
    /// Linear light, the sRGB curve undone.
    Linear,
}

/// A field of linear values in 0..=1, row by row from the top left, that is compared only where
/// there is geometry.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    pub width: u32,
    pub height: u32,
    /// `width * height` values.
    pub values: &'a [f32],
    /// `width * height` flags: whether the pixel shows geometry.
    pub mask: &'a [bool],
}

/// How far a picture, or the picture of a field, is from its reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Pixels compared: all of a picture, the geometry of a field.
    pub pixels: u64,
    /// Mean squared error, of values in 0..=1.
    pub mse: f64,
    /// Square root of `mse`.
    pub rmse: f64,
    /// dB for a peak of 1; infinite for equal values (`null` in JSON).
    pub psnr: f64,
    /// Structural similarity, 1 for equal pictures; see [`ssim::ssim`]. `None` where no 11 x 11
    /// window fits.
    pub ssim: Option<f64>,
    /// Mean LDR-FLIP error, 0 for equal pictures, at most 1; see [`flip`].
    pub flip: f64,
}

/// PSNR in dB of a mean squared error of values whose peak is 1; infinite for 0.
///
/// To sum up several frames, average their `mse` and convert once: the mean of PSNRs is infinite
/// as soon as one frame is exact.
pub fn psnr(mse: f64) -> f64 {
    10.0 * (1.0 / mse).log10()
}

/// Text of a PSNR: two decimals, or `inf`.
pub fn psnr_text(psnr: f64) -> String {
    if psnr.is_infinite() {
        "inf".to_string()
    } else {
        format!("{psnr:.2}")
    }
}

/// Mean over frames: errors are averaged over frames of equal weight, PSNR is that of the mean
/// squared error, RMSE its root. SSIM is averaged over the frames that have one. `None` for no
/// frame.
pub fn mean(frames: &[Difference]) -> Option<Difference> {
    let n = frames.len() as f64;
    if frames.is_empty() {
        return None;
    }
    let mse = frames.iter().map(|f| f.mse).sum::<f64>() / n;
    let ssims: Vec<f64> = frames.iter().filter_map(|f| f.ssim).collect();
    Some(Difference {
        pixels: frames.iter().map(|f| f.pixels).sum(),
        mse,
        rmse: mse.sqrt(),
        psnr: psnr(mse),
        ssim: (!ssims.is_empty()).then(|| ssims.iter().sum::<f64>() / ssims.len() as f64),
        flip: frames.iter().map(|f| f.flip).sum::<f64>() / n,
    })
}

/// Compares two pictures: MSE, RMSE and PSNR over all three channels, SSIM over luma, both in
/// `values`; FLIP always of the sRGB pictures, as it is defined.
///
/// # Errors
/// `Invalid` where the sizes differ, a picture is empty or too large for FLIP.
pub fn compare_pictures(
    picture: &Picture,
    reference: &Picture,
    values: Values,
) -> Result<Difference> {
    same_size(
        (picture.width, picture.height, picture.rgb.len()),
        (reference.width, reference.height, reference.rgb.len()),
    )?;
    let table = code_values(values);
    let value = |code: u8| table[usize::from(code)];

    let mut sum = 0.0;
    for (a, b) in picture.rgb.iter().zip(&reference.rgb) {
        for channel in 0..3 {
            let d = value(a[channel]) - value(b[channel]);
            sum += d * d;
        }
    }
    let mse = sum / (3 * picture.rgb.len()) as f64;

    let luma = |p: &Picture| -> Vec<f64> {
        p.rgb
            .iter()
            .map(|rgb| luma(values, rgb.map(value)))
            .collect()
    };
    let ssim = ssim::ssim(
        picture.width as usize,
        picture.height as usize,
        &luma(picture),
        &luma(reference),
        None,
    );
    let errors = flip::error_map(picture, reference)?;
    Ok(Difference {
        pixels: picture.rgb.len() as u64,
        mse,
        rmse: mse.sqrt(),
        psnr: psnr(mse),
        ssim,
        flip: flip::mean(&errors, None),
    })
}

/// Compares two fields over the pixels that show geometry in both. MSE, RMSE, PSNR and SSIM are of
/// the linear values; FLIP is of the fields displayed as gray (`round(255 * value)`,
/// [`Picture::from_values`]; pixels without geometry are white in both) and averaged over the same
/// pixels.
///
/// # Errors
/// `Invalid` where the sizes differ, a value is not finite, no pixel shows geometry, or the field
/// is too large for FLIP.
pub fn compare_fields(field: &Field, reference: &Field) -> Result<Difference> {
    let mask = common_mask(&[field, reference])?;
    let mse = mean_square(&mask, |i| {
        f64::from(field.values[i]) - f64::from(reference.values[i])
    });
    // Pixels without geometry are given the same value, so that they hold no error that a filter
    // could carry over the border.
    let shown = |f: &Field| -> Vec<f32> {
        f.values
            .iter()
            .zip(&mask)
            .map(|(&v, &inside)| if inside { v } else { 1.0 })
            .collect()
    };
    let (a, b) = (shown(field), shown(reference));
    let wide = |v: &[f32]| -> Vec<f64> { v.iter().map(|&v| f64::from(v)).collect() };
    let ssim = ssim::ssim(
        field.width as usize,
        field.height as usize,
        &wide(&a),
        &wide(&b),
        Some(&mask),
    );
    let errors = flip::error_map(
        &Picture::from_values(field.width, field.height, &a),
        &Picture::from_values(field.width, field.height, &b),
    )?;
    Ok(Difference {
        pixels: mask.iter().filter(|&&inside| inside).count() as u64,
        mse,
        rmse: mse.sqrt(),
        psnr: psnr(mse),
        ssim,
        flip: flip::mean(&errors, Some(&mask)),
    })
}

/// Pixels that show geometry in every one of `fields`.
///
/// # Errors
/// `Invalid` where sizes differ, a value within the mask is not finite, or no pixel is left.
pub(super) fn common_mask(fields: &[&Field]) -> Result<Vec<bool>> {
    let Some(first) = fields.first() else {
        return Err(Error::Invalid("there is no field to compare".to_string()));
    };
    let mut mask = first.mask.to_vec();
    for field in fields {
        same_size(
            (first.width, first.height, first.values.len()),
            (field.width, field.height, field.values.len()),
        )?;
        if field.mask.len() != field.values.len() {
            return Err(Error::Invalid(format!(
                "a field of {} values has a geometry mask of {}",
                field.values.len(),
                field.mask.len()
            )));
        }
        for (all, &inside) in mask.iter_mut().zip(field.mask) {
            *all &= inside;
        }
    }
    for field in fields {
        let bad = field
            .values
            .iter()
            .zip(&mask)
            .position(|(v, &inside)| inside && !v.is_finite());
        if let Some(i) = bad {
            let (x, y) = (i % field.width as usize, i / field.width as usize);
            return Err(Error::Invalid(format!(
                "the field holds {} at pixel {x},{y}, where a finite value is needed",
                field.values[i]
            )));
        }
    }
    if !mask.contains(&true) {
        return Err(Error::Invalid(
            "no pixel shows geometry, so there is nothing to compare".to_string(),
        ));
    }
    Ok(mask)
}

/// Mean of `error(i)` squared over the set pixels of `mask`, of which there is at least one.
pub(super) fn mean_square(mask: &[bool], error: impl Fn(usize) -> f64) -> f64 {
    let mut sum = 0.0;
    let mut count = 0u64;
    for i in (0..mask.len()).filter(|&i| mask[i]) {
        sum += error(i) * error(i);
        count += 1;
    }
    sum / count as f64
}

fn same_size(a: (u32, u32, usize), b: (u32, u32, usize)) -> Result<()> {
    if (a.0, a.1) != (b.0, b.1) {
        return Err(Error::Invalid(format!(
            "sizes differ: {}x{} against {}x{} pixels; pictures must have the same size to be \
             compared",
            a.0, a.1, b.0, b.1
        )));
    }
    let pixels = a.0 as usize * a.1 as usize;
    if pixels == 0 {
        return Err(Error::Invalid(format!(
            "a picture of {}x{} pixels is empty",
            a.0, a.1
        )));
    }
    for length in [a.2, b.2] {
        if length != pixels {
            return Err(Error::Invalid(format!(
                "a picture of {}x{} pixels holds {length} values",
                a.0, a.1
            )));
        }
    }
    Ok(())
}

/// The value of each 8-bit code, in 0..=1.
fn code_values(values: Values) -> [f64; 256] {
    std::array::from_fn(|code| {
        let v = code as f64 / 255.0;
        match values {
            Values::Srgb => v,
            // IEC 61966-2-1.
            Values::Linear if v <= 0.04045 => v / 12.92,
            Values::Linear => ((v + 0.055) / 1.055).powf(2.4),
        }
    })
}

/// Luma of sRGB codes by the weights that SSIM was published with (ITU-R BT.601), luminance of
/// linear values by those of the sRGB primaries (ITU-R BT.709).
fn luma(values: Values, [r, g, b]: [f64; 3]) -> f64 {
    match values {
        Values::Srgb => 0.299 * r + 0.587 * g + 0.114 * b,
        Values::Linear => 0.2126 * r + 0.7152 * g + 0.0722 * b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smooth picture with some texture.
    fn picture(width: u32, height: u32) -> Picture {
        let rgb = (0..width * height)
            .map(|i| {
                let (x, y) = ((i % width) as f32, (i / width) as f32);
                let v = 120.0 + 60.0 * (x * 0.21).sin() + 40.0 * (y * 0.37 + x * 0.05).cos();
                [v as u8, (v * 0.9) as u8, (v * 0.7) as u8]
            })
            .collect();
        Picture { width, height, rgb }
    }

    fn noisy(picture: &Picture, amplitude: f32) -> Picture {
        let mut state = 1u32;
        let mut noise = move || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 23) as f32 - 1.0
        };
        let rgb = picture
            .rgb
            .iter()
            .map(|p| p.map(|c| (f32::from(c) + amplitude * noise()).round() as u8))
            .collect();
        Picture { rgb, ..*picture }
    }

    #[test]
    fn equal_pictures_have_no_error() {
        for values in [Values::Srgb, Values::Linear] {
            let a = picture(40, 30);
            let d = compare_pictures(&a, &a, values).expect("compared");
            assert_eq!(
                (d.mse, d.rmse, d.psnr, d.flip),
                (0.0, 0.0, f64::INFINITY, 0.0)
            );
            assert!((d.ssim.expect("has windows") - 1.0).abs() < 1e-12, "{d:?}");
            assert_eq!(psnr_text(d.psnr), "inf");
            let json = serde_json::to_value(d).expect("serialised");
            assert!(json["psnr"].is_null() && json["pixels"] == 1200, "{json}");
        }
    }

    #[test]
    fn one_wrong_channel_by_hand() {
        // One of 2 x 2 x 3 channels is 51 codes off: MSE = (51 / 255)^2 / 12 = 1 / 300.
        let a = Picture::filled(2, 2, [100, 100, 100]);
        let mut b = a.clone();
        b.rgb[3][1] = 151;
        let d = compare_pictures(&b, &a, Values::Srgb).expect("compared");
        assert!((d.mse - 1.0 / 300.0).abs() < 1e-15);
        assert!((d.psnr - 10.0 * 300f64.log10()).abs() < 1e-9);
        assert_eq!(d.ssim, None, "no 11 x 11 window fits");
    }

    #[test]
    fn linear_values_undo_the_curve() {
        // Code 188 is 0.5028865 of linear light, code 0 is 0.
        let a = Picture::filled(3, 3, [188; 3]);
        let b = Picture::filled(3, 3, [0; 3]);
        let d = compare_pictures(&a, &b, Values::Linear).expect("compared");
        assert!((d.rmse - 0.502_886_5).abs() < 1e-6, "{d:?}");
    }

    #[test]
    fn every_metric_falls_with_growing_noise() {
        let a = picture(64, 48);
        let mut last: Option<Difference> = None;
        for amplitude in [2.0, 5.0, 10.0, 20.0, 40.0] {
            let d = compare_pictures(&noisy(&a, amplitude), &a, Values::Srgb).expect("compared");
            if let Some(l) = last {
                assert!(
                    d.psnr < l.psnr && d.rmse > l.rmse && d.flip > l.flip,
                    "{d:?} {l:?}"
                );
                assert!(d.ssim.expect("ssim") < l.ssim.expect("ssim"), "{d:?} {l:?}");
            }
            last = Some(d);
        }
    }

    #[test]
    fn sizes_that_differ_are_one_sentence() {
        let message = compare_pictures(&picture(4, 3), &picture(3, 4), Values::Srgb)
            .expect_err("refused")
            .to_string();
        assert!(
            message.starts_with("sizes differ: 4x3 against 3x4 pixels"),
            "{message}"
        );
    }

    #[test]
    fn fields_are_compared_over_geometry_alone() {
        let (width, height) = (24, 20);
        let n = (width * height) as usize;
        let mask: Vec<bool> = (0..n).map(|i| i % 24 < 16).collect();
        let reference = vec![0.5f32; n];
        // Off by 0.25 in a quarter of the geometry, and by a lot where there is none.
        let values: Vec<f32> = (0..n)
            .map(|i| match i % 24 {
                x if x >= 16 => f32::NAN,
                x if x < 4 => 0.75,
                _ => 0.5,
            })
            .collect();
        let reference = Field {
            width,
            height,
            values: &reference,
            mask: &mask,
        };
        let field = Field {
            values: &values,
            ..reference
        };
        let d = compare_fields(&field, &reference).expect("compared");
        assert_eq!(d.pixels, 320);
        assert!((d.mse - 0.0625 / 4.0).abs() < 1e-12, "{d:?}");
        assert!(d.flip > 0.0 && d.ssim.is_some());

        let none = vec![false; n];
        assert!(
            compare_fields(
                &Field {
                    mask: &none,
                    ..field
                },
                &reference
            )
            .is_err()
        );
        let all = vec![true; n];
        let full = Field {
            mask: &all,
            ..reference
        };
        let message = compare_fields(
            &Field {
                mask: &all,
                ..field
            },
            &full,
        )
        .expect_err("NaN");
        assert!(
            message.to_string().contains("NaN at pixel 16,0"),
            "{message}"
        );
    }

    #[test]
    fn mean_of_frames_averages_squared_errors() {
        let frame = |mse: f64, ssim| Difference {
            pixels: 10,
            mse,
            rmse: mse.sqrt(),
            psnr: psnr(mse),
            ssim,
            flip: mse,
        };
        let m = mean(&[frame(0.0, Some(1.0)), frame(0.02, None)]).expect("frames");
        assert!(
            (m.psnr - 20.0).abs() < 1e-9 && m.pixels == 20 && m.ssim == Some(1.0),
            "{m:?}"
        );
        assert!((m.rmse - 0.1).abs() < 1e-12 && (m.flip - 0.01).abs() < 1e-12);
        assert_eq!(mean(&[]), None);
    }
}
