//! The model `vertices`.

#[cfg(feature = "generate")]
mod baked;
mod dump;
#[cfg(feature = "generate")]
pub mod expected;
#[cfg(feature = "generate")]
pub mod generate;
pub mod queries;
#[cfg(feature = "generate")]
pub mod writer;

use dapple_codec::vertices::{Coding, Vertices};
use dapple_codec::{Decoder, TrackState};

use super::{ModelVectors, NoAnswer, Samplers};

impl ModelVectors for Vertices {
    fn names(&self) -> [&'static str; 2] {
        match self.coding {
            Coding::Raw => ["vertices", "raw"],
            Coding::Packed => ["vertices", "packed"],
        }
    }

    fn dump_parameters(&self, track: u32, out: &mut String) {
        dump::parameters(track, self, out);
    }

    fn dump_content(&self, decoder: &Decoder, live: &TrackState, out: &mut String) {
        dump::values(decoder.vertices(), live, self, out);
    }

    fn answer(
        &self,
        samplers: &Samplers,
        decoder: &Decoder,
        live: &TrackState,
        words: &str,
    ) -> Result<Vec<f32>, NoAnswer> {
        queries::answer(samplers.vertices, decoder, live, words)
    }
}
