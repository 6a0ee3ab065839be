//! The model `points`.

mod dump;
#[cfg(feature = "generate")]
pub mod expected;
#[cfg(feature = "generate")]
pub mod frames;
#[cfg(feature = "generate")]
pub mod generate;
#[cfg(feature = "generate")]
pub mod oracle;
pub mod queries;
#[cfg(feature = "generate")]
pub mod writer;

use dapple_codec::points::Grid;
use dapple_codec::{Decoder, TrackState};

use super::{ModelVectors, NoAnswer, Samplers};

impl ModelVectors for Grid {
    fn names(&self) -> [&'static str; 2] {
        ["points", "cells"]
    }

    fn dump_parameters(&self, track: u32, out: &mut String) {
        dump::parameters(track, self, out);
    }

    fn dump_content(&self, decoder: &Decoder, live: &TrackState, out: &mut String) {
        dump::buckets(decoder.points(), live, self, out);
    }

    fn answer(
        &self,
        samplers: &Samplers,
        decoder: &Decoder,
        live: &TrackState,
        words: &str,
    ) -> Result<Vec<f32>, NoAnswer> {
        queries::answer(samplers.points, decoder, live, words)
    }
}
