//! `dapple render`: one picture of a scene, lit by a stream or by a reference.

mod path;
mod probes;
mod stream_frame;

use super::args::{self, ClientArgs, Rate, SceneArgs, ViewArgs};
use super::effects::{self, Given};
use super::inputs::is_dash;
use super::limits::LimitArgs;
use super::output::{self, Sink};
use super::stream;
use crate::files;
use crate::measure::reference::{RAYS, mean_of_halves, rtao};
use crate::points::client::PointsView;
use crate::points::server::Options;
use crate::render::gbuffer::Lookup;
use crate::render::light::{Interpolation, OCCLUSION_STRENGTH};
use crate::render::obscurance::{Baked, BakedAo};
use crate::render::{Backend, Picture, Renderer, composite};
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::Tracer;
use crate::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use stream_frame::StreamFrame;

/// Examples in the help.
const EXAMPLES: &str = "\
Examples:
  dapple render ao.dapple --scene scene.glb --frame 30 -o picture.png
  dapple render light.dapple --scene scene.glb --camera door -o lit.png
  dapple render --method rtao --scene scene.glb --frame 30 -o reference.png
  dapple render --method path --scene scene.glb --samples 1024 -o path.png";

/// Render one frame of a scene to a PNG file, lit by a stream or by a reference.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The stream, `-` for one on standard input; not needed where the scene's file has one, and for
    /// `--method rtao`, `none`, `path` and `direct`.
    #[arg(value_name = "STREAM", help_heading = "Arguments")]
    stream: Option<PathBuf>,
    /// The scene that the stream was made for: a glTF file, `-` for one on standard input, or `hall`.
    #[arg(long, value_name = "SCENE", help_heading = "Scene and view")]
    scene: PathBuf,
    /// The scene within the glTF file, by number or name; the file's default one if not given.
    #[arg(long, value_name = "N|NAME", help_heading = "Scene and view")]
    gltf_scene: Option<String>,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    client: ClientArgs,
    /// Where ambient occlusion, or all light, comes from; the model of the stream if not given.
    #[arg(long, help_heading = "Method")]
    method: Option<Method>,
    /// How probes are interpolated.
    #[arg(long, default_value = "visibility-weighted", help_heading = "Method")]
    interpolation: Interpolation,
    /// Strength, 0 to 1, of the stream's ambient occlusion of `points` on its light of probes, where it
    /// has both.
    #[arg(long, value_name = "SHARE", default_value_t = OCCLUSION_STRENGTH, value_parser = args::share,
        help_heading = "Method")]
    occlusion: f32,
    /// Frames a second that `--frame` counts in; the stream's if not given, 60 without a stream.
    #[arg(long, value_name = "RATE", help_heading = "Scene and view")]
    fps: Option<Rate>,
    /// Length of the reference's occlusion rays in metres; as `encode` has it if not given.
    #[arg(long, value_name = "M", value_parser = args::distance, help_heading = "Ray-traced ambient occlusion")]
    distance: Option<f32>,
    /// Rays a pixel of the reference.
    #[arg(long, value_name = "COUNT", default_value_t = RAYS,
        value_parser = clap::value_parser!(u32).range(2..=65_536), help_heading = "Ray-traced ambient occlusion")]
    rays: u32,
    #[command(flatten)]
    path: path::PathArgs,
    /// What draws.
    #[arg(long, default_value = "auto", help_heading = "Output")]
    backend: Backend,
    #[command(flatten)]
    limits: LimitArgs,
    /// Write ambient occlusion alone, as a gray picture.
    #[arg(long, help_heading = "Output")]
    ao_only: bool,
    /// The PNG file; `-` for standard output. Missing folders are made.
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// Ambient occlusion out of the stream.
    Points,
    /// Baked obscurance out of the stream: at vertices, of instances, in regions, and by points where an instance
    /// has them.
    #[value(alias = "instances", alias = "regions")]
    Vertices,
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

/// Frames a second of `--frame` where there is no stream.
const FPS: f64 = 60.0;

/// Runs the command.
///
/// # Errors
/// `Scene`, `Io`, `Codec` for unusable files, `Invalid` for what scene or stream do not have,
/// `Usage` for outputs that cannot be taken and for a method without its stream.
pub fn run(args: &Args, given: &Given) -> Result<ExitCode> {
    check_extension(&args.output, "png")?;
    if let Some(linear) = args.path.linear() {
        check_extension(linear, "pfm")?;
    }
    if is_dash(&args.scene) && args.stream.as_deref().is_some_and(is_dash) {
        let text = "standard input (-) is named for two inputs";
        return Err(Error::Usage(text.into()));
    }
    let needs_stream = args.method.is_none_or(Method::needs_stream);
    let attached = match needs_stream && args.stream.is_none() {
        true => Some(attached(&args.scene)?),
        false => None,
    };
    let path = match attached {
        Some(_) => Some(args.scene.as_path()),
        None => args.stream.as_deref(),
    };
    let scene = SceneArgs {
        scene: args.scene.clone(),
        gltf_scene: args.gltf_scene.clone(),
        view: args.view.clone(),
    }
    .open(true)?;
    let view = args.view.view(&scene)?;
    let stream_frame = match path {
        Some(path) if needs_stream => {
            let source = match attached {
                Some(source) => source,
                None => stream::Source::open(path)?,
            };
            Some((StreamFrame::read(source, path, &scene, args)?, path))
        }
        Some(path) => {
            files::protect(path);
            None
        }
        None => None,
    };
    let method = match &stream_frame {
        Some((stream_frame, path)) => stream_frame.method(args.method, path)?,
        None => args.method.unwrap_or(Method::None),
    };
    given.warn_without_effect(&args.active(method));
    let seconds = match &stream_frame {
        Some((stream_frame, _)) => stream_frame.seconds,
        None => {
            let rate = args.fps.map_or(FPS, Rate::hz);
            args.view.time_at(rate).unwrap_or(0.0)
        }
    };
    let pose = scene.pose(seconds);
    let camera = view.at(&pose);
    // Before the work: an output that cannot be written is told at once.
    let mut sink = Sink::create(&args.output)?;
    let (picture, note) = if let Method::Path | Method::Direct = method {
        let direct_only = method == Method::Direct;
        path::picture(&args.path, &scene, &pose, &camera, args, direct_only)?
    } else {
        let mut renderer = Renderer::new(&scene, args.backend)?;
        let stream_frame = stream_frame.as_ref().map(|(stream_frame, _)| stream_frame);
        let (picture, note) = drawn(
            args,
            method,
            &scene,
            &pose,
            stream_frame,
            &camera,
            &mut renderer,
        )?;
        (picture, format!("drawn by {}{note}", renderer.name()))
    };
    sink.write(&picture.to_png()?)?;
    sink.finish()?;
    let camera = args.view.describe(&scene, &view);
    output::print_about(&args.output, &format!("{note}; {camera}\n"))?;
    Ok(ExitCode::SUCCESS)
}

/// The stream in the file of a scene.
///
/// # Errors
/// `Io` and `Scene` where the file cannot be read, `Usage` where it has no stream.
fn attached(scene: &Path) -> Result<stream::Source> {
    let is_file = !is_dash(scene) && scene != Path::new("hall");
    let source = match is_file {
        true => stream::Source::attached(scene)?,
        false => None,
    };
    source.ok_or_else(|| {
        Error::Usage(format!(
            "{} has no stream in it: name a stream, or choose --method rtao, none, path or direct",
            stream::name(scene)
        ))
    })
}

/// A picture by a method that rasterises, and a note about it.
fn drawn(
    args: &Args,
    method: Method,
    scene: &Scene,
    pose: &Pose,
    stream_frame: Option<&StreamFrame>,
    camera: &CameraPose,
    renderer: &mut Renderer,
) -> Result<(Picture, String)> {
    let (width, height) = args.view.size;
    let mut note = String::new();
    let (frame, ao) = match (method, stream_frame) {
        (Method::Probes | Method::Ddgi, Some(stream_frame)) => {
            let client = &stream_frame.client;
            let picture = probes::picture(args, method, scene, pose, client, camera, renderer)?;
            return Ok((picture, format!("; stream frame {}", stream_frame.frame.0)));
        }
        (Method::Points, Some(stream_frame)) => {
            let (client, (number, time)) = (&stream_frame.client, stream_frame.frame);
            let server_pose = scene.pose(time);
            let shown = PointsView::new(client);
            let lookup = if shown.looks_up_rest_pose() {
                Lookup::Rest
            } else {
                Lookup::Posed(&server_pose)
            };
            let frame = renderer.frame(pose, lookup, camera, width, height)?;
            let points =
                renderer.points_ao(&frame.gbuffer, &shown.state(), args.client.fallback)?;
            note = format!(
                "; stream frame {number}, {:.3} % of fragments without a point in reach",
                100.0 * points.counts.without_point()
            );
            (frame, points.ao)
        }
        (Method::Vertices, Some(stream_frame)) => {
            let frame = renderer.frame(pose, Lookup::Rest, camera, width, height)?;
            let baked = Baked::new(&stream_frame.client, scene, pose)?;
            let BakedAo { ao, counts } = renderer.baked_ao(&frame.gbuffer, &baked)?;
            let baked = counts.vertices + counts.instances + counts.regions;
            let all = baked + counts.points + counts.none;
            let share = |count: u64| 100.0 * count as f64 / all.max(1) as f64;
            note = format!(
                "; fragments lit at vertices {:.1} %, by instance {:.1} %, by region {:.1} %, not baked {:.1} %",
                share(counts.vertices),
                share(counts.instances),
                share(counts.regions),
                share(counts.none)
            );
            if counts.points > 0 {
                note += &format!(", by points {:.1} %", share(counts.points));
            }
            (frame, ao)
        }
        (Method::Rtao, _) => {
            let frame = renderer.frame(pose, Lookup::Rest, camera, width, height)?;
            let tracer = Tracer::new(scene, pose);
            let fitted = || Options::for_scene(scene).distance;
            let distance = args.distance.unwrap_or_else(fitted);
            note = format!("; AO distance {} m", output::significant(distance.into()));
            let (a, b) = rtao(&tracer, &frame.gbuffer, args.rays, distance, 0);
            (frame, mean_of_halves(&a, &b))
        }
        (Method::None | Method::Path | Method::Direct, _)
        | (Method::Points | Method::Vertices | Method::Probes | Method::Ddgi, None) => {
            let frame = renderer.frame(pose, Lookup::Rest, camera, width, height)?;
            let open = vec![1.0; frame.gbuffer.fragments.len()];
            (frame, open)
        }
    };
    let picture = if args.ao_only {
        composite::ao_picture(&frame.gbuffer, &ao)
    } else {
        frame.composite(Some(&ao))
    };
    Ok((picture, note))
}

/// Refuses a file whose name promises another format than `extension`.
fn check_extension(path: &Path, extension: &str) -> Result<()> {
    match path.extension() {
        Some(found) if !is_dash(path) && !found.eq_ignore_ascii_case(extension) => {
            Err(Error::Usage(format!(
                "{}: this is written as {}; name a file that ends with .{extension}",
                path.display(),
                extension.to_uppercase()
            )))
        }
        _ => Ok(()),
    }
}

impl Args {
    /// The choices that decide which other options have an effect.
    fn active(&self, method: Method) -> Vec<&'static str> {
        let mut active = vec![method.choice()];
        let spread = method == Method::Direct && self.path.supersample();
        active.extend(spread.then_some(effects::SPREAD));
        active.extend(self.view.frame.map(|_| effects::FRAME));
        active
    }
}

impl Method {
    fn needs_stream(self) -> bool {
        !matches!(
            self,
            Method::Rtao | Method::None | Method::Path | Method::Direct
        )
    }

    /// What of a stream it shows.
    fn model(self) -> &'static str {
        match self {
            Method::Points => "points",
            Method::Vertices => "baked obscurance",
            _ => "probes",
        }
    }

    /// As the user types it.
    fn choice(self) -> &'static str {
        match self {
            Method::Points => effects::METHOD_POINTS,
            Method::Vertices => effects::METHOD_VERTICES,
            Method::Rtao => effects::RTAO,
            Method::None => effects::NONE,
            Method::Path => effects::PATH,
            Method::Direct => effects::DIRECT,
            Method::Probes => effects::METHOD_PROBES,
            Method::Ddgi => effects::DDGI,
        }
    }
}
