//! Queries of `instances`: AO at a place on a mesh instance.

use dapple_codec::{Decoder, TrackState};
use serde::{Deserialize, Serialize};

use crate::models::{ModelQuery, NoAnswer, POSITION_UNIT, integers};

/// AO of the mesh instance of a path, at a mesh-space position (metres), times a local AO.
pub type Sampler = fn(&Decoder, &TrackState, path: &str, position: [f32; 3], local: f32) -> f32;

/// A look-up of AO.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstancesQuery {
    /// Track id.
    pub track: u32,
    /// Path of the mesh instance.
    pub instance: String,
    /// Mesh-space position in 1/65536 m.
    pub position: [i32; 3],
    /// Local AO, 0 to 65536, in 1/65536.
    pub local: u32,
    /// Smallest and largest AO, in 1/65536.
    pub ao: [u32; 2],
}

impl ModelQuery for InstancesQuery {
    fn line(&self) -> String {
        let ([x, y, z], local) = (self.position, self.local);
        format!("{} {x} {y} {z} {local} {}", self.track, self.instance)
    }

    fn intervals(&self) -> Vec<[f64; 2]> {
        vec![self.ao.map(|end| f64::from(end) / 65536.0)]
    }
}

/// The AO that a query line looks up.
pub fn answer(
    sampler: Option<Sampler>,
    decoder: &Decoder,
    live: &TrackState,
    words: &str,
) -> Result<Vec<f32>, NoAnswer> {
    // The path is the rest of the line, with any spaces.
    let mut ends = words.match_indices(' ').map(|(at, _)| at);
    let end = ends.nth(3).ok_or(NoAnswer::NoQuery)?;
    let &[x, y, z, local @ 0..=65536] = integers(&words[..end])?.as_slice() else {
        return Err(NoAnswer::NoQuery);
    };
    let position = [x, y, z].map(|v| v as f32 * POSITION_UNIT);
    let sampler = sampler.ok_or(NoAnswer::NotImplemented)?;
    let ao = sampler(
        decoder,
        live,
        &words[end + 1..],
        position,
        local as f32 / 65536.0,
    );
    Ok(vec![ao])
}
