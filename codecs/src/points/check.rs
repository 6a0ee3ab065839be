//! The rules of a track's content in a frame, clauses P-020 to P-030 of `spec/points.md`.

use super::sections::{BUCKET_BYTES, Sections, StagedTrack, bucket, points, word};
use super::state::region;
use super::{BUCKET_ENTRIES, Bucket, CELL_POINTS, EMPTY, Hasher, State};
use crate::error::Fault;
use crate::track::LiveTrack;

/// Turns gaps into indices, in place. After a fault the bytes mean nothing.
fn gaps_to_indices(bytes: &mut [u8], bound: u32, fault: Fault) -> Result<(), Fault> {
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
    state: &mut State,
    live: &LiveTrack,
) -> Result<(), Fault> {
    let grid = live.track.grid();
    let bucket_gaps = &mut bytes[staged.bucket_indices.clone()];
    gaps_to_indices(bucket_gaps, grid.bucket_count, Fault::BucketIndex)?;
    let cell_gaps = &mut bytes[staged.cell_indices.clone()];
    gaps_to_indices(cell_gaps, grid.cell_capacity, Fault::CellIndex)?;
    let sections = Sections::new(bytes, staged);
    let keys = &mut state.next_keys[region(live.first_cell, grid.cell_capacity)];
    if staged.keyframe && !emptied && live.filled {
        keys.fill(EMPTY);
    }
    let buckets = (!staged.keyframe && !emptied)
        .then(|| &state.buckets[region(live.first_bucket, grid.bucket_count)]);
    match grid.widths.bits() {
        16 => check_cells::<2, 14>(&sections, live, buckets, keys)?,
        24 => check_cells::<3, 21>(&sections, live, buckets, keys)?,
        _ => check_cells::<4, 28>(&sections, live, buckets, keys)?,
    }
    check_buckets(&sections, &live.hasher, keys)
}

/// Keys inside the grid; points within their width, used ones first; free cells without points. In
/// a delta, which has `committed` buckets: cells that changed their key are no longer named by the
/// bucket of the old one.
fn check_cells<const B: usize, const S: usize>(
    sections: &Sections<'_>,
    live: &LiveTrack,
    committed: Option<&[Bucket]>,
    next_keys: &mut [u32],
) -> Result<(), Fault> {
    // The volume is at most 2^32 - 1.
    let volume = live.track.grid().volume() as u32;
    let cells = sections.cell_indices.iter().zip(sections.keys);
    for ((index, key), cell) in cells.zip(sections.points.as_chunks::<S>().0) {
        let (index, key) = (word(*index), word(*key));
        if key >= volume && key != EMPTY {
            return Err(Fault::CellKey);
        }
        check_points(points::<B, S>(cell), 1 << (8 * B - 1), key == EMPTY)?;
        let next = next_keys.get_mut(index as usize).ok_or(Fault::CellIndex)?;
        let old = core::mem::replace(next, key);
        if old != key
            && old != EMPTY
            && let Some(buckets) = committed
        {
            let old_home = live.hasher.bucket_of_key(old);
            let moved = key == EMPTY || live.hasher.bucket_of_key(key) != old_home;
            let named = || match sections.find_bucket(old_home) {
                Some(bucket) => bucket.0.contains(&index),
                None => buckets[old_home as usize].0.contains(&index),
            };
            if moved && named() {
                return Err(Fault::CellMoved);
            }
        }
    }
    Ok(())
}

/// Each point is 0 or has the bit `there`, no point stands after a 0, and a free cell has none.
#[inline(always)]
fn check_points(points: [u32; CELL_POINTS], there: u32, free: bool) -> Result<(), Fault> {
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
        return Err(Fault::PointBits);
    }
    let used = points.iter().take_while(|&&p| p != 0).count();
    if points[used..].iter().any(|&p| p != 0) {
        return Err(Fault::PointCompact);
    }
    Err(Fault::FreeCell)
}

/// Buckets that are checked at once.
const BUCKET_BLOCK: usize = 32;

/// Entries used first, inside the track, named once, and of cells whose key hashes here.
fn check_buckets(sections: &Sections<'_>, hasher: &Hasher, next_keys: &[u32]) -> Result<(), Fault> {
    let indices = sections.bucket_indices.chunks(BUCKET_BLOCK);
    for (indices, buckets) in indices.zip(sections.buckets.chunks(BUCKET_BLOCK)) {
        if !buckets_are_right(indices, buckets, hasher, next_keys) {
            find_fault(indices, buckets, hasher, next_keys)?;
        }
    }
    Ok(())
}

/// The checks of a block of buckets. The used entries are first drawn together into one list: how
/// many a bucket has cannot be predicted, and a loop for each bucket would cost more in wrong
/// guesses than in checks.
fn buckets_are_right(
    indices: &[[u8; 4]],
    buckets: &[[u8; BUCKET_BYTES]],
    hasher: &Hasher,
    next_keys: &[u32],
) -> bool {
    let mut entries = [0; BUCKET_BLOCK * BUCKET_ENTRIES];
    let mut homes = [0; BUCKET_BLOCK * BUCKET_ENTRIES];
    let mut count = 0;
    let mut wrong = false;
    for (index, bytes) in indices.iter().zip(buckets) {
        let bucket = bucket(bytes);
        let (Some(used), Some(entries), Some(homes)) = (
            used_entries(&bucket),
            entries[count..].first_chunk_mut(),
            homes[count..].first_chunk_mut(),
        ) else {
            return false;
        };
        wrong |= names_twice(&bucket);
        *entries = bucket.0;
        *homes = [word(*index); BUCKET_ENTRIES];
        count += used;
    }
    for (&entry, &home) in entries[..count].iter().zip(&homes) {
        let key = next_keys.get(entry as usize).copied().unwrap_or(EMPTY);
        wrong |= key == EMPTY || hasher.bucket_of_key(key) != home;
    }
    !wrong
}

/// The same checks one by one, in the order of the specification.
#[cold]
fn find_fault(
    indices: &[[u8; 4]],
    buckets: &[[u8; BUCKET_BYTES]],
    hasher: &Hasher,
    next_keys: &[u32],
) -> Result<(), Fault> {
    for (index, bytes) in indices.iter().zip(buckets) {
        let bucket = bucket(bytes);
        let used = used_entries(&bucket).ok_or(Fault::BucketCompact)?;
        let entries = &bucket.0[..used];
        for (i, &entry) in entries.iter().enumerate() {
            let key = *next_keys.get(entry as usize).ok_or(Fault::BucketEntry)?;
            if key == EMPTY || hasher.bucket_of_key(key) != word(*index) {
                return Err(Fault::EntryHash);
            }
            if entries[..i].contains(&entry) {
                return Err(Fault::BucketTwice);
            }
        }
    }
    Ok(())
}

/// How many entries are used; `None` if an empty one comes before a used one.
#[inline(always)]
fn used_entries(Bucket(entries): &Bucket) -> Option<usize> {
    let used = entries.map(|entry| u32::from(entry != EMPTY));
    let count = used.iter().sum::<u32>();
    let mut gap = 0;
    for (i, used) in used.into_iter().enumerate() {
        gap |= used ^ u32::from((i as u32) < count);
    }
    (gap == 0).then_some(count as usize)
}

/// Whether two used entries are equal. Every entry against those one to four places on, all round,
/// is every pair, in four steps of eight lanes.
#[inline(always)]
fn names_twice(Bucket(entries): &Bucket) -> bool {
    let mut same = [0; BUCKET_ENTRIES];
    for shift in 1..=BUCKET_ENTRIES / 2 {
        for i in 0..BUCKET_ENTRIES {
            let other = entries[(i + shift) % BUCKET_ENTRIES];
            same[i] |= u32::from(entries[i] == other);
        }
    }
    let mut twice = 0;
    for i in 0..BUCKET_ENTRIES {
        twice |= same[i] & u32::from(entries[i] != EMPTY);
    }
    twice != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{Grid, PointWidths};

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
                (false, _, _) => Err(Fault::PointBits),
                (_, false, _) => Err(Fault::PointCompact),
                (_, _, true) => Err(Fault::FreeCell),
                _ => Ok(()),
            };
            assert_eq!(check_points(points, there, free), wanted, "{points:x?}");
            right += u32::from(wanted.is_ok());
        }
        assert!((50_000..150_000).contains(&right), "{right}");
    }

    #[test]
    fn quick_checks_of_buckets_miss_nothing() {
        let grid = Grid {
            grid_from_mesh: [[0.0; 4]; 3],
            dims: [5, 4, 3],
            cell_edge: 2.0,
            radius: 1.0,
            widths: PointWidths::BITS_32,
            bucket_count: 7,
            cell_capacity: 60,
        };
        let hasher = Hasher::new(&grid);
        let mut state = 3;
        let mut right = 0;
        for _ in 0..20_000 {
            let mut keys: [u32; 60] = core::array::from_fn(|_| draw(&mut state, 60));
            keys[draw(&mut state, 60) as usize] = EMPTY;
            // Right buckets of the cells, and at times one entry that is not.
            let mut indices = [[0; 4]; 7];
            let mut buckets = [[0xff; BUCKET_BYTES]; 7];
            for home in 0..7 {
                indices[home] = (home as u32).to_le_bytes();
                let named = (0..60u32)
                    .filter(|&c| keys[c as usize] != EMPTY)
                    .filter(|&c| hasher.bucket_of_key(keys[c as usize]) == home as u32);
                for (entry, cell) in buckets[home].as_chunks_mut::<4>().0.iter_mut().zip(named) {
                    *entry = cell.to_le_bytes();
                }
            }
            if draw(&mut state, 2) == 0 {
                let bucket = &mut buckets[draw(&mut state, 7) as usize];
                let entries = bucket.as_chunks_mut::<4>().0;
                let from = entries[draw(&mut state, 8) as usize];
                let entry = [u32::from_le_bytes(from), EMPTY, draw(&mut state, 64)];
                entries[draw(&mut state, 8) as usize] =
                    entry[draw(&mut state, 3) as usize].to_le_bytes();
            }
            let quick = buckets_are_right(&indices, &buckets, &hasher, &keys);
            let wanted = find_fault(&indices, &buckets, &hasher, &keys);
            assert_eq!(quick, wanted.is_ok(), "{wanted:?}");
            right += u32::from(quick);
        }
        assert!((5_000..15_000).contains(&right), "{right}");
    }
}
