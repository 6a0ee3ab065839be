//! What a `probes` server puts into the frames of a stream (DDISH-GI §4, `spec/encoding.md`).

use super::server::{Arrived, Options, Server, Tick};
use super::volume::Volume;
use crate::Result;
use crate::codec::points::StateDigest;
use crate::codec::probes::{self, Coding, Coverage, Probe, Steps, Tolerance, Update};
use crate::codec::{self, Compression, Encoder, LookupSpace, Model, Target};
use crate::scene::{Pose, Scene};
use crate::trace::path::{PathTracer, Paths, Random, Sky};
use crate::trace::{Aabb, Tracer};
use glam::Vec3;

/// What is asked of the model.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// Probes along x, y and z.
    pub dims: [u16; 3],
    /// Box of the outermost probes; `None` fits one to the scene.
    pub bounds: Option<Aabb>,
    pub server: Options,
    pub packing: Packing,
    pub sky: Sky,
}

/// How probes are coded, and how near the truth they have to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Packing {
    Raw,
    Packed {
        steps: Steps,
        /// Error that irradiance may have, as a share of the brightest probe's: what changes by
        /// less is not sent.
        tolerance: f32,
    },
}

impl Packing {
    /// 48 dB of irradiance with room to spare, on the scenes that were measured.
    pub const DEFAULT: Packing = Packing::Packed {
        steps: Steps {
            luma: [6, 48, 96],
            chroma: [48, 96, 192],
        },
        tolerance: 1.0 / 256.0,
    };
}

impl Default for Request {
    fn default() -> Self {
        Request {
            dims: [16, 8, 8],
            bounds: None,
            server: Options::default(),
            packing: Packing::DEFAULT,
            sky: Sky::default(),
        }
    }
}

/// A server, the scene it looks at, and what its clients know.
pub struct Content<'s> {
    scene: &'s Scene,
    pose: Pose,
    tracer: Tracer<'s>,
    server: Server,
    sky: Sky,
    packing: Packing,
    id: u32,
    volume: probes::Volume,
    /// As clients have them.
    sent: Vec<Probe>,
    sent_visibility: Option<Vec<u8>>,
}

impl<'s> Content<'s> {
    /// A volume in the scene as it is at `time`, in a track of this id. It holds no light yet.
    ///
    /// # Errors
    /// `Invalid` for a volume or options that cannot be.
    pub fn new(scene: &'s Scene, request: &Request, time: f64, id: u32) -> Result<Content<'s>> {
        let pose = scene.pose(time);
        let tracer = Tracer::new(scene, &pose);
        let place = match request.bounds {
            Some(bounds) => Volume::over(bounds, request.dims)?,
            None => Volume::fit(scene, &pose, &tracer, request.dims)?,
        };
        let server = Server::new(place, request.server)?;
        let side = request.server.visibility as u8;
        let volume = probes::Volume {
            grid_from_mesh: place.grid_from_world(),
            dims: place.lattice.dims,
            spacing: place.lattice.spacing.to_array(),
            exponent: 0,
            visibility: probes::Visibility {
                side,
                range: if side > 0 { server.range() } else { 0.0 },
            },
            coding: match request.packing {
                Packing::Raw => Coding::Raw,
                Packing::Packed { steps, .. } => Coding::Packed(steps),
            },
        };
        Ok(Content {
            scene,
            pose,
            tracer,
            sky: request.sky,
            packing: request.packing,
            id,
            sent: vec![Probe::ABSENT; place.lattice.count()],
            sent_visibility: None,
            volume,
            server,
        })
    }

    pub fn server(&self) -> &Server {
        &self.server
    }

    /// The probes as clients have them.
    pub fn sent(&self) -> &[Probe] {
        &self.sent
    }

    pub fn volume(&self) -> &probes::Volume {
        &self.volume
    }

    /// Runs the server for one frame, at a time of the scene.
    pub fn tick(&mut self, time: f64) -> Tick {
        self.pose = self.scene.pose(time);
        self.tracer.update(&self.pose);
        let paths = PathTracer::new(self.scene, &self.pose, &self.tracer, self.sky);
        update(&mut self.server, &paths)
    }

    pub fn track(&self) -> codec::Track {
        let place = self.server.volume();
        codec::Track {
            id: self.id,
            target: Target::default(),
            aabb_min: place.origin.to_array(),
            aabb_max: (place.origin + place.lattice.extent()).to_array(),
            space: LookupSpace::Mesh,
            model: Model::Probes(self.volume),
        }
    }

    /// Everything that a client needs to start at this frame.
    pub fn write_keyframe(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let probes = self.next();
        let visibility = self.visibility();
        let update = Update {
            track: self.id,
            base: &[],
            probes: &probes,
            visibility: visibility.as_deref(),
        };
        encoder.probes(out, Coverage::Keyframe, &[update], compression)?;
        self.sent = probes;
        self.sent_visibility = visibility;
        Ok(())
    }

    /// What changed since the last frame.
    pub fn write_delta(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let probes = self.next();
        let visibility = self.visibility();
        let seen_anew = visibility != self.sent_visibility;
        if probes == self.sent && !seen_anew {
            return Ok(());
        }
        let update = Update {
            track: self.id,
            base: &self.sent,
            probes: &probes,
            visibility: visibility.as_deref().filter(|_| seen_anew),
        };
        encoder.probes(out, Coverage::Delta, &[update], compression)?;
        self.sent = probes;
        self.sent_visibility = visibility;
        Ok(())
    }

    /// Adds the state as clients have it.
    pub fn digest(&self, digest: &mut StateDigest) {
        digest.volume(self.id, None, &self.sent, self.sent_visibility.as_deref());
    }

    /// The probes as this frame shall have them.
    fn next(&self) -> Vec<Probe> {
        let tolerance = self.tolerance();
        let probe = |(index, sent): (usize, &Probe)| {
            if !self.server.is_present(index) {
                return Probe::ABSENT;
            }
            let radiance = self.server.l2(index).map(|c| c.to_array());
            self.volume.quantize_near(&radiance, sent, &tolerance)
        };
        self.sent.iter().enumerate().map(probe).collect()
    }

    /// The error that each coefficient may have so that irradiance stays within the share that was
    /// asked for: degree l adds to irradiance by A_l (Ramamoorthi and Hanrahan 2001).
    fn tolerance(&self) -> Tolerance {
        let Packing::Packed { tolerance, .. } = self.packing else {
            return Tolerance::default();
        };
        let present = (0..self.sent.len()).filter(|&i| self.server.is_present(i));
        let luma = |c: Vec3| (c.x + 2.0 * c.y + c.z) / 4.0;
        let brightest = present
            .map(|i| luma(self.server.l2(i)[0]))
            .fold(0.0, f32::max);
        let of_degree = |l: usize| tolerance * brightest * super::sh::COSINE[0] / super::sh::COSINE[l];
        let tolerances = [0, 1, 2].map(of_degree);
        Tolerance {
            luma: tolerances,
            chroma: tolerances,
        }
    }

    fn visibility(&self) -> Option<Vec<u8>> {
        let block = self.server.visibility()?;
        Some(block.texels.as_flattened().to_vec())
    }
}

/// One frame of a server in a scene.
pub fn update(server: &mut Server, paths: &PathTracer) -> Tick {
    let options = *server.options();
    let follow = Paths::default();
    server.update(|origin, direction, draw| {
        let sample = draw.frame.wrapping_mul(options.samples).wrapping_add(draw.sample);
        let random = Random::new(options.seed as u32, draw.probe, sample);
        let arrived = paths.radiance(origin, direction, random, &follow);
        Arrived {
            radiance: arrived.radiance,
            distance: arrived.distance,
            back_face: arrived.back_face,
        }
    })
}
