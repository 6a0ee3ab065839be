//! The records that order a stream: stream, group, track remove, transforms, commit.

use super::Draft;
use super::plan::{Plan, at, cell, digest, moved, payload, refused, two_tracks, valid};
use crate::forge::{
    Entry, IDENTITY, commit, group, kind, points, removal, set_word, tracks, transforms, words,
};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    stream(drafts);
    group_fields(drafts);
    group_order(drafts);
    groups(drafts);
    removals(drafts);
    removal_faults(drafts);
    transform_faults(drafts);
    transform_values(drafts);
    commit_faults(drafts);
    commit_values(drafts);
    empty_counts(drafts);
}

fn stream(drafts: &mut Vec<Draft>) {
    drafts.extend([
        payload(
            (2001, "stream-short"),
            &["C-040"],
            at::STREAM,
            "The payload of a stream record is a byte short.",
            |p| p.truncate(7),
        ),
        payload(
            (2001, "stream-long"),
            &["C-040"],
            at::STREAM,
            "The payload of a stream record is a byte long.",
            |p| p.push(0),
        ),
        payload(
            (2001, "stream-half"),
            &["C-040"],
            at::STREAM,
            "The payload of a stream record lacks its second field.",
            |p| p.truncate(4),
        ),
        payload(
            (2003, "stream-no-ticks"),
            &["C-050"],
            at::STREAM,
            "0 ticks in a second.",
            |p| set_word(p, 0, 0),
        ),
        payload(
            (2003, "stream-in-no-time"),
            &["C-050"],
            at::STREAM,
            "60 ticks in 0 seconds.",
            |p| set_word(p, 4, 0),
        ),
        payload(
            (2001, "stream-size-before-rate"),
            &["C-040", "C-050", "C-112"],
            at::STREAM,
            "A rate of 0 in a payload that is too long: the size is checked first.",
            |p| {
                set_word(p, 0, 0);
                p.push(0);
            },
        ),
    ]);
    for (name, rate, comment) in [
        ("stream-rate-least", [1, 1], "A tick a second."),
        (
            "stream-rate-most",
            [u32::MAX, u32::MAX],
            "The largest numerator and denominator, not reduced.",
        ),
        (
            "stream-rate-fraction",
            [30_000, 1001],
            "A rate that is no whole number.",
        ),
    ] {
        let mut plan = Plan::usual().up_to(at::DELTA);
        plan.records[at::STREAM].1 = words(&rate);
        drafts.push(valid(name, &["C-050"], comment, &plan));
    }
}

fn group_fields(drafts: &mut Vec<Draft>) {
    drafts.extend([
        payload(
            (2001, "group-short"),
            &["C-040"],
            at::GROUP,
            "The payload of a group is a byte short.",
            |p| p.truncate(15),
        ),
        payload(
            (2001, "group-long"),
            &["C-040"],
            at::GROUP,
            "The payload of a group is four bytes long.",
            |p| p.extend([0; 4]),
        ),
        payload(
            (2001, "group-without-digest"),
            &["C-040"],
            at::GROUP,
            "A group from keyframes leaves the digest out.",
            |p| p.truncate(8),
        ),
        payload(
            (2002, "group-digest-not-due"),
            &["C-041"],
            at::GROUP,
            "A group from keyframes has a digest.",
            |p| p[8] = 1,
        ),
        payload(
            (2002, "group-digest-not-due-high"),
            &["C-041"],
            at::GROUP,
            "A group from keyframes has the highest bit of the digest set.",
            |p| p[15] = 0x80,
        ),
        payload(
            (2021, "group-start-two"),
            &["C-060"],
            at::GROUP,
            "A group starts in way 2.",
            |p| set_word(p, 4, 2),
        ),
        payload(
            (2021, "group-start-high-byte"),
            &["C-060"],
            at::GROUP,
            "The start has 32 bits.",
            |p| set_word(p, 4, 1 << 24),
        ),
        payload(
            (2001, "group-size-before-start"),
            &["C-040", "C-060", "C-112"],
            at::GROUP,
            "A group starts in way 2 and is too long: the size is checked first.",
            |p| {
                set_word(p, 4, 2);
                p.push(0);
            },
        ),
    ]);
}

/// Groups where they may not stand, or on what is not there.
fn group_order(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual;
    // In the open first frame, after its points.
    let open = |payload| usual().insert(at::TRANSFORMS, kind::GROUP, payload);
    drafts.extend([
        refused((4006, "group-in-frame"), &["C-061", "C-044"], at::TRANSFORMS,
            "A group starts while a frame is open.", open(group(1, 0, 0))),
        refused((4006, "group-after-group"), &["C-061", "C-044"], at::POINTS,
            "A group right after a group: the first one has opened a frame.",
            usual().insert(at::POINTS, kind::GROUP, group(1, 0, 0))),
        refused((4006, "group-after-transforms"), &["C-061", "C-044"], at::SECOND_COMMIT,
            "A group after the transforms of a frame.",
            usual().insert(at::SECOND_COMMIT, kind::GROUP, group(1, 0, 0))),
        refused((2002, "group-reserved-before-open"), &["C-041", "C-061", "C-112"], at::TRANSFORMS,
            "A group has a digest that is not due and a frame is open: the fields are checked first.",
            open(group(1, 0, 1))),
        refused((2021, "group-start-before-open"), &["C-060", "C-061", "C-112"], at::TRANSFORMS,
            "A group starts in way 2 and a frame is open: the start is checked first.",
            open(group(1, 2, 0))),
        refused((4006, "group-open-before-base"), &["C-061", "C-063", "C-112"], at::SECOND_TRANSFORMS,
            "A group builds on another state and a frame is open: the frame is checked first.",
            usual().insert(at::SECOND_TRANSFORMS, kind::GROUP, group(1, 1, 99))),
        // The XXH64 of nothing is the digest of a state without tracks.
        refused((4002, "group-on-state-before-commit"), &["C-063"], 1,
            "A group builds on the empty state before there was a commit.",
            Plan::of([
                (kind::STREAM, words(&[60, 1])),
                (kind::GROUP, group(0, 1, 0xef46_db37_51d8_e999)),
                (kind::COMMIT, commit(0, 0, None)),
            ])),
        refused((4002, "group-on-other-state"), &["C-063"], at::DELTA,
            "A group builds on a state that is not the last one.",
            usual().insert(at::DELTA, kind::GROUP, group(1, 1, 99))),
        refused((4002, "group-on-digest-zero"), &["C-063"], at::DELTA,
            "A group builds on a state with the digest 0.",
            usual().insert(at::DELTA, kind::GROUP, group(1, 1, 0))),
        // A model record before any group.
        refused((4008, "commit-before-group"), &["C-087"], at::GROUP,
            "A commit before the first group.",
            usual().insert(at::GROUP, kind::COMMIT, commit(0, 0, None))),
        refused((4008, "transforms-before-group"), &["C-087"], at::GROUP,
            "A transforms record before the first group.",
            usual().insert(at::GROUP, kind::TRANSFORMS, transforms(&[]))),
        refused((4008, "points-before-group"), &["C-087"], at::GROUP,
            "A points record before the first group.",
            usual().insert(at::GROUP, kind::POINTS, points(None, &[]))),
        refused((4008, "transforms-group-before-fields"), &["C-087", "C-112"], at::GROUP,
            "A transforms record before the first group has a reserved bit set: the group is checked first.",
            usual().insert(at::GROUP, kind::TRANSFORMS, words(&[0, 1]))),
        refused((2001, "commit-size-before-group"), &["C-040", "C-087", "C-112"], at::GROUP,
            "A commit before the first group is too short: the size is checked first.",
            usual().insert(at::GROUP, kind::COMMIT, vec![0; 12])),
        refused((4001, "delta-first-in-group"), &["C-062", "P-012"], at::SECOND_TRANSFORMS,
            "A delta in the first frame of a group that starts from keyframes.",
            usual().insert(at::DELTA, kind::GROUP, group(1, 0, 0))),
    ]);
}

/// Groups that a decoder takes, and what they leave.
fn groups(drafts: &mut Vec<Draft>) {
    let [first, second] = two_tracks();
    let part = cell(&first, 0, 5, 200);
    let other = cell(&second, 0, 7, 100);
    let held = |second_part, transforms: [Option<[f32; 12]>; 2]| {
        digest(&[
            (1, transforms[0], Some(&part)),
            (2, transforms[1], second_part),
        ])
    };
    let both = [Some(moved(1.0)), Some(moved(2.0))];
    let one = Plan::usual().up_to(at::DELTA);
    let add =
        |name, clauses: &[&'static str], comment, plan: Plan| valid(name, clauses, comment, &plan);
    drafts.extend([
        add("group-empties", &["C-062"],
            "A second group from keyframes without content: all tracks become empty and lose their transforms.",
            one.clone().then(kind::GROUP, group(1, 0, 0)).then(kind::COMMIT, commit(4, 2, None))),
        add("group-keeps-what-is-in-its-frame", &["C-062"],
            "A second group from keyframes has content of one track and a transform of the other.",
            one.clone()
                .then(kind::GROUP, group(1, 0, 0))
                .then(kind::POINTS, points(None, &[cell(&first, 2, 9, 33)]))
                .then(kind::TRANSFORMS, transforms(&[(2, moved(9.0))]))
                .then(kind::COMMIT, commit(4, 2, None))),
        add("group-second-frame-keeps", &["C-062", "C-088"],
            "Only the first frame of a group starts from nothing.",
            one.clone()
                .then(kind::GROUP, group(1, 0, 0))
                .then(kind::POINTS, points(None, &[cell(&first, 2, 9, 33)]))
                .then(kind::COMMIT, commit(4, 2, None))
                .then(kind::TRANSFORMS, transforms(&[(2, moved(9.0))]))
                .then(kind::COMMIT, commit(5, 3, None))),
        add("group-on-state", &["C-063", "C-105"],
            "A group builds on the committed state; its frame is a delta.",
            one.clone()
                .then(kind::GROUP, group(1, 1, held(Some(&other), both)))
                .then(kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)]))
                .then(kind::COMMIT, commit(4, 2, None))),
        add("group-on-state-keeps-transforms", &["C-063", "C-088"],
            "A group that builds on a state empties nothing.",
            one.clone()
                .then(kind::GROUP, group(1, 1, held(Some(&other), both)))
                .then(kind::COMMIT, commit(4, 2, None))),
        add("group-on-empty-state", &["C-063", "C-105"],
            "A group builds on a committed state without tracks.",
            Plan::of([
                (kind::STREAM, words(&[60, 1])),
                (kind::GROUP, group(0, 0, 0)),
                (kind::COMMIT, commit(0, 0, None)),
                (kind::GROUP, group(1, 1, 0xef46_db37_51d8_e999)),
                (kind::COMMIT, commit(0, 1, None)),
            ])),
        add("group-on-state-with-new-track", &["C-064", "C-045"],
            "The digest of a group has a track that was declared since the commit, empty.",
            one.clone()
                .then(kind::TRACK, tracks(&[Entry::new(7)]))
                .then(kind::GROUP, group(1, 1, digest(&[
                    (1, both[0], Some(&part)),
                    (2, both[1], Some(&other)),
                    (7, None, None),
                ])))
                .then(kind::COMMIT, commit(4, 2, None))),
        add("group-on-state-with-removed-track", &["C-064", "C-081"],
            "The digest of a group still has a track whose removal waits for the commit.",
            one.clone()
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::GROUP, group(1, 1, held(Some(&other), both)))
                .then(kind::COMMIT, commit(4, 2, None))),
        add("group-ids-any", &["C-060"],
            "Group ids are not checked: 4294967295, then 7, then 7.",
            Plan::of([
                (kind::STREAM, words(&[60, 1])),
                (kind::GROUP, group(u32::MAX, 0, 0)),
                (kind::COMMIT, commit(0, 0, None)),
                (kind::GROUP, group(7, 0, 0)),
                (kind::COMMIT, commit(0, 1, None)),
                (kind::GROUP, group(7, 0, 0)),
                (kind::COMMIT, commit(0, 2, None)),
            ])),
        add("commit-without-frame", &["C-044", "C-094"],
            "Commits where no frame is open carry a tick alone.",
            one.clone()
                .then(kind::COMMIT, commit(4, 2, None))
                .then(kind::COMMIT, commit(9, 3, None))),
        add("tracks-anywhere", &["C-045", "C-079"],
            "Tracks are declared before the group, inside a frame and between frames.",
            Plan::of([
                (kind::STREAM, words(&[60, 1])),
                (kind::TRACK, tracks(&[Entry::new(1)])),
                (kind::GROUP, group(0, 0, 0)),
                (kind::POINTS, points(None, &[part.clone()])),
                (kind::TRACK, tracks(&[second.clone()])),
                (kind::POINTS, points(None, &[other.clone()])),
                (kind::COMMIT, commit(0, 0, None)),
                (kind::TRACK, tracks(&[Entry::new(3)])),
                (kind::GROUP, group(1, 0, 0)),
                (kind::TRACK, tracks(&[Entry::new(4)])),
                (kind::COMMIT, commit(1, 1, None)),
            ])),
        add("group-twice-redeclared", &["C-078", "C-062"],
            "Each group declares its tracks again, as it would for one who joins.",
            one.clone()
                .then(kind::TRACK, tracks(&[first.clone(), second.clone()]))
                .then(kind::GROUP, group(1, 0, 0))
                .then(kind::POINTS, points(None, &[cell(&second, 3, 11, 9)]))
                .then(kind::COMMIT, commit(4, 2, None))),
    ]);
}

fn removals(drafts: &mut Vec<Draft>) {
    let one = Plan::usual().up_to(at::DELTA);
    let [first, second] = two_tracks();
    let other = cell(&second, 0, 7, 100);
    let add =
        |name, clauses: &[&'static str], comment, plan: Plan| valid(name, clauses, comment, &plan);
    drafts.extend([
        add(
            "remove-both",
            &["C-081"],
            "All tracks end at once.",
            one.clone()
                .then(kind::TRACK_REMOVE, removal(&[1, 2]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        add(
            "remove-in-frame",
            &["C-045", "C-081"],
            "A removal inside a frame, after content of another track.",
            one.clone()
                .then(kind::POINTS, points(Some(1), &[cell(&second, 1, 8, 60)]))
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        add(
            "remove-with-transform",
            &["C-080"],
            "A removed track has a transform in the same frame, which ends with it.",
            one.clone()
                .then(
                    kind::TRANSFORMS,
                    transforms(&[(1, moved(8.0)), (2, moved(9.0))]),
                )
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        add(
            "remove-before-group",
            &["C-045", "C-081"],
            "A track is removed before it was in any frame.",
            Plan::usual()
                .insert(at::GROUP, kind::TRACK, tracks(&[Entry::new(9)]))
                .insert(at::GROUP + 1, kind::TRACK_REMOVE, removal(&[9]))
                .up_to(at::DELTA + 2),
        ),
        add(
            "remove-digest",
            &["C-081", "C-105"],
            "The digest of a commit does not have the track that ends with it.",
            one.clone().then(kind::TRACK_REMOVE, removal(&[1])).then(
                kind::COMMIT,
                commit(4, 2, Some(digest(&[(2, Some(moved(2.0)), Some(&other))]))),
            ),
        ),
        add(
            "remove-then-new-track",
            &["C-074", "C-082"],
            "After a removal the next track takes a higher id and starts empty.",
            one.clone()
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::COMMIT, commit(4, 2, None))
                .then(
                    kind::TRACK,
                    tracks(&[Entry {
                        path: first.path.clone(),
                        ..Entry::new(3)
                    }]),
                )
                .then(kind::COMMIT, commit(5, 3, None)),
        ),
        add(
            "remove-and-declare-in-one-frame",
            &["C-074", "C-081"],
            "A track ends and another comes with the same commit.",
            one.clone()
                .then(kind::TRACK_REMOVE, removal(&[2]))
                .then(kind::TRACK, tracks(&[Entry::new(3)]))
                .then(
                    kind::POINTS,
                    points(None, &[cell(&Entry::new(3), 5, 20, 1)]),
                )
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        add(
            "remove-in-first-frame-of-group",
            &["C-062", "C-081"],
            "A removal in the first frame of a group from keyframes.",
            one.clone()
                .then(kind::GROUP, group(1, 0, 0))
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
    ]);
}

fn removal_faults(drafts: &mut Vec<Draft>) {
    let of = |ids: &[u32]| {
        let mut plan = Plan::usual();
        plan.records[at::REMOVE].1 = removal(ids);
        plan
    };
    let one = || Plan::usual().up_to(at::DELTA);
    drafts.extend([
        payload(
            (2001, "remove-without-count"),
            &["C-040"],
            at::REMOVE,
            "A track remove record of three bytes.",
            |p| p.truncate(3),
        ),
        payload(
            (2001, "remove-count-above"),
            &["C-040"],
            at::REMOVE,
            "Two ids are counted and one is there.",
            |p| set_word(p, 0, 2),
        ),
        payload(
            (2001, "remove-count-below"),
            &["C-040"],
            at::REMOVE,
            "No id is counted and one is there.",
            |p| set_word(p, 0, 0),
        ),
        payload(
            (2001, "remove-count-wraps"),
            &["C-040"],
            at::REMOVE,
            "The count is 2^30 + 1: its size wraps to four bytes in 32 bits.",
            |p| set_word(p, 0, (1 << 30) + 1),
        ),
        payload(
            (2001, "remove-byte-over"),
            &["C-040"],
            at::REMOVE,
            "A byte follows the ids.",
            |p| p.push(0),
        ),
        payload(
            (2001, "remove-id-cut"),
            &["C-040"],
            at::REMOVE,
            "The id is a byte short.",
            |p| p.truncate(7),
        ),
        refused(
            (2004, "remove-same-twice"),
            &["C-043"],
            at::REMOVE,
            "A removal names a track twice.",
            of(&[2, 2]),
        ),
        refused(
            (2004, "remove-descending"),
            &["C-043"],
            at::REMOVE,
            "A removal names its tracks in descending order.",
            of(&[2, 1]),
        ),
        refused(
            (2019, "remove-unknown"),
            &["C-080"],
            at::REMOVE,
            "A removal names a track that was never declared.",
            of(&[3]),
        ),
        refused(
            (2019, "remove-second-unknown"),
            &["C-080"],
            at::REMOVE,
            "The second track of a removal was never declared.",
            of(&[1, 3]),
        ),
        refused(
            (2019, "remove-again"),
            &["C-082"],
            at::REMOVE + 1,
            "A track is removed twice before the commit.",
            Plan::usual().insert(at::REMOVE, kind::TRACK_REMOVE, removal(&[1])),
        ),
        refused(
            (2019, "remove-again-after-commit"),
            &["C-080"],
            at::THIRD_COMMIT + 1,
            "A track is removed again after it has ended.",
            Plan::usual()
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::COMMIT, commit(6, 4, None)),
        ),
        refused(
            (4010, "remove-in-the-frame"),
            &["C-080"],
            at::SECOND_TRANSFORMS,
            "A removal names a track that has content in the open frame.",
            Plan::usual().insert(at::SECOND_TRANSFORMS, kind::TRACK_REMOVE, removal(&[1])),
        ),
        refused(
            (2004, "remove-order-before-live"),
            &["C-043", "C-080", "C-112"],
            at::REMOVE,
            "Ids descend to one that was never declared: the order is checked first.",
            of(&[2, 0]),
        ),
        refused(
            (2019, "remove-first-id-before-order"),
            &["C-043", "C-080", "C-112"],
            at::REMOVE,
            "The first id is unknown and the second below it: entries are checked one by one.",
            of(&[5, 1]),
        ),
        payload(
            (2004, "remove-order-before-bytes-over"),
            &["C-040", "C-043", "C-112"],
            at::REMOVE,
            "An id twice, and bytes over at the end: the end is checked last.",
            |p| *p = words(&[2, 1, 1, 0]),
        ),
        refused(
            (2019, "transform-of-removed"),
            &["C-082", "C-085"],
            at::DELTA + 1,
            "A transform names a track whose removal waits for the commit.",
            one()
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::TRANSFORMS, transforms(&[(1, IDENTITY)]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        refused(
            (2019, "points-of-removed"),
            &["C-082"],
            at::DELTA + 1,
            "A points record names a track whose removal waits for the commit.",
            one()
                .then(kind::TRACK_REMOVE, removal(&[1]))
                .then(kind::POINTS, points(None, &[cell(&Entry::new(1), 0, 5, 1)]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        refused(
            (2005, "declare-removed"),
            &["C-082", "C-074"],
            at::DELTA + 1,
            "A track is declared again while its removal waits for the commit.",
            one()
                .then(kind::TRACK_REMOVE, removal(&[2]))
                .then(kind::TRACK, tracks(&[two_tracks()[1].clone()]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
        refused(
            (2005, "declare-removed-after-commit"),
            &["C-082", "C-074"],
            at::DELTA + 2,
            "A track is declared again after it has ended, though no higher id is live.",
            one()
                .then(kind::TRACK_REMOVE, removal(&[2]))
                .then(kind::COMMIT, commit(4, 2, None))
                .then(kind::TRACK, tracks(&[two_tracks()[1].clone()]))
                .then(kind::COMMIT, commit(5, 3, None)),
        ),
    ]);
}

fn transform_faults(drafts: &mut Vec<Draft>) {
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

fn transform_values(drafts: &mut Vec<Draft>) {
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

fn commit_faults(drafts: &mut Vec<Draft>) {
    let second = at::SECOND_COMMIT;
    let of = |name: (u16, &str), clauses: &[&'static str], comment, payload: Vec<u8>| {
        super::plan::payload(name, clauses, second, comment, |p| *p = payload)
    };
    let across = |commit: Vec<u8>| {
        Plan::usual()
            .up_to(at::DELTA)
            .then(kind::GROUP, group(1, 0, 0))
            .then(kind::COMMIT, commit)
    };
    drafts.extend([
        payload((2001, "commit-short"), &["C-040"], second,
            "The payload of a commit is a byte short.", |p| p.truncate(15)),
        payload((2001, "commit-byte-over"), &["C-040"], second,
            "A byte follows a commit without a digest.", |p| p.push(0)),
        payload((2001, "commit-digest-missing"), &["C-040"], second,
            "A commit promises a digest that is not there.", |p| p[12] = 1),
        payload((2001, "commit-digest-cut"), &["C-040"], second,
            "The digest of a commit is a byte short.", |p| {
                p[12] = 1;
                p.extend([0; 7]);
            }),
        payload((2001, "commit-digest-not-promised"), &["C-040"], second,
            "A commit has a digest that it does not promise.", |p| p.extend([0; 8])),
        payload((2001, "commit-long"), &["C-040"], second,
            "A byte follows the digest of a commit.", |p| {
                p[12] = 1;
                p.extend([0; 9]);
            }),
        payload((2002, "commit-flag-two"), &["C-041"], second,
            "The flag of a commit's digest is 2.", |p| p[12] = 2),
        payload((2002, "commit-flag-high-byte"), &["C-041"], second,
            "The flag of a commit's digest has 32 bits.", |p| p[15] = 1),
        payload((2002, "commit-flag-before-size"), &["C-041", "C-040", "C-112"], second,
            "The flag is 2 and bytes are over: the flag is checked first.", |p| {
                p[12] = 2;
                p.extend([0; 4]);
            }),
        of((4003, "commit-number-again"), &["C-091"],
            "A frame has the number of the last one.", commit(4, 1, None)),
        of((4003, "commit-number-below"), &["C-091"],
            "A frame has a number below the last one's.", commit(4, 0, None)),
        of((4004, "commit-tick-below"), &["C-092"],
            "The tick of a frame is one before the last one's.", commit(2, 2, None)),
        of((4003, "commit-number-before-tick"), &["C-091", "C-092", "C-112"],
            "Number and tick are below the last ones: the number is checked first.",
            commit(2, 0, None)),
        of((4004, "commit-tick-before-digest"), &["C-092", "C-093", "C-112"],
            "The tick is below the last one and the digest of another state: the tick is checked first.",
            commit(2, 2, Some(0))),
        of((4005, "commit-digest"), &["C-093"],
            "The digest of a commit is of another state.", commit(4, 2, Some(0))),
        refused((4003, "commit-number-again-in-group"), &["C-091"], at::DELTA + 1,
            "The first frame of a second group has the number of the last one.",
            across(commit(4, 1, None))),
        refused((4004, "commit-tick-below-in-group"), &["C-092"], at::DELTA + 1,
            "The first frame of a second group has a tick before the last one's.",
            across(commit(2, 2, None))),
    ]);
    // The digest must be of the state after the frame, and not of the one before.
    let [first, other] = two_tracks();
    let before = digest(&[
        (1, Some(moved(1.0)), Some(&cell(&first, 0, 5, 200))),
        (2, Some(moved(2.0)), Some(&cell(&other, 0, 7, 100))),
    ]);
    drafts.push(of(
        (4005, "commit-digest-of-before"),
        &["C-093", "C-105"],
        "The digest of a commit is of the state before the frame.",
        commit(4, 2, Some(before)),
    ));
    let mut plan = Plan::usual().up_to(at::DELTA);
    plan.records[at::COMMIT].1 = commit(3, 1, Some(before ^ 1 << 63));
    drafts.push(refused(
        (4005, "commit-digest-highest-bit"),
        &["C-093"],
        at::COMMIT,
        "The digest of a commit is off by its highest bit.",
        plan.clone(),
    ));
    plan.records[at::COMMIT].1 = commit(3, 1, Some(before));
    drafts.push(valid(
        "commit-digest",
        &["C-093", "C-105", "P-031"],
        "A commit has the digest of its state.",
        &plan,
    ));
    // Big ticks: the high word counts.
    let high = Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::GROUP, group(0, 0, 0)),
        (kind::COMMIT, commit(1 << 32, 0, None)),
        (kind::COMMIT, commit(u32::MAX.into(), 1, None)),
    ]);
    drafts.push(refused(
        (4004, "commit-tick-high-word"),
        &["C-092"],
        3,
        "The tick has 64 bits: its high word is below the last one's.",
        high,
    ));
    let signed = Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::GROUP, group(0, 0, 0)),
        (kind::COMMIT, commit(0, 1 << 31, None)),
        (kind::COMMIT, commit(0, 1, None)),
    ]);
    drafts.push(refused(
        (4003, "commit-number-not-signed"),
        &["C-091"],
        3,
        "The frame number is unsigned: 1 is below 2147483648.",
        signed,
    ));
}

fn commit_values(drafts: &mut Vec<Draft>) {
    let frames = |commits: &[(u64, u32)]| {
        let mut plan = Plan::of([
            (kind::STREAM, words(&[60, 1])),
            (kind::GROUP, group(0, 0, 0)),
        ]);
        for &(tick, frame) in commits {
            plan = plan.then(kind::COMMIT, commit(tick, frame, None));
        }
        plan
    };
    for (name, comment, commits) in [
        (
            "commit-numbers-left-out",
            "Frame numbers 5, 6, 100.",
            &[(0, 5), (1, 6), (2, 100)][..],
        ),
        (
            "commit-numbers-most",
            "The last frame has the largest number.",
            &[(0, 0), (0, 1 << 31), (0, u32::MAX)],
        ),
        (
            "commit-ticks-repeat",
            "Three frames with one tick.",
            &[(9, 1), (9, 2), (9, 3)],
        ),
        (
            "commit-ticks-most",
            "The tick jumps to the largest.",
            &[(1 << 31, 1), (1 << 63, 2), (u64::MAX, 3), (u64::MAX, 4)],
        ),
    ] {
        drafts.push(valid(
            name,
            &["C-091", "C-092", "C-094"],
            comment,
            &frames(commits),
        ));
    }
    let empty = 0xef46_db37_51d8_e999;
    let plan = frames(&[]).then(kind::COMMIT, commit(0, 0, Some(empty)));
    drafts.push(valid(
        "commit-digest-of-nothing",
        &["C-105"],
        "The digest of a state without tracks.",
        &plan,
    ));
    let plan = Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::TRACK, tracks(&[Entry::new(3)])),
        (kind::GROUP, group(0, 0, 0)),
        (kind::COMMIT, commit(0, 0, Some(digest(&[(3, None, None)])))),
    ]);
    drafts.push(valid(
        "commit-digest-of-empty-track",
        &["C-105", "C-079"],
        "The digest of a state with one empty track.",
        &plan,
    ));
}

/// Records whose count is 0.
fn empty_counts(drafts: &mut Vec<Draft>) {
    let one = || Plan::usual().up_to(at::DELTA);
    drafts.extend([
        valid(
            "empty-track-record",
            &["C-046"],
            "A track record without entries.",
            &one().insert(at::GROUP, kind::TRACK, tracks(&[])),
        ),
        valid(
            "empty-removal",
            &["C-046"],
            "A track remove record without ids, inside a frame.",
            &one().insert(at::TRANSFORMS, kind::TRACK_REMOVE, removal(&[])),
        ),
        valid(
            "empty-transforms",
            &["C-046", "C-088"],
            "A frame with a transforms record without entries keeps the transforms.",
            &one()
                .then(kind::TRANSFORMS, transforms(&[]))
                .then(kind::COMMIT, commit(4, 2, None)),
        ),
    ]);
    let open = one().then(kind::TRANSFORMS, transforms(&[]));
    drafts.push(refused(
        (4006, "empty-transforms-open-a-frame"),
        &["C-046", "C-044"],
        at::DELTA + 1,
        "A transforms record without entries opens a frame, in which no group may start.",
        open.then(kind::GROUP, group(1, 0, 0))
            .then(kind::COMMIT, commit(4, 2, None)),
    ));
    let open = one().then(kind::POINTS, points(None, &[]));
    drafts.push(refused(
        (4006, "empty-points-open-a-frame"),
        &["C-046", "C-044"],
        at::DELTA + 1,
        "A points record without tracks opens a frame, in which no group may start.",
        open.then(kind::GROUP, group(1, 0, 0))
            .then(kind::COMMIT, commit(4, 2, None)),
    ));
}
