//! `dapple decode`: what every frame of a stream decodes to, as text: the canonical dump of
//! `spec/dump.md`, or of it the lines of the stream and its frames alone.

use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use dapple_conformance::dump;

use super::{output, stream};
use crate::Result;
use crate::codec::Event;

/// Decode a stream and print every frame as text.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream.
    file: PathBuf,
    /// Print the canonical dump, with the tracks, transforms and cells of every frame, not only
    /// their digests.
    #[arg(long)]
    dump: bool,
    /// Accept a live stream, which may stop after any commit.
    #[arg(long)]
    live: bool,
}

/// Runs the command.
///
/// # Errors
/// `Io` where the file cannot be read or stdout not written, `Invalid` at a fault of the stream;
/// the frames before it are printed.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut out = BufWriter::with_capacity(64 << 10, std::io::stdout().lock());
    let mut lines = String::new();
    if args.dump {
        lines.push_str(dump::HEAD);
    }
    let outcome = stream::decode(&args.file, args.live, |decoder, event| {
        match event {
            Event::Frame(frame) if !args.dump => {
                let digest = decoder.state_digest();
                lines = format!("frame {} {} {digest:016x}\n", frame.number, frame.tick);
            }
            _ => dump::event(decoder, event, &mut lines),
        }
        let written = out.write_all(lines.as_bytes());
        lines.clear();
        written.map_err(output::error)
    })?;
    out.write_all(lines.as_bytes()).map_err(output::error)?;
    out.flush().map_err(output::error)?;
    match outcome.fault {
        None => Ok(ExitCode::SUCCESS),
        Some(fault) => Err(stream::error(&args.file, &fault)),
    }
}
