//! The error of glossy light: the split sum with its zonal lobe against the integral it stands for.

use crate::measure::chart::{Axis, Chart, Point, Series};
use crate::probes::ggx::error::{self, error};

/// Angles between view and normal, in degrees.
const ANGLES: [u32; 5] = [0, 30, 60, 70, 80];
/// Random lights that an error is the mean over.
const LIGHTS: usize = 256;
const SEED: u64 = 1;

/// Error over roughness, a curve an angle, for a metal that reflects all; with the lobe about the
/// sampler's direction, and about the mirror direction as in the paper.
pub fn lobe() -> Chart {
    let axes = [
        (error::Axis::Dominant, "leaning"),
        (error::Axis::Mirror, "mirror"),
    ];
    let curves = axes
        .iter()
        .flat_map(|axis| ANGLES.map(|angle| (*axis, angle)));
    let curve = |((axis, name), angle): ((error::Axis, &str), u32)| Series {
        name: format!("{angle}\u{b0}, {name}"),
        points: (1..=8)
            .map(|step| {
                let roughness = step as f32 / 10.0;
                let cosine = (angle as f32).to_radians().cos();
                Point {
                    x: f64::from(step) / 10.0,
                    y: error(roughness, cosine, 1.0, axis, LIGHTS, SEED).rms,
                    label: String::new(),
                }
            })
            .collect(),
        line: true,
    };
    Chart {
        title: "Error of glossy light".into(),
        x: Axis {
            label: "roughness".into(),
            log: false,
        },
        y: Axis {
            label: "rms error over rms light".into(),
            log: true,
        },
        series: curves.map(curve).collect(),
        levels: Vec::new(),
    }
}
