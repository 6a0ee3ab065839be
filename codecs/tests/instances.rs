//! Streams of `instances` tracks: what is sent is what is shown, whatever the cuts and the faults.

use crate::baked::{self, Baked};
use crate::common::{self, Random, decode, header, records, with_payload};
use crate::instance_tables::*;
use dapple_codec::container::record_type;
use dapple_codec::instances::*;
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::*;

/// Keys and values of a track.
type Shown = (Vec<u64>, Vec<Value>);

impl Baked for Table {
    type Parameters = Table;
    type Sent = Vec<Entry>;
    type Shown = Shown;
    const BUFFERS: &'static [Buffer] = &[Buffer::InstancesKeys, Buffer::InstancesValues];

    fn tracks() -> [(u32, Table); 4] {
        let one = Table {
            signals: Signals::one(Kernel::cut_off(0.5)),
            step: 1,
            ..table(1, Coding::Packed)
        };
        [
            (2, table(9, Coding::Packed)),
            (3, table(5, Coding::Raw)),
            (5, one),
            (6, table(70, Coding::Packed)),
        ]
    }

    fn track(id: u32, table: Table) -> Track {
        table_track(id, table)
    }

    fn content(table: &Table, random: &mut Random) -> (Vec<Entry>, Shown) {
        let entries = entries(table, random);
        let shown = shown(table, &entries);
        (entries, shown)
    }

    fn empty(_: &Table) -> Shown {
        Shown::default()
    }

    fn put(
        encoder: &mut Encoder,
        out: &mut Vec<u8>,
        sent: &[(u32, Vec<Entry>)],
        compression: Compression,
    ) {
        let updates = sent.iter().map(|(id, entries)| update(*id, entries));
        let updates: Vec<_> = updates.collect();
        encoder.instances(out, &updates, compression).unwrap();
    }

    fn digest(
        digest: &mut StateDigest,
        id: u32,
        transform: Option<&Transform>,
        (keys, values): &Shown,
    ) {
        digest.instances(id, transform, keys, values);
    }

    fn shown(decoder: &Decoder, track: &TrackState) -> Option<Shown> {
        track.track.instance_table()?;
        let state = decoder.instances();
        let (keys, values) = (state.keys_of(track), state.values_of(track));
        Some((keys.to_vec(), values.to_vec()))
    }
}

#[test]
fn decoded_entries_are_those_sent_for_any_cut() {
    baked::check_content_for_any_cut::<Table>();
}

#[test]
fn dirty_arrays_of_entries_cover_every_change() {
    baked::check_dirty_ranges::<Table>();
}

#[test]
fn entries_sent_again_are_not_dirty() {
    baked::check_same_content_is_not_dirty::<Table>();
}

/// A stream with two frames of one table, and where its last record of instances is.
fn two_frames(table: Table) -> (Vec<u8>, usize) {
    let mut random = Random(4);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[table_track(1, table)]).unwrap();
    for frame in 0..2 {
        let entries = entries(&table, &mut random);
        let update = update(1, &entries);
        encoder
            .instances(&mut out, &[update], Compression::None)
            .unwrap();
        encoder.commit(&mut out, frame, None).unwrap();
    }
    let of_instances = |&at: &usize| header(&out, at).record_type == record_type::INSTANCES;
    let at = records(&out).into_iter().rfind(of_instances);
    (out.clone(), at.unwrap())
}

/// What holds of every committed state.
fn check_state(decoder: &Decoder) {
    for track in decoder.tracks() {
        let table = track.track.instance_table().unwrap();
        let keys = decoder.instances().keys_of(track);
        let values = decoder.instances().values_of(track);
        assert!([0, table.count as usize].contains(&keys.len()));
        assert_eq!(values.len(), keys.len() * usize::from(table.signals.count));
        assert!(keys.is_sorted_by(|a, b| a < b));
        let step = table.step as i16;
        let fits = |&v: &i16| v != i16::MIN && v % step == 0;
        assert!(values.as_flattened().iter().all(fits));
    }
}

/// Any bytes after the head or after the keys, or a few bits changed.
#[test]
fn hostile_bytes_of_instances_are_refused_or_within_range() {
    let mut seen = std::collections::BTreeMap::new();
    for coding in [Coding::Raw, Coding::Packed] {
        let (bytes, at) = two_frames(table(6, coding));
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
                    let kept = match (coding, round % 3) {
                        // Keys and forms stay.
                        (Coding::Raw, 1) => 28 + 6 * 8 + 1,
                        _ => 28,
                    };
                    let size = payload.len();
                    payload.truncate(kept);
                    let length = match round % 2 {
                        0 => size - kept,
                        _ => random.below(300) as usize,
                    };
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
    for id in [1019, 3301, 3302, 3303, 3305, 3306] {
        assert!(seen.contains_key(&id), "{id}: {seen:?}");
    }
}

/// Work is bounded by the entries of a table and by bytes: a section cannot have more quotients.
#[test]
fn work_of_packed_entries_is_bounded_by_their_number() {
    let table = table(1 << 16, Coding::Packed);
    let (bytes, at) = two_frames(table);
    let decoded = {
        let mut decoder = Decoder::new(Limits::default());
        decoder.push_all(&bytes, |_, _| {}).unwrap();
        decoder.work()
    };
    for fill in [0x00, 0xaa, 0xfe] {
        let wrong = with_payload(&bytes, at, |payload| {
            payload.truncate(28);
            payload.extend([fill; 40]);
            payload[20..24].copy_from_slice(&40u32.to_le_bytes());
        });
        let mut decoder = Decoder::new(Limits::default());
        let _ = decode(&mut decoder, &wrong);
        assert!(decoder.work() <= decoded, "{} {decoded}", decoder.work());
        check_state(&decoder);
    }
}

/// The limit counts what the arrays take, of all models together.
#[test]
fn tables_count_against_the_limit_of_state() {
    let two = table(5, Coding::Packed);
    let one = Table {
        signals: Signals::one(Kernel::cut_off(0.5)),
        ..two
    };
    let tracks = [
        common::track(1, points::PointWidths::BITS_32, 10, 20),
        table_track(2, two),
        table_track(3, one),
    ];
    let bytes = 10 * 32 + 20 * 36 + 5 * 48 + 5 * 32;
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

/// Entries that contradict their track write nothing.
#[test]
fn wrong_entries_are_refused_by_the_encoder() {
    type Wrong = fn(&mut Vec<Entry>);
    let wrongs: [(u16, Wrong); 6] = [
        (4012, |e| _ = e.pop()),
        (4012, |e| e.push(e[0])),
        (3303, |e| e.swap(1, 2)),
        (3303, |e| e[2].key = e[1].key),
        (3305, |e| e[3].codes[1][0] = 1024),
        (4012, |e| {
            e[0].form = Form::Scalar;
            e[0].codes[0][3] = 1;
        }),
    ];
    for coding in [Coding::Raw, Coding::Packed] {
        let table = table(4, coding);
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
        encoder.group(&mut out, GroupStart::Keyframes).unwrap();
        let points = common::track(7, points::PointWidths::BITS_32, 5, 6);
        encoder
            .tracks(&mut out, &[table_track(1, table), points])
            .unwrap();
        let good = entries(&table, &mut Random(9));
        let length = out.len();
        for (id, wrong) in wrongs {
            let mut entries = good.clone();
            wrong(&mut entries);
            let written = encoder.instances(&mut out, &[update(1, &entries)], Compression::None);
            assert_eq!(written.map_err(|e| e.id), Err(id));
            assert_eq!(out.len(), length);
        }
        for (track, id) in [(2, 2019), (7, 2027)] {
            let written = encoder.instances(&mut out, &[update(track, &good)], Compression::None);
            assert_eq!(written.map_err(|e| e.id), Err(id));
        }
        encoder
            .instances(&mut out, &[update(1, &good)], Compression::None)
            .unwrap();
        encoder.commit(&mut out, 0, None).unwrap();
        encoder.end(&mut out).unwrap();
        let mut decoder = Decoder::new(Limits::default());
        assert_eq!(decode(&mut decoder, &out).1, Ok(()));
        assert_eq!(baked::shown::<Table>(&decoder), [shown(&table, &good)]);
    }
}
