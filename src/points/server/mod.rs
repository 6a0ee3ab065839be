//! The server (PSAO §3.1-3.3): keeps the ambient occlusion of every point that the client may look
//! at up to date, and touches nothing else.
//!
//! [`layout`] places the points; a tick marks what movers can reach and picks what the client can
//! see ([`select`]), traces it, and stores what changed enough ([`track`]).

mod fit;
pub mod hidden;
mod layout;
mod options;
mod select;
mod track;

pub use options::{Options, Space};
pub use track::Track;

use super::chunks::AabbTree;
use super::frustum::Frustum;
use crate::Result;
use crate::rng::Rng;
use crate::scene::{Pose, Surface};
use crate::world::World;
use hidden::Openness;
use layout::{placing_pose, templates};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};
use track::TracedPoint;

/// Poses looked at to size the grid of a deforming mesh.
const SAMPLED_POSES: usize = 48;
/// Their spacing as a share of the animation: the golden ratio falls in step with no cycle.
const POSE_SPACING: f64 = 0.618_033_988_749_894_8;
/// Points traced at once; bounds the memory of a tick.
const BLOCK: usize = 1 << 16;

/// What one tick did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tick {
    /// Points that were traced again.
    pub traced_points: usize,
    pub rays: u64,
    /// Points whose change passed the threshold.
    pub changed_points: usize,
    /// Points still waiting: out of view, or beyond the budget.
    pub waiting_points: usize,
    /// Finding the points that movers can reach and the client can see.
    pub select_time: Duration,
    pub trace_time: Duration,
    /// Buckets and cells.
    pub store_time: Duration,
}

/// The server's state: everything that the client holds, and what may have changed since. All calls
/// take a world of one scene.
#[derive(Clone, Debug)]
pub struct Server {
    options: Options,
    tracks: Vec<Track>,
    /// Chunks of instances that never move, as (track, chunk), and their tree in world space.
    still_chunks: Arc<Vec<(u32, u32)>>,
    still_tree: Arc<AabbTree>,
    /// Where the round-robin goes on.
    cursor: (usize, u32),
    placing_time: Duration,
    /// Of the last [`Server::leave`].
    leave_time: Duration,
    startup_rays: u64,
}

impl Server {
    /// Places all points and lays out grids and hashes; traces nothing yet. `world` is at the first
    /// frame.
    pub fn new(world: &World, options: Options) -> Result<Self> {
        Self::of_instances(world, options, &|_| true)
    }

    /// [`Server::new`] with points on the instances of the scene that `takes` picks.
    pub fn of_instances(
        world: &World,
        options: Options,
        takes: &dyn Fn(usize) -> bool,
    ) -> Result<Self> {
        let clock = Instant::now();
        let (scene, pose) = (world.scene(), world.pose());
        let rest = scene.rest_pose();
        let samples: Vec<Pose> = if scene
            .instances
            .iter()
            .enumerate()
            .any(|(i, _)| scene.is_deforming_instance(i))
        {
            (0..SAMPLED_POSES)
                .map(|k| scene.pose(scene.duration as f64 * (k as f64 * POSE_SPACING).fract()))
                .collect()
        } else {
            Vec::new()
        };

        let placing = placing_pose(scene, &rest, &samples, pose.time, &options);
        let templates = templates(scene, &rest, &placing, &options, takes)?;
        let tracks: Vec<Track> = (0..scene.instances.len())
            .into_par_iter()
            .filter_map(|i| {
                let template = templates.of_instance[i].clone()?;
                (!template.placement.points.is_empty())
                    .then(|| layout::track(scene, &rest, &samples, i, template, &options))
            })
            .collect::<Result<_>>()?;
        let mut still_chunks = Vec::new();
        let mut still_bounds = Vec::new();
        for (t, track) in tracks.iter().enumerate() {
            if !track.movable {
                let world = pose.world_from_mesh[track.instance];
                for (c, b) in track.template.chunks.bounds.iter().enumerate() {
                    still_chunks.push((t as u32, c as u32));
                    still_bounds.push(b.transformed(&world));
                }
            }
        }
        Ok(Server {
            options,
            tracks,
            still_chunks: Arc::new(still_chunks),
            still_tree: Arc::new(AabbTree::new(&still_bounds)),
            cursor: (0, 0),
            placing_time: clock.elapsed(),
            leave_time: Duration::ZERO,
            startup_rays: 0,
        })
    }

    /// How long points and grids took.
    pub fn placing_time(&self) -> Duration {
        self.placing_time
    }

    /// Rays of [`Server::start`].
    pub fn startup_rays(&self) -> u64 {
        self.startup_rays
    }

    pub fn options(&self) -> &Options {
        &self.options
    }

    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    pub fn tracks_mut(&mut self) -> &mut [Track] {
        &mut self.tracks
    }

    /// Traces every point once, in view or not: what a client starts from.
    pub fn start(&mut self, world: &World, progress: &mut dyn FnMut(usize, usize)) -> Tick {
        for track in &mut self.tracks {
            track.mark_all();
        }
        let mut tick = Tick::default();
        let chosen = self.choose(world, None, None, &mut tick);
        self.trace(world, &chosen, &mut tick, progress);
        self.startup_rays = tick.rays;
        tick
    }

    /// Gives every point a value that is not this server's own: that of `value`, by the surface that the point lies on
    /// and the seed of its rays. A point without one is left out.
    pub fn fill(&mut self, world: &World, value: &(dyn Fn(&Surface, u32) -> Option<f32> + Sync)) {
        let (scene, pose, options) = (world.scene(), world.pose(), self.options);
        for (t, track) in self.tracks.iter_mut().enumerate() {
            let shared = &*track;
            let filled: Vec<TracedPoint> = (0..shared.points() as u32)
                .into_par_iter()
                .filter_map(|point| {
                    let at = shared.surface(scene, pose, point);
                    let ao = value(&at, point_seed(options.seed, t, point))?;
                    Some(shared.traced(t, point, &at, Openness::open(ao), 0))
                })
                .collect();
            for point in &filled {
                track.apply(point, &options);
            }
        }
    }

    /// Marks what is about to move where it still is: occlusion changes where a mover left as well as
    /// where it comes to. To be called while the world advances.
    pub fn leave(&mut self, world: &World) {
        let clock = Instant::now();
        self.mark_reached(world);
        self.leave_time = clock.elapsed();
    }

    /// Brings every point up to date that something that moved can reach and that the world's camera
    /// can see. A point that is reached out of view is remembered and traced when it comes into
    /// view; one that nothing reached keeps its value.
    pub fn tick(&mut self, world: &World) -> Tick {
        let mut tick = Tick::default();
        let clock = Instant::now();
        self.mark_reached(world);
        let frustum = world
            .camera
            .filter(|_| self.options.visibility)
            .map(|c| Frustum::new(&c, self.options.aspect, self.options.margin));
        let budget = self.options.budget;
        let chosen = self.choose(world, frustum.as_ref(), budget, &mut tick);
        tick.select_time = std::mem::take(&mut self.leave_time) + clock.elapsed();
        self.trace(world, &chosen, &mut tick, &mut |_, _| {});
        tick
    }

    /// Advances a world that only this server follows, and brings the points up to date.
    pub fn advance(&mut self, world: &mut World, time: f64) -> Tick {
        world.advance(time, |world| self.leave(world));
        self.tick(world)
    }

    /// Traces the chosen points and stores those that changed enough.
    fn trace(
        &mut self,
        world: &World,
        chosen: &[(usize, u32)],
        tick: &mut Tick,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        let (scene, options) = (world.scene(), self.options);
        let (tracer, pose) = (world.tracer(), world.pose());
        for (k, block) in chosen.chunks(BLOCK).enumerate() {
            progress(k * BLOCK, chosen.len());
            let clock = Instant::now();
            let tracks = &self.tracks;
            let traced: Vec<TracedPoint> = block
                .par_iter()
                .map(|&(t, point)| {
                    let track = &tracks[t];
                    let at = track.surface(scene, pose, point);
                    let mut rays = 0;
                    let openness = Openness::trace(&options, track.radius(), |distance| {
                        rays += options.rays;
                        tracer.ambient_occlusion(
                            at.position,
                            at.geometric_normal,
                            at.normal,
                            options.rays,
                            distance,
                            point_seed(options.seed, t, point),
                        )
                    });
                    track.traced(t, point, &at, openness, rays)
                })
                .collect();
            tick.trace_time += clock.elapsed();

            let clock = Instant::now();
            for p in &traced {
                tick.rays += u64::from(p.rays);
                tick.changed_points += self.tracks[p.track].apply(p, &options) as usize;
            }
            tick.store_time += clock.elapsed();
        }
        tick.traced_points += chosen.len();
        progress(chosen.len(), chosen.len());
    }
}

/// The sequence of a point depends on nothing but its number, so that its value never flickers.
fn point_seed(seed: u64, track: usize, point: u32) -> u32 {
    Rng::new(seed ^ (track as u64) << 32 ^ point as u64).draw() as u32
}
#[cfg(test)]
mod tests;
