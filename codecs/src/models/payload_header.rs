//! The header of a model record's payload, which all models share: sixteen bytes, and a table of
//! twelve bytes a track.

use alloc::vec::Vec;

use crate::error::ErrorKind;
use crate::models::ModelKind;
use crate::session::track::{self, TrackState};
use crate::wire::put_u32;

/// Bytes before the table, and of an entry in it.
const HEADER_BYTES: usize = 16;
const ENTRY_BYTES: usize = 12;

/// What a model record says about the tracks it names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// Everything: what is not sent is empty.
    Keyframe,
    /// What changed since the last committed frame.
    Delta,
}

/// What a pending frame builds on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Base {
    /// It starts from an empty state: the first one of a group that starts from keyframes.
    pub(crate) emptied: bool,
    /// The last committed frame.
    pub(crate) last_frame: Option<u32>,
}

/// The errors of a model for what is too short or long, and for what has to be 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeErrors {
    pub(crate) size: ErrorKind,
    pub(crate) reserved: ErrorKind,
}

/// The first bytes of a payload, read and checked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PayloadHeader {
    pub(crate) keyframe: bool,
    /// Entries of the table.
    pub(crate) count: usize,
    /// Every further id is at least this.
    above: u64,
}

impl PayloadHeader {
    /// Reads the sixteen bytes and makes sure that the table is there.
    pub(crate) fn read(
        payload: &[u8],
        base: Base,
        errors: ShapeErrors,
    ) -> Result<PayloadHeader, ErrorKind> {
        let words = payload.as_chunks::<4>().0;
        let Some(&[count, flags, base_frame, reserved]) = words.first_chunk() else {
            return Err(errors.size);
        };
        let count = u32::from_le_bytes(count);
        let flags = u32::from_le_bytes(flags);
        let base_frame = u32::from_le_bytes(base_frame);
        let keyframe = flags == 1;
        if flags > 1 || reserved != [0; 4] || (keyframe && base_frame != 0) {
            return Err(errors.reserved);
        }
        if !keyframe && (base.emptied || base.last_frame != Some(base_frame)) {
            return Err(ErrorKind::MissingBase);
        }
        let end = HEADER_BYTES as u64 + u64::from(count) * ENTRY_BYTES as u64;
        if end > payload.len() as u64 {
            return Err(errors.size);
        }
        Ok(PayloadHeader {
            keyframe,
            count: count as usize,
            above: 0,
        })
    }

    /// Reads the sixteen bytes of a model whose records replace all content of their tracks: a delta
    /// is an error of what has to be 0 or 1.
    pub(crate) fn read_keyframe(
        payload: &[u8],
        errors: ShapeErrors,
    ) -> Result<PayloadHeader, ErrorKind> {
        let base = Base {
            emptied: true,
            last_frame: None,
        };
        PayloadHeader::read(payload, base, errors).map_err(|fault| match fault {
            ErrorKind::MissingBase => errors.reserved,
            fault => fault,
        })
    }

    /// Bytes up to the end of the table.
    pub(crate) fn bytes(&self) -> usize {
        HEADER_BYTES + self.count * ENTRY_BYTES
    }

    /// Reads the entry at `index`: its track, found among the declared ones, and its two numbers. The
    /// ids of entries that are read one after the other ascend.
    pub(crate) fn entry(
        &mut self,
        payload: &[u8],
        index: usize,
        kind: ModelKind,
        tracks: &[TrackState],
    ) -> Result<TableEntry, ErrorKind> {
        let start = HEADER_BYTES + index * ENTRY_BYTES;
        let word = |k: usize| {
            let at = start + 4 * k;
            let bytes = &payload[at..at + 4];
            u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
        };
        let id = word(0);
        if u64::from(id) < self.above {
            return Err(ErrorKind::EntryOrder);
        }
        self.above = u64::from(id) + 1;
        let slot = track::find(tracks, id).ok_or(ErrorKind::UnknownTrack)?;
        let state = &tracks[slot];
        if state.removed {
            return Err(ErrorKind::UnknownTrack);
        }
        if state.track.model.kind() != kind {
            return Err(ErrorKind::TrackModel);
        }
        if state.staged.is_some() {
            return Err(ErrorKind::TrackTwice);
        }
        Ok(TableEntry {
            slot,
            id,
            numbers: [word(1), word(2)],
        })
    }
}

/// An entry of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TableEntry {
    /// Index of its track in the decoder's list.
    pub(crate) slot: usize,
    pub(crate) id: u32,
    pub(crate) numbers: [u32; 2],
}

/// Appends the sixteen bytes; the caller appends the table. `base` is that of a delta.
pub(crate) fn write_header(base: Option<u32>, count: u32, out: &mut Vec<u8>) {
    put_u32(out, count);
    put_u32(out, u32::from(base.is_none()));
    put_u32(out, base.unwrap_or(0));
    put_u32(out, 0);
}
