//! Placeholder of the decoding benchmark.
fn main() {}
