//! Builds streams byte by byte: every field can be given a value that no encoder writes, and the
//! checksums above it are recomputed, so that the fault which is meant is the first that a decoder
//! meets.
//!
//! Nothing here uses the codec's own writer: layouts are written out once more, from `spec/`.

use std::hash::Hasher as _;

use dapple_codec::container::crc32c;
use twox_hash::XxHash64;

/// Record types of the specification.
pub mod kind {
    pub const STREAM: u16 = 0x01;
    pub const GROUP: u16 = 0x02;
    pub const TRACK: u16 = 0x03;
    pub const TRACK_REMOVE: u16 = 0x04;
    pub const TRANSFORMS: u16 = 0x05;
    pub const COMMIT: u16 = 0x06;
    pub const END: u16 = 0x07;
    pub const SEEK_INDEX: u16 = 0x10;
    pub const POINTS: u16 = 0x20;
    pub const PROBES: u16 = 0x21;
    pub const VERTICES: u16 = 0x22;
    pub const INSTANCES: u16 = 0x23;
    pub const REGIONS: u16 = 0x24;
}

/// Bytes of a preamble and of a record header.
pub const PREAMBLE: usize = 16;
pub const HEADER: usize = 32;

/// A packing, with what the packer needs to know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pack {
    #[default]
    None,
    Lz4,
    /// Level.
    Zstd(i32),
}

/// A record header's fields as they will stand there; `header_crc` is what the CRC is XORed with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    pub record_type: u16,
    pub critical: bool,
    pub version: u8,
    pub packing: u8,
    pub reserved: u32,
    pub sequence: u64,
    pub stored: u32,
    pub unpacked: u32,
    pub payload_crc: u32,
    pub header_crc: u32,
}

impl Header {
    fn bytes(&self) -> [u8; HEADER] {
        let mut bytes = [0; HEADER];
        let record_type = self.record_type | if self.critical { 0x8000 } else { 0 };
        bytes[0..2].copy_from_slice(&record_type.to_le_bytes());
        bytes[2] = self.version;
        bytes[3] = self.packing;
        bytes[4..8].copy_from_slice(&self.reserved.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[16..20].copy_from_slice(&self.stored.to_le_bytes());
        bytes[20..24].copy_from_slice(&self.unpacked.to_le_bytes());
        bytes[24..28].copy_from_slice(&self.payload_crc.to_le_bytes());
        let crc = crc32c(&bytes[..28]) ^ self.header_crc;
        bytes[28..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }
}

/// A stream that is being written.
#[derive(Clone, Debug)]
pub struct StreamBuilder {
    pub bytes: Vec<u8>,
    /// Sequence number of the next record.
    pub sequence: u64,
    headers: XxHash64,
    /// Offset of each record's header.
    pub starts: Vec<usize>,
}

impl Default for StreamBuilder {
    fn default() -> Self {
        StreamBuilder::new()
    }
}

impl StreamBuilder {
    /// A valid preamble.
    pub fn new() -> StreamBuilder {
        StreamBuilder::with_preamble(1, 0)
    }

    /// A preamble of some version and profile, with its CRC.
    pub fn with_preamble(version: u16, profile: u16) -> StreamBuilder {
        StreamBuilder::with_magic(*b"\x89DPL\r\n\x1a\n", version, profile)
    }

    /// A preamble of some magic, version and profile, with its CRC.
    pub fn with_magic(magic: [u8; 8], version: u16, profile: u16) -> StreamBuilder {
        let mut bytes = magic.to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend(profile.to_le_bytes());
        bytes.extend(crc32c(&bytes).to_le_bytes());
        let mut headers = XxHash64::with_seed(0);
        headers.write(&bytes);
        StreamBuilder {
            bytes,
            sequence: 0,
            headers,
            starts: Vec::new(),
        }
    }

    /// A preamble and the usual `stream` record: 60 ticks a second.
    pub fn started() -> StreamBuilder {
        let mut builder = StreamBuilder::new();
        builder.put(kind::STREAM, &words(&[60, 1]));
        builder
    }

    /// Appends a critical record, as it is.
    pub fn put(&mut self, record_type: u16, payload: &[u8]) -> &mut StreamBuilder {
        self.put_with(record_type, Pack::None, payload, |_| {})
    }

    /// Appends a critical record, packed.
    pub fn put_packed(
        &mut self,
        record_type: u16,
        pack: Pack,
        payload: &[u8],
    ) -> &mut StreamBuilder {
        self.put_with(record_type, pack, payload, |_| {})
    }

    /// Appends a record whose header fields `change` may alter before its CRC is computed.
    pub fn put_with(
        &mut self,
        record_type: u16,
        pack: Pack,
        payload: &[u8],
        change: impl FnOnce(&mut Header),
    ) -> &mut StreamBuilder {
        let stored = packed(pack, payload);
        self.put_stored(record_type, pack, payload.len(), &stored, change)
    }

    /// Appends a record whose payload is packed already.
    pub fn put_stored(
        &mut self,
        record_type: u16,
        pack: Pack,
        unpacked: usize,
        stored: &[u8],
        change: impl FnOnce(&mut Header),
    ) -> &mut StreamBuilder {
        let mut header = Header {
            record_type,
            critical: true,
            version: 0,
            packing: match pack {
                Pack::None => 0,
                Pack::Lz4 => 1,
                Pack::Zstd(_) => 2,
            },
            reserved: 0,
            sequence: self.sequence,
            stored: stored.len() as u32,
            unpacked: unpacked as u32,
            payload_crc: crc32c(stored),
            header_crc: 0,
        };
        change(&mut header);
        let bytes = header.bytes();
        self.starts.push(self.bytes.len());
        self.headers.write(&bytes);
        self.bytes.extend(bytes);
        self.bytes.extend(stored);
        self.sequence += 1;
        self
    }

    /// Offset of the last record's header.
    pub fn last(&self) -> usize {
        self.starts.last().copied().unwrap_or(PREAMBLE)
    }

    /// Appends the `end` record that fits.
    pub fn end(&mut self) -> &mut StreamBuilder {
        let payload = self.end_payload();
        self.put(kind::END, &payload)
    }

    /// The payload of the `end` record that fits.
    pub fn end_payload(&self) -> Vec<u8> {
        let mut payload = self.sequence.to_le_bytes().to_vec();
        payload.extend(self.headers.finish().to_le_bytes());
        payload
    }

    /// The stream so far with an `end` record.
    pub fn ended(&self) -> Vec<u8> {
        self.clone().end().bytes.clone()
    }
}

/// Packs a payload.
pub fn packed(pack: Pack, payload: &[u8]) -> Vec<u8> {
    match pack {
        Pack::None => payload.to_vec(),
        Pack::Lz4 => {
            let mut block = vec![0; lz4_flex::block::get_maximum_output_size(payload.len())];
            let bytes = lz4_flex::block::compress_into(payload, &mut block);
            block.truncate(bytes.unwrap_or_default());
            block
        }
        // One plain frame with its content size, which is what the library writes by default.
        Pack::Zstd(level) => zstd::bulk::compress(payload, level).unwrap_or_default(),
    }
}

/// Little-endian 32-bit words.
pub fn words(values: &[u32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Little-endian bits of floats.
pub fn floats(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

/// Replaces the word at an offset.
pub fn set_word(payload: &mut [u8], offset: usize, value: u32) {
    payload[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
}

/// Payload of a `group` record.
pub fn group(id: u32, start: u32, digest: u64) -> Vec<u8> {
    let mut payload = words(&[id, start]);
    payload.extend(digest.to_le_bytes());
    payload
}

/// Payload of a `track remove` record.
pub fn removal(ids: &[u32]) -> Vec<u8> {
    let mut payload = words(&[ids.len() as u32]);
    payload.extend(words(ids));
    payload
}

/// Payload of a `transforms` record.
pub fn transforms(entries: &[(u32, [f32; 12])]) -> Vec<u8> {
    let mut payload = words(&[entries.len() as u32, 0]);
    for (id, rows) in entries {
        payload.extend(id.to_le_bytes());
        payload.extend(floats(rows));
    }
    payload
}

/// Payload of a `commit` record.
pub fn commit(tick: u64, frame: u32, digest: Option<u64>) -> Vec<u8> {
    let mut payload = tick.to_le_bytes().to_vec();
    payload.extend(words(&[frame, u32::from(digest.is_some())]));
    payload.extend(digest.iter().flat_map(|digest| digest.to_le_bytes()));
    payload
}

/// The identity as rows of a 3x4 matrix.
pub const IDENTITY: [f32; 12] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0.];
