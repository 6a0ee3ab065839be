//! `vertices`: tracks of values, drawn from an input, and the rules that they keep.

use arbitrary::{Result, Unstructured};
use dapple_codec::container::HEADER_BYTES;
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::vertices::{Coding, State, Update, Vertices};
use dapple_codec::{Compression, Decoder, Encoder, EncoderConfig, GroupStart, Model, TrackState};

use super::{TrackContent, in_records};
use crate::records::{put, some};
use crate::server::compression;

/// Small enough that eight of them with all their content fit into a record.
pub fn track(u: &mut Unstructured<'_>) -> Result<Vertices> {
    let kernel = |u: &mut Unstructured<'_>| {
        let distance = f32::from(u.int_in_range(1u8..=40)?) / 4.0;
        Ok(match u.arbitrary()? {
            true => Kernel::exponential(distance),
            false => Kernel::cut_off(distance),
        })
    };
    let first = kernel(u)?;
    Ok(Vertices {
        signals: match u.int_in_range(0..=3)? {
            0 => Signals::one(first),
            1 => Signals::blended(first, kernel(u)?, 0.5),
            _ => Signals::two(first, kernel(u)?, 0.97),
        },
        count: u.int_in_range(1..=40)?,
        bits: if u.arbitrary()? { 5 } else { 8 },
        order: u.int_in_range(0..=1)?,
        coding: match u.ratio(1, 3)? {
            true => Coding::Raw,
            false => Coding::Packed,
        },
    })
}

/// Codes that a track may have.
pub fn codes(u: &mut Unstructured<'_>, vertices: &Vertices) -> Result<Vec<u8>> {
    let most = if vertices.bits == 5 { 31 } else { 255 };
    let mut code = u.arbitrary::<u8>()? & most;
    let mut codes = Vec::new();
    for _ in 0..vertices.values() {
        // Near the one before more often than not.
        code = match u.ratio(3, 4)? {
            true => code
                .saturating_add_signed(u.int_in_range(-2i8..=2)?)
                .min(most),
            false => u.arbitrary::<u8>()? & most,
        };
        codes.push(code);
    }
    Ok(codes)
}

/// The values that codes come to (V-020).
pub fn values(vertices: &Vertices, codes: &[u8]) -> Vec<u8> {
    let value = |&code: &u8| match vertices.bits {
        5 => (f64::from(code) * 255.0 / 31.0).round() as u8,
        _ => code,
    };
    codes.iter().map(value).collect()
}

/// Number of the coding.
pub fn coding(vertices: &Vertices) -> u16 {
    match vertices.coding {
        Coding::Raw => 0,
        Coding::Packed => 1,
    }
}

/// Parameters as bytes, with `scale` times as many vertices.
pub fn parameters(vertices: &Vertices, scale: u32) -> Vec<u8> {
    let signals = vertices.signals;
    let [first, second] = signals.kernels;
    let mut bytes = vec![signals.count, first.kind, second.kind, 0];
    let numbers = [first.distance, second.distance, signals.share];
    put(&mut bytes, &numbers.map(f32::to_bits));
    put(&mut bytes, &[vertices.count.saturating_mul(scale)]);
    bytes.extend([vertices.bits, vertices.order, 0, 0]);
    bytes
}

/// The values of a track.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// A byte each.
    pub values: Vec<u8>,
}

impl Content {
    /// Of a new track.
    pub fn empty(vertices: &Vertices) -> Content {
        let values = vec![255; vertices.values()];
        Content { values }
    }

    /// What a decoder shows.
    pub fn shown(state: &State, track: &TrackState) -> Content {
        let values = state.values_of(track).to_vec();
        Content { values }
    }
}

/// Changes tracks and writes them ([`super::write`]).
pub fn write(
    u: &mut Unstructured<'_>,
    tracks: Vec<TrackContent<'_>>,
    encoder: &mut Encoder,
    out: &mut Vec<u8>,
) -> Result<()> {
    let mut contents = Vec::new();
    for track in tracks {
        if let (Model::Vertices(vertices), super::Content::Vertices(kept)) =
            (track.model, track.content)
        {
            let codes = codes(u, &vertices)?;
            kept.values = values(&vertices, &codes);
            contents.push((track.id, codes));
        }
    }
    in_records(u, &contents, |u, contents| {
        let written = encoder.vertices(out, &updates(contents), compression(u)?);
        written.expect("vertices");
        Ok(())
    })
}

fn updates(contents: &[(u32, Vec<u8>)]) -> Vec<Update<'_>> {
    let update = |content| -> Update<'_> {
        let (track, codes): &(u32, Vec<u8>) = content;
        Update {
            track: *track,
            codes,
        }
    };
    contents.iter().map(update).collect()
}

/// New values of some tracks, by the encoder.
pub fn payload(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let named = decoder.tracks().iter().map(|state| state.track.clone());
    let tracks: Vec<_> = named
        .filter(|track| track.vertices().is_some() && ids.contains(&track.id))
        .collect();
    let mut payload = Vec::new();
    if tracks.is_empty() {
        put(&mut payload, &[0, 1, 0, 0]);
        return Ok(payload);
    }
    // A stream of its own, whose last record is the one that is wanted.
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("preamble");
    encoder.tracks(&mut bytes, &tracks).expect("tracks");
    let start = GroupStart::Keyframes;
    encoder.group(&mut bytes, start).expect("group");
    let mut contents = Vec::new();
    for track in &tracks {
        let vertices = track.vertices().expect("vertices");
        contents.push((track.id, codes(u, vertices)?));
    }
    let at = bytes.len() + HEADER_BYTES;
    let written = encoder.vertices(&mut bytes, &updates(&contents), Compression::None);
    written.expect("vertices");
    payload = bytes.split_off(at);
    if u.ratio(1, 8)? {
        let at = u.choose_index(payload.len())?;
        payload[at] ^= 1 << u.int_in_range(0..=7)?;
    }
    Ok(payload)
}

/// What holds of the committed state (`spec/vertices.md` §5 to §7). Returns what it counts (V-002).
pub fn check(decoder: &Decoder) -> u64 {
    let state = decoder.vertices();
    let mut bytes = 0;
    let mut regions = Vec::new();
    for track in decoder.tracks() {
        let Some(vertices) = track.track.vertices() else {
            continue;
        };
        let values = state.values_of(track);
        let first = state.first_of(track).expect("a place") as usize;
        assert_eq!(values.len(), vertices.values());
        assert_eq!(first % 4, 0);
        assert_eq!(&state.values()[first..first + values.len()], values);
        if vertices.bits == 5 {
            let all = self::values(vertices, &(0..32).collect::<Vec<u8>>());
            assert!(values.iter().all(|value| all.contains(value)));
        }
        let size = values.len().next_multiple_of(4);
        regions.push((first, first + size));
        bytes += 2 * size as u64;
    }
    regions.sort_unstable();
    assert!(regions.windows(2).all(|pair| pair[0].1 <= pair[1].0));
    bytes
}
