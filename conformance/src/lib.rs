//! Conformance of Dapple decoders: the canonical dump, the vectors and what is known of them, the
//! generator that writes them, and the runner that runs them through any decoder.
//!
//! What an external decoder has to speak stands in `conformance/README.md`, the form of its output in
//! `spec/dump.md`.

pub mod checks;
pub mod clauses;
pub mod dump;
#[cfg(feature = "generate")]
pub mod generate;
pub mod models;
pub mod options;
pub mod program;
pub mod protocol;
pub mod reference;
pub mod report;
pub mod run;
pub mod serve;
#[cfg(feature = "generate")]
pub mod stream_builder;
mod text;
pub mod vector;
