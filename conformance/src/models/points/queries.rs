//! Queries of `points`: AO at a position with a normal.

use dapple_codec::{Decoder, TrackState};
use serde::{Deserialize, Serialize};

use crate::models::{ModelQuery, NoAnswer, POSITION_UNIT, integers, unit};

/// AO at a grid-space position (metres) with a unit normal on a track.
pub type Sampler = fn(&Decoder, &TrackState, [f32; 3], [f32; 3]) -> f32;

/// A look-up of AO.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointsQuery {
    /// Track id.
    pub track: u32,
    /// Grid-space position in 1/65536 m.
    pub position: [i32; 3],
    /// Direction of the normal, to be normalised.
    pub normal: [i32; 3],
    /// Smallest and largest AO, in 1/65536.
    pub ao: [u32; 2],
}

impl ModelQuery for PointsQuery {
    fn line(&self) -> String {
        let ([x, y, z], [nx, ny, nz]) = (self.position, self.normal);
        format!("{} {x} {y} {z} {nx} {ny} {nz}", self.track)
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
    let &[x, y, z, nx, ny, nz] = integers(words)?.as_slice() else {
        return Err(NoAnswer::NoQuery);
    };
    let position = [x, y, z].map(|v| v as f32 * POSITION_UNIT);
    let normal = unit([nx, ny, nz]).ok_or(NoAnswer::NoQuery)?;
    let sampler = sampler.ok_or(NoAnswer::NotImplemented)?;
    Ok(vec![sampler(decoder, live, position, normal)])
}
