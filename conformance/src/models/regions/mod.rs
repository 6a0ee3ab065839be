//! The model `regions`.

#[cfg(feature = "generate")]
mod baked;
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

use dapple_codec::regions::{Coding, RegionSet};
use dapple_codec::{Decoder, TrackState};

use super::{ModelVectors, NoAnswer, Samplers};

impl ModelVectors for RegionSet {
    fn names(&self) -> [&'static str; 2] {
        match self.coding {
            Coding::Raw => ["regions", "raw"],
            Coding::Packed => ["regions", "packed"],
        }
    }

    fn dump_parameters(&self, track: u32, out: &mut String) {
        dump::parameters(track, self, out);
    }

    fn dump_content(&self, decoder: &Decoder, live: &TrackState, out: &mut String) {
        dump::regions(decoder.regions(), live, out);
    }

    fn answer(
        &self,
        samplers: &Samplers,
        decoder: &Decoder,
        live: &TrackState,
        words: &str,
    ) -> Result<Vec<f32>, NoAnswer> {
        queries::answer(samplers.regions, decoder, live, words)
    }
}
