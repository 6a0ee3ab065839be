//! Faults of records that are of no frame: what a resynchronisation makes of them, and that none of their
//! entries counts.

use super::{Case, FIRST, LAST, THIRD, at, case, damaged, long, pushed};
use crate::generate::plan::{Plan, cell, two_tracks};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind, removal, words};

/// Frame 1 of the usual stream, some records, and frame 3 from keyframes.
fn between(records: &[(u16, Vec<u8>)], parts: &[Part]) -> StreamBuilder {
    let mut plan = Plan::usual().up_to(6);
    plan.records.extend_from_slice(records);
    plan.then(kind::GROUP, group(1, 0, 0))
        .then(kind::POINTS, points(None, parts))
        .then(kind::COMMIT, commit(5, 3, None))
        .start()
        .end()
        .clone()
}

/// Faulty records in a resynchronisation: they count for the sequence, and are not reported.
pub(super) fn while_resynchronising(all: &mut Vec<Case>) {
    let kept = [cell(&two_tracks()[1], 0, 7, 9)];
    let builder = between(
        &[
            (kind::COMMIT, commit(4, 2, None)),
            (kind::TRACK, tracks(&[Entry::new(3)])),
        ],
        &kept,
    );
    let s = &builder.starts;
    let mut both = damaged(&builder, 6);
    both[s[7] + HEADER] ^= 1;
    let again = [&both[..s[8]], &builder.bytes[s[7]..]].concat();
    all.push(case(
        "faulty-track-while-resynchronising-counts",
        &["C-117", "C-118"],
        "A resynchronisation meets a damaged track record, and it comes again: it counts as declared, so it is one too many.",
        pushed(&again).resume().resume().finish(),
        format!(
            "{FIRST}, error framing 1011 {}, resume yes, error framing 1007 {}, resume yes, {THIRD}, {LAST}",
            s[6] + HEADER,
            s[8]
        ),
    ));
    // Nine tracks are counted, so that the table is beyond the payload.
    let mut plan = long().up_to(at::TRACK_AGAIN);
    plan.records[at::DELTA].1[0] = 9;
    let mut builder = plan.start();
    builder
        .put(kind::END, &[0; 15])
        .put_with(kind::END, Pack::None, &[0; 16], |h| h.sequence -= 1);
    all.push(case(
        "short-end-while-resynchronising-sent-again",
        &["C-118", "C-120"],
        "In a resynchronisation an end is a byte short and comes again, whole: a faulty end does not count as a record.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "{FIRST}, error codec 3001 {}, resume yes, {LAST}",
            builder.starts[at::DELTA] + HEADER
        ),
    ));
    let mut builder = StreamBuilder::new();
    let broken = |payload: &[u8], builder: &mut StreamBuilder, record_type| {
        builder.put_with(record_type, Pack::None, payload, |h| h.payload_crc ^= 1);
    };
    broken(&words(&[60, 1]), &mut builder, kind::STREAM);
    builder
        .put(kind::STREAM, &words(&[0, 1]))
        .put(kind::STREAM, &words(&[60, 1]))
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    broken(&commit(1, 1, None), &mut builder, kind::COMMIT);
    builder
        .put(kind::TRACK_REMOVE, &removal(&[9]))
        .put(kind::GROUP, &group(1, 0, 0))
        .put(kind::COMMIT, &commit(2, 2, None))
        .end();
    all.push(case(
        "faulty-stream-and-removal-while-resynchronising",
        &["C-118"],
        "A resynchronisation meets a stream record of no ticks, another a removal of an unknown track: neither is reported.",
        pushed(&builder.bytes).resume().resume().finish(),
        format!(
            "error framing 1011 48, resume yes, stream 60 1, group 0 keyframes, frame 0 0, \
             error framing 1011 {}, resume yes, group 1 keyframes, frame 2 2, {LAST}",
            builder.starts[5] + HEADER
        ),
    ));
}

/// Declarations and removals whose second entry has the fault: the first one counts no more.
pub(super) fn of_later_entries(all: &mut Vec<Case>) {
    let [first, second] = two_tracks();
    let new = Entry::new(3);
    let faulty = Entry {
        space: 9,
        ..Entry::new(5)
    };
    let other = cell(&second, 0, 7, 9);
    let builder = between(
        &[
            (kind::TRACK, tracks(&[Entry::new(4), faulty])),
            (kind::TRACK, tracks(std::slice::from_ref(&new))),
        ],
        &[other.clone(), cell(&new, 0, 3, 4)],
    );
    all.push(case(
        "id-of-a-faulty-declaration-is-free",
        &["C-074", "C-077"],
        "Tracks 4 and 5 are declared in a record with a fault, and then track 3: no id above it is declared.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "{FIRST}, error record 2020 {}, resume yes, {THIRD}, {LAST}",
            builder.starts[6] + HEADER
        ),
    ));
    let builder = between(
        &[
            (kind::COMMIT, commit(4, 2, None)),
            (kind::TRACK_REMOVE, removal(&[1, 9])),
        ],
        &[cell(&first, 0, 5, 1), other],
    );
    all.push(case(
        "faulty-removal-removes-none",
        &["C-080", "C-083"],
        "The second track of a removal is unknown: the first does not end, and has content in the next frame.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "{FIRST}, frame 2 4, error record 2019 {}, resume yes, {THIRD}, {LAST}",
            builder.starts[7] + HEADER
        ),
    ));
}
