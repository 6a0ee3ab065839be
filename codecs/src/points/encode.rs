//! The payload of a `points` record (coding `cells`), written.

use alloc::vec::Vec;

use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY, Grid};
use crate::content::write_head;
use crate::error::ErrorKind;
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

/// Appends the payload. `grid_of` finds a declared track of the model.
pub(crate) fn write_payload<'g>(
    base: Option<u32>,
    updates: &[Update<'_>],
    grid_of: impl Fn(u32) -> Result<&'g Grid, ErrorKind>,
    out: &mut Vec<u8>,
) -> Result<(), ErrorKind> {
    let count = |n: usize| u32::try_from(n).map_err(|_| ErrorKind::EncoderUse);
    if !updates.is_sorted_by(|a, b| a.track < b.track) {
        return Err(ErrorKind::EntryOrder);
    }
    write_head(base, count(updates.len())?, out);
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

fn write_track(grid: &Grid, update: &Update<'_>, out: &mut Vec<u8>) -> Result<(), ErrorKind> {
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
    fault: ErrorKind,
    out: &mut Vec<u8>,
) -> Result<(), ErrorKind> {
    let mut next = 0u32;
    for &index in indices {
        if index < next || index >= bound {
            return Err(fault);
        }
        put_u32(out, index - next);
        next = index + 1;
    }
    Ok(())
}
