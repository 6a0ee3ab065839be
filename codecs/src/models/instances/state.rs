//! The decoded state of all `instances` tracks: arrays that upload to a GPU as they are.

use alloc::vec::Vec;
use core::mem;

use super::{COEFFICIENTS, Table, Value};
use crate::dirty::{Buffer, Dirty, DirtyRange};
use crate::error::ErrorKind;
use crate::memory::reserve::{reserve_bounded, reserve_exact};
use crate::models::baked::BakedState;
use crate::session::track::TrackState;

/// All tables, as of the last commit.
///
/// The entries of a track are either all there or, before its first frame, none. Entry i has key i, and its
/// signal s of S is value `i * S + s`.
#[derive(Default)]
pub struct State {
    /// Ids ascending.
    pub(super) tables: Vec<TableState>,
}

impl State {
    /// The keys of a track's entries, which ascend; none where the track is not of this state.
    pub fn keys_of(&self, track: &TrackState) -> &[u64] {
        self.of(track).map_or(&[], |table| &table.entries.keys)
    }

    /// The values of a track's entries, one or two each; none where the track is not of this state.
    pub fn values_of(&self, track: &TrackState) -> &[Value] {
        self.of(track).map_or(&[], |table| &table.entries.values)
    }

    /// The values of the entry of a key, as many as the track has signals; none without an entry.
    pub fn find(&self, track: &TrackState, key: u64) -> Option<&[Value]> {
        let table = self.of(track)?;
        let index = table.entries.keys.binary_search(&key).ok()?;
        let signals = table.table.signals();
        table.entries.values.get(index * signals..)?.get(..signals)
    }

    /// What changed since [`crate::Decoder::clear_dirty`]: both arrays of a track, whole.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        let changed = self.tables.iter().filter(|table| table.dirty);
        changed.flat_map(|table| {
            let whole = |buffer, end: usize| Dirty {
                buffer,
                track: Some(table.id),
                range: DirtyRange {
                    start: 0,
                    end: end as u32,
                },
            };
            [
                whole(Buffer::InstancesKeys, table.entries.keys.len()),
                whole(Buffer::InstancesValues, table.entries.values.len()),
            ]
        })
    }

    pub(super) fn of(&self, track: &TrackState) -> Option<&TableState> {
        Some(&self.tables[self.index_of(track.track.id)?])
    }

    pub(super) fn add_table(
        &mut self,
        id: u32,
        table: &Table,
        limit: usize,
    ) -> Result<(), ErrorKind> {
        reserve_bounded(&mut self.tables, 1, limit)?;
        self.tables.push(TableState {
            id,
            table: *table,
            entries: Entries::new(table)?,
            next: Entries::new(table)?,
            dirty: false,
        });
        Ok(())
    }
}

/// The state of a track, and what the pending frame makes of it.
pub(super) struct TableState {
    pub(super) id: u32,
    pub(super) table: Table,
    pub(super) entries: Entries,
    /// All entries as the pending frame leaves them; none where it has none for the track.
    pub(super) next: Entries,
    dirty: bool,
}

impl TableState {
    /// Makes `next` the committed state. Returns how many entries it has.
    pub(super) fn apply(&mut self) -> u32 {
        self.dirty |= self.entries != self.next;
        mem::swap(&mut self.entries, &mut self.next);
        self.next.clear();
        self.entries.keys.len() as u32
    }

    /// No entry is there.
    pub(super) fn empty(&mut self) {
        self.dirty |= !self.entries.keys.is_empty();
        self.entries.clear();
    }

    pub(super) fn clear_dirty(&mut self) {
        self.dirty = false;
    }
}

/// Entries of a table: all of them, or none.
#[derive(PartialEq)]
pub(super) struct Entries {
    pub(super) keys: Vec<u64>,
    pub(super) values: Vec<Value>,
}

impl Entries {
    /// No entries, and memory for all.
    pub(super) fn new(table: &Table) -> Result<Entries, ErrorKind> {
        let count = table.count as usize;
        let (mut keys, mut values) = (Vec::new(), Vec::new());
        reserve_exact(&mut keys, count)?;
        reserve_exact(&mut values, count * table.signals())?;
        Ok(Entries { keys, values })
    }

    /// Starts an entry, whose signals follow.
    #[inline]
    pub(super) fn start(&mut self, key: u64) -> Result<(), ErrorKind> {
        if self.keys.last().is_some_and(|&before| before >= key) {
            return Err(ErrorKind::InstanceKey);
        }
        self.keys.push(key);
        Ok(())
    }

    /// Adds a signal of the entry.
    #[inline]
    pub(super) fn signal(
        &mut self,
        table: &Table,
        codes: [i32; COEFFICIENTS],
    ) -> Result<(), ErrorKind> {
        codes.iter().try_for_each(|&code| table.check_code(code))?;
        let step = i32::from(table.step);
        self.values.push(codes.map(|code| (code * step) as i16));
        Ok(())
    }

    pub(super) fn clear(&mut self) {
        self.keys.clear();
        self.values.clear();
    }
}

impl Table {
    /// A code is in its range.
    #[inline]
    pub(super) fn check_code(&self, code: i32) -> Result<(), ErrorKind> {
        match code.unsigned_abs() <= self.most() as u32 {
            true => Ok(()),
            false => Err(ErrorKind::InstanceCode),
        }
    }
}
