//! Accuracy over an option of the server: degree, samples, hysteresis.

use super::{Row, Setting};
use crate::Result;
use crate::cli::progress::Progress;
use crate::measure::chart::{Axis, Chart, Level, Point, Series};
use crate::measure::light::from_expansions;
use crate::probes::server::{Hysteresis, Server};
use crate::probes::source::{Request, Source};
use crate::world::World;
use serde::Serialize;

/// One point of a curve.
#[derive(Serialize)]
pub struct SweepPoint {
    pub curve: &'static str,
    pub value: f64,
    pub psnr: f64,
    pub update_ms: f64,
}

/// PSNR of the picture over an option of the server: unquantised probes, trilinear. The first frames are
/// averaged, so that what is left of them is not the curve's shape.
///
/// # Errors
/// `Invalid` for a volume that cannot be.
pub fn curves(world: &World, scored: &Setting, request: &Request) -> Result<Vec<SweepPoint>> {
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
        server.hysteresis = Hysteresis::Adaptive(share);
        runs.push(("hysteresis", f64::from(share), server));
    }
    let frames = request.warm_up.max(1);
    let bar = Progress::new("Curves", runs.len() as u64 * u64::from(frames));
    let mut sweep = Vec::new();
    for (curve, value, options) in runs {
        let request = Request {
            server: options,
            warm_up: 0,
            ..*request
        };
        let mut probes = Source::new(world, &request, 0)?;
        for _ in 0..frames {
            probes.update(world);
            bar.step(1);
        }
        let server: &Server = probes.server();
        let indirect = scored
            .seen
            .indirect(|surface| from_expansions(server, surface));
        let [picture, _] = scored.score(&indirect)?;
        sweep.push(SweepPoint {
            curve,
            value,
            psnr: picture.psnr,
            update_ms: probes.statistics().probe_update_ms,
        });
    }
    Ok(sweep)
}

/// The curves as charts, with what the other methods reach.
pub fn charts(sweep: &[SweepPoint], rows: &[Row]) -> Vec<Chart> {
    let chart = |curve: &str, title: &str, label: &str, log: bool| {
        let points = sweep.iter().filter(|point| point.curve == curve);
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
                    .map(|point| Point {
                        x: point.value,
                        y: point.psnr,
                        label: format!("{:.0} ms", point.update_ms),
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
    if sweep.is_empty() {
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
