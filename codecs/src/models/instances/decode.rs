//! The payload of an `instances` record, read: decoded when it comes into entries beside the
//! committed ones, which take their place at the commit. Nothing after the checks can fail.

use alloc::vec::Vec;
use core::mem;
use core::ops::Range;

use super::state::{Entries, TableState};
use super::{Coding, State, Table, packed, raw};
use crate::entropy;
use crate::error::ErrorKind;
use crate::memory::reserve::reserve_bounded;
use crate::models::payload_header::{Base, PayloadHeader, ShapeErrors};
use crate::models::state::{ModelState, PendingView, Rollback};
use crate::models::{ModelKind, Parameters};
use crate::session::digest::StateDigest;
use crate::session::track::{self, Track, TrackState};

const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
    size: ErrorKind::InstancesSize,
    reserved: ErrorKind::InstancesReserved,
};

/// Steps of work of an entry: some fifty bits of its key and up to eight codes.
const ENTRY_WORK: u64 = 32;

/// The state of the model, and what the pending frame has for it.
#[derive(Default)]
pub(crate) struct Store {
    pub(crate) state: State,
    staged: Vec<StagedTable>,
    work: u64,
}

/// A track of the pending frame, whose entries are decoded.
struct StagedTable {
    /// Index in the state's list of tables.
    index: usize,
    /// Where its payload starts in those of the frame.
    payload: usize,
}

impl Store {
    /// What is kept of a track beside its arrays.
    pub(super) const TRACK_BYTES: usize = size_of::<TableState>() + size_of::<StagedTable>();
}

/// The tracks of the model, with their ids.
fn tables(tracks: &[Track]) -> impl Iterator<Item = (u32, &Table)> {
    let tracks = tracks.iter();
    tracks.filter_map(|track| Some((track.id, track.instance_table()?)))
}

impl ModelState for Store {
    fn plan(&mut self, tracks: &[Track]) -> Result<Option<u64>, ErrorKind> {
        let there = self.state.tables.iter().map(|t| &t.table);
        let all = there.chain(tables(tracks).map(|(_, table)| table));
        let bytes = all.fold(0u64, |sum, table| sum.saturating_add(table.state_bytes()));
        Ok(usize::try_from(bytes).is_ok().then_some(bytes))
    }

    fn add(
        &mut self,
        tracks: &[Track],
        _max_bytes: u64,
        max_tracks: usize,
    ) -> Result<(), ErrorKind> {
        tables(tracks).try_for_each(|(id, table)| self.state.add(id, table, max_tracks))
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.state.tables.retain(|table| !removed(table.id));
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
            let entry = header.entry(bytes, i, ModelKind::Instances, tracks)?;
            let [size, reserved] = entry.numbers;
            if reserved != 0 {
                return Err(ErrorKind::InstancesReserved);
            }
            let section = bytes[at..].get(..size as usize);
            let section = section.ok_or(ErrorKind::InstancesSize)?;
            at += section.len();
            let index = self.state.index_of(entry.id);
            let index = index.ok_or(ErrorKind::UnknownTrack)?;
            reserve_bounded(&mut self.staged, 1, tracks.len())?;
            // Kept before the entries are looked at, so that an error rolls them back.
            tracks[entry.slot].staged = Some(self.staged.len() as u32);
            self.staged.push(StagedTable {
                index,
                payload: payload.start,
            });
            let table = &mut self.state.tables[index];
            let result = decode(section, &table.table, &mut table.next);
            self.work += ENTRY_WORK * table.next.keys.len() as u64 + 1;
            result?;
        }
        match at == bytes.len() {
            true => Ok(()),
            false => Err(ErrorKind::InstancesSize),
        }
    }

    fn rollback(&mut self, to: Rollback, tracks: &mut [TrackState]) {
        let first = match to {
            Rollback::ToPayload(kept) => self.staged.partition_point(|s| s.payload < kept),
            Rollback::Frame => 0,
        };
        for staged in self.staged.drain(first..) {
            let table = &mut self.state.tables[staged.index];
            table.next.clear();
            if let Some(at) = track::find(tracks, table.id) {
                tracks[at].staged = None;
            }
        }
    }

    fn commit(&mut self, pending: PendingView<'_>, tracks: &[TrackState]) -> u32 {
        let staged = self.staged.drain(..);
        let changed = staged.map(|staged| self.state.tables[staged.index].apply());
        let changed = changed.fold(0, u32::saturating_add);
        if pending.emptied {
            for track in tracks {
                if track.staged.is_none()
                    && track.filled
                    && let Some(table) = self.state.get_mut(track.track.id)
                {
                    table.empty();
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
        let Some(table) = self.state.of(track) else {
            return;
        };
        match pending {
            Some(_) if track.staged.is_some() => digest.instances_content(&table.next),
            Some(pending) if pending.emptied => digest.instances_no_content(),
            _ => digest.instances_content(&table.entries),
        }
    }

    fn take_work(&mut self) -> u64 {
        mem::take(&mut self.work)
    }

    fn clear_dirty(&mut self) {
        let tables = self.state.tables.iter_mut();
        tables.for_each(|table| table.clear_dirty());
    }

    fn reset(&mut self) {
        self.staged.clear();
        self.state.tables.clear();
    }
}

/// Decodes the entries of a track.
fn decode(bytes: &[u8], table: &Table, entries: &mut Entries) -> Result<(), ErrorKind> {
    match table.coding {
        Coding::Raw => raw::read(bytes, table, entries),
        Coding::Packed => {
            let mut contexts = packed::contexts();
            let mut reader =
                entropy::Reader::new(bytes, &mut contexts, ErrorKind::InstancesEntropy)?;
            packed::check_size(table, bytes.len())?;
            packed::code(&mut reader, table, None, entries)?;
            reader.end()
        }
    }
}
