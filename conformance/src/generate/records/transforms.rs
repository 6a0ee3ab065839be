//! The transforms record.

use crate::generate::Draft;
use crate::generate::plan::{Plan, at, cell, digest, moved, payload, refused, two_tracks, valid};
use crate::stream_builder::{commit, kind, set_word, transforms, words};

pub fn transform_faults(drafts: &mut Vec<Draft>) {
    let entry = |k: usize| 8 + 52 * k;
    let nan = f32::NAN.to_bits();
    let infinite = f32::INFINITY.to_bits();
    let at = at::TRANSFORMS;
    drafts.extend([
        payload((2001, "transforms-head-cut"), &["C-040"], at,
            "A transforms record of seven bytes.", |p| p.truncate(7)),
        payload((2001, "transforms-count-above"), &["C-040"], at,
            "Three transforms are counted and two are there.", |p| set_word(p, 0, 3)),
        payload((2001, "transforms-count-below"), &["C-040"], at,
            "One transform is counted and two are there.", |p| set_word(p, 0, 1)),
        payload((2001, "transforms-count-wraps"), &["C-040"], at,
            "The count is 2^30 + 2: its size wraps to that of two in 32 bits.",
            |p| set_word(p, 0, (1 << 30) + 2)),
        payload((2001, "transforms-cut"), &["C-040"], at,
            "The last transform lacks a byte.", |p| p.truncate(8 + 103)),
        payload((2001, "transforms-byte-over"), &["C-040"], at,
            "A byte follows the transforms.", |p| p.push(0)),
        payload((2002, "transforms-reserved"), &["C-041"], at,
            "The reserved field of a transforms record is not 0.", |p| p[7] = 0x80),
        payload((2004, "transforms-same-twice"), &["C-043"], at,
            "A track has two transforms in a record.", |p| set_word(p, entry(1), 1)),
        payload((2004, "transforms-descending"), &["C-043"], at,
            "Tracks descend.", |p| {
                set_word(p, entry(0), 2);
                set_word(p, entry(1), 1);
            }),
        payload((2009, "transforms-nan"), &["C-042"], at,
            "The first number of a transform is not a number.", |p| set_word(p, entry(0) + 4, nan)),
        payload((2009, "transforms-infinite"), &["C-042"], at,
            "The last number of the last transform is infinite.",
            |p| set_word(p, entry(1) + 48, infinite)),
        payload((2009, "transforms-minus-infinite"), &["C-042"], at,
            "A number of a transform is minus infinity.",
            |p| set_word(p, entry(1) + 16, infinite | 1 << 31)),
        payload((2009, "transforms-signalling-nan"), &["C-042"], at,
            "A number of a transform is a signalling NaN.",
            |p| set_word(p, entry(0) + 20, 0xff80_0001)),
        payload((2019, "transforms-unknown"), &["C-085"], at,
            "A transform names a track that was never declared.", |p| set_word(p, entry(1), 3)),
        refused((4010, "transforms-twice"), &["C-086"], at + 1,
            "A frame has two transforms records, of different tracks.",
            Plan::usual().insert(at + 1, kind::TRANSFORMS, transforms(&[])),),
        refused((4010, "transforms-empty-then-full"), &["C-086", "C-046"], at + 1,
            "A frame has a transforms record without entries, and another.",
            Plan::usual().insert(at, kind::TRANSFORMS, transforms(&[]))),
        refused((4010, "transforms-twice-before-fields"), &["C-086", "C-041", "C-112"], at + 1,
            "The second transforms record of a frame has a reserved bit set: the number is checked first.",
            Plan::usual().insert(at + 1, kind::TRANSFORMS, words(&[0, 1]))),
        payload((2002, "transforms-reserved-before-size"), &["C-041", "C-040", "C-112"], at,
            "The reserved field is not 0 and a byte is over: the field is checked first.", |p| {
                p[4] = 1;
                p.push(0);
            }),
        payload((2001, "transforms-size-before-entries"), &["C-040", "C-043", "C-112"], at,
            "Tracks descend and a byte is over: the size is checked first.", |p| {
                set_word(p, entry(1), 0);
                p.push(0);
            }),
        payload((2004, "transforms-order-before-finite"), &["C-043", "C-042", "C-112"], at,
            "The second id does not ascend and its numbers are no numbers: the order is checked first.",
            |p| {
                set_word(p, entry(1), 1);
                set_word(p, entry(1) + 4, nan);
            }),
        payload((2009, "transforms-finite-before-live"), &["C-042", "C-085", "C-112"], at,
            "An unknown track with numbers that are none: the numbers are checked first.", |p| {
                set_word(p, entry(1), 3);
                set_word(p, entry(1) + 4, nan);
            }),
        payload((2019, "transforms-entry-by-entry"), &["C-085", "C-042", "C-112"], at,
            "The first track is unknown, the second has numbers that are none: entries go one by one.",
            |p| {
                set_word(p, entry(0), 0);
                set_word(p, entry(1) + 4, nan);
            }),
    ]);
}

pub fn transform_values(drafts: &mut Vec<Draft>) {
    let with = |rows: [f32; 12], expect: &[(u32, [f32; 12])]| {
        let mut plan = Plan::usual();
        plan.records[at::SECOND_TRANSFORMS].1 = transforms(&[(2, rows)]);
        let [first, second] = two_tracks();
        let mut part = cell(&first, 0, 5, 200);
        let delta = cell(&first, 1, 6, 50);
        part.buckets.extend(delta.buckets);
        part.buckets.sort_unstable();
        part.cells.extend(delta.cells);
        let other = cell(&second, 0, 7, 100);
        let digest = digest(&[
            (1, Some(moved(1.0)), Some(&part)),
            (2, Some(expect[0].1), Some(&other)),
        ]);
        plan.records[at::SECOND_COMMIT].1 = commit(4, 2, Some(digest));
        plan
    };
    let numbers: [f32; 12] = std::array::from_fn(|i| 1.5 * i as f32 - 3.25);
    let edges = [
        -0.0,
        0.0,
        f32::MIN_POSITIVE,
        -f32::from_bits(1),
        f32::from_bits(0x007f_ffff),
        f32::MAX,
        f32::MIN,
        1.0,
        -1.0,
        f32::EPSILON,
        16_777_216.0,
        0.1,
    ];
    drafts.push(valid(
        "transforms-by-rows",
        &["C-105", "C-088"],
        "Twelve different numbers in a transform, and the digest after it.",
        &with(numbers, &[(2, numbers)]),
    ));
    drafts.push(valid(
        "transforms-extreme-numbers",
        &["C-042", "C-088", "C-105"],
        "Minus zero, denormal and the largest numbers are kept as the bits that came.",
        &with(edges, &[(2, edges)]),
    ));
    drafts.push(valid(
        "transforms-not-rigid",
        &["C-085"],
        "A transform of zeros: whether it is a rotation is not checked.",
        &with([0.0; 12], &[(2, [0.0; 12])]),
    ));
}
