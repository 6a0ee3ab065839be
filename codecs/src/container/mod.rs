//! The container: preamble, record headers, checksums, compression (`spec/container.md`).

pub(crate) mod crc;
mod header;
mod lz4;
pub(crate) mod pack;
mod preamble;
pub(crate) mod unpack;
#[cfg_attr(dapple_without_zstd, allow(dead_code))]
pub(crate) mod zstd;

pub(crate) use crc::crc32c_copy;
pub use header::{HEADER_BYTES, Packing, RecordHeader, record_type};
pub use pack::Compression;
pub use preamble::{CONTAINER_VERSION, MAGIC, PREAMBLE_BYTES, Preamble, profile};

/// CRC-32C (Castagnoli, reflected, initial value and final XOR all ones) of `bytes`.
pub fn crc32c(bytes: &[u8]) -> u32 {
    crc::crc32c(bytes)
}
