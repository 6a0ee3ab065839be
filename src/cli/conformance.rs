//! `dapple conformance`: runs the conformance vectors through a decoder.

use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use dapple_conformance::clauses::{self, Clause};
use dapple_conformance::models::Samplers;
use dapple_conformance::models::probes::queries::Interpolation;
use dapple_conformance::models::probes::queries::Surface;
use dapple_conformance::options::{Extent, Level, Options};
use dapple_conformance::program::{Batch, CommandLine, OneShot};
use dapple_conformance::protocol::Program;
use dapple_conformance::reference::Reference;
use dapple_conformance::report;
use dapple_conformance::run::{self, Report};
use dapple_conformance::vector::{self, Vector};
use glam::Vec3;

use super::interrupt;
use super::progress::Progress;
use super::{output, tell};
use crate::codec::{Decoder, TrackState};
use crate::files::{self, NewFile};
use crate::instances::client::entry_of;
use crate::points::sample::{self, Fallback};
use crate::probes;
use crate::probes::client::ProbesVolume;
use crate::regions::sample::Regions;
use crate::vertices;
use crate::{Error, Result};

/// Run the conformance vectors through a decoder: exit code 0 if all pass, 1 if any fails.
///
/// For example: dapple conformance --decoder ./my-decoder --batch. Without --decoder, the decoder and
/// sampler of this program are tested. Ctrl-C ends the run with the results so far.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Command line of a decoder that speaks the protocol of conformance/README.md; run by the
    /// shell.
    #[arg(long, value_name = "CMD")]
    decoder: Option<String>,
    /// Start the decoder once, with --batch, and send it all requests. Recommended: without it the
    /// decoder is started for each of thousands of requests, and few prefixes are run.
    #[arg(long, requires = "decoder")]
    batch: bool,
    /// What to hold it to; all if not given. May be given several times; full takes core with it.
    #[arg(long, value_name = "LEVEL", value_parser = named::<Level>(Level::ALL.map(Level::name)))]
    level: Vec<Level>,
    /// Proper prefixes of streams up to 4 KiB: none, one in 29, or all, 1.6 million requests.
    #[arg(long, value_name = "EXTENT", default_value = "sample", value_parser = named::<Extent>(Extent::ALL.map(Extent::name)))]
    prefixes: Extent,
    /// Single-bit flips of valid vectors up to 4 KiB: none, one in 29, or all.
    #[arg(long, value_name = "EXTENT", default_value = "none", value_parser = named::<Extent>(Extent::ALL.map(Extent::name)))]
    flips: Extent,
    /// Folder of the vectors; the one in the source tree that this program was built from if not
    /// given.
    #[arg(long, value_name = "DIR")]
    vectors: Option<PathBuf>,
    /// Only vectors with this text in their path; given several times, with any of them.
    #[arg(long, value_name = "TEXT")]
    filter: Vec<String>,
    /// File with vectors that may fail: a path and a reason a line. One that passes is an error.
    #[arg(long, value_name = "FILE")]
    skip: Option<PathBuf>,
    /// Seconds that the decoder has for a request.
    #[arg(long, value_name = "S", default_value = "10", requires = "decoder",
        value_parser = clap::value_parser!(u32).range(1..=86_400))]
    timeout: u32,
    /// Address space that the decoder may take, in MiB; 0 for no limit. Needs a POSIX shell.
    #[arg(long, value_name = "MIB", default_value = "4096", requires = "decoder",
        value_parser = clap::value_parser!(u32).range(0..=16_777_216))]
    memory: u32,
    /// Write a report as JSON to this file. Missing folders are made.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a report as JUnit XML to this file.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write a report as a web page, with the coverage of each clause, to this file.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

/// Reads one of these names, and lists them all in the help.
fn named<T>(names: impl IntoIterator<Item = &'static str>) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err = String> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names).try_map(|name| name.parse::<T>())
}

/// Runs the command.
///
/// # Errors
/// As [`NewFile::create`] and [`NewFile::finish`] of the reports. What is wrong with the arguments is told here, with exit
/// code 2.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(skip) = &args.skip {
        files::protect(skip);
    }
    // A report that cannot be written is told before the run.
    let create = |path: &Option<PathBuf>| path.as_deref().map(NewFile::create).transpose();
    let reports = [
        create(&args.json)?,
        create(&args.junit)?,
        create(&args.html)?,
    ];
    // The clauses first: they may be wrong, and a run takes its time.
    match clauses(args).and_then(|clauses| Ok((verdicts(args)?, clauses))) {
        Ok((report, clauses)) => {
            output::print(&report::text(&report))?;
            write_reports(reports, &report, &clauses)?;
            let failed = u8::from(!report.passed());
            Ok(ExitCode::from(
                interrupt::signal().map_or(failed, |signal| 128 + signal),
            ))
        }
        Err(sentence) => {
            tell(&Error::Invalid(sentence));
            Ok(ExitCode::from(2))
        }
    }
}

fn verdicts(args: &Args) -> std::result::Result<Report, String> {
    let folder = args.vectors.clone().unwrap_or_else(vector::folder);
    let vectors = vectors(args, &folder)?;
    let skips = match &args.skip {
        None => Default::default(),
        Some(path) => {
            let text = std::fs::read_to_string(path);
            run::skips(&text.map_err(|e| format!("{}: {e}", path.display()))?)?
        }
    };
    let options = Options {
        levels: match args.level.as_slice() {
            [] => Level::ALL.to_vec(),
            levels => levels.to_vec(),
        },
        prefixes: args.prefixes,
        flips: args.flips,
        partial: args.batch || args.decoder.is_none(),
        compare: args.decoder.is_some(),
        skips,
        filters: args.filter.clone(),
    };
    let name = args.decoder.as_deref().unwrap_or("dapple");
    interrupt::defer();
    let bar = Progress::new("vectors", vectors.len() as u64);
    let report = run::run(
        name,
        program(args).as_mut(),
        &vectors,
        &options,
        &mut |progress| {
            match progress {
                run::Progress::Vectors(done) => bar.at(done as u64),
                run::Progress::Area {
                    name,
                    vectors,
                    failed,
                } => bar.line(&format!("{name}: {vectors} vectors, {failed} failed")),
            }
            match interrupt::signal() {
                Some(_) => ControlFlow::Break(()),
                None => ControlFlow::Continue(()),
            }
        },
    );
    report.map(|mut report| {
        let sentence = format!("vectors: those of {}", folder.display());
        report.extent.insert(0, sentence);
        report
    })
}

fn program(args: &Args) -> Box<dyn Program> {
    let Some(command) = &args.decoder else {
        return Box::new(Reference {
            samplers: Samplers {
                points: Some(ambient_occlusion),
                probes: Some(light),
                vertices: Some(at_vertices),
                instances: Some(instance_ambient_occlusion),
                regions: Some(region_ambient_occlusion),
            },
        });
    };
    let command_line = CommandLine {
        command: command.clone(),
        timeout: Duration::from_secs(u64::from(args.timeout)),
        memory_mib: u64::from(args.memory),
    };
    match args.batch {
        true => Box::new(Batch::new(command_line)),
        false => Box::new(OneShot(command_line)),
    }
}

/// The vectors are files in the source tree and no part of this program: who tests a decoder wants
/// to open them, and a program that carries a thousand files would need a build step of its own.
fn vectors(args: &Args, folder: &Path) -> std::result::Result<Vec<Vector>, String> {
    let loaded = vector::load(folder);
    match args.vectors {
        Some(_) => loaded,
        None => loaded.map_err(|e| {
            format!("{e}; --vectors names the folder conformance/vectors of a source tree")
        }),
    }
}

/// AO by Eq. 4 alone, at a grid-space position and normal.
fn ambient_occlusion(decoder: &Decoder, live: &TrackState, x: [f32; 3], n: [f32; 3]) -> f32 {
    let state = decoder.points();
    // A track of another model has no points, and nothing closes it.
    let Some(grid) = live.track.grid() else {
        return 1.0;
    };
    let (buckets, cells) = (state.buckets_of(live), state.cells_of(live));
    let (x, n) = (Vec3::from(x), Vec3::from(n));
    sample::sample(grid, buckets, cells, x, n, Fallback::One).ao
}

/// Irradiance and filtered radiance of a surface of a volume.
fn light(decoder: &Decoder, live: &TrackState, surface: &Surface) -> [[f32; 3]; 2] {
    // Nothing lights a track of another model.
    let Some(volume) = ProbesVolume::new(decoder, live) else {
        return [[0.0; 3]; 2];
    };
    let [x, n, v] = [surface.position, surface.normal, surface.view].map(Vec3::from);
    let radiance = match surface.interpolation {
        Interpolation::Trilinear => probes::sample::trilinear(&volume.field(), x),
        Interpolation::VisibilityWeighted => {
            probes::sample::visibility_weighted(&volume.field(), x, n, v)
        }
    };
    let light = probes::sample::incoming_light(&radiance, n, v, surface.roughness);
    [light.irradiance.to_array(), light.filtered.to_array()]
}

/// AO in a triangle of a mesh (`spec/vertices.md` §9).
fn at_vertices(decoder: &Decoder, live: &TrackState, corners: [u32; 3], weights: [f32; 3]) -> f32 {
    let state = decoder.vertices();
    let track = live.track.vertices();
    let values = track.and_then(|track| vertices::client::values_of(state, live, track));
    // Nothing closes a track of another model.
    values.map_or(1.0, |values| values.ao(state.values(), corners, weights))
}

/// AO of a mesh instance at a mesh-space position, times a local AO.
fn instance_ambient_occlusion(
    decoder: &Decoder,
    live: &TrackState,
    path: &str,
    position: [f32; 3],
    local: f32,
) -> f32 {
    match entry_of(decoder, live, path) {
        Some(entry) => entry.ao(position, local),
        None => local,
    }
}

/// AO of an object at a position with a normal, in the space of a track of regions.
fn region_ambient_occlusion(
    decoder: &Decoder,
    live: &TrackState,
    position: [f32; 3],
    normal: [f32; 3],
) -> f32 {
    // Nothing closes a place of a track of another model.
    let Some(set) = live.track.region_set() else {
        return 1.0;
    };
    let state = decoder.regions();
    let regions = Regions::new(set, state.regions_of(live), state.pairs_of(live));
    regions.ao(position.into(), normal.into())
}

/// Writes those reports that were asked for: JSON, JUnit XML, and a web page.
fn write_reports(
    [json, junit, html]: [Option<NewFile>; 3],
    report: &Report,
    clauses: &[Clause],
) -> Result<()> {
    let write = |file: Option<NewFile>, text: &dyn Fn() -> String| match file {
        None => Ok(()),
        Some(mut file) => {
            let written = file.write_all(text().as_bytes());
            written.map_err(|e| file.error(e))?;
            file.finish()
        }
    };
    write(json, &|| report::json(report))?;
    write(junit, &|| report::junit(report))?;
    write(html, &|| report::html(report, clauses))
}

/// The clauses that a web page tells the coverage of: those of the specification beside the
/// vectors, or none where a folder of vectors stands alone.
fn clauses(args: &Args) -> std::result::Result<Vec<Clause>, String> {
    if args.html.is_none() {
        return Ok(Vec::new());
    }
    let folder = match &args.vectors {
        None => clauses::folder(),
        Some(vectors) => {
            let beside = vectors.join("../../spec");
            if !beside.is_dir() {
                return Ok(Vec::new());
            }
            beside
        }
    };
    clauses::read(&clauses::chapters(&folder)?)
}
