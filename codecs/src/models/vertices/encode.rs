//! The payload of a `vertices` record, written.

use alloc::vec::Vec;

use super::{Vertices, sections};
use crate::container::Compression;
use crate::encoder::Encoder;
use crate::error::{ErrorKind, Result};
use crate::models::ModelKind;
use crate::models::payload_header::{Coverage, write_header};
use crate::wire::put_u32;

/// Content of one track.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    /// Id of the track.
    pub track: u32,
    /// The code of each value, signals of a vertex side by side: 0 to 255, or to 31 at 5 bits
    /// ([`super::nearest`], [`super::dithered`]).
    pub codes: &'a [u8],
}

impl Encoder {
    /// Content of the frame for `vertices` tracks, ids ascending: all values of each. Other tracks keep
    /// theirs, but for the first frame of a keyframe group.
    ///
    /// # Errors
    /// 2004, 2019, 2027, 4008 before the first group, 4009, 4010, 4012 for a wrong number of codes or
    /// one that its bits do not hold.
    pub fn vertices(
        &mut self,
        out: &mut Vec<u8>,
        updates: &[Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        self.content(
            out,
            (ModelKind::Vertices, compression),
            Coverage::Keyframe,
            updates,
            |update| update.codes.len(),
            |session, _, now, payload| {
                let vertices_of = |id| {
                    let track = &session.track(id)?.track;
                    track.vertices().ok_or(ErrorKind::TrackModel)
                };
                write_payload(now, vertices_of, payload)
            },
        )
    }
}

/// Appends the payload. `vertices_of` finds the parameters of a declared track.
fn write_payload<'v>(
    updates: &[Update<'_>],
    vertices_of: impl Fn(u32) -> core::result::Result<&'v Vertices, ErrorKind>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    let count = u32::try_from(updates.len()).map_err(|_| ErrorKind::EncoderUse)?;
    if !updates.is_sorted_by(|a, b| a.track < b.track) {
        return Err(ErrorKind::EntryOrder);
    }
    write_header(None, count, out);
    for update in updates {
        let vertices = vertices_of(update.track)?;
        let fits = |&code: &u8| code <= vertices.most();
        if update.codes.len() != vertices.values() || !update.codes.iter().all(fits) {
            return Err(ErrorKind::EncoderUse);
        }
        put_u32(out, update.track);
        put_u32(out, sections::bytes(vertices) as u32);
        put_u32(out, 0);
    }
    for update in updates {
        sections::write(vertices_of(update.track)?, update.codes, out);
    }
    Ok(())
}
