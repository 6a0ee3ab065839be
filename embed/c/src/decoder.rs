//! The decoder's handle: bytes in, events out.

use alloc::vec::Vec;
use core::ffi::c_char;

use dapple_codec as codec;
use dapple_codec::{Decoder as Codec, GroupStart};

use crate::array::DirtyRange;
use crate::call::{self, ARGUMENT, Handle, Status, into_handle, items, put, with};
use crate::error::{ErrorInfo, LastError, text};
use crate::limits::{Limits, limits_or_default};

/// A decoder for one stream after another.
pub struct Decoder {
    pub(crate) codec: Codec,
    limits: codec::Limits,
    /// What changed, once somebody asks for it; none where the state may have changed since.
    pub(crate) dirty: Vec<DirtyRange>,
    pub(crate) dirty_known: bool,
    error: LastError,
    broken: bool,
}

impl Handle for Decoder {
    fn broken(&mut self) -> &mut bool {
        &mut self.broken
    }

    fn last_error(&mut self) -> &mut LastError {
        &mut self.error
    }
}

/// What an event says; fields of other events are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct EventInfo {
    /// `DAPPLE_EVENT_*`.
    pub kind: u32,
    /// Number of the group that starts.
    pub group: u32,
    /// Digest of the state that the group builds on, if `has_digest` is 1.
    pub digest: u64,
    /// Whether the group builds on a state; if not, it starts from keyframes.
    pub has_digest: u32,
    /// Tracks that are new.
    pub tracks_added: u32,
    /// Type of the record that was skipped.
    pub record_type: u32,
    /// Its payload bytes.
    pub stored_bytes: u32,
    /// Ticks...
    pub ticks: u32,
    /// ...in so many seconds.
    pub seconds: u32,
    /// The frame that was committed.
    pub frame: Frame,
}

/// A frame that was committed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Frame {
    /// Time in ticks.
    pub tick: u64,
    /// Frame number; ascends, and may leave numbers out.
    pub number: u32,
    /// Transforms that the frame carried.
    pub transforms: u32,
    /// Items of each model that the frame carried, at `DAPPLE_MODEL_*`; the first is 0.
    pub items: [u32; 6],
}

impl From<codec::Event> for EventInfo {
    fn from(event: codec::Event) -> EventInfo {
        let mut info = EventInfo {
            kind: event.number(),
            ..EventInfo::default()
        };
        match event {
            codec::Event::Stream(rate) => {
                (info.ticks, info.seconds) = (rate.numerator, rate.denominator);
            }
            codec::Event::Group { id, start } => {
                info.group = id;
                if let GroupStart::State(digest) = start {
                    (info.digest, info.has_digest) = (digest, 1);
                }
            }
            codec::Event::Tracks { added } => info.tracks_added = added,
            codec::Event::Frame(frame) => {
                info.frame.tick = frame.tick;
                info.frame.number = frame.number;
                info.frame.transforms = frame.transforms;
                for model in codec::ModelKind::ALL {
                    if let Some(items) = info.frame.items.get_mut(usize::from(model.number())) {
                        *items = frame.count(model);
                    }
                }
            }
            codec::Event::Skipped {
                record_type,
                stored_bytes,
            } => {
                info.record_type = record_type.into();
                info.stored_bytes = stored_bytes;
            }
            _ => {}
        }
        info
    }
}

/// A decoder. Null where there is no memory for it. Null `limits` are the default ones.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_new(limits: *const Limits) -> *mut Decoder {
    // SAFETY: the caller's promise.
    let limits = unsafe { limits_or_default(limits) };
    into_handle(Decoder {
        codec: Codec::new(limits),
        limits,
        dirty: Vec::new(),
        dirty_known: false,
        error: LastError::default(),
        broken: false,
    })
}

/// Frees a decoder and all its memory. Null is left alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_free(decoder: *mut Decoder) {
    // SAFETY: the caller's promise.
    unsafe { call::free(decoder) };
}

/// Feeds bytes, and returns what they came to: `DAPPLE_EVENT_*`, or minus the id of an error. Push the rest
/// again, until `DAPPLE_EVENT_NEED_INPUT`. `used` gets the number of bytes that were used, in both cases;
/// `event`, if not null, what the event says.
///
/// After an error the state of the last frame stays, and every push gives 4011 until `dapple_decoder_resume`
/// or `dapple_decoder_reset`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_push(
    decoder: *mut Decoder,
    bytes: *const u8,
    size: usize,
    used: *mut usize,
    event: *mut EventInfo,
) -> i32 {
    // SAFETY: the caller's promises, here and below.
    unsafe {
        with(decoder, |decoder| {
            let input = items(bytes, size)?;
            put(used, 0)?;
            decoder.dirty_known = false;
            let before = decoder.codec.position();
            let result = decoder.codec.push(input);
            put(used, (decoder.codec.position() - before) as usize)?;
            let info = EventInfo::from(result.map_err(|error| decoder.error.set(error))?.1);
            if !event.is_null() {
                put(event, info)?;
            }
            Ok(info.kind as Status)
        })
    }
}

/// Ends the input. 0 if the stream is complete; -1019 if it is not, -4011 after an error. The decoder may be fed on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_finish(decoder: *mut Decoder) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let finished = decoder.codec.finish();
            finished.map_err(|error| decoder.error.set(error))?;
            Ok(0)
        })
    }
}

/// Ends the input of a live stream, which may stop after any frame. 0, or -1019 inside a record, -4006 inside a
/// frame, -4011 after an error.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_finish_live(decoder: *mut Decoder) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let finished = decoder.codec.finish_live();
            finished.map_err(|error| decoder.error.set(error))?;
            Ok(0)
        })
    }
}

/// After an error: goes on at the next group that can be decoded. 1, or 0 where only `dapple_decoder_reset` helps.
/// Push from `dapple_decoder_position` on. Without an error it is without effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_resume(decoder: *mut Decoder) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            decoder.dirty_known = false;
            Ok(decoder.codec.resume().into())
        })
    }
}

/// Forgets the stream and its state; keeps limits and memory. The next byte starts a stream.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_reset(decoder: *mut Decoder) -> i32 {
    // SAFETY: the caller's promise.
    let Some(object) = (unsafe { decoder.as_mut() }) else {
        return ARGUMENT;
    };
    if object.broken {
        // Nothing of what a panic left is looked at again, not even to free it.
        core::mem::forget(core::mem::replace(
            &mut object.codec,
            Codec::new(object.limits),
        ));
        object.broken = false;
    }
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            decoder.codec.reset();
            decoder.dirty_known = false;
            decoder.error = LastError::default();
            Ok(0)
        })
    }
}

/// Bytes of the stream used so far.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_position(decoder: *const Decoder) -> u64 {
    // SAFETY: the caller's promise.
    unsafe { decoder.as_ref() }.map_or(0, |decoder| decoder.codec.position())
}

/// Steps of work for this stream so far; a step takes some 10 ns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_work(decoder: *const Decoder) -> u64 {
    // SAFETY: the caller's promise.
    unsafe { decoder.as_ref() }.map_or(0, |decoder| decoder.codec.work())
}

/// Writes the digest of the state of the last frame, the same from every decoder. Takes time: it reads the state.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_state_digest(
    decoder: *mut Decoder,
    digest: *mut u64,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe { with(decoder, |decoder| put(digest, decoder.codec.state_digest())) }
}

/// Writes the last error of a call with this decoder; all zeros where there was none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_error(decoder: *const Decoder, error: *mut ErrorInfo) {
    // SAFETY: the caller's promise.
    unsafe {
        if let Some(decoder) = decoder.as_ref() {
            let _ = put(error, decoder.error.info);
        }
    }
}

/// Writes the last error as a sentence and a 0 to `out`, which has `size` bytes; what does not fit is cut off.
/// Returns the length of the sentence.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_error_message(
    decoder: *const Decoder,
    out: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: the caller's promise.
    unsafe {
        let Some(decoder) = decoder.as_ref() else {
            return text(out, size, |_| Ok(()));
        };
        text(out, size, |text| decoder.error.sentence(text))
    }
}
