//! Record headers: checksum, sequence, type, version, lengths; records that are skipped.

use super::empty_frame;
use crate::generate::Draft;
use crate::generate::plan::{AREA, Plan, at, header};
use crate::stream_builder::{HEADER, Header, Pack, StreamBuilder, kind, words};

/// Faults of the fields that all record types share.
pub fn headers(drafts: &mut Vec<Draft>) {
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
            "A record's sequence is two below the expected one.",
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
                h.record_type = 0x25;
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
    let usual = Plan::usual().builder(at::END, |_| {});
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
pub fn types(drafts: &mut Vec<Draft>) {
    for number in [
        0x00, 0x08, 0x10, 0x1f, 0x25, 0x26, 0x40, 0x41, 0x42, 0x43, 0x7000, 0x7fff,
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
    let unknown = |h: &mut Header| h.record_type = 0x25;
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
pub fn lengths(drafts: &mut Vec<Draft>) {
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
        let mut builder = Plan::usual().up_to(at::GROUP).start();
        builder.put_stored(kind::COMMIT, Pack::None, stored.len(), stored, change);
        (builder.last(), builder.ended())
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
pub fn skipped(drafts: &mut Vec<Draft>) {
    // Nonsense in all fields that are not looked at.
    let with = |number: u16, places: &[usize], payload: &[u8]| {
        let mut builder = StreamBuilder::new();
        let put = |builder: &mut StreamBuilder| {
            builder.put_with(number, Pack::None, payload, |h| {
                h.critical = false;
                h.version = 255;
                h.packing = 77;
                h.unpacked = u32::MAX;
                h.payload_crc ^= 0x5555_5555;
            });
        };
        for (index, (record_type, payload)) in Plan::usual().records.iter().enumerate() {
            if places.contains(&index) {
                put(&mut builder);
            }
            builder.put(*record_type, payload);
        }
        if places.contains(&at::END) {
            put(&mut builder);
        }
        builder.ended()
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
    for number in [0x00, 0x08, 0x10, 0x1f, 0x25, 0x40, 0x7000, 0x7fff] {
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
