//! Regions and codes, clauses, in both codings, and the coding `raw`.

use super::{
    Content, Draft, Place, Region, Set, both, ordered, some, streams, valid, wrong_regions,
    wrong_section,
};
use crate::stream_builder::set_word;

type Wrong = fn(&mut Vec<Region>);

const BOXES: &[(&str, &str, Wrong)] = &[
    (
        "x-inside-out",
        "The minimum of x is above the maximum",
        |r| r[1].bounds[0] = r[1].bounds[3] + 1.0,
    ),
    (
        "z-inside-out",
        "The minimum of z is next above the maximum",
        |r| r[2].bounds[2] = r[2].bounds[5].next_up(),
    ),
    ("minimum-nan", "A minimum is NaN", |r| {
        r[0].bounds[1] = f32::NAN
    }),
    ("maximum-nan", "A maximum is NaN", |r| {
        r[0].bounds[4] = f32::NAN
    }),
    ("maximum-infinite", "A maximum is infinite", |r| {
        r[3].bounds[5] = f32::INFINITY
    }),
    ("minimum-infinite", "A minimum is minus infinity", |r| {
        r[3].bounds[0] = f32::NEG_INFINITY
    }),
    ("maximum-2-40", "A maximum is 2^40", |r| {
        r[3].bounds[3] = 2f32.powi(40)
    }),
    ("minimum-minus-2-40", "A minimum is -2^40", |r| {
        r[0].bounds[2] = -2f32.powi(40)
    }),
];

const CENTRES: &[(&str, &str, Wrong)] = &[
    ("centre-below", "The centre is next below the box", |r| {
        r[1].centre = Some(centre(&r[1], 0, f32::next_down))
    }),
    ("centre-above", "The centre is above the box", |r| {
        let mut wrong = centre(&r[2], 2, |v| v);
        wrong[2] = r[2].bounds[5] + 0.5;
        r[2].centre = Some(wrong);
    }),
    ("centre-nan", "The centre is NaN", |r| {
        r[0].centre = Some(centre(&r[0], 1, |_| f32::NAN))
    }),
    ("centre-infinite", "The centre is infinite", |r| {
        r[3].centre = Some(centre(&r[3], 1, |_| f32::INFINITY))
    }),
];

/// The minimum, with one coordinate changed.
fn centre(region: &Region, axis: usize, change: fn(f32) -> f32) -> [f32; 3] {
    let mut centre = [0, 1, 2].map(|axis| region.bounds[axis]);
    centre[axis] = change(centre[axis]);
    centre
}

/// Bits of a form, the error, name, sentence.
const FORMS: &[(u32, u16, &str, &str)] = &[
    (3, 3404, "derivatives-3", "The derivatives are 3"),
    (3 << 2, 3404, "degree-3", "The degree is 3"),
    (15, 3404, "form-15", "Derivatives and degree are 3"),
    (1 << 6, 3402, "form-bit-6", "Bit 6 of the form is set"),
    (1 << 31, 3402, "form-bit-31", "Bit 31 of the form is set"),
];

pub fn add(drafts: &mut Vec<Draft>) {
    for (coding, set) in both(4) {
        for (clause, cases) in [("R-020", BOXES), ("R-021", CENTRES)] {
            for &(name, comment, wrong) in cases {
                let name = format!("{name}-{coding}");
                wrong_regions(drafts, (3403, clause), &set, (&name, comment), wrong);
            }
        }
        capacity(drafts, coding, &set);
        codes(drafts, coding, &set);
        edges(drafts, coding, &set);
    }
    let set = Set::raw(4);
    for &(bits, id, name, comment) in FORMS {
        wrong_section(drafts, (id, "R-022"), &set, (name, comment), |section| {
            let at = 2 * 40 + 36;
            let form = section.head[at] & 0x30;
            set_word(&mut section.head, at, bits | u32::from(form));
        });
    }
    let one = Set::raw(4).of_one();
    let comment = "A region has two signals in a track of one";
    wrong_section(
        drafts,
        (3404, "R-022"),
        &one,
        ("signals-2", comment),
        |section| section.head[40 + 36] |= 0x10,
    );
    let comment = "Bit 6 of the form of a centred region is set";
    wrong_section(
        drafts,
        (3402, "R-022"),
        &set,
        ("form-bit-6-centred", comment),
        |section| {
            section.head[36] |= 0x60;
            section.head[24..36].fill(0);
        },
    );
    for (axis, name) in [(0, "x"), (2, "z")] {
        let name = format!("centred-{name}");
        let comment = "A centred region has a centre that is not 0";
        wrong_section(drafts, (3402, "R-021"), &set, (&name, comment), |section| {
            section.head[36] |= 0x20;
            section.head[24..36].fill(0);
            section.head[24 + 4 * axis + 3] = 0x80;
        });
    }
    sizes(drafts, &set);
    orders(drafts, &set);
}

/// Clause R-023.
fn capacity(drafts: &mut Vec<Draft>, coding: &str, set: &Set) {
    let regions = some(set, 1);
    let pairs: usize = regions.iter().map(|r| r.coefficients().div_ceil(2)).sum();
    let full = Set {
        capacity: pairs as u32,
        ..set.clone()
    };
    let frames = streams(std::slice::from_ref(&full));
    let frames = frames.regions(&[Content::new(1, regions.clone())]).commit();
    let name = format!("capacity-full-{coding}");
    let comment = "The regions take all the pairs that their track declares.";
    drafts.push(valid(&name, &["R-023", "R-025"], comment, &frames));
    let short = Set {
        capacity: pairs as u32 - 1,
        ..set.clone()
    };
    let name = format!("capacity-above-{coding}");
    let comment = "The last region needs a pair more than its track declares";
    let refused = Place::First.with_section(&short, regions, |_| {});
    let error = (3407, name.as_str());
    drafts.push(super::invalid(error, &["R-023"], comment, refused));
    // Odd numbers of coefficients take a pair more.
    let odd = Set {
        capacity: 4,
        ..set.clone()
    };
    let regions = vec![Region::new([0.0; 6], [0, 0, 1]); 4];
    let frames = streams(std::slice::from_ref(&odd));
    let frames = frames.regions(&[Content::new(1, regions)]).commit();
    let name = format!("capacity-least-{coding}");
    let comment = "Four regions of one coefficient take four pairs.";
    drafts.push(valid(&name, &["R-002", "R-023", "R-050"], comment, &frames));
    let mut regions = vec![Region::new([0.0; 6], [0, 0, 1]); 4];
    regions[1] = Region::new([0.0; 6], [1, 0, 1]);
    let refused = Place::First.with_section(&odd, regions, |_| {});
    let name = format!("capacity-of-odd-{coding}");
    let comment = "Regions of one, four, one and one coefficients need five pairs of four.";
    let error = (3407, name.as_str());
    drafts.push(super::invalid(error, &["R-023"], comment, refused));
}

/// Clause R-024: codes at their bounds.
fn codes(drafts: &mut Vec<Draft>, coding: &str, set: &Set) {
    for (step, most) in [(1, 32767), (2, 16383), (3, 10922), (16384, 1), (32767, 1)] {
        let set = Set {
            step,
            ..set.clone()
        };
        let mut regions = vec![Region::new([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [1, 1, 2]); 4];
        for (at, region) in regions.iter_mut().enumerate() {
            for (i, code) in region.codes.iter_mut().enumerate() {
                *code = [most, -most, 0, 1][(i + at) % 4];
            }
        }
        let content = Content {
            follow: [true; 3],
            ..Content::new(1, regions.clone())
        };
        let frames = streams(std::slice::from_ref(&set));
        let frames = frames.regions(&[content]).commit();
        let name = format!("codes-at-bounds-step-{step}-{coding}");
        let comment = format!("With a step of {step}, codes are {most} and its negative.");
        let clauses = ["R-003", "R-024", "R-025", "R-050"];
        drafts.push(valid(&name, &clauses, &comment, &frames));
        for sign in [1, -1] {
            let mut regions = regions.clone();
            regions[3].codes[31] = sign * (most + 1);
            // A `raw` code has 16 bits.
            if coding == "raw" && sign * (most + 1) > 32767 {
                continue;
            }
            let side = if sign > 0 { "above" } else { "below" };
            let name = format!("code-{side}-step-{step}-{coding}");
            let comment = format!("With a step of {step}, a code is {}.", sign * (most + 1));
            let refused = Place::First.with_section(&set, regions, |_| {});
            let error = (3405, name.as_str());
            drafts.push(super::invalid(error, &["R-024"], &comment, refused));
        }
    }
}

/// Name, sentence, box, centre.
type Edge = (&'static str, &'static str, [f32; 6], Option<[f32; 3]>);

/// The other side of the bounds of boxes and centres.
fn edges(drafts: &mut Vec<Draft>, coding: &str, set: &Set) {
    let most = 2f32.powi(40).next_down();
    let boxes: [Edge; 5] = [
        (
            "flat",
            "Boxes are flat in y.",
            [1.0, 2.0, 3.0, 4.0, 2.0, 5.0],
            None,
        ),
        (
            "point",
            "Boxes are points, with their centres.",
            [1.0; 6],
            Some([1.0; 3]),
        ),
        (
            "largest",
            "Boxes are as large as they may be, with their centres at the ends.",
            [-most, -most, -most, most, most, most],
            Some([-most, most, 0.0]),
        ),
        (
            "zeros",
            "Minimum -0, maximum 0, centre of both.",
            [-0.0, 0.0, -0.0, 0.0, -0.0, -0.0],
            Some([0.0, -0.0, 0.0]),
        ),
        (
            "least",
            "Boxes of the smallest numbers.",
            [
                0.0,
                -f32::from_bits(1),
                0.0,
                f32::from_bits(1),
                0.0,
                f32::MIN_POSITIVE,
            ],
            Some([f32::from_bits(1), 0.0, f32::from_bits(9)]),
        ),
    ];
    for (name, comment, bounds, centre) in boxes {
        let mut regions = some(set, 3);
        for region in &mut regions[1..] {
            region.bounds = bounds;
            region.centre = centre;
        }
        let frames = streams(std::slice::from_ref(set));
        let frames = frames.regions(&[Content::new(1, regions)]).commit();
        let name = format!("box-{name}-{coding}");
        drafts.push(valid(&name, &["R-020", "R-021", "R-050"], comment, &frames));
    }
}

fn sizes(drafts: &mut Vec<Draft>, set: &Set) {
    type Cut = fn(&mut super::Section);
    let cases: [(&str, &str, Cut); 6] = [
        ("raw-nothing", "A section is empty", |s| {
            s.head.clear();
            s.codes.clear();
        }),
        (
            "raw-regions-short",
            "A section lacks the last byte of its regions",
            |s| {
                s.codes.clear();
                s.head.pop();
            },
        ),
        ("raw-no-codes", "A section has no codes", |s| {
            s.codes.clear()
        }),
        (
            "raw-codes-short",
            "A section lacks the last byte of its codes",
            |s| _ = s.codes.pop(),
        ),
        ("raw-code-short", "A section lacks the last code", |s| {
            s.codes.truncate(s.codes.len() - 2)
        }),
        ("raw-code-over", "A section has a code more", |s| {
            s.codes.extend([0; 2])
        }),
    ];
    for (name, comment, cut) in cases {
        wrong_section(drafts, (3401, "R-012"), set, (name, comment), cut);
    }
    for seed in [1, 2, 3] {
        let frames = streams(std::slice::from_ref(set));
        let frames = frames.regions(&[Content::new(1, some(set, seed))]).commit();
        let name = format!("raw-regions-{seed}");
        let comment = "Regions of forms of all kinds, raw.";
        drafts.push(valid(&name, &["R-030", "R-025", "R-050"], comment, &frames));
    }
}

/// Name, error, sentence, clauses, change.
type Order = (
    &'static str,
    u16,
    &'static str,
    [&'static str; 2],
    fn(&mut super::Section),
);

/// One check before the next, in `raw`.
fn orders(drafts: &mut Vec<Draft>, set: &Set) {
    let cases: [Order; 7] = [
        (
            "box-then-form-bits",
            3403,
            "A box before the bits of its form",
            ["R-020", "R-022"],
            |s| {
                s.head[15] = 0xff;
                s.head[14] = 0xff;
                s.head[37] = 1;
            },
        ),
        (
            "form-bits-then-form",
            3402,
            "Unused bits of a form before the form",
            ["R-022", "R-022"],
            |s| {
                s.head[36] |= 3;
                s.head[39] = 1;
            },
        ),
        (
            "form-then-centre",
            3404,
            "A form before the centre",
            ["R-022", "R-021"],
            |s| {
                s.head[36] = 0x20 | 3;
                s.head[24] = 1;
            },
        ),
        (
            "first-region-then-second",
            3402,
            "The centre of a region before the box of the next",
            ["R-021", "R-020"],
            |s| {
                s.head[36] |= 0x20;
                s.head[24..36].fill(1);
                s.head[40..64].fill(0xff);
            },
        ),
        (
            "regions-then-codes",
            3403,
            "The last box before the size of the codes",
            ["R-020", "R-012"],
            |s| {
                s.head[3 * 40..3 * 40 + 24].fill(0xff);
                s.codes.clear();
            },
        ),
        (
            "size-then-code",
            3401,
            "The size of the codes before the codes",
            ["R-012", "R-024"],
            |s| {
                s.codes.fill(0x7f);
                s.codes.push(0);
            },
        ),
        (
            "code-then-end",
            3405,
            "A code before bytes after the section",
            ["R-024", "R-012"],
            |s| {
                s.codes.fill(0x7f);
                s.size = Some((s.head.len() + s.codes.len()) as u32);
                s.codes.push(0);
            },
        ),
    ];
    for (name, id, comment, clauses, change) in cases {
        let refused = Place::First.with_section(set, some(set, 1), change);
        let comment = format!("{comment}.");
        drafts.push(ordered((id, name), &clauses, &comment, refused));
    }
    // The pairs of a region before the box of the next.
    let set = Set {
        capacity: 4,
        ..set.clone()
    };
    let mut regions = vec![Region::new([0.0; 6], [2, 2, 2]); 4];
    regions[1].bounds[0] = 1.0;
    let refused = Place::First.with_section(&set, regions, |_| {});
    let comment = "The pairs of a region before the box of the next.";
    drafts.push(ordered(
        (3407, "pairs-then-box"),
        &["R-023", "R-020"],
        comment,
        refused,
    ));
}
