//! Points for instances that no rung of the ladder describes within the tolerance.
//!
//! An instance's points are placed as those of the model `points` are, in a track of its own, and have the obscurance
//! of the bake in the place of occlusion within a distance. They never change.

use super::ladder::{self, Measured, Rung, Sample};
use super::plan::{Plan, Traced};
use super::signals::Baked;
use crate::Result;
use crate::codec::points::{Bucket, Cell, Grid};
use crate::codec::{self, Transform};
use crate::points::place::Density;
use crate::points::sample::{Fallback, sample, to_grid};
use crate::points::server::{Options, Server, Space, Track};
use crate::points::source::{declare, transform};
use crate::vertices::server::place::Site;
use crate::world::World;
use std::collections::{BTreeMap, BTreeSet};

/// Densities that are tried, from few points to many: shares of the one that suits occlusion within a short distance
/// ([`Options::for_scene`]).
const SHARES: [f32; 4] = [1.0 / 64.0, 1.0 / 16.0, 1.0 / 4.0, 1.0];

/// Most candidates of an instance; half of them are kept and traced.
const MAX_CANDIDATES: f64 = 1e6;

/// The next density has to lower an error to this share of it. What then is left is noise of the rays, which more points
/// do not lower.
const GAIN: f64 = 0.97;

/// The points of an instance.
#[derive(Clone, Debug, PartialEq)]
pub struct InstancePoints {
    pub instance: usize,
    /// Candidates per square metre, before thinning.
    pub density: f32,
    /// Points that clients get.
    pub points: usize,
    /// Root mean square error over the instance's held-out samples.
    pub error: f64,
    /// The rung that the points stand in for, and its error.
    pub instead_of: (Rung, f64),
    /// What a stream declares, with 0 for an id.
    pub(super) track: codec::Track,
    pub(super) transform: Transform,
    pub(super) buckets: Vec<Bucket>,
    pub(super) cells: Vec<Cell>,
}

impl Plan<'_> {
    /// Gives points to each instance whose rung misses the tolerance: the fewest that are tried within it, or, where all
    /// miss it, as many as lower the error. Where no points err less than the rung it stays.
    ///
    /// `baked` is what [`Plan::fit`] made of `traced`, and `world` is at the pose of the plan. Without a tolerance
    /// nothing changes.
    ///
    /// # Errors
    /// As [`Server::new`] and [`Plan::trace`].
    pub fn escalate(&self, world: &World, traced: &[Traced], baked: &mut Baked) -> Result<()> {
        let Some(tolerance) = self.settings.tolerance else {
            return Ok(());
        };
        let choices = baked.choices.iter().enumerate();
        let missing = choices.filter(|(_, choice)| choice.error().is_some_and(|e| e > tolerance));
        let mut open: BTreeSet<usize> = missing.map(|(instance, _)| instance).collect();
        let gathers = self.by_instance(traced);
        let mut best: BTreeMap<usize, InstancePoints> = BTreeMap::new();
        for share in SHARES {
            open.retain(|instance| self.area(*instance) * self.density(share) <= MAX_CANDIDATES);
            if open.is_empty() {
                break;
            }
            let server = self.points(world, share, &open)?;
            for track in server.tracks() {
                let instance = track.instance;
                let (samples, numbers) =
                    self.ladder_samples(instance, self.sites(instance), &gathers[instance]);
                let error = self.points_error(track, &samples, &numbers);
                let choice = &baked.choices[instance];
                let before = choice.error().unwrap_or(f64::INFINITY);
                let known = best.get(&instance).map_or(before, |best| best.error);
                let gains = error <= GAIN * known;
                if gains {
                    let points = InstancePoints {
                        instance,
                        density: track.density().candidates,
                        points: track.store.used_points(),
                        error,
                        instead_of: (choice.rung, before),
                        track: declare(self.scene, 0, track),
                        transform: transform(track, self.pose),
                        buckets: track.store.buckets().to_vec(),
                        cells: track.store.cells().to_vec(),
                    };
                    best.insert(instance, points);
                }
                // The first density may be too low to gain.
                let is_stuck = !gains && best.contains_key(&instance);
                if error <= tolerance || is_stuck {
                    open.remove(&instance);
                }
            }
        }
        for points in best.values() {
            let choice = &mut baked.choices[points.instance];
            choice.rung = Rung::Points;
            choice.ladder.rungs.push(Measured {
                rung: Rung::Points,
                error: points.error,
                functions: Vec::new(),
            });
        }
        baked.points = best.into_values().collect();
        Ok(())
    }

    /// Points on some instances, with values.
    fn points(&self, world: &World, share: f32, takes: &BTreeSet<usize>) -> Result<Server> {
        let fitted = Options::for_scene(self.scene);
        let options = Options {
            density: Density {
                candidates: self.density(share) as f32,
                ..fitted.density
            },
            // The pose of the bake alone.
            span: 0.0,
            // Deforming meshes are looked up at rest, as values at vertices are.
            space: Space::Rest,
            min_ao: 0,
            visibility: false,
            ..fitted
        };
        let mut server = Server::of_instances(world, options, &|i| takes.contains(&i))?;
        let tone = &self.settings.tone;
        let kernels = self.settings.vertices.kernels.len();
        self.with_obscurance(self.settings.vertices.rays, |obscurance| {
            server.fill(world, &|surface, seed| {
                let gather = obscurance.at_surface(surface, seed);
                let shown = || tone.shown(&tone.apply(&gather.values[..kernels]));
                gather.is_valid().then(shown)
            });
        })?;
        Ok(server)
    }

    /// Candidates per square metre.
    fn density(&self, share: f32) -> f64 {
        f64::from(share * Options::for_scene(self.scene).density.candidates)
    }

    /// Square metres that an instance's samples stand for.
    fn area(&self, instance: usize) -> f64 {
        self.sites(instance).iter().map(|site| site.area).sum()
    }

    /// The error of points as a client looks them up, over held-out samples.
    fn points_error(&self, track: &Track, samples: &[Sample], numbers: &[usize]) -> f64 {
        let grid: &Grid = track.store.grid();
        let (buckets, cells) = (track.store.buckets(), track.store.cells());
        let sites = self.sites(track.instance);
        ladder::error(samples, &self.settings.tone, |i| {
            let site: &Site = &sites[numbers[i]];
            let surface = site.surface(self.scene, self.pose, track.instance);
            let (x, n) = to_grid(grid, surface.rest_position, surface.rest_normal);
            vec![sample(grid, buckets, cells, x, n, Fallback::Fill).ao]
        })
    }
}
