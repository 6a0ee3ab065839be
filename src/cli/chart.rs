//! `dapple chart`: accuracy against bitrate and time. Of `points` over densities, cameras and server
//! rates; of `probes` in [`probes`], and of baked obscurance in [`baked`].

mod baked;
mod probes;

use super::args::{EncodeArgs, Rate, SceneArgs, ViewArgs};
use super::effects::{self, Given};
use super::output;
use super::progress::Progress;
use crate::limits::check_tracks;
use crate::measure::chart::{Axis, Chart, Level, Point, Series, add_point};
use crate::measure::evaluate::{
    Evaluation, Playback, Quality, StartedServer, evaluate, references,
};
use crate::measure::metrics::{self, Difference};
use crate::measure::reference::{RAYS, Reference, Score};
use crate::measure::report::{Image, Report, Section, Source, save, write};
use crate::measure::table::{Table, Value};
use crate::models::{Model, ModelOptions};
use crate::points::place::Density;
use crate::points::server::{Options, Server};
use crate::points::source::declarations;
use crate::render::{Backend, Renderer};
use crate::scene::Scene;
use crate::stream::{Job, View};
use crate::world::World;
use crate::{Error, Result, files};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Measure a scene: `points` over densities, bitrate of a whole run and accuracy against RTAO; with
/// `--model probes`, indirect light against path tracing, beside DDGI; with `--baked`, baked obscurance of
/// `vertices`, `instances` and `regions` against ray tracing.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    encode: EncodeArgs,
    /// Measure baked obscurance by bytes, error and time, at one moment. `--rays` are those of a sample (64 if not
    /// given); `--distance` is that of plain occlusion, in the place of the half-distances of 2 m and 300 m.
    #[arg(help_heading = HEADING, long, conflicts_with = "model")]
    baked: bool,
    /// Points of the surfaces at which `--baked` measures errors.
    #[arg(help_heading = HEADING, long, value_name = "COUNT", default_value = "4000",
        value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    points: u32,
    /// Densities to measure, before thinning, instead of the one of --density; if neither is given: a
    /// sixteenth and a quarter of the density that suits the scene, and that.
    #[arg(help_heading = HEADING, long, value_name = "N,N", value_delimiter = ',', value_parser = super::args::density,
        conflicts_with = "density")]
    densities: Vec<f64>,
    /// Cameras to measure; all of the scene's if not given.
    #[arg(help_heading = HEADING, long, value_name = "NAME,NAME", value_delimiter = ',',
        conflicts_with_all = ["camera", "eye"])]
    cameras: Vec<String>,
    /// Frames a camera that are scored, spread evenly over the run.
    #[arg(help_heading = HEADING, long, value_name = "COUNT", default_value = "8",
        value_parser = clap::value_parser!(u32).range(1..=1000))]
    scored: u32,
    /// Server rates to measure as well, at a display rate of --fps.
    #[arg(help_heading = HEADING, long, value_name = "HZ,HZ", value_delimiter = ',')]
    server_rates: Vec<Rate>,
    /// Milliseconds from a server frame to its use.
    #[arg(help_heading = HEADING, long, value_name = "MS", default_value = "0", value_parser = super::args::latency)]
    latency_ms: f64,
    /// Paths a pixel of the reference for `probes`; rays of a point of it for `--baked`.
    #[arg(help_heading = HEADING, long, value_name = "COUNT", default_value = "1024",
        value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    reference: u32,
    /// Paths a pixel that tell diffuse and glossy light apart for `probes`, at one pixel of 36.
    #[arg(help_heading = HEADING, long, value_name = "COUNT", default_value = "512",
        value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    parts: u32,
    /// Factor on radiance before the tone curve for `probes`; by the reference's luminance if not
    /// given.
    #[arg(help_heading = HEADING, long, value_name = "FACTOR", value_parser = super::args::exposure)]
    exposure: Option<f32>,
    /// Measure `probes` over degree, samples and hysteresis as well.
    #[arg(help_heading = HEADING, long)]
    curves: bool,
    /// Folder for the tables, charts and the page; missing folders are made.
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    output: PathBuf,
}

/// Heading of the measurements' options in the help.
const HEADING: &str = "Measurements";

/// Columns of the table.
const COLUMNS: [&str; 16] = [
    "N (1/m2)",
    "server (Hz)",
    "camera",
    "points",
    "steady (Mbit/s)",
    "start-up (MB)",
    "PSNR (dB)",
    "SSIM",
    "FLIP",
    "AO PSNR (dB)",
    "AO rmse",
    "reference noise",
    "no point in reach (%)",
    "changed a frame",
    "rays a frame",
    "tick (ms)",
];

/// One row: a density at a server rate, seen by one camera.
#[derive(Serialize)]
struct Row {
    density: f32,
    server_fps: f64,
    camera: String,
    evaluation: Evaluation,
}

/// A camera and what it should see.
struct Seat {
    name: String,
    view: View,
    references: Vec<Reference>,
}

/// Runs the command.
///
/// # Errors
/// `Scene` for an unusable scene, `Invalid` for cameras it does not have, `Io` where the folder
/// cannot be written.
pub fn run(args: &Args, given: &Given) -> Result<ExitCode> {
    let mut active = match args.baked {
        true => vec![effects::BAKED],
        false => args.encode.active(),
    };
    active.extend(given.has("frame").then_some(effects::FRAME));
    active.extend(given.has("frames").then_some(effects::FRAMES));
    given.warn_without_effect(&active);
    if args.baked {
        return baked::run(args);
    }
    match args.encode.model[..] {
        [Model::Points] => {}
        _ if args.encode.model.contains(&Model::Probes) => return probes::run(args),
        _ => {
            return Err(Error::Usage(
                "chart points, probes, or points,probes".into(),
            ));
        }
    }
    let scene = args.scene.open(true)?;
    files::create_folder(&args.output)?;
    let job = args.encode.job(&scene, &args.scene.view)?;
    let points = job
        .points()
        .copied()
        .unwrap_or_else(|| args.encode.options(&scene, args.scene.view.aspect()));
    let densities: Vec<f32> = match args.densities[..] {
        [] if args.encode.density.is_some() => vec![points.density.candidates],
        [] => [16.0, 4.0, 1.0]
            .map(|share| points.density.candidates / share)
            .into(),
        _ => args.densities.iter().map(|&d| d as f32).collect(),
    };
    let mut renderer = Renderer::new(&scene, Backend::Auto)?;
    let seats = seats(args, &scene, &job, points.distance, &mut renderer)?;

    let mut rates = vec![args.encode.fps];
    rates.extend(args.server_rates.iter().filter(|r| **r != args.encode.fps));
    let bar = Progress::new(
        "Measuring runs",
        (densities.len() * seats.len() * rates.len()) as u64,
    );
    let mut rows: Vec<Row> = Vec::new();
    for density in densities {
        let options = Options {
            fitted: points.fitted && args.densities.is_empty(),
            density: Density {
                candidates: density,
                ..points.density
            },
            ..points
        };
        let clock = Instant::now();
        let world = World::new(&scene, job.start);
        let mut server = Server::new(&world, options)?;
        check_tracks(&scene.name, &declarations(&scene, &server, 0), &job.limits)?;
        server.start(&world, &mut |_, _| {});
        let startup_time = clock.elapsed();
        for &rate in &rates {
            for seat in &seats {
                let share = rate.hz() / args.encode.fps.hz();
                let job = Job {
                    models: vec![ModelOptions::Points(options)],
                    view: seat.view,
                    frames: ((job.frames as f64 * share).round() as usize).max(1),
                    rate: rate.into(),
                    ..job.clone()
                };
                let playback = Playback {
                    latency: args.latency_ms * 1e-3,
                    ..Playback::default()
                };
                let evaluation = evaluate(
                    StartedServer {
                        world: World::new(&scene, job.start),
                        server: server.clone(),
                        startup_time,
                    },
                    job,
                    playback,
                    &mut renderer,
                    &seat.references,
                    |_| Ok(()),
                )?;
                rows.push(Row {
                    density,
                    server_fps: rate.hz(),
                    camera: seat.name.clone(),
                    evaluation,
                });
                bar.step(1);
                // What is measured so far survives an interruption.
                save(
                    &args.output.join("table.csv"),
                    &table(&scene.name, &rows, &[]).to_csv(),
                )?;
            }
        }
    }
    drop(bar);

    let open: Vec<(String, WithoutAo)> = seats
        .iter()
        .map(|seat| Ok((seat.name.clone(), without_ao(&seat.references)?)))
        .collect::<Result<_>>()?;
    for sentence in worse_than_none(&rows, &open) {
        output::warn(&format!("{}: {sentence}", scene.name));
    }
    let table = table(&scene.name, &rows, &open);
    let charts = charts(&rows, &open);
    save(&args.output.join("table.csv"), &table.to_csv())?;
    save(&args.output.join("table.md"), &markdown(&table))?;
    for (chart, name) in charts.iter().zip(["rate", "time"]) {
        save(&args.output.join(format!("{name}.svg")), &chart.to_svg())?;
        save(&args.output.join(format!("{name}.csv")), &chart.to_csv())?;
    }
    let (width, height) = args.scene.view.size;
    let page = Report {
        title: format!("{}: accuracy, bitrate and time", scene.name),
        subtitle: format!(
            "{} frames at {} Hz, {} scored a camera at {width}x{height} against {RAYS} rays a pixel, \
             {} rays a point, seed {}",
            job.frames,
            args.encode.fps.hz(),
            (args.scored as usize).min(job.frames),
            points.rays,
            points.seed
        ),
        sections: vec![
            Section {
                images: images(&rows, &seats, &args.output)?,
                ..Section::default()
            },
            Section {
                charts,
                tables: vec![table.clone()],
                ..Section::default()
            },
        ],
        notes: vec![
            "PSNR, SSIM and FLIP are of the picture, AO PSNR and rmse of occlusion over its geometry; means over \
             the scored frames."
                .into(),
            "Start-up is the first frame, which has all points; the steady rate is of the frames after it."
                .into(),
            format!("Pictures are of the last scored frame, drawn by {}.", renderer.name()),
        ],
        ..Report::default()
    };
    write(&page, &rows, &args.output)?;
    let page = args.output.join("index.html");
    output::print(&format!("{}\n{}\n", markdown(&table), page.display()))?;
    Ok(ExitCode::SUCCESS)
}

fn seats(
    args: &Args,
    scene: &Scene,
    job: &Job,
    distance: f32,
    renderer: &mut Renderer,
) -> Result<Vec<Seat>> {
    let names: Vec<String> = if !args.cameras.is_empty() {
        args.cameras.clone()
    } else if args.scene.view.look().is_some() || scene.cameras.is_empty() {
        vec![String::new()]
    } else if let Some(name) = &args.scene.view.camera {
        vec![name.clone()]
    } else {
        scene.cameras.iter().map(|c| c.name.clone()).collect()
    };
    let (width, height) = args.scene.view.size;
    let quality = Quality {
        width,
        height,
        rays: RAYS,
        distance,
        seed: 1,
    };
    let length = job.frames as f64 / args.encode.fps.hz();
    let bar = Progress::new(
        "Tracing references",
        names.len() as u64 * args.scored as u64,
    );
    names
        .into_iter()
        .map(|name| {
            let camera = (!name.is_empty()).then(|| name.clone());
            let view = ViewArgs {
                camera,
                ..args.scene.view.clone()
            }
            .view(scene)?;
            let frames = (0..args.scored).map(|k| (k as f64 + 0.5) / args.scored as f64);
            // On frames of the display.
            let fps = args.encode.fps.hz();
            let mut times: Vec<f64> = frames
                .map(|at| job.start + (at * length * fps).floor() / fps)
                .collect();
            times.dedup();
            let references = references(scene, renderer, view, &times, quality, || bar.step(1))?;
            let name = if name.is_empty() {
                "framing".into()
            } else {
                name
            };
            Ok(Seat {
                name,
                view,
                references,
            })
        })
        .collect()
}

/// Of each camera the reference, and the picture of its last row, which has the most points.
fn images(rows: &[Row], seats: &[Seat], folder: &Path) -> Result<Vec<Image>> {
    let mut images = Vec::new();
    for (number, seat) in seats.iter().enumerate() {
        let Some(reference) = seat.references.last() else {
            continue;
        };
        let mut add = |kind: &str, caption: String, detail: String, ao: &[f32]| -> Result<()> {
            let file = format!("{kind}_{number}.png");
            reference
                .frame
                .composite(Some(ao))
                .write_png(&folder.join(&file))?;
            images.push(Image {
                caption,
                detail,
                source: Source::File(file),
            });
            Ok(())
        };
        let caption = format!("{}, ray-traced", seat.name);
        add("reference", caption, String::new(), &reference.ao)?;
        let of_camera = rows.iter().filter(|row| row.camera == seat.name);
        if let Some(row) = of_camera.max_by(|a, b| a.density.total_cmp(&b.density)) {
            let caption = format!("{}, {} points per m2", row.camera, row.density);
            let detail = format!(
                "{:.2} dB over all scored frames",
                row.evaluation.picture.psnr
            );
            add("points", caption, detail, &row.evaluation.last_ao)?;
        }
    }
    Ok(images)
}

/// The score of no AO at all, pictures and AO: the floor that a method has to clear.
struct WithoutAo {
    picture: Difference,
    ao: Difference,
}

/// [`WithoutAo`] of what one camera sees.
fn without_ao(references: &[Reference]) -> Result<WithoutAo> {
    let scores: Vec<Score> = references
        .iter()
        .map(|r| r.score(&vec![1.0; r.ao.len()]))
        .collect::<Result<_>>()?;
    let mean = |of: fn(&Score) -> Difference| {
        metrics::mean(&scores.iter().map(of).collect::<Vec<_>>())
            .ok_or_else(|| Error::Invalid("no frame was scored".into()))
    };
    Ok(WithoutAo {
        picture: mean(|s| s.picture)?,
        ao: mean(|s| s.ao)?,
    })
}

/// A sentence for every row that is worse than no AO at all, in the picture or in the AO.
fn worse_than_none(rows: &[Row], open: &[(String, WithoutAo)]) -> Vec<String> {
    let mut all = Vec::new();
    for row in rows {
        let Some((_, open)) = open.iter().find(|(camera, _)| *camera == row.camera) else {
            continue;
        };
        let (picture, ao) = (row.evaluation.picture, row.evaluation.ao);
        for (what, unit, got, without) in [
            ("PSNR of AO", " dB", ao.psnr, open.ao.psnr),
            (
                "PSNR of the picture",
                " dB",
                picture.psnr,
                open.picture.psnr,
            ),
            (
                "SSIM of the picture",
                "",
                picture.ssim.unwrap_or(f64::NAN),
                open.picture.ssim.unwrap_or(f64::NAN),
            ),
        ] {
            if got < without {
                all.push(format!(
                    "worse than no AO: at {} points per m2, camera {}, the {what} is {got:.3}{unit}, and \
                     {without:.3}{unit} without AO; raise the density",
                    row.density, row.camera
                ));
            }
        }
    }
    all
}

fn table(scene: &str, rows: &[Row], open: &[(String, WithoutAo)]) -> Table {
    let measured = rows.iter().map(|row| {
        let (e, s) = (&row.evaluation, &row.evaluation.stream);
        let points = e.points();
        let ticks = s.ticks();
        vec![
            Value::Number(row.density as f64, 0),
            Value::Number(row.server_fps, 0),
            Value::Text(row.camera.clone()),
            Value::Count(points.points as u64),
            Value::Number(s.mbps_steady, 2),
            Value::Number(s.bytes_startup as f64 * 1e-6, 2),
            Value::Number(e.picture.psnr, 2),
            Value::number(e.picture.ssim, 4),
            Value::Number(e.picture.flip, 4),
            Value::Number(e.ao.psnr, 2),
            Value::Number(e.ao.rmse, 4),
            Value::Number(e.reference_noise, 4),
            Value::Number(100.0 * e.without_point, 3),
            Value::Count((points.changed_points / ticks) as u64),
            Value::Count(s.rays / ticks as u64),
            Value::Number(s.stage_ms.total(), 1),
        ]
    });
    let without = open
        .iter()
        .map(|(camera, open)| row_without_ao(camera, open));
    Table {
        title: scene.into(),
        columns: COLUMNS.map(String::from).to_vec(),
        rows: measured.chain(without).collect(),
        note: String::new(),
    }
}

/// A row of the table for each camera: the same frames with AO = 1.
fn row_without_ao(camera: &str, open: &WithoutAo) -> Vec<Value> {
    let mut row = vec![
        Value::Text("no AO".into()),
        Value::Missing,
        Value::Text(camera.into()),
        Value::Missing,
        Value::Missing,
        Value::Missing,
        Value::Number(open.picture.psnr, 2),
        Value::number(open.picture.ssim, 4),
        Value::Number(open.picture.flip, 4),
        Value::Number(open.ao.psnr, 2),
        Value::Number(open.ao.rmse, 4),
    ];
    row.resize_with(COLUMNS.len(), || Value::Missing);
    row
}

/// PSNR over rate and over server time, a curve a camera and server rate.
fn charts(rows: &[Row], open: &[(String, WithoutAo)]) -> Vec<Chart> {
    let chart = |title: &str, label: &str, x: &dyn Fn(&Row) -> f64| {
        let mut series: Vec<Series> = Vec::new();
        for row in rows {
            let name = format!("{}, {} Hz", row.camera, row.server_fps);
            let point = Point {
                x: x(row),
                y: row.evaluation.picture.psnr,
                label: format!("{}", row.density),
            };
            add_point(&mut series, &name, point);
        }
        Chart {
            title: title.into(),
            x: Axis {
                label: label.into(),
                log: true,
            },
            y: Axis {
                label: "PSNR (dB)".into(),
                log: false,
            },
            series,
            levels: open
                .iter()
                .map(|(camera, open)| Level {
                    name: format!("{camera}, no AO"),
                    y: open.picture.psnr,
                })
                .collect(),
        }
    };
    vec![
        chart("Accuracy against rate", "steady rate (Mbit/s)", &|r| {
            r.evaluation.stream.mbps_steady
        }),
        chart(
            "Accuracy against server time",
            "tick (ms, 2 threads)",
            &|r| r.evaluation.stream.stage_ms.total(),
        ),
    ]
}

fn markdown(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let mut text = format!("**{}**\n\n", table.title);
    text += &line(&table.columns);
    text += &format!("|{}\n", " --- |".repeat(table.columns.len()));
    for row in &table.rows {
        text += &line(&row.iter().map(Value::shown).collect::<Vec<_>>());
    }
    if !table.note.is_empty() {
        text += &format!("\n{}\n", table.note);
    }
    text
}
