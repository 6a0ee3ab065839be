//! The section of a track in an `instances` record, read: entries that are decoded beside the
//! committed ones, and take their place at the commit.

use super::state::{Entries, TableState};
use super::{Coding, State, Table, packed, raw};
use crate::entropy;
use crate::error::ErrorKind;
use crate::models::baked::{BakedState, BakedStore, Content, Staged};
use crate::models::payload_header::ShapeErrors;
use crate::models::{ModelKind, Parameters};
use crate::session::digest::StateDigest;
use crate::session::track::Track;

/// The state of the model, and what the pending frame has for it.
pub(crate) type Store = BakedStore<State>;

/// What is kept of a track beside its arrays.
pub(super) const TRACK_BYTES: usize = size_of::<TableState>() + size_of::<Staged>();

/// Steps of work of an entry: some fifty bits of its key and up to eight codes.
const ENTRY_WORK: u64 = 32;

/// The tracks of the model, with their ids.
fn tables(tracks: &[Track]) -> impl Iterator<Item = (u32, &Table)> {
    let tracks = tracks.iter();
    tracks.filter_map(|track| Some((track.id, track.instance_table()?)))
}

impl BakedState for State {
    const MODEL: ModelKind = ModelKind::Instances;
    const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
        size: ErrorKind::InstancesSize,
        reserved: ErrorKind::InstancesReserved,
    };
    type Plan = ();

    fn plan(&self, tracks: &[Track]) -> Result<((), Option<u64>), ErrorKind> {
        let there = self.tables.iter().map(|t| &t.table);
        let all = there.chain(tables(tracks).map(|(_, table)| table));
        let bytes = all.fold(0u64, |sum, table| sum.saturating_add(table.state_bytes()));
        Ok(((), usize::try_from(bytes).is_ok().then_some(bytes)))
    }

    fn add(&mut self, tracks: &[Track], (): (), max_tracks: usize) -> Result<(), ErrorKind> {
        tables(tracks).try_for_each(|(id, table)| self.add_table(id, table, max_tracks))
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.tables.retain(|table| !removed(table.id));
    }

    fn index_of(&self, id: u32) -> Option<usize> {
        self.tables.binary_search_by_key(&id, |t| t.id).ok()
    }

    fn id_of(&self, index: usize) -> u32 {
        self.tables[index].id
    }

    fn read(&mut self, index: usize, section: &[u8], work: &mut u64) -> Result<(), ErrorKind> {
        let table = &mut self.tables[index];
        let result = decode(section, &table.table, &mut table.next);
        *work += ENTRY_WORK * table.next.keys.len() as u64 + 1;
        result
    }

    fn discard(&mut self, index: usize) {
        self.tables[index].next.clear();
    }

    fn apply(&mut self, index: usize, _work: &mut u64) -> u32 {
        self.tables[index].apply()
    }

    fn empty(&mut self, index: usize, _work: &mut u64) {
        self.tables[index].empty();
    }

    fn digest(&self, index: usize, content: Content, digest: &mut StateDigest) {
        let table = &self.tables[index];
        match content {
            Content::Pending => digest.instances_content(&table.next),
            Content::None => digest.instances_no_content(),
            Content::Committed => digest.instances_content(&table.entries),
        }
    }

    fn clear_dirty(&mut self) {
        self.tables.iter_mut().for_each(TableState::clear_dirty);
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
