//! The records that order a stream: stream, group, track remove, transforms, commit.

mod commits;
mod removals;
mod transforms;

use std::slice;

use crate::generate::Draft;
use crate::generate::plan::{Plan, at, cell, digest, moved, payload, refused, two_tracks, valid};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::points;
use crate::stream_builder::{commit, group, kind, removal, set_word, transforms, words};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    stream(drafts);
    group_fields(drafts);
    group_order(drafts);
    groups(drafts);
    removals::removals(drafts);
    removals::come_and_go(drafts);
    removals::removal_faults(drafts);
    transforms::transform_faults(drafts);
    transforms::transform_values(drafts);
    commits::commit_faults(drafts);
    commits::commit_values(drafts);
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
            (2002, "group-digest-at-keyframes"),
            &["C-041"],
            at::GROUP,
            "A group from keyframes has a digest.",
            |p| p[8] = 1,
        ),
        payload(
            (2002, "group-digest-at-keyframes-high"),
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
            "A group has a digest though it starts from keyframes and a frame is open: the fields are checked first.",
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
    let state_digest = |second_part, transforms: [Option<[f32; 12]>; 2]| {
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
                .then(kind::GROUP, group(1, 1, state_digest(Some(&other), both)))
                .then(kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)]))
                .then(kind::COMMIT, commit(4, 2, None))),
        add("group-on-state-keeps-transforms", &["C-063", "C-088"],
            "A group that builds on a state empties nothing.",
            one.clone()
                .then(kind::GROUP, group(1, 1, state_digest(Some(&other), both)))
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
                .then(kind::GROUP, group(1, 1, state_digest(Some(&other), both)))
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
                (kind::POINTS, points(None, slice::from_ref(&part))),
                (kind::TRACK, tracks(slice::from_ref(&second))),
                (kind::POINTS, points(None, slice::from_ref(&other))),
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
        &["C-061", "C-046", "C-044"],
        at::DELTA + 1,
        "A transforms record without entries opens a frame, in which no group may start.",
        open.then(kind::GROUP, group(1, 0, 0))
            .then(kind::COMMIT, commit(4, 2, None)),
    ));
    let open = one().then(kind::POINTS, points(None, &[]));
    drafts.push(refused(
        (4006, "empty-points-open-a-frame"),
        &["C-061", "C-046", "C-044"],
        at::DELTA + 1,
        "A points record without tracks opens a frame, in which no group may start.",
        open.then(kind::GROUP, group(1, 0, 0))
            .then(kind::COMMIT, commit(4, 2, None)),
    ));
}
