//! Dumps and transcripts to read: hashes alone would hide what a change changes.

use dapple_conformance::protocol::{Arguments, Mode, Program as _};
use dapple_conformance::reference::Reference;
use dapple_conformance::vector::{self, Kind, Vector};

/// Vectors that show much in little.
const TELLING: &[&str] = &[
    "container/valid/commit-digest",
    "container/valid/group-empties",
    "container/valid/least",
    "container/valid/live-after-commit",
    "container/valid/path-controls",
    "container/valid/remove-with-transform",
    "container/valid/track-numbers-extreme",
    "container/valid/usual",
    "points/valid/cell-freed-and-used-again",
    "points/valid/cells-of-0-to-7-points-24-bits",
    "points/valid/chain-of-deltas",
    "points/valid/order-of-entries",
    "points/valid/unnamed-cell-keeps",
    "probes/valid/both-models-keyframe-and-delta",
    "probes/valid/fill-follows",
    "probes/valid/packed-five-bits",
    "probes/valid/packed-levels",
    "probes/valid/raw-8-probes",
    "probes/valid/values-strong-chroma",
    "probes/valid/visibility-goes-packed",
];

fn output(vector: &Vector) -> String {
    let arguments = Arguments {
        mode: match vector.kind {
            Kind::Sessions => Mode::Session,
            _ => Mode::Stream,
        },
        limits: vector.info.limits.clone(),
        live: vector.info.live,
        ..Arguments::default()
    };
    let answer = Reference::default().request(&arguments, &vector.bytes);
    String::from_utf8(answer.expect("an answer").output).expect("text")
}

fn snapshot(vector: &Vector) {
    let name = vector.path().replace('/', "-");
    insta::with_settings!({
        prepend_module_to_snapshot => false,
        omit_expression => true,
        description => &vector.info.comment,
    }, {
        insta::assert_snapshot!(name, output(vector));
    });
}

#[test]
fn telling_dumps() {
    let vectors = vector::load(&vector::folder()).expect("vectors");
    for path in TELLING {
        let vector = vectors.iter().find(|vector| vector.path() == *path);
        snapshot(vector.expect(path));
    }
}

#[test]
fn transcripts_of_all_sessions() {
    let vectors = vector::load(&vector::folder()).expect("vectors");
    for vector in vectors
        .iter()
        .filter(|vector| vector.kind == Kind::Sessions)
    {
        snapshot(vector);
    }
}
