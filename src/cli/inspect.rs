//! `dapple inspect`: what a stream holds.

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::records::RecordTotal;
use super::stream::{self, FaultReport, Outcome, buckets, cells_of};
use super::{output, tell};
use crate::Result;
use crate::codec::container::{CONTAINER_VERSION, HEADER_BYTES, PREAMBLE_BYTES};
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
            Event::Group {
                start: GroupStart::Keyframes,
                ..
            } => self.keyframe_next = true,
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
        let ticks = self
            .last_tick?
            .checked_sub(self.first_tick?)
            .filter(|&t| t > 0)?;
        Some(ticks as f64 / rate.hz())
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
    let outcome = stream::decode(&args.file, true, |decoder, event| {
        timing.event(decoder, event);
        Ok(())
    })?;
    let report = Report::new(args, &outcome, timing);
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

impl Report {
    fn new(args: &Args, outcome: &Outcome, timing: Timing) -> Report {
        let decoder = &outcome.decoder;
        let total = outcome.records.total();
        let rate = decoder.tick_rate();
        let (mbps_steady, mbps_with_keyframes) =
            rate.map_or((None, None), |rate| timing.rates(rate));
        let type_report = |(number, name, total)| TypeReport {
            number,
            name,
            total,
        };
        Report {
            file: args.file.to_string_lossy().into_owned(),
            bytes: outcome.bytes,
            // The decoder reads one version, and a record only after a valid preamble.
            container_version: (total.records > 0).then_some(CONTAINER_VERSION),
            tick_rate: rate.map(|rate| [rate.numerator, rate.denominator]),
            records: outcome.records.by_type().map(type_report).collect(),
            compression_ratio: ratio(&total),
            timing,
            mbps_steady,
            mbps_with_keyframes,
            tracks: decoder
                .tracks()
                .iter()
                .map(|live| TrackReport::new(decoder, live))
                .collect(),
            ended: outcome.ended,
            fault: outcome.fault.as_ref().map(FaultReport::new),
        }
    }

    fn to_text(&self) -> String {
        let mut text = format!("{}, {} bytes", self.file, self.bytes);
        if let Some(version) = self.container_version {
            text += &format!(", container version {version}");
        }
        if let Some([ticks, seconds]) = self.tick_rate {
            let hz = f64::from(ticks) / f64::from(seconds);
            let rounded = format!("{hz:.6}");
            text += ", ";
            text += rounded.trim_end_matches('0').trim_end_matches('.');
            text += " ticks a second";
        }
        let end = match (&self.fault, self.ended) {
            (Some(_), _) => ", damaged",
            (None, true) => "",
            (None, false) => ", no end record (live)",
        };
        text += end;
        text += "\n\n";
        text += &self.record_table();
        text.push('\n');
        text += &self.frame_lines();
        text.push('\n');
        text += &self.track_table();
        text
    }

    fn record_table(&self) -> String {
        let row = |name: &str, t: &RecordTotal| {
            vec![
                name.to_string(),
                t.records.to_string(),
                t.stored_bytes.to_string(),
                t.unpacked_bytes.to_string(),
                ratio(t).map_or(String::new(), |r| format!("{r:.2}")),
            ]
        };
        let mut rows = vec![
            ["records", "count", "stored", "unpacked", "ratio"]
                .map(String::from)
                .to_vec(),
        ];
        let mut sum = RecordTotal::default();
        for report in &self.records {
            let name = match report.name {
                "unknown" => format!("type {}", report.number),
                name => name.to_string(),
            };
            rows.push(row(&name, &report.total));
            sum = sum.plus(&report.total);
        }
        rows.push(row("all", &sum));
        let framing = sum.records * HEADER_BYTES as u64 + PREAMBLE_BYTES as u64;
        rows.push(
            ["headers", "", &framing.to_string()]
                .map(String::from)
                .to_vec(),
        );
        output::columns(&rows)
    }

    fn frame_lines(&self) -> String {
        let t = &self.timing;
        let mut text = format!(
            "{} frames, {} of them keyframes; start-up {} bytes\n",
            t.frames, t.keyframes, t.bytes_startup
        );
        let mut rates = Vec::new();
        if let Some(rate) = self.mbps_steady {
            rates.push(format!("{rate:.3} Mbit/s without keyframes"));
        }
        if let Some(rate) = self.mbps_with_keyframes {
            rates.push(format!("{rate:.3} Mbit/s with them"));
        }
        if !rates.is_empty() {
            text += &format!("after the first frame: {}\n", rates.join(", "));
        }
        text
    }

    fn track_table(&self) -> String {
        let names = [
            "track",
            "space",
            "grid",
            "radius (m)",
            "bits",
            "buckets",
            "cells",
            "points",
        ];
        let mut rows = vec![names.map(String::from).to_vec()];
        for t in self.tracks.iter().take(LISTED_TRACKS) {
            let [dx, dy, dz] = t.dims;
            let path: String = t.path.chars().filter(|c| !c.is_control()).collect();
            rows.push(vec![
                format!("{} {path}", t.id),
                t.space.to_string(),
                format!("{dx}x{dy}x{dz}"),
                format!("{:.4}", t.radius),
                t.point_bits.to_string(),
                t.buckets.to_string(),
                t.cells.to_string(),
                t.points.to_string(),
            ]);
        }
        let sum = |f: fn(&TrackReport) -> u64| self.tracks.iter().map(f).sum::<u64>().to_string();
        rows.push(vec![
            format!("{} in all", self.tracks.len()),
            String::new(),
            String::new(),
            String::new(),
            String::new(),
            sum(|t| u64::from(t.buckets)),
            sum(|t| t.cells),
            sum(|t| t.points),
        ]);
        let mut text = output::columns(&rows);
        if self.tracks.len() > LISTED_TRACKS {
            let more = self.tracks.len() - LISTED_TRACKS;
            text += &format!("{more} tracks more: --json lists them all\n");
        }
        text
    }
}

impl TrackReport {
    fn new(decoder: &Decoder, live: &LiveTrack) -> TrackReport {
        let track = &live.track;
        let grid = track.grid();
        let (mut cells, mut points) = (0, 0);
        for bucket in buckets(decoder, live) {
            for cell in cells_of(decoder, live, bucket) {
                cells += 1;
                points += cell.points.iter().filter(|&&point| point != 0).count() as u64;
            }
        }
        TrackReport {
            id: track.id,
            model: "points",
            application_id: track.target.application_id,
            path: track.target.path.clone(),
            space: match track.space {
                LookupSpace::Mesh => "mesh",
                LookupSpace::Rest => "rest",
            },
            dims: grid.dims,
            cell_edge: grid.cell_edge,
            radius: grid.radius,
            point_bits: grid.widths.bits(),
            buckets: grid.bucket_count,
            cell_capacity: grid.cell_capacity,
            cells,
            points,
        }
    }
}

/// Unpacked over stored; `None` where nothing is stored.
fn ratio(total: &RecordTotal) -> Option<f64> {
    (total.stored_bytes > 0).then(|| total.unpacked_bytes as f64 / total.stored_bytes as f64)
}
