//! Session scripts: loss, failed frames, resuming, resetting. What each comes to is stated here by
//! hand, in outline; a test holds our decoder against it.

mod baked;
mod failures;
mod faults;
mod loss;
mod probes;

use crate::generate::Draft;
use crate::generate::container::empty_frame;
use crate::generate::plan::{AREA, Plan, cell, digest, two_tracks};
use crate::models::entry::tracks;
use crate::models::instances::writer::Table;
use crate::models::points::writer::points;
use crate::models::regions::writer::Set;
use crate::models::vertices::writer::Vertices;
use crate::stream_builder::{HEADER, StreamBuilder, commit, group, kind};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    drafts.extend(
        cases()
            .into_iter()
            .map(|c| Draft::session(c.area, &c.name, &c.clauses, &c.comment, c.script)),
    );
}

/// A session.
struct Case {
    area: &'static str,
    name: String,
    clauses: Vec<&'static str>,
    comment: String,
    script: Vec<u8>,
    /// Its transcript without what a frame holds, without digests, on one line.
    outline: String,
}

fn case(
    name: &str,
    clauses: &[&'static str],
    comment: &str,
    script: Script,
    outline: String,
) -> Case {
    Case {
        area: AREA,
        name: name.to_string(),
        clauses: clauses.to_vec(),
        comment: comment.to_string(),
        script: script.0,
        outline,
    }
}

/// A script under construction.
#[derive(Clone, Default)]
struct Script(Vec<u8>);

impl Script {
    fn push(mut self, bytes: &[u8]) -> Script {
        self.0.extend(format!("push {}\n", bytes.len()).bytes());
        self.0.extend(bytes);
        self
    }

    fn word(mut self, word: &str) -> Script {
        self.0.extend(format!("{word}\n").bytes());
        self
    }

    fn resume(self) -> Script {
        self.word("resume")
    }

    fn finish(self) -> Script {
        self.word("finish")
    }
}

fn pushed(bytes: &[u8]) -> Script {
    Script::default().push(bytes)
}

fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    loss::lost(&mut all);
    loss::late_join(&mut all);
    loss::damaged_payloads(&mut all);
    loss::damaged_headers(&mut all);
    failures::failed_frames(&mut all);
    failures::tracks_in_lost_stretches(&mut all);
    failures::ends(&mut all);
    failures::sequences(&mut all);
    faults::while_resynchronising(&mut all);
    faults::of_later_entries(&mut all);
    control(&mut all);
    pieces(&mut all);
    probes::probes(&mut all);
    baked::baked::<Vertices>(&mut all);
    baked::baked::<Table>(&mut all);
    baked::baked::<Set>(&mut all);
    all
}

/// Places of the records of [`long`].
mod at {
    pub const TRACK: usize = 1;
    pub const POINTS: usize = 3;
    pub const DELTA: usize = 6;
    pub const TRANSFORMS: usize = 7;
    pub const SECOND_COMMIT: usize = 8;
    pub const TRACK_AGAIN: usize = 9;
    pub const GROUP_AGAIN: usize = 10;
    pub const KEYFRAME: usize = 11;
    pub const THIRD_COMMIT: usize = 12;
    pub const GROUP_ON_STATE: usize = 13;
    pub const LAST_DELTA: usize = 14;
    pub const LAST_COMMIT: usize = 15;
    pub const END: usize = 16;
}

/// Three groups: frames 1 and 2, frame 3 from keyframes with its tracks declared again, frame 4 on
/// the state of frame 3.
fn long() -> Plan {
    let [first, second] = two_tracks();
    let third = cell(&first, 2, 9, 33);
    let state = digest(&[(1, None, Some(&third)), (2, None, None)]);
    Plan::usual()
        .up_to(at::TRACK_AGAIN)
        .then(kind::TRACK, tracks(&[first.clone(), second]))
        .then(kind::GROUP, group(1, 0, 0))
        .then(kind::POINTS, points(None, &[third]))
        .then(kind::COMMIT, commit(5, 3, None))
        .then(kind::GROUP, group(2, 1, state))
        .then(kind::POINTS, points(Some(3), &[cell(&first, 1, 6, 50)]))
        .then(kind::COMMIT, commit(6, 4, None))
}

/// What the parts of [`long`] come to.
const FIRST: &str = "stream 60 1, group 0 keyframes, frame 1 3";
const SECOND: &str = "frame 2 4";
const THIRD: &str = "group 1 keyframes, frame 3 5";
const FOURTH: &str = "group 2 state, frame 4 6";
const LAST: &str = "end, finished";

/// The long stream with its `end`.
fn whole() -> StreamBuilder {
    long().start().end().clone()
}

/// Bytes without the records `first` to `last`.
fn without(builder: &StreamBuilder, first: usize, last: usize) -> Vec<u8> {
    let (from, to) = (builder.starts[first], builder.starts[last + 1]);
    [&builder.bytes[..from], &builder.bytes[to..]].concat()
}

/// Bytes with the lowest bit of a record's first payload byte flipped.
fn damaged(builder: &StreamBuilder, at: usize) -> Vec<u8> {
    let mut bytes = builder.bytes.clone();
    bytes[builder.starts[at] + HEADER] ^= 1;
    bytes
}

/// Reset, and what is refused after an error.
fn control(all: &mut Vec<Case>) {
    let builder = whole();
    let s = &builder.starts;
    let small = empty_frame().ended();
    let other = format!("reset, stream 60 1, group 0 keyframes, frame 0 0, {LAST}");
    let reset = |script: Script| script.word("reset").push(&small).finish();
    all.extend([
        case("reset-in-frame", &["C-114"],
            "A reset within a frame, and another stream.",
            reset(pushed(&builder.bytes[..s[at::SECOND_COMMIT] + 5])), format!("{FIRST}, {other}")),
        case("reset-in-preamble", &["C-114"],
            "A reset within a preamble, and another stream.",
            reset(pushed(&builder.bytes[..7])), other.clone()),
        case("reset-after-end", &["C-114"],
            "A reset after the end, and another stream.",
            reset(pushed(&builder.bytes).finish()),
            format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}, {other}")),
        case("reset-after-lost-framing", &["C-114", "C-115"],
            "Nothing can be resumed after a damaged header; a reset helps.",
            reset({
                let mut bytes = builder.bytes.clone();
                bytes[s[at::DELTA] + 16] ^= 0x80;
                pushed(&bytes).resume()
            }),
            format!("{FIRST}, error framing 1005 {}, resume no, {other}", s[at::DELTA])),
        case("reset-while-resynchronising", &["C-114"],
            "A reset in a resynchronisation: the next stream's totals are checked again.",
            {
                let mut wrong = small.clone();
                let at = wrong.len() - 16;
                wrong[at] ^= 1;
                let cut = without(&builder, at::DELTA, at::DELTA);
                let mut fixed = empty_frame();
                let mut end = fixed.end_payload();
                end[0] ^= 1;
                fixed.put(kind::END, &end);
                pushed(&cut[..s[at::TRANSFORMS]]).resume().word("reset").push(&fixed.bytes)
            },
            format!("{FIRST}, error framing 1008 {}, resume yes, reset, stream 60 1, group 0 keyframes, frame 0 0, error framing 1024 {}",
                s[at::DELTA], small.len() - 16)),
        case("reset-forgets-tracks", &["C-114", "C-074"],
            "After a reset, ids may be used again and frames start anew.",
            pushed(&builder.bytes).word("reset").push(&builder.bytes).finish(),
            format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}, end, reset, {FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}")),
        case("push-after-error", &["C-114"],
            "What is pushed after an error, before resuming, is refused and lost; what the error left is not.",
            pushed(&damaged(&builder, at::DELTA)).push(b"lost").resume().finish(),
            {
                let at = s[at::DELTA] + HEADER;
                format!("{FIRST}, error framing 1011 {at}, error session 4011 {}, resume yes, {THIRD}, {FOURTH}, {LAST}",
                    s[at::TRANSFORMS])
            }),
        case("finish-after-error", &["C-114"],
            "A stream that stopped at an error cannot be finished.",
            pushed(&damaged(&builder, at::DELTA)).finish(),
            format!("{FIRST}, error framing 1011 {}, error session 4011 {}",
                s[at::DELTA] + HEADER, s[at::TRANSFORMS])),
    ]);
    // An unknown critical record without a payload: what it is looked at again for is there at once.
    let mut unknown = empty_frame();
    unknown.put(0x11, &[]);
    all.push(case(
        "resume-over-an-empty-payload",
        &["C-116", "C-121"],
        "A record whose header is at fault has no payload: after the resume the decoder stands between two records.",
        pushed(&unknown.bytes).resume().word("finish-live"),
        format!(
            "stream 60 1, group 0 keyframes, frame 0 0, error framing 1022 {}, resume yes, finished",
            unknown.last()
        ),
    ));
    // The input ends everywhere, each time of a new stream.
    let places = [
        (0, "error framing 1019 0", "error framing 1019 0"),
        (3, "error framing 1019 3", "error framing 1019 3"),
        (16, "error framing 1019 16", "error framing 1019 16"),
        (55, "error framing 1019 55", "error framing 1019 55"),
        (
            56,
            "stream 60 1, error framing 1019 56",
            "stream 60 1, finished",
        ),
        (
            60,
            "stream 60 1, error framing 1019 60",
            "stream 60 1, error framing 1019 60",
        ),
        (
            104,
            "stream 60 1, group 0 keyframes, error framing 1019 104",
            "stream 60 1, group 0 keyframes, error session 4006 104",
        ),
        (
            105,
            "stream 60 1, group 0 keyframes, error framing 1019 105",
            "stream 60 1, group 0 keyframes, error framing 1019 105",
        ),
        (
            152,
            "stream 60 1, group 0 keyframes, frame 0 0, error framing 1019 152",
            "stream 60 1, group 0 keyframes, frame 0 0, finished",
        ),
        (
            199,
            "stream 60 1, group 0 keyframes, frame 0 0, error framing 1019 199",
            "stream 60 1, group 0 keyframes, frame 0 0, error framing 1019 199",
        ),
        (
            200,
            "stream 60 1, group 0 keyframes, frame 0 0, end, finished",
            "stream 60 1, group 0 keyframes, frame 0 0, end, finished",
        ),
    ];
    for (name, word, live) in [
        ("finish-everywhere", "finish", false),
        ("finish-live-everywhere", "finish-live", true),
    ] {
        let (mut script, mut outlines) = (Script::default(), Vec::new());
        for (length, plain, of_live) in places {
            script = script.push(&small[..length]).word(word).word("reset");
            outlines.extend([if live { of_live } else { plain }, "reset"]);
        }
        all.push(case(
            name,
            &["C-103", "C-104"],
            "The input ends before, within and after each record of a small stream.",
            script,
            outlines.join(", "),
        ));
    }
}

/// Input in small pieces.
fn pieces(all: &mut Vec<Case>) {
    let small = empty_frame().ended();
    let mut script = Script::default();
    for byte in &small {
        script = script.push(&[*byte]);
    }
    all.push(case(
        "pieces-of-a-byte",
        &["C-111"],
        "A stream byte by byte.",
        script.finish(),
        format!("stream 60 1, group 0 keyframes, frame 0 0, {LAST}"),
    ));
    let builder = whole();
    let mut script = Script::default();
    for piece in builder.bytes.chunks(11) {
        script = script.push(piece).push(&[]);
    }
    all.push(case(
        "pieces-of-eleven",
        &["C-111"],
        "A stream in pieces of eleven bytes, with empty ones between.",
        script.finish(),
        format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}"),
    ));
    // The error shows when the payload is whole; then the rest comes in pieces too.
    let bytes = damaged(&builder, at::TRANSFORMS);
    let fault = builder.starts[at::SECOND_COMMIT];
    let mut script = Script::default();
    for piece in bytes[..fault].chunks(23) {
        script = script.push(piece);
    }
    script = script.resume();
    for piece in bytes[fault..].chunks(23) {
        script = script.push(piece);
    }
    all.push(case(
        "pieces-and-resynchronisation",
        &["C-111", "C-116"],
        "A damaged stream in pieces of 23 bytes: the same as in one piece.",
        script.finish(),
        format!(
            "{FIRST}, error framing 1011 {}, resume yes, {THIRD}, {FOURTH}, {LAST}",
            builder.starts[at::TRANSFORMS] + HEADER
        ),
    ));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Arguments, Mode, Program as _};
    use crate::reference::Reference;

    /// A transcript without what frames hold, without digests, on one line.
    fn outline(transcript: &str) -> String {
        let steps = transcript.lines().filter_map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            match words[0] {
                "dapple-dump" | "track" | "transform" | "grid" | "bucket" => None,
                "volume" | "probe" | "values" | "visibility" => None,
                "vertices" | "vertex" | "instances" | "entry" | "regions" | "region" => None,
                "frame" => Some(words[..3].join(" ")),
                "group" => Some(words[..3].join(" ")),
                _ => Some(line.to_string()),
            }
        });
        steps.collect::<Vec<_>>().join(", ")
    }

    #[test]
    fn sessions_come_to_what_they_say() {
        let arguments = Arguments {
            mode: Mode::Session,
            ..Arguments::default()
        };
        let mut wrong = Vec::new();
        for case in cases() {
            let answer = Reference::default()
                .request(&arguments, &case.script)
                .unwrap();
            let found = outline(&String::from_utf8(answer.output).unwrap());
            if found != case.outline {
                wrong.push(format!(
                    "{}:\n  says {}\n  gives {found}",
                    case.name, case.outline
                ));
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}
