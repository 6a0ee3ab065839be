//! Lost and damaged records, and late joins.

use super::{
    Case, FIRST, FOURTH, LAST, SECOND, THIRD, at, case, damaged, long, pushed, whole, without,
};
use crate::generate::plan::cell;
use crate::models::entry::Entry;
use crate::models::points::writer::points;
use crate::stream_builder::{HEADER, Header, Pack, StreamBuilder, kind};

pub(super) fn lost(all: &mut Vec<Case>) {
    let builder = whole();
    let s = &builder.starts;
    let once = |first, last| pushed(&without(&builder, first, last)).resume().finish();
    let cut = |place: usize| format!("error framing 1008 {}, resume yes", s[place]);
    let rest = format!("{THIRD}, {FOURTH}, {LAST}");
    all.extend([
        case("lost-record", &["C-115", "C-117", "C-119"],
            "The transforms of frame 2 are lost: the frame is dropped, the next group decodes.",
            once(at::TRANSFORMS, at::TRANSFORMS),
            format!("{FIRST}, {}, {rest}", cut(at::TRANSFORMS))),
        case("lost-commit", &["C-110", "C-116"],
            "The commit of frame 2 is lost: the frame is dropped though all else of it came.",
            once(at::SECOND_COMMIT, at::SECOND_COMMIT),
            format!("{FIRST}, {}, {rest}", cut(at::SECOND_COMMIT))),
        case("lost-frame", &["C-115", "C-118"],
            "The whole of frame 2 is lost, right before tracks are declared again.",
            once(at::DELTA, at::SECOND_COMMIT),
            format!("{FIRST}, {}, {rest}", cut(at::DELTA))),
        case("lost-up-to-a-group", &["C-116", "C-119"],
            "All records before a group are lost: the group's own header shows the gap and ends the resynchronisation.",
            once(at::DELTA, at::TRACK_AGAIN),
            format!("{FIRST}, {}, {rest}", cut(at::DELTA))),
        case("lost-group", &["C-119", "C-120", "C-063"],
            "A group from keyframes is lost: the next one builds on a state that is not there, up to the end.",
            once(at::TRACK_AGAIN, at::THIRD_COMMIT),
            format!("{FIRST}, {SECOND}, {}, {LAST}", cut(at::TRACK_AGAIN))),
        case("lost-group-record", &["C-117", "C-119"],
            "The record that starts a group is lost: its frame is skipped.",
            once(at::GROUP_AGAIN, at::GROUP_AGAIN),
            format!("{FIRST}, {SECOND}, {}, {LAST}", cut(at::GROUP_AGAIN))),
        case("lost-twice", &["C-115", "C-117"],
            "Records are lost in two frames, with a group between.",
            {
                let mut bytes = without(&builder, at::LAST_DELTA, at::LAST_DELTA);
                bytes.drain(s[at::DELTA]..s[at::TRANSFORMS]);
                pushed(&bytes).resume().resume().finish()
            },
            {
                let second = s[at::LAST_DELTA] - (s[at::TRANSFORMS] - s[at::DELTA]);
                format!("{FIRST}, {}, {THIRD}, group 2 state, error framing 1008 {second}, resume yes, {LAST}",
                    cut(at::DELTA))
            }),
        case("lost-twice-while-resynchronising", &["C-117"],
            "Records are lost among records that are skipped anyway: no further error.",
            {
                let mut bytes = without(&builder, at::SECOND_COMMIT, at::SECOND_COMMIT);
                bytes.drain(s[at::DELTA]..s[at::TRANSFORMS]);
                pushed(&bytes).resume().finish()
            },
            format!("{FIRST}, {}, {rest}", cut(at::DELTA))),
        case("lost-live", &["C-121"],
            "A live stream ends while a group is searched for.",
            pushed(&without(&builder, at::DELTA, at::DELTA)[..s[at::SECOND_COMMIT]])
                .resume()
                .word("finish-live"),
            String::new()),
    ]);
    // Of that one: the commit is missing in what came.
    let live = pushed(
        &without(&builder, at::DELTA, at::DELTA)
            [..s[at::TRACK_AGAIN] - (s[at::TRANSFORMS] - s[at::DELTA])],
    );
    if let Some(last) = all.last_mut() {
        last.script = live.resume().word("finish-live").0;
        last.outline = format!("{FIRST}, {}, finished", cut(at::DELTA));
    }
}

pub(super) fn late_join(all: &mut Vec<Case>) {
    let builder = whole();
    let s = &builder.starts;
    // The preamble and the stream record come first, as a server sends them to one who joins.
    let head = &builder.bytes[..s[at::TRACK]];
    let joined = |from: usize| [head, &builder.bytes[s[from]..]].concat();
    let gap = format!("stream 60 1, error framing 1008 {}, resume yes", head.len());
    all.extend([
        case("late-join", &["C-117", "C-118", "C-119"],
            "One joins where tracks are declared again, before a group from keyframes.",
            pushed(&joined(at::TRACK_AGAIN)).resume().finish(),
            format!("{gap}, {THIRD}, {FOURTH}, {LAST}")),
        case("late-join-in-a-frame", &["C-117", "C-119"],
            "One joins within a frame, which is skipped.",
            pushed(&joined(at::TRANSFORMS)).resume().finish(),
            format!("{gap}, {THIRD}, {FOURTH}, {LAST}")),
        case("late-join-after-tracks", &["C-117", "P-013"],
            "One joins after the tracks were declared: the group decodes, its points name unknown tracks.",
            pushed(&joined(at::GROUP_AGAIN)).resume().resume().finish(),
            format!("{gap}, group 1 keyframes, error record 2019 {}, resume yes, {LAST}",
                head.len() + (s[at::KEYFRAME] - s[at::GROUP_AGAIN]) + HEADER)),
        case("late-join-on-a-state", &["C-063", "C-119"],
            "One joins at a group that builds on a state: there is none, so nothing decodes.",
            pushed(&joined(at::GROUP_ON_STATE)).resume().finish(),
            format!("{gap}, {LAST}")),
        case("late-join-without-stream", &["C-016", "C-115", "C-118"],
            "One joins after the preamble, without a stream record: the records that come are refused, the first without another report.",
            pushed(&[&builder.bytes[..16], &builder.bytes[s[at::GROUP_ON_STATE]..]].concat())
                .resume().resume(),
            format!("error framing 1008 16, resume yes, error session 4007 {}, resume yes, error session 4007 {}",
                16 + (s[at::LAST_DELTA] - s[at::GROUP_ON_STATE]),
                16 + (s[at::LAST_COMMIT] - s[at::GROUP_ON_STATE]))),
        case("late-join-without-preamble", &["C-115", "C-001"],
            "One joins without a preamble: the framing cannot be found.",
            pushed(&builder.bytes[s[at::TRACK_AGAIN]..]).resume(),
            "error framing 1001 0, resume no".to_string()),
    ]);
}

pub(super) fn damaged_payloads(all: &mut Vec<Case>) {
    let builder = whole();
    let s = &builder.starts;
    let once = |place| pushed(&damaged(&builder, place)).resume().finish();
    let crc = |place: usize| format!("error framing 1011 {}, resume yes", s[place] + HEADER);
    let rest = format!("{THIRD}, {FOURTH}, {LAST}");
    all.extend([
        case(
            "damaged-transforms",
            &["C-110", "C-116"],
            "A payload is damaged: its frame is dropped, the next group decodes.",
            once(at::TRANSFORMS),
            format!("{FIRST}, {}, {rest}", crc(at::TRANSFORMS)),
        ),
        case(
            "damaged-first-points",
            &["C-110", "C-116"],
            "The first points are damaged: nothing was shown before the next group.",
            once(at::POINTS),
            format!(
                "stream 60 1, group 0 keyframes, {}, {rest}",
                crc(at::POINTS)
            ),
        ),
        case(
            "damaged-tracks",
            &["C-077", "C-118"],
            "The first track record is damaged, and the next one declares the tracks.",
            once(at::TRACK),
            format!("stream 60 1, {}, group 0 keyframes", crc(at::TRACK)),
        ),
        case(
            "damaged-group",
            &["C-119"],
            "The start of a group is damaged: its frame is skipped, and so is the next group.",
            once(at::GROUP_AGAIN),
            format!("{FIRST}, {SECOND}, {}, {LAST}", crc(at::GROUP_AGAIN)),
        ),
        case(
            "damaged-group-on-state",
            &["C-116", "C-120"],
            "The start of the last group is damaged: the stream ends as complete.",
            once(at::GROUP_ON_STATE),
            format!(
                "{FIRST}, {SECOND}, {THIRD}, {}, {LAST}",
                crc(at::GROUP_ON_STATE)
            ),
        ),
        case(
            "damaged-stream",
            &["C-118", "C-016"],
            "The stream record is damaged: no other record may stand before one.",
            pushed(&damaged(&builder, 0)).resume(),
            format!("{}, error session 4007 {}", crc(0), s[at::TRACK]),
        ),
        case(
            "damaged-end",
            &["C-116", "C-103"],
            "The end is damaged: after a resynchronisation the stream is cut off.",
            once(at::END),
            format!(
                "{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {}, error framing 1019 {}",
                crc(at::END),
                builder.bytes.len()
            ),
        ),
        case(
            "damaged-end-sent-again",
            &["C-116", "C-120"],
            "The end is damaged and comes again: a faulty end does not count as a record.",
            pushed(
                &[
                    &damaged(&builder, at::END)[..],
                    &builder.bytes[s[at::END]..],
                ]
                .concat(),
            )
            .resume()
            .finish(),
            format!(
                "{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {}, {LAST}",
                crc(at::END)
            ),
        ),
    ]);
    // After damaged tracks, the first group has points of unknown tracks.
    if let Some(case) = all.iter_mut().find(|case| case.name == "damaged-tracks") {
        case.script = pushed(&damaged(&builder, at::TRACK))
            .resume()
            .resume()
            .finish()
            .0;
        case.outline += &format!(
            ", error record 2019 {}, resume yes, {rest}",
            s[at::POINTS] + HEADER
        );
    }
    let mut both = damaged(&builder, at::DELTA);
    both[s[at::LAST_DELTA] + HEADER] ^= 1;
    all.push(case(
        "damaged-twice",
        &["C-115", "C-116"],
        "Two frames of different groups are damaged.",
        pushed(&both).resume().resume().finish(),
        format!(
            "{FIRST}, {}, {THIRD}, group 2 state, {}, {LAST}",
            crc(at::DELTA),
            crc(at::LAST_DELTA)
        ),
    ));
    let mut both = damaged(&builder, at::DELTA);
    both[s[at::SECOND_COMMIT] + HEADER] ^= 1;
    all.push(case(
        "damaged-twice-while-resynchronising",
        &["C-117"],
        "A commit that is skipped anyway is damaged too: no further error.",
        pushed(&both).resume().finish(),
        format!("{FIRST}, {}, {rest}", crc(at::DELTA)),
    ));
    let mut both = damaged(&builder, at::DELTA);
    both[s[at::GROUP_AGAIN] + HEADER] ^= 1;
    all.push(case(
        "damaged-group-while-resynchronising",
        &["C-118", "C-119"],
        "The group that a resynchronisation would find is damaged: it counts, and the resynchronisation goes on.",
        pushed(&both).resume().finish(),
        format!("{FIRST}, {}, {LAST}", crc(at::DELTA)),
    ));
    let mut both = damaged(&builder, at::DELTA);
    both[s[at::TRACK_AGAIN] + HEADER] ^= 1;
    all.push(case("damaged-tracks-while-resynchronising", &["C-118"],
        "Tracks that are live anyway are declared in a damaged record: it counts, and has no other effect.",
        pushed(&both).resume().finish(),
        format!("{FIRST}, {}, {rest}", crc(at::DELTA))));
    // The record comes once more, whole.
    let again = [
        &damaged(&builder, at::TRANSFORMS)[..s[at::SECOND_COMMIT]],
        &builder.bytes[s[at::TRANSFORMS]..],
    ]
    .concat();
    all.push(case(
        "damaged-and-sent-again",
        &["C-116", "C-117"],
        "A damaged record comes again: it counts as declared, so it is one too many.",
        pushed(&again).resume().resume().finish(),
        format!(
            "{FIRST}, {}, error framing 1007 {}, resume yes, {rest}",
            crc(at::TRANSFORMS),
            s[at::SECOND_COMMIT]
        ),
    ));
    // A missing base without a gap: the sender left a frame out.
    let mut plan = long();
    plan.records[at::DELTA].1 = points(Some(0), &[cell(&Entry::new(1), 1, 6, 50)]);
    let builder = plan.start().end().clone();
    all.push(case(
        "missing-base",
        &["P-012", "C-116"],
        "A delta builds on another frame than the last one.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "{FIRST}, error session 4001 {}, resume yes, {rest}",
            builder.starts[at::DELTA] + HEADER
        ),
    ));
}

pub(super) fn damaged_headers(all: &mut Vec<Case>) {
    let rest = format!("{THIRD}, {FOURTH}, {LAST}");
    let mut with = |name,
                    clauses,
                    comment,
                    place,
                    change: fn(&mut Header),
                    resumes: usize,
                    outline: &dyn Fn(usize) -> String| {
        let mut builder = long().builder(place, change);
        builder.end();
        let mut script = pushed(&builder.bytes);
        for _ in 0..resumes {
            script = script.resume();
        }
        all.push(case(
            name,
            clauses,
            comment,
            script.finish(),
            outline(builder.starts[place]),
        ));
    };
    with(
        "header-version",
        &["C-115", "C-116"],
        "A record of a newer version is skipped, and its frame with it.",
        at::DELTA,
        |h| h.version = 1,
        1,
        &|at| format!("{FIRST}, error framing 1021 {at}, resume yes, {rest}"),
    );
    with(
        "header-unknown-critical",
        &["C-013", "C-116"],
        "A critical record of an unknown type is skipped, and its frame with it.",
        at::DELTA,
        |h| h.record_type = 0x25,
        1,
        &|at| format!("{FIRST}, error framing 1022 {at}, resume yes, {rest}"),
    );
    with(
        "header-packing",
        &["C-020", "C-116", "C-117"],
        "A model record in an unknown packing is skipped.",
        at::DELTA,
        |h| h.packing = 9,
        1,
        &|at| format!("{FIRST}, error framing 1010 {at}, resume yes, {rest}"),
    );
    with(
        "header-length",
        &["C-021", "C-116"],
        "A track record whose lengths contradict each other still has a fault in the resynchronisation.",
        at::TRACK_AGAIN,
        |h| h.unpacked += 1,
        1,
        &|at| format!("{FIRST}, {SECOND}, error framing 1014 {at}, resume yes, {rest}"),
    );
    with(
        "header-second-stream",
        &["C-016", "C-116"],
        "A second stream record is skipped.",
        at::DELTA,
        |h| h.record_type = kind::STREAM,
        1,
        &|at| format!("{FIRST}, error session 4007 {at}, resume yes, {rest}"),
    );
    with(
        "header-sequence-below",
        &["C-012", "C-116"],
        "A record that is out of order is skipped; the expected sequence stays.",
        at::DELTA,
        |h| h.sequence = 2,
        1,
        &|at| format!("{FIRST}, error framing 1009 {at}, resume yes, {rest}"),
    );
    with(
        "header-checksum",
        &["C-010", "C-115"],
        "A header is damaged: its length cannot be trusted, and nothing can be resumed.",
        at::DELTA,
        |h| h.header_crc = 1,
        1,
        &|at| {
            format!(
                "{FIRST}, error framing 1005 {at}, resume no, error session 4011 {}",
                at + 32
            )
        },
    );
    with(
        "header-reserved",
        &["C-011", "C-115"],
        "A reserved bit in a header: the framing may be another, and nothing can be resumed.",
        at::DELTA,
        |h| h.reserved = 1,
        1,
        &|at| {
            format!(
                "{FIRST}, error framing 1006 {at}, resume no, error session 4011 {}",
                at + 32
            )
        },
    );
    let mut builder = StreamBuilder::new();
    for (index, (record_type, payload)) in long().records.iter().enumerate() {
        builder.put_with(*record_type, Pack::None, payload, |h| match index {
            at::DELTA => h.sequence = 2,
            at::TRANSFORMS => h.sequence = 3,
            _ => {}
        });
    }
    builder.end();
    let s = &builder.starts;
    all.push(case(
        "expected-after-an-old-header",
        &["C-116", "C-117"],
        "An old record comes, and the one after it: the expected sequence is not taken from the first, so the second is old too.",
        pushed(&builder.bytes).resume().resume().finish(),
        format!(
            "{FIRST}, error framing 1009 {}, resume yes, error framing 1009 {}, resume yes, {rest}",
            s[at::DELTA],
            s[at::TRANSFORMS]
        ),
    ));
    // Twice: the resynchronisation meets an unknown critical record.
    let mut builder = StreamBuilder::new();
    for (index, (record_type, payload)) in long().records.iter().enumerate() {
        let unknown = matches!(index, at::DELTA | at::SECOND_COMMIT);
        builder.put_with(*record_type, Pack::None, payload, |h| {
            if unknown {
                h.record_type = 0x25;
            }
        });
    }
    builder.end();
    let s = &builder.starts;
    all.push(case(
        "header-unknown-critical-while-resynchronising",
        &["C-013", "C-117"],
        "A resynchronisation meets another critical record of an unknown type, and says so.",
        pushed(&builder.bytes).resume().resume().finish(),
        format!(
            "{FIRST}, error framing 1022 {}, resume yes, error framing 1022 {}, resume yes, {rest}",
            s[at::DELTA],
            s[at::SECOND_COMMIT]
        ),
    ));
    // Passed over without a look at lengths and packing.
    let mut builder = StreamBuilder::new();
    for (index, (record_type, payload)) in long().records.iter().enumerate() {
        builder.put_with(*record_type, Pack::None, payload, |h| match index {
            at::DELTA => h.version = 1,
            at::TRANSFORMS => (h.packing, h.unpacked) = (77, u32::MAX),
            at::SECOND_COMMIT => h.payload_crc ^= 1,
            _ => {}
        });
    }
    builder.end();
    all.push(case(
        "header-not-checked-while-resynchronising",
        &["C-117"],
        "Packing, lengths and CRC of records that are skipped are not looked at.",
        pushed(&builder.bytes).resume().finish(),
        format!(
            "{FIRST}, error framing 1021 {}, resume yes, {rest}",
            builder.starts[at::DELTA]
        ),
    ));
}
