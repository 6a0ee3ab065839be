//! The registry of models: what each is called in a stream, what a track declares of it, and what a
//! session keeps of it.
//!
//! A new model is a folder here, a line in each item of this file, and what the compiler asks for where
//! programs tell models apart. Nothing else in this crate names a model.

pub(crate) mod baked;
pub mod instances;
pub(crate) mod payload_header;
pub mod points;
pub mod probes;
pub mod regions;
pub mod signals;
pub(crate) mod state;
pub mod vertices;

use alloc::vec::Vec;

use crate::dirty::Dirty;
use crate::error::ErrorKind;
use crate::wire::Reader;
use state::ModelState;

/// Model of a track with its parameters.
///
/// Exhaustive as long as the crate is not released: a new model has to be a compile error in every
/// program of this repository that tells models apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// `points` in the coding `cells`.
    Points(points::Grid),
    /// `probes` in the coding `raw` or `packed`.
    Probes(probes::Volume),
    /// `vertices` in the coding `raw` or `packed`.
    Vertices(vertices::Vertices),
    /// `instances` in the coding `raw` or `packed`.
    Instances(instances::Table),
    /// `regions` in the coding `raw` or `packed`.
    Regions(regions::RegionSet),
}

/// A model without parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ModelKind {
    /// `points`: ambient occlusion at surface points.
    Points,
    /// `probes`: indirect light at the probes of a volume.
    Probes,
    /// `vertices`: ambient obscurance at the vertices of a mesh.
    Vertices,
    /// `instances`: ambient obscurance of whole mesh instances.
    Instances,
    /// `regions`: ambient obscurance in boxes of the world.
    Regions,
}

/// The space that a fragment is looked up in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LookupSpace {
    /// Mesh space as drawn: rigid, or posed by the server.
    Mesh,
    /// Rest pose: the fragment passes its rest position and rest normal.
    Rest,
}

/// What the container and the track record know of a model.
pub(crate) struct Descriptor {
    pub(crate) name: &'static str,
    /// Number of the model in a track's entry.
    pub(crate) number: u16,
    /// Type of the record that carries its content.
    pub(crate) record_type: u16,
    /// Names of its codings, by their numbers.
    pub(crate) codings: &'static [&'static str],
    /// Spaces that its tracks may be looked up in.
    pub(crate) spaces: &'static [LookupSpace],
    /// Reads the parameters of a track in a coding that there is.
    pub(crate) read: fn(coding: u16, reader: &mut Reader<'_>) -> Result<Model, ErrorKind>,
    /// Bytes that a session keeps of each track beside its decoded state.
    pub(crate) track_bytes: usize,
}

/// What a track declares of a model.
pub(crate) trait Parameters {
    /// Number of the coding.
    fn coding(&self) -> u16;

    /// The rules that hold for the parameters by themselves.
    fn check(&self) -> Result<(), ErrorKind>;

    /// Appends the parameters.
    fn write(&self, out: &mut Vec<u8>);

    /// Bytes of decoded state that count against [`crate::Limits::state_bytes`].
    fn state_bytes(&self) -> u64;
}

/// The state of every model, as a session holds it.
#[derive(Default)]
pub(crate) struct ModelStates {
    pub(crate) points: points::Store,
    pub(crate) probes: probes::Store,
    pub(crate) vertices: vertices::Store,
    pub(crate) instances: instances::Store,
    pub(crate) regions: regions::Store,
}

impl ModelKind {
    /// All models, by their numbers.
    pub const ALL: [ModelKind; 5] = [
        ModelKind::Points,
        ModelKind::Probes,
        ModelKind::Vertices,
        ModelKind::Instances,
        ModelKind::Regions,
    ];

    pub(crate) const fn descriptor(self) -> &'static Descriptor {
        match self {
            ModelKind::Points => &points::DESCRIPTOR,
            ModelKind::Probes => &probes::DESCRIPTOR,
            ModelKind::Vertices => &vertices::DESCRIPTOR,
            ModelKind::Instances => &instances::DESCRIPTOR,
            ModelKind::Regions => &regions::DESCRIPTOR,
        }
    }
}

impl Model {
    /// The model without its parameters.
    pub fn kind(&self) -> ModelKind {
        self.parts().0
    }

    fn parts(&self) -> (ModelKind, &dyn Parameters) {
        match self {
            Model::Points(grid) => (ModelKind::Points, grid),
            Model::Probes(volume) => (ModelKind::Probes, volume),
            Model::Vertices(vertices) => (ModelKind::Vertices, vertices),
            Model::Instances(table) => (ModelKind::Instances, table),
            Model::Regions(set) => (ModelKind::Regions, set),
        }
    }
}

impl ModelStates {
    pub(crate) fn of(&self, kind: ModelKind) -> &dyn ModelState {
        match kind {
            ModelKind::Points => &self.points,
            ModelKind::Probes => &self.probes,
            ModelKind::Vertices => &self.vertices,
            ModelKind::Instances => &self.instances,
            ModelKind::Regions => &self.regions,
        }
    }

    pub(crate) fn of_mut(&mut self, kind: ModelKind) -> &mut dyn ModelState {
        match kind {
            ModelKind::Points => &mut self.points,
            ModelKind::Probes => &mut self.probes,
            ModelKind::Vertices => &mut self.vertices,
            ModelKind::Instances => &mut self.instances,
            ModelKind::Regions => &mut self.regions,
        }
    }

    /// What changed in the arrays of all models.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        let all = core::iter::empty();
        let all = all.chain(self.points.state.dirty());
        let all = all.chain(self.probes.state.dirty());
        let all = all.chain(self.vertices.state.dirty());
        let all = all.chain(self.instances.state.dirty());
        all.chain(self.regions.state.dirty())
    }
}

// What follows is the same for every model.

impl ModelKind {
    /// Its name in the specification, such as `points`.
    pub fn name(self) -> &'static str {
        self.descriptor().name
    }

    /// Its number in a track's entry, such as 1 of `points`.
    pub fn number(self) -> u16 {
        self.descriptor().number
    }

    /// Type of the record that carries its content.
    pub fn record_type(self) -> u16 {
        self.descriptor().record_type
    }

    /// The spaces that its tracks may be looked up in.
    pub fn spaces(self) -> &'static [LookupSpace] {
        self.descriptor().spaces
    }

    /// Its index in [`ModelKind::ALL`].
    pub(crate) fn index(self) -> usize {
        self as usize
    }

    /// The model of a number in a track's entry.
    pub(crate) fn of_number(number: u16) -> Result<ModelKind, ErrorKind> {
        let mut all = ModelKind::ALL.into_iter();
        let found = all.find(|kind| kind.descriptor().number == number);
        found.ok_or(ErrorKind::Model)
    }

    /// The model whose content a record carries; none for the records of the container.
    pub(crate) fn of_record(record_type: u16) -> Option<ModelKind> {
        let mut all = ModelKind::ALL.into_iter();
        all.find(|kind| kind.descriptor().record_type == record_type)
    }

    /// The model has a coding of this number.
    pub(crate) fn check_coding(self, coding: u16) -> Result<(), ErrorKind> {
        match usize::from(coding) < self.descriptor().codings.len() {
            true => Ok(()),
            false => Err(ErrorKind::Coding),
        }
    }

    /// A track of the model may be looked up in this space.
    pub(crate) fn check_space(self, space: LookupSpace) -> Result<(), ErrorKind> {
        match self.descriptor().spaces.contains(&space) {
            true => Ok(()),
            false => Err(ErrorKind::Space),
        }
    }
}

impl Model {
    /// Bytes of decoded state that count against [`crate::Limits::state_bytes`].
    pub fn state_bytes(&self) -> u64 {
        self.parameters().state_bytes()
    }

    /// The name of the coding in the specification, such as `cells`.
    pub fn coding_name(&self) -> &'static str {
        let (kind, parameters) = self.parts();
        kind.descriptor().codings[usize::from(parameters.coding())]
    }

    /// Number of the coding in a track's entry.
    pub fn coding_number(&self) -> u16 {
        self.parameters().coding()
    }

    pub(crate) fn parameters(&self) -> &dyn Parameters {
        self.parts().1
    }
}

impl ModelStates {
    /// What all models keep of a track, whichever it is of.
    pub(crate) const TRACK_BYTES: usize = {
        let mut sum = 0;
        let mut index = 0;
        while index < ModelKind::ALL.len() {
            sum += ModelKind::ALL[index].descriptor().track_bytes;
            index += 1;
        }
        sum
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lists of the registry name every model, and tell all of them apart.
    #[test]
    fn models_have_their_own_numbers_and_names() {
        for (index, kind) in ModelKind::ALL.into_iter().enumerate() {
            assert_eq!(kind.index(), index);
            let descriptor = kind.descriptor();
            assert_eq!(ModelKind::of_number(descriptor.number), Ok(kind));
            assert_eq!(ModelKind::of_record(descriptor.record_type), Some(kind));
            let record = crate::container::record_type::name(descriptor.record_type);
            assert_eq!(record, kind.name());
            assert!(!descriptor.codings.is_empty() && !descriptor.spaces.is_empty());
        }
        assert_eq!(ModelKind::of_number(0), Err(ErrorKind::Model));
    }
}
