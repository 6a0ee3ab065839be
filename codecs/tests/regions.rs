//! Streams of `regions` tracks: what is sent is what is shown, whatever the cuts and the faults.

use crate::common::{self, Random, decode, header, records, transform, with_payload};
use crate::region_sets::*;
use crate::volumes;
use dapple_codec::container::record_type;
use dapple_codec::regions::*;
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::*;

/// Frames of several sets beside other models, with digests, and what a client shows after each. Some
/// frames have content for some sets, and a group that starts from keyframes empties the others.
fn stream(seed: u64, frames: u32, compression: Compression) -> (Vec<u8>, Vec<Vec<Content>>) {
    let mut random = Random(seed);
    let one = RegionSet {
        signals: Signals::one(Kernel::cut_off(0.5)),
        step: 1,
        ..set(1, Coding::Packed)
    };
    let sets = [
        (2, set(9, Coding::Packed)),
        (3, set(5, Coding::Raw)),
        (5, one),
        (6, set(70, Coding::Packed)),
    ];
    let mut contents = vec![Content::default(); 4];
    let points = common::track(1, points::PointWidths::BITS_32, 5, 6);
    let volume = volumes::volume_track(4, volumes::volume([2, 2, 1], 0, probes::Coding::Raw));
    let mut tracks = vec![points, volume];
    tracks.extend(sets.map(|(id, set)| region_track(id, set)));
    tracks.sort_by_key(|track| track.id);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut states = Vec::new();
    for frame in 0..frames {
        let keyframe = frame % 5 == 0;
        if keyframe {
            encoder.group(&mut out, GroupStart::Keyframes).unwrap();
            contents.fill(Content::default());
        }
        if frame == 0 {
            encoder.tracks(&mut out, &tracks).unwrap();
        }
        let mut sent = Vec::new();
        for ((id, set), now) in sets.iter().zip(&mut contents) {
            if random.below(3) > 0 {
                *now = content(set, &mut random);
                sent.push((*id, now.clone()));
            }
        }
        // Two records a frame, the later ids first.
        let (first, second) = sent.split_at(sent.len() / 2);
        for part in [second, first] {
            let updates: Vec<_> = part
                .iter()
                .map(|(id, content)| update(*id, content))
                .collect();
            encoder.regions(&mut out, &updates, compression).unwrap();
        }
        let moved = transform(frame as f32);
        encoder
            .transforms(&mut out, &[(3, moved)], compression)
            .unwrap();
        let mut digest = StateDigest::new();
        digest.points(
            1,
            None,
            &[points::Bucket::EMPTY; 5],
            &[points::Cell::FREE; 6],
        );
        for ((id, _), now) in sets.iter().zip(&contents) {
            if *id == 5 {
                digest.probes(4, None, &[], None);
            }
            let moved = (*id == 3).then_some(&moved);
            digest.regions(*id, moved, &now.regions, &now.pairs);
        }
        encoder
            .commit(&mut out, frame.into(), Some(digest.finish()))
            .unwrap();
        states.push(contents.clone());
    }
    encoder.end(&mut out).unwrap();
    (out, states)
}

fn contents_of(decoder: &Decoder) -> Vec<Content> {
    let tracks = decoder.tracks().iter();
    let sets = tracks.filter(|track| track.track.region_set().is_some());
    sets.map(|track| shown_content(decoder, track)).collect()
}

#[test]
fn decoded_regions_are_those_sent_for_any_cut() {
    for (seed, compression) in [(1, Compression::None), (2, Compression::Lz4)] {
        let (bytes, states) = stream(seed, 23, compression);
        for piece in [1, 7, 4096, usize::MAX] {
            let mut decoder = Decoder::new(Limits::default());
            let mut frames = states.iter();
            for part in bytes.chunks(piece) {
                let check = |decoder: &mut Decoder, event| {
                    if let Event::Frame(_) = event {
                        assert_eq!(&contents_of(decoder), frames.next().unwrap());
                    }
                };
                decoder.push_all(part, check).unwrap();
            }
            decoder.finish().unwrap();
            assert_eq!(frames.next(), None);
        }
    }
}

#[test]
fn dirty_arrays_of_regions_cover_every_change() {
    let (bytes, _) = stream(3, 40, Compression::None);
    let mut copies = common::Copies::default();
    let update = |decoder: &mut Decoder, _| copies.update(decoder);
    decode_all(&bytes, Limits::default(), update).unwrap();
    for buffer in [Buffer::Regions, Buffer::RegionsPairs] {
        assert!(copies.seen.contains(&buffer));
    }
}

#[test]
fn regions_sent_again_are_not_dirty() {
    let set = set(4, Coding::Packed);
    let content = content(&set, &mut Random(2));
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[region_track(1, set)]).unwrap();
    let mut decoder = Decoder::new(Limits::default());
    for frame in 0..2 {
        let update = update(1, &content);
        encoder
            .regions(&mut out, &[update], Compression::None)
            .unwrap();
        encoder.commit(&mut out, frame, None).unwrap();
        decoder.push_all(&out, |_, _| {}).unwrap();
        out.clear();
        assert_eq!(decoder.dirty().count(), if frame == 0 { 2 } else { 0 });
        decoder.clear_dirty();
    }
}

/// A stream with two frames of one set, and where its last record of regions is.
fn two_frames(coding: Coding) -> (Vec<u8>, usize) {
    let mut random = Random(4);
    let set = set(6, coding);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[region_track(1, set)]).unwrap();
    for frame in 0..2 {
        let content = content(&set, &mut random);
        let update = update(1, &content);
        encoder
            .regions(&mut out, &[update], Compression::None)
            .unwrap();
        encoder.commit(&mut out, frame, None).unwrap();
    }
    let of_regions = |&at: &usize| header(&out, at).record_type == record_type::REGIONS;
    let at = records(&out).into_iter().rfind(of_regions);
    (out.clone(), at.unwrap())
}

/// What holds of every committed state.
fn check_state(decoder: &Decoder) {
    for track in decoder.tracks() {
        let set = track.track.region_set().unwrap();
        let Content { regions, pairs } = shown_content(decoder, track);
        assert!([0, set.count as usize].contains(&regions.len()));
        assert!(pairs.len() <= set.capacity as usize);
        let mut first = 0;
        for region in &regions {
            let form = region.form().unwrap();
            assert_eq!(region.first as usize, first);
            first += form.pairs();
            for axis in 0..3 {
                let (min, max) = (region.min[axis], region.max[axis]);
                assert!(min <= region.centre[axis] && region.centre[axis] <= max);
                assert!(min.abs() < 2f32.powi(40) && max.abs() < 2f32.powi(40));
            }
        }
        assert_eq!(first, pairs.len());
        assert!(pairs.as_flattened().iter().all(|&v| v != i16::MIN));
    }
}

/// Sound boxes and then any bytes; or any bytes, or a few bits changed.
#[test]
fn hostile_bytes_of_regions_are_refused_or_within_range() {
    let mut seen = std::collections::BTreeMap::new();
    for coding in [Coding::Raw, Coding::Packed] {
        let (bytes, at) = two_frames(coding);
        let mut random = Random(6);
        for round in 0..12_000u32 {
            let wrong = with_payload(&bytes, at, |payload| match round % 3 {
                0 => {
                    for _ in 0..=random.below(4) {
                        let bit = random.below(8 * payload.len() as u32) as usize;
                        payload[bit / 8] ^= 1 << (bit % 8);
                    }
                }
                _ => {
                    // What comes after the boxes, or after the regions.
                    let kept = match (coding, round % 3) {
                        (Coding::Packed, 1) => 28 + 6 * 24,
                        (Coding::Raw, 1) => 28 + 6 * 40,
                        _ => 28,
                    };
                    payload.truncate(kept);
                    let length = random.below(if round % 2 == 0 { 40 } else { 900 });
                    let skewed = random.below(3);
                    payload.extend((0..length).map(|_| match skewed {
                        0 => random.next() as u8,
                        1 => (random.next() & random.next() & random.next()) as u8,
                        _ => (random.next() | random.next() | random.next()) as u8,
                    }));
                    let section = payload.len() as u32 - 28;
                    payload[20..24].copy_from_slice(&section.to_le_bytes());
                }
            });
            let mut decoder = Decoder::new(Limits::default());
            let outcome = decode(&mut decoder, &wrong).1.unwrap_err().id;
            *seen.entry(outcome).or_insert(0) += 1;
            check_state(&decoder);
        }
    }
    // 1019: it was taken, and the end record is missing.
    for id in [1019, 3401, 3402, 3403, 3404, 3405, 3406] {
        assert!(seen.contains_key(&id), "{id}: {seen:?}");
    }
}

/// The limit counts what the arrays take, of all models together.
#[test]
fn regions_count_against_the_limit_of_state() {
    let set = RegionSet {
        capacity: 17,
        ..set(5, Coding::Packed)
    };
    let tracks = [
        common::track(1, points::PointWidths::BITS_32, 10, 20),
        region_track(2, set),
        region_track(3, RegionSet { count: 1, ..set }),
    ];
    let bytes = 10 * 32 + 20 * 36 + 6 * 96 + 2 * 17 * 8;
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

/// Content that contradicts its track or itself writes nothing.
#[test]
fn wrong_regions_are_refused_by_the_encoder() {
    type Wrong = fn(&mut Content);
    let wrongs: [(u16, Wrong); 10] = [
        (4012, |c| _ = c.regions.pop()),
        (4012, |c| c.pairs.push([0; 2])),
        (4012, |c| _ = c.pairs.pop()),
        (4012, |c| c.pairs[0][0] += 1),
        (4012, |c| c.regions[1].first += 1),
        (4012, |c| c.regions[1].reserved = 1),
        (3403, |c| c.regions[2].max[1] = -1e9),
        (3403, |c| c.regions[2].centre[0] = 1e9),
        (3404, |c| c.regions[3].form |= 3),
        (3402, |c| c.regions[3].form |= 64),
    ];
    for coding in [Coding::Raw, Coding::Packed] {
        let set = set(4, coding);
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        let points = common::track(7, points::PointWidths::BITS_32, 5, 6);
        encoder
            .tracks(&mut out, &[region_track(1, set), points])
            .unwrap();
        let good = content(&set, &mut Random(9));
        let length = out.len();
        for (id, wrong) in wrongs {
            let mut content = good.clone();
            wrong(&mut content);
            let written = encoder.regions(&mut out, &[update(1, &content)], Compression::None);
            assert_eq!(written.map_err(|e| e.id), Err(id));
            assert_eq!(out.len(), length);
        }
        for (track, id) in [(2, 2019), (7, 2027)] {
            let written = encoder.regions(&mut out, &[update(track, &good)], Compression::None);
            assert_eq!(written.map_err(|e| e.id), Err(id));
        }
        encoder
            .regions(&mut out, &[update(1, &good)], Compression::None)
            .unwrap();
        encoder.commit(&mut out, 0, None).unwrap();
        encoder.end(&mut out).unwrap();
        let mut decoder = Decoder::new(Limits::default());
        assert_eq!(decode(&mut decoder, &out).1, Ok(()));
        assert_eq!(contents_of(&decoder), [good]);
    }
}
