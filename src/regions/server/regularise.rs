//! Models that agree better with their neighbours (section 2.3).
//!
//! Lowers
//!
//! ```text
//! E = sum_i (M_i - M_orig,i)^2 + beta sum_i sum_{j in N(i)} w_ij (M_i(b_ij) - M_j(b_ij))^2
//! ```
//!
//! by block coordinate descent: one region after the other takes the terms that are best while all others
//! stay. The first difference is the mean square over the samples of the region and over normals;
//! `w_ij` is the area of the boundary as a share of the boxes' own surfaces, so that beta does not depend
//! on the unit of length. E never rises.

use super::dense::{self, MAX};
use super::fit;
use super::graph::Link;
use super::model::Model;
use super::samples::{Channels, RegionSamples};

/// Holds terms that no sample determines where they are.
const RIDGE: f64 = 1e-6;
/// The least relative drop of E in a sweep that another one is worth.
const CONVERGED: f64 = 1e-4;

/// How models are regularised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Weight of the boundaries; 0 leaves all as it is.
    pub beta: f64,
    /// Most sweeps over all regions.
    pub sweeps: usize,
}

/// E after a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// What the models have moved.
    pub moved: f64,
    /// The differences at the boundaries, times beta.
    pub differences: f64,
}

impl Energy {
    pub fn total(self) -> f64 {
        self.moved + self.differences
    }
}

/// Regularises one model per region, of any derivatives each. Gives E before the first sweep and after
/// each.
pub fn regularise(
    models: &mut [Model],
    samples: &[&RegionSamples],
    links: &[Link],
    settings: Settings,
) -> Vec<Energy> {
    let graph = Graph::new(models, samples, links, settings.beta);
    let mut energies = vec![graph.energy(models)];
    if settings.beta <= 0.0 || links.is_empty() {
        return energies;
    }
    for _ in 0..settings.sweeps {
        for region in 0..models.len() {
            let terms = graph.best(models, region);
            models[region].terms = terms;
        }
        let energy = graph.energy(models);
        let before = energies[energies.len() - 1].total();
        energies.push(energy);
        if energy.total() >= before * (1.0 - CONVERGED) {
            break;
        }
    }
    energies
}

/// A boundary as a region sees it.
struct Boundary<'a> {
    link: &'a Link,
    neighbour: usize,
    /// beta times `w`.
    weight: f64,
}

struct Graph<'a> {
    originals: Vec<Model>,
    grams: Vec<dense::Matrix>,
    boundaries: Vec<Vec<Boundary<'a>>>,
}

impl<'a> Graph<'a> {
    fn new(models: &[Model], samples: &[&RegionSamples], links: &'a [Link], beta: f64) -> Self {
        let grams = models.iter().zip(samples).map(|(model, samples)| {
            let mut gram = fit::gram(model, &samples.samples);
            (0..MAX).for_each(|i| gram[i][i] += RIDGE);
            gram
        });
        let mut boundaries: Vec<Vec<Boundary>> = models.iter().map(|_| Vec::new()).collect();
        for link in links {
            let [i, j] = link.regions;
            let area = |i: usize| f64::from(models[i].bounds.half_area());
            let share = f64::from(link.area) / (area(i) * area(j)).sqrt();
            if !share.is_finite() {
                continue;
            }
            for (own, neighbour) in [(i, j), (j, i)] {
                boundaries[own].push(Boundary {
                    link,
                    neighbour,
                    weight: beta * share,
                });
            }
        }
        Graph {
            originals: models.to_vec(),
            grams: grams.collect(),
            boundaries,
        }
    }

    fn energy(&self, models: &[Model]) -> Energy {
        let mut energy = Energy {
            moved: 0.0,
            differences: 0.0,
        };
        for (i, model) in models.iter().enumerate() {
            energy.moved += self.moved(i, model);
            for boundary in &self.boundaries[i] {
                let b = boundary.link.centre;
                let other = models[boundary.neighbour].channels(b);
                energy.differences += boundary.weight * fit::distance(&model.channels(b), &other);
            }
        }
        energy
    }

    /// Mean square of what a model has moved over its samples.
    fn moved(&self, i: usize, model: &Model) -> f64 {
        let (gram, original) = (&self.grams[i], &self.originals[i]);
        let step: Vec<Channels> = model
            .terms
            .iter()
            .zip(&original.terms)
            .map(|(a, b)| std::array::from_fn(|k| a[k] - b[k]))
            .collect();
        let mut sum = 0.0;
        for (a, row) in step.iter().zip(gram) {
            for (b, weight) in step.iter().zip(row) {
                let products = a.iter().zip(b).enumerate();
                let dot: f64 = products
                    .map(|(k, (a, b))| super::basis::SQUARE[k % super::basis::COUNT] * a * b)
                    .sum();
                sum += weight * dot;
            }
        }
        sum
    }

    /// The terms of a region that minimise E while all others stay. Every boundary counts twice: it is
    /// one of its neighbour, too.
    fn best(&self, models: &[Model], region: usize) -> Vec<Channels> {
        let (model, original) = (&models[region], &self.originals[region]);
        let n = model.terms.len();
        let mut matrix = self.grams[region];
        let mut right = [[0.0; _]; MAX];
        for (i, right) in right[..n].iter_mut().enumerate() {
            for (weight, term) in matrix[i].iter().zip(&original.terms) {
                add(right, *weight, term);
            }
        }
        for boundary in &self.boundaries[region] {
            let b = boundary.link.centre;
            let features = model.features(b.clamp(model.bounds.min, model.bounds.max));
            let other = models[boundary.neighbour].channels(b);
            for i in 0..n {
                for j in 0..n {
                    matrix[i][j] += 2.0 * boundary.weight * features[i] * features[j];
                }
                add(&mut right[i], 2.0 * boundary.weight * features[i], &other);
            }
        }
        dense::solve(&matrix, n, &right)[..n].to_vec()
    }
}

fn add(to: &mut Channels, weight: f64, values: &Channels) {
    for (to, value) in to.iter_mut().zip(values) {
        *to += weight * value;
    }
}
