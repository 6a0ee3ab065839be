//! Sizes of sections, clause V-011.

use super::{Draft, Vertices, invalid, ordered, payload, section, two};
use crate::stream_builder::{kind, set_word};

pub fn add(drafts: &mut Vec<Draft>) {
    sizes(drafts);
    neighbours(drafts);
}

/// Sections of the size of another coding, of other bits, or of another number of signals.
fn sizes(drafts: &mut Vec<Draft>) {
    for (name, comment, vertices, bytes) in [
        (
            "five-bits-in-bytes",
            "Raw codes of 5 bits stand in a byte each",
            Vertices::raw(7).five(),
            7,
        ),
        (
            "packed-in-five-bits",
            "Packed codes of 5 bits stand in 5 bits each",
            Vertices::packed(7).five(),
            5,
        ),
        (
            "one-signal-of-two",
            "A section of two signals has one",
            Vertices::packed(6).two(),
            6,
        ),
        (
            "two-signals-of-one",
            "A section of one signal has two",
            Vertices::raw(6),
            12,
        ),
        (
            "five-bits-rounded-up-to-4",
            "A section is padded to a multiple of four",
            Vertices::raw(7).five(),
            8,
        ),
    ] {
        let refused = section(&vertices, |section| section.bytes = vec![0; bytes]);
        let comment = format!("{comment}.");
        drafts.push(invalid((3201, name), &["V-011"], &comment, refused));
    }
}

/// Sections that take bytes of what follows them.
fn neighbours(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let whole = payload(&frames.vertices_sections(&contents));
    let refused = |change: fn(&mut Vec<u8>)| {
        let mut payload = whole.clone();
        change(&mut payload);
        frames.clone().refused_of(kind::VERTICES, &payload)
    };
    drafts.push(invalid(
        (3201, "section-long"),
        &["V-011"],
        "The first section has a byte more than its values.",
        refused(|p| {
            set_word(p, 20, 11);
            p.insert(40, 0);
        }),
    ));
    drafts.push(invalid(
        (3201, "sections-shifted"),
        &["V-011"],
        "The first section has a byte more and the last one less.",
        refused(|p| {
            p[20] += 1;
            p[32] -= 1;
        }),
    ));
    drafts.push(ordered(
        (3202, "section-then-byte-over"),
        &["V-021", "V-011"],
        "The bits after the last code are checked before what follows the last section.",
        refused(|p| {
            p[41 + 10] |= 0x80;
            p.push(0);
        }),
    ));
}
