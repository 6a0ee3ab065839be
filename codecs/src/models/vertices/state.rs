//! The decoded state of all `vertices` tracks: one array that uploads to a GPU as it is.

use alloc::vec::Vec;
use core::ops::Range;

use super::Vertices;
use crate::dirty::{Buffer, Dirty, DirtyList};
use crate::error::ErrorKind;
use crate::memory::free_ranges::FreeRanges;
use crate::memory::reserve::{reserve_bounded, reserve_exact};
use crate::models::baked::BakedState;
use crate::session::track::{Track, TrackState};

/// Dirty ranges of the array.
const MAX_DIRTY: usize = 256;
/// Value of a vertex without content: open.
pub(super) const OPEN: u8 = 255;

/// Where a track lies in the array.
pub(super) struct Place {
    pub(super) id: u32,
    pub(super) vertices: Vertices,
    /// Its first byte, a multiple of 4.
    pub(super) first: u32,
}

impl Place {
    /// Its values in the array.
    pub(super) fn values(&self) -> Range<usize> {
        let first = self.first as usize;
        first..first + self.vertices.values()
    }

    /// Steps of work of writing all of it ([`crate::Decoder::work`]).
    pub(super) fn work(&self) -> u64 {
        self.vertices.values() as u64 / 64 + 1
    }
}

/// Where planned tracks will lie.
pub(crate) struct Plan {
    firsts: Vec<u32>,
    free: FreeRanges,
    end: u64,
}

/// All values of all tracks, as of the last commit.
///
/// A value is a byte, 0 fully occluded and 255 open. The one or two signals of a vertex stand side by side,
/// vertices in the order that the track says; a track starts at a multiple of four bytes
/// ([`State::first_of`]). So a track is a vertex attribute `unorm8` or, with two signals, `unorm8x2`, and the
/// array a storage buffer of `u32`. A track without content is open.
#[derive(Default)]
pub struct State {
    pub(super) values: Vec<u8>,
    /// Values as the pending frame leaves them, of the tracks that are in it.
    pub(super) next: Vec<u8>,
    /// Ids ascending.
    pub(super) places: Vec<Place>,
    free: FreeRanges,
    pub(super) dirty: DirtyList,
}

impl State {
    /// Values of all tracks, with up to three bytes of padding after each.
    pub fn values(&self) -> &[u8] {
        &self.values
    }

    /// The values of a track; none where the track is not of this state.
    pub fn values_of(&self, track: &TrackState) -> &[u8] {
        self.place_of(track)
            .map_or(&[], |place| &self.values[place.values()])
    }

    /// Index of a track's first value in [`State::values`]; none where the track is not of this state.
    pub fn first_of(&self, track: &TrackState) -> Option<u32> {
        Some(self.place_of(track)?.first)
    }

    /// What changed since [`crate::Decoder::clear_dirty`], at most 256 ranges. A track that was added or
    /// removed counts as changed.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        self.dirty.ranges().iter().map(|&range| Dirty {
            buffer: Buffer::VerticesValues,
            track: None,
            range,
        })
    }

    pub(super) fn place_of(&self, track: &TrackState) -> Option<&Place> {
        Some(&self.places[self.index_of(track.track.id)?])
    }

    /// Plans places for the tracks of the model. Returns the bytes of state with them too, or none
    /// where there are more values than indices count.
    pub(super) fn plan_places(&self, tracks: &[Track]) -> Result<(Plan, Option<u64>), ErrorKind> {
        let mut firsts = Vec::new();
        reserve_exact(&mut firsts, tracks.len())?;
        // Each track gives one range back when it is removed.
        let most = self.places.len() + tracks.len();
        let mut plan = Plan {
            firsts,
            free: self.free.copy(most)?,
            end: self.values.len() as u64,
        };
        for (_, vertices) in of_model(tracks) {
            let bytes = region_bytes(vertices);
            let first = plan.free.take(bytes).unwrap_or_else(|| {
                let first = plan.end;
                plan.end += u64::from(bytes);
                first as u32
            });
            plan.firsts.push(first);
        }
        let bytes = 2 * plan.end;
        let counted = plan.end <= u64::from(u32::MAX);
        Ok((plan, counted.then_some(bytes)))
    }

    /// Takes in the tracks of a plan, open. There may be `limit` tracks.
    pub(super) fn add_places(
        &mut self,
        tracks: &[Track],
        plan: Plan,
        limit: usize,
    ) -> Result<(), ErrorKind> {
        // Exact: an array that doubled would break the promise of the limit.
        let end = plan.end as usize;
        let more = end - self.values.len();
        reserve_exact(&mut self.values, more)?;
        reserve_exact(&mut self.next, more)?;
        reserve_bounded(&mut self.places, plan.firsts.len(), limit)?;
        self.dirty.reserve(MAX_DIRTY)?;
        // From here on nothing fails.
        self.free = plan.free;
        self.values.resize(end, OPEN);
        self.next.resize(end, OPEN);
        for ((id, vertices), first) in of_model(tracks).zip(plan.firsts) {
            let vertices = *vertices;
            self.places.push(Place {
                id,
                vertices,
                first,
            });
            self.touch(self.places.len() - 1);
        }
        self.dirty.merge();
        Ok(())
    }

    /// Opens the tracks that `removed` picks by their ids, and frees their places.
    pub(super) fn remove_places(&mut self, removed: impl Fn(u32) -> bool) {
        for index in 0..self.places.len() {
            if removed(self.places[index].id) {
                self.open(index);
                let place = &self.places[index];
                self.free.give(place.first, region_bytes(&place.vertices));
            }
        }
        self.places.retain(|place| !removed(place.id));
        self.free.merge();
    }

    /// All values of a track become open.
    pub(super) fn open(&mut self, index: usize) {
        let place = &self.places[index];
        self.values[place.values()].fill(OPEN);
        self.touch(index);
    }

    /// The whole of a track is dirty, with its padding.
    pub(super) fn touch(&mut self, index: usize) {
        let place = &self.places[index];
        let end = place.first + region_bytes(&place.vertices);
        self.dirty.add(place.first, end);
    }
}

/// Bytes that a track takes in the array.
pub(super) fn region_bytes(vertices: &Vertices) -> u32 {
    let values = vertices.values() as u64;
    values.next_multiple_of(4).min(u32::MAX.into()) as u32
}

/// The tracks of the model, with their ids.
fn of_model(tracks: &[Track]) -> impl Iterator<Item = (u32, &Vertices)> {
    tracks
        .iter()
        .filter_map(|track| Some((track.id, track.vertices()?)))
}
