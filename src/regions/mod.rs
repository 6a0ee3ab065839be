//! `regions`: ambient obscurance for objects that move, one small model per box of space (Sloan,
//! Tranchida, Chen and Kavan 2013, *Ambient Obscurance Baking on the GPU*, section 2.3).
//!
//! Server: `server`. Client: [`client`] -> [`index`] -> [`sample`]. What was measured is in `docs/regions.md`.

pub mod client;
pub mod index;
pub mod sample;
#[cfg(feature = "encode")]
pub mod server;
