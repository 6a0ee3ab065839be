//! The section of a track in a `vertices` record, read: values that are decoded beside the committed
//! ones, and copied over them at the commit.

use super::state::{Place, Plan};
use super::{State, sections};
use crate::error::ErrorKind;
use crate::models::ModelKind;
use crate::models::baked::{BakedState, BakedStore, Content, Staged};
use crate::models::payload_header::ShapeErrors;
use crate::session::digest::StateDigest;
use crate::session::track::Track;

/// The state of the model, and what the pending frame has for it.
pub(crate) type Store = BakedStore<State>;

/// What is kept of a track beside its values.
pub(super) const TRACK_BYTES: usize = size_of::<Place>() + size_of::<Staged>();

impl BakedState for State {
    const MODEL: ModelKind = ModelKind::Vertices;
    const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
        size: ErrorKind::VerticesSize,
        reserved: ErrorKind::VerticesReserved,
    };
    type Plan = Plan;

    fn plan(&self, tracks: &[Track]) -> Result<(Plan, Option<u64>), ErrorKind> {
        self.plan_places(tracks)
    }

    fn add(&mut self, tracks: &[Track], plan: Plan, max_tracks: usize) -> Result<(), ErrorKind> {
        self.add_places(tracks, plan, max_tracks)
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.remove_places(removed);
    }

    fn index_of(&self, id: u32) -> Option<usize> {
        self.places.binary_search_by_key(&id, |place| place.id).ok()
    }

    fn id_of(&self, index: usize) -> u32 {
        self.places[index].id
    }

    fn read(&mut self, index: usize, section: &[u8], work: &mut u64) -> Result<(), ErrorKind> {
        let place = &self.places[index];
        if section.len() as u64 != sections::bytes(&place.vertices) {
            return Err(ErrorKind::VerticesSize);
        }
        *work += place.work();
        sections::read(&place.vertices, section, &mut self.next[place.values()])
    }

    /// Values that are decoded again are written over.
    fn discard(&mut self, _index: usize) {}

    fn apply(&mut self, index: usize, work: &mut u64) -> u32 {
        let place = &self.places[index];
        let count = place.vertices.count;
        *work += place.work();
        let values = place.values();
        let (now, next) = (&mut self.values[values.clone()], &self.next[values]);
        if now != next {
            now.copy_from_slice(next);
            self.touch(index);
        }
        count
    }

    fn empty(&mut self, index: usize, work: &mut u64) {
        *work += self.places[index].work();
        self.open(index);
    }

    fn end_commit(&mut self) {
        self.dirty.merge();
    }

    fn digest(&self, index: usize, content: Content, digest: &mut StateDigest) {
        let place = &self.places[index];
        match content {
            Content::Pending => digest.bytes(&self.next[place.values()]),
            Content::None => digest.open_values(place.vertices.values()),
            Content::Committed => digest.bytes(&self.values[place.values()]),
        }
    }

    fn clear_dirty(&mut self) {
        self.dirty.clear();
    }
}
