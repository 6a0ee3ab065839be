//! Preamble, record headers, records that are skipped, the end of a stream.

use super::plan::{AREA, Plan, at, header, payload, refused, valid};
use super::{Draft, packing, tracks};
use crate::forge::{Forge, HEADER, Header, Pack, commit, group, kind, words};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    whole(drafts);
    preamble(drafts);
    headers(drafts);
    types(drafts);
    lengths(drafts);
    skipped(drafts);
    ends(drafts);
    truncated(drafts);
    live(drafts);
    packing::add(drafts);
    tracks::add(drafts);
}

/// A stream with one frame of nothing.
pub fn empty_frame() -> Forge {
    let mut forge = Forge::started();
    forge
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    forge
}

fn whole(drafts: &mut Vec<Draft>) {
    drafts.push(Draft::valid(
        AREA,
        "least",
        &["C-001", "C-002", "C-003", "C-004", "C-010", "C-101"],
        "The smallest stream that shows something: one empty frame.",
        empty_frame().ended(),
    ));
    drafts.push(Draft::valid(
        AREA,
        "no-frame",
        &["C-016", "C-101"],
        "Nothing but the stream record and the end.",
        Forge::started().ended(),
    ));
    drafts.push(valid(
        "usual",
        &["C-012", "C-044", "C-081", "C-088"],
        "Each defined record type at least once, over three frames.",
        &Plan::usual(),
    ));
}

fn preamble(drafts: &mut Vec<Draft>) {
    let mut bad = |fault: (u16, &str), clauses: &[&'static str], comment: &str, bytes: Vec<u8>| {
        drafts.push(Draft::invalid(AREA, fault, 0, clauses, comment, bytes));
    };
    let usual = Plan::usual().bytes();
    // The whole stream after another preamble.
    let after = |mut forge: Forge| {
        for (record_type, payload) in Plan::usual().records {
            forge.put(record_type, &payload);
        }
        forge.ended()
    };
    let magic = *b"\x89DPL\r\n\x1a\n";
    for (name, at, value, comment) in [
        (
            "magic-seven-bit",
            0,
            0x09,
            "The first byte of the magic has lost its highest bit.",
        ),
        (
            "magic-lower-case",
            1,
            b'd',
            "A letter of the magic is in lower case.",
        ),
        (
            "magic-last-byte",
            7,
            0x0d,
            "The last byte of the magic is another.",
        ),
    ] {
        let mut other = magic;
        other[at] = value;
        let bytes = after(Forge::with_magic(other, 1, 0));
        bad((1001, name), &["C-001"], comment, bytes);
    }
    bad(
        (1001, "magic-text-transfer"),
        &["C-001"],
        "A transfer as text has taken the carriage returns out.",
        usual.iter().copied().filter(|&b| b != b'\r').collect(),
    );
    bad(
        (1001, "magic-of-png"),
        &["C-001"],
        "Another format: the first bytes of a PNG file.",
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01".to_vec(),
    );
    let damaged = |at: usize, bit: u8| {
        let mut bytes = usual.clone();
        bytes[at] ^= bit;
        bytes
    };
    bad(
        (1002, "preamble-crc"),
        &["C-002"],
        "The lowest bit of the preamble's CRC is flipped.",
        damaged(12, 1),
    );
    bad(
        (1002, "preamble-profile-bit"),
        &["C-002"],
        "A bit of the profile is flipped and the CRC is not mended.",
        damaged(11, 0x80),
    );
    bad(
        (1001, "magic-before-checksum"),
        &["C-001", "C-112"],
        "The magic is another and the CRC does not match: the magic is checked first.",
        damaged(3, 1),
    );
    bad(
        (1002, "checksum-before-version"),
        &["C-002", "C-112"],
        "The version is unknown and the CRC does not match: the CRC is checked first.",
        damaged(8, 2),
    );
    for (name, version, comment) in [
        ("version-zero", 0, "Container version 0."),
        ("version-two", 2, "Container version 2."),
        (
            "version-high-byte",
            0x0101,
            "The version's high byte counts: 257.",
        ),
    ] {
        let bytes = after(Forge::with_preamble(version, 0));
        bad((1003, name), &["C-003"], comment, bytes);
    }
    for (name, profile, comment) in [
        ("profile-datagrams", 1, "The profile kept for datagrams."),
        (
            "profile-high-byte",
            0x0100,
            "The profile's high byte counts.",
        ),
    ] {
        let bytes = after(Forge::with_preamble(1, profile));
        bad((1004, name), &["C-004"], comment, bytes);
    }
    bad(
        (1003, "version-before-profile"),
        &["C-003", "C-112"],
        "Version and profile are unknown: the version is checked first.",
        after(Forge::with_preamble(2, 1)),
    );
}

/// Faults of the fields that all record types share.
fn headers(drafts: &mut Vec<Draft>) {
    let reserved = |h: &mut Header| h.reserved = 1;
    let gap = |h: &mut Header| h.sequence += 1;
    drafts.extend([
        header(
            (1005, "first-header-crc"),
            &["C-010"],
            at::STREAM,
            "The header CRC of the first record is off by a bit.",
            |h| h.header_crc = 1,
        ),
        header(
            (1005, "header-crc"),
            &["C-010"],
            at::COMMIT,
            "The header CRC of a commit is off by its highest bit.",
            |h| h.header_crc = 1 << 31,
        ),
        header(
            (1005, "end-header-crc"),
            &["C-010"],
            at::END,
            "The header CRC of the end is off by a bit.",
            |h| h.header_crc = 2,
        ),
        header(
            (1005, "checksum-before-reserved"),
            &["C-010", "C-112"],
            at::GROUP,
            "A reserved bit is set and the header CRC does not match: the CRC is checked first.",
            |h| {
                h.header_crc = 1;
                reserved(h);
            },
        ),
        header(
            (1006, "header-reserved-lowest"),
            &["C-011"],
            at::STREAM,
            "The lowest reserved bit of a header is set.",
            reserved,
        ),
        header(
            (1006, "header-reserved-highest"),
            &["C-011"],
            at::POINTS,
            "The highest reserved bit of a header is set.",
            |h| h.reserved = 1 << 31,
        ),
        header(
            (1006, "reserved-before-sequence"),
            &["C-011", "C-112"],
            at::TRACK,
            "A reserved bit is set and records are missing: the bit is checked first.",
            |h| {
                reserved(h);
                gap(h);
            },
        ),
        header(
            (1006, "header-reserved-of-skipped"),
            &["C-011", "C-017"],
            at::DELTA,
            "A record that would be skipped has a reserved bit set.",
            |h| {
                skip(h);
                reserved(h);
            },
        ),
        header(
            (1007, "sequence-again"),
            &["C-012"],
            at::DELTA,
            "A record has the sequence of the record before.",
            |h| h.sequence -= 1,
        ),
        header(
            (1007, "sequence-of-end"),
            &["C-012"],
            at::END,
            "The end has the sequence of the record before.",
            |h| h.sequence -= 1,
        ),
        header(
            (1008, "sequence-ahead"),
            &["C-012"],
            at::TRANSFORMS,
            "A record's sequence is one ahead.",
            gap,
        ),
        header(
            (1008, "sequence-first"),
            &["C-012"],
            at::STREAM,
            "The first record has sequence 1.",
            gap,
        ),
        header(
            (1008, "sequence-high-word"),
            &["C-012"],
            at::COMMIT,
            "The sequence has 64 bits: its low word fits, its high word does not.",
            |h| h.sequence += 1 << 32,
        ),
        header(
            (1008, "sequence-most"),
            &["C-012"],
            at::STREAM,
            "The first record has the largest sequence, which is not one less than 0.",
            |h| h.sequence = u64::MAX,
        ),
        header(
            (1009, "sequence-two-back"),
            &["C-012"],
            at::COMMIT,
            "A record's sequence is two below the one due.",
            |h| h.sequence -= 2,
        ),
        header(
            (1009, "sequence-zero"),
            &["C-012"],
            at::SECOND_COMMIT,
            "A later record has sequence 0.",
            |h| h.sequence = 0,
        ),
        header(
            (1008, "sequence-before-type"),
            &["C-012", "C-112"],
            at::TRANSFORMS,
            "Records are missing and the type is unknown: the sequence is checked first.",
            |h| {
                gap(h);
                h.record_type = 0x21;
            },
        ),
        header(
            (1008, "sequence-of-skipped"),
            &["C-012", "C-017"],
            at::TRANSFORMS,
            "A record that would be skipped is one ahead.",
            |h| {
                gap(h);
                skip(h);
            },
        ),
    ]);
    // Whole records twice, and left out.
    let usual = Plan::usual().forge(at::END, |_| {});
    let (starts, bytes) = (&usual.starts, &usual.bytes);
    let end = |at: usize| starts[at + 1];
    let commit = at::COMMIT;
    let twice = [&bytes[..end(commit)], &bytes[starts[commit]..]].concat();
    drafts.push(Draft::invalid(
        AREA,
        (1007, "record-twice"),
        end(commit),
        &["C-012"],
        "A whole record came twice.",
        twice,
    ));
    let lost = [&bytes[..starts[commit]], &bytes[end(commit)..]].concat();
    drafts.push(Draft::invalid(
        AREA,
        (1008, "record-lost"),
        starts[commit],
        &["C-012"],
        "A whole record is missing.",
        lost,
    ));
    let swapped = [
        &bytes[..starts[at::POINTS]],
        &bytes[starts[at::TRANSFORMS]..end(at::TRANSFORMS)],
        &bytes[starts[at::POINTS]..end(at::POINTS)],
        &bytes[starts[commit]..],
    ]
    .concat();
    drafts.push(Draft::invalid(
        AREA,
        (1008, "records-swapped"),
        starts[at::POINTS],
        &["C-012"],
        "Two records have changed places.",
        swapped,
    ));
}

/// Makes a header one of a record that is skipped.
fn skip(header: &mut Header) {
    header.record_type = kind::SEEK_INDEX;
    header.critical = false;
}

/// The defined types: name and place in the usual stream.
const TYPES: [(&str, usize); 8] = [
    ("stream", at::STREAM),
    ("group", at::GROUP),
    ("track", at::TRACK),
    ("track-remove", at::REMOVE),
    ("transforms", at::TRANSFORMS),
    ("commit", at::COMMIT),
    ("end", at::END),
    ("points", at::DELTA),
];

/// Type, critical bit and version; the first record.
fn types(drafts: &mut Vec<Draft>) {
    for number in [
        0x00, 0x08, 0x10, 0x1f, 0x21, 0x22, 0x23, 0x24, 0x40, 0x41, 0x42, 0x43, 0x7000, 0x7fff,
    ] {
        drafts.push(header(
            (1022, &format!("critical-type-{number:04x}")),
            &["C-013"],
            at::DELTA,
            &format!("A critical record of the type 0x{number:04x}, which no decoder knows yet."),
            |h| h.record_type = number,
        ));
    }
    for (name, at) in TYPES {
        drafts.push(header(
            (1023, &format!("{name}-not-critical")),
            &["C-014"],
            at,
            "A record of a defined type lacks the critical bit.",
            |h| h.critical = false,
        ));
        drafts.push(header(
            (1021, &format!("{name}-version")),
            &["C-015"],
            at,
            "A record of a defined type has version 1.",
            |h| h.version = 1,
        ));
        drafts.push(
            header(
                (1011, &format!("{name}-payload-crc")),
                &["C-022"],
                at,
                "The payload CRC is off by a bit.",
                |h| h.payload_crc ^= 1,
            )
            .payload_fault(),
        );
    }
    let unknown = |h: &mut Header| h.record_type = 0x21;
    let older = |h: &mut Header| h.version = 1;
    drafts.extend([
        header((1021, "version-most"), &["C-015"], at::GROUP,
            "Record version 255.", |h| h.version = 255),
        header((1022, "unknown-before-first"), &["C-013", "C-112"], at::STREAM,
            "The first record is critical and of an unknown type: the type is checked before the place.",
            unknown),
        header((1022, "unknown-before-version"), &["C-013", "C-112"], at::DELTA,
            "A critical record of an unknown type has version 1, which is not looked at.", |h| {
                unknown(h);
                older(h);
            }),
        header((1023, "critical-before-version"), &["C-014", "C-112"], at::GROUP,
            "A record lacks the critical bit and has version 1: the bit is checked first.", |h| {
                h.critical = false;
                older(h);
            }),
        header((1021, "version-before-first"), &["C-015", "C-112"], at::STREAM,
            "The first record is a group of version 1: the version is checked before the place.",
            |h| {
                h.record_type = kind::GROUP;
                older(h);
            }),
        header((4007, "first-is-group"), &["C-016"], at::STREAM,
            "The first record is a group.", |h| h.record_type = kind::GROUP),
        header((4007, "first-is-end"), &["C-016"], at::STREAM,
            "The first record is an end.", |h| h.record_type = kind::END),
        header((4007, "first-is-skipped"), &["C-016", "C-017"], at::STREAM,
            "A record that would be skipped stands before the stream record.", skip),
        header((4007, "first-before-length"), &["C-016", "C-112"], at::STREAM,
            "The first record is a commit that claims 4 GiB: the place is checked before the length.",
            |h| {
                h.record_type = kind::COMMIT;
                h.stored = u32::MAX;
            }),
    ]);
    let again = Plan::usual().insert(at::GROUP, kind::STREAM, words(&[60, 1]));
    let (offset, bytes) = again.with_header(at::GROUP, |_| {});
    drafts.push(Draft::invalid(
        AREA,
        (4007, "second-stream"),
        offset,
        &["C-016"],
        "A second stream record, the same as the first.",
        bytes,
    ));
}

/// Packing and lengths as the header states them. Claims beyond a limit are among the limits.
fn lengths(drafts: &mut Vec<Draft>) {
    drafts.extend([
        header((1010, "packing-three"), &["C-020"], at::GROUP,
            "Packing 3 is unknown.", |h| h.packing = 3),
        header((1010, "packing-most"), &["C-020"], at::POINTS,
            "Packing 255 is unknown.", |h| h.packing = 255),
        header((1010, "packing-before-length"), &["C-020", "C-112"], at::TRACK,
            "The packing is unknown and the lengths differ: the packing is checked first.", |h| {
                h.packing = 3;
                h.unpacked -= 1;
            }),
        header((1014, "unpacked-above-stored"), &["C-021"], at::COMMIT,
            "An unpacked record claims a byte more than is stored.", |h| h.unpacked += 1),
        header((1014, "unpacked-below-stored"), &["C-021"], at::COMMIT,
            "An unpacked record claims a byte less than is stored.", |h| h.unpacked -= 1),
        header((1014, "lz4-ratio"), &["C-021"], at::STREAM,
            "An lz4 block of 8 bytes claims 2041, one more than can be.", |h| {
                h.packing = 1;
                h.unpacked = 255 * 8 + 1;
            }),
        header((1015, "lz4-ratio-just-possible"), &["C-021", "C-030"], at::STREAM,
            "An lz4 block of 8 bytes claims 2040: possible by the lengths, but not what is in it.",
            |h| {
                h.packing = 1;
                h.unpacked = 255 * 8;
            })
        .payload_fault(),
        header((1014, "zstd-ratio"), &["C-021"], at::STREAM,
            "A zstd frame of 8 bytes claims 262145, one more than can be.", |h| {
                h.packing = 2;
                h.unpacked = 2 * 131_072 + 1;
            }),
        header((1017, "zstd-ratio-just-possible"), &["C-021", "C-031"], at::STREAM,
            "A zstd frame of 8 bytes claims 262144: possible by the lengths, but not a frame.",
            |h| {
                h.packing = 2;
                h.unpacked = 2 * 131_072;
            })
        .payload_fault(),
        header((1014, "length-before-payload"), &["C-021", "C-112"], at::GROUP,
            "The lengths contradict each other and the payload CRC does not match: the header comes first.",
            |h| {
                h.unpacked += 4;
                h.payload_crc ^= 1;
            }),
    ]);
    // A payload of nothing or next to nothing: the rest of the stream stays whole.
    let small = |stored: &[u8], change: fn(&mut Header)| {
        let mut forge = Plan::usual().up_to(at::GROUP).start();
        forge.put_stored(kind::COMMIT, Pack::None, stored.len(), stored, change);
        (forge.last(), forge.ended())
    };
    let mut bad = |fault, clauses: &[&'static str], comment, (offset, bytes)| {
        drafts.push(Draft::invalid(AREA, fault, offset, clauses, comment, bytes));
    };
    bad(
        (1014, "lz4-of-nothing"),
        &["C-021"],
        "An lz4 block of 0 bytes claims a byte.",
        small(&[], |h| (h.packing, h.unpacked) = (1, 1)),
    );
    bad(
        (1014, "zstd-of-three-bytes"),
        &["C-021"],
        "A zstd frame of 3 bytes claims a byte: a whole quarter of a word has none.",
        small(&[1, 2, 3], |h| (h.packing, h.unpacked) = (2, 1)),
    );
    let payload = |(header, bytes)| (header + HEADER, bytes);
    bad(
        (1011, "empty-payload-crc"),
        &["C-022"],
        "An empty payload has a CRC other than 0.",
        payload(small(&[], |h| h.payload_crc = 1)),
    );
    bad(
        (2001, "empty-payload"),
        &["C-022", "C-040"],
        "An empty payload of a record that has fields.",
        payload(small(&[], |_| {})),
    );
}

impl Draft {
    /// Moves the fault from a header to its payload.
    fn payload_fault(mut self) -> Draft {
        self.error = self.error.map(|(id, offset)| (id, offset + HEADER as u64));
        self
    }
}

/// Records of unknown types that may be ignored.
fn skipped(drafts: &mut Vec<Draft>) {
    // Nonsense in all fields that are not looked at.
    let with = |number: u16, places: &[usize], payload: &[u8]| {
        let mut forge = Forge::new();
        let put = |forge: &mut Forge| {
            forge.put_with(number, Pack::None, payload, |h| {
                h.critical = false;
                h.version = 255;
                h.packing = 77;
                h.unpacked = u32::MAX;
                h.payload_crc ^= 0x5555_5555;
            });
        };
        for (index, (record_type, payload)) in Plan::usual().records.iter().enumerate() {
            if places.contains(&index) {
                put(&mut forge);
            }
            forge.put(*record_type, payload);
        }
        if places.contains(&at::END) {
            put(&mut forge);
        }
        forge.ended()
    };
    let mut good = |name: &str, comment: &str, bytes| {
        drafts.push(Draft::valid(
            AREA,
            name,
            &["C-017", "C-101"],
            comment,
            bytes,
        ));
    };
    for number in [0x00, 0x08, 0x10, 0x1f, 0x21, 0x40, 0x7000, 0x7fff] {
        good(
            &format!("skipped-type-{number:04x}"),
            &format!(
                "A record of the type 0x{number:04x} without the critical bit, with nonsense in what is not looked at."
            ),
            with(number, &[at::POINTS], b"abc"),
        );
    }
    good(
        "skipped-after-stream",
        "A skipped record right after the stream record.",
        with(kind::SEEK_INDEX, &[at::TRACK], b"index"),
    );
    good(
        "skipped-before-end",
        "A skipped record right before the end, which counts it.",
        with(kind::SEEK_INDEX, &[at::END], b"index"),
    );
    good(
        "skipped-everywhere",
        "A skipped record before each other one.",
        with(0x7abc, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11], &[]),
    );
    let inner = empty_frame().ended();
    good(
        "skipped-with-a-stream-inside",
        "A skipped record that holds a stream of its own.",
        with(0x7000, &[at::COMMIT], &inner),
    );
    good(
        "skipped-empty",
        "A skipped record without a payload.",
        with(0x7000, &[at::COMMIT], &[]),
    );
}

/// The end record, and what follows it.
fn ends(drafts: &mut Vec<Draft>) {
    drafts.extend([
        payload(
            (1024, "end-count-above"),
            &["C-101"],
            at::END,
            "The end counts a record too many.",
            |p| p[0] += 1,
        ),
        payload(
            (1024, "end-count-below"),
            &["C-101"],
            at::END,
            "The end counts a record too few.",
            |p| p[0] -= 1,
        ),
        payload(
            (1024, "end-count-high-word"),
            &["C-101"],
            at::END,
            "The count has 64 bits.",
            |p| p[7] = 0x80,
        ),
        payload(
            (1025, "end-digest"),
            &["C-101"],
            at::END,
            "The digest of the stream is off by a bit.",
            |p| p[8] ^= 1,
        ),
        payload(
            (1025, "end-digest-high-word"),
            &["C-101"],
            at::END,
            "The digest of the stream is off by its highest bit.",
            |p| p[15] ^= 0x80,
        ),
        payload(
            (1024, "count-before-digest"),
            &["C-101", "C-112"],
            at::END,
            "Count and digest do not match: the count is checked first.",
            |p| {
                p[0] += 1;
                p[8] ^= 1;
            },
        ),
        payload(
            (2001, "end-short"),
            &["C-040"],
            at::END,
            "The payload of an end is a byte short.",
            |p| p.truncate(15),
        ),
        payload(
            (2001, "end-long"),
            &["C-040"],
            at::END,
            "The payload of an end is a byte long.",
            |p| p.push(0),
        ),
        payload(
            (2001, "end-empty"),
            &["C-040"],
            at::END,
            "The payload of an end has nothing in it.",
            |p| p.clear(),
        ),
        payload(
            (2001, "end-size-before-count"),
            &["C-040", "C-112"],
            at::END,
            "An end is too long and counts wrong: the size is checked first.",
            |p| {
                p[0] += 1;
                p.push(0);
            },
        ),
    ]);
    // The open frame begins with a group, with a transforms record, with a points record.
    let usual = Plan::usual;
    for (name, count, comment) in [
        (
            "end-after-group",
            at::POINTS,
            "The end comes after a group without a commit.",
        ),
        (
            "end-after-transforms",
            at::COMMIT,
            "The end comes after transforms without a commit.",
        ),
        (
            "end-after-points",
            at::SECOND_TRANSFORMS,
            "The end comes after points without a commit.",
        ),
    ] {
        drafts.push(refused(
            (4006, name),
            &["C-100", "C-044"],
            count,
            comment,
            usual().up_to(count),
        ));
    }
    let open = usual().up_to(at::POINTS);
    let (offset, bytes) = open.clone().with_payload(at::POINTS, |p| p[0] += 1);
    drafts.push(Draft::invalid(
        AREA,
        (4006, "open-before-count"),
        offset,
        &["C-100", "C-112"],
        "A frame is open at the end, and the count is wrong: the frame is checked first.",
        bytes,
    ));
    let (offset, bytes) = open.with_payload(at::POINTS, |p| p.push(0));
    drafts.push(Draft::invalid(
        AREA,
        (2001, "end-size-before-open"),
        offset,
        &["C-040", "C-112"],
        "A frame is open at the end, which is too long: the size is checked first.",
        bytes,
    ));
    // What a digest of other bytes would be: without skipped records it has to differ.
    let mut forge = usual().up_to(at::GROUP).start();
    let without = forge.end_payload();
    forge.put_with(0x7000, Pack::None, b"abc", |h| h.critical = false);
    let mut payload = 3u64.to_le_bytes().to_vec();
    payload.extend(&without[8..]);
    forge.put(kind::END, &payload);
    drafts.push(Draft::invalid(
        AREA,
        (1025, "end-digest-without-skipped"),
        forge.last() + HEADER,
        &["C-101", "C-017"],
        "The digest of the stream leaves a skipped record out.",
        forge.bytes,
    ));

    let whole = usual().bytes();
    for (name, more, comment) in [
        ("byte-after-end", vec![0], "One zero byte follows the end."),
        (
            "stream-after-end",
            empty_frame().ended(),
            "A second stream follows the end.",
        ),
    ] {
        drafts.push(Draft::invalid(
            AREA,
            (1020, name),
            whole.len(),
            &["C-102"],
            comment,
            [&whole[..], &more].concat(),
        ));
    }
}

/// Input that stops too early.
fn truncated(drafts: &mut Vec<Draft>) {
    let forge = Plan::usual().forge(at::END, |_| {});
    let (starts, bytes) = (&forge.starts, &forge.bytes);
    let cut = |name: &str, clauses: &[&'static str], comment: &str, length: usize| {
        Draft::invalid(
            AREA,
            (1019, name),
            length,
            clauses,
            comment,
            bytes[..length].to_vec(),
        )
    };
    drafts.extend([
        cut("empty", &["C-103"], "No byte at all.", 0),
        cut("one-byte", &["C-103"], "One byte of the preamble.", 1),
        cut(
            "preamble-cut",
            &["C-103"],
            "The preamble lacks its last byte.",
            15,
        ),
        cut(
            "preamble-alone",
            &["C-103"],
            "Nothing follows the preamble.",
            16,
        ),
        cut(
            "header-cut",
            &["C-103"],
            "A header lacks its last byte.",
            starts[at::COMMIT] + 31,
        ),
        cut(
            "header-alone",
            &["C-103"],
            "A payload is missing.",
            starts[at::COMMIT] + 32,
        ),
        cut(
            "payload-cut",
            &["C-103"],
            "A payload lacks its last byte.",
            starts[at::DELTA] - 1,
        ),
        cut("no-end", &["C-103"], "The end is missing.", starts[at::END]),
        cut(
            "end-header-alone",
            &["C-103"],
            "The payload of the end is missing.",
            starts[at::END] + 32,
        ),
        cut(
            "end-cut",
            &["C-103"],
            "The end lacks its last byte.",
            bytes.len() - 1,
        ),
        cut(
            "frame-open",
            &["C-103"],
            "The input ends within a frame.",
            starts[at::COMMIT],
        ),
    ]);
    let mut wrong = bytes[..15].to_vec();
    wrong[0] = 0;
    drafts.push(Draft::invalid(
        AREA,
        (1019, "preamble-cut-before-magic"),
        15,
        &["C-103", "C-112"],
        "A preamble with another magic is a byte short: it is checked when all is there.",
        wrong,
    ));
    let (header, faulty) = Plan::usual().with_header(at::GROUP, |h| h.header_crc = 1);
    drafts.push(Draft::invalid(
        AREA,
        (1019, "header-cut-before-checksum"),
        header + 31,
        &["C-103", "C-112"],
        "A damaged header is a byte short: it is checked when all is there.",
        faulty[..header + 31].to_vec(),
    ));
    drafts.push(Draft::invalid(
        AREA,
        (1005, "header-before-payload"),
        header,
        &["C-010", "C-112"],
        "A header is damaged and its payload is missing: the header is checked before.",
        faulty[..header + 32].to_vec(),
    ));
    let (payload, faulty) = Plan::usual().with_payload(at::STREAM, |p| p[0] = 0);
    drafts.push(Draft::invalid(
        AREA,
        (1019, "payload-cut-before-fields"),
        payload + 7,
        &["C-103", "C-112"],
        "A payload with a fault is a byte short: it is checked when all is there.",
        faulty[..payload + 7].to_vec(),
    ));
    // Claims that a product of 32 bits would get wrong.
    for (name, packing, stored, unpacked, comment) in [
        (
            "lz4-ratio-in-64-bits",
            1,
            16_843_010,
            1 << 20,
            "255 times the stored length is beyond 32 bits; the claim is possible, the payload missing.",
        ),
        (
            "zstd-ratio-in-64-bits",
            2,
            131_072,
            100,
            "The most that the stored length can hold is 2^32; the claim is possible, the payload missing.",
        ),
    ] {
        let (header, claim) = Plan::usual().with_header(at::DELTA, |h| {
            (h.packing, h.stored, h.unpacked) = (packing, stored, unpacked);
        });
        drafts.push(Draft::invalid(
            AREA,
            (1019, name),
            header + HEADER,
            &["C-021", "C-103"],
            comment,
            claim[..header + HEADER].to_vec(),
        ));
    }
}

/// Live streams, which may end after any commit.
fn live(drafts: &mut Vec<Draft>) {
    let forge = Plan::usual().forge(at::END, |_| {});
    let (starts, bytes) = (&forge.starts, &forge.bytes);
    for (name, length, comment) in [
        (
            "live-after-stream",
            starts[at::TRACK],
            "A live stream ends after its stream record.",
        ),
        (
            "live-after-track",
            starts[at::GROUP],
            "A live stream ends before its first group.",
        ),
        (
            "live-after-commit",
            starts[at::DELTA],
            "A live stream ends after a commit.",
        ),
        (
            "live-after-remove",
            starts[at::THIRD_COMMIT],
            "A live stream ends while a removal waits.",
        ),
        (
            "live-after-last-commit",
            starts[at::END],
            "A live stream ends where its end would stand.",
        ),
        ("live-with-end", bytes.len(), "A live stream with an end."),
    ] {
        drafts.push(Draft::valid(AREA, name, &["C-104"], comment, bytes[..length].to_vec()).live());
    }
    let mut forge = Plan::usual().up_to(at::DELTA).start();
    forge.put_with(0x7000, Pack::None, &[1], |h| h.critical = false);
    drafts.push(
        Draft::valid(
            AREA,
            "live-after-skipped",
            &["C-104", "C-017"],
            "A live stream ends after a skipped record.",
            forge.bytes,
        )
        .live(),
    );
    let mut bad = |fault, clauses: &[&'static str], comment, length: usize| {
        let bytes = bytes[..length].to_vec();
        drafts.push(Draft::invalid(AREA, fault, length, clauses, comment, bytes).live());
    };
    let live = &["C-103", "C-104"];
    bad(
        (1019, "live-empty"),
        live,
        "A live stream without a byte.",
        0,
    );
    bad(
        (1019, "live-preamble"),
        live,
        "A live stream ends after its preamble.",
        16,
    );
    bad(
        (1019, "live-stream-cut"),
        live,
        "A live stream ends within its stream record.",
        starts[at::TRACK] - 1,
    );
    bad(
        (1019, "live-header-cut"),
        live,
        "A live stream ends within a header.",
        starts[at::DELTA] + 1,
    );
    bad(
        (1019, "live-header-alone"),
        live,
        "A live stream ends between a header and its payload.",
        starts[at::DELTA] + 32,
    );
    bad(
        (1019, "live-header-cut-in-frame"),
        live,
        "A live stream ends within a header and a frame: within a record it is truncated.",
        starts[at::SECOND_COMMIT] + 1,
    );
    bad(
        (4006, "live-after-group"),
        &["C-104", "C-044"],
        "A live stream ends after a group.",
        starts[at::POINTS],
    );
    bad(
        (4006, "live-after-points"),
        &["C-104", "C-044"],
        "A live stream ends after a points record.",
        starts[at::SECOND_TRANSFORMS],
    );
    bad(
        (4006, "live-before-commit"),
        &["C-104", "C-044"],
        "A live stream ends right before a commit.",
        starts[at::SECOND_COMMIT],
    );
}
