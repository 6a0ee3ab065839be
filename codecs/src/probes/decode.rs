//! The payload of a `probes` record, read: decoded when it comes into codes beside the committed
//! ones, and turned into texels at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::mem;
use core::ops::Range;

use super::state::{MAX_DIRTY, PROBE_BYTES, SETS, VolumeState};
use super::values::Scales;
use super::{Coding, State, Volume, contexts, packed, raw};
use crate::content::{Base, Head, ShapeErrors};
use crate::digest::StateDigest;
use crate::dirty::DirtyRange;
use crate::entropy;
use crate::error::ErrorKind;
use crate::frame::FrameInfo;
use crate::model::{Model, ModelKind};
use crate::part;
use crate::reserve::reserve_bounded;
use crate::track::{LiveTrack, Track};

const FAULTS: ShapeErrors = ShapeErrors {
    size: ErrorKind::ProbesSize,
    reserved: ErrorKind::ProbesReserved,
};
/// Flag of a track in a record: its visibility block follows.
pub(super) const HAS_VISIBILITY: u32 = 1;

/// Steps of work of a probe whose texels are computed.
const PROBE_WORK: u64 = 8;

/// Steps of work of a section that changes some of a volume's probes: those, and a look at its sets.
fn section_work(probes: usize, changed: u32) -> u64 {
    32 * u64::from(changed) + probes as u64 / 512 + 1
}

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Part {
    pub(crate) state: State,
    staged: Vec<Staged>,
    work: u64,
}

/// A track of the pending frame, whose probes are decoded.
struct Staged {
    /// Index in the state's list of volumes.
    index: usize,
    keyframe: bool,
    /// Where its visibility block lies in the frame's payloads.
    visibility: Option<Range<usize>>,
    changed: u32,
}

impl Part {
    /// What is kept of a track beside its arrays: dirty ranges, and what its sets round up, too.
    pub(crate) const TRACK_BYTES: usize = size_of::<VolumeState>()
        + size_of::<Staged>()
        + 4 * MAX_DIRTY * size_of::<DirtyRange>()
        + 8 * SETS;

    fn find_staged(&self, index: usize) -> Option<&Staged> {
        let at = self.staged.binary_search_by_key(&index, |s| s.index);
        Some(&self.staged[at.ok()?])
    }
}

/// The tracks of the model, with their ids.
fn volumes(tracks: &[Track]) -> impl Iterator<Item = (u32, &Volume)> {
    tracks.iter().filter_map(|track| match &track.model {
        Model::Probes(volume) => Some((track.id, volume)),
        _ => None,
    })
}

/// Bytes that count against the limit of decoded state.
pub(crate) fn state_bytes(volume: &Volume) -> u64 {
    volume.count() as u64 * PROBE_BYTES + volume.visibility_bytes()
}

impl part::Part for Part {
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind> {
        let there = self.state.volumes.iter().map(|v| &v.volume);
        let all = there.chain(volumes(tracks).map(|(_, volume)| volume));
        let bytes = all.fold(0u64, |sum, volume| sum.saturating_add(state_bytes(volume)));
        Ok(usize::try_from(bytes).is_ok().then_some(bytes))
    }

    fn add(&mut self, tracks: &[Track], _most: u64, limit: usize) -> Result<(), ErrorKind> {
        volumes(tracks).try_for_each(|(id, volume)| self.state.add(id, volume, limit))
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.volumes.retain(|volume| !removed(volume.id));
    }

    fn empty(&mut self, id: u32) {
        if let Some(volume) = self.state.get_mut(id) {
            self.work += PROBE_WORK * volume.empty();
        }
    }

    fn expect_nothing(&mut self, _id: u32) {}

    fn stage(
        &mut self,
        frame: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [LiveTrack],
    ) -> Result<(), ErrorKind> {
        let payload_bytes = &frame[payload.clone()];
        let mut head = Head::read(payload_bytes, base, FAULTS)?;
        let mut at = head.bytes();
        for i in 0..head.count {
            let entry = head.entry(payload_bytes, i, ModelKind::Probes, tracks)?;
            let [size, flags] = entry.numbers;
            let index = self
                .state
                .index_of(entry.id)
                .ok_or(ErrorKind::UnknownTrack)?;
            let volume = &mut self.state.volumes[index];
            let visibility_bytes = volume.volume.visibility_bytes();
            if flags > HAS_VISIBILITY || (flags == HAS_VISIBILITY && visibility_bytes == 0) {
                return Err(ErrorKind::ProbesReserved);
            }
            let section = payload_bytes[at..].get(..size as usize);
            let section = section.ok_or(ErrorKind::ProbesSize)?;
            let mut probes = section;
            let mut visibility = None;
            if flags == HAS_VISIBILITY {
                if visibility_bytes > u64::from(size) {
                    return Err(ErrorKind::ProbesSize);
                }
                let bytes = visibility_bytes as usize;
                probes = &section[bytes..];
                let start = payload.start + at;
                visibility = Some(start..start + bytes);
            }
            at += section.len();
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            let changed = decode(probes, volume, head.keyframe);
            // Kept before the result is looked at, so that a fault reverts it.
            tracks[entry.slot].staged = true;
            self.staged.push(Staged {
                index,
                keyframe: head.keyframe,
                visibility,
                changed: *changed.as_ref().unwrap_or(&0),
            });
            self.work += section_work(volume.volume.count(), changed?);
        }
        if at != payload_bytes.len() {
            return Err(ErrorKind::ProbesSize);
        }
        Ok(())
    }

    fn staged(&self) -> usize {
        self.staged.len()
    }

    fn unstage(&mut self, kept: usize, _emptied: bool, tracks: &mut [LiveTrack]) {
        for staged in self.staged.drain(kept..) {
            let volume = &mut self.state.volumes[staged.index];
            volume.revert();
            let id = volume.id;
            if let Ok(slot) = tracks.binary_search_by_key(&id, |live| live.track.id) {
                tracks[slot].staged = false;
            }
        }
    }

    fn revert(&mut self, _emptied: bool, _tracks: &[LiveTrack]) {
        for staged in self.staged.drain(..) {
            self.state.volumes[staged.index].revert();
        }
    }

    fn seal(&mut self) {
        self.staged.sort_unstable_by_key(|staged| staged.index);
    }

    fn apply(&mut self, frame: &[u8], info: &mut FrameInfo) {
        for staged in self.staged.drain(..) {
            let volume = &mut self.state.volumes[staged.index];
            self.work += PROBE_WORK * volume.apply();
            match staged.visibility {
                Some(range) => volume.set_visibility(Some(&frame[range])),
                None if staged.keyframe => volume.set_visibility(None),
                None => {}
            }
            info.probes += staged.changed;
        }
    }

    fn digest(&self, id: u32, digest: &mut StateDigest) {
        if let Some(index) = self.state.index_of(id) {
            let volume = &self.state.volumes[index];
            digest.looked_at(volume.probes.len());
            digest.probes(&volume.probes, volume.visibility());
        }
    }

    fn digest_staged(&self, id: u32, frame: &[u8], emptied: bool, digest: &mut StateDigest) {
        let Some(index) = self.state.index_of(id) else {
            return;
        };
        let volume = &self.state.volumes[index];
        digest.looked_at(volume.probes.len());
        match self.find_staged(index) {
            Some(staged) => {
                let visibility = match &staged.visibility {
                    Some(range) => Some(&frame[range.clone()]),
                    None if staged.keyframe => None,
                    None => volume.visibility(),
                };
                digest.probes(&volume.next, visibility);
            }
            None if emptied => digest.probes(&[], None),
            None => digest.probes(&volume.probes, volume.visibility()),
        }
    }

    fn settle(&mut self) {}

    fn take_work(&mut self) -> u64 {
        mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        let volumes = self.state.volumes.iter_mut();
        volumes.for_each(|volume| volume.clear_dirty());
    }

    fn reset(&mut self) {
        self.staged.clear();
        self.state.volumes.clear();
    }
}

/// Decodes the probes of a track into `next`. Returns how many changed.
fn decode(bytes: &[u8], state: &mut VolumeState, keyframe: bool) -> Result<u32, ErrorKind> {
    if keyframe {
        state.start_empty();
    }
    let result = match state.volume.coding {
        Coding::Raw => raw::read(bytes, &mut state.next, &mut state.changed),
        Coding::Packed(steps) => {
            let mut contexts = contexts::initial();
            entropy::Reader::new(bytes, &mut contexts).and_then(|mut reader| {
                let mut walk = packed::Walk {
                    probes: &mut state.next,
                    present: (!keyframe).then_some(&state.present),
                    marks: &mut state.marks,
                    changed: &mut state.changed,
                };
                let scales = Scales::new(&steps);
                let changed = packed::code(&mut reader, &state.volume, &scales, None, &mut walk)?;
                reader.end(ErrorKind::ProbesEntropy)?;
                Ok(changed)
            })
        }
    };
    state.end_section();
    result
}
