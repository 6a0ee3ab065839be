//! Whole streams: round trips, every cut, every damage.

use crate::common::*;
use dapple_codec::points::*;
use dapple_codec::*;

const ALL: [Compression; 3] = [
    Compression::None,
    Compression::Lz4,
    Compression::Zstd {
        level: 15,
        lazy: true,
    },
];

fn frames(events: &[Event]) -> usize {
    events
        .iter()
        .filter(|e| matches!(e, Event::Frame(_)))
        .count()
}

#[test]
fn decoded_state_is_that_of_the_server() {
    for compression in ALL {
        for digests in [false, true] {
            let (bytes, states) = stream(compression, digests);
            let mut frame = 0;
            let check = |decoder: &mut Decoder, event| {
                if let Event::Frame(info) = event {
                    assert_eq!(info.number as usize, frame);
                    assert_eq!(shown(decoder), states[frame], "{compression:?} {frame}");
                    frame += 1;
                }
            };
            decode_all(&bytes, Limits::default(), check).unwrap();
            assert_eq!(frame, states.len());
        }
    }
}

#[test]
fn every_split_gives_the_same() {
    for compression in ALL {
        let (bytes, states) = stream(compression, true);
        let mut whole = Decoder::new(Limits::default());
        let (events, result) = decode(&mut whole, &bytes);
        result.unwrap();
        let mut random = Random(1);
        for round in 0..40 {
            let mut decoder = Decoder::new(Limits::default());
            let mut seen = Vec::new();
            let mut at = 0;
            while at < bytes.len() {
                let size = if round == 0 {
                    1
                } else {
                    1 + random.below(round * 20) as usize
                };
                let end = (at + size).min(bytes.len());
                while at < end {
                    let (consumed, event) = decoder.push(&bytes[at..end]).unwrap();
                    at += consumed;
                    if event != Event::NeedInput {
                        seen.push(event);
                    }
                }
            }
            // A record that ends with the input gives its event at the next call at the latest.
            while let (0, event) = decoder.push(&[]).unwrap() {
                if event == Event::End || event == Event::NeedInput {
                    break;
                }
                seen.push(event);
            }
            assert_eq!(seen, events);
            assert_eq!(shown(&decoder), states[states.len() - 1]);
        }
    }
}

#[test]
fn truncated_at_every_byte_is_truncated_and_the_last_frame_stands() {
    let (bytes, states) = stream(Compression::Lz4, false);
    let mut decoder = Decoder::new(Limits::default());
    for end in 0..bytes.len() {
        decoder.reset();
        let (events, result) = decode(&mut decoder, &bytes[..end]);
        let error = result.unwrap_err();
        assert_eq!(
            (error.class, error.id, error.offset),
            (ErrorClass::Truncated, 1019, end as u64)
        );
        match frames(&events) {
            0 => assert_eq!(decoder.last_frame(), None),
            n => assert_eq!(shown(&decoder), states[n - 1]),
        }
        let at_boundary = end == bytes.len() || records(&bytes).contains(&end);
        let committed = at_boundary && {
            let before = records(&bytes).into_iter().filter(|&r| r < end).max();
            before.is_some_and(|r| matches!(header(&bytes, r).record_type, 1 | 6))
        };
        assert_eq!(
            decoder.finish_live().is_ok(),
            committed,
            "live end at {end}"
        );
    }
}

#[test]
fn every_flipped_bit_is_an_error_and_the_last_frame_stands() {
    for compression in ALL {
        let (bytes, states) = stream(compression, false);
        let mut decoder = Decoder::new(Limits::default());
        for bit in 0..bytes.len() * 8 {
            let mut damaged = bytes.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            decoder.reset();
            let (events, result) = decode(&mut decoder, &damaged);
            let error = result.unwrap_err();
            assert!(error.offset <= (bit / 8) as u64, "{error}");
            match frames(&events) {
                0 => assert_eq!(decoder.last_frame(), None),
                n => assert_eq!(shown(&decoder), states[n - 1], "bit {bit}"),
            }
        }
        decoder.reset();
        decode(&mut decoder, &bytes).1.unwrap();
        assert_eq!(shown(&decoder), states[4]);
    }
}

#[test]
fn resume_goes_on_at_the_next_group() {
    let (bytes, states) = stream(Compression::None, false);
    let starts = records(&bytes);
    let second_group = starts
        .iter()
        .position(|&r| header(&bytes, r).record_type == 2 && header(&bytes, r).sequence > 1)
        .unwrap();
    let mut decoder = Decoder::new(Limits::default());
    for (i, &start) in starts.iter().enumerate().take(second_group).skip(1) {
        // Damage of the payload, a lost record, and a header that says too much.
        let end = starts[i + 1];
        let mut payload = bytes.clone();
        payload[start + 32] ^= 1;
        let lost = [&bytes[..start], &bytes[end..]].concat();
        let huge = with_header(&bytes, start, |h| h.packing = 9);
        for damaged in [payload, lost, huge] {
            decoder.reset();
            let (_, result) = decode(&mut decoder, &damaged);
            result.unwrap_err();
            let before = shown(&decoder);
            assert!(decoder.resume());
            assert_eq!(shown(&decoder), before);
            let from = decoder.position() as usize;
            let (events, result) = decode(&mut decoder, &damaged[from..]);
            result.unwrap();
            assert_eq!(frames(&events), 2);
            assert_eq!(shown(&decoder), states[4]);
        }
    }
    // A damaged header loses the framing.
    let mut damaged = bytes.clone();
    damaged[starts[2] + 5] ^= 1;
    decoder.reset();
    assert_eq!(decode(&mut decoder, &damaged).1.unwrap_err().id, 1005);
    assert!(!decoder.resume());
    assert_eq!(decoder.push(&[]).unwrap_err().id, 4011);
}

#[test]
fn resume_waits_for_no_byte_of_an_empty_payload() {
    let (bytes, _) = stream(Compression::None, false);
    let start = records(&bytes)[1];
    // Of a record that is skipped, and of one that is read and too short.
    for (record_type, critical) in [(0x7000, false), (3, true)] {
        let mut ahead = with_header(&bytes, start, |h| {
            h.record_type = record_type;
            h.critical = critical;
            h.sequence = 9;
            h.stored_bytes = 0;
            h.unpacked_bytes = 0;
        });
        ahead.truncate(start + 32);
        let mut decoder = Decoder::new(Limits::default());
        assert_eq!(decode(&mut decoder, &ahead).1.unwrap_err().id, 1008);
        assert_eq!(decoder.finish_live().unwrap_err().id, 4011);
        assert!(decoder.resume());
        decoder.finish_live().unwrap();
    }
}

#[test]
fn a_group_can_build_on_a_state() {
    let table = track(1, PointWidths::BITS_32, 3, 4);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[table]).unwrap();
    encoder.commit(&mut out, 0, None).unwrap();
    let mut digest = StateDigest::new();
    digest.points(1, None, &[Bucket::EMPTY; 3], &[Cell::FREE; 4]);
    for (wanted, id) in [(digest.finish(), None), (digest.finish() ^ 1, Some(4002))] {
        let mut decoder = Decoder::new(Limits::default());
        let _ = decode(&mut decoder, &out);
        let mut more = Vec::new();
        let mut bytes = out.clone();
        bytes.truncate(out.len());
        // The group's payload is id, start, digest.
        let mut payload = Vec::new();
        payload.extend(1u32.to_le_bytes());
        payload.extend(1u32.to_le_bytes());
        payload.extend(wanted.to_le_bytes());
        let header = container::RecordHeader {
            record_type: 2,
            critical: true,
            version: 0,
            packing: 0,
            sequence: 4,
            stored_bytes: 16,
            unpacked_bytes: 16,
            payload_crc: container::crc32c(&payload),
        };
        more.extend(header.to_bytes());
        more.extend(payload);
        assert_eq!(decoder.push(&more).err().map(|e| e.id), id);
    }
}

/// Copies that are made from dirty ranges alone are the arrays, also where groups leave tracks empty.
#[test]
fn dirty_ranges_of_points_cover_every_change() {
    let (bytes, _) = stream(Compression::None, false);
    let mut copies = Copies::default();
    let update = |decoder: &mut Decoder, _| copies.update(decoder);
    decode_all(&bytes, Limits::default(), update).unwrap();
    let seen = [
        Buffer::PointsBuckets,
        Buffer::PointsCells,
        Buffer::Transforms,
    ];
    assert!(copies.seen.iter().eq(&seen));
    assert!(copies.partial > 0);

    // A group without content or transforms, the removal of a track, and an added one.
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut table = Table::new(track(1, PointWidths::BITS_32, 31, 60));
    table.change(&mut Random(3), 20);
    let content = table.keyframe();
    let keyframe = Coverage::Keyframe;
    let tracks = [1, 2].map(|id| track(id, PointWidths::BITS_32, 31, 60));
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &tracks).unwrap();
    encoder
        .points(&mut out, keyframe, &[content.update()], Compression::None)
        .unwrap();
    encoder
        .transforms(&mut out, &[(1, transform(2.0))], Compression::None)
        .unwrap();
    encoder.commit(&mut out, 0, None).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.commit(&mut out, 1, None).unwrap();
    encoder.remove_tracks(&mut out, &[1]).unwrap();
    encoder.commit(&mut out, 2, None).unwrap();
    let added = track(3, PointWidths::BITS_32, 5, 6);
    encoder.tracks(&mut out, &[added]).unwrap();
    encoder.commit(&mut out, 3, None).unwrap();
    encoder.end(&mut out).unwrap();
    let mut copies = Copies::default();
    let update = |decoder: &mut Decoder, _| copies.update(decoder);
    decode_all(&out, Limits::default(), update).unwrap();
    assert!(copies.seen.contains(&Buffer::Transforms));
}

/// From its removal on a track counts as not declared, also before the commit that ends it.
#[test]
fn a_removed_track_is_not_declared_again() {
    let declared = track(3, PointWidths::BITS_32, 5, 6);
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder.tracks(&mut out, &[declared]).unwrap();
    encoder.commit(&mut out, 0, None).unwrap();
    let kept = out.len();
    encoder.remove_tracks(&mut out, &[3]).unwrap();
    // The first track record once more, as the next record.
    let at = records(&out)
        .into_iter()
        .find(|&at| header(&out, at).record_type == container::record_type::TRACK)
        .unwrap();
    let again = header(&out, at);
    let payload = out[at + 32..at + 32 + again.stored_bytes as usize].to_vec();
    let sequence = records(&out).len() as u64;
    let again = container::RecordHeader { sequence, ..again };
    let mut decoder = Decoder::new(Limits::default());
    let bytes = [&out[..], &again.to_bytes(), &payload].concat();
    assert_eq!(decode(&mut decoder, &bytes).1.unwrap_err().id, 2005);
    // Before the removal it is taken.
    let again = container::RecordHeader {
        sequence: sequence - 1,
        ..again
    };
    let bytes = [&out[..kept], &again.to_bytes(), &payload].concat();
    decoder.reset();
    assert_eq!(decode(&mut decoder, &bytes).1.unwrap_err().id, 1019);
}

/// A record of tracks that are too large together reserves nothing for the first of them.
#[test]
fn tracks_beyond_the_limit_take_no_memory() {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    let tracks = [1, 2].map(|id| track(id, PointWidths::BITS_32, 5, 6));
    encoder.tracks(&mut out, &tracks).unwrap();
    // Two tracks of 5 buckets and 6 cells count 752 bytes.
    for (state_bytes, cells) in [(751, 0), (752, 12)] {
        let limits = Limits {
            state_bytes,
            ..Limits::default()
        };
        let mut decoder = Decoder::new(limits);
        let id = if cells == 0 { 2018 } else { 1019 };
        assert_eq!(decode(&mut decoder, &out).1.unwrap_err().id, id);
        assert_eq!(decoder.points().cells().len(), cells);
    }
}

#[test]
fn tracks_come_and_go_and_reuse_memory() {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut decoder = Decoder::new(Limits::default());
    encoder.group(&mut out, GroupStart::Keyframes).unwrap();
    encoder
        .tracks(&mut out, &[track(0, PointWidths::BITS_32, 5, 6)])
        .unwrap();
    encoder.commit(&mut out, 0, None).unwrap();
    for id in 1..50 {
        encoder
            .tracks(&mut out, &[track(id, PointWidths::BITS_32, 5, 6)])
            .unwrap();
        let cell = Cell {
            key: 3,
            points: [0; 7],
        };
        let bucket = track(id, PointWidths::BITS_32, 5, 6)
            .grid()
            .unwrap()
            .bucket_of_key(3);
        let update = Update {
            track: id,
            bucket_indices: &[bucket],
            buckets: &[Bucket([2, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, EMPTY])],
            cell_indices: &[2],
            cells: &[cell],
        };
        encoder
            .points(&mut out, Coverage::Delta, &[update], Compression::None)
            .unwrap();
        encoder.remove_tracks(&mut out, &[id - 1]).unwrap();
        encoder.commit(&mut out, u64::from(id), None).unwrap();
    }
    assert_eq!(decode(&mut decoder, &out).1.unwrap_err().id, 1019);
    assert_eq!(decoder.tracks().len(), 1);
    assert_eq!(decoder.points().cells().len(), 12);
    assert_eq!(decoder.points().buckets().len(), 10);
}

/// A decoder can go to another thread.
#[test]
fn public_types_are_send_and_sync() {
    fn check<T: Send + Sync + Unpin + 'static>() {}
    check::<Decoder>();
    check::<Encoder>();
    check::<Error>();
    check::<Event>();
    check::<TrackState>();
    check::<StateDigest>();
    check::<State>();
    check::<Hasher>();
    check::<probes::State>();
}
