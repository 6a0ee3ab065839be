//! `dapple encode`: runs the server on a scene and writes a stream.

use super::args::{EncodeArgs, Model, SceneArgs};
use super::progress::Progress;
use super::{job, output};
use crate::measure::table::grouped;
use crate::stream::Report;
use crate::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Ray-trace a scene's light and write it as a stream.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    encode: EncodeArgs,
    /// Where the stream goes.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print the figures as one JSON document.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// `Scene` for an unusable scene, `Io` where the stream cannot be written, `Invalid` for what the
/// scene does not have. An output file appears whole or not at all.
pub fn run(args: &Args) -> Result<ExitCode> {
    let scene = args.scene.open()?;
    let job = args.encode.job(&scene, &args.scene.view)?;
    if let Some(probes) = &job.probes {
        job::warn_if_dark(&scene, &probes.sky);
    }
    let io = |source| Error::Io {
        path: args.output.clone(),
        source,
    };
    let unfinished = beside(&args.output)?;
    let mut file = BufWriter::new(File::create(&unfinished).map_err(|source| Error::Io {
        path: unfinished.clone(),
        source,
    })?);

    let mut write = || -> Result<_> {
        let mut bytes = Vec::new();
        let frames = job.frames;
        let mut stream = job::start(&scene, job.clone(), &mut bytes)?;
        let bar = Progress::new("Encoding frames", frames as u64);
        loop {
            file.write_all(&bytes).map_err(io)?;
            bytes.clear();
            bar.step(1);
            if stream.next_frame(&mut bytes)?.is_none() {
                break;
            }
        }
        let report = stream.finish(&mut bytes)?;
        file.write_all(&bytes)
            .and_then(|()| file.flush())
            .map_err(io)?;
        if unfinished != args.output {
            std::fs::rename(&unfinished, &args.output).map_err(io)?;
        }
        Ok(report)
    };
    let report = write().inspect_err(|_| {
        if unfinished != args.output {
            let _ = std::fs::remove_file(&unfinished);
        }
    })?;

    if args.json {
        output::print_report(&report)?;
    } else {
        output::print(&summary(args, &report))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn summary(args: &Args, report: &Report) -> String {
    let mut text = format!(
        "{}: {} frames at {} Hz, start-up {} bytes, then {:.3} Mbit/s\n",
        args.output.display(),
        report.frames,
        report.fps,
        grouped(report.bytes_startup),
        report.mbps_steady,
    );
    if args.encode.model.contains(&Model::Points) {
        text += &format!(
            "{} points in {} cells, {} dropped; {} changed points and {} rays a frame, {:.1} ms a frame\n",
            grouped(report.points as u64),
            grouped(report.cells as u64),
            grouped(report.dropped_points),
            grouped((report.changed_points / report.ticks()) as u64),
            grouped(report.rays / report.ticks() as u64),
            report.stage_ms.total(),
        );
    }
    if let Some(probes) = &report.probes {
        let irradiance = match probes.irradiance_psnr {
            Some(psnr) => format!(" at {psnr:.1} dB of irradiance"),
            None => String::new(),
        };
        text += &format!(
            "{} probes, {} of them in the open; first frame {} bytes, visibility {}, then {:.2} bytes a \
             probe and frame{irradiance}; {:.1} ms a frame\n",
            grouped(probes.probes as u64),
            grouped(probes.probes_present as u64),
            grouped(probes.bytes_first),
            grouped(probes.bytes_visibility),
            probes.bytes_per_probe_frame,
            probes.probe_update_ms,
        );
    }
    text
}

/// The name of the output while it is written: another one beside it, unless it is a pipe or a
/// device, which must not be replaced by a file.
fn beside(path: &Path) -> Result<PathBuf> {
    match std::fs::metadata(path) {
        Ok(m) if m.is_dir() => Err(Error::Io {
            path: path.into(),
            source: std::io::ErrorKind::IsADirectory.into(),
        }),
        Ok(m) if !m.is_file() => Ok(path.into()),
        _ => {
            let mut name = path.file_name().unwrap_or_default().to_os_string();
            name.push(".part");
            Ok(path.with_file_name(name))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_are_replaced() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.dapple");
        let part = folder.path().join("a.dapple.part");
        assert_eq!(beside(&file).expect("new"), part);
        std::fs::write(&file, b"old").expect("written");
        assert_eq!(beside(&file).expect("there"), part);
        assert!(beside(folder.path()).is_err());
        let null = Path::new("/dev/null");
        if null.exists() {
            assert_eq!(beside(null).expect("a device"), null);
        }
    }
}
