//! The parts of all models, as a session holds them.

use crate::model::Kind;
use crate::part::Part;
use crate::{points, probes};

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
