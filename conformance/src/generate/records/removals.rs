//! The track remove record.

use crate::generate::Draft;
use crate::generate::plan::{Plan, at, cell, digest, moved, payload, refused, two_tracks, valid};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::{Grid, points};
use crate::stream_builder::{IDENTITY, commit, group, kind, removal, set_word, transforms, words};

pub fn removals(drafts: &mut Vec<Draft>) {
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

/// Tracks of many sizes come and go, each with content in its last cell: what a decoder keeps in the
/// room of a removed track must not show.
pub fn come_and_go(drafts: &mut Vec<Draft>) {
    let track = |id, buckets, capacity| {
        Entry::of_grid(
            id,
            Grid {
                buckets,
                capacity,
                ..Grid::default()
            },
        )
    };
    // What ends, and then what comes, frame by frame.
    let frames = [
        (
            &[][..],
            vec![track(1, 2, 3), track(2, 3, 2), track(3, 1, 5)],
        ),
        (
            &[1, 3][..],
            vec![track(4, 1, 1), track(5, 1, 2), track(6, 4, 6)],
        ),
        (&[2, 5][..], vec![track(7, 3, 3), track(8, 2, 8)]),
        (&[4, 6, 7, 8][..], vec![track(9, 6, 12)]),
    ];
    let mut plan = Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::GROUP, group(0, 0, 0)),
    ]);
    for ((ended, new), frame) in frames.into_iter().zip(0..) {
        let parts: Vec<_> = new
            .iter()
            .map(|entry| cell(entry, entry.grid().capacity - 1, entry.id, 10 * entry.id))
            .collect();
        plan = plan
            .then(kind::TRACK_REMOVE, removal(ended))
            .then(kind::COMMIT, commit(0, 2 * frame, None))
            .then(kind::TRACK, tracks(&new))
            .then(kind::POINTS, points(None, &parts))
            .then(kind::COMMIT, commit(0, 2 * frame + 1, None));
    }
    drafts.push(valid(
        "remove-and-declare-many-sizes",
        &["C-079", "C-081"],
        "Tracks of many sizes come and go, and each shows its own content.",
        &plan,
    ));
}

pub fn removal_faults(drafts: &mut Vec<Draft>) {
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
        refused(
            (2005, "id-of-an-ended-track-after-a-declaration"),
            &["C-082", "C-074"],
            at::DELTA + 3,
            "A track is declared again after it has ended, and after a live one of a lower id was.",
            one()
                .then(kind::TRACK_REMOVE, removal(&[2]))
                .then(kind::COMMIT, commit(4, 2, None))
                .then(kind::TRACK, tracks(&[two_tracks()[0].clone()]))
                .then(kind::TRACK, tracks(&[two_tracks()[1].clone()]))
                .then(kind::COMMIT, commit(5, 3, None)),
        ),
    ]);
}
