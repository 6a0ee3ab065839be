//! The strength of the fit's ridge, and whether to fit at all, by receivers that the fit does not see.

use super::rows::Rows;
use super::solve::solve;
use crate::probes::sh::{L2, L2_COUNT};
use glam::Vec3;

/// Every so many receivers one is held out.
const HELD_OUT: usize = 5;
/// Strengths that are tried, the strongest first. With 0.03 irradiance at receivers may still come out
/// better than with 0.1, but glossy light gets worse and rings more: in six scenes every picture did.
const STRENGTHS: [f32; 5] = [10.0, 3.0, 1.0, 0.3, 0.1];

/// What held-out receivers say of traced and fitted light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Choice {
    /// The strength of the ridge.
    pub strength: f32,
    /// Error of irradiance at the receivers that were held out, rms over rms, by the traced light. The
    /// noise of the receivers is in it.
    pub traced_error: f64,
    /// The same by light that is fitted to the others.
    pub fitted_error: f64,
}

/// Tries the strengths, each with a fit to four fifths of the receivers, and takes the strongest whose
/// error on the last fifth is within one standard error of the least (the rule of Breiman et al. 1984,
/// *Classification and Regression Trees*, §3.4.3): receivers lie where probes see surfaces, cameras
/// look elsewhere, too. `weights` and `irradiance` are those of all receivers, `traced` the light to
/// start from.
pub fn choose(rows: &Rows, weights: &[f32], irradiance: &[Vec3], traced: &[L2]) -> Choice {
    let is_held = |r: usize| r % HELD_OUT == HELD_OUT - 1;
    let held: Vec<usize> = (0..weights.len())
        .filter(|&r| is_held(r) && weights[r] > 0.0)
        .collect();
    // The sum of the weights stays, so that a strength means the same.
    let whole: f32 = weights.iter().sum();
    let kept = |r: usize| if is_held(r) { 0.0 } else { weights[r] };
    let rest: f32 = (0..weights.len()).map(kept).sum();
    let scale = if rest > 0.0 { whole / rest } else { 0.0 };
    let fitted_to: Vec<f32> = (0..weights.len()).map(|r| kept(r) * scale).collect();

    let by_traced = rows.look_up(traced);
    let pairs = irradiance.iter().zip(&by_traced);
    let missing: Vec<Vec3> = pairs.map(|(right, got)| *right - *got).collect();
    let zero = vec![Vec3::ZERO; missing.len()];
    let errors = |got: &[Vec3]| -> Vec<f64> {
        let error = |&r: &usize| f64::from(missing[r].distance_squared(got[r]));
        held.iter().map(error).collect()
    };
    let size: f64 = held
        .iter()
        .map(|&r| f64::from(irradiance[r].length_squared()))
        .sum();
    let relative = |errors: &[f64]| match size > 0.0 {
        true => (errors.iter().sum::<f64>() / size).sqrt(),
        false => 0.0,
    };

    let mut change = vec![[Vec3::ZERO; L2_COUNT]; traced.len()];
    let tried: Vec<(f32, Vec<f64>)> = STRENGTHS
        .iter()
        .map(|&strength| {
            let start = std::mem::take(&mut change);
            change = solve(rows, &fitted_to, &missing, strength, start);
            (strength, errors(&rows.look_up(&change)))
        })
        .collect();
    let sum = |errors: &Vec<f64>| errors.iter().sum::<f64>();
    let least = tried
        .iter()
        .min_by(|(_, a), (_, b)| sum(a).total_cmp(&sum(b)));
    let chosen = least.and_then(|(_, best)| {
        let mut tried = tried.iter();
        tried.find(|(_, errors)| is_within_noise(errors, best))
    });
    let traced_error = relative(&errors(&zero));
    match chosen {
        Some((strength, errors)) => Choice {
            strength: *strength,
            traced_error,
            fitted_error: relative(errors),
        },
        None => Choice::default(),
    }
}

/// Whether the mean of `errors` is above that of `best` by no more than one standard error of their
/// differences, which are those of the same receivers and so share their noise.
fn is_within_noise(errors: &[f64], best: &[f64]) -> bool {
    let count = errors.len().max(1) as f64;
    let difference = || errors.iter().zip(best).map(|(e, b)| e - b);
    let mean = difference().sum::<f64>() / count;
    let variance = difference().map(|d| (d - mean).powi(2)).sum::<f64>() / count;
    mean <= (variance / count).sqrt()
}
