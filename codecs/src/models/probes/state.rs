//! The decoded state of all `probes` tracks: arrays that upload to a GPU as they are.

use alloc::vec::Vec;

use super::fill::Fill;
use super::packed::Mark;
use super::values::{Scales, values};
use super::{CODES, Coding, OPEN, Probe, TEXELS, Texel, Volume, maps};
use crate::dirty::{Buffer, Dirty, DirtyList, DirtyRange};
use crate::error::ErrorKind;
use crate::memory::index_set::IndexSet;
use crate::memory::reserve::{filled, reserve_bounded};
use crate::session::track::TrackState;

/// What a probe without its visibility counts against the limit of decoded state (`spec/probes.md`
/// §3): codes as committed and as the pending frame leaves them, texels, what the syntax remembers,
/// the distance of the fill, and a bit in each set. Of packed visibility there are two copies as well.
pub(super) const PROBE_BYTES: u64 = 184;
/// Sets of probes of a volume; each rounds its bits up to 8 bytes.
pub(super) const SETS: usize = 4 + Fill::SETS;
const _: () = assert!(
    2 * size_of::<Probe>() + TEXELS * size_of::<Texel>() + size_of::<Mark>() + 1 + SETS.div_ceil(8)
        <= PROBE_BYTES as usize
);
/// Dirty ranges of a volume.
pub(super) const MAX_DIRTY: usize = 8;

/// All volumes, as of the last commit.
///
/// A volume of N probes has 7 N texels in seven planes: texel t of probe p at `t * N + p`, and value
/// v of a probe (channel c of coefficient lm is `3 * lm + c`) is component `v % 4` of its texel
/// `v / 4`; the 28th is 0. So a plane is a 3D texture `rgba16float` of Dx x Dy x Dz, and all seven
/// stacked in depth are one. A shader multiplies by two to the volume's exponent.
///
/// Absent probes near present ones are filled in from those (`spec/probes.md` §8); others are 0.
#[derive(Default)]
pub struct State {
    /// Ids ascending.
    pub(super) volumes: Vec<VolumeState>,
}

impl State {
    /// The texels of a track; none where the track is not of this state.
    pub fn texels_of(&self, track: &TrackState) -> &[Texel] {
        self.of(track).map_or(&[], |volume| &volume.texels)
    }

    /// The probes of a track as they are coded; none where the track is not of this state.
    pub fn probes_of(&self, track: &TrackState) -> &[Probe] {
        self.of(track).map_or(&[], |volume| &volume.probes)
    }

    /// The visibility block of a track, where it has come: the octahedral maps of the probes, each by
    /// rows, of two bytes a texel: the mean of the distance and its deviation.
    pub fn visibility_of(&self, track: &TrackState) -> Option<&[u8]> {
        self.of(track)?.visibility()
    }

    /// What changed since [`crate::Decoder::clear_dirty`]. Texels: at most 8 ranges in each of the seven
    /// planes of a track, filled probes included, and all of them in a track that was added. Visibility: at
    /// most 8 ranges of whole maps, and an empty one where the block has gone.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        self.volumes.iter().flat_map(|volume| {
            let dirty = |buffer, start, end| Dirty {
                buffer,
                track: Some(volume.id),
                range: DirtyRange { start, end },
            };
            let count = volume.probes.len() as u32;
            let texels = (0..TEXELS as u32).flat_map(move |plane| {
                let ranges = volume.dirty.ranges().iter();
                ranges.map(move |range| {
                    let (start, end) = (plane * count + range.start, plane * count + range.end);
                    dirty(Buffer::ProbesTexels, start, end)
                })
            });
            let map_bytes = volume.map_bytes() as u32;
            let maps = volume.maps_dirty.ranges().iter().map(move |range| {
                let bytes = [range.start, range.end].map(|map| map.saturating_mul(map_bytes));
                dirty(Buffer::ProbesVisibility, bytes[0], bytes[1])
            });
            let gone = volume.maps_gone && !volume.has_maps;
            let gone = gone.then_some(dirty(Buffer::ProbesVisibility, 0, 0));
            texels.chain(maps.filter(|_| volume.has_maps)).chain(gone)
        })
    }

    pub(super) fn of(&self, track: &TrackState) -> Option<&VolumeState> {
        Some(&self.volumes[self.index_of(track.track.id)?])
    }

    pub(super) fn index_of(&self, id: u32) -> Option<usize> {
        self.volumes.binary_search_by_key(&id, |v| v.id).ok()
    }

    pub(super) fn get_mut(&mut self, id: u32) -> Option<&mut VolumeState> {
        let index = self.index_of(id)?;
        Some(&mut self.volumes[index])
    }

    pub(super) fn add(&mut self, id: u32, volume: &Volume, limit: usize) -> Result<(), ErrorKind> {
        reserve_bounded(&mut self.volumes, 1, limit)?;
        self.volumes.push(VolumeState::new(id, volume)?);
        Ok(())
    }
}

/// The state of a track, and what the pending frame makes of it.
pub(super) struct VolumeState {
    pub(super) id: u32,
    pub(super) volume: Volume,
    pub(super) probes: Vec<Probe>,
    /// All probes as the pending frame leaves them; as committed outside `touched`.
    pub(super) next: Vec<Probe>,
    /// Probes whose `next` was written.
    touched: IndexSet,
    /// Probes that the section in progress changes, and what is remembered of each. Empty and 0
    /// between sections.
    pub(super) changed: IndexSet,
    pub(super) marks: Vec<Mark>,
    /// Probes that are present in the committed state.
    pub(super) present: IndexSet,
    texels: Vec<Texel>,
    /// Its visibility block, as of the last frame that had one.
    visibility: Vec<u8>,
    /// The committed frame has that block.
    has_maps: bool,
    /// In the coding `packed`: the block as the pending frame leaves it; as `visibility` outside of
    /// `maps_touched`.
    next_visibility: Vec<u8>,
    /// Probes whose maps in `next_visibility` were written.
    maps_touched: IndexSet,
    fill: Fill,
    dirty: DirtyList,
    /// Probes whose maps changed.
    maps_dirty: DirtyList,
    /// The block went since dirty ranges were cleared.
    maps_gone: bool,
}

impl VolumeState {
    fn new(id: u32, volume: &Volume) -> Result<VolumeState, ErrorKind> {
        let count = volume.count();
        let map_bytes = volume.visibility_bytes() as usize;
        let next_bytes = match volume.coding {
            Coding::Raw => 0,
            Coding::Packed(_) => map_bytes,
        };
        let mut dirty = DirtyList::new(MAX_DIRTY)?;
        dirty.add(0, count as u32);
        Ok(VolumeState {
            id,
            volume: *volume,
            probes: filled(count, Probe::ABSENT)?,
            next: filled(count, Probe::ABSENT)?,
            touched: IndexSet::new(count)?,
            changed: IndexSet::new(count)?,
            marks: filled(count, 0)?,
            present: IndexSet::new(count)?,
            texels: filled(TEXELS * count, [0; 4])?,
            visibility: filled(map_bytes, 0)?,
            has_maps: false,
            next_visibility: filled(next_bytes, 0)?,
            maps_touched: IndexSet::new(count)?,
            fill: Fill::new(count)?,
            dirty,
            maps_dirty: DirtyList::new(MAX_DIRTY)?,
            maps_gone: false,
        })
    }

    pub(super) fn visibility(&self) -> Option<&[u8]> {
        self.has_maps.then_some(&self.visibility[..])
    }

    /// Bytes of a map.
    fn map_bytes(&self) -> usize {
        let side = usize::from(self.volume.visibility.side);
        2 * side * side
    }

    /// Takes over a visibility block of the coding `raw`.
    pub(super) fn set_visibility(&mut self, bytes: &[u8]) {
        if self.visibility() != Some(bytes) {
            self.visibility.copy_from_slice(bytes);
            self.maps_dirty.add(0, self.probes.len() as u32);
            self.has_maps = true;
        }
    }

    /// No maps are there.
    pub(super) fn drop_visibility(&mut self) {
        self.maps_gone |= self.has_maps;
        self.has_maps = false;
        self.maps_dirty.clear();
    }

    /// The maps that a section of the coding `packed` changes, with their priors in place: those of the
    /// last frame, or open ones.
    pub(super) fn begin_maps(&mut self, keyframe: bool) -> maps::Walk<'_> {
        let intra = keyframe || !self.has_maps;
        if intra {
            self.next_visibility.as_chunks_mut().0.fill(OPEN);
            (0..self.probes.len()).for_each(|probe| {
                self.maps_touched.insert(probe);
            });
        }
        maps::Walk {
            maps: self.next_visibility.as_chunks_mut().0,
            intra,
            changed: &mut self.changed,
        }
    }

    /// The maps of a section were read, to their end or to a fault.
    pub(super) fn end_maps(&mut self) {
        let changed = &self.changed;
        changed.each(|probe| {
            self.maps_touched.insert(probe);
        });
        self.changed.clear();
    }

    /// The visibility block as the pending frame leaves it.
    pub(super) fn next_visibility(&self) -> &[u8] {
        &self.next_visibility
    }

    /// Makes `next_visibility` the committed state. Returns how many bytes were looked at.
    pub(super) fn apply_maps(&mut self) -> u64 {
        let size = self.map_bytes();
        let mut touched = 0;
        let had = core::mem::replace(&mut self.has_maps, true);
        self.maps_touched.each(|probe| {
            let map = probe * size..(probe + 1) * size;
            let next = &self.next_visibility[map.clone()];
            touched += 1;
            if !had || self.visibility[map.clone()] != *next {
                self.visibility[map].copy_from_slice(next);
                self.maps_dirty.add_one(probe);
            }
        });
        self.maps_touched.clear();
        self.maps_dirty.merge();
        touched * size as u64
    }

    /// The pending frame starts with all probes absent.
    pub(super) fn start_empty(&mut self) {
        self.present.each(|probe| {
            self.next[probe] = Probe::ABSENT;
            self.touched.insert(probe);
        });
    }

    /// A section was read, to its end or to a fault.
    pub(super) fn end_section(&mut self) {
        self.changed.each(|probe| {
            self.marks[probe] = 0;
            self.touched.insert(probe);
        });
        self.changed.clear();
    }

    /// Drops what the pending frame made of the probes.
    pub(super) fn rollback(&mut self) {
        self.touched
            .each(|probe| self.next[probe] = self.probes[probe]);
        self.touched.clear();
        let size = self.map_bytes();
        self.maps_touched.each(|probe| {
            let map = probe * size..(probe + 1) * size;
            self.next_visibility[map.clone()].copy_from_slice(&self.visibility[map]);
        });
        self.maps_touched.clear();
    }

    /// Makes `next` the committed state, and its texels with it. Returns how many probes were
    /// looked at, those of the fill included.
    pub(super) fn apply(&mut self) -> u64 {
        let scales = match self.volume.coding {
            Coding::Raw => None,
            Coding::Packed(steps) => Some(Scales::new(&steps)),
        };
        let count = self.probes.len();
        let mut steps = 0;
        self.touched.each(|index| {
            steps += 1;
            let probe = self.next[index];
            let old = core::mem::replace(&mut self.probes[index], probe);
            if probe == old {
                return;
            }
            match (probe.level > 0, old.level > 0) {
                (true, false) => {
                    self.present.insert(index);
                    self.fill.came_or_went(index);
                }
                (false, true) => {
                    self.present.remove(index);
                    self.fill.came_or_went(index);
                }
                _ => {}
            }
            if probe.level > 0 {
                let values = match &scales {
                    None => probe.codes.map(|code| code as u16),
                    Some(scales) => values(scales, &probe),
                };
                put_texels(&mut self.texels, count, index, &values);
                self.fill.changed(index);
                self.dirty.add_one(index);
            }
        });
        self.touched.clear();
        let VolumeState {
            fill,
            probes,
            texels,
            dirty,
            ..
        } = self;
        let dims = self.volume.dims;
        steps += fill.update(dims, probes, texels, |probe| dirty.add_one(probe));
        dirty.merge();
        steps
    }

    /// No probe is there, and no visibility.
    pub(super) fn empty(&mut self) -> u64 {
        self.start_empty();
        self.drop_visibility();
        self.apply()
    }

    pub(super) fn clear_dirty(&mut self) {
        self.dirty.clear();
        self.maps_dirty.clear();
        self.maps_gone = false;
    }
}

#[inline]
fn put_texels(texels: &mut [Texel], count: usize, probe: usize, values: &[u16; CODES]) {
    for (t, texel) in texels[probe..].iter_mut().step_by(count).enumerate() {
        *texel = core::array::from_fn(|c| values.get(4 * t + c).copied().unwrap_or(0));
    }
}
