//! The rules of a track's content in a frame, clauses P-020 to P-030 of `spec/points.md`.

use super::sections::{Sections, StagedTrack, bucket, points, word};
use super::{Bucket, CELL_POINTS, Cell, EMPTY, Place, State};
use crate::error::ErrorKind;

/// Turns gaps into indices, in place. After a fault the bytes mean nothing.
fn gaps_to_indices(bytes: &mut [u8], bound: u32, fault: ErrorKind) -> Result<(), ErrorKind> {
    let mut next = 0u64;
    for gap in bytes.as_chunks_mut::<4>().0 {
        let index = next + u64::from(word(*gap));
        *gap = (index as u32).to_le_bytes();
        next = index + 1;
    }
    // They ascend, so the last one is the largest.
    if next <= u64::from(bound) {
        Ok(())
    } else {
        Err(fault)
    }
}

pub(super) fn check_track(
    bytes: &mut [u8],
    staged: &StagedTrack,
    emptied: bool,
    filled: bool,
    state: &mut State,
) -> Result<(), ErrorKind> {
    let place = state.places[staged.place];
    let grid = &place.grid;
    let bucket_gaps = &mut bytes[staged.bucket_indices.clone()];
    gaps_to_indices(bucket_gaps, grid.bucket_count, ErrorKind::BucketIndex)?;
    let cell_gaps = &mut bytes[staged.cell_indices.clone()];
    gaps_to_indices(cell_gaps, grid.cell_capacity, ErrorKind::CellIndex)?;
    let sections = Sections::new(bytes, staged);
    let homes = &mut state.next_homes[place.cells()];
    if staged.keyframe && !emptied && filled {
        homes.fill(EMPTY);
    }
    let committed = (!staged.keyframe && !emptied).then(|| CommittedTrack {
        buckets: &state.buckets[place.buckets()],
        cells: &state.cells[place.cells()],
    });
    match grid.widths.bits() {
        16 => check_cells::<2, 14>(&sections, &place, committed, homes)?,
        24 => check_cells::<3, 21>(&sections, &place, committed, homes)?,
        _ => check_cells::<4, 28>(&sections, &place, committed, homes)?,
    }
    check_buckets(&sections, homes)
}

/// What a track had before a delta.
struct CommittedTrack<'a> {
    buckets: &'a [Bucket],
    cells: &'a [Cell],
}

/// Keys inside the grid; points within their width, used ones first; free cells without points. In
/// a delta: cells that changed their key are no longer named by the bucket of the old one.
fn check_cells<const B: usize, const S: usize>(
    sections: &Sections<'_>,
    place: &Place,
    committed: Option<CommittedTrack<'_>>,
    next_homes: &mut [u32],
) -> Result<(), ErrorKind> {
    // The volume is at most 2^32 - 1.
    let volume = place.grid.volume() as u32;
    let cells = sections.cell_indices.iter().zip(sections.keys);
    for ((index, key), cell) in cells.zip(sections.points.as_chunks::<S>().0) {
        let (index, key) = (word(*index), word(*key));
        if key >= volume && key != EMPTY {
            return Err(ErrorKind::CellKey);
        }
        check_points(points::<B, S>(cell), 1 << (8 * B - 1), key == EMPTY)?;
        // Most cells of a delta keep their key. Reading it here also fetches the cell for the write
        // at the commit.
        let committed = committed.as_ref();
        if committed.is_some_and(|c| c.cells[index as usize].key == key) {
            continue;
        }
        let home = place.hasher.home(key);
        let next = next_homes
            .get_mut(index as usize)
            .ok_or(ErrorKind::CellIndex)?;
        let old_home = core::mem::replace(next, home);
        if old_home != home
            && old_home != EMPTY
            && let Some(committed) = committed
        {
            let bucket = sections
                .find_bucket(old_home)
                .unwrap_or(committed.buckets[old_home as usize]);
            if bucket.0.contains(&index) {
                return Err(ErrorKind::CellMoved);
            }
        }
    }
    Ok(())
}

/// Each point is 0 or has the bit `there`, no point stands after a 0, and a free cell has none.
#[inline(always)]
fn check_points(points: [u32; CELL_POINTS], there: u32, free: bool) -> Result<(), ErrorKind> {
    // Without branches, since how many points a cell has is anyone's guess. `p | -p` has the bit if
    // p is not 0; then p must have it, and so must the point before.
    let mut before = if free { 0 } else { there };
    let mut wrong = 0;
    for point in points {
        wrong |= (point | point.wrapping_neg()) & !(point & before);
        before = point;
    }
    if wrong & there == 0 {
        return Ok(());
    }
    if points.iter().any(|&p| p != 0 && p & there == 0) {
        return Err(ErrorKind::PointBits);
    }
    let used = points.iter().take_while(|&&p| p != 0).count();
    if points[used..].iter().any(|&p| p != 0) {
        return Err(ErrorKind::PointCompact);
    }
    Err(ErrorKind::FreeCell)
}

/// Entries used first, inside the track, named once, and of cells whose key hashes here.
fn check_buckets(sections: &Sections<'_>, next_homes: &[u32]) -> Result<(), ErrorKind> {
    for (index, bytes) in sections.bucket_indices.iter().zip(sections.buckets) {
        let index = word(*index);
        let Bucket(entries) = bucket(bytes);
        let mut used = 0u32;
        for (i, &entry) in entries.iter().enumerate() {
            used |= u32::from(entry != EMPTY) << i;
        }
        if used & (used + 1) != 0 {
            return Err(ErrorKind::BucketCompact);
        }
        for (i, &entry) in entries.iter().take_while(|&&e| e != EMPTY).enumerate() {
            match next_homes.get(entry as usize) {
                None => return Err(ErrorKind::BucketEntry),
                Some(&home) if home != index => return Err(ErrorKind::EntryHash),
                Some(_) => {}
            }
            if entries[..i].contains(&entry) {
                return Err(ErrorKind::BucketTwice);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small number, drawn by a linear congruential generator.
    fn draw(state: &mut u64, bound: u32) -> u32 {
        *state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (*state >> 33) as u32 % bound
    }

    /// The quick checks must pass exactly what the ones of the specification, one by one, pass.
    #[test]
    fn quick_checks_of_points_miss_nothing() {
        let mut state = 5;
        let mut right = 0;
        for _ in 0..200_000 {
            let bytes = 2 + draw(&mut state, 3);
            let there = 1u32 << (8 * bytes - 1);
            let used = draw(&mut state, 8) as usize;
            let mut points: [u32; CELL_POINTS] = core::array::from_fn(|i| {
                let low = draw(&mut state, there.min(1 << 30)) >> draw(&mut state, 30);
                if i < used { there | low } else { 0 }
            });
            if draw(&mut state, 2) == 0 {
                let at = draw(&mut state, 7) as usize;
                points[at] = [0, 1, there, there - 1][draw(&mut state, 4) as usize];
            }
            let free = draw(&mut state, 4) == 0;
            let bits = points.iter().all(|&p| p == 0 || p >= there);
            let compact = points.windows(2).all(|pair| pair[0] != 0 || pair[1] == 0);
            let wanted = match (bits, compact, free && points != [0; CELL_POINTS]) {
                (false, _, _) => Err(ErrorKind::PointBits),
                (_, false, _) => Err(ErrorKind::PointCompact),
                (_, _, true) => Err(ErrorKind::FreeCell),
                _ => Ok(()),
            };
            assert_eq!(check_points(points, there, free), wanted, "{points:x?}");
            right += u32::from(wanted.is_ok());
        }
        assert!((50_000..150_000).contains(&right), "{right}");
    }
}
