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
use super::rng::Rng;
use crate::Result;
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::Tracer;
use hidden::Openness;
use layout::{is_movable, placing_pose, templates};
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
    /// Animation and skinning.
    pub pose_time: Duration,
    /// Acceleration structures.
    pub update_time: Duration,
    /// Finding the points that movers can reach and the client can see.
    pub select_time: Duration,
    pub trace_time: Duration,
    /// Buckets and cells.
    pub store_time: Duration,
}

/// The server's state: everything that the client holds, and what may have changed since.
pub struct Server<'s> {
    scene: &'s Scene,
    options: Options,
    tracer: Tracer<'s>,
    pose: Pose,
    tracks: Vec<Track>,
    /// Chunks of instances that never move, as (track, chunk), and their tree in world space.
    still_chunks: Arc<Vec<(u32, u32)>>,
    still_tree: Arc<AabbTree>,
    /// Where the round-robin goes on.
    cursor: (usize, u32),
    placing_time: Duration,
}

impl<'s> Server<'s> {
    /// Places all points and lays out grids and hashes; traces nothing yet. The scene starts at
    /// `time` seconds.
    pub fn new(scene: &'s Scene, options: Options, time: f64) -> Result<Self> {
        let clock = Instant::now();
        let rest = scene.rest_pose();
        let pose = scene.pose(time);
        let tracer = Tracer::new(scene, &pose);
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

        let placing = placing_pose(scene, &rest, &samples, time, &options);
        let templates = templates(scene, &rest, &placing, &options)?;
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
            scene,
            options,
            tracer,
            pose,
            tracks,
            still_chunks: Arc::new(still_chunks),
            still_tree: Arc::new(AabbTree::new(&still_bounds)),
            cursor: (0, 0),
            placing_time: clock.elapsed(),
        })
    }

    /// How long points, grids and acceleration structures took.
    pub fn placing_time(&self) -> Duration {
        self.placing_time
    }

    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// A clone with its traced values; nothing is traced again.
    pub fn fork(&self) -> Self {
        Server {
            scene: self.scene,
            options: self.options,
            tracer: Tracer::new(self.scene, &self.pose),
            pose: self.pose.clone(),
            tracks: self.tracks.clone(),
            still_chunks: self.still_chunks.clone(),
            still_tree: self.still_tree.clone(),
            cursor: self.cursor,
            placing_time: self.placing_time,
        }
    }

    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    pub fn tracks_mut(&mut self) -> &mut [Track] {
        &mut self.tracks
    }

    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    pub fn tracer(&self) -> &Tracer<'s> {
        &self.tracer
    }

    /// Traces every point once, in view or not: what a client starts from.
    pub fn start(&mut self, progress: &mut dyn FnMut(usize, usize)) -> Tick {
        for track in &mut self.tracks {
            track.mark_all();
        }
        let mut tick = Tick::default();
        let chosen = self.choose(None, None, &mut tick);
        self.trace(&chosen, &mut tick, progress);
        tick
    }

    /// Moves the scene to `time` and brings every point up to date that something that moved can
    /// reach and that `camera` can see. A point that is reached out of view is remembered and traced
    /// when it comes into view; one that nothing reached keeps its value.
    pub fn tick(&mut self, time: f64, camera: Option<&CameraPose>) -> Tick {
        match camera {
            None => self.advance(time, |_| None),
            Some(camera) => self.advance(time, |_| Some(*camera)),
        }
    }

    /// [`Server::tick`] for a camera that moves with the scene.
    pub fn tick_seen(&mut self, time: f64, camera: impl Fn(&Pose) -> CameraPose) -> Tick {
        self.advance(time, |pose| Some(camera(pose)))
    }

    fn advance(&mut self, time: f64, camera: impl Fn(&Pose) -> Option<CameraPose>) -> Tick {
        let mut tick = Tick::default();
        let clock = Instant::now();
        let mut next = std::mem::take(&mut self.pose);
        let last = next.clone();
        self.scene.pose_into(time, &mut next);
        self.pose = next;
        tick.pose_time = clock.elapsed();

        let clock = Instant::now();
        let movers: Vec<usize> = (0..self.scene.instances.len())
            .filter(|&i| {
                is_movable(self.scene, i)
                    && (last.world_from_mesh[i] != self.pose.world_from_mesh[i]
                        || last.deformed[i] != self.pose.deformed[i])
            })
            .collect();
        // Occlusion changes where a mover left as well as where it arrived.
        let pose = std::mem::take(&mut self.pose);
        self.mark_reached(&movers, &last, &pose);
        self.pose = pose;
        let select = clock.elapsed();
        let clock = Instant::now();
        if !movers.is_empty() {
            self.tracer.update(&self.pose);
        }
        tick.update_time = clock.elapsed();
        let clock = Instant::now();
        let pose = std::mem::take(&mut self.pose);
        self.mark_reached(&movers, &pose, &last);
        self.pose = pose;
        let frustum = camera(&self.pose)
            .filter(|_| self.options.visibility)
            .map(|c| Frustum::new(&c, self.options.aspect, self.options.margin));
        let chosen = self.choose(frustum.as_ref(), self.options.budget, &mut tick);
        tick.select_time = select + clock.elapsed();

        self.trace(&chosen, &mut tick, &mut |_, _| {});
        tick
    }

    /// Traces the chosen points and stores those that changed enough.
    fn trace(
        &mut self,
        chosen: &[(usize, u32)],
        tick: &mut Tick,
        progress: &mut dyn FnMut(usize, usize),
    ) {
        let (scene, options) = (self.scene, self.options);
        for (k, block) in chosen.chunks(BLOCK).enumerate() {
            progress(k * BLOCK, chosen.len());
            let clock = Instant::now();
            let (tracks, tracer, pose) = (&self.tracks, &self.tracer, &self.pose);
            let traced: Vec<TracedPoint> = block
                .par_iter()
                .map(|&(t, point)| {
                    let track = &tracks[t];
                    let on_mesh = &track.template.placement.points[point as usize];
                    let triangle = on_mesh.triangle as usize;
                    let mut at =
                        scene.surface(pose, track.instance, triangle, on_mesh.u, on_mesh.v);
                    if on_mesh.back {
                        at = at.flipped();
                    }
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
                    let (position, normal) = if track.looks_up_rest_pose() {
                        (at.rest_position, at.rest_normal)
                    } else {
                        (at.mesh_position, at.mesh_normal)
                    };
                    TracedPoint {
                        track: t,
                        point,
                        openness,
                        rays,
                        position: track.to_grid.position(position),
                        normal: track.to_grid.normal(normal),
                    }
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
