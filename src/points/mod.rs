//! `points`: ambient occlusion at surface points (PSAO).
//!
//! Server: [`place`] -> [`server`] (with [`grid`], [`store`], [`chunks`], [`frustum`]) ->
//! [`source`]. Client: [`client`] -> [`sample`].

#[cfg(feature = "encode")]
pub mod chunks;
pub mod client;
#[cfg(feature = "encode")]
pub mod eliminate;
#[cfg(feature = "encode")]
pub mod frustum;
#[cfg(feature = "encode")]
pub mod grid;
#[cfg(feature = "encode")]
pub mod place;
pub mod sample;
#[cfg(feature = "encode")]
pub mod server;
#[cfg(feature = "encode")]
pub mod source;
#[cfg(feature = "encode")]
pub mod store;
