//! The models of the format, by their numbers, and what a track declares of them. A new model is one
//! more arm here, one more of `parts.rs`, and a module that answers.

use alloc::vec::Vec;

use crate::container::record_type;
use crate::error::ErrorKind;
use crate::points::{self, Grid};
use crate::probes::{self, Volume};
use crate::wire::Reader;

/// Model of a track with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Model {
    /// `points` in the coding `cells`.
    Points(Grid),
    /// `probes` in the coding `raw` or `packed`.
    Probes(Volume),
}

/// The space that a fragment is looked up in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LookupSpace {
    /// Mesh space as drawn: rigid, or posed by the server.
    Mesh,
    /// Rest pose: the fragment passes its rest position and rest normal.
    Rest,
}

/// A model without parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ModelKind {
    Points,
    Probes,
}

impl ModelKind {
    /// The model of a number in a track's entry.
    pub(crate) fn of_number(number: u16) -> Result<ModelKind, ErrorKind> {
        match number {
            1 => Ok(ModelKind::Points),
            2 => Ok(ModelKind::Probes),
            _ => Err(ErrorKind::Model),
        }
    }

    pub(crate) fn number(self) -> u16 {
        match self {
            ModelKind::Points => 1,
            ModelKind::Probes => 2,
        }
    }

    /// The record that carries the content of the model.
    pub(crate) fn record_type(self) -> u16 {
        match self {
            ModelKind::Points => record_type::POINTS,
            ModelKind::Probes => record_type::PROBES,
        }
    }

    /// The model whose content a record carries; none for the records of the container.
    pub(crate) fn of_record(number: u16) -> Option<ModelKind> {
        match number {
            record_type::POINTS => Some(ModelKind::Points),
            record_type::PROBES => Some(ModelKind::Probes),
            _ => None,
        }
    }

    /// The model has a coding of this number.
    pub(crate) fn check_coding(self, coding: u16) -> Result<(), ErrorKind> {
        let codings = match self {
            ModelKind::Points => points::CODINGS,
            ModelKind::Probes => probes::CODINGS,
        };
        if coding < codings {
            Ok(())
        } else {
            Err(ErrorKind::Coding)
        }
    }

    /// A track of the model may be looked up in this space.
    pub(crate) fn check_space(self, space: LookupSpace) -> Result<(), ErrorKind> {
        match (self, space) {
            (ModelKind::Probes, LookupSpace::Rest) => Err(ErrorKind::Space),
            _ => Ok(()),
        }
    }

    /// The parameters of a track in a coding that [`ModelKind::check_coding`] took.
    pub(crate) fn read(self, coding: u16, reader: &mut Reader<'_>) -> Result<Model, ErrorKind> {
        Ok(match self {
            ModelKind::Points => Model::Points(Grid::read(reader)?),
            ModelKind::Probes => Model::Probes(Volume::read(coding, reader)?),
        })
    }
}

impl Model {
    /// Bytes of decoded state that count against [`crate::Limits::state_bytes`].
    pub fn state_bytes(&self) -> u64 {
        match self {
            Model::Points(grid) => {
                points::state_bytes(grid.bucket_count.into(), grid.cell_capacity.into())
            }
            Model::Probes(volume) => probes::state_bytes(volume),
        }
    }

    pub(crate) fn kind(&self) -> ModelKind {
        match self {
            Model::Points(_) => ModelKind::Points,
            Model::Probes(_) => ModelKind::Probes,
        }
    }

    /// Number of the coding.
    pub(crate) fn coding(&self) -> u16 {
        match self {
            Model::Points(_) => 0,
            Model::Probes(volume) => volume.coding_number(),
        }
    }

    /// The rules that hold for the parameters by themselves.
    pub(crate) fn check(&self) -> Result<(), ErrorKind> {
        match self {
            Model::Points(grid) => grid.check(),
            Model::Probes(volume) => volume.check(),
        }
    }

    /// Appends the parameters.
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        match self {
            Model::Points(grid) => grid.write(out),
            Model::Probes(volume) => volume.write(out),
        }
    }
}
