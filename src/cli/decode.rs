//! `dapple decode`: what every frame of a stream decodes to, as text.
//!
//! The dump is canonical: two decoders that agree give the same bytes, whatever cells they keep
//! content in. One item a line, fields separated by one space, in this order:
//!
//! ```text
//! dapple-dump 1
//! stream TICKS SECONDS                      tick rate as a fraction
//! frame NUMBER TICK DIGEST                  a commit, and the digest of the state it leaves
//! track ID SPACE DX DY DZ BUCKETS WIDTHS EDGE RADIUS PATH     each live track, ids ascending
//! transform ID F0 ... F11                   its transform, rows, if it has one
//! bucket ID INDEX KEY:P0,P1,... ...         each bucket that names a cell; cells in its order
//! end                                       an end record
//! ```
//!
//! Digests, floats (as their bits) and packed points are hexadecimal; a path is a JSON string.

use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use super::{output, stream};
use crate::Result;
use crate::codec::points::EMPTY;
use crate::codec::{Decoder, Event, LiveTrack, LookupSpace};

/// Decode a stream and print every frame as text.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream.
    file: PathBuf,
    /// Print the tracks, transforms and cells of every frame, not only its digest.
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
    writeln!(out, "dapple-dump 1").map_err(output::error)?;
    let outcome = stream::decode(&args.file, args.live, |decoder, event| {
        let written = match event {
            Event::Stream(rate) => {
                writeln!(out, "stream {} {}", rate.numerator, rate.denominator)
            }
            Event::Frame(frame) => {
                let digest = decoder.state_digest();
                writeln!(out, "frame {} {} {digest:016x}", frame.number, frame.tick).and_then(
                    |()| {
                        if args.dump {
                            dump(decoder, &mut out)
                        } else {
                            Ok(())
                        }
                    },
                )
            }
            Event::End => writeln!(out, "end"),
            _ => Ok(()),
        };
        written.map_err(output::error)
    })?;
    out.flush().map_err(output::error)?;
    match outcome.fault {
        None => Ok(ExitCode::SUCCESS),
        Some(fault) => Err(stream::error(&args.file, &fault)),
    }
}

/// The committed state.
fn dump(decoder: &Decoder, out: &mut impl Write) -> std::io::Result<()> {
    for live in decoder.tracks() {
        let track = &live.track;
        let grid = track.grid();
        let space = match track.space {
            LookupSpace::Mesh => "mesh",
            LookupSpace::Rest => "rest",
        };
        let [dx, dy, dz] = grid.dims;
        writeln!(
            out,
            "track {} {space} {dx} {dy} {dz} {} {},{},{} {:08x} {:08x} {}",
            track.id,
            grid.bucket_count,
            grid.widths.position,
            grid.widths.normal,
            grid.widths.ao,
            grid.cell_edge.to_bits(),
            grid.radius.to_bits(),
            serde_json::Value::from(track.target.path.as_str()),
        )?;
        if let Some(transform) = &live.transform {
            write!(out, "transform {}", track.id)?;
            for value in transform.world_from_grid.as_flattened() {
                write!(out, " {:08x}", value.to_bits())?;
            }
            writeln!(out)?;
        }
        dump_buckets(decoder, live, out)?;
    }
    Ok(())
}

fn dump_buckets(decoder: &Decoder, live: &LiveTrack, out: &mut impl Write) -> std::io::Result<()> {
    let digits = live.track.grid().widths.bits() as usize / 4;
    for (index, bucket) in stream::buckets(decoder, live).iter().enumerate() {
        if bucket.0[0] == EMPTY {
            continue;
        }
        write!(out, "bucket {} {index}", live.track.id)?;
        for cell in stream::cells_of(decoder, live, bucket) {
            write!(out, " {}:", cell.key)?;
            for (i, point) in cell
                .points
                .iter()
                .take_while(|&&point| point != 0)
                .enumerate()
            {
                let comma = if i > 0 { "," } else { "" };
                write!(out, "{comma}{point:0digits$x}")?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}
