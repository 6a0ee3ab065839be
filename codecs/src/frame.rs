//! A frame: the payloads of the pending one, and what is told of one that was committed.

use alloc::vec::Vec;
use core::ops::Range;

use crate::error::ErrorKind;
use crate::reserve::{grown, reserve_bounded, reserve_exact};

/// A frame that was committed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameInfo {
    /// Frame number; ascends, and may leave numbers out.
    pub number: u32,
    /// Time in ticks of the stream's [`TickRate`](crate::TickRate).
    pub tick: u64,
    /// Buckets that the frame carried.
    pub buckets: u32,
    /// Cells that the frame carried.
    pub cells: u32,
    /// Probes that the frame carried: those that it changed.
    pub probes: u32,
    /// Transforms that the frame carried.
    pub transforms: u32,
}

/// Payloads of the pending frame, one after the other: one buffer for the model records of all
/// models, so that the limit of a frame bounds it once.
#[derive(Default)]
pub(crate) struct FrameBytes {
    /// The first `used` bytes are payloads; the rest is kept from earlier frames.
    bytes: Vec<u8>,
    used: usize,
}

impl FrameBytes {
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
        let mut frame = FrameBytes::default();
        let (mut steps, mut kept) = (0, 0);
        for bytes in 1..=1000 {
            assert_eq!(frame.reserve(bytes, 1000).unwrap().len(), bytes);
            let capacity = frame.bytes.capacity();
            steps += u32::from(capacity != kept);
            kept = capacity;
            assert!((bytes..=1000).contains(&kept));
        }
        assert!(steps <= 11, "{steps}");
    }
}
