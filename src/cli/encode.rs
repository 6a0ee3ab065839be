//! `dapple encode`: runs the server on a scene and writes a stream.

use super::args::{EncodeArgs, SceneArgs};
use super::effects::{self, Given};
use super::inputs::is_dash;
use super::output::Sink;
use super::progress::Progress;
use super::{job, output};
use crate::measure::table::grouped;
use crate::models::Model;
use crate::stream::Report;
use crate::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Examples in the help.
const EXAMPLES: &str = "\
Examples:
  dapple encode scene.glb -o ao.dapple                     ambient occlusion of the animation
  dapple encode scene.glb -o ao.dapple --quality draft     a quarter of the points, for a first look
  dapple encode scene.glb -o light.dapple --model probes   indirect light
  dapple encode scene.glb -o all.dapple --model points,probes --frames 60 --keyframe-interval 30";

/// Ray-trace a scene's light and write it as a stream.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    encode: EncodeArgs,
    /// Where the stream goes; `-` for standard output. Missing folders are made.
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: PathBuf,
    /// Print the figures as one JSON document.
    #[arg(long, help_heading = "Output")]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// `Scene` for an unusable scene, `Io` where the stream cannot be written, `Invalid` for what the
/// scene does not have, `Usage` for an output that cannot be taken.
pub fn run(args: &Args, given: &Given) -> Result<ExitCode> {
    if args.json && is_dash(&args.output) {
        let text = "standard output can have the stream (-o -) or the figures (--json), not both";
        return Err(Error::Usage(text.into()));
    }
    let active = args.encode.active();
    given.warn_without_effect(&active);
    let colors = args.encode.model.contains(&Model::Probes);
    let scene = args.scene.open(colors)?;
    let job = args.encode.job(&scene, &args.scene.view)?;
    if let Some(probes) = job.probes() {
        job::warn_if_dark(&scene, &probes.sky);
    }
    let clock = Instant::now();
    let mut sink = Sink::create(&args.output)?;
    let mut bytes = Vec::new();
    let mut written = 0;
    let mut write = |bytes: &mut Vec<u8>| {
        written += bytes.len() as u64;
        sink.write(bytes)?;
        bytes.clear();
        Ok::<_, Error>(())
    };
    let frames = job.frames;
    let camera = args.scene.view.describe(&scene, &job.view);
    let mut stream = job::start(&scene, job, &mut bytes)?;
    let bar = Progress::new("Encoding frames", frames as u64);
    loop {
        write(&mut bytes)?;
        bar.step(1);
        if stream.next_frame(&mut bytes)?.is_none() {
            break;
        }
    }
    drop(bar);
    let report = stream.finish(&mut bytes)?;
    write(&mut bytes)?;
    sink.finish()?;
    if args.json {
        output::print_report(&report)?;
    } else {
        let mut text = summary(&report, written, clock.elapsed().as_secs_f64());
        if active.contains(&effects::VISIBILITY) {
            text += &format!("updated where seen by {camera}\n");
        }
        output::print_about(&args.output, &text)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn summary(report: &Report, written: u64, seconds: f64) -> String {
    let mut text = format!(
        "{} at {} Hz, {} bytes, {seconds:.1} s; start-up {} bytes",
        output::counted(report.frames as u64, "frame"),
        report.fps,
        grouped(written),
        grouped(report.bytes_startup),
    );
    // A rate says little of a shorter run.
    if report.frames as f64 >= report.fps {
        text += &format!(", then {:.3} Mbit/s", report.mbps_steady);
    }
    text += "\n";
    if let Some(points) = &report.models.points {
        text += &format!(
            "{} candidates per m2 ({} to {}), AO distance {} m, in a scene {} m across\n\
             {} placed, {} sent in {}, {} dropped",
            output::significant(points.density.into()),
            output::significant(points.lowest_density.into()),
            output::significant(points.highest_density.into()),
            output::significant(points.distance.into()),
            output::significant(report.scene_size.into()),
            output::counted(points.points as u64, "point"),
            grouped(points.points_sent as u64),
            output::counted(points.cells as u64, "cell"),
            grouped(points.dropped_points),
        );
        if report.frames > 1 {
            text += &format!(
                "; {} changed points and {} rays a frame, {:.1} ms a frame",
                grouped((points.changed_points / report.ticks()) as u64),
                grouped(report.rays / report.ticks() as u64),
                report.stage_ms.total(),
            );
        }
        text += "\n";
    }
    if let Some(probes) = &report.models.probes {
        let irradiance = match probes.irradiance_psnr {
            Some(psnr) => format!(" at {psnr:.1} dB of irradiance"),
            None => String::new(),
        };
        text += &format!(
            "{} probes, {} of them outside geometry; first frame {} bytes{irradiance}, visibility {} bytes",
            grouped(probes.probes as u64),
            grouped(probes.probes_present as u64),
            grouped(probes.bytes_first),
            grouped(probes.bytes_visibility),
        );
        if report.frames > 1 {
            text += &format!(
                ", then {:.2} bytes a probe and frame",
                probes.bytes_per_probe_frame
            );
        }
        text += &format!("; {:.1} ms a frame\n", probes.probe_update_ms);
        if let Some(choice) = &probes.fit {
            text += &format!(
                "{}: held-out error {:.3} traced, {:.3} fitted with a ridge of {}\n",
                if probes.fitted {
                    "fitted to surfaces"
                } else {
                    "traced light is kept"
                },
                choice.traced_error,
                choice.fitted_error,
                choice.strength,
            );
        }
    }
    text
}
