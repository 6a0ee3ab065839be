//! Streams of `regions` tracks: what is sent is what is shown, whatever the cuts and the faults.

use crate::baked::{self, Baked};
use crate::common::{self, Random, decode, header, records, with_payload};
use crate::region_sets::*;
use dapple_codec::container::record_type;
use dapple_codec::regions::*;
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::*;

impl Baked for RegionSet {
    type Parameters = RegionSet;
    type Sent = Content;
    type Shown = Content;
    const BUFFERS: &'static [Buffer] = &[Buffer::Regions, Buffer::RegionsPairs];

    fn tracks() -> [(u32, RegionSet); 4] {
        let one = RegionSet {
            signals: Signals::one(Kernel::cut_off(0.5)),
            step: 1,
            ..set(1, Coding::Packed)
        };
        [
            (2, set(9, Coding::Packed)),
            (3, set(5, Coding::Raw)),
            (5, one),
            (6, set(70, Coding::Packed)),
        ]
    }

    fn track(id: u32, set: RegionSet) -> Track {
        region_track(id, set)
    }

    fn content(set: &RegionSet, random: &mut Random) -> (Content, Content) {
        let content = content(set, random);
        (content.clone(), content)
    }

    fn empty(_: &RegionSet) -> Content {
        Content::default()
    }

    fn put(
        encoder: &mut Encoder,
        out: &mut Vec<u8>,
        sent: &[(u32, Content)],
        compression: Compression,
    ) {
        let updates = sent.iter().map(|(id, content)| update(*id, content));
        let updates: Vec<_> = updates.collect();
        encoder.regions(out, &updates, compression).unwrap();
    }

    fn digest(digest: &mut StateDigest, id: u32, transform: Option<&Transform>, shown: &Content) {
        digest.regions(id, transform, &shown.regions, &shown.pairs);
    }

    fn shown(decoder: &Decoder, track: &TrackState) -> Option<Content> {
        track.track.region_set()?;
        Some(shown_content(decoder, track))
    }
}

#[test]
fn decoded_regions_are_those_sent_for_any_cut() {
    baked::check_content_for_any_cut::<RegionSet>();
}

#[test]
fn dirty_arrays_of_regions_cover_every_change() {
    baked::check_dirty_ranges::<RegionSet>();
}

#[test]
fn regions_sent_again_are_not_dirty() {
    baked::check_same_content_is_not_dirty::<RegionSet>();
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
        assert_eq!(baked::shown::<RegionSet>(&decoder), [good]);
    }
}
