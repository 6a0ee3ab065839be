//! One fault a stream, each with its number; the state and the decoder survive all of them.

use crate::common::*;
use dapple_codec::container::record_type;
use dapple_codec::points::*;
use dapple_codec::*;

/// A stream of one track and two frames, uncompressed; the second is a delta.
struct Small {
    bytes: Vec<u8>,
    /// State after the first frame.
    first: Shown,
}

impl Small {
    fn new() -> Small {
        let table = track(1, PointWidths::BITS_32, 31, 60);
        let grid = *table.grid().unwrap();
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).unwrap();
        encoder.group(&mut bytes, GroupStart::Keyframes).unwrap();
        encoder.tracks(&mut bytes, &[table]).unwrap();
        let (bucket, cell) = one(&grid, 5, 0);
        let update = Update {
            track: 1,
            bucket_indices: &[grid.bucket_of_key(5)],
            buckets: &[bucket],
            cell_indices: &[0],
            cells: &[cell],
        };
        encoder
            .points(&mut bytes, Coverage::Keyframe, &[update], Compression::None)
            .unwrap();
        encoder.commit(&mut bytes, 3, None).unwrap();
        let mut decoder = Decoder::new(Limits::default());
        let _ = decode(&mut decoder, &bytes);
        let first = shown(&decoder);
        let (bucket, cell) = one(&grid, 9, 2);
        let update = Update {
            track: 1,
            bucket_indices: &[grid.bucket_of_key(9)],
            buckets: &[bucket],
            cell_indices: &[2],
            cells: &[cell],
        };
        encoder
            .points(&mut bytes, Coverage::Delta, &[update], Compression::None)
            .unwrap();
        encoder
            .transforms(&mut bytes, &[(1, transform(2.0))], Compression::None)
            .unwrap();
        encoder.commit(&mut bytes, 4, None).unwrap();
        encoder.end(&mut bytes).unwrap();
        Small { bytes, first }
    }

    /// Start of the `nth` record of a type.
    fn record(&self, kind: u16, nth: usize) -> usize {
        let of_kind = |&r: &usize| header(&self.bytes, r).record_type == kind;
        records(&self.bytes)
            .into_iter()
            .filter(of_kind)
            .nth(nth)
            .unwrap()
    }

    /// The stream gives this error, the state stays, and the decoder takes the next stream.
    fn rejects(&self, bytes: &[u8], id: u16, kind: ErrorClass) {
        let mut decoder = Decoder::new(Limits::default());
        let (events, result) = decode(&mut decoder, bytes);
        let error = result.unwrap_err();
        assert_eq!((error.id, error.class), (id, kind), "{error}");
        assert_eq!(error.layer as u16, id / 1000 - 1);
        assert!(!error.name().is_empty() && error.to_string().starts_with(&format!("E{id} ")));
        match events
            .iter()
            .filter(|e| matches!(e, Event::Frame(_)))
            .count()
        {
            0 => assert_eq!(decoder.last_frame(), None),
            1 => assert!(shown(&decoder) == self.first, "the state changed"),
            _ => assert_eq!(decoder.last_frame(), Some((1, 4))),
        }
        assert_eq!(decoder.push(&[1]).unwrap_err().id, 4011);
        decoder.reset();
        decode(&mut decoder, &self.bytes).1.unwrap();
    }
}

/// A bucket that names cell `index`, and that cell with key `key` and one point.
fn one(grid: &Grid, key: u32, index: u32) -> (Bucket, Cell) {
    let mut entries = [EMPTY; 8];
    entries[0] = index;
    let point = grid.widths.pack([0.5; 3], [0.0, 1.0, 0.0], 0.5);
    (
        Bucket(entries),
        Cell {
            key,
            points: [point, 0, 0, 0, 0, 0, 0],
        },
    )
}

fn put(payload: &mut [u8], at: usize, value: u32) {
    payload[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn framing() {
    let small = Small::new();
    let bytes = &small.bytes;
    let malformed = ErrorClass::Malformed;
    small.rejects(b"not a stream, but long", 1001, malformed);
    small.rejects(
        &bytes
            .iter()
            .filter(|b| **b != 0x0d)
            .copied()
            .collect::<Vec<_>>(),
        1001,
        malformed,
    );
    let preamble = |version: u16, profile: u16| {
        let mut b = bytes.clone();
        b[8..10].copy_from_slice(&version.to_le_bytes());
        b[10..12].copy_from_slice(&profile.to_le_bytes());
        let crc = container::crc32c(&b[..12]);
        b[12..16].copy_from_slice(&crc.to_le_bytes());
        b
    };
    small.rejects(&preamble(2, 0), 1003, ErrorClass::Unsupported);
    small.rejects(&preamble(1, 1), 1004, ErrorClass::Unsupported);

    let points = small.record(record_type::POINTS, 1);
    let end = points + 32 + header(bytes, points).stored_bytes as usize;
    let twice = [&bytes[..end], &bytes[points..]].concat();
    small.rejects(&twice, 1007, malformed);
    small.rejects(&[&bytes[..points], &bytes[end..]].concat(), 1008, malformed);
    let early = small.record(record_type::GROUP, 0);
    small.rejects(
        &[&bytes[..points], &bytes[early..]].concat(),
        1009,
        malformed,
    );
    small.rejects(
        &with_header(bytes, points, |h| h.packing = 3),
        1010,
        ErrorClass::Unsupported,
    );
    small.rejects(
        &with_header(bytes, points, |h| h.unpacked_bytes += 1),
        1014,
        malformed,
    );
    small.rejects(
        &with_header(bytes, points, |h| h.version = 1),
        1021,
        ErrorClass::Unsupported,
    );
    small.rejects(
        &with_header(bytes, points, |h| h.record_type = 99),
        1022,
        ErrorClass::Unsupported,
    );
    small.rejects(
        &with_header(bytes, points, |h| h.critical = false),
        1023,
        malformed,
    );
    let record = small.record(record_type::END, 0);
    small.rejects(&with_payload(bytes, record, |p| p[0] ^= 1), 1024, malformed);
    small.rejects(
        &with_payload(bytes, record, |p| p[8] ^= 1),
        1025,
        ErrorClass::Checksum,
    );
    let mut reserved = bytes.clone();
    reserved[points + 4] = 1;
    let crc = container::crc32c(&reserved[points..points + 28]);
    reserved[points + 28..points + 32].copy_from_slice(&crc.to_le_bytes());
    small.rejects(&reserved, 1006, malformed);

    // Trailing bytes after the end come with the next push.
    let mut decoder = Decoder::new(Limits::default());
    let (_, result) = decode(&mut decoder, bytes);
    result.unwrap();
    assert_eq!(decoder.push(&[0]).unwrap_err().id, 1020);
}

#[test]
fn errors_name_the_number_that_was_found() {
    let small = Small::new();
    let points = small.record(record_type::POINTS, 1);
    let group = small.record(record_type::GROUP, 0);
    let track = small.record(record_type::TRACK, 0);
    let mut version = small.bytes.clone();
    version[8] = 7;
    let crc = container::crc32c(&version[..12]);
    version[12..16].copy_from_slice(&crc.to_le_bytes());
    let of_header =
        |change: fn(&mut container::RecordHeader)| with_header(&small.bytes, points, change);
    let plain = unpacked(&small.bytes, track);
    let of_track = |at: usize, value: u8| with_payload(&plain, track, |p| p[at] = value);
    for (bytes, id, found, track, words) in [
        (version, 1003, 7, None, "(version 7)"),
        (
            of_header(|h| h.packing = 3),
            1010,
            3,
            None,
            "(compression 3)",
        ),
        (of_header(|h| h.version = 4), 1021, 4, None, "(version 4)"),
        (
            of_header(|h| h.record_type = 99),
            1022,
            99,
            None,
            "(type 99, unknown)",
        ),
        (
            of_header(|h| h.record_type = 0x22),
            1022,
            0x22,
            None,
            "(type 34, vertices)",
        ),
        (
            with_payload(&small.bytes, group, |p| put(p, 4, 2)),
            2021,
            2,
            None,
            "(start 2)",
        ),
        (of_track(16, 3), 2007, 3, Some(1), "(model 3) (track 1)"),
        (of_track(18, 5), 2008, 5, Some(1), "(coding 5) (track 1)"),
        (of_track(20, 2), 2020, 2, Some(1), "(space 2) (track 1)"),
    ] {
        let error = decode(&mut Decoder::new(Limits::default()), &bytes)
            .1
            .unwrap_err();
        assert_eq!(
            (error.id, error.found, error.track),
            (id, Some(found), track)
        );
        assert!(error.to_string().ends_with(words), "{error}");
    }
}

/// The stream with a record's payload as it was before packing.
fn unpacked(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut h = header(bytes, at);
    let end = at + 32 + h.stored_bytes as usize;
    let mut payload = vec![0; h.unpacked_bytes as usize];
    match h.packing {
        0 => payload.copy_from_slice(&bytes[at + 32..end]),
        _ => assert_eq!(lz4(&bytes[at + 32..end], &mut payload), payload.len()),
    }
    h.packing = 0;
    h.stored_bytes = payload.len() as u32;
    h.payload_crc = container::crc32c(&payload);
    [&bytes[..at], &h.to_bytes(), &payload, &bytes[end..]].concat()
}

#[test]
fn four_gigabytes_in_sixty_bytes() {
    let small = Small::new();
    let start = small.record(record_type::STREAM, 0);
    for (packing, stored, unpacked, id) in [
        (0, u32::MAX, u32::MAX, 1012),
        (1, 12, u32::MAX, 1013),
        (1, 12, 64 << 20, 1014),
        (2, 12, 64 << 20, 1014),
        (2, 12, u32::MAX, 1013),
    ] {
        let bytes = with_header(&small.bytes[..60], start, |h| {
            h.packing = packing;
            h.stored_bytes = stored;
            h.unpacked_bytes = unpacked;
        });
        let mut decoder = Decoder::new(Limits::default());
        let error = decode(&mut decoder, &bytes).1.unwrap_err();
        assert_eq!(error.id, id, "{error}");
        if id != 1014 {
            let ErrorClass::LimitExceeded { asked, allowed, .. } = error.class else {
                panic!("{error}")
            };
            assert_eq!((asked, allowed), (u64::from(u32::MAX), 256 << 20));
        }
    }
}

#[test]
fn unknown_records() {
    let small = Small::new();
    // An ancillary record of an unknown type, packed in an unknown way, after the first commit.
    let at = small.record(record_type::POINTS, 1);
    let sequence = header(&small.bytes, at).sequence;
    let header = container::RecordHeader {
        record_type: 0x10,
        critical: false,
        version: 9,
        packing: 77,
        sequence,
        stored_bytes: 3,
        unpacked_bytes: u32::MAX,
        payload_crc: 0,
    };
    let bytes = [&small.bytes[..at], &header.to_bytes(), b"abc"].concat();
    let mut decoder = Decoder::new(Limits::default());
    let (events, _) = decode(&mut decoder, &bytes);
    let skipped = Event::Skipped {
        record_type: 0x10,
        stored_bytes: 3,
    };
    assert_eq!(events.last(), Some(&skipped));
    decoder.finish_live().unwrap();
}

#[test]
fn fields_of_records() {
    let small = Small::new();
    let malformed = ErrorClass::Malformed;
    let case = |kind: u16, nth: usize, id: u16, want: ErrorClass, change: &dyn Fn(&mut Vec<u8>)| {
        let at = small.record(kind, nth);
        small.rejects(&with_payload(&small.bytes, at, |p| change(p)), id, want);
    };
    use record_type::*;
    case(STREAM, 0, 2001, malformed, &|p| p.push(0));
    case(STREAM, 0, 2003, malformed, &|p| put(p, 4, 0));
    case(GROUP, 0, 2002, malformed, &|p| p[8] = 1);
    case(GROUP, 0, 2021, ErrorClass::Unsupported, &|p| put(p, 4, 2));
    case(GROUP, 0, 4002, ErrorClass::MissingBase, &|p| put(p, 4, 1));
    case(TRANSFORMS, 0, 2001, malformed, &|p| put(p, 0, 2));
    case(TRANSFORMS, 0, 2019, malformed, &|p| put(p, 8, 2));
    case(TRANSFORMS, 0, 2009, malformed, &|p| {
        put(p, 12, f32::NAN.to_bits())
    });
    case(COMMIT, 1, 4003, malformed, &|p| put(p, 8, 0));
    case(COMMIT, 1, 4004, malformed, &|p| put(p, 0, 2));
    case(COMMIT, 1, 2002, malformed, &|p| put(p, 12, 2));
    case(COMMIT, 1, 4005, ErrorClass::Checksum, &|p| {
        put(p, 12, 1);
        p.extend([0; 8]);
    });
    // Tracks are packed by the encoder; rewrite the record without.
    let at = small.record(TRACK, 0);
    let plain = unpacked(&small.bytes, at);
    let track_case = |id: u16, want: ErrorClass, change: &dyn Fn(&mut Vec<u8>)| {
        small.rejects(&with_payload(&plain, at, |p| change(p)), id, want);
    };
    let limit = |which, asked, allowed| ErrorClass::LimitExceeded {
        which,
        asked,
        allowed,
    };
    let unsupported = ErrorClass::Unsupported;
    track_case(2001, malformed, &|p| put(p, 0, 2));
    track_case(2001, malformed, &|p| put(p, 8, 4));
    track_case(2002, malformed, &|p| put(p, 4, 1));
    track_case(2007, unsupported, &|p| p[16] = 3);
    track_case(2008, unsupported, &|p| p[18] = 1);
    track_case(2020, unsupported, &|p| p[20] = 2);
    track_case(2002, malformed, &|p| p[21] = 2);
    track_case(2012, limit(Limit::PathBytes, 0xff0b, 1024), &|p| {
        p[23] = 0xff
    });
    track_case(2009, malformed, &|p| put(p, 40, f32::INFINITY.to_bits()));
    track_case(2010, malformed, &|p| put(p, 40, 5f32.to_bits()));
    track_case(2014, malformed, &|p| put(p, 112, 0));
    track_case(2015, malformed, &|p| put(p, 124, 1f32.to_bits()));
    track_case(2016, malformed, &|p| p[128] = 6);
    track_case(2017, malformed, &|p| put(p, 132, 0));
    let asked = 31 * 32 + u64::from(u32::MAX - 1) * 36;
    track_case(2018, limit(Limit::StateBytes, asked, 512 << 20), &|p| {
        put(p, 136, u32::MAX - 1)
    });
    track_case(2011, malformed, &|p| p[140] = 0xff);
    track_case(2002, malformed, &|p| *p.last_mut().unwrap() = 1);
}

/// A minimal lz4 block decoder: the test needs no other crate.
fn lz4(mut block: &[u8], out: &mut [u8]) -> usize {
    fn length(block: &mut &[u8], mut value: usize) -> usize {
        if value == 15 {
            loop {
                let byte = block[0];
                *block = &block[1..];
                value += usize::from(byte);
                if byte != 255 {
                    break;
                }
            }
        }
        value
    }
    let mut at = 0;
    while let Some((&token, rest)) = block.split_first() {
        block = rest;
        let literals = length(&mut block, usize::from(token >> 4));
        out[at..at + literals].copy_from_slice(&block[..literals]);
        block = &block[literals..];
        at += literals;
        if block.is_empty() {
            break;
        }
        let offset = usize::from(u16::from_le_bytes([block[0], block[1]]));
        block = &block[2..];
        for _ in 0..4 + length(&mut block, usize::from(token & 15)) {
            out[at] = out[at - offset];
            at += 1;
        }
    }
    at
}

#[test]
fn fields_of_points() {
    let small = Small::new();
    let malformed = ErrorClass::Malformed;
    let case = |id: u16, want: ErrorClass, change: &dyn Fn(&mut Vec<u8>)| {
        let at = small.record(record_type::POINTS, 1);
        small.rejects(&with_payload(&small.bytes, at, |p| change(p)), id, want);
    };
    // Head 16, entry 12, bucket index 28, bucket 32..64, cell index 64, key 68, points 72..100.
    case(3001, malformed, &|p| p.truncate(15));
    case(3001, malformed, &|p| p.extend([0; 4]));
    case(3001, malformed, &|p| put(p, 0, u32::MAX));
    case(3001, malformed, &|p| put(p, 20, u32::MAX));
    case(3001, malformed, &|p| put(p, 24, 2));
    case(3002, malformed, &|p| put(p, 4, 2));
    case(3002, malformed, &|p| put(p, 12, 1));
    case(3002, malformed, &|p| (put(p, 4, 1), put(p, 8, 1)).0);
    case(4001, ErrorClass::MissingBase, &|p| put(p, 8, 7));
    case(2019, malformed, &|p| put(p, 16, 2));
    case(3003, malformed, &|p| put(p, 28, 31));
    case(3003, malformed, &|p| put(p, 28, u32::MAX));
    case(3004, malformed, &|p| put(p, 64, 60));
    case(3005, malformed, &|p| put(p, 32, 60));
    case(3006, malformed, &|p| put(p, 40, 2));
    case(3007, malformed, &|p| put(p, 36, 2));
    case(3008, malformed, &|p| put(p, 68, 9 * 8 * 7));
    case(3009, malformed, &|p| put(p, 80, 1 << 31));
    case(3010, malformed, &|p| put(p, 76, 1));
    case(3011, malformed, &|p| put(p, 68, EMPTY));
    case(3012, malformed, &|p| put(p, 68, 10));
    case(3012, malformed, &|p| put(p, 32, 1));
    // The cell of the first frame takes another key; its old bucket still names it.
    case(3013, malformed, &|p| put(p, 64, 0));
}

/// Records of valid streams in another order, with sequence numbers that fit.
fn in_order(records: &[&[u8]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    Encoder::new(EncoderConfig::default(), &mut bytes).unwrap();
    for (sequence, record) in (1..).zip(records) {
        bytes.extend(with_header(record, 0, |h| h.sequence = sequence));
    }
    bytes
}

#[test]
fn records_out_of_order_are_refused() {
    let t = |id, buckets| track(id, PointWidths::BITS_32, buckets, 4);
    let empty = Update {
        track: 4,
        bucket_indices: &[],
        buckets: &[],
        cell_indices: &[],
        cells: &[],
    };
    let none = Compression::None;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).unwrap();
    let mut starts = vec![bytes.len()];
    let mut step = |write: &mut dyn FnMut(&mut Encoder, &mut Vec<u8>) -> Result<()>| {
        write(&mut encoder, &mut bytes).unwrap();
        starts.push(bytes.len());
    };
    step(&mut |e, o| e.group(o, GroupStart::Keyframes));
    step(&mut |e, o| e.tracks(o, &[t(4, 3)]));
    step(&mut |e, o| e.tracks(o, &[t(5, 3)]));
    step(&mut |e, o| e.points(o, Coverage::Keyframe, &[empty], none));
    step(&mut |e, o| e.transforms(o, &[(4, Transform::IDENTITY)], none));
    step(&mut |e, o| e.commit(o, 0, None).map(|_| ()));
    step(&mut |e, o| e.remove_tracks(o, &[4]));
    step(&mut |e, o| e.commit(o, 0, None).map(|_| ()));
    step(&mut |e, o| e.end(o));
    let records: Vec<&[u8]> = starts.windows(2).map(|w| &bytes[w[0]..w[1]]).collect();
    let &[
        group,
        track_4,
        track_5,
        points,
        transforms,
        commit,
        remove,
        _,
        end,
    ] = &records[..]
    else {
        panic!("one record a step");
    };
    let other = {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).unwrap();
        let start = bytes.len();
        encoder.tracks(&mut bytes, &[t(4, 4)]).unwrap();
        bytes.split_off(start)
    };
    for (records, id) in [
        (&[commit][..], 4008),
        (&[track_4, transforms], 4008),
        (&[track_4, points], 4008),
        (&[group, group], 4006),
        (&[group, end], 4006),
        (&[group, track_4, points, points], 4010),
        (&[group, track_4, transforms, transforms], 4010),
        (&[group, track_4, points, remove], 4010),
        (&[track_5, track_4], 2005),
        (&[group, track_4, remove, commit, track_4], 2005),
        (&[track_4, track_4, other.as_slice()], 2006),
        (&[group, track_4, remove, transforms], 2019),
        (&[group, track_4, remove, points], 2019),
        (&[group, track_4, remove, remove], 2019),
        (&[group, transforms], 2019),
    ] {
        let mut decoder = Decoder::new(Limits::default());
        let (_, result) = decode(&mut decoder, &in_order(records));
        assert_eq!(result.unwrap_err().id, id);
    }
}
