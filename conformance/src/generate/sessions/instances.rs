//! Sessions of tables: what a decoder keeps of them through loss and failed frames.

use super::{Case, LAST, case, pushed, without};
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::instances::expected::Content;
use crate::models::instances::generate::{AREA, some};
use crate::models::instances::writer::Table;
use crate::stream_builder::{HEADER, commit, kind};

const FIRST: &str = "stream 60 1, group 0 keyframes, frame 0 0";
const SECOND: &str = "frame 1 1";

fn tables() -> [Table; 2] {
    [Table::packed(6), Table::raw(4).of_two()]
}

/// Entries of both tables, others for each seed.
fn contents(seed: u64) -> [Content; 2] {
    let tables = tables();
    [1, 2].map(|id| Content::new(id, some(&tables[id as usize - 1], seed)))
}

fn begun() -> Frames {
    let mut id = 0;
    let entries = tables().map(|table| {
        id += 1;
        Entry::of_table(id, table)
    });
    Frames::new(&entries).instances(&contents(1)).commit()
}

pub(super) fn instances(all: &mut Vec<Case>) {
    let first = all.len();
    failed(all);
    lost(all);
    all[first..].iter_mut().for_each(|case| case.area = AREA);
}

/// A frame that fails after [`begun`]: the state is as before, bit for bit, as the digest of the next
/// group shows.
fn failed(all: &mut Vec<Case>) {
    let bad = |id: usize, change: fn(&mut Content)| {
        let mut contents = contents(2);
        change(&mut contents[id - 1]);
        contents
    };
    let start = begun();
    let record = |contents: &[Content]| (kind::INSTANCES, start.instances_payload(contents));
    let frames = [
        (
            "digest",
            "session 4005",
            "A frame of both tables has a wrong digest.",
            vec![record(&contents(2)), (kind::COMMIT, commit(1, 1, Some(7)))],
        ),
        (
            "group",
            "session 4005",
            "The first frame of a group from keyframes has a wrong digest.",
            vec![
                (kind::GROUP, crate::stream_builder::group(0, 0, 0)),
                record(&contents(2)[..1]),
                (kind::COMMIT, commit(1, 1, Some(7))),
            ],
        ),
        (
            "code",
            "codec 3305",
            "The last code of a packed table is out of range.",
            vec![record(&bad(1, |c| c.instances[5].codes[0][0] = 256)[..1])],
        ),
        (
            "key",
            "codec 3303",
            "The last key of the second table does not ascend, after a whole first one.",
            vec![record(&bad(2, |c| c.instances[3].key = 0))],
        ),
        (
            "second-record",
            "codec 3305",
            "The second record of a frame is wrong, after a whole first one.",
            vec![
                record(&contents(2)[..1]),
                record(&bad(2, |c| c.instances[0].codes[1][0] = -256)[1..]),
            ],
        ),
    ];
    for (name, error, comment, records) in frames {
        let grouped = records.iter().any(|record| record.0 == kind::GROUP);
        let mut frames = begun();
        for (record_type, payload) in &records {
            frames.builder.put(*record_type, payload);
        }
        let offset = frames.builder.last() + HEADER;
        let frames = frames
            .group_on_state()
            .instances(&contents(3)[1..])
            .commit();
        let started = if grouped { ", group 0 keyframes" } else { "" };
        all.push(case(
            &format!("failed-{name}"),
            &["C-090", "C-110", "C-119", "I-010"],
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
    let frames = begun().bare().instances(&contents(2)).commit();
    let frames = frames.group().instances(&contents(3)[..1]).commit();
    let builder = frames.builder.clone().end().clone();
    all.push(case(
        "lost-record",
        &["C-115", "C-119", "I-010", "C-062"],
        "A record and its commit are lost: the next group replaces one table and empties the other.",
        pushed(&without(&builder, 5, 6)).resume().finish(),
        format!(
            "{FIRST}, error framing 1008 {}, resume yes, group 0 keyframes, frame 2 2, {LAST}",
            builder.starts[5]
        ),
    ));
}
