//! The payload of a `points` record (coding `cells`), written.

use alloc::vec::Vec;

use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY, Grid};
use crate::container::Compression;
use crate::encoder::Encoder;
use crate::error::{ErrorKind, Result};
use crate::models::ModelKind;
use crate::models::payload_header::{Coverage, write_header};
use crate::wire::{pad4, put_u32};

/// Content of one track for one frame. Indices count within the track and ascend strictly.
#[derive(Clone, Copy, Debug)]
pub struct Update<'a> {
    /// Id of the track.
    pub track: u32,
    /// Indices of `buckets`.
    pub bucket_indices: &'a [u32],
    /// Whole buckets.
    pub buckets: &'a [Bucket],
    /// Indices of `cells`.
    pub cell_indices: &'a [u32],
    /// Whole cells.
    pub cells: &'a [Cell],
}

impl Encoder {
    /// Content of the frame for `points` tracks, ids ascending; each track at most once a frame. A delta
    /// builds on the last committed frame. No record is written for no updates.
    ///
    /// # Errors
    /// 2004, 2019, 2027, 3003 to 3013, 4001 for a delta in the first frame of a keyframe group,
    /// 4008 before the first group, 4009, 4010, 4012 for slices of different lengths.
    pub fn points(
        &mut self,
        out: &mut Vec<u8>,
        coverage: Coverage,
        updates: &[Update<'_>],
        compression: Compression,
    ) -> Result<()> {
        let bytes = |update: &Update<'_>| 36 * (update.buckets.len() + update.cells.len());
        self.content(
            out,
            (ModelKind::Points, compression),
            coverage,
            updates,
            bytes,
            |session, base, now, payload| {
                let grid_of = |id| {
                    let grid = session.track(id)?.track.grid();
                    grid.ok_or(ErrorKind::TrackModel)
                };
                write_payload(base, now, grid_of, payload)
            },
        )
    }
}

/// Appends the payload. `grid_of` finds a declared track of the model.
fn write_payload<'g>(
    base: Option<u32>,
    updates: &[Update<'_>],
    grid_of: impl Fn(u32) -> core::result::Result<&'g Grid, ErrorKind>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    let count = |n: usize| u32::try_from(n).map_err(|_| ErrorKind::EncoderUse);
    if !updates.is_sorted_by(|a, b| a.track < b.track) {
        return Err(ErrorKind::EntryOrder);
    }
    write_header(base, count(updates.len())?, out);
    for update in updates {
        if update.bucket_indices.len() != update.buckets.len()
            || update.cell_indices.len() != update.cells.len()
        {
            return Err(ErrorKind::EncoderUse);
        }
        put_u32(out, update.track);
        put_u32(out, count(update.buckets.len())?);
        put_u32(out, count(update.cells.len())?);
    }
    for update in updates {
        let grid = grid_of(update.track)?;
        write_track(grid, update, out)?;
    }
    Ok(())
}

fn write_track(
    grid: &Grid,
    update: &Update<'_>,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    write_gaps(
        update.bucket_indices,
        grid.bucket_count,
        ErrorKind::BucketIndex,
        out,
    )?;
    out.reserve(update.buckets.len() * 4 * BUCKET_ENTRIES);
    for bucket in update.buckets {
        bucket.0.iter().for_each(|&entry| put_u32(out, entry));
    }
    write_gaps(
        update.cell_indices,
        grid.cell_capacity,
        ErrorKind::CellIndex,
        out,
    )?;
    out.reserve(update.cells.len() * 4 * (1 + CELL_POINTS));
    for cell in update.cells {
        if cell.key != EMPTY && u64::from(cell.key) >= grid.volume() {
            return Err(ErrorKind::CellKey);
        }
        put_u32(out, cell.key);
    }
    let start = out.len();
    let bits = grid.widths.bits();
    for point in update.cells.iter().flat_map(|cell| cell.points) {
        if point != 0 && point >> (bits - 1) != 1 {
            return Err(ErrorKind::PointBits);
        }
        out.extend_from_slice(&point.to_le_bytes()[..bits as usize / 8]);
    }
    pad4(out, start);
    Ok(())
}

/// Each index as the number of indices left out since the one before: for runs that is all zeros,
/// which packs far better than the indices themselves.
fn write_gaps(
    indices: &[u32],
    bound: u32,
    error: ErrorKind,
    out: &mut Vec<u8>,
) -> core::result::Result<(), ErrorKind> {
    let mut next = 0u32;
    for &index in indices {
        if index < next || index >= bound {
            return Err(error);
        }
        put_u32(out, index - next);
        next = index + 1;
    }
    Ok(())
}
