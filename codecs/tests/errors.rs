//! What errors tell beside their numbers. Which bytes give which number is in `conformance/vectors/`.

use crate::common::*;
use dapple_codec::container::{RecordHeader, record_type};
use dapple_codec::*;

fn first(bytes: &[u8], kind: u16) -> usize {
    let of_kind = |&at: &usize| header(bytes, at).record_type == kind;
    records(bytes).into_iter().find(of_kind).unwrap()
}

fn error_of(bytes: &[u8]) -> Error {
    decode_all(bytes, Limits::default(), |_, _| {})
        .err()
        .unwrap()
}

/// The stream with a record's payload as it was before packing.
fn unpacked(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut h = header(bytes, at);
    let end = at + 32 + h.stored_bytes as usize;
    let mut payload = vec![0; h.unpacked_bytes as usize];
    match h.packing {
        0 => payload.copy_from_slice(&bytes[at + 32..end]),
        _ => {
            let block = &bytes[at + 32..end];
            let length = lz4_flex::block::decompress_into(block, &mut payload).unwrap();
            assert_eq!(length, payload.len());
        }
    }
    h.packing = 0;
    h.stored_bytes = payload.len() as u32;
    h.payload_crc = container::crc32c(&payload);
    [&bytes[..at], &h.to_bytes(), &payload, &bytes[end..]].concat()
}

#[test]
fn errors_name_the_number_that_was_found() {
    let (stream, _) = stream(Compression::None, false);
    let points = first(&stream, record_type::POINTS);
    let group = first(&stream, record_type::GROUP);
    let track = first(&stream, record_type::TRACK);
    let mut version = stream.clone();
    version[8] = 7;
    let crc = container::crc32c(&version[..12]);
    version[12..16].copy_from_slice(&crc.to_le_bytes());
    let of_header = |change: fn(&mut RecordHeader)| with_header(&stream, points, change);
    let plain = unpacked(&stream, track);
    let of_track = |at: usize, value: u8| with_payload(&plain, track, |p| p[at] = value);
    let of_group = with_payload(&stream, group, |p| p[4] = 2);
    let first = Some(1);
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
            of_header(|h| h.record_type = 0x42),
            1022,
            66,
            None,
            "(type 66, acknowledge)",
        ),
        (of_group, 2021, 2, None, "(start 2)"),
        (of_track(16, 9), 2007, 9, first, "(model 9) (track 1)"),
        (of_track(18, 5), 2008, 5, first, "(coding 5) (track 1)"),
        (of_track(20, 2), 2020, 2, first, "(space 2) (track 1)"),
    ] {
        let error = error_of(&bytes);
        assert_eq!((error.id, error.found), (id, Some(found)));
        assert_eq!(error.track, track);
        assert_eq!(error.layer as u16, id / 1000 - 1);
        assert!(error.to_string().starts_with(&format!("E{id} ")));
        assert!(error.to_string().ends_with(words), "{error}");
    }
}

/// A header that claims 4 GiB is refused before memory is reserved, and the error says what was asked for.
#[test]
fn limit_errors_tell_what_was_asked() {
    let (stream, _) = stream(Compression::None, false);
    let start = first(&stream, record_type::STREAM);
    for (packing, stored, which) in [
        (0, u32::MAX, Limit::StoredBytes),
        (1, 12, Limit::UnpackedBytes),
        (2, 12, Limit::UnpackedBytes),
    ] {
        let bytes = with_header(&stream[..60], start, |h| {
            h.packing = packing;
            h.stored_bytes = stored;
            h.unpacked_bytes = u32::MAX;
        });
        let class = ErrorClass::LimitExceeded {
            which,
            asked: u32::MAX.into(),
            allowed: 256 << 20,
        };
        assert_eq!(error_of(&bytes).class, class);
    }
}
