//! The commit record.

use crate::generate::Draft;
use crate::generate::plan::{Plan, at, cell, digest, moved, payload, refused, two_tracks, valid};
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{commit, group, kind, words};

pub fn commit_faults(drafts: &mut Vec<Draft>) {
    let second = at::SECOND_COMMIT;
    let of = |name: (u16, &str), clauses: &[&'static str], comment, payload: Vec<u8>| {
        crate::generate::plan::payload(name, clauses, second, comment, |p| *p = payload)
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

pub fn commit_values(drafts: &mut Vec<Draft>) {
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
