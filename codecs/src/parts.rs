//! The parts of all models, as a session holds them.

use crate::model::ModelKind;
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

    pub(crate) fn of(&self, kind: ModelKind) -> &dyn Part {
        match kind {
            ModelKind::Points => &self.points,
            ModelKind::Probes => &self.probes,
        }
    }

    pub(crate) fn of_mut(&mut self, kind: ModelKind) -> &mut dyn Part {
        match kind {
            ModelKind::Points => &mut self.points,
            ModelKind::Probes => &mut self.probes,
        }
    }

    pub(crate) fn all(&mut self) -> [&mut dyn Part; 2] {
        [&mut self.points, &mut self.probes]
    }
}
