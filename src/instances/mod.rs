//! `instances`: ambient obscurance of meshes that stand in a scene many times (Sloan, Tranchida, Chen and
//! Kavan 2013, *Ambient Obscurance Baking on the GPU*, section 2.2).
//!
//! Server: `server`. What was measured is in `docs/instances.md`.

#[cfg(feature = "encode")]
pub mod server;
