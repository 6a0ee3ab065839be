//! `dapple render`: one picture of a scene, lit by a stream or by a reference.

mod path;
mod probes;

use super::args::{self, ClientArgs, Rate, SceneArgs, ViewArgs};
use super::limits::LimitArgs;
use super::{output, stream};
use crate::codec::Limits;
use crate::measure::reference::{RAYS, mean_of_halves, rtao};
use crate::points::client::Client;
use crate::points::sample::Fallback;
use crate::render::gbuffer::Lookup;
use crate::render::{Backend, Renderer, composite};
use crate::trace::Tracer;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Render one frame of a scene to a PNG file, lit by a stream or by a reference.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The stream, `-` for standard input; not needed for `--method rtao`, `none`, `path` and `direct`.
    #[arg(value_name = "STREAM")]
    stream: Option<PathBuf>,
    /// The scene that the stream was made for: a glTF file, or `hall`.
    #[arg(long, value_name = "SCENE")]
    scene: String,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    client: ClientArgs,
    /// Where ambient occlusion, or all light, comes from.
    #[arg(long, default_value = "points")]
    method: Method,
    /// How probes are interpolated.
    #[arg(long, default_value = "resistant")]
    interpolation: probes::Between,
    /// Frames a second that `--frame` counts in.
    #[arg(long, value_name = "RATE", default_value = "60")]
    fps: Rate,
    /// Length of the reference's occlusion rays in metres.
    #[arg(long, value_name = "M", default_value = "0.6", value_parser = args::distance)]
    distance: f32,
    /// Rays a pixel of the reference.
    #[arg(long, value_name = "COUNT", default_value_t = RAYS,
        value_parser = clap::value_parser!(u32).range(2..=65_536))]
    rays: u32,
    #[command(flatten)]
    path: path::PathArgs,
    /// What draws.
    #[arg(long, default_value = "auto")]
    backend: Drawing,
    #[command(flatten)]
    limits: LimitArgs,
    /// Write ambient occlusion alone, as a gray picture.
    #[arg(long)]
    ao_only: bool,
    /// The PNG file.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    /// Out of the stream.
    Points,
    /// Ray-traced per pixel: the reference.
    Rtao,
    /// AO = 1.
    None,
    /// All light, path-traced per pixel: the reference.
    Path,
    /// Punctual lights with ray-traced shadows, and emission.
    Direct,
    /// Punctual lights through shadow maps, and indirect light out of the stream.
    Probes,
    /// The same with DDGI's probes in the place of the stream's.
    Ddgi,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Drawing {
    /// A graphics device if there is one, else the CPU.
    Auto,
    Gpu,
    Cpu,
}

/// Runs the command.
///
/// # Errors
/// `Scene`, `Io`, `Codec` for unusable files, `Invalid` for what scene or stream do not have.
pub fn run(args: &Args) -> Result<ExitCode> {
    let scene = SceneArgs {
        scene: args.scene.clone(),
        view: args.view.clone(),
    }
    .open()?;
    let view = args.view.view(&scene)?;
    let seconds = args.view.seconds(args.fps);
    let pose = scene.pose(seconds);
    let (width, height) = args.view.size;
    if let Method::Path | Method::Direct = args.method {
        let camera = view.at(&pose);
        let direct_only = args.method == Method::Direct;
        return path::run(&args.path, &scene, &pose, &camera, args, direct_only);
    }
    let backend = match args.backend {
        Drawing::Auto => Backend::Auto,
        Drawing::Gpu => Backend::Gpu,
        Drawing::Cpu => Backend::Cpu,
    };
    let mut renderer = Renderer::new(&scene, backend)?;
    let camera = view.at(&pose);
    if let Method::Probes | Method::Ddgi = args.method {
        return probes::run(args, &scene, &pose, seconds, &camera, &mut renderer);
    }

    let mut note = String::new();
    let (frame, ao) = match args.method {
        Method::None | Method::Path | Method::Direct | Method::Probes | Method::Ddgi => {
            let frame = renderer.frame(&pose, Lookup::Rest, &camera, width, height)?;
            let open = vec![1.0; frame.gbuffer.fragments.len()];
            (frame, open)
        }
        Method::Rtao => {
            let frame = renderer.frame(&pose, Lookup::Rest, &camera, width, height)?;
            let tracer = Tracer::new(&scene, &pose);
            let (a, b) = rtao(&tracer, &frame.gbuffer, args.rays, args.distance, 0);
            (frame, mean_of_halves(&a, &b))
        }
        Method::Points => {
            let path = args.stream.as_deref().ok_or_else(|| {
                Error::Invalid("name a stream, or choose --method rtao or none".into())
            })?;
            // The newest server frame that has arrived by now.
            let sent = args.client.newest_at(seconds, args.fps);
            let client = read_until(path, &scene, sent, args.limits.limits())?;
            let (number, time) = client.last_frame().ok_or_else(|| {
                Error::Invalid(format!("{}: the stream has no frame", path.display()))
            })?;
            let server_pose = scene.pose(time);
            let lookup = if client.looks_up_rest_pose() {
                Lookup::Rest
            } else {
                Lookup::Posed(&server_pose)
            };
            let frame = renderer.frame(&pose, lookup, &camera, width, height)?;
            let points =
                renderer.points_ao(&frame.gbuffer, &client.state(), args.client.fallback())?;
            note = format!(
                "; stream frame {number}, {:.3} % of fragments without a point in reach",
                100.0 * points.counts.without_point()
            );
            (frame, points.ao)
        }
    };
    let picture = if args.ao_only {
        composite::ao_picture(&frame.gbuffer, &ao)
    } else {
        frame.composite(Some(&ao))
    };
    picture.write_png(&args.output)?;
    output::print(&format!(
        "{}: drawn by {}{note}\n",
        args.output.display(),
        renderer.name()
    ))?;
    Ok(ExitCode::SUCCESS)
}

impl ClientArgs {
    /// Animation time of the newest server frame that a client showing `seconds` has.
    pub fn newest_at(&self, seconds: f64, stream_rate: Rate) -> f64 {
        let server = self.server_fps.unwrap_or(stream_rate).hz();
        let arrived = (seconds - self.latency_ms * 1e-3).max(0.0);
        (arrived * server + 1e-6).floor() / server
    }

    pub fn fallback(&self) -> Fallback {
        match self.fallback {
            args::Fallback::One => Fallback::One,
            args::Fallback::Mend => Fallback::Mend,
        }
    }
}

/// Decodes a stream up to the last frame whose time is not after `seconds`; the first frame in any
/// case.
fn read_until(
    path: &Path,
    scene: &crate::scene::Scene,
    seconds: f64,
    limits: Limits,
) -> Result<Client> {
    let named = |error| match error {
        Error::Codec(fault) => stream::error(path, &fault),
        Error::Invalid(message) => Error::Invalid(format!("{}: {message}", stream::name(path))),
        other => other,
    };
    let mut source = stream::Source::open(path)?;
    let mut client = Client::new(scene, limits);
    let mut buffer = vec![0; 1 << 16];
    loop {
        let read = source.read(&mut buffer)?;
        if read == 0 {
            client
                .decoder()
                .finish_live()
                .map_err(|fault| stream::error(path, &fault))?;
            return Ok(client);
        }
        let mut bytes = &buffer[..read];
        while !bytes.is_empty() && !client.ended() {
            // The rate is known once the first frame is there.
            let next = client.last_frame().map_or(0, |(number, _)| number + 1);
            if let (Some((_, time)), Some(rate)) =
                (client.last_frame(), client.decoder().tick_rate())
            {
                let step = 1.0 / rate.hz();
                if time + step > seconds + 1e-6 {
                    return Ok(client);
                }
            }
            let (used, _) = client.push_until(bytes, next).map_err(named)?;
            bytes = &bytes[used..];
        }
        if client.ended() {
            return Ok(client);
        }
    }
}
