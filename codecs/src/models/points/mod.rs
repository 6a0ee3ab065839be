//! `points`: ambient occlusion at surface points in hashed grid cells (PSAO §3, `spec/points.md`).

mod check;
mod decode;
mod digest;
mod encode;
mod hash;
mod parameters;
mod point;
mod sections;
mod state;

use crate::container::record_type;
pub use crate::dirty::DirtyRange;
pub use crate::models::payload_header::Coverage;
use crate::models::{Descriptor, LookupSpace, Model};
use crate::session::track::Track;
pub use encode::Update;
pub use hash::Hasher;
pub use state::{Place, State};

pub(crate) use decode::Store;

use bytemuck::{Pod, Zeroable};

use crate::Decoder;

/// Entries in a hash bucket (PSAO §3.2).
pub const BUCKET_ENTRIES: usize = 8;
/// Points in a cell (PSAO §3.2).
pub const CELL_POINTS: usize = 7;
/// An entry of a bucket, or a key of a cell, that holds nothing.
pub const EMPTY: u32 = u32::MAX;

/// A hash bucket: indices of cells within the track, used entries first, then [`EMPTY`].
/// 32 bytes; WGSL `array<u32, 8>`, C `uint32_t[8]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Bucket(pub [u32; BUCKET_ENTRIES]);

impl Bucket {
    /// A bucket that names no cell.
    pub const EMPTY: Bucket = Bucket([EMPTY; BUCKET_ENTRIES]);
}

/// A cell: the dense index of its grid cell, and up to seven packed points, used ones first, then
/// zeros. 32 bytes; WGSL `struct { key: u32, points: array<u32, 7> }`, C
/// `struct { uint32_t key; uint32_t points[7]; }`.
/// Several cells of one bucket may carry the same key: together they hold what seven points cannot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Cell {
    /// `x + Dx * (y + Dy * z)`, or [`EMPTY`].
    pub key: u32,
    /// Points, packed as [`PointWidths`] says, in the low bits of each word.
    pub points: [u32; CELL_POINTS],
}

impl Cell {
    /// A cell that is not in use.
    pub const FREE: Cell = Cell {
        key: EMPTY,
        points: [0; CELL_POINTS],
    };
}

/// Widths of a packed point. From the lowest bit: AO, normal (two octahedral coordinates), position
/// (x, y, z), and one bit that says the point is there, at bit `bits() - 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointWidths {
    /// Bits of each of three position coordinates, 1 to 8.
    pub position: u8,
    /// Bits of each of two octahedral coordinates, 2 to 8.
    pub normal: u8,
    /// Bits of the AO value, 1 to 8.
    pub ao: u8,
}

impl PointWidths {
    /// 1 + 15 + 8 + 8 bits, as in PSAO §3.2.
    pub const BITS_32: PointWidths = PointWidths {
        position: 5,
        normal: 4,
        ao: 8,
    };
    /// 1 + 12 + 6 + 5 bits.
    pub const BITS_24: PointWidths = PointWidths {
        position: 4,
        normal: 3,
        ao: 5,
    };
    /// 1 + 6 + 4 + 5 bits.
    pub const BITS_16: PointWidths = PointWidths {
        position: 2,
        normal: 2,
        ao: 5,
    };

    /// Bits of a packed point, its allocation bit included.
    pub fn bits(&self) -> u32 {
        1 + 3 * u32::from(self.position) + 2 * u32::from(self.normal) + u32::from(self.ao)
    }
}

/// What a track of the model declares, once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Rows of a 3x4 matrix, grid space from mesh space: metres with scale applied, origin at the
    /// grid's corner.
    pub grid_from_mesh: [[f32; 4]; 3],
    /// Cells along x, y, z; their product fits in 32 bits with [`EMPTY`] left over.
    pub dims: [u16; 3],
    /// Edge of a cell in metres, at least `2 * radius`.
    pub cell_edge: f32,
    /// Interpolation radius r of Eq. 2 in metres.
    pub radius: f32,
    /// Widths of a point.
    pub widths: PointWidths,
    /// Number of buckets the hash is reduced by.
    pub bucket_count: u32,
    /// Cells that the track may hold.
    pub cell_capacity: u32,
    /// How buckets and cells are coded.
    pub coding: Coding,
}

/// How buckets and cells of a track are coded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coding {
    /// `cells`: whole buckets and whole cells, as they lie in the arrays.
    #[default]
    Cells,
}

/// The model's entry in the registry.
pub(crate) const DESCRIPTOR: Descriptor = Descriptor {
    name: "points",
    number: 1,
    record_type: record_type::POINTS,
    codings: &["cells"],
    spaces: &[LookupSpace::Mesh, LookupSpace::Rest],
    read: |coding, reader| Ok(Model::Points(Grid::read(coding, reader)?)),
    track_bytes: Store::TRACK_BYTES,
};

impl Grid {
    /// Number of grid cells, `Dx * Dy * Dz`.
    pub fn volume(&self) -> u64 {
        self.dims.iter().map(|&d| u64::from(d)).product()
    }
}

impl Track {
    /// The grid of a `points` track; none of another model.
    pub fn grid(&self) -> Option<&Grid> {
        let Model::Points(grid) = &self.model else {
            return None;
        };
        Some(grid)
    }
}

impl Decoder {
    /// State of the `points` tracks as of the last commit.
    pub fn points(&self) -> &State {
        &self.session.models.points.state
    }
}

#[cfg(test)]
mod tests;
