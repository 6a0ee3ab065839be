//! The models of the format, by their numbers, and what a track declares of them. A new model is one
//! more arm here, one more of `parts.rs`, and a module that answers.

use alloc::vec::Vec;

use crate::container::record_type;
use crate::error::Fault;
use crate::points::{self, Grid};
use crate::probes::{self, Volume};
use crate::wire::Reader;

/// Model of a track with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
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
pub(crate) enum Kind {
    Points,
    Probes,
}

impl Kind {
    /// The model of a number in a track's entry.
    pub(crate) fn of_number(number: u16) -> Result<Kind, Fault> {
        match number {
            1 => Ok(Kind::Points),
            2 => Ok(Kind::Probes),
            _ => Err(Fault::Model),
        }
    }

    pub(crate) fn number(self) -> u16 {
        match self {
            Kind::Points => 1,
            Kind::Probes => 2,
        }
    }

    /// The record that carries the content of the model.
    pub(crate) fn record_type(self) -> u16 {
        match self {
            Kind::Points => record_type::POINTS,
            Kind::Probes => record_type::PROBES,
        }
    }

    /// The model whose content a record carries; none for the records of the container.
    pub(crate) fn of_record(number: u16) -> Option<Kind> {
        match number {
            record_type::POINTS => Some(Kind::Points),
            record_type::PROBES => Some(Kind::Probes),
            _ => None,
        }
    }

    /// The model has a coding of this number.
    pub(crate) fn check_coding(self, coding: u16) -> Result<(), Fault> {
        let codings = match self {
            Kind::Points => points::CODINGS,
            Kind::Probes => probes::CODINGS,
        };
        if coding < codings {
            Ok(())
        } else {
            Err(Fault::Coding)
        }
    }

    /// A track of the model may be looked up in this space.
    pub(crate) fn check_space(self, space: LookupSpace) -> Result<(), Fault> {
        match (self, space) {
            (Kind::Probes, LookupSpace::Rest) => Err(Fault::Space),
            _ => Ok(()),
        }
    }

    /// The parameters of a track in a coding that [`Kind::check_coding`] took.
    pub(crate) fn read(self, coding: u16, reader: &mut Reader<'_>) -> Result<Model, Fault> {
        Ok(match self {
            Kind::Points => Model::Points(Grid::read(reader)?),
            Kind::Probes => Model::Probes(Volume::read(coding, reader)?),
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

    pub(crate) fn kind(&self) -> Kind {
        match self {
            Model::Points(_) => Kind::Points,
            Model::Probes(_) => Kind::Probes,
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
    pub(crate) fn check(&self) -> Result<(), Fault> {
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
