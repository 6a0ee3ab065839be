//! The parameters of a volume, clauses B-001 to B-005: each field at its bounds, from both sides.

use super::{Content, Draft, Frames, Volume, invalid, some, valid};
use crate::models::Parameters;
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{HEADER, Pack, StreamBuilder, commit, group, kind};

type Change = fn(&mut Entry, &mut Volume);
/// Name, sentence, fault.
type Fault = (&'static str, &'static str, Change);

const DIMS: &[Fault] = &[
    ("dx-0", "Dx is 0", |_, v| v.dims = [0, 2, 2]),
    ("dy-0", "Dy is 0", |_, v| v.dims = [3, 0, 2]),
    ("dz-0", "Dz is 0", |_, v| v.dims = [3, 2, 0]),
    ("dims-0", "Dx, Dy and Dz are 0", |_, v| v.dims = [0; 3]),
    (
        "probes-2-24-and-more",
        "There are 2^24 probes and a row",
        |_, v| v.dims = [4096, 4097, 1],
    ),
    ("probes-wrap", "There are 2^32 + 2^24 probes", |_, v| {
        v.dims = [4096, 4096, 257]
    }),
    ("probes-2-32", "There are 2^32 probes", |_, v| {
        v.dims = [32768, 32768, 4]
    }),
    ("probes-most", "Dx, Dy and Dz are 65535", |_, v| {
        v.dims = [65535; 3]
    }),
];

const SPACING: &[Fault] = &[
    ("sx-0", "sx is 0", |_, v| v.spacing[0] = 0.0),
    ("sy-minus-0", "sy is -0", |_, v| v.spacing[1] = -0.0),
    ("sz-negative", "sz is negative", |_, v| v.spacing[2] = -1.0),
    ("spacing-negative", "All three are negative", |_, v| {
        v.spacing = [-1.0; 3]
    }),
    (
        "sy-least-negative",
        "sy is the negative number next to 0",
        |_, v| v.spacing[1] = -f32::from_bits(1),
    ),
];

const EXPONENT: &[Fault] = &[
    ("exponent-65", "The exponent is 65", |_, v| v.exponent = 65),
    ("exponent-minus-65", "The exponent is -65", |_, v| {
        v.exponent = -65
    }),
    ("exponent-127", "The exponent is 127", |_, v| {
        v.exponent = 127
    }),
    ("exponent-minus-128", "The exponent is -128", |_, v| {
        v.exponent = -128
    }),
];

const VISIBILITY: &[Fault] = &[
    ("side-1", "The side of the visibility map is 1", |_, v| {
        (v.side, v.range) = (1, 8.0)
    }),
    ("side-5", "The side of the visibility map is 5", |_, v| {
        (v.side, v.range) = (5, 8.0)
    }),
    ("side-12", "The side of the visibility map is 12", |_, v| {
        (v.side, v.range) = (12, 8.0)
    }),
    ("side-32", "The side of the visibility map is 32", |_, v| {
        (v.side, v.range) = (32, 8.0)
    }),
    (
        "side-255",
        "The side of the visibility map is 255",
        |_, v| (v.side, v.range) = (255, 8.0),
    ),
    ("side-4-range-0", "The side is 4 and the range 0", |_, v| {
        (v.side, v.range, v.map_steps) = (4, 0.0, [1, 1])
    }),
    (
        "side-8-range-minus-0",
        "The side is 8 and the range -0",
        |_, v| (v.side, v.range, v.map_steps) = (8, -0.0, [1, 1]),
    ),
    (
        "side-16-range-negative",
        "The side is 16 and the range negative",
        |_, v| (v.side, v.range, v.map_steps) = (16, -8.0, [1, 1]),
    ),
    (
        "side-0-range",
        "The side is 0 and the range is not",
        |_, v| v.range = 8.0,
    ),
    (
        "side-0-range-minus-0",
        "The side is 0 and the range -0",
        |_, v| v.range = -0.0,
    ),
    (
        "side-0-range-least",
        "The side is 0 and the range the smallest f32",
        |_, v| v.range = f32::from_bits(1),
    ),
    (
        "side-0-map-step",
        "The side is 0 and a map step is not",
        |_, v| v.map_steps = [1, 0],
    ),
    (
        "side-0-map-step-of-deviations",
        "The side is 0 and the step of deviations is not",
        |_, v| v.map_steps = [0, 255],
    ),
    (
        "map-step-0",
        "Packed maps have the step 0 of means",
        |_, v| (v.side, v.range, v.map_steps) = (4, 8.0, [0, 1]),
    ),
    (
        "map-step-0-of-deviations",
        "Packed maps have the step 0 of deviations",
        |_, v| (v.side, v.range, v.map_steps) = (4, 8.0, [1, 0]),
    ),
    ("raw-map-step", "Raw maps have a map step", |e, v| {
        (v.side, v.range, v.map_steps) = (8, 8.0, [0, 1]);
        (e.coding, v.steps) = (0, [0; 6]);
    }),
];

const STEPS: &[Fault] = &[
    ("s0-0", "s0 is 0", |_, v| v.steps[0] = 0),
    ("s0-2561", "s0 is 2561", |_, v| v.steps[0] = 2561),
    ("s0-most", "s0 is 65535", |_, v| v.steps[0] = 65535),
    ("s1-0", "s1 is 0", |_, v| v.steps[1] = 0),
    ("s2-32769", "s2 is 32769", |_, v| v.steps[2] = 32769),
    ("s3-0", "s3 is 0", |_, v| v.steps[3] = 0),
    ("s4-most", "s4 is 65535", |_, v| v.steps[4] = 65535),
    ("s5-0", "s5 is 0", |_, v| v.steps[5] = 0),
    ("s5-32769", "s5 is 32769", |_, v| v.steps[5] = 32769),
    ("steps-0", "All steps of packed probes are 0", |_, v| {
        v.steps = [0; 6]
    }),
];

const RESERVED: &[Fault] = &[
    ("after-dims", "The field after the dims is not 0", |_, v| {
        v.dims_reserved = 0x8000
    }),
    ("raw-s0", "Raw probes have a step s0", |e, v| {
        (e.coding, v.steps) = (0, [1, 0, 0, 0, 0, 0])
    }),
    ("raw-s5", "Raw probes have a step s5", |e, v| {
        (e.coding, v.steps) = (0, [0, 0, 0, 0, 0, 0x8000])
    }),
];

const FINITE: &[Fault] = &[
    (
        "grid-first",
        "The first f32 of grid_from_mesh is NaN",
        |_, v| v.grid_from_mesh[0] = f32::NAN,
    ),
    (
        "grid-last",
        "The last f32 of grid_from_mesh is infinite",
        |_, v| v.grid_from_mesh[11] = f32::INFINITY,
    ),
    ("sx", "sx is infinite", |_, v| v.spacing[0] = f32::INFINITY),
    ("sz", "sz is NaN", |_, v| v.spacing[2] = f32::NAN),
    ("range", "The range is minus infinity", |_, v| {
        v.range = f32::NEG_INFINITY
    }),
    ("range-with-side", "The range of a map is NaN", |_, v| {
        (v.side, v.range) = (8, f32::NAN)
    }),
];

const CODING: &[Fault] = &[
    ("coding-2", "The coding is 2", |e, _| e.coding = 2),
    ("coding-257", "The coding is 257", |e, _| e.coding = 257),
];

const SPACE: &[Fault] = &[
    (
        "space-rest",
        "A volume has the lookup space rest",
        |e, _| e.space = 1,
    ),
    ("space-2", "A volume has the lookup space 2", |e, _| {
        e.space = 2
    }),
];

/// Error, name, sentence, clauses, two faults of an entry; the first decides.
const ORDER: &[(u16, &str, &str, &[&str], Change)] = &[
    (
        2020,
        "space-before-dims",
        "The space is checked before the dims",
        &["C-071", "B-001"],
        |e, v| {
            e.space = 1;
            v.dims[0] = 0;
        },
    ),
    (
        2020,
        "space-before-numbers",
        "The space is checked before the numbers",
        &["C-071", "C-042"],
        |e, v| {
            e.space = 1;
            v.spacing[0] = f32::NAN;
        },
    ),
    (
        2002,
        "reserved-before-range",
        "The field after the dims is read before the range",
        &["C-041", "C-042"],
        |_, v| {
            v.range = f32::NAN;
            v.dims_reserved = 1;
        },
    ),
    (
        2009,
        "range-before-map-steps",
        "All fields are read before the map steps are checked",
        &["C-042", "B-004"],
        |_, v| {
            v.range = f32::NAN;
            v.map_steps = [1, 0];
        },
    ),
    (
        2025,
        "map-steps-before-steps",
        "Map steps are checked before the steps of a packed volume",
        &["B-004", "B-005"],
        |_, v| {
            v.map_steps = [1, 1];
            v.steps[0] = 0;
        },
    ),
    (
        2002,
        "raw-steps-before-dims",
        "Steps of raw probes are checked when they are read, before the dims",
        &["C-041", "B-001"],
        |e, v| {
            e.coding = 0;
            v.dims[0] = 0;
        },
    ),
    (
        2002,
        "raw-steps-before-padding",
        "Steps of raw probes are checked when they are read, before the path",
        &["C-041", "C-072"],
        |e, _| {
            e.coding = 0;
            e.path = vec![0xff];
        },
    ),
    (
        2011,
        "path-before-dims",
        "The path is checked before the dims",
        &["C-072", "B-001"],
        |e, v| {
            e.path = vec![0xff];
            v.dims[0] = 0;
        },
    ),
    (
        2010,
        "bounds-before-dims",
        "The AABB is checked before the dims",
        &["C-073", "B-001"],
        |e, v| {
            e.aabb[0] = 9.0;
            v.dims[0] = 0;
        },
    ),
    (
        2022,
        "dims-before-spacing",
        "The dims are checked before the spacing",
        &["B-001", "B-002"],
        |_, v| {
            v.dims[0] = 0;
            v.spacing[0] = 0.0;
        },
    ),
    (
        2023,
        "spacing-before-exponent",
        "The spacing is checked before the exponent",
        &["B-002", "B-003"],
        |_, v| {
            v.spacing[0] = 0.0;
            v.exponent = 65;
        },
    ),
    (
        2024,
        "exponent-before-side",
        "The exponent is checked before the side",
        &["B-003", "B-004"],
        |_, v| {
            v.exponent = 65;
            v.side = 5;
        },
    ),
    (
        2025,
        "side-before-steps",
        "The side is checked before the steps",
        &["B-004", "B-005"],
        |_, v| {
            v.side = 5;
            v.steps[0] = 0;
        },
    ),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for (id, clause, faults) in [
        (2022, "B-001", DIMS),
        (2023, "B-002", SPACING),
        (2024, "B-003", EXPONENT),
        (2025, "B-004", VISIBILITY),
        (2026, "B-005", STEPS),
        (2002, "C-041", RESERVED),
        (2009, "C-042", FINITE),
        (2008, "C-071", CODING),
        (2020, "C-071", SPACE),
    ] {
        for &(name, comment, change) in faults {
            drafts.push(refused((id, name), &[clause], comment, &[], change));
        }
    }
    for &(id, name, comment, clauses, change) in ORDER {
        let clauses = &[clauses, &["C-112"]].concat();
        let name = format!("order-{name}");
        drafts.push(refused((id, &name), clauses, comment, &[], change));
    }
    let grid = Entry::new(1);
    let before = [grid, Entry::of_volume(2, Volume::raw([1, 1, 1]))];
    for (id, clause, faults) in [
        (2022, "B-001", DIMS),
        (2023, "B-002", SPACING),
        (2024, "B-003", EXPONENT),
        (2025, "B-004", VISIBILITY),
        (2026, "B-005", STEPS),
    ] {
        let comment = "The fault is in the entry after a grid and a volume, all packed";
        let error = (id, "third-entry");
        drafts.push(refused(error, &[clause], comment, &before, faults[0].2));
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
    let mut volume = Volume::packed([3, 2, 2]);
    let mut faulty = Entry::of_volume(7, volume.clone());
    change(&mut faulty, &mut volume);
    faulty.parameters = Parameters::Probes(volume);
    let entries = [before, &[faulty]].concat();
    let pack = if before.is_empty() {
        Pack::None
    } else {
        Pack::Zstd(3)
    };
    let mut builder = StreamBuilder::started();
    builder.put_packed(kind::TRACK, pack, &tracks(&entries));
    let offset = builder.last() + HEADER;
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    let name = format!("volume-{name}");
    invalid(
        (id, &name),
        clauses,
        &format!("{comment}."),
        (offset, builder.ended()),
    )
}

/// An entry that ends within its parameters.
fn cut(drafts: &mut Vec<Draft>) {
    for (name, size) in [
        ("before-dims", 104u32),
        ("after-dims", 112),
        ("before-exponent", 124),
        ("before-range", 128),
        ("before-steps", 132),
        ("before-last-step", 140),
        ("before-path", 144),
    ] {
        let whole = Entry::of_volume(1, Volume::packed([3, 2, 2])).bytes();
        let mut short = whole[..size as usize].to_vec();
        short[..4].copy_from_slice(&size.to_le_bytes());
        let mut builder = StreamBuilder::started();
        builder.put(
            kind::TRACK,
            &[&[1, 0, 0, 0, 0, 0, 0, 0][..], &short].concat(),
        );
        let offset = builder.last() + HEADER;
        builder
            .put(kind::GROUP, &group(0, 0, 0))
            .put(kind::COMMIT, &commit(0, 0, None));
        let name = format!("volume-cut-{name}");
        let comment = "An entry of a volume ends before its fields do.";
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
type Taken = (&'static str, &'static str, &'static str, fn(&mut Volume));

/// The other side of each bound.
fn taken(drafts: &mut Vec<Draft>) {
    let cases: &[Taken] = &[
        ("one-probe", "B-001", "A volume of one probe.", |v| {
            v.dims = [1; 3]
        }),
        (
            "long-in-x",
            "B-001",
            "A volume of 300 x 1 x 1 probes.",
            |v| v.dims = [300, 1, 1],
        ),
        (
            "long-in-y",
            "B-001",
            "A volume of 1 x 300 x 1 probes.",
            |v| v.dims = [1, 300, 1],
        ),
        (
            "long-in-z",
            "B-001",
            "A volume of 1 x 1 x 300 probes.",
            |v| v.dims = [1, 1, 300],
        ),
        ("flat", "B-001", "A volume of 9 x 1 x 7 probes.", |v| {
            v.dims = [9, 1, 7]
        }),
        (
            "spacing-least",
            "B-002",
            "Spacing of the smallest and the largest f32.",
            |v| v.spacing = [f32::from_bits(1), f32::MAX, f32::MIN_POSITIVE],
        ),
        ("exponent-64", "B-003", "The exponent is 64.", |v| {
            v.exponent = 64
        }),
        ("exponent-minus-64", "B-003", "The exponent is -64.", |v| {
            v.exponent = -64
        }),
        ("exponent-minus-1", "B-003", "The exponent is -1.", |v| {
            v.exponent = -1
        }),
        (
            "side-4",
            "B-004",
            "A visibility map of 4 x 4, its range the smallest f32.",
            |v| seeing(v, 4, f32::from_bits(1)),
        ),
        (
            "side-8",
            "B-004",
            "A visibility map of 8 x 8, its range the largest f32.",
            |v| seeing(v, 8, f32::MAX),
        ),
        ("side-16", "B-004", "A visibility map of 16 x 16.", |v| {
            seeing(v, 16, 1.0)
        }),
        (
            "grid-any",
            "C-042",
            "grid_from_mesh holds -0, the smallest and the largest f32.",
            |v| {
                let bits = [0x8000_0000, 1, 0x7f7f_ffff, 0xff7f_ffff, 0x8000_0001];
                for (value, bits) in v.grid_from_mesh.iter_mut().zip(bits) {
                    *value = f32::from_bits(bits);
                }
            },
        ),
    ];
    for (coding, volume) in [
        ("raw", Volume::raw([3, 2, 2])),
        ("packed", Volume::packed([3, 2, 2])),
    ] {
        for &(name, clause, comment, change) in cases {
            let mut volume = volume.clone();
            change(&mut volume);
            let frames = shown(&volume);
            drafts.push(valid(
                &format!("volume-{name}-{coding}"),
                &[clause, "B-062"],
                comment,
                frames,
            ));
        }
    }
    for (name, comment, steps) in [
        ("steps-least", "All steps are 1.", [1; 6]),
        (
            "steps-most",
            "Each step is the largest there may be.",
            [2560, 32768, 32768, 32768, 32768, 32768],
        ),
        (
            "steps-all-other",
            "No step is like another.",
            [7, 11, 13, 17, 19, 23],
        ),
    ] {
        let volume = Volume {
            steps,
            ..Volume::packed([3, 2, 2])
        };
        let frames = shown(&volume);
        drafts.push(valid(
            &format!("volume-{name}"),
            &["B-005", "B-050", "B-051"],
            comment,
            frames,
        ));
    }
    let (frames, comment) = (
        Frames::new(&[Entry::of_volume(1, Volume::packed([65535, 1, 1]))]).commit(),
        "A volume of 65535 probes that never come.",
    );
    drafts.push(valid("volume-65535-probes", &["B-001"], comment, frames));
    again(drafts);
}

/// Gives a volume maps of a side and a range.
fn seeing(volume: &mut Volume, side: u8, range: f32) {
    *volume = Volume {
        range,
        ..volume.clone().seeing(side)
    };
}

/// A keyframe and a delta of a volume.
fn shown(volume: &Volume) -> Frames {
    let first = some(volume, 1);
    let next = super::later(volume, &first, 2);
    let mut content = Content::new(1, first);
    if volume.side > 0 {
        content.visibility = Some(super::seen(volume, 3));
    }
    super::streams(std::slice::from_ref(volume))
        .probes(true, &[content])
        .commit()
        .probes(false, &[Content::new(1, next)])
        .commit()
}

/// A volume declared again, as it was and not.
fn again(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([3, 2, 2]).seeing(4);
    let entry = Entry::of_volume(1, volume.clone());
    let frames = shown(&volume);
    let same = frames
        .clone()
        .declare(std::slice::from_ref(&entry))
        .commit();
    let comment = "A live volume is declared again, and keeps its probes.";
    drafts.push(valid("volume-declared-again", &["C-075"], comment, same));
    let mut zeros = volume.clone();
    zeros.grid_from_mesh[1] = -0.0;
    zeros.grid_from_mesh[11] = -0.0;
    let mut other = entry.clone();
    other.aabb[2] = -0.0;
    other.parameters = Parameters::Probes(zeros);
    let other = frames.clone().declare(&[other]).commit();
    let comment =
        "A live volume is declared again with -0 for 0 in grid_from_mesh and in its AABB.";
    let clauses = &["C-075", "C-078"];
    drafts.push(valid(
        "volume-again-with-other-zero",
        clauses,
        comment,
        other,
    ));
    let changes: &[Fault] = &[
        ("dims", "dims", |_, v| v.dims = [2, 3, 2]),
        ("spacing", "spacing", |_, v| v.spacing[1] = 0.875),
        ("exponent", "exponent", |_, v| v.exponent = 1),
        ("side", "side of the map", |_, v| v.side = 8),
        ("range", "range", |_, v| v.range = 4.0),
        ("last-step", "last step", |_, v| v.steps[5] += 1),
        ("first-step", "first step", |_, v| v.steps[0] += 1),
        ("grid", "grid_from_mesh", |_, v| v.grid_from_mesh[3] = 1.0),
        ("map-step", "map step", |_, v| v.map_steps[0] += 1),
        ("coding", "coding", |e, v| {
            (e.coding, v.steps, v.map_steps) = (0, [0; 6], [0; 2])
        }),
    ];
    for &(name, what, change) in changes {
        let mut other = entry.clone();
        let mut parameters = volume.clone();
        change(&mut other, &mut parameters);
        other.parameters = Parameters::Probes(parameters);
        let refused = frames.clone().refused_of(kind::TRACK, &tracks(&[other]));
        let comment = format!("A live volume is declared again with another {what}.");
        drafts.push(invalid(
            (2006, &format!("volume-{name}")),
            &["C-075"],
            &comment,
            refused,
        ));
    }
    let mut as_points = Entry::new(1);
    as_points.path.clone_from(&entry.path);
    let refused = frames.refused_of(kind::TRACK, &tracks(&[as_points]));
    let comment = "A live volume is declared again as a grid of points.";
    drafts.push(invalid(
        (2006, "volume-model"),
        &["C-075"],
        comment,
        refused,
    ));
}
