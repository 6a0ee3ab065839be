//! The model `probes`.

mod dump;
#[cfg(feature = "generate")]
pub mod expected;
#[cfg(feature = "generate")]
pub mod frames;
#[cfg(feature = "generate")]
pub mod generate;
#[cfg(feature = "generate")]
pub mod maps;
#[cfg(feature = "generate")]
pub mod oracle;
pub mod queries;
#[cfg(feature = "generate")]
pub mod range;
#[cfg(feature = "generate")]
pub mod values;
#[cfg(feature = "generate")]
pub mod writer;

use dapple_codec::probes::{Coding, Volume};
use dapple_codec::{Decoder, TrackState};

use super::{ModelVectors, NoAnswer, Samplers};

impl ModelVectors for Volume {
    fn names(&self) -> [&'static str; 2] {
        match self.coding {
            Coding::Raw => ["probes", "raw"],
            Coding::Packed(_) => ["probes", "packed"],
        }
    }

    fn dump_parameters(&self, track: u32, out: &mut String) {
        dump::parameters(track, self, out);
    }

    fn dump_content(&self, decoder: &Decoder, live: &TrackState, out: &mut String) {
        dump::probes(decoder.probes(), live, self, out);
    }

    fn answer(
        &self,
        samplers: &Samplers,
        decoder: &Decoder,
        live: &TrackState,
        words: &str,
    ) -> Result<Vec<f32>, NoAnswer> {
        queries::answer(samplers.probes, decoder, live, words)
    }
}
