//! The encoder: runs the models of a stream over a span of time and writes what a client needs, a
//! frame a tick (PSAO §3.4, DDISH-GI §4).

use crate::codec::{
    self, Compression, Encoder, EncoderConfig, GroupStart, Limits, StateDigest, TickRate,
};
use crate::limits::check_tracks;
use crate::models::{ModelOptions, Reports, Source, Tick};
use crate::points::server::Server;
use crate::scene::{CameraPose, Pose, Scene};
use crate::world::World;
use crate::{Result, points, probes};
use std::any::Any;
use std::time::{Duration, Instant};

/// The camera whose view the server keeps up to date.
#[derive(Clone, Copy, Debug)]
pub enum View {
    /// A camera of the scene, which may be animated.
    Camera(usize),
    Fixed(CameraPose),
}

impl View {
    pub fn at(&self, pose: &Pose) -> CameraPose {
        match self {
            View::Camera(i) => pose.cameras[*i],
            View::Fixed(camera) => *camera,
        }
    }
}

/// The options of a stream.
#[derive(Clone, Debug)]
pub struct Job {
    /// What the stream carries, in the order of [`Model::ALL`](crate::models::Model::ALL).
    pub models: Vec<ModelOptions>,
    pub view: View,
    /// Frames, the start-up frame included.
    pub frames: usize,
    /// Server frames a second.
    pub rate: TickRate,
    /// Seconds into the animation at which the first frame lies: a whole number of ticks, for the
    /// stream counts in them.
    pub start: f64,
    /// Frames between keyframes; 0 for none after the first.
    pub keyframe_interval: usize,
    pub compression: Compression,
    /// Limits of the decoders that shall read the stream.
    pub limits: Limits,
}

/// Statistics of an encoded stream. Times are means over the frames after the first.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Report {
    pub scene: String,
    pub frames: usize,
    pub fps: f64,
    /// Metres across the scene that default lengths were chosen for, and their factor in a scene of
    /// 4 to 40 m.
    pub scene_size: f32,
    pub length_scale: f32,
    /// World space counts from here in the coordinates of the file.
    pub origin: [f64; 3],
    /// Near plane in metres of cameras that the scene does not define.
    pub near_plane: f32,
    /// Rays of the frames after the first.
    pub rays: u64,
    /// Everything up to the first commit.
    pub bytes_startup: u64,
    /// Frames after the first that carry no keyframe.
    pub bytes_steady: u64,
    /// Frames after the first that carry one.
    pub bytes_keyframes: u64,
    /// Rate of the frames after the first that carry no keyframe.
    pub mbps_steady: f64,
    /// Rate of the whole stream, its first keyframe included.
    pub mbps_with_keyframes: f64,
    /// Frames between keyframes; 0 when only the first is one.
    pub keyframe_interval: usize,
    pub stage_ms: StageMs,
    /// Seconds for everything up to the first frame.
    pub startup_s: f64,
    #[cfg_attr(feature = "cli", serde(flatten))]
    pub models: Reports,
}

impl Job {
    /// The options of `points`, where the stream carries them.
    pub fn points(&self) -> Option<&points::server::Options> {
        let mut all = self.models.iter();
        all.find_map(|model| {
            let ModelOptions::Points(options) = model else {
                return None;
            };
            Some(options)
        })
    }

    /// The options of `probes`, where the stream carries them.
    pub fn probes(&self) -> Option<&probes::source::Request> {
        let mut all = self.models.iter();
        all.find_map(|model| {
            let ModelOptions::Probes(options) = model else {
                return None;
            };
            Some(options)
        })
    }

    /// Seconds on the animation's clock of a frame, counted from 0.
    pub fn time_of(&self, frame: usize) -> f64 {
        self.start + frame as f64 / self.rate.hz()
    }
}

impl Report {
    /// Frames after the first, at least 1: what sums over them are divided by.
    pub fn ticks(&self) -> usize {
        self.frames.saturating_sub(1).max(1)
    }
}

/// Mean milliseconds of a tick by stage.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct StageMs {
    /// Animation and skinning.
    pub pose: f64,
    /// Acceleration structures.
    pub update: f64,
    /// Finding what to trace.
    pub select: f64,
    pub trace: f64,
    /// Storing what was traced.
    pub store: f64,
    /// Packing and compressing.
    pub encode: f64,
}

impl StageMs {
    pub fn total(&self) -> f64 {
        self.pose + self.update + self.select + self.trace + self.store + self.encode
    }

    fn add(&mut self, world: &World, tick: &Tick, encode: Duration) {
        let ms = |d: Duration| d.as_secs_f64() * 1e3;
        self.pose += ms(world.pose_time());
        self.update += ms(world.update_time());
        self.select += ms(tick.select_time);
        self.trace += ms(tick.trace_time);
        self.store += ms(tick.store_time);
        self.encode += ms(encode);
    }

    fn scaled(self, by: f64) -> StageMs {
        StageMs {
            pose: self.pose * by,
            update: self.update * by,
            select: self.select * by,
            trace: self.trace * by,
            store: self.store * by,
            encode: self.encode * by,
        }
    }
}

/// Encodes a stream frame by frame.
pub struct Stream<'s> {
    world: World<'s>,
    sources: Vec<Box<dyn Source>>,
    job: Job,
    encoder: Encoder,
    /// Frames written.
    frame: usize,
    report: Report,
    stages: StageMs,
    steady_frames: usize,
}

impl<'s> Stream<'s> {
    /// Starts all models of the job and writes the first frame. `progress` gets (done, all) of the
    /// points traced.
    ///
    /// # Errors
    /// `Invalid` for a scene that a model can do nothing with.
    pub fn start(
        scene: &'s Scene,
        job: Job,
        out: &mut Vec<u8>,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Self> {
        let clock = Instant::now();
        let world = World::new(scene, job.start);
        let mut sources: Vec<Box<dyn Source>> = Vec::new();
        let mut first_id = 0;
        for options in &job.models {
            let source = options.source(&world, first_id)?;
            first_id += source.tracks().len() as u32;
            sources.push(source);
        }
        // Tracing takes long: what no decoder reads is refused before it.
        check_tracks(&scene.name, &tracks_of(&sources), &job.limits)?;
        for source in &mut sources {
            source.start(&world, progress);
        }
        Self::with_sources(world, sources, clock.elapsed(), job, out)
    }

    /// Like [`Stream::start`] with a `points` server that has traced its points already in `world`,
    /// so that several streams can share that work. The models of the job are not looked at.
    ///
    /// # Errors
    /// As [`Stream::start`].
    pub fn with_points(
        world: World<'s>,
        server: Server,
        startup_time: Duration,
        job: Job,
        out: &mut Vec<u8>,
    ) -> Result<Self> {
        let source = points::source::Source::with_server(&world, server, 0)?;
        let sources: Vec<Box<dyn Source>> = vec![Box::new(source)];
        check_tracks(&world.scene().name, &tracks_of(&sources), &job.limits)?;
        Self::with_sources(world, sources, startup_time, job, out)
    }

    /// Writes the first frame of sources that have started and whose tracks are within the limits.
    fn with_sources(
        world: World<'s>,
        sources: Vec<Box<dyn Source>>,
        startup_time: Duration,
        job: Job,
        out: &mut Vec<u8>,
    ) -> Result<Self> {
        let scene = world.scene();
        let config = EncoderConfig {
            tick_rate: job.rate,
            limits: job.limits,
            ..EncoderConfig::default()
        };
        let before = out.len();
        let mut stream = Stream {
            encoder: Encoder::new(config, out)?,
            frame: 0,
            report: Report {
                scene: scene.name.clone(),
                scene_size: scene.size(),
                length_scale: scene.length_scale(),
                origin: scene.origin.to_array(),
                near_plane: scene.near_plane(),
                fps: job.rate.hz(),
                keyframe_interval: job.keyframe_interval,
                startup_s: startup_time.as_secs_f64(),
                ..Report::default()
            },
            stages: StageMs::default(),
            steady_frames: 0,
            world,
            sources,
            job,
        };
        stream.write_keyframe(out)?;
        stream.report.bytes_startup = (out.len() - before) as u64;
        Ok(stream)
    }

    /// The scene as of the last frame.
    pub fn world(&self) -> &World<'s> {
        &self.world
    }

    /// One of the models, where the stream has it.
    pub fn source<T: Source>(&self) -> Option<&T> {
        let mut sources = self.sources.iter();
        sources.find_map(|source| (&**source as &dyn Any).downcast_ref())
    }

    /// Seconds of the frame that was written last.
    pub fn time(&self) -> f64 {
        self.job.time_of(self.frame.saturating_sub(1))
    }

    /// Runs all models for one tick and writes their frame; `None` after the last.
    pub fn next_frame(&mut self, out: &mut Vec<u8>) -> Result<Option<Tick>> {
        if self.frame >= self.job.frames {
            return Ok(None);
        }
        let (world, sources) = (&mut self.world, &mut self.sources);
        world.advance(self.job.time_of(self.frame), |world| {
            sources.iter_mut().for_each(|source| source.leave(world));
        });
        world.camera = Some(self.job.view.at(world.pose()));
        let mut tick = Tick::default();
        for source in sources {
            tick += source.tick(world);
        }
        let before = out.len();
        let clock = Instant::now();
        let interval = self.job.keyframe_interval;
        if interval > 0 && self.frame.is_multiple_of(interval) {
            self.write_keyframe(out)?;
            self.report.bytes_keyframes += (out.len() - before) as u64;
        } else {
            self.write_delta(out)?;
            self.report.bytes_steady += (out.len() - before) as u64;
            self.steady_frames += 1;
        }
        self.stages.add(&self.world, &tick, clock.elapsed());
        self.report.rays += tick.rays;
        Ok(Some(tick))
    }

    /// Ends the stream and sums up.
    pub fn finish(mut self, out: &mut Vec<u8>) -> Result<Report> {
        self.encoder.end(out)?;
        let mut report = self.report;
        let rate = |bytes: u64, frames: usize| {
            bytes as f64 * 8e-6 * self.job.rate.hz() / frames.max(1) as f64
        };
        report.frames = self.frame;
        report.stage_ms = self.stages.scaled(1.0 / report.ticks() as f64);
        for source in &self.sources {
            source.report(&mut report.models);
        }
        report.mbps_steady = rate(report.bytes_steady, self.steady_frames);
        report.mbps_with_keyframes = rate(
            report.bytes_startup + report.bytes_keyframes + report.bytes_steady,
            self.frame,
        );
        Ok(report)
    }

    /// Everything a client needs to start at this frame.
    fn write_keyframe(&mut self, out: &mut Vec<u8>) -> Result<()> {
        self.encoder.group(out, GroupStart::Keyframes)?;
        self.encoder.tracks(out, &tracks_of(&self.sources))?;
        for source in &mut self.sources {
            source.write_keyframe(&mut self.encoder, self.job.compression, out)?;
        }
        let digest = self.digest();
        self.commit(out, Some(digest))
    }

    /// What changed since the last frame.
    fn write_delta(&mut self, out: &mut Vec<u8>) -> Result<()> {
        for source in &mut self.sources {
            source.write_delta(&mut self.encoder, self.job.compression, out)?;
        }
        // The last frame proves the whole chain of deltas.
        let last = self.frame + 1 == self.job.frames;
        let digest = last.then(|| self.digest());
        self.commit(out, digest)
    }

    fn commit(&mut self, out: &mut Vec<u8>, digest: Option<u64>) -> Result<()> {
        let tick = (self.job.start * self.job.rate.hz()).round() as u64 + self.frame as u64;
        self.encoder.commit(out, tick, digest)?;
        self.frame += 1;
        Ok(())
    }

    fn digest(&self) -> u64 {
        let mut digest = StateDigest::new();
        for source in &self.sources {
            source.digest(&mut digest);
        }
        digest.finish()
    }
}

/// The declarations of all tracks.
fn tracks_of(sources: &[Box<dyn Source>]) -> Vec<codec::Track> {
    sources.iter().flat_map(|source| source.tracks()).collect()
}
