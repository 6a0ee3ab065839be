//! Limits of a decoder.

use crate::call::put;
use dapple_codec as codec;

/// Upper bounds that every length in a stream is compared with before memory is reserved for it.
/// `dapple_limits_default` fills it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Limits {
    /// Bytes of decoded state of all tracks.
    pub state_bytes: u64,
    /// Bytes of one record's payload as stored.
    pub stored_bytes: u32,
    /// Bytes of one record's payload unpacked.
    pub unpacked_bytes: u32,
    /// Unpacked bytes of all model records of one frame.
    pub frame_bytes: u32,
    /// Window of a zstd frame.
    pub zstd_window_bytes: u32,
    /// Tracks that are declared and not removed.
    pub tracks: u32,
    /// UTF-8 bytes of a track's path.
    pub path_bytes: u32,
    /// Steps of work for each byte of the stream so far.
    pub work_per_byte: u32,
    /// 0.
    pub reserved: u32,
}

impl From<codec::Limits> for Limits {
    fn from(limits: codec::Limits) -> Limits {
        Limits {
            state_bytes: limits.state_bytes,
            stored_bytes: limits.stored_bytes,
            unpacked_bytes: limits.unpacked_bytes,
            frame_bytes: limits.frame_bytes,
            zstd_window_bytes: limits.zstd_window_bytes,
            tracks: limits.tracks,
            path_bytes: limits.path_bytes,
            work_per_byte: limits.work_per_byte,
            reserved: 0,
        }
    }
}

impl From<Limits> for codec::Limits {
    fn from(limits: Limits) -> codec::Limits {
        codec::Limits {
            state_bytes: limits.state_bytes,
            stored_bytes: limits.stored_bytes,
            unpacked_bytes: limits.unpacked_bytes,
            frame_bytes: limits.frame_bytes,
            zstd_window_bytes: limits.zstd_window_bytes,
            tracks: limits.tracks,
            path_bytes: limits.path_bytes,
            work_per_byte: limits.work_per_byte,
        }
    }
}

/// Limits of the caller's, or the defaults where there are none.
///
/// # Safety
/// `limits` is null, or there is a value.
pub(crate) unsafe fn limits_or_default(limits: *const Limits) -> codec::Limits {
    match limits.is_null() || !limits.is_aligned() {
        true => codec::Limits::default(),
        // SAFETY: the caller's promise.
        false => unsafe { *limits }.into(),
    }
}

/// Writes the default limits, which suit scenes of some hundred megabytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_limits_default(limits: *mut Limits) {
    // SAFETY: the caller's promise.
    let _ = unsafe { put(limits, codec::Limits::default().into()) };
}

/// The most bytes that a decoder with these limits ever has allocated at once, whatever it is fed. Null
/// stands for the default limits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_limits_heap_bytes(limits: *const Limits) -> u64 {
    // SAFETY: the caller's promise.
    unsafe { limits_or_default(limits) }.heap_bytes()
}
