//! Ranges of an array that changed, for partial uploads.

use alloc::vec::Vec;
use core::ops::Range;

use crate::error::ErrorKind;
use crate::memory::reserve::reserve_exact;
use crate::memory::sort::sort_by_key;

/// Runs of dirty items that are closer than this become one: a small gap costs less than a second
/// upload call.
const MERGE_GAP: u32 = 64;

/// An array of decoded state that is uploaded by ranges.
///
/// An array is one of all tracks, or each track has one of its own; which one is told here.
/// [`crate::Decoder::array`] gives its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Buffer {
    /// [`crate::points::State::buckets`], one array of all tracks. An element is a bucket of 32 bytes.
    PointsBuckets,
    /// [`crate::points::State::cells`], one array of all tracks. An element is a cell of 32 bytes.
    PointsCells,
    /// [`crate::probes::State::texels_of`] a track. An element is a texel of 8 bytes; a probe has one in each
    /// of seven planes.
    ProbesTexels,
    /// [`crate::probes::State::visibility_of`] a track. An element is a byte. The array is empty where the track
    /// has no visibility block.
    ProbesVisibility,
    /// [`crate::vertices::State::values`], one array of all tracks. An element is a value of one byte.
    VerticesValues,
    /// [`crate::instances::State::keys_of`] a track. An element is a key of 8 bytes. The array is empty before
    /// the first frame of the track.
    InstancesKeys,
    /// [`crate::instances::State::values_of`] a track. An element is a value of 8 bytes; an entry has one or two.
    /// The array is empty before the first frame of the track.
    InstancesValues,
    /// [`crate::regions::State::regions_of`] a track. An element is a region of 48 bytes.
    Regions,
    /// [`crate::regions::State::pairs_of`] a track. An element is two coefficients of 4 bytes together.
    RegionsPairs,
    /// [`crate::TrackState::transform`] of a track. The array has one element of twelve f32, or none where the
    /// track has no transform.
    Transforms,
}

impl Buffer {
    /// All buffers.
    pub const ALL: [Buffer; 10] = [
        Buffer::PointsBuckets,
        Buffer::PointsCells,
        Buffer::ProbesTexels,
        Buffer::ProbesVisibility,
        Buffer::VerticesValues,
        Buffer::InstancesKeys,
        Buffer::InstancesValues,
        Buffer::Regions,
        Buffer::RegionsPairs,
        Buffer::Transforms,
    ];

    /// Its stable number, for interfaces of other languages: its index in [`Buffer::ALL`].
    pub fn number(self) -> u32 {
        self as u32
    }

    /// Bytes of an element.
    pub fn element_bytes(self) -> usize {
        match self {
            Buffer::PointsBuckets | Buffer::PointsCells => 32,
            Buffer::ProbesTexels | Buffer::InstancesKeys | Buffer::InstancesValues => 8,
            Buffer::ProbesVisibility | Buffer::VerticesValues => 1,
            Buffer::RegionsPairs => 4,
            Buffer::Regions | Buffer::Transforms => 48,
        }
    }
}

/// A range of an array that changed ([`crate::Decoder::dirty`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dirty {
    /// Which array.
    pub buffer: Buffer,
    /// Id of the track whose array it is; none for an array of all tracks.
    pub track: Option<u32>,
    /// Elements that changed. Of an array that became empty the range is empty.
    pub range: DirtyRange,
}

impl Dirty {
    /// The range in bytes of the array.
    pub fn bytes(&self) -> Range<usize> {
        let size = self.buffer.element_bytes();
        size * self.range.start as usize..size * self.range.end as usize
    }
}

/// Elements `start..end` of an array that changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirtyRange {
    /// First element.
    pub start: u32,
    /// One past the last element.
    pub end: u32,
}

/// Ranges that changed, in the order they came; merged into ascending order.
#[derive(Default)]
pub(crate) struct DirtyList {
    ranges: Vec<DirtyRange>,
    /// Above this many ranges, neighbours are merged with ever larger gaps.
    most: usize,
}

impl DirtyList {
    /// No ranges, of which there are at most `most` once they are merged. Reserves all its memory.
    pub(crate) fn new(most: usize) -> Result<DirtyList, ErrorKind> {
        let mut list = DirtyList::default();
        list.reserve(most)?;
        Ok(list)
    }

    /// Sets how many ranges there may be once they are merged, and reserves memory for them.
    pub(crate) fn reserve(&mut self, most: usize) -> Result<(), ErrorKind> {
        self.most = most;
        let more = (4 * most).saturating_sub(self.ranges.len());
        reserve_exact(&mut self.ranges, more)
    }

    pub(crate) fn add_one(&mut self, index: usize) {
        self.add(index as u32, index as u32 + 1);
    }

    /// What changed: ascending and merged, once merged.
    pub(crate) fn ranges(&self) -> &[DirtyRange] {
        &self.ranges
    }

    pub(crate) fn clear(&mut self) {
        self.ranges.clear();
    }

    /// Adds `start..end`, growing the last range if it is near and before.
    #[inline]
    pub(crate) fn add(&mut self, start: u32, end: u32) {
        if let Some(last) = self.ranges.last_mut()
            && start >= last.start
            && start <= last.end.saturating_add(MERGE_GAP)
        {
            last.end = last.end.max(end);
            return;
        }
        if self.ranges.len() >= 4 * self.most {
            self.merge();
        }
        self.ranges.push(DirtyRange { start, end });
    }

    /// Sorts and merges.
    pub(crate) fn merge(&mut self) {
        if self.ranges.len() < 2 {
            return;
        }
        sort_by_key(&mut self.ranges, |r| (r.start, r.end));
        let mut gap = MERGE_GAP;
        loop {
            self.ranges.dedup_by(|next, kept| {
                let near = next.start <= kept.end.saturating_add(gap);
                if near {
                    kept.end = kept.end.max(next.end);
                }
                near
            });
            if self.ranges.len() <= self.most {
                return;
            }
            gap = gap.saturating_mul(4);
        }
    }
}
