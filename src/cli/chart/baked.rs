//! `dapple chart --baked`: baked obscurance by `vertices`, `instances` and `regions` against obscurance traced at
//! points of the surfaces and per pixel.

mod methods;
mod setting;

use super::{Args, markdown};
use crate::bake::Settings;
use crate::cli::output;
use crate::measure::chart::{Axis, Chart, Level, Point, Series, add_point};
use crate::measure::metrics::psnr_text;
use crate::measure::report::{Image, Report, Section, Source, save, write};
use crate::measure::table::{Table, Value};
use crate::obscurance::Kernel;
use crate::render::composite;
use crate::vertices::server as vertices;
use crate::world::World;
use crate::{Result, files};
use methods::{Family, Results, Row};
use setting::{PIXEL_RAYS, Setting};
use std::process::ExitCode;

/// Rays of a sample if not given: a quarter of what `bake` takes, for a result in a minute or two.
const RAYS: u32 = 64;

/// Runs the command.
///
/// # Errors
/// As [`super::run`].
pub fn run(args: &Args) -> Result<ExitCode> {
    let scene = args.scene.open(true)?;
    files::create_folder(&args.output)?;
    let view = args.scene.view.view(&scene)?;
    let world = World::new(&scene, args.scene.view.seconds(args.encode.fps));
    let settings = settings(args);
    let camera = view.at(world.pose());
    let mut setting = Setting::new(&scene, &world, &settings, &camera, args)?;
    let Results {
        rows,
        mut notes,
        beside_regions,
    } = methods::run(&mut setting, &world, &settings)?;

    let table = table(&scene.name, &rows, &setting, args);
    let charts = charts(&rows, beside_regions);
    save(&args.output.join("table.csv"), &table.to_csv())?;
    save(&args.output.join("table.md"), &markdown(&table))?;
    for (chart, name) in &charts {
        save(&args.output.join(format!("{name}.svg")), &chart.to_svg())?;
        save(&args.output.join(format!("{name}.csv")), &chart.to_csv())?;
    }
    let images = images(&rows, &setting, args)?;
    notes.push(format!("Pictures drawn by {}.", setting.drawn_by()));
    let (width, height) = args.scene.view.size;
    let page = Report {
        title: format!("{}: baked obscurance", scene.name),
        subtitle: format!(
            "{}, {width}x{height}; {} rays a sample",
            args.scene.view.describe(&scene, &view),
            settings.vertices.rays
        ),
        sections: vec![
            Section {
                images,
                ..Section::default()
            },
            Section {
                charts: charts.into_iter().map(|(chart, _)| chart).collect(),
                tables: vec![table.clone()],
                ..Section::default()
            },
        ],
        notes,
        ..Report::default()
    };
    write(&page, &rows, &args.output)?;
    let page = args.output.join("index.html");
    output::print(&format!("{}\n{}\n", markdown(&table), page.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// What is baked: obscurance by two half-distances, or with `--distance` plain ambient occlusion.
fn settings(args: &Args) -> Settings {
    let defaults = vertices::Settings::default();
    let kernels = match args.encode.distance {
        Some(distance) => vec![Kernel::CutOff { distance }],
        None => defaults.kernels.clone(),
    };
    Settings {
        vertices: vertices::Settings {
            kernels,
            rays: args.encode.rays.unwrap_or(RAYS),
            ..defaults
        },
        ..Settings::default()
    }
}

/// Accuracy against bytes, a chart a family, and against the time of a look-up.
fn charts(rows: &[Row], beside_regions: Option<f64>) -> Vec<(Chart, &'static str)> {
    let sized = |family: Family, title: &str| {
        let x = |row: &Row| Some(row.measured.bytes as f64 / 1e3);
        let takes = |row: &Row| row.family == family;
        chart(rows, title, ("stream (kB)", true), takes, x)
    };
    let alpha = |row: &Row| row.setting.parse().ok();
    let time = |row: &Row| match row.family {
        // The same look-ups once more.
        Family::Alpha => None,
        _ => row.measured.look_up_ms,
    };
    let by_alpha = chart(
        rows,
        "Values at vertices, by weight of smoothness",
        ("alpha", true),
        |row| row.family == Family::Alpha,
        alpha,
    );
    let by_time = ("look-up (ms)", false);
    let by_time = chart(rows, "Accuracy against time", by_time, |_| true, time);
    let mut regions = sized(Family::Regions, "Regions, by derivatives");
    regions.levels.extend(beside_regions.map(|y| Level {
        name: "values at vertices, 8 bits, at the same points".into(),
        y,
    }));
    let by_samples = "Values at vertices, by samples a face";
    let mut charts = vec![
        (sized(Family::Vertices, by_samples), "vertices"),
        (by_alpha, "alpha"),
        (sized(Family::Rungs, "Instances, by rung"), "rungs"),
        (regions, "regions"),
        (by_time, "time"),
    ];
    charts.retain(|(chart, _)| !chart.series.is_empty());
    charts
}

/// PSNR at the points over `x`, a curve a method.
fn chart(
    rows: &[Row],
    title: &str,
    (label, log): (&str, bool),
    takes: impl Fn(&Row) -> bool,
    x: impl Fn(&Row) -> Option<f64>,
) -> Chart {
    let mut series: Vec<Series> = Vec::new();
    for row in rows.iter().filter(|row| takes(row)) {
        let Some(x) = x(row) else { continue };
        let point = Point {
            x,
            y: row.measured.psnr,
            label: row.setting.clone(),
        };
        add_point(&mut series, row.method, point);
    }
    Chart {
        title: title.into(),
        x: Axis {
            label: label.into(),
            log,
        },
        y: Axis {
            label: "PSNR at the points (dB)".into(),
            log: false,
        },
        series,
        levels: Vec::new(),
    }
}

fn table(scene: &str, rows: &[Row], setting: &Setting, args: &Args) -> Table {
    let columns = [
        "method",
        "setting",
        "stream (bytes)",
        "RMSE at points",
        "at points (dB)",
        "AO (dB)",
        "picture (dB)",
        "SSIM",
        "FLIP",
        "look-up (ms)",
    ];
    let line = |row: &Row| {
        let m = &row.measured;
        vec![
            Value::Text(row.method.into()),
            Value::Text(row.setting.clone()),
            match row.family {
                Family::Open => Value::Missing,
                _ => Value::Count(m.bytes as u64),
            },
            Value::Number(m.rmse, 4),
            Value::Number(m.psnr, 2),
            Value::Number(m.ao.psnr, 2),
            Value::Number(m.picture.psnr, 2),
            Value::number(m.picture.ssim, 4),
            Value::Number(m.picture.flip, 4),
            Value::number(m.look_up_ms, 2),
        ]
    };
    let (width, height) = args.scene.view.size;
    Table {
        title: scene.into(),
        columns: columns.map(String::from).to_vec(),
        rows: rows.iter().map(line).collect(),
        note: format!(
            "Errors at {} random points of the surfaces, evenly by area, against {} rays each; points inside \
             geometry are left out. AO and picture against {PIXEL_RAYS} rays a pixel, whose own noise is {:.4}. \
             Look-ups of {width}x{height} pixels on the CPU, {} threads. The setting of values at vertices is the \
             most samples a face; `at vertices` has the same number of rays in all. Regions \
             are measured at the points that are in one or next to one.",
            setting.points(),
            args.reference,
            setting.picture.noise,
            rayon::current_num_threads(),
        ),
    }
}

/// Pictures of obscurance alone: the reference and some methods.
fn images(rows: &[Row], setting: &Setting, args: &Args) -> Result<Vec<Image>> {
    let image = |file: &str, caption: String, detail: String, ao: &[f32]| {
        let picture = composite::ao_picture(&setting.picture.frame.gbuffer, ao);
        picture.write_png(&args.output.join(format!("{file}.png")))?;
        Ok(Image {
            caption,
            detail,
            source: Source::File(format!("{file}.png")),
        })
    };
    let reference = &setting.picture.ao;
    let reference = image("reference", "ray-traced".into(), String::new(), reference);
    let shown = rows.iter().filter_map(|row| {
        let (file, ao) = row.picture.as_ref()?;
        let caption = format!("{}, {}", row.method, row.setting);
        let detail = format!("{} dB", psnr_text(row.measured.ao.psnr));
        Some(image(file, caption, detail, ao))
    });
    std::iter::once(reference).chain(shown).collect()
}
