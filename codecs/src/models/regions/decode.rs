//! The payload of a `regions` record, read: decoded when it comes, beside the committed content, and
//! exchanged with it at the commit. Nothing after the checks can fail.

use core::mem;
use core::ops::Range;

use alloc::vec::Vec;

use super::packed::{FIRST, Walk};
use super::state::{Arrays, SetState};
use super::{Coding, Form, MOST_COEFFICIENTS, Region, RegionSet, State, contexts, raw};
use crate::entropy;
use crate::error::ErrorKind;
use crate::memory::reserve::reserve_bounded;
use crate::models::payload_header::{Base, PayloadHeader, ShapeErrors};
use crate::models::state::{ModelState, PendingView, Rollback};
use crate::models::{ModelKind, Parameters};
use crate::session::digest::StateDigest;
use crate::session::track::{self, Track, TrackState};

const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
    size: ErrorKind::RegionsSize,
    reserved: ErrorKind::RegionsReserved,
};

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Store {
    pub(crate) state: State,
    staged: Vec<StagedSet>,
    work: u64,
}

/// A track of the pending frame, whose regions are decoded.
struct StagedSet {
    /// Index in the state's list of sets.
    index: usize,
    /// Where its payload starts in those of the frame.
    payload: usize,
}

impl Store {
    /// What is kept of a track beside its arrays.
    pub(super) const TRACK_BYTES: usize = size_of::<SetState>() + size_of::<StagedSet>();
}

/// The tracks of the model, with their ids.
fn sets(tracks: &[Track]) -> impl Iterator<Item = (u32, &RegionSet)> {
    tracks
        .iter()
        .filter_map(|track| Some((track.id, track.region_set()?)))
}

impl ModelState for Store {
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind> {
        let there = self.state.sets.iter().map(|set| &set.set);
        let all = there.chain(sets(tracks).map(|(_, set)| set));
        let bytes = all.fold(0u64, |sum, set| sum.saturating_add(set.state_bytes()));
        Ok(usize::try_from(bytes).is_ok().then_some(bytes))
    }

    fn add(
        &mut self,
        tracks: &[Track],
        _max_bytes: u64,
        max_tracks: usize,
    ) -> Result<(), ErrorKind> {
        sets(tracks).try_for_each(|(id, set)| self.state.add(id, set, max_tracks))
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.sets.retain(|set| !removed(set.id));
    }

    fn stage(
        &mut self,
        payloads: &mut [u8],
        payload: Range<usize>,
        _base: Base,
        tracks: &mut [TrackState],
    ) -> Result<(), ErrorKind> {
        let bytes = &payloads[payload.clone()];
        let mut header = PayloadHeader::read_keyframe(bytes, SHAPE_ERRORS)?;
        let mut at = header.bytes();
        for i in 0..header.count {
            let entry = header.entry(bytes, i, ModelKind::Regions, tracks)?;
            let [size, reserved] = entry.numbers;
            if reserved != 0 {
                return Err(ErrorKind::RegionsReserved);
            }
            let section = bytes[at..].get(..size as usize);
            let section = section.ok_or(ErrorKind::RegionsSize)?;
            at += section.len();
            let index = self.state.index_of(entry.id);
            let index = index.ok_or(ErrorKind::UnknownTrack)?;
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            let set = &mut self.state.sets[index];
            let read = match set.set.coding {
                Coding::Raw => raw::read(section, &set.set, &mut set.next),
                Coding::Packed => read_packed(section, &set.set, &mut set.next),
            };
            self.work += (set.next.regions.len() + 4 * set.next.pairs.len()) as u64;
            // Kept before the result is looked at, so that an error rolls it back.
            tracks[entry.slot].staged = Some(self.staged.len() as u32);
            self.staged.push(StagedSet {
                index,
                payload: payload.start,
            });
            read?;
        }
        if at != bytes.len() {
            return Err(ErrorKind::RegionsSize);
        }
        Ok(())
    }

    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]) {
        let first = match to {
            Rollback::ToPayload(kept) => self.staged.partition_point(|s| s.payload < kept),
            Rollback::Frame => 0,
        };
        for staged in self.staged.drain(first..) {
            let set = &mut self.state.sets[staged.index];
            set.next.clear();
            if let Some(at) = track::find(tracks, set.id) {
                tracks[at].staged = None;
            }
        }
    }

    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32 {
        let mut items = 0;
        for staged in self.staged.drain(..) {
            let set = &mut self.state.sets[staged.index];
            items += set.next.regions.len() as u32;
            self.work += set.apply();
        }
        if pending.emptied {
            for track in tracks {
                if track.staged.is_none()
                    && track.filled
                    && let Some(set) = self.state.get_mut(track.track.id)
                {
                    self.work += 1;
                    set.empty();
                }
            }
        }
        if pending.removes {
            self.remove(&|id| track::is_removed(tracks, id));
        }
        items
    }

    fn digest(
        &self,
        track: &TrackState,
        pending: Option<PendingView<'_>>,
        digest: &mut StateDigest,
    ) {
        let Some(set) = self.state.of(track) else {
            return;
        };
        let none = Arrays::default();
        let arrays = match pending {
            Some(_) if track.staged.is_some() => &set.next,
            Some(pending) if pending.emptied => &none,
            _ => &set.content,
        };
        digest.regions_content(&arrays.regions, &arrays.pairs);
    }

    fn take_work(&mut self) -> u64 {
        mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        self.state.sets.iter_mut().for_each(SetState::clear_dirty);
    }

    fn reset(&mut self) {
        self.staged.clear();
        self.state.sets.clear();
    }
}

/// Reads a `packed` section into `next`, which is empty (`spec/regions.md` §7).
fn read_packed(bytes: &[u8], set: &RegionSet, next: &mut Arrays) -> Result<(), ErrorKind> {
    let count = set.count as usize;
    let size = ErrorKind::RegionsSize;
    let (boxes, rest) = bytes.split_at_checked(24 * count).ok_or(size)?;
    let (bitmap, rest) = rest.split_at_checked(count.div_ceil(8)).ok_or(size)?;
    let mut boxes = Boxes {
        boxes,
        centres: &[],
        bitmap,
    };
    if (count..8 * bitmap.len()).any(|at| boxes.has_centre(at)) {
        return Err(ErrorKind::RegionsReserved);
    }
    let given = (0..count).filter(|&at| boxes.has_centre(at)).count();
    let (centres, coded) = rest.split_at_checked(12 * given).ok_or(size)?;
    boxes.centres = centres;
    for region in boxes.regions() {
        region.check_box()?;
        region.check_centre()?;
    }
    let mut contexts = contexts::initial();
    let fault = ErrorKind::RegionsEntropy;
    let mut reader = entropy::Reader::new(coded, &mut contexts, fault)?;
    let mut walk = Walk::start(&mut reader, set.signals.count, set.step, [false; 3]);
    for (at, region) in boxes.regions().enumerate() {
        let form = Form {
            centred: !boxes.has_centre(at),
            ..walk.form(&mut reader, FIRST)
        };
        let region = Region {
            form: form.bits(),
            ..region
        };
        next.push(set, region, form)?;
        let mut codes = [0; MOST_COEFFICIENTS];
        walk.codes(&mut reader, &mut codes)?;
        let first = next.pairs.len() - form.pairs();
        let values = next.pairs[first..].as_flattened_mut();
        for (value, code) in values[..form.coefficients()].iter_mut().zip(codes) {
            *value = code * set.step as i16;
        }
    }
    reader.end()
}

/// Boxes and centres of a `packed` section.
struct Boxes<'a> {
    boxes: &'a [u8],
    centres: &'a [u8],
    /// Bit r: region r has a centre of its own.
    bitmap: &'a [u8],
}

impl Boxes<'_> {
    fn has_centre(&self, at: usize) -> bool {
        self.bitmap[at / 8] >> (at % 8) & 1 == 1
    }

    /// The regions, without their forms.
    fn regions(&self) -> impl Iterator<Item = Region> {
        let floats = |bytes: &[u8]| {
            let words = bytes.as_chunks::<4>().0;
            [0, 1, 2].map(|at| f32::from_le_bytes(words[at]))
        };
        let mut centres = self.centres.as_chunks::<12>().0.iter();
        let boxes = self.boxes.as_chunks::<24>().0.iter().enumerate();
        boxes.map(move |(at, bytes)| {
            let mut region = Region {
                min: floats(&bytes[..12]),
                first: 0,
                max: floats(&bytes[12..]),
                form: 0,
                centre: [0.0; 3],
                reserved: 0,
            };
            region.centre = match self.has_centre(at) {
                true => centres.next().map_or([0.0; 3], |bytes| floats(bytes)),
                false => region.middle(),
            };
            region
        })
    }
}
