//! The server (PSAO §3.1-3.3): keeps the ambient occlusion of every point that the client may look
//! at up to date, and touches nothing else.

use super::chunks::{AabbTree, Chunks};
use super::frustum::Frustum;
use super::grid::{self, Extent};
use super::place::{Density, Placement, area, place};
use super::rng::Rng;
use super::sample::GridTransform;
use super::store::{Overflow, Store};
use crate::codec::Limits;
use crate::codec::points::{Bucket, Cell, PointWidths};
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::offset::OFFSET_PER_METRE;
use crate::trace::{Aabb, Tracer};
use crate::{Error, Result};
use glam::{Affine3A, Mat3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A deforming point is sent again when it moved farther than this share of the interpolation
/// radius: two steps of a 32-bit point's position.
const MOVED: f32 = 1.0 / 8.0;
/// ... or when its normal turned by more than this cosine (8 degrees, about the mean error of a
/// 4+4 bit octahedral normal).
const TURNED: f32 = 0.990;
/// Poses looked at to size the grid of a deforming mesh.
const SAMPLED_POSES: usize = 48;
/// Their spacing as a share of the animation: the golden ratio falls in step with no cycle.
const POSE_SPACING: f64 = 0.618_033_988_749_894_8;
/// Entries left free in every bucket of a deforming mesh, for the poses that were not looked at.
const POSED_SPARE: u32 = 2;
/// Most candidates that are placed in a scene, all instances together: about 4 GB of memory at
/// the worst, and as many points as a decoder's default limits accept.
const MAX_CANDIDATES: f64 = (1u32 << 25) as f64;
/// Rest shapes that differ by less than this share of their size hold the same points.
const SAME_SHAPE: f32 = 1e-4;
/// Points traced at once; bounds the memory of a tick.
const BLOCK: usize = 1 << 16;

/// In which shape of a deforming mesh its points live.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Space {
    /// The shape of the last frame: points move through the grid, as in the paper.
    #[default]
    Posed,
    /// The rest pose: points never move, and the client looks fragments up by their rest position.
    Rest,
}

/// What happens to points that no ray leaves: under a box, or where meshes interpenetrate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Buried {
    /// They are left out for as long as they are buried. What can be seen is not closed to all
    /// sides, so such a point only leaks darkness onto its visible neighbours.
    #[default]
    Omit,
    /// They are kept with AO = 0, as in the paper.
    Keep,
}

/// What the server is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    pub density: Density,
    /// Rays a point.
    pub rays: u32,
    /// Length of an occlusion ray in metres (PSAO §4).
    pub distance: f32,
    /// A point is sent when its AO differs from the last value sent by at least this much, in 0..1.
    pub threshold: f32,
    pub widths: PointWidths,
    pub overflow: Overflow,
    pub space: Space,
    pub buried: Buried,
    pub seed: u64,
    /// Skip points outside the client's extended field of view.
    pub visibility: bool,
    /// Radians by which each half angle of the field of view is widened.
    pub margin: f32,
    /// Width over height of the client's picture.
    pub aspect: f32,
    /// At most this many points are traced in a tick, round-robin (PSAO §5); the rest wait.
    pub budget: Option<usize>,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            density: Density { candidates: 1024.0, thinning: 2.0 },
            rays: 128,
            distance: 0.6,
            threshold: 4.0 / 255.0,
            widths: PointWidths::BITS_32,
            overflow: Overflow::Chain,
            space: Space::Posed,
            buried: Buried::Omit,
            seed: 0,
            visibility: true,
            margin: 10f32.to_radians(),
            aspect: 16.0 / 9.0,
            budget: None,
        }
    }
}

/// What all instances of one mesh at one scale share.
#[derive(Debug)]
struct Template {
    mesh: usize,
    scale: Mat3,
    placement: Placement,
    /// Mesh-space position of each site in the rest pose.
    positions: Vec<Vec3>,
    chunks: Chunks,
}

/// The points of one instance.
#[derive(Clone, Debug)]
pub struct Track {
    pub instance: usize,
    template: Arc<Template>,
    to_grid: GridTransform,
    /// Follows the posed vertices rather than the rest pose.
    posed: bool,
    deforms: bool,
    movable: bool,
    pub store: Store,
    /// AO last sent, in steps of 1/255.
    sent_ao: Vec<u8>,
    /// Where a posed point was when it was last sent: grid position and normal.
    sent_at: Vec<(Vec3, Vec3)>,
    stale: Vec<bool>,
    stale_chunks: Vec<u32>,
    chunk_is_stale: Vec<bool>,
}

impl Track {
    pub fn points(&self) -> usize {
        self.template.placement.sites.len()
    }

    pub fn candidates(&self) -> usize {
        self.template.placement.candidates
    }

    /// Bounds of the points in the rest pose, in mesh space.
    pub fn mesh_bounds(&self) -> Aabb {
        self.template.chunks.bounds.iter().fold(Aabb::EMPTY, |a, b| a.union(b))
    }

    pub fn mesh_from_grid(&self) -> Affine3A {
        self.to_grid.inverse()
    }

    pub fn looks_up_rest_pose(&self) -> bool {
        self.deforms && !self.posed
    }

    fn mark_chunk(&mut self, chunk: u32, mut reached: impl FnMut(Vec3) -> bool) {
        let mut any = false;
        for &p in self.template.chunks.points(chunk) {
            if !self.stale[p as usize] && reached(self.template.positions[p as usize]) {
                self.stale[p as usize] = true;
                any = true;
            }
        }
        if any && !std::mem::replace(&mut self.chunk_is_stale[chunk as usize], true) {
            self.stale_chunks.push(chunk);
        }
    }

    fn mark_all(&mut self) {
        for chunk in 0..self.template.chunks.bounds.len() as u32 {
            self.mark_chunk(chunk, |_| true);
        }
    }
}

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
    /// Track of each instance, if it has points.
    track_of: Vec<Option<usize>>,
    /// Chunks of instances that never move, as (track, chunk), and their tree in world space.
    still_chunks: Arc<Vec<(u32, u32)>>,
    still_tree: Arc<AabbTree>,
    /// Where the round-robin goes on.
    cursor: (usize, u32),
    placing_time: Duration,
}

/// A point as the tracing stage sees it.
struct Traced {
    track: usize,
    point: u32,
    ao: f32,
    position: Vec3,
    normal: Vec3,
}

impl<'s> Server<'s> {
    /// Places all points and lays out grids and hashes; traces nothing yet. The scene starts at
    /// `time` seconds.
    pub fn new(scene: &'s Scene, options: Options, time: f64) -> Result<Self> {
        let clock = Instant::now();
        let rest = scene.rest_pose();
        let pose = scene.pose(time);
        let tracer = Tracer::new(scene, &pose);
        let templates = templates(scene, &rest, &pose, &options)?;
        let samples: Vec<Pose> = if scene.instances.iter().enumerate().any(|(i, _)| scene.is_deforming_instance(i)) {
            (0..SAMPLED_POSES)
                .map(|k| scene.pose(scene.duration as f64 * (k as f64 * POSE_SPACING).fract()))
                .collect()
        } else {
            Vec::new()
        };

        let tracks: Vec<Track> = (0..scene.instances.len())
            .into_par_iter()
            .filter_map(|i| {
                let template = templates.of_instance[i].clone()?;
                (!template.placement.sites.is_empty())
                    .then(|| track(scene, &rest, &samples, i, template, &options))
            })
            .collect::<Result<_>>()?;
        check_size(&tracks)?;
        let mut track_of = vec![None; scene.instances.len()];
        let mut still_chunks = Vec::new();
        let mut still_bounds = Vec::new();
        for (t, track) in tracks.iter().enumerate() {
            track_of[track.instance] = Some(t);
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
            track_of,
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

    /// A copy that goes its own way: the points keep their values, nothing is traced again.
    pub fn fork(&self) -> Self {
        Server {
            scene: self.scene,
            options: self.options,
            tracer: Tracer::new(self.scene, &self.pose),
            pose: self.pose.clone(),
            tracks: self.tracks.clone(),
            track_of: self.track_of.clone(),
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

    /// Index of the track that holds an instance's points.
    pub fn track_of(&self) -> &[Option<usize>] {
        &self.track_of
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
        self.mark_reached(&movers, &last);
        let select = clock.elapsed();
        let clock = Instant::now();
        if !movers.is_empty() {
            self.tracer.update(&self.pose);
        }
        tick.update_time = clock.elapsed();
        let clock = Instant::now();
        let pose = std::mem::take(&mut self.pose);
        self.mark_reached(&movers, &pose);
        self.pose = pose;
        let frustum = camera(&self.pose)
            .filter(|_| self.options.visibility)
            .map(|c| Frustum::new(&c, self.options.aspect, self.options.margin));
        let chosen = self.choose(frustum.as_ref(), self.options.budget, &mut tick);
        tick.select_time = select + clock.elapsed();

        self.trace(&chosen, &mut tick, &mut |_, _| {});
        tick
    }

    /// Marks as stale what the movers can reach in the tracer's present pose, which is `pose`.
    fn mark_reached(&mut self, movers: &[usize], pose: &Pose) {
        let (tracer, distance) = (&self.tracer, self.options.distance);
        // How far from a point's surface its rays may end at a mover: they start off the surface,
        // and the end is rounded no worse than what that offset makes up for.
        let reach_to = |mover: &Aabb| {
            let size = (mover.reach() + distance).max(tracer.reach());
            distance * (1.0 + 1e-5) + 2.0 * OFFSET_PER_METRE * size
        };
        let bounds: Vec<Aabb> =
            (0..if movers.is_empty() { 0 } else { self.scene.instances.len() }).map(|i| tracer.bounds(i)).collect();
        for &mover in movers {
            let near = bounds[mover];
            let reach = reach_to(&near);
            let still = &self.still_chunks;
            let tracks = &mut self.tracks;
            self.still_tree.near(&near, reach, |item| {
                let (t, chunk) = still[item as usize];
                let track = &mut tracks[t as usize];
                let world = pose.world_from_mesh[track.instance];
                let sphere = track.template.chunks.bounds[chunk as usize].transformed(&world);
                if tracer.within(mover, sphere.centre(), sphere.radius() + reach) {
                    track.mark_chunk(chunk, |p| near.distance_squared(world.transform_point3(p)) <= reach * reach);
                }
            });
        }
        // Points that move themselves: what matters is who is near and moves against them.
        let is_mover = {
            let mut flags = vec![false; self.scene.instances.len()];
            movers.iter().for_each(|&m| flags[m] = true);
            flags
        };
        for track in self.tracks.iter_mut().filter(|t| t.movable) {
            let own = track.instance;
            if track.deforms && is_mover[own] {
                track.mark_all();
                continue;
            }
            let world = pose.world_from_mesh[own];
            let others = (0..bounds.len()).filter(|&i| {
                let reach = reach_to(&bounds[i]);
                i != own && (is_mover[own] || is_mover[i]) && bounds[i].gap_squared(&bounds[own]) <= reach * reach
            });
            for other in others {
                if track.deforms {
                    // Its chunks are bounded in the rest pose only.
                    track.mark_all();
                    break;
                }
                let near = bounds[other];
                let reach = reach_to(&near);
                for chunk in 0..track.template.chunks.bounds.len() as u32 {
                    let sphere = track.template.chunks.bounds[chunk as usize].transformed(&world);
                    if sphere.gap_squared(&near) <= reach * reach
                        && tracer.within(other, sphere.centre(), sphere.radius() + reach)
                    {
                        track.mark_chunk(chunk, |p| near.distance_squared(world.transform_point3(p)) <= reach * reach);
                    }
                }
            }
        }
    }

    /// Takes the stale points in view off the list, at most `budget`, round-robin.
    fn choose(
        &mut self,
        frustum: Option<&Frustum>,
        budget: Option<usize>,
        tick: &mut Tick,
    ) -> Vec<(usize, u32)> {
        let mut chosen = Vec::new();
        let mut waiting = 0;
        for (t, track) in self.tracks.iter_mut().enumerate() {
            if track.stale_chunks.is_empty() {
                continue;
            }
            track.stale_chunks.sort_unstable();
            let world = self.pose.world_from_mesh[track.instance];
            let deformed = self.pose.deformed[track.instance].as_ref();
            for &chunk in &track.stale_chunks {
                let bounds = track.template.chunks.bounds[chunk as usize].transformed(&world);
                // Chunks are bounded in the rest pose; deformed ones are tested point by point.
                let chunk_seen = deformed.is_some() || frustum.is_none_or(|f| f.touches(&bounds));
                for &p in track.template.chunks.points(chunk) {
                    if !track.stale[p as usize] {
                        continue;
                    }
                    let seen = chunk_seen
                        && frustum.is_none_or(|f| {
                            let at = match deformed {
                                None => track.template.positions[p as usize],
                                Some(d) => {
                                    let mesh = &self.scene.meshes[track.template.mesh];
                                    let site = &track.template.placement.sites[p as usize];
                                    site.on(&mesh.triangles, &d.positions)
                                }
                            };
                            f.contains(world.transform_point3(at))
                        });
                    if seen {
                        chosen.push((t, p));
                    } else {
                        waiting += 1;
                    }
                }
            }
        }
        if let Some(budget) = budget.filter(|&b| b < chosen.len()) {
            chosen.sort_unstable();
            let from = chosen.partition_point(|c| *c < self.cursor);
            chosen.rotate_left(from);
            waiting += chosen.len() - budget;
            self.cursor = chosen[budget];
            chosen.truncate(budget);
        }
        for &(t, p) in &chosen {
            self.tracks[t].stale[p as usize] = false;
        }
        for track in self.tracks.iter_mut().filter(|t| !t.stale_chunks.is_empty()) {
            let (chunks, stale) = (&track.template.chunks, &track.stale);
            let flags = &mut track.chunk_is_stale;
            track.stale_chunks.retain(|&c| {
                let keep = chunks.points(c).iter().any(|&p| stale[p as usize]);
                flags[c as usize] = keep;
                keep
            });
        }
        tick.waiting_points = waiting;
        chosen
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
            let traced: Vec<Traced> = block
                .par_iter()
                .map(|&(t, point)| {
                    let track = &tracks[t];
                    let site = &track.template.placement.sites[point as usize];
                    let triangle = site.triangle as usize;
                    let mut at = scene.surface(pose, track.instance, triangle, site.u, site.v);
                    if site.back {
                        at = at.flipped();
                    }
                    let ao = tracer.ambient_occlusion(
                        at.position,
                        at.geometric_normal,
                        at.normal,
                        options.rays,
                        options.distance,
                        point_seed(options.seed, t, point),
                    );
                    let (position, normal) = if track.looks_up_rest_pose() {
                        (at.rest_position, at.rest_normal)
                    } else {
                        (at.mesh_position, at.mesh_normal)
                    };
                    Traced {
                        track: t,
                        point,
                        ao,
                        position: track.to_grid.position(position),
                        normal: track.to_grid.normal(normal),
                    }
                })
                .collect();
            tick.trace_time += clock.elapsed();

            let clock = Instant::now();
            for p in &traced {
                tick.changed_points += self.tracks[p.track].apply(p, &options) as usize;
            }
            tick.store_time += clock.elapsed();
        }
        tick.traced_points += chosen.len();
        tick.rays += chosen.len() as u64 * options.rays as u64;
        progress(chosen.len(), chosen.len());
    }
}

impl Track {
    /// Stores a traced point if it differs enough from what was last sent (PSAO §3.3).
    fn apply(&mut self, p: &Traced, options: &Options) -> bool {
        let i = p.point as usize;
        let ao = (p.ao * 255.0).round() as u8;
        let had = self.store.has(p.point);
        if ao == 0 && options.buried == Buried::Omit {
            self.store.unset(p.point);
            self.sent_ao[i] = 0;
            return had;
        }
        if had {
            let brighter = (ao as f32 - self.sent_ao[i] as f32).abs() / 255.0;
            let moved = self.posed && {
                let (position, normal) = self.sent_at[i];
                position.distance(p.position) > MOVED * self.store.grid().radius
                    || normal.dot(p.normal) < TURNED
            };
            if !moved && (brighter < options.threshold || brighter == 0.0) {
                return false;
            }
        }
        self.sent_ao[i] = ao;
        if self.posed {
            self.sent_at[i] = (p.position, p.normal);
        }
        let grid = *self.store.grid();
        let cell = grid::cell_at(&grid, p.position);
        let corner = cell.unwrap_or_default().map(|c| c as f32);
        let inside = p.position / grid.cell_edge - Vec3::from(corner);
        let word = grid.widths.pack(inside.to_array(), p.normal.to_array(), p.ao);
        self.store.set(p.point, cell, word);
        true
    }
}

/// The sequence of a point depends on nothing but its number, so that its value never flickers.
fn point_seed(seed: u64, track: usize, point: u32) -> u32 {
    Rng::new(seed ^ (track as u64) << 32 ^ point as u64).next() as u32
}

/// Lays out the grid, hash and memory of one instance.
fn track(
    scene: &Scene,
    rest: &Pose,
    samples: &[Pose],
    instance: usize,
    template: Arc<Template>,
    options: &Options,
) -> Result<Track> {
    let deforms = scene.is_deformed_instance(instance);
    let posed = deforms && options.space == Space::Posed;
    let mesh = &scene.meshes[template.mesh];
    let sites = &template.placement.sites;
    let scale = if deforms && !posed {
        template.scale * stored_scale(scene, rest, instance)
    } else {
        template.scale
    };
    // Where the points are at every pose looked at, in scaled mesh space.
    let shapes: Vec<Vec<Vec3>> = if posed {
        let poses = samples.iter().chain([rest]);
        poses
            .filter_map(|pose| pose.deformed[instance].as_ref())
            .map(|d| sites.iter().map(|s| scale * s.on(&mesh.triangles, &d.positions)).collect())
            .collect()
    } else {
        // Vertices as stored: what a client has at hand without posing the mesh.
        vec![sites.iter().map(|s| scale * s.on(&mesh.triangles, &mesh.positions)).collect()]
    };
    let mut bounds = Aabb::of(shapes.iter().flatten().copied());
    if posed {
        // Between the sampled poses vertices may reach a little farther.
        let slack = (bounds.max - bounds.min) * 0.1;
        bounds = Aabb { min: bounds.min - slack, max: bounds.max + slack };
    }
    let extent = Extent { min: bounds.min, max: bounds.max };
    let mut grid = grid::lay(extent, scale, options.density.radius(), options.widths)
        .ok_or_else(|| {
            Error::Invalid(format!(
                "instance '{}' is {:.0} m across, which is more cells of {:.3} m than a grid can number; \
                 lower --density or split the mesh",
                scene.instances[instance].name,
                (bounds.max - bounds.min).max_element(),
                2.0 * options.density.radius(),
            ))
        })?;
    let to_grid = GridTransform::new(&grid);
    let origin = to_grid.position(Vec3::ZERO);
    let occupancies: Vec<Vec<([u32; 3], u32)>> = shapes
        .iter()
        .map(|shape| {
            let mut cells: Vec<[u32; 3]> =
                shape.iter().filter_map(|&p| grid::cell_at(&grid, p + origin)).collect();
            cells.sort_unstable();
            cells
                .chunk_by(|a, b| a == b)
                .map(|same| (same[0], options.overflow.cells_for(same.len())))
                .collect()
        })
        .collect();
    grid.bucket_count = grid::search_bucket_count(&grid, &occupancies, if posed { POSED_SPARE } else { 0 });
    let most = occupancies.iter().map(|o| o.iter().map(|c| c.1).sum::<u32>()).max().unwrap_or(0);
    // A point that never moves needs no spare cells; cells that move do.
    grid.cell_capacity = if posed { most + most / 2 + 64 } else { most };

    let points = sites.len();
    let chunks = template.chunks.bounds.len();
    Ok(Track {
        instance,
        to_grid,
        posed,
        deforms,
        movable: is_movable(scene, instance),
        store: Store::new(grid, points, options.overflow),
        sent_ao: vec![0; points],
        sent_at: if posed { vec![(Vec3::ZERO, Vec3::ZERO); points] } else { Vec::new() },
        stale: vec![false; points],
        stale_chunks: Vec::new(),
        chunk_is_stale: vec![false; chunks],
        template,
    })
}

fn is_movable(scene: &Scene, instance: usize) -> bool {
    scene.is_moving_instance(instance) || scene.is_deforming_instance(instance)
}

/// Metres in the bind pose per metre of the stored vertices: inverse bind matrices may hide a scale.
fn stored_scale(scene: &Scene, rest: &Pose, instance: usize) -> f32 {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let area = |positions: &[Vec3]| -> f64 {
        let corners = mesh.triangles.iter().map(|t| t.map(|i| positions[i as usize]));
        corners.map(|[a, b, c]| (b - a).cross(c - a).length() as f64).sum()
    };
    let ratio = (area(rest.shape(scene, instance)) / area(&mesh.positions)).sqrt() as f32;
    if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
}

struct Templates {
    of_instance: Vec<Option<Arc<Template>>>,
}

/// Places points once for every mesh, scale and rest shape; instances that share all three share
/// their points. Skins over one mesh may bind it at different sizes.
fn templates(scene: &Scene, rest: &Pose, pose: &Pose, options: &Options) -> Result<Templates> {
    let mut kinds: Vec<(usize, Mat3, usize)> = Vec::new();
    let mut kinds_of: BTreeMap<(usize, [u32; 9]), Vec<usize>> = BTreeMap::new();
    let of_instance: Vec<Option<usize>> = (0..scene.instances.len())
        .map(|i| {
            let (_, scale) = grid::split(&pose.world_from_mesh[i])?;
            let mesh = scene.instances[i].mesh;
            let alike = kinds_of.entry((mesh, scale_key(scale))).or_default();
            let known = alike.iter().find(|&&k| same_shape(scene, rest, kinds[k].2, i));
            Some(known.copied().unwrap_or_else(|| {
                kinds.push((mesh, scale, i));
                alike.push(kinds.len() - 1);
                kinds.len() - 1
            }))
        })
        .collect();
    let areas: Vec<f64> =
        kinds.par_iter().map(|&(_, scale, instance)| area(scene, rest, instance, scale)).collect();
    check_area(scene, of_instance.iter().flatten().map(|&k| areas[k]).sum(), options.density)?;
    let built: Vec<Arc<Template>> = kinds
        .par_iter()
        .enumerate()
        .map(|(k, &(mesh, scale, instance))| {
            let seed = options.seed ^ Rng::new(k as u64).next();
            let placement = place(scene, rest, instance, scale, options.density, seed);
            let triangles = &scene.meshes[mesh].triangles;
            let shape = rest.shape(scene, instance);
            let positions: Vec<Vec3> =
                placement.sites.iter().map(|s| s.on(triangles, shape)).collect();
            Arc::new(Template { mesh, scale, chunks: Chunks::new(&positions), placement, positions })
        })
        .collect();
    Ok(Templates { of_instance: of_instance.iter().map(|k| k.map(|k| built[k].clone())).collect() })
}

/// Whether two instances of one mesh have the same vertices at rest.
fn same_shape(scene: &Scene, rest: &Pose, a: usize, b: usize) -> bool {
    if rest.deformed[a].is_none() && rest.deformed[b].is_none() {
        return true;
    }
    let (a, b) = (rest.shape(scene, a), rest.shape(scene, b));
    let bounds = Aabb::of(a.iter().copied());
    let tolerance = (bounds.max - bounds.min).length() * SAME_SHAPE;
    a.iter().zip(b).all(|(a, b)| a.abs_diff_eq(*b, tolerance))
}

/// Refuses more surface than memory holds points for, before anything is placed.
fn check_area(scene: &Scene, area: f64, density: Density) -> Result<()> {
    let candidates = area * density.candidates as f64;
    if candidates <= MAX_CANDIDATES {
        return Ok(());
    }
    let mend = if area.is_finite() {
        format!("; lower the density to at most {:.3e}", MAX_CANDIDATES / area)
    } else {
        String::new()
    };
    Err(Error::Invalid(format!(
        "{}: {area:.3e} m2 of surface at {} candidates per m2 make more than {MAX_CANDIDATES} \
         candidates{mend}",
        scene.name, density.candidates
    )))
}

/// Refuses a state that no decoder with the default limits would take.
fn check_size(tracks: &[Track]) -> Result<()> {
    let limits = Limits::default();
    // A keyframe of one track is one record, in which everything travels with its index.
    let size = |t: &Track| -> u64 {
        let (buckets, cells) = (t.store.buckets().len(), t.store.cells().len());
        (buckets * (4 + size_of::<Bucket>()) + cells * (4 + size_of::<Cell>())) as u64
    };
    let all: u64 = tracks.iter().map(size).sum();
    let largest = tracks.iter().map(size).max().unwrap_or(0);
    for (bytes, allowed, what) in [
        (all, u64::from(limits.frame_bytes).min(limits.state_bytes), "all points take"),
        (largest, u64::from(limits.unpacked_bytes.min(limits.stored_bytes)), "the points of one mesh take"),
    ] {
        if bytes > allowed {
            return Err(Error::Invalid(format!(
                "{what} {} MiB, and decoders accept {} MiB; lower the density",
                bytes >> 20,
                allowed >> 20
            )));
        }
    }
    Ok(())
}

/// Scales that differ by rounding alone are one scale.
fn scale_key(scale: Mat3) -> [u32; 9] {
    scale.to_cols_array().map(|x| (((x * 4096.0).round() / 4096.0) + 0.0).to_bits())
}

#[cfg(test)]
#[path = "server_tests.rs"]
mod tests;
