//! Head, table and sections of a record, clauses V-011 to V-015.

use super::{
    Draft, Section, Vertices, invalid, ordered, payload, section, some, streams, two, valid,
};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, kind, set_word};

type Change = fn(&mut Vec<u8>);

/// Faults of a payload of two tracks: its table ends at 40, the sections have 10 and 2 bytes.
const SIZES: &[(&str, &str, Change)] = &[
    ("byte-over", "A byte follows the last section", |p| {
        p.push(0)
    }),
    ("word-over", "Four bytes follow the last section", |p| {
        p.extend([0; 4])
    }),
    ("byte-short", "The last section lacks a byte", |p| {
        _ = p.pop()
    }),
    (
        "tracks-one-more",
        "The table counts a track more than there is room for",
        |p| {
            p.truncate(40);
            set_word(p, 0, 3);
        },
    ),
    ("tracks-most", "The track count is 2^32 - 1", |p| {
        set_word(p, 0, u32::MAX)
    }),
    (
        "tracks-wrap",
        "The track count is 2^30, whose entries take 0 bytes modulo 2^32",
        |p| set_word(p, 0, 1 << 30),
    ),
    (
        "section-most",
        "The size of the first section is 2^32 - 1",
        |p| set_word(p, 20, u32::MAX),
    ),
    ("section-0", "The size of the first section is 0", |p| {
        set_word(p, 20, 0)
    }),
    (
        "section-one-less",
        "The first section has a byte less than its values",
        |p| {
            set_word(p, 20, 9);
            p.remove(40);
        },
    ),
    (
        "section-one-more",
        "The first section has a byte more than its values",
        |p| {
            set_word(p, 20, 11);
            p.insert(40, 0);
        },
    ),
    (
        "section-beyond",
        "The size of the last section is one more than there is",
        |p| p[32] += 1,
    ),
    (
        "sections-shifted",
        "The first section has a byte more and the last one less",
        |p| {
            p[20] += 1;
            p[32] -= 1;
        },
    ),
    ("no-sections", "The payload ends with its table", |p| {
        p.truncate(40)
    }),
];

const RESERVED: &[(&str, &str, Change)] = &[
    ("delta", "The record is a delta", |p| p[4] = 0),
    ("flag-1", "Bit 1 of the flags is set", |p| p[4] |= 2),
    ("flag-1-alone", "The flags are 2", |p| p[4] = 2),
    ("flag-31", "Bit 31 of the flags is set", |p| p[7] |= 0x80),
    ("base-1", "The base frame is 1", |p| p[8] = 1),
    ("base-most", "The base frame is 2^32 - 1", |p| {
        set_word(p, 8, u32::MAX)
    }),
    (
        "reserved-bit-0",
        "Bit 0 of the reserved field is set",
        |p| p[12] = 1,
    ),
    (
        "reserved-bit-31",
        "Bit 31 of the reserved field is set",
        |p| p[15] = 0x80,
    ),
    (
        "table-bit-0",
        "Bit 0 of a track's reserved field is set",
        |p| p[24] = 1,
    ),
    (
        "table-bit-31",
        "Bit 31 of the last track's reserved field is set",
        |p| p[39] = 0x80,
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, cases) in [(3201, "V-011", SIZES), (3202, "V-012", RESERVED)] {
        for &(name, comment, change) in cases {
            for later in [false, true] {
                let (mut frames, contents) = two();
                if later {
                    frames = frames.vertices(&contents).commit();
                }
                let mut payload = payload(&frames.vertices_sections(&contents));
                change(&mut payload);
                let place = if later { "later" } else { "first" };
                let name = format!("{name}-{place}");
                let comment = format!("{comment}, in the {place} frame.");
                let refused = frames.refused_of(kind::VERTICES, &payload);
                drafts.push(invalid((id, &name), &[clause], &comment, refused));
            }
        }
    }
    heads(drafts);
    sections(drafts);
    ids(drafts);
    frame(drafts);
    order(drafts);
}

fn heads(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let whole = payload(&frames.vertices_sections(&contents));
    for length in [0, 4, 12, 15, 16, 28, 39] {
        let refused = frames.clone().refused_of(kind::VERTICES, &whole[..length]);
        let comment = format!("The payload has {length} bytes, and head and table take 40.");
        let name = format!("head-of-{length}");
        drafts.push(invalid((3201, &name), &["V-011"], &comment, refused));
    }
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        let mut payload = whole.clone();
        payload.push(0);
        let frames = frames.clone().packed(pack);
        let refused = frames.refused_of(kind::VERTICES, &payload);
        let comment = "A byte follows the last section, in a record that is packed as a whole.";
        let name = format!("byte-over-{name}");
        drafts.push(invalid((3201, &name), &["V-011"], comment, refused));
    }
    let frames = frames
        .vertices(&[])
        .vertices(&contents)
        .vertices(&[])
        .commit();
    drafts.push(valid(
        "records-of-no-tracks",
        &["C-046", "V-010"],
        "Records of no tracks before and after one of two.",
        &frames,
    ));
}

/// Sections of the size of another coding, of other bits, or of another number of signals.
fn sections(drafts: &mut Vec<Draft>) {
    for (name, comment, vertices, bytes) in [
        (
            "five-bits-in-bytes",
            "Raw codes of 5 bits stand in a byte each",
            Vertices::raw(7).five(),
            7,
        ),
        (
            "packed-in-five-bits",
            "Packed codes of 5 bits stand in 5 bits each",
            Vertices::packed(7).five(),
            5,
        ),
        (
            "one-signal-of-two",
            "A section of two signals has one",
            Vertices::packed(6).two(),
            6,
        ),
        (
            "two-signals-of-one",
            "A section of one signal has two",
            Vertices::raw(6),
            12,
        ),
        (
            "five-bits-rounded-up-to-4",
            "A section is padded to a multiple of four",
            Vertices::raw(7).five(),
            8,
        ),
    ] {
        let refused = section(&vertices, |section| section.bytes = vec![0; bytes]);
        let comment = format!("{comment}.");
        drafts.push(invalid((3201, name), &["V-011"], &comment, refused));
    }
}

fn ids(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let sections = frames.vertices_sections(&contents);
    let named = |first: u32, second: u32| {
        let mut sections = sections.clone();
        (sections[0].id, sections[1].id) = (first, second);
        payload(&sections)
    };
    let mut refuse = |error: (u16, &str), comment: &str, payload: &[u8]| {
        let refused = frames.clone().refused_of(kind::VERTICES, payload);
        drafts.push(invalid(error, &["V-013"], comment, refused));
    };
    refuse((2004, "ids-descend"), "The ids descend.", &named(1, 0));
    refuse(
        (2004, "ids-equal"),
        "A track comes twice in a record.",
        &named(1, 1),
    );
    refuse(
        (2019, "id-unknown"),
        "The first track is not declared.",
        &named(0, 2),
    );
    refuse(
        (2019, "id-most"),
        "The second track is not declared.",
        &named(1, u32::MAX),
    );
    let removed = frames.clone().commit().remove(&[2]);
    let refused = removed.refused_of(kind::VERTICES, &payload(&sections));
    let comment = "The second track was removed in this frame.";
    drafts.push(invalid((2019, "id-removed"), &["V-013"], comment, refused));
    let twice = frames.clone().vertices(&contents[1..]);
    let refused = twice.refused_of(kind::VERTICES, &payload(&sections));
    let comment = "The second track has come in this frame, in another record.";
    drafts.push(invalid((4010, "twice"), &["V-013"], comment, refused));
    let removal = frames.vertices(&contents);
    let refused = removal.refused_of(kind::TRACK_REMOVE, &crate::stream_builder::removal(&[1]));
    let comment = "A track with values in the open frame is removed.";
    drafts.push(invalid(
        (4010, "removed-after-content"),
        &["C-080"],
        comment,
        refused,
    ));
}

/// The limit of a frame, and records outside a group.
fn frame(drafts: &mut Vec<Draft>) {
    let vertices = Vertices::packed(100);
    let codes = vec![(1, some(&vertices, 1))];
    let frames = streams(&[vertices]);
    let bytes = payload(&frames.vertices_sections(&codes));
    let limit = bytes.len() as u64;
    for (name, pack) in [("plain", Pack::None), ("zstd", Pack::Zstd(3))] {
        let frames = frames.clone().packed(pack);
        let good = frames.clone().vertices(&codes).commit();
        let comment = "The records of a frame have as many bytes as the limit.";
        drafts.push(
            valid(
                &format!("frame-at-limit-{name}"),
                &["V-015"],
                comment,
                &good,
            )
            .limit("frame_bytes", limit),
        );
        let refused = frames.refused_of(kind::VERTICES, &bytes);
        let offset = refused.0;
        let comment = "The records of a frame have a byte more than the limit.";
        drafts.push(
            invalid(
                (4009, &format!("frame-above-limit-{name}")),
                &["V-015"],
                comment,
                (offset, refused.1),
            )
            .limit("frame_bytes", limit - 1),
        );
    }
    let entry = crate::models::entry::Entry::of_vertices(1, Vertices::raw(1));
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &crate::models::entry::tracks(&[entry]));
    let section = Section {
        id: 1,
        bytes: vec![7],
        ..Section::default()
    };
    builder.put(kind::VERTICES, &payload(&[section]));
    let refused = (builder.last() + HEADER, builder.ended());
    let comment = "A record of vertices comes before the first group.";
    drafts.push(invalid((4008, "no-group"), &["C-087"], comment, refused));
}

/// Two faults of a record; the first decides.
fn order(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let whole = payload(&frames.vertices_sections(&contents));
    let mut case = |error: (u16, &str), clauses: &[&'static str], comment: &str, change: Change| {
        let mut payload = whole.clone();
        change(&mut payload);
        let refused = frames.clone().refused_of(kind::VERTICES, &payload);
        drafts.push(ordered(error, clauses, comment, refused));
    };
    case(
        (3202, "flags-then-table"),
        &["V-012", "V-011"],
        "The flags are checked before the length of the table.",
        |p| {
            p[4] = 0;
            set_word(p, 0, 99);
        },
    );
    case(
        (3201, "table-then-id"),
        &["V-011", "V-013"],
        "The length of the table is checked before its first id.",
        |p| {
            set_word(p, 0, 99);
            set_word(p, 16, 77);
        },
    );
    case(
        (2019, "id-then-reserved"),
        &["V-013", "V-012"],
        "A track's id is checked before its reserved field.",
        |p| {
            set_word(p, 16, 0);
            p[24] = 1;
        },
    );
    case(
        (3202, "reserved-then-size"),
        &["V-012", "V-011"],
        "A track's reserved field is checked before its size.",
        |p| {
            p[24] = 1;
            p[20] = 0;
        },
    );
    case(
        (3201, "size-then-next-id"),
        &["V-011", "V-013"],
        "The section of a track is checked before the next id.",
        |p| {
            p[20] = 0;
            set_word(p, 28, 0);
        },
    );
    case(
        (3202, "section-then-byte-over"),
        &["V-021", "V-011"],
        "The bits after the last code are checked before what follows the last section.",
        |p| {
            p[41 + 10] |= 0x80;
            p.push(0);
        },
    );
}
