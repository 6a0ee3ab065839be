//! The decoded state of all `probes` tracks: arrays that upload to a GPU as they are.

use alloc::vec::Vec;

use super::fill::Fill;
use super::packed::Mark;
use super::values::{Scales, values};
use super::{CODES, Coding, Probe, TEXELS, Texel, Volume};
use crate::dirty::DirtyRange;
use crate::room::make_room;
use crate::track::LiveTrack;

/// Bytes of state of a probe without its visibility: codes as committed and as the frame in the
/// making leaves them, texels, what the syntax remembers, and the order of the fill.
pub(super) const PROBE_BYTES: u64 = (2 * size_of::<Probe>()
    + TEXELS * size_of::<Texel>()
    + size_of::<Mark>()
    + 2 * size_of::<u32>()) as u64;

/// All volumes, as of the last commit.
///
/// A volume of N probes has 7 N texels in seven planes: texel t of probe p at `t * N + p`, and value
/// v of a probe (channel c of coefficient lm is `3 * lm + c`) is component `v % 4` of its texel
/// `v / 4`; the 28th is 0. So a plane is a 3D texture `rgba16float` of Dx x Dy x Dz, and all seven
/// stacked in depth are one. A shader multiplies by two to the volume's exponent.
///
/// Absent probes are filled in from the present ones about them.
#[derive(Default)]
pub struct State {
    /// Ids ascending.
    pub(super) volumes: Vec<VolumeState>,
}

impl State {
    /// The texels of a track; none where the track is not of this state.
    pub fn texels_of(&self, live: &LiveTrack) -> &[Texel] {
        self.of(live).map_or(&[], |volume| &volume.texels)
    }

    /// The probes of a track as they are coded; none where the track is not of this state.
    pub fn probes_of(&self, live: &LiveTrack) -> &[Probe] {
        self.of(live).map_or(&[], |volume| &volume.probes)
    }

    /// The visibility block of a track, where it has come: the octahedral maps of the probes, each by
    /// rows, of two bytes a texel: the mean of the distance and its deviation.
    pub fn visibility_of(&self, live: &LiveTrack) -> Option<&[u8]> {
        let volume = self.of(live)?;
        volume.has_visibility().then_some(&volume.visibility[..])
    }

    /// Probes of a track whose texels changed since [`crate::Decoder::clear_dirty`], the same in each
    /// of the seven planes. All of them in a track that was added.
    pub fn dirty_of(&self, live: &LiveTrack) -> Option<DirtyRange> {
        self.of(live)?.dirty
    }

    /// The visibility block of a track came, went or changed since [`crate::Decoder::clear_dirty`].
    pub fn visibility_dirty_of(&self, live: &LiveTrack) -> bool {
        self.of(live).is_some_and(|volume| volume.visibility_dirty)
    }

    fn of(&self, live: &LiveTrack) -> Option<&VolumeState> {
        Some(&self.volumes[self.index_of(live.track.id)?])
    }

    pub(super) fn index_of(&self, id: u32) -> Option<usize> {
        self.volumes.binary_search_by_key(&id, |v| v.id).ok()
    }

    pub(super) fn get_mut(&mut self, id: u32) -> Option<&mut VolumeState> {
        let index = self.index_of(id)?;
        Some(&mut self.volumes[index])
    }

    pub(super) fn add(&mut self, id: u32, volume: &Volume, limit: usize) {
        make_room(&mut self.volumes, 1, limit);
        self.volumes.push(VolumeState::new(id, volume));
    }
}

/// The state of a track, and the frame in the making.
pub(super) struct VolumeState {
    pub(super) id: u32,
    pub(super) volume: Volume,
    pub(super) probes: Vec<Probe>,
    /// All probes as the frame in the making leaves them, once its content has come.
    pub(super) next: Vec<Probe>,
    pub(super) marks: Vec<Mark>,
    texels: Vec<Texel>,
    /// Empty, or all of it.
    visibility: Vec<u8>,
    fill: Fill,
    dirty: Option<DirtyRange>,
    visibility_dirty: bool,
}

impl VolumeState {
    fn new(id: u32, volume: &Volume) -> VolumeState {
        let count = volume.count();
        // Exact: the limit counts it so.
        fn zeros<T: Clone>(count: usize, zero: T) -> Vec<T> {
            let mut items = Vec::new();
            items.reserve_exact(count);
            items.resize(count, zero);
            items
        }
        let mut visibility = Vec::new();
        visibility.reserve_exact(volume.visibility_bytes() as usize);
        VolumeState {
            id,
            volume: *volume,
            probes: zeros(count, Probe::ABSENT),
            next: zeros(count, Probe::ABSENT),
            marks: zeros(count, 0),
            texels: zeros(TEXELS * count, [0; 4]),
            visibility,
            fill: Fill::with_room(count),
            dirty: Some(DirtyRange {
                start: 0,
                end: count as u32,
            }),
            visibility_dirty: true,
        }
    }

    pub(super) fn has_visibility(&self) -> bool {
        !self.visibility.is_empty()
    }

    pub(super) fn visibility(&self) -> Option<&[u8]> {
        self.has_visibility().then_some(&self.visibility[..])
    }

    /// Takes over a visibility block, or none.
    pub(super) fn set_visibility(&mut self, bytes: Option<&[u8]>) {
        if self.visibility() != bytes {
            self.visibility.clear();
            self.visibility.extend_from_slice(bytes.unwrap_or(&[]));
            self.visibility_dirty = true;
        }
    }

    /// Makes `next` the committed state, and its texels with it.
    pub(super) fn apply(&mut self) {
        core::mem::swap(&mut self.probes, &mut self.next);
        let scales = match self.volume.coding {
            Coding::Raw => None,
            Coding::Packed(steps) => Some(Scales::new(&steps)),
        };
        let (mut first, mut end) = (usize::MAX, 0);
        let mut other_places = false;
        for (index, (probe, old)) in self.probes.iter().zip(&self.next).enumerate() {
            if probe == old {
                continue;
            }
            first = first.min(index);
            end = index + 1;
            other_places |= (probe.level == 0) != (old.level == 0);
            let values = match &scales {
                None => probe.codes.map(|code| code as u16),
                Some(scales) => values(scales, probe),
            };
            put_texels(&mut self.texels, self.probes.len(), index, &values);
        }
        if end == 0 {
            return;
        }
        if other_places {
            self.fill.find(self.volume.dims, &self.probes);
        }
        if !self.fill.is_empty() {
            self.fill.write(self.volume.dims, &mut self.texels);
            (first, end) = (0, self.probes.len());
        }
        self.touch(first as u32, end as u32);
    }

    /// No probe is there, and no visibility.
    pub(super) fn empty(&mut self) {
        self.probes.fill(Probe::ABSENT);
        self.texels.fill([0; 4]);
        self.fill.find(self.volume.dims, &self.probes);
        self.set_visibility(None);
        self.touch(0, self.probes.len() as u32);
    }

    fn touch(&mut self, start: u32, end: u32) {
        let dirty = self.dirty.get_or_insert(DirtyRange { start, end });
        dirty.start = dirty.start.min(start);
        dirty.end = dirty.end.max(end);
    }

    pub(super) fn clear_dirty(&mut self) {
        self.dirty = None;
        self.visibility_dirty = false;
    }
}

#[inline]
fn put_texels(texels: &mut [Texel], count: usize, probe: usize, values: &[u16; CODES]) {
    for (t, texel) in texels[probe..].iter_mut().step_by(count).enumerate() {
        *texel = core::array::from_fn(|c| values.get(4 * t + c).copied().unwrap_or(0));
    }
}
