//! Tests that the baked models share: what is sent is what is shown, whatever the cuts.

use std::fmt::Debug;

use crate::common::{self, Random, transform};
use crate::volumes;
use dapple_codec::*;

/// A baked model, as the shared tests need it.
pub trait Baked {
    /// Parameters of a track.
    type Parameters: Copy;
    /// What is sent of a track.
    type Sent;
    /// What a client shows of a track.
    type Shown: Clone + PartialEq + Debug;
    /// Arrays of the model.
    const BUFFERS: &'static [Buffer];

    /// Tracks 2, 3, 5 and 6, of all codings and numbers of signals.
    fn tracks() -> [(u32, Self::Parameters); 4];
    fn track(id: u32, parameters: Self::Parameters) -> Track;
    /// Content at random.
    fn content(parameters: &Self::Parameters, random: &mut Random) -> (Self::Sent, Self::Shown);
    /// What is shown of a track without content.
    fn empty(parameters: &Self::Parameters) -> Self::Shown;
    /// Writes a record.
    fn put(
        encoder: &mut Encoder,
        out: &mut Vec<u8>,
        sent: &[(u32, Self::Sent)],
        compression: Compression,
    );
    fn digest(
        digest: &mut StateDigest,
        id: u32,
        transform: Option<&Transform>,
        shown: &Self::Shown,
    );
    /// What a decoder shows of a track, none where it is of another model.
    fn shown(decoder: &Decoder, track: &TrackState) -> Option<Self::Shown>;
}

/// Frames of several tracks beside other models, with digests, and what a client shows after each. Some
/// frames have content for some tracks, and a group that starts from keyframes empties the others.
fn stream<M: Baked>(
    seed: u64,
    frames: u32,
    compression: Compression,
) -> (Vec<u8>, Vec<Vec<M::Shown>>) {
    let mut random = Random(seed);
    let tracks = M::tracks();
    let points = common::track(1, points::PointWidths::BITS_32, 5, 6);
    let volume = volumes::volume_track(4, volumes::volume([2, 2, 1], 0, probes::Coding::Raw));
    let mut all = vec![points, volume];
    all.extend(tracks.map(|(id, parameters)| M::track(id, parameters)));
    all.sort_by_key(|track| track.id);
    let empty = tracks.map(|(_, parameters)| M::empty(&parameters));
    let mut shown = empty.to_vec();
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut states = Vec::new();
    for frame in 0..frames {
        if frame % 5 == 0 {
            encoder.group(&mut out, GroupStart::Keyframes).unwrap();
            shown = empty.to_vec();
        }
        if frame == 0 {
            encoder.tracks(&mut out, &all).unwrap();
        }
        let mut sent = Vec::new();
        for ((id, parameters), now) in tracks.iter().zip(&mut shown) {
            if random.below(3) > 0 {
                let (content, visible) = M::content(parameters, &mut random);
                *now = visible;
                sent.push((*id, content));
            }
        }
        // Two records a frame, the later ids first.
        let (first, second) = sent.split_at(sent.len() / 2);
        for part in [second, first] {
            M::put(&mut encoder, &mut out, part, compression);
        }
        let moved = transform(frame as f32);
        encoder
            .transforms(&mut out, &[(3, moved)], compression)
            .unwrap();
        let mut digest = StateDigest::new();
        let cells = [points::Cell::FREE; 6];
        digest.points(1, None, &[points::Bucket::EMPTY; 5], &cells);
        for ((id, _), now) in tracks.iter().zip(&shown) {
            if *id == 5 {
                digest.probes(4, None, &[], None);
            }
            M::digest(&mut digest, *id, (*id == 3).then_some(&moved), now);
        }
        encoder
            .commit(&mut out, frame.into(), Some(digest.finish()))
            .unwrap();
        states.push(shown.clone());
    }
    encoder.end(&mut out).unwrap();
    (out, states)
}

/// What a decoder shows of all tracks of the model.
pub fn shown<M: Baked>(decoder: &Decoder) -> Vec<M::Shown> {
    let tracks = decoder.tracks().iter();
    tracks
        .filter_map(|track| M::shown(decoder, track))
        .collect()
}

/// What was sent is shown after each frame, whatever the pieces that the stream comes in.
pub fn check_content_for_any_cut<M: Baked>() {
    for (seed, compression) in [(1, Compression::None), (2, Compression::Lz4)] {
        let (bytes, states) = stream::<M>(seed, 23, compression);
        for piece in [1, 7, 4096, usize::MAX] {
            let mut decoder = Decoder::new(Limits::default());
            let mut frames = states.iter();
            for part in bytes.chunks(piece) {
                let check = |decoder: &mut Decoder, event| {
                    if let Event::Frame(_) = event {
                        assert_eq!(&shown::<M>(decoder), frames.next().unwrap());
                    }
                };
                decoder.push_all(part, check).unwrap();
            }
            decoder.finish().unwrap();
            assert_eq!(frames.next(), None);
        }
    }
}

/// Arrays that are copied by their dirty ranges are those of the decoder, after each frame.
pub fn check_dirty_ranges<M: Baked>() {
    let (bytes, _) = stream::<M>(3, 40, Compression::None);
    let mut copies = common::Copies::default();
    let update = |decoder: &mut Decoder, _| copies.update(decoder);
    decode_all(&bytes, Limits::default(), update).unwrap();
    for buffer in M::BUFFERS {
        assert!(copies.seen.contains(buffer));
    }
}

/// A frame that sends again what is there changes no array.
pub fn check_same_content_is_not_dirty<M: Baked>() {
    for (id, parameters) in M::tracks() {
        let (content, _) = M::content(&parameters, &mut Random(2));
        let sent = [(id, content)];
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        encoder
            .tracks(&mut out, &[M::track(id, parameters)])
            .unwrap();
        let mut decoder = Decoder::new(Limits::default());
        for frame in 0..2 {
            M::put(&mut encoder, &mut out, &sent, Compression::None);
            encoder.commit(&mut out, frame, None).unwrap();
            decoder.push_all(&out, |_, _| {}).unwrap();
            out.clear();
            let arrays = if frame == 0 { M::BUFFERS.len() } else { 0 };
            assert_eq!(decoder.dirty().count(), arrays);
            decoder.clear_dirty();
        }
    }
}
