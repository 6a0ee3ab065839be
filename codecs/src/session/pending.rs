//! The pending frame, and what is told of one that was committed.

use alloc::vec::Vec;
use core::ops::Range;

use super::track::TrackState;
use super::transforms::Transform;
use crate::error::ErrorKind;
use crate::memory::reserve::{grown, reserve_bounded, reserve_exact};
use crate::models::ModelKind;
use crate::models::state::PendingView;

/// A frame that was committed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameInfo {
    /// Frame number; ascends, and may leave numbers out.
    pub number: u32,
    /// Time in ticks of the stream's [`TickRate`](crate::TickRate).
    pub tick: u64,
    /// Transforms that the frame carried.
    pub transforms: u32,
    pub(crate) items: [u32; ModelKind::ALL.len()],
}

impl FrameInfo {
    /// Items of a model that the frame carried: cells of `points`; of `probes` those that it changed; vertices
    /// of `vertices`; entries of `instances`; regions of `regions`.
    pub fn count(&self, model: ModelKind) -> u32 {
        self.items[model.index()]
    }
}

/// What came of the next frame.
#[derive(Default)]
pub(crate) struct PendingFrame {
    /// Something came.
    pub(crate) open: bool,
    /// The frame starts from an empty state.
    pub(crate) emptied: bool,
    /// Some tracks may be marked as staged.
    pub(crate) has_content: bool,
    pub(crate) has_transforms: bool,
    /// Index of the track in the session's list, ascending.
    pub(crate) transforms: Vec<(usize, Transform)>,
    pub(crate) payloads: Payloads,
}

impl PendingFrame {
    /// It changes tracks that stay.
    pub(crate) fn has_changes(&self) -> bool {
        self.has_content || self.has_transforms || self.emptied
    }

    /// What models are told of it.
    pub(crate) fn view(&self, removes: bool) -> PendingView<'_> {
        PendingView {
            payloads: self.payloads.get(),
            emptied: self.emptied,
            removes,
        }
    }

    /// The transform of a track after the frame.
    pub(crate) fn transform<'t>(
        &'t self,
        index: usize,
        state: &'t TrackState,
    ) -> Option<&'t Transform> {
        let found = self.transforms.binary_search_by_key(&index, |&(at, _)| at);
        match found {
            Ok(at) => Some(&self.transforms[at].1),
            Err(_) if self.emptied => None,
            Err(_) => state.transform.as_ref(),
        }
    }

    /// Forgets what came; keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.open = false;
        self.emptied = false;
        self.has_content = false;
        self.has_transforms = false;
        self.transforms.clear();
        self.payloads.clear();
    }
}

/// Payloads of the pending frame, one after the other: one buffer for the model records of all
/// models, so that the limit of a frame bounds it once.
#[derive(Default)]
pub(crate) struct Payloads {
    /// The first `used` bytes are payloads; the rest is kept from earlier frames.
    bytes: Vec<u8>,
    used: usize,
}

impl Payloads {
    /// Bytes of payloads so far.
    pub(crate) fn used(&self) -> usize {
        self.used
    }

    /// All payloads so far.
    pub(crate) fn get(&self) -> &[u8] {
        &self.bytes[..self.used]
    }

    /// Reserves memory for a payload, to be filled and then kept. The frame has no more than `most` bytes.
    pub(crate) fn reserve(&mut self, bytes: usize, most: usize) -> Result<&mut [u8], ErrorKind> {
        let end = self.used + bytes;
        if self.used == 0 && self.bytes.capacity() < bytes {
            // Nothing in it to copy.
            let wanted = grown(self.bytes.capacity(), bytes, most);
            self.bytes = Vec::new();
            reserve_exact(&mut self.bytes, wanted)?;
        }
        if self.bytes.len() < end {
            let more = end - self.bytes.len();
            reserve_bounded(&mut self.bytes, more, most)?;
            self.bytes.resize(end, 0);
        }
        Ok(&mut self.bytes[self.used..end])
    }

    /// Keeps what the reserved memory was filled with: all payloads with it, and where it lies in them.
    pub(crate) fn keep(&mut self, bytes: usize) -> (&mut [u8], Range<usize>) {
        let start = self.used;
        self.used += bytes;
        (&mut self.bytes[..self.used], start..self.used)
    }

    /// Forgets all payloads but the first `bytes` of them.
    pub(crate) fn truncate(&mut self, bytes: usize) {
        self.used = self.used.min(bytes);
    }

    /// Forgets the payloads; keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.used = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames that grow byte by byte cost few allocations, and none above what a frame may have.
    #[test]
    fn memory_of_payloads_doubles_within_the_frame() {
        let mut payloads = Payloads::default();
        let (mut steps, mut kept) = (0, 0);
        for bytes in 1..=1000 {
            assert_eq!(payloads.reserve(bytes, 1000).unwrap().len(), bytes);
            let capacity = payloads.bytes.capacity();
            steps += u32::from(capacity != kept);
            kept = capacity;
            assert!((bytes..=1000).contains(&kept));
        }
        assert!(steps <= 11, "{steps}");
    }
}
