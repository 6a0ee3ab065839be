//! Runs the whole system on a scene: encodes, decodes, draws, and scores against the reference.

use super::metrics::{self, Difference};
use super::reference::{Reference, Score};
use crate::client::Client;
use crate::codec::Limits;
use crate::points::client::PointsView;
use crate::points::sample::Fallback;
use crate::points::server::Server;
use crate::render::gbuffer::Lookup;
use crate::render::points::Counts;
use crate::render::{Frame, Renderer};
use crate::scene::Scene;
use crate::stream::{Job, Report, Stream, View};
use crate::trace::Tracer;
use crate::world::World;
use crate::{Result, points};
use serde::Serialize;
use std::time::Duration;

/// Size of a picture and rays of its reference.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    pub width: u32,
    pub height: u32,
    pub rays: u32,
    /// Length of an occlusion ray in metres.
    pub distance: f32,
    pub seed: u64,
}

/// What the client does with the stream.
#[derive(Clone, Copy, Debug, Default)]
pub struct Playback {
    pub fallback: Fallback,
    /// Seconds from a server frame to its use.
    pub latency: f64,
}

/// Frames of a view with their references, in order of time.
///
/// # Errors
/// As [`Renderer::frame`] and [`Reference::new`].
pub fn references(
    scene: &Scene,
    renderer: &mut Renderer,
    view: View,
    times: &[f64],
    quality: Quality,
    mut done: impl FnMut(),
) -> Result<Vec<Reference>> {
    let mut tracer: Option<Tracer> = None;
    times
        .iter()
        .map(|&time| {
            let pose = scene.pose(time);
            let camera = view.at(&pose);
            let Quality {
                width,
                height,
                rays,
                distance,
                seed,
            } = quality;
            let frame = renderer.frame(&pose, Lookup::Rest, &camera, width, height)?;
            let tracer = match &mut tracer {
                Some(tracer) => {
                    tracer.update(&pose);
                    tracer
                }
                None => tracer.insert(Tracer::new(scene, &pose)),
            };
            let reference = Reference::new(tracer, &pose, frame, rays, distance, seed);
            done();
            reference
        })
        .collect()
}

/// A scored run.
#[derive(Clone, Debug, Serialize)]
pub struct Evaluation {
    pub stream: Report,
    /// Means over the frames that were scored.
    pub picture: Difference,
    pub ao: Difference,
    /// Rms noise of the reference's AO.
    pub reference_noise: f64,
    pub scored_frames: usize,
    /// Share of fragments without a point in reach (Eq. 4 falls back to 1).
    pub without_point: f64,
    /// Share of fragments that the fallback could do nothing for either.
    pub without_any: f64,
    /// AO of the last scored frame.
    #[serde(skip)]
    pub last_ao: Vec<f32>,
}

impl Evaluation {
    /// Statistics of the points in the stream.
    pub fn points(&self) -> points::source::Report {
        self.stream.models.points.unwrap_or_default()
    }
}

/// A server that has traced all its points in `world`, and the time that took.
pub struct StartedServer<'s> {
    pub world: World<'s>,
    pub server: Server,
    pub startup_time: Duration,
}

/// Encodes `job` with a server, decodes the bytes as a client would, and scores what the client shows at the times of the references. `written` gets the bytes
/// of every frame.
///
/// # Errors
/// Whatever encoding, decoding, drawing and `written` give.
pub fn evaluate(
    started: StartedServer,
    job: Job,
    playback: Playback,
    renderer: &mut Renderer,
    references: &[Reference],
    mut written: impl FnMut(&[u8]) -> Result<()>,
) -> Result<Evaluation> {
    let StartedServer {
        world,
        server,
        startup_time,
    } = started;
    let scene = world.scene();
    let rate = job.rate.hz();
    let (start, frames, view) = (job.start, job.frames, job.view);
    // Frame of the stream that the client shows at a reference's time.
    let shown = |reference: &Reference| -> usize {
        let arrived = (reference.time - playback.latency - start).max(0.0);
        ((arrived * rate + 1e-6).floor() as usize).min(frames.saturating_sub(1))
    };
    let mut scores: Vec<Score> = Vec::new();
    let mut counts = Counts::default();
    let mut last_ao = Vec::new();
    let mut score = |number: usize, client: &Client| -> Result<()> {
        for reference in references.iter().filter(|r| shown(r) == number) {
            let Frame { gbuffer, .. } = &reference.frame;
            let pose = scene.pose(reference.time);
            let time = client.last_frame().map_or(start, |(_, time)| time);
            let server_pose = scene.pose(time);
            let shown_points = PointsView::new(client);
            let lookup = if shown_points.looks_up_rest_pose() {
                Lookup::Rest
            } else {
                Lookup::Posed(&server_pose)
            };
            let camera = view.at(&pose);
            let looked_up =
                renderer.gbuffer(&pose, lookup, &camera, gbuffer.width, gbuffer.height)?;
            let points =
                renderer.points_ao(&looked_up, &shown_points.state(), playback.fallback)?;
            counts.add(&points.counts);
            scores.push(reference.score(&points.ao)?);
            last_ao = points.ao;
        }
        Ok(())
    };

    let mut bytes = Vec::new();
    let mut client = Client::of_scene(scene, Limits::default());
    let mut stream = Stream::with_points(world, server, startup_time, job, &mut bytes)?;
    let mut number = 0;
    loop {
        client.push(&bytes)?;
        written(&bytes)?;
        bytes.clear();
        score(number, &client)?;
        number += 1;
        if stream.next_frame(&mut bytes)?.is_none() {
            break;
        }
    }
    let report = stream.finish(&mut bytes)?;
    client.push(&bytes)?;
    written(&bytes)?;

    let mean = |of: fn(&Score) -> Difference| {
        metrics::mean(&scores.iter().map(of).collect::<Vec<_>>())
            .ok_or_else(|| crate::Error::Invalid("no frame was scored".into()))
    };
    Ok(Evaluation {
        stream: report,
        picture: mean(|s| s.picture)?,
        ao: mean(|s| s.ao)?,
        reference_noise: rms(references.iter().map(|r| r.noise)),
        scored_frames: scores.len(),
        without_point: counts.without_point(),
        without_any: counts.without_any(),
        last_ao,
    })
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}
