//! Unpacking of record payloads.

use super::header::Packing;
#[cfg(not(dapple_without_zstd))]
use super::zstd::ZstdDecoders;
use super::{lz4, zstd};
use crate::error::{ErrorDetail, ErrorKind};

/// Unpacks payloads; keeps its tables from one to the next.
#[derive(Default)]
pub(crate) struct Unpacker {
    #[cfg(not(dapple_without_zstd))]
    zstd: ZstdDecoders,
}

impl Unpacker {
    /// Rejects what the lengths alone show to be impossible, before `unpacked` bytes are reserved.
    pub(crate) fn check_lengths(
        packing: u8,
        stored: u32,
        unpacked: u32,
    ) -> Result<Packing, ErrorDetail> {
        let (stored, unpacked) = (u64::from(stored), u64::from(unpacked));
        let (packing, possible) = match packing {
            0 => (Packing::None, stored == unpacked),
            1 => (Packing::Lz4, unpacked <= stored * lz4::RATIO),
            2 if cfg!(not(dapple_without_zstd)) => {
                (Packing::Zstd, unpacked <= stored / 4 * zstd::BLOCK_BYTES)
            }
            _ => return Err(ErrorDetail::found(ErrorKind::Compression, packing)),
        };
        if possible {
            Ok(packing)
        } else {
            Err(ErrorKind::Length.into())
        }
    }

    /// Checks a packed payload as far as that needs no unpacking: its lengths, and the headers of a
    /// zstd frame.
    pub(crate) fn check(
        packing: Packing,
        stored: &[u8],
        unpacked: usize,
        window_limit: u32,
    ) -> Result<(), ErrorDetail> {
        Unpacker::check_lengths(packing as u8, stored.len() as u32, unpacked as u32)?;
        if packing == Packing::Zstd {
            zstd::check_frame(stored, unpacked, window_limit)?;
        }
        Ok(())
    }

    /// Fills `out`, whose length the record header gave, from `stored`.
    pub(crate) fn unpack(
        &mut self,
        packing: Packing,
        stored: &[u8],
        out: &mut [u8],
        window_limit: u32,
    ) -> Result<(), ErrorDetail> {
        match packing {
            Packing::None => {
                if stored.len() != out.len() {
                    return Err(ErrorKind::Length.into());
                }
                out.copy_from_slice(stored);
                Ok(())
            }
            Packing::Lz4 => lz4::unpack(stored, out).map_err(ErrorDetail::from),
            #[cfg(not(dapple_without_zstd))]
            Packing::Zstd => self.zstd.unpack(stored, out, window_limit),
            #[cfg(dapple_without_zstd)]
            Packing::Zstd => {
                let _ = window_limit;
                Err(ErrorDetail::found(ErrorKind::Compression, 2u8))
            }
        }
    }

    /// The most bytes that the decompressors have allocated at once. lz4 takes none.
    pub(crate) fn heap_bytes(window: u32) -> u64 {
        zstd::heap_bytes(window)
    }
}
