//! Local values that suit the instances of a mesh (the paper's future work: "optimizing for the per-object local AO
//! using alternating least squares").
//!
//! Eq. 3 is linear in the global function for a given local signal, and linear in the local values for given global
//! functions. They are fitted in turns. The values of the object alone stay the starting point and a prior:
//! vertices that no sample says anything of keep them.
//!
//! Whether it helps is decided on the samples that are held out of both fits.

use super::fit::{self, Fit, Linear, Sample};
use super::solve::{Traced, samples_of};
use crate::scene::{Mesh, Scene};
use std::collections::HashMap;

/// Turns at most.
const TURNS: usize = 8;

/// Turns end where the error over the samples falls by less than this share.
const SMALL_GAIN: f64 = 1e-3;

/// Weight of the prior, as a share of the mean of what the samples say about a vertex.
const PRIOR: f64 = 0.05;

/// Steps of the conjugate gradient at most; a turn starts where the last one ended.
const STEPS: usize = 50;

/// What a refinement came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Refined {
    /// One value per vertex, in 0..=1: the refined ones, or those given where they are not better.
    pub local: Vec<f32>,
    /// Held-out error of the linear rung over all instances, by area: with the local values given, and refined.
    pub errors: [f64; 2],
    /// Turns done.
    pub turns: usize,
}

impl Refined {
    pub fn is_better(&self) -> bool {
        self.errors[1] < self.errors[0]
    }
}

/// Refines one signal of the local values of a mesh. `instances` are instances of that mesh with their samples
/// ([`super::solve::trace`]), by whose linear functions the values are fitted.
pub fn refine(
    scene: &Scene,
    mesh: usize,
    instances: &[(usize, &[Traced])],
    local: &[f32],
    signal: usize,
) -> Refined {
    let mesh = &scene.meshes[mesh];
    let (variable_of, variables) = weld(mesh);
    let all = Equations::new(scene, mesh, instances, &variable_of, signal);
    let start = average(&variable_of, variables, local);
    let mut values = start.clone();
    let mut samples = all.samples.clone();
    let mut fitted = all.fit_globals(&mut samples, &values);
    let given = fitted.held_out;
    let mut best = (given, values.clone());
    let mut turns = 0;
    while turns < TURNS {
        turns += 1;
        all.fit_locals(&mut values, &start, &fitted.globals);
        let next = all.fit_globals(&mut samples, &values);
        let gain = fitted.error - next.error;
        let small = gain < SMALL_GAIN * fitted.error;
        fitted = next;
        if fitted.held_out < best.0 {
            best = (fitted.held_out, values.clone());
        }
        if small {
            break;
        }
    }
    let local = match best.0 < given {
        true => variable_of.iter().map(|v| best.1[*v] as f32).collect(),
        false => local.to_vec(),
    };
    Refined {
        local,
        errors: [given, best.0],
        turns,
    }
}

/// A number per vertex, the same for vertices of the same bits of position and normal, and how many there are.
fn weld(mesh: &Mesh) -> (Vec<usize>, usize) {
    let mut seen = HashMap::with_capacity(mesh.positions.len());
    let mut variable_of = Vec::with_capacity(mesh.positions.len());
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let normal = mesh.normals.get(vertex).copied().unwrap_or_default();
        let key = (
            position.to_array().map(f32::to_bits),
            normal.to_array().map(f32::to_bits),
        );
        let next = seen.len();
        variable_of.push(*seen.entry(key).or_insert(next));
    }
    (variable_of, seen.len())
}

/// The mean of the vertices of each variable.
fn average(variable_of: &[usize], variables: usize, local: &[f32]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0u32); variables];
    for (variable, value) in variable_of.iter().zip(local) {
        sums[*variable].0 += f64::from(*value);
        sums[*variable].1 += 1;
    }
    sums.iter()
        .map(|(sum, n)| sum / f64::from((*n).max(1)))
        .collect()
}

/// The samples of all instances.
struct Equations {
    /// Instance by instance.
    samples: Vec<Sample>,
    /// Variables of the corners of each sample's triangle, and its weights.
    corners: Vec<([usize; 3], [f64; 3])>,
    /// Samples of each instance.
    counts: Vec<usize>,
}

/// The linear functions of all instances, and their errors, by area.
struct Globals {
    globals: Vec<Linear>,
    /// Over the samples that were fitted.
    error: f64,
    held_out: f64,
}

impl Equations {
    fn new(
        scene: &Scene,
        mesh: &Mesh,
        instances: &[(usize, &[Traced])],
        variable_of: &[usize],
        signal: usize,
    ) -> Equations {
        let zero = vec![0.0; mesh.positions.len()];
        let mut all = Equations {
            samples: Vec::new(),
            corners: Vec::new(),
            counts: Vec::new(),
        };
        for (instance, traced) in instances {
            all.samples
                .extend(samples_of(scene, *instance, &zero, traced, signal));
            all.counts.push(traced.len());
            all.corners.extend(traced.iter().map(|Traced { site, .. }| {
                let corners = mesh.triangles[site.triangle as usize];
                (
                    corners.map(|v| variable_of[v as usize]),
                    site.weights().map(f64::from),
                )
            }));
        }
        all
    }

    /// The instances' functions for given local values, which are put into `samples`.
    fn fit_globals(&self, samples: &mut [Sample], values: &[f64]) -> Globals {
        for (sample, (corners, weights)) in samples.iter_mut().zip(&self.corners) {
            sample.local = (0..3).map(|k| weights[k] * values[corners[k]]).sum();
        }
        let mut globals = Vec::with_capacity(self.counts.len());
        // Weighted squares and weights: fitted, held out.
        let mut sums = [[0.0; 2]; 2];
        let mut rest = &samples[..];
        for &count in &self.counts {
            let (own, others) = rest.split_at(count);
            rest = others;
            let Fit { linear, .. } = fit::fit(own);
            globals.push(linear.global);
            for s in own {
                let square = (fit::shown(&linear.global, s.at, s.local) - s.gold).powi(2);
                let sum = &mut sums[usize::from(s.held_out)];
                sum[0] += s.weight * square;
                sum[1] += s.weight;
            }
        }
        let [error, held_out] = sums.map(|[squares, weight]| match weight > 0.0 {
            true => (squares / weight).sqrt(),
            false => 0.0,
        });
        Globals {
            globals,
            error,
            held_out,
        }
    }

    /// The local values for given functions: least squares over the fitted samples, drawn to `prior`, then
    /// clamped to 0..=1. By the conjugate gradient with the diagonal as its preconditioner.
    fn fit_locals(&self, values: &mut [f64], prior: &[f64], globals: &[Linear]) {
        // The corners' weights times the global function, of each fitted sample.
        let mut terms = Vec::new();
        let numbered = self.counts.iter().enumerate();
        let owners = numbered.flat_map(|(k, count)| std::iter::repeat_n(k, *count));
        for ((sample, (corners, weights)), owner) in
            self.samples.iter().zip(&self.corners).zip(owners)
        {
            if !sample.held_out {
                let global = fit::evaluate(&globals[owner], sample.at);
                terms.push((*corners, weights.map(|w| w * global), sample));
            }
        }
        let mut diagonal = vec![0.0; values.len()];
        for (corners, weights, sample) in &terms {
            for k in 0..3 {
                diagonal[corners[k]] += sample.weight * weights[k] * weights[k];
            }
        }
        let pull = PRIOR * diagonal.iter().sum::<f64>() / values.len().max(1) as f64;
        if pull <= 0.0 {
            return;
        }
        let apply = |x: &[f64], out: &mut [f64], gold: f64| {
            // Half the gradient of the energy without its right-hand side for gold = 0, with it for 1.
            for ((out, x), prior) in out.iter_mut().zip(x).zip(prior) {
                *out = pull * (x - gold * prior);
            }
            for (corners, weights, sample) in &terms {
                let value: f64 = (0..3).map(|k| weights[k] * x[corners[k]]).sum();
                let pulled = sample.weight * (value - gold * sample.gold);
                (0..3).for_each(|k| out[corners[k]] += weights[k] * pulled);
            }
        };
        let inverse: Vec<f64> = diagonal.iter().map(|d| 1.0 / (d + pull)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let scaled =
            |r: &[f64]| -> Vec<f64> { r.iter().zip(&inverse).map(|(r, i)| r * i).collect() };
        let mut residual = vec![0.0; values.len()];
        apply(values, &mut residual, 1.0);
        residual.iter_mut().for_each(|r| *r = -*r);
        let mut z = scaled(&residual);
        let mut direction = z.clone();
        let mut product = vec![0.0; values.len()];
        let mut energy = dot(&residual, &z);
        let first = energy;
        for _ in 0..STEPS {
            apply(&direction, &mut product, 0.0);
            let curvature = dot(&direction, &product);
            if energy <= 1e-12 * first || curvature <= 0.0 {
                break;
            }
            let step = energy / curvature;
            for i in 0..values.len() {
                values[i] += step * direction[i];
                residual[i] -= step * product[i];
            }
            z = scaled(&residual);
            let next = dot(&residual, &z);
            for (d, z) in direction.iter_mut().zip(&z) {
                *d = z + next / energy * *d;
            }
            energy = next;
        }
        values.iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instances::server::Site;
    use crate::obscurance::shapes::{floor, scene as scene_of};
    use crate::rng::Rng;
    use glam::{DVec3, Vec3};

    /// Instances of a floor, and their samples of `gold(instance, u, truth)`, where truth is what the local values `local`
    /// give there.
    fn traced(
        scene: &Scene,
        local: &[f32],
        gold: impl Fn(usize, DVec3, f64) -> f64,
    ) -> Vec<Vec<Traced>> {
        let mut random = Rng::new(4);
        let triangles = scene.meshes[0].triangles.len() as u64;
        let mut one = |instance: usize| {
            let site = |k: usize| {
                let (u, v) = (0.5 * random.unit(), 0.5 * random.unit());
                Traced {
                    site: Site {
                        triangle: (random.draw() % triangles) as u32,
                        u,
                        v,
                        area: 1.0,
                        seed: 0,
                        held_out: k % 4 == 3,
                    },
                    gold: vec![0.0],
                }
            };
            let mut traced: Vec<Traced> = (0..200).map(site).collect();
            let samples: Vec<Sample> = samples_of(scene, 0, local, &traced, 0).collect();
            for (traced, s) in traced.iter_mut().zip(samples) {
                traced.gold[0] = gold(instance, s.at, s.local) as f32;
            }
            traced
        };
        (0..20).map(&mut one).collect()
    }

    fn run(scene: &Scene, traced: &[Vec<Traced>], local: &[f32]) -> Refined {
        let instances: Vec<(usize, &[Traced])> = traced.iter().map(|t| (0, &t[..])).collect();
        refine(scene, 0, &instances, local, 0)
    }

    #[test]
    fn wrong_local_values_are_refined_towards_the_true_ones() {
        let (scene, _) = scene_of(vec![floor(Vec3::ZERO, 4.0, 6)]);
        let positions = &scene.meshes[0].positions;
        let truth: Vec<f32> = positions
            .iter()
            .map(|p| 0.5 + 0.3 * (3.0 * p.x).sin())
            .collect();
        let global = |i: usize, u: DVec3| 0.6 + 0.02 * i as f64 * u.x - 0.01 * u.z;
        let all = traced(&scene, &truth, |i, u, l| global(i, u) * l);
        let wrong: Vec<f32> = positions.iter().map(|p| 0.6 + 0.1 * p.z.sin()).collect();
        let refined = run(&scene, &all, &wrong);
        assert!(refined.is_better());
        let [before, after] = refined.errors;
        assert!(after < 0.2 * before, "{before} {after}");
        assert!(refined.local.iter().all(|v| (0.0..=1.0).contains(v)));
    }

    #[test]
    fn noise_is_not_fitted() {
        let (scene, _) = scene_of(vec![floor(Vec3::ZERO, 4.0, 30)]);
        let local = vec![0.7; scene.meshes[0].positions.len()];
        let random = std::cell::RefCell::new(Rng::new(1));
        let noise = |_: usize, _: DVec3, _: f64| random.borrow_mut().unit_f64();
        let all = traced(&scene, &local, noise);
        let refined = run(&scene, &all, &local);
        assert!(!refined.is_better());
        assert_eq!(refined.local, local);
    }

    #[test]
    fn nothing_comes_of_no_samples() {
        let (scene, _) = scene_of(vec![floor(Vec3::ZERO, 4.0, 2)]);
        let local = vec![0.7; scene.meshes[0].positions.len()];
        assert_eq!(run(&scene, &[Vec::new(), Vec::new()], &local).local, local);
    }
}
