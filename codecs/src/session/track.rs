//! Tracks, and the records that declare and remove them.

use alloc::string::String;
use alloc::vec::Vec;

use super::transforms::Transform;
use crate::Limits;
use crate::error::{ErrorDetail, ErrorKind, Limit};
use crate::models::{LookupSpace, Model, ModelKind};
use crate::wire::{Reader, pad4, put_f32, put_u16, put_u32, put_u64};

/// Light data of one mesh instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Never used twice in a stream; each new track takes a higher one.
    pub id: u32,
    /// What it belongs to.
    pub target: Target,
    /// Smallest corner of the bounds of its points, mesh space, metres.
    pub aabb_min: [f32; 3],
    /// Largest corner.
    pub aabb_max: [f32; 3],
    /// The space that a fragment is looked up in.
    pub space: LookupSpace,
    /// Model and its parameters.
    pub model: Model,
}

/// What a track belongs to, in the application's terms.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Target {
    /// A number that the application gives a meaning to; 0 where it has none.
    pub application_id: u64,
    /// Path of the node, such as a glTF node path; may be empty.
    pub path: String,
    /// Hash of the mesh that the content depends on, where it depends on one.
    pub content_hash: Option<u64>,
}

impl Track {
    /// The rules that hold for a track by itself.
    pub(crate) fn check(&self, path_limit: u32) -> Result<(), ErrorDetail> {
        let path = self.target.path.len() as u64;
        if path > u64::from(path_limit) {
            let allowed = u64::from(path_limit);
            return Err(ErrorDetail::limit(
                ErrorKind::PathLimit,
                Limit::PathBytes,
                path,
                allowed,
            ));
        }
        if !self
            .aabb_min
            .iter()
            .chain(&self.aabb_max)
            .all(|f| f.is_finite())
        {
            return Err(ErrorKind::NotFinite.into());
        }
        if (0..3).any(|axis| self.aabb_min[axis] > self.aabb_max[axis]) {
            return Err(ErrorKind::Aabb.into());
        }
        self.model.kind().check_space(self.space)?;
        Ok(self.model.parameters().check()?)
    }

    fn read(entry: &[u8], limits: &Limits) -> Result<Track, ErrorDetail> {
        let mut r = Reader::new(entry, ErrorKind::PayloadSize);
        let _size = r.u32()?;
        let id = r.u32()?;
        let number = r.u16()?;
        let kind =
            ModelKind::of_number(number).map_err(|fault| ErrorDetail::found(fault, number))?;
        let coding = r.u16()?;
        kind.check_coding(coding)
            .map_err(|fault| ErrorDetail::found(fault, coding))?;
        let space = match r.u8()? {
            0 => LookupSpace::Mesh,
            1 => LookupSpace::Rest,
            number => return Err(ErrorDetail::found(ErrorKind::Space, number)),
        };
        kind.check_space(space)?;
        let has_content_hash = r.u8()?;
        let path_bytes = r.u16()?;
        let application_id = r.u64()?;
        let content_hash = r.u64()?;
        if has_content_hash > 1 || (has_content_hash == 0 && content_hash != 0) {
            return Err(ErrorKind::PayloadReserved.into());
        }
        let aabb_min = r.floats()?;
        let aabb_max = r.floats()?;
        let model = (kind.descriptor().read)(coding, &mut r)?;
        if u32::from(path_bytes) > limits.path_bytes {
            let (asked, allowed) = (u64::from(path_bytes), u64::from(limits.path_bytes));
            return Err(ErrorDetail::limit(
                ErrorKind::PathLimit,
                Limit::PathBytes,
                asked,
                allowed,
            ));
        }
        let path = r.bytes(usize::from(path_bytes))?;
        let path = core::str::from_utf8(path).map_err(|_| ErrorKind::PathText)?;
        let padding = r.bytes(r.len())?;
        if padding.len() > 3 {
            return Err(ErrorKind::PayloadSize.into());
        }
        if padding.iter().any(|&b| b != 0) {
            return Err(ErrorKind::PayloadReserved.into());
        }
        let track = Track {
            id,
            target: Target {
                application_id,
                path: copy(path)?,
                content_hash: (has_content_hash == 1).then_some(content_hash),
            },
            aabb_min,
            aabb_max,
            space,
            model,
        };
        track.check(limits.path_bytes)?;
        Ok(track)
    }

    fn write(&self, out: &mut Vec<u8>) -> Result<(), ErrorDetail> {
        self.check(u32::from(u16::MAX))?;
        let start = out.len();
        put_u32(out, 0);
        put_u32(out, self.id);
        put_u16(out, self.model.kind().descriptor().number);
        put_u16(out, self.model.parameters().coding());
        out.push(match self.space {
            LookupSpace::Mesh => 0,
            LookupSpace::Rest => 1,
        });
        out.push(u8::from(self.target.content_hash.is_some()));
        put_u16(out, self.target.path.len() as u16);
        put_u64(out, self.target.application_id);
        put_u64(out, self.target.content_hash.unwrap_or(0));
        let floats = self.aabb_min.iter().chain(&self.aabb_max);
        floats.for_each(|&value| put_f32(out, value));
        self.model.parameters().write(out);
        out.extend_from_slice(self.target.path.as_bytes());
        pad4(out, start);
        let size = (out.len() - start) as u32;
        out[start..start + 4].copy_from_slice(&size.to_le_bytes());
        Ok(())
    }
}

/// A text in memory of its own.
fn copy(text: &str) -> Result<String, ErrorKind> {
    let mut copy = String::new();
    let reserved = copy.try_reserve_exact(text.len());
    reserved.map_err(|_| ErrorKind::Memory)?;
    copy.push_str(text);
    Ok(copy)
}

/// A declared track, and what a decoder keeps of it beside the content of its model.
#[derive(Clone, Debug)]
pub struct TrackState {
    /// What was declared.
    pub track: Track,
    /// The last committed transform; none before the first.
    pub transform: Option<Transform>,
    /// Which of its model's staged tracks it is, where the pending frame has content for it.
    pub(crate) staged: Option<u32>,
    /// The committed state may have content for it. Without, there is nothing to empty, so that
    /// a stream of bare groups costs no more than its bytes.
    pub(crate) filled: bool,
    /// The next commit removes it.
    pub(crate) removed: bool,
    /// Its transform changed since [`crate::Decoder::clear_dirty`].
    pub(crate) transform_dirty: bool,
}

impl TrackState {
    /// A track as declared: empty, without a transform.
    pub(crate) fn new(track: Track) -> TrackState {
        TrackState {
            track,
            transform: None,
            staged: None,
            filled: false,
            removed: false,
            transform_dirty: false,
        }
    }

    /// Sets the transform, and marks it as dirty where that is a change.
    pub(crate) fn set_transform(&mut self, transform: Option<Transform>) {
        self.transform_dirty |= self.transform != transform;
        self.transform = transform;
    }
}

/// Index of the track of an id. Ids ascend.
pub(crate) fn find(tracks: &[TrackState], id: u32) -> Option<usize> {
    tracks
        .binary_search_by_key(&id, |state| state.track.id)
        .ok()
}

/// Whether the track of an id is marked as removed.
pub(crate) fn is_removed(tracks: &[TrackState], id: u32) -> bool {
    find(tracks, id).is_some_and(|at| tracks[at].removed)
}

/// Calls `each` with every declared track, ids ascending.
pub(crate) fn read_tracks(
    payload: &[u8],
    limits: &Limits,
    mut each: impl FnMut(Track) -> Result<(), ErrorDetail>,
) -> Result<(), ErrorDetail> {
    let mut reader = Reader::new(payload, ErrorKind::PayloadSize);
    let count = reader.u32()?;
    if reader.u32()? != 0 {
        return Err(ErrorKind::PayloadReserved.into());
    }
    let mut above = 0u64;
    for _ in 0..count {
        let mut ahead = Reader::new(payload, ErrorKind::PayloadSize);
        ahead.bytes(payload.len() - reader.len())?;
        let size = ahead.u32()? as usize;
        if size < 12 || !size.is_multiple_of(4) {
            return Err(ErrorKind::PayloadSize.into());
        }
        let id = ahead.u32()?;
        let of_track = |failure: ErrorDetail| failure.of_track(id);
        let track = Track::read(reader.bytes(size)?, limits).map_err(of_track)?;
        if u64::from(id) < above {
            return Err(of_track(ErrorKind::EntryOrder.into()));
        }
        above = u64::from(id) + 1;
        each(track).map_err(of_track)?;
    }
    Ok(reader.end()?)
}

/// Appends the payload of a `track` record.
pub(crate) fn write_tracks(tracks: &[Track], out: &mut Vec<u8>) -> Result<(), ErrorDetail> {
    put_u32(
        out,
        u32::try_from(tracks.len()).map_err(|_| ErrorKind::EncoderUse)?,
    );
    put_u32(out, 0);
    if !tracks.is_sorted_by(|a, b| a.id < b.id) {
        return Err(ErrorKind::EntryOrder.into());
    }
    tracks
        .iter()
        .try_for_each(|track| track.write(out).map_err(|f| f.of_track(track.id)))
}

/// Calls `each` with every removed track, ids ascending.
pub(crate) fn read_removed(
    payload: &[u8],
    mut each: impl FnMut(u32) -> Result<(), ErrorKind>,
) -> Result<(), ErrorKind> {
    let mut reader = Reader::new(payload, ErrorKind::PayloadSize);
    let count = reader.u32()?;
    let mut above = 0u64;
    for _ in 0..count {
        let id = reader.u32()?;
        if u64::from(id) < above {
            return Err(ErrorKind::EntryOrder);
        }
        above = u64::from(id) + 1;
        each(id)?;
    }
    reader.end()
}

/// Appends the payload of a `track remove` record.
pub(crate) fn write_removed(ids: &[u32], out: &mut Vec<u8>) -> Result<(), ErrorKind> {
    put_u32(
        out,
        u32::try_from(ids.len()).map_err(|_| ErrorKind::EncoderUse)?,
    );
    ids.iter().for_each(|&id| put_u32(out, id));
    if ids.is_sorted_by(|a, b| a < b) {
        Ok(())
    } else {
        Err(ErrorKind::EntryOrder)
    }
}
