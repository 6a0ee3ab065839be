//! Our decoder against every vector, in this process, without a sampler. What mutation and coverage
//! runs use: nothing runs beneath it but `dapple-codec`.

use std::ops::ControlFlow;

use dapple_conformance::options::{Extent, Options};
use dapple_conformance::reference::Reference;
use dapple_conformance::run::run;
use dapple_conformance::vector;

#[test]
fn our_decoder_passes_every_vector() {
    passes(Extent::None, Extent::None);
}

#[test]
fn our_decoder_passes_their_prefixes_and_flips() {
    passes(Extent::All, Extent::Sample);
}

fn passes(prefixes: Extent, flips: Extent) {
    let options = Options {
        prefixes,
        flips,
        compare: false,
        ..Options::default()
    };
    let vectors = vector::load(&vector::folder()).expect("vectors");
    let report = run(
        "own",
        &mut Reference::default(),
        &vectors,
        &options,
        &mut |_| ControlFlow::Continue(()),
    );
    let mut failed = String::new();
    for outcome in report.expect("vectors to run").outcomes {
        if outcome.failed() {
            let failure = &outcome.failures[0];
            failed += &format!(
                "{}, {}: expected {}, got {}\n",
                outcome.path, failure.check, failure.expected, failure.got
            );
        }
    }
    assert!(failed.is_empty(), "\n{failed}");
}
