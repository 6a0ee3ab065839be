//! The frame of a stream that a client shows at a given time.

use super::{Args, Method};
use crate::cli::args::Rate;
use crate::cli::stream;
use crate::client::Client;
use crate::codec::{ModelKind, TickRate};
use crate::scene::Scene;
use crate::{Error, Result, files};
use std::path::Path;

/// Seconds by which times of the same frame may differ.
const SAME: f64 = 1e-6;

/// A client at the newest frame that has arrived.
pub struct StreamFrame {
    pub client: Client,
    /// Its frame: number and time in seconds.
    pub frame: (u32, f64),
    /// Time that is shown.
    pub seconds: f64,
}

impl StreamFrame {
    /// Decodes a stream up to the newest frame that has arrived at the time to show: that of
    /// `--frame` or `--time`, or else of the stream's first frame.
    ///
    /// # Errors
    /// As [`stream::Source::read`] and [`Client::push`]; `Invalid` for a time that the stream does not
    /// reach. Light of a scene in which nothing moves stays right after the last frame.
    pub fn read(
        mut source: stream::Source,
        path: &Path,
        scene: &Scene,
        args: &Args,
    ) -> Result<StreamFrame> {
        let named = |error| match error {
            Error::Codec(fault) => stream::error(path, &fault),
            Error::Invalid(message) => Error::Invalid(format!("{}: {message}", stream::name(path))),
            other => other,
        };
        files::protect(path);
        let mut client = Client::of_scene(scene, args.limits.limits());
        let mut buffer = vec![0; 1 << 16];
        let mut unread = 0..0;
        let mut times = None;
        loop {
            if let (Some(frame), Some(rate)) = (client.last_frame(), client.decoder().tick_rate()) {
                let times = match times {
                    Some(times) => times,
                    None => *times.insert(Times::new(args, frame.1, rate).map_err(named)?),
                };
                if frame.1 + 1.0 / rate.hz() > times.arrived + SAME {
                    return Ok(StreamFrame::new(client, frame, times));
                }
            }
            if client.ended() {
                break;
            }
            if unread.is_empty() {
                unread = 0..source.read(&mut buffer)?;
                if unread.is_empty() {
                    let end = client.decoder().finish_live();
                    end.map_err(|fault| stream::error(path, &fault))?;
                    break;
                }
            }
            let next = client.last_frame().map_or(0, |(number, _)| number + 1);
            let (used, _) = client
                .push_until(&buffer[unread.clone()], next)
                .map_err(named)?;
            unread.start += used;
        }
        match (client.last_frame(), times) {
            // A bake is one frame, which stays.
            (Some(frame), Some(times)) if scene.duration == 0.0 || is_baked(&client) => {
                Ok(StreamFrame::new(client, frame, times))
            }
            (Some((_, last)), Some(times)) => Err(named(Error::Invalid(format!(
                "its last frame is {}, before {}",
                times.name(last),
                times.name(times.shown)
            )))),
            _ => Err(named(Error::Invalid("the stream has no frame".into()))),
        }
    }

    fn new(client: Client, frame: (u32, f64), times: Times) -> StreamFrame {
        StreamFrame {
            client,
            frame,
            seconds: times.shown,
        }
    }

    /// The method that was asked for, or the one for what the stream carries, of several the first of `probes`,
    /// `vertices`, which shows points, too, and `points`.
    ///
    /// # Errors
    /// `Invalid` for a stream without what the method needs.
    pub fn method(&self, asked: Option<Method>, path: &Path) -> Result<Method> {
        let refuse = |what: String| Err(Error::Invalid(format!("{}: {what}", stream::name(path))));
        let carried = [Method::Probes, Method::Vertices, Method::Points];
        let mut carried = carried.into_iter().filter(|method| self.carries(*method));
        let Some(first) = carried.next() else {
            return refuse("the stream has no track with light".into());
        };
        match asked {
            Some(Method::Ddgi) if first == Method::Probes => Ok(Method::Ddgi),
            Some(method) if method == first || carried.any(|other| other == method) => Ok(method),
            Some(method) => refuse(format!(
                "the stream has no {} but {}; choose {}",
                method.model(),
                first.model(),
                first.choice()
            )),
            None => Ok(first),
        }
    }

    /// Whether the stream has tracks for a method.
    fn carries(&self, method: Method) -> bool {
        let tracks = self.client.decoder().tracks();
        let mut kinds = tracks.iter().map(|live| live.track.model.kind());
        kinds.any(|kind| method_of(kind) == method)
    }
}

/// Whether a stream is a bake: it has baked tracks, and besides them points at most.
fn is_baked(client: &Client) -> bool {
    let tracks = client.decoder().tracks().iter();
    let methods: Vec<Method> = tracks
        .map(|live| method_of(live.track.model.kind()))
        .collect();
    methods.contains(&Method::Vertices) && !methods.contains(&Method::Probes)
}

/// The method that shows a model.
fn method_of(kind: ModelKind) -> Method {
    match kind {
        ModelKind::Points => Method::Points,
        ModelKind::Probes => Method::Probes,
        ModelKind::Vertices | ModelKind::Instances | ModelKind::Regions => Method::Vertices,
    }
}

/// Times in seconds.
#[derive(Clone, Copy)]
struct Times {
    shown: f64,
    /// Of the newest server frame that has arrived by then.
    arrived: f64,
    /// Frames a second of `--frame`.
    rate: f64,
}

impl Times {
    /// `first` is the time of the stream's first frame.
    ///
    /// # Errors
    /// `Invalid` for a time before it.
    fn new(args: &Args, first: f64, rate: TickRate) -> Result<Times> {
        let server = args.client.server_fps.map_or(rate.hz(), Rate::hz);
        let rate = args.fps.map_or(rate.hz(), Rate::hz);
        let shown = args.view.time_at(rate).unwrap_or(first);
        let late = (shown - args.client.latency_ms * 1e-3).max(0.0);
        let times = Times {
            shown,
            arrived: (late * server + SAME).floor() / server,
            rate,
        };
        if shown < first - SAME {
            return Err(Error::Invalid(format!(
                "its first frame is {}, after {}",
                times.name(first),
                times.name(shown)
            )));
        }
        Ok(times)
    }

    /// A time as the user gives it.
    fn name(&self, seconds: f64) -> String {
        format!("{:.0} ({seconds:.3} s)", (seconds * self.rate).round())
    }
}
