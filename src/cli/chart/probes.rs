//! `dapple chart --model probes`: indirect light from probes against path tracing, beside DDGI
//! (Tables 1 to 3 of DDISH-GI), where the error comes from, what the light costs to send, the error of
//! lobes of glossy light, ambient occlusion of `points` on it all, and curves over degree, samples and hysteresis.

mod curves;
mod lobe;
mod occlusion;
mod rates;

use super::{Args, Model, markdown};
use crate::cli::job::warn_if_dark;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::measure::chart::{Axis, Chart, Point, Series};
use crate::measure::light::{
    FirstHits, WARM_UP, from_ddgi, from_itself, from_paths, from_probes, settled_ddgi,
    through_a_stream,
};
use crate::measure::lobe::{LOBES, scores};
use crate::measure::metrics::{Difference, psnr};
use crate::measure::report::{Image, Report, Section, Source, save, write};
use crate::measure::table::{Table, Value};
use crate::probes::sample::Indirect;
use crate::probes::server::InsideGeometry;
use crate::probes::source::{self, Fit, Request};
use crate::render::light::Interpolation;
use crate::render::path::state::{self, PictureId};
use crate::render::path::{Options, Part, PathPicture};
use crate::scene::Scene;
use crate::trace::path::PathTracer;
use crate::trace::path::bsdf::luminance;
use crate::world::World;
use crate::{Error, Result, files};
use glam::Vec3;
use serde::Serialize;
use std::process::ExitCode;
use std::time::Instant;

/// Samples of the reference that a pass adds to each half.
const PASS: u32 = 16;
/// What the logarithmic mean of the reference's luminance becomes before the tone curve (Reinhard et
/// al. 2002, *Photographic Tone Reproduction for Digital Images*): a picture neither dark nor washed out.
const KEY: f64 = 0.18;
/// Luminance that is added to each pixel before its logarithm, as a share of the mean.
const BLACK: f64 = 1e-3;
/// Where parts of the light are told apart: every so many pixels.
const STEP: u32 = 6;
/// Level of zstd for textures and visibility blocks.
const ZSTD_LEVEL: i32 = 19;
/// Surfaces at which lobes are compared, for each path that tells diffuse and glossy light apart.
const RECEIVERS: usize = 3;

/// A method's picture.
#[derive(Serialize)]
struct Row {
    method: String,
    picture: Difference,
    /// Of indirect light alone.
    indirect: Difference,
    /// Server milliseconds a frame, where there is a server.
    update_ms: Option<f64>,
    /// Milliseconds to look up the indirect light of all pixels.
    look_up_ms: Option<f64>,
    /// Bytes of the first frame, and of what each probe knows of distances.
    bytes: Option<[u64; 2]>,
}

/// Where the error of a picture comes from, at some pixels.
#[derive(Serialize)]
struct Parts {
    method: String,
    /// PSNR of the picture in dB; then with nothing but diffuse and nothing but glossy light wrong.
    picture: f64,
    diffuse: f64,
    glossy: f64,
    /// Mean glossy light relative to what is right.
    glossy_mean: f64,
}

/// What all methods are scored against.
struct Setting {
    seen: FirstHits,
    reference: PathPicture,
    /// Radiance of the reference, all of it and the indirect part.
    all: Vec<Vec3>,
    indirect: Vec<Vec3>,
    exposure: f32,
}

impl Setting {
    fn score(&self, indirect: &[Indirect]) -> Result<[Difference; 2]> {
        let light: Vec<Vec3> = indirect.iter().map(|r| r.diffuse + r.glossy).collect();
        let lit = self.seen.lit(indirect);
        Ok([
            self.seen.score(&lit, &self.all, self.exposure)?,
            self.seen.score(&light, &self.indirect, self.exposure)?,
        ])
    }
}

/// A few pixels where the coat's light and the base's are traced separately.
struct LightParts {
    seen: FirstHits,
    all: Vec<Vec3>,
    right: Vec<Indirect>,
    exposure: f32,
}

impl LightParts {
    fn new(scored: &Setting, paths: &PathTracer, samples: u32) -> LightParts {
        let seen = scored.seen.every(STEP);
        LightParts {
            all: scored.seen.pick(&scored.all, STEP),
            right: seen.numbered(|i, surface| from_paths(paths, surface, i, samples)),
            exposure: scored.exposure,
            seen,
        }
    }

    fn parts(&self, method: &str, indirect: &[Indirect]) -> Result<Parts> {
        let right = self.seen.lit(&self.right);
        let score = |part: &dyn Fn(&Indirect, &Indirect) -> Indirect| -> Result<f64> {
            let pairs = indirect.iter().zip(&self.right);
            let mixed: Vec<Indirect> = pairs.map(|(got, right)| part(got, right)).collect();
            let mixed = self.seen.lit(&mixed);
            Ok(self.seen.score(&mixed, &right, self.exposure)?.psnr)
        };
        let lit = self.seen.lit(indirect);
        Ok(Parts {
            method: method.into(),
            picture: self.seen.score(&lit, &self.all, self.exposure)?.psnr,
            diffuse: score(&|got, right| Indirect {
                diffuse: got.diffuse,
                glossy: right.glossy,
            })?,
            glossy: score(&|got, right| Indirect {
                diffuse: right.diffuse,
                glossy: got.glossy,
            })?,
            glossy_mean: mean(indirect) / mean(&self.right),
        })
    }
}

/// Mean luminance of the glossy light.
fn mean(indirect: &[Indirect]) -> f64 {
    let sum: f64 = indirect
        .iter()
        .map(|i| f64::from(luminance(i.glossy)))
        .sum();
    sum / indirect.len().max(1) as f64
}

/// A way to fill and to send the probes.
struct Variant {
    name: &'static str,
    file: &'static str,
    request: Request,
    /// How it is looked up: a fit is for one way, and trilinearly only where that is not the same as
    /// another variant.
    interpolations: &'static [Interpolation],
}

const BOTH: &[Interpolation] = &[Interpolation::Trilinear, Interpolation::VisibilityWeighted];

/// What is compared: probes inside geometry disabled or kept as in the paper; fewer texels of visibility; and
/// more probes for the same number of rays; and probes fitted to surfaces, for which half of the rays go.
fn variants(request: &Request) -> [Variant; 6] {
    let with = |change: &dyn Fn(&mut Request)| {
        let mut request = Request {
            warm_up: 0,
            fit: Fit::Off,
            ..*request
        };
        change(&mut request);
        request
    };
    [
        Variant {
            name: "disabled inside geometry",
            file: "disabled",
            request: with(&|r| r.server.inside = InsideGeometry::Disabled),
            interpolations: BOTH,
        },
        Variant {
            name: "kept inside geometry",
            file: "kept",
            request: with(&|r| r.server.inside = InsideGeometry::Kept),
            interpolations: BOTH,
        },
        Variant {
            name: "kept, 8x8 texels",
            file: "kept_8",
            request: with(&|r| {
                r.server.inside = InsideGeometry::Kept;
                r.server.visibility = 8;
            }),
            interpolations: &[Interpolation::VisibilityWeighted],
        },
        Variant {
            name: "kept, 8 times the probes, same rays",
            file: "denser",
            request: with(&|r| {
                r.server.inside = InsideGeometry::Kept;
                r.dims = r.dims.map(|d| d.saturating_mul(2));
                r.server.samples = r.server.samples.div_ceil(8);
            }),
            interpolations: BOTH,
        },
        Variant {
            name: "kept, fitted",
            file: "fitted",
            request: with(&|r| {
                r.server.inside = InsideGeometry::Kept;
                r.server.visibility = 0;
                r.fit = Fit::On;
            }),
            interpolations: &[Interpolation::Trilinear],
        },
        Variant {
            name: "kept, fitted",
            file: "fitted",
            request: with(&|r| {
                r.server.inside = InsideGeometry::Kept;
                r.fit = Fit::On;
            }),
            interpolations: &[Interpolation::VisibilityWeighted],
        },
    ]
}

fn name_of(interpolation: Interpolation) -> &'static str {
    match interpolation {
        Interpolation::Trilinear => "trilinear",
        Interpolation::VisibilityWeighted => "visibility-weighted",
    }
}

/// Runs the command.
///
/// # Errors
/// As [`super::run`].
pub fn run(args: &Args) -> Result<ExitCode> {
    let scene = args.scene.open(true)?;
    files::create_folder(&args.output)?;
    let view = args.scene.view.view(&scene)?;
    let time = args.scene.view.seconds(args.encode.fps);
    let world = World::new(&scene, time);
    let camera = view.at(world.pose());
    let (width, height) = args.scene.view.size;
    let request = args.encode.probes_request(&scene);
    warn_if_dark(&scene, &request.sky);
    let paths = world.paths(request.sky);

    let options = Options::default();
    let id = PictureId::new(&scene, time, &camera, &options, &request.sky, true);
    let file = args.output.join("reference.state");
    let mut reference = state::load(&file, width, height, &id)?;
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
        state::save(&file, &reference, &id)?;
    }
    drop(bar);
    let all = reference.light(Part::All);
    let seen = FirstHits::new(&paths, &camera, width, height);
    // A background would set the exposure of what stands before it.
    let geometry = all.iter().zip(seen.geometry());
    let geometry: Vec<Vec3> = geometry
        .filter_map(|(radiance, is_geometry)| is_geometry.then_some(*radiance))
        .collect();
    let scored = Setting {
        seen,
        exposure: args.exposure.unwrap_or_else(|| exposure(&geometry)),
        indirect: reference.light(Part::Indirect),
        all,
        reference,
    };
    let light_parts = LightParts::new(&scored, &paths, args.parts);

    let none = scored.seen.indirect(|_| Indirect::default());
    let mut rows = vec![row("direct light alone", &scored, &none)?];
    let itself = |i: u32, surface: &_| from_itself(&paths, surface, i, args.parts);
    let at_surfaces = "degree 2 at the surface itself";
    let mut lobes = Vec::new();
    let receivers = RECEIVERS * args.parts as usize;
    let mut parts = vec![light_parts.parts(at_surfaces, &light_parts.seen.numbered(itself))?];

    let frames = request.warm_up.max(1);
    let variants = variants(&request);
    let ddgi_frames = 2 * u64::from(WARM_UP + frames);
    let all_frames = ddgi_frames + variants.len() as u64 * u64::from(frames);
    let mut disabled = Vec::new();
    let mut lights: Vec<(String, Vec<Indirect>)> = Vec::new();
    let bar = Progress::new("Probes and DDGI", all_frames);
    for variant in &variants {
        let mut probes = source::Source::new(&world, &variant.request, 0)?;
        for _ in 1..frames {
            probes.trace(&world);
            bar.step(1);
        }
        probes.update(&world);
        bar.step(1);
        let place = *probes.server().volume();
        let sent = through_a_stream(&mut probes, variant.request.packing)?;
        let field = sent.volume.field();
        let server = probes.server();
        let all = 0..place.lattice.count();
        if variant.request.server.inside == InsideGeometry::Disabled {
            disabled = all.clone().map(|p| !server.is_present(p)).collect();
            let present: Vec<usize> = all.filter(|p| server.is_present(*p)).collect();
            lobes = scores(&paths, &field, &place, &present, receivers, &LOBES);
        }
        for &interpolation in variant.interpolations {
            let how = name_of(interpolation);
            let look = |surface: &_| from_probes(&field, &place, interpolation, surface);
            let clock = Instant::now();
            let indirect = scored.seen.indirect(look);
            let look_up_ms = clock.elapsed().as_secs_f64() * 1e3;
            let method = format!("probes, {how}, {}", variant.name);
            let visibility = match interpolation {
                Interpolation::Trilinear => 0,
                Interpolation::VisibilityWeighted => sent.bytes_visibility,
            };
            rows.push(Row {
                update_ms: Some(probes.statistics().probe_update_ms),
                look_up_ms: Some(look_up_ms),
                bytes: Some([sent.bytes_first, visibility]),
                ..row(&method, &scored, &indirect)?
            });
            parts.push(light_parts.parts(&method, &light_parts.seen.indirect(look))?);
            picture(args, &scored, &indirect, &format!("{}_{how}", variant.file))?;
            if interpolation == Interpolation::VisibilityWeighted {
                lights.push((method, indirect));
            }
        }
    }
    let place = request.place(&world)?;
    for (name, file, disabled) in [
        ("DDGI, kept inside geometry", "ddgi", None),
        (
            "DDGI, disabled inside geometry",
            "ddgi_disabled",
            Some(disabled),
        ),
    ] {
        let step = || bar.step(1);
        let (ddgi, ddgi_ms) =
            settled_ddgi(&paths, &place, &request.server, disabled, frames, &step);
        let look = |surface: &_| from_ddgi(&ddgi, surface);
        let clock = Instant::now();
        let indirect = scored.seen.indirect(look);
        let look_up_ms = clock.elapsed().as_secs_f64() * 1e3;
        let [light, distances] = ddgi.textures();
        rows.push(Row {
            update_ms: Some(ddgi_ms),
            look_up_ms: Some(look_up_ms),
            bytes: Some([compressed(&light)?, compressed(&distances)?]),
            ..row(name, &scored, &indirect)?
        });
        parts.push(light_parts.parts(name, &light_parts.seen.indirect(look))?);
        picture(args, &scored, &indirect, file)?;
        lights.push((name.into(), indirect));
    }
    drop(bar);
    picture(args, &scored, &none, "direct")?;
    let developed = scored.seen.picture(&scored.all, scored.exposure);
    developed.write_png(&args.output.join("reference.png"))?;

    let mut tables = vec![
        accuracy(&scene, &rows, &scored, args),
        light_parts_table(&scene, &parts, args.parts),
        lobe::table(&scene.name, &lobes, receivers),
    ];
    let mut names = vec!["table", "parts", "lobe"];
    if args.encode.model.contains(&Model::Points) {
        let ao = occlusion::ao(args, &scene)?;
        tables.push(occlusion::table(&scene.name, &scored, &lights, &ao)?);
        names.push("occlusion");
    }
    if let Some(frames) = args.encode.frames {
        names.push("rates");
        let fps = args.encode.fps.hz();
        tables.push(rates::rates(&scene, &request, time, fps, frames)?);
    }
    let sweep = match args.curves {
        true => curves::curves(&world, &scored, &request)?,
        false => Vec::new(),
    };
    let mut charts = vec![by_size(&rows), by_time(&rows), lobe::chart(&lobes)];
    charts.extend(curves::charts(&sweep, &rows));
    let chart_names = ["size", "time", "lobes", "degree", "samples", "hysteresis"];
    for (chart, name) in charts.iter().zip(chart_names) {
        save(&args.output.join(format!("{name}.svg")), &chart.to_svg())?;
        save(&args.output.join(format!("{name}.csv")), &chart.to_csv())?;
    }
    for (table, name) in tables.iter().zip(&names) {
        save(&args.output.join(format!("{name}.csv")), &table.to_csv())?;
        save(&args.output.join(format!("{name}.md")), &markdown(table))?;
        output::print(&format!("{}\n", markdown(table)))?;
    }
    let page = Report {
        title: format!("{}: indirect light from probes", scene.name),
        subtitle: format!(
            "{width}x{height}, {} paths a pixel in the reference, {frames} frames of {} samples",
            scored.reference.samples(),
            request.server.samples
        ),
        sections: vec![
            Section {
                images: images(&rows, &variants),
                ..Section::default()
            },
            Section {
                charts,
                tables,
                ..Section::default()
            },
        ],
        notes: vec![
            "PSNR, SSIM and FLIP are of the developed picture against the path-traced one; indirect PSNR is of \
             indirect light alone."
                .into(),
            "Probe update is the server's time for a frame; light is what a client gets in it, distances come once."
                .into(),
        ],
        ..Report::default()
    };
    write(&page, &(&rows, &parts, &sweep), &args.output)?;
    Ok(ExitCode::SUCCESS)
}

/// The bytes of `data` under zstd, as strong as is not called ultra: what a file or a socket takes.
fn compressed(data: &[u8]) -> Result<u64> {
    let packed = zstd::bulk::compress(data, ZSTD_LEVEL);
    let packed = packed.map_err(|e| Error::Invalid(format!("zstd: {e}")))?;
    Ok(packed.len() as u64)
}

/// The factor on radiance that makes a picture of it.
fn exposure(radiance: &[Vec3]) -> f32 {
    let luminances = || radiance.iter().map(|c| f64::from(luminance(*c)));
    let count = radiance.len().max(1) as f64;
    let black = BLACK * luminances().sum::<f64>() / count;
    if black <= 0.0 {
        return 1.0;
    }
    let logarithms: f64 = luminances().map(|l| (l.max(0.0) + black).ln()).sum();
    (KEY / (logarithms / count).exp()) as f32
}

fn row(method: &str, scored: &Setting, indirect: &[Indirect]) -> Result<Row> {
    let [picture, indirect] = scored.score(indirect)?;
    Ok(Row {
        method: method.into(),
        picture,
        indirect,
        update_ms: None,
        look_up_ms: None,
        bytes: None,
    })
}

fn picture(args: &Args, scored: &Setting, indirect: &[Indirect], name: &str) -> Result<()> {
    let light = scored.seen.lit(indirect);
    let picture = scored.seen.picture(&light, scored.exposure);
    picture.write_png(&args.output.join(format!("{name}.png")))
}

fn images(rows: &[Row], variants: &[Variant]) -> Vec<Image> {
    let image = |caption: &str, file: &str| {
        let row = rows.iter().find(|row| row.method == caption);
        Image {
            caption: caption.into(),
            detail: row.map_or(String::new(), |row| format!("{:.2} dB", row.picture.psnr)),
            source: Source::File(format!("{file}.png")),
        }
    };
    let mut images = vec![
        image("path-traced", "reference"),
        image("direct light alone", "direct"),
        image("DDGI, kept inside geometry", "ddgi"),
        image("DDGI, disabled inside geometry", "ddgi_disabled"),
    ];
    for variant in variants {
        for &interpolation in variant.interpolations {
            let how = name_of(interpolation);
            let method = format!("probes, {how}, {}", variant.name);
            images.push(image(&method, &format!("{}_{how}", variant.file)));
        }
    }
    images
}

fn accuracy(scene: &Scene, rows: &[Row], scored: &Setting, args: &Args) -> Table {
    let columns = [
        "method",
        "PSNR (dB)",
        "SSIM",
        "FLIP",
        "indirect PSNR (dB)",
        "probe update (ms)",
        "look-up (ms)",
        "light (kB)",
        "distances (kB)",
    ];
    let kilobytes = |bytes: Option<u64>| Value::number(bytes.map(|b| b as f64 / 1e3), 1);
    let line = |row: &Row| {
        vec![
            Value::Text(row.method.clone()),
            Value::Number(row.picture.psnr, 2),
            Value::number(row.picture.ssim, 4),
            Value::Number(row.picture.flip, 4),
            Value::Number(row.indirect.psnr, 2),
            Value::number(row.update_ms, 0),
            Value::number(row.look_up_ms, 0),
            kilobytes(row.bytes.map(|b| b[0])),
            kilobytes(row.bytes.map(|b| b[1])),
        ]
    };
    let noise = psnr(scored.reference.noise(Part::All, scored.exposure).powi(2));
    let best = rows.iter().map(|row| row.picture.psnr);
    let best = best.fold(f64::NEG_INFINITY, f64::max);
    let [x, y, z] = args.encode.probes_request(scene).dims;
    Table {
        title: format!("{}, {x}x{y}x{z} probes", scene.name),
        columns: columns.map(String::from).to_vec(),
        rows: rows.iter().map(line).collect(),
        note: format!(
            "Exposure {:.3}. The reference has {} paths a pixel; its own noise lies {noise:.1} dB below \
             white, {:.1} dB below the error of the best method. All methods share surfaces and direct \
             light with ray-traced shadows. Look-ups of {}x{} pixels on the CPU, {} threads. Bytes of \
             a whole frame of light, and of the distances that come once.",
            scored.exposure,
            scored.reference.samples(),
            noise - best,
            scored.seen.width,
            scored.seen.height,
            rayon::current_num_threads(),
        ),
    }
}

fn light_parts_table(scene: &Scene, parts: &[Parts], samples: u32) -> Table {
    let columns = [
        "method",
        "picture (dB)",
        "only diffuse wrong (dB)",
        "only glossy wrong (dB)",
        "glossy, mean over right",
    ];
    let line = |p: &Parts| {
        vec![
            Value::Text(p.method.clone()),
            Value::Number(p.picture, 2),
            Value::Number(p.diffuse, 2),
            Value::Number(p.glossy, 2),
            Value::Number(p.glossy_mean, 3),
        ]
    };
    Table {
        title: format!("{}: where the error comes from", scene.name),
        columns: columns.map(String::from).to_vec(),
        rows: parts.iter().map(line).collect(),
        note: format!(
            "PSNR at every {STEP}th pixel of every {STEP}th row. Diffuse and glossy light are indirect; \
             what is right of each comes from {samples} paths a pixel. The first row has no \
             interpolation: an expansion of {samples} paths stands at each pixel's surface."
        ),
    }
}

/// Accuracy against the bytes of a frame.
fn by_size(rows: &[Row]) -> Chart {
    against(rows, "frame's light (kB)", "Accuracy against size", |row| {
        row.bytes.map(|b| b[0] as f64 / 1e3)
    })
}

/// Accuracy against the client's time.
fn by_time(rows: &[Row]) -> Chart {
    against(rows, "look-up (ms)", "Accuracy against time", |row| {
        row.look_up_ms
    })
}

fn against(rows: &[Row], label: &str, title: &str, x: impl Fn(&Row) -> Option<f64>) -> Chart {
    let series = |row: &Row| {
        let point = Point {
            x: x(row)?,
            y: row.picture.psnr,
            label: String::new(),
        };
        Some(Series {
            name: row.method.clone(),
            points: vec![point],
            line: false,
        })
    };
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
        series: rows.iter().filter_map(series).collect(),
        levels: Vec::new(),
    }
}
