//! Visibility maps in the coding `packed`, clauses B-063 to B-066.

use super::{Content, Draft, Probe, Volume, invalid, ordered, payload, seen, some, streams, valid};
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::models::probes::maps::{Choices, byte_of, code_of};
use crate::stream_builder::kind;

pub fn add(drafts: &mut Vec<Draft>) {
    shapes(drafts);
    steps(drafts);
    deltas(drafts);
    choices(drafts);
    runs(drafts);
    ranges(drafts);
    ends(drafts);
}

/// A block of maps with slopes, edges and open texels, as walls make them; other ones for each seed.
fn walls(volume: &Volume, seed: u64) -> Vec<u8> {
    let mut draw = Draw(seed);
    let side = i32::from(volume.side);
    let mut block = Vec::new();
    for _ in 0..volume.count() {
        let base = draw.below_i32(200);
        let (across, down) = (draw.below_i32(60) - 30, draw.below_i32(60) - 30);
        let edge = draw.below_i32(2 * side);
        let deviates = draw.below_i32(3) == 0;
        for texel in 0..side * side {
            let (x, y) = (texel % side, texel / side);
            let mean = match x + y < edge {
                true => base + (across * x + down * y) / side,
                false => 255,
            };
            let deviation = match deviates {
                true => (x * y + draw.below_i32(3)) % 70,
                false => 0,
            };
            block.extend([mean, deviation].map(|byte| byte.clamp(0, 255) as u8));
        }
    }
    rounded(volume, block)
}

/// The same bytes as those of map codes.
fn rounded(volume: &Volume, mut block: Vec<u8>) -> Vec<u8> {
    for (at, byte) in block.iter_mut().enumerate() {
        let step = volume.map_steps[at % 2];
        *byte = byte_of(code_of(*byte, step), step);
    }
    block
}

/// Absent probes with these maps.
fn content(volume: &Volume, block: Vec<u8>) -> Content {
    Content {
        visibility: Some(block),
        ..Content::new(1, vec![Probe::ABSENT; volume.count()])
    }
}

fn keyframe(volume: &Volume, block: Vec<u8>) -> Frames {
    streams(std::slice::from_ref(volume)).probes(true, &[content(volume, block)])
}

/// Volumes of all sides, along each axis, and maps of each kind.
fn shapes(drafts: &mut Vec<Draft>) {
    let clauses = &["B-063", "B-064"];
    for (dims, name) in [
        ([1, 1, 1], "one"),
        ([4, 1, 1], "along-x"),
        ([1, 4, 1], "along-y"),
        ([1, 1, 4], "along-z"),
        ([3, 3, 2], "block"),
    ] {
        for side in [4, 8, 16] {
            let volume = Volume::packed(dims).seeing(side);
            let comment = format!(
                "Maps of {side} x {side} with slopes and edges, in a volume of {dims:?} probes."
            );
            let frames = keyframe(&volume, walls(&volume, 60 + u64::from(side))).commit();
            let name = format!("maps-walls-{name}-{side}");
            drafts.push(valid(&name, clauses, &comment, frames));
        }
    }
    for (name, texel, comment) in [
        ("open", [255, 0], "Nothing is seen: each map is one bit."),
        ("black", [0, 0], "All distances are 0."),
        ("full", [255, 255], "All means and deviations are 255."),
    ] {
        let volume = Volume::packed([3, 2, 1]).seeing(8);
        let block = texel.repeat(6 * 64);
        let frames = keyframe(&volume, block).commit();
        drafts.push(valid(&format!("maps-{name}"), clauses, comment, frames));
    }
    let volume = Volume::packed([3, 2, 2]).seeing(4);
    let probes = Content {
        visibility: Some(walls(&volume, 3)),
        ..Content::new(1, some(&volume, 4))
    };
    let frames = streams(std::slice::from_ref(&volume)).probes(true, &[probes]);
    let comment = "Maps, and probes behind them in the same bits.";
    drafts.push(valid("maps-and-probes", clauses, comment, frames.commit()));
}

/// Steps at their ends, and random codes, whose residuals have all lengths and both signs.
fn steps(drafts: &mut Vec<Draft>) {
    for map_steps in [[1, 1], [1, 255], [255, 1], [2, 128], [127, 254], [200, 3]] {
        let volume = Volume {
            map_steps,
            ..Volume::packed([3, 2, 2]).seeing(4)
        };
        let [means, deviations] = map_steps;
        for (name, block) in [("random", seen(&volume, 7)), ("walls", walls(&volume, 8))] {
            let comment = format!("Map steps of {means} and {deviations}.");
            let name = format!("maps-{name}-steps-{means}-{deviations}");
            let frames = keyframe(&volume, block).commit();
            drafts.push(valid(&name, &["B-063", "B-064"], &comment, frames));
        }
    }
    // From 0 to 255 and back, texel by texel and probe by probe.
    let volume = Volume {
        map_steps: [1, 1],
        ..Volume::packed([2, 2, 1]).seeing(4)
    };
    let jumps = (0..volume.visibility_bytes()).map(|at| match (at / 2 + at / 32 + at % 2) % 2 {
        0 => 0,
        _ => 255,
    });
    let frames = keyframe(&volume, jumps.collect()).commit();
    let comment = "Residuals of 255, to either side.";
    drafts.push(valid("maps-jump", &["B-063"], comment, frames));
}

/// Deltas of maps that change from those of the last frame (B-011, B-065).
fn deltas(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([3, 2, 2]).seeing(4);
    let first = walls(&volume, 21);
    let other = walls(&volume, 22);
    let begun = keyframe(&volume, first.clone()).commit();
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        drafts.push(valid(&format!("maps-{name}"), clauses, comment, frames));
    };
    let some_of = |which: &[usize]| {
        let mut block = first.clone();
        for &probe in which {
            let map = probe * 32..(probe + 1) * 32;
            block[map.clone()].copy_from_slice(&other[map]);
        }
        block
    };
    for (name, which) in [
        ("delta-of-the-first", &[0][..]),
        ("delta-of-the-last", &[11]),
        ("delta-of-three", &[1, 4, 9]),
        ("delta-of-all", &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]),
        ("delta-of-none", &[]),
    ] {
        let delta = content(&volume, some_of(which));
        let frames = begun.clone().probes(false, &[delta]).commit();
        let comment = format!("A delta in which maps {which:?} change.");
        case(name, &["B-011", "B-063"], &comment, frames.commit());
    }
    let mut texel = first.clone();
    texel[5 * 32 + 14] = byte_of(3, 7);
    let open: Vec<u8> = [255, 0].repeat(12 * 16);
    case(
        "delta-of-a-texel",
        &["B-011", "B-063"],
        "One texel of one map changes.",
        begun
            .clone()
            .probes(false, &[content(&volume, texel)])
            .commit(),
    );
    case(
        "delta-to-open",
        &["B-011", "B-064"],
        "A delta in which all maps become open, and one in which they come back.",
        begun
            .clone()
            .probes(false, &[content(&volume, open.clone())])
            .commit()
            .probes(false, &[content(&volume, first.clone())])
            .commit(),
    );
    case(
        "delta-of-no-block",
        &["B-065"],
        "A delta with maps of a track that has none: they change from open ones, like those of a keyframe.",
        begun
            .clone()
            .probes(true, &[Content::new(1, some(&volume, 5))])
            .commit()
            .probes(
                false,
                &[Content {
                    visibility: Some(other.clone()),
                    ..Content::new(1, some(&volume, 5))
                }],
            )
            .commit(),
    );
    case(
        "open-block-in-a-delta",
        &["B-065"],
        "A delta with maps that all stay open: now there is a block.",
        streams(std::slice::from_ref(&volume))
            .commit()
            .probes(false, &[content(&volume, open)])
            .commit(),
    );
    case(
        "keyframe-from-open",
        &["B-010", "B-063"],
        "A second keyframe: its maps change from open ones, not from those of the first.",
        begun
            .clone()
            .probes(true, &[content(&volume, some_of(&[2]))])
            .commit(),
    );
    case(
        "many-deltas",
        &["B-011", "B-063"],
        "Ten deltas, one map after the other.",
        (0..10).fold(begun.clone(), |frames, probe| {
            let delta = content(&volume, some_of(&[probe]));
            frames.probes(false, &[delta]).commit()
        }),
    );
}

/// What a writer may choose.
fn choices(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([3, 2, 1]).seeing(4);
    let block = walls(&volume, 31);
    let open: Vec<u8> = [255, 0].repeat(6 * 16);
    let with = |block: &[u8], touched: &[usize], deviating: &[usize]| Content {
        maps: Choices {
            touched: touched.to_vec(),
            deviating: deviating.to_vec(),
            wrong: None,
        },
        ..content(&volume, block.to_vec())
    };
    let begun = keyframe(&volume, block.clone()).commit();
    for (name, comment, frames) in [
        (
            "touched",
            "Maps of a delta count as changing and stay as they are.",
            begun
                .clone()
                .probes(false, &[with(&block, &[0, 3, 4], &[])]),
        ),
        (
            "touched-open",
            "Open maps of a keyframe count as changing.",
            streams(std::slice::from_ref(&volume)).probes(true, &[with(&open, &[1, 2], &[2])]),
        ),
        (
            "deviations-of-0",
            "Maps have deviations, and all of them are 0.",
            begun.probes(false, &[with(&open, &[], &[0, 1, 2, 3, 4, 5])]),
        ),
    ] {
        let name = format!("maps-{name}");
        drafts.push(valid(&name, &["B-063"], comment, frames.commit()));
    }
}

/// Long runs of maps that do not change, with some between them that do.
fn runs(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([30, 20, 4]).seeing(4);
    let walls = walls(&volume, 41);
    let mut block: Vec<u8> = [255, 0].repeat(2400 * 16);
    for probe in [700, 701, 730, 1300, 2399] {
        let map = probe * 32..(probe + 1) * 32;
        block[map.clone()].copy_from_slice(&walls[map]);
    }
    let frames = keyframe(&volume, block.clone()).commit();
    let mut later = block;
    later[1299 * 32..1300 * 32].copy_from_slice(&walls[1299 * 32..1300 * 32]);
    let delta = content(&volume, later);
    let frames = frames.probes(false, std::slice::from_ref(&delta)).commit();
    let frames = frames.probes(false, &[delta]).commit();
    let comment = "Few of 2400 maps change, then one, then none.";
    drafts.push(valid("maps-run", &["B-063", "B-031"], comment, frames));
}

/// Codes out of their range (B-066).
fn ranges(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([2, 2, 1]).seeing(4);
    for (name, comment, wrong) in [
        (
            "first-below-0",
            "The first mean is one below 0",
            (0, 0, 0, -38),
        ),
        (
            "mean-below-0",
            "A mean in a map is far below 0",
            (1, 6, 0, -200),
        ),
        (
            "mean-above",
            "A mean in a map is far above the largest",
            (1, 9, 0, 200),
        ),
        (
            "last-mean",
            "The last mean of the last map is out of range",
            (3, 15, 0, -255),
        ),
        (
            "first-deviation",
            "The first deviation is one above the largest",
            (0, 0, 1, 10),
        ),
        (
            "deviation",
            "A deviation in a map is out of range",
            (2, 5, 1, 255),
        ),
    ] {
        let content = Content {
            maps: Choices {
                touched: vec![0, 1, 2, 3],
                deviating: vec![0, 1, 2, 3],
                wrong: Some(wrong),
            },
            ..content(&volume, walls(&volume, 51))
        };
        let begun = keyframe(&volume, walls(&volume, 51)).commit();
        let new = streams(std::slice::from_ref(&volume));
        for (place, frames, whole) in [("keyframe", new, true), ("delta", begun, false)] {
            // The prior decides where the first codes lie.
            if !whole && wrong.1 == 0 {
                continue;
            }
            let payload = frames.probes_payload(whole, std::slice::from_ref(&content));
            let refused = frames.refused_of(kind::PROBES, &payload);
            let name = format!("maps-{name}-{place}");
            let comment = format!("{comment}, in a {place}.");
            drafts.push(invalid((3104, &name), &["B-066"], &comment, refused));
        }
    }
}

/// Bytes left or missing where there are maps (B-034, B-035).
fn ends(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([2, 2, 1]).seeing(8);
    let content = Content {
        visibility: Some(walls(&volume, 61)),
        ..Content::new(1, some(&volume, 62))
    };
    let frames = streams(std::slice::from_ref(&volume));
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut sections = frames.sections(true, std::slice::from_ref(&content));
        change(&mut sections[0].probes);
        frames
            .clone()
            .refused_of(kind::PROBES, &payload(None, &sections))
    };
    let over = refused(&|bytes| bytes.extend([0; 5]));
    let comment = "Five zeros follow maps and probes at their shortest.";
    drafts.push(invalid((3105, "maps-five-over"), &["B-034"], comment, over));
    let start = refused(&|bytes| bytes[..4].fill(0xff));
    let comment = "Maps begin with four bytes of ff.";
    drafts.push(invalid(
        (3105, "maps-code-at-range"),
        &["B-035"],
        comment,
        start,
    ));
    // The maps are decoded first, so a code of a map comes before one of a probe and before the end.
    let wrong = Content {
        maps: Choices {
            touched: vec![0],
            wrong: Some((0, 0, 0, -255)),
            ..Choices::default()
        },
        whole: true,
        ..content.clone()
    };
    let mut sections = frames.sections(true, &[wrong]);
    sections[0].probes.extend([0xff; 40]);
    let refused = frames
        .clone()
        .refused_of(kind::PROBES, &payload(None, &sections));
    drafts.push(ordered(
        (3104, "map-code-then-length"),
        &["B-066", "B-034"],
        "A code of a map is checked before the length of the section.",
        refused,
    ));
}
