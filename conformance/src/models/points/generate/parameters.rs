//! The parameters of a track, clauses P-001 to P-004: each field at its bounds, from both sides.

use super::{AREA, Draft, Frames, content, filled, some};
use crate::models::entry::{Entry, tracks};
use crate::models::points::frames::{WIDTHS, entry};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind};

type Change = fn(&mut Entry);

const DIMS: &[(&str, &str, Change)] = &[
    ("dx-0", "Dx is 0", |e| e.grid_mut().dims = [0, 3, 2]),
    ("dy-0", "Dy is 0", |e| e.grid_mut().dims = [4, 0, 2]),
    ("dz-0", "Dz is 0", |e| e.grid_mut().dims = [4, 3, 0]),
    ("all-0", "Dx, Dy and Dz are 0", |e| {
        e.grid_mut().dims = [0; 3]
    }),
    ("volume-2-32", "Dx Dy Dz is 2^32", |e| {
        e.grid_mut().dims = [32768, 32768, 4]
    }),
    ("volume-wraps", "Dx Dy Dz is 2^32 + 2^24", |e| {
        e.grid_mut().dims = [4096, 4096, 257]
    }),
    ("volume-maximum", "Dx, Dy and Dz are 65535", |e| {
        e.grid_mut().dims = [65535; 3]
    }),
];

const RADIUS: &[(&str, &str, Change)] = &[
    ("radius-0", "The radius is 0", |e| e.grid_mut().radius = 0.0),
    ("radius-minus-0", "The radius is -0", |e| {
        e.grid_mut().radius = -0.0
    }),
    ("radius-negative", "The radius is negative", |e| {
        e.grid_mut().radius = -0.25
    }),
    (
        "edge-0",
        "The cell edge is 0, and 2 r the second smallest f32",
        |e| {
            e.grid_mut().cell_edge = 0.0;
            e.grid_mut().radius = f32::from_bits(1);
        },
    ),
    ("edge-minus-0", "The cell edge is -0", |e| {
        e.grid_mut().cell_edge = -0.0
    }),
    ("edge-negative", "The cell edge is negative", |e| {
        e.grid_mut().cell_edge = -0.5
    }),
    ("both-negative", "Radius and cell edge are negative", |e| {
        e.grid_mut().cell_edge = -0.5;
        e.grid_mut().radius = -0.25;
    }),
    (
        "two-steps",
        "2 r is two steps of f32 above the cell edge",
        |e| {
            e.grid_mut().radius = 0.25f32.next_up().next_up();
        },
    ),
    (
        "two-steps-denormal",
        "2 r is 4 and the cell edge 2 of the smallest f32",
        |e| {
            e.grid_mut().cell_edge = f32::from_bits(2);
            e.grid_mut().radius = f32::from_bits(2);
        },
    ),
    (
        "two-steps-to-the-first-normal",
        "2 r is the smallest normal f32, two steps above the edge",
        |e| {
            e.grid_mut().cell_edge = f32::from_bits(0x007f_fffe);
            e.grid_mut().radius = f32::from_bits(0x0040_0000);
        },
    ),
    (
        "twice-the-radius-infinite",
        "2 r is beyond the largest f32, the edge two steps below it",
        |e| {
            e.grid_mut().cell_edge = f32::MAX.next_down();
            e.grid_mut().radius = f32::MAX;
        },
    ),
];

const POINT: &[(&str, &str, Change)] = &[
    (
        "position-0",
        "Position bits are 0, and the sum is 16",
        |e| e.grid_mut().widths = [0, 4, 7],
    ),
    (
        "position-9",
        "Position bits are 9 and AO bits 0, and the sum is 32",
        |e| e.grid_mut().widths = [9, 2, 0],
    ),
    ("position-255", "Position bits are 255", |e| {
        e.grid_mut().widths = [255, 4, 8]
    }),
    ("normal-0", "Normal bits are 0, and the sum is 16", |e| {
        e.grid_mut().widths = [3, 0, 6]
    }),
    ("normal-1", "Normal bits are 1, and the sum is 16", |e| {
        e.grid_mut().widths = [3, 1, 4]
    }),
    ("normal-9", "Normal bits are 9, and the sum is 24", |e| {
        e.grid_mut().widths = [1, 9, 2]
    }),
    ("normal-255", "Normal bits are 255", |e| {
        e.grid_mut().widths = [5, 255, 8]
    }),
    ("ao-0", "AO bits are 0, and the sum is 16", |e| {
        e.grid_mut().widths = [3, 3, 0]
    }),
    ("ao-9", "AO bits are 9, and the sum is 24", |e| {
        e.grid_mut().widths = [2, 4, 9]
    }),
    ("ao-255", "AO bits are 255", |e| {
        e.grid_mut().widths = [5, 4, 255]
    }),
    ("sum-15", "The sum is 15", |e| {
        e.grid_mut().widths = [2, 2, 4]
    }),
    ("sum-17", "The sum is 17", |e| {
        e.grid_mut().widths = [2, 2, 6]
    }),
    ("sum-23", "The sum is 23", |e| {
        e.grid_mut().widths = [4, 3, 4]
    }),
    ("sum-25", "The sum is 25", |e| {
        e.grid_mut().widths = [4, 3, 6]
    }),
    ("sum-31", "The sum is 31", |e| {
        e.grid_mut().widths = [5, 4, 7]
    }),
    ("sum-33", "The sum is 33", |e| {
        e.grid_mut().widths = [6, 4, 6]
    }),
    ("sum-40", "The sum is 40", |e| {
        e.grid_mut().widths = [7, 5, 8]
    }),
    ("sum-48", "The sum is 48", |e| {
        e.grid_mut().widths = [8, 8, 7]
    }),
];

const CAPACITY: &[(&str, &str, Change)] = &[
    ("buckets-0", "bucket_count is 0", |e| {
        e.grid_mut().buckets = 0
    }),
    ("capacity-0", "cell_capacity is 0", |e| {
        e.grid_mut().capacity = 0
    }),
    ("capacity-maximum", "cell_capacity is 2^32 - 1", |e| {
        e.grid_mut().capacity = u32::MAX
    }),
];

const FINITE: &[(&str, &str, Change)] = &[
    (
        "grid-from-mesh-first",
        "The first f32 of grid_from_mesh is NaN",
        |e| e.grid_mut().grid_from_mesh[0] = f32::NAN,
    ),
    (
        "grid-from-mesh-last",
        "The last f32 of grid_from_mesh is infinite",
        |e| e.grid_mut().grid_from_mesh[11] = f32::INFINITY,
    ),
    ("cell-edge", "The cell edge is infinite", |e| {
        e.grid_mut().cell_edge = f32::INFINITY
    }),
    ("radius", "The radius is NaN", |e| {
        e.grid_mut().radius = f32::NAN
    }),
];

const RESERVED: &[(&str, &str, Change)] = &[
    (
        "after-dims",
        "The reserved field after the dims is not 0",
        |e| e.grid_mut().dims_reserved = 0x8000,
    ),
    (
        "after-widths",
        "The reserved field after the widths is not 0",
        |e| e.grid_mut().widths_reserved = 1,
    ),
];

/// Two faults of an entry; the first decides.
const ORDER: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        2010,
        "before-dims",
        "The AABB is checked before the dims",
        &["C-073", "P-001", "C-112"],
        |e| {
            e.aabb[0] = 9.0;
            e.grid_mut().dims[0] = 0;
        },
    ),
    (
        2014,
        "before-radius",
        "The dims are checked before the radius",
        &["P-001", "P-002", "C-112"],
        |e| {
            e.grid_mut().dims[0] = 0;
            e.grid_mut().radius = 0.0;
        },
    ),
    (
        2015,
        "before-widths",
        "The radius is checked before the widths",
        &["P-002", "P-003", "C-112"],
        |e| {
            e.grid_mut().radius = 0.0;
            e.grid_mut().widths[0] = 0;
        },
    ),
    (
        2016,
        "before-capacity",
        "The widths are checked before bucket_count",
        &["P-003", "P-004", "C-112"],
        |e| {
            e.grid_mut().widths[0] = 0;
            e.grid_mut().buckets = 0;
        },
    ),
    (
        2009,
        "before-dims",
        "An f32 that is not finite is found before dims of 0",
        &["C-042", "P-001", "C-112"],
        |e| {
            e.grid_mut().radius = f32::NAN;
            e.grid_mut().dims[0] = 0;
        },
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, faults) in [
        (2014, "P-001", DIMS),
        (2015, "P-002", RADIUS),
        (2016, "P-003", POINT),
        (2017, "P-004", CAPACITY),
        (2009, "C-042", FINITE),
        (2002, "C-041", RESERVED),
    ] {
        for &(name, comment, change) in faults {
            drafts.push(refused(
                id,
                name,
                &[clause],
                comment,
                Pack::None,
                &[],
                change,
            ));
        }
    }
    for &(id, name, comment, clauses, change) in ORDER {
        drafts.push(refused(id, name, clauses, comment, Pack::None, &[], change));
    }
    for (id, name, clause, change) in [
        (2014, "second-entry", "P-001", DIMS[0].2),
        (2015, "second-entry", "P-002", RADIUS[7].2),
        (2016, "second-entry", "P-003", POINT[10].2),
        (2017, "second-entry", "P-004", CAPACITY[2].2),
    ] {
        let before = [entry(1, WIDTHS[1])];
        let comment = "The fault is in the second entry of a packed record";
        drafts.push(refused(
            id,
            name,
            &[clause],
            comment,
            Pack::Lz4,
            &before,
            change,
        ));
    }
    valid(drafts);
}

/// A `track` record whose last entry has a fault.
fn refused(
    id: u16,
    name: &str,
    clauses: &[&'static str],
    comment: &str,
    pack: Pack,
    before: &[Entry],
    change: Change,
) -> Draft {
    let mut faulty = entry(7, WIDTHS[0]);
    change(&mut faulty);
    let entries = [before, &[faulty]].concat();
    let mut builder = StreamBuilder::started();
    builder.put_packed(kind::TRACK, pack, &tracks(&entries));
    let offset = builder.last() + HEADER;
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    let name = format!("track-{name}");
    let comment = format!("{comment}.");
    Draft::invalid(
        AREA,
        (id, &name),
        offset,
        clauses,
        &comment,
        builder.ended(),
    )
}

/// The other side of each bound.
fn valid(drafts: &mut Vec<Draft>) {
    let cases: &[(&str, &str, &'static str, Change)] = &[
        (
            "one-cube",
            "A grid of one cube, with one bucket and one cell.",
            "P-001",
            |e| {
                (
                    e.grid_mut().dims,
                    e.grid_mut().buckets,
                    e.grid_mut().capacity,
                ) = ([1; 3], 1, 1);
            },
        ),
        (
            "radius-half-the-edge",
            "2 r is the cell edge.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) = (0.3, 0.15);
            },
        ),
        (
            "radius-one-step-more",
            "2 r is one step of f32 above the cell edge.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) = (0.5, 0.25f32.next_up());
            },
        ),
        (
            "radius-one-step-more-over-a-power-of-two",
            "2 r is one step above an edge one step below 1.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) = (1f32.next_down(), 0.5);
            },
        ),
        (
            "radius-smallest",
            "The radius is the smallest f32, and 2 r one step above the edge.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) =
                    (f32::from_bits(1), f32::from_bits(1));
            },
        ),
        (
            "radius-smallest-normal",
            "2 r is the smallest normal f32, one step above the edge.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) =
                    (f32::from_bits(0x007f_ffff), f32::from_bits(0x0040_0000));
            },
        ),
        (
            "radius-largest",
            "Edge and radius are the largest f32: 2 r is the next number above it.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) = (f32::MAX, f32::MAX);
            },
        ),
        (
            "radius-far-below-the-edge",
            "The radius is a small part of the cell edge.",
            "P-002",
            |e| {
                (e.grid_mut().cell_edge, e.grid_mut().radius) = (1e6, 1e-6);
            },
        ),
        (
            "capacity-1",
            "A track has room for one cell.",
            "P-004",
            |e| e.grid_mut().capacity = 1,
        ),
        (
            "capacity-65537",
            "A track has room for more cells than 16 bits count.",
            "P-004",
            |e| e.grid_mut().capacity = 65537,
        ),
        (
            "grid-from-mesh-any",
            "grid_from_mesh holds -0, the smallest and the largest f32.",
            "C-042",
            |e| {
                let bits = [
                    0x8000_0000,
                    1,
                    0x7f7f_ffff,
                    0xff7f_ffff,
                    0x8000_0001,
                    0x0080_0000,
                ];
                for (value, bits) in e.grid_mut().grid_from_mesh.iter_mut().zip(bits) {
                    *value = f32::from_bits(bits);
                }
            },
        ),
    ];
    for &(name, comment, clause, change) in cases {
        let mut entry = entry(7, WIDTHS[0]);
        change(&mut entry);
        let last = entry.grid().capacity - 1;
        let part = match last {
            0..11 => filled(&entry, &[(last, 0, some(&entry, 0, 4))]),
            11 => content(&entry),
            _ => filled(
                &entry,
                &[(0, 1, some(&entry, 0, 4)), (last, 2, some(&entry, 4, 7))],
            ),
        };
        let frames = Frames::new(&[entry]).keyframe(&[part]).commit();
        let name = format!("track-{name}");
        drafts.push(Draft::valid(
            AREA,
            &name,
            &[clause],
            comment,
            frames.ended(),
        ));
    }
}
