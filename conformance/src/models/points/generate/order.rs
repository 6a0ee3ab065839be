//! Two faults in a record: the order of checks (`spec/points.md` §5) decides which is reported.

use super::{AREA, Draft, Place, Sections, content};
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::points::frames::{WIDTHS, entry, some};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::{HEADER, Pack, commit, kind, packed, set_word};
use dapple_codec::points::EMPTY;

type Change = fn(&Entry, &mut Part);

/// Error, name, sentence, clauses in the order of their checks, faults.
const PARTS: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        3003,
        "bucket-index-then-cell-index",
        "Bucket indices come before cell indices",
        &["P-020", "P-021"],
        |_, part| {
            part.buckets[1].0 = 5;
            part.cells[9].0 = 12;
        },
    ),
    (
        3004,
        "last-cell-index-then-first-key",
        "All cell indices come before the first key",
        &["P-021", "P-022"],
        |_, part| {
            part.cells[9].0 = 12;
            part.cells[0].1 = 24;
        },
    ),
    (
        3008,
        "key-then-point-of-a-cell",
        "The key of a cell comes before its points",
        &["P-022", "P-023"],
        |_, part| {
            part.cells[3].1 = 24;
            part.cells[3].2 = vec![1];
        },
    ),
    (
        3010,
        "point-of-a-cell-then-key-of-the-next",
        "A cell comes before the next",
        &["P-023", "P-022"],
        |_, part| {
            part.cells[3].2 = vec![1];
            part.cells[4].1 = 24;
        },
    ),
    (
        3010,
        "bits-of-the-last-point-then-a-gap",
        "The bits of all points of a cell come before gaps between them",
        &["P-023", "P-024"],
        |entry, part| {
            part.cells[3].2 = some(entry, 1, 7);
            part.cells[3].2[1] = 0;
            part.cells[3].2[6] = 1;
        },
    ),
    (
        3009,
        "gap-then-free-cell",
        "Gaps between points come before those of a free cell",
        &["P-024", "P-025"],
        |entry, part| {
            part.cells[3] = (5, EMPTY, vec![0, entry.grid().point([0; 3], [0; 2], 0)]);
        },
    ),
    (
        3009,
        "gap-of-a-cell-then-bits-of-the-next",
        "A cell comes before the next",
        &["P-024", "P-023"],
        |entry, part| {
            part.cells[3].2 = vec![0, entry.grid().point([0; 3], [0; 2], 0)];
            part.cells[4].2 = vec![1];
        },
    ),
    (
        3011,
        "free-cell-then-key-of-the-next",
        "A cell comes before the next",
        &["P-025", "P-022"],
        |entry, part| {
            part.cells[3] = (5, EMPTY, some(entry, 1, 1));
            part.cells[4].1 = 24;
        },
    ),
    (
        3010,
        "last-cell-then-first-bucket",
        "All cells come before the first bucket",
        &["P-023", "P-028"],
        |_, part| {
            part.cells[9].2 = vec![1];
            part.buckets[0].1[0] = 12;
        },
    ),
    (
        3006,
        "gap-in-a-bucket-then-entry-beyond",
        "Gaps in a bucket come before its entries",
        &["P-027", "P-028"],
        |_, part| {
            part.buckets[0].1 = vec![12, EMPTY, 2];
        },
    ),
    (
        3005,
        "entry-beyond-then-gap-in-the-next-bucket",
        "A bucket comes before the next",
        &["P-028", "P-027"],
        |_, part| {
            part.buckets[0].1 = vec![12];
            part.buckets[1].1 = vec![EMPTY, 4];
        },
    ),
    (
        3005,
        "entry-beyond-then-wrong-bucket",
        "An entry comes before the next",
        &["P-028", "P-029"],
        |_, part| {
            part.buckets[0].1 = vec![12, 4];
        },
    ),
    (
        3012,
        "wrong-bucket-then-entry-beyond",
        "An entry comes before the next",
        &["P-029", "P-028"],
        |_, part| {
            part.buckets[0].1 = vec![4, 12];
        },
    ),
    (
        3012,
        "wrong-bucket-then-twice",
        "An entry comes before the next, which names the same cell",
        &["P-029", "P-030"],
        |_, part| {
            part.buckets[0].1 = vec![4, 4];
        },
    ),
    (
        3007,
        "twice-then-wrong-bucket",
        "An entry comes before the next",
        &["P-030", "P-029"],
        |_, part| {
            part.buckets[0].1 = vec![0, 0, 4];
        },
    ),
    (
        3005,
        "entry-beyond-twice",
        "An entry beyond the cells is named twice",
        &["P-028", "P-030"],
        |_, part| {
            part.buckets[0].1 = vec![12, 12];
        },
    ),
    (
        3007,
        "twice-then-gap-in-the-next-bucket",
        "A bucket comes before the next",
        &["P-030", "P-027"],
        |_, part| {
            part.buckets[0].1 = vec![2, 0, 2];
            part.buckets[1].1 = vec![EMPTY, 4];
        },
    ),
];

/// The same, where a cell has lost its bucket in a delta.
const MOVES: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        3011,
        "free-cell-then-moved",
        "The points of a free cell come before the bucket that names it",
        &["P-025", "P-026"],
        |entry, part| {
            part.cells = vec![(0, EMPTY, some(entry, 1, 1))];
        },
    ),
    (
        3013,
        "moved-then-key-of-the-next",
        "A cell that moved comes before the next",
        &["P-026", "P-022"],
        |entry, part| {
            part.cells = vec![(0, 4, some(entry, 1, 1)), (2, 24, vec![])];
        },
    ),
    (
        3008,
        "key-then-moved",
        "A cell comes before the next, which moved",
        &["P-022", "P-026"],
        |entry, part| {
            part.cells = vec![(0, 24, vec![]), (2, 4, some(entry, 1, 1))];
        },
    ),
    (
        3013,
        "moved-then-entry-of-its-bucket",
        "A cell that moved comes before the listed bucket that names it",
        &["P-026", "P-029"],
        |entry, part| {
            part.cells = vec![(0, 4, some(entry, 1, 1))];
            part.buckets = vec![(0, vec![0, 2])];
        },
    ),
    (
        3013,
        "moved-then-gap-in-its-bucket",
        "The old bucket names the cell behind an EMPTY entry",
        &["P-026", "P-027"],
        |entry, part| {
            part.cells = vec![(2, 4, some(entry, 1, 1))];
            part.buckets = vec![(0, vec![EMPTY, 2])];
        },
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for &(id, name, comment, clauses, change) in PARTS {
        for place in [Place::Keyframe, Place::SecondDelta] {
            let (offset, bytes) = place.with_part(change);
            let name = format!("{name}-{}", place.name());
            draft(drafts, (id, &name), offset, clauses, comment, bytes);
        }
    }
    for &(id, name, comment, clauses, change) in MOVES {
        let (offset, bytes) = Place::Delta.with_part(|entry, part| {
            part.buckets.clear();
            change(entry, part);
        });
        draft(drafts, (id, name), offset, clauses, comment, bytes);
    }
    tracks(drafts);
    heads(drafts);
    unpacking(drafts);
}

fn draft(
    drafts: &mut Vec<Draft>,
    (id, name): (u16, &str),
    offset: usize,
    clauses: &[&'static str],
    comment: &str,
    bytes: Vec<u8>,
) {
    let name = format!("order-{name}");
    let comment = format!("{comment}.");
    let clauses = &[clauses, &["C-112"]].concat();
    drafts.push(Draft::invalid(
        AREA,
        (id, &name),
        offset,
        clauses,
        &comment,
        bytes,
    ));
}

/// Two tracks, each with a fault: all of the first comes before the second.
fn tracks(drafts: &mut Vec<Draft>) {
    let entries = [entry(1, WIDTHS[0]), entry(2, WIDTHS[2])];
    let frames = Frames::new(&entries);
    let parts = entries.each_ref().map(content);
    let mut case = |id, name: &str, clauses, comment: &str, change: fn(&mut [Part; 2])| {
        let mut parts = parts.clone();
        change(&mut parts);
        let (offset, bytes) = frames.clone().refused(&frames.payload(true, &parts));
        draft(drafts, (id, name), offset, clauses, comment, bytes);
    };
    let comment = "The first track's buckets come before the second's indices";
    case(
        3007,
        "first-track-then-index-of-the-second",
        &["P-030", "P-020"],
        comment,
        |parts| {
            parts[0].buckets[0].1 = vec![0, 0];
            parts[1].buckets[1].0 = 5;
        },
    );
    let comment = "The first track's content comes before the second's id";
    case(
        3010,
        "first-track-then-unknown-id",
        &["P-023", "P-013"],
        comment,
        |parts| {
            parts[0].cells[0].2 = vec![1];
            parts[1].id = 3;
        },
    );
    let comment = "The first track's content comes before the order of the ids";
    case(
        3008,
        "first-track-then-order-of-ids",
        &["P-022", "P-013"],
        comment,
        |parts| {
            parts[0].cells[3].1 = 24;
            parts[1].id = 1;
        },
    );
    let comment = "The id of the second track, which is unknown, does not ascend either";
    case(
        2004,
        "order-of-ids-then-unknown-id",
        &["P-013"],
        comment,
        |parts| parts[1].id = 0,
    );
    let mut payload = frames.payload(true, &parts);
    let own = Sections::last(&parts);
    set_word(&mut payload, own.entry + 4, u32::MAX);
    let mut unknown = payload.clone();
    set_word(&mut unknown, own.entry, 3);
    let (offset, bytes) = frames.clone().refused(&unknown);
    let comment = "The id of a track comes before its sections";
    draft(
        drafts,
        (2019, "unknown-id-then-sections"),
        offset,
        &["P-013", "P-010"],
        comment,
        bytes,
    );
    let mut first = parts.clone();
    first[0].cells[0].2 = vec![1];
    let mut payload = frames.payload(true, &first);
    payload.truncate(payload.len() - 4);
    let (offset, bytes) = frames.clone().refused(&payload);
    let comment = "The first track's content comes before the size of the second's sections";
    draft(
        drafts,
        (3010, "first-track-then-size-of-the-second"),
        offset,
        &["P-023", "P-010"],
        comment,
        bytes,
    );
    let mut second = parts;
    second[1].cells[0].2 = vec![1];
    let mut payload = frames.payload(true, &second);
    payload.extend([0; 4]);
    let (offset, bytes) = frames.clone().refused(&payload);
    let comment = "The content of all tracks comes before bytes left over";
    draft(
        drafts,
        (3010, "content-then-bytes-over"),
        offset,
        &["P-023", "P-010"],
        comment,
        bytes,
    );
    let open = frames.keyframe(&[Part::of(&entries[0])]);
    let mut again = open.payload(true, &[Part::of(&entries[0])]);
    set_word(&mut again, 20, u32::MAX);
    let (offset, bytes) = open.refused(&again);
    let comment = "That a track comes twice is found before the size of its sections";
    draft(
        drafts,
        (4010, "twice-then-sections"),
        offset,
        &["P-013", "P-010"],
        comment,
        bytes,
    );
}

/// Two faults in the head, or one in the head and one after it.
fn heads(drafts: &mut Vec<Draft>) {
    let entry = entry(7, WIDTHS[2]);
    let frames = Frames::new(std::slice::from_ref(&entry))
        .keyframe(&[content(&entry)])
        .commit();
    let one = Part::of(&entry).cell(1, 3, &some(&entry, 2, 2));
    let mut case = |id, name: &str, clauses, comment: &str, change: fn(&mut Vec<u8>)| {
        let mut payload = frames.payload(false, std::slice::from_ref(&one));
        change(&mut payload);
        let (offset, bytes) = frames.clone().refused(&payload);
        draft(drafts, (id, name), offset, clauses, comment, bytes);
    };
    let comment = "That the head is short is found before its flags";
    case(3001, "head-then-flags", &["P-010", "P-011"], comment, |p| {
        p[4] = 2;
        p.truncate(12);
    });
    let comment = "The reserved field comes before the base";
    case(
        3002,
        "reserved-then-base",
        &["P-011", "P-012"],
        comment,
        |p| {
            p[12] = 1;
            p[8] = 5;
        },
    );
    let comment = "The base comes before the size of the table";
    case(4001, "base-then-table", &["P-012", "P-010"], comment, |p| {
        p[8] = 5;
        set_word(p, 0, u32::MAX);
    });
    let comment = "The base comes before the ids";
    case(
        4001,
        "base-then-unknown-id",
        &["P-012", "P-013"],
        comment,
        |p| {
            p[8] = 5;
            p[16] = 9;
        },
    );
    let comment = "The size of the table comes before the ids in it";
    case(
        3001,
        "table-then-unknown-id",
        &["P-010", "P-013"],
        comment,
        |p| {
            p[0] = 0xff;
            p[16] = 9;
        },
    );
    let comment = "The padding comes before the cell indices";
    case(
        3002,
        "padding-then-cell-index",
        &["P-011", "P-021"],
        comment,
        |p| {
            set_word(p, 28, 12);
            *p.last_mut().unwrap_or(&mut 0) = 1;
        },
    );
    let comment = "That padding is missing is found before the cell indices";
    case(
        3001,
        "padding-missing-then-cell-index",
        &["P-010", "P-021"],
        comment,
        |p| {
            set_word(p, 28, 12);
            p.truncate(p.len() - 2);
        },
    );
}

/// A record that is too much for its frame, or before any group, is not unpacked.
fn unpacking(drafts: &mut Vec<Draft>) {
    let entry = entry(7, WIDTHS[0]);
    let payload = points(None, &[content(&entry)]);
    for (name, pack, error) in [
        ("lz4", Pack::Lz4, "C-030"),
        ("zstd", Pack::Zstd(3), "C-031"),
    ] {
        let mut frames = Frames::new(std::slice::from_ref(&entry));
        // No lz4 block and no zstd frame.
        let mut stored = packed(pack, &payload);
        stored[..4].fill(0xff);
        frames
            .builder
            .put_stored(kind::POINTS, pack, payload.len(), &stored, |_| {});
        let offset = frames.builder.last() + HEADER;
        frames.builder.put(kind::COMMIT, &commit(0, 0, None));
        let name = format!("order-limit-then-{name}");
        let draft = Draft::invalid(
            AREA,
            (4009, &name),
            offset,
            &["P-014", error, "C-112"],
            "The bytes of the frame are checked before the record is unpacked.",
            frames.ended(),
        );
        drafts.push(draft.limit("frame_bytes", payload.len() as u64 - 1));
    }
}
