//! `dapple inspect`: what a stream holds.

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::records::RecordTotal;
use super::stream::{self, FaultReport, Outcome};
use super::{output, tell};
use crate::Result;
use crate::codec::container::{CONTAINER_VERSION, HEADER_BYTES, PREAMBLE_BYTES};
use crate::codec::points::{Bucket, Cell, EMPTY};
use crate::codec::{Decoder, Event, GroupStart, LiveTrack, LookupSpace, TickRate};

/// Tracks that the text report lists; `--json` lists all.
const LISTED_TRACKS: usize = 20;

/// Show what a stream holds: records, tracks, frames, bytes, bitrate.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream.
    file: PathBuf,
    /// Print one JSON document, with every track.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    file: String,
    bytes: u64,
    /// `None` where not even the preamble is valid.
    container_version: Option<u16>,
    /// Ticks a second as a fraction.
    tick_rate: Option<[u32; 2]>,
    records: Vec<TypeReport>,
    /// Payload bytes unpacked over payload bytes stored.
    compression_ratio: Option<f64>,
    #[serde(flatten)]
    timing: Timing,
    mbps_steady: Option<f64>,
    mbps_with_keyframes: Option<f64>,
    tracks: Vec<TrackReport>,
    /// Whether the stream ends with an `end` record.
    ended: bool,
    fault: Option<FaultReport>,
}

#[derive(Debug, Serialize)]
struct TypeReport {
    #[serde(rename = "type")]
    number: u16,
    name: &'static str,
    #[serde(flatten)]
    total: RecordTotal,
}

/// A live track at the end of the stream.
#[derive(Debug, Serialize)]
struct TrackReport {
    id: u32,
    model: &'static str,
    application_id: u64,
    path: String,
    space: &'static str,
    dims: [u16; 3],
    cell_edge: f32,
    radius: f32,
    point_bits: u32,
    buckets: u32,
    cell_capacity: u32,
    /// Cells and points that a lookup can reach.
    cells: u64,
    points: u64,
}

/// Frames and the bytes they took, as the stream goes by.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Timing {
    frames: u64,
    /// Frames that start a group from nothing.
    keyframes: u64,
    first_tick: Option<u64>,
    last_tick: Option<u64>,
    /// Up to the end of the first commit.
    bytes_startup: u64,
    /// Of later frames that are no keyframes.
    bytes_steady: u64,
    /// Of later keyframes.
    bytes_keyframes: u64,
    #[serde(skip)]
    keyframe_next: bool,
    #[serde(skip)]
    position: u64,
}

impl Timing {
    fn event(&mut self, decoder: &Decoder, event: Event) {
        match event {
            Event::Group { start: GroupStart::Keyframes, .. } => self.keyframe_next = true,
            Event::Frame(frame) => {
                let bytes = decoder.position() - self.position;
                self.position = decoder.position();
                match (self.frames, self.keyframe_next) {
                    (0, _) => self.bytes_startup = bytes,
                    (_, false) => self.bytes_steady += bytes,
                    (_, true) => self.bytes_keyframes += bytes,
                }
                self.frames += 1;
                self.keyframes += u64::from(self.keyframe_next);
                self.keyframe_next = false;
                self.first_tick.get_or_insert(frame.tick);
                self.last_tick = Some(frame.tick);
            }
            _ => {}
        }
    }

    /// Seconds from the first commit to the last.
    fn seconds(&self, rate: TickRate) -> Option<f64> {
        let ticks = self.last_tick?.checked_sub(self.first_tick?).filter(|&t| t > 0)?;
        Some(ticks as f64 * f64::from(rate.denominator) / f64::from(rate.numerator))
    }

    /// Mean Mbit/s of the frames after the first: that of frames which are no keyframes, as if the
    /// keyframes were such frames too, and that of all.
    fn rates(&self, rate: TickRate) -> (Option<f64>, Option<f64>) {
        let Some(seconds) = self.seconds(rate) else {
            return (None, None);
        };
        let later = self.frames - 1;
        let first_is_keyframe = u64::from(self.keyframes > 0);
        let plain = later - self.keyframes.saturating_sub(first_is_keyframe).min(later);
        let megabits = |bytes: u64| bytes as f64 * 8.0 / 1e6 / seconds;
        let steady = megabits(self.bytes_steady) * later as f64 / plain as f64;
        let all = megabits(self.bytes_steady + self.bytes_keyframes);
        ((plain > 0).then_some(steady), Some(all))
    }
}

/// Runs the command. A stream with a fault is reported up to it, with exit code 1; one that stops
/// after a commit without an `end` record is a live stream and no fault.
///
/// # Errors
/// `Io` where the file cannot be read.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut timing = Timing::default();
    let mut tick_rate = None;
    let mut tracks = Vec::new();
    let outcome = stream::decode(&args.file, true, |decoder, event| {
        timing.event(decoder, event);
        match event {
            Event::Stream(rate) => tick_rate = Some(rate),
            // The state is gone when decoding returns, and no event tells the last frame.
            Event::Frame(_) => tracks.clear(),
            _ => {}
        }
        if matches!(event, Event::End) {
            tracks = decoder.tracks().iter().map(|live| TrackReport::new(decoder, live)).collect();
        }
        Ok(())
    })?;
    let report = Report::new(args, &outcome, timing, tick_rate, tracks);
    if args.json {
        output::print_json(&report)?;
    } else {
        output::print(&report.to_text())?;
    }
    match &outcome.fault {
        None => Ok(ExitCode::SUCCESS),
        Some(_) if args.json => Ok(ExitCode::from(1)),
        Some(fault) => {
            tell(&stream::error(&args.file, fault));
            Ok(ExitCode::from(1))
        }
    }
}
