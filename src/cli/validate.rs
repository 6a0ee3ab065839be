//! `dapple validate`: whether a file is a valid stream, and if not, where and why.

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::limits::LimitArgs;
use super::stream::{self, FaultReport, ReadOptions};
use super::{output, tell};
use crate::Result;
use crate::codec::Event;

/// Check a stream: exit code 0 if it is valid, 1 with the first fault if it is not.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream; `-` for standard input.
    file: PathBuf,
    /// Accept a live stream, which may stop after any commit.
    #[arg(long)]
    live: bool,
    /// Print one JSON document.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

#[derive(Serialize)]
struct Report {
    valid: bool,
    frames: u64,
    #[serde(flatten)]
    fault: Option<FaultReport>,
}

/// Runs the command.
///
/// # Errors
/// `Io` where the file cannot be read.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut frames = 0;
    let options = ReadOptions {
        limits: args.limits.limits(),
        live: args.live,
        ..ReadOptions::default()
    };
    let outcome = stream::decode(&args.file, &options, |_, event| {
        frames += u64::from(matches!(event, Ok(Event::Frame(_))));
        Ok(())
    })?;
    let fault = outcome.fault.as_ref();
    if args.json {
        let valid = fault.is_none();
        output::print_json(&Report {
            valid,
            frames,
            fault: fault.map(FaultReport::new),
        })?;
    } else if let Some(fault) = fault {
        tell(&stream::error(&args.file, fault));
    } else {
        output::print(&format!(
            "valid: {} in {}, {} bytes\n",
            output::counted(frames, "frame"),
            output::counted(outcome.records.total().records, "record"),
            outcome.bytes
        ))?;
    }
    Ok(if fault.is_none() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    })
}
