//! The tests of the codec, but for `memory.rs`, which is a process of its own.

#[path = "common/baked.rs"]
mod baked;
mod common;
#[path = "common/tables.rs"]
mod instance_tables;
#[path = "common/regions.rs"]
mod region_sets;
#[path = "common/volumes.rs"]
mod volumes;

mod encoder_misuse;
mod errors;
mod instances;
mod probes;
mod regions;
mod stream;
mod vertices;
mod work;
