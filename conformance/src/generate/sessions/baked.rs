//! Sessions of the baked models: what a decoder keeps of them through loss and failed frames.

use super::{Case, LAST, case, pushed, without};
use crate::generate::frames::Frames;
use crate::models::baked::{Baked, Fault, streams};
use crate::stream_builder::{HEADER, commit, group, kind, removal};

const FIRST: &str = "stream 60 1, group 0 keyframes, frame 0 0";
const SECOND: &str = "frame 1 1";

/// Adds the sessions of a model.
pub(super) fn baked<M: Baked>(all: &mut Vec<Case>) {
    let first = all.len();
    failed::<M>(all);
    lost::<M>(all);
    all[first..].iter_mut().for_each(|case| case.area = M::NAME);
}

/// A frame with content of two tracks.
fn begun<M: Baked>() -> Frames {
    M::put(streams::<M>(2), &[1, 2], 1).commit()
}

/// A frame that fails after [`begun`]: the state is as before, bit for bit, as the digest of the next
/// group shows.
fn failed<M: Baked>(all: &mut Vec<Case>) {
    let start = begun::<M>();
    let record = |ids: &[u32]| (M::RECORD, M::payload(&start, ids, 2));
    let wrong = (kind::COMMIT, commit(1, 1, Some(7)));
    let mut frames = vec![
        (
            "digest",
            "session 4005",
            "A frame of both tracks has a wrong digest.",
            vec![record(&[1, 2]), wrong.clone()],
        ),
        (
            "group",
            "session 4005",
            "The first frame of a group from keyframes has a wrong digest.",
            vec![(kind::GROUP, group(0, 0, 0)), record(&[1]), wrong],
        ),
    ];
    for fault in M::faults(&start) {
        let Fault {
            name,
            error,
            comment,
            payload,
            after_a_record,
        } = fault;
        let before = after_a_record.then(|| record(&[1]));
        let records = before.into_iter().chain([(M::RECORD, payload)]).collect();
        frames.push((name, error, comment, records));
    }
    for (name, error, comment, records) in frames {
        let grouped = records.iter().any(|record| record.0 == kind::GROUP);
        let mut frames = start.clone();
        for (record_type, payload) in &records {
            frames.builder.put(*record_type, payload);
        }
        let offset = frames.builder.last() + HEADER;
        let frames = M::put(frames.group_on_state(), &[2], 3).commit();
        let started = if grouped { ", group 0 keyframes" } else { "" };
        all.push(case(
            &format!("failed-{name}"),
            &["C-090", "C-110", "C-119", M::REPLACES],
            &format!("{comment} The state is as before, bit for bit."),
            pushed(&frames.ended()).resume().finish(),
            format!(
                "{FIRST}{started}, error {error} {offset}, resume yes, group 1 state, {SECOND}, {LAST}"
            ),
        ));
    }
}

fn lost<M: Baked>(all: &mut Vec<Case>) {
    // Without digests: one would show that the record was lost.
    let frames = M::put(begun::<M>().bare(), &[1, 2], 2).commit();
    let frames = M::put(frames.group(), &[1], 3).commit();
    let builder = frames.builder.clone().end().clone();
    all.push(case(
        "lost-record",
        &["C-115", "C-119", M::REPLACES, "C-062"],
        "A record and its commit are lost: the next group replaces one track and empties the other.",
        pushed(&without(&builder, 5, 6)).resume().finish(),
        format!(
            "{FIRST}, error framing 1008 {}, resume yes, group 0 keyframes, frame 2 2, {LAST}",
            builder.starts[5]
        ),
    ));
    // A removal that came before the fault stays.
    let mut frames = begun::<M>();
    frames.builder.put(kind::TRACK_REMOVE, &removal(&[1]));
    let record = M::payload(&frames, &[1], 2);
    frames.builder.put(M::RECORD, &record);
    let offset = frames.builder.last() + HEADER;
    let frames = frames.group().remove_silently(&[1]);
    let frames = M::put(frames, &[2], 4).commit();
    all.push(case(
        "removed-before-a-fault",
        &["C-081", "C-119", M::REPLACES],
        "A record names a track that was removed in its frame: the removal stays.",
        pushed(&frames.ended()).resume().finish(),
        format!(
            "{FIRST}, error record 2019 {offset}, resume yes, group 0 keyframes, {SECOND}, {LAST}"
        ),
    ));
}
