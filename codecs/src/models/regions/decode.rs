//! The section of a track in a `regions` record, read: regions that are decoded beside the committed
//! ones, and exchanged with them at the commit.

use super::packed::{FIRST, Walk};
use super::state::{Arrays, SetState};
use super::{Coding, Form, MOST_COEFFICIENTS, Region, RegionSet, State, contexts, raw};
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
pub(super) const TRACK_BYTES: usize = size_of::<SetState>() + size_of::<Staged>();

/// The tracks of the model, with their ids.
fn sets(tracks: &[Track]) -> impl Iterator<Item = (u32, &RegionSet)> {
    tracks
        .iter()
        .filter_map(|track| Some((track.id, track.region_set()?)))
}

impl BakedState for State {
    const MODEL: ModelKind = ModelKind::Regions;
    const SHAPE_ERRORS: ShapeErrors = ShapeErrors {
        size: ErrorKind::RegionsSize,
        reserved: ErrorKind::RegionsReserved,
    };
    type Plan = ();

    fn plan(&self, tracks: &[Track]) -> Result<((), Option<u64>), ErrorKind> {
        let there = self.sets.iter().map(|set| &set.set);
        let all = there.chain(sets(tracks).map(|(_, set)| set));
        let bytes = all.fold(0u64, |sum, set| sum.saturating_add(set.state_bytes()));
        Ok(((), usize::try_from(bytes).is_ok().then_some(bytes)))
    }

    fn add(&mut self, tracks: &[Track], (): (), max_tracks: usize) -> Result<(), ErrorKind> {
        sets(tracks).try_for_each(|(id, set)| self.add_set(id, set, max_tracks))
    }

    fn remove(&mut self, removed: &dyn Fn(u32) -> bool) {
        self.sets.retain(|set| !removed(set.id));
    }

    fn index_of(&self, id: u32) -> Option<usize> {
        self.sets.binary_search_by_key(&id, |set| set.id).ok()
    }

    fn id_of(&self, index: usize) -> u32 {
        self.sets[index].id
    }

    fn read(&mut self, index: usize, section: &[u8], work: &mut u64) -> Result<(), ErrorKind> {
        let set = &mut self.sets[index];
        let result = match set.set.coding {
            Coding::Raw => raw::read(section, &set.set, &mut set.next),
            Coding::Packed => read_packed(section, &set.set, &mut set.next),
        };
        *work += (set.next.regions.len() + 4 * set.next.pairs.len()) as u64;
        result
    }

    fn discard(&mut self, index: usize) {
        self.sets[index].next.clear();
    }

    fn apply(&mut self, index: usize, work: &mut u64) -> u32 {
        let set = &mut self.sets[index];
        let regions = set.next.regions.len() as u32;
        *work += set.apply();
        regions
    }

    fn empty(&mut self, index: usize, work: &mut u64) {
        *work += 1;
        self.sets[index].empty();
    }

    fn digest(&self, index: usize, content: Content, digest: &mut StateDigest) {
        let set = &self.sets[index];
        let none = Arrays::default();
        let arrays = match content {
            Content::Pending => &set.next,
            Content::None => &none,
            Content::Committed => &set.content,
        };
        digest.regions_content(&arrays.regions, &arrays.pairs);
    }

    fn clear_dirty(&mut self) {
        self.sets.iter_mut().for_each(SetState::clear_dirty);
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
