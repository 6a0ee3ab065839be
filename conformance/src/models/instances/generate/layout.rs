//! Head, table and sections of a record, clauses I-010 to I-018.

use super::{
    Content, Draft, Frames, Section, Table, invalid, ordered, payload, some, streams, valid,
};
use crate::models::entry::{Entry, tracks};
use crate::models::points::frames::{self, WIDTHS, filled};
use crate::models::points::writer::points;
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, kind, set_word};

type Change = fn(&mut Vec<u8>);

/// Faults of a payload of two tracks: its table ends at 40.
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
    (
        "section-beyond",
        "The size of the last section is one more than there is",
        |p| p[32] += 1,
    ),
    ("no-sections", "The payload ends with its table", |p| {
        p.truncate(40)
    }),
];

const RESERVED: &[(&str, &str, Change)] = &[
    ("delta", "The flags are 0, as those of a delta", |p| {
        p[4] = 0
    }),
    ("flag-1", "Bit 1 of the flags is set", |p| p[4] |= 2),
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
        "track-reserved-0",
        "Bit 0 of a track's reserved field is set",
        |p| p[24] = 1,
    ),
    (
        "track-reserved-31",
        "Bit 31 of the last track's reserved field is set",
        |p| p[39] = 0x80,
    ),
];

/// Two tables, both codings, and their contents.
fn two(seed: u64) -> (Frames, [Content; 2]) {
    let tables = [Table::packed(7), Table::raw(9).of_two()];
    let contents = [1, 2].map(|id| Content::new(id, some(&tables[id as usize - 1], seed)));
    (streams(&tables), contents)
}

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, cases) in [(3301, "I-013", SIZES), (3302, "I-014", RESERVED)] {
        for &(name, comment, change) in cases {
            for later in [false, true] {
                let (mut frames, contents) = two(1);
                if later {
                    frames = frames.instances(&contents).commit();
                }
                let mut payload = frames.instances_payload(&contents);
                change(&mut payload);
                let (place, words) = match later {
                    false => ("first", "the first frame"),
                    true => ("later", "a later frame"),
                };
                let name = format!("{name}-{place}");
                let comment = format!("{comment}, in {words}.");
                let refused = frames.refused_of(kind::INSTANCES, &payload);
                drafts.push(invalid((id, &name), &[clause], &comment, refused));
            }
        }
    }
    heads(drafts);
    ids(drafts);
    others(drafts);
    effect(drafts);
    limits(drafts);
    order(drafts);
}

fn heads(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two(1);
    let whole = frames.instances_payload(&contents);
    for length in [0, 4, 12, 15, 16, 28, 39] {
        let refused = frames.clone().refused_of(kind::INSTANCES, &whole[..length]);
        let comment = format!("The payload has {length} bytes, and head and table take 40.");
        let name = format!("head-of-{length}");
        drafts.push(invalid((3301, &name), &["I-013"], &comment, refused));
    }
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        let mut payload = whole.clone();
        payload.push(0);
        let refused = frames
            .clone()
            .packed(pack)
            .refused_of(kind::INSTANCES, &payload);
        let comment = "A byte follows the last section, in a record that is packed as a whole.";
        let name = format!("byte-over-{name}");
        drafts.push(invalid((3301, &name), &["I-013"], comment, refused));
    }
    let mut bare = payload(&[]);
    bare.extend([0; 4]);
    let refused = frames.refused_of(kind::INSTANCES, &bare);
    let comment = "A record of no tracks has 4 bytes more than its head.";
    let name = "no-tracks-and-four-bytes";
    drafts.push(invalid((3301, name), &["I-013"], comment, refused));
}

/// Ids that do not ascend, are not live or come twice (I-016).
fn ids(drafts: &mut Vec<Draft>) {
    let table = Table::packed(4);
    let tables = [table.clone(), table.clone(), table.clone()];
    let instances = some(&table, 1);
    let content = |id| Content::new(id, instances.clone());
    let frames = streams(&tables).instances(&[1, 2, 3].map(content)).commit();
    let of = |ids: &[u32]| {
        let sections = ids.iter().map(|&id| Section {
            id,
            ..frames.instance_sections(&[content(1)]).remove(0)
        });
        payload(&sections.collect::<Vec<_>>())
    };
    let cases: [(u16, &str, &[u32], &str); 7] = [
        (
            2004,
            "ids-descend",
            &[2, 1],
            "Track 1 stands after track 2.",
        ),
        (
            2004,
            "ids-equal",
            &[2, 2],
            "Track 2 stands twice in a record.",
        ),
        (
            2004,
            "ids-descend-later",
            &[1, 3, 2],
            "The last of three tracks is below the one before.",
        ),
        (
            2004,
            "ids-descend-to-unknown",
            &[1, 0],
            "Track 0, which is none, stands after track 1.",
        ),
        (2019, "id-unknown", &[4], "There is no track 4."),
        (2019, "id-0", &[0], "There is no track 0."),
        (
            2019,
            "id-most",
            &[1, u32::MAX],
            "There is no track 2^32 - 1.",
        ),
    ];
    for (id, name, tracks, comment) in cases {
        let refused = frames.clone().refused_of(kind::INSTANCES, &of(tracks));
        drafts.push(invalid((id, name), &["I-016"], comment, refused));
    }
    let removed = frames.clone().remove(&[2]);
    drafts.push(invalid(
        (2019, "removed-in-the-frame"),
        &["I-016", "C-081"],
        "A removed track is named in the frame that removes it.",
        removed.refused_of(kind::INSTANCES, &of(&[2])),
    ));
    let open = frames.clone().instances(&[content(2)]);
    drafts.push(invalid(
        (4010, "twice"),
        &["I-016"],
        "Two records of a frame have one track.",
        open.refused_of(kind::INSTANCES, &of(&[1, 2])),
    ));
}

/// A track 1 of `points` and a track 2 of `instances`.
fn mixed() -> (Frames, crate::models::points::writer::Part, Content) {
    let grid = frames::entry(1, WIDTHS[0]);
    let table = Table::packed(6);
    let part = filled(&grid, &[(1, 3, frames::some(&grid, 9, 2))]);
    let content = Content::new(2, some(&table, 4));
    let entries = [grid, Entry::of_table(2, table)];
    (Frames::new(&entries), part, content)
}

/// Records that name a track of another model.
fn others(drafts: &mut Vec<Draft>) {
    let (frames, mut part, content) = mixed();
    let mut section = frames.instance_sections(&[content]).remove(0);
    section.id = 1;
    let record = payload(std::slice::from_ref(&section));
    drafts.push(invalid(
        (2027, "instances-of-points"),
        &["B-017"],
        "A record of instances names a track of points.",
        frames.clone().refused_of(kind::INSTANCES, &record),
    ));
    part.id = 2;
    drafts.push(invalid(
        (2027, "points-of-instances"),
        &["B-017"],
        "A record of points names a track of instances.",
        frames.clone().refused(&points(None, &[part])),
    ));
    section.reserved = 1;
    section.size = Some(u32::MAX);
    drafts.push(ordered(
        (2027, "model-then-reserved"),
        &["B-017", "I-014"],
        "The model of a track is checked before its reserved field and its size.",
        frames.refused_of(kind::INSTANCES, &payload(&[section])),
    ));
}

/// What records leave of tracks (I-010, I-011).
fn effect(drafts: &mut Vec<Draft>) {
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        drafts.push(valid(name, clauses, comment, frames));
    };
    let (frames, first) = two(1);
    let (_, second) = two(2);
    let begun = frames.clone().instances(&first).commit();
    case(
        "replaced",
        &["I-010"],
        "A second record replaces all entries of both tables.",
        begun.clone().instances(&second).commit(),
    );
    case(
        "one-replaced",
        &["I-010"],
        "A second record replaces the entries of one table; the other keeps those that it has.",
        begun.clone().instances(&second[1..]).commit().commit(),
    );
    case(
        "empty-until-later",
        &["I-010", "I-050"],
        "A table is empty in its first frame, and the other one is not.",
        frames
            .clone()
            .instances(&first[..1])
            .commit()
            .instances(&second[1..])
            .commit(),
    );
    case(
        "emptied-by-group",
        &["C-062", "I-050"],
        "A group from keyframes leaves one table out, which is empty then.",
        begun
            .clone()
            .group()
            .instances(&second[..1])
            .commit()
            .group()
            .instances(&first)
            .commit(),
    );
    case(
        "group-on-state",
        &["I-010", "C-064"],
        "A group builds on the state, and replaces one table.",
        begun
            .clone()
            .group_on_state()
            .instances(&second[..1])
            .commit(),
    );
    case(
        "two-records",
        &["I-011"],
        "A frame has a record for each of two tables, the later id first.",
        frames
            .clone()
            .instances(&first[1..])
            .instances(&first[..1])
            .commit(),
    );
    case(
        "no-tracks",
        &["I-011", "C-046"],
        "A record of no tracks, before and beside one with tracks.",
        frames
            .clone()
            .instances(&[])
            .commit()
            .instances(&[])
            .instances(&first)
            .commit(),
    );
    case(
        "removed",
        &["C-080", "I-050"],
        "A table is removed, and the other is replaced in the same frame.",
        begun.clone().remove(&[1]).instances(&second[1..]).commit(),
    );
    let rows = crate::generate::plan::moved(2.0);
    case(
        "transform",
        &["I-010", "C-105"],
        "A table has a transform, which entries leave alone.",
        begun
            .transforms(&[(2, rows)])
            .commit()
            .instances(&second)
            .commit(),
    );
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        let name = format!("record-in-{name}");
        let comment = "The record is packed as a whole.";
        let frames = frames.clone().packed(pack).instances(&first).commit();
        case(&name, &["I-020", "I-030"], comment, frames);
    }
    let (frames, part, content) = mixed();
    case(
        "with-points",
        &["I-011"],
        "A frame has points of one track and entries of another.",
        frames
            .keyframe(std::slice::from_ref(&part))
            .instances(&[content])
            .commit(),
    );
}

/// The bytes of a frame (I-018), and a record before any group (C-087).
fn limits(drafts: &mut Vec<Draft>) {
    for (name, pack) in [
        ("plain", Pack::None),
        ("lz4", Pack::Lz4),
        ("zstd", Pack::Zstd(3)),
    ] {
        let (frames, contents) = two(1);
        let frames = frames.packed(pack);
        let first = frames.instances_payload(&contents[..1]);
        let second = frames.instances_payload(&contents[1..]);
        let both = (first.len() + second.len()) as u64;
        let taken = frames
            .clone()
            .instances(&contents[..1])
            .instances(&contents[1..]);
        let at = valid(
            &format!("frame-at-limit-{name}"),
            &["I-018", "I-011"],
            "Two records of a frame take all the bytes that a frame may.",
            taken.commit().instances(&contents[..1]).commit(),
        );
        drafts.push(at.limit("frame_bytes", both));
        let above = invalid(
            (4009, &format!("frame-above-limit-{name}")),
            &["I-018"],
            "Two records of a frame take one byte more than a frame may.",
            frames
                .instances(&contents[..1])
                .refused_of(kind::INSTANCES, &second),
        );
        drafts.push(above.limit("frame_bytes", both - 1));
    }
    let (frames, contents) = two(1);
    let mut record = frames.instances_payload(&contents);
    let limit = record.len() as u64 - 1;
    record[12] = 1;
    let draft = ordered(
        (4009, "frame-then-reserved"),
        &["I-018", "I-014"],
        "The bytes of a frame are checked before the record's fields.",
        frames.refused_of(kind::INSTANCES, &record),
    );
    drafts.push(draft.limit("frame_bytes", limit));
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(&[Entry::of_table(1, Table::raw(2))]));
    builder.put(kind::INSTANCES, &payload(&[]));
    let offset = builder.last() + HEADER;
    let bytes = builder.put(kind::COMMIT, &commit(0, 0, None)).ended();
    drafts.push(invalid(
        (4008, "instances"),
        &["C-087"],
        "A record of instances stands before the first group.",
        (offset, bytes),
    ));
}

/// Two faults: the order of the checks decides.
fn order(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two(1);
    let mut case = |id, name: &str, clauses: &[&'static str], comment: &str, change: Change| {
        let mut payload = frames.instances_payload(&contents);
        change(&mut payload);
        let refused = frames.clone().refused_of(kind::INSTANCES, &payload);
        drafts.push(ordered((id, name), clauses, comment, refused));
    };
    case(
        3301,
        "head-then-flags",
        &["I-013", "I-014"],
        "That the head is short is found before its flags.",
        |p| {
            p[4] = 0;
            p.truncate(12);
        },
    );
    case(
        3302,
        "flags-then-table",
        &["I-014", "I-013"],
        "The flags come before the size of the table.",
        |p| {
            p[4] = 0;
            set_word(p, 0, u32::MAX);
        },
    );
    case(
        3301,
        "table-then-id",
        &["I-013", "I-016"],
        "The size of the table comes before the ids in it.",
        |p| {
            set_word(p, 0, 1 << 20);
            p[16] = 9;
        },
    );
    case(
        2004,
        "ids-then-unknown",
        &["I-016"],
        "That ids do not ascend is found before that one is unknown.",
        |p| p[28] = 0,
    );
    case(
        2019,
        "id-then-reserved",
        &["I-016", "I-014"],
        "The id of a track comes before its reserved field.",
        |p| {
            p[16] = 9;
            p[24] = 2;
        },
    );
    case(
        3302,
        "reserved-then-size",
        &["I-014", "I-013"],
        "The reserved field of a track comes before the size of its section.",
        |p| {
            p[24] = 2;
            set_word(p, 20, u32::MAX);
        },
    );
    case(
        3306,
        "first-section-then-second-id",
        &["I-034", "I-016"],
        "The first section, of both sizes, comes before the second's id.",
        |p| {
            p.extend([0; 9]);
            let both = (p.len() - 40) as u32;
            set_word(p, 20, both);
            p[28] = 9;
        },
    );
}
