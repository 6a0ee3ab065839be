//! AO over a shaded picture, and pictures of AO itself.

use super::gbuffer::{GBuffer, NONE};
use super::image::Picture;
use super::shade::Shade;
use glam::Vec3;

/// Multiplies one AO value a pixel onto reflected light and leaves emission and sky alone
/// (PSAO §4.1: composited over a 4x supersampled picture), then encodes sRGB. `None` composites
/// AO = 1.
pub fn composite(width: u32, height: u32, shades: &[Shade], ao: Option<&[f32]>) -> Picture {
    let at = |i: usize| ao.and_then(|ao| ao.get(i)).copied().unwrap_or(1.0);
    let linear: Vec<Vec3> = shades
        .iter()
        .enumerate()
        .map(|(i, shade)| shade.lit * at(i) + shade.emitted)
        .collect();
    Picture::from_linear(width, height, &linear)
}

/// AO over geometry as linear grey; the sky is white.
pub fn ao_picture(gbuffer: &GBuffer, ao: &[f32]) -> Picture {
    let open =
        |(f, v): (&super::gbuffer::Fragment, &f32)| if f.instance == NONE { 1.0 } else { *v };
    let values: Vec<f32> = gbuffer.fragments.iter().zip(ao).map(open).collect();
    Picture::from_values(gbuffer.width, gbuffer.height, &values)
}
