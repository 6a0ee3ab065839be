//! The default density of points on each mesh.
//!
//! All have the density that suits the scene's size, but for those too small to get points enough
//! from it, and the largest where all together would have too many.

use crate::points::grid;
use crate::points::place::Density;
use glam::Vec3;

/// Fewest candidates of an instance: both sides of a small box get points from as many.
const MIN_CANDIDATES: f64 = 128.0;
/// Most candidates that the minimum adds up to over all instances.
const MAX_MINIMA: f64 = 1e6;
/// Most candidates of a scene: sponza at the paper's density has 8.3 million.
const MAX_CANDIDATES: f64 = 1e7;
/// A small instance's points are at most so many times denser than the others.
const MAX_RAISE: f64 = 64.0;

/// The surface of all instances that share their points.
pub(super) struct Surfaces {
    /// Of one of them, in square metres.
    pub(super) area: f64,
    pub(super) count: usize,
    /// Of one of them, in metres.
    pub(super) size: Vec3,
}

/// The density of each, given the one that suits the scene.
pub(super) fn fit(surfaces: &[Surfaces], density: Density) -> Vec<Density> {
    let wanted = f64::from(density.candidates);
    let instances: usize = surfaces.iter().map(|s| s.count).sum();
    let least = MIN_CANDIDATES.min(MAX_MINIMA / instances.max(1) as f64);
    let mut candidates: Vec<f64> = surfaces
        .iter()
        .map(|s| (wanted * s.area).max(least.min(MAX_RAISE * wanted * s.area)))
        .collect();
    let most = level(surfaces, &candidates);
    candidates.iter_mut().for_each(|c| *c = c.min(most));
    let fitted = surfaces.iter().zip(candidates).map(|(s, candidates)| {
        let mut fitted = Density {
            candidates: if s.area > 0.0 {
                (candidates / s.area) as f32
            } else {
                density.candidates
            },
            ..density
        };
        while s.size.is_finite() && !grid::fits(s.size, fitted.radius()) {
            fitted.candidates *= 0.5;
        }
        fitted
    });
    fitted.collect()
}

/// The number of candidates at which all instances with more have to be cut off for
/// [`MAX_CANDIDATES`] in all.
fn level(surfaces: &[Surfaces], candidates: &[f64]) -> f64 {
    let mut sorted: Vec<(f64, f64)> = candidates
        .iter()
        .zip(surfaces)
        .map(|(c, s)| (*c, s.count as f64))
        .collect();
    sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut left: f64 = sorted.iter().map(|s| s.1).sum();
    let mut budget = MAX_CANDIDATES;
    for (candidates, count) in sorted {
        if candidates * left > budget {
            return budget / left;
        }
        budget -= candidates * count;
        left -= count;
    }
    f64::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: Density = Density {
        candidates: 1024.0,
        thinning: 2.0,
    };

    fn surfaces(area: f64, count: usize) -> Surfaces {
        Surfaces {
            area,
            count,
            size: Vec3::splat(area.sqrt() as f32),
        }
    }

    fn total(all: &[Surfaces], fitted: &[Density]) -> f64 {
        let each = all.iter().zip(fitted);
        each.map(|(s, d)| s.area * s.count as f64 * f64::from(d.candidates))
            .sum()
    }

    #[test]
    fn a_room_has_the_density_asked_for() {
        let all = [surfaces(60.0, 1), surfaces(0.5, 12), surfaces(0.0, 1)];
        assert_eq!(fit(&all, PAPER), [PAPER; 3]);
    }

    #[test]
    fn small_instances_have_points_enough_and_many_of_them_not_too_many() {
        let few = fit(&[surfaces(60.0, 1), surfaces(0.01, 20)], PAPER);
        assert_eq!(few[0], PAPER);
        assert!((few[1].candidates - 12_800.0).abs() < 1.0, "{few:?}");
        let specks = fit(&[surfaces(60.0, 1), surfaces(1e-8, 1)], PAPER);
        assert!((specks[1].candidates - 65_536.0).abs() < 1.0, "{specks:?}");
        let leaves = [surfaces(0.01, 100_000)];
        assert!(total(&leaves, &fit(&leaves, PAPER)) < 2e6);
    }

    #[test]
    fn a_large_ground_leaves_the_density_of_the_others() {
        let all = [surfaces(40_000.0, 1), surfaces(300.0, 2)];
        let fitted = fit(&all, PAPER);
        assert_eq!(fitted[1], PAPER);
        assert!((total(&all, &fitted) - 1e7).abs() < 1e4, "{fitted:?}");
        // Numbered by 32 bits, whatever its size.
        let vast = fit(&[surfaces(1e9, 1)], PAPER);
        assert!(grid::fits(Vec3::splat(31_623.0), vast[0].radius()));
    }
}
