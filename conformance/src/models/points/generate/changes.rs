//! What keyframes, deltas and groups make of what was there.

use super::{AREA, Draft, content};
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::points::frames::{WIDTHS, entry, filled, some};
use crate::models::points::writer::Part;
use crate::stream_builder::IDENTITY;
use dapple_codec::points::EMPTY;

/// Name, clauses, sentence, the frames after a keyframe with [`content`] in track 7.
type Case = (
    &'static str,
    &'static [&'static str],
    &'static str,
    fn(Frames, &Entry) -> Frames,
);

const ONE_TRACK: &[Case] = &[
    (
        "no-tracks-keyframe",
        &["P-015", "C-046"],
        "A keyframe of no tracks leaves all as it is.",
        |frames, _| frames.keyframe(&[]).commit(),
    ),
    (
        "no-tracks-delta",
        &["P-016", "C-046"],
        "A delta of no tracks leaves all as it is.",
        |frames, _| frames.delta(&[]).commit(),
    ),
    (
        "no-record",
        &["P-016"],
        "A frame without a record leaves all as it is.",
        |frames, _| frames.commit(),
    ),
    (
        "empty-keyframe",
        &["P-015"],
        "A keyframe without buckets and cells empties its track.",
        |frames, entry| frames.keyframe(&[Part::of(entry)]).commit(),
    ),
    (
        "empty-delta",
        &["P-016"],
        "A delta without buckets and cells leaves its track as it is.",
        |frames, entry| frames.delta(&[Part::of(entry)]).commit(),
    ),
    (
        "keyframe-empties-buckets",
        &["P-015"],
        "Buckets that a keyframe does not list are empty.",
        |frames, entry| {
            frames
                .keyframe(&[filled(entry, &[(0, 0, some(entry, 50, 2))])])
                .commit()
        },
    ),
    (
        "keyframe-frees-cells",
        &["P-015", "P-026"],
        "A cell that a keyframe freed gets another key without leave of its old bucket.",
        |frames, entry| {
            let first = filled(entry, &[(0, 0, some(entry, 50, 2))]);
            let next = filled(
                entry,
                &[(2, 1, some(entry, 51, 1)), (11, 8, some(entry, 52, 3))],
            );
            frames.keyframe(&[first]).commit().delta(&[next]).commit()
        },
    ),
    (
        "keyframe-of-cells-alone",
        &["P-015", "P-018"],
        "A keyframe of cells alone shows nothing, until a delta lists their bucket.",
        |frames, entry| {
            let mut cells = filled(
                entry,
                &[(3, 5, some(entry, 60, 2)), (9, 0, some(entry, 61, 1))],
            );
            let buckets = std::mem::take(&mut cells.buckets);
            let naming = Part {
                buckets,
                ..Part::of(entry)
            };
            frames.keyframe(&[cells]).commit().delta(&[naming]).commit()
        },
    ),
    (
        "keyframe-again",
        &["P-015"],
        "The same keyframe again.",
        |frames, entry| frames.keyframe(&[content(entry)]).commit(),
    ),
    (
        "cells-elsewhere",
        &["P-015", "P-031"],
        "A keyframe has the same content in other cells: digest and dump stay.",
        |frames, entry| {
            let mut part = content(entry);
            let mut cells: Vec<_> = part
                .cells
                .iter()
                .map(|cell| (11 - cell.0, cell.1, cell.2.clone()))
                .collect();
            cells.reverse();
            part.cells = cells;
            for (_, entries) in &mut part.buckets {
                entries.iter_mut().for_each(|entry| *entry = 11 - *entry);
            }
            frames.keyframe(&[part]).commit()
        },
    ),
    (
        "delta-of-a-cell",
        &["P-016"],
        "A delta of one cell leaves its bucket and the other cells.",
        |frames, entry| {
            frames
                .delta(&[Part::of(entry).cell(7, 11, &some(entry, 50, 7))])
                .commit()
        },
    ),
    (
        "delta-of-a-bucket",
        &["P-016"],
        "A delta of one bucket leaves cells and the other buckets.",
        |frames, entry| {
            frames
                .delta(&[Part::of(entry).bucket(4, &[4, 6, 8])])
                .commit()
        },
    ),
    (
        "delta-replaces-whole-cells",
        &["P-016"],
        "A delta with fewer points in a cell leaves none of the others.",
        |frames, entry| {
            let full = Part::of(entry).cell(2, 6, &some(entry, 50, 7));
            let one = Part::of(entry).cell(2, 6, &some(entry, 60, 1));
            frames.delta(&[full]).commit().delta(&[one]).commit()
        },
    ),
    (
        "delta-replaces-whole-buckets",
        &["P-016"],
        "A delta with fewer entries in a bucket leaves none of the others.",
        |frames, entry| frames.delta(&[Part::of(entry).bucket(0, &[2])]).commit(),
    ),
    (
        "delta-empties-a-bucket",
        &["P-016"],
        "A delta empties a bucket and leaves its cells, which a later one names again.",
        |frames, entry| {
            let emptied = frames.delta(&[Part::of(entry).bucket(4, &[])]).commit();
            emptied
                .delta(&[Part::of(entry).bucket(4, &[11, 4])])
                .commit()
        },
    ),
    (
        "order-of-entries",
        &["P-019", "P-031"],
        "The entries of a bucket are turned about: the order shows.",
        |frames, entry| {
            frames
                .delta(&[Part::of(entry).bucket(4, &[11, 4, 10, 5, 9, 6, 8, 7])])
                .commit()
        },
    ),
    (
        "full-bucket",
        &["P-027"],
        "A bucket goes from eight entries to none and back to eight.",
        |frames, entry| {
            let none = frames.delta(&[Part::of(entry).bucket(4, &[])]).commit();
            none.delta(&[Part::of(entry).bucket(4, &[4, 5, 6, 7, 8, 9, 10, 11])])
                .commit()
        },
    ),
    (
        "first-and-last-cell",
        &["P-006", "P-016"],
        "A delta lists the first and the last cell.",
        |frames, entry| {
            let part = Part::of(entry).cell(0, 0, &some(entry, 50, 1));
            frames
                .delta(&[part.cell(11, 21, &some(entry, 51, 1))])
                .commit()
        },
    ),
    (
        "first-and-last-bucket",
        &["P-006", "P-016"],
        "A delta lists the first and the last bucket.",
        |frames, entry| {
            frames
                .delta(&[Part::of(entry).bucket(0, &[2, 0]).bucket(4, &[4])])
                .commit()
        },
    ),
    (
        "every-gap",
        &["P-006"],
        "Buckets and cells with gaps of 0, 1 and 2.",
        |frames, entry| {
            let cells = [(1, 7), (2, 9), (4, 9), (7, 13), (8, 13)]
                .map(|(cell, key)| (cell, key, some(entry, cell, 1)));
            let mut part = filled(entry, &cells);
            part.buckets.insert(0, (0, vec![]));
            part.buckets.sort_by_key(|bucket| bucket.0);
            part.buckets.dedup_by_key(|bucket| bucket.0);
            frames.keyframe(&[part]).commit()
        },
    ),
    (
        "new-cell",
        &["P-016"],
        "A delta writes a free cell and names it.",
        |frames, entry| {
            let part = Part::of(entry).cell(1, 6, &some(entry, 50, 3));
            frames.delta(&[part.bucket(0, &[0, 2, 1])]).commit()
        },
    ),
    (
        "cell-between-names",
        &["P-018"],
        "A delta writes a cell that no bucket names; the next names it.",
        |frames, entry| {
            let written = frames.delta(&[Part::of(entry).cell(3, 7, &some(entry, 50, 3))]);
            written
                .commit()
                .delta(&[Part::of(entry).bucket(1, &[3])])
                .commit()
        },
    ),
    (
        "unnamed-cell-keeps",
        &["P-018"],
        "A cell that no bucket names for two frames comes back as it was.",
        |frames, entry| {
            let gone = frames.delta(&[Part::of(entry).bucket(0, &[2])]).commit();
            let gone = gone
                .delta(&[Part::of(entry).cell(4, 5, &some(entry, 50, 1))])
                .commit();
            gone.delta(&[Part::of(entry).bucket(0, &[2, 0])]).commit()
        },
    ),
    (
        "unnamed-cells-are-not-in-the-digest",
        &["P-018", "P-031"],
        "A cell that no bucket names changes nothing, nor the digest.",
        |frames, entry| {
            frames
                .delta(&[Part::of(entry).cell(3, 7, &some(entry, 50, 3))])
                .commit()
        },
    ),
    (
        "unnamed-cell-takes-any-key",
        &["P-026", "P-018"],
        "A cell that no bucket names goes from key to key.",
        |frames, entry| {
            let frames = frames
                .delta(&[Part::of(entry).cell(3, 7, &some(entry, 50, 3))])
                .commit();
            let frames = frames
                .delta(&[Part::of(entry).cell(3, 4, &some(entry, 51, 2))])
                .commit();
            frames.delta(&[Part::of(entry).bucket(3, &[3])]).commit()
        },
    ),
    (
        "cell-freed",
        &["P-025", "P-026"],
        "A cell is freed, and its bucket listed without it.",
        |frames, entry| {
            frames
                .delta(&[Part::of(entry).cell(0, EMPTY, &[]).bucket(0, &[2])])
                .commit()
        },
    ),
    (
        "cell-freed-and-used-again",
        &["P-026"],
        "A cell is freed and, a frame later, of another key.",
        |frames, entry| {
            let freed = frames.delta(&[Part::of(entry).cell(0, EMPTY, &[]).bucket(0, &[2])]);
            let again = Part::of(entry).cell(0, 9, &some(entry, 50, 2));
            freed
                .commit()
                .delta(&[again.bucket(entry.grid().bucket(9), &[0])])
                .commit()
        },
    ),
    (
        "cell-freed-in-two-frames",
        &["P-018", "P-025"],
        "A bucket lets a cell go, and the next frame frees it.",
        |frames, entry| {
            let gone = frames.delta(&[Part::of(entry).bucket(0, &[2])]).commit();
            gone.delta(&[Part::of(entry).cell(0, EMPTY, &[])]).commit()
        },
    ),
    (
        "free-cell-freed",
        &["P-025"],
        "A cell that is free is freed, in a keyframe and in a delta.",
        |frames, entry| {
            let part = content(entry);
            let mut keyframe = part.clone();
            keyframe.cells.insert(1, (1, EMPTY, vec![]));
            frames
                .keyframe(&[keyframe])
                .commit()
                .delta(&[Part::of(entry).cell(1, EMPTY, &[])])
                .commit()
        },
    ),
    (
        "cell-moved",
        &["P-026"],
        "A cell moves to another bucket; both are listed.",
        |frames, entry| {
            let part = Part::of(entry).cell(0, 4, &some(entry, 50, 2));
            frames
                .delta(&[part.bucket(0, &[2]).bucket(3, &[0])])
                .commit()
        },
    ),
    (
        "cell-moved-unnamed",
        &["P-026", "P-018"],
        "A cell gets a key of another bucket, which names it a frame later.",
        |frames, entry| {
            let part = Part::of(entry)
                .cell(0, 4, &some(entry, 50, 2))
                .bucket(0, &[2]);
            frames
                .delta(&[part])
                .commit()
                .delta(&[Part::of(entry).bucket(3, &[0])])
                .commit()
        },
    ),
    (
        "cell-moved-and-back",
        &["P-026"],
        "A cell moves to another bucket and back.",
        |frames, entry| {
            let there = Part::of(entry).cell(0, 4, &some(entry, 50, 2));
            let frames = frames
                .delta(&[there.bucket(0, &[2]).bucket(3, &[0])])
                .commit();
            let back = Part::of(entry).cell(0, 0, &some(entry, 51, 1));
            frames
                .delta(&[back.bucket(0, &[2, 0]).bucket(3, &[])])
                .commit()
        },
    ),
    (
        "cells-change-places",
        &["P-026", "P-029"],
        "Two cells of two buckets take each other's keys.",
        |frames, entry| {
            let part =
                Part::of(entry)
                    .cell(0, 5, &some(entry, 50, 1))
                    .cell(4, 0, &some(entry, 51, 2));
            frames
                .delta(&[part
                    .bucket(0, &[4, 2])
                    .bucket(4, &[0, 5, 6, 7, 8, 9, 10, 11])])
                .commit()
        },
    ),
    (
        "key-within-the-bucket",
        &["P-026"],
        "A cell gets another key of its bucket, which is not listed.",
        |frames, entry| {
            let part =
                Part::of(entry)
                    .cell(0, 6, &some(entry, 50, 1))
                    .cell(11, 5, &some(entry, 51, 7));
            frames.delta(&[part]).commit()
        },
    ),
    (
        "cell-emptied-of-points",
        &["P-024"],
        "A cell keeps its key and has no points any more.",
        |frames, entry| frames.delta(&[Part::of(entry).cell(2, 6, &[])]).commit(),
    ),
    (
        "chain-of-deltas",
        &["P-012", "P-016"],
        "Six deltas, each on the one before.",
        |mut frames, entry| {
            for i in 0..6 {
                let part = Part::of(entry).cell(
                    4 + i,
                    content(entry).cells[2 + i as usize].1,
                    &some(entry, 50 + i, i + 1),
                );
                frames = frames.delta(&[part]).commit();
            }
            frames
        },
    ),
    (
        "keyframe-within-a-chain",
        &["P-015", "P-017"],
        "A delta, a keyframe and a delta, in one group.",
        |frames, entry| {
            let first = Part::of(entry).cell(4, 5, &some(entry, 50, 1));
            let keyframe = filled(entry, &[(6, 5, some(entry, 51, 2))]);
            let last = Part::of(entry).cell(6, 14, &some(entry, 52, 3));
            frames
                .delta(&[first])
                .commit()
                .keyframe(&[keyframe])
                .commit()
                .delta(&[last])
                .commit()
        },
    ),
    (
        "base-after-left-out-frames",
        &["P-012", "C-094"],
        "The base is the last frame, whose number is not one less.",
        |frames, entry| {
            let part = |i| Part::of(entry).cell(4, 5, &some(entry, i, 1));
            let frames = frames.numbered(1000).commit();
            // The next number is 1001, its base 1000; then one whose base is not its number less 1.
            let frames = frames.delta(&[part(50)]).commit();
            let frames = frames.delta(&[part(51)]);
            frames.numbered(5000).commit()
        },
    ),
    (
        "base-2-32-minus-2",
        &["P-012"],
        "The last frame number there is, on the one before.",
        |frames, entry| {
            let frames = frames.numbered(u32::MAX - 1).commit();
            frames
                .delta(&[Part::of(entry).cell(4, 5, &some(entry, 50, 1))])
                .commit()
        },
    ),
    (
        "group-empties",
        &["C-062", "P-015"],
        "A group that starts from keyframes begins with a frame without content.",
        |frames, _| frames.group().commit(),
    ),
    (
        "group-with-keyframe",
        &["C-062", "P-015"],
        "A group that starts from keyframes begins with one.",
        |frames, entry| {
            frames
                .group()
                .keyframe(&[filled(entry, &[(3, 7, some(entry, 50, 4))])])
                .commit()
        },
    ),
    (
        "group-then-delta",
        &["C-062", "P-012"],
        "The second frame of a group that starts from keyframes is a delta.",
        |frames, entry| {
            let frames = frames.group().commit();
            frames
                .delta(&[filled(entry, &[(3, 7, some(entry, 50, 4))])])
                .commit()
        },
    ),
    (
        "group-on-state-with-delta",
        &["P-012", "C-064"],
        "A group that builds on the state begins with a delta.",
        |frames, entry| {
            frames
                .group_on_state()
                .delta(&[Part::of(entry).cell(4, 5, &some(entry, 50, 1))])
                .commit()
        },
    ),
    (
        "transform-and-points",
        &["P-015", "C-105"],
        "A frame with a transform, and frames that keep it.",
        |frames, entry| {
            let mut rows = IDENTITY;
            rows[3] = -0.0;
            rows[7] = 1.5;
            let part = |i| Part::of(entry).cell(4, 5, &some(entry, i, 1));
            let frames = frames.transforms(&[(7, rows)]).delta(&[part(50)]).commit();
            let frames = frames.keyframe(&[part(51)]).commit();
            rows[11] = 3.0;
            frames.delta(&[part(52)]).transforms(&[(7, rows)]).commit()
        },
    ),
    (
        "declared-again",
        &["C-078"],
        "A track is declared again between delta and commit, and keeps all.",
        |frames, entry| {
            let part = Part::of(entry).cell(4, 5, &some(entry, 50, 1));
            let frames = frames
                .delta(&[part])
                .declare(std::slice::from_ref(entry))
                .commit();
            frames.delta(&[Part::of(entry)]).commit()
        },
    ),
    (
        "without-digests",
        &["P-016"],
        "Frames without digests.",
        |frames, entry| {
            frames
                .bare()
                .delta(&[Part::of(entry).cell(4, 5, &some(entry, 50, 1))])
                .commit()
        },
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for (i, &(name, clauses, comment, more)) in ONE_TRACK.iter().enumerate() {
        let entry = entry(7, WIDTHS[i % 3]);
        let frames = Frames::new(std::slice::from_ref(&entry)).keyframe(&[content(&entry)]);
        let bytes = more(frames.commit(), &entry).ended();
        drafts.push(Draft::valid(AREA, name, clauses, comment, bytes));
    }
}
