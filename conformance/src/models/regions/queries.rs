//! Queries of `regions`: the AO of an object that moves.

use dapple_codec::{Decoder, TrackState};
use serde::{Deserialize, Serialize};

use crate::models::{ModelQuery, NoAnswer, POSITION_UNIT, integers, unit};

/// The AO at a position (metres) with a unit normal, both in the space of a track.
pub type Sampler = fn(&Decoder, &TrackState, [f32; 3], [f32; 3]) -> f32;

/// A look-up of AO by position and normal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RegionsQuery {
    /// Track id.
    pub track: u32,
    /// Position in the track's space in 1/65536 m.
    pub position: [i32; 3],
    /// Direction of the normal, to be normalised.
    pub normal: [i32; 3],
    /// Smallest and largest AO of a region, in 1/65536.
    pub obscurance: [u64; 2],
}

impl ModelQuery for RegionsQuery {
    fn line(&self) -> String {
        let numbers = self.position.iter().chain(&self.normal);
        numbers.fold(self.track.to_string(), |line, n| format!("{line} {n}"))
    }

    fn intervals(&self) -> Vec<[f64; 2]> {
        vec![self.obscurance.map(|end| end as f64 / 65536.0)]
    }
}

/// The AO that a query line looks up.
pub fn answer(
    sampler: Option<Sampler>,
    decoder: &Decoder,
    live: &TrackState,
    words: &str,
) -> Result<Vec<f32>, NoAnswer> {
    let numbers = integers(words)?;
    let &[x, y, z, nx, ny, nz] = numbers.as_slice() else {
        return Err(NoAnswer::NoQuery);
    };
    let normal = unit([nx, ny, nz]).ok_or(NoAnswer::NoQuery)?;
    let sampler = sampler.ok_or(NoAnswer::NotImplemented)?;
    let position = [x, y, z].map(|v| v as f32 * POSITION_UNIT);
    Ok(vec![sampler(decoder, live, position, normal)])
}
