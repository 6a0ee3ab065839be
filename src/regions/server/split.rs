//! Regions that one model does not fit are divided.

use super::Settings;
use super::fit;
use super::graph::Region;
use super::ladder;
use super::model::{Derivatives, Form};
use super::samples::{self, RegionSamples};
use super::space::Space;
use crate::Result;
use crate::obscurance::Obscurance;
use crate::trace::{Aabb, Tracer};

/// Samples a region and, while the error of its richest model on its held-out samples is above the
/// tolerance, divides it in the middle of the axis that leaves the least; at most `depth` times, and not
/// below two cells of the space. Divisions carry the name with `.0` and `.1` behind it.
///
/// A function of the region and the shared scene alone.
///
/// # Errors
/// As [`samples::sample`].
pub fn sample_and_split(
    obscurance: &Obscurance,
    tracer: &Tracer,
    space: &Space,
    region: Region,
    settings: &Settings,
    depth: usize,
) -> Result<Vec<(Region, RegionSamples)>> {
    let samples = samples::sample(obscurance, tracer, space, region.bounds)?;
    let axis = (depth > 0)
        .then(|| axis(region.bounds, &samples, space, settings))
        .flatten();
    let Some(axis) = axis else {
        return Ok(vec![(region, samples)]);
    };
    let mut all = Vec::new();
    for (i, bounds) in halves(region.bounds, axis).into_iter().enumerate() {
        let name = format!("{}.{i}", region.name);
        let half = Region { name, bounds };
        let parts = sample_and_split(obscurance, tracer, space, half, settings, depth - 1)?;
        all.extend(parts);
    }
    Ok(all)
}

/// The axis to divide a region along; `None` where it is good enough, or too small.
fn axis(
    bounds: Aabb,
    samples: &RegionSamples,
    space: &Space,
    settings: &Settings,
) -> Option<usize> {
    let (_, fitted) = fit::fit(bounds, samples, settings.centres);
    let form = Form {
        derivatives: Derivatives::Sided,
        degree: 2,
        signals: 1,
    };
    let share = f64::from(settings.blend.long);
    let error = ladder::error(&fitted.last()?.model, form, samples, share)?;
    if error <= settings.tolerance {
        return None;
    }
    let left = |axis: usize| -> f64 {
        let of_half = |half: Aabb| {
            let mut own = samples.clone();
            own.samples
                .retain(|s| half.distance_squared(s.position) == 0.0);
            let (_, fitted) = fit::fit(half, &own, settings.centres);
            let residual = fitted.last().map_or(0.0, |fitted| fitted.residual);
            residual * own.samples.len() as f64
        };
        halves(bounds, axis).map(of_half).iter().sum()
    };
    let size = bounds.max - bounds.min;
    let long = (0..3).filter(|axis| size[*axis] >= 4.0 * space.cell());
    long.map(|axis| (left(axis), axis))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, axis)| axis)
}

fn halves(bounds: Aabb, axis: usize) -> [Aabb; 2] {
    let middle = bounds.centre()[axis];
    let (mut low, mut high) = (bounds, bounds);
    low.max[axis] = middle;
    high.min[axis] = middle;
    [low, high]
}
