//! Session scripts: loss, failed frames, resuming, resetting. What each comes to is stated here by
//! hand, in outline; a test holds our decoder against it.

use super::Draft;
use super::container::empty_frame;
use super::plan::{AREA, Plan, cell, digest, moved, two_tracks};
use crate::forge::{
    Entry, Forge, HEADER, Header, Pack, Part, commit, group, kind, points, removal, tracks,
    transforms, words,
};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    drafts.extend(
        cases()
            .into_iter()
            .map(|case| Draft::session(AREA, &case.name, case.clauses, &case.comment, case.script)),
    );
}

/// A session.
struct Case {
    name: String,
    clauses: &'static [&'static str],
    comment: String,
    script: Vec<u8>,
    /// Its transcript without what a frame holds, without digests, on one line.
    #[cfg_attr(not(test), expect(dead_code))]
    outline: String,
}

fn case(
    name: &str,
    clauses: &'static [&'static str],
    comment: &str,
    script: Script,
    outline: String,
) -> Case {
    Case {
        name: name.to_string(),
        clauses,
        comment: comment.to_string(),
        script: script.0,
        outline,
    }
}

/// A script in the making.
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
    lost(&mut all);
    late_join(&mut all);
    damaged_payloads(&mut all);
    damaged_headers(&mut all);
    failed_frames(&mut all);
    tracks_in_lost_stretches(&mut all);
    ends(&mut all);
    sequences(&mut all);
    control(&mut all);
    pieces(&mut all);
    all
}

/// Places of the records of [`long`].
mod at {
    pub const TRACK: usize = 1;
    pub const POINTS: usize = 3;
    pub const COMMIT: usize = 5;
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
fn whole() -> Forge {
    long().start().end().clone()
}

/// Bytes without the records `first` to `last`.
fn without(forge: &Forge, first: usize, last: usize) -> Vec<u8> {
    let (from, to) = (forge.starts[first], forge.starts[last + 1]);
    [&forge.bytes[..from], &forge.bytes[to..]].concat()
}

/// Bytes with the lowest bit of a record's first payload byte flipped.
fn damaged(forge: &Forge, at: usize) -> Vec<u8> {
    let mut bytes = forge.bytes.clone();
    bytes[forge.starts[at] + HEADER] ^= 1;
    bytes
}

fn lost(all: &mut Vec<Case>) {
    let forge = whole();
    let s = &forge.starts;
    let once = |first, last| pushed(&without(&forge, first, last)).resume().finish();
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
            "All records before a group are lost: the group's own header shows the gap and ends the search.",
            once(at::DELTA, at::TRACK_AGAIN),
            format!("{FIRST}, {}, {rest}", cut(at::DELTA))),
        case("lost-group", &["C-119", "C-120", "C-063"],
            "A group from keyframes is lost: the next one builds on a state that is not there, up to the end.",
            once(at::TRACK_AGAIN, at::THIRD_COMMIT),
            format!("{FIRST}, {SECOND}, {}, {LAST}", cut(at::TRACK_AGAIN))),
        case("lost-group-record", &["C-117", "C-119"],
            "The record that starts a group is lost: its frame is passed over.",
            once(at::GROUP_AGAIN, at::GROUP_AGAIN),
            format!("{FIRST}, {SECOND}, {}, {LAST}", cut(at::GROUP_AGAIN))),
        case("lost-twice", &["C-115", "C-117"],
            "Records are lost in two frames, with a group between.",
            {
                let mut bytes = without(&forge, at::LAST_DELTA, at::LAST_DELTA);
                bytes.drain(s[at::DELTA]..s[at::TRANSFORMS]);
                pushed(&bytes).resume().resume().finish()
            },
            {
                let second = s[at::LAST_DELTA] - (s[at::TRANSFORMS] - s[at::DELTA]);
                format!("{FIRST}, {}, {THIRD}, group 2 state, error framing 1008 {second}, resume yes, {LAST}",
                    cut(at::DELTA))
            }),
        case("lost-twice-in-a-search", &["C-117"],
            "Records are lost in a stretch that is passed over anyway: no further error.",
            {
                let mut bytes = without(&forge, at::SECOND_COMMIT, at::SECOND_COMMIT);
                bytes.drain(s[at::DELTA]..s[at::TRANSFORMS]);
                pushed(&bytes).resume().finish()
            },
            format!("{FIRST}, {}, {rest}", cut(at::DELTA))),
        case("lost-live", &["C-121"],
            "A live stream ends while a group is searched for.",
            pushed(&without(&forge, at::DELTA, at::DELTA)[..s[at::SECOND_COMMIT]])
                .resume()
                .word("finish-live"),
            String::new()),
    ]);
    // Of that one: the commit is missing in what came.
    let live = pushed(
        &without(&forge, at::DELTA, at::DELTA)
            [..s[at::TRACK_AGAIN] - (s[at::TRANSFORMS] - s[at::DELTA])],
    );
    if let Some(last) = all.last_mut() {
        last.script = live.resume().word("finish-live").0;
        last.outline = format!("{FIRST}, {}, finished", cut(at::DELTA));
    }
}

fn late_join(all: &mut Vec<Case>) {
    let forge = whole();
    let s = &forge.starts;
    // The preamble and the stream record come first, as a server sends them to one who joins.
    let head = &forge.bytes[..s[at::TRACK]];
    let joined = |from: usize| [head, &forge.bytes[s[from]..]].concat();
    let gap = format!("stream 60 1, error framing 1008 {}, resume yes", head.len());
    all.extend([
        case("late-join", &["C-117", "C-118", "C-119"],
            "One joins where tracks are declared again, before a group from keyframes.",
            pushed(&joined(at::TRACK_AGAIN)).resume().finish(),
            format!("{gap}, {THIRD}, {FOURTH}, {LAST}")),
        case("late-join-in-a-frame", &["C-117", "C-119"],
            "One joins within a frame, which is passed over.",
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
            "One joins after the preamble, without a stream record: each record asked for is refused.",
            pushed(&[&forge.bytes[..16], &forge.bytes[s[at::GROUP_ON_STATE]..]].concat())
                .resume().resume(),
            format!("error framing 1008 16, resume yes, error session 4007 16, resume yes, error session 4007 {}",
                16 + (s[at::LAST_DELTA] - s[at::GROUP_ON_STATE]))),
        case("late-join-without-preamble", &["C-115", "C-001"],
            "One joins without a preamble: the framing cannot be found.",
            pushed(&forge.bytes[s[at::TRACK_AGAIN]..]).resume(),
            "error framing 1001 0, resume no".to_string()),
    ]);
}

fn damaged_payloads(all: &mut Vec<Case>) {
    let forge = whole();
    let s = &forge.starts;
    let once = |place| pushed(&damaged(&forge, place)).resume().finish();
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
            "The start of a group is damaged: its frame is passed over, and so is the next group.",
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
            pushed(&damaged(&forge, 0)).resume(),
            format!("{}, error session 4007 {}", crc(0), s[at::TRACK]),
        ),
        case(
            "damaged-end",
            &["C-116", "C-103"],
            "The end is damaged: after a search the stream is cut off.",
            once(at::END),
            format!(
                "{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {}, error framing 1019 {}",
                crc(at::END),
                forge.bytes.len()
            ),
        ),
        case(
            "damaged-end-sent-again",
            &["C-116", "C-120"],
            "The end is damaged and comes again: a faulty end does not count as a record.",
            pushed(&[&damaged(&forge, at::END)[..], &forge.bytes[s[at::END]..]].concat())
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
        case.script = pushed(&damaged(&forge, at::TRACK))
            .resume()
            .resume()
            .finish()
            .0;
        case.outline += &format!(
            ", error record 2019 {}, resume yes, {rest}",
            s[at::POINTS] + HEADER
        );
    }
    let mut both = damaged(&forge, at::DELTA);
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
    let mut both = damaged(&forge, at::DELTA);
    both[s[at::SECOND_COMMIT] + HEADER] ^= 1;
    all.push(case(
        "damaged-twice-in-a-search",
        &["C-117"],
        "A commit that is passed over anyway is damaged too: no further error.",
        pushed(&both).resume().finish(),
        format!("{FIRST}, {}, {rest}", crc(at::DELTA)),
    ));
    let mut both = damaged(&forge, at::DELTA);
    both[s[at::GROUP_AGAIN] + HEADER] ^= 1;
    all.push(case(
        "damaged-group-in-a-search",
        &["C-118", "C-119"],
        "The group that a search would find is damaged: it is as if it had not come.",
        pushed(&both).resume().finish(),
        format!("{FIRST}, {}, {LAST}", crc(at::DELTA)),
    ));
    let mut both = damaged(&forge, at::DELTA);
    both[s[at::TRACK_AGAIN] + HEADER] ^= 1;
    all.push(case("damaged-tracks-in-a-search", &["C-118"],
        "Tracks that are live anyway are declared in a damaged record: it is as if it had not come.",
        pushed(&both).resume().finish(),
        format!("{FIRST}, {}, {rest}", crc(at::DELTA))));
    // The record comes once more, whole.
    let again = [
        &damaged(&forge, at::TRANSFORMS)[..s[at::SECOND_COMMIT]],
        &forge.bytes[s[at::TRANSFORMS]..],
    ]
    .concat();
    all.push(case(
        "damaged-and-sent-again",
        &["C-116", "C-117"],
        "A damaged record comes again: it counts as come, so it is one too many.",
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
    let forge = plan.start().end().clone();
    all.push(case(
        "missing-base",
        &["P-012", "C-116"],
        "A delta builds on another frame than the last one.",
        pushed(&forge.bytes).resume().finish(),
        format!(
            "{FIRST}, error session 4001 {}, resume yes, {rest}",
            forge.starts[at::DELTA] + HEADER
        ),
    ));
}

fn damaged_headers(all: &mut Vec<Case>) {
    let rest = format!("{THIRD}, {FOURTH}, {LAST}");
    let mut with = |name,
                    clauses,
                    comment,
                    place,
                    change: fn(&mut Header),
                    resumes: usize,
                    outline: &dyn Fn(usize) -> String| {
        let mut forge = long().forge(place, change);
        forge.end();
        let mut script = pushed(&forge.bytes);
        for _ in 0..resumes {
            script = script.resume();
        }
        all.push(case(
            name,
            clauses,
            comment,
            script.finish(),
            outline(forge.starts[place]),
        ));
    };
    with(
        "header-version",
        &["C-115", "C-116"],
        "A record of a newer version is passed over, and its frame with it.",
        at::DELTA,
        |h| h.version = 1,
        1,
        &|at| format!("{FIRST}, error framing 1021 {at}, resume yes, {rest}"),
    );
    with(
        "header-unknown-critical",
        &["C-013", "C-116"],
        "A critical record of an unknown type is passed over, and its frame with it.",
        at::DELTA,
        |h| h.record_type = 0x21,
        1,
        &|at| format!("{FIRST}, error framing 1022 {at}, resume yes, {rest}"),
    );
    with(
        "header-packing",
        &["C-020", "C-116", "C-117"],
        "A model record in an unknown packing is passed over.",
        at::DELTA,
        |h| h.packing = 9,
        1,
        &|at| format!("{FIRST}, error framing 1010 {at}, resume yes, {rest}"),
    );
    with(
        "header-length",
        &["C-021", "C-116"],
        "A track record whose lengths contradict each other still has a fault in the search.",
        at::TRACK_AGAIN,
        |h| h.unpacked += 1,
        1,
        &|at| format!("{FIRST}, {SECOND}, error framing 1014 {at}, resume yes, {rest}"),
    );
    with(
        "header-second-stream",
        &["C-016", "C-116"],
        "A second stream record is passed over.",
        at::DELTA,
        |h| h.record_type = kind::STREAM,
        1,
        &|at| format!("{FIRST}, error session 4007 {at}, resume yes, {rest}"),
    );
    with(
        "header-sequence-below",
        &["C-012", "C-116"],
        "A record that is out of order is passed over; the sequence due stays.",
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
    // Twice: the search meets an unknown critical record.
    let mut forge = Forge::new();
    for (index, (record_type, payload)) in long().records.iter().enumerate() {
        let unknown = matches!(index, at::DELTA | at::SECOND_COMMIT);
        forge.put_with(*record_type, Pack::None, payload, |h| {
            if unknown {
                h.record_type = 0x22;
            }
        });
    }
    forge.end();
    let s = &forge.starts;
    all.push(case(
        "header-unknown-critical-in-a-search",
        &["C-013", "C-117"],
        "A search meets another critical record of an unknown type, and says so.",
        pushed(&forge.bytes).resume().resume().finish(),
        format!(
            "{FIRST}, error framing 1022 {}, resume yes, error framing 1022 {}, resume yes, {rest}",
            s[at::DELTA],
            s[at::SECOND_COMMIT]
        ),
    ));
    // Passed over without a look at lengths and packing.
    let mut forge = Forge::new();
    for (index, (record_type, payload)) in long().records.iter().enumerate() {
        forge.put_with(*record_type, Pack::None, payload, |h| match index {
            at::DELTA => h.version = 1,
            at::TRANSFORMS => (h.packing, h.unpacked) = (77, u32::MAX),
            at::SECOND_COMMIT => h.payload_crc ^= 1,
            _ => {}
        });
    }
    forge.end();
    all.push(case(
        "header-not-looked-at-in-a-search",
        &["C-117"],
        "Packing, lengths and CRC of records that are passed over are not looked at.",
        pushed(&forge.bytes).resume().finish(),
        format!(
            "{FIRST}, error framing 1021 {}, resume yes, {rest}",
            forge.starts[at::DELTA]
        ),
    ));
}

/// A frame that fails at its end, or within: the state is that of the frame before, bit for bit,
/// as the digest of the next group shows, and its delta.
fn failed_frames(all: &mut Vec<Case>) {
    let [first, second] = two_tracks();
    let (part, other) = (cell(&first, 0, 5, 200), cell(&second, 0, 7, 100));
    let state = digest(&[
        (1, Some(moved(1.0)), Some(&part)),
        (2, Some(moved(2.0)), Some(&other)),
    ]);
    let keyframes = || points(None, &[cell(&first, 0, 9, 1), cell(&second, 3, 2, 2)]);
    let wrong: Part = Part::of(&second).bucket(4, &[0]);
    let moves = || transforms(&[(1, moved(-1.0)), (2, moved(-2.0))]);
    let frames: [(&str, &str, &str, Vec<(u16, Vec<u8>)>); 8] = [
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
        let forge = plan
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
            pushed(&forge.bytes).resume().finish(),
            format!(
                "{FIRST}{started}, error {error} {}, resume yes, group 2 state, frame 3 5, {LAST}",
                forge.starts[failing] + HEADER
            ),
        ));
    }
}

/// Declarations and removals that come in a stretch that is passed over, or are lost with it.
fn tracks_in_lost_stretches(all: &mut Vec<Case>) {
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
    let points_at = |forge: &Forge| forge.starts[10] + HEADER;
    let shorter = declare.starts[8] - declare.starts[6];
    all.extend([
        case("remove-in-lost-stretch", &["C-118", "C-081"],
            "A removal comes in a stretch that is passed over: the track ends at the next commit.",
            pushed(&damaged(&remove, 6)).resume().finish(),
            format!("{FIRST}, {crc}, {rest}")),
        case("remove-lost", &["C-062", "C-118"],
            "A removal is lost: the track stays, and is empty after the next group.",
            pushed(&without(&remove, 6, 7)).resume().finish(),
            format!("{FIRST}, {gap}, {rest}")),
        case("declare-in-lost-stretch", &["C-118", "C-079"],
            "A track is declared in a stretch that is passed over: the next group has content of it.",
            pushed(&damaged(&declare, 6)).resume().finish(),
            format!("{FIRST}, {crc}, {rest}")),
        case("declare-lost", &["C-118", "P-013"],
            "The declaration of a track is lost: the next group names an unknown track.",
            pushed(&without(&declare, 6, 7)).resume().resume().finish(),
            format!("{FIRST}, {gap}, group 1 keyframes, error record 2019 {}, resume yes, {LAST}",
                points_at(&declare) - shorter)),
        case("declare-changed-in-lost-stretch", &["C-118", "C-075"],
            "A live track is declared with other content in a search: the record is as if it had not come.",
            {
                let changed = Entry { radius: 0.125, ..Entry::new(1) };
                let forge = stream((kind::TRACK, tracks(&[changed])), &kept);
                pushed(&damaged(&forge, 6)).resume().finish()
            },
            format!("{FIRST}, {crc}, {rest}")),
        case("declare-after-failed-frame", &["C-110", "C-079"],
            "A track that was declared in a frame that failed stays declared.",
            {
                let forge = Plan::usual()
                    .up_to(6)
                    .then(kind::TRACK, tracks(std::slice::from_ref(&new)))
                    .then(kind::COMMIT, commit(4, 1, None))
                    .then(kind::GROUP, group(1, 0, 0))
                    .then(kind::POINTS, points(None, &grown))
                    .then(kind::COMMIT, commit(5, 3, None))
                    .start()
                    .ended();
                pushed(&forge).resume().finish()
            },
            {
                let at = Plan::usual().up_to(6).start().bytes.len();
                let track = HEADER + tracks(std::slice::from_ref(&new)).len();
                format!("{FIRST}, error session 4003 {}, resume yes, {rest}", at + track + HEADER)
            }),
        case("remove-after-failed-frame", &["C-110", "C-081"],
            "A track that was removed in a frame that failed ends at the next commit.",
            {
                let forge = Plan::usual()
                    .up_to(6)
                    .then(kind::TRACK_REMOVE, removal(&[1]))
                    .then(kind::COMMIT, commit(4, 1, None))
                    .then(kind::GROUP, group(1, 0, 0))
                    .then(kind::POINTS, points(None, &kept))
                    .then(kind::COMMIT, commit(5, 3, None))
                    .start()
                    .ended();
                pushed(&forge).resume().finish()
            },
            {
                let at = Plan::usual().up_to(6).start().bytes.len();
                format!("{FIRST}, error session 4003 {}, resume yes, {rest}", at + HEADER + 8 + HEADER)
            }),
        case("declare-faulty-declares-none", &["C-077", "C-110"],
            "The second track of a record has a fault: the first is not declared either.",
            {
                let faulty = Entry { space: 9, ..Entry::new(4) };
                let forge = stream((kind::TRACK, tracks(&[new.clone(), faulty])), &grown);
                pushed(&forge.bytes).resume().resume().finish()
            },
            {
                let faulty = Entry { space: 9, ..Entry::new(4) };
                let forge = stream((kind::TRACK, tracks(&[new.clone(), faulty])), &grown);
                format!("{FIRST}, error record 2020 {}, resume yes, group 1 keyframes, error record 2019 {}, resume yes, {LAST}",
                    forge.starts[7] + HEADER, points_at(&forge))
            }),
    ]);
}

/// The end of a stream that has lost records.
fn ends(all: &mut Vec<Case>) {
    let lossy = || {
        let mut plan = long().up_to(at::GROUP_ON_STATE);
        plan.records[at::DELTA].1[0] = 9;
        plan
    };
    let at_delta = lossy().start().starts[at::DELTA] + HEADER;
    // Nine tracks are counted, so that the table is beyond the payload.
    let fault = format!("error codec 3001 {at_delta}, resume yes");
    let totals = |payload: &[u8]| {
        let mut forge = lossy().start();
        forge.put(kind::END, payload);
        forge
    };
    let wrong = totals(&[0xee; 16]);
    all.push(case(
        "end-totals-after-loss",
        &["C-101", "C-120"],
        "After a search, count and digest of the end are not checked.",
        pushed(&wrong.bytes).resume().finish(),
        format!("{FIRST}, {fault}, {THIRD}, {LAST}"),
    ));
    let short = totals(&[0; 15]);
    all.push(case(
        "end-short-after-loss",
        &["C-040", "C-120"],
        "After a search, the size of the end is still checked.",
        pushed(&short.bytes).resume(),
        format!(
            "{FIRST}, {fault}, {THIRD}, error record 2001 {}",
            short.last() + HEADER
        ),
    ));
    let mut plan = lossy();
    plan.records.truncate(at::TRACK_AGAIN);
    let mut forge = plan.start();
    forge.put(kind::END, &[0; 15]);
    all.push(case(
        "end-short-in-a-search",
        &["C-118", "C-120"],
        "In a search, an end of 15 bytes is as if it had not come.",
        pushed(&forge.bytes).resume().finish(),
        format!("{FIRST}, {fault}, error framing 1019 {}", forge.bytes.len()),
    ));
    let mut forge = lossy().up_to(at::THIRD_COMMIT).start();
    forge.put(kind::END, &[0; 16]);
    all.push(case(
        "end-in-frame-after-loss",
        &["C-100", "C-120"],
        "After a search, an end within a frame is still an error; resumed, it may come again.",
        pushed(&forge.bytes)
            .resume()
            .resume()
            .push(&forge.bytes[forge.last()..])
            .finish(),
        format!(
            "{FIRST}, {fault}, group 1 keyframes, error session 4006 {}, resume yes, {LAST}",
            forge.last() + HEADER
        ),
    ));
    let forge = whole();
    let length = forge.bytes.len();
    let all_of_it = format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}");
    all.push(case(
        "byte-after-end",
        &["C-102", "C-115"],
        "A byte follows the end in the same push; nothing can be resumed.",
        pushed(&[&forge.bytes[..], &[0]].concat()).resume(),
        format!("{all_of_it}, end, error framing 1020 {length}, resume no"),
    ));
    all.push(case(
        "push-after-end",
        &["C-102", "C-115"],
        "The stream was finished, and then a byte comes.",
        pushed(&forge.bytes).finish().push(&[0]).resume(),
        format!("{all_of_it}, {LAST}, error framing 1020 {length}, resume no"),
    ));
    all.push(case(
        "number-held-after-loss",
        &["C-091", "C-119"],
        "After a search, frame numbers are still held against the last commit.",
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
        "tick-held-after-loss",
        &["C-092", "C-119"],
        "After a search, ticks are still held against the last commit.",
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
fn sequences(all: &mut Vec<Case>) {
    let mut forge = empty_frame();
    let start = forge.bytes.len();
    for (record_type, payload) in [
        (kind::GROUP, group(1, 0, 0)),
        (kind::COMMIT, commit(1, 1, None)),
        (kind::END, vec![0; 16]),
    ] {
        forge.put_with(record_type, Pack::None, &payload, |h| h.sequence = u64::MAX);
    }
    all.push(case("sequence-at-its-most", &["C-117"],
        "A group found in a search has the largest sequence; no larger one can be due.",
        pushed(&forge.bytes).resume().finish(),
        format!("stream 60 1, group 0 keyframes, frame 0 0, error framing 1008 {start}, resume yes, group 1 keyframes, frame 1 1, {LAST}")));
    let mut forge = Forge::new();
    forge
        .put_with(kind::STREAM, Pack::None, &words(&[60, 1]), |h| {
            h.payload_crc ^= 1
        })
        .put(kind::STREAM, &words(&[50, 1]))
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None))
        .end();
    all.push(case(
        "stream-again-in-a-search",
        &["C-118", "C-016"],
        "The stream record is damaged and comes again, with the next sequence.",
        pushed(&forge.bytes).resume().finish(),
        format!(
            "error framing 1011 48, resume yes, stream 50 1, group 0 keyframes, frame 0 0, {LAST}"
        ),
    ));
}

/// Reset, and what is refused after an error.
fn control(all: &mut Vec<Case>) {
    let forge = whole();
    let s = &forge.starts;
    let small = empty_frame().ended();
    let other = format!("reset, stream 60 1, group 0 keyframes, frame 0 0, {LAST}");
    let reset = |script: Script| script.word("reset").push(&small).finish();
    all.extend([
        case("reset-in-frame", &["C-114"],
            "A reset within a frame, and another stream.",
            reset(pushed(&forge.bytes[..s[at::SECOND_COMMIT] + 5])), format!("{FIRST}, {other}")),
        case("reset-in-preamble", &["C-114"],
            "A reset within a preamble, and another stream.",
            reset(pushed(&forge.bytes[..7])), other.clone()),
        case("reset-after-end", &["C-114"],
            "A reset after the end, and another stream.",
            reset(pushed(&forge.bytes).finish()),
            format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}, {other}")),
        case("reset-after-lost-framing", &["C-114", "C-115"],
            "Nothing can be resumed after a damaged header; a reset helps.",
            reset({
                let mut bytes = forge.bytes.clone();
                bytes[s[at::DELTA] + 16] ^= 0x80;
                pushed(&bytes).resume()
            }),
            format!("{FIRST}, error framing 1005 {}, resume no, {other}", s[at::DELTA])),
        case("reset-in-a-search", &["C-114"],
            "A reset in a search: the next stream's totals are checked again.",
            {
                let mut wrong = small.clone();
                let at = wrong.len() - 16;
                wrong[at] ^= 1;
                let cut = without(&forge, at::DELTA, at::DELTA);
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
            pushed(&forge.bytes).word("reset").push(&forge.bytes).finish(),
            format!("{FIRST}, {SECOND}, {THIRD}, {FOURTH}, end, reset, {FIRST}, {SECOND}, {THIRD}, {FOURTH}, {LAST}")),
        case("push-after-error", &["C-114"],
            "What is pushed after an error, before resuming, is refused and lost; what the error left is not.",
            pushed(&damaged(&forge, at::DELTA)).push(b"lost").resume().finish(),
            {
                let at = s[at::DELTA] + HEADER;
                format!("{FIRST}, error framing 1011 {at}, error session 4011 {}, resume yes, {THIRD}, {FOURTH}, {LAST}",
                    s[at::TRANSFORMS])
            }),
        case("finish-after-error", &["C-114"],
            "A stream that stopped at an error cannot be finished.",
            pushed(&damaged(&forge, at::DELTA)).finish(),
            format!("{FIRST}, error framing 1011 {}, error session 4011 {}",
                s[at::DELTA] + HEADER, s[at::TRANSFORMS])),
    ]);
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
    let forge = whole();
    let mut script = Script::default();
    for piece in forge.bytes.chunks(11) {
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
    let bytes = damaged(&forge, at::TRANSFORMS);
    let fault = forge.starts[at::SECOND_COMMIT];
    let mut script = Script::default();
    for piece in bytes[..fault].chunks(23) {
        script = script.push(piece);
    }
    script = script.resume();
    for piece in bytes[fault..].chunks(23) {
        script = script.push(piece);
    }
    all.push(case(
        "pieces-and-a-search",
        &["C-111", "C-116"],
        "A damaged stream in pieces of 23 bytes: the same as in one piece.",
        script.finish(),
        format!(
            "{FIRST}, error framing 1011 {}, resume yes, {THIRD}, {FOURTH}, {LAST}",
            forge.starts[at::TRANSFORMS] + HEADER
        ),
    ));
    let _ = at::LAST_COMMIT;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{Arguments, Mode, Own, Program as _};

    /// A transcript without what frames hold, without digests, on one line.
    fn outline(transcript: &str) -> String {
        let steps = transcript.lines().filter_map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            match words[0] {
                "dapple-dump" | "track" | "grid" | "transform" | "bucket" => None,
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
            let answer = Own::default().ask(&arguments, &case.script).unwrap();
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
