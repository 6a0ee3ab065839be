//! `dapple render --method probes` and `ddgi`: pictures by rasterised direct light and indirect light
//! from probes.

use super::{Args, Method, read_until};
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::measure::light::{Seen, WARM_UP, from_ddgi, settled_ddgi};
use crate::probes::client::ProbesVolume;
use crate::probes::server::Options;
use crate::probes::volume::Volume;
use crate::render::gbuffer::Lookup;
use crate::render::light::{Indirect, Interpolation, Source};
use crate::render::probes::ProbeVolume;
use crate::render::tone::develop;
use crate::render::{Picture, Renderer};
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::Tracer;
use crate::trace::path::{PathTracer, Sky};
use crate::{Error, Result};
use glam::Vec3;
use std::process::ExitCode;

/// Texels a side of a shadow map.
const SHADOW_SIDE: u32 = 2048;
/// Frames that DDGI runs once all bounces are there.
const FRAMES: u32 = 64;

/// How probes are interpolated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Between {
    /// As a texture unit does.
    Trilinear,
    /// With the visibility block, against light through walls.
    Resistant,
}

/// Draws the picture that the arguments ask for.
///
/// # Errors
/// `Io`, `Codec` for unusable streams, `Invalid` for one without a volume of probes.
pub fn run(
    args: &Args,
    scene: &Scene,
    pose: &Pose,
    seconds: f64,
    camera: &CameraPose,
    renderer: &mut Renderer,
) -> Result<ExitCode> {
    let path = args.stream.as_deref().ok_or_else(|| {
        Error::Invalid(
            "name a stream with a volume of probes, or choose --method path or direct".into(),
        )
    })?;
    let sent = args.client.newest_at(seconds, args.fps);
    let client = read_until(path, scene, sent, args.limits.limits())?;
    let decoder = client.decoder();
    let live = decoder.tracks().iter();
    let volumes: Vec<ProbesVolume> = live
        .filter_map(|live| ProbesVolume::new(decoder, live))
        .collect();
    let views: Vec<ProbeVolume> = volumes.iter().map(ProbeVolume::of).collect();
    let Some((number, _)) = client.last_frame().filter(|_| !views.is_empty()) else {
        let path = path.display();
        let text = format!("{path}: the stream has no frame with a volume of probes");
        return Err(Error::Invalid(text));
    };
    let (width, height) = args.view.size;
    let sky = args.path.sky();
    let gbuffer = renderer.gbuffer(pose, Lookup::Rest, camera, width, height)?;
    let supplied: Vec<Indirect>;
    let source = match args.method {
        Method::Ddgi => {
            supplied = by_ddgi(args, scene, pose, camera, &views[0], &sky);
            Source::Supplied(&supplied)
        }
        _ => Source::Probes {
            volumes: &views,
            interpolation: match args.interpolation {
                Between::Trilinear => Interpolation::Trilinear,
                Between::Resistant => Interpolation::Resistant,
            },
        },
    };
    let (lit, _) = renderer.lit(&gbuffer, pose, camera, &sky, &source, SHADOW_SIDE)?;
    let developed = develop(&lit.radiance(), args.path.exposure());
    Picture::from_linear(width, height, &developed).write_png(&args.output)?;
    output::print(&format!(
        "{}: drawn by {}; stream frame {number}\n",
        args.output.display(),
        renderer.name()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// Indirect light by the baseline, with its probes where the stream has them.
fn by_ddgi(
    args: &Args,
    scene: &Scene,
    pose: &Pose,
    camera: &CameraPose,
    volume: &ProbeVolume,
    sky: &Sky,
) -> Vec<Indirect> {
    let tracer = Tracer::new(scene, pose);
    let paths = PathTracer::new(scene, pose, &tracer, *sky);
    let place = Volume {
        lattice: volume.lattice,
        origin: Vec3::from(volume.grid_from_world.inverse().translation),
    };
    let bar = Progress::new("DDGI", u64::from(WARM_UP + FRAMES));
    let (ddgi, _) = settled_ddgi(&paths, &place, &Options::default(), FRAMES, &|| bar.step(1));
    let (width, height) = args.view.size;
    let seen = Seen::new(&paths, camera, width, height);
    seen.indirect(|surface| from_ddgi(&ddgi, surface))
}
