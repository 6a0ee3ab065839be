//! The models of the format, by their numbers, and what a session asks of each of them. A new model
//! is one more arm here and a module that answers.

use alloc::vec::Vec;
use core::ops::Range;

use crate::container::record_type;
use crate::content::Base;
use crate::digest::StateDigest;
use crate::error::Fault;
use crate::points::{self, Grid};
use crate::probes::{self, Volume};
use crate::records::FrameInfo;
use crate::track::{LiveTrack, LookupSpace, Track};
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

/// What a session asks of a model: its tracks are known by their ids, and its content comes in
/// payloads of the frame in the making.
pub(crate) trait Part {
    /// Plans room for tracks, those of other models left out. Returns the bytes of decoded state
    /// that there will be, or none where there are more items than indices count.
    fn plan(&mut self, tracks: &[Track]) -> Option<u64>;

    /// Takes in the tracks of the last plan, empty. The model may have `most` bytes of state, which
    /// the plan is within, and `limit` tracks.
    fn add(&mut self, tracks: &[Track], most: u64, limit: usize);

    /// Forgets a track and gives its room back.
    fn remove(&mut self, id: u32);

    /// Empties a track.
    fn empty(&mut self, id: u32);

    /// The frame in the making starts with a track empty.
    fn expect_nothing(&mut self, id: u32);

    /// Checks a payload and keeps what is in it. `frame` has all payloads of the frame in the
    /// making. Marks tracks as staged. After a fault the caller must revert the frame.
    fn stage(
        &mut self,
        frame: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [LiveTrack],
    ) -> Result<(), Fault>;

    /// Drops the frame in the making.
    fn revert(&mut self, emptied: bool, tracks: &[LiveTrack]);

    /// All content of the frame is there: [`Part::digest_staged`] and [`Part::apply`] come.
    fn seal(&mut self);

    /// Writes the frame into the state, and counts what is in it.
    fn apply(&mut self, frame: &[u8], info: &mut FrameInfo);

    /// Adds a track's committed content to `digest`.
    fn digest(&self, id: u32, digest: &mut StateDigest);

    /// Adds a track's content to `digest` as it will be after the frame.
    fn digest_staged(&self, id: u32, frame: &[u8], emptied: bool, digest: &mut StateDigest);

    /// The frame is in the state, with tracks removed.
    fn settle(&mut self);

    /// What changed has been uploaded.
    fn clear_dirty(&mut self);

    /// Forgets all tracks.
    fn reset(&mut self);
}

/// One part for each model.
#[derive(Default)]
pub(crate) struct Parts {
    pub(crate) points: points::Part,
    pub(crate) probes: probes::Part,
}

impl Parts {
    /// What all parts keep of a track.
    pub(crate) const TRACK_BYTES: usize = points::Part::TRACK_BYTES + probes::Part::TRACK_BYTES;

    pub(crate) fn of(&self, kind: Kind) -> &dyn Part {
        match kind {
            Kind::Points => &self.points,
            Kind::Probes => &self.probes,
        }
    }

    pub(crate) fn of_mut(&mut self, kind: Kind) -> &mut dyn Part {
        match kind {
            Kind::Points => &mut self.points,
            Kind::Probes => &mut self.probes,
        }
    }

    pub(crate) fn all(&mut self) -> [&mut dyn Part; 2] {
        [&mut self.points, &mut self.probes]
    }
}
