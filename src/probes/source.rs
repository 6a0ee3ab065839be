//! The model `probes` in a stream: what its server puts into the frames (DDISH-GI §4,
//! `spec/encoding.md`).

use super::dering::{Keep, dering};
use super::fidelity::Fidelity;
use super::follow::Follower;
use super::server::fitting::{Choice, Fitting, Place, traced};
use super::server::{self, InsideGeometry, Nearest, Options, Server};
use super::sh::L2;
use super::volume::Volume;
use crate::Result;
use crate::codec::probes::{self, Coding, Coverage, Probe, Steps, Tolerance, Update, f32_from_f16};
use crate::codec::{
    self, Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, StateDigest, Target,
};
use crate::models::{self, Reports, Tick};
use crate::scene::{Pose, Scene};
use crate::trace::offset::offset_origin;
use crate::trace::path::bsdf::seen_normal;
use crate::trace::path::{PathTracer, Paths, Random, Sky};
use crate::trace::{Aabb, Ray, Tracer};
use crate::world::World;
use glam::Vec3;
use rayon::prelude::*;
use std::time::Instant;

/// The options of the model `probes`.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// Probes along x, y and z.
    pub dims: [u16; 3],
    /// Box of the outermost probes; `None` fits one to the scene.
    pub bounds: Option<Aabb>,
    pub server: Options,
    /// Frames that the server runs before the first that is sent.
    pub warm_up: u32,
    pub packing: Packing,
    pub sky: Sky,
    pub fit: Fit,
}

/// What probes hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Fit {
    /// The light at their places.
    #[default]
    Off,
    /// Values that make the look-up right on surfaces. Half of the rays find out what is right there.
    On,
    /// Whichever errs less at surfaces that the fit was not told of, chosen once for a volume after
    /// the frames before the first that is sent.
    Auto,
}

impl Request {
    /// Where the probes stand: in the box that was asked for, or in one that fits the scene.
    ///
    /// # Errors
    /// `Invalid` for a volume that cannot be.
    pub fn place(&self, world: &World) -> Result<Volume> {
        match self.bounds {
            Some(bounds) => Volume::over(bounds, self.dims),
            None => Volume::fit(world.scene(), world.pose(), world.tracer(), self.dims),
        }
    }
}

/// Statistics of the encoded probes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Report {
    pub probes: usize,
    /// Probes that are not disabled, in the last frame.
    pub probes_present: usize,
    /// Probes whose codes changed, summed over the frames after the first.
    pub probes_sent: usize,
    /// The first frame's record, less its visibility block.
    pub bytes_first: u64,
    /// What the visibility block adds to a keyframe's record.
    pub bytes_visibility: u64,
    /// Bytes a probe of a delta record, the mean over frames without keyframe.
    pub bytes_per_probe_frame: f64,
    /// PSNR in dB of the irradiance that clients get, 64 directions a probe, against the 99.9th
    /// percentile of the server's own.
    pub irradiance_psnr: Option<f64>,
    /// Rms error of irradiance over rms irradiance.
    pub irradiance_relative_rms: Option<f64>,
    /// Milliseconds of a server frame, the mean.
    pub probe_update_ms: f64,
    /// What the fit to surfaces was worth, where one was tried, and whether it was taken.
    pub fit: Option<Choice>,
    pub fitted: bool,
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
    /// `packed`, with steps that fit a tolerance: no code is finer than it has to be, and none
    /// coarser for a probe as bright as the brightest.
    pub fn packed(tolerance: f32) -> Packing {
        // Steps are twice what may be off; degree l counts for A_l / A_0 in irradiance.
        let luma = (512.0 * tolerance * std::f32::consts::LOG2_E).clamp(1.0, 2560.0);
        let relative = |l: usize| {
            let step = 2.0 * 4096.0 * tolerance * super::sh::COSINE[0] / super::sh::COSINE[l];
            step.clamp(1.0, 32768.0) as u16
        };
        Packing::Packed {
            steps: Steps {
                luma: [luma as u16, relative(1), relative(2)],
                chroma: [relative(0), relative(1), relative(2)],
            },
            tolerance,
        }
    }

    fn coding(self) -> Coding {
        match self {
            Packing::Raw => Coding::Raw,
            Packing::Packed { steps, .. } => Coding::Packed(steps),
        }
    }
}

/// Frames that a server runs by default before the first that is sent.
const WARM_UP: u32 = 16;

impl Default for Request {
    fn default() -> Self {
        Request {
            dims: [16, 8, 8],
            bounds: None,
            server: Options::default(),
            warm_up: WARM_UP,
            packing: Packing::packed(0.004),
            sky: Sky::default(),
            fit: Fit::default(),
        }
    }
}

/// A server and what its clients know.
pub struct Source {
    server: Server,
    sky: Sky,
    packing: Packing,
    warm_up: u32,
    id: u32,
    volume: probes::Volume,
    /// The server's light after deringing (irradiance is non-negative).
    light: Vec<L2>,
    /// As clients have them.
    sent: Vec<Probe>,
    /// The visibility block as clients have it.
    maps: Option<Vec<u8>>,
    /// Which maps geometry has moved near; `None` where what moves is not in them.
    follower: Option<Follower>,
    /// Sums over frames.
    report: Report,
    ticks: u32,
    delta_frames: u32,
    delta_bytes: u64,
    fidelity: Fidelity,
    fit: Fit,
    /// Paths of a probe and frame if no surface has any.
    samples: u32,
    fitting: Option<Fitting>,
}

impl Source {
    /// A volume in a scene, in a track of this id. No light is traced yet.
    ///
    /// # Errors
    /// `Invalid` for a volume or options that cannot be.
    pub fn new(world: &World, request: &Request, id: u32) -> Result<Source> {
        let place = request.place(world)?;
        let samples = request.server.samples;
        let mut server = Server::new(
            place,
            Options {
                // The other half is the receivers'.
                samples: match request.fit {
                    Fit::Off => samples,
                    Fit::On | Fit::Auto => samples.div_ceil(2),
                },
                ..request.server
            },
        )?;
        let through = request.server.inside == InsideGeometry::Kept;
        let follows = request.server.visibility_updates > 0;
        // Rays start clear of what never moves.
        server.measure_geometry(|origin, direction| {
            nearest(world, (origin, direction), through, false)
        });
        if follows {
            let all: Vec<usize> = (0..place.lattice.count()).collect();
            server.measure_maps(&all, |origin, direction| {
                nearest(world, (origin, direction), through, true)
            });
        }
        let side = request.server.visibility as u8;
        let volume = probes::Volume {
            grid_from_mesh: place.grid_from_world(),
            dims: place.lattice.dims,
            spacing: place.lattice.spacing.to_array(),
            exponent: 0,
            visibility: probes::Visibility {
                side,
                range: if side > 0 { server.range() } else { 0.0 },
                steps: map_steps(&request.server, request.packing),
            },
            coding: request.packing.coding(),
        };
        Ok(Source {
            sky: request.sky,
            packing: request.packing,
            warm_up: request.warm_up,
            id,
            light: Vec::new(),
            sent: vec![Probe::ABSENT; place.lattice.count()],
            maps: None,
            follower: follows.then(|| Follower::new(world, place.lattice.count())),
            report: Report {
                probes: place.lattice.count(),
                ..Report::default()
            },
            ticks: 0,
            delta_frames: 0,
            delta_bytes: 0,
            fidelity: Fidelity::default(),
            fit: request.fit,
            samples,
            fitting: None,
            volume,
            server,
        })
    }

    pub fn server(&self) -> &Server {
        &self.server
    }

    /// The light that is coded: the server's after deringing.
    pub fn light(&self) -> &[L2] {
        &self.light
    }

    /// The probes as clients have them.
    pub fn sent(&self) -> &[Probe] {
        &self.sent
    }

    pub fn volume(&self) -> &probes::Volume {
        &self.volume
    }

    /// Runs the server for the frames before the first that is sent.
    pub fn warm_up(&mut self, world: &World) {
        for _ in 1..self.warm_up {
            self.trace(world);
        }
        if self.warm_up > 0 {
            self.update(world);
        }
    }

    /// Runs the server for one frame.
    pub fn update(&mut self, world: &World) -> server::Tick {
        let mut tick = self.trace(world);
        tick.rays += self.follow(world);
        let clock = Instant::now();
        let mut light = self.fitted_light();
        light.par_iter_mut().for_each(|light| {
            dering(light, Keep::Irradiance);
        });
        self.light = light;
        // Clients hold the volume from the first keyframe on.
        if self.report.bytes_first == 0 {
            self.volume.exponent = exponent(&self.light);
        }
        let update_time = tick.update_time + clock.elapsed();
        self.report.probe_update_ms += clock.elapsed().as_secs_f64() * 1e3;
        server::Tick {
            update_time,
            ..tick
        }
    }

    /// Traces a frame whose light is not given out.
    pub fn trace(&mut self, world: &World) -> server::Tick {
        let clock = Instant::now();
        let paths = world.paths(self.sky);
        let mut tick = update(&mut self.server, &paths);
        if self.fit != Fit::Off {
            let fitting = self.fitting.get_or_insert_with(|| {
                Fitting::new(&self.server, |origin, direction| {
                    meet(
                        world.scene(),
                        world.pose(),
                        world.tracer(),
                        (origin, direction),
                    )
                })
            });
            tick.rays += fitting.update(&self.server, |origin, direction, random| {
                paths.radiance(origin, direction, random, &AT_SURFACES)
            });
        }
        self.ticks += 1;
        tick.update_time = clock.elapsed();
        self.report.probe_update_ms += tick.update_time.as_secs_f64() * 1e3;
        tick
    }

    /// The light that is traced, or fitted to surfaces.
    fn fitted_light(&mut self) -> Vec<L2> {
        let Some(fitting) = &mut self.fitting else {
            return traced(&self.server);
        };
        if fitting.choice().is_none() {
            let choice = fitting.choose(&self.server);
            let traced = choice.traced_error <= choice.fitted_error;
            self.report.fit = Some(choice);
            self.report.fitted = !(traced && self.fit == Fit::Auto);
        }
        if !self.report.fitted {
            self.fitting = None;
            self.fit = Fit::Off;
            self.server.set_samples(self.samples);
            return traced(&self.server);
        }
        fitting.fit(&self.server)
    }

    /// Measures maps near what moves again, as many as a frame may. Returns the number of rays.
    fn follow(&mut self, world: &World) -> u64 {
        let Some(follower) = &mut self.follower else {
            return 0;
        };
        let options = *self.server.options();
        let most = options.visibility_updates as usize;
        let probes = follower.take(world, &self.server, most);
        let through = options.inside == InsideGeometry::Kept;
        self.server.measure_maps(&probes, |origin, direction| {
            nearest(world, (origin, direction), through, true)
        })
    }

    /// Statistics so far.
    pub fn statistics(&self) -> Report {
        Report {
            probes_present: self.sent.iter().filter(|p| p.level > 0).count(),
            bytes_per_probe_frame: self.delta_bytes as f64
                / (f64::from(self.delta_frames.max(1)) * self.sent.len() as f64),
            irradiance_psnr: self.fidelity.psnr(),
            irradiance_relative_rms: self.fidelity.relative_rms(),
            probe_update_ms: self.report.probe_update_ms / f64::from(self.ticks.max(1)),
            ..self.report
        }
    }

    /// Codes probes in another way from the next keyframe on; the track changes.
    pub fn pack_as(&mut self, packing: Packing) {
        self.packing = packing;
        self.volume.coding = packing.coding();
        self.volume.visibility.steps = map_steps(self.server.options(), packing);
        self.volume.exponent = exponent(&self.light);
        self.sent.fill(Probe::ABSENT);
        self.maps = None;
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

    /// The bytes of a keyframe's record of these probes without a visibility block.
    ///
    /// # Errors
    /// Those of the codec.
    pub fn bytes_of_light(&self, probes: &[Probe], compression: Compression) -> Result<u64> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
        encoder.group(&mut bytes, GroupStart::Keyframes)?;
        encoder.tracks(&mut bytes, &[self.track()])?;
        let before = bytes.len();
        let update = Update {
            track: self.id,
            base: &[],
            probes,
            visibility: None,
        };
        let compression = self.compression(compression);
        encoder.probes(&mut bytes, Coverage::Keyframe, &[update], compression)?;
        Ok((bytes.len() - before) as u64)
    }

    /// The compression of a record: what is entropy-coded has none to gain.
    fn compression(&self, asked: Compression) -> Compression {
        match self.packing {
            Packing::Raw => asked,
            Packing::Packed { .. } => Compression::None,
        }
    }

    /// Counts the error of what was sent.
    fn compare(&mut self) {
        let scale = 2f32.powi(self.volume.exponent.into());
        for (index, probe) in self.sent.iter().enumerate() {
            if probe.level == 0 {
                continue;
            }
            let values = self
                .volume
                .values(probe)
                .map(|bits| f32_from_f16(bits) * scale);
            let got = std::array::from_fn(|lm| Vec3::from_slice(&values[3 * lm..]));
            self.fidelity.add(&self.light[index], &got);
        }
    }

    /// The probes as this frame shall have them.
    fn next(&self) -> Vec<Probe> {
        let tolerance = self.tolerance();
        let probe = |(index, sent): (usize, &Probe)| {
            if !self.server.is_present(index) {
                return Probe::ABSENT;
            }
            let radiance = self.light[index].map(|c| c.to_array());
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
        let brightest = present.map(|i| luma(self.light[i][0])).fold(0.0, f32::max);
        let of_degree =
            |l: usize| tolerance * brightest * super::sh::COSINE[0] / super::sh::COSINE[l];
        let tolerances = [0, 1, 2].map(of_degree);
        Tolerance {
            luma: tolerances,
            chroma: tolerances,
        }
    }

    /// The maps as this frame shall have them. Those of absent probes, which no client looks at, are open
    /// in the coding `packed`, where they take no bytes.
    fn next_maps(&self) -> Option<Vec<u8>> {
        let block = self.server.visibility()?;
        let mut maps = block.texels.to_vec();
        if let Packing::Packed { .. } = self.packing {
            let size = (block.side * block.side) as usize;
            for (probe, map) in maps.chunks_mut(size).enumerate() {
                if !self.server.is_present(probe) {
                    map.fill([255, 0]);
                }
            }
        }
        Some(maps.into_flattened())
    }
}

impl models::Source for Source {
    fn tracks(&self) -> Vec<codec::Track> {
        vec![self.track()]
    }

    fn start(&mut self, world: &World, _progress: &mut dyn FnMut(usize, usize)) -> Tick {
        self.warm_up(world);
        self.tick(world)
    }

    fn tick(&mut self, world: &World) -> Tick {
        let tick = self.update(world);
        Tick {
            rays: tick.rays,
            trace_time: tick.update_time,
            ..Tick::default()
        }
    }

    /// Light and visibility block.
    fn write_keyframe(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let probes = self.next();
        self.maps = self.next_maps();
        let update = Update {
            track: self.id,
            base: &[],
            probes: &probes,
            visibility: self.maps.as_deref(),
        };
        let before = out.len();
        let packed = self.compression(compression);
        encoder.probes(out, Coverage::Keyframe, &[update], packed)?;
        if self.report.bytes_first == 0 {
            let bytes = (out.len() - before) as u64;
            self.report.bytes_first = match update.visibility {
                Some(_) => self.bytes_of_light(&probes, compression)?,
                None => bytes,
            };
            self.report.bytes_visibility = bytes.saturating_sub(self.report.bytes_first);
        }
        self.sent = probes;
        self.compare();
        Ok(())
    }

    /// Probes that changed. In the coding `packed`, maps that did come with them; in `raw` the whole block.
    fn write_delta(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()> {
        let probes = self.next();
        let changed = probes
            .iter()
            .zip(&self.sent)
            .filter(|(a, b)| a != b)
            .count();
        let maps = self.next_maps();
        let before = out.len();
        if changed > 0 || maps != self.maps {
            let update = Update {
                track: self.id,
                base: &self.sent,
                probes: &probes,
                visibility: maps.as_deref().filter(|_| maps != self.maps),
            };
            let compression = self.compression(compression);
            encoder.probes(out, Coverage::Delta, &[update], compression)?;
        }
        self.report.probes_sent += changed;
        self.delta_bytes += (out.len() - before) as u64;
        self.delta_frames += 1;
        self.sent = probes;
        self.maps = maps;
        self.compare();
        Ok(())
    }

    fn digest(&self, digest: &mut StateDigest) {
        digest.probes(self.id, None, &self.sent, self.maps.as_deref());
    }

    fn report(&self, reports: &mut Reports) {
        reports.probes = Some(self.statistics());
    }
}

/// Steps of the codes of distances: those of a server, and none where they are not coded.
fn map_steps(options: &Options, packing: Packing) -> [u8; 2] {
    match packing {
        Packing::Packed { .. } if options.visibility > 0 => [options.visibility_step; 2],
        _ => [0; 2],
    }
}

/// The nearest surface along a ray. `through`: backs of single-sided materials are passed. Unless the
/// block `follows` what moves, that is passed too: it would stay in the block where it was.
fn nearest(
    world: &World,
    (origin, direction): (Vec3, Vec3),
    through: bool,
    follows: bool,
) -> Nearest {
    let (scene, tracer) = (world.scene(), world.tracer());
    let mut ray = Ray {
        origin,
        direction,
        t_max: f32::INFINITY,
    };
    // A bound for rays that run within a surface.
    for _ in 0..256 {
        let hit = match through {
            true => tracer.closest_front(&ray).0,
            false => tracer.closest(&ray),
        };
        let Some(hit) = hit else { break };
        let instance = hit.instance as usize;
        let position = ray.origin + direction * hit.t;
        if follows || !scene.can_move(instance) {
            return Nearest {
                distance: (position - origin).length(),
                back_face: hit.back && !scene.is_double_sided(instance, hit.triangle as usize),
            };
        }
        ray.origin = offset_origin(position, direction, tracer.reach());
    }
    Nearest {
        distance: f32::INFINITY,
        back_face: false,
    }
}

/// How light is followed that reaches a surface.
const AT_SURFACES: Paths = Paths {
    max_bounces: 31,
    cull_back_faces: false,
};

/// The first surface on a ray from a probe whose indirect light clients look up, if it never moves.
fn meet(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    (origin, direction): (Vec3, Vec3),
) -> Option<Place> {
    let ray = Ray {
        origin,
        direction,
        t_max: f32::INFINITY,
    };
    let hit = tracer.closest_front(&ray).0?;
    let instance = hit.instance as usize;
    if scene.can_move(instance) {
        return None;
    }
    let surface = scene
        .surface(pose, instance, hit.triangle as usize, hit.u, hit.v)
        .facing(direction);
    let n = surface.geometric_normal;
    (!surface.unlit).then(|| Place {
        position: surface.position,
        origin: offset_origin(surface.position, n, tracer.reach()),
        geometric_normal: n,
        normal: seen_normal(surface.normal, -direction),
    })
}

/// How much brighter light can become before it is clipped: night to dusk, or a lamp that is brought
/// next to a probe. A volume's exponent never changes.
const HEADROOM: f32 = 256.0;

/// The least exponent, not below 0, that leaves [`HEADROOM`] above these expansions: 0 as long as no
/// coefficient is above 255.
fn exponent(light: &[L2]) -> i8 {
    let largest = |l: &L2| l.iter().map(|c| c.abs().max_element()).fold(0.0, f32::max);
    let peak = light.iter().map(largest).fold(0.0, f32::max);
    let most = f64::from(f32_from_f16(0x7bff));
    (0i8..64)
        .find(|e| f64::from(peak * HEADROOM) <= most * 2f64.powi(i32::from(*e)))
        .unwrap_or(64)
}

/// One frame of a server in a scene.
pub fn update(server: &mut Server, paths: &PathTracer) -> server::Tick {
    let options = *server.options();
    let follow = Paths::default();
    server.update(|origin, direction, draw| {
        let sample = draw
            .frame
            .wrapping_mul(options.samples)
            .wrapping_add(draw.sample);
        let random = Random::new(options.seed as u32, draw.probe, sample);
        paths.radiance(origin, direction, random, &follow)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::Source as _;

    const SKY: Sky = Sky {
        up: Vec3::splat(2.0),
        down: Vec3::splat(0.5),
    };

    fn request(fit: Fit) -> Request {
        Request {
            dims: [4, 3, 4],
            server: Options {
                samples: 16,
                visibility: 4,
                ..Options::default()
            },
            warm_up: 3,
            sky: SKY,
            fit,
            ..Request::default()
        }
    }

    #[test]
    fn fitted_keyframe_is_the_same_with_any_number_of_threads() {
        let scene = Scene::hall();
        let keyframe = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a pool");
            pool.install(|| {
                let world = World::new(&scene, 0.0);
                let mut source = Source::new(&world, &request(Fit::On), 0).expect("a source");
                source.warm_up(&world);
                let mut bytes = Vec::new();
                let mut encoder =
                    Encoder::new(EncoderConfig::default(), &mut bytes).expect("an encoder");
                let start = encoder.group(&mut bytes, GroupStart::Keyframes);
                start.expect("a group");
                encoder
                    .tracks(&mut bytes, &[source.track()])
                    .expect("a track");
                source
                    .write_keyframe(&mut encoder, Compression::None, &mut bytes)
                    .expect("a keyframe");
                (bytes, source.statistics().fit)
            })
        };
        let (one, choice) = keyframe(1);
        assert!(choice.is_some_and(|c| c.traced_error > 0.0), "{choice:?}");
        assert!((one, choice) == keyframe(2));
    }

    #[test]
    fn fit_takes_no_more_rays() {
        let scene = Scene::hall();
        let world = World::new(&scene, 0.0);
        let rays = |fit| {
            let mut source = Source::new(&world, &request(fit), 0).expect("a source");
            source.trace(&world);
            source.trace(&world).rays
        };
        let (off, on) = (rays(Fit::Off), rays(Fit::On));
        assert!(on <= off && on > off / 2, "{on} of {off}");
    }

    /// Visibility that clients have after something moved is that of a server that starts there.
    #[test]
    fn visibility_follows_what_moves() {
        let scene = Scene::hall();
        let request = Request {
            dims: [5, 3, 5],
            server: Options {
                samples: 1,
                visibility: 8,
                visibility_updates: 10,
                inside: InsideGeometry::Kept,
                ..Options::default()
            },
            warm_up: 0,
            ..Request::default()
        };
        let mut world = World::new(&scene, 0.0);
        let place = request.place(&world).expect("a volume");
        let request = Request {
            bounds: Some(Aabb {
                min: place.origin,
                max: place.origin + place.lattice.extent(),
            }),
            ..request
        };
        let mut source = Source::new(&world, &request, 1).expect("a source");
        source.update(&world);
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).expect("an encoder");
        encoder
            .group(&mut out, GroupStart::Keyframes)
            .expect("a group");
        encoder.tracks(&mut out, &[source.track()]).expect("tracks");
        let none = Compression::None;
        models::Source::write_keyframe(&mut source, &mut encoder, none, &mut out)
            .expect("keyframe");
        encoder.commit(&mut out, 0, None).expect("a commit");
        let mut decoder = codec::Decoder::new(codec::Limits::default());
        let mut seen = |out: &mut Vec<u8>| {
            decoder.push_all(out, |_, _| {}).expect("a stream");
            out.clear();
            let track = &decoder.tracks()[0];
            decoder
                .probes()
                .visibility_of(track)
                .expect("maps")
                .to_vec()
        };
        let before = seen(&mut out);
        world.advance(1.5, |_| {});
        let mut fresh = Source::new(&world, &request, 1).expect("a source");
        fresh.update(&world);
        let fresh = fresh.next_maps().expect("maps");
        assert_ne!(before, fresh, "nothing moves");
        // 75 maps, ten a frame.
        for frame in 1..=8 {
            source.update(&world);
            models::Source::write_delta(&mut source, &mut encoder, none, &mut out)
                .expect("a delta");
            encoder.commit(&mut out, frame, None).expect("a commit");
            let now = seen(&mut out);
            assert!(frame < 8 || now == fresh);
        }
    }

    #[test]
    fn the_exponent_leaves_headroom_and_is_no_larger() {
        let light = |value: f32| vec![[Vec3::ZERO; 9], [Vec3::new(0.0, -value, 0.0); 9]];
        assert_eq!(
            [0.0, 1.0, 255.0, 257.0].map(|v| exponent(&light(v))),
            [0, 0, 0, 1]
        );
        for value in [1e5f32, 1e10, 1e20] {
            let room = 65504.0 * 2f64.powi(exponent(&light(value)).into()) / f64::from(value);
            assert!((256.0..512.0).contains(&room), "{value}: {room}");
        }
        assert_eq!(exponent(&light(f32::MAX)), 64);
    }
}
