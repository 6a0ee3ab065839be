//! `points`: ambient occlusion at surface points in hashed grid cells (PSAO §3).

use bytemuck::{Pod, Zeroable};

/// Entries in a hash bucket (PSAO §3.2).
pub const BUCKET_ENTRIES: usize = 8;
/// Points in a cell (PSAO §3.2).
pub const CELL_POINTS: usize = 7;
/// An entry of a bucket, or a key of a cell, that holds nothing.
pub const EMPTY: u32 = u32::MAX;

/// A hash bucket: indices of cells within the track, used entries first, then [`EMPTY`].
/// 32 bytes; WGSL `array<u32, 8>`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Bucket(pub [u32; BUCKET_ENTRIES]);

/// A cell: the dense index of its grid cell, and up to seven packed points, used ones first, then
/// zeros. 32 bytes; WGSL `struct { key: u32, points: array<u32, 7> }`.
/// Several cells of one bucket may carry the same key: together they hold what seven points cannot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Cell {
    pub key: u32,
    pub points: [u32; CELL_POINTS],
}

/// Widths of a packed point. From the lowest bit: AO, normal (two octahedral coordinates), position
/// (x, y, z), and one bit that says the point is there, at bit `bits() - 1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointWidths {
    /// Bits of each of three position coordinates.
    pub position: u8,
    /// Bits of each of two octahedral coordinates.
    pub normal: u8,
    pub ao: u8,
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
    pub widths: PointWidths,
    /// Number of buckets the hash is reduced by.
    pub bucket_count: u32,
    /// Cells that the track may hold.
    pub cell_capacity: u32,
}
