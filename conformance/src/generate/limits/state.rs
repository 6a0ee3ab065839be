//! Limits of tracks: their number, and the memory of the decoded state.

use super::{edge, payload_of};
use crate::generate::Draft;
use crate::generate::plan::{AREA, Plan, at, two_tracks};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::Grid;
use crate::stream_builder::{commit, group, kind, removal, set_word, words};

pub fn track_counts(drafts: &mut Vec<Draft>) {
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
                model: 6,
                ..Entry::new(4)
            },
        ])),
        at::DELTA,
    );
    let huge = Entry::of_grid(
        3,
        Grid {
            buckets: u32::MAX,
            ..Grid::default()
        },
    );
    ordered(
        (2013, "tracks-before-state"),
        &["C-076", "C-112"],
        "A third track of 4 billion buckets: the number of tracks is checked first.",
        with(tracks(&[huge])),
        at::DELTA,
    );
}

pub fn state_bytes(drafts: &mut Vec<Draft>) {
    let usual = Plan::usual;
    // 5 buckets and 6 cells.
    let track = 5 * 32 + 6 * 36;
    let entry = |id, buckets, capacity| {
        Entry::of_grid(
            id,
            Grid {
                buckets,
                capacity,
                ..Grid::default()
            },
        )
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
                    model: 6,
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
pub fn state_claims(drafts: &mut Vec<Draft>) {
    let mut claim = |name, comment, limit: u64, entries: &[Entry]| {
        let plan = Plan::usual().insert(at::DELTA, kind::TRACK, tracks(entries));
        let (offset, bytes) = payload_of(plan, at::DELTA);
        drafts.push(
            Draft::invalid(AREA, (2018, name), offset, &["C-076"], comment, bytes)
                .limit("state_bytes", limit),
        );
    };
    let entry = |id, buckets, capacity| {
        Entry::of_grid(
            id,
            Grid {
                buckets,
                capacity,
                ..Grid::default()
            },
        )
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
    // Track 1, of 5 buckets and 6 cells, has been removed; without it the sums would be 2^32 - 1.
    for (name, comment, further) in [
        (
            "state-buckets-beyond-32-bits-with-removed",
            "The number of buckets is beyond 32 bits with those of a track whose removal waits.",
            entry(3, u32::MAX - 5, 1),
        ),
        (
            "state-cells-beyond-32-bits-with-removed",
            "The number of cells is beyond 32 bits with those of a track whose removal waits.",
            entry(3, 1, u32::MAX - 6),
        ),
    ] {
        let plan = Plan::usual().insert(at::THIRD_COMMIT, kind::TRACK, tracks(&[further]));
        let (offset, bytes) = payload_of(plan, at::THIRD_COMMIT);
        let clauses = &["C-076", "C-081"];
        drafts.push(
            Draft::invalid(AREA, (2018, name), offset, clauses, comment, bytes)
                .limit("state_bytes", 1 << 50),
        );
    }
}
