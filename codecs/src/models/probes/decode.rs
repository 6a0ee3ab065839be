//! The payload of a `probes` record, read: decoded when it comes into codes beside the committed
//! ones, and turned into texels at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::mem;
use core::ops::Range;

use super::state::{MAX_DIRTY, SETS, VolumeState};
use super::values::Scales;
use super::{Coding, State, Volume, contexts, maps, packed, raw};
use crate::dirty::DirtyRange;
use crate::entropy;
use crate::error::ErrorKind;
use crate::memory::reserve::reserve_bounded;
use crate::models::payload_header::{Base, PayloadHeader, ShapeErrors};
use crate::models::state::{ModelState, PendingView, Rollback};
use crate::models::{ModelKind, Parameters};
use crate::session::digest::StateDigest;
use crate::session::track::{self, Track, TrackState};

const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
    size: ErrorKind::ProbesSize,
    reserved: ErrorKind::ProbesReserved,
};
/// Flag of a track in a record: its visibility block follows.
pub(super) const HAS_VISIBILITY: u32 = 1;

/// Steps of work of a texel of a map that is decoded.
const MAP_TEXEL_WORK: u64 = 4;

/// Steps of work of a probe whose texels are computed.
const PROBE_WORK: u64 = 8;

/// Bytes of a map that are written or compared in a step of work.
const MAP_BYTES_PER_STEP: u64 = 64;

/// Steps of work of a section that changes some of a volume's probes: those, and a look at its sets.
fn section_work(probes: usize, changed: u32) -> u64 {
    32 * u64::from(changed) + probes as u64 / 512 + 1
}

/// Steps of work of a section with coded maps: those of the texels of maps that change, and priors that may
/// be written.
fn map_work(volume: &Volume, maps: bool, changed: u32) -> u64 {
    let side = u64::from(volume.visibility.side);
    let priors = volume.visibility_bytes() / MAP_BYTES_PER_STEP;
    u64::from(changed) * side * side * MAP_TEXEL_WORK + u64::from(maps) * priors
}

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Store {
    pub(crate) state: State,
    staged: Vec<StagedVolume>,
    work: u64,
}

/// A track of the pending frame, whose probes are decoded.
struct StagedVolume {
    /// Index in the state's list of volumes.
    index: usize,
    /// Where its payload starts in those of the frame.
    payload: usize,
    keyframe: bool,
    visibility: StagedVisibility,
    changed: u32,
}

/// What a section says of visibility.
enum StagedVisibility {
    /// Nothing: a delta keeps what there is, and a keyframe has none.
    Absent,
    /// Coding `raw`: where the block lies in the frame's payloads.
    Block(Range<usize>),
    /// Coding `packed`: the volume has it pending.
    Maps,
}

impl Store {
    /// What is kept of a track beside its arrays: dirty ranges, and what its sets round up, too.
    pub(super) const TRACK_BYTES: usize = size_of::<VolumeState>()
        + size_of::<StagedVolume>()
        + 8 * MAX_DIRTY * size_of::<DirtyRange>()
        + 8 * SETS;

    fn write_staged(&mut self, payloads: &[u8]) -> u32 {
        let mut changed = 0;
        for staged in self.staged.drain(..) {
            let volume = &mut self.state.volumes[staged.index];
            self.work += PROBE_WORK * volume.apply();
            match staged.visibility {
                StagedVisibility::Block(range) => volume.set_visibility(&payloads[range]),
                StagedVisibility::Maps => self.work += volume.apply_maps() / MAP_BYTES_PER_STEP,
                StagedVisibility::Absent if staged.keyframe => volume.drop_visibility(),
                StagedVisibility::Absent => {}
            }
            changed += staged.changed;
        }
        changed
    }
}

/// The tracks of the model, with their ids.
fn volumes(tracks: &[Track]) -> impl Iterator<Item = (u32, &Volume)> {
    tracks
        .iter()
        .filter_map(|track| Some((track.id, track.volume()?)))
}

impl ModelState for Store {
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind> {
        let there = self.state.volumes.iter().map(|v| &v.volume);
        let all = there.chain(volumes(tracks).map(|(_, volume)| volume));
        let bytes = all.fold(0u64, |sum, volume| sum.saturating_add(volume.state_bytes()));
        Ok(usize::try_from(bytes).is_ok().then_some(bytes))
    }

    fn add(
        &mut self,
        tracks: &[Track],
        _max_bytes: u64,
        max_tracks: usize,
    ) -> Result<(), ErrorKind> {
        volumes(tracks).try_for_each(|(id, volume)| self.state.add(id, volume, max_tracks))
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.volumes.retain(|volume| !removed(volume.id));
    }

    fn stage(
        &mut self,
        payloads: &mut [u8],
        payload: Range<usize>,
        base: Base,
        tracks: &mut [TrackState],
    ) -> Result<(), ErrorKind> {
        let payload_bytes = &payloads[payload.clone()];
        let mut header = PayloadHeader::read(payload_bytes, base, SHAPE_ERRORS)?;
        let mut at = header.bytes();
        for i in 0..header.count {
            let entry = header.entry(payload_bytes, i, ModelKind::Probes, tracks)?;
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
            let mut rest = section;
            let visibility = match (flags, volume.volume.coding) {
                (0, _) => StagedVisibility::Absent,
                (_, Coding::Packed(_)) => StagedVisibility::Maps,
                (_, Coding::Raw) => {
                    if visibility_bytes > u64::from(size) {
                        return Err(ErrorKind::ProbesSize);
                    }
                    let bytes = visibility_bytes as usize;
                    rest = &section[bytes..];
                    let start = payload.start + at;
                    StagedVisibility::Block(start..start + bytes)
                }
            };
            at += section.len();
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            let maps = matches!(visibility, StagedVisibility::Maps);
            let changed = decode(rest, volume, header.keyframe, maps);
            // Kept before the result is looked at, so that an error rolls it back.
            tracks[entry.slot].staged = Some(self.staged.len() as u32);
            self.staged.push(StagedVolume {
                index,
                payload: payload.start,
                keyframe: header.keyframe,
                visibility,
                changed: changed.as_ref().map_or(0, |changed| changed.probes),
            });
            let changed = changed?;
            self.work += section_work(volume.volume.count(), changed.probes);
            self.work += map_work(&volume.volume, maps, changed.maps);
        }
        if at != payload_bytes.len() {
            return Err(ErrorKind::ProbesSize);
        }
        Ok(())
    }

    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]) {
        let first = match to {
            Rollback::ToPayload(kept) => self.staged.partition_point(|s| s.payload < kept),
            Rollback::Frame => 0,
        };
        for staged in self.staged.drain(first..) {
            let volume = &mut self.state.volumes[staged.index];
            volume.rollback();
            if let Some(at) = track::find(tracks, volume.id) {
                tracks[at].staged = None;
            }
        }
    }

    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32 {
        let changed = self.write_staged(pending.payloads);
        if pending.emptied {
            for track in tracks {
                if track.staged.is_none()
                    && track.filled
                    && let Some(volume) = self.state.get_mut(track.track.id)
                {
                    self.work += PROBE_WORK * volume.empty();
                }
            }
        }
        if pending.removes {
            self.remove(&|id| track::is_removed(tracks, id));
        }
        changed
    }

    fn digest(
        &self,
        track: &TrackState,
        pending: Option<PendingView<'_>>,
        digest: &mut StateDigest,
    ) {
        let Some(volume) = self.state.of(track) else {
            return;
        };
        digest.looked_at(volume.probes.len());
        let staged = track.staged.map(|at| &self.staged[at as usize]);
        match (pending, staged) {
            (Some(pending), Some(staged)) => {
                let visibility = match &staged.visibility {
                    StagedVisibility::Block(range) => Some(&pending.payloads[range.clone()]),
                    StagedVisibility::Maps => Some(volume.next_visibility()),
                    StagedVisibility::Absent if staged.keyframe => None,
                    StagedVisibility::Absent => volume.visibility(),
                };
                digest.probes_content(&volume.next, visibility);
            }
            (Some(pending), None) if pending.emptied => digest.probes_content(&[], None),
            _ => digest.probes_content(&volume.probes, volume.visibility()),
        }
    }

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

/// How many maps and probes a section changes.
#[derive(Clone, Copy, Default)]
struct Changed {
    maps: u32,
    probes: u32,
}

/// Decodes the maps of a track, where it has some, and its probes into what is pending.
fn decode(
    bytes: &[u8],
    state: &mut VolumeState,
    keyframe: bool,
    maps: bool,
) -> Result<Changed, ErrorKind> {
    if keyframe {
        state.start_empty();
    }
    let mut changed = Changed::default();
    let result = match state.volume.coding {
        Coding::Raw => raw::read(bytes, &mut state.next, &mut state.changed),
        Coding::Packed(steps) => {
            let mut contexts = contexts::initial();
            let fault = ErrorKind::ProbesEntropy;
            entropy::Reader::new(bytes, &mut contexts, fault).and_then(|mut reader| {
                if maps {
                    changed.maps = decode_maps(&mut reader, state, keyframe)?;
                }
                let mut walk = packed::Walk {
                    probes: &mut state.next,
                    present: (!keyframe).then_some(&state.present),
                    marks: &mut state.marks,
                    changed: &mut state.changed,
                };
                let scales = Scales::new(&steps);
                let changed = packed::code(&mut reader, &state.volume, &scales, None, &mut walk)?;
                reader.end()?;
                Ok(changed)
            })
        }
    };
    state.end_section();
    changed.probes = result?;
    Ok(changed)
}

/// Decodes visibility maps. Returns how many change.
fn decode_maps(
    reader: &mut entropy::Reader<'_>,
    state: &mut VolumeState,
    keyframe: bool,
) -> Result<u32, ErrorKind> {
    let volume = state.volume;
    let result = maps::code(reader, &volume, None, &mut state.begin_maps(keyframe));
    state.end_maps();
    result
}
