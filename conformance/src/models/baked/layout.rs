//! Head, table and sections of a record: sizes, fields that must be 0, ids, and the order of the checks.

use super::{Baked, Drafts, REMOVAL, streams};
use crate::generate::Draft;
use crate::models::entry::tracks;
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, kind, removal, set_word};

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
        "The table counts a track more than there are bytes for",
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
        "track-reserved-bit-0",
        "Bit 0 of a track's reserved field is set",
        |p| p[24] = 1,
    ),
    (
        "track-reserved-bit-31",
        "Bit 31 of the last track's reserved field is set",
        |p| p[39] = 0x80,
    ),
];

pub(super) fn add<M: Baked>(drafts: &mut Vec<Draft>) {
    let mut drafts = Drafts::<M>::of(drafts);
    fields(&mut drafts);
    heads(&mut drafts);
    ids(&mut drafts);
    limits(&mut drafts);
    order(&mut drafts);
}

fn fields<M: Baked>(drafts: &mut Drafts<'_, M>) {
    for ((id, clause), cases) in [(M::SIZE, SIZES), (M::RESERVED, RESERVED)] {
        for &(name, comment, change) in cases {
            for later in [false, true] {
                let mut frames = streams::<M>(2);
                if later {
                    frames = M::put(frames, &[1, 2], 1).commit();
                }
                let mut payload = M::payload(&frames, &[1, 2], 1);
                change(&mut payload);
                let (place, words) = match later {
                    false => ("first", "the first frame"),
                    true => ("later", "a later frame"),
                };
                let name = format!("{name}-{place}");
                let comment = format!("{comment}, in {words}.");
                drafts.refused((id, &name), &[clause], &comment, frames, &payload);
            }
        }
    }
}

fn heads<M: Baked>(drafts: &mut Drafts<'_, M>) {
    let (id, clause) = M::SIZE;
    let frames = streams::<M>(2);
    let whole = M::payload(&frames, &[1, 2], 1);
    for length in [0, 4, 12, 15, 16, 28, 39] {
        let comment = format!("The payload has {length} bytes, and head and table take 40.");
        let name = format!("head-of-{length}");
        let payload = &whole[..length];
        drafts.refused((id, &name), &[clause], &comment, frames.clone(), payload);
    }
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        let mut payload = whole.clone();
        payload.push(0);
        let frames = frames.clone().packed(pack);
        let comment = "A byte follows the last section, in a record that is packed as a whole.";
        let name = format!("byte-over-{name}");
        drafts.refused((id, &name), &[clause], comment, frames, &payload);
    }
    let mut bare = M::payload(&frames, &[], 1);
    bare.extend([0; 4]);
    let comment = "A record of no tracks has 4 bytes more than its head.";
    let name = "no-tracks-and-four-bytes";
    drafts.refused((id, name), &[clause], comment, frames, &bare);
}

/// Ids that do not ascend, are not live or come twice.
fn ids<M: Baked>(drafts: &mut Drafts<'_, M>) {
    let frames = M::put(streams::<M>(3), &[1, 2, 3], 1).commit();
    // Sections of these tracks; of track 1 under ids that are none.
    let of = |ids: &[u32]| {
        let own = ids
            .iter()
            .map(|&id| if (1..=3).contains(&id) { id } else { 1 });
        let mut payload = M::payload(&frames, &own.collect::<Vec<_>>(), 1);
        for (index, &id) in ids.iter().enumerate() {
            set_word(&mut payload, 16 + 12 * index, id);
        }
        payload
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
        (
            2019,
            "id-last-unknown",
            &[1, 2, 9],
            "The last of three tracks is not declared.",
        ),
    ];
    for (id, name, tracks, comment) in cases {
        drafts.refused((id, name), &[M::IDS], comment, frames.clone(), &of(tracks));
    }
    drafts.refused(
        (2019, "removed-in-the-frame"),
        &[M::IDS, "C-081"],
        "A removed track is named in the frame that removes it.",
        frames.clone().remove(&[1]),
        &of(&[1]),
    );
    drafts.refused(
        (2019, "removed-before"),
        &[M::IDS, "C-081"],
        "A track is named that was removed with the last frame.",
        frames.clone().remove(&[1]).commit(),
        &of(&[1]),
    );
    drafts.refused(
        (4010, "twice"),
        &[M::IDS],
        "Two records of a frame have one track.",
        M::put(frames.clone(), &[2], 1),
        &of(&[1, 2]),
    );
    let open = M::put(frames.clone(), &[2], 1);
    drafts.invalid(
        (4010, "removed-after"),
        &["C-080"],
        "A track is removed that the frame has content of.",
        open.refused_of(REMOVAL, &removal(&[2])),
    );
}

/// The bytes of a frame, and a record before any group.
fn limits<M: Baked>(drafts: &mut Drafts<'_, M>) {
    for (name, pack) in [
        ("plain", Pack::None),
        ("lz4", Pack::Lz4),
        ("zstd", Pack::Zstd(3)),
    ] {
        let frames = streams::<M>(3).packed(pack);
        let lengths = [1, 2, 3].map(|id| M::payload(&frames, &[id], 1).len() as u64);
        let all: u64 = lengths.iter().sum();
        let last = M::payload(&frames, &[3], 1);
        let open = M::put(M::put(frames, &[1], 1), &[2], 1);
        drafts.valid(
            &format!("frame-at-limit-{name}"),
            &[M::FRAME_BYTES, M::SEVERAL],
            "Three records of a frame take all the bytes that a frame may.",
            M::put(M::put(open.clone(), &[3], 1).commit(), &[1], 1).commit(),
        );
        drafts.limit("frame_bytes", all);
        drafts.refused(
            (4009, &format!("frame-above-limit-{name}")),
            &[M::FRAME_BYTES],
            "Three records of a frame take one byte more than a frame may.",
            open,
            &last,
        );
        drafts.limit("frame_bytes", all - 1);
    }
    let frames = streams::<M>(2);
    let mut record = M::payload(&frames, &[1, 2], 1);
    let limit = record.len() as u64 - 1;
    record[12] = 1;
    drafts.refused(
        (4009, "order-frame-then-reserved"),
        &[M::FRAME_BYTES, M::RESERVED.1, "C-112"],
        "The bytes of a frame are checked before the record's fields.",
        frames.clone(),
        &record,
    );
    drafts.limit("frame_bytes", limit);
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(&[M::entry(1)]));
    builder.put(M::RECORD, &M::payload(&frames, &[1], 1));
    let offset = builder.last() + HEADER;
    let bytes = builder.put(kind::COMMIT, &commit(0, 0, None)).ended();
    drafts.invalid(
        (4008, "no-group"),
        &["C-087"],
        "A record stands before the first group.",
        (offset, bytes),
    );
}

/// Two faults: the order of the checks decides.
fn order<M: Baked>(drafts: &mut Drafts<'_, M>) {
    let (size, size_clause) = M::SIZE;
    let (reserved, reserved_clause) = M::RESERVED;
    let frames = streams::<M>(2);
    let whole = M::payload(&frames, &[1, 2], 1);
    let mut case = |id, name: &str, clauses: &[&'static str], comment: &str, change: Change| {
        let mut payload = whole.clone();
        change(&mut payload);
        let name = format!("order-{name}");
        let clauses = [clauses, &["C-112"]].concat();
        drafts.refused((id, &name), &clauses, comment, frames.clone(), &payload);
    };
    case(
        size,
        "head-then-flags",
        &[size_clause, reserved_clause],
        "That the head is short is found before its flags.",
        |p| {
            p[4] = 0;
            p.truncate(12);
        },
    );
    case(
        reserved,
        "flags-then-table",
        &[reserved_clause, size_clause],
        "The flags come before the size of the table.",
        |p| {
            p[4] = 0;
            set_word(p, 0, u32::MAX);
        },
    );
    case(
        size,
        "table-then-id",
        &[size_clause, M::IDS],
        "The size of the table comes before the ids in it.",
        |p| {
            set_word(p, 0, 1 << 20);
            p[16] = 9;
        },
    );
    case(
        2004,
        "ids-then-unknown",
        &[M::IDS],
        "That ids do not ascend is found before that one is unknown.",
        |p| p[28] = 0,
    );
    case(
        2019,
        "id-then-reserved",
        &[M::IDS, reserved_clause],
        "The id of a track comes before its reserved field.",
        |p| {
            p[16] = 9;
            p[24] = 2;
        },
    );
    case(
        reserved,
        "reserved-then-size",
        &[reserved_clause, size_clause],
        "The reserved field of a track comes before the size of its section.",
        |p| {
            p[24] = 2;
            set_word(p, 20, u32::MAX);
        },
    );
    case(
        size,
        "size-then-next-id",
        &[size_clause, M::IDS],
        "The size of a section comes before the next id.",
        |p| {
            set_word(p, 20, u32::MAX);
            set_word(p, 28, 0);
        },
    );
    case(
        reserved,
        "last-then-end",
        &[reserved_clause, size_clause],
        "The reserved field of the last track comes before the end of the payload.",
        |p| {
            set_word(p, 36, 1);
            p.push(0);
        },
    );
}
