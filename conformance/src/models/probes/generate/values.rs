//! What clients see, clauses B-050 to B-053 and B-060.

use super::{Content, Draft, Volume, some, streams, valid};
use crate::models::probes::writer::Probe;

pub fn add(drafts: &mut Vec<Draft>) {
    lumas(drafts);
    colours(drafts);
    rounding(drafts);
    fill(drafts);
}

/// All 10240 lumas of degree 0, step 1: every T and every power of two.
fn lumas(drafts: &mut Vec<Draft>) {
    let volume = Volume {
        steps: [1; 6],
        ..Volume::packed([256, 40, 1])
    };
    let probes = (0..10240).map(|e| Probe::new(1, &[e])).collect();
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, probes)])
        .commit();
    let comment = "Each luma of degree 0 that there is.";
    drafts.push(valid(
        "values-all-lumas",
        &["B-050", "B-053"],
        comment,
        frames,
    ));
    let volume = Volume {
        steps: [37, 1, 1, 1, 1, 1],
        ..Volume::packed([277, 1, 1])
    };
    let probes = (0..277).map(|code| Probe::new(1, &[code])).collect();
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, probes)])
        .commit();
    let comment = "Codes of degree 0 at a step of 37.";
    drafts.push(valid("values-lumas-by-37", &["B-050"], comment, frames));
    // Black, whatever the other codes.
    let volume = Volume::packed([2, 1, 1]);
    let codes: Vec<i32> = (0..27).map(|i| if i == 0 { 0 } else { i - 13 }).collect();
    let lit: Vec<i32> = codes.iter().map(|&c| c.max(1)).collect();
    let probes = vec![Probe::new(3, &codes), Probe::new(3, &lit)];
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, probes)])
        .commit();
    let comment = "A probe with code 0 of 0 is black whatever its other codes; the next is not.";
    drafts.push(valid("values-black", &["B-050", "B-051"], comment, frames));
}

/// Chroma and other degrees.
fn colours(drafts: &mut Vec<Draft>) {
    let volume = Volume {
        steps: [64, 512, 256, 512, 256, 512],
        ..Volume::packed([27, 4, 1])
    };
    // One code at a time, of either sign, small and large.
    let probes = (0..108).map(|i: i32| {
        let mut probe = Probe::new(3, &[100]);
        let code = (i % 27) as usize;
        let value = [3, -3, 60, -60][(i / 27) as usize];
        if code > 0 {
            probe.codes[code] = value;
        }
        probe
    });
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, probes.collect())])
        .commit();
    let comment = "One code at a time: where each goes, and which way it is rounded.";
    let clauses = ["B-051", "B-052", "B-053"];
    drafts.push(valid("values-each-code", &clauses, comment, frames));
    // Chroma so strong that a channel of degree 0 would be negative.
    let strong = [
        [0, 9],
        [0, -9],
        [9, 0],
        [-9, 0],
        [9, 9],
        [-9, -9],
        [9, -9],
        [-9, 9],
    ];
    let volume = Volume::packed([8, 1, 1]);
    let volume = Volume {
        steps: [64, 512, 256, 512, 256, 512],
        ..volume
    };
    let probes =
        strong.map(|[co, cg]| Probe::new(2, &[90, co, cg, 0, 0, 0, co, cg, cg, co, co, co]));
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, probes.to_vec())])
        .commit();
    let comment = "Channels that would be negative: 0 in degree 0, and negative in degree 1.";
    drafts.push(valid("values-strong-chroma", &["B-052"], comment, frames));
    for level in 1..=3 {
        let volume = Volume::packed([3, 3, 3]);
        let full = some(&volume, 71);
        let cut = full.iter().map(|probe| {
            let level = probe.level.min(level);
            Probe::new(level, &probe.codes[..[0, 3, 12, 27][usize::from(level)]])
        });
        let frames = streams(std::slice::from_ref(&volume))
            .probes(true, &[Content::new(1, cut.collect())])
            .commit();
        let comment = format!("Probes up to level {level}: degrees that they lack are 0.");
        drafts.push(valid(
            &format!("values-level-{level}"),
            &["B-051", "B-060"],
            &comment,
            frames,
        ));
    }
}

/// f16: subnormals, ties, overflow.
fn rounding(drafts: &mut Vec<Draft>) {
    // Lumas near the least, times shares that make all low bits.
    let volume = Volume {
        steps: [1, 1, 1, 1, 1, 1],
        ..Volume::packed([64, 1, 1])
    };
    let mut case = |name: &str, comment: &str, first: i32, step: i32| {
        let probes = (0..64).map(|i| {
            let codes: Vec<i32> = (0..27)
                .map(|c| match c {
                    0 => first + step * i,
                    _ => {
                        [4096, 6144, 2048, 5120, -4096, 32767, -32768, 1, -1][c as usize % 9]
                            + 64 * i * i32::from(c % 9 < 4)
                    }
                })
                .collect();
            Probe::new(3, &codes)
        });
        let frames = streams(std::slice::from_ref(&volume))
            .probes(true, &[Content::new(1, probes.collect())])
            .commit();
        drafts.push(valid(name, &["B-051", "B-053"], comment, frames));
    };
    case(
        "values-subnormal",
        "Values from 1 unit of 2^-24 up: f16 without a leading one.",
        1,
        40,
    );
    case(
        "values-first-normal",
        "Values about 2^-14, the least f16 with a leading one.",
        2560 - 32,
        1,
    );
    case(
        "values-ties",
        "Lumas of whole powers of two, times shares that are half between two f16.",
        2816,
        64,
    );
    case(
        "values-overflow",
        "Values about 65504 and far above: no infinity.",
        10239 - 126,
        2,
    );
    // Ties exactly: luma 2^13 units and shares of 1/4096 give every residue.
    let volume = Volume {
        steps: [256, 1, 1, 1, 1, 1],
        ..Volume::packed([128, 1, 1])
    };
    let probes = (0..128).map(|i: i32| {
        let codes: Vec<i32> = (0..27)
            .map(|c| match c {
                0 => 12 + i % 4,
                1 | 2 => 0,
                _ => (4096 + 2 * i + c) * if c % 2 == 0 { 1 } else { -1 },
            })
            .collect();
        Probe::new(3, &codes)
    });
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, probes.collect())])
        .commit();
    let comment = "Values halfway between two f16, both ways and of both signs.";
    drafts.push(valid("values-halves", &["B-053"], comment, frames));
}

/// What absent probes show (B-060).
fn fill(drafts: &mut Vec<Draft>) {
    let mut case = |name: &str, comment: &str, volume: &Volume, present: &[usize]| {
        let mut all = some(volume, 81);
        let full = match volume.is_packed() {
            true => {
                let codes: Vec<i32> = (0..27)
                    .map(|c| if c == 0 { 350 } else { c * 2 - 30 })
                    .collect();
                Probe::new(3, &codes)
            }
            false => {
                let values: Vec<u16> = (0..27).map(|v| 0x3c00 + 77 * v).collect();
                Probe::raw(&values)
            }
        };
        for (index, probe) in all.iter_mut().enumerate() {
            if !present.contains(&index) {
                *probe = Probe::ABSENT;
            } else if probe.level == 0 {
                *probe = full;
                probe.codes[0] += index as i32;
            }
        }
        let frames = streams(std::slice::from_ref(volume))
            .probes(true, &[Content::new(1, all)])
            .commit();
        drafts.push(valid(&format!("fill-{name}"), &["B-060"], comment, frames));
    };
    let packed = Volume::packed([5, 4, 3]);
    let raw = Volume::raw([5, 4, 3]);
    for (name, volume) in [("packed", &packed), ("raw", &raw)] {
        case(
            &format!("one-corner-{name}"),
            "One probe in a corner is there, and fills all within four steps.",
            volume,
            &[0],
        );
        case(
            &format!("one-within-{name}"),
            "One probe within is there, and fills all within four steps.",
            volume,
            &[27],
        );
        case(
            &format!("two-corners-{name}"),
            "Two opposite corners meet.",
            volume,
            &[0, 59],
        );
        case(
            &format!("few-{name}"),
            "A few probes, and several distances.",
            volume,
            &[3, 17, 20, 44, 58],
        );
        let but = |gone: &[usize]| (0..60).filter(|p| !gone.contains(p)).collect::<Vec<_>>();
        case(
            &format!("one-gone-{name}"),
            "One probe is absent among six.",
            volume,
            &but(&[27]),
        );
        case(
            &format!("wall-{name}"),
            "A wall of absent probes.",
            volume,
            &but(&[2, 7, 12, 17, 22, 27, 32, 37, 42, 47, 52, 57]),
        );
        case(
            &format!("none-{name}"),
            "No probe is there: all is 0.",
            volume,
            &[],
        );
    }
    let row = Volume::packed([40, 1, 1]);
    case(
        "row",
        "Two ends of a row fill four probes each; those between are 0.",
        &row,
        &[0, 39],
    );
    case(
        "row-even",
        "The middle of an odd run has both ends at one distance.",
        &row,
        &[10, 18, 28],
    );
    follow(drafts);
}

/// The fill changes with the present probes, and nothing rests on it.
fn follow(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([4, 3, 1]);
    let probe = |luma: i32| Probe::new(2, &[luma, 2, -1, 9, -9, 4]);
    let mut probes = vec![Probe::ABSENT; 12];
    probes[0] = probe(300);
    let of = |probes: &[Probe]| [Content::new(1, probes.to_vec())];
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &of(&probes))
        .commit();
    probes[0] = probe(310);
    let frames = frames.probes(false, &of(&probes)).commit();
    probes[11] = probe(200);
    let frames = frames.probes(false, &of(&probes)).commit();
    probes[0] = Probe::ABSENT;
    let frames = frames.probes(false, &of(&probes)).commit();
    let frames = frames.commit();
    probes[11] = Probe::ABSENT;
    let frames = frames.probes(false, &of(&probes)).commit();
    let comment =
        "Present probes change, come and go; the absent ones follow, and none is left at the end.";
    drafts.push(valid("fill-follows", &["B-060", "B-011"], comment, frames));
    // -0 and the least numbers of raw probes.
    let volume = Volume::raw([5, 1, 1]);
    let ends = [
        [0u16, 1, 3, 0x8000, 0x8001, 0x8003, 0xfbff, 0x7bff],
        [1, 2, 0, 0x8000, 0x8002, 0x8000, 0xfbff, 0x7bff],
    ];
    let mut probes = vec![Probe::ABSENT; 5];
    probes[0] = Probe::raw(&ends[0]);
    probes[2] = Probe::raw(&ends[1]);
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &of(&probes))
        .commit();
    let comment = "Means of -0, of the least f16 and of the largest: rounded down, then to an f16.";
    drafts.push(valid(
        "fill-of-extremes",
        &["B-060", "B-053"],
        comment,
        frames,
    ));
}
