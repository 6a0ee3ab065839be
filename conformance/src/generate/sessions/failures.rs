//! Frames that fail; tracks and ends in streams that have lost records.

use super::{
    Case, FIRST, FOURTH, LAST, SECOND, THIRD, at, case, damaged, long, pushed, whole, without,
};
use crate::generate::container::empty_frame;
use crate::generate::plan::{Plan, cell, digest, moved, two_tracks};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::{Grid, Part, points};
use crate::stream_builder::{
    HEADER, Pack, StreamBuilder, commit, group, kind, removal, transforms, words,
};

/// Name, sentence, layer and number of the error, and the records of the frame.
type FailedFrame = (&'static str, &'static str, &'static str, Vec<Record>);
/// Type and payload.
type Record = (u16, Vec<u8>);

/// A frame that fails at its end, or within: the state is that of the frame before, bit for bit,
/// as the digest of the next group shows, and its delta.
pub(super) fn failed_frames(all: &mut Vec<Case>) {
    let [first, second] = two_tracks();
    let (part, other) = (cell(&first, 0, 5, 200), cell(&second, 0, 7, 100));
    let state = digest(&[
        (1, Some(moved(1.0)), Some(&part)),
        (2, Some(moved(2.0)), Some(&other)),
    ]);
    let keyframes = || points(None, &[cell(&first, 0, 9, 1), cell(&second, 3, 2, 2)]);
    let wrong: Part = Part::of(&second).bucket(4, &[0]);
    let moves = || transforms(&[(1, moved(-1.0)), (2, moved(-2.0))]);
    let frames: [FailedFrame; 8] = [
        (
            "delta",
            "A frame of a delta and transforms has a wrong digest.",
            "session 4005",
            vec![
                (kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)])),
                (kind::TRANSFORMS, moves()),
                (kind::COMMIT, commit(4, 2, Some(7))),
            ],
        ),
        (
            "keyframes",
            "A frame of keyframes and transforms has a wrong digest.",
            "session 4005",
            vec![
                (kind::POINTS, keyframes()),
                (kind::TRANSFORMS, moves()),
                (kind::COMMIT, commit(4, 2, Some(7))),
            ],
        ),
        (
            "group",
            "The first frame of a group from keyframes has a wrong digest.",
            "session 4005",
            vec![
                (kind::GROUP, group(1, 0, 0)),
                (kind::POINTS, keyframes()),
                (kind::COMMIT, commit(4, 2, Some(7))),
            ],
        ),
        (
            "empty-group",
            "The first frame of a group, without content, has an old number.",
            "session 4003",
            vec![
                (kind::GROUP, group(1, 0, 0)),
                (kind::COMMIT, commit(4, 1, None)),
            ],
        ),
        (
            "second-track",
            "The second track of a record has a fault, after a whole first one.",
            "codec 3005",
            vec![(
                kind::POINTS,
                points(
                    None,
                    &[cell(&first, 0, 9, 1), Part::of(&second).bucket(4, &[6])],
                ),
            )],
        ),
        (
            "second-record",
            "The second record of a frame has a fault, after a whole first one.",
            "codec 3012",
            vec![
                (kind::POINTS, points(Some(1), &[cell(&first, 0, 9, 1)])),
                (kind::POINTS, points(None, &[wrong])),
            ],
        ),
        (
            "moved-cell",
            "A delta moves a cell that its old bucket still names.",
            "codec 3013",
            vec![(kind::POINTS, points(Some(1), &[cell(&first, 0, 9, 1)]))],
        ),
        (
            "transforms",
            "The transforms of a frame name an unknown track, after a known one.",
            "record 2019",
            vec![
                (kind::POINTS, keyframes()),
                (
                    kind::TRANSFORMS,
                    transforms(&[(1, moved(7.0)), (3, moved(8.0))]),
                ),
            ],
        ),
    ];
    for (name, comment, error, records) in frames {
        // A cell of the first track may only change its key with the old bucket in the delta.
        let records: Vec<_> = records
            .into_iter()
            .map(|(record_type, payload)| match name {
                "second-record" if payload == points(Some(1), &[cell(&first, 0, 9, 1)]) => {
                    (record_type, points(Some(1), &[cell(&first, 1, 9, 1)]))
                }
                _ => (record_type, payload),
            })
            .collect();
        let groups = records
            .iter()
            .filter(|record| record.0 == kind::GROUP)
            .count();
        let failing = 5 + records.len();
        let mut plan = Plan::usual().up_to(6);
        plan.records.extend(records);
        let builder = plan
            .then(kind::GROUP, group(2, 1, state))
            .then(kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)]))
            .then(kind::COMMIT, commit(5, 3, None))
            .start()
            .end()
            .clone();
        let started = if groups > 0 {
            ", group 1 keyframes"
        } else {
            ""
        };
        all.push(case(
            &format!("failed-{name}"),
            &["C-090", "C-110", "C-119"],
            &format!("{comment} The state is as before, bit for bit."),
            pushed(&builder.bytes).resume().finish(),
            format!(
                "{FIRST}{started}, error {error} {}, resume yes, group 2 state, frame 3 5, {LAST}",
                builder.starts[failing] + HEADER
            ),
        ));
    }
}

/// Declarations and removals that come among records that are skipped, or are lost with it.
pub(super) fn tracks_in_lost_stretches(all: &mut Vec<Case>) {
    let new = Entry::new(3);
    // Frame 2 is damaged at its first record; then a change of tracks; then a group.
    let stream = |change: (u16, Vec<u8>), parts: &[Part]| {
        Plan::usual()
            .up_to(6)
            .then(kind::TRANSFORMS, transforms(&[(2, moved(3.0))]))
            .then(change.0, change.1)
            .then(kind::COMMIT, commit(4, 2, None))
            .then(kind::GROUP, group(1, 0, 0))
            .then(kind::POINTS, points(None, parts))
            .then(kind::COMMIT, commit(5, 3, None))
            .start()
            .end()
            .clone()
    };
    let kept = [cell(&two_tracks()[1], 0, 7, 9)];
    let grown = [kept[0].clone(), cell(&new, 0, 3, 4)];
    let remove = stream((kind::TRACK_REMOVE, removal(&[1])), &kept);
    let declare = stream((kind::TRACK, tracks(std::slice::from_ref(&new))), &grown);
    let crc = format!(
        "error framing 1011 {}, resume yes",
        remove.starts[6] + HEADER
    );
    let gap = format!("error framing 1008 {}, resume yes", remove.starts[6]);
    let rest = format!("{THIRD}, {LAST}");
    let points_at = |builder: &StreamBuilder| builder.starts[10] + HEADER;
    let shorter = declare.starts[8] - declare.starts[6];
    all.extend([
        case("remove-in-lost-records", &["C-118", "C-081"],
            "A removal comes among records that are skipped: the track ends at the next commit.",
            pushed(&damaged(&remove, 6)).resume().finish(),
            format!("{FIRST}, {crc}, {rest}")),
        case("remove-lost", &["C-062", "C-118"],
            "A removal is lost: the track stays, and is empty after the next group.",
            pushed(&without(&remove, 6, 7)).resume().finish(),
            format!("{FIRST}, {gap}, {rest}")),
        case("declare-in-lost-records", &["C-118", "C-079"],
            "A track is declared among records that are skipped: the next group has content of it.",
            pushed(&damaged(&declare, 6)).resume().finish(),
            format!("{FIRST}, {crc}, {rest}")),
        case("declare-lost", &["C-118", "P-013"],
            "The declaration of a track is lost: the next group names an unknown track.",
            pushed(&without(&declare, 6, 7)).resume().resume().finish(),
            format!("{FIRST}, {gap}, group 1 keyframes, error record 2019 {}, resume yes, {LAST}",
                points_at(&declare) - shorter)),
        case("declare-changed-in-lost-records", &["C-118", "C-075"],
            "A live track is declared with other content in a resynchronisation: the record counts, and has no other effect.",
            {
                let changed = Entry::of_grid(1, Grid { radius: 0.125, ..Grid::default() });
                let builder = stream((kind::TRACK, tracks(&[changed])), &kept);
                pushed(&damaged(&builder, 6)).resume().finish()
            },
            format!("{FIRST}, {crc}, {rest}")),
        case("declare-after-failed-frame", &["C-110", "C-079"],
            "A track that was declared in a frame that failed stays declared.",
            {
                let builder = Plan::usual()
                    .up_to(6)
                    .then(kind::TRACK, tracks(std::slice::from_ref(&new)))
                    .then(kind::COMMIT, commit(4, 1, None))
                    .then(kind::GROUP, group(1, 0, 0))
                    .then(kind::POINTS, points(None, &grown))
                    .then(kind::COMMIT, commit(5, 3, None))
                    .start()
                    .ended();
                pushed(&builder).resume().finish()
            },
            {
                let at = Plan::usual().up_to(6).start().bytes.len();
                let track = HEADER + tracks(std::slice::from_ref(&new)).len();
                format!("{FIRST}, error session 4003 {}, resume yes, {rest}", at + track + HEADER)
            }),
        case("remove-after-failed-frame", &["C-110", "C-081"],
            "A track that was removed in a frame that failed ends at the next commit.",
            {
                let builder = Plan::usual()
                    .up_to(6)
                    .then(kind::TRACK_REMOVE, removal(&[1]))
                    .then(kind::COMMIT, commit(4, 1, None))
                    .then(kind::GROUP, group(1, 0, 0))
                    .then(kind::POINTS, points(None, &kept))
                    .then(kind::COMMIT, commit(5, 3, None))
                    .start()
                    .ended();
                pushed(&builder).resume().finish()
            },
            {
                let at = Plan::usual().up_to(6).start().bytes.len();
                format!("{FIRST}, error session 4003 {}, resume yes, {rest}", at + HEADER + 8 + HEADER)
            }),
        case("declare-faulty-declares-none", &["C-077", "C-110"],
            "The second track of a record has a fault: the first is not declared either.",
            {
                let faulty = Entry { space: 9, ..Entry::new(4) };
                let builder = stream((kind::TRACK, tracks(&[new.clone(), faulty])), &grown);
                pushed(&builder.bytes).resume().resume().finish()
            },
            {
                let faulty = Entry { space: 9, ..Entry::new(4) };
                let builder = stream((kind::TRACK, tracks(&[new.clone(), faulty])), &grown);
                format!("{FIRST}, error record 2020 {}, resume yes, group 1 keyframes, error record 2019 {}, resume yes, {LAST}",
                    builder.starts[7] + HEADER, points_at(&builder))
            }),
    ]);
}

/// The end of a stream that has lost records.
pub(super) fn ends(all: &mut Vec<Case>) {
    let lossy = || {
        let mut plan = long().up_to(at::GROUP_ON_STATE);
        plan.records[at::DELTA].1[0] = 9;
        plan
    };
    let at_delta = lossy().start().starts[at::DELTA] + HEADER;
    // Nine tracks are counted, so that the table is beyond the payload.
    let fault = format!("error codec 3001 {at_delta}, resume yes");
    let totals = |payload: &[u8]| {
        let mut builder = lossy().start();
        builder.put(kind::END, payload);
        builder
    };
    let wrong = totals(&[0xee; 16]);
    all.push(case(
        "end-totals-after-loss",
        &["C-101", "C-120"],
        "After a resynchronisation, count and digest of the end are not checked.",
        pushed(&wrong.bytes).resume().finish(),
        format!("{FIRST}, {fault}, {THIRD}, {LAST}"),
    ));
    let short = totals(&[0; 15]);
    all.push(case(
        "end-short-after-loss",
        &["C-040", "C-120"],
        "After a resynchronisation, the size of the end is still checked.",
        pushed(&short.bytes).resume(),
        format!(
            "{FIRST}, {fault}, {THIRD}, error record 2001 {}",
            short.last() + HEADER
        ),
    ));
    let mut plan = lossy();
    plan.records.truncate(at::TRACK_AGAIN);
    let mut builder = plan.start();
    builder.put(kind::END, &[0; 15]);
    all.push(case(
        "end-short-while-resynchronising",
        &["C-118", "C-120"],
        "In a resynchronisation, an end of 15 bytes is not reported, and the stream has not ended.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "{FIRST}, {fault}, error framing 1019 {}",
            builder.bytes.len()
        ),
    ));
    let mut builder = lossy().up_to(at::THIRD_COMMIT).start();
    builder.put(kind::END, &[0; 16]);
    all.push(case(
        "end-in-frame-after-loss",
        &["C-100", "C-120"],
        "After a resynchronisation, an end within a frame is still an error; resumed, it may come again.",
        pushed(&builder.bytes)
            .resume()
            .resume()
            .push(&builder.bytes[builder.last()..])
            .finish(),
        format!(
            "{FIRST}, {fault}, group 1 keyframes, error session 4006 {}, resume yes, {LAST}",
            builder.last() + HEADER
        ),
    ));
    let builder = whole();
    let length = builder.bytes.len();
    let all_of_it = format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}");
    all.push(case(
        "byte-after-end",
        &["C-102", "C-115"],
        "A byte follows the end in the same push; nothing can be resumed.",
        pushed(&[&builder.bytes[..], &[0]].concat()).resume(),
        format!("{all_of_it}, end, error framing 1020 {length}, resume no"),
    ));
    all.push(case(
        "push-after-end",
        &["C-102", "C-115"],
        "The stream was finished, and then a byte comes.",
        pushed(&builder.bytes).finish().push(&[0]).resume(),
        format!("{all_of_it}, {LAST}, error framing 1020 {length}, resume no"),
    ));
    all.push(case(
        "number-checked-after-loss",
        &["C-091", "C-119"],
        "After a resynchronisation, frame numbers are still compared with the last commit.",
        {
            let mut plan = lossy();
            plan.records[at::THIRD_COMMIT].1 = commit(5, 1, None);
            pushed(&plan.start().ended()).resume().resume().finish()
        },
        format!(
            "{FIRST}, {fault}, group 1 keyframes, error session 4003 {}, resume yes, {LAST}",
            lossy().start().starts[at::THIRD_COMMIT] + HEADER
        ),
    ));
    all.push(case(
        "tick-checked-after-loss",
        &["C-092", "C-119"],
        "After a resynchronisation, ticks are still compared with the last commit.",
        {
            let mut plan = lossy();
            plan.records[at::THIRD_COMMIT].1 = commit(2, 3, None);
            pushed(&plan.start().ended()).resume().resume().finish()
        },
        format!(
            "{FIRST}, {fault}, group 1 keyframes, error session 4004 {}, resume yes, {LAST}",
            lossy().start().starts[at::THIRD_COMMIT] + HEADER
        ),
    ));
}

/// Sequences at their end, and a stream record that comes again.
pub(super) fn sequences(all: &mut Vec<Case>) {
    let mut builder = empty_frame();
    let start = builder.bytes.len();
    for (record_type, payload) in [
        (kind::GROUP, group(1, 0, 0)),
        (kind::COMMIT, commit(1, 1, None)),
        (kind::END, vec![0; 16]),
    ] {
        builder.put_with(record_type, Pack::None, &payload, |h| h.sequence = u64::MAX);
    }
    all.push(case("sequence-at-its-most", &["C-117"],
        "A group found in a resynchronisation has the largest sequence; no larger one can be expected.",
        pushed(&builder.bytes).resume().finish(),
        format!("stream 60 1, group 0 keyframes, frame 0 0, error framing 1008 {start}, resume yes, group 1 keyframes, frame 1 1, {LAST}")));
    let mut builder = StreamBuilder::new();
    builder
        .put_with(kind::STREAM, Pack::None, &words(&[60, 1]), |h| {
            h.payload_crc ^= 1
        })
        .put(kind::STREAM, &words(&[50, 1]))
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None))
        .end();
    all.push(case(
        "stream-again-while-resynchronising",
        &["C-118", "C-016"],
        "The stream record is damaged and comes again, with the next sequence.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "error framing 1011 48, resume yes, stream 50 1, group 0 keyframes, frame 0 0, {LAST}"
        ),
    ));
}
