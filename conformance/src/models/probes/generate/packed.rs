//! The coding `packed`: bytes, bits and contexts, clauses B-030 to B-035, B-040 and B-041.

use super::{Content, Draft, Place, Volume, faults, invalid, ordered, some, streams, valid};
use crate::generate::frames::Frames;
use crate::models::probes::range::{Bit, INITIAL, code};
use crate::models::probes::writer::{Probe, context, payload};
use crate::stream_builder::kind;

pub fn add(drafts: &mut Vec<Draft>) {
    lengths(drafts);
    endings(drafts);
    levels(drafts);
    chains(drafts);
    shapes(drafts);
    predictions(drafts);
}

/// Bytes left or missing (B-034).
fn lengths(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([3, 2, 2]);
    faults(
        drafts,
        (3105, "B-034"),
        &volume,
        &[
            (
                "packed-quarter",
                "The section ends after a quarter of its bytes",
                |s| s.probes.truncate(s.probes.len() / 4),
            ),
            ("packed-half", "The section ends half way", |s| {
                s.probes.truncate(s.probes.len() / 2)
            }),
            (
                "packed-five-over",
                "Five zeros follow the section at its shortest",
                |s| s.probes.extend([0; 5]),
            ),
            (
                "packed-bytes-over",
                "Bytes follow the section, the first of them not 0",
                |s| s.probes.extend([0, 0, 0, 0, 0xff, 1]),
            ),
        ],
    );
    // A code that is not below the range, whatever follows.
    faults(
        drafts,
        (3105, "B-035"),
        &volume,
        &[
            (
                "packed-code-at-range",
                "The section is four bytes of ff",
                |s| s.probes = vec![0xff; 4],
            ),
            (
                "packed-code-at-range-long",
                "The section is nine bytes of ff",
                |s| s.probes = vec![0xff; 9],
            ),
            (
                "packed-code-at-range-then-bits",
                "The section starts with four bytes of ff, and goes on as it was",
                |s| s.probes.splice(..0, [0xff; 4]).for_each(drop),
            ),
        ],
    );
    // A bit of the only probe, which takes four bytes.
    let one = Volume::packed([1, 1, 1]);
    for length in 0..7 {
        let frames = streams(std::slice::from_ref(&one));
        let content = Content::new(1, vec![Probe::ABSENT]);
        let mut sections = frames.sections(true, std::slice::from_ref(&content));
        sections[0].probes = vec![0; length];
        let comment = format!("The only probe is absent, in a section of {length} zeros.");
        if length <= 4 {
            let frames = frames.probes_as(true, &[content], &sections).commit();
            let name = format!("packed-absent-in-{length}-bytes");
            drafts.push(valid(&name, &["B-030", "B-034"], &comment, frames));
        } else {
            let refused = frames.refused_of(kind::PROBES, &payload(None, &sections));
            let name = format!("packed-absent-in-{length}-bytes");
            drafts.push(invalid((3105, &name), &["B-034"], &comment, refused));
        }
    }
    // Many probable bits take no byte for a long time; here they take one, so one must be there.
    let many = Volume::packed([12000, 1, 1]);
    let frames = streams(std::slice::from_ref(&many));
    let mut sections = frames.sections(true, &[Content::new(1, vec![Probe::ABSENT; 12000])]);
    let taken = sections[0].probes.len();
    assert!(taken > 0, "the bits take more than four bytes");
    sections[0].probes.pop();
    let refused = frames
        .clone()
        .refused_of(kind::PROBES, &payload(None, &sections));
    let comment = "12000 absent probes, one zero of them missing.";
    drafts.push(invalid(
        (3105, "packed-zero-missing"),
        &["B-034"],
        comment,
        refused,
    ));
    let content = Content::new(1, vec![Probe::ABSENT; 12000]);
    let frames = frames.probes(true, &[content]).commit();
    let comment = "12000 absent probes in as few zeros as there may be.";
    drafts.push(valid(
        "packed-zeros-least",
        &["B-031", "B-034"],
        comment,
        frames,
    ));
    let volume = Volume::packed([2, 2, 1]);
    let bad = Probe::new(1, &[640]);
    let (frames, _, _) = Place::Keyframe.stream(&volume);
    let mut probes = some(&volume, 1);
    probes[3] = bad;
    let mut sections = frames.sections(true, &[Content::new(1, probes)]);
    sections[0].probes.extend([0; 9]);
    let refused = frames.refused_of(kind::PROBES, &payload(None, &sections));
    let comment = "A code of the last probe is out of range, and bytes are left.";
    drafts.push(ordered(
        (3104, "packed-code-then-length"),
        &["B-042", "B-034"],
        comment,
        refused,
    ));
    // One byte, after which its fraction goes on giving bits: six more are taken when a code comes to lie
    // beyond the coarse steps' range.
    let volume = Volume {
        steps: [2560, 32768, 32768, 32768, 32768, 32768],
        ..Volume::packed([4, 4, 4])
    };
    let refused = Place::Keyframe.with_section(&volume, |section| section.probes = vec![0xa5]);
    let comment =
        "A section has run out for more than four bytes, and then a code is out of range.";
    drafts.push(ordered(
        (3104, "packed-code-past-the-end"),
        &["B-042", "B-034"],
        comment,
        refused,
    ));
}

/// Zeros at the end that are there or left out: the same state.
fn endings(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([3, 2, 2]);
    for zeros in 0..=3 {
        let frames = streams(std::slice::from_ref(&volume));
        let content = Content::new(1, some(&volume, 21));
        let mut sections = frames.sections(true, std::slice::from_ref(&content));
        sections[0].probes.extend(vec![0; zeros]);
        let frames = frames.probes_as(true, &[content], &sections).commit();
        let name = format!("packed-{zeros}-zeros-more");
        let comment = format!("A section has {zeros} zeros more at its end than it needs.");
        drafts.push(valid(&name, &["B-030", "B-034"], &comment, frames));
    }
}

/// Every level after every level, near all kinds of neighbours.
fn levels(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([4, 4, 2]);
    let probe = |level: u8, seed: i32| {
        let mut probe = Probe::new(level, &[]);
        let used = [0, 3, 12, 27][usize::from(level)];
        for (i, code) in (0..).zip(&mut probe.codes[..used]) {
            *code = (seed * 7 + i * 3) % 11 - 5;
        }
        probe.codes[0] = if level > 0 { 300 + seed } else { 0 };
        probe
    };
    let before: Vec<Probe> = (0..32).map(|i| probe((i % 4) as u8, i)).collect();
    let after: Vec<Probe> = (0..32).map(|i| probe((i / 4 % 4) as u8, i)).collect();
    let kept: Vec<Probe> = (0..32).map(|i| probe((i / 4 % 4) as u8, i % 4)).collect();
    let frames = streams(std::slice::from_ref(&volume))
        .probes(true, &[Content::new(1, before)])
        .commit()
        .probes(false, &[Content::new(1, after)])
        .commit()
        .probes(false, &[Content::new(1, kept.clone())])
        .commit();
    let comment = "Each level follows each, with codes of each kind.";
    drafts.push(valid(
        "packed-levels",
        &["B-040", "B-041", "B-051"],
        comment,
        frames.clone(),
    ));
    // Changing, and the same.
    for (name, touched, comment) in [
        (
            "some",
            vec![0, 5, 6, 31],
            "Some probes are said to change, and are as they were.",
        ),
        (
            "all",
            (0..32).collect(),
            "All probes are said to change, absent ones but in no level, and are as they were.",
        ),
    ] {
        let touched = touched
            .into_iter()
            .filter(|&i: &usize| kept[i].level > 0)
            .collect();
        let content = Content {
            touched,
            ..Content::new(1, kept.clone())
        };
        let frames = frames.clone().probes(false, &[content]).commit();
        let name = format!("packed-unchanged-{name}");
        drafts.push(valid(&name, &["B-040"], comment, frames));
    }
    let zero = vec![Probe::new(1, &[0]); 32];
    let frames = frames.probes(true, &[Content::new(1, zero)]).commit();
    let comment = "All probes are there and black: no residual anywhere.";
    drafts.push(valid("packed-black", &["B-040", "B-050"], comment, frames));
}

/// Long chains of deltas, so that contexts adapt and codes go far.
fn chains(drafts: &mut Vec<Draft>) {
    for (name, dims, steps, seed) in [
        ("fine", [4, 3, 3], [1, 1, 1, 1, 1, 1], 31u64),
        ("middling", [4, 3, 3], [16, 200, 300, 500, 600, 900], 32),
        (
            "coarse",
            [4, 3, 3],
            [2560, 32768, 32768, 32768, 32768, 32768],
            33,
        ),
        ("in-a-row", [36, 1, 1], [4, 20, 30, 50, 60, 90], 34),
    ] {
        let volume = Volume {
            steps,
            ..Volume::packed(dims)
        };
        let mut probes = some(&volume, seed);
        let content = |probes: &Vec<Probe>| Content::new(1, probes.clone());
        let mut frames = streams(std::slice::from_ref(&volume))
            .probes(true, &[content(&probes)])
            .commit();
        for step in 1..6 {
            probes = super::later(&volume, &probes, seed + 10 * step);
            frames = frames.probes(step == 4, &[content(&probes)]).commit();
        }
        let comment = format!("A keyframe, three deltas, a keyframe and a delta, of {name} steps.");
        let name = format!("packed-chain-{name}");
        let clauses = [
            "B-030", "B-031", "B-032", "B-040", "B-041", "B-011", "B-062",
        ];
        drafts.push(valid(&name, &clauses, &comment, frames));
    }
}

fn one_frame(volume: &Volume, probes: Vec<Probe>) -> Frames {
    let content = Content::new(1, probes);
    streams(std::slice::from_ref(volume))
        .probes(true, &[content])
        .commit()
}

/// Volumes of which some neighbours are not there, magnitudes of all lengths, and the start of all
/// contexts.
fn shapes(drafts: &mut Vec<Draft>) {
    for (name, dims) in [
        ("1-1-1", [1, 1, 1]),
        ("40-1-1", [40, 1, 1]),
        ("1-40-1", [1, 40, 1]),
        ("1-1-40", [1, 1, 40]),
        ("1-6-7", [1, 6, 7]),
        ("6-1-7", [6, 1, 7]),
        ("6-7-1", [6, 7, 1]),
        ("5-4-3", [5, 4, 3]),
    ] {
        let volume = Volume::packed(dims);
        let frames = one_frame(&volume, some(&volume, 41));
        let comment = "A keyframe of a volume, whose neighbours are those of its shape.";
        let name = format!("packed-shape-{name}");
        drafts.push(valid(&name, &["B-040", "B-041"], comment, frames));
    }
    let volume = Volume {
        steps: [1; 6],
        ..Volume::packed([16, 2, 1])
    };
    let probes = (0..32).map(|i| {
        let (length, sign) = (i % 16, if i % 2 == 0 { 1 } else { -1 });
        let size = |below: i32| sign * ((1 << length) - below).clamp(1, 32767);
        let mut probe = Probe::new(3, &[size(0).abs().min(10239)]);
        (1..27).for_each(|code| probe.codes[code] = size(code as i32 % 3 - 1));
        probe
    });
    let frames = one_frame(&volume, probes.collect());
    let comment = "Magnitudes of 1 to 16 bits, of both signs, in all groups.";
    drafts.push(valid(
        "packed-magnitudes",
        &["B-032", "B-040"],
        comment,
        frames,
    ));
    // Each group alone has residuals, in a keyframe and in a delta.
    let volume = Volume::packed([3, 3, 1]);
    for (group, codes) in [0..1, 1..3, 3..6, 6..12, 12..17, 17..27]
        .into_iter()
        .enumerate()
    {
        let of = |value: i32| {
            let mut probe = Probe::new(3, &[]);
            // The last code of the group alone, now and then.
            let first = if value % 2 == 0 {
                codes.end - 1
            } else {
                codes.start
            };
            (first..codes.end).for_each(|code| probe.codes[code] = value);
            if group == 0 {
                probe.codes[0] = value.abs();
            }
            probe
        };
        let frames = one_frame(&volume, (0..9).map(|i| of(i - 4)).collect());
        let next = (0..9)
            .map(|i| of((i - 4) * if i % 3 == 0 { 2 } else { 1 }))
            .collect();
        let frames = frames.probes(false, &[Content::new(1, next)]).commit();
        let comment = format!("Group {group} alone has codes other than 0.");
        let name = format!("packed-group-{group}");
        drafts.push(valid(&name, &["B-033", "B-040"], &comment, frames));
    }
    // All numbers at the start of contexts take part: the first bit in each, as the keyframe has it.
    let volumes = [Volume::packed([7, 5, 3]), Volume::packed([7, 5, 3])];
    let first = some(&volumes[0], 51);
    let second = super::later(&volumes[0], &first, 52);
    let contents = [
        Content::new(1, first.clone()),
        Content::new(2, second.clone()),
    ];
    let swapped = [Content::new(1, second), Content::new(2, first)];
    let frames = streams(&volumes)
        .probes(true, &contents)
        .commit()
        .probes(false, &swapped)
        .commit();
    let comment = "Two tracks of 105 probes in a record: contexts start anew in each section.";
    drafts.push(valid(
        "packed-two-tracks",
        &["B-031", "B-033", "B-040"],
        comment,
        frames,
    ));
    carries(drafts);
}

/// The longest runs of 255 and 0 that carries go through.
fn carries(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([64, 1, 1]);
    for (name, level, comment) in [
        ("absent", 0, "All probes are absent: zeros alone."),
        (
            "least",
            1,
            "All probes have level 1 and no residual: the highest part of each range.",
        ),
    ] {
        let frames = one_frame(&volume, vec![Probe::new(level, &[]); 64]);
        let name = format!("packed-all-{name}");
        drafts.push(valid(&name, &["B-030", "B-031"], comment, frames));
    }
    // The bits of a decoder whose code stays just below its range are ones; they make a code out of
    // range.
    let frames = streams(std::slice::from_ref(&volume));
    let mut sections = frames.sections(true, &[Content::new(1, vec![Probe::ABSENT; 64])]);
    sections[0].probes = vec![0xff; 400];
    sections[0].probes[3] = 0xfe;
    let refused = frames.refused_of(kind::PROBES, &payload(None, &sections));
    let comment =
        "A section of 400 bytes of 255, the fourth 254: level 1 and a luma that is negative.";
    drafts.push(invalid(
        (3104, "packed-all-ones"),
        &["B-042"],
        comment,
        refused,
    ));
    // A first bit in one context, by itself.
    let one = Volume::packed([1, 1, 1]);
    let bits = [
        Bit::In(context::changed(true, 0), true),
        Bit::In(context::level(0, false), true),
        Bit::In(context::level(0, true), true),
        Bit::In(context::any(true, 0, 0, false), false),
        Bit::In(context::any(true, 1, 0, false), false),
    ];
    assert!(
        bits.iter()
            .all(|bit| matches!(bit, Bit::In(at, _) if INITIAL[*at] > 0))
    );
    let frames = streams(std::slice::from_ref(&one));
    let content = Content::new(1, vec![Probe::new(1, &[])]);
    let mut sections = frames.sections(true, std::slice::from_ref(&content));
    sections[0].probes = code(&bits).short();
    let frames = frames.probes_as(true, &[content], &sections).commit();
    let comment = "One black probe of level 1: five bits, written out.";
    drafts.push(valid(
        "packed-five-bits",
        &["B-033", "B-040"],
        comment,
        frames,
    ));
}

/// Predictions (B-041): means of one, two and three neighbours, rounded down, of those that have the
/// degree alone.
fn predictions(drafts: &mut Vec<Draft>) {
    // The last of eight probes has three neighbours: 6, 5 and 3.
    let volume = Volume::packed([2, 2, 2]);
    for (name, levels, comment) in [
        ("three", [3, 3, 3], "The mean of three"),
        (
            "two-and-level-1",
            [3, 3, 1],
            "The mean of two, where the third has no degree 1",
        ),
        (
            "two-and-level-2",
            [2, 3, 3],
            "The mean of two in degree 2, and of three in degree 1",
        ),
        (
            "one-and-absent",
            [0, 3, 0],
            "One neighbour, where two are absent",
        ),
        ("none", [0, 0, 0], "No neighbour is there"),
        ("level-1-alone", [1, 1, 1], "No neighbour has degree 1"),
    ] {
        let mut probes = vec![Probe::ABSENT; 8];
        for (k, (at, level)) in [6, 5, 3].into_iter().zip(levels).enumerate() {
            let mut probe = Probe::new(level, &[]);
            let used = [0, 3, 12, 27][usize::from(level)];
            // Sums of all remainders, negative ones too.
            (0..used).for_each(|code| {
                probe.codes[code] = (code as i32 * 5 + k as i32 * 4) % 13 - 7;
            });
            probe.codes[0] = i32::from(level > 0) * (100 + k as i32);
            probes[at] = probe;
        }
        // What was predicted, and so no residual: a wrong prediction shows.
        let mut last = Probe::new(3, &[]);
        for code in 0..27 {
            let degree = [0, 1, 2][usize::from(code >= 3) + usize::from(code >= 12)];
            last.codes[code] =
                crate::models::probes::writer::mean(&[6, 5, 3], &probes, degree, code);
        }
        probes[7] = last;
        let frames = one_frame(&volume, probes.clone());
        let name = format!("packed-mean-of-{name}");
        let comment = format!("{comment}, rounded down, with no residual to it.");
        drafts.push(valid(&name, &["B-041"], &comment, frames));
    }
    // In a delta, the neighbour's new codes and level count, whether they changed or not.
    let mut before = some(&volume, 61);
    before[7] = Probe::ABSENT;
    let mut after = before.clone();
    after[6] = some(&volume, 62)[6];
    after[7] = Probe::new(3, &(0..27).map(|i| 40 - i).collect::<Vec<_>>());
    let frames = one_frame(&volume, before)
        .probes(false, &[Content::new(1, after)])
        .commit();
    let comment = "A probe comes in a delta, beside one that changes and two that do not.";
    drafts.push(valid(
        "packed-mean-in-a-delta",
        &["B-041", "B-011"],
        comment,
        frames,
    ));
}
