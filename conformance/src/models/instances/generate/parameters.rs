//! The parameters of a table, clauses O-001 to O-003, I-001 and I-002: each field at its bounds, from
//! both sides.

use super::{Content, Draft, Frames, Table, invalid, some, valid};
use crate::models::Parameters;
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind};

type Change = fn(&mut Entry, &mut Table);
/// Name, sentence, fault.
type Fault = (&'static str, &'static str, Change);

const NUMBERS: &[Fault] = &[
    ("count-0", "The count is 0", |_, t| t.count = 0),
    ("count-2-24-and-1", "The count is 2^24 + 1", |_, t| {
        t.count = (1 << 24) + 1
    }),
    ("count-most", "The count is 2^32 - 1", |_, t| {
        t.count = u32::MAX
    }),
    ("exponent-4", "The exponent is 4", |_, t| t.exponent = 4),
    ("exponent-255", "The exponent is 255", |_, t| {
        t.exponent = 255
    }),
    ("step-0", "The step is 0", |_, t| t.step = 0),
    ("step-32768", "The step is 32768", |_, t| t.step = 32768),
    ("step-65535", "The step is 65535", |_, t| t.step = 65535),
];

const SIGNALS: &[Fault] = &[
    ("signals-0", "There are no signals", |_, t| t.signals = 0),
    ("signals-3", "There are three signals", |_, t| t.signals = 3),
    (
        "signals-2-without-b",
        "There are two signals and one kernel",
        |_, t| {
            t.kinds[1] = 0;
            t.distances[1] = 0.0;
            t.share = 0.0;
        },
    ),
    ("no-kernel-a", "Kernel A is none", |_, t| {
        t.kinds[0] = 0;
        t.distances[0] = 0.0;
    }),
    (
        "kernel-a-none-with-a-distance",
        "Kernel A is of kind 0, and has a distance",
        |_, t| t.kinds[0] = 0,
    ),
    ("kernel-a-3", "Kernel A is of kind 3", |_, t| t.kinds[0] = 3),
    ("kernel-b-3", "Kernel B is of kind 3", |_, t| t.kinds[1] = 3),
];

const DISTANCES: &[Fault] = &[
    ("distance-a-0", "The distance of kernel A is 0", |_, t| {
        t.distances[0] = 0.0
    }),
    (
        "distance-a-negative",
        "The distance of kernel A is negative",
        |_, t| t.distances[0] = -2.0,
    ),
    (
        "distance-b-minus-0",
        "The distance of kernel B is -0",
        |_, t| t.distances[1] = -0.0,
    ),
    (
        "distance-of-none",
        "There is a distance and no kernel B",
        |_, t| (t.signals, t.kinds[1], t.share) = (1, 0, 0.0),
    ),
    (
        "distance-minus-0-of-none",
        "The distance is -0 without kernel B",
        |_, t| (t.signals, t.kinds[1], t.distances[1], t.share) = (1, 0, -0.0, 0.0),
    ),
];

const SHARE: &[Fault] = &[
    ("share-above-1", "The share is above 1", |_, t| {
        t.share = f32::from_bits(1.0f32.to_bits() + 1)
    }),
    ("share-below-0", "The share is below 0", |_, t| {
        t.share = -f32::from_bits(1)
    }),
    (
        "share-of-none",
        "There is a share and no kernel B",
        |_, t| (t.signals, t.kinds[1], t.distances[1]) = (1, 0, 0.0),
    ),
    (
        "share-minus-0-of-none",
        "The share is -0 without kernel B",
        |_, t| (t.signals, t.kinds[1], t.distances[1], t.share) = (1, 0, 0.0, -0.0),
    ),
];

const RESERVED: &[Fault] = &[
    (
        "after-kinds",
        "The field after the kinds of kernels is not 0",
        |_, t| t.signals_reserved = 1,
    ),
    (
        "after-exponent",
        "The field after the exponent is not 0",
        |_, t| t.reserved = 0x80,
    ),
];

const FINITE: &[Fault] = &[
    ("distance-a", "The distance of kernel A is NaN", |_, t| {
        t.distances[0] = f32::NAN
    }),
    (
        "distance-b",
        "The distance of kernel B is infinite",
        |_, t| t.distances[1] = f32::INFINITY,
    ),
    ("share", "The share is minus infinity", |_, t| {
        t.share = f32::NEG_INFINITY
    }),
];

const CODING: &[Fault] = &[("coding-2", "The coding is 2", |e, _| e.coding = 2)];

const SPACE: &[Fault] = &[("space-rest", "A table has the lookup space rest", |e, _| {
    e.space = 1
})];

/// Error, name, sentence, clauses, two faults of an entry; the first decides.
const ORDER: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        2002,
        "kinds-before-distance",
        "The field after the kinds is read before the distances",
        &["C-041", "C-042"],
        |_, t| (t.signals_reserved, t.share) = (1, f32::NAN),
    ),
    (
        2009,
        "share-before-reserved",
        "The share is read before the field after the exponent",
        &["C-042", "C-041"],
        |_, t| (t.share, t.reserved) = (f32::NAN, 1),
    ),
    (
        2002,
        "reserved-before-path",
        "The reserved field is read before the path",
        &["C-041", "C-072"],
        |e, t| {
            t.reserved = 1;
            e.path = vec![0xff];
        },
    ),
    (
        2010,
        "bounds-before-signals",
        "The AABB is checked before the signals",
        &["C-073", "O-001"],
        |e, t| {
            e.aabb[0] = 9.0;
            t.signals = 0;
        },
    ),
    (
        2028,
        "signals-before-count",
        "The signals are checked before the count",
        &["O-003", "I-001"],
        |_, t| (t.share, t.count) = (2.0, 0),
    ),
    (
        2030,
        "count-before-id",
        "The count is checked before the order of ids",
        &["I-001", "C-043"],
        |e, t| (e.id, t.count) = (0, 0),
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, faults) in [
        (2030, "I-001", NUMBERS),
        (2028, "O-001", SIGNALS),
        (2028, "O-002", DISTANCES),
        (2028, "O-003", SHARE),
        (2002, "C-041", RESERVED),
        (2009, "C-042", FINITE),
        (2008, "C-071", CODING),
        (2020, "C-071", SPACE),
    ] {
        for &(name, comment, change) in faults {
            drafts.push(refused((id, name), &[clause], comment, &[], change));
        }
    }
    let before = [Entry::new(1), Entry::of_table(2, Table::raw(1))];
    for &(id, name, comment, clauses, change) in ORDER {
        let clauses = &[clauses, &["C-112"]].concat();
        let name = format!("order-{name}");
        drafts.push(refused((id, &name), clauses, comment, &before[1..], change));
    }
    let comment = "The fault is in the entry after a grid and a table, all packed";
    drafts.push(refused(
        (2030, "third-entry"),
        &["I-001"],
        comment,
        &before,
        NUMBERS[0].2,
    ));
    cut(drafts);
    taken(drafts);
    memory(drafts);
}

/// A `track` record whose last entry has a fault; packed where others stand before it.
fn refused(
    (id, name): (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    before: &[Entry],
    change: Change,
) -> Draft {
    let mut table = Table::packed(5).of_two();
    let mut faulty = Entry::of_table(7, table.clone());
    change(&mut faulty, &mut table);
    faulty.parameters = Parameters::Instances(table);
    let entries = [before, &[faulty]].concat();
    let pack = match before.len() {
        2 => Pack::Zstd(3),
        _ => Pack::None,
    };
    let name = format!("table-{name}");
    invalid(
        (id, &name),
        clauses,
        &format!("{comment}."),
        declared(pack, &tracks(&entries)),
    )
}

/// A stream that ends with a `track` record of this payload, and the offset of its fault.
fn declared(pack: Pack, payload: &[u8]) -> (usize, Vec<u8>) {
    let mut builder = StreamBuilder::started();
    builder.put_packed(kind::TRACK, pack, payload);
    let offset = builder.last() + HEADER;
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    (offset, builder.ended())
}

/// An entry that ends within its parameters.
fn cut(drafts: &mut Vec<Draft>) {
    for (name, size) in [
        ("before-signals", 56u32),
        ("before-distances", 60),
        ("before-share", 68),
        ("before-count", 72),
        ("before-exponent", 76),
    ] {
        let whole = Entry::of_table(1, Table::packed(5)).bytes();
        let mut short = whole[..size as usize].to_vec();
        short[..4].copy_from_slice(&size.to_le_bytes());
        let payload = [&[1, 0, 0, 0, 0, 0, 0, 0][..], &short].concat();
        drafts.push(invalid(
            (2001, &format!("table-cut-{name}")),
            &["C-040", "C-070"],
            "An entry of a table ends before its fields do.",
            declared(Pack::None, &payload),
        ));
    }
}

/// Name, clause, sentence, change.
type Taken = (&'static str, &'static str, &'static str, fn(&mut Table));

/// The other side of each bound.
fn taken(drafts: &mut Vec<Draft>) {
    let cases: &[Taken] = &[
        ("one-entry", "I-001", "A table of one entry.", |t| {
            t.count = 1
        }),
        ("exponent-3", "I-001", "The exponent is 3.", |t| {
            t.exponent = 3
        }),
        ("step-1", "I-001", "The step is 1.", |t| t.step = 1),
        ("step-32767", "I-001", "The step is 32767.", |t| {
            t.step = 32767
        }),
        ("cut-off", "O-001", "Kernel A has a cut-off.", |t| {
            t.kinds[0] = 2
        }),
        (
            "blended",
            "O-001",
            "One signal, which is the blend of two kernels.",
            |t| (t.kinds[1], t.distances[1], t.share) = (2, 300.0, 0.97),
        ),
        (
            "distance-least",
            "O-002",
            "The distance of kernel A is the smallest f32.",
            |t| t.distances[0] = f32::from_bits(1),
        ),
        (
            "share-1",
            "O-003",
            "Two signals, and the share of the second is 1.",
            |t| (*t, t.share) = (t.clone().of_two(), 1.0),
        ),
        (
            "share-0",
            "O-003",
            "Two signals, and the share of the second is 0.",
            |t| (*t, t.share) = (t.clone().of_two(), 0.0),
        ),
        (
            "share-minus-0",
            "O-003",
            "Two signals, and the share of the second is -0.",
            |t| (*t, t.share) = (t.clone().of_two(), -0.0),
        ),
    ];
    for &(name, clause, comment, change) in cases {
        for table in [Table::raw(5), Table::packed(5)] {
            let mut table = table;
            change(&mut table);
            let coding = if table.is_packed { "packed" } else { "raw" };
            let content = Content::new(1, some(&table, 3));
            let frames = Frames::new(&[Entry::of_table(1, table)]);
            let frames = frames.instances(&[content]).commit();
            let name = format!("table-{name}-{coding}");
            drafts.push(valid(&name, &[clause, "I-026"], comment, frames));
        }
    }
}

/// The memory of tables, clause I-002.
fn memory(drafts: &mut Vec<Draft>) {
    let table = |id, table| Entry::of_table(id, table);
    let cases = [
        (
            "one-entry",
            vec![table(1, Table::raw(1))],
            32,
            "One entry of one signal.",
        ),
        (
            "two-signals",
            vec![table(1, Table::packed(7).of_two())],
            7 * 48,
            "7 entries of two signals.",
        ),
        (
            "two-tables",
            vec![table(1, Table::raw(3)), table(2, Table::packed(2).of_two())],
            3 * 32 + 2 * 48,
            "Two tables of a record count together.",
        ),
        (
            "table-and-grid",
            vec![Entry::new(1), table(2, Table::packed(4))],
            5 * 32 + 6 * 36 + 4 * 32,
            "A table counts with the buckets and cells of a grid.",
        ),
    ];
    for (name, entries, bytes, comment) in cases {
        let contents: Vec<Content> = entries
            .iter()
            .filter_map(|entry| Some(Content::new(entry.id, some(entry.table()?, 1))))
            .collect();
        let frames = Frames::new(&entries).instances(&contents).commit();
        let draft = valid(
            &format!("state-{name}-at-limit"),
            &["I-002", "C-076"],
            &format!("{comment} The limit is just enough."),
            frames,
        );
        drafts.push(draft.limit("state_bytes", bytes));
        let draft = invalid(
            (2018, &format!("state-{name}-above-limit")),
            &["C-076"],
            &format!("{comment} The limit is one too low."),
            declared(Pack::None, &tracks(&entries)),
        );
        drafts.push(draft.limit("state_bytes", bytes - 1));
    }
    // A claim takes no memory.
    let most: Vec<Entry> = (1..=3)
        .map(|id| table(id, Table::packed(1 << 24).of_two()))
        .collect();
    for count in [1, 3] {
        drafts.push(invalid(
            (2018, &format!("state-{count}-of-2-24")),
            &["C-076"],
            "Tables of 2^24 entries of two signals, which are beyond the default limit.",
            declared(Pack::None, &tracks(&most[..count])),
        ));
    }
}
