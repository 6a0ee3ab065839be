//! The encoder: runs the servers of the models over a span of time and writes what a client needs,
//! a frame a tick (PSAO §3.4, DDISH-GI §4).

use crate::Result;
use crate::codec::{
    self, Compression, Encoder, EncoderConfig, GroupStart, Limits, StateDigest, TickRate,
};
use crate::limits::check_tracks;
use crate::points::content::Content as PointsContent;
use crate::points::server::{Options, Server, Tick, Track};
use crate::probes;
use crate::probes::content::{Content as ProbesContent, Request};
use crate::scene::{CameraPose, Pose, Scene};
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
    /// AO at surface points.
    pub points: Option<Options>,
    /// Light in a volume of probes.
    pub probes: Option<Request>,
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
    pub seed: u64,
    pub frames: usize,
    pub fps: f64,
    /// Metres across the scene that the lengths below were chosen for, and their factor in a scene of
    /// 4 to 40 m.
    pub scene_size: f32,
    pub length_scale: f32,
    /// World space counts from here in the coordinates of the file.
    pub origin: [f64; 3],
    /// Candidates per square metre, before thinning.
    pub density: f32,
    /// Of all meshes, the lowest and the highest.
    pub lowest_density: f32,
    pub highest_density: f32,
    /// Length of the occlusion rays in metres.
    pub distance: f32,
    /// Near plane in metres of cameras that the scene does not define.
    pub near_plane: f32,
    pub candidates: usize,
    pub points: usize,
    /// Interpolation radius in metres.
    pub radius: f32,
    pub cells: usize,
    pub buckets: usize,
    /// Points that did not fit into their cell or bucket, counted each time, the start-up frame included.
    pub dropped_points: u64,
    pub dropped_cells: u64,
    /// Points sent again, summed over the frames after the first.
    pub changed_points: usize,
    /// Points traced again, summed over the frames after the first.
    pub traced_points: usize,
    /// Rays of the start-up frame.
    pub rays_startup: u64,
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
    /// Seconds for placing points, grids and acceleration structures.
    pub placing_s: f64,
    /// Seconds for that and for the first trace of every point.
    pub startup_s: f64,
    #[cfg_attr(feature = "cli", serde(flatten))]
    pub probes: Option<probes::content::Report>,
}

impl Job {
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
    /// Finding the points to trace.
    pub select: f64,
    pub trace: f64,
    /// Buckets and cells.
    pub store: f64,
    /// Packing and compressing.
    pub encode: f64,
}

impl StageMs {
    pub fn total(&self) -> f64 {
        self.pose + self.update + self.select + self.trace + self.store + self.encode
    }

    fn add(&mut self, tick: &Tick, encode: Duration) {
        let ms = |d: Duration| d.as_secs_f64() * 1e3;
        self.pose += ms(tick.pose_time);
        self.update += ms(tick.update_time);
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
    points: Option<PointsContent<'s>>,
    probes: Option<ProbesContent<'s>>,
    job: Job,
    encoder: Encoder,
    /// Frames written.
    frame: usize,
    report: Report,
    stages: StageMs,
    steady_frames: usize,
}

impl<'s> Stream<'s> {
    /// Starts the servers of all models that the job asks for, and writes the start-up frame.
    /// `progress` gets (done, all) of the points traced.
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
        let points = match job.points {
            Some(options) => Some(PointsContent::new(Server::new(scene, options, job.start)?)?),
            None => None,
        };
        let tracks = points.as_ref().map_or(0, |p| p.server().tracks().len());
        let probes = match &job.probes {
            Some(request) => {
                let warm_up = 0;
                let request = Request {
                    warm_up,
                    ..*request
                };
                Some(ProbesContent::new(
                    scene,
                    &request,
                    job.start,
                    tracks as u32,
                )?)
            }
            None => None,
        };
        // Tracing takes long: what no decoder reads is refused before it.
        check_tracks(&scene.name, &tracks_of(&points, &probes), &job.limits)?;
        let points = points.map(|mut content| {
            let tick = content.server_mut().start(progress);
            (content, tick)
        });
        let probes = probes.map(|mut content| {
            let warm_up = job.probes.map_or(0, |request| request.warm_up);
            (0..=warm_up).for_each(|_| {
                content.tick(job.start);
            });
            content
        });
        Self::with_content(scene, points, probes, clock.elapsed(), job, out)
    }

    /// Like [`Stream::start`] with a `points` server that has traced its points already, so that
    /// several streams can share that work.
    ///
    /// # Errors
    /// As [`Stream::start`].
    pub fn with_points(
        server: Server<'s>,
        startup: Tick,
        startup_time: Duration,
        job: Job,
        out: &mut Vec<u8>,
    ) -> Result<Self> {
        let scene = server.scene();
        let points = Some((PointsContent::new(server)?, startup));
        Self::with_content(scene, points, None, startup_time, job, out)
    }

    fn with_content(
        scene: &Scene,
        points: Option<(PointsContent<'s>, Tick)>,
        probes: Option<ProbesContent<'s>>,
        startup_time: Duration,
        job: Job,
        out: &mut Vec<u8>,
    ) -> Result<Self> {
        let mut report = Report {
            scene: scene.name.clone(),
            scene_size: scene.size(),
            length_scale: scene.length_scale(),
            origin: scene.origin.to_array(),
            near_plane: scene.near_plane(),
            fps: job.rate.hz(),
            keyframe_interval: job.keyframe_interval,
            startup_s: startup_time.as_secs_f64(),
            ..Report::default()
        };
        if let Some(options) = &job.points {
            report.seed = options.seed;
            report.density = options.density.candidates;
            report.distance = options.distance;
            report.radius = options.density.radius();
        }
        if let Some((content, startup)) = &points {
            let server = content.server();
            let tracks = server.tracks();
            report.candidates = tracks.iter().map(Track::candidates).sum();
            report.points = tracks.iter().map(Track::points).sum();
            let densities = || tracks.iter().map(|t| t.density().candidates);
            report.lowest_density = densities().reduce(f32::min).unwrap_or_default();
            report.highest_density = densities().fold(0.0, f32::max);
            report.buckets = tracks.iter().map(|t| t.store.buckets().len()).sum();
            report.rays_startup = startup.rays;
            report.placing_s = server.placing_time().as_secs_f64();
        }
        let points = points.map(|(content, _)| content);
        check_tracks(&scene.name, &tracks_of(&points, &probes), &job.limits)?;
        let config = EncoderConfig {
            tick_rate: job.rate,
            limits: job.limits,
            ..EncoderConfig::default()
        };
        let before = out.len();
        let mut stream = Stream {
            encoder: Encoder::new(config, out)?,
            frame: 0,
            report,
            stages: StageMs::default(),
            steady_frames: 0,
            points,
            probes,
            job,
        };
        stream.write_keyframe(out)?;
        stream.report.bytes_startup = (out.len() - before) as u64;
        Ok(stream)
    }

    /// The server of `points`, where the stream has them.
    pub fn points(&self) -> Option<&Server<'s>> {
        self.points.as_ref().map(PointsContent::server)
    }

    /// What the stream has of `probes`.
    pub fn probes(&self) -> Option<&ProbesContent<'s>> {
        self.probes.as_ref()
    }

    /// Seconds of the frame that was written last.
    pub fn time(&self) -> f64 {
        self.job.time_of(self.frame.saturating_sub(1))
    }

    /// Runs the servers for one tick and writes their frame; `None` after the last. What the tick
    /// says is of `points`.
    pub fn next_frame(&mut self, out: &mut Vec<u8>) -> Result<Option<Tick>> {
        if self.frame >= self.job.frames {
            return Ok(None);
        }
        let time = self.job.time_of(self.frame);
        let view = &self.job.view;
        let tick = match &mut self.points {
            Some(points) => points.server_mut().tick_seen(time, |pose| view.at(pose)),
            None => Tick::default(),
        };
        if let Some(probes) = &mut self.probes {
            self.report.rays += probes.tick(time).rays;
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
        self.stages.add(&tick, clock.elapsed());
        self.report.rays += tick.rays;
        self.report.traced_points += tick.traced_points;
        self.report.changed_points += tick.changed_points;
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
        report.probes = self.probes.as_ref().map(ProbesContent::report);
        let tracks = self
            .points
            .iter()
            .flat_map(|points| points.server().tracks());
        for Track { store, .. } in tracks {
            report.cells += store.used_cells();
            report.dropped_points += store.dropped_points;
            report.dropped_cells += store.dropped_cells;
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
        let tracks = tracks_of(&self.points, &self.probes);
        self.encoder.tracks(out, &tracks)?;
        let (encoder, compression) = (&mut self.encoder, self.job.compression);
        if let Some(points) = &mut self.points {
            points.write_keyframe(encoder, compression, out)?;
        }
        if let Some(probes) = &mut self.probes {
            probes.write_keyframe(encoder, compression, out)?;
        }
        let digest = self.digest();
        self.commit(out, Some(digest))
    }

    /// What changed since the last frame.
    fn write_delta(&mut self, out: &mut Vec<u8>) -> Result<()> {
        let (encoder, compression) = (&mut self.encoder, self.job.compression);
        if let Some(points) = &mut self.points {
            points.write_delta(encoder, compression, out)?;
        }
        if let Some(probes) = &mut self.probes {
            probes.write_delta(encoder, compression, out)?;
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
        if let Some(points) = &self.points {
            points.digest(&mut digest);
        }
        if let Some(probes) = &self.probes {
            probes.digest(&mut digest);
        }
        digest.finish()
    }
}

/// The declarations of all tracks.
fn tracks_of(points: &Option<PointsContent>, probes: &Option<ProbesContent>) -> Vec<codec::Track> {
    let points = points.iter().flat_map(PointsContent::tracks);
    let probes = probes.iter().map(ProbesContent::track);
    points.chain(probes).collect()
}
