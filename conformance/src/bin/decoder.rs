//! Our decoder as a program that speaks the protocol of `conformance/README.md`; no query is
//! implemented, since a sampler is no part of a decoder.

use std::process::ExitCode;

use dapple_conformance::reference::Reference;
use dapple_conformance::serve;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    serve::main(&mut Reference::default(), &words)
}
