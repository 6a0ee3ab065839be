//! The thirty-two bytes before a record's payload.

use super::crc::crc32c;
use crate::error::ErrorKind;

/// Size of a record header.
pub const HEADER_BYTES: usize = 32;
/// The bit of the type field that says that a decoder must understand the record.
const CRITICAL: u16 = 0x8000;

/// Numbers of the record types. What is reserved has a number here and no meaning yet.
pub mod record_type {
    /// Tick rate; the first record.
    pub const STREAM: u16 = 0x01;
    /// Start of a group.
    pub const GROUP: u16 = 0x02;
    /// Declares tracks.
    pub const TRACK: u16 = 0x03;
    /// Ends tracks.
    pub const TRACK_REMOVE: u16 = 0x04;
    /// Instance transforms of the frame.
    pub const TRANSFORMS: u16 = 0x05;
    /// Makes the frame visible.
    pub const COMMIT: u16 = 0x06;
    /// End of the stream.
    pub const END: u16 = 0x07;
    /// Reserved: seek index.
    pub const SEEK_INDEX: u16 = 0x10;
    /// Content of `points` tracks.
    pub const POINTS: u16 = 0x20;
    /// Content of `probes` tracks.
    pub const PROBES: u16 = 0x21;
    /// Content of `vertices` tracks.
    pub const VERTICES: u16 = 0x22;
    /// Reserved: content of `instances` tracks.
    pub const INSTANCES: u16 = 0x23;
    /// Content of `regions` tracks.
    pub const REGIONS: u16 = 0x24;
    /// Reserved: uplink, camera pose.
    pub const CAMERA_POSE: u16 = 0x40;
    /// Reserved: uplink, scene update.
    pub const SCENE_UPDATE: u16 = 0x41;
    /// Reserved: uplink, acknowledgement of a frame.
    pub const ACKNOWLEDGE: u16 = 0x42;
    /// Reserved: uplink, request of a keyframe.
    pub const REFRESH: u16 = 0x43;

    /// The name of a type, for reports.
    pub fn name(number: u16) -> &'static str {
        match number {
            STREAM => "stream",
            GROUP => "group",
            TRACK => "track",
            TRACK_REMOVE => "track-remove",
            TRANSFORMS => "transforms",
            COMMIT => "commit",
            END => "end",
            SEEK_INDEX => "seek-index",
            POINTS => "points",
            PROBES => "probes",
            VERTICES => "vertices",
            INSTANCES => "instances",
            REGIONS => "regions",
            CAMERA_POSE => "camera-pose",
            SCENE_UPDATE => "scene-update",
            ACKNOWLEDGE => "acknowledge",
            REFRESH => "refresh",
            _ => "unknown",
        }
    }

    /// A record of the container itself. Those of models are in the registry of models.
    pub(crate) fn is_of_container(number: u16) -> bool {
        matches!(number, STREAM..=END)
    }
}

/// How a payload is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Packing {
    /// As it is.
    None = 0,
    /// One lz4 block.
    Lz4 = 1,
    /// One zstd frame.
    Zstd = 2,
}

/// A record header whose checksum matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordHeader {
    /// One of [`record_type`], without the critical bit.
    pub record_type: u16,
    /// A decoder that does not know the type must stop.
    pub critical: bool,
    /// Version of the record's own coding.
    pub version: u8,
    /// How the payload is packed: a [`Packing`] number, or one that is unknown.
    pub packing: u8,
    /// Position in the stream, counted from 0.
    pub sequence: u64,
    /// Bytes of payload that follow.
    pub stored_bytes: u32,
    /// Bytes of payload after unpacking.
    pub unpacked_bytes: u32,
    /// CRC-32C of the stored payload.
    pub payload_crc: u32,
}

impl RecordHeader {
    /// Reads a header. Its checksum and reserved bits are checked, nothing else is.
    ///
    /// # Errors
    /// 1005 and 1006, at offset 0 of `bytes`.
    pub fn read(bytes: &[u8; HEADER_BYTES]) -> crate::Result<RecordHeader> {
        RecordHeader::parse(bytes).map_err(|fault| crate::error::ErrorDetail::from(fault).at(0))
    }

    pub(crate) fn parse(bytes: &[u8; HEADER_BYTES]) -> Result<RecordHeader, ErrorKind> {
        let u32_at =
            |i: usize| u32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
        if crc32c(&bytes[..28]) != u32_at(28) {
            return Err(ErrorKind::HeaderChecksum);
        }
        if u32_at(4) != 0 {
            return Err(ErrorKind::HeaderReserved);
        }
        let type_and_flag = u16::from_le_bytes([bytes[0], bytes[1]]);
        Ok(RecordHeader {
            record_type: type_and_flag & !CRITICAL,
            critical: type_and_flag & CRITICAL != 0,
            version: bytes[2],
            packing: bytes[3],
            sequence: u64::from(u32_at(8)) | u64::from(u32_at(12)) << 32,
            stored_bytes: u32_at(16),
            unpacked_bytes: u32_at(20),
            payload_crc: u32_at(24),
        })
    }

    /// The thirty-two bytes of the header.
    pub fn to_bytes(&self) -> [u8; HEADER_BYTES] {
        let flag = if self.critical { CRITICAL } else { 0 };
        let mut bytes = [0; HEADER_BYTES];
        bytes[0..2].copy_from_slice(&(self.record_type & !CRITICAL | flag).to_le_bytes());
        bytes[2] = self.version;
        bytes[3] = self.packing;
        bytes[8..16].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[16..20].copy_from_slice(&self.stored_bytes.to_le_bytes());
        bytes[20..24].copy_from_slice(&self.unpacked_bytes.to_le_bytes());
        bytes[24..28].copy_from_slice(&self.payload_crc.to_le_bytes());
        let crc = crc32c(&bytes[..28]);
        bytes[28..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }
}
