//! Recomputes checksums, so that a mutated stream fails at a later check than the first CRC.

use dapple_codec::container::{HEADER_BYTES, PREAMBLE_BYTES, crc32c};

use crate::stream_builder::EndDigest;

/// What of a mutated stream is recomputed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recompute {
    /// Nothing.
    Nothing,
    /// CRCs of the preamble, the headers and the payloads.
    Checksums,
    /// Also the sequence numbers, the unpacked lengths of records that are not packed, and the
    /// count and digest of `end` records.
    Framing,
}

impl Recompute {
    /// From a byte of the input.
    pub fn choose(byte: u8) -> Recompute {
        match byte % 3 {
            0 => Recompute::Nothing,
            1 => Recompute::Checksums,
            _ => Recompute::Framing,
        }
    }
}

/// Walks the records as their stored lengths say and recomputes fields in place.
pub fn recompute(bytes: &mut [u8], what: Recompute) {
    if what == Recompute::Nothing || bytes.len() < PREAMBLE_BYTES {
        return;
    }
    put(bytes, 12, crc32c(&bytes[..12]));
    let mut digest = EndDigest::new(&bytes[..PREAMBLE_BYTES]);
    let mut at = PREAMBLE_BYTES;
    while bytes.len() - at >= HEADER_BYTES {
        let (head, payload) = bytes[at..].split_at_mut(HEADER_BYTES);
        let stored = u32::from_le_bytes([head[16], head[17], head[18], head[19]]) as usize;
        let payload_bytes = stored.min(payload.len());
        let payload = &mut payload[..payload_bytes];
        if what == Recompute::Framing {
            head[8..16].copy_from_slice(&digest.records().to_le_bytes());
            if head[3] == 0 {
                head.copy_within(16..20, 20);
            }
            let is_end = head[..2] == [0x07, 0x80];
            if is_end && payload.len() == 16 {
                payload.copy_from_slice(&digest.end_payload());
            }
        }
        put(head, 24, crc32c(payload));
        put(head, 28, crc32c(&head[..28]));
        digest.record(head);
        at += HEADER_BYTES + payload_bytes;
    }
}

fn put(bytes: &mut [u8], at: usize, value: u32) {
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
}
