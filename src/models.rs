//! The models, and what each is to a stream. A new model is one entry in each item of this file that
//! names them.

use crate::Result;
use crate::codec::{self, Compression, Encoder, StateDigest};
use crate::points::source as points;
use crate::probes::source as probes;
use crate::world::World;
use std::any::Any;
use std::time::Duration;

/// A model that a stream can carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Model {
    /// Ambient occlusion at surface points.
    Points,
    /// Indirect light in a volume of probes.
    Probes,
}

impl Model {
    /// All models in the order of their tracks in a stream.
    pub const ALL: [Model; 2] = [Model::Points, Model::Probes];
}

/// The options of a model.
#[derive(Clone, Copy, Debug)]
pub enum ModelOptions {
    Points(points::Options),
    Probes(probes::Request),
}

impl ModelOptions {
    /// The model in a scene, before anything is traced. Its tracks have the ids from `first_id` on.
    ///
    /// # Errors
    /// `Invalid` for a scene without anything for the model, and for options that it cannot have.
    pub fn source(&self, world: &World, first_id: u32) -> Result<Box<dyn Source>> {
        Ok(match self {
            ModelOptions::Points(o) => Box::new(points::Source::new(world, o, first_id)?),
            ModelOptions::Probes(o) => Box::new(probes::Source::new(world, o, first_id)?),
        })
    }
}

/// Statistics by model, each `None` where the stream does not carry it.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "cli", derive(serde::Serialize))]
pub struct Reports {
    #[cfg_attr(feature = "cli", serde(flatten))]
    pub points: Option<points::Report>,
    #[cfg_attr(feature = "cli", serde(flatten))]
    pub probes: Option<probes::Report>,
}

/// The work of a tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tick {
    pub rays: u64,
    /// Finding what to trace.
    pub select_time: Duration,
    pub trace_time: Duration,
    /// Storing what was traced.
    pub store_time: Duration,
}

impl std::ops::AddAssign for Tick {
    fn add_assign(&mut self, other: Tick) {
        self.rays += other.rays;
        self.select_time += other.select_time;
        self.trace_time += other.trace_time;
        self.store_time += other.store_time;
    }
}

/// A model in a stream: its values, and the records that bring clients up to date.
pub trait Source: Any {
    /// The declarations of its tracks.
    fn tracks(&self) -> Vec<codec::Track>;

    /// Computes all values for the first time. `progress` gets (done, all).
    fn start(&mut self, world: &World, progress: &mut dyn FnMut(usize, usize)) -> Tick;

    /// Looks at the world just before it moves ([`World::advance`]).
    fn leave(&mut self, _world: &World) {}

    /// Brings the values up to date with a world that has moved.
    fn tick(&mut self, world: &World) -> Tick;

    /// Writes everything that a client needs to start at this frame.
    ///
    /// # Errors
    /// Those of the codec.
    fn write_keyframe(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()>;

    /// Writes what changed since the last frame.
    ///
    /// # Errors
    /// Those of the codec.
    fn write_delta(
        &mut self,
        encoder: &mut Encoder,
        compression: Compression,
        out: &mut Vec<u8>,
    ) -> Result<()>;

    /// Adds the state of its tracks as clients have it, in the order of their ids.
    fn digest(&self, digest: &mut StateDigest);

    /// States its part of the statistics.
    fn report(&self, reports: &mut Reports);
}

#[cfg(all(test, feature = "cli"))]
mod tests {
    use super::*;

    #[test]
    fn all_lists_every_model() {
        let declared = <Model as clap::ValueEnum>::value_variants();
        assert_eq!(Model::ALL, *declared);
    }
}
