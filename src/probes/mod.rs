//! `probes`: incident light at the nodes of a grid in spherical harmonics (DDISH-GI).
//!
//! [`sh`] is the basis, [`ggx`] the glossy lobe in it, [`dering`] what keeps light from going
//! negative, [`lattice`] where the probes stand, [`visibility`] how far they see. Server: `volume` ->
//! `server` -> `source`. Client: [`client`] -> [`sample`].

pub mod client;
pub mod dering;
#[cfg(feature = "encode")]
pub mod fidelity;
pub mod ggx;
pub mod lattice;
pub mod sample;
#[cfg(feature = "encode")]
pub mod server;
pub mod sh;
#[cfg(feature = "encode")]
pub mod source;
pub mod visibility;
#[cfg(feature = "encode")]
pub mod volume;
