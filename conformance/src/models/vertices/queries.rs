//! Queries of `vertices`: AO in a triangle.

use dapple_codec::{Decoder, TrackState};
use serde::{Deserialize, Serialize};

use crate::models::{ModelQuery, NoAnswer, integers};

/// AO of a track in a triangle of these vertices, at barycentric weights; all vertices are the track's.
pub type Sampler = fn(&Decoder, &TrackState, [u32; 3], [f32; 3]) -> f32;

/// What the weights of a query come to.
const WHOLE: i32 = 65536;

/// A look-up of AO.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VerticesQuery {
    /// Track id.
    pub track: u32,
    /// Numbers of the triangle's vertices in the track's order.
    pub vertices: [u32; 3],
    /// Barycentric weights in 1/65536, whose sum is 65536.
    pub weights: [u32; 3],
    /// Smallest and largest AO, in 1/65536.
    pub ao: [u32; 2],
}

impl ModelQuery for VerticesQuery {
    fn line(&self) -> String {
        let ([a, b, c], [u, v, w]) = (self.vertices, self.weights);
        format!("{} {a} {b} {c} {u} {v} {w}", self.track)
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
    let &[a, b, c, u, v, w] = integers(words)?.as_slice() else {
        return Err(NoAnswer::NoQuery);
    };
    let count = live.track.vertices().map_or(0, |vertices| vertices.count);
    let vertex = |number: i32| u32::try_from(number).ok().filter(|&number| number < count);
    let vertices = [a, b, c].map(vertex);
    let weights = [u, v, w];
    let [Some(a), Some(b), Some(c)] = vertices else {
        return Err(NoAnswer::NoQuery);
    };
    let whole = weights.iter().map(|&weight| i64::from(weight)).sum::<i64>();
    if weights.iter().any(|&weight| weight < 0) || whole != i64::from(WHOLE) {
        return Err(NoAnswer::NoQuery);
    }
    let sampler = sampler.ok_or(NoAnswer::NotImplemented)?;
    let weights = weights.map(|weight| weight as f32 / WHOLE as f32);
    Ok(vec![sampler(decoder, live, [a, b, c], weights)])
}
