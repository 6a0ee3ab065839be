//! Memory management of one track (PSAO §3.2): which point is in which cell, which cell is in
//! which bucket, and what changed since the last emission.

use crate::codec::points::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY, Grid};
use std::collections::BTreeSet;

/// What happens to the eighth point of a grid cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Overflow {
    /// It goes into another `Cell` with the same key in the same bucket.
    #[cfg_attr(
        feature = "cli",
        value(help = "It goes into another cell of the same key")
    )]
    #[default]
    Chain,
    /// It is discarded and counted, as in PSAO.
    #[cfg_attr(
        feature = "cli",
        value(help = "It is discarded, as in PSAO, and counted")
    )]
    Drop,
}

impl Overflow {
    /// `Cell`s that a grid cell with `points` points takes.
    pub fn cells_for(self, points: usize) -> u32 {
        match self {
            Overflow::Chain => points.div_ceil(CELL_POINTS) as u32,
            Overflow::Drop => points.min(1) as u32,
        }
    }
}

/// Where a point is stored: `cell * 7 + slot`, or [`EMPTY`] for a point that is not.
pub type Place = u32;

/// Buckets and cells of one track as the client will see them.
#[derive(Clone, Debug)]
pub struct Store {
    grid: Grid,
    overflow: Overflow,
    buckets: Vec<Bucket>,
    cells: Vec<Cell>,
    /// Point in each slot of each cell, by its number within the track.
    owners: Vec<[u32; CELL_POINTS]>,
    places: Vec<Place>,
    free_cells: Vec<u32>,
    dirty_buckets: Vec<u32>,
    dirty_cells: Vec<u32>,
    bucket_is_dirty: Vec<bool>,
    cell_is_dirty: Vec<bool>,
    /// Points that ever did not fit into a cell or bucket, or lay outside the grid. One that is
    /// dropped again counts once.
    pub dropped_points: u64,
    /// Grid cells whose `Cell` ever did not fit into their bucket or the track.
    pub dropped_cells: u64,
    point_was_dropped: Vec<bool>,
    dropped_keys: BTreeSet<u32>,
}

impl Store {
    /// An empty store for `points` points.
    pub fn new(grid: Grid, points: usize, overflow: Overflow) -> Self {
        let (buckets, cells) = (grid.bucket_count as usize, grid.cell_capacity as usize);
        Store {
            grid,
            overflow,
            buckets: vec![Bucket([EMPTY; BUCKET_ENTRIES]); buckets],
            cells: vec![
                Cell {
                    key: EMPTY,
                    points: [0; CELL_POINTS]
                };
                cells
            ],
            owners: vec![[EMPTY; CELL_POINTS]; cells],
            places: vec![EMPTY; points],
            free_cells: (0..cells as u32).rev().collect(),
            dirty_buckets: Vec::new(),
            dirty_cells: Vec::new(),
            bucket_is_dirty: vec![false; buckets],
            cell_is_dirty: vec![false; cells],
            dropped_points: 0,
            dropped_cells: 0,
            point_was_dropped: vec![false; points],
            dropped_keys: BTreeSet::new(),
        }
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    pub fn buckets(&self) -> &[Bucket] {
        &self.buckets
    }

    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// Whether the point is stored.
    pub fn has(&self, point: u32) -> bool {
        self.places[point as usize] != EMPTY
    }

    /// Points that are stored.
    pub fn used_points(&self) -> usize {
        self.places.iter().filter(|place| **place != EMPTY).count()
    }

    /// Cells that hold at least one point.
    pub fn used_cells(&self) -> usize {
        self.cells.len() - self.free_cells.len()
    }

    /// Puts `point`'s packed word into the grid cell it lies in, moving it if it was in another.
    /// `cell` is `None` outside the grid.
    pub fn set(&mut self, point: u32, cell: Option<[u32; 3]>, word: u32) {
        let place = self.places[point as usize];
        let key = cell.map(|c| self.grid.key(c));
        if place != EMPTY {
            let (index, slot) = split_place(place);
            if key == Some(self.cells[index].key) {
                self.cells[index].points[slot] = word;
                self.mark_cell(index);
                return;
            }
            self.remove(point);
        }
        let stored = cell.is_some_and(|cell| self.insert(point, cell, word));
        if !stored && !std::mem::replace(&mut self.point_was_dropped[point as usize], true) {
            self.dropped_points += 1;
        }
    }

    /// Takes `point` out, if it is stored.
    pub fn unset(&mut self, point: u32) {
        if self.has(point) {
            self.remove(point);
        }
    }

    fn insert(&mut self, point: u32, cell: [u32; 3], word: u32) -> bool {
        let key = self.grid.key(cell);
        let bucket = self.grid.bucket(cell) as usize;
        let mut entries = 0;
        for &entry in &self.buckets[bucket].0 {
            if entry == EMPTY {
                break;
            }
            entries += 1;
            let index = entry as usize;
            if self.cells[index].key == key {
                if let Some(slot) = self.owners[index].iter().position(|&o| o == EMPTY) {
                    self.put(point, index, slot, word);
                    return true;
                }
                if self.overflow == Overflow::Drop {
                    return false;
                }
            }
        }
        if entries == BUCKET_ENTRIES || self.free_cells.is_empty() {
            self.dropped_cells += u64::from(self.dropped_keys.insert(key));
            return false;
        }
        let Some(index) = self.free_cells.pop() else {
            return false;
        };
        self.buckets[bucket].0[entries] = index;
        self.mark_bucket(bucket);
        self.cells[index as usize].key = key;
        self.put(point, index as usize, 0, word);
        true
    }

    fn put(&mut self, point: u32, index: usize, slot: usize, word: u32) {
        self.cells[index].points[slot] = word;
        self.owners[index][slot] = point;
        self.places[point as usize] = (index * CELL_POINTS + slot) as Place;
        self.mark_cell(index);
    }

    /// Takes a point out; the last point of the cell fills the hole, and an empty cell is freed.
    fn remove(&mut self, point: u32) {
        let (index, slot) = split_place(self.places[point as usize]);
        self.places[point as usize] = EMPTY;
        let last = self.owners[index]
            .iter()
            .rposition(|&o| o != EMPTY)
            .unwrap_or(slot);
        self.cells[index].points.swap(slot, last);
        self.owners[index].swap(slot, last);
        self.cells[index].points[last] = 0;
        self.owners[index][last] = EMPTY;
        if self.owners[index][slot] != EMPTY {
            self.places[self.owners[index][slot] as usize] = (index * CELL_POINTS + slot) as Place;
        }
        self.mark_cell(index);
        if self.owners[index][0] != EMPTY {
            return;
        }
        let key = self.cells[index].key;
        let bucket = self.grid.bucket_of_key(key) as usize;
        let entries = &mut self.buckets[bucket].0;
        if let Some(hole) = entries.iter().position(|&e| e == index as u32) {
            entries.copy_within(hole + 1.., hole);
            entries[BUCKET_ENTRIES - 1] = EMPTY;
        }
        self.mark_bucket(bucket);
        self.cells[index].key = EMPTY;
        self.free_cells.push(index as u32);
    }

    fn mark_cell(&mut self, index: usize) {
        if !std::mem::replace(&mut self.cell_is_dirty[index], true) {
            self.dirty_cells.push(index as u32);
        }
    }

    fn mark_bucket(&mut self, index: usize) {
        if !std::mem::replace(&mut self.bucket_is_dirty[index], true) {
            self.dirty_buckets.push(index as u32);
        }
    }

    /// Indices of buckets and cells that changed since the last call, ascending.
    pub fn take_dirty(&mut self) -> (Vec<u32>, Vec<u32>) {
        for &c in &self.dirty_cells {
            self.cell_is_dirty[c as usize] = false;
        }
        for &b in &self.dirty_buckets {
            self.bucket_is_dirty[b as usize] = false;
        }
        self.dirty_buckets.sort_unstable();
        self.dirty_cells.sort_unstable();
        (
            std::mem::take(&mut self.dirty_buckets),
            std::mem::take(&mut self.dirty_cells),
        )
    }
}

fn split_place(place: Place) -> (usize, usize) {
    (place as usize / CELL_POINTS, place as usize % CELL_POINTS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::points::PointWidths;
    use crate::rng::Rng;
    use std::collections::BTreeMap;

    fn grid(bucket_count: u32, cell_capacity: u32) -> Grid {
        Grid {
            grid_from_mesh: [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
            ],
            dims: [6, 5, 4],
            cell_edge: 1.0,
            radius: 0.5,
            widths: PointWidths::BITS_32,
            bucket_count,
            cell_capacity,
            coding: crate::codec::points::Coding::Cells,
        }
    }

    /// All words a client finds under a grid cell.
    fn look_up(store: &Store, cell: [u32; 3]) -> Vec<u32> {
        let grid = store.grid();
        let mut words: Vec<u32> = store.buckets()[grid.bucket(cell) as usize]
            .0
            .iter()
            .take_while(|e| **e != EMPTY)
            .map(|e| store.cells()[*e as usize])
            .filter(|c| c.key == grid.key(cell))
            .flat_map(|c| c.points.into_iter().take_while(|w| *w != 0))
            .collect();
        words.sort_unstable();
        words
    }

    /// Random moves against a plain map from grid cell to words.
    fn against_a_map(overflow: Overflow, bucket_count: u32, cell_capacity: u32) -> Store {
        let mut rng = Rng::new(11);
        let mut store = Store::new(grid(bucket_count, cell_capacity), 300, overflow);
        let mut at: BTreeMap<u32, ([u32; 3], u32)> = BTreeMap::new();
        for step in 0..6000u32 {
            let point = (rng.draw() % 300) as u32;
            let cell = [
                rng.draw() as u32 % 6,
                rng.draw() as u32 % 5,
                rng.draw() as u32 % 4,
            ];
            let word = 1 << 31 | step;
            store.set(point, Some(cell), word);
            at.remove(&point);
            if store.has(point) {
                at.insert(point, (cell, word));
            }
            if step % 200 == 0 {
                store.take_dirty();
            }
        }
        let mut expected: BTreeMap<[u32; 3], Vec<u32>> = BTreeMap::new();
        for (cell, word) in at.values() {
            expected.entry(*cell).or_default().push(*word);
        }
        let mut cells = 0;
        for x in 0..6 {
            for y in 0..5 {
                for z in 0..4 {
                    let mut words = expected.remove(&[x, y, z]).unwrap_or_default();
                    words.sort_unstable();
                    assert_eq!(look_up(&store, [x, y, z]), words, "cell {x} {y} {z}");
                    cells += usize::from(!words.is_empty());
                }
            }
        }
        assert!(store.used_cells() >= cells);
        store
    }

    #[test]
    fn holds_what_a_map_holds() {
        let store = against_a_map(Overflow::Chain, 61, 400);
        assert_eq!(store.dropped_points, 0);
    }

    #[test]
    fn what_is_dropped_is_counted_and_nothing_else_is_lost() {
        let store = against_a_map(Overflow::Drop, 7, 50);
        assert!(store.dropped_points > 0 && store.dropped_cells > 0);
    }

    #[test]
    fn dirty_lists_turn_an_old_copy_into_the_new_state() {
        let mut rng = Rng::new(23);
        let mut store = Store::new(grid(61, 300), 200, Overflow::Chain);
        let (mut buckets, mut cells) = (store.buckets().to_vec(), store.cells().to_vec());
        for _ in 0..50 {
            for _ in 0..40 {
                let cell = [
                    rng.draw() as u32 % 6,
                    rng.draw() as u32 % 5,
                    rng.draw() as u32 % 4,
                ];
                store.set(
                    rng.draw() as u32 % 200,
                    Some(cell),
                    rng.draw() as u32 | 1 << 31,
                );
            }
            let (dirty_buckets, dirty_cells) = store.take_dirty();
            assert!(dirty_buckets.is_sorted() && dirty_cells.is_sorted());
            dirty_buckets
                .iter()
                .for_each(|&b| buckets[b as usize] = store.buckets()[b as usize]);
            dirty_cells
                .iter()
                .for_each(|&c| cells[c as usize] = store.cells()[c as usize]);
            assert_eq!((&buckets[..], &cells[..]), (store.buckets(), store.cells()));
        }
        assert_eq!(store.take_dirty(), (vec![], vec![]));
    }

    #[test]
    fn a_point_outside_the_grid_is_dropped_and_counted() {
        let mut store = Store::new(grid(61, 10), 1, Overflow::Chain);
        store.set(0, Some([0, 0, 0]), 1 << 31);
        store.set(0, None, 1 << 31);
        store.set(0, None, 1 << 31);
        assert!(!store.has(0));
        assert_eq!((store.dropped_points, store.used_cells()), (1, 0));
    }
}
