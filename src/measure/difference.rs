//! Pictures of where a field differs from its reference, and in which direction.

use super::metrics::{Field, common_mask};
use crate::Result;
use crate::render::image::Picture;

/// What a full-scale difference looks like, in sRGB: too dark blue, too bright red. The two differ
/// in lightness as well as hue, so that colour-blind readers can tell them apart.
const TOO_DARK: [f32; 3] = [5.0, 66.0, 144.0];
const TOO_BRIGHT: [f32; 3] = [214.0, 74.0, 12.0];
const EQUAL: [f32; 3] = [247.0, 247.0, 247.0];
/// Pixels without geometry.
const OUTSIDE: [u8; 3] = [208, 208, 208];

/// A picture of `field - reference`: near white where they agree, blue where the field is too dark,
/// red where it is too bright, in full colour from a difference of `full_scale` on.
///
/// # Errors
/// `Invalid` where sizes differ, a value is not finite, or no pixel shows geometry in both.
pub fn signed_picture(field: &Field, reference: &Field, full_scale: f32) -> Result<Picture> {
    let mask = common_mask(&[field, reference])?;
    let colour = |i: usize| {
        if !mask[i] {
            return OUTSIDE;
        }
        let share = ((field.values[i] - reference.values[i]) / full_scale).clamp(-1.0, 1.0);
        let end = if share < 0.0 { TOO_DARK } else { TOO_BRIGHT };
        std::array::from_fn(|c| (EQUAL[c] + (end[c] - EQUAL[c]) * share.abs()).round() as u8)
    };
    let rgb = (0..mask.len()).map(colour).collect();
    Ok(Picture {
        width: field.width,
        height: field.height,
        rgb,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn direction_and_scale_show() {
        let mask = [true, true, true, true, false];
        let reference = Field {
            width: 5,
            height: 1,
            values: &[0.5; 5],
            mask: &mask,
        };
        let field = Field {
            values: &[0.5, 0.4, 0.6, 0.9, 0.0],
            ..reference
        };
        let picture = signed_picture(&field, &reference, 0.1).expect("picture");
        let expected = [
            [247; 3],
            [5, 66, 144],
            [214, 74, 12],
            [214, 74, 12],
            [208; 3],
        ];
        assert_eq!(picture.rgb, expected);
        let fainter = signed_picture(&field, &reference, 0.4).expect("picture");
        assert!(fainter.rgb[1][0] > 100 && fainter.rgb[1][0] < 247);
    }
}
