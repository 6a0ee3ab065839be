//! The coding `packed`, clauses.

use super::{
    Content, Draft, Place, Region, Set, invalid, ordered, payload, some, streams, valid,
    wrong_section,
};
use crate::generate::draw::Draw;
use crate::models::range::{Bit, code};
use crate::models::regions::writer::context;
use crate::stream_builder::kind;

const BOX: [f32; 6] = [0.0, 0.0, 0.0, 2.0, 1.0, 1.0];

pub fn add(drafts: &mut Vec<Draft>) {
    heads(drafts);
    lengths(drafts);
    orders(drafts);
    forms(drafts);
    predictions(drafts);
    magnitudes(drafts);
    endings(drafts);
    chains(drafts);
    written(drafts);
}

fn frame(set: &Set, content: Content) -> crate::generate::frames::Frames {
    streams(std::slice::from_ref(set))
        .regions(&[content])
        .commit()
}

/// Boxes, bitmap and centres.
fn heads(drafts: &mut Vec<Draft>) {
    let set = Set::packed(11);
    type Cut = fn(&mut super::Section);
    let cases: [(u16, &'static str, &str, &str, Cut); 8] = [
        (3401, "R-012", "packed-nothing", "A section is empty", |s| {
            s.head.clear();
            s.codes.clear();
        }),
        (
            3401,
            "R-012",
            "packed-boxes-short",
            "A section lacks the last byte of its boxes",
            |s| {
                s.head.truncate(11 * 24 - 1);
                s.codes.clear();
            },
        ),
        (
            3401,
            "R-012",
            "packed-no-bitmap",
            "A section ends with its boxes",
            |s| {
                s.head.truncate(11 * 24);
                s.codes.clear();
            },
        ),
        (
            3401,
            "R-012",
            "packed-bitmap-short",
            "A section has half of its bitmap",
            |s| {
                s.head.truncate(11 * 24 + 1);
                s.codes.clear();
            },
        ),
        (
            3401,
            "R-012",
            "packed-centres-short",
            "A section lacks the last byte of its centres",
            |s| {
                s.head.pop();
                s.codes.clear();
            },
        ),
        (
            3402,
            "R-013",
            "packed-bitmap-bit-11",
            "The bitmap has a bit for a twelfth region",
            |s| s.head[11 * 24 + 1] |= 8,
        ),
        (
            3402,
            "R-013",
            "packed-bitmap-bit-15",
            "The last bit of the bitmap is set",
            |s| s.head[11 * 24 + 1] |= 0x80,
        ),
        (
            3406,
            "R-041",
            "packed-all-ff",
            "The entropy-coded part begins with four bytes of 255",
            |s| s.codes[..4].fill(0xff),
        ),
    ];
    for (id, clause, name, comment, cut) in cases {
        wrong_section(drafts, (id, clause), &set, (name, comment), cut);
    }
    for count in [1, 7, 8, 9, 16, 17] {
        let set = Set::packed(count);
        let frames = frame(&set, Content::new(1, some(&set, 40 + u64::from(count))));
        let name = format!("packed-{count}-regions");
        let comment = format!("{count} regions, some with centres of their own.");
        drafts.push(valid(
            &name,
            &["R-040", "R-044", "R-050"],
            &comment,
            &frames,
        ));
    }
    for (name, own, comment) in [
        ("all", true, "All regions have a centre of their own."),
        ("none", false, "All regions are centred."),
    ] {
        let mut regions = some(&set, 50);
        for region in &mut regions {
            region.centre = own.then(|| [region.bounds[0], region.bounds[4], region.bounds[2]]);
        }
        let frames = frame(&set, Content::new(1, regions));
        let name = format!("packed-centres-{name}");
        drafts.push(valid(&name, &["R-040"], comment, &frames));
    }
}

/// Clause R-043.
fn lengths(drafts: &mut Vec<Draft>) {
    let set = Set::packed(6);
    type Cut = fn(&mut super::Section);
    let cases: [(&str, &str, Cut); 4] = [
        (
            "packed-byte-over",
            "Five bytes follow what the codes take at least",
            |s| s.codes.extend([0; 5]),
        ),
        (
            "packed-word-over",
            "Many bytes follow what the codes take",
            |s| s.codes.extend([1; 30]),
        ),
        ("packed-no-codes", "The entropy-coded part is empty", |s| {
            s.codes.clear()
        }),
        (
            "packed-cut-in-half",
            "The entropy-coded part ends in its middle",
            |s| s.codes.truncate(s.codes.len() / 2),
        ),
    ];
    for (name, comment, cut) in cases {
        // Codes that are small, so that zeros come to no code out of range.
        let regions = vec![small(&set, 3); 6];
        let refused = Place::First.with_section(&set, regions, cut);
        let comment = format!("{comment}.");
        drafts.push(invalid((3406, name), &["R-043"], &comment, refused));
    }
}

/// A region of two signals with small codes.
fn small(set: &Set, seed: u64) -> Region {
    let mut draw = Draw(seed);
    let mut region = Region::new(BOX, [2, 2, set.signals]);
    for code in &mut region.codes {
        *code = draw.below_i32(7) - 3;
    }
    region
}

fn orders(drafts: &mut Vec<Draft>) {
    type Cut = fn(&mut super::Section);
    let set = Set::packed(11);
    let cases: [(u16, &str, &str, [&'static str; 2], Cut); 5] = [
        (
            3402,
            "packed-bitmap-then-centres",
            "Unused bits of the bitmap before the centres",
            ["R-013", "R-012"],
            |s| {
                s.head[11 * 24 + 1] |= 0x80;
                s.head.truncate(11 * 24 + 2);
                s.codes.clear();
            },
        ),
        (
            3401,
            "packed-centres-then-boxes",
            "The size of the centres before the boxes",
            ["R-012", "R-020"],
            |s| {
                s.head[..24].fill(0xff);
                s.head.pop();
                s.codes.clear();
            },
        ),
        (
            3403,
            "packed-boxes-then-coder",
            "The last box before the first value of the range coder",
            ["R-020", "R-041"],
            |s| {
                s.head[10 * 24..11 * 24].fill(0xff);
                s.codes[..4].fill(0xff);
            },
        ),
        (
            3406,
            "packed-coder-then-codes",
            "The first value of the range coder before the codes",
            ["R-041", "R-024"],
            |s| s.codes = vec![0xff; 400],
        ),
        (
            3405,
            "packed-codes-then-length",
            "A code out of range before the length",
            ["R-024", "R-043"],
            |s| {
                s.codes = vec![0xff; 4000];
                s.codes[3] = 0xfe;
            },
        ),
    ];
    for (id, name, comment, clauses, cut) in cases {
        let refused = Place::First.with_section(&set, some(&set, 1), cut);
        let comment = format!("{comment}.");
        drafts.push(ordered((id, name), &clauses, &comment, refused));
    }
    // A centre before the box of the next region.
    let mut regions = some(&set, 1);
    regions[0].centre = Some([f32::NAN; 3]);
    regions[1].bounds[0] = f32::NAN;
    let refused = Place::First.with_section(&set, regions, |_| {});
    let comment = "The centre of a region before the box of the next: one error for both.";
    drafts.push(ordered(
        (3403, "packed-centre-then-box"),
        &["R-021", "R-020"],
        comment,
        refused,
    ));
    // The pairs of a region before its codes.
    let tight = Set {
        capacity: 12,
        ..Set::packed(11)
    };
    let mut regions = vec![Region::new(BOX, [0, 0, 1]); 11];
    regions[10] = Region::new(BOX, [2, 2, 2]);
    regions[10].codes.fill(30_000);
    let refused = Place::First.with_section(&tight, regions, |_| {});
    let comment = "The pairs of the last region before its codes.";
    drafts.push(ordered(
        (3407, "packed-pairs-then-codes"),
        &["R-023", "R-024"],
        comment,
        refused,
    ));
}

/// Every form after every form, and the same again.
fn forms(drafts: &mut Vec<Draft>) {
    for (name, signals) in [("one-signal", 1u8), ("two-signals", 2)] {
        let mut all = Vec::new();
        for derivatives in 0..3u8 {
            for degree in 0..3u8 {
                for s in 1..=signals {
                    all.push([derivatives, degree, s]);
                }
            }
        }
        let mut draw = Draw(u64::from(signals));
        let mut regions = Vec::new();
        for step in 1..all.len() {
            for at in 0..all.len() {
                let form = all[at * step % all.len()];
                for _ in 0..1 + draw.below(2) {
                    let mut region = Region::new(BOX, form);
                    for code in &mut region.codes {
                        *code = draw.below_i32(9) - 4;
                    }
                    regions.push(region);
                }
            }
        }
        let mut set = Set::packed(regions.len() as u32);
        if signals == 1 {
            set = set.of_one();
        }
        let content = Content {
            follow: [true; 3],
            ..Content::new(1, regions)
        };
        let name = format!("packed-forms-{name}");
        let comment = "Each form follows each, once or twice.";
        drafts.push(valid(
            &name,
            &["R-044", "R-025"],
            comment,
            &frame(&set, content),
        ));
    }
}

/// Each choice of the classes that are predicted.
fn predictions(drafts: &mut Vec<Draft>) {
    let set = Set::packed(12);
    for choice in 0..8 {
        let follow = [0, 1, 2].map(|class| choice >> class & 1 == 1);
        let content = Content {
            follow,
            ..Content::new(1, some(&set, 60))
        };
        let name = format!("packed-follow-{choice}");
        let comment = format!("Means, gradients and sided derivatives predicted: {follow:?}.");
        drafts.push(valid(&name, &["R-044"], &comment, &frame(&set, content)));
    }
    // What is predicted is what the last region with such a coefficient had, however far back.
    let mut regions = Vec::new();
    for (at, form) in [
        [2, 2, 2],
        [0, 0, 1],
        [1, 1, 1],
        [0, 2, 2],
        [1, 0, 2],
        [2, 1, 1],
        [1, 2, 2],
    ]
    .into_iter()
    .enumerate()
    {
        let mut region = Region::new(BOX, form);
        for (i, code) in region.codes.iter_mut().enumerate() {
            *code = 200 + 10 * at as i32 + i as i32;
        }
        regions.push(region);
    }
    let same = regions.clone();
    regions.extend(same);
    let set = Set::packed(regions.len() as u32);
    let content = Content {
        follow: [true; 3],
        ..Content::new(1, regions)
    };
    let comment = "Codes are predicted from regions some way back, of other forms.";
    drafts.push(valid(
        "packed-follow-far",
        &["R-044"],
        comment,
        &frame(&set, content),
    ));
    for follow in [[true; 3], [false; 3]] {
        let set = Set::packed(9);
        let content = Content {
            follow,
            ..Content::new(1, vec![small(&set, 9); 9])
        };
        let name = format!(
            "packed-same-{}",
            if follow[0] { "followed" } else { "alone" }
        );
        let comment = "Nine regions are alike.";
        drafts.push(valid(
            &name,
            &["R-044", "R-043"],
            comment,
            &frame(&set, content),
        ));
    }
}

/// Residuals of all lengths and both signs.
fn magnitudes(drafts: &mut Vec<Draft>) {
    let set = Set {
        step: 1,
        ..Set::packed(16)
    };
    let mut regions = Vec::new();
    for length in 0..16 {
        let mut region = Region::new(BOX, [[2, 2, 2], [1, 2, 2]][length % 2]);
        for (i, code) in region.codes.iter_mut().enumerate() {
            let size = (1i32 << length) + (i as i32 * 7 % (1 << length)).min(1 << length);
            *code = size.clamp(1, 32767) * if (i + length) % 2 == 0 { 1 } else { -1 };
        }
        regions.push(region);
    }
    let content = Content {
        follow: [false; 3],
        ..Content::new(1, regions)
    };
    let comment = "Magnitudes of 1 to 15 digits, of both signs, in all groups.";
    drafts.push(valid(
        "packed-magnitudes",
        &["R-044"],
        comment,
        &frame(&set, content),
    ));
    // A residual of 65534: from one end to the other.
    let mut regions = vec![Region::new(BOX, [1, 0, 1]); 16];
    for (at, region) in regions.iter_mut().enumerate() {
        region.codes.fill(if at % 2 == 0 { 32767 } else { -32767 });
    }
    let content = Content {
        follow: [true; 3],
        ..Content::new(1, regions)
    };
    let comment = "Residuals of 16 digits: codes go from one end to the other.";
    drafts.push(valid(
        "packed-residuals-most",
        &["R-044"],
        comment,
        &frame(&set, content),
    ));
}

/// Zeros at the end that are there or left out: the same state.
fn endings(drafts: &mut Vec<Draft>) {
    let set = Set::packed(5);
    for zeros in 0..=3 {
        let frames = streams(std::slice::from_ref(&set));
        let content = Content::new(1, some(&set, 21));
        let mut sections = frames.region_sections(std::slice::from_ref(&content));
        sections[0].codes.extend(vec![0; zeros]);
        let frames = frames.regions_as(&[content], &sections).commit();
        let name = format!("packed-{zeros}-zeros-more");
        let comment = format!("A section has {zeros} zeros more at its end than it needs.");
        drafts.push(valid(&name, &["R-043"], &comment, &frames));
    }
    let content = Content {
        whole: true,
        ..Content::new(1, some(&set, 22))
    };
    let comment = "A section has all zeros at its end that it may have.";
    drafts.push(valid(
        "packed-zeros-whole",
        &["R-043"],
        comment,
        &frame(&set, content),
    ));
    // All codes 0: the fewest bytes, or none.
    for count in [1, 300] {
        let set = Set::packed(count);
        let regions = vec![Region::new(BOX, [0, 0, 1]); count as usize];
        let content = Content {
            follow: [false; 3],
            ..Content::new(1, regions)
        };
        let name = format!("packed-all-zero-{count}");
        let comment = format!("{count} regions of one code, all of them 0.");
        drafts.push(valid(
            &name,
            &["R-042", "R-043"],
            &comment,
            &frame(&set, content),
        ));
    }
}

/// Many regions in several frames, so that contexts adapt and start anew in each section.
fn chains(drafts: &mut Vec<Draft>) {
    let sets = [Set::packed(60), Set::packed(60)];
    let mut frames = streams(&sets);
    for seed in 0..3 {
        let contents = [1, 2].map(|id| Content {
            follow: [true, seed == 1, id == 2],
            ..Content::new(id, some(&sets[0], 70 + seed + u64::from(id)))
        });
        frames = frames.regions(&contents).commit();
    }
    let comment =
        "Two tracks of 60 regions in a record, three times: contexts start anew in each section.";
    drafts.push(valid(
        "packed-chain",
        &["R-042", "R-044", "R-010"],
        comment,
        &frames,
    ));
}

/// Bits that are written out.
fn written(drafts: &mut Vec<Draft>) {
    let set = Set::packed(1);
    let bits = [
        Bit::Even(true),
        Bit::Even(false),
        Bit::Even(true),
        Bit::In(context::OTHER, true),
        Bit::In(context::DERIVATIVES, false),
        Bit::In(context::DEGREE, false),
        Bit::In(context::SIGNALS, true),
        Bit::In(context::significant(0, 0), true),
        Bit::In(context::sign(0, 0), true),
        Bit::In(context::prefix(0, 0), false),
        Bit::In(context::significant(9, 0), false),
    ];
    let mut region = Region::new(BOX, [0, 0, 2]);
    region.codes = vec![-1, 0];
    let frames = streams(std::slice::from_ref(&set));
    let content = Content::new(1, vec![region]);
    let mut sections = frames.region_sections(std::slice::from_ref(&content));
    sections[0].codes = code(&[128; context::ALL], &bits).short();
    let frames = frames.regions_as(&[content], &sections).commit();
    let comment = "One region of two codes: eleven bits, written out.";
    drafts.push(valid(
        "packed-eleven-bits",
        &["R-042", "R-044"],
        comment,
        &frames,
    ));
    // The form is said to be another, and is the same.
    let bits = [
        Bit::Even(false),
        Bit::Even(false),
        Bit::Even(false),
        Bit::In(context::OTHER, true),
        Bit::In(context::DERIVATIVES, false),
        Bit::In(context::DEGREE, false),
        Bit::In(context::SIGNALS, false),
        Bit::In(context::significant(0, 0), true),
        Bit::In(context::sign(0, 0), false),
        Bit::In(context::prefix(0, 0), true),
        Bit::In(context::prefix(0, 1), false),
        Bit::In(context::suffix(0), true),
    ];
    let mut region = Region::new(BOX, [0, 0, 1]);
    region.codes = vec![3];
    let frames = streams(std::slice::from_ref(&set));
    let content = Content::new(1, vec![region]);
    let mut sections = frames.region_sections(std::slice::from_ref(&content));
    sections[0].codes = code(&[128; context::ALL], &bits).short();
    let frames = frames.regions_as(&[content], &sections).commit();
    let comment = "A region is said to have another form than the first, and has the same.";
    drafts.push(valid(
        "packed-same-form-again",
        &["R-044"],
        comment,
        &frames,
    ));
    // Bytes of a decoder whose value stays just below its range are ones.
    let refused = Place::First.with_section(&set, vec![Region::new(BOX, [2, 2, 2])], |section| {
        section.codes = vec![0xff; 60];
        section.codes[3] = 0xfe;
    });
    let comment = "60 bytes of 255, the fourth 254: a code far out of range.";
    drafts.push(invalid(
        (3405, "packed-all-ones"),
        &["R-024"],
        comment,
        refused,
    ));
    let frames = streams(std::slice::from_ref(&set));
    let payload = payload(&[super::Section {
        id: 1,
        head: crate::models::regions::writer::packed_head(&[Region::new(BOX, [0, 0, 1])]),
        ..super::Section::default()
    }]);
    let frames = frames.content(kind::REGIONS, &payload);
    let mut frames = frames;
    if let Some(track) = frames.pending_mut(1)
        && let crate::models::Expected::Regions(regions) = &mut track.state
    {
        regions.regions = vec![Region::new(BOX, [0, 0, 1])];
    }
    let comment = "An entropy-coded part of no bytes: one region, its code 0.";
    drafts.push(valid(
        "packed-no-bytes",
        &["R-043"],
        comment,
        &frames.commit(),
    ));
}
