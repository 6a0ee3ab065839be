//! `dapple chart --model probes`: indirect light from probes against path tracing, beside DDGI
//! (Tables 1 to 3 of DDISH-GI), and curves over degree, samples and hysteresis.

use super::{Args, markdown};
use crate::cli::args::ProbesArgs;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::codec::{Compression, Decoder, Encoder, EncoderConfig, Event, GroupStart, Limits};
use crate::measure::chart::{Axis, Chart, Level, Point, Series};
use crate::measure::ddgi::{self, Ddgi};
use crate::measure::light::{Seen, ddgi_end, from_ddgi, from_expansions, from_probes};
use crate::measure::metrics::{Difference, psnr};
use crate::measure::report::{Report, Section, save, write};
use crate::measure::table::{Table, Value};
use crate::probes::client::ProbesVolume;
use crate::probes::content::{Content, Packing, Request};
use crate::probes::sample::Indirect;
use crate::probes::server::{Hysteresis, Server};
use crate::probes::volume::Volume;
use crate::render::light::Interpolation;
use crate::render::path::state::{self, Subject};
use crate::render::path::{Options, Part, PathPicture};
use crate::scene::Scene;
use crate::trace::Tracer;
use crate::trace::path::PathTracer;
use crate::{Error, Result};
use glam::{UVec3, Vec3};
use serde::Serialize;
use std::process::ExitCode;
use std::time::Instant;

/// Samples of the reference that a pass adds to each half.
const PASS: u32 = 16;
/// Frames that the baseline runs before the frames that are counted.
const WARM_UP: u32 = 32;
/// Factor on radiance before the tone curve.
const EXPOSURE: f32 = 1.0;

/// A method's picture.
#[derive(Serialize)]
struct Row {
    method: String,
    picture: Difference,
    /// Of indirect light alone.
    indirect: Difference,
    /// Server milliseconds a frame, where there is a server.
    update_ms: Option<f64>,
    bytes_per_probe: Option<f64>,
}

/// One point of a curve.
#[derive(Serialize)]
struct Knob {
    curve: &'static str,
    value: f64,
    psnr: f64,
    update_ms: f64,
}

/// What all methods are scored against.
struct Setting {
    seen: Seen,
    reference: PathPicture,
}

impl Setting {
    fn score(&self, indirect: &[Indirect]) -> Result<[Difference; 2]> {
        let light: Vec<Vec3> = indirect.iter().map(|r| r.diffuse + r.glossy).collect();
        Ok([
            self.seen.score(
                &self.seen.lit(indirect),
                &self.reference.light(Part::All),
                EXPOSURE,
            )?,
            self.seen
                .score(&light, &self.reference.light(Part::Indirect), EXPOSURE)?,
        ])
    }
}

/// Runs the command.
///
/// # Errors
/// As [`super::run`].
pub fn run(args: &Args) -> Result<ExitCode> {
    let scene = args.scene.open()?;
    std::fs::create_dir_all(&args.output).map_err(|source| Error::Io {
        path: args.output.clone(),
        source,
    })?;
    let view = args.scene.view.view(&scene)?;
    let time = args.scene.view.seconds(args.encode.fps);
    let pose = scene.pose(time);
    let camera = view.at(&pose);
    let (width, height) = args.scene.view.size;
    let request = args.encode.probes.request(args.encode.seed);
    let tracer = Tracer::new(&scene, &pose);
    let paths = PathTracer::new(&scene, &pose, &tracer, request.sky);

    let options = Options::default();
    let subject = Subject::new(&scene, time, &camera, &options, &request.sky, true);
    let file = args.output.join("reference.state");
    let mut reference = state::load(&file, width, height, &subject)?;
    let wanted = args.reference.div_ceil(2);
    let bar = Progress::new(
        "Tracing the reference",
        u64::from(wanted) * u64::from(height),
    );
    bar.at(u64::from(reference.samples() / 2) * u64::from(height));
    while reference.samples() / 2 < wanted {
        let samples = PASS.min(wanted - reference.samples() / 2);
        reference.add(&paths, &camera, &options, samples, &|rows| {
            bar.step(rows * u64::from(samples));
        });
        state::save(&file, &reference, &subject)?;
    }
    drop(bar);
    let noise = reference.noise(Part::All, EXPOSURE);
    let scored = Setting {
        seen: Seen::new(&paths, &camera, width, height),
        reference,
    };

    let mut rows = Vec::new();
    let none = scored.seen.indirect(|_| Indirect::default());
    rows.push(row("direct light alone", &scored, &none, None, None)?);

    let frames = request.settle.max(1);
    let bar = Progress::new("Probes and DDGI", 2 * u64::from(frames));
    let mut content = Content::new(
        &scene,
        &Request {
            settle: 0,
            ..request
        },
        time,
        0,
    )?;
    for _ in 0..frames {
        content.tick(time);
        bar.step(1);
    }
    let place = *content.server().volume();
    let (ddgi, ddgi_ms) = settle_ddgi(&paths, &place, &request, &bar);
    drop(bar);
    let indirect = scored.seen.indirect(|surface| from_ddgi(&ddgi, surface));
    let bytes = Ddgi::BYTES as f64;
    rows.push(row("DDGI", &scored, &indirect, Some(ddgi_ms), Some(bytes))?);
    save_picture(args, &scored, &indirect, "ddgi")?;

    let update = Some(content.report().probe_update_ms);
    let count = place.lattice.count() as f64;
    for (name, packing) in [("raw", Packing::Raw), ("packed", request.packing)] {
        let (decoded, bytes) = through_a_stream(&mut content, packing)?;
        let field = decoded.field();
        for interpolation in [Interpolation::Trilinear, Interpolation::Resistant] {
            let indirect = scored
                .seen
                .indirect(|surface| from_probes(&field, &place, interpolation, surface));
            let how = match interpolation {
                Interpolation::Trilinear => "trilinear",
                Interpolation::Resistant => "resistant",
            };
            let method = format!("probes, {name}, {how}");
            let bytes = Some(bytes as f64 / count);
            rows.push(row(&method, &scored, &indirect, update, bytes)?);
            save_picture(args, &scored, &indirect, &format!("probes_{name}_{how}"))?;
        }
    }
    let all = scored.reference.light(Part::All);
    let picture = scored.seen.picture(&all, EXPOSURE);
    picture.write_png(&args.output.join("reference.png"))?;
    let picture = scored.seen.picture(scored.seen.direct(), EXPOSURE);
    picture.write_png(&args.output.join("direct.png"))?;
    let table = table(&scene, &rows, noise, &args.encode.probes, args.reference);
    save(&args.output.join("table.csv"), &table.to_csv())?;
    save(&args.output.join("table.md"), &markdown(&table))?;

    let knobs = match args.curves {
        true => curves(&scene, &scored, &request, time)?,
        false => Vec::new(),
    };
    let charts = charts(&knobs, &rows);
    for (chart, name) in charts.iter().zip(["degree", "samples", "hysteresis"]) {
        save(&args.output.join(format!("{name}.svg")), &chart.to_svg())?;
        save(&args.output.join(format!("{name}.csv")), &chart.to_csv())?;
    }
    let page = Report {
        title: format!("{}: indirect light from probes", scene.name),
        subtitle: format!(
            "{width}x{height}, {} paths a pixel in the reference, {frames} frames of {} samples",
            scored.reference.samples(),
            request.server.samples
        ),
        sections: vec![Section {
            charts,
            tables: vec![table.clone()],
            ..Section::default()
        }],
        ..Report::default()
    };
    write(&page, &(&rows, &knobs), &args.output)?;
    output::print(&markdown(&table))?;
    Ok(ExitCode::SUCCESS)
}

fn row(
    method: &str,
    scored: &Setting,
    indirect: &[Indirect],
    update_ms: Option<f64>,
    bytes_per_probe: Option<f64>,
) -> Result<Row> {
    let [picture, indirect] = scored.score(indirect)?;
    Ok(Row {
        method: method.into(),
        picture,
        indirect,
        update_ms,
        bytes_per_probe,
    })
}

fn save_picture(args: &Args, scored: &Setting, indirect: &[Indirect], name: &str) -> Result<()> {
    let light = scored.seen.lit(indirect);
    let picture = scored.seen.picture(&light, EXPOSURE);
    picture.write_png(&args.output.join(format!("{name}.png")))
}

/// The baseline on the same probes, with as many rays, frames and the same hysteresis. Returns the
/// mean milliseconds of a frame, too.
fn settle_ddgi(
    paths: &PathTracer,
    place: &Volume,
    request: &Request,
    bar: &Progress,
) -> (Ddgi, f64) {
    let options = ddgi::Options {
        origin: place.origin,
        spacing: place.lattice.spacing,
        dims: UVec3::from(place.lattice.dims.map(u32::from)),
        rays: request.server.samples,
        hysteresis: request.server.hysteresis.share(),
        cull_back_faces: true,
        seed: request.server.seed,
    };
    let arrive = |origin, direction| ddgi_end(paths, origin, direction, true);
    // Each bounce needs as many frames as the one before. Forgetting fast at first, all of them are
    // there before the frames that count.
    let mut ddgi = Ddgi::new(ddgi::Options {
        hysteresis: 0.6,
        ..options
    });
    for _ in 0..WARM_UP {
        ddgi.update(arrive);
    }
    ddgi.set_hysteresis(options.hysteresis);
    let frames = request.settle.max(1);
    let clock = Instant::now();
    for _ in 0..frames {
        ddgi.update(arrive);
        bar.step(1);
    }
    let ms = clock.elapsed().as_secs_f64() * 1e3 / f64::from(frames);
    (ddgi, ms)
}

/// What a client makes of the server's state: a keyframe, a delta with the visibility block, and
/// the decoder. Returns the bytes of the keyframe's record, too.
fn through_a_stream(content: &mut Content, packing: Packing) -> Result<(ProbesVolume, u64)> {
    content.pack_as(packing);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
    encoder.group(&mut bytes, GroupStart::Keyframes)?;
    encoder.tracks(&mut bytes, &[content.track()])?;
    let compression = Compression::None;
    let before = bytes.len();
    content.write_keyframe(&mut encoder, compression, &mut bytes)?;
    let size = (bytes.len() - before) as u64;
    encoder.commit(&mut bytes, 0, None)?;
    content.write_delta(&mut encoder, compression, &mut bytes)?;
    encoder.commit(&mut bytes, 1, None)?;
    encoder.end(&mut bytes)?;
    let mut decoder = Decoder::new(Limits::default());
    let mut rest = &bytes[..];
    loop {
        let (used, event) = decoder.push(rest)?;
        rest = &rest[used..];
        if matches!(event, Event::End | Event::NeedInput) {
            break;
        }
    }
    let volume = decoder.tracks().first();
    let volume = volume.and_then(|live| ProbesVolume::new(&decoder, live));
    let volume = volume.ok_or_else(|| Error::Invalid("the stream has no volume".into()))?;
    Ok((volume, size))
}

/// PSNR of the picture over what a server can turn: unquantised probes, trilinear.
fn curves(scene: &Scene, scored: &Setting, request: &Request, time: f64) -> Result<Vec<Knob>> {
    let mut runs = Vec::new();
    for degree in 0..=4 {
        let mut server = request.server;
        server.degree = degree;
        runs.push(("degree", degree as f64, server));
    }
    for samples in [16, 64, 256, 1024] {
        let mut server = request.server;
        server.samples = samples;
        runs.push(("samples", f64::from(samples), server));
    }
    for share in [0.8, 0.9, 0.95, 0.99, 0.998] {
        let mut server = request.server;
        server.hysteresis = Hysteresis::Fixed(share);
        runs.push(("hysteresis", f64::from(share), server));
    }
    let frames = request.settle.max(1);
    let bar = Progress::new("Curves", runs.len() as u64 * u64::from(frames));
    let mut knobs = Vec::new();
    for (curve, value, options) in runs {
        let request = Request {
            server: options,
            settle: 0,
            ..*request
        };
        let mut content = Content::new(scene, &request, time, 0)?;
        for _ in 0..frames {
            content.tick(time);
            bar.step(1);
        }
        let server: &Server = content.server();
        let indirect = scored
            .seen
            .indirect(|surface| from_expansions(server, surface));
        let [picture, _] = scored.score(&indirect)?;
        knobs.push(Knob {
            curve,
            value,
            psnr: picture.psnr,
            update_ms: content.report().probe_update_ms,
        });
    }
    Ok(knobs)
}

fn table(scene: &Scene, rows: &[Row], noise: f64, probes: &ProbesArgs, reference: u32) -> Table {
    let columns = [
        "method",
        "PSNR (dB)",
        "SSIM",
        "FLIP",
        "indirect PSNR (dB)",
        "indirect SSIM",
        "probe update (ms)",
        "first frame (B/probe)",
    ];
    let rows = rows.iter().map(|row| {
        vec![
            Value::Text(row.method.clone()),
            Value::Number(row.picture.psnr, 2),
            Value::number(row.picture.ssim, 4),
            Value::Number(row.picture.flip, 4),
            Value::Number(row.indirect.psnr, 2),
            Value::number(row.indirect.ssim, 4),
            Value::number(row.update_ms, 1),
            Value::number(row.bytes_per_probe, 1),
        ]
    });
    let [x, y, z] = probes.probes;
    Table {
        title: format!("{}, {x}x{y}x{z} probes", scene.name),
        columns: columns.map(String::from).to_vec(),
        rows: rows.collect(),
        note: format!(
            "The reference has {reference} paths a pixel; its own noise lies {:.1} dB below white. All \
             methods share direct light with ray-traced shadows.",
            psnr(noise * noise)
        ),
    }
}

fn charts(knobs: &[Knob], rows: &[Row]) -> Vec<Chart> {
    let chart = |curve: &str, title: &str, label: &str, log: bool| {
        let points = knobs.iter().filter(|knob| knob.curve == curve);
        Chart {
            title: title.into(),
            x: Axis {
                label: label.into(),
                log,
            },
            y: Axis {
                label: "PSNR (dB)".into(),
                log: false,
            },
            series: vec![Series {
                name: "probes, trilinear".into(),
                points: points
                    .map(|knob| Point {
                        x: knob.value,
                        y: knob.psnr,
                        label: format!("{:.0} ms", knob.update_ms),
                    })
                    .collect(),
                line: true,
            }],
            levels: rows
                .iter()
                .filter(|row| !row.method.starts_with("probes"))
                .map(|row| Level {
                    name: row.method.clone(),
                    y: row.picture.psnr,
                })
                .collect(),
        }
    };
    if knobs.is_empty() {
        return Vec::new();
    }
    vec![
        chart("degree", "Accuracy against degree", "highest degree", false),
        chart(
            "samples",
            "Accuracy against samples",
            "paths a probe and frame",
            true,
        ),
        chart(
            "hysteresis",
            "Accuracy against hysteresis",
            "share kept",
            false,
        ),
    ]
}
