//! The parameters of a track, clauses O-001 to O-003 and V-001.

use super::{Draft, Vertices, invalid, ordered, some, valid};
use crate::generate::frames::Frames;
use crate::models::Parameters;
use crate::models::entry::{Entry, tracks};
use crate::models::signals::SignalsBlock;
use crate::stream_builder::{HEADER, StreamBuilder, commit, group, kind};

type Change = fn(&mut Entry, &mut Vertices);
/// Name, sentence, fault.
type Fault = (&'static str, &'static str, Change);

const SIGNALS: &[Fault] = &[
    ("signals-0", "A value has no signal", |_, v| {
        v.signals.count = 0
    }),
    ("signals-3", "A value has three signals", |_, v| {
        v.signals.count = 3
    }),
    ("signals-255", "A value has 255 signals", |_, v| {
        v.signals.count = 255
    }),
    (
        "two-without-b",
        "A value has two signals, and there is no kernel B",
        |_, v| {
            v.signals = SignalsBlock {
                count: 2,
                ..SignalsBlock::ONE
            }
        },
    ),
    ("kernel-a-none", "There is no kernel A", |_, v| {
        v.signals.kinds[0] = 0;
        v.signals.distances[0] = 0.0;
    }),
    (
        "kernel-a-none-with-a-distance",
        "Kernel A is of kind 0, and has a distance",
        |_, v| v.signals.kinds[0] = 0,
    ),
    ("kernel-a-3", "Kernel A is of kind 3", |_, v| {
        v.signals.kinds[0] = 3
    }),
    ("kernel-b-3", "Kernel B is of kind 3", |_, v| {
        v.signals.kinds[1] = 3
    }),
    ("kernel-b-255", "Kernel B is of kind 255", |_, v| {
        v.signals.kinds[1] = 255
    }),
];

const DISTANCES: &[Fault] = &[
    ("distance-a-0", "The distance of kernel A is 0", |_, v| {
        v.signals.distances[0] = 0.0
    }),
    (
        "distance-a-negative",
        "The distance of kernel A is negative",
        |_, v| v.signals.distances[0] = -2.0,
    ),
    (
        "distance-a-cut-off-0",
        "The distance of a cut-off is 0",
        |_, v| {
            v.signals.kinds[0] = 2;
            v.signals.distances[0] = 0.0;
        },
    ),
    ("distance-b-0", "The distance of kernel B is 0", |_, v| {
        v.signals.distances[1] = 0.0
    }),
    (
        "distance-b-minus-0",
        "The distance of kernel B is -0",
        |_, v| v.signals.distances[1] = -0.0,
    ),
    (
        "distance-of-none",
        "There is a distance B without its kernel",
        |_, v| {
            v.signals = SignalsBlock {
                distances: [2.0, 300.0],
                ..SignalsBlock::ONE
            }
        },
    ),
    (
        "distance-of-none-minus-0",
        "The distance B without its kernel is -0",
        |_, v| {
            v.signals = SignalsBlock {
                distances: [2.0, -0.0],
                ..SignalsBlock::ONE
            }
        },
    ),
];

const SHARE: &[Fault] = &[
    ("share-above-1", "The share is the f32 above 1", |_, v| {
        v.signals.share = 1.0f32.next_up()
    }),
    (
        "share-below-0",
        "The share is the negative f32 next to 0",
        |_, v| v.signals.share = -f32::from_bits(1),
    ),
    (
        "share-of-none",
        "There is a share without kernel B",
        |_, v| {
            v.signals = SignalsBlock {
                share: 0.5,
                ..SignalsBlock::ONE
            }
        },
    ),
    (
        "share-of-none-minus-0",
        "The share without kernel B is -0",
        |_, v| {
            v.signals = SignalsBlock {
                share: -0.0,
                ..SignalsBlock::ONE
            }
        },
    ),
];

const VERTICES: &[Fault] = &[
    ("vertices-0", "There is no vertex", |_, v| v.count = 0),
    (
        "vertices-2-28-and-1",
        "There are 2^28 + 1 vertices",
        |_, v| v.count = (1 << 28) + 1,
    ),
    ("vertices-most", "There are 2^32 - 1 vertices", |_, v| {
        v.count = u32::MAX
    }),
    ("bits-0", "A code has 0 bits", |_, v| v.bits = 0),
    ("bits-4", "A code has 4 bits", |_, v| v.bits = 4),
    ("bits-6", "A code has 6 bits", |_, v| v.bits = 6),
    ("bits-9", "A code has 9 bits", |_, v| v.bits = 9),
    ("bits-16", "A code has 16 bits", |_, v| v.bits = 16),
    ("bits-255", "A code has 255 bits", |_, v| v.bits = 255),
    ("order-2", "The order is 2", |_, v| v.order = 2),
    ("order-255", "The order is 255", |_, v| v.order = 255),
];

const FINITE: &[Fault] = &[
    ("distance-a", "The distance of kernel A is NaN", |_, v| {
        v.signals.distances[0] = f32::NAN
    }),
    (
        "distance-b",
        "The distance of kernel B is infinite",
        |_, v| v.signals.distances[1] = f32::INFINITY,
    ),
    ("share", "The share is NaN", |_, v| {
        v.signals.share = f32::NAN
    }),
    (
        "distance-of-none",
        "The distance B without its kernel is NaN",
        |_, v| {
            v.signals = SignalsBlock {
                distances: [2.0, f32::NAN],
                ..SignalsBlock::ONE
            }
        },
    ),
];

const RESERVED: &[Fault] = &[
    (
        "after-kinds",
        "The field after the kinds is not 0",
        |_, v| v.signals.reserved = 1,
    ),
    ("last-bit-0", "Bit 0 of the last field is set", |_, v| {
        v.reserved = 1
    }),
    ("last-bit-15", "Bit 15 of the last field is set", |_, v| {
        v.reserved = 0x8000
    }),
];

const CODING: &[Fault] = &[
    ("coding-2", "The coding is 2", |e, _| e.coding = 2),
    ("coding-257", "The coding is 257", |e, _| e.coding = 257),
];

const SPACE: &[Fault] = &[
    ("space-rest", "The lookup space is rest", |e, _| e.space = 1),
    ("space-2", "The lookup space is 2", |e, _| e.space = 2),
];

/// Error, name, sentence, clauses, two faults of an entry; the first decides.
const ORDER: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        2020,
        "space-before-signals",
        "The space is checked before the signals",
        &["C-071", "O-001"],
        |e, v| {
            e.space = 1;
            v.signals.count = 0;
        },
    ),
    (
        2002,
        "reserved-before-distance",
        "The field after the kinds is read before the distances",
        &["C-041", "C-042"],
        |_, v| {
            v.signals.reserved = 1;
            v.signals.distances[0] = f32::NAN;
        },
    ),
    (
        2009,
        "share-before-reserved",
        "The share is read before the last field",
        &["C-042", "C-041"],
        |_, v| {
            v.signals.share = f32::NAN;
            v.reserved = 1;
        },
    ),
    (
        2011,
        "path-before-signals",
        "The path is checked before the signals",
        &["C-072", "O-001"],
        |e, v| {
            e.path = vec![0xff];
            v.signals.count = 0;
        },
    ),
    (
        2010,
        "box-before-signals",
        "The AABB is checked before the signals",
        &["C-073", "O-001"],
        |e, v| {
            e.aabb[0] = 9.0;
            v.signals.count = 0;
        },
    ),
    (
        2028,
        "signals-before-vertices",
        "The share is checked before the number of vertices",
        &["O-003", "V-001"],
        |_, v| {
            v.signals.share = 2.0;
            v.count = 0;
        },
    ),
];

/// The usual entry of a track: two signals, packed.
fn entry(change: Change) -> Entry {
    let mut vertices = Vertices::packed(4).two();
    let mut entry = Entry::of_vertices(2, vertices.clone());
    change(&mut entry, &mut vertices);
    entry.parameters = Parameters::Vertices(vertices);
    entry
}

/// A stream whose second track is the entry, and the offset of its record's payload.
fn declared(entry: Entry) -> (usize, Vec<u8>) {
    let first = Entry::of_vertices(1, Vertices::raw(2));
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(&[first, entry]));
    let offset = builder.last() + HEADER;
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    (offset, builder.ended())
}

pub fn add(drafts: &mut Vec<Draft>) {
    for (error, clause, faults) in [
        (2028, "O-001", SIGNALS),
        (2028, "O-002", DISTANCES),
        (2028, "O-003", SHARE),
        (2029, "V-001", VERTICES),
        (2009, "C-042", FINITE),
        (2002, "C-041", RESERVED),
        (2008, "C-071", CODING),
        (2020, "C-071", SPACE),
    ] {
        for &(name, comment, change) in faults {
            let comment = format!("{comment}.");
            let refused = declared(entry(change));
            drafts.push(invalid((error, name), &[clause], &comment, refused));
        }
    }
    for &(error, name, comment, clauses, change) in ORDER {
        let comment = format!("{comment}.");
        drafts.push(ordered(
            (error, name),
            clauses,
            &comment,
            declared(entry(change)),
        ));
    }
    cut(drafts);
    accepted(drafts);
    again(drafts);
}

/// Entries that end within their parameters.
fn cut(drafts: &mut Vec<Draft>) {
    for length in [56, 60, 72, 76] {
        let mut bytes = entry(|_, _| {}).bytes();
        bytes.truncate(length);
        bytes[..4].copy_from_slice(&(length as u32).to_le_bytes());
        let mut payload = tracks(&[]);
        payload[0] = 1;
        payload.extend(bytes);
        let mut builder = StreamBuilder::started();
        builder.put(kind::TRACK, &payload);
        let offset = builder.last() + HEADER;
        let comment = format!("An entry ends after {length} of its 80 bytes.");
        drafts.push(invalid(
            (2001, &format!("entry-of-{length}")),
            &["C-070"],
            &comment,
            (offset, builder.ended()),
        ));
    }
}

/// Parameters at their bounds.
fn accepted(drafts: &mut Vec<Draft>) {
    let signals = |change: fn(&mut SignalsBlock)| {
        let mut signals = SignalsBlock::TWO;
        change(&mut signals);
        Vertices {
            signals,
            ..Vertices::raw(3)
        }
    };
    let cases: [(&str, &str, &[&'static str], Vertices); 9] = [
        (
            "signals-one-cut-off",
            "One signal of a cut-off.",
            &["V-010"],
            Vertices {
                signals: SignalsBlock {
                    kinds: [2, 0],
                    ..SignalsBlock::ONE
                },
                ..Vertices::raw(3)
            },
        ),
        (
            "signals-blended",
            "One signal that is the blend of two: a value a vertex.",
            &["V-010", "V-020"],
            Vertices {
                signals: SignalsBlock::BLENDED,
                ..Vertices::raw(3)
            },
        ),
        (
            "signals-both-kinds",
            "Two signals, of an exponential kernel and of a cut-off.",
            &["V-010"],
            signals(|s| s.kinds = [1, 2]),
        ),
        (
            "share-minus-0",
            "A share of -0 is one of 0.",
            &["V-010"],
            signals(|s| s.share = -0.0),
        ),
        (
            "share-1",
            "A share of 1.",
            &["V-010"],
            signals(|s| s.share = 1.0),
        ),
        (
            "distances-least",
            "The smallest distances that there are.",
            &["V-010"],
            signals(|s| s.distances = [f32::from_bits(1); 2]),
        ),
        (
            "distances-most",
            "The largest finite distances.",
            &["V-010"],
            signals(|s| s.distances = [f32::MAX; 2]),
        ),
        (
            "order-distinct",
            "Distinct vertices: a decoder does nothing else for them.",
            &["V-010"],
            Vertices {
                order: 1,
                ..Vertices::packed(6)
            },
        ),
        (
            "one-vertex",
            "A track of one vertex.",
            &["V-010", "V-030"],
            Vertices::packed(1),
        ),
    ];
    for (name, comment, clauses, vertices) in cases {
        let codes = some(&vertices, 1);
        let frames = super::streams(&[vertices]).vertices(&[(1, codes)]).commit();
        drafts.push(valid(name, clauses, comment, &frames));
    }
}

/// Tracks that are declared again with other parameters.
fn again(drafts: &mut Vec<Draft>) {
    let vertices = Vertices::raw(3).two();
    let first = Entry::of_vertices(1, vertices.clone());
    let begun = Frames::new(std::slice::from_ref(&first))
        .vertices(&[(1, some(&vertices, 1))])
        .commit();
    let faults: &[Fault] = &[
        ("order", "another order", |_, v| v.order = 1),
        ("bits", "other bits", |_, v| v.bits = 5),
        ("count", "another number of vertices", |_, v| v.count = 4),
        ("share", "another share", |_, v| v.signals.share = 0.5),
        ("coding", "another coding", |e, _| e.coding = 1),
    ];
    for &(name, what, change) in faults {
        let mut other = vertices.clone();
        let mut entry = first.clone();
        change(&mut entry, &mut other);
        entry.parameters = Parameters::Vertices(other);
        let refused = begun.clone().refused_of(kind::TRACK, &tracks(&[entry]));
        let comment = format!("A track is declared again with {what}.");
        let name = format!("other-{name}");
        drafts.push(invalid((2006, &name), &["C-075"], &comment, refused));
    }
}
