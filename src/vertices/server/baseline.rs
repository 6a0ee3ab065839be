//! What bakers commonly do, to compare the fit with.

use super::fill::fill;
use super::shape::Shape;
use super::{Sample, Site};
use crate::obscurance::Obscurance;
use crate::scene::Pose;

/// How far a corner's sample is moved from the corner towards the middle of its triangle, as a
/// share of the way: at the corner itself rays would start in whatever touches it.
const INSET: f32 = 0.02;

/// Places of the corners of all triangles that receive samples, three a triangle.
pub fn corners(instance: usize, shape: &Shape) -> Vec<Site> {
    let triangles = (0..shape.triangles.len()).filter(|&t| shape.receives[t]);
    triangles
        .flat_map(|t| {
            let shift = super::place::face_seed(instance, t);
            (0..3).map(move |corner| {
                let mut weights = [INSET / 3.0; 3];
                weights[corner] = 1.0 - 2.0 * INSET / 3.0;
                Site {
                    triangle: t as u32,
                    u: weights[1],
                    v: weights[2],
                    area: shape.areas[t] / 3.0,
                    seed: (shift as u32).wrapping_add(corner as u32),
                }
            })
        })
        .collect()
}

/// Obscurance at the vertices: each takes the mean of its corners ([`corners`]), weighted by area,
/// those inside geometry left out. Values per signal and variable.
pub fn at_vertices(
    obscurance: &Obscurance,
    pose: &Pose,
    instance: usize,
    shape: &Shape,
) -> Vec<Vec<f64>> {
    let signals = obscurance.kernels().len();
    let sites = corners(instance, shape);
    let gathers = super::trace(obscurance, pose, instance, &sites);
    let valid = sites.iter().zip(&gathers).enumerate();
    let valid = valid.filter(|(_, (_, gather))| gather.is_valid());
    let weighted = valid.map(|(i, (site, gather))| {
        let variable = shape.triangles[site.triangle as usize][i % 3];
        (variable, site.area, &gather.values[..signals])
    });
    average(shape, weighted, signals)
}

/// The mean of the samples about each vertex, weighted by area and barycentric weight: the cheapest
/// use of samples on faces. Values per signal and variable.
pub fn splat<'a>(
    shape: &Shape,
    samples: impl Iterator<Item = Sample<'a>>,
    signals: usize,
) -> Vec<Vec<f64>> {
    let weighted = samples.flat_map(|Sample { site, values }| {
        let variables = shape.triangles[site.triangle as usize];
        let weights = site.weights().into_iter().zip(variables);
        weights.map(move |(weight, variable)| (variable, site.area * weight, values))
    });
    average(shape, weighted, signals)
}

/// Weighted means by variable; those without any are filled as the fit fills its own.
fn average<'a>(
    shape: &Shape,
    weighted: impl Iterator<Item = (u32, f64, &'a [f32])>,
    signals: usize,
) -> Vec<Vec<f64>> {
    let mut sums = vec![vec![0.0; shape.variables()]; signals];
    let mut weights = vec![0.0; shape.variables()];
    for (variable, weight, values) in weighted {
        weights[variable as usize] += weight;
        for (sum, value) in sums.iter_mut().zip(values) {
            sum[variable as usize] += weight * f64::from(*value);
        }
    }
    let total: f64 = weights.iter().sum();
    let default = |sum: &Vec<f64>| match total > 0.0 {
        true => sum.iter().sum::<f64>() / total,
        false => 1.0,
    };
    let default: Vec<f64> = sums.iter().map(default).collect();
    for sum in &mut sums {
        for (value, weight) in sum.iter_mut().zip(&weights) {
            *value = if *weight > 0.0 { *value / weight } else { 0.0 };
        }
    }
    let is_known: Vec<bool> = weights.iter().map(|weight| *weight > 0.0).collect();
    fill(shape, &mut sums, &is_known, &default);
    sums
}
