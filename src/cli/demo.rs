//! `dapple demo`: the main job from end to end, on the built-in scene unless another is named.

use super::args::{EncodeArgs, SceneArgs, ViewArgs};
use super::effects::Given;
use super::output;
use super::progress::Progress;
use crate::files::{self, NewFile};
use crate::measure::difference::signed_picture;
use crate::measure::evaluate::{
    Evaluation, Playback, Quality, StartedServer, evaluate, references,
};
use crate::measure::metrics::psnr_text;
use crate::measure::reference::RAYS;
use crate::measure::report::{Figure, Image, Report, Section, Source, write};
use crate::measure::table::{Table, Value, grouped};
use crate::models::Model;
use crate::points::server::Server;
use crate::render::{Backend, Picture, Renderer, composite};
use crate::world::World;
use crate::{Error, Result};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Encode, decode and render a scene, compare it with a ray-traced reference, and write a report.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A glTF file, `-` for one on standard input, or `hall` for the built-in scene.
    #[arg(value_name = "SCENE", default_value = "hall")]
    scene: PathBuf,
    /// The scene within the glTF file, by number or name; the file's default one if not given.
    #[arg(long = "scene", visible_alias = "gltf-scene", value_name = "N|NAME")]
    gltf_scene: Option<String>,
    /// Folder for the stream, the pictures and the report; missing folders are made.
    #[arg(
        short = 'o',
        long,
        visible_alias = "output",
        value_name = "DIR",
        default_value = "dapple-demo",
        help_heading = "Output"
    )]
    out: PathBuf,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    encode: EncodeArgs,
}

/// Frames of a demo where none are asked for.
const FRAMES: u32 = 60;
/// AO difference that is shown in full colour.
const FULL_SCALE: f32 = 0.25;

#[derive(Serialize)]
struct Figures<'a> {
    #[serde(flatten)]
    evaluation: &'a Evaluation,
    drawn_by: &'a str,
    width: u32,
    height: u32,
    reference_rays: u32,
    seconds: f64,
}

/// Runs the command.
///
/// # Errors
/// `Scene` for an unusable scene, `Io` where the folder cannot be written.
pub fn run(args: &Args, given: &Given) -> Result<ExitCode> {
    let clock = Instant::now();
    if args.encode.model[..] != [Model::Points] {
        return Err(Error::Usage(
            "the demo shows --model points alone; chart measures probes".into(),
        ));
    }
    given.warn_without_effect(&args.encode.active());
    let scene_args = SceneArgs {
        scene: args.scene.clone(),
        gltf_scene: args.gltf_scene.clone(),
        view: args.view.clone(),
    };
    let scene = scene_args.open(true)?;
    let encode = EncodeArgs {
        frames: Some(args.encode.frames.unwrap_or(FRAMES)),
        ..args.encode.clone()
    };
    let job = encode.job(&scene, &args.view)?;
    let options = job
        .points()
        .copied()
        .unwrap_or_else(|| encode.options(&scene, args.view.aspect()));
    files::create_folder(&args.out)?;
    let (width, height) = args.view.size;
    let quality = Quality {
        width,
        height,
        rays: RAYS,
        distance: options.distance,
        seed: 1,
    };

    let placing = Instant::now();
    let world = World::new(&scene, job.start);
    let mut server = Server::new(&world, options)?;
    let mut bar = None;
    server.start(&world, &mut |done, all| {
        bar.get_or_insert_with(|| Progress::new("Tracing all points", all as u64))
            .at(done as u64);
    });
    drop(bar);
    let startup_time = placing.elapsed();

    let mut renderer = Renderer::new(&scene, Backend::Auto)?;
    let last = job.time_of(job.frames - 1);
    let bar = Progress::new("Tracing the reference", 1);
    let reference = references(&scene, &mut renderer, job.view, &[last], quality, || {
        bar.step(1)
    })?;
    drop(bar);

    let mut file = NewFile::create(&args.out.join("stream.dapple"))?;
    let bar = Progress::new("Encoding frames", job.frames as u64);
    let evaluation = evaluate(
        StartedServer {
            world,
            server,
            startup_time,
        },
        job.clone(),
        Playback::default(),
        &mut renderer,
        &reference,
        |bytes| {
            bar.step(1);
            file.write_all(bytes).map_err(|e| file.error(e))
        },
    )?;
    file.finish()?;
    drop(bar);

    let reference = &reference[0];
    let gbuffer = &reference.frame.gbuffer;
    let save = |name: &str, caption: &str, detail: String, picture: Picture| -> Result<Image> {
        picture.write_png(&args.out.join(format!("{name}.png")))?;
        Ok(Image {
            caption: caption.into(),
            detail,
            source: Source::File(format!("{name}.png")),
        })
    };
    let ao = &evaluation.last_ao;
    let [without, with] = [None, Some(&ao[..])].map(|ao| reference.frame.composite(ao));
    let images = vec![
        save(
            "without_and_with",
            "Without ambient occlusion, and with that of the stream",
            String::new(),
            Picture::halves(&without, &with),
        )?,
        save(
            "points",
            "points, as the client shows it",
            format!("PSNR {} dB", psnr_text(evaluation.picture.psnr)),
            with,
        )?,
        save(
            "rtao",
            "RTAO, the reference",
            format!("{RAYS} rays a pixel"),
            reference.frame.composite(Some(&reference.ao)),
        )?,
        save(
            "points_ao",
            "points, AO alone",
            format!("rmse {:.4}", evaluation.ao.rmse),
            composite::ao_picture(gbuffer, ao),
        )?,
        save(
            "rtao_ao",
            "RTAO, AO alone",
            format!("noise {:.4} rms", evaluation.reference_noise),
            composite::ao_picture(gbuffer, &reference.ao),
        )?,
        save(
            "difference",
            "Difference of AO",
            format!("red too bright, blue too dark, full colour at {FULL_SCALE}"),
            signed_picture(
                &reference.field(ao),
                &reference.field(&reference.ao),
                FULL_SCALE,
            )?,
        )?,
        save("no_ao", "Without AO", String::new(), without)?,
    ];

    let page = page(
        &scene.name,
        &evaluation,
        images,
        renderer.name(),
        (width, height),
    );
    let figures = Figures {
        evaluation: &evaluation,
        drawn_by: renderer.name(),
        width,
        height,
        reference_rays: RAYS,
        seconds: clock.elapsed().as_secs_f64(),
    };
    write(&page, &figures, &args.out)?;
    let e = &evaluation;
    output::print(&format!(
        "{}\n{} points, start-up {} bytes, then {:.3} Mbit/s at {} Hz\n\
         PSNR {} dB, FLIP {:.4}, AO rmse {:.4} against RTAO with {RAYS} rays; \
         {:.3} % of fragments without a point in reach\ndrawn by {}, {:.1} s in all\n",
        args.out.join("index.html").display(),
        grouped(e.points().points as u64),
        grouped(e.stream.bytes_startup),
        e.stream.mbps_steady,
        e.stream.fps,
        psnr_text(e.picture.psnr),
        e.picture.flip,
        e.ao.rmse,
        100.0 * e.without_point,
        renderer.name(),
        clock.elapsed().as_secs_f64(),
    ))?;
    Ok(ExitCode::SUCCESS)
}

fn page(
    scene: &str,
    e: &Evaluation,
    images: Vec<Image>,
    drawn_by: &str,
    (width, height): (u32, u32),
) -> Report {
    let figure = |label: &str, value: String, unit: &str, note: String| Figure {
        label: label.into(),
        value,
        unit: unit.into(),
        note,
    };
    let (s, points) = (&e.stream, e.points());
    let ticks = s.ticks();
    let figures = vec![
        figure(
            "Steady rate",
            format!("{:.2}", s.mbps_steady),
            "Mbit/s",
            format!("at {} Hz, keyframes aside", s.fps),
        ),
        figure(
            "Start-up",
            format!("{:.2}", s.bytes_startup as f64 / 1e6),
            "MB",
            "all points, once".into(),
        ),
        figure(
            "PSNR",
            psnr_text(e.picture.psnr),
            "dB",
            "composited picture against RTAO".into(),
        ),
        figure(
            "FLIP",
            format!("{:.4}", e.picture.flip),
            "",
            "lower is better".into(),
        ),
        figure(
            "Points",
            grouped(points.points as u64),
            "",
            format!(
                "{} candidates, {} cells",
                grouped(points.candidates as u64),
                grouped(points.cells as u64)
            ),
        ),
        figure(
            "Changed points",
            grouped((points.changed_points / ticks) as u64),
            "a frame",
            format!("{} traced", grouped((points.traced_points / ticks) as u64)),
        ),
        figure(
            "Tick",
            format!("{:.1}", s.stage_ms.total()),
            "ms",
            "server, all stages".into(),
        ),
        figure(
            "No point in reach",
            format!("{:.3}", 100.0 * e.without_point),
            "%",
            "of fragments; filled from the neighbourhood".into(),
        ),
    ];
    let row = |name: &str, value: Value| vec![Value::Text(name.into()), value];
    let stages = Table {
        title: "Server stages".into(),
        columns: vec!["stage".into(), "time (ms a tick)".into()],
        rows: vec![
            row("animation and skinning", Value::Number(s.stage_ms.pose, 3)),
            row(
                "acceleration structures",
                Value::Number(s.stage_ms.update, 3),
            ),
            row("points to trace", Value::Number(s.stage_ms.select, 3)),
            row("rays", Value::Number(s.stage_ms.trace, 3)),
            row("buckets and cells", Value::Number(s.stage_ms.store, 3)),
            row(
                "packing and compression",
                Value::Number(s.stage_ms.encode, 3),
            ),
        ],
        note: format!("{} rays a tick.", grouped(s.rays / ticks as u64)),
    };
    let stream = Table {
        title: "Stream".into(),
        columns: vec!["figure".into(), "value".into()],
        rows: vec![
            row("frames", Value::Count(s.frames as u64)),
            row("bytes at start-up", Value::Count(s.bytes_startup)),
            row(
                "bytes of all other frames",
                Value::Count(s.bytes_steady + s.bytes_keyframes),
            ),
            row("steady rate (Mbit/s)", Value::Number(s.mbps_steady, 3)),
            row(
                "rate with the first keyframe (Mbit/s)",
                Value::Number(s.mbps_with_keyframes, 3),
            ),
            row("buckets", Value::Count(points.buckets as u64)),
            row("cells", Value::Count(points.cells as u64)),
            row("points dropped", Value::Count(points.dropped_points)),
            row("cells dropped", Value::Count(points.dropped_cells)),
            row(
                "interpolation radius (m)",
                Value::Number(points.radius as f64, 4),
            ),
        ],
        note: String::new(),
    };
    let quality = Table {
        title: "Against the reference".into(),
        columns: vec!["metric".into(), "picture".into(), "AO over geometry".into()],
        rows: vec![
            vec![
                Value::Text("PSNR (dB)".into()),
                Value::Number(e.picture.psnr, 2),
                Value::Number(e.ao.psnr, 2),
            ],
            vec![
                Value::Text("rmse".into()),
                Value::Number(e.picture.rmse, 4),
                Value::Number(e.ao.rmse, 4),
            ],
            vec![
                Value::Text("SSIM".into()),
                Value::number(e.picture.ssim, 4),
                Value::number(e.ao.ssim, 4),
            ],
            vec![
                Value::Text("FLIP".into()),
                Value::Number(e.picture.flip, 4),
                Value::Number(e.ao.flip, 4),
            ],
        ],
        note: format!(
            "The reference's own noise is {:.4} rms of AO.",
            e.reference_noise
        ),
    };
    Report {
        title: "Dapple: streamed ambient occlusion".into(),
        subtitle: format!(
            "Scene {scene}, {} frames at {} Hz, {} points per square metre before thinning, seed {}; \
             pictures of the last frame at {width}x{height}",
            s.frames, s.fps, points.density, points.seed
        ),
        figures,
        sections: vec![
            Section { title: "Pictures".into(), images, ..Section::default() },
            Section {
                title: "Figures".into(),
                tables: vec![quality, stages, stream],
                ..Section::default()
            },
        ],
        notes: vec![
            format!("Drawn by {drawn_by}."),
            "The stream was decoded as it was written; the last frame's digest proves that client and \
             server hold the same state."
                .into(),
        ],
    }
}
