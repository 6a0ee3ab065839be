//! `instances`: ambient obscurance of meshes that stand in a scene many times (Sloan, Tranchida, Chen and
//! Kavan 2013, *Ambient Obscurance Baking on the GPU*, section 2.2).
//!
//! Server: `server`. Client: [`client`] -> [`sample`]. What was measured is in `docs/instances.md`.

pub mod client;
pub mod sample;
#[cfg(feature = "encode")]
pub mod server;
