//! Head, table and sections of a record, clauses.

use super::{Content, Draft, Set, invalid, ordered, payload, some, streams};
use crate::generate::frames::Frames;
use crate::models::entry::tracks;
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
        "The table counts a track more than there is place for",
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
    ("flags-0", "The flags are 0", |p| p[4] = 0),
    ("flags-2", "The flags are 2", |p| p[4] = 2),
    ("flag-1", "Bit 1 of the flags is set", |p| p[4] |= 2),
    ("flag-31", "Bit 31 of the flags is set", |p| p[7] |= 0x80),
    ("base-1", "The base frame is 1", |p| p[8] = 1),
    ("base-most", "The base frame is 2^32 - 1", |p| {
        p[8..12].fill(0xff)
    }),
    ("flags-0-base-0", "A delta on frame 0", |p| p[4] = 0),
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
        "Bit 31 of a track's reserved field is set",
        |p| p[39] = 0x80,
    ),
];

/// Two tracks, both codings, and their contents.
fn two() -> (Frames, [Content; 2]) {
    let sets = [Set::packed(4), Set::raw(3)];
    let contents = [1, 2].map(|id| Content::new(id, some(&sets[id as usize - 1], 1)));
    (streams(&sets), contents)
}

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, cases) in [(3401, "R-012", SIZES), (3402, "R-013", RESERVED)] {
        for &(name, comment, change) in cases {
            for first in [true, false] {
                let (mut frames, contents) = two();
                if !first {
                    frames = frames.regions(&contents).commit();
                }
                let mut payload = frames.regions_payload(&contents);
                change(&mut payload);
                let place = if first { "first" } else { "later" };
                let name = format!("{name}-{place}");
                let comment = format!("{comment}, in the {place} frame.");
                let refused = frames.refused_of(kind::REGIONS, &payload);
                drafts.push(invalid((id, &name), &[clause], &comment, refused));
            }
        }
    }
    heads(drafts);
    ids(drafts);
    limits(drafts);
    order(drafts);
}

fn heads(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let whole = frames.regions_payload(&contents);
    for length in [0, 4, 12, 15, 16, 28, 39] {
        let refused = frames.clone().refused_of(kind::REGIONS, &whole[..length]);
        let comment = format!("The payload has {length} bytes, and head and table take 40.");
        let name = format!("head-of-{length}");
        drafts.push(invalid((3401, &name), &["R-012"], &comment, refused));
    }
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        let mut payload = whole.clone();
        payload.push(0);
        let frames = frames.clone().packed(pack);
        let refused = frames.refused_of(kind::REGIONS, &payload);
        let comment = "A byte follows the last section, in a record that is packed as a whole.";
        let name = format!("byte-over-{name}");
        drafts.push(invalid((3401, &name), &["R-012"], comment, refused));
    }
    let mut bare = frames.regions_payload(&[]);
    bare.extend([0; 4]);
    let refused = frames.refused_of(kind::REGIONS, &bare);
    let comment = "A record of no tracks has 4 bytes more than its head.";
    drafts.push(invalid(
        (3401, "no-tracks-and-four-bytes"),
        &["R-012"],
        comment,
        refused,
    ));
}

/// Ids that do not ascend, are not live or come twice.
fn ids(drafts: &mut Vec<Draft>) {
    let set = Set::packed(2);
    let sets = [set.clone(), set.clone(), set.clone()];
    let content = |id| Content::new(id, some(&set, 1));
    let frames = streams(&sets).regions(&[1, 2, 3].map(content)).commit();
    let of = |ids: &[u32]| {
        let sections = ids.iter().map(|&id| super::Section {
            id,
            ..frames.region_sections(&[content(1)]).remove(0)
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
            "id-between",
            &[1, 2, 3, 9],
            "The last of four tracks is not declared.",
        ),
    ];
    for (id, name, tracks, comment) in cases {
        let refused = frames.clone().refused_of(kind::REGIONS, &of(tracks));
        drafts.push(invalid((id, name), &["R-014"], comment, refused));
    }
    let removed = frames.clone().remove(&[2]);
    let refused = removed.refused_of(kind::REGIONS, &of(&[2]));
    let comment = "A removed track is named in the frame that removes it.";
    let error = (2019, "removed-in-the-frame");
    drafts.push(invalid(error, &["R-014", "C-081"], comment, refused));
    let removed = frames.clone().remove(&[2]).commit();
    let refused = removed.refused_of(kind::REGIONS, &of(&[2]));
    let comment = "A track is named that was removed with the last frame.";
    drafts.push(invalid(
        (2019, "removed-before"),
        &["R-014", "C-081"],
        comment,
        refused,
    ));
    let open = frames.clone().regions(&[content(2)]);
    let refused = open.refused_of(kind::REGIONS, &of(&[1, 2]));
    let comment = "Two records of a frame have one track.";
    drafts.push(invalid((4010, "twice"), &["R-014"], comment, refused));
    let open = frames.clone().regions(&[content(2)]);
    let refused = open.refused_of(kind::TRACK_REMOVE, &crate::stream_builder::removal(&[2]));
    let comment = "A track is removed that the frame has content of.";
    drafts.push(invalid(
        (4010, "removed-after"),
        &["C-080"],
        comment,
        refused,
    ));
}

/// The bytes of a frame, and a record before any group (C-087).
fn limits(drafts: &mut Vec<Draft>) {
    for (name, pack) in [("plain", Pack::None), ("zstd", Pack::Zstd(3))] {
        let (frames, contents) = two();
        let frames = frames.packed(pack);
        let first = frames.regions_payload(&contents[..1]);
        let second = frames.regions_payload(&contents[1..]);
        let both = (first.len() + second.len()) as u64;
        let taken = frames
            .clone()
            .regions(&contents[..1])
            .regions(&contents[1..]);
        let taken = taken.commit().regions(&contents[..1]).commit();
        let comment = "Two records of a frame take all the bytes that a frame may.";
        let name_at = format!("frame-at-limit-{name}");
        let at = super::valid(&name_at, &["R-015", "R-011"], comment, &taken);
        drafts.push(at.limit("frame_bytes", both));
        let refused = frames
            .regions(&contents[..1])
            .refused_of(kind::REGIONS, &second);
        let comment = "Two records of a frame take one byte more than a frame may.";
        let name = format!("frame-above-limit-{name}");
        let above = invalid((4009, &name), &["R-015"], comment, refused);
        drafts.push(above.limit("frame_bytes", both - 1));
    }
    let set = Set::packed(2);
    let payload =
        streams(std::slice::from_ref(&set)).regions_payload(&[Content::new(1, some(&set, 1))]);
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(&super::entries(&[set])));
    builder.put(kind::REGIONS, &payload);
    let offset = builder.last() + HEADER;
    builder.put(kind::COMMIT, &commit(0, 0, None));
    let comment = "A record of regions stands before the first group.";
    let refused = (offset, builder.ended());
    drafts.push(invalid(
        (4008, "before-a-group"),
        &["C-087"],
        comment,
        refused,
    ));
}

/// Name, error, sentence, clauses, change of a payload of two tracks.
type Order = (&'static str, u16, &'static str, [&'static str; 2], Change);

fn order(drafts: &mut Vec<Draft>) {
    let cases: [Order; 5] = [
        (
            "flags-then-table",
            3402,
            "The flags before the table",
            ["R-013", "R-012"],
            |p| {
                p[4] = 0;
                set_word(p, 0, u32::MAX);
            },
        ),
        (
            "table-then-ids",
            3401,
            "The table before the ids",
            ["R-012", "R-014"],
            |p| {
                set_word(p, 0, u32::MAX);
                set_word(p, 16, 99);
            },
        ),
        (
            "ids-then-reserved",
            2019,
            "An id before the reserved word",
            ["R-014", "R-013"],
            |p| {
                set_word(p, 16, 0);
                set_word(p, 24, 1);
            },
        ),
        (
            "size-then-next-id",
            3401,
            "The size of a section before the next id",
            ["R-012", "R-014"],
            |p| {
                set_word(p, 20, u32::MAX);
                set_word(p, 28, 0);
            },
        ),
        (
            "last-then-end",
            3402,
            "The reserved word of the last track before the end",
            ["R-013", "R-012"],
            |p| {
                set_word(p, 36, 1);
                p.push(0);
            },
        ),
    ];
    for (name, id, comment, clauses, change) in cases {
        let (frames, contents) = two();
        let mut payload = frames.regions_payload(&contents);
        change(&mut payload);
        let refused = frames.refused_of(kind::REGIONS, &payload);
        let comment = format!("{comment}.");
        drafts.push(ordered((id, name), &clauses, &comment, refused));
    }
}
