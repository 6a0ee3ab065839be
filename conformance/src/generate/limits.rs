//! As much as each limit allows, and a step more; claims that are far beyond what is there.

mod claims;
mod state;

use crate::generate::Draft;
use crate::generate::container::empty_frame;
use crate::generate::packing::{FIRST_PAYLOAD, Frame, first_stored, raw};
use crate::generate::plan::{AREA, Plan, at, cell, two_tracks};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind, words};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    record_lengths(drafts);
    frame_bytes(drafts);
    windows(drafts);
    state::track_counts(drafts);
    path_bytes(drafts);
    state::state_bytes(drafts);
    state::state_claims(drafts);
    claims::claims(drafts);
    claims::bombs(drafts);
    claims::counts(drafts);
}

/// A stream that needs exactly `value` of a limit: taken under it, refused under one less.
fn edge(
    drafts: &mut Vec<Draft>,
    (limit, value): (&str, u64),
    (id, name): (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    (offset, bytes): (usize, Vec<u8>),
) {
    let at = format!("{comment} The limit is just enough.");
    let above = format!("{comment} The limit is one too low.");
    let draft = Draft::valid(
        AREA,
        &format!("{name}-at-limit"),
        clauses,
        &at,
        bytes.clone(),
    );
    drafts.push(draft.limit(limit, value));
    let name = format!("{name}-above-limit");
    let draft = Draft::invalid(AREA, (id, &name), offset, clauses, &above, bytes);
    drafts.push(draft.limit(limit, value - 1));
}

/// Offset of the header of a record of a plan, and the stream.
fn header_of(plan: &Plan, at: usize) -> (usize, Vec<u8>) {
    plan.with_header(at, |_| {})
}

/// Offset of the payload of a record of a plan, and the stream.
fn payload_of(plan: Plan, at: usize) -> (usize, Vec<u8>) {
    plan.with_payload(at, |_| {})
}

/// The usual stream with one record packed: offset of its header.
fn usual_packed(at: usize, pack: Pack) -> (usize, Vec<u8>) {
    let mut builder = StreamBuilder::new();
    for (index, (record_type, payload)) in Plan::usual().records.iter().enumerate() {
        let pack = if index == at { pack } else { Pack::None };
        builder.put_packed(*record_type, pack, payload);
    }
    let start = builder.starts[at];
    (start, builder.ended())
}

fn record_lengths(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual();
    // The track record is the largest one.
    let track = usual.records[at::TRACK].1.len() as u64;
    edge(
        drafts,
        ("stored_bytes", track),
        (1012, "stored"),
        &["C-018"],
        "A record is stored in as many bytes as its payload.",
        header_of(&usual, at::TRACK),
    );
    edge(
        drafts,
        ("unpacked_bytes", track),
        (1013, "unpacked"),
        &["C-019"],
        "A record that is not packed.",
        header_of(&usual, at::TRACK),
    );
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(0))] {
        let (start, bytes) = usual_packed(at::TRACK, pack);
        edge(
            drafts,
            ("unpacked_bytes", track),
            (1013, &format!("unpacked-{name}")),
            &["C-019"],
            "A packed record counts as it unpacks.",
            (start, bytes),
        );
        let mut builder = StreamBuilder::started();
        builder.put_packed(kind::TRACK, pack, &usual.records[at::TRACK].1);
        let (start, stored) = (
            builder.last(),
            builder.bytes.len() - builder.last() - HEADER,
        );
        builder
            .put(kind::GROUP, &group(0, 0, 0))
            .put(kind::COMMIT, &commit(0, 0, None));
        edge(
            drafts,
            ("stored_bytes", stored as u64),
            (1012, &format!("stored-{name}")),
            &["C-018"],
            "A packed record counts as it is stored.",
            (start, builder.ended()),
        );
    }
    let mut builder = empty_frame();
    builder.put_with(0x7000, Pack::None, &[0xaa; 300], |h| h.critical = false);
    drafts.push(
        Draft::valid(
            AREA,
            "skipped-beyond-stored",
            &["C-017", "C-018"],
            "A skipped record of 300 bytes counts against no limit.",
            builder.ended(),
        )
        .limit("stored_bytes", 16),
    );
    drafts.push(
        Draft::valid(
            AREA,
            "skipped-beyond-unpacked",
            &["C-017", "C-019"],
            "A skipped record of 300 bytes counts against no limit.",
            builder.ended(),
        )
        .limit("unpacked_bytes", 16),
    );
}

fn frame_bytes(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual;
    let [first, second] = two_tracks();
    let keyframe = usual().records[at::POINTS].1.len() as u64;
    edge(
        drafts,
        ("frame_bytes", keyframe),
        (4009, "frame"),
        &["P-014"],
        "The points of a frame in one record; those of the next frame are counted anew.",
        payload_of(usual(), at::POINTS),
    );
    let empty = usual().insert(at::POINTS, kind::POINTS, points(None, &[]));
    edge(
        drafts,
        ("frame_bytes", keyframe + 16),
        (4009, "frame-of-two-records"),
        &["P-014"],
        "The points of a frame in two records, the first without tracks.",
        payload_of(empty, at::POINTS + 1),
    );
    let mut split = usual();
    split.records[at::POINTS].1 = points(None, &[cell(&first, 0, 5, 200)]);
    let split = split.insert(
        at::TRANSFORMS,
        kind::POINTS,
        points(None, &[cell(&second, 0, 7, 1)]),
    );
    let sum: usize = [at::POINTS, at::POINTS + 1]
        .map(|at| split.records[at].1.len())
        .iter()
        .sum();
    edge(
        drafts,
        ("frame_bytes", sum as u64),
        (4009, "frame-of-two-tracks"),
        &["P-014"],
        "The points of a frame in two records of a track each.",
        payload_of(split, at::POINTS + 1),
    );
    // Each record has a header of 16 bytes and 12 of its track.
    let three = [1, 2, 3].map(Entry::new);
    let mut plan = Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::TRACK, tracks(&three)),
        (kind::GROUP, group(0, 0, 0)),
    ]);
    for entry in &three {
        plan = plan.then(kind::POINTS, points(None, &[Part::of(entry)]));
    }
    edge(
        drafts,
        ("frame_bytes", 84),
        (4009, "frame-of-three-records"),
        &["P-014"],
        "The points of a frame in three records of 28 bytes.",
        payload_of(plan.then(kind::COMMIT, commit(0, 0, None)), at::POINTS + 2),
    );
    for (name, pack) in [("frame-lz4", Pack::Lz4), ("frame-zstd", Pack::Zstd(0))] {
        let (start, bytes) = usual_packed(at::POINTS, pack);
        edge(
            drafts,
            ("frame_bytes", keyframe),
            (4009, name),
            &["P-014"],
            "A packed points record counts as it unpacks.",
            (start + HEADER, bytes),
        );
    }
    let mut ordered = |fault, clauses: &[&'static str], comment, (offset, bytes)| {
        let draft = Draft::invalid(AREA, fault, offset, clauses, comment, bytes);
        drafts.push(draft.limit("frame_bytes", keyframe - 1));
    };
    let (start, bytes) = usual().with_header(at::POINTS, |h| h.payload_crc ^= 1);
    ordered(
        (1011, "checksum-before-frame"),
        &["C-022", "P-014", "C-112"],
        "Points beyond the limit whose CRC does not match: the CRC is checked first.",
        (start + HEADER, bytes),
    );
    ordered(
        (4008, "group-before-frame"),
        &["C-087", "P-014", "C-112"],
        "Points beyond the limit before the first group: the group is checked first.",
        payload_of(
            usual().insert(
                at::GROUP,
                kind::POINTS,
                usual().records[at::POINTS].1.clone(),
            ),
            at::GROUP,
        ),
    );
    ordered(
        (4009, "frame-before-fields"),
        &["P-014", "P-011", "C-112"],
        "Points beyond the limit with a reserved bit set: the limit is checked first.",
        usual().with_payload(at::POINTS, |p| p[12] = 1),
    );
    let mut builder = usual().up_to(at::POINTS).start();
    builder.put_stored(
        kind::POINTS,
        Pack::Lz4,
        keyframe as usize,
        &[0xf0; 40],
        |_| {},
    );
    let offset = builder.last() + HEADER;
    builder.put(kind::COMMIT, &commit(0, 0, None));
    ordered(
        (4009, "frame-before-unpacking"),
        &["P-014", "C-112"],
        "Points beyond the limit that do not unpack: the limit is checked first.",
        (offset, builder.ended()),
    );
}

fn windows(drafts: &mut Vec<Draft>) {
    let rate = words(&[60, 1]);
    let stream = |frame: Frame| {
        (
            FIRST_PAYLOAD,
            first_stored(Pack::Zstd(0), 8, &frame.bytes()),
        )
    };
    let windowed = |descriptor| stream(Frame::windowed(descriptor, 8, raw(true, &rate)));
    let limit = |value| ("zstd_window_bytes", value);
    edge(
        drafts,
        limit(1024),
        (1018, "window-least"),
        &["C-032"],
        "The smallest window that a descriptor can state, 1024 bytes.",
        windowed(0),
    );
    edge(
        drafts,
        limit(1152),
        (1018, "window-mantissa-one"),
        &["C-032"],
        "A window of 1024 bytes and one eighth more.",
        windowed(1),
    );
    edge(
        drafts,
        limit(1920),
        (1018, "window-mantissa-seven"),
        &["C-032"],
        "A window of 1024 bytes and seven eighths more.",
        windowed(7),
    );
    edge(
        drafts,
        limit(2048),
        (1018, "window-exponent-one"),
        &["C-032"],
        "A window of 2048 bytes.",
        windowed(1 << 3),
    );
    edge(
        drafts,
        limit(8),
        (1018, "window-single-segment"),
        &["C-032"],
        "The window of a single segment is its content size.",
        stream(Frame::new(8, raw(true, &rate))),
    );
    let mut above = |name, comment, frame: Frame| {
        let (offset, bytes) = stream(frame);
        drafts.push(
            Draft::invalid(AREA, (1018, name), offset, &["C-032"], comment, bytes)
                .limit("zstd_window_bytes", 8 << 20),
        );
    };
    above(
        "window-nine-mib",
        "A window of 9 MiB in a frame of 8 bytes.",
        Frame::windowed(13 << 3 | 1, 8, raw(true, &rate)),
    );
    above(
        "window-four-gib",
        "A window of 4 GiB, which is 0 in 32 bits.",
        Frame::windowed(22 << 3, 8, raw(true, &rate)),
    );
    above(
        "window-most",
        "The largest window that a descriptor can state.",
        Frame::windowed(0xff, 8, raw(true, &rate)),
    );
    let (start, bytes) = usual_packed(at::POINTS, Pack::Zstd(0));
    drafts.push(
        Draft::invalid(
            AREA,
            (1018, "window-of-points"),
            start + HEADER,
            &["C-032"],
            "A points record of a single segment larger than the window limit.",
            bytes,
        )
        .limit("zstd_window_bytes", 64),
    );
}

fn path_bytes(drafts: &mut Vec<Draft>) {
    edge(
        drafts,
        ("path_bytes", 8),
        (2012, "path"),
        &["C-072"],
        "A path of 8 bytes.",
        payload_of(Plan::usual(), at::TRACK),
    );
    let with = |path: &str| {
        let entry = Entry {
            path: path.as_bytes().to_vec(),
            ..Entry::new(1)
        };
        Plan::of([
            (kind::STREAM, words(&[60, 1])),
            (kind::TRACK, tracks(&[entry])),
            (kind::GROUP, group(0, 0, 0)),
            (kind::COMMIT, commit(0, 0, None)),
        ])
    };
    edge(
        drafts,
        ("path_bytes", 6),
        (2012, "path-in-bytes"),
        &["C-072"],
        "A path of two code points, which are 6 bytes.",
        payload_of(with("寺院"), 1),
    );
    edge(
        drafts,
        ("path_bytes", 1),
        (2012, "path-one"),
        &["C-072"],
        "A path of one byte.",
        payload_of(with("a"), 1),
    );
    drafts.push(
        Draft::valid(
            AREA,
            "path-none",
            &["C-072"],
            "An empty path where none is allowed.",
            with("").bytes(),
        )
        .limit("path_bytes", 0),
    );
    let long = "x".repeat(1025);
    let (offset, bytes) = payload_of(with(&long), 1);
    drafts.push(
        Draft::invalid(
            AREA,
            (2012, "path-of-1025"),
            offset,
            &["C-072"],
            "A path one byte longer than the default limit.",
            bytes,
        )
        .limit("path_bytes", 1024),
    );
}
