//! Track records with two faults; ids that do not ascend; live tracks declared with other content.

use super::entry;
use crate::generate::Draft;
use crate::generate::plan::{Plan, at, payload, refused, two_tracks};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::Grid;
use crate::stream_builder::{kind, words};

type Change = fn(&mut Entry);

/// Two faults in an entry, or in two entries.
pub fn order(drafts: &mut Vec<Draft>) {
    let mut two = |id, name: &str, comment, change: fn(&mut Entry)| {
        drafts.push(entry((id, name), &["C-112"], 0, comment, change));
    };
    two(
        2007,
        "model-before-coding",
        "Model and coding are unknown.",
        |e| (e.model, e.coding) = (6, 1),
    );
    two(
        2008,
        "coding-before-space",
        "Coding and lookup space are unknown.",
        |e| (e.coding, e.space) = (1, 2),
    );
    two(
        2020,
        "space-before-hash",
        "An unknown lookup space, and a flag of 2.",
        |e| (e.space, e.has_hash) = (2, 2),
    );
    two(
        2002,
        "hash-before-bounds",
        "A flag of 2, and bounds that are no numbers.",
        |e| (e.has_hash, e.aabb[0]) = (2, f32::NAN),
    );
    two(
        2009,
        "grid-before-dims-reserved",
        "A matrix of no numbers, and a reserved bit after it.",
        |e| (e.grid_mut().grid_from_mesh[11], e.grid_mut().dims_reserved) = (f32::NAN, 1),
    );
    two(
        2002,
        "dims-reserved-before-edge",
        "A reserved bit, and an edge that is no number after it.",
        |e| (e.grid_mut().dims_reserved, e.grid_mut().cell_edge) = (1, f32::NAN),
    );
    two(
        2009,
        "radius-before-widths-reserved",
        "A radius of no number, and a reserved bit after it.",
        |e| (e.grid_mut().radius, e.grid_mut().widths_reserved) = (f32::NAN, 1),
    );
    two(
        2002,
        "widths-reserved-before-path",
        "A reserved bit, and a path of no text.",
        |e| (e.grid_mut().widths_reserved, e.path[0]) = (1, 0xff),
    );
    two(
        2012,
        "path-limit-before-size",
        "A path of 1025 bytes that is not there.",
        |e| e.path_length = Some(1025),
    );
    two(
        2001,
        "path-size-before-text",
        "A path of no text that runs past its entry.",
        |e| (e.path[0], e.path_length) = (0xff, Some(9)),
    );
    two(
        2011,
        "path-text-before-padding",
        "A path of no text, and padding that is not 0.",
        |e| (e.path[0], e.padding) = (0xff, Some(vec![1, 0, 0])),
    );
    two(
        2001,
        "padding-size-before-zero",
        "Seven bytes of padding that are not 0.",
        |e| e.padding = Some(vec![1; 7]),
    );
    two(
        2002,
        "padding-before-bounds",
        "Padding that is not 0, and bounds the wrong way round.",
        |e| (e.padding, e.aabb[0]) = (Some(vec![1, 0, 0]), 9.0),
    );
    two(
        2011,
        "path-text-before-bounds",
        "A path of no text, and bounds the wrong way round.",
        |e| (e.path[0], e.aabb[0]) = (0xff, 9.0),
    );
    two(
        2010,
        "bounds-before-dims",
        "Bounds the wrong way round, and a dimension of 0.",
        |e| (e.aabb[0], e.grid_mut().dims[0]) = (9.0, 0),
    );
    two(
        2014,
        "dims-before-radius",
        "A dimension of 0, and a radius of 0.",
        |e| (e.grid_mut().dims[0], e.grid_mut().radius) = (0, 0.0),
    );
    two(
        2015,
        "radius-before-widths",
        "A radius of 0, and widths of 31 bits.",
        |e| (e.grid_mut().radius, e.grid_mut().widths[2]) = (0.0, 7),
    );
    two(
        2016,
        "widths-before-buckets",
        "Widths of 31 bits, and no bucket.",
        |e| (e.grid_mut().widths[2], e.grid_mut().buckets) = (7, 0),
    );
    // An entry of 36 bytes ends after the first f32 of its bounds.
    let short = {
        let mut short = Entry {
            size: Some(36),
            aabb: [f32::INFINITY; 6],
            ..Entry::new(1)
        }
        .bytes();
        short.truncate(36);
        short
    };
    drafts.push(payload(
        (2009, "bounds-before-size"),
        &["C-042", "C-040", "C-112"],
        at::TRACK,
        "An entry ends after the first f32 of its bounds, which is infinite: each f32 is a field of its own.",
        |p| *p = [&words(&[1, 0])[..], &short].concat(),
    ));
    let [first, second] = two_tracks();
    let mut pair = |id, name: &str, comment, change: &dyn Fn(&mut Entry, &mut Entry)| {
        let (mut a, mut b) = (first.clone(), second.clone());
        change(&mut a, &mut b);
        drafts.push(payload((id, name), &["C-112"], at::TRACK, comment, |p| {
            *p = tracks(&[a, b])
        }));
    };
    pair(
        2017,
        "capacity-before-order",
        "No cell, and an id that does not ascend.",
        &|_, b| (b.grid_mut().capacity, b.id) = (0, 1),
    );
    pair(
        2004,
        "order-before-changed",
        "An id that comes again in a record, with other content.",
        &|_, b| b.id = 1,
    );
    pair(
        2010,
        "first-entry-before-second",
        "Bounds the wrong way round, then an unknown model.",
        &|a, b| (a.aabb[0], b.model) = (9.0, 3),
    );
    pair(
        2017,
        "first-entry-before-size",
        "No bucket, then an entry of size 0.",
        &|a, b| (a.grid_mut().buckets, b.size) = (0, Some(0)),
    );
    // Order among entries, then what was there before.
    let again = first.clone().with_grid(|grid| {
        grid.radius = 0.125;
    });
    drafts.push(refused(
        (2006, "changed-before-second-order"),
        &["C-075", "C-043", "C-112"],
        at::DELTA,
        "A live track with other content, then an id that does not ascend: entries go one by one.",
        Plan::usual().insert(at::DELTA, kind::TRACK, tracks(&[again.clone(), again])),
    ));
}

/// Ids: ascending in a record, above every earlier one.
pub fn ids(drafts: &mut Vec<Draft>) {
    let track = |ids: &[u32]| tracks(&ids.iter().map(|&id| Entry::new(id)).collect::<Vec<_>>());
    let with = |ids: &[u32]| Plan::usual().insert(at::DELTA, kind::TRACK, track(ids));
    drafts.extend([
        refused(
            (2004, "track-same-twice"),
            &["C-043"],
            at::DELTA,
            "A record declares a new track twice.",
            with(&[5, 5]),
        ),
        refused(
            (2004, "track-descending"),
            &["C-043"],
            at::DELTA,
            "A record declares its tracks in descending order.",
            with(&[6, 5]),
        ),
        refused(
            (2005, "track-id-below"),
            &["C-074"],
            at::DELTA,
            "A new track has an id below every earlier one.",
            with(&[0]),
        ),
        refused(
            (2005, "track-id-below-in-other-record"),
            &["C-074"],
            at::DELTA + 1,
            "A new track has an id below that of an earlier record.",
            with(&[9]).insert(at::DELTA + 1, kind::TRACK, track(&[8])),
        ),
        refused(
            (2005, "track-id-after-the-last"),
            &["C-074"],
            at::DELTA + 1,
            "After the largest id no track can come.",
            with(&[u32::MAX]).insert(at::DELTA + 1, kind::TRACK, track(&[7])),
        ),
    ]);
    // Every field of a live track, declared again with another value.
    let change: [(&str, Change); 18] = [
        ("space", |e| e.space = 0),
        ("hash-flag", |e| (e.has_hash, e.hash) = (0, 0)),
        ("hash", |e| e.hash ^= 1 << 63),
        ("application", |e| e.application ^= 1),
        ("aabb-minimum", |e| e.aabb[2] -= 0.5),
        ("aabb-maximum", |e| e.aabb[3] += 0.5),
        ("grid-first", |e| e.grid_mut().grid_from_mesh[0] = 2.0),
        ("grid-last", |e| e.grid_mut().grid_from_mesh[11] = 2.0),
        ("dims-x", |e| e.grid_mut().dims[0] = 5),
        ("dims-z", |e| e.grid_mut().dims[2] = 3),
        ("edge", |e| e.grid_mut().cell_edge = 0.75),
        ("radius", |e| e.grid_mut().radius = 0.125),
        ("widths", |e| e.grid_mut().widths = [4, 3, 5]),
        ("buckets", |e| e.grid_mut().buckets += 1),
        ("capacity", |e| e.grid_mut().capacity += 1),
        ("path-text", |e| e.path[7] = b'y'),
        ("path-longer", |e| e.path.push(b'e')),
        ("path-empty", |e| e.path.clear()),
    ];
    for (field, change) in change {
        let mut again = two_tracks()[1].clone();
        change(&mut again);
        drafts.push(refused(
            (2006, &format!("track-again-other-{field}")),
            &["C-075"],
            at::DELTA,
            "A live track is declared again with another value in one field.",
            Plan::usual().insert(at::DELTA, kind::TRACK, tracks(&[again])),
        ));
    }
    let other = Entry::of_grid(
        9,
        Grid {
            radius: 0.125,
            ..Grid::default()
        },
    );
    drafts.push(refused(
        (2006, "track-again-before-commit"),
        &["C-075", "C-079"],
        at::DELTA + 1,
        "A track is declared again with another radius before it was in any frame.",
        with(&[9]).insert(at::DELTA + 1, kind::TRACK, tracks(&[other])),
    ));
}
