//! Streams of `vertices` tracks: what is sent is what is shown, whatever the cuts and the faults.

use crate::baked::{self, Baked};
use crate::common::{self, Random, decode, header, records, with_payload};
use dapple_codec::container::record_type;
use dapple_codec::vertices::*;
use dapple_codec::*;

fn vertices(count: u32, signals: u8, bits: u8, coding: Coding) -> Vertices {
    let (first, second) = (Kernel::exponential(2.0), Kernel::cut_off(1.0));
    Vertices {
        signals: match signals {
            1 => Signals::one(first),
            _ => Signals::two(first, second, 0.97),
        },
        count,
        bits,
        order: Vertices::DISTINCT_ORDER,
        coding,
    }
}

fn vertices_track(id: u32, vertices: Vertices) -> Track {
    Track {
        id,
        target: Target {
            application_id: 3,
            path: String::new(),
            content_hash: Some(u64::from(id)),
        },
        aabb_min: [0.0; 3],
        aabb_max: [4.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Vertices(vertices),
    }
}

/// Codes at random, and the values that a client shows of them.
fn content(vertices: &Vertices, random: &mut Random) -> (Vec<u8>, Vec<u8>) {
    let most = if vertices.bits == 5 { 31 } else { 255 };
    let codes: Vec<u8> = (0..vertices.values())
        .map(|_| random.below(most + 1) as u8)
        .collect();
    let value = |&code: &u8| (f64::from(code) * 255.0 / f64::from(most)).round() as u8;
    let values = codes.iter().map(value).collect();
    (codes, values)
}

impl Baked for Vertices {
    type Parameters = Vertices;
    type Sent = Vec<u8>;
    type Shown = Vec<u8>;
    const BUFFERS: &'static [Buffer] = &[Buffer::VerticesValues];

    fn tracks() -> [(u32, Vertices); 4] {
        [
            (2, vertices(9, 2, 8, Coding::Packed)),
            (3, vertices(5, 1, 5, Coding::Raw)),
            (5, vertices(1, 2, 5, Coding::Packed)),
            (6, vertices(70, 1, 8, Coding::Raw)),
        ]
    }

    fn track(id: u32, vertices: Vertices) -> Track {
        vertices_track(id, vertices)
    }

    fn content(vertices: &Vertices, random: &mut Random) -> (Vec<u8>, Vec<u8>) {
        content(vertices, random)
    }

    fn empty(vertices: &Vertices) -> Vec<u8> {
        vec![255; vertices.values()]
    }

    fn put(
        encoder: &mut Encoder,
        out: &mut Vec<u8>,
        sent: &[(u32, Vec<u8>)],
        compression: Compression,
    ) {
        let updates = sent.iter().map(|(track, codes)| Update {
            track: *track,
            codes,
        });
        let updates: Vec<_> = updates.collect();
        encoder.vertices(out, &updates, compression).unwrap();
    }

    fn digest(digest: &mut StateDigest, id: u32, transform: Option<&Transform>, shown: &Vec<u8>) {
        digest.vertices(id, transform, shown);
    }

    fn shown(decoder: &Decoder, track: &TrackState) -> Option<Vec<u8>> {
        track.track.vertices()?;
        let values = decoder.vertices().values_of(track);
        let first = decoder.vertices().first_of(track)? as usize;
        assert_eq!(first % 4, 0);
        let all = decoder.vertices().values();
        assert_eq!(all[first..][..values.len()], *values);
        Some(values.to_vec())
    }
}

#[test]
fn decoded_values_are_those_sent_for_any_cut() {
    baked::check_content_for_any_cut::<Vertices>();
}

#[test]
fn dirty_arrays_of_values_cover_every_change() {
    baked::check_dirty_ranges::<Vertices>();
}

#[test]
fn values_sent_again_are_not_dirty() {
    baked::check_same_content_is_not_dirty::<Vertices>();
}

/// Tracks come and go in one array: each is open when it comes, and no other one changes.
#[test]
fn tracks_that_come_and_go_keep_to_their_places() {
    let mut random = Random(7);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    let mut decoder = Decoder::new(Limits::default());
    let mut copies = common::Copies::default();
    let mut kept: Vec<(u32, Vertices, Vec<u8>)> = Vec::new();
    for frame in 0..200u32 {
        if kept.len() > 5 {
            let at = random.below(kept.len() as u32) as usize;
            encoder
                .remove_tracks(&mut out, &[kept.remove(at).0])
                .unwrap();
        }
        let coding = [Coding::Raw, Coding::Packed][random.below(2) as usize];
        let new = vertices(1 + random.below(9), 1 + random.below(2) as u8, 8, coding);
        encoder
            .tracks(&mut out, &[vertices_track(frame, new)])
            .unwrap();
        kept.push((frame, new, vec![255; new.values()]));
        let at = random.below(kept.len() as u32) as usize;
        let (track, vertices, values) = &mut kept[at];
        let (codes, shown) = content(vertices, &mut random);
        *values = shown;
        let update = Update {
            track: *track,
            codes: &codes,
        };
        encoder
            .vertices(&mut out, &[update], Compression::None)
            .unwrap();
        encoder.commit(&mut out, frame.into(), None).unwrap();
        decoder.push_all(&out, |_, _| {}).unwrap();
        out.clear();
        let wanted: Vec<_> = kept.iter().map(|(_, _, values)| values.clone()).collect();
        assert_eq!(baked::shown::<Vertices>(&decoder), wanted);
        copies.update(&mut decoder);
    }
    assert!(
        decoder.vertices().values().len() < 8 * 20,
        "no place is used again"
    );
}

#[test]
fn wrong_calls_are_refused_and_write_nothing() {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let points = common::track(1, points::PointWidths::BITS_32, 5, 6);
    let five = vertices_track(2, vertices(3, 1, 5, Coding::Packed));
    let two = vertices_track(3, vertices(2, 2, 8, Coding::Raw));
    encoder.tracks(&mut out, &[points, five, two]).unwrap();
    let update = |track, codes| Update { track, codes };
    let mut refused = |encoder: &mut Encoder, id: u16, updates: &[Update<'_>]| {
        let before = out.clone();
        let written = encoder.vertices(&mut out, updates, Compression::None);
        assert_eq!(written.unwrap_err().id, id, "{updates:?}");
        assert_eq!(out, before);
    };
    refused(&mut encoder, 4008, &[update(2, &[1, 2, 3])]);
    let mut more = Vec::new();
    encoder.group(&mut more, GroupStart::Keyframes).unwrap();
    for (id, updates) in [
        (4012, vec![update(2, &[1, 2])]),
        (4012, vec![update(2, &[1, 2, 3, 4])]),
        (4012, vec![update(2, &[1, 2, 32])]),
        (4012, vec![update(3, &[1, 2])]),
        (2019, vec![update(9, &[1])]),
        (2027, vec![update(1, &[1])]),
        (2004, vec![update(3, &[1, 2, 3, 4]), update(2, &[1, 2, 3])]),
        (2004, vec![update(2, &[1, 2, 3]), update(2, &[1, 2, 3])]),
    ] {
        refused(&mut encoder, id, &updates);
    }
    let updates = [update(2, &[1, 2, 31]), update(3, &[1, 2, 3, 255])];
    encoder
        .vertices(&mut more, &updates, Compression::None)
        .unwrap();
    refused(&mut encoder, 4010, &updates[1..]);
}

/// Any bytes as a section are refused or come to values; after an error the last frame stands.
#[test]
fn hostile_bytes_are_refused_or_shown() {
    let mut random = Random(6);
    let mut seen = std::collections::BTreeMap::new();
    for (bits, coding) in [
        (5, Coding::Raw),
        (5, Coding::Packed),
        (8, Coding::Raw),
        (8, Coding::Packed),
    ] {
        let vertices = vertices(7, 2, bits, coding);
        let (codes, shown) = content(&vertices, &mut random);
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        encoder
            .tracks(&mut out, &[vertices_track(1, vertices)])
            .unwrap();
        for frame in 0..2 {
            let update = Update {
                track: 1,
                codes: &codes,
            };
            encoder
                .vertices(&mut out, &[update], Compression::None)
                .unwrap();
            encoder.commit(&mut out, frame, None).unwrap();
        }
        let of_vertices = |&at: &usize| header(&out, at).record_type == record_type::VERTICES;
        let at = records(&out).into_iter().rfind(of_vertices).unwrap();
        for _ in 0..2000 {
            let wrong = with_payload(&out, at, |payload| {
                let length = match random.below(3) {
                    0 => random.below(20) as usize,
                    _ => payload.len() - 28,
                };
                payload.truncate(28);
                payload[20..24].copy_from_slice(&(length as u32).to_le_bytes());
                let mask = [0x1f, 0x3f, 0xff][random.below(3) as usize];
                payload.extend((0..length).map(|_| random.next() as u8 & mask));
                if random.below(8) == 0 {
                    let byte = random.below(payload.len() as u32) as usize;
                    payload[byte] ^= 1 << random.below(8);
                }
            });
            let mut decoder = Decoder::new(Limits::default());
            let outcome = decode(&mut decoder, &wrong).1.unwrap_err().id;
            *seen.entry(outcome).or_insert(0) += 1;
            let frame = decoder.last_frame().unwrap().0;
            let values = &baked::shown::<Vertices>(&decoder)[0];
            if frame == 0 {
                assert_eq!(*values, shown);
            }
            let levels = |value: &&u8| (u32::from(**value) * 31 + 127) / 255 * 255;
            let step = |value: &u8| (levels(&value) + 15) / 31 == u32::from(*value);
            assert!(bits == 8 || values.iter().all(step), "{values:?}");
        }
    }
    // 1019: it was taken, and the end record is missing.
    for id in [1019, 3201, 3202, 3205] {
        assert!(seen.get(&id).is_some_and(|&count| count > 20), "{seen:?}");
    }
}

/// Work is bounded by bytes: a record that opens or fills a large track costs a step for 64 values.
#[test]
fn work_of_a_record_is_that_of_its_bytes() {
    let count = 100_000;
    let vertices = vertices(count, 1, 8, Coding::Packed);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder
        .tracks(&mut out, &[vertices_track(1, vertices)])
        .unwrap();
    let codes = vec![255; count as usize];
    let frames = 20;
    for frame in 0..frames {
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        if frame % 2 == 0 {
            let update = Update {
                track: 1,
                codes: &codes,
            };
            encoder
                .vertices(&mut out, &[update], Compression::None)
                .unwrap();
        }
        encoder.commit(&mut out, frame, None).unwrap();
    }
    let mut decoder = Decoder::new(Limits::default());
    decoder.push_all(&out, |_, _| {}).unwrap();
    let work = decoder.work();
    let least = frames * u64::from(count) / 64;
    let most = frames / 2 * u64::from(count) / 16 + 3 * least;
    assert!((least..most).contains(&work), "{work} of {least} to {most}");
}
