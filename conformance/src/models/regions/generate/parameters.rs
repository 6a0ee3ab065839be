//! The parameters of a track, clauses and O-001 to O-003: each field at its bounds.

use super::{Content, Draft, Set, invalid, some, streams, valid};
use crate::models::Parameters;
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind};

type Change = fn(&mut Entry, &mut Set);
/// Name, sentence, fault.
type Fault = (&'static str, &'static str, Change);

const COUNT: &[Fault] = &[
    ("count-0", "There are no regions", |_, s| s.count = 0),
    (
        "count-and-capacity-0",
        "There are no regions and no pairs",
        |_, s| (s.count, s.capacity) = (0, 0),
    ),
    (
        "count-2-20-and-one",
        "There are 2^20 + 1 regions",
        |_, s| (s.count, s.capacity) = ((1 << 20) + 1, 1 << 21),
    ),
    ("count-most", "There are 2^32 - 1 regions", |_, s| {
        (s.count, s.capacity) = (u32::MAX, u32::MAX)
    }),
];

const CAPACITY: &[Fault] = &[
    ("capacity-0", "The capacity is 0", |_, s| s.capacity = 0),
    ("capacity-below", "Three regions have two pairs", |_, s| {
        s.capacity = 2
    }),
    ("capacity-above", "Three regions have 190 pairs", |_, s| {
        s.capacity = 190
    }),
    ("capacity-most", "The capacity is 2^32 - 1", |_, s| {
        s.capacity = u32::MAX
    }),
    (
        "capacity-wraps",
        "63 times the regions is 2^32 modulo 2^32 and a pair more",
        |_, s| (s.count, s.capacity) = (1 << 20, 63 * (1 << 20) + 1),
    ),
];

const STEP: &[Fault] = &[
    ("exponent-4", "The exponent is 4", |_, s| s.exponent = 4),
    ("exponent-255", "The exponent is 255", |_, s| {
        s.exponent = 255
    }),
    ("step-0", "The step is 0", |_, s| s.step = 0),
    ("step-32768", "The step is 32768", |_, s| s.step = 32768),
    ("step-most", "The step is 65535", |_, s| s.step = 65535),
];

const KINDS: &[Fault] = &[
    ("signals-0", "S is 0", |_, s| s.signals = 0),
    ("signals-3", "S is 3", |_, s| s.signals = 3),
    ("signals-2-of-one", "S is 2 with one kernel", |_, s| {
        (s.kinds, s.distances, s.share) = ([1, 0], [2.0, 0.0], 0.0)
    }),
    ("kernel-a-none", "Kernel A is of kind 0", |_, s| {
        (s.kinds[0], s.distances[0]) = (0, 0.0)
    }),
    (
        "kernel-a-none-with-a-distance",
        "Kernel A is of kind 0, and has a distance",
        |_, s| s.kinds[0] = 0,
    ),
    ("kernel-a-3", "Kernel A is of kind 3", |_, s| s.kinds[0] = 3),
    ("kernel-b-3", "Kernel B is of kind 3", |_, s| s.kinds[1] = 3),
];

const DISTANCES: &[Fault] = &[
    ("distance-a-0", "The distance of kernel A is 0", |_, s| {
        s.distances[0] = 0.0
    }),
    (
        "distance-b-negative",
        "The distance of kernel B is negative",
        |_, s| s.distances[1] = -1.0,
    ),
    (
        "distance-of-none",
        "The distance of no kernel B is -0",
        |_, s| {
            *s = s.clone().of_one();
            s.distances[1] = -0.0;
        },
    ),
];

const SHARE: &[Fault] = &[
    ("share-negative", "The share is below 0", |_, s| {
        s.share = -f32::MIN_POSITIVE
    }),
    ("share-above-1", "The share is next above 1", |_, s| {
        s.share = 1f32.next_up()
    }),
    (
        "share-of-none",
        "There is a share and no kernel B",
        |_, s| {
            *s = s.clone().of_one();
            s.share = 0.5;
        },
    ),
];

const RESERVED: &[Fault] = &[
    (
        "after-kinds",
        "The byte after the kinds is not 0",
        |_, s| s.signals_reserved = 1,
    ),
    (
        "after-exponent",
        "The byte after the exponent is not 0",
        |_, s| s.reserved = 0x80,
    ),
];

const FINITE: &[Fault] = &[
    ("distance-a", "The distance of kernel A is NaN", |_, s| {
        s.distances[0] = f32::NAN
    }),
    (
        "distance-b",
        "The distance of kernel B is infinite",
        |_, s| s.distances[1] = f32::INFINITY,
    ),
    ("share", "The share is NaN", |_, s| s.share = f32::NAN),
];

const CODING: &[Fault] = &[("coding-2", "The coding is 2", |e, _| e.coding = 2)];

const SPACE: &[Fault] = &[
    (
        "space-rest",
        "Regions have the lookup space rest",
        |e, _| e.space = 1,
    ),
    ("space-2", "Regions have the lookup space 2", |e, _| {
        e.space = 2
    }),
];

/// Each list with its error and clause.
const FAULTS: &[(u16, &str, &[Fault])] = &[
    (2028, "O-001", KINDS),
    (2028, "O-002", DISTANCES),
    (2028, "O-003", SHARE),
    (2031, "R-001", COUNT),
    (2031, "R-002", CAPACITY),
    (2031, "R-003", STEP),
    (2002, "C-041", RESERVED),
    (2009, "C-042", FINITE),
    (2008, "C-071", CODING),
    (2020, "C-071", SPACE),
];

/// Error, name, sentence, clauses, two faults of an entry; the first decides.
const ORDER: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        2020,
        "space-before-numbers",
        "The space before the numbers",
        &["C-071", "C-042"],
        |e, s| {
            e.space = 1;
            s.share = f32::NAN;
        },
    ),
    (
        2002,
        "reserved-before-distances",
        "The byte after the kinds before the distances",
        &["C-041", "C-042"],
        |_, s| {
            s.signals_reserved = 1;
            s.distances[0] = f32::NAN;
        },
    ),
    (
        2009,
        "share-before-reserved",
        "The share before the byte after the exponent",
        &["C-042", "C-041"],
        |_, s| {
            s.share = f32::NAN;
            s.reserved = 1;
        },
    ),
    (
        2011,
        "path-before-signals",
        "The path before the signals",
        &["C-072", "O-001"],
        |e, s| {
            e.path = vec![0xff];
            s.signals = 0;
        },
    ),
    (
        2010,
        "bounds-before-signals",
        "The AABB before the signals",
        &["C-073", "O-001"],
        |e, s| {
            e.aabb[0] = 9.0;
            s.signals = 0;
        },
    ),
    (
        2028,
        "signals-before-count",
        "The signals before the number of regions",
        &["O-003", "R-001"],
        |_, s| {
            s.share = 2.0;
            s.count = 0;
        },
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for &(id, clause, faults) in FAULTS {
        for &(name, comment, change) in faults {
            drafts.push(refused((id, name), &[clause], comment, &[], change));
        }
    }
    for &(id, name, comment, clauses, change) in ORDER {
        let clauses = &[clauses, &["C-112"]].concat();
        let name = format!("order-{name}");
        drafts.push(refused((id, &name), clauses, comment, &[], change));
    }
    let before = [Entry::new(1), Entry::of_set(2, Set::raw(1))];
    for &(id, clause, faults) in &FAULTS[3..6] {
        let comment = "The fault is in the entry after a grid and a track of regions, all packed";
        let name = format!("third-entry-{}", faults[0].0);
        drafts.push(refused(
            (id, &name),
            &[clause],
            comment,
            &before,
            faults[0].2,
        ));
    }
    cut(drafts);
    taken(drafts);
}

/// A `track` record whose last entry has a fault; packed where others stand before it.
fn refused(
    (id, name): (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    before: &[Entry],
    change: Change,
) -> Draft {
    let mut set = Set::packed(3);
    let mut faulty = Entry::of_set(7, set.clone());
    change(&mut faulty, &mut set);
    faulty.parameters = Parameters::Regions(set);
    let entries = [before, &[faulty]].concat();
    let pack = match before {
        [] => Pack::None,
        _ => Pack::Zstd(3),
    };
    let mut builder = StreamBuilder::started();
    builder.put_packed(kind::TRACK, pack, &tracks(&entries));
    let offset = builder.last() + HEADER;
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    let name = format!("set-{name}");
    let comment = format!("{comment}.");
    invalid((id, &name), clauses, &comment, (offset, builder.ended()))
}

/// An entry that ends within its parameters.
fn cut(drafts: &mut Vec<Draft>) {
    for (name, size) in [
        ("before-distances", 60u32),
        ("before-count", 72),
        ("before-capacity", 76),
        ("before-exponent", 80),
    ] {
        let whole = Entry::of_set(1, Set::packed(3)).bytes();
        let mut short = whole[..size as usize].to_vec();
        short[..4].copy_from_slice(&size.to_le_bytes());
        let mut builder = StreamBuilder::started();
        let head = [1, 0, 0, 0, 0, 0, 0, 0];
        builder.put(kind::TRACK, &[&head[..], &short].concat());
        let offset = builder.last() + HEADER;
        builder
            .put(kind::GROUP, &group(0, 0, 0))
            .put(kind::COMMIT, &commit(0, 0, None));
        let name = format!("set-cut-{name}");
        let comment = "An entry of regions ends before its fields do.";
        let refused = (offset, builder.ended());
        drafts.push(invalid(
            (2001, &name),
            &["C-040", "C-070"],
            comment,
            refused,
        ));
    }
}

/// Name, clause, sentence, change.
type Taken = (&'static str, &'static str, &'static str, fn(&mut Set));

/// The other side of each bound.
fn taken(drafts: &mut Vec<Draft>) {
    let cases: &[Taken] = &[
        ("one-region", "R-001", "One region.", |s| {
            (s.count, s.capacity) = (1, 63)
        }),
        ("many-regions", "R-001", "300 regions.", |s| {
            (s.count, s.capacity) = (300, 63 * 300)
        }),
        ("exponent-0", "R-003", "The exponent is 0.", |s| {
            s.exponent = 0
        }),
        ("exponent-3", "R-003", "The exponent is 3.", |s| {
            s.exponent = 3
        }),
        ("step-1", "R-003", "The step is 1.", |s| s.step = 1),
        ("step-32767", "R-003", "The step is 32767.", |s| {
            s.step = 32767
        }),
        ("one-signal", "O-001", "One signal of one kernel.", |s| {
            *s = s.clone().of_one()
        }),
        (
            "blended",
            "O-001",
            "One signal that is the blend of two.",
            |s| s.signals = 1,
        ),
        (
            "cut-off",
            "O-001",
            "Both kernels are cut off, at the smallest and the largest f32.",
            |s| {
                s.kinds = [2, 2];
                s.distances = [f32::from_bits(1), f32::MAX];
            },
        ),
        ("share-0", "O-003", "The share is 0.", |s| s.share = 0.0),
        ("share-minus-0", "O-003", "The share is -0.", |s| {
            s.share = -0.0
        }),
        ("share-1", "O-003", "The share is 1.", |s| s.share = 1.0),
        (
            "distances-equal",
            "O-002",
            "Both kernels are the same.",
            |s| s.distances = [2.0; 2],
        ),
    ];
    for (coding, set) in super::both(3) {
        for &(name, clause, comment, change) in cases {
            let mut set = set.clone();
            change(&mut set);
            let frames = streams(std::slice::from_ref(&set));
            let frames = frames.regions(&[Content::new(1, some(&set, 1))]).commit();
            let name = format!("set-{name}-{coding}");
            drafts.push(valid(&name, &[clause, "R-050"], comment, &frames));
        }
    }
}
