//! Records byte by byte, with valid checksums and any content.

use std::hash::Hasher as _;

use dapple_codec::container::{HEADER_BYTES, MAGIC, Packing, RecordHeader, crc32c};
use twox_hash::XxHash64;

/// What an `end` record states of the records before it.
pub struct EndDigest {
    headers: XxHash64,
    records: u64,
}

impl EndDigest {
    /// After the preamble.
    pub fn new(preamble: &[u8]) -> EndDigest {
        let mut headers = XxHash64::with_seed(0);
        headers.write(preamble);
        EndDigest {
            headers,
            records: 0,
        }
    }

    /// After one more record header.
    pub fn record(&mut self, header: &[u8]) {
        self.headers.write(header);
        self.records += 1;
    }

    /// Records so far.
    pub fn records(&self) -> u64 {
        self.records
    }

    /// The payload of an `end` record that comes now.
    pub fn end_payload(&self) -> [u8; 16] {
        let mut payload = [0; 16];
        payload[..8].copy_from_slice(&self.records.to_le_bytes());
        payload[8..].copy_from_slice(&self.headers.finish().to_le_bytes());
        payload
    }
}

/// Writes a stream record by record; nothing is checked.
pub struct StreamBuilder {
    /// What was written.
    pub bytes: Vec<u8>,
    /// What an `end` record would state.
    pub end: EndDigest,
}

impl Default for StreamBuilder {
    fn default() -> Self {
        StreamBuilder::new()
    }
}

impl StreamBuilder {
    /// A stream with its preamble.
    pub fn new() -> StreamBuilder {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0, 0, 0]);
        let crc = crc32c(&bytes);
        bytes.extend(crc.to_le_bytes());
        let end = EndDigest::new(&bytes);
        StreamBuilder { bytes, end }
    }

    /// Appends a record whose header may be changed before its checksum is made.
    pub fn record(
        &mut self,
        record_type: u16,
        payload: &[u8],
        packing: Packing,
        change: impl FnOnce(&mut RecordHeader),
    ) {
        let stored = pack(packing, payload);
        let mut header = RecordHeader {
            record_type,
            critical: true,
            version: 0,
            packing: packing as u8,
            sequence: self.end.records(),
            stored_bytes: stored.len() as u32,
            unpacked_bytes: payload.len() as u32,
            payload_crc: crc32c(&stored),
        };
        change(&mut header);
        let head = header.to_bytes();
        self.end.record(&head);
        self.bytes.extend(head);
        self.bytes.extend(stored);
    }
}

/// Packs without a search: literals and raw blocks only.
pub fn pack(packing: Packing, payload: &[u8]) -> Vec<u8> {
    match packing {
        Packing::None => payload.to_vec(),
        Packing::Lz4 => {
            let mut block = vec![(payload.len().min(15) as u8) << 4];
            if payload.len() >= 15 {
                let mut rest = payload.len() - 15;
                while rest >= 255 {
                    block.push(255);
                    rest -= 255;
                }
                block.push(rest as u8);
            }
            block.extend(payload);
            block
        }
        Packing::Zstd => {
            // One segment, content size in four bytes.
            let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
            frame.extend((payload.len() as u32).to_le_bytes());
            let mut blocks = payload.chunks(128 << 10).peekable();
            if blocks.peek().is_none() {
                frame.extend([1, 0, 0]);
            }
            while let Some(block) = blocks.next() {
                let last = u32::from(blocks.peek().is_none());
                let header = (block.len() as u32) << 3 | last;
                frame.extend(&header.to_le_bytes()[..3]);
                frame.extend(block);
            }
            frame
        }
    }
}

/// Starts of the records of a well-framed stream.
pub fn record_starts(bytes: &[u8]) -> Vec<usize> {
    let mut at = dapple_codec::container::PREAMBLE_BYTES;
    let mut starts = Vec::new();
    while at + HEADER_BYTES <= bytes.len() {
        starts.push(at);
        let length = &bytes[at + 16..at + 20];
        let stored = u32::from_le_bytes([length[0], length[1], length[2], length[3]]);
        at += HEADER_BYTES + stored as usize;
    }
    starts
}

/// A stream of a `stream` and an `end` record.
pub fn tiny() -> Vec<u8> {
    let mut builder = StreamBuilder::new();
    builder.record(0x01, &[60, 0, 0, 0, 1, 0, 0, 0], Packing::None, |_| {});
    let end = builder.end.end_payload();
    builder.record(0x07, &end, Packing::None, |_| {});
    builder.bytes
}
