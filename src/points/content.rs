//! What a `points` server puts into the frames of a stream (PSAO §3.4).

use super::server::{Server, Track};
use crate::codec::points::{Bucket, Cell, Coverage, EMPTY, Update};
use crate::codec::{
    self, Compression, Encoder, LookupSpace, Model, StateDigest, Target, Transform,
};
use crate::scene::Pose;
use crate::{Error, Result};
use glam::Affine3A;

/// A server and what its clients know. Its tracks have the ids 0, 1, 2 and so on.
pub struct Content<'s> {
    server: Server<'s>,
    /// Transforms as last sent, one per track.
    sent_transforms: Vec<Option<Transform>>,
}

impl<'s> Content<'s> {
    /// # Errors
    /// `Invalid` for a scene without a surface that points could lie on.
    pub fn new(server: Server<'s>) -> Result<Content<'s>> {
        if server.tracks().is_empty() {
            return Err(Error::Invalid(format!(
                "{}: no surface to put points on (glass holds none)",
                server.scene().name
            )));
        }
        Ok(Content {
            sent_transforms: vec![None; server.tracks().len()],
            server,
        })
    }

    pub fn server(&self) -> &Server<'s> {
        &self.server
    }

    pub fn server_mut(&mut self) -> &mut Server<'s> {
        &mut self.server
    }

    /// The declarations of all tracks.
    pub fn tracks(&self) -> Vec<codec::Track> {
        declarations(&self.server)
    }

    /// Everything that a client needs to start at this frame.
    pub fn write_keyframe(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        self.sent_transforms.fill(None);
        self.write_transforms(encoder, compression, out)?;
        let tracks = self.server.tracks_mut().iter_mut().enumerate();
        let parts = tracks.map(|(t, track)| {
            track.store.take_dirty();
            let buckets = track.store.buckets().iter().enumerate();
            let cells = track.store.cells().iter().enumerate();
            let buckets = buckets
                .filter(|(_, b)| b.0[0] != EMPTY)
                .map(|(i, b)| (i as u32, *b));
            let cells = cells
                .filter(|(_, c)| c.key != EMPTY)
                .map(|(i, c)| (i as u32, *c));
            Part::new(t, buckets, cells)
        });
        let parts: Vec<Part> = parts.collect();
        write_parts(encoder, Coverage::Keyframe, &parts, compression, out)
    }

    /// What changed since the last frame.
    pub fn write_delta(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        self.write_transforms(encoder, compression, out)?;
        let tracks = self.server.tracks_mut().iter_mut().enumerate();
        let parts = tracks.filter_map(|(t, track)| {
            let (buckets, cells) = track.store.take_dirty();
            let store = &track.store;
            // A freed cell is not sent: no bucket names it any more (PSAO Figure 3).
            let cells = cells.into_iter().map(|c| (c, store.cells()[c as usize]));
            let part = Part::new(
                t,
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

    fn write_transforms(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let mut changed = Vec::new();
        for (t, track) in self.server.tracks().iter().enumerate() {
            let transform = transform(track, self.server.pose());
            if self.sent_transforms[t] != Some(transform) {
                self.sent_transforms[t] = Some(transform);
                changed.push((t as u32, transform));
            }
        }
        if !changed.is_empty() {
            encoder.transforms(out, &changed, compression)?;
        }
        Ok(())
    }

    /// Adds the state of all tracks, as clients have it.
    pub fn digest(&self, digest: &mut StateDigest) {
        for (t, track) in self.server.tracks().iter().enumerate() {
            let (store, transform) = (&track.store, self.sent_transforms[t].as_ref());
            digest.points(t as u32, transform, store.buckets(), store.cells());
        }
    }
}

/// What a stream says of the tracks of a server.
pub fn declarations(server: &Server) -> Vec<codec::Track> {
    let tracks = server.tracks().iter().enumerate();
    tracks.map(|(t, track)| declare(server, t, track)).collect()
}

/// What the stream says of a track: it is found again by the path of its instance,
/// whose mesh has to be the same.
fn declare(server: &Server, t: usize, track: &Track) -> codec::Track {
    let bounds = track.mesh_bounds();
    let scene = server.scene();
    let instance = &scene.instances[track.instance];
    codec::Track {
        id: t as u32,
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
        track: usize,
        buckets: impl Iterator<Item = (u32, Bucket)>,
        cells: impl Iterator<Item = (u32, Cell)>,
    ) -> Part {
        let (bucket_indices, buckets) = buckets.unzip();
        let (cell_indices, cells) = cells.unzip();
        Part {
            track: track as u32,
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
fn transform(track: &Track, pose: &Pose) -> Transform {
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
