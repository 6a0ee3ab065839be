//! As much as each limit allows, and a step more; claims that are far beyond what is there.

use super::Draft;
use super::container::empty_frame;
use super::packing::{FIRST_PAYLOAD, Frame, block, first_stored, raw};
use super::plan::{AREA, Plan, at, cell, header, payload, two_tracks};
use crate::forge::{
    Entry, Forge, HEADER, Header, Pack, commit, group, kind, points, removal, set_word, tracks,
    words,
};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    record_lengths(drafts);
    frame_bytes(drafts);
    windows(drafts);
    track_counts(drafts);
    path_bytes(drafts);
    state_bytes(drafts);
    state_claims(drafts);
    claims(drafts);
    bombs(drafts);
    counts(drafts);
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

/// The usual stream with one record packed: offsets of its header and payload, stored length.
fn usual_packed(at: usize, pack: Pack) -> (usize, usize, Vec<u8>) {
    let mut forge = Forge::new();
    for (index, (record_type, payload)) in Plan::usual().records.iter().enumerate() {
        let pack = if index == at { pack } else { Pack::None };
        forge.put_packed(*record_type, pack, payload);
    }
    let (start, next) = (forge.starts[at], forge.starts[at + 1]);
    (start, next - start - HEADER, forge.ended())
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
        let (start, stored, bytes) = usual_packed(at::TRACK, pack);
        // Below it, the next largest record that is not packed.
        let keyframe = usual.records[at::POINTS].1.len();
        if stored >= keyframe {
            edge(
                drafts,
                ("stored_bytes", stored as u64),
                (1012, &format!("stored-{name}")),
                &["C-018"],
                "A packed record counts as it is stored.",
                (start, bytes.clone()),
            );
        }
        edge(
            drafts,
            ("unpacked_bytes", track),
            (1013, &format!("unpacked-{name}")),
            &["C-019"],
            "A packed record counts as it unpacks.",
            (start, bytes),
        );
    }
    let mut forge = empty_frame();
    forge.put_with(0x7000, Pack::None, &[0xaa; 300], |h| h.critical = false);
    drafts.push(
        Draft::valid(
            AREA,
            "skipped-beyond-stored",
            &["C-017", "C-018"],
            "A skipped record of 300 bytes is held against no limit.",
            forge.ended(),
        )
        .limit("stored_bytes", 16),
    );
    drafts.push(
        Draft::valid(
            AREA,
            "skipped-beyond-unpacked",
            &["C-017", "C-019"],
            "A skipped record of 300 bytes is held against no limit.",
            forge.ended(),
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
    for (name, pack) in [("frame-lz4", Pack::Lz4), ("frame-zstd", Pack::Zstd(0))] {
        let (start, _, bytes) = usual_packed(at::POINTS, pack);
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
    let mut forge = usual().up_to(at::POINTS).start();
    forge.put_stored(
        kind::POINTS,
        Pack::Lz4,
        keyframe as usize,
        &[0xf0; 40],
        |_| {},
    );
    let offset = forge.last() + HEADER;
    forge.put(kind::COMMIT, &commit(0, 0, None));
    ordered(
        (4009, "frame-before-unpacking"),
        &["P-014", "C-112"],
        "Points beyond the limit that do not unpack: the limit is checked first.",
        (offset, forge.ended()),
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
    let (start, _, bytes) = usual_packed(at::POINTS, Pack::Zstd(0));
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

fn track_counts(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual;
    let more = |ids: &[u32]| tracks(&ids.iter().map(|&id| Entry::new(id)).collect::<Vec<_>>());
    edge(
        drafts,
        ("tracks", 2),
        (2013, "tracks"),
        &["C-076"],
        "Two tracks in a record.",
        payload_of(usual(), at::TRACK),
    );
    edge(
        drafts,
        ("tracks", 3),
        (2013, "tracks-in-two-records"),
        &["C-076"],
        "Two tracks in a record, and one in another.",
        payload_of(
            usual().insert(at::DELTA, kind::TRACK, more(&[3])),
            at::DELTA,
        ),
    );
    edge(
        drafts,
        ("tracks", 3),
        (2013, "tracks-removed-until-commit"),
        &["C-076", "C-081"],
        "A removed track counts until the commit that ends it.",
        payload_of(
            usual().insert(at::THIRD_COMMIT, kind::TRACK, more(&[3])),
            at::THIRD_COMMIT,
        ),
    );
    let after = usual()
        .then(kind::TRACK, more(&[3]))
        .then(kind::COMMIT, commit(6, 4, None));
    let again = usual().insert(at::DELTA, kind::TRACK, usual().records[at::TRACK].1.clone());
    let mut good = |name, comment, plan: Plan| {
        let draft = Draft::valid(AREA, name, &["C-076"], comment, plan.bytes());
        drafts.push(draft.limit("tracks", 2));
    };
    good(
        "tracks-removed-after-commit",
        "After its commit a removed track counts no more.",
        after,
    );
    good(
        "tracks-again",
        "A live track that is declared again counts once.",
        again,
    );
    let none = Plan::of([
        (kind::STREAM, words(&[60, 1])),
        (kind::TRACK, tracks(&[])),
        (kind::GROUP, group(0, 0, 0)),
        (kind::COMMIT, commit(0, 0, None)),
    ]);
    drafts.push(
        Draft::valid(
            AREA,
            "tracks-none",
            &["C-076"],
            "No track where none is allowed.",
            none.bytes(),
        )
        .limit("tracks", 0),
    );
    let mut ordered = |fault, clauses: &[&'static str], comment, plan: Plan, at| {
        let (offset, bytes) = payload_of(plan, at);
        let draft = Draft::invalid(AREA, fault, offset, clauses, comment, bytes);
        drafts.push(draft.limit("tracks", 2));
    };
    let with = |payload| usual().insert(at::DELTA, kind::TRACK, payload);
    ordered(
        (2005, "reused-before-tracks"),
        &["C-074", "C-076", "C-112"],
        "A third track with a low id, where two are allowed: the id is checked first.",
        with(more(&[0])),
        at::DELTA,
    );
    ordered(
        (2013, "tracks-before-next-entry"),
        &["C-076", "C-112"],
        "A third track, then one of an unknown model: entries go one by one.",
        with(tracks(&[
            Entry::new(3),
            Entry {
                model: 2,
                ..Entry::new(4)
            },
        ])),
        at::DELTA,
    );
    let huge = Entry {
        buckets: u32::MAX,
        ..Entry::new(3)
    };
    ordered(
        (2013, "tracks-before-state"),
        &["C-076", "C-112"],
        "A third track of 4 billion buckets: the number of tracks is checked first.",
        with(tracks(&[huge])),
        at::DELTA,
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

fn state_bytes(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual;
    // 5 buckets and 6 cells.
    let track = 5 * 32 + 6 * 36;
    let entry = |id, buckets, capacity| Entry {
        buckets,
        capacity,
        ..Entry::new(id)
    };
    let with = |at, entries: &[Entry]| usual().insert(at, kind::TRACK, tracks(entries));
    edge(
        drafts,
        ("state_bytes", 2 * track),
        (2018, "state"),
        &["C-076"],
        "Two tracks of 376 bytes.",
        payload_of(usual(), at::TRACK),
    );
    edge(
        drafts,
        ("state_bytes", 2 * track + 32 * 7 + 36),
        (2018, "state-buckets"),
        &["C-076"],
        "A further track of 7 buckets and one cell.",
        payload_of(with(at::DELTA, &[entry(3, 7, 1)]), at::DELTA),
    );
    edge(
        drafts,
        ("state_bytes", 2 * track + 32 + 36 * 7),
        (2018, "state-cells"),
        &["C-076"],
        "A further track of one bucket and 7 cells.",
        payload_of(with(at::DELTA, &[entry(3, 1, 7)]), at::DELTA),
    );
    edge(
        drafts,
        ("state_bytes", 2 * track + 3 * 68),
        (2018, "state-together"),
        &["C-076"],
        "Three further tracks in a record count together.",
        payload_of(
            with(at::DELTA, &[3, 4, 5].map(|id| entry(id, 1, 1))),
            at::DELTA,
        ),
    );
    edge(
        drafts,
        ("state_bytes", 3 * track),
        (2018, "state-removed-until-commit"),
        &["C-076", "C-081"],
        "A removed track counts until the commit that ends it.",
        payload_of(with(at::THIRD_COMMIT, &[Entry::new(3)]), at::THIRD_COMMIT),
    );
    let mut good = |name, comment, plan: Plan| {
        let draft = Draft::valid(AREA, name, &["C-076"], comment, plan.bytes());
        drafts.push(draft.limit("state_bytes", 2 * track));
    };
    good(
        "state-removed-after-commit",
        "A track of the same size after the end of another.",
        usual()
            .then(kind::TRACK, tracks(&[Entry::new(3)]))
            .then(kind::COMMIT, commit(6, 4, None)),
    );
    good(
        "state-again",
        "Live tracks that are declared again count once.",
        usual().insert(at::DELTA, kind::TRACK, tracks(&two_tracks())),
    );
    // The first of the record would fit.
    let (offset, bytes) = payload_of(
        with(at::DELTA, &[entry(3, 1, 1), entry(4, 1, 1)]),
        at::DELTA,
    );
    drafts.push(
        Draft::invalid(
            AREA,
            (2018, "state-of-second-track"),
            offset,
            &["C-076", "C-077"],
            "The second of two new tracks is too much.",
            bytes,
        )
        .limit("state_bytes", 2 * track + 68),
    );
    let mut over = tracks(&[Entry::new(3)]);
    over.extend([0; 4]);
    let (offset, bytes) = payload_of(usual().insert(at::DELTA, kind::TRACK, over), at::DELTA);
    drafts.push(
        Draft::invalid(
            AREA,
            (2001, "bytes-over-before-state"),
            offset,
            &["C-040", "C-076", "C-112"],
            "A track beyond the limit and bytes over: the bytes are checked first.",
            bytes,
        )
        .limit("state_bytes", 2 * track),
    );
    let (offset, bytes) = payload_of(
        with(
            at::DELTA,
            &[
                Entry::new(3),
                Entry {
                    model: 2,
                    ..Entry::new(4)
                },
            ],
        ),
        at::DELTA,
    );
    drafts.push(
        Draft::invalid(
            AREA,
            (2007, "entries-before-state"),
            offset,
            &["C-076", "C-112"],
            "A track beyond the limit, then an unknown model: the memory is checked last.",
            bytes,
        )
        .limit("state_bytes", 2 * track),
    );
    // Removed and declared in turn, never more than two at a time.
    let mut plan = usual();
    for id in 3..7 {
        plan = plan
            .then(kind::TRACK, tracks(&[Entry::new(id)]))
            .then(kind::COMMIT, commit(id.into(), 2 * id, None))
            .then(kind::TRACK_REMOVE, removal(&[id]))
            .then(kind::COMMIT, commit(id.into(), 2 * id + 1, None));
    }
    let plan = plan.records.into_iter().map(|(record_type, mut payload)| {
        // Ticks go on from the usual stream's.
        if record_type == kind::COMMIT {
            set_word(&mut payload, 0, 10);
        }
        (record_type, payload)
    });
    drafts.push(
        Draft::valid(
            AREA,
            "state-come-and-go",
            &["C-076"],
            "Tracks of one size come and go within the limit.",
            Plan::of(plan).bytes(),
        )
        .limit("state_bytes", 2 * track),
    );
}

/// Tracks of gigabytes.
fn state_claims(drafts: &mut Vec<Draft>) {
    let mut claim = |name, comment, limit: u64, entries: &[Entry]| {
        let plan = Plan::usual().insert(at::DELTA, kind::TRACK, tracks(entries));
        let (offset, bytes) = payload_of(plan, at::DELTA);
        drafts.push(
            Draft::invalid(AREA, (2018, name), offset, &["C-076"], comment, bytes)
                .limit("state_bytes", limit),
        );
    };
    let entry = |id, buckets, capacity| Entry {
        buckets,
        capacity,
        ..Entry::new(id)
    };
    let default = 512 << 20;
    claim(
        "state-buckets-most",
        "A track of 2^32 - 1 buckets.",
        default,
        &[entry(3, u32::MAX, 1)],
    );
    claim(
        "state-cells-most",
        "A track of 2^32 - 2 cells.",
        default,
        &[entry(3, 1, u32::MAX - 1)],
    );
    claim(
        "state-both-most",
        "A track of as many buckets and cells as can be stated.",
        default,
        &[entry(3, u32::MAX, u32::MAX - 1)],
    );
    claim(
        "state-buckets-wrap",
        "Buckets of 4 GiB, which is 0 in 32 bits.",
        default,
        &[entry(3, 1 << 27, 1)],
    );
    claim(
        "state-cells-wrap",
        "Cells of 36 GiB, which is 0 in 32 bits.",
        default,
        &[entry(3, 1, 1 << 30)],
    );
    claim(
        "state-sum-wraps",
        "Two tracks of 2^31 buckets, whose number is 0 in 32 bits.",
        default,
        &[entry(3, 1 << 31, 1), entry(4, 1 << 31, 1)],
    );
    claim(
        "state-buckets-beyond-32-bits",
        "Buckets whose number is beyond 32 bits, whatever the limit.",
        1 << 50,
        &[entry(3, u32::MAX, 1)],
    );
    claim(
        "state-cells-beyond-32-bits",
        "Cells whose number is beyond 32 bits, whatever the limit.",
        1 << 50,
        &[entry(3, 1, u32::MAX - 1)],
    );
}

/// Lengths far beyond what is there.
fn claims(drafts: &mut Vec<Draft>) {
    let default = 256 << 20;
    let mut claim = |fault: (u16, &str),
                     clauses: &[&'static str],
                     limit,
                     comment: &str,
                     change: fn(&mut Header)| {
        drafts.push(header(fault, clauses, at::TRACK, comment, change).limit(limit, default));
    };
    claim(
        (1012, "four-gib-stored"),
        &["C-018"],
        "stored_bytes",
        "A record claims to store 4 GiB.",
        |h| (h.stored, h.unpacked) = (u32::MAX, u32::MAX),
    );
    claim(
        (1012, "four-gib-stored-lz4"),
        &["C-018"],
        "stored_bytes",
        "A packed record claims to store 4 GiB, for a few bytes.",
        |h| (h.packing, h.stored, h.unpacked) = (1, u32::MAX, 8),
    );
    claim(
        (1012, "stored-above-default"),
        &["C-018"],
        "stored_bytes",
        "A record claims to store a byte more than the default limit.",
        |h| h.stored = (256 << 20) + 1,
    );
    claim(
        (1013, "four-gib-unpacked"),
        &["C-019"],
        "unpacked_bytes",
        "A record claims to unpack to 4 GiB.",
        |h| h.unpacked = u32::MAX,
    );
    claim(
        (1013, "four-gib-unpacked-lz4"),
        &["C-019"],
        "unpacked_bytes",
        "A packed record claims to unpack to 4 GiB.",
        |h| (h.packing, h.unpacked) = (1, u32::MAX),
    );
    claim(
        (1013, "unpacked-above-default"),
        &["C-019"],
        "unpacked_bytes",
        "A packed record claims to unpack to a byte more than the default limit.",
        |h| (h.packing, h.unpacked) = (2, (256 << 20) + 1),
    );
    claim(
        (1014, "quarter-gib-lz4"),
        &["C-021"],
        "unpacked_bytes",
        "An lz4 block of 284 bytes claims the default limit, which it cannot hold.",
        |h| (h.packing, h.unpacked) = (1, 256 << 20),
    );
    claim(
        (1014, "quarter-gib-zstd"),
        &["C-021"],
        "unpacked_bytes",
        "A zstd frame of 284 bytes claims the default limit, which it cannot hold.",
        |h| (h.packing, h.unpacked) = (2, 256 << 20),
    );
    claim(
        (1012, "stored-before-unpacked"),
        &["C-018", "C-019", "C-112"],
        "stored_bytes",
        "Both lengths are beyond the limits: the stored one is checked first.",
        |h| (h.packing, h.stored, h.unpacked) = (2, u32::MAX, u32::MAX),
    );
    claim(
        (1013, "unpacked-before-packing"),
        &["C-019", "C-020", "C-112"],
        "unpacked_bytes",
        "4 GiB in an unknown packing: the length is checked first.",
        |h| (h.packing, h.unpacked) = (9, u32::MAX),
    );
    claim(
        (1021, "version-before-stored"),
        &["C-015", "C-018", "C-112"],
        "stored_bytes",
        "4 GiB of a newer version: the version is checked first.",
        |h| (h.version, h.stored) = (1, u32::MAX),
    );
    // Possible claims, of which nothing came.
    let mut cut = |name, clauses: &[&'static str], comment, change: fn(&mut Header)| {
        let (start, mut bytes) = Plan::usual().with_header(at::DELTA, change);
        bytes.truncate(start + HEADER + 4);
        drafts.push(
            Draft::invalid(AREA, (1019, name), bytes.len(), clauses, comment, bytes)
                .limit("stored_bytes", default),
        );
    };
    cut(
        "quarter-gib-missing",
        &["C-023", "C-103"],
        "A record as large as the limit, of which four bytes came: no memory may be reserved for it.",
        |h| (h.stored, h.unpacked) = (256 << 20, 256 << 20),
    );
    cut(
        "quarter-gib-missing-zstd",
        &["C-023", "C-103"],
        "A frame that may unpack to as much as the limit, of which four bytes came.",
        |h| (h.packing, h.stored, h.unpacked) = (2, 8192, 256 << 20),
    );
    cut(
        "skipped-four-gib-missing",
        &["C-017", "C-103"],
        "A record of 4 GiB is skipped, of which four bytes came.",
        |h| {
            h.critical = false;
            h.record_type = 0x7000;
            h.stored = u32::MAX;
        },
    );
}

/// Packed payloads that hold more than they say.
fn bombs(drafts: &mut Vec<Draft>) {
    let mut bomb = |fault, clauses: &[&'static str], comment, stored: &[u8], pack| {
        let bytes = first_stored(pack, 8, stored);
        drafts.push(
            Draft::invalid(AREA, fault, FIRST_PAYLOAD, clauses, comment, bytes)
                .limit("unpacked_bytes", 4096),
        );
    };
    // One literal and a match of 15 + 4 + 255 * 200 bytes.
    let mut lz4 = vec![0x1f, 7, 1, 0];
    lz4.extend([255; 200]);
    lz4.extend([0, 0]);
    bomb(
        (1015, "lz4-bomb"),
        &["C-030"],
        "A block of 200 bytes unpacks to 51 KB, and says 8.",
        &lz4,
        Pack::Lz4,
    );
    let blocks: Vec<u8> = (0..40)
        .flat_map(|i| block(i == 39, 1, 131_072, &[0]))
        .collect();
    bomb(
        (1016, "zstd-bomb"),
        &["C-033"],
        "A frame of 171 bytes decodes to 5 MB, and says 8.",
        &Frame::windowed(7 << 3, 8, blocks.clone()).bytes(),
        Pack::Zstd(0),
    );
    bomb(
        (1017, "zstd-bomb-in-frame-alone"),
        &["C-031"],
        "The frame says 5 MB where the record says 8.",
        &Frame::windowed(7 << 3, 40 * 131_072, blocks.clone()).bytes(),
        Pack::Zstd(0),
    );
    let frame = Frame::windowed(7 << 3, 40 * 131_072, blocks).bytes();
    let bytes = first_stored(Pack::Zstd(0), 40 * 131_072, &frame);
    drafts.push(
        Draft::invalid(
            AREA,
            (1013, "zstd-bomb-said"),
            FIRST_PAYLOAD - HEADER,
            &["C-019"],
            "A frame of 171 bytes says that it decodes to 5 MB, where 4096 are allowed.",
            bytes.clone(),
        )
        .limit("unpacked_bytes", 4096),
    );
    drafts.push(
        Draft::invalid(
            AREA,
            (2001, "zstd-bomb-allowed"),
            FIRST_PAYLOAD,
            &["C-040"],
            "A frame that decodes to 5 MB within the limit, in a record that has 8 bytes.",
            bytes,
        )
        .limit("unpacked_bytes", 40 * 131_072),
    );
}

/// Counts far beyond the payload: nothing may be reserved for them.
fn counts(drafts: &mut Vec<Draft>) {
    let most = |p: &mut Vec<u8>| set_word(p, 0, u32::MAX);
    drafts.extend([
        payload(
            (2001, "track-count-most"),
            &["C-040"],
            at::TRACK,
            "A track record counts 2^32 - 1 tracks.",
            most,
        ),
        payload(
            (2001, "remove-count-most"),
            &["C-040"],
            at::REMOVE,
            "A track remove record counts 2^32 - 1 ids.",
            most,
        ),
        payload(
            (2001, "transforms-count-most"),
            &["C-040"],
            at::TRANSFORMS,
            "A transforms record counts 2^32 - 1 transforms.",
            most,
        ),
        payload(
            (3001, "points-count-most"),
            &["P-010"],
            at::POINTS,
            "A points record counts 2^32 - 1 tracks.",
            most,
        ),
    ]);
}
