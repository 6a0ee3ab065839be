//! `vertices`: ambient obscurance at the vertices of meshes (Sloan, Tranchida, Chen and Kavan 2013, *Ambient
//! Obscurance Baking on the GPU*, section 2.1).
//!
//! Server: `server`. Client: [`client`] -> [`sample`]. What was measured is in `docs/vertices.md`.

pub mod client;
pub mod sample;
#[cfg(feature = "encode")]
pub mod server;
