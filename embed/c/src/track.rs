//! Tracks: what was declared, and the content of `probes` that is in no array.

use core::ffi::c_char;

use dapple_codec as codec;
use dapple_codec::{LookupSpace, TrackState, probes};

use crate::call::{ARGUMENT, Status, put, with};
use crate::decoder::Decoder;
use crate::error::ERROR_NO_TRACK;
use crate::parameters::{Parameters, from_model};

/// A track.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Track {
    /// A number that the application gives a meaning to; 0 where it has none.
    pub application_id: u64,
    /// Hash of the mesh that the content depends on, if `has_content_hash` is 1.
    pub content_hash: u64,
    /// Id, which no other track of the stream has or had.
    pub id: u32,
    /// `DAPPLE_MODEL_*`.
    pub model: u32,
    /// Number of the model's coding: 0 for `cells` of points and `raw` of others, 1 for `packed`.
    pub coding: u32,
    /// The space that a fragment is looked up in: 0 mesh space as drawn, 1 rest pose.
    pub space: u32,
    /// Whether there is a content hash.
    pub has_content_hash: u32,
    /// Of a decoder: whether there is a transform.
    pub has_transform: u32,
    /// Smallest corner of its bounds.
    pub aabb_min: [f32; 3],
    /// Largest corner.
    pub aabb_max: [f32; 3],
    /// Of a decoder: rows of the last transform, world space from grid space, a 3x4 matrix.
    pub world_from_grid: [f32; 12],
    /// Parameters of its model.
    pub parameters: Parameters,
    /// Path of the node, UTF-8, not ended by a 0. Of a decoder it holds until the next push or reset.
    pub path: *const c_char,
    /// Bytes of the path.
    pub path_size: usize,
}

/// A probe as it is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Probe {
    /// Degrees that are there: 0 for an absent probe, 1, 2 or 3.
    pub level: u16,
    /// Codes, 0 above the level.
    pub codes: [i16; 27],
}

impl From<&probes::Probe> for Probe {
    fn from(probe: &probes::Probe) -> Probe {
        Probe {
            level: probe.level.into(),
            codes: probe.codes,
        }
    }
}

fn from_state(decoder: &codec::Decoder, state: &TrackState) -> Track {
    let codec::Track { id, target, .. } = &state.track;
    let mut parameters = from_model(&state.track.model);
    // Writes of plain numbers.
    if let Some(place) = decoder.points().place_of(state) {
        // SAFETY: a track that has a place among points is one of points.
        let grid = unsafe { &mut parameters.points };
        (grid.first_bucket, grid.first_cell) = (place.first_bucket, place.first_cell);
    }
    if let Some(first) = decoder.vertices().first_of(state) {
        parameters.vertices.first_value = first;
    }
    Track {
        application_id: target.application_id,
        content_hash: target.content_hash.unwrap_or(0),
        id: *id,
        model: state.track.model.kind().number().into(),
        coding: state.track.model.coding_number().into(),
        space: match state.track.space {
            LookupSpace::Mesh => 0,
            LookupSpace::Rest => 1,
        },
        has_content_hash: target.content_hash.is_some().into(),
        has_transform: state.transform.is_some().into(),
        aabb_min: state.track.aabb_min,
        aabb_max: state.track.aabb_max,
        world_from_grid: state.transform.map_or([0.0; 12], |transform| {
            bytemuck::cast(transform.world_from_grid)
        }),
        parameters,
        path: target.path.as_ptr().cast(),
        path_size: target.path.len(),
    }
}

/// The track of an id.
fn find(decoder: &Decoder, id: u32) -> Result<&TrackState, Status> {
    let tracks = decoder.codec.tracks();
    let found = tracks.binary_search_by_key(&id, |state| state.track.id);
    found.map_or(Err(-(ERROR_NO_TRACK as Status)), |at| Ok(&tracks[at]))
}

/// Number of declared tracks that were not removed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_track_count(decoder: *const Decoder) -> usize {
    // SAFETY: the caller's promise.
    unsafe { decoder.as_ref() }.map_or(0, |decoder| decoder.codec.tracks().len())
}

/// Writes the track at an index below `dapple_decoder_track_count`; ids ascend.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_track(
    decoder: *mut Decoder,
    index: usize,
    track: *mut Track,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let state = decoder.codec.tracks().get(index);
            let state = state.ok_or(-(ERROR_NO_TRACK as Status))?;
            put(track, from_state(&decoder.codec, state))
        })
    }
}

/// Writes the track of an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_find_track(
    decoder: *mut Decoder,
    id: u32,
    track: *mut Track,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            put(track, from_state(&decoder.codec, find(decoder, id)?))
        })
    }
}

/// Writes `count` probes of a track from `first` on, as they are coded: a level of 0 says that a probe is
/// absent. Texels are what a sampler reads.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_probes(
    decoder: *mut Decoder,
    track: u32,
    first: usize,
    count: usize,
    probes: *mut Probe,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let all = decoder.codec.probes().probes_of(find(decoder, track)?);
            let some = all.get(first..).and_then(|rest| rest.get(..count));
            for (at, probe) in some.ok_or(ARGUMENT)?.iter().enumerate() {
                put(probes.wrapping_add(at), probe.into())?;
            }
            Ok(0)
        })
    }
}

/// Writes a bit for each probe of a track, 1 where it is present, the lowest bit of the first word first:
/// `(probes + 31) / 32` words, which must be `words`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_presence(
    decoder: *mut Decoder,
    track: u32,
    bits: *mut u32,
    words: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let all = decoder.codec.probes().probes_of(find(decoder, track)?);
            if words != all.len().div_ceil(32) {
                return Err(ARGUMENT);
            }
            for (at, probes) in all.chunks(32).enumerate() {
                let present = probes.iter().enumerate();
                let word = present.fold(0, |word, (bit, probe)| {
                    word | u32::from(probe.level > 0) << bit
                });
                put(bits.wrapping_add(at), word)?;
            }
            Ok(0)
        })
    }
}
