//! The coding `raw`, clauses B-020 to B-025.

use super::{Content, Draft, Place, Volume, faults, ordered, some, streams, valid};
use crate::models::probes::writer::Probe;

/// 9 probes: two bytes a bitmap, seven bits of them spare.
const DIMS: [u16; 3] = [3, 1, 3];

pub fn add(drafts: &mut Vec<Draft>) {
    sizes(drafts);
    reserved(drafts);
    numbers(drafts);
    order(drafts);
    taken(drafts);
}

fn sizes(drafts: &mut Vec<Draft>) {
    let volume = Volume::raw(DIMS);
    faults(
        drafts,
        (3101, "B-021"),
        &volume,
        &[
            ("raw-empty", "The section is empty", |s| s.probes.clear()),
            ("raw-one-byte", "The section has one byte", |s| {
                s.probes.truncate(1)
            }),
            ("raw-first-bitmap", "The section has one bitmap", |s| {
                s.probes.truncate(2)
            }),
            ("raw-bitmap-short", "The second bitmap lacks a byte", |s| {
                s.probes.truncate(3)
            }),
        ],
    );
    faults(
        drafts,
        (3101, "B-023"),
        &volume,
        &[
            ("raw-bitmaps-alone", "No values follow the bitmaps", |s| {
                s.probes.truncate(4)
            }),
            ("raw-value-short", "The last probe lacks a byte", |s| {
                _ = s.probes.pop()
            }),
            ("raw-probe-short", "The last probe is missing", |s| {
                s.probes.truncate(s.probes.len() - 56)
            }),
            ("raw-byte-over", "A byte follows the last probe", |s| {
                s.probes.push(0)
            }),
            ("raw-probe-over", "A probe follows the last one", |s| {
                s.probes.extend([0; 56])
            }),
        ],
    );
    let full = Volume::raw([8, 1, 1]);
    faults(
        drafts,
        (3101, "B-021"),
        &full,
        &[(
            "raw-of-8-one-bitmap",
            "A volume of 8 probes has one byte of bitmaps",
            |s| s.probes.truncate(1),
        )],
    );
}

fn reserved(drafts: &mut Vec<Draft>) {
    let volume = Volume::raw(DIMS);
    faults(
        drafts,
        (3102, "B-022"),
        &volume,
        &[
            (
                "raw-changed-past-end",
                "The bit of probe 9 of 9 is set among those that change",
                |s| s.probes[1] |= 2,
            ),
            (
                "raw-changed-past-end-last",
                "The last bit of the first bitmap is set",
                |s| s.probes[1] |= 0x80,
            ),
            (
                "raw-present-past-end",
                "The bit of probe 9 of 9 is set in both",
                |s| {
                    s.probes[1] |= 2;
                    s.probes[3] |= 2;
                    s.probes.extend([0; 56]);
                },
            ),
            (
                "raw-present-past-end-alone",
                "The last bit of the second bitmap is set",
                |s| s.probes[3] |= 0x80,
            ),
            (
                "raw-present-unchanged",
                "A probe that does not change is present",
                |s| {
                    // Its values stay, so that all else fits.
                    let bit = s.probes[2] & s.probes[2].wrapping_neg();
                    s.probes[0] &= !bit;
                },
            ),
        ],
    );
    faults(
        drafts,
        (3102, "B-025"),
        &volume,
        &[
            (
                "raw-first-pad",
                "The first byte after the values of a probe is not 0",
                |s| s.probes[4 + 54] = 1,
            ),
            (
                "raw-last-pad",
                "The last byte of the last probe is not 0",
                |s| {
                    if let Some(last) = s.probes.last_mut() {
                        *last = 0x80;
                    }
                },
            ),
        ],
    );
}

/// Values that are not finite, or negative where they may not be.
fn numbers(drafts: &mut Vec<Draft>) {
    let volume = Volume::raw(DIMS);
    for (name, value, bits, comment) in [
        ("infinite-first", 0, 0x7c00, "Value 0 is infinite"),
        ("infinite-last", 26, 0x7c00, "Value 26 is infinite"),
        ("minus-infinite", 13, 0xfc00, "Value 13 is minus infinity"),
        ("nan", 9, 0x7e00, "Value 9 is not a number"),
        ("nan-signalling", 3, 0x7c01, "Value 3 is a signalling NaN"),
        ("nan-negative", 26, 0xffff, "Value 26 is the last NaN"),
        (
            "red-negative",
            0,
            0x8001,
            "Value 0 is the negative number next to 0",
        ),
        ("green-minus-0", 1, 0x8000, "Value 1 is -0"),
        ("blue-negative", 2, 0xfbff, "Value 2 is -65504"),
    ] {
        for place in Place::ALL {
            let mut probes = some(&volume, 7);
            probes[4] = Probe::raw(&[0; 27]);
            probes[4].codes[value] = i32::from(bits as u16 as i16);
            let refused = place.with_probes(&volume, probes);
            let name = format!("raw-{name}-{}", place.name());
            let comment = format!("{comment}, in {}.", place.words());
            drafts.push(super::invalid((3103, &name), &["B-024"], &comment, refused));
        }
    }
}

fn order(drafts: &mut Vec<Draft>) {
    let volume = Volume::raw(DIMS);
    let mut case = |id, name, clauses: &[&'static str], comment, change: fn(&mut Vec<u8>)| {
        let refused = Place::Keyframe.with_section(&volume, |s| change(&mut s.probes));
        drafts.push(ordered((id, name), clauses, comment, refused));
    };
    case(
        3102,
        "raw-bits-then-size",
        &["B-022", "B-023"],
        "Spare bits come before the size of the values.",
        |p| {
            p[1] |= 2;
            p.push(0);
        },
    );
    case(
        3101,
        "raw-size-then-value",
        &["B-023", "B-024"],
        "The size of the values comes before the first of them.",
        |p| {
            p[5] = 0x7c;
            p.push(0);
        },
    );
    case(
        3103,
        "raw-value-then-pad",
        &["B-024", "B-025"],
        "The values of a probe come before the bytes after them.",
        |p| {
            p[4 + 53] = 0x7c;
            p[4 + 54] = 1;
        },
    );
    case(
        3102,
        "raw-pad-then-next-value",
        &["B-025", "B-024"],
        "A probe comes before the next.",
        |p| {
            p[4 + 55] = 1;
            p[4 + 56 + 1] = 0xfc;
        },
    );
}

fn taken(drafts: &mut Vec<Draft>) {
    for (name, dims) in [
        ("1", [1, 1, 1]),
        ("7", [7, 1, 1]),
        ("8", [2, 2, 2]),
        ("9", DIMS),
        ("16", [4, 2, 2]),
        ("17", [1, 17, 1]),
    ] {
        let volume = Volume::raw(dims);
        let first = some(&volume, 11);
        let second = super::later(&volume, &first, 12);
        let frames = streams(std::slice::from_ref(&volume))
            .probes(true, &[Content::new(1, first)])
            .commit()
            .probes(false, &[Content::new(1, second)])
            .commit();
        let comment = format!("A keyframe and a delta of a volume of {name} raw probes.");
        let name = format!("raw-{name}-probes");
        drafts.push(valid(&name, &["B-020", "B-011", "B-062"], &comment, frames));
    }
    let volume = Volume::raw([3, 2, 2]);
    let first: Vec<Probe> = some(&volume, 11);
    let begun = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, first.clone())])
        .commit();
    let mut case = |name: &str, comment: &str, probes: &[Probe], touched: &[usize]| {
        let content = Content {
            touched: touched.to_vec(),
            ..Content::new(1, probes.to_vec())
        };
        let frames = begun.clone().probes(false, &[content]).commit();
        drafts.push(valid(name, &["B-020", "B-011"], comment, frames));
    };
    case(
        "raw-nothing-changes",
        "No probe of a delta changes.",
        &first,
        &[],
    );
    let all: Vec<usize> = (0..12).collect();
    case(
        "raw-all-the-same",
        "All probes of a delta come again as they were, absent ones too.",
        &first,
        &all,
    );
    case(
        "raw-all-absent",
        "All probes of a delta become absent.",
        &[Probe::ABSENT; 12],
        &[],
    );
    let zero = Probe::raw(&[]);
    case(
        "raw-zeros",
        "All values of all probes become 0, and they are present.",
        &[zero; 12],
        &[],
    );
    let mut last = first.clone();
    last[11] = Probe::raw(&[0x7bff; 27]);
    case("raw-last", "The last probe alone changes.", &last, &[]);
    let mut values = [0u16; 27];
    for (value, bits) in values
        .iter_mut()
        .zip([0, 1, 0x7bff, 0x8000, 0x8001, 0xfbff, 0x83ff, 0x0400, 0x8400])
    {
        *value = bits;
    }
    case(
        "raw-values-extreme",
        "Values are -0, the least and the largest f16.",
        &[Probe::raw(&values); 12],
        &[],
    );
}
