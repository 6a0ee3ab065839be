//! `dapple inspect`: what a stream holds.

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::limits::LimitArgs;
use super::records::RecordTotal;
use super::stream::{self, FaultReport, Outcome, ReadOptions};
use super::{output, tell};
use crate::Result;
use crate::codec::points::Grid;
use crate::codec::probes::{Coding, Volume};
use crate::codec::regions::{Derivatives, RegionSet};
use crate::codec::vertices::Vertices;
use crate::codec::{Decoder, Event, LookupSpace, Model, TrackState};

mod frames;
mod sparkline;
mod text;

use frames::Frames;

/// Show what a stream holds: records, tracks, frames, bytes, bitrate.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream; `-` for standard input.
    file: PathBuf,
    /// Print one JSON document, with every track.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    limits: LimitArgs,
}

#[derive(Debug, Serialize)]
struct Report {
    file: String,
    bytes: u64,
    /// `None` where not even the preamble is whole.
    container_version: Option<u16>,
    /// Ticks a second as a fraction.
    tick_rate: Option<[u32; 2]>,
    records: Vec<TypeReport>,
    /// Payload bytes unpacked over payload bytes stored.
    compression_ratio: Option<f64>,
    #[serde(flatten)]
    frames: Frames,
    /// After the last commit: the `end` record, a frame that was not committed, what follows a fault.
    bytes_after: u64,
    mbps_steady: Option<f64>,
    mbps_with_keyframes: Option<f64>,
    /// All tracks that were declared; `tracks` are those that live at the end.
    tracks_declared: u64,
    tracks_removed: u64,
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
    application_id: u64,
    path: String,
    space: &'static str,
    /// Of a grid or a volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    dims: Option<[u16; 3]>,
    #[serde(flatten)]
    model: ModelReport,
}

/// What a model says of a track.
#[derive(Debug, Serialize)]
#[serde(tag = "model", rename_all = "lowercase")]
enum ModelReport {
    Points {
        cell_edge: f32,
        radius: f32,
        point_bits: u32,
        buckets: u32,
        cell_capacity: u32,
        /// Cells and points that a lookup can reach.
        cells: u64,
        points: u64,
    },
    Probes {
        coding: &'static str,
        spacing: [f32; 3],
        exponent: i8,
        /// Texels a side of the visibility block, and whether it has come.
        visibility_side: u8,
        has_visibility: bool,
        probes: u64,
        /// Those that are not absent.
        present: u64,
    },
    Vertices {
        coding: &'static str,
        vertices: u32,
        signals: u8,
        bits: u8,
        order: &'static str,
        /// Of all values, 0 to 1.
        mean: f64,
    },
    Instances {
        coding: &'static str,
        signals: u8,
        /// Entries of the table: 0 before its first frame.
        entries: u64,
    },
    Regions {
        coding: &'static str,
        signals: u8,
        /// Regions: 0 before the first frame.
        entries: u64,
        /// By derivatives: constant, gradient, sided.
        rungs: [usize; 3],
        coefficients: usize,
    },
}

/// Runs the command. A stream with a fault is reported up to it, with exit code 1; one that stops
/// after a commit without an `end` record is a live stream and no fault.
///
/// # Errors
/// `Io` where the file cannot be read.
pub fn run(args: &Args) -> Result<ExitCode> {
    let mut frames = Frames::default();
    let mut declared = 0;
    let options = ReadOptions {
        limits: args.limits.limits(),
        live: true,
        ..ReadOptions::default()
    };
    let outcome = stream::decode(&args.file, &options, |decoder, event| {
        let Ok(event) = event else { return Ok(()) };
        frames.event(decoder, event);
        if let Event::Tracks { added } = event {
            declared += u64::from(added);
        }
        Ok(())
    })?;
    let report = Report::new(args, &outcome, frames, declared);
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
    fn new(args: &Args, outcome: &Outcome, frames: Frames, declared: u64) -> Report {
        let decoder = &outcome.decoder;
        let total = outcome.records.total();
        let rate = decoder.tick_rate();
        let (mbps_steady, mbps_with_keyframes) =
            rate.map_or((None, None), |rate| frames.rates(rate));
        let type_report = |(number, name, total)| TypeReport {
            number,
            name,
            total,
        };
        Report {
            file: stream::name(&args.file),
            bytes: outcome.bytes,
            container_version: outcome.records.container_version(),
            tick_rate: rate.map(|rate| [rate.numerator, rate.denominator]),
            records: outcome.records.by_type().map(type_report).collect(),
            compression_ratio: ratio(&total),
            bytes_after: outcome.bytes - frames.position,
            frames,
            mbps_steady,
            mbps_with_keyframes,
            tracks_declared: declared,
            tracks_removed: declared.saturating_sub(decoder.tracks().len() as u64),
            tracks: decoder
                .tracks()
                .iter()
                .map(|live| TrackReport::new(decoder, live))
                .collect(),
            ended: outcome.ended,
            fault: outcome.fault.as_ref().map(FaultReport::new),
        }
    }
}

impl TrackReport {
    fn new(decoder: &Decoder, live: &TrackState) -> TrackReport {
        let track = &live.track;
        let (dims, model) = match &track.model {
            Model::Points(grid) => (Some(grid.dims), of_points(decoder, live, grid)),
            Model::Probes(volume) => (Some(volume.dims), of_probes(decoder, live, volume)),
            Model::Vertices(vertices) => (None, of_vertices(decoder, live, vertices)),
            Model::Instances(table) => (
                None,
                ModelReport::Instances {
                    coding: track.model.coding_name(),
                    signals: table.signals.count,
                    entries: decoder.instances().keys_of(live).len() as u64,
                },
            ),
            Model::Regions(set) => (None, of_regions(decoder, live, set)),
        };
        TrackReport {
            id: track.id,
            application_id: track.target.application_id,
            path: track.target.path.clone(),
            space: match track.space {
                LookupSpace::Mesh => "mesh",
                LookupSpace::Rest => "rest",
            },
            dims,
            model,
        }
    }
}

fn of_points(decoder: &Decoder, live: &TrackState, grid: &Grid) -> ModelReport {
    let (mut cells, mut points) = (0, 0);
    let state = decoder.points();
    for bucket in state.buckets_of(live) {
        for cell in state.cells_in(live, bucket) {
            cells += 1;
            points += cell.points.iter().filter(|&&point| point != 0).count() as u64;
        }
    }
    ModelReport::Points {
        cell_edge: grid.cell_edge,
        radius: grid.radius,
        point_bits: grid.widths.bits(),
        buckets: grid.bucket_count,
        cell_capacity: grid.cell_capacity,
        cells,
        points,
    }
}

fn of_probes(decoder: &Decoder, live: &TrackState, volume: &Volume) -> ModelReport {
    let state = decoder.probes();
    let present = state.probes_of(live).iter().filter(|p| p.level > 0);
    ModelReport::Probes {
        coding: match volume.coding {
            Coding::Raw => "raw",
            Coding::Packed(_) => "packed",
        },
        spacing: volume.spacing,
        exponent: volume.exponent,
        visibility_side: volume.visibility.side,
        has_visibility: state.visibility_of(live).is_some(),
        probes: volume.count() as u64,
        present: present.count() as u64,
    }
}

fn of_vertices(decoder: &Decoder, live: &TrackState, vertices: &Vertices) -> ModelReport {
    let values = decoder.vertices().values_of(live);
    let sum: u64 = values.iter().map(|&value| u64::from(value)).sum();
    ModelReport::Vertices {
        coding: live.track.model.coding_name(),
        vertices: vertices.count,
        signals: vertices.signals.count,
        bits: vertices.bits,
        order: match vertices.order {
            Vertices::DISTINCT_ORDER => "distinct",
            _ => "file",
        },
        mean: sum as f64 / 255.0 / values.len().max(1) as f64,
    }
}

fn of_regions(decoder: &Decoder, live: &TrackState, set: &RegionSet) -> ModelReport {
    let regions = decoder.regions().regions_of(live);
    let forms: Vec<_> = regions.iter().filter_map(|region| region.form()).collect();
    let with = |derivatives| forms.iter().filter(move |f| f.derivatives == derivatives);
    ModelReport::Regions {
        coding: live.track.model.coding_name(),
        signals: set.signals.count,
        entries: regions.len() as u64,
        rungs: Derivatives::ALL.map(|derivatives| with(derivatives).count()),
        coefficients: forms.iter().map(|form| form.coefficients()).sum(),
    }
}

/// Unpacked over stored; `None` where nothing is stored.
fn ratio(total: &RecordTotal) -> Option<f64> {
    (total.stored_bytes > 0).then(|| total.unpacked_bytes as f64 / total.stored_bytes as f64)
}
