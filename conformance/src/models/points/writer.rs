//! The parameters and records of `points`, byte by byte, from `spec/points.md` alone.

use dapple_codec::points::EMPTY;

use crate::models::Parameters;
use crate::models::entry::Entry;
use crate::stream_builder::{IDENTITY, floats, words};

/// The parameters of a grid as they will stand there.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    pub grid_from_mesh: [f32; 12],
    pub dims: [u16; 3],
    pub dims_reserved: u16,
    pub cell_edge: f32,
    pub radius: f32,
    /// Position, normal, AO.
    pub widths: [u8; 3],
    pub widths_reserved: u8,
    pub buckets: u32,
    pub capacity: u32,
}

impl Default for Grid {
    /// A small grid of 4 x 3 x 2 cubes, 5 buckets and at most 6 cells.
    fn default() -> Grid {
        Grid {
            grid_from_mesh: IDENTITY,
            dims: [4, 3, 2],
            dims_reserved: 0,
            cell_edge: 0.5,
            radius: 0.25,
            widths: [5, 4, 8],
            widths_reserved: 0,
            buckets: 5,
            capacity: 6,
        }
    }
}

impl Grid {
    /// The 84 bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut grid = floats(&self.grid_from_mesh);
        grid.extend(self.dims.iter().flat_map(|dim| dim.to_le_bytes()));
        grid.extend(self.dims_reserved.to_le_bytes());
        grid.extend(floats(&[self.cell_edge, self.radius]));
        grid.extend(self.widths);
        grid.push(self.widths_reserved);
        grid.extend(words(&[self.buckets, self.capacity]));
        grid
    }

    /// Dense index of a cube.
    pub fn key(&self, [x, y, z]: [u32; 3]) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        x.wrapping_add(dx.wrapping_mul(y.wrapping_add(dy.wrapping_mul(z))))
    }

    /// Bucket of a key (PSAO Eq. 1).
    pub fn bucket(&self, key: u32) -> u32 {
        let [dx, dy, _] = self.dims.map(u32::from);
        let (x, y, z) = (key % dx, key / dx % dy, key / dx / dy);
        let h = x
            .wrapping_add(y.wrapping_mul(dx.wrapping_mul(17)))
            .wrapping_add(z.wrapping_mul(dx.wrapping_mul(dy).wrapping_mul(31)));
        h % self.buckets
    }

    /// Bytes of a packed point.
    pub fn point_bytes(&self) -> usize {
        let [position, normal, ao] = self.widths.map(usize::from);
        (1 + 3 * position + 2 * normal + ao) / 8
    }

    /// A point of this track's widths from its codes.
    pub fn point(&self, position: [u32; 3], normal: [u32; 2], ao: u32) -> u32 {
        let [p, n, a] = self.widths.map(u32::from);
        let mut word = 1;
        for axis in [2, 1, 0] {
            word = word << p | position[axis];
        }
        word << (2 * n + a) | normal[1] << (n + a) | normal[0] << a | ao
    }
}

impl Entry {
    /// An entry of `points` with the usual small grid.
    pub fn new(id: u32) -> Entry {
        Entry::of_grid(id, Grid::default())
    }

    /// An entry of `points`.
    pub fn of_grid(id: u32, grid: Grid) -> Entry {
        Entry::of(id, 1, 0, Parameters::Points(grid))
    }

    /// The parameters of an entry of `points`.
    ///
    /// # Panics
    /// If the entry is of another model.
    pub fn grid(&self) -> &Grid {
        let Parameters::Points(grid) = &self.parameters else {
            panic!("track {} is not of points", self.id);
        };
        grid
    }

    /// As [`Entry::grid`], to change it.
    ///
    /// # Panics
    /// If the entry is of another model.
    pub fn grid_mut(&mut self) -> &mut Grid {
        let Parameters::Points(grid) = &mut self.parameters else {
            panic!("track {} is not of points", self.id);
        };
        grid
    }

    /// The entry with its grid changed.
    pub fn with_grid(mut self, change: impl FnOnce(&mut Grid)) -> Entry {
        change(self.grid_mut());
        self
    }
}

/// A track's part of a `points` payload.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    pub id: u32,
    /// Index and entries; fewer than eight are filled up with EMPTY.
    pub buckets: Vec<(u32, Vec<u32>)>,
    /// Index, key and points; fewer than seven are filled up with 0.
    pub cells: Vec<(u32, u32, Vec<u32>)>,
    /// Bytes of a point.
    pub point_bytes: usize,
}

impl Part {
    /// An empty part of a track.
    pub fn of(entry: &Entry) -> Part {
        Part {
            id: entry.id,
            point_bytes: entry.grid().point_bytes(),
            ..Part::default()
        }
    }

    /// With a bucket.
    pub fn bucket(mut self, index: u32, entries: &[u32]) -> Part {
        self.buckets.push((index, entries.to_vec()));
        self
    }

    /// With a cell.
    pub fn cell(mut self, index: u32, key: u32, points: &[u32]) -> Part {
        self.cells.push((index, key, points.to_vec()));
        self
    }
}

/// Payload of a `points` record; `base` is `None` for a keyframe.
pub fn points(base: Option<u32>, parts: &[Part]) -> Vec<u8> {
    let flags = u32::from(base.is_none());
    let mut payload = words(&[parts.len() as u32, flags, base.unwrap_or(0), 0]);
    for part in parts {
        let counts = [part.buckets.len() as u32, part.cells.len() as u32];
        payload.extend(words(&[part.id, counts[0], counts[1]]));
    }
    for part in parts {
        payload.extend(words(&gaps(part.buckets.iter().map(|bucket| bucket.0))));
        for (_, entries) in &part.buckets {
            let mut all = [EMPTY; 8];
            all[..entries.len()].copy_from_slice(entries);
            payload.extend(words(&all));
        }
        payload.extend(words(&gaps(part.cells.iter().map(|cell| cell.0))));
        payload.extend(words(&part.cells.iter().map(|c| c.1).collect::<Vec<_>>()));
        for (_, _, points) in &part.cells {
            let mut all = [0; 7];
            all[..points.len()].copy_from_slice(points);
            for point in all {
                payload.extend(&point.to_le_bytes()[..part.point_bytes]);
            }
        }
        payload.resize(payload.len().next_multiple_of(4), 0);
    }
    payload
}

/// Gaps of ascending indices.
pub fn gaps(indices: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut next = 0u32;
    indices
        .map(|index| {
            let gap = index.wrapping_sub(next);
            next = index.wrapping_add(1);
            gap
        })
        .collect()
}
