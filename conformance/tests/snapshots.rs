//! Dumps and transcripts to read: one for each record type, model and coding, and for the usual
//! losses. Hashes of all are in the JSON of the vectors.

use dapple_conformance::protocol::{Arguments, Mode, Program as _};
use dapple_conformance::reference::Reference;
use dapple_conformance::vector::{self, Kind, Vector};

const SHOWN: &[&str] = &[
    "container/sessions/damaged-group",
    "container/sessions/late-join",
    "container/sessions/lost-frame",
    "container/sessions/reset-in-frame",
    "container/valid/path-controls",
    "container/valid/remove-with-transform",
    "container/valid/usual",
    "instances/sessions/failed-second-record",
    "instances/valid/entries-4-of-1-raw",
    "instances/valid/entries-5-of-2-packed",
    "points/valid/cells-of-0-to-7-points-24-bits",
    "points/valid/chain-of-deltas",
    "probes/sessions/failed-value",
    "probes/valid/both-models-keyframe-and-delta",
    "probes/valid/raw-8-probes",
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

#[test]
fn dumps_and_transcripts_snapshots() {
    let vectors = vector::load(&vector::folder()).expect("vectors");
    for path in SHOWN {
        let vector = vectors.iter().find(|vector| vector.path() == *path);
        let vector = vector.expect(path);
        insta::with_settings!({
            prepend_module_to_snapshot => false,
            omit_expression => true,
            description => &vector.info.comment,
        }, {
            insta::assert_snapshot!(path.replace('/', "-"), output(vector));
        });
    }
}
