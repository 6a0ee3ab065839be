//! The tests of the vectors, the generator and the runner, but for `vectors.rs`.

mod clauses;
mod counts;
mod examples;
#[cfg(feature = "generate")]
mod generator;
mod lighting;
mod lighting_mistakes;
mod queries;
mod regions_mistakes;
#[cfg(feature = "generate")]
mod runner;
mod schema;
mod snapshots;
mod vertices_mistakes;
