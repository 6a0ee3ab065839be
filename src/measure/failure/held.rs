//! What a client holds: the probes of a server, through encoder and decoder.

use crate::Result;
use crate::measure::ddgi::Ddgi;
use crate::measure::light::{settled_ddgi, through_a_stream};
use crate::probes::client::ProbesVolume;
use crate::probes::content::{Content, Packing, Request};
use crate::probes::dering::{Keep, dering};
use crate::probes::sample::{Field, resistant, trilinear};
use crate::probes::server::{Hysteresis, Options, Server};
use crate::probes::sh::{self, L2};
use crate::probes::volume::Volume;
use crate::scene::Scene;
use crate::trace::Aabb;
use crate::trace::path::{PathTracer, Sky};
use glam::Vec3;

use super::places::{Place, grey};

/// Frames that a server settles in, unless a case is about time.
pub const SETTLE: u32 = 24;

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
        settle: SETTLE,
        packing: Packing::packed(0.004),
        sky: Sky::default(),
    }
}

/// The content of a still scene, settled.
///
/// # Errors
/// As [`Content::new`].
pub fn settled<'s>(scene: &'s Scene, request: &Request) -> Result<Content<'s>> {
    Content::new(scene, request, 0.0, 0)
}

/// What a client makes of a keyframe and of the delta with the visibility block, coded as `packing`.
///
/// # Errors
/// Those of the codec.
pub fn decoded(content: &mut Content, packing: Packing) -> Result<ProbesVolume> {
    Ok(through_a_stream(content, packing)?.volume)
}

/// The server's light without what rings below zero: what is coded.
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
    Resistant,
}

/// Irradiance at a place, seen from `view`. It may be negative.
pub fn irradiance(field: &Field, volume: &Volume, how: LookUp, place: &Place, view: Vec3) -> f32 {
    let x = volume.to_grid(place.position);
    let radiance = match how {
        LookUp::Trilinear => trilinear(field, x),
        LookUp::Resistant => resistant(field, x, place.normal, view),
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
    settled_ddgi(paths, volume, &server, SETTLE, &|| {}).0
}
