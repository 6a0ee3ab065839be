//! `points`: place -> solve -> update -> encode, and the client's sampler.
pub mod sample;
