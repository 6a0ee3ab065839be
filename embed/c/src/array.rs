//! Arrays of decoded state, and what changed in them.

use core::ffi::c_void;

use dapple_codec::Buffer;

use crate::call::{ARGUMENT, Status, put, with};
use crate::decoder::Decoder;
use crate::error::{ERROR_NO_TRACK, NO_MEMORY};

/// Elements `start` to `end` (excluded) of an array that changed. Of an array that became empty both are 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct DirtyRange {
    /// `DAPPLE_BUFFER_*`.
    pub buffer: u32,
    /// Id of the track whose array it is; 0 for an array of all tracks.
    pub track: u32,
    /// First element.
    pub start: u32,
    /// One past the last element.
    pub end: u32,
}

/// An array as the bytes that a GPU reads, in the machine's order. The pointers hold until the next call that
/// takes the decoder, other than one that only asks.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Array {
    /// All of it, dirty or not.
    pub data: *const c_void,
    /// Bytes of all of it.
    pub size: usize,
    /// Bytes of an element.
    pub element_size: usize,
    /// What changed since `dapple_decoder_clear_dirty`: ranges ascend and do not touch.
    pub dirty: *const DirtyRange,
    /// Number of those ranges.
    pub dirty_count: usize,
}

/// Where the ranges of an array stand in the list of all: by model, then by track, then by buffer.
fn order(range: &DirtyRange) -> (u32, u32, u32) {
    let group = match Buffer::ALL.get(range.buffer as usize) {
        Some(Buffer::ProbesTexels | Buffer::ProbesVisibility) => Buffer::ProbesTexels.number(),
        Some(Buffer::InstancesKeys | Buffer::InstancesValues) => Buffer::InstancesKeys.number(),
        Some(Buffer::Regions | Buffer::RegionsPairs) => Buffer::Regions.number(),
        _ => range.buffer,
    };
    (group, range.track, range.buffer)
}

/// Whether all tracks share the array.
fn shared(buffer: Buffer) -> bool {
    match buffer {
        Buffer::PointsBuckets | Buffer::PointsCells | Buffer::VerticesValues => true,
        Buffer::ProbesTexels
        | Buffer::ProbesVisibility
        | Buffer::InstancesKeys
        | Buffer::InstancesValues
        | Buffer::Regions
        | Buffer::RegionsPairs
        | Buffer::Transforms => false,
    }
}

impl Decoder {
    /// What changed, listed once for each change.
    fn dirty(&mut self) -> Result<&[DirtyRange], Status> {
        if !self.dirty_known {
            self.dirty.clear();
            // A loop: an iterator of known length is three times the code.
            for dirty in self.codec.dirty() {
                self.dirty.try_reserve(1).map_err(|_| NO_MEMORY)?;
                self.dirty.push(DirtyRange {
                    buffer: dirty.buffer.number(),
                    track: dirty.track.unwrap_or(0),
                    start: dirty.range.start,
                    end: dirty.range.end,
                });
            }
            debug_assert!(self.dirty.is_sorted_by_key(order));
            self.dirty_known = true;
        }
        Ok(&self.dirty)
    }
}

/// Gives the list of all that changed since `dapple_decoder_clear_dirty`, in every array of every
/// model, and how many ranges it has. The ranges of an array stand together and ascend.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_dirty(
    decoder: *mut Decoder,
    ranges: *mut *const DirtyRange,
    count: *mut usize,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let dirty = decoder.dirty()?;
            put(count, dirty.len())?;
            put(ranges, dirty.as_ptr())
        })
    }
}

/// The dirty ranges have been uploaded.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_clear_dirty(decoder: *mut Decoder) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            decoder.codec.clear_dirty();
            decoder.dirty_known = false;
            Ok(0)
        })
    }
}

/// Writes an array, `DAPPLE_BUFFER_*`, with its dirty ranges. `track` is the id of its track, and is not looked
/// at for an array of all tracks. The array is empty where the track is of another model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dapple_decoder_array(
    decoder: *mut Decoder,
    buffer: u32,
    track: u32,
    array: *mut Array,
) -> i32 {
    // SAFETY: the caller's promise.
    unsafe {
        with(decoder, |decoder| {
            let buffer = *Buffer::ALL.get(buffer as usize).ok_or(ARGUMENT)?;
            let of = (!shared(buffer)).then_some(track);
            let known = of.is_none_or(|id| {
                let tracks = decoder.codec.tracks();
                tracks
                    .binary_search_by_key(&id, |state| state.track.id)
                    .is_ok()
            });
            if !known {
                return Err(-(ERROR_NO_TRACK as Status));
            }
            let wanted = order(&DirtyRange {
                buffer: buffer.number(),
                track: of.unwrap_or(0),
                ..DirtyRange::default()
            });
            let dirty = decoder.dirty()?;
            let first = dirty.partition_point(|range| order(range) < wanted);
            let dirty = &dirty[first..];
            let count = dirty.partition_point(|range| order(range) == wanted);
            let dirty = dirty.as_ptr();
            let bytes = decoder.codec.array(buffer, of);
            let result = Array {
                data: bytes.as_ptr().cast(),
                size: bytes.len(),
                element_size: buffer.element_bytes(),
                dirty,
                dirty_count: count,
            };
            put(array, result)
        })
    }
}
