//! A bake as a stream: one frame, with a `vertices` track for each instance.

use super::{Baked, Plan};
use crate::Result;
use crate::codec::vertices::{
    Coding, Kernel as Distance, Signals, Update, Vertices, dithered, remap,
};
use crate::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, Limits, LookupSpace, Model, StateDigest,
    Target, Track,
};
use crate::limits::check_tracks;
use crate::obscurance::Kernel;
use crate::scene::Mesh;
use glam::Vec3;

/// How a bake is written.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Bits of a value, 8 or 5. With 5 values are dithered.
    pub bits: u8,
    pub compression: Compression,
    /// Limits of the decoders that shall read it.
    pub limits: Limits,
}

/// The tracks of a stream: one for each instance.
///
/// # Errors
/// `Invalid` for more than the limits allow.
pub fn tracks(plan: &Plan, options: Options) -> Result<Vec<Track>> {
    let scene = plan.scene();
    let signals = signals(plan);
    let counts: Vec<u32> = scene
        .meshes
        .iter()
        .map(|mesh| {
            let last = distinct_vertices(mesh).into_iter().max();
            last.map_or(0, |last| last + 1)
        })
        .collect();
    let numbered = scene.instances.iter().zip(1..);
    let tracks = numbered.map(|(instance, id)| {
        let (min, max) = bounds(&scene.meshes[instance.mesh]);
        Track {
            id,
            target: Target {
                application_id: 0,
                path: instance.name.clone(),
                content_hash: Some(scene.mesh_hash(instance.mesh)),
            },
            aabb_min: min.to_array(),
            aabb_max: max.to_array(),
            space: LookupSpace::Mesh,
            model: Model::Vertices(Vertices {
                signals,
                count: counts[instance.mesh],
                bits: options.bits,
                order: Vertices::DISTINCT_ORDER,
                coding: Coding::Packed,
            }),
        }
    });
    let tracks: Vec<Track> = tracks.collect();
    check_tracks(&scene.name, &tracks, &options.limits)?;
    Ok(tracks)
}

/// The bytes of a stream.
///
/// Values stand in the order of distinct vertices: vertices with equal positions and normals have equal
/// values, since the fit welds them.
///
/// # Errors
/// As [`tracks`]; `Codec` for what else a decoder refuses.
pub fn write(plan: &Plan, baked: &Baked, options: Options) -> Result<Vec<u8>> {
    let scene = plan.scene();
    let tracks = tracks(plan, options)?;
    let instances = scene.instances.iter().zip(&baked.instances);
    let codes: Vec<Vec<u8>> = instances
        .map(|(instance, signals)| {
            codes(
                &scene.meshes[instance.mesh],
                &signals.vertices,
                options.bits,
            )
        })
        .collect();
    let updates = tracks.iter().zip(&codes);
    let updates: Vec<Update> = updates
        .map(|(track, codes)| Update {
            track: track.id,
            codes,
        })
        .collect();
    let mut digest = StateDigest::new();
    for update in &updates {
        digest.vertices(update.track, None, &values(update.codes, options.bits));
    }
    let mut out = Vec::new();
    let config = EncoderConfig {
        limits: options.limits,
        ..EncoderConfig::default()
    };
    let mut encoder = Encoder::new(config, &mut out)?;
    encoder.group(&mut out, GroupStart::Keyframes)?;
    encoder.tracks(&mut out, &tracks)?;
    encoder.vertices(&mut out, &updates, options.compression)?;
    encoder.commit(&mut out, 0, Some(digest.finish()))?;
    encoder.end(&mut out)?;
    Ok(out)
}

/// What the values are.
fn signals(plan: &Plan) -> Signals {
    let settings = plan.settings();
    let kernel = |kernel: &Kernel| match *kernel {
        Kernel::Exponential { half_distance } => Distance::exponential(half_distance),
        Kernel::CutOff { distance } => Distance::cut_off(distance),
    };
    let share = settings.tone.blend.long;
    match settings
        .vertices
        .kernels
        .iter()
        .map(kernel)
        .collect::<Vec<_>>()[..]
    {
        [short, long] if settings.tone.separate => Signals::two(short, long, share),
        [short, long] => Signals::blended(short, long, share),
        [one, ..] => Signals::one(one),
        [] => Signals::one(Distance::NONE),
    }
}

/// The distinct vertex of each vertex of a mesh.
fn distinct_vertices(mesh: &Mesh) -> Vec<u32> {
    let arrays =
        |vectors: &[Vec3]| -> Vec<[f32; 3]> { vectors.iter().map(|v| v.to_array()).collect() };
    remap(&arrays(&mesh.positions), &arrays(&mesh.normals))
}

/// The codes of the distinct vertices of a mesh, signals side by side.
fn codes(mesh: &Mesh, signals: &[Vec<u8>], bits: u8) -> Vec<u8> {
    let mut next = 0;
    let mut codes = Vec::new();
    for (vertex, distinct) in distinct_vertices(mesh).into_iter().enumerate() {
        if distinct == next {
            next += 1;
            codes.extend(signals.iter().map(|signal| match bits {
                8 => signal[vertex],
                bits => dithered(f32::from(signal[vertex]) / 255.0, bits, distinct),
            }));
        }
    }
    codes
}

/// The values that a decoder makes of codes.
fn values(codes: &[u8], bits: u8) -> Vec<u8> {
    let value = |code: &u8| match bits {
        8 => *code,
        _ => ((u32::from(*code) * 255 + 15) / 31) as u8,
    };
    codes.iter().map(value).collect()
}

fn bounds(mesh: &Mesh) -> (Vec3, Vec3) {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let all = mesh.positions.iter();
    all.fold(none, |(low, high), p| (low.min(*p), high.max(*p)))
}
