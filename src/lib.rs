//! Dapple: the reference system for streamed and baked low-frequency light.
//!
//! Data flows one way: [`scene`] -> [`trace`] -> model ([`points`], [`probes`]) -> `dapple-codec` ->
//! file or wire -> `dapple-codec` -> [`client`] -> [`render`] -> [`measure`].
//! Nothing upstream knows what is downstream.

pub mod client;
pub mod error;
pub mod instances;
pub mod points;
pub mod probes;
pub mod regions;
pub mod rng;
pub mod vertices;

#[cfg(feature = "encode")]
pub mod bake;
#[cfg(feature = "encode")]
mod base64;
#[cfg(feature = "encode")]
pub mod gltf_writer;
#[cfg(feature = "encode")]
pub mod limits;
#[cfg(feature = "encode")]
pub mod models;
#[cfg(feature = "encode")]
pub mod obscurance;
#[cfg(feature = "encode")]
pub mod scene;
#[cfg(feature = "encode")]
pub mod stream;
#[cfg(feature = "encode")]
pub mod trace;
#[cfg(feature = "encode")]
pub mod world;

#[cfg(feature = "render")]
pub mod files;
#[cfg(feature = "render")]
pub mod render;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
pub mod measure;

pub use dapple_codec as codec;
pub use error::{Error, Result};
