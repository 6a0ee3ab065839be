//! `points`: grids, buckets and cells, drawn from an input, and the rules that they keep.

use std::collections::{BTreeMap, BTreeSet};

use arbitrary::{Result, Unstructured};
use dapple_codec::points::{
    BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, Coding, Coverage, EMPTY, Grid, PointWidths, State,
    Update,
};
use dapple_codec::{Decoder, Encoder, Model, TrackState};

use super::{TrackContent, in_records};
use crate::records::{matrix_and_dims, put, some};
use crate::server::{compression, matrix};

/// A grid with parameters that hold.
pub fn grid(u: &mut Unstructured<'_>) -> Result<Grid> {
    let dims = match u.int_in_range(0..=9)? {
        0 => [65_535, 65_535, 1],
        1 => [1, 3, 65_535],
        2 => [1, 1, 1],
        _ => [
            u.int_in_range(1..=9)?,
            u.int_in_range(1..=9)?,
            u.int_in_range(1..=9)?,
        ],
    };
    let radius = f32::from(u.int_in_range(1u8..=9)?) / 8.0;
    Ok(Grid {
        grid_from_mesh: matrix(u)?,
        dims,
        cell_edge: radius * if u.arbitrary()? { 2.0 } else { 3.0 },
        radius,
        widths: widths(u)?,
        bucket_count: u.int_in_range(1..=17)?,
        cell_capacity: u.int_in_range(1..=24)?,
        coding: Coding::Cells,
    })
}

fn widths(u: &mut Unstructured<'_>) -> Result<PointWidths> {
    let (position, normal, ao) = *u.choose(&[
        (5, 4, 8),
        (4, 3, 5),
        (2, 2, 5),
        (8, 2, 3),
        (1, 2, 8),
        (3, 4, 6),
        (1, 8, 4),
    ])?;
    Ok(PointWidths {
        position,
        normal,
        ao,
    })
}

/// Number of the coding.
pub fn coding(grid: &Grid) -> u16 {
    match grid.coding {
        Coding::Cells => 0,
    }
}

/// Parameters as bytes, with `scale` times as many buckets and cells.
pub fn parameters(grid: &Grid, scale: u32) -> Vec<u8> {
    let mut bytes = matrix_and_dims(&grid.grid_from_mesh, grid.dims);
    put(
        &mut bytes,
        &[grid.cell_edge.to_bits(), grid.radius.to_bits()],
    );
    bytes.extend([grid.widths.position, grid.widths.normal, grid.widths.ao, 0]);
    put(
        &mut bytes,
        &[grid.bucket_count * scale, grid.cell_capacity * scale],
    );
    bytes
}

/// Buckets and cells of a track. Equal where buckets and cells are, whatever waits to be sent.
#[derive(Clone, Debug)]
pub struct Content {
    /// All buckets.
    pub buckets: Vec<Bucket>,
    /// All cells.
    pub cells: Vec<Cell>,
    changed_buckets: BTreeSet<u32>,
    changed_cells: BTreeSet<u32>,
}

impl PartialEq for Content {
    fn eq(&self, other: &Content) -> bool {
        self.buckets == other.buckets && self.cells == other.cells
    }
}

impl Content {
    /// Of a new track.
    pub fn empty(grid: &Grid) -> Content {
        Content::of(
            vec![Bucket::EMPTY; grid.bucket_count as usize],
            vec![Cell::FREE; grid.cell_capacity as usize],
        )
    }

    /// What a decoder shows.
    pub fn shown(state: &State, track: &TrackState) -> Content {
        let buckets = state.buckets_of(track).to_vec();
        Content::of(buckets, state.cells_of(track).to_vec())
    }

    fn of(buckets: Vec<Bucket>, cells: Vec<Cell>) -> Content {
        Content {
            buckets,
            cells,
            changed_buckets: BTreeSet::new(),
            changed_cells: BTreeSet::new(),
        }
    }

    /// Without cells that no bucket names, and with cells in the order of the buckets.
    pub fn reachable(&self) -> Content {
        let mut cells = Vec::new();
        let mut buckets = self.buckets.clone();
        for Bucket(entries) in &mut buckets {
            for entry in entries.iter_mut().filter(|entry| **entry != EMPTY) {
                cells.push(self.cells[*entry as usize]);
                *entry = 0;
            }
        }
        Content::of(buckets, cells)
    }

    /// Frees a cell, fills one, moves one to another key, or changes its points.
    fn change(&mut self, grid: &Grid, u: &mut Unstructured<'_>) -> Result<()> {
        let index = u.int_in_range(0..=grid.cell_capacity - 1)?;
        let mut cell = self.cells[index as usize];
        let (free, moved) = (u.ratio(1, 5)?, u.ratio(1, 5)?);
        if cell.key != EMPTY && (free || moved) {
            self.unname(grid, index, cell.key);
        }
        if free {
            cell = Cell::FREE;
        } else {
            if cell.key == EMPTY || moved {
                cell.key = u.int_in_range(0..=(grid.volume() - 1) as u32)?;
                // A full bucket leaves the cell without a name, which is allowed.
                self.name(grid, index, cell.key);
            }
            let there = 1u32 << (grid.widths.bits() - 1);
            let used = u.int_in_range(0..=CELL_POINTS)?;
            cell.points = [0; CELL_POINTS];
            for point in &mut cell.points[..used] {
                *point = there | u.arbitrary::<u32>()? & (there - 1);
            }
        }
        self.cells[index as usize] = cell;
        self.changed_cells.insert(index);
        Ok(())
    }

    fn name(&mut self, grid: &Grid, index: u32, key: u32) {
        let bucket = grid.bucket_of_key(key);
        let entries = &mut self.buckets[bucket as usize].0;
        if let Some(at) = entries.iter().position(|&e| e == EMPTY) {
            entries[at] = index;
            self.changed_buckets.insert(bucket);
        }
    }

    fn unname(&mut self, grid: &Grid, index: u32, key: u32) {
        let bucket = grid.bucket_of_key(key);
        let entries = &mut self.buckets[bucket as usize].0;
        if let Some(at) = entries.iter().position(|&e| e == index) {
            entries.copy_within(at + 1.., at);
            entries[BUCKET_ENTRIES - 1] = EMPTY;
            self.changed_buckets.insert(bucket);
        }
    }

    /// What is to be sent: what changed, or all that is in use.
    fn update(&mut self, id: u32, keyframe: bool) -> OwnedUpdate {
        let mut buckets = std::mem::take(&mut self.changed_buckets);
        let mut cells = std::mem::take(&mut self.changed_cells);
        if keyframe {
            let used = (0..)
                .zip(&self.buckets)
                .filter(|(_, b)| **b != Bucket::EMPTY);
            buckets = used.map(|(index, _)| index).collect();
            let used = (0..).zip(&self.cells).filter(|(_, c)| **c != Cell::FREE);
            cells = used.map(|(index, _)| index).collect();
        }
        OwnedUpdate {
            track: id,
            buckets: buckets.iter().map(|&i| self.buckets[i as usize]).collect(),
            bucket_indices: buckets.into_iter().collect(),
            cells: cells.iter().map(|&i| self.cells[i as usize]).collect(),
            cell_indices: cells.into_iter().collect(),
        }
    }
}

/// An owned [`Update`].
struct OwnedUpdate {
    track: u32,
    bucket_indices: Vec<u32>,
    buckets: Vec<Bucket>,
    cell_indices: Vec<u32>,
    cells: Vec<Cell>,
}

/// Changes tracks and writes them ([`super::write`]).
pub fn write(
    u: &mut Unstructured<'_>,
    tracks: Vec<TrackContent<'_>>,
    encoder: &mut Encoder,
    out: &mut Vec<u8>,
) -> Result<()> {
    let (mut full, mut partial) = (Vec::new(), Vec::new());
    for track in tracks {
        let (Model::Points(grid), super::Content::Points(content)) = (track.model, track.content)
        else {
            continue;
        };
        for _ in 0..u.int_in_range(0..=6)? {
            content.change(&grid, u)?;
        }
        let into = if track.keyframe {
            &mut full
        } else {
            &mut partial
        };
        into.push(content.update(track.id, track.keyframe));
    }
    for (coverage, updates) in [(Coverage::Keyframe, full), (Coverage::Delta, partial)] {
        in_records(u, &updates, |u, updates| {
            let updates: Vec<_> = updates
                .iter()
                .map(|owned| Update {
                    track: owned.track,
                    bucket_indices: &owned.bucket_indices,
                    buckets: &owned.buckets,
                    cell_indices: &owned.cell_indices,
                    cells: &owned.cells,
                })
                .collect();
            let written = encoder.points(out, coverage, &updates, compression(u)?);
            written.expect("points");
            Ok(())
        })?;
    }
    Ok(())
}

/// Gaps, buckets, cells and points of some tracks, with changes that fit.
pub fn payload(u: &mut Unstructured<'_>, decoder: &Decoder) -> Result<Vec<u8>> {
    let ids = some(u, decoder)?;
    let last = decoder.last_frame();
    let keyframe = last.is_none() || u.ratio(1, 2)?;
    let base = if keyframe {
        0
    } else {
        last.map_or(0, |(frame, _)| frame)
    };
    let (mut table, mut sections) = (Vec::new(), Vec::new());
    put(&mut table, &[ids.len() as u32, keyframe.into(), base, 0]);
    for track in decoder
        .tracks()
        .iter()
        .filter(|track| ids.contains(&track.track.id))
    {
        let Some(grid) = track.track.grid().copied() else {
            continue;
        };
        let old = |index: u32| match keyframe {
            true => Cell::FREE,
            false => decoder.points().cells_of(track)[index as usize],
        };
        let old_bucket = |index: u32| match keyframe {
            true => Bucket::EMPTY,
            false => decoder.points().buckets_of(track)[index as usize],
        };
        let (buckets, cells) = changes(u, &grid, old, old_bucket)?;
        put(
            &mut table,
            &[track.track.id, buckets.len() as u32, cells.len() as u32],
        );
        gaps(&mut sections, buckets.keys());
        buckets
            .values()
            .for_each(|entries| put(&mut sections, entries));
        gaps(&mut sections, cells.keys());
        cells
            .values()
            .for_each(|cell| put(&mut sections, &[cell.key]));
        let size = grid.widths.bits() as usize / 8;
        let points = cells.values().flat_map(|cell| cell.points);
        sections.extend(points.flat_map(|point| point.to_le_bytes().into_iter().take(size)));
        sections.resize(sections.len().next_multiple_of(4), 0);
    }
    table.extend(sections);
    Ok(table)
}

/// Buckets and cells by their indices.
pub type Changes = (BTreeMap<u32, [u32; 8]>, BTreeMap<u32, Cell>);

/// Changes of a few cells, and of every bucket that they concern.
pub fn changes(
    u: &mut Unstructured<'_>,
    grid: &Grid,
    old: impl Fn(u32) -> Cell,
    old_bucket: impl Fn(u32) -> Bucket,
) -> Result<Changes> {
    let mut cells = BTreeMap::new();
    for _ in 0..u.int_in_range(0..=5)? {
        let index = u.int_in_range(0..=grid.cell_capacity - 1)?;
        cells.insert(index, cell(u, grid.volume() as u32, grid.widths)?);
    }
    let keys = cells
        .iter()
        .flat_map(|(&index, cell)| [cell.key, old(index).key]);
    let homes: BTreeSet<u32> = keys
        .filter(|&key| key != EMPTY)
        .map(|key| grid.bucket_of_key(key))
        .collect();
    let mut buckets = BTreeMap::new();
    for home in homes {
        let kept = old_bucket(home)
            .0
            .into_iter()
            .filter(|e| *e != EMPTY && !cells.contains_key(e));
        let new = cells
            .iter()
            .filter(|(_, cell)| cell.key != EMPTY && grid.bucket_of_key(cell.key) == home);
        let mut entries = [EMPTY; 8];
        for (entry, index) in entries
            .iter_mut()
            .zip(kept.chain(new.map(|(&index, _)| index)))
        {
            *entry = index;
        }
        buckets.insert(home, entries);
    }
    Ok((buckets, cells))
}

fn cell(u: &mut Unstructured<'_>, volume: u32, widths: PointWidths) -> Result<Cell> {
    if u.ratio(1, 5)? {
        return Ok(Cell::FREE);
    }
    let there = 1u32 << (widths.bits() - 1);
    let mut points = [0; CELL_POINTS];
    let used = u.int_in_range(0..=CELL_POINTS)?;
    for point in &mut points[..used] {
        *point = there | u.arbitrary::<u32>()? & (there - 1);
    }
    Ok(Cell {
        key: u.int_in_range(0..=volume - 1)?,
        points,
    })
}

/// Ascending indices as gaps.
fn gaps<'a>(out: &mut Vec<u8>, indices: impl Iterator<Item = &'a u32>) {
    let mut next = 0;
    for &index in indices {
        put(out, &[index - next]);
        next = index + 1;
    }
}

/// What holds of the committed state (`spec/points.md` §5).
pub fn check(decoder: &Decoder) -> u64 {
    let state = decoder.points();
    let places = || {
        let tracks = decoder.tracks().iter();
        tracks.filter_map(|track| state.place_of(track))
    };
    apart(places().map(|place| (place.first_bucket, place.grid.bucket_count)));
    apart(places().map(|place| (place.first_cell, place.grid.cell_capacity)));
    for track in decoder.tracks() {
        if let Some(grid) = track.track.grid() {
            check_track(state, track, grid);
        }
    }
    // Free regions count too.
    32 * state.buckets().len() as u64 + 36 * state.cells().len() as u64
}

/// The regions of tracks do not overlap.
fn apart(regions: impl Iterator<Item = (u32, u32)>) {
    let mut regions: Vec<_> = regions.collect();
    regions.sort_unstable();
    assert!(
        regions.is_sorted_by(|a, b| a.0 + a.1 <= b.0),
        "regions overlap: {regions:?}"
    );
}

fn check_track(state: &State, track: &TrackState, grid: &Grid) {
    let (buckets, cells) = (state.buckets_of(track), state.cells_of(track));
    assert_eq!(buckets.len(), grid.bucket_count as usize);
    assert_eq!(cells.len(), grid.cell_capacity as usize);
    let there = 1u32 << (grid.widths.bits() - 1);
    for cell in cells {
        assert!(cell.key == EMPTY || u64::from(cell.key) < grid.volume());
        let used = cell.points.iter().take_while(|&&p| p != 0).count();
        assert!(used == 0 || cell.key != EMPTY, "a free cell with points");
        for point in &cell.points[..used] {
            assert!(point & there != 0 && u64::from(*point) < 2 * u64::from(there));
        }
        assert!(
            cell.points[used..].iter().all(|&p| p == 0),
            "points are not compact"
        );
    }
    for (index, Bucket(entries)) in (0u32..).zip(buckets) {
        let used = entries.iter().take_while(|&&e| e != EMPTY).count();
        assert!(
            entries[used..].iter().all(|&e| e == EMPTY),
            "entries are not compact"
        );
        for (i, &entry) in entries[..used].iter().enumerate() {
            assert!(entry < grid.cell_capacity);
            assert!(!entries[..i].contains(&entry), "a cell is named twice");
            let key = cells[entry as usize].key;
            assert!(key != EMPTY, "an entry names a free cell");
            assert_eq!(grid.bucket_of_key(key), index);
        }
    }
}
