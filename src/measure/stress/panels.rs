//! Small pictures in false colours.

use super::places::Place;
use crate::measure::difference::signed_picture;
use crate::measure::metrics::Field;
use crate::render::Picture;
use crate::render::view::View;
use crate::scene::CameraPose;
use crate::trace::path::PathTracer;
use crate::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;

/// Pixels of one panel; four make a picture of 320x180.
pub const WIDTH: u32 = 160;
pub const HEIGHT: u32 = 90;

/// What the pixels of a panel see: a place and the direction to the camera, or nothing.
pub fn seen(paths: &PathTracer, camera: &CameraPose) -> Vec<Option<(Place, Vec3)>> {
    let view = View::new(camera, WIDTH, HEIGHT);
    let pixel = |i: u32| {
        let direction = view.direction(i % WIDTH, i / WIDTH);
        let vertex = paths.first(camera.eye(), direction, true).0?;
        let place = Place {
            position: vertex.position,
            normal: vertex.geometric_normal,
        };
        Some((place, vertex.view))
    };
    (0..WIDTH * HEIGHT).into_par_iter().map(pixel).collect()
}

/// A value for each pixel that sees something.
pub fn values(
    seen: &[Option<(Place, Vec3)>],
    value: impl Fn(&Place, Vec3) -> f32 + Sync,
) -> Vec<Option<f32>> {
    let pixel = |p: &Option<(Place, Vec3)>| p.as_ref().map(|(place, view)| value(place, *view));
    seen.par_iter().map(pixel).collect()
}

/// A picture of `width` of values from 0 to 1, dark to light over blue, red and yellow; negative ones
/// are cyan, none and those that are no number gray.
pub fn ramp(width: u32, values: &[Option<f32>]) -> Picture {
    const STOPS: [[f32; 3]; 6] = [
        [0.0, 0.0, 4.0],
        [60.0, 15.0, 112.0],
        [150.0, 40.0, 110.0],
        [228.0, 80.0, 60.0],
        [252.0, 170.0, 70.0],
        [252.0, 253.0, 200.0],
    ];
    let colour = |value: &Option<f32>| match value {
        Some(v) if *v < 0.0 => [0, 220, 230],
        Some(v) if !v.is_nan() => {
            let at = v.min(1.0) * (STOPS.len() - 1) as f32;
            let stop = (at as usize).min(STOPS.len() - 2);
            let f = at - stop as f32;
            std::array::from_fn(|c| {
                (STOPS[stop][c] * (1.0 - f) + STOPS[stop + 1][c] * f).round() as u8
            })
        }
        _ => [128; 3],
    };
    Picture {
        width,
        height: values.len() as u32 / width.max(1),
        rgb: values.iter().map(colour).collect(),
    }
}

/// A share on a scale of decades: 1 at 1, 0 at ten to minus `decades` and below.
pub fn decades(share: f32, decades: f32) -> f32 {
    (1.0 + share.max(0.0).log10() / decades).max(0.0)
}

/// A panel of `found - right`: red where there is too much, in full colour at `full_scale`.
///
/// # Errors
/// `Invalid` where a value is no number, or nothing is seen.
pub fn difference(
    found: &[Option<f32>],
    right: &[Option<f32>],
    full_scale: f32,
) -> Result<Picture> {
    let mask: Vec<bool> = found.iter().map(Option::is_some).collect();
    let [found, right] =
        [found, right].map(|f| -> Vec<f32> { f.iter().map(|v| v.unwrap_or_default()).collect() });
    let field = |values| Field {
        width: WIDTH,
        height: HEIGHT,
        values,
        mask: &mask,
    };
    signed_picture(&field(&found), &field(&right), full_scale)
}

/// Panels of one size as one picture, `columns` in a row.
///
/// # Errors
/// `Invalid` where sizes differ.
pub fn joined(panels: &[Picture], columns: usize) -> Result<Picture> {
    let (width, height) = panels.first().map_or((0, 0), |p| (p.width, p.height));
    if panels
        .iter()
        .any(|p| (p.width, p.height) != (width, height))
        || columns == 0
    {
        return Err(Error::Invalid("panels differ in size".into()));
    }
    let rows = panels.len().div_ceil(columns);
    let mut picture = Picture::filled(width * columns as u32, height * rows as u32, [255; 3]);
    for (number, panel) in panels.iter().enumerate() {
        let (left, top) = (
            number % columns * width as usize,
            number / columns * height as usize,
        );
        for (y, line) in panel.rgb.chunks(width as usize).enumerate() {
            let at = (top + y) * picture.width as usize + left;
            picture.rgb[at..at + line.len()].copy_from_slice(line);
        }
    }
    Ok(picture)
}

/// Each pixel as `by` x `by`.
pub fn enlarged(picture: &Picture, by: u32) -> Picture {
    let (width, height) = (picture.width * by, picture.height * by);
    let pixel = |i: u32| {
        let (x, y) = (i % width / by, i / width / by);
        picture.rgb[(y * picture.width + x) as usize]
    };
    Picture {
        width,
        height,
        rgb: (0..width * height).map(pixel).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_are_joined_in_rows() {
        let panel = |c: u8| Picture::filled(2, 1, [c; 3]);
        let joined = joined(&[panel(1), panel(2), panel(3)], 2).expect("a picture");
        let shades: Vec<u8> = joined.rgb.iter().map(|c| c[0]).collect();
        assert_eq!(shades, [1, 1, 2, 2, 3, 3, 255, 255]);
        assert!(super::joined(&[panel(1), Picture::filled(1, 1, [0; 3])], 2).is_err());
        assert_eq!(enlarged(&panel(7), 3).rgb, vec![[7; 3]; 18]);
    }

    #[test]
    fn scales_have_their_ends() {
        assert_eq!((decades(1.0, 4.0), decades(1e-9, 4.0)), (1.0, 0.0));
        assert!((decades(0.01, 4.0) - 0.5).abs() < 1e-6 && decades(0.0, 4.0) == 0.0);
        let shown = ramp(4, &[Some(0.0), Some(2.0), Some(-0.1), None]).rgb;
        assert_eq!(shown, [[0, 0, 4], [252, 253, 200], [0, 220, 230], [128; 3]]);
    }
}
