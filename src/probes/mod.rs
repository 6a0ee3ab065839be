//! `probes`: incident light at the nodes of a grid in spherical harmonics (DDISH-GI).
//!
//! [`sh`] is the basis, [`ggx`] the glossy lobe in it, [`dering`] what keeps light from going
//! negative, [`lattice`] where the probes stand, [`visibility`] how far they see. Server: `volume` ->
//! `server` -> `source`. Client: [`client`] -> [`sample`],
//! or [`pack`] for smaller textures.

pub mod client;
pub mod dering;
pub mod fidelity;
#[cfg(feature = "encode")]
mod follow;
pub mod ggx;
pub mod lattice;
pub mod pack;
pub mod sample;
#[cfg(feature = "encode")]
pub mod server;
pub mod sh;
#[cfg(feature = "encode")]
pub mod source;
pub mod visibility;
#[cfg(feature = "encode")]
pub mod volume;
