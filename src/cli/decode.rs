//! `dapple decode`: what every frame of a stream decodes to, as text: the canonical dump of
//! `spec/dump.md`, or of it the lines of the stream and its frames alone.

use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use dapple_conformance::dump;

use super::limits::LimitArgs;
use super::output;
use super::stream::{self, ReadOptions};
use crate::Result;
use crate::codec::Event;

/// Decode a stream and print every frame as text.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream; `-` for standard input.
    file: PathBuf,
    /// Print the canonical dump, with the tracks, transforms and cells of every frame, not only
    /// their digests.
    #[arg(long)]
    dump: bool,
    /// Accept a live stream, which may stop after any commit; each frame is printed when it is
    /// complete.
    #[arg(long)]
    live: bool,
    /// After a fault or a lost record, go on at the next group that can be decoded. Each fault is a
    /// line of the output and a warning.
    #[arg(long)]
    resume: bool,
    /// Accept a stream that was joined in its middle: records may be missing between its start and
    /// the first group that can be decoded.
    #[arg(long)]
    join: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

/// Runs the command.
///
/// # Errors
/// `Io` where the file cannot be read or stdout not written, `Invalid` at the fault that ends the
/// stream; the frames before it are printed.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut out = BufWriter::with_capacity(64 << 10, std::io::stdout().lock());
    let mut lines = String::new();
    if args.dump {
        lines.push_str(dump::HEAD);
    }
    let options = ReadOptions {
        limits: args.limits.limits(),
        live: args.live,
        resume: args.resume,
        join: args.join,
    };
    let outcome = stream::decode(&args.file, &options, |decoder, event| {
        match event {
            Ok(Event::Frame(frame)) if !args.dump => {
                let digest = decoder.state_digest();
                lines += &format!("frame {} {} {digest:016x}\n", frame.number, frame.tick);
            }
            Ok(event) => dump::event(decoder, event, &mut lines),
            Err(fault) => {
                let layer = fault.layer.name();
                lines += &format!("error {layer} {} {}\nresume yes\n", fault.id, fault.offset);
                output::warn(&stream::error(&args.file, &fault).to_string());
            }
        }
        let mut written = out.write_all(lines.as_bytes());
        if args.live {
            written = written.and_then(|()| out.flush());
        }
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
