//! The model `points` in a stream: what its server puts into the frames (PSAO §3.4).

use super::server::{self, Server, Track};
use crate::codec::points::{Bucket, Cell, Coverage, EMPTY, Update};
use crate::codec::{
    self, Compression, Encoder, LookupSpace, Model, StateDigest, Target, Transform,
};
use crate::models::{self, Reports, Tick};
use crate::scene::{Pose, Scene};
use crate::world::World;
use crate::{Error, Result};
use glam::Affine3A;

pub use super::server::Options;

/// Statistics of the encoded points. Sums are over the frames after the first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Report {
    pub seed: u64,
    /// Candidates per square metre, before thinning.
    pub density: f32,
    /// Of all meshes, the lowest and the highest.
    pub lowest_density: f32,
    pub highest_density: f32,
    /// Length of the occlusion rays in metres.
    pub distance: f32,
    pub candidates: usize,
    /// Points that were placed.
    pub points: usize,
    /// Points that clients have at the last frame: without dropped and fully occluded ones.
    pub points_sent: usize,
    /// Interpolation radius in metres.
    pub radius: f32,
    pub cells: usize,
    pub buckets: usize,
    /// Points that did not fit into their cell or bucket, counted each time, the start-up frame
    /// included.
    pub dropped_points: u64,
    pub dropped_cells: u64,
    /// Points sent again.
    pub changed_points: usize,
    /// Points traced again.
    pub traced_points: usize,
    /// Rays of the start-up frame.
    pub rays_startup: u64,
    /// Seconds for placing points and grids.
    pub placing_s: f64,
}

/// A server and what its clients know.
pub struct Source {
    server: Server,
    /// What the stream says of each track.
    declarations: Vec<codec::Track>,
    /// Transforms of the tracks at the present frame, and as last sent.
    transforms: Vec<Transform>,
    sent_transforms: Vec<Option<Transform>>,
    traced_points: usize,
    changed_points: usize,
}

impl Source {
    /// Points in a scene, none of them traced, in tracks with the ids from `first_id` on.
    ///
    /// # Errors
    /// As [`Server::new`]; `Invalid` for a scene without a surface that points could lie on.
    pub fn new(world: &World, options: &Options, first_id: u32) -> Result<Source> {
        Self::with_server(world, Server::new(world, *options)?, first_id)
    }

    /// The same with a server that has placed its points, and may have traced them.
    ///
    /// # Errors
    /// `Invalid` for a scene without a surface that points could lie on.
    pub fn with_server(world: &World, server: Server, first_id: u32) -> Result<Source> {
        let scene = world.scene();
        if server.tracks().is_empty() {
            return Err(Error::Invalid(format!(
                "{}: no surface to put points on (glass holds none)",
                scene.name
            )));
        }
        let mut source = Source {
            declarations: declarations(scene, &server, first_id),
            transforms: Vec::new(),
            sent_transforms: vec![None; server.tracks().len()],
            server,
            traced_points: 0,
            changed_points: 0,
        };
        source.follow(world.pose());
        Ok(source)
    }

    pub fn server(&self) -> &Server {
        &self.server
    }

    fn follow(&mut self, pose: &Pose) {
        let tracks = self.server.tracks().iter();
        self.transforms = tracks.map(|track| transform(track, pose)).collect();
    }

    fn write_transforms(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let mut changed = Vec::new();
        let now = self.transforms.iter().zip(&mut self.sent_transforms);
        for ((transform, sent), track) in now.zip(&self.declarations) {
            if *sent != Some(*transform) {
                *sent = Some(*transform);
                changed.push((track.id, *transform));
            }
        }
        if !changed.is_empty() {
            encoder.transforms(out, &changed, compression)?;
        }
        Ok(())
    }

    /// The tracks of the server, each with its id.
    fn tracks_mut(&mut self) -> impl Iterator<Item = (u32, &mut Track)> {
        let ids = self.declarations.iter().map(|track| track.id);
        ids.zip(self.server.tracks_mut())
    }
}

impl models::Source for Source {
    fn tracks(&self) -> Vec<codec::Track> {
        self.declarations.clone()
    }

    fn start(&mut self, world: &World, progress: &mut dyn FnMut(usize, usize)) -> Tick {
        let tick = self.server.start(world, progress);
        self.follow(world.pose());
        work(&tick)
    }

    fn leave(&mut self, world: &World) {
        self.server.leave(world);
    }

    fn tick(&mut self, world: &World) -> Tick {
        let tick = self.server.tick(world);
        self.traced_points += tick.traced_points;
        self.changed_points += tick.changed_points;
        self.follow(world.pose());
        work(&tick)
    }

    fn write_keyframe(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        self.sent_transforms.fill(None);
        self.write_transforms(encoder, compression, out)?;
        let tracks = self.tracks_mut().map(|(id, track)| {
            track.store.take_dirty();
            (id, track.store.buckets(), track.store.cells())
        });
        write_keyframe(encoder, tracks, compression, out)
    }

    fn write_delta(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        self.write_transforms(encoder, compression, out)?;
        let parts = self.tracks_mut().filter_map(|(id, track)| {
            let (buckets, cells) = track.store.take_dirty();
            let store = &track.store;
            // A freed cell is not sent: no bucket names it any more (PSAO Figure 3).
            let cells = cells.into_iter().map(|c| (c, store.cells()[c as usize]));
            let part = Part::new(
                id,
                buckets
                    .into_iter()
                    .map(|b| (b, store.buckets()[b as usize])),
                cells.filter(|(_, c)| c.key != EMPTY),
            );
            (!part.buckets.is_empty() || !part.cells.is_empty()).then_some(part)
        });
        let parts: Vec<Part> = parts.collect();
        write_parts(encoder, Coverage::Delta, &parts, compression, out)
    }

    fn digest(&self, digest: &mut StateDigest) {
        let tracks = self.server.tracks().iter().zip(&self.declarations);
        for ((track, declaration), transform) in tracks.zip(&self.sent_transforms) {
            let store = &track.store;
            digest.points(
                declaration.id,
                transform.as_ref(),
                store.buckets(),
                store.cells(),
            );
        }
    }

    fn report(&self, reports: &mut Reports) {
        let (options, tracks) = (self.server.options(), self.server.tracks());
        let densities = || tracks.iter().map(|t| t.density().candidates);
        reports.points = Some(Report {
            seed: options.seed,
            density: options.density.candidates,
            lowest_density: densities().reduce(f32::min).unwrap_or_default(),
            highest_density: densities().fold(0.0, f32::max),
            distance: options.distance,
            candidates: tracks.iter().map(Track::candidates).sum(),
            points: tracks.iter().map(Track::points).sum(),
            points_sent: tracks.iter().map(|t| t.store.used_points()).sum(),
            radius: options.density.radius(),
            cells: tracks.iter().map(|t| t.store.used_cells()).sum(),
            buckets: tracks.iter().map(|t| t.store.buckets().len()).sum(),
            dropped_points: tracks.iter().map(|t| t.store.dropped_points).sum(),
            dropped_cells: tracks.iter().map(|t| t.store.dropped_cells).sum(),
            changed_points: self.changed_points,
            traced_points: self.traced_points,
            rays_startup: self.server.startup_rays(),
            placing_s: self.server.placing_time().as_secs_f64(),
        });
    }
}

fn work(tick: &server::Tick) -> Tick {
    Tick {
        rays: tick.rays,
        select_time: tick.select_time,
        trace_time: tick.trace_time,
        store_time: tick.store_time,
    }
}

/// What a stream says of the tracks of a server: ids from `first_id` on.
pub fn declarations(scene: &Scene, server: &Server, first_id: u32) -> Vec<codec::Track> {
    let tracks = (first_id..).zip(server.tracks());
    tracks
        .map(|(id, track)| declare(scene, id, track))
        .collect()
}

/// Writes all content of tracks, by their ids, ascending: what a client needs to start from.
///
/// # Errors
/// Those of the codec.
pub fn write_keyframe<'t>(
    encoder: &mut Encoder,
    tracks: impl Iterator<Item = (u32, &'t [Bucket], &'t [Cell])>,
    compression: Compression,
    out: &mut Vec<u8>,
) -> Result<()> {
    let parts = tracks.map(|(id, buckets, cells)| {
        let buckets = buckets.iter().enumerate();
        let buckets = buckets
            .filter(|(_, b)| b.0[0] != EMPTY)
            .map(|(i, b)| (i as u32, *b));
        let cells = cells.iter().enumerate();
        let cells = cells
            .filter(|(_, c)| c.key != EMPTY)
            .map(|(i, c)| (i as u32, *c));
        Part::new(id, buckets, cells)
    });
    let parts: Vec<Part> = parts.collect();
    write_parts(encoder, Coverage::Keyframe, &parts, compression, out)
}

/// What the stream says of a track: it is found again by the path of its instance,
/// whose mesh has to be the same.
pub fn declare(scene: &Scene, id: u32, track: &Track) -> codec::Track {
    let bounds = track.mesh_bounds();
    let instance = &scene.instances[track.instance];
    codec::Track {
        id,
        target: Target {
            application_id: 0,
            path: instance.name.clone(),
            content_hash: Some(scene.mesh_hash(instance.mesh)),
        },
        aabb_min: bounds.min.to_array(),
        aabb_max: bounds.max.to_array(),
        space: if track.looks_up_rest_pose() {
            LookupSpace::Rest
        } else {
            LookupSpace::Mesh
        },
        model: Model::Points(*track.store.grid()),
    }
}

fn write_parts(
    encoder: &mut Encoder,
    coverage: Coverage,
    parts: &[Part],
    compression: Compression,
    out: &mut Vec<u8>,
) -> Result<()> {
    let updates: Vec<Update> = parts.iter().map(Part::update).collect();
    Ok(encoder.points(out, coverage, &updates, compression)?)
}

/// Changed buckets and cells of one track.
struct Part {
    track: u32,
    bucket_indices: Vec<u32>,
    buckets: Vec<Bucket>,
    cell_indices: Vec<u32>,
    cells: Vec<Cell>,
}

impl Part {
    fn new(
        track: u32,
        buckets: impl Iterator<Item = (u32, Bucket)>,
        cells: impl Iterator<Item = (u32, Cell)>,
    ) -> Part {
        let (bucket_indices, buckets) = buckets.unzip();
        let (cell_indices, cells) = cells.unzip();
        Part {
            track,
            bucket_indices,
            buckets,
            cell_indices,
            cells,
        }
    }

    fn update(&self) -> Update<'_> {
        Update {
            track: self.track,
            bucket_indices: &self.bucket_indices,
            buckets: &self.buckets,
            cell_indices: &self.cell_indices,
            cells: &self.cells,
        }
    }
}

/// World from grid space of a track at a pose.
pub fn transform(track: &Track, pose: &Pose) -> Transform {
    let world: Affine3A = pose.world_from_mesh[track.instance] * track.mesh_from_grid();
    let rows = world.matrix3.transpose();
    let t = world.translation;
    let row = |r: glam::Vec3A, t: f32| [r.x, r.y, r.z, t];
    Transform {
        world_from_grid: [
            row(rows.x_axis, t.x),
            row(rows.y_axis, t.y),
            row(rows.z_axis, t.z),
        ],
    }
}
