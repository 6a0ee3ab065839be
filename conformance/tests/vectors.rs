//! Our decoder against every vector, in this process. What mutation and coverage runs use: nothing
//! runs beneath it but `dapple-codec`, without a sampler.

use dapple_conformance::protocol::Own;
use dapple_conformance::run::{Flips, Options, run};
use dapple_conformance::vector;

#[test]
fn our_decoder_passes_every_vector() {
    let vectors = vector::load(&vector::folder()).expect("vectors");
    let options = Options {
        flips: Flips::Sample,
        compare: false,
        ..Options::default()
    };
    let report = run("own", &mut Own::default(), &vectors, &options, &mut |_| {});
    let report = report.expect("vectors to run");
    let mut failed = String::new();
    for outcome in report.outcomes.iter().filter(|outcome| outcome.failed()) {
        let failure = &outcome.failures[0];
        failed += &format!(
            "{}, {}: expected {}, got {}\n",
            outcome.path, failure.check, failure.expected, failure.got
        );
    }
    assert!(failed.is_empty(), "\n{failed}");
}
