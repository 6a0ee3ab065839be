//! Faults in the layout of a record, clauses P-010, P-011 and P-014.

use super::{AREA, Draft, Place, Sections, content, started};
use crate::generate::frames::Frames;
use crate::models::entry::tracks;
use crate::models::points::frames::{WIDTHS, entry, filled, some};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, kind, set_word};

type Change = fn(&mut Vec<u8>, &Sections);

/// Name, sentence, fault: sizes that do not fill the payload.
const SIZES: &[(&str, &str, Change)] = &[
    (
        "bucket-gaps-short",
        "The payload ends 4 bytes before its bucket gaps do",
        |p, s| p.truncate(s.bucket_gaps - 4),
    ),
    (
        "buckets-short",
        "The payload ends 4 bytes before its buckets do",
        |p, s| p.truncate(s.buckets - 4),
    ),
    (
        "cell-gaps-short",
        "The payload ends 4 bytes before its cell gaps do",
        |p, s| p.truncate(s.cell_gaps - 4),
    ),
    (
        "keys-short",
        "The payload ends 4 bytes before its keys do",
        |p, s| p.truncate(s.keys - 4),
    ),
    (
        "points-short",
        "The payload ends 4 bytes before its points do",
        |p, s| p.truncate(s.points - 4),
    ),
    (
        "points-short-of-a-byte",
        "The payload ends one byte before its points do",
        |p, s| p.truncate(s.points - 1),
    ),
    (
        "four-bytes-over",
        "Four bytes follow the last section",
        |p, _| p.extend([0; 4]),
    ),
    ("a-byte-over", "A byte follows the last section", |p, _| {
        p.push(0)
    }),
    (
        "buckets-one-more",
        "The table counts one bucket more than the payload has room for",
        |p, s| {
            p.truncate(s.buckets);
            set_word(p, s.entry + 4, 3);
            set_word(p, s.entry + 8, 0);
        },
    ),
    (
        "buckets-maximum",
        "The table counts 2^32 - 1 buckets",
        |p, s| set_word(p, s.entry + 4, u32::MAX),
    ),
    (
        "buckets-wrap",
        "The table counts 2^30 buckets, whose bytes are 0 modulo 2^32",
        |p, s| {
            p.truncate(s.table);
            set_word(p, s.entry + 4, 1 << 30);
            set_word(p, s.entry + 8, 0);
        },
    ),
    (
        "cells-one-more",
        "The table counts one cell more than there are",
        |p, s| set_word(p, s.entry + 8, 11),
    ),
    (
        "cells-maximum",
        "The table counts 2^32 - 1 cells",
        |p, s| set_word(p, s.entry + 8, u32::MAX),
    ),
    (
        "cells-wrap",
        "The table counts 2^30 cells, whose gaps and keys are 0 bytes modulo 2^32",
        |p, s| {
            p.truncate(s.buckets);
            set_word(p, s.entry + 8, 1 << 30);
        },
    ),
    (
        "tracks-one-more",
        "The table has one track more than the payload has room for",
        |p, s| {
            let count = (s.table - 16) as u32 / 12;
            p.truncate(s.table);
            set_word(p, 0, count + 1);
        },
    ),
    ("tracks-maximum", "The track count is 2^32 - 1", |p, _| {
        set_word(p, 0, u32::MAX)
    }),
    (
        "tracks-wrap",
        "The track count is 2^30, whose entries take 0 bytes modulo 2^32",
        |p, _| set_word(p, 0, 1 << 30),
    ),
];

/// Name, sentence, fault: fields that must be 0.
const RESERVED: &[(&str, &str, Change)] = &[
    ("flag-1", "Bit 1 of the flags is set", |p, _| p[4] |= 2),
    ("flag-31", "Bit 31 of the flags is set", |p, _| p[7] |= 0x80),
    (
        "reserved-bit-0",
        "Bit 0 of the reserved field is set",
        |p, _| p[12] = 1,
    ),
    (
        "reserved-bit-31",
        "Bit 31 of the reserved field is set",
        |p, _| p[15] = 0x80,
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    let places = [Place::Keyframe, Place::Delta, Place::SecondTrack];
    let mut cases = |id, clause, faults: &[(&str, &str, Change)], places: &[Place]| {
        for &(name, comment, change) in faults {
            for place in places {
                let (offset, bytes) = place.with_payload(change);
                let name = format!("{name}-{}", place.name());
                let comment = format!("{comment}, in {}.", place.words());
                let fault = (id, name.as_str());
                drafts.push(Draft::invalid(
                    AREA,
                    fault,
                    offset,
                    &[clause],
                    &comment,
                    bytes,
                ));
            }
        }
    };
    cases(3001, "P-010", SIZES, &places);
    cases(3002, "P-011", RESERVED, &places[..2]);
    let packed = [Pack::Lz4, Pack::Zstd(3)].map(Place::Packed);
    cases(3001, "P-010", &SIZES[4..7], &packed);
    cases(3002, "P-011", &RESERVED[2..3], &packed);
    heads(drafts);
    padding(drafts);
    limits(drafts);
}

/// Payloads that end within their head or table, and the base of a keyframe.
fn heads(drafts: &mut Vec<Draft>) {
    let (frames, entry) = started(WIDTHS[0]);
    let whole = frames.payload(true, &[Part::of(&entry)]);
    for length in [0, 4, 12, 15] {
        let (offset, bytes) = frames.clone().refused(&whole[..length]);
        let comment = format!("The payload has {length} bytes, and its head takes 16.");
        let name = format!("head-of-{length}");
        drafts.push(Draft::invalid(
            AREA,
            (3001, &name),
            offset,
            &["P-010"],
            &comment,
            bytes,
        ));
    }
    for length in [16, 24, 27] {
        let (offset, bytes) = frames.clone().refused(&whole[..length]);
        let comment = format!("The payload has {length} bytes, and head and table take 28.");
        let name = format!("table-to-{length}");
        drafts.push(Draft::invalid(
            AREA,
            (3001, &name),
            offset,
            &["P-010"],
            &comment,
            bytes,
        ));
    }
    for (name, keyframe) in [("keyframe", true), ("delta", false)] {
        let mut payload = frames.payload(keyframe, &[]);
        payload.extend([0; 4]);
        let (offset, bytes) = frames.clone().refused(&payload);
        let name = format!("no-tracks-and-four-bytes-{name}");
        let comment = "A record of no tracks has 4 bytes more than its head.";
        drafts.push(Draft::invalid(
            AREA,
            (3001, &name),
            offset,
            &["P-010"],
            comment,
            bytes,
        ));
    }
    for (name, base) in [("1", 1), ("maximum", u32::MAX)] {
        let mut payload = whole.clone();
        set_word(&mut payload, 8, base);
        let (offset, bytes) = frames.clone().refused(&payload);
        let name = format!("base-of-keyframe-{name}");
        let comment = format!("A keyframe has the base {base}.");
        drafts.push(Draft::invalid(
            AREA,
            (3002, &name),
            offset,
            &["P-011"],
            &comment,
            bytes,
        ));
    }
}

/// Padding after points of 16 and 24 bits that is not 0, or not there.
fn padding(drafts: &mut Vec<Draft>) {
    // Bits of a point, cells, bytes of padding.
    for (bits, widths, cells, padding) in [
        (16, WIDTHS[2], 1, 2),
        (24, WIDTHS[1], 1, 3),
        (24, WIDTHS[1], 2, 2),
        (24, WIDTHS[1], 3, 1),
    ] {
        let entry = entry(7, widths);
        let frames = Frames::new(std::slice::from_ref(&entry));
        let list: Vec<_> = (0..cells)
            .map(|cell| (cell, cell, some(&entry, cell, 7)))
            .collect();
        let payload = frames.payload(true, &[filled(&entry, &list)]);
        let start = payload.len() - padding;
        let mut case = |id, what: &str, clause, payload: &[u8], comment: &str| {
            let (offset, bytes) = frames.clone().refused(payload);
            let name = format!("{what}-{bits}-bits-{cells}-cells");
            drafts.push(Draft::invalid(
                AREA,
                (id, &name),
                offset,
                &[clause],
                comment,
                bytes,
            ));
        };
        let mut first = payload.clone();
        first[start] = 1;
        let comment = "The first byte of the padding is not 0.";
        case(3002, "padding-first-byte", "P-011", &first, comment);
        let mut last = payload.clone();
        *last.last_mut().unwrap_or(&mut 0) = 0x80;
        let comment = "The last byte of the padding is not 0.";
        case(3002, "padding-last-byte", "P-011", &last, comment);
        let comment = "The padding after the points is missing.";
        case(3001, "padding-missing", "P-010", &payload[..start], comment);
    }
    let entries = [entry(1, WIDTHS[2]), entry(2, WIDTHS[0])];
    let frames = Frames::new(&entries);
    let parts = entries
        .each_ref()
        .map(|entry| filled(entry, &[(3, 9, some(entry, 1, 3))]));
    let mut payload = frames.payload(true, &parts);
    // The first track's sections end where the second's begin: 36 + 8 + 28 bytes before the end.
    let at = payload.len() - 72 - 1;
    payload[at] = 1;
    let (offset, bytes) = frames.refused(&payload);
    drafts.push(Draft::invalid(
        AREA,
        (3002, "padding-of-the-first-of-two-tracks"),
        offset,
        &["P-011"],
        "The padding of the first of two tracks is not 0.",
        bytes,
    ));
}

/// The bytes of a frame (P-014), and a record before any group (C-087).
fn limits(drafts: &mut Vec<Draft>) {
    let entries = [entry(1, WIDTHS[0]), entry(2, WIDTHS[0])];
    let parts = entries.each_ref().map(content);
    for (name, pack) in [
        ("plain", Pack::None),
        ("lz4", Pack::Lz4),
        ("zstd", Pack::Zstd(3)),
    ] {
        let frames = Frames::new(&entries).packed(pack);
        let first = frames.payload(true, &parts[..1]);
        let second = frames.payload(true, &parts[1..]);
        let both = (first.len() + second.len()) as u64;
        let bytes = frames.clone().keyframe(&parts[..1]).keyframe(&parts[1..]);
        // The second frame has room of its own.
        let bytes = bytes.commit().keyframe(&parts).commit().ended();
        let comment =
            "Two records of a frame take all the bytes that a frame may, so does the next.";
        let name_at = format!("frame-at-the-limit-{name}");
        drafts.push(
            Draft::valid(AREA, &name_at, &["P-014"], comment, bytes).limit("frame_bytes", both),
        );
        let (offset, bytes) = frames.clone().keyframe(&parts[..1]).refused(&second);
        let name = format!("second-record-{name}");
        let comment = "Two records of a frame take one byte more than a frame may.";
        let draft = Draft::invalid(AREA, (4009, &name), offset, &["P-014"], comment, bytes);
        drafts.push(draft.limit("frame_bytes", both - 1));
    }
    let frames = Frames::new(&entries);
    let payload = frames.payload(true, &parts[..1]);
    let limit = payload.len() as u64 - 1;
    let (offset, bytes) = frames.refused(&payload);
    let comment = "The only record of a frame takes one byte more than a frame may.";
    let draft = Draft::invalid(
        AREA,
        (4009, "one-record"),
        offset,
        &["P-014"],
        comment,
        bytes,
    );
    drafts.push(draft.limit("frame_bytes", limit));

    let mut builder = StreamBuilder::started();
    builder
        .put(kind::TRACK, &tracks(&entries))
        .put(kind::POINTS, &points(None, &parts));
    let offset = builder.last() + HEADER;
    let bytes = builder.put(kind::COMMIT, &commit(0, 0, None)).ended();
    let comment = "A record of points stands before the first group.";
    drafts.push(Draft::invalid(
        AREA,
        (4008, "points"),
        offset,
        &["C-087"],
        comment,
        bytes,
    ));
}
