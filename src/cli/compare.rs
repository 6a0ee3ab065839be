//! `dapple compare`: the error of a picture against its reference.

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::output;
use crate::measure::flip::PIXELS_PER_DEGREE;
use crate::measure::metrics::{Difference, Values, compare_pictures, psnr_text};
use crate::render::image::Picture;
use crate::{Error, Result};

/// Compare a picture with its reference: PSNR, SSIM and FLIP of two PNG files of one size.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The picture that is judged.
    picture: PathBuf,
    /// The picture it is judged against.
    reference: PathBuf,
    /// Take PSNR and SSIM of linear light instead of sRGB codes. FLIP is always of sRGB.
    #[arg(long)]
    linear: bool,
    /// Print one JSON document; an infinite PSNR is null.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    picture: &'a str,
    reference: &'a str,
    values: Values,
    flip_pixels_per_degree: f32,
    #[serde(flatten)]
    difference: Difference,
}

/// Runs the command.
///
/// # Errors
/// `Io` or `Invalid` where a file is no usable picture or the sizes differ.
pub fn run(args: &Args) -> Result<ExitCode> {
    let picture = Picture::read_png(&args.picture)?;
    let reference = Picture::read_png(&args.reference)?;
    let values = if args.linear {
        Values::Linear
    } else {
        Values::Srgb
    };
    let difference = compare_pictures(&picture, &reference, values).map_err(|e| {
        Error::Invalid(format!(
            "{} and {}: {e}",
            args.picture.display(),
            args.reference.display()
        ))
    })?;
    if args.json {
        output::print_json(&Report {
            picture: &args.picture.to_string_lossy(),
            reference: &args.reference.to_string_lossy(),
            values,
            flip_pixels_per_degree: PIXELS_PER_DEGREE,
            difference,
        })?;
    } else {
        let ssim = match difference.ssim {
            Some(ssim) => format!("{ssim:.5}"),
            None => "none (a side is shorter than its 11 pixel window)".to_string(),
        };
        output::print(&format!(
            "PSNR  {} dB\nSSIM  {ssim}\nFLIP  {:.5}\nRMSE  {:.6}\n",
            psnr_text(difference.psnr),
            difference.flip,
            difference.rmse
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
