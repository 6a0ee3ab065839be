//! The client's side of a `points` stream: bytes in, arrays for the sampler out.

use crate::codec::points::{Bucket, Cell, DirtyRange, Grid};
use crate::codec::{Decoder, Event, Limits, LookupSpace};
use crate::scene::Scene;
use crate::{Error, Result};
use std::collections::BTreeMap;

/// Where a track's state lies in the shared buffers.
#[derive(Clone, Copy, Debug)]
pub struct PointsTrack {
    pub grid: Grid,
    /// Index of its first bucket; `grid.bucket_count` of them are its own.
    pub first_bucket: u32,
    /// Index of its first cell; `grid.cell_capacity` of them are its own.
    pub first_cell: u32,
}

/// The decoded state of all tracks, as it lies in the decoder.
#[derive(Clone, Copy, Debug)]
pub struct PointsState<'a> {
    pub tracks: &'a [PointsTrack],
    pub buckets: &'a [Bucket],
    pub cells: &'a [Cell],
    /// Per instance of the scene, an index into `tracks`; beyond its end there is none.
    pub track_of_instance: &'a [Option<u32>],
    /// What changed since the last call with the same state: the device uploads that alone. `None`
    /// uploads everything, as after a jump or for another state.
    pub dirty: Option<Dirty<'a>>,
}

/// Changed items of the shared buffers, as the decoder reports them.
#[derive(Clone, Copy, Debug)]
pub struct Dirty<'a> {
    pub buckets: &'a [DirtyRange],
    pub cells: &'a [DirtyRange],
}

/// Follows a stream that was made for a scene the client has, too.
pub struct Client {
    decoder: Decoder,
    instance_of_path: BTreeMap<String, usize>,
    /// [`Scene::mesh_hash`] of the mesh of each instance.
    mesh_hashes: Vec<u64>,
    tracks: Vec<PointsTrack>,
    track_of_instance: Vec<Option<u32>>,
    rest: bool,
    ended: bool,
}

impl Client {
    pub fn new(scene: &Scene, limits: Limits) -> Client {
        let names = scene.instances.iter().enumerate();
        Client {
            decoder: Decoder::new(limits),
            instance_of_path: names
                .map(|(i, instance)| (instance.name.clone(), i))
                .collect(),
            mesh_hashes: scene
                .instances
                .iter()
                .map(|instance| scene.mesh_hash(instance.mesh))
                .collect(),
            tracks: Vec::new(),
            track_of_instance: vec![None; scene.instances.len()],
            rest: false,
            ended: false,
        }
    }

    /// Takes the next bytes of the stream in; returns the frames that they completed.
    ///
    /// # Errors
    /// What the decoder says of the bytes; `Invalid` for a stream of another scene. The last
    /// completed frame stays as it was.
    pub fn push(&mut self, mut bytes: &[u8]) -> Result<usize> {
        let mut frames = 0;
        while !bytes.is_empty() && !self.ended {
            let (consumed, event) = self.decoder.push(bytes)?;
            bytes = &bytes[consumed..];
            match event {
                Event::NeedInput => break,
                Event::Frame(_) => frames += 1,
                Event::End => self.ended = true,
                _ => {}
            }
        }
        if frames > 0 {
            self.bind()?;
        }
        Ok(frames)
    }

    /// Takes bytes in up to and including frame `number`; returns how many bytes it used and
    /// whether the frame is there.
    ///
    /// # Errors
    /// As [`Client::push`].
    pub fn push_until(&mut self, bytes: &[u8], number: u32) -> Result<(usize, bool)> {
        let mut used = 0;
        while used < bytes.len() && !self.ended {
            let (consumed, event) = self.decoder.push(&bytes[used..])?;
            used += consumed;
            match event {
                Event::NeedInput => break,
                Event::Frame(frame) if frame.number >= number => {
                    self.bind()?;
                    return Ok((used, true));
                }
                Event::End => self.ended = true,
                _ => {}
            }
        }
        Ok((used, false))
    }

    /// Whether the stream's end was reached.
    pub fn ended(&self) -> bool {
        self.ended
    }

    pub fn decoder(&self) -> &Decoder {
        &self.decoder
    }

    /// Number and time in seconds of the last frame; the time is on the animation's clock.
    pub fn last_frame(&self) -> Option<(u32, f64)> {
        let (number, tick) = self.decoder.last_frame()?;
        let rate = self.decoder.tick_rate()?;
        Some((number, tick as f64 / rate.hz()))
    }

    /// Whether deforming meshes are looked up in their rest pose.
    pub fn looks_up_rest_pose(&self) -> bool {
        self.rest
    }

    /// What the sampler needs.
    pub fn state(&self) -> PointsState<'_> {
        PointsState {
            tracks: &self.tracks,
            buckets: self.decoder.points().buckets(),
            cells: self.decoder.points().cells(),
            track_of_instance: &self.track_of_instance,
            dirty: None,
        }
    }

    /// Finds the instance of every track.
    fn bind(&mut self) -> Result<()> {
        self.tracks.clear();
        self.track_of_instance.fill(None);
        self.rest = false;
        for live in self.decoder.tracks() {
            let Some(place) = self.decoder.points().place_of(live) else {
                continue;
            };
            let path = &live.track.target.path;
            let Some(&instance) = self.instance_of_path.get(path) else {
                return Err(Error::Invalid(format!(
                    "the stream has light for '{path}', which the scene does not have: \
                     it was made for another scene"
                )));
            };
            let hash = live.track.target.content_hash;
            if hash.is_some_and(|hash| hash != self.mesh_hashes[instance]) {
                return Err(Error::Invalid(format!(
                    "the stream has light for another mesh of '{path}' than the scene has: it was \
                     made for another version of the scene"
                )));
            }
            self.track_of_instance[instance] = Some(self.tracks.len() as u32);
            self.rest |= live.track.space == LookupSpace::Rest;
            self.tracks.push(PointsTrack {
                grid: place.grid,
                first_bucket: place.first_bucket,
                first_cell: place.first_cell,
            });
        }
        Ok(())
    }
}
