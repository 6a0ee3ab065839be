//! The error of glossy light by lobe and roughness, as a chart and as a table.

use crate::measure::chart::{Axis, Chart, Point, Series};
use crate::measure::lobe::{LOBES, REFLECTANCES, Score, mean};
use crate::measure::metrics::psnr;
use crate::measure::table::{Table, Value};

fn material(reflectance: f32) -> &'static str {
    if reflectance < 0.5 {
        "dielectric"
    } else {
        "metal"
    }
}

/// PSNR of a metal's glossy light over roughness, a curve a lobe.
pub fn chart(scores: &[Score]) -> Chart {
    let metal = || scores.iter().filter(|s| s.reflectance == REFLECTANCES[1]);
    let curve = |(number, lobe): (usize, &crate::measure::lobe::Lobe)| Series {
        name: lobe.name.into(),
        points: metal()
            .map(|s| Point {
                x: f64::from(s.roughness),
                y: psnr(s.lobes[number].0),
                label: String::new(),
            })
            .collect(),
        line: true,
    };
    Chart {
        title: "Glossy light of a metal, by lobe".into(),
        x: Axis {
            label: "roughness".into(),
            log: false,
        },
        y: Axis {
            label: "PSNR (dB)".into(),
            log: false,
        },
        series: LOBES.iter().enumerate().map(curve).collect(),
        levels: Vec::new(),
    }
}

/// PSNR and brightness by material and lobe.
pub fn table(title: &str, scores: &[Score], receivers: usize) -> Table {
    let mut columns = vec!["roughness".to_string(), "material".into()];
    for lobe in &LOBES {
        columns.push(format!("{} (dB)", lobe.name));
        columns.push("over right".into());
    }
    let mut rows: Vec<Vec<Value>> = scores
        .iter()
        .map(|s| {
            let head = [
                Value::Number(f64::from(s.roughness), 1),
                Value::Text(material(s.reflectance).into()),
            ];
            let lobes = s.lobes.iter();
            let cells = lobes.flat_map(|(error, over)| {
                [Value::Number(psnr(*error), 2), Value::Number(*over, 2)]
            });
            head.into_iter().chain(cells).collect()
        })
        .collect();
    let means = (0..LOBES.len()).flat_map(|l| [Value::Number(mean(scores, l), 2), Value::Missing]);
    let all = [Value::Text("all".into()), Value::Missing];
    rows.push(all.into_iter().chain(means).collect());
    Table {
        title: format!("{title}: glossy light by lobe"),
        columns,
        rows,
        note: format!(
            "Glossy light of visibility-weighted probes against paths, at {receivers} surfaces seen \
             from probes, each taken for all materials. PSNR of sRGB values after the tone curve, at \
             the exposure of the right light; the mean over the right one. Lobes lean to the normal \
             unless it says otherwise."
        ),
    }
}
