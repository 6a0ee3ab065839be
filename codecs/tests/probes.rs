//! Streams of `probes` tracks: what is sent is what is shown, whatever the cuts and the faults.

use crate::common::{self, Random, decode, header, records, transform, with_payload};
use crate::volumes::*;
use dapple_codec::container::record_type;
use dapple_codec::probes::*;
use dapple_codec::*;

/// Frames of several volumes and a track of points, with digests; what a client shows after each.
fn stream(seed: u64, frames: u32, compression: Compression) -> (Vec<u8>, Vec<Vec<ShownVolume>>) {
    let mut random = Random(seed);
    let packed = Coding::Packed(STEPS);
    let mut fixtures = [
        VolumeFixture::new(2, volume([3, 4, 2], 0, packed)),
        VolumeFixture::new(3, volume([7, 1, 2], 4, Coding::Raw)),
        VolumeFixture::new(5, volume([1, 1, 1], 8, packed)),
        VolumeFixture::new(6, volume([5, 5, 5], 4, packed)),
    ];
    let points = common::track(4, points::PointWidths::BITS_32, 5, 6);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut states = Vec::new();
    for frame in 0..frames {
        let keyframe = frame % 5 == 0;
        if keyframe {
            encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        }
        if frame == 0 {
            let mut tracks: Vec<_> = fixtures
                .iter()
                .map(|fixture| fixture.track.clone())
                .collect();
            tracks.insert(2, points.clone());
            encoder.tracks(&mut out, &tracks).unwrap();
        }
        for fixture in &mut fixtures {
            fixture.change(&mut random, if keyframe { 2 } else { 6 });
            if keyframe && !fixture.send_visibility {
                fixture.visibility = None;
            }
        }
        let coverage = match keyframe {
            true => Coverage::Keyframe,
            false => Coverage::Delta,
        };
        // Two records a frame, the later ids first.
        for part in [&fixtures[2..], &fixtures[..2]] {
            let updates: Vec<_> = part.iter().map(VolumeFixture::update).collect();
            encoder
                .probes(&mut out, coverage, &updates, compression)
                .unwrap();
        }
        let moved = transform(frame as f32);
        encoder
            .transforms(&mut out, &[(3, moved)], compression)
            .unwrap();
        let mut digest = StateDigest::new();
        for fixture in &fixtures[..2] {
            let moved = (fixture.track.id == 3).then_some(&moved);
            digest.probes(
                fixture.track.id,
                moved,
                &fixture.probes,
                fixture.visibility.as_deref(),
            );
        }
        digest.points(
            4,
            None,
            &[points::Bucket::EMPTY; 5],
            &[points::Cell::FREE; 6],
        );
        for fixture in &fixtures[2..] {
            digest.probes(
                fixture.track.id,
                None,
                &fixture.probes,
                fixture.visibility.as_deref(),
            );
        }
        encoder
            .commit(&mut out, frame.into(), Some(digest.finish()))
            .unwrap();
        states.push(fixtures.iter().map(wanted).collect());
    }
    encoder.end(&mut out).unwrap();
    (out, states)
}

/// What a fixture looks like to a client, from its codes: values of present probes, and a fill that
/// looks for the nearest ones again for each probe.
fn wanted(fixture: &VolumeFixture) -> ShownVolume {
    let count = fixture.probes.len();
    let dims = fixture.volume.dims.map(i64::from);
    let place = |i: usize| {
        let i = i as i64;
        [i % dims[0], i / dims[0] % dims[1], i / dims[0] / dims[1]]
    };
    let steps = |a: usize, b: usize| {
        let (a, b) = (place(a), place(b));
        (0..3).map(|k| (a[k] - b[k]).abs()).sum::<i64>()
    };
    let present: Vec<usize> = (0..count)
        .filter(|&i| fixture.probes[i].level > 0)
        .collect();
    // In a box the way along the axes is free, so the nearest is so many steps away.
    let distance = |i: usize| present.iter().map(|&p| steps(i, p)).min();
    let distances: Vec<Option<i64>> = (0..count).map(distance).collect();
    let mut values: Vec<[u16; 28]> = vec![[0; 28]; count];
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&i| distances[i]);
    for &i in &order {
        match distances[i] {
            // Beyond the reach of the fill.
            None | Some(5..) => {}
            Some(0) => {
                values[i][..CODES].copy_from_slice(&fixture.volume.values(&fixture.probes[i]))
            }
            Some(d) => {
                let near = |j: &usize| steps(i, *j) == 1 && distances[*j] == Some(d - 1);
                let from: Vec<usize> = (0..count).filter(near).collect();
                let filled = std::array::from_fn(|v| {
                    // Twenty-four bits below the point and sixteen above: exact.
                    let unit = |&j: &usize| f64::from(f32_from_f16(values[j][v])) * 16_777_216.0;
                    let sum: f64 = from.iter().map(unit).sum();
                    to_f16((sum / from.len() as f64).floor() / 16_777_216.0)
                });
                values[i] = filled;
            }
        }
    }
    let texel = |at: usize| {
        let (t, p) = (at / count, at % count);
        std::array::from_fn(|c| values[p][4 * t + c])
    };
    ShownVolume {
        probes: fixture.probes.clone(),
        texels: (0..7 * count).map(texel).collect(),
        visibility: fixture.visibility.clone(),
    }
}

/// The nearest f16 by a search among all of them, ties to the even one.
fn to_f16(value: f64) -> u16 {
    let magnitude = value.abs();
    let at = |bits: u16| f64::from(f32_from_f16(bits));
    let mut low = 0u16;
    let mut high = 0x7bff;
    while low < high {
        let middle = low + (high - low).div_ceil(2);
        if at(middle) <= magnitude {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    if low < 0x7bff {
        let (below, above) = (magnitude - at(low), at(low + 1) - magnitude);
        if above < below || (above == below && low % 2 == 1) {
            low += 1;
        }
    }
    if value < 0.0 { low | 0x8000 } else { low }
}

fn volumes_of(decoder: &Decoder) -> Vec<ShownVolume> {
    let track = decoder.tracks().iter();
    track
        .filter(|track| track.track.volume().is_some())
        .map(|track| shown_volume(decoder, track))
        .collect()
}

#[test]
fn decoded_volumes_are_those_sent_for_any_cut() {
    for (seed, compression) in [(1, Compression::None), (2, Compression::Lz4)] {
        let (bytes, states) = stream(seed, 23, compression);
        for piece in [1, 7, 4096, usize::MAX] {
            let mut decoder = Decoder::new(Limits::default());
            let mut frames = states.iter();
            for part in bytes.chunks(piece) {
                let check = |decoder: &mut Decoder, event| {
                    if let Event::Frame(_) = event {
                        assert_eq!(&volumes_of(decoder), frames.next().unwrap());
                    }
                };
                decoder.push_all(part, check).unwrap();
            }
            decoder.finish().unwrap();
            assert_eq!(frames.next(), None);
        }
    }
}

/// A client that loops over what is dirty sees every change of every kind, visibility blocks included.
#[test]
fn dirty_ranges_cover_every_change_of_every_buffer() {
    let (bytes, _) = stream(3, 40, Compression::None);
    let mut copies = common::Copies::default();
    let update = |decoder: &mut Decoder, _| copies.update(decoder);
    decode_all(&bytes, Limits::default(), update).unwrap();
    // Those of baked models have tests of their own.
    let streamed = Buffer::ALL[..4].iter().chain(&[Buffer::Transforms]);
    assert!(copies.seen.iter().eq(streamed));
    assert!(copies.partial > 0);
}

/// Deltas never drift: what a decoder holds after 10,000 frames is what the encoder holds.
#[test]
fn ten_thousand_deltas_end_where_the_encoder_does() {
    let mut random = Random(11);
    let mut fixture = VolumeFixture::new(1, volume([4, 3, 3], 0, Coding::Packed(STEPS)));
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[fixture.track.clone()]).unwrap();
    let mut decoder = Decoder::new(Limits::default());
    for frame in 0..10_000 {
        fixture.change(&mut random, 5);
        let coverage = match frame {
            0 => Coverage::Keyframe,
            _ => Coverage::Delta,
        };
        encoder
            .probes(&mut out, coverage, &[fixture.update()], Compression::None)
            .unwrap();
        encoder.commit(&mut out, frame, None).unwrap();
        decoder.push_all(&out, |_, _| {}).unwrap();
        out.clear();
        let track = &decoder.tracks()[0];
        assert_eq!(decoder.probes().probes_of(track), fixture.probes);
    }
    assert_eq!(volumes_of(&decoder), [wanted(&fixture)]);
}

/// A stream with a keyframe and a delta of one volume, and where its last record of probes is.
fn keyframe_and_delta() -> (Vec<u8>, usize) {
    let mut random = Random(4);
    let mut fixture = VolumeFixture::new(1, volume([3, 3, 2], 0, Coding::Packed(STEPS)));
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    let points = common::track(7, points::PointWidths::BITS_32, 5, 6);
    encoder
        .tracks(&mut out, &[fixture.track.clone(), points])
        .unwrap();
    fixture.change(&mut random, 1);
    encoder
        .probes(
            &mut out,
            Coverage::Keyframe,
            &[fixture.update()],
            Compression::None,
        )
        .unwrap();
    encoder.commit(&mut out, 0, None).unwrap();
    fixture.change(&mut random, 2);
    fixture.send_visibility = false;
    encoder
        .probes(
            &mut out,
            Coverage::Delta,
            &[fixture.update()],
            Compression::None,
        )
        .unwrap();
    encoder.commit(&mut out, 1, None).unwrap();
    let of_probes = |&at: &usize| header(&out, at).record_type == record_type::PROBES;
    let at = records(&out).into_iter().rfind(of_probes);
    (out.clone(), at.unwrap())
}

/// A code out of its range comes from residuals alone: any bytes may say so.
#[test]
fn hostile_bytes_are_refused_or_within_range() {
    let (bytes, at) = keyframe_and_delta();
    let mut random = Random(6);
    let mut seen = std::collections::BTreeMap::new();
    for round in 0..20_000u32 {
        let length = random.below(if round % 2 == 0 { 40 } else { 900 }) as usize;
        let keyframe = random.below(2);
        let wrong = with_payload(&bytes, at, |payload| {
            payload.truncate(28);
            payload[4] = keyframe as u8;
            payload[20..24].copy_from_slice(&(length as u32).to_le_bytes());
            let skewed = random.below(3);
            payload.extend((0..length).map(|_| match skewed {
                0 => random.next() as u8,
                1 => (random.next() & random.next() & random.next()) as u8,
                _ => (random.next() | random.next() | random.next()) as u8,
            }));
        });
        let mut decoder = Decoder::new(Limits::default());
        let outcome = decode(&mut decoder, &wrong).1.unwrap_err().id;
        *seen.entry(outcome).or_insert(0) += 1;
        for track in decoder.tracks() {
            for probe in decoder.probes().probes_of(track) {
                let codes = probe.codes.iter().zip(most(&STEPS));
                assert!(
                    probe.level <= 3 && codes.into_iter().all(|(c, m)| i32::from(c.abs()) <= m)
                );
            }
            let texels = decoder.probes().texels_of(track).as_flattened();
            assert!(texels.iter().all(|bits| bits & 0x7c00 != 0x7c00));
        }
    }
    // 1019: it was taken, and the end record is missing.
    assert!(
        seen.contains_key(&3104) && seen.contains_key(&3105),
        "{seen:?}"
    );
}

/// The limit counts what the arrays take, of all models together.
#[test]
fn state_counts_against_its_limit() {
    let tracks = [
        common::track(1, points::PointWidths::BITS_32, 10, 20),
        volume_track(2, volume([3, 2, 2], 4, Coding::Raw)),
        volume_track(3, volume([5, 1, 1], 0, Coding::Raw)),
    ];
    let bytes = 10 * 32 + 20 * 36 + 12 * (184 + 2 * 16) + 5 * 184;
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.tracks(&mut out, &tracks).unwrap();
    for (state_bytes, id) in [(bytes, 1019), (bytes - 1, 2018)] {
        let mut decoder = Decoder::new(Limits {
            state_bytes,
            ..Limits::default()
        });
        let error = decode(&mut decoder, &out).1.unwrap_err();
        assert_eq!(error.id, id);
        assert_eq!(decoder.tracks().len(), if id == 1019 { 3 } else { 0 });
    }
}
