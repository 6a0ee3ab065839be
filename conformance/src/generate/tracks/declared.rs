//! Tracks with fields at their edges, and live tracks declared again.

use super::shown;
use crate::generate::Draft;
use crate::generate::plan::{Plan, at, cell, moved, two_tracks, valid};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::points;
use crate::stream_builder::{commit, kind, removal, transforms};

/// Tracks with fields at their edges.
pub fn declared(drafts: &mut Vec<Draft>) {
    let mut good = |name: &str, clauses: &[&'static str], comment, entries: &[Entry]| {
        drafts.push(valid(name, clauses, comment, &shown(entries)));
    };
    let new = Entry::new;
    good(
        "track-ids-edges",
        &["C-043", "C-074"],
        "Tracks 0, 1, 2147483648 and 4294967295.",
        &[new(0), new(1), new(1 << 31), new(u32::MAX)],
    );
    good(
        "track-many",
        &["C-076", "C-079"],
        "Eight tracks in a record.",
        &(0..8).map(|id| new(3 * id)).collect::<Vec<_>>(),
    );
    good(
        "track-spaces",
        &["C-071"],
        "A track looked up as drawn, and one in its rest pose.",
        &[new(1), Entry { space: 1, ..new(2) }],
    );
    good(
        "track-hashes",
        &["C-041"],
        "No content hash, one of 0, one of 1 and the largest: all differ in the dump.",
        &[
            new(1),
            Entry {
                has_hash: 1,
                ..new(2)
            },
            Entry {
                has_hash: 1,
                hash: 1,
                ..new(3)
            },
            Entry {
                has_hash: 1,
                hash: u64::MAX,
                ..new(4)
            },
        ],
    );
    good(
        "track-application-ids",
        &["C-070"],
        "The largest application id, and one of eight bytes.",
        &[
            Entry {
                application: u64::MAX,
                ..new(1)
            },
            Entry {
                application: 0x0123_4567_89ab_cdef,
                ..new(2)
            },
        ],
    );
    good(
        "track-bounds-flat",
        &["C-073"],
        "Bounds whose minimum is their maximum, and of -0 and 0.",
        &[
            Entry {
                aabb: [1.5; 6],
                ..new(1)
            },
            Entry {
                aabb: [0.0, -0.0, 0.0, -0.0, 0.0, 0.0],
                ..new(2)
            },
        ],
    );
    good(
        "track-numbers-extreme",
        &["C-042"],
        "Minus zero, denormal and the largest numbers are kept as the bits that came.",
        &[Entry {
            aabb: [
                f32::MIN,
                -f32::from_bits(1),
                -0.0,
                f32::MAX,
                f32::from_bits(1),
                f32::MIN_POSITIVE,
            ],
            ..new(1).with_grid(|grid| {
                grid.grid_from_mesh = [
                    -0.0,
                    f32::MAX,
                    f32::MIN,
                    f32::from_bits(1),
                    -f32::from_bits(0x007f_ffff),
                    1.0,
                    0.1,
                    -0.1,
                    f32::EPSILON,
                    1e30,
                    -1e-30,
                    3.5,
                ];
            })
        }],
    );
    good(
        "track-radius-edges",
        &["P-002"],
        "Twice the radius is the edge, and one step above it; a denormal radius.",
        &[
            new(1).with_grid(|grid| {
                grid.cell_edge = 0.5;
                grid.radius = 0.25;
            }),
            new(2).with_grid(|grid| {
                grid.cell_edge = 0.6f32.next_down();
                grid.radius = 0.3;
            }),
            new(3).with_grid(|grid| {
                grid.cell_edge = f32::from_bits(1);
                grid.radius = f32::from_bits(1);
            }),
            new(4).with_grid(|grid| {
                grid.cell_edge = f32::MAX;
                grid.radius = f32::MAX / 2.0;
            }),
        ],
    );
    good(
        "track-least",
        &["P-001", "P-004"],
        "A grid of two cubes with one bucket and one cell.",
        &[new(1).with_grid(|grid| {
            grid.dims = [2, 1, 1];
            grid.buckets = 1;
            grid.capacity = 1;
        })],
    );
    good(
        "track-dims-most",
        &["P-001"],
        "The largest dims that sixteen bits give, in one layer.",
        &[new(1).with_grid(|grid| {
            grid.dims = [65_535, 65_535, 1];
        })],
    );
    good(
        "track-capacity-large",
        &["P-004", "C-076"],
        "20000 buckets and 30000 cells, most unused.",
        &[
            new(1),
            new(2).with_grid(|grid| {
                grid.buckets = 20_000;
                grid.capacity = 30_000;
            }),
        ],
    );
}

/// Tracks declared again.
pub fn redeclared(drafts: &mut Vec<Draft>) {
    let [first, second] = two_tracks();
    let one = || Plan::usual().up_to(at::DELTA);
    let next = |plan: Plan| plan.then(kind::COMMIT, commit(4, 2, None));
    drafts.extend([
        valid(
            "again-keeps-content",
            &["C-075", "C-078"],
            "Live tracks are declared again: content and transforms stay.",
            &next(one().then(kind::TRACK, tracks(&[first.clone(), second.clone()]))),
        ),
        valid(
            "again-one-of-two",
            &["C-075", "C-078"],
            "One of two live tracks is declared again.",
            &next(one().then(kind::TRACK, tracks(std::slice::from_ref(&first)))),
        ),
        valid(
            "again-with-new",
            &["C-074", "C-075", "C-078"],
            "A record declares live tracks again, and a new one.",
            &next(one().then(
                kind::TRACK,
                tracks(&[first.clone(), second.clone(), Entry::new(3)]),
            )),
        ),
        valid(
            "again-in-frame",
            &["C-045", "C-078"],
            "A live track is declared again inside a frame that has content of it.",
            &next(
                one()
                    .then(kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)]))
                    .then(kind::TRANSFORMS, transforms(&[(1, moved(5.0))]))
                    .then(kind::TRACK, tracks(std::slice::from_ref(&first))),
            ),
        ),
        valid(
            "again-in-same-frame-as-first",
            &["C-078"],
            "A track is declared twice before its first frame, in two records.",
            &Plan::usual().insert(
                at::GROUP,
                kind::TRACK,
                tracks(&[first.clone(), second.clone()]),
            ),
        ),
        valid(
            "again-with-other-zero",
            &["C-075"],
            "A live track is declared again with -0 for 0, which is the same number.",
            &next(one().then(
                kind::TRACK,
                tracks(&[Entry {
                    aabb: [-0.0, -0.0, 0.0, 2.0, 1.5, 1.0],
                    ..first.clone()
                }]),
            )),
        ),
        valid(
            "again-with-other-zero-in-grid",
            &["C-075", "C-078"],
            "A live track is declared again with -0 for each 0 of grid_from_mesh, which are the same numbers.",
            &next(one().then(
                kind::TRACK,
                tracks(&[first.clone().with_grid(|grid| {
                    grid.grid_from_mesh = grid.grid_from_mesh.map(minus_zero);
                })]),
            )),
        ),
        valid(
            "again-below-others",
            &["C-074", "C-075"],
            "A live track is declared again after one with a higher id.",
            &next(
                one()
                    .then(kind::TRACK, tracks(&[Entry::new(9)]))
                    .then(kind::TRACK, tracks(std::slice::from_ref(&second))),
            ),
        ),
        valid(
            "again-beside-removed",
            &["C-078", "C-082"],
            "One track is declared again while the removal of another waits.",
            &next(
                one()
                    .then(kind::TRACK_REMOVE, removal(&[1]))
                    .then(kind::TRACK, tracks(&[second])),
            ),
        ),
    ]);
}

/// -0 for a 0, and any other number as it is.
fn minus_zero(number: f32) -> f32 {
    if number == 0.0 { -0.0 } else { number }
}
