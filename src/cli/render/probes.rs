//! `dapple render --method probes` and `ddgi`: pictures by rasterised direct light and indirect light
//! from probes.

use super::{Args, Method};
use crate::Result;
use crate::cli::output;
use crate::cli::progress::Progress;
use crate::client::Client;
use crate::measure::light::{FirstHits, WARM_UP, from_ddgi, settled_ddgi};
use crate::points::client::PointsView;
use crate::probes::client::{ProbesView, ProbesVolume};
use crate::probes::server::Options;
use crate::probes::volume::Volume;
use crate::render::gbuffer::Lookup;
use crate::render::light::{Indirect, Interpolation, Occlusion, Source};
use crate::render::tone::develop;
use crate::render::{Picture, Renderer};
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::Tracer;
use crate::trace::path::{PathTracer, Sky};
use glam::Vec3;

/// Texels a side of a shadow map.
const SHADOW_SIDE: u32 = 2048;
/// Frames that DDGI runs once all bounces are there.
const FRAMES: u32 = 64;

/// The picture that the arguments ask for, of a client with a volume of probes, whose light its ambient
/// occlusion darkens where it has any.
///
/// # Errors
/// As [`Renderer::gbuffer`] and [`Renderer::lit`].
pub fn picture(
    args: &Args,
    method: Method,
    scene: &Scene,
    pose: &Pose,
    client: &Client,
    camera: &CameraPose,
    renderer: &mut Renderer,
) -> Result<Picture> {
    let volumes = ProbesView::new(client).volumes;
    if method == Method::Probes && args.interpolation == Interpolation::VisibilityWeighted {
        warn_of_leaks(&volumes);
    }
    let (width, height) = args.view.size;
    let sky = args.path.sky();
    let points = PointsView::new(client);
    let server_pose = client.last_frame().map(|(_, time)| scene.pose(time));
    let lookup = match &server_pose {
        Some(posed) if !points.looks_up_rest_pose() => Lookup::Posed(posed),
        _ => Lookup::Rest,
    };
    let gbuffer = renderer.gbuffer(pose, lookup, camera, width, height)?;
    let state = points.state();
    let ao = match method == Method::Probes && !state.tracks.is_empty() && args.occlusion > 0.0 {
        true => Some(
            renderer
                .points_ao(&gbuffer, &state, args.client.fallback)?
                .ao,
        ),
        false => None,
    };
    let supplied: Vec<Indirect>;
    let source = if method == Method::Ddgi
        && let Some(volume) = volumes.first()
    {
        supplied = by_ddgi(args, scene, pose, camera, volume, &sky);
        Source::Supplied(&supplied)
    } else {
        Source::Probes {
            volumes: &volumes,
            interpolation: args.interpolation,
            occlusion: ao.as_deref().map(|ao| Occlusion {
                ao,
                strength: args.occlusion,
            }),
        }
    };
    let (lit, _) = renderer.lit(&gbuffer, pose, camera, &sky, &source, SHADOW_SIDE)?;
    let developed = develop(&lit.radiance(), args.path.exposure());
    Ok(Picture::from_linear(width, height, &developed))
}

/// Warns where the interpolation has no visibility block to keep light from coming through walls.
fn warn_of_leaks(volumes: &[ProbesVolume]) {
    let without = volumes.iter().filter(|v| v.visibility().is_none()).count();
    if without > 0 {
        output::warn(&format!(
            "{without} of {} volumes of probes have no visibility block: light may come through walls; \
             encode with --visibility-side 16",
            volumes.len()
        ));
    }
}

/// Indirect light by the baseline, with its probes where the stream has them.
fn by_ddgi(
    args: &Args,
    scene: &Scene,
    pose: &Pose,
    camera: &CameraPose,
    volume: &ProbesVolume,
    sky: &Sky,
) -> Vec<Indirect> {
    let tracer = Tracer::new(scene, pose);
    let paths = PathTracer::new(scene, pose, &tracer, *sky);
    let place = Volume {
        lattice: volume.lattice,
        origin: Vec3::from(volume.grid_from_world.inverse().translation),
    };
    let bar = Progress::new("DDGI", u64::from(WARM_UP + FRAMES));
    let (ddgi, _) = settled_ddgi(&paths, &place, &Options::default(), None, FRAMES, &|| {
        bar.step(1)
    });
    let (width, height) = args.view.size;
    let seen = FirstHits::new(&paths, camera, width, height);
    seen.indirect(|surface| from_ddgi(&ddgi, surface))
}
