//! Sessions of regions: what a decoder keeps of them through loss and failed frames.

use super::{Case, LAST, case, pushed, without};
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::regions::expected::Content;
use crate::models::regions::generate::{AREA, some};
use crate::models::regions::writer::{Section, Set, payload};
use crate::stream_builder::{HEADER, commit, group, kind, removal};

const FIRST: &str = "stream 60 1, group 0 keyframes, frame 0 0";
const SECOND: &str = "frame 1 1";

fn sets() -> [Set; 2] {
    [Set::raw(4), Set::packed(5)]
}

/// Regions of both tracks, others for each seed.
fn contents(seed: u64) -> [Content; 2] {
    let sets = sets();
    [1, 2].map(|id| Content::new(id, some(&sets[id as usize - 1], seed)))
}

fn begun() -> Frames {
    let mut id = 0;
    let entries = sets().map(|set| {
        id += 1;
        Entry::of_set(id, set)
    });
    Frames::new(&entries).regions(&contents(1)).commit()
}

pub(super) fn regions(all: &mut Vec<Case>) {
    let first = all.len();
    failed(all);
    lost(all);
    all[first..].iter_mut().for_each(|case| case.area = AREA);
}

/// A frame that fails after [`begun`]: the state is as before, bit for bit, as the digest of the next
/// group shows.
fn failed(all: &mut Vec<Case>) {
    let start = begun();
    let bad = |change: fn(&mut [Section])| {
        let mut sections = start.region_sections(&contents(2));
        change(&mut sections);
        (kind::REGIONS, payload(&sections))
    };
    let good = bad(|_| {});
    let wrong = (kind::COMMIT, commit(1, 1, Some(7)));
    let first = (
        kind::REGIONS,
        payload(&start.region_sections(&contents(2)[..1])),
    );
    let second = |change: fn(&mut Section)| {
        let mut sections = start.region_sections(&contents(2)[1..]);
        change(&mut sections[0]);
        (kind::REGIONS, payload(&sections))
    };
    let frames = [
        (
            "digest",
            "session 4005",
            "A frame of both tracks has a wrong digest.",
            vec![good, wrong.clone()],
        ),
        (
            "group",
            "session 4005",
            "The first frame of a group from keyframes has a wrong digest.",
            vec![(kind::GROUP, group(0, 0, 0)), first.clone(), wrong],
        ),
        (
            "box",
            "codec 3403",
            "The last box of the second track is inside out, after a whole first track.",
            vec![bad(|sections| sections[1].head[4 * 24 + 3] = 0x7f)],
        ),
        (
            "size",
            "codec 3406",
            "The codes of the second section are too long, after a whole first one.",
            vec![bad(|sections| sections[1].codes.extend([0; 9]))],
        ),
        (
            "second-record",
            "codec 3406",
            "The second record of a frame is wrong, after a whole first one.",
            vec![first, second(|section| section.codes[..4].fill(0xff))],
        ),
    ];
    for (name, error, comment, records) in frames {
        let grouped = records.iter().any(|record| record.0 == kind::GROUP);
        let mut frames = begun();
        for (record_type, payload) in &records {
            frames.builder.put(*record_type, payload);
        }
        let offset = frames.builder.last() + HEADER;
        let frames = frames.group_on_state().regions(&contents(3)[1..]).commit();
        let started = if grouped { ", group 0 keyframes" } else { "" };
        all.push(case(
            &format!("failed-{name}"),
            &["C-090", "C-110", "C-119", "R-010"],
            &format!("{comment} The state is as before, bit for bit."),
            pushed(&frames.ended()).resume().finish(),
            format!(
                "{FIRST}{started}, error {error} {offset}, resume yes, group 1 state, {SECOND}, {LAST}"
            ),
        ));
    }
}

fn lost(all: &mut Vec<Case>) {
    // Without digests: one would show that the record was lost.
    let frames = begun().bare().regions(&contents(2)).commit();
    let frames = frames.group().regions(&contents(3)[..1]).commit();
    let builder = frames.builder.clone().end().clone();
    all.push(case(
        "lost-record",
        &["C-115", "C-119", "R-010", "C-062"],
        "A record and its commit are lost: the next group replaces one track and empties the other.",
        pushed(&without(&builder, 5, 6)).resume().finish(),
        format!(
            "{FIRST}, error framing 1008 {}, resume yes, group 0 keyframes, frame 2 2, {LAST}",
            builder.starts[5]
        ),
    ));
    // A removal that came before the fault stays.
    let mut frames = begun();
    frames.builder.put(kind::TRACK_REMOVE, &removal(&[1]));
    let record = payload(&frames.region_sections(&contents(2)[..1]));
    frames.builder.put(kind::REGIONS, &record);
    let offset = frames.builder.last() + HEADER;
    let frames = frames.group().remove_silently(&[1]);
    let frames = frames.regions(&contents(4)[1..]).commit();
    all.push(case(
        "removed-before-a-fault",
        &["C-081", "C-119", "R-010"],
        "A record names a track that was removed in its frame: the removal stays.",
        pushed(&frames.ended()).resume().finish(),
        format!(
            "{FIRST}, error record 2019 {offset}, resume yes, group 0 keyframes, {SECOND}, {LAST}"
        ),
    ));
}
