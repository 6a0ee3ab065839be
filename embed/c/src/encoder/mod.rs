//! The encoder's handle: a stream that grows, call by call.

mod content;
mod declare;

pub use content::*;

use alloc::string::ToString as _;
use alloc::vec::Vec;
use core::ffi::c_char;

use dapple_codec as codec;
use dapple_codec::{Encoder as Codec, EncoderConfig as Config, GroupStart, LookupSpace};

use crate::call::{self, ARGUMENT, Handle, Status, catch, into_handle, items, put, with};
use crate::error::{ERROR_NOT_BUILT, ERROR_PANIC, ErrorInfo, LastError, NO_MEMORY, status, text};
use crate::limits::{Limits, limits_or_default};
use crate::numbers;
use crate::track::Track;
use declare::to_model;

/// Writes a stream, record by record. Unlike a decoder, it ends the program where memory runs out.
pub struct Encoder {
    pub(crate) codec: Codec,
    pub(crate) out: Vec<u8>,
    error: LastError,
    broken: bool,
}

impl Handle for Encoder {
    fn broken(&mut self) -> &mut bool {
        &mut self.broken
    }

    fn last_error(&mut self) -> &mut LastError {
        &mut self.error
    }
}

/// How a stream is written. `dapple_encoder_config_default` fills it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct EncoderConfig {
    /// Limits of the decoders that shall read the stream: what exceeds them is refused.
    pub limits: Limits,
    /// Ticks...
    pub ticks: u32,
    /// ...in so many seconds.
    pub seconds: u32,
}

/// A transform of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Transform {
    /// Id of the track.
    pub track: u32,
    /// Rows of a 3x4 matrix, world space from grid space: a rotation and a translation.
    pub world_from_grid: [f32; 12],
}

impl From<Config> for EncoderConfig {
    fn from(config: Config) -> EncoderConfig {
        EncoderConfig {
            limits: config.limits.into(),
            ticks: config.tick_rate.numerator,
            seconds: config.tick_rate.denominator,
        }
    }
}

/// Calls the encoder's codec, and keeps its error.
///
/// # Safety
/// As of [`with`].
pub(crate) unsafe fn encode(
    encoder: *mut Encoder,
    f: impl FnOnce(&mut Codec, &mut Vec<u8>) -> Result<codec::Result<u32>, Status>,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        with(encoder, |encoder| {
            let result = f(&mut encoder.codec, &mut encoder.out)?;
            let number = result.map_err(|error| encoder.error.set(error))?;
            Ok(number as Status)
        })
    }
}

/// The packing of a number; -9004 where the library cannot.
pub(crate) fn compression(number: u32) -> Result<codec::Compression, Status> {
    const NONE: u32 = numbers::Compression::None as u32;
    const LZ4: u32 = numbers::Compression::Lz4 as u32;
    const ZSTD: u32 = numbers::Compression::Zstd as u32;
    match number {
        NONE => Ok(codec::Compression::None),
        LZ4 => Ok(codec::Compression::Lz4),
        ZSTD if cfg!(feature = "zstd-native") => Ok(codec::Compression::PAPER),
        ZSTD => Err(-(ERROR_NOT_BUILT as Status)),
        _ => Err(ARGUMENT),
    }
}

/// Writes the default configuration: 60 ticks a second, default limits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_config_default(config: *mut EncoderConfig) {
    // SAFETY: the caller's promise.
    let _ = unsafe { put(config, Config::default().into()) };
}

/// An encoder, which has written the head of its stream. Null `config` is the default one. Null where there
/// is no memory, or the configuration is refused; `status`, if not null, gets 0 or minus the id of an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_new(
    config: *const EncoderConfig,
    status: *mut i32,
) -> *mut Encoder {
    let mut codec_config = Config::default();
    // SAFETY: the caller's promise.
    unsafe {
        if let Some(config) = config.as_ref() {
            codec_config.limits = limits_or_default(&config.limits);
            codec_config.tick_rate.numerator = config.ticks;
            codec_config.tick_rate.denominator = config.seconds;
        }
        let mut out = Vec::new();
        let made = catch(|| Codec::new(codec_config, &mut out));
        let (encoder, result) = match made {
            Some(Ok(codec)) => {
                let encoder = into_handle(Encoder {
                    codec,
                    out,
                    error: LastError::default(),
                    broken: false,
                });
                (encoder, if encoder.is_null() { NO_MEMORY } else { 0 })
            }
            Some(Err(error)) => (core::ptr::null_mut(), self::status(&error)),
            None => (core::ptr::null_mut(), -(ERROR_PANIC as Status)),
        };
        let _ = put(status, result);
        encoder
    }
}

/// Frees an encoder and the bytes that it still has. Null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_free(encoder: *mut Encoder) {
    // SAFETY: the caller's promise.
    unsafe { call::free(encoder) };
}

/// Declares tracks, ids ascending: `id`, `model`, `coding`, `space`, bounds, path and parameters of each, and
/// `content_hash` and `application_id` where it has them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_tracks(
    encoder: *mut Encoder,
    tracks: *const Track,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let tracks = items(tracks, count)?.iter().map(|track| to_track(track));
            let tracks: Result<Vec<codec::Track>, Status> = tracks.collect();
            Ok(codec.tracks(out, &tracks?).map(|()| 0))
        })
    }
}

/// The track that C declares.
///
/// # Safety
/// The path and the parameters are there.
unsafe fn to_track(track: &Track) -> Result<codec::Track, Status> {
    // SAFETY: the caller's promise.
    let (path, model) = unsafe {
        let path = items(track.path.cast::<u8>(), track.path_size)?;
        (path, to_model(track.model, track.coding, &track.parameters))
    };
    let path = core::str::from_utf8(path).map_err(|_| ARGUMENT)?;
    Ok(codec::Track {
        id: track.id,
        target: codec::Target {
            application_id: track.application_id,
            path: path.to_string(),
            content_hash: (track.has_content_hash != 0).then_some(track.content_hash),
        },
        aabb_min: track.aabb_min,
        aabb_max: track.aabb_max,
        space: match track.space {
            0 => LookupSpace::Mesh,
            1 => LookupSpace::Rest,
            _ => return Err(ARGUMENT),
        },
        model: model.ok_or(ARGUMENT)?,
    })
}

/// Ends tracks at the next commit; ids ascend.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_remove_tracks(
    encoder: *mut Encoder,
    ids: *const u32,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let ids = items(ids, count)?;
            Ok(codec.remove_tracks(out, ids).map(|()| 0))
        })
    }
}

/// Starts a group. Without a `digest` (null) its first frame must have a keyframe of every track that is not to
/// be empty; with one it builds on the state of that digest, which is that of the last commit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_group(encoder: *mut Encoder, digest: *const u64) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        let start = digest.as_ref().copied();
        let start = start.map_or(GroupStart::Keyframes, GroupStart::State);
        encode(encoder, |codec, out| {
            Ok(codec.group(out, start).map(|()| 0))
        })
    }
}

/// Transforms of the frame, ids ascending; at most one call a frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_transforms(
    encoder: *mut Encoder,
    transforms: *const Transform,
    count: usize,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let transforms = items(transforms, count)?.iter().map(|transform| {
                let rows = bytemuck::cast(transform.world_from_grid);
                let rows = codec::Transform {
                    world_from_grid: rows,
                };
                (transform.track, rows)
            });
            let transforms: Vec<_> = transforms.collect();
            let lz4 = codec::Compression::Lz4;
            Ok(codec.transforms(out, &transforms, lz4).map(|()| 0))
        })
    }
}

/// Makes the frame visible at a tick, which may not be before the last one's. Returns the frame's number in
/// the lower 31 bits, or minus the id of an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_commit(encoder: *mut Encoder, tick: u64) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        encode(encoder, |codec, out| {
            let frame = codec.commit(out, tick, None);
            Ok(frame.map(|number| number & 0x7fff_ffff))
        })
    }
}

/// Ends the stream; every call that writes is refused after it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_end(encoder: *mut Encoder) -> i32 {
    // SAFETY: the caller's promise.
    unsafe { encode(encoder, |codec, out| Ok(codec.end(out).map(|()| 0))) }
}

/// Writes where the bytes are that were written since `dapple_encoder_clear`, and how many. They hold until the
/// next call that writes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_bytes(
    encoder: *mut Encoder,
    bytes: *mut *const u8,
    size: *mut usize,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(encoder, |encoder| {
            put(size, encoder.out.len())?;
            put(bytes, encoder.out.as_ptr())
        })
    }
}

/// Forgets the bytes that were taken; keeps the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_clear(encoder: *mut Encoder) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(encoder, |encoder| {
            encoder.out.clear();
            Ok(0)
        })
    }
}

/// Writes the digest of the state of the last commit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_state_digest(
    encoder: *mut Encoder,
    digest: *mut u64,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe { with(encoder, |encoder| put(digest, encoder.codec.state_digest())) }
}

/// Writes the last error of a call with this encoder; all zeros where there was none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_error(encoder: *const Encoder, error: *mut ErrorInfo) {
    // SAFETY: the caller's promise.
    unsafe {
        if let Some(encoder) = encoder.as_ref() {
            let _ = put(error, encoder.error.info);
        }
    }
}

/// Writes the last error as a sentence and a 0 to `out`, which has `size` bytes; what does not fit is cut off.
/// Returns the length of the sentence.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_encoder_error_message(
    encoder: *const Encoder,
    out: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: the caller's promise.
    unsafe {
        let Some(encoder) = encoder.as_ref() else {
            return text(out, size, |_| Ok(()));
        };
        text(out, size, |text| encoder.error.sentence(text))
    }
}
