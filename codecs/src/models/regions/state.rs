//! The decoded state of all `regions` tracks: arrays that upload to a GPU as they are.

use alloc::vec::Vec;
use core::mem;

use bytemuck::cast_slice;

use super::{Form, Pair, Region, RegionSet};
use crate::dirty::{Buffer, Dirty, DirtyRange};
use crate::error::ErrorKind;
use crate::memory::reserve::{reserve_bounded, reserve_exact};
use crate::models::baked::BakedState;
use crate::session::track::TrackState;

/// What a region and a pair count against the limit of decoded state (`spec/regions.md` §3): as
/// committed and as the pending frame leaves them.
pub(super) const REGION_BYTES: u64 = 2 * size_of::<Region>() as u64;
pub(super) const PAIR_BYTES: u64 = 2 * size_of::<Pair>() as u64;

/// All regions, as of the last commit.
///
/// A track has an array of regions and one of the pairs that they name; both are empty where it has no
/// content, and are replaced as a whole.
#[derive(Default)]
pub struct State {
    /// Ids ascending.
    pub(super) sets: Vec<SetState>,
}

impl State {
    /// The regions of a track; none where the track is not of this state.
    pub fn regions_of(&self, track: &TrackState) -> &[Region] {
        self.of(track).map_or(&[], |set| &set.content.regions)
    }

    /// The pairs of a track; none where the track is not of this state.
    pub fn pairs_of(&self, track: &TrackState) -> &[Pair] {
        self.of(track).map_or(&[], |set| &set.content.pairs)
    }

    /// What changed since [`crate::Decoder::clear_dirty`]: both arrays of a track, whole.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        let changed = self.sets.iter().filter(|set| set.dirty);
        changed.flat_map(|set| {
            let dirty = |buffer, end: usize| Dirty {
                buffer,
                track: Some(set.id),
                range: DirtyRange {
                    start: 0,
                    end: end as u32,
                },
            };
            [
                dirty(Buffer::Regions, set.content.regions.len()),
                dirty(Buffer::RegionsPairs, set.content.pairs.len()),
            ]
        })
    }

    pub(super) fn of(&self, track: &TrackState) -> Option<&SetState> {
        Some(&self.sets[self.index_of(track.track.id)?])
    }

    pub(super) fn add_set(
        &mut self,
        id: u32,
        set: &RegionSet,
        limit: usize,
    ) -> Result<(), ErrorKind> {
        reserve_bounded(&mut self.sets, 1, limit)?;
        self.sets.push(SetState {
            id,
            set: *set,
            content: Arrays::reserved(set)?,
            next: Arrays::reserved(set)?,
            dirty: false,
        });
        Ok(())
    }
}

/// Regions and their pairs, with memory for as many as the track declares.
#[derive(Default)]
pub(super) struct Arrays {
    pub(super) regions: Vec<Region>,
    pub(super) pairs: Vec<Pair>,
}

impl Arrays {
    fn reserved(set: &RegionSet) -> Result<Arrays, ErrorKind> {
        let mut arrays = Arrays::default();
        reserve_exact(&mut arrays.regions, set.count as usize)?;
        reserve_exact(&mut arrays.pairs, set.capacity as usize)?;
        Ok(arrays)
    }

    /// Adds a region whose pairs are all 0.
    ///
    /// # Errors
    /// [`ErrorKind::RegionsCapacity`] where the track has no place for its pairs.
    pub(super) fn push(
        &mut self,
        set: &RegionSet,
        region: Region,
        form: Form,
    ) -> Result<(), ErrorKind> {
        let first = self.pairs.len();
        if first + form.pairs() > set.capacity as usize {
            return Err(ErrorKind::RegionsCapacity);
        }
        self.pairs.resize(first + form.pairs(), [0; 2]);
        self.regions.push(Region {
            first: first as u32,
            ..region
        });
        Ok(())
    }

    pub(super) fn clear(&mut self) {
        self.regions.clear();
        self.pairs.clear();
    }

    /// Bits, where `==` of floats takes -0 for 0.
    fn same(&self, other: &Arrays) -> bool {
        let regions = cast_slice::<_, u8>(&self.regions) == cast_slice::<_, u8>(&other.regions);
        regions && self.pairs == other.pairs
    }
}

/// The state of a track, and what the pending frame makes of it.
pub(super) struct SetState {
    pub(super) id: u32,
    pub(super) set: RegionSet,
    pub(super) content: Arrays,
    /// Empty where the pending frame has nothing for the track.
    pub(super) next: Arrays,
    dirty: bool,
}

impl SetState {
    /// Makes `next` the committed state. Returns steps of work.
    pub(super) fn apply(&mut self) -> u64 {
        let pairs = self.next.pairs.len() + self.content.pairs.len();
        if !self.next.same(&self.content) {
            mem::swap(&mut self.next, &mut self.content);
            self.dirty = true;
        }
        self.next.clear();
        (self.content.regions.len() + pairs / 16) as u64
    }

    /// There are no regions.
    pub(super) fn empty(&mut self) {
        self.dirty |= !self.content.regions.is_empty();
        self.content.clear();
    }

    pub(super) fn clear_dirty(&mut self) {
        self.dirty = false;
    }
}
