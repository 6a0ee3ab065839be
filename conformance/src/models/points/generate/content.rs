//! Faults in the content of a track, clauses P-020 to P-030: each in a keyframe, in a delta and in
//! a second track, which have points of 32, 24 and 16 bits; some also packed.

use super::{AREA, Draft, Place, content};
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::points::frames::{WIDTHS, entry, filled, point, some};
use crate::models::points::writer::Part;
use crate::stream_builder::Pack;
use dapple_codec::points::EMPTY;

type Change = fn(&Entry, &mut Part);

/// Clause, error, name, sentence, fault.
const FAULTS: &[(&str, u16, &str, &str, Change)] = &[
    (
        "P-020",
        3003,
        "first-bucket",
        "The only bucket listed is one beyond the last",
        |_, part| {
            part.buckets = vec![(5, vec![])];
        },
    ),
    (
        "P-020",
        3003,
        "last-bucket",
        "The last of two buckets listed is one beyond the last",
        |_, part| {
            part.buckets[1].0 = 5;
        },
    ),
    (
        "P-020",
        3003,
        "bucket-gap-wraps",
        "A bucket gap leads beyond 2^32 and, wrapped, back to bucket 0",
        |_, part| {
            part.buckets = vec![(4, vec![]), (0, vec![])];
        },
    ),
    (
        "P-020",
        3003,
        "bucket-gap-maximum",
        "The first bucket gap is 2^32 - 1",
        |_, part| {
            part.buckets = vec![(u32::MAX, vec![])];
        },
    ),
    (
        "P-020",
        3003,
        "second-bucket-gap-maximum",
        "The second bucket gap is 2^32 - 1, which would wrap to the bucket before it",
        |_, part| {
            part.buckets = vec![(1, vec![]), (1, vec![])];
        },
    ),
    (
        "P-021",
        3004,
        "first-cell",
        "The only cell listed is one beyond the last",
        |entry, part| {
            part.buckets.clear();
            part.cells = vec![(12, 0, some(entry, 0, 1))];
        },
    ),
    (
        "P-021",
        3004,
        "last-cell",
        "The last of the cells listed is one beyond the last",
        |_, part| {
            part.buckets[1].1.pop();
            part.cells[9].0 = 12;
        },
    ),
    (
        "P-021",
        3004,
        "cell-gap-wraps",
        "A cell gap leads beyond 2^32 and, wrapped, back to cell 0",
        |entry, part| {
            part.buckets.clear();
            part.cells = vec![(3, 0, some(entry, 0, 1)), (0, 0, some(entry, 1, 1))];
        },
    ),
    (
        "P-021",
        3004,
        "cell-gap-maximum",
        "The first cell gap is 2^32 - 1",
        |_, part| {
            part.buckets.clear();
            part.cells = vec![(u32::MAX, EMPTY, vec![])];
        },
    ),
    (
        "P-021",
        3004,
        "second-cell-gap-maximum",
        "The second cell gap is 2^32 - 1, which would wrap to the cell before it",
        |entry, part| {
            part.buckets.clear();
            part.cells = vec![(1, 0, some(entry, 0, 1)), (1, 0, some(entry, 1, 1))];
        },
    ),
    (
        "P-022",
        3008,
        "key-of-first-cell",
        "The key of the first cell is the number of cubes",
        |_, part| {
            part.buckets[0].1.remove(0);
            part.cells[0].1 = 24;
        },
    ),
    (
        "P-022",
        3008,
        "key-of-last-cell",
        "The key of the last cell is one below EMPTY",
        |_, part| {
            part.buckets[1].1.pop();
            part.cells[9].1 = EMPTY - 1;
        },
    ),
    (
        "P-023",
        3010,
        "first-point",
        "The first point of the first cell has all bits but the highest",
        |entry, part| {
            part.cells[0].2 = vec![(1 << (8 * entry.grid().point_bytes() - 1)) - 1];
        },
    ),
    (
        "P-023",
        3010,
        "seventh-point",
        "The seventh point of the last cell has the lowest bit alone",
        |entry, part| {
            let mut points = some(entry, 3, 6);
            points.push(1);
            part.cells[9].2 = points;
        },
    ),
    (
        "P-023",
        3010,
        "second-highest-bit",
        "A point has the second highest bit alone",
        |entry, part| {
            let mut points = some(entry, 3, 2);
            points.push(1 << (8 * entry.grid().point_bytes() - 2));
            part.cells[4].2 = points;
        },
    ),
    (
        "P-024",
        3009,
        "first-point-missing",
        "The first point of the first cell is 0 and the second is not",
        |entry, part| {
            part.cells[0].2 = vec![0, point(entry, 1)];
        },
    ),
    (
        "P-024",
        3009,
        "sixth-point-missing",
        "The sixth point of the last cell is 0 and the seventh is not",
        |entry, part| {
            part.cells[9].2 = some(entry, 2, 7);
            part.cells[9].2[5] = 0;
        },
    ),
    (
        "P-025",
        3011,
        "one-point",
        "The first cell is free and has one point",
        |entry, part| {
            part.buckets[0].1.remove(0);
            part.cells[0].1 = EMPTY;
            part.cells[0].2 = some(entry, 4, 1);
        },
    ),
    (
        "P-025",
        3011,
        "seven-points",
        "The last cell is free and has seven points",
        |entry, part| {
            part.buckets[1].1.pop();
            part.cells[9].1 = EMPTY;
            part.cells[9].2 = some(entry, 4, 7);
        },
    ),
    (
        "P-027",
        3006,
        "first-bucket",
        "The first bucket has an EMPTY entry between two others",
        |_, part| {
            part.buckets[0].1 = vec![0, EMPTY, 2];
        },
    ),
    (
        "P-027",
        3006,
        "first-entry",
        "The first entry of the last bucket is EMPTY and the second is not",
        |_, part| {
            part.buckets[1].1 = vec![EMPTY, 4];
        },
    ),
    (
        "P-027",
        3006,
        "last-entry",
        "The last entry of the last bucket comes after seven that are EMPTY",
        |_, part| {
            part.buckets[1].1 = vec![EMPTY; 8];
            part.buckets[1].1[7] = 4;
        },
    ),
    (
        "P-028",
        3005,
        "first-entry",
        "The first entry of the first bucket is the number of cells",
        |_, part| {
            part.buckets[0].1[0] = 12;
        },
    ),
    (
        "P-028",
        3005,
        "last-entry",
        "The eighth entry of the last bucket is one below EMPTY",
        |_, part| {
            part.buckets[1].1[7] = EMPTY - 1;
        },
    ),
    (
        "P-029",
        3012,
        "free-cell",
        "An entry names a cell that was never written",
        |_, part| {
            part.buckets[0].1[0] = 1;
        },
    ),
    (
        "P-029",
        3012,
        "freed-cell",
        "An entry names a cell that the record lists as free",
        |_, part| {
            part.cells.insert(2, (3, EMPTY, vec![]));
            part.buckets[0].1.push(3);
        },
    ),
    (
        "P-029",
        3012,
        "cell-of-another-bucket",
        "The eighth entry of the last bucket names a cell of the first",
        |_, part| {
            part.buckets[1].1[7] = 2;
        },
    ),
    (
        "P-029",
        3012,
        "bucket-of-no-key",
        "A bucket between the two names a cell of the first",
        |_, part| {
            part.buckets.insert(1, (3, vec![0]));
        },
    ),
    (
        "P-030",
        3007,
        "first-bucket",
        "The first bucket names a cell twice",
        |_, part| {
            part.buckets[0].1 = vec![0, 0];
        },
    ),
    (
        "P-030",
        3007,
        "first-and-last-entry",
        "The last entry of a full bucket is its first",
        |_, part| {
            part.buckets[1].1[7] = 4;
        },
    ),
];

/// Faults that also stand in packed records.
const PACKED: [&str; 3] = ["last-cell", "seventh-point", "first-and-last-entry"];

pub fn add(drafts: &mut Vec<Draft>) {
    for &(clause, id, name, comment, change) in FAULTS {
        let mut places = vec![Place::Keyframe, Place::Delta, Place::SecondTrack];
        if PACKED.contains(&name) {
            places.extend([Pack::Lz4, Pack::Zstd(3)].map(Place::Packed));
        }
        for place in places {
            let (offset, bytes) = place.with_part(change);
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
    moves(drafts);
    committed(drafts);
}

/// Cells whose old bucket still names them (P-026), at each width.
fn moves(drafts: &mut Vec<Draft>) {
    let faults: [(&str, &str, Change); 6] = [
        (
            "first-cell",
            "The first cell gets a key of another bucket; its old one, not listed, names it",
            |entry, part| {
                part.cells = vec![(0, 5, some(entry, 1, 1))];
            },
        ),
        (
            "last-cell",
            "The last cell gets a key of another bucket; its old one, not listed, names it last",
            |entry, part| {
                part.cells = vec![(11, 0, some(entry, 1, 1))];
            },
        ),
        (
            "freed",
            "A cell is freed; its bucket, not listed, names it",
            |_, part| {
                part.cells = vec![(2, EMPTY, vec![])];
            },
        ),
        (
            "among-others",
            "Of three cells that get keys of bucket 3, one is still named by its old bucket",
            |entry, part| {
                let cells = [0, 2, 4].map(|cell| (cell, 4, some(entry, cell, 1)));
                *part = filled(entry, &cells).bucket(4, &[5, 6, 7, 8, 9, 10, 11]);
            },
        ),
        (
            "new-bucket-listed",
            "A cell moves to a bucket that names it; its old one, not listed, names it, too",
            |entry, part| {
                *part = filled(entry, &[(0, 4, some(entry, 1, 1))]);
            },
        ),
        (
            "wrong-bucket-listed",
            "A cell moves, and a bucket is emptied that was not its own",
            |entry, part| {
                part.cells = vec![(0, 4, some(entry, 1, 1))];
                part.buckets = vec![(4, vec![])];
            },
        ),
    ];
    for (name, comment, change) in faults {
        for place in [Place::Delta, Place::SecondDelta] {
            let (offset, bytes) = place.with_part(|entry, part| {
                part.buckets.clear();
                change(entry, part);
            });
            let name = format!("{name}-{}", place.name());
            let comment = format!("{comment}, in {}.", place.words());
            let fault = (3013, name.as_str());
            drafts.push(Draft::invalid(
                AREA,
                fault,
                offset,
                &["P-026"],
                &comment,
                bytes,
            ));
        }
    }
    for (bits, widths) in [32, 24, 16].into_iter().zip(WIDTHS) {
        let entry = entry(7, widths);
        let frames = Frames::new(std::slice::from_ref(&entry)).keyframe(&[content(&entry)]);
        // Bucket 0 without cell 0, which moves to bucket 3; the next frame moves it back.
        let moved = filled(&entry, &[(0, 4, some(&entry, 1, 1))]).bucket(4, &[4]);
        let mut moved = Part {
            buckets: vec![(0, vec![2]), (3, vec![0])],
            ..moved
        };
        let frames = frames.commit().delta(&[moved.clone()]).commit();
        moved.buckets = vec![(0, vec![0, 2])];
        moved.cells[0].1 = 0;
        let (offset, bytes) = frames.clone().refused(&frames.payload(false, &[moved]));
        drafts.push(Draft::invalid(
            AREA,
            (3013, &format!("moved-back-{bits}-bits")),
            offset,
            &["P-026"],
            "A cell that an earlier delta moved moves back; the bucket it had in between names it.",
            bytes,
        ));
    }
}

/// Entries that name what the committed state has, or no longer has (P-029).
fn committed(drafts: &mut Vec<Draft>) {
    let entry = entry(7, WIDTHS[0]);
    let frames = Frames::new(std::slice::from_ref(&entry))
        .keyframe(&[content(&entry)])
        .commit();
    let none = Part::of(&entry);
    let mut case = |name: &str, comment: &str, frames: &Frames, keyframe: bool, part: Part| {
        let payload = frames.payload(keyframe, &[part]);
        let (offset, bytes) = frames.clone().refused(&payload);
        let fault = (3012, name);
        drafts.push(Draft::invalid(
            AREA,
            fault,
            offset,
            &["P-029", "P-015"],
            comment,
            bytes,
        ));
    };
    case(
        "committed-cell-of-another-bucket",
        "A delta lists a bucket that names a committed cell of another.",
        &frames,
        false,
        none.clone().bucket(2, &[0]),
    );
    case(
        "cell-that-a-keyframe-freed",
        "A keyframe names a cell that it does not list; the last frame had it.",
        &frames,
        true,
        none.clone().bucket(0, &[0]),
    );
    case(
        "cell-that-a-group-freed",
        "The keyframe of a new group names a cell that only the last group had.",
        &frames.clone().group(),
        true,
        none.clone().bucket(0, &[0]),
    );
    case(
        "cell-of-an-emptied-track",
        "A delta names a cell that a keyframe without content had freed.",
        &frames
            .clone()
            .keyframe(std::slice::from_ref(&none))
            .commit(),
        false,
        none.clone().bucket(0, &[0]),
    );
    case(
        "cell-of-a-track-without-content",
        "A delta names a cell of a track that the new group's first frame said nothing of.",
        &frames.clone().group().commit(),
        false,
        none.bucket(0, &[0]),
    );
}
