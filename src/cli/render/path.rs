//! `dapple render --method path` and `direct`: pictures by path tracing.

use crate::Result;
use crate::cli::args::exposure;
use crate::cli::job::warn_if_dark;
use crate::cli::output::Sink;
use crate::cli::progress::Progress;
use crate::measure::metrics::psnr;
use crate::render::Picture;
use crate::render::path::state::{self, PictureId};
use crate::render::path::{Options, Part, PathPicture, direct};
use crate::render::tone::develop;
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::Tracer;
use crate::trace::path::{PathTracer, Sky};
use glam::Vec3;
use std::path::{Path, PathBuf};

/// Samples that a pass adds to each half of the picture: the state is saved between passes.
const PASS: u32 = 8;

/// Options of path-traced pictures.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Path tracing")]
pub struct PathArgs {
    /// Paths a pixel, in two independent halves that tell the picture's noise.
    #[arg(long, value_name = "COUNT", default_value = "256",
        value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    samples: u32,
    /// Most surfaces that scatter light along a path.
    #[arg(long, value_name = "COUNT", default_value = "32",
        value_parser = clap::value_parser!(u32).range(1..=1024))]
    bounces: u32,
    /// Which light to show: what the seen surface gets from lights itself, or from everything else.
    #[arg(long, default_value = "all")]
    part: Shown,
    /// Radiance of the sky as R,G,B, or above and below as R,G,B:R,G,B; black if not given.
    #[arg(long, value_name = "RGB", value_parser = sky)]
    sky: Option<Sky>,
    /// Show surfaces without their glossy coats.
    #[arg(long)]
    no_coats: bool,
    /// Spread samples over the pixels instead of their centres.
    #[arg(long)]
    supersample: bool,
    /// Factor on radiance before the tone curve.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = exposure)]
    exposure: f32,
    /// Keep the samples in this file, and go on from those that are in it.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Write linear radiance, too, as a PFM file of 32-bit floats.
    #[arg(long, value_name = "FILE")]
    linear: Option<PathBuf>,
}

impl PathArgs {
    /// Whether samples are spread over pixels.
    pub fn supersample(&self) -> bool {
        self.supersample
    }

    /// The file of linear radiance.
    pub fn linear(&self) -> Option<&Path> {
        self.linear.as_deref()
    }

    pub fn sky(&self) -> Sky {
        self.sky.unwrap_or_default()
    }

    pub fn exposure(&self) -> f32 {
        self.exposure
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Shown {
    All,
    Direct,
    Indirect,
}

/// The picture that the arguments ask for, and a note about it. Writes its state and its linear
/// radiance where they are asked for.
///
/// # Errors
/// `Io` for files that cannot be read or written, `Invalid` for a state of another picture, and as
/// [`Sink::create`].
pub fn picture(
    own: &PathArgs,
    scene: &Scene,
    pose: &Pose,
    camera: &CameraPose,
    args: &super::Args,
    direct_only: bool,
) -> Result<(Picture, String)> {
    let linear = own.linear.as_deref().map(Sink::create).transpose()?;
    let (width, height) = args.view.size;
    let sky = own.sky();
    warn_if_dark(scene, &sky);
    let options = Options {
        max_bounces: own.bounces,
        supersample: own.supersample,
        seed: 0,
    };
    let tracer = Tracer::new(scene, pose);
    let mut tracer = PathTracer::new(scene, pose, &tracer, sky);
    if own.no_coats {
        tracer = tracer.without_coats();
    }
    let started = std::time::Instant::now();
    let (light, note) = if direct_only {
        let light = direct(&tracer, camera, args.view.size, &options, own.samples);
        (light, "direct light, ray-traced shadows".to_owned())
    } else {
        let id = PictureId::new(scene, pose.time, camera, &options, &sky, !own.no_coats);
        let mut picture = match &own.state {
            Some(path) => state::load(path, width, height, &id)?,
            None => PathPicture::new(width, height),
        };
        let before = picture.samples();
        let wanted = own.samples.div_ceil(2);
        let progress = Progress::new("Tracing paths", u64::from(wanted) * u64::from(height));
        progress.at(u64::from(before / 2) * u64::from(height));
        while picture.samples() / 2 < wanted {
            let samples = PASS.min(wanted - picture.samples() / 2);
            picture.add(&tracer, camera, &options, samples, &|rows| {
                progress.step(rows * u64::from(samples));
            });
            if let Some(path) = &own.state {
                state::save(path, &picture, &id)?;
            }
        }
        let part = match own.part {
            Shown::All => Part::All,
            Shown::Direct => Part::Direct,
            Shown::Indirect => Part::Indirect,
        };
        let noise = picture.noise(part, own.exposure);
        let paths = f64::from(picture.samples() - before) * f64::from(width) * f64::from(height);
        let noise = if noise > 0.0 {
            format!("noise {:.1} dB below white", psnr(noise * noise))
        } else {
            "no noise".to_owned()
        };
        let note = format!(
            "{} paths a pixel, {noise}; {:.2} million paths a second",
            picture.samples(),
            paths / started.elapsed().as_secs_f64() / 1e6
        );
        (picture.light(part), note)
    };
    if let Some(mut sink) = linear {
        sink.write(&pfm(width, &light))?;
        sink.finish()?;
    }
    let picture = Picture::from_linear(width, height, &develop(&light, own.exposure));
    Ok((picture, note))
}

/// Portable FloatMap: three little-endian floats a pixel, rows from the bottom.
fn pfm(width: u32, light: &[Vec3]) -> Vec<u8> {
    let width = width.max(1) as usize;
    let mut bytes = format!("PF\n{width} {}\n-1.0\n", light.len() / width).into_bytes();
    for row in light.chunks(width).rev() {
        for value in row.iter().flat_map(|c| c.to_array()) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

fn sky(text: &str) -> std::result::Result<Sky, String> {
    let colour = |text: &str| {
        let parts: Vec<f32> = text
            .split(',')
            .map(|p| p.trim().parse().ok())
            .collect::<Option<_>>()?;
        let [r, g, b] = parts[..] else { return None };
        let light = Vec3::new(r, g, b);
        (light.min_element() >= 0.0 && light.max_element() <= 1e6).then_some(light)
    };
    let (up, down) = text.split_once(':').unwrap_or((text, text));
    match (colour(up), colour(down)) {
        (Some(up), Some(down)) => Ok(Sky { up, down }),
        _ => Err("expected radiance as R,G,B from 0 to 1000000, or two such with a colon".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skies_are_one_colour_or_two() {
        assert_eq!(sky("1,0.5,0"), Ok(Sky::uniform(Vec3::new(1.0, 0.5, 0.0))));
        let two = sky("1,1,1:0,0,0").expect("two colours");
        assert_eq!((two.up, two.down), (Vec3::ONE, Vec3::ZERO));
        for wrong in [
            "", "1,1", "1,1,-1", "1,1,nan", "1,1,1:", "1,1,1,1", "inf,0,0",
        ] {
            assert!(sky(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn exposures_are_positive() {
        assert_eq!(exposure("0.5"), Ok(0.5));
        for wrong in ["0", "-1", "nan", "1e9"] {
            assert!(exposure(wrong).is_err(), "{wrong}");
        }
    }
}
