//! Sessions of volumes: what a decoder keeps of them through loss and failed frames.

use super::{Case, LAST, Script, case, damaged, pushed, without};
use crate::generate::frames::Frames;
use crate::models::entry::Entry;
use crate::models::probes::expected::Content;
use crate::models::probes::generate::{AREA, later, seen, some};
use crate::models::probes::writer::{Probe, Section, Volume, payload};
use crate::stream_builder::{HEADER, StreamBuilder, commit, kind};

/// Places of the records of [`whole`].
mod at {
    pub const TRACK: usize = 1;
    pub const KEYFRAME: usize = 3;
    pub const DELTA: usize = 5;
    pub const SECOND_COMMIT: usize = 6;
    pub const TRACK_AGAIN: usize = 7;
    pub const GROUP_AGAIN: usize = 8;
    pub const SECOND_KEYFRAME: usize = 9;
    pub const THIRD_COMMIT: usize = 10;
}

const FIRST: &str = "stream 60 1, group 0 keyframes, frame 0 0";
const SECOND: &str = "frame 1 1";
const THIRD: &str = "group 0 keyframes, frame 2 2";
const FOURTH: &str = "group 1 state, frame 3 3";

fn volumes() -> [Volume; 2] {
    [
        Volume::packed([3, 2, 2]).seeing(4),
        Volume::raw([2, 2, 1]).seeing(4),
    ]
}

/// Probes and visibility of both volumes, others for each seed.
fn contents(seed: u64) -> [Content; 2] {
    let volumes = volumes();
    [1, 2].map(|id| {
        let volume = &volumes[id as usize - 1];
        Content {
            visibility: Some(seen(volume, seed)),
            ..Content::new(id, some(volume, seed))
        }
    })
}

/// What a delta makes of [`contents`].
fn delta(seed: u64) -> [Content; 2] {
    let volumes = volumes();
    contents(seed).map(|content| {
        let volume = &volumes[content.id as usize - 1];
        Content::new(content.id, later(volume, &content.probes, seed + 1))
    })
}

fn entries() -> [Entry; 2] {
    let mut id = 0;
    volumes().map(|volume| {
        id += 1;
        Entry::of_volume(id, volume)
    })
}

fn begun() -> Frames {
    Frames::new(&entries()).probes(true, &contents(1)).commit()
}

/// Frames 0 and 1; frame 2 from keyframes, its tracks declared again; frame 3 on its state.
fn whole() -> StreamBuilder {
    let frames = begun().probes(false, &delta(1)).commit();
    let frames = frames.declare(&entries()).group();
    let frames = frames.probes(true, &contents(5)).commit();
    let frames = frames.group_on_state().probes(false, &delta(5)).commit();
    frames.builder.clone().end().clone()
}

pub(super) fn probes(all: &mut Vec<Case>) {
    let first = all.len();
    lost(all);
    failed(all);
    tracks(all);
    all[first..].iter_mut().for_each(|case| case.area = AREA);
}

fn lost(all: &mut Vec<Case>) {
    let builder = whole();
    let s = &builder.starts;
    let once = |first, last| pushed(&without(&builder, first, last)).resume().finish();
    let cut = |place: usize| format!("error framing 1008 {}, resume yes", s[place]);
    let crc = |place: usize| format!("error framing 1011 {}, resume yes", s[place] + HEADER);
    let mut pieces = Script::default();
    for piece in builder.bytes.chunks(37) {
        pieces = pieces.push(piece);
    }
    let head = &builder.bytes[..s[at::TRACK]];
    all.extend([
        case("lost-frame", &["C-115", "C-119", "B-010"],
            "A delta and its commit are lost: the next group replaces all.",
            once(at::DELTA, at::SECOND_COMMIT),
            format!("{FIRST}, {}, {THIRD}, {FOURTH}, {LAST}", cut(at::DELTA))),
        case("lost-group", &["C-063", "C-119", "B-062"],
            "A group from keyframes is lost: the next one builds on a state that is not there.",
            once(at::TRACK_AGAIN, at::THIRD_COMMIT),
            format!("{FIRST}, {SECOND}, {}, {LAST}", cut(at::TRACK_AGAIN))),
        case("lost-keyframe", &["C-110", "C-119"],
            "The keyframe of a group is lost: its frame does not come, nor what builds on it.",
            once(at::SECOND_KEYFRAME, at::SECOND_KEYFRAME),
            format!("{FIRST}, {SECOND}, group 0 keyframes, {}, {LAST}", cut(at::SECOND_KEYFRAME))),
        case("damaged-first-keyframe", &["C-022", "C-119"],
            "The first keyframe is damaged: nothing is there up to the next group.",
            pushed(&damaged(&builder, at::KEYFRAME)).resume().finish(),
            format!("stream 60 1, group 0 keyframes, {}, {THIRD}, {FOURTH}, {LAST}", crc(at::KEYFRAME))),
        case("damaged-delta", &["C-022", "C-110", "C-119"],
            "A delta is damaged: its frame does not come.",
            pushed(&damaged(&builder, at::DELTA)).resume().finish(),
            format!("{FIRST}, {}, {THIRD}, {FOURTH}, {LAST}", crc(at::DELTA))),
        case("late-join", &["C-117", "C-118", "C-119"],
            "One joins where the volumes are declared again.",
            pushed(&[head, &builder.bytes[s[at::TRACK_AGAIN]..]].concat()).resume().finish(),
            format!("stream 60 1, error framing 1008 {}, resume yes, {THIRD}, {FOURTH}, {LAST}", head.len())),
        case("late-join-after-tracks", &["C-117", "B-016"],
            "One joins after the volumes were declared: the keyframe names unknown tracks.",
            pushed(&[head, &builder.bytes[s[at::GROUP_AGAIN]..]].concat()).resume().resume().finish(),
            format!("stream 60 1, error framing 1008 {}, resume yes, group 0 keyframes, error record 2019 {}, resume yes, {LAST}",
                head.len(), head.len() + s[at::SECOND_KEYFRAME] - s[at::GROUP_AGAIN] + HEADER)),
        case("pieces-of-37", &["C-111"],
            "A stream in pieces of 37 bytes: the same as in one.",
            pieces.finish(),
            format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}")),
        case("reset-forgets-volumes", &["C-114"],
            "After a reset within a delta the stream comes again: nothing is left of its volumes.",
            pushed(&builder.bytes[..s[at::DELTA] + 50]).word("reset").push(&builder.bytes).finish(),
            format!("{FIRST}, reset, {FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}")),
    ]);
}

/// A frame that fails after [`begun`]: the state is as before, bit for bit, as the digest of the next
/// group shows, and its delta.
fn failed(all: &mut Vec<Case>) {
    let bad = |id: usize, code: usize, value: i32| {
        let mut contents = delta(1);
        // The last probe, so that all others are decoded before it.
        if let Some(last) = contents[id - 1].probes.last_mut() {
            *last = Probe::new(3, &last.codes);
            last.codes[code] = value;
        }
        contents
    };
    let with_seen = || {
        let volumes = volumes();
        delta(1).map(|content| Content {
            visibility: Some(seen(&volumes[content.id as usize - 1], 9)),
            ..content
        })
    };
    let wrong = commit(1, 1, Some(7));
    let record = |frames: &Frames, keyframe: bool, contents: &[Content]| {
        (kind::PROBES, frames.probes_payload(keyframe, contents))
    };
    let start = begun();
    let cut_short = |mut sections: Vec<Section>| {
        if let Some(last) = sections.last_mut() {
            last.probes.pop();
        }
        sections
    };
    let group = (kind::GROUP, crate::stream_builder::group(0, 0, 0));
    let frames = [
        (
            "delta",
            "session 4005",
            "A frame of deltas, and of visibility, has a wrong digest.",
            vec![
                record(&start, false, &with_seen()),
                (kind::COMMIT, wrong.clone()),
            ],
        ),
        (
            "keyframes",
            "session 4005",
            "A frame of keyframes has a wrong digest.",
            vec![
                record(&start, true, &contents(5)),
                (kind::COMMIT, wrong.clone()),
            ],
        ),
        (
            "group",
            "session 4005",
            "The first frame of a group from keyframes has a wrong digest.",
            vec![
                group,
                record(&start, true, &contents(5)),
                (kind::COMMIT, wrong),
            ],
        ),
        (
            "code",
            "codec 3104",
            "The last code of a packed volume is out of range, in a delta.",
            vec![record(&start, false, &bad(1, 26, 5000)[..1])],
        ),
        (
            "value",
            "codec 3103",
            "The last value of the second volume is infinite, after a whole first one.",
            vec![record(&start, false, &bad(2, 26, 0x7c00))],
        ),
        (
            "second-record",
            "codec 3101",
            "The second record of a frame is too short, after a whole first one.",
            vec![
                record(&start, false, &with_seen()[..1]),
                (
                    kind::PROBES,
                    payload(Some(0), &cut_short(start.sections(false, &delta(1)[1..]))),
                ),
            ],
        ),
        (
            "missing-base",
            "session 4001",
            "A delta builds on a frame that never was.",
            vec![(
                kind::PROBES,
                payload(Some(7), &start.sections(false, &delta(1))),
            )],
        ),
    ];
    for (name, error, comment, records) in frames {
        let groups = records
            .iter()
            .filter(|record| record.0 == kind::GROUP)
            .count();
        let mut frames = begun();
        for (record_type, payload) in &records {
            frames.builder.put(*record_type, payload);
        }
        let offset = frames.builder.last() + HEADER;
        let frames = frames.group_on_state().probes(false, &delta(1)).commit();
        let started = if groups > 0 {
            ", group 0 keyframes"
        } else {
            ""
        };
        all.push(case(
            &format!("failed-{name}"),
            &["C-090", "C-110", "C-119", "B-011", "B-015", "B-061"],
            &format!("{comment} The state is as before, bit for bit."),
            pushed(&frames.ended()).resume().finish(),
            format!("{FIRST}{started}, error {error} {offset}, resume yes, group 1 state, {SECOND}, {LAST}"),
        ));
    }
}

/// Volumes that end, or come, in stretches that are skipped.
fn tracks(all: &mut Vec<Case>) {
    let stream = |remove: bool| {
        // Without digests: one would show that a removal was lost.
        let mut frames = begun().bare().probes(false, &delta(1));
        frames = match remove {
            true => frames.remove(&[1]),
            false => frames.declare(&[Entry::of_volume(3, volumes()[0].clone())]),
        };
        let frames = frames.commit().group();
        let mut kept = contents(5)[1..].to_vec();
        if !remove {
            kept.push(Content {
                id: 3,
                ..contents(5)[0].clone()
            });
        }
        frames
            .probes(true, &kept)
            .commit()
            .builder
            .clone()
            .end()
            .clone()
    };
    let crc = |builder: &StreamBuilder| {
        format!(
            "error framing 1011 {}, resume yes",
            builder.starts[5] + HEADER
        )
    };
    let gap =
        |builder: &StreamBuilder| format!("error framing 1008 {}, resume yes", builder.starts[5]);
    let (remove, declare) = (stream(true), stream(false));
    let named = declare.starts[9] - (declare.starts[7] - declare.starts[5]) + HEADER;
    all.extend([
        case("remove-in-lost-records", &["C-118", "C-081"],
            "A removal comes among records that are skipped: the volume ends at the next commit.",
            pushed(&damaged(&remove, 5)).resume().finish(),
            format!("{FIRST}, {}, {THIRD}, {LAST}", crc(&remove))),
        case("remove-lost", &["C-062", "C-118", "B-061"],
            "A removal is lost: the volume stays, and is empty after the next group.",
            pushed(&without(&remove, 5, 6)).resume().finish(),
            format!("{FIRST}, {}, {THIRD}, {LAST}", gap(&remove))),
        case("declare-in-lost-records", &["C-118", "C-079"],
            "A volume is declared among records that are skipped: the next group has probes of it.",
            pushed(&damaged(&declare, 5)).resume().finish(),
            format!("{FIRST}, {}, {THIRD}, {LAST}", crc(&declare))),
        case("declare-lost", &["C-118", "B-016"],
            "The declaration of a volume is lost: the next group names an unknown track.",
            pushed(&without(&declare, 5, 6)).resume().resume().finish(),
            format!("{FIRST}, {}, group 0 keyframes, error record 2019 {named}, resume yes, {LAST}", gap(&declare))),
        case("delta-of-a-removed-track", &["B-016", "C-081", "C-110"],
            "A frame removes a volume and then names it: the frame fails, the volume ends at the next commit.",
            {
                let frames = begun();
                let sections = frames.sections(false, &delta(1)[..1]);
                let mut frames = frames.remove(&[1]);
                frames.builder.put(kind::PROBES, &payload(Some(0), &sections));
                let frames = frames.group().probes(true, &contents(5)[1..]).commit();
                pushed(&frames.ended()).resume().finish()
            },
            {
                let removed = begun().remove(&[1]);
                let at = removed.builder.bytes.len() + HEADER;
                format!("{FIRST}, error record 2019 {at}, resume yes, group 0 keyframes, frame 1 1, {LAST}")
            }),
    ]);
}
