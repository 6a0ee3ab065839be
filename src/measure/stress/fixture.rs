//! What the cases share: a server in a scene, its probes through encoder and decoder, and look-ups in
//! the decoded volume.

use crate::codec::{Compression, Decoder, Encoder, EncoderConfig, Event, GroupStart, Limits};
use crate::measure::ddgi::Ddgi;
use crate::measure::light::{settled_ddgi, through_a_stream};
use crate::models::Source as _;
use crate::probes::client::ProbesVolume;
use crate::probes::dering::{Keep, dering};
use crate::probes::sample::{Field, trilinear, visibility_weighted};
use crate::probes::server::{Hysteresis, Options, Server};
use crate::probes::sh::{self, L2};
use crate::probes::source::{Fit, Packing, Request, Source};
use crate::probes::volume::Volume;
use crate::trace::Aabb;
use crate::trace::path::{PathTracer, Sky};
use crate::world::World;
use crate::{Error, Result};
use glam::Vec3;

use super::places::{Place, grey};

/// Server frames before the first that is sent, unless a case is about time.
pub const WARM_UP: u32 = 24;

/// A server that averages all its frames, and how its probes are coded.
pub fn request(min: Vec3, max: Vec3, dims: [u16; 3], samples: u32) -> Request {
    Request {
        dims,
        bounds: Some(Aabb { min, max }),
        server: Options {
            samples,
            hysteresis: Hysteresis::Adaptive(0.99),
            ..Options::default()
        },
        warm_up: WARM_UP,
        packing: Packing::packed(0.004),
        sky: Sky::default(),
        fit: Fit::default(),
    }
}

/// The probes of a scene after their warm-up frames.
///
/// # Errors
/// As [`Source::new`].
pub fn warmed_up(world: &World, request: &Request) -> Result<Source> {
    let mut source = Source::new(world, request, 0)?;
    source.warm_up(world);
    Ok(source)
}

/// The volume decoded from a keyframe that is coded as `packing`.
///
/// # Errors
/// Those of the codec.
pub fn decoded(source: &mut Source, packing: Packing) -> Result<ProbesVolume<'static>> {
    Ok(through_a_stream(source, packing)?.volume)
}

/// Writes frames of a scene without animation, a keyframe every `interval`, and calls `show` with the volume that a
/// client has after each commit.
///
/// # Errors
/// Those of the codec.
pub fn frames(
    world: &World,
    source: &mut Source,
    packing: Packing,
    frames: usize,
    interval: usize,
    mut show: impl FnMut(ProbesVolume),
) -> Result<()> {
    source.pack_as(packing);
    let mut decoder = Decoder::new(Limits::default());
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
    for frame in 0..frames {
        if frame > 0 {
            source.update(world);
        }
        if frame % interval == 0 {
            encoder.group(&mut bytes, GroupStart::Keyframes)?;
            encoder.tracks(&mut bytes, &[source.track()])?;
            source.write_keyframe(&mut encoder, Compression::None, &mut bytes)?;
        } else {
            source.write_delta(&mut encoder, Compression::None, &mut bytes)?;
        }
        encoder.commit(&mut bytes, frame as u64, None)?;
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let (used, event) = decoder.push(rest)?;
            rest = &rest[used..];
            if matches!(event, Event::NeedInput) {
                break;
            }
        }
        let live = decoder.tracks().first();
        let volume = live.and_then(|live| ProbesVolume::new(&decoder, live));
        show(volume.ok_or_else(no_frame)?);
        bytes.clear();
    }
    Ok(())
}

/// The error for a stream without a volume.
pub fn no_frame() -> Error {
    Error::Invalid("the stream has no volume".into())
}

/// The server's light after deringing: what is coded.
pub fn light(server: &Server) -> Vec<L2> {
    let count = server.volume().lattice.count();
    let probe = |probe| {
        let mut light = server.l2(probe);
        dering(&mut light, Keep::Irradiance);
        light
    };
    (0..count).map(probe).collect()
}

/// How light is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LookUp {
    Trilinear,
    VisibilityWeighted,
}

/// Irradiance at a place, seen from `view`. It may be negative.
pub fn irradiance(field: &Field, volume: &Volume, how: LookUp, place: &Place, view: Vec3) -> f32 {
    let x = volume.to_grid(place.position);
    let radiance = match how {
        LookUp::Trilinear => trilinear(field, x),
        LookUp::VisibilityWeighted => visibility_weighted(field, x, place.normal, view),
    };
    grey(sh::irradiance(&radiance, place.normal))
}

/// [`irradiance`] at places seen from straight above.
pub fn at_places(field: &Field, volume: &Volume, how: LookUp, places: &[Place]) -> Vec<f32> {
    let at = |place: &Place| irradiance(field, volume, how, place, place.normal);
    places.iter().map(at).collect()
}

/// DDGI on the same probes with as many rays, all its bounces brought in.
pub fn ddgi(paths: &PathTracer, volume: &Volume, samples: u32) -> Ddgi {
    let server = Options {
        samples,
        hysteresis: Hysteresis::Fixed(0.9),
        ..Options::default()
    };
    settled_ddgi(paths, volume, &server, None, WARM_UP, &|| {}).0
}
