//! Head, table and sections of a record, clauses B-013 to B-016 and B-018.

use super::{
    Content, Draft, Frames, Place, Section, Volume, entries, faults, invalid, ordered, payload,
    some, streams,
};
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
    ("flag-1", "Bit 1 of the flags is set", |p| p[4] |= 2),
    ("flag-31", "Bit 31 of the flags is set", |p| p[7] |= 0x80),
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
    ("track-flag-1", "Bit 1 of a track's flags is set", |p| {
        p[24] |= 2
    }),
    ("track-flag-31", "Bit 31 of a track's flags is set", |p| {
        p[39] |= 0x80
    }),
    (
        "visibility-of-none",
        "The flag of visibility stands in a volume without",
        |p| p[24] |= 1,
    ),
];

/// Two volumes, both codings, and their contents.
fn two() -> (Frames, [Content; 2]) {
    let volumes = [Volume::packed([3, 2, 2]), Volume::raw([3, 1, 2])];
    let contents = [1, 2].map(|id| Content::new(id, some(&volumes[id as usize - 1], 1)));
    (streams(&volumes), contents)
}

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, cases) in [(3101, "B-013", SIZES), (3102, "B-014", RESERVED)] {
        for &(name, comment, change) in cases {
            for keyframe in [true, false] {
                let (mut frames, contents) = two();
                if !keyframe {
                    frames = frames.probes(true, &contents).commit();
                }
                let mut payload = frames.probes_payload(keyframe, &contents);
                change(&mut payload);
                let place = if keyframe { "keyframe" } else { "delta" };
                let name = format!("{name}-{place}");
                let comment = format!("{comment}, in a {place}.");
                let refused = frames.refused_of(kind::PROBES, &payload);
                drafts.push(invalid((id, &name), &[clause], &comment, refused));
            }
        }
    }
    heads(drafts);
    visibility(drafts);
    bases(drafts);
    ids(drafts);
    limits(drafts);
    order(drafts);
}

fn heads(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let whole = frames.probes_payload(true, &contents);
    for length in [0, 4, 12, 15, 16, 28, 39] {
        let refused = frames.clone().refused_of(kind::PROBES, &whole[..length]);
        let comment = format!("The payload has {length} bytes, and head and table take 40.");
        let name = format!("head-of-{length}");
        drafts.push(invalid((3101, &name), &["B-013"], &comment, refused));
    }
    for (name, base) in [("1", 1), ("most", u32::MAX)] {
        let mut payload = whole.clone();
        set_word(&mut payload, 8, base);
        let refused = frames.clone().refused_of(kind::PROBES, &payload);
        let name = format!("base-of-keyframe-{name}");
        let comment = format!("A keyframe has the base {base}.");
        drafts.push(invalid((3102, &name), &["B-014"], &comment, refused));
    }
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        let mut payload = whole.clone();
        payload.push(0);
        let frames = frames.clone().packed(pack);
        let refused = frames.refused_of(kind::PROBES, &payload);
        let comment = "A byte follows the last section, in a record that is packed as a whole.";
        drafts.push(invalid(
            (3101, &format!("byte-over-{name}")),
            &["B-013"],
            comment,
            refused,
        ));
    }
    let mut bare = frames.probes_payload(true, &[]);
    bare.extend([0; 4]);
    let refused = frames.refused_of(kind::PROBES, &bare);
    let comment = "A record of no tracks has 4 bytes more than its head.";
    drafts.push(invalid(
        (3101, "no-tracks-and-four-bytes"),
        &["B-013"],
        comment,
        refused,
    ));
}

/// A section whose flag says that a visibility block stands in it.
fn visibility(drafts: &mut Vec<Draft>) {
    let volume = Volume::raw([2, 1, 1]).seeing(4);
    // 64 bytes of visibility.
    faults(
        drafts,
        (3101, "B-013"),
        &volume,
        &[
            (
                "visibility-missing",
                "The flag of visibility stands, and the section is empty",
                |s| {
                    s.flags = Some(1);
                    s.probes.clear();
                },
            ),
            (
                "visibility-short",
                "The section is one byte shorter than its visibility",
                |s| {
                    s.visibility = Some(vec![1; 63]);
                    s.probes.clear();
                },
            ),
        ],
    );
    let raw = Volume::raw([2, 1, 1]).seeing(4);
    faults(
        drafts,
        (3101, "B-021"),
        &raw,
        &[(
            "visibility-alone",
            "The section has a visibility block, and no bitmaps",
            |s| {
                s.visibility = Some(vec![1; 64]);
                s.probes.clear();
            },
        )],
    );
}

/// Deltas on another frame than the last (B-015).
fn bases(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let frames = frames.probes(true, &contents).commit();
    let frames = frames.probes(false, &[]).commit().commit();
    let record = |frames: &Frames, base| {
        let sections = frames.sections(false, &contents[..1]);
        frames
            .clone()
            .refused_of(kind::PROBES, &payload(Some(base), &sections))
    };
    for (name, base, comment) in [
        (
            "last-frame-but-one",
            1,
            "The base is the last frame but one.",
        ),
        (
            "first-frame",
            0,
            "The base is frame 0 and the last is frame 2.",
        ),
        (
            "own-frame",
            3,
            "The base is the frame that the record is in.",
        ),
        ("most", u32::MAX, "The base is 2^32 - 1."),
        (
            "bit-16",
            0x1_0002,
            "The base agrees with the last frame in its low 16 bits.",
        ),
    ] {
        drafts.push(invalid(
            (4001, name),
            &["B-015"],
            comment,
            record(&frames, base),
        ));
    }
    let group = frames.clone().group();
    let comment = "A group that starts from keyframes begins with a delta on the last frame.";
    drafts.push(invalid(
        (4001, "first-of-a-group"),
        &["B-015"],
        comment,
        record(&group, 2),
    ));
    let keyed = group.probes(true, &contents[1..]);
    let comment = "A delta stands after a keyframe in the first frame of a group.";
    drafts.push(invalid(
        (4001, "after-a-keyframe"),
        &["B-015"],
        comment,
        record(&keyed, 2),
    ));
    let unstarted = two().0;
    let comment = "The first frame of the stream is a delta on frame 0.";
    drafts.push(invalid(
        (4001, "no-frame"),
        &["B-015"],
        comment,
        record(&unstarted, 0),
    ));
    let refused = frames.refused_of(kind::PROBES, &payload(Some(1), &[]));
    let comment = "A delta of no tracks has the last frame but one as its base.";
    drafts.push(invalid((4001, "no-tracks"), &["B-015"], comment, refused));
}

/// Ids that do not ascend, are not live or come twice (B-016).
fn ids(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([2, 2, 1]);
    let volumes = [volume.clone(), volume.clone(), volume.clone()];
    let probes = some(&volume, 1);
    let content = |id| Content::new(id, probes.clone());
    let frames = streams(&volumes)
        .probes(true, &[1, 2, 3].map(content))
        .commit();
    let of = |ids: &[u32], keyframe: bool| {
        let sections = ids.iter().map(|&id| Section {
            id,
            ..frames.sections(keyframe, &[content(1)]).remove(0)
        });
        payload((!keyframe).then_some(0), &sections.collect::<Vec<_>>())
    };
    let cases: [(u16, &str, &[u32], &str); 8] = [
        (2004, "ids-descend", &[2, 1], "Track 1 stands after track 2"),
        (
            2004,
            "ids-equal",
            &[2, 2],
            "Track 2 stands twice in a record",
        ),
        (
            2004,
            "ids-descend-later",
            &[1, 3, 2],
            "The last of three tracks is below the one before",
        ),
        (
            2004,
            "ids-descend-to-unknown",
            &[1, 0],
            "Track 0, which is none, stands after track 1",
        ),
        (2019, "id-unknown", &[4], "There is no track 4"),
        (2019, "id-0", &[0], "There is no track 0"),
        (
            2019,
            "id-most",
            &[1, u32::MAX],
            "There is no track 2^32 - 1",
        ),
        (
            2019,
            "id-between",
            &[1, 2, 3, 9],
            "The last of four tracks is not declared",
        ),
    ];
    for (id, name, tracks, comment) in cases {
        for keyframe in [true, false] {
            let place = if keyframe { "keyframe" } else { "delta" };
            let refused = frames
                .clone()
                .refused_of(kind::PROBES, &of(tracks, keyframe));
            let (name, comment) = (
                format!("{name}-{place}"),
                format!("{comment}, in a {place}."),
            );
            drafts.push(invalid((id, &name), &["B-016"], &comment, refused));
        }
    }
    let removed = frames.clone().remove(&[2]);
    let refused = removed.refused_of(kind::PROBES, &of(&[2], true));
    let comment = "A removed track is named in the frame that removes it.";
    drafts.push(invalid(
        (2019, "removed-in-the-frame"),
        &["B-016", "C-081"],
        comment,
        refused,
    ));
    let removed = frames.clone().remove(&[2]).commit();
    let sections = [Section {
        id: 2,
        ..removed.sections(false, &[content(1)]).remove(0)
    }];
    let refused = removed.refused_of(kind::PROBES, &payload(Some(1), &sections));
    let comment = "A track is named that was removed with the last frame.";
    drafts.push(invalid(
        (2019, "removed-before"),
        &["B-016", "C-081"],
        comment,
        refused,
    ));
    for (name, first, second, comment) in [
        (
            "keyframe-then-delta",
            true,
            false,
            "A keyframe and a delta of a frame have one track.",
        ),
        (
            "delta-then-keyframe",
            false,
            true,
            "A delta and a keyframe of a frame have one track.",
        ),
        (
            "two-keyframes",
            true,
            true,
            "Two keyframes of a frame have one track.",
        ),
        (
            "two-deltas",
            false,
            false,
            "Two deltas of a frame have one track.",
        ),
    ] {
        let open = frames.clone().probes(first, &[content(2)]);
        let refused = open.refused_of(kind::PROBES, &of(&[1, 2], second));
        let name = format!("twice-{name}");
        drafts.push(invalid((4010, &name), &["B-016"], comment, refused));
    }
}

/// The bytes of a frame (B-018), and a record before any group (C-087).
fn limits(drafts: &mut Vec<Draft>) {
    for (name, pack) in [
        ("plain", Pack::None),
        ("lz4", Pack::Lz4),
        ("zstd", Pack::Zstd(3)),
    ] {
        let (frames, contents) = two();
        let frames = frames.packed(pack);
        let first = frames.probes_payload(true, &contents[..1]);
        let second = frames.probes_payload(true, &contents[1..]);
        let both = (first.len() + second.len()) as u64;
        let taken = frames
            .clone()
            .probes(true, &contents[..1])
            .probes(true, &contents[1..]);
        let taken = taken.commit().probes(true, &contents[..1]).commit();
        let comment = "Two records of a frame take all the bytes that a frame may.";
        let at = super::valid(
            &format!("frame-at-limit-{name}"),
            &["B-018", "B-012"],
            comment,
            taken,
        );
        drafts.push(at.limit("frame_bytes", both));
        let refused = frames
            .probes(true, &contents[..1])
            .refused_of(kind::PROBES, &second);
        let comment = "Two records of a frame take one byte more than a frame may.";
        let above = invalid(
            (4009, &format!("frame-above-limit-{name}")),
            &["B-018"],
            comment,
            refused,
        );
        drafts.push(above.limit("frame_bytes", both - 1));
    }
    let (frames, contents) = two();
    let mut record = frames.probes_payload(true, &contents);
    let limit = record.len() as u64 - 1;
    record[12] = 1;
    let refused = frames.refused_of(kind::PROBES, &record);
    let comment = "The bytes of a frame are checked before the record's fields.";
    let draft = ordered(
        (4009, "frame-then-reserved"),
        &["B-018", "B-014"],
        comment,
        refused,
    );
    drafts.push(draft.limit("frame_bytes", limit));
    let volumes = [Volume::packed([3, 2, 2]), Volume::raw([3, 1, 2])];
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(&entries(&volumes)));
    builder.put(kind::PROBES, &payload(None, &[]));
    let offset = builder.last() + HEADER;
    let bytes = builder.put(kind::COMMIT, &commit(0, 0, None)).ended();
    let comment = "A record of probes stands before the first group.";
    drafts.push(invalid(
        (4008, "probes"),
        &["C-087"],
        comment,
        (offset, bytes),
    ));
}

/// Two faults: the order of the checks decides.
fn order(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let frames = frames.probes(true, &contents).commit();
    let mut case = |id, name: &str, clauses: &[&'static str], comment: &str, change: Change| {
        let mut payload = frames.probes_payload(false, &contents);
        change(&mut payload);
        let refused = frames.clone().refused_of(kind::PROBES, &payload);
        drafts.push(ordered((id, name), clauses, comment, refused));
    };
    case(
        3101,
        "head-then-flags",
        &["B-013", "B-014"],
        "That the head is short is found before its flags.",
        |p| {
            p[4] = 2;
            p.truncate(12);
        },
    );
    case(
        3102,
        "reserved-then-base",
        &["B-014", "B-015"],
        "The reserved field comes before the base.",
        |p| {
            p[12] = 1;
            p[8] = 5;
        },
    );
    case(
        4001,
        "base-then-table",
        &["B-015", "B-013"],
        "The base comes before the size of the table.",
        |p| {
            p[8] = 5;
            set_word(p, 0, u32::MAX);
        },
    );
    case(
        3101,
        "table-then-id",
        &["B-013", "B-016"],
        "The size of the table comes before the ids in it.",
        |p| {
            set_word(p, 0, 1 << 20);
            p[16] = 9;
        },
    );
    case(
        2004,
        "ids-then-unknown",
        &["B-016"],
        "That ids do not ascend is found before that one is unknown.",
        |p| {
            p[28] = 0;
        },
    );
    case(
        2019,
        "id-then-flags",
        &["B-016", "B-014"],
        "The id of a track comes before its flags.",
        |p| {
            p[16] = 9;
            p[24] = 2;
        },
    );
    case(
        3102,
        "flags-then-size",
        &["B-014", "B-013"],
        "The flags of a track come before the size of its section.",
        |p| {
            p[24] = 2;
            set_word(p, 20, u32::MAX);
        },
    );
    case(
        3102,
        "flag-of-none-then-size",
        &["B-014", "B-013"],
        "The flag of visibility in a volume without comes before the size of its section.",
        |p| {
            p[36] = 1;
            set_word(p, 32, u32::MAX);
        },
    );
    case(
        3102,
        "first-track-then-second-id",
        &["B-014", "B-016"],
        "All of the first track comes before the second's id.",
        |p| {
            p[24] = 2;
            p[28] = 9;
        },
    );
    case(
        3105,
        "first-section-then-second-id",
        &["B-034", "B-016"],
        "The first section, of both sizes, comes before the second's id.",
        |p| {
            p.extend([0; 9]);
            let both = (p.len() - 40) as u32;
            set_word(p, 20, both);
            p[28] = 9;
        },
    );
    let volume = Volume::packed([2, 2, 1]);
    let mut bad = some(&volume, 1);
    bad[1] = super::Probe::new(1, &[10240 / 16]);
    let (frames, _, _) = Place::Keyframe.stream(&volume);
    let mut payload = frames.probes_payload(true, &[Content::new(1, bad)]);
    payload.push(0);
    let refused = frames.refused_of(kind::PROBES, &payload);
    let comment = "A code out of range is found before bytes that no section has.";
    drafts.push(ordered(
        (3104, "code-then-bytes-left"),
        &["B-042", "B-013"],
        comment,
        refused,
    ));
}
