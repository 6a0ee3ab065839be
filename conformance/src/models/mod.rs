//! The models of the format, and what the suite needs of each: its lines in dumps, its queries, and
//! for the generator its raw parameters, its expected state and its vectors.
//!
//! A new model is a folder here and one more arm wherever the compiler asks for it; nothing outside
//! this folder names models.

#[cfg(feature = "generate")]
pub mod baked;
#[cfg(feature = "generate")]
pub mod entry;
pub mod instances;
pub mod points;
pub mod probes;
#[cfg(feature = "generate")]
pub mod range;
pub mod regions;
pub mod signals;
pub mod vertices;

use dapple_codec::{Decoder, Model, TrackState};
use serde::{Deserialize, Serialize};
#[cfg(feature = "generate")]
use twox_hash::XxHash64;

#[cfg(feature = "generate")]
use crate::generate::Draft;

/// A model with the parameters of a track.
pub trait ModelVectors {
    /// Names of the model and of its coding in dumps.
    fn names(&self) -> [&'static str; 2];

    /// Appends the lines of the parameters to a dump.
    fn dump_parameters(&self, track: u32, out: &mut String);

    /// Appends the lines of the content to a dump.
    fn dump_content(&self, decoder: &Decoder, live: &TrackState, out: &mut String);

    /// The numbers that answer a query line, of which `words` follow the track.
    ///
    /// # Errors
    /// Why there are none.
    fn answer(
        &self,
        samplers: &Samplers,
        decoder: &Decoder,
        live: &TrackState,
        words: &str,
    ) -> Result<Vec<f32>, NoAnswer>;
}

/// The model of a track.
pub fn of(model: &Model) -> &dyn ModelVectors {
    match model {
        Model::Points(grid) => grid,
        Model::Probes(volume) => volume,
        Model::Vertices(vertices) => vertices,
        Model::Instances(table) => table,
        Model::Regions(set) => set,
    }
}

/// Why a query has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoAnswer {
    /// The line is no query of a live track.
    NoQuery,
    /// There is no sampler of its model.
    NotImplemented,
}

/// What queries are answered with, by model.
#[derive(Clone, Copy, Debug, Default)]
pub struct Samplers {
    /// AO of `points`.
    pub points: Option<points::queries::Sampler>,
    /// Light of `probes`.
    pub probes: Option<probes::queries::Sampler>,
    /// AO of `vertices`.
    pub vertices: Option<vertices::queries::Sampler>,
    /// AO by `instances`.
    pub instances: Option<instances::queries::Sampler>,
    /// AO of `regions`.
    pub regions: Option<regions::queries::Sampler>,
}

impl Samplers {
    /// Whether no query can be answered.
    pub fn is_empty(&self) -> bool {
        self.points.is_none()
            && self.probes.is_none()
            && self.vertices.is_none()
            && self.instances.is_none()
            && self.regions.is_none()
    }
}

/// A look-up and the intervals that its result must lie in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Query {
    /// Of a track of `points`.
    Points(points::queries::PointsQuery),
    /// Of a track of `probes`.
    Probes(probes::queries::ProbesQuery),
    /// Of a track of `vertices`.
    Vertices(vertices::queries::VerticesQuery),
    /// Of a track of `instances`.
    Instances(instances::queries::InstancesQuery),
    /// Of a track of `regions`.
    Regions(regions::queries::RegionsQuery),
}

/// A query of a model.
pub trait ModelQuery {
    /// The line of a request (`conformance/README.md`).
    fn line(&self) -> String;

    /// The interval of each number of the answer.
    fn intervals(&self) -> Vec<[f64; 2]>;
}

impl Query {
    fn get(&self) -> &dyn ModelQuery {
        match self {
            Query::Points(query) => query,
            Query::Probes(query) => query,
            Query::Vertices(query) => query,
            Query::Instances(query) => query,
            Query::Regions(query) => query,
        }
    }

    /// The line of a request (`conformance/README.md`).
    pub fn line(&self) -> String {
        self.get().line()
    }

    /// The interval of each number of the answer.
    pub fn intervals(&self) -> Vec<[f64; 2]> {
        self.get().intervals()
    }

    /// Whether these numbers lie in their intervals.
    pub fn accepts(&self, answer: &[f64]) -> bool {
        let intervals = self.intervals();
        let mut pairs = intervals.iter().zip(answer);
        intervals.len() == answer.len() && pairs.all(|([low, high], v)| (low..=high).contains(&v))
    }
}

/// Metres per unit of a query's position.
pub const POSITION_UNIT: f32 = 1.0 / 65536.0;

/// The unit vector of a direction; `None` of length 0.
fn unit(direction: [i32; 3]) -> Option<[f32; 3]> {
    let direction = direction.map(f64::from);
    let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    (length > 0.0).then(|| direction.map(|v| (v / length) as f32))
}

/// The numbers of a query line.
fn integers(words: &str) -> Result<Vec<i32>, NoAnswer> {
    let numbers = words.split(' ').map(|word| word.parse().ok());
    numbers.collect::<Option<_>>().ok_or(NoAnswer::NoQuery)
}

/// The parameters of a track with all fields as they will stand there.
#[cfg(feature = "generate")]
#[derive(Clone, Debug, PartialEq)]
pub enum Parameters {
    Points(points::writer::Grid),
    Probes(probes::writer::Volume),
    Vertices(vertices::writer::Vertices),
    Instances(instances::writer::Table),
    Regions(regions::writer::Set),
}

#[cfg(feature = "generate")]
impl Parameters {
    /// Their bytes.
    pub fn bytes(&self) -> Vec<u8> {
        match self {
            Parameters::Points(grid) => grid.bytes(),
            Parameters::Probes(volume) => volume.bytes(),
            Parameters::Vertices(vertices) => vertices.bytes(),
            Parameters::Instances(table) => table.bytes(),
            Parameters::Regions(set) => set.bytes(),
        }
    }
}

/// The state that a track must have, worked out a second time.
#[cfg(feature = "generate")]
#[derive(Clone, Debug)]
pub enum Expected {
    Points(points::expected::Cells),
    Probes(probes::expected::Probes),
    Vertices(vertices::expected::Values),
    Instances(instances::expected::Entries),
    Regions(regions::expected::Regions),
}

/// An expected state of a model.
#[cfg(feature = "generate")]
pub trait ExpectedState {
    /// Adds the state to the digest of a commit.
    fn digest(&self, digest: &mut XxHash64);

    /// The lines of a dump that digest what a client sees, for a model that has some.
    fn digest_lines(&self, _track: u32) -> Vec<String> {
        Vec::new()
    }
}

#[cfg(feature = "generate")]
impl Expected {
    /// The state of a track without content.
    pub fn new(parameters: &Parameters) -> Expected {
        match parameters {
            Parameters::Points(_) => Expected::Points(points::expected::Cells::default()),
            Parameters::Probes(volume) => Expected::Probes(probes::expected::Probes::new(volume)),
            Parameters::Vertices(vertices) => {
                Expected::Vertices(vertices::expected::Values::new(vertices))
            }
            Parameters::Instances(table) => {
                Expected::Instances(instances::expected::Entries::new(table))
            }
            Parameters::Regions(set) => Expected::Regions(regions::expected::Regions::new(set)),
        }
    }

    /// The state, whatever its model.
    pub fn get(&self) -> &dyn ExpectedState {
        match self {
            Expected::Points(cells) => cells,
            Expected::Probes(probes) => probes,
            Expected::Vertices(values) => values,
            Expected::Instances(entries) => entries,
            Expected::Regions(regions) => regions,
        }
    }
}

/// Adds the vectors of all models.
///
/// # Errors
/// A sentence that names a vector with a query too near to a threshold.
#[cfg(feature = "generate")]
pub fn generate(drafts: &mut Vec<Draft>) -> Result<(), String> {
    points::generate::add(drafts)?;
    probes::generate::add(drafts)?;
    vertices::generate::add(drafts);
    instances::generate::add(drafts)?;
    regions::generate::add(drafts)
}
