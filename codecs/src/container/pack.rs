//! Packing of record payloads, where that makes them smaller.

use alloc::vec::Vec;

use super::header::Packing;
use crate::error::ErrorKind;

/// How an encoder packs a payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// lz4 block: the fastest to unpack.
    Lz4,
    /// zstd frame. Needs the feature `zstd-native`.
    Zstd {
        /// Level, 1 to 19.
        level: i32,
        /// Use the `lazy` strategy (number 4) whatever the level would choose.
        lazy: bool,
    },
}

impl Compression {
    /// zstd as PSAO §4 uses it: level 15, strategy 4.
    pub const PAPER: Compression = Compression::Zstd {
        level: 15,
        lazy: true,
    };
}

/// The window that zstd takes of itself at level 19, for large payloads.
#[cfg(feature = "zstd-native")]
const LARGEST_WINDOW: u32 = 8 << 20;

/// Packs payloads; keeps its tables from one to the next.
#[derive(Default)]
pub(crate) struct Packer {
    #[cfg(feature = "zstd-native")]
    zstd: Option<(Compression, zstd::bulk::Compressor<'static>)>,
}

impl Packer {
    /// Appends `payload` to `out`, packed if that makes it smaller; a zstd frame needs a window of
    /// `window` bytes at most, or of 1 KiB. Returns how it was packed.
    pub(crate) fn pack(
        &mut self,
        compression: Compression,
        payload: &[u8],
        window: u32,
        out: &mut Vec<u8>,
    ) -> Result<Packing, ErrorKind> {
        let start = out.len();
        let (packing, bytes) = match compression {
            Compression::None => (Packing::None, payload.len()),
            Compression::Lz4 => {
                out.resize(
                    start + lz4_flex::block::get_maximum_output_size(payload.len()),
                    0,
                );
                let bytes = lz4_flex::block::compress_into(payload, &mut out[start..])
                    .map_err(|_| ErrorKind::EncoderUse)?;
                (Packing::Lz4, bytes)
            }
            Compression::Zstd { level, lazy } => {
                let bytes = self.zstd((level, lazy), payload, window, out)?;
                (Packing::Zstd, bytes)
            }
        };
        if packing == Packing::None || bytes >= payload.len() {
            out.truncate(start);
            out.extend_from_slice(payload);
            return Ok(Packing::None);
        }
        out.truncate(start + bytes);
        Ok(packing)
    }

    #[cfg(feature = "zstd-native")]
    fn zstd(
        &mut self,
        (level, lazy): (i32, bool),
        payload: &[u8],
        window: u32,
        out: &mut Vec<u8>,
    ) -> Result<usize, ErrorKind> {
        use zstd::zstd_safe::{CParameter, Strategy};
        let level = level.clamp(1, 19);
        let wanted = Compression::Zstd { level, lazy };
        if self.zstd.as_ref().is_none_or(|(kept, _)| *kept != wanted) {
            let mut compressor =
                zstd::bulk::Compressor::new(level).map_err(|_| ErrorKind::EncoderUse)?;
            if lazy {
                compressor
                    .set_parameter(CParameter::Strategy(Strategy::ZSTD_lazy))
                    .map_err(|_| ErrorKind::EncoderUse)?;
            }
            if window < LARGEST_WINDOW {
                let log = window.checked_ilog2().unwrap_or(0).max(10);
                compressor
                    .set_parameter(CParameter::WindowLog(log))
                    .map_err(|_| ErrorKind::EncoderUse)?;
            }
            self.zstd = Some((wanted, compressor));
        }
        let (_, compressor) = self.zstd.as_mut().ok_or(ErrorKind::EncoderUse)?;
        let start = out.len();
        out.resize(start + zstd::zstd_safe::compress_bound(payload.len()), 0);
        compressor
            .compress_to_buffer(payload, &mut out[start..])
            .map_err(|_| ErrorKind::EncoderUse)
    }

    #[cfg(not(feature = "zstd-native"))]
    fn zstd(
        &mut self,
        _: (i32, bool),
        _: &[u8],
        _: u32,
        _: &mut Vec<u8>,
    ) -> Result<usize, ErrorKind> {
        Err(ErrorKind::EncoderUse)
    }
}
