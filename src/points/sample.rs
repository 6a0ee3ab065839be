//! The client's sampler: ambient occlusion at a surface position from the points about it
//! (PSAO §3.5, Eq. 2-4). The oracle that every other sampler is held to; `embed/shaders/wgsl/points.wgsl` is its twin.
//!
//! Everything is in grid space: mesh space with scale applied, metres, origin at the grid's corner
//! ([`to_grid`]).

use dapple_codec::points::{BUCKET_ENTRIES, Bucket, CELL_POINTS, Cell, EMPTY, Grid};
use glam::{IVec3, Vec3};

/// Smallest cosine between the normals of point and fragment (Eq. 3). SHARED with `embed/shaders/wgsl/points.wgsl`.
pub const T_N: f32 = 0.1;
/// Largest squared cosine between a point's normal and the direction to it (Eq. 3). SHARED with
/// `embed/shaders/wgsl/points.wgsl`.
pub const T_D: f32 = 0.7;
/// Total weight below which [`Fallback::Fill`] fills up. SHARED with `embed/shaders/wgsl/points.wgsl`.
///
/// A fragment amid points twice as far apart as r has a total of about 0.5 to 2, so that 0.1 touches
/// only fragments at the rim of a gap.
pub const FILL_WEIGHT: f32 = 0.1;
/// Track index of a query that has none. SHARED with `embed/shaders/wgsl/points.wgsl`.
pub const NO_TRACK: u32 = u32::MAX;

/// The value of a fragment with too few points in reach for Eq. 4. Values SHARED with `embed/shaders/wgsl/points.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Fallback {
    /// AO = 1 where the weights sum to nothing, as Eq. 4 has it. Sparkles in thinned point sets.
    #[cfg_attr(feature = "cli", value(help = "AO = 1, as in the paper"))]
    One = 0,
    /// Points of the block, already fetched, fill up what is missing of [`FILL_WEIGHT`].
    ///
    /// They pass the same two criteria of Eq. 3 and weigh
    /// `window * (r / max(d, r))^2 * (n_p.n_x - T_n) * (T_d - (n_p.dir)^2)`: no cutoff at r, so that
    /// a gap takes the light of its rim; smooth in both criteria; and `window` falls to zero where
    /// the 2x2x2 block is about to leave the cell (1 for the fragment's own cell, `2 |f - 1/2|` per
    /// axis for a neighbour, f the position within the own cell), so that no point jumps in or out
    /// when the block moves on. A fragment of weight [`FILL_WEIGHT`] or more is Eq. 4 to the bit;
    /// below it the value slides over to the fill, which makes the rim of a gap continuous.
    #[cfg_attr(
        feature = "cli",
        value(help = "The points around it, as far as the lookup goes")
    )]
    #[default]
    Fill = 1,
}

/// How a sample was computed. Values SHARED with `embed/shaders/wgsl/points.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Case {
    /// Points within reach.
    Found = 0,
    /// No point within reach; filled by [`Fallback::Fill`].
    Filled = 1,
    /// Nothing to go by: AO = 1.
    None = 2,
}

/// A fragment's ambient occlusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// 1 is open, 0 closed.
    pub ao: f32,
    /// Sum of the weights of Eq. 2 and 3.
    pub weight: f32,
    /// Points of positive weight, at most those of eight buckets.
    pub points: u32,
    pub case: Case,
}

/// Takes a position and a unit normal from mesh space to grid space. The normal goes by the inverse
/// transpose, so that it stays perpendicular under non-uniform scale.
pub fn to_grid(grid: &Grid, position: Vec3, normal: Vec3) -> (Vec3, Vec3) {
    let transform = GridTransform::new(grid);
    (transform.position(position), transform.normal(normal))
}

/// [`to_grid`] prepared for many fragments.
#[derive(Clone, Copy, Debug)]
pub struct GridTransform {
    grid_from_mesh: glam::Affine3A,
    normals: glam::Mat3A,
}

impl GridTransform {
    pub fn new(grid: &Grid) -> Self {
        let [r0, r1, r2] = grid.grid_from_mesh;
        let linear = glam::Mat3::from_cols_array(&[
            r0[0], r1[0], r2[0], r0[1], r1[1], r2[1], r0[2], r1[2], r2[2],
        ]);
        let grid_from_mesh =
            glam::Affine3A::from_mat3_translation(linear, Vec3::new(r0[3], r1[3], r2[3]));
        // The cofactor matrix is the inverse transpose times the determinant, and exists for flat
        // transforms, too. Its sign follows a mirror so that outward stays outward.
        let cofactors = glam::Mat3A::from_cols(
            linear.y_axis.cross(linear.z_axis).into(),
            linear.z_axis.cross(linear.x_axis).into(),
            linear.x_axis.cross(linear.y_axis).into(),
        );
        let sign = if linear.determinant() < 0.0 {
            -1.0
        } else {
            1.0
        };
        Self {
            grid_from_mesh,
            normals: cofactors * sign,
        }
    }

    pub fn position(&self, position: Vec3) -> Vec3 {
        self.grid_from_mesh.transform_point3(position)
    }

    /// Mesh space from grid space.
    pub fn inverse(&self) -> glam::Affine3A {
        self.grid_from_mesh.inverse()
    }

    pub fn normal(&self, normal: Vec3) -> Vec3 {
        (self.normals * normal).normalize_or(normal)
    }
}

/// A point out of its word: position relative to the cell's corner in metres, unit normal, AO.
#[derive(Clone, Copy, Debug)]
struct Unpacked {
    position: Vec3,
    normal: Vec3,
    ao: f32,
}

fn unpack(grid: &Grid, word: u32) -> Unpacked {
    Unpacked {
        position: Vec3::from(grid.widths.unpack_position(word)) * grid.cell_edge,
        normal: grid.widths.unpack_normal(word).into(),
        ao: grid.widths.unpack_ao(word),
    }
}

/// Whether a track's parameters can be sampled at all; a decoded track always passes.
pub(crate) fn usable(grid: &Grid) -> bool {
    let w = grid.widths;
    let wide_enough = w.position >= 1 && w.normal >= 2 && w.ao >= 1;
    grid.bucket_count > 0 && wide_enough && w.bits() <= 32
}

/// AO at position `x` with unit normal `n`, both in grid space (PSAO Eq. 2-4).
///
/// `buckets` and `cells` are the track's own, `buckets.len() >= grid.bucket_count`. The 2x2x2 block
/// holds, per axis, the cell of `x` and the neighbour on its nearer side; cells outside the grid are
/// skipped. Every entry of a bucket counts until the first [`EMPTY`], and every cell whose key
/// matches, for several may share one. Where a point lies at `x` itself there is no direction to it,
/// and only the normal criterion of Eq. 3 applies. An index that points past `cells` is skipped.
pub fn sample(
    grid: &Grid,
    buckets: &[Bucket],
    cells: &[Cell],
    x: Vec3,
    n: Vec3,
    fallback: Fallback,
) -> Sample {
    let mut sums = Sums::default();
    if usable(grid) {
        gather(grid, buckets, cells, x, n, &mut sums);
    }
    sums.resolve(fallback)
}

#[derive(Default)]
struct Sums {
    weight: f32,
    weighted: f32,
    points: u32,
    fill: f32,
    filled: f32,
}

impl Sums {
    fn add(&mut self, p: &Unpacked, x: Vec3, n: Vec3, radius: f32, window: f32) {
        let agreement = p.normal.dot(n);
        if agreement <= T_N {
            return;
        }
        let to_point = p.position - x;
        let distance = to_point.length();
        let slope = if distance > 0.0 {
            p.normal.dot(to_point / distance)
        } else {
            0.0
        };
        let slope2 = slope * slope;
        if slope2 >= T_D {
            return;
        }
        let alpha = ((radius - distance) / radius).max(0.0);
        if alpha > 0.0 {
            self.points += 1;
        }
        self.weight += alpha;
        self.weighted += alpha * p.ao;
        let ratio = radius / distance.max(radius);
        let tail = window * ratio * ratio * (agreement - T_N) * (T_D - slope2);
        self.fill += tail;
        self.filled += tail * p.ao;
    }

    fn resolve(&self, fallback: Fallback) -> Sample {
        let (ao, case) =
            if fallback == Fallback::Fill && self.weight < FILL_WEIGHT && self.fill > 0.0 {
                let fill = self.filled / self.fill;
                let ao = (self.weighted + (FILL_WEIGHT - self.weight) * fill) / FILL_WEIGHT;
                let found = self.weight > 0.0;
                (ao, if found { Case::Found } else { Case::Filled })
            } else if self.weight > 0.0 {
                (self.weighted / self.weight, Case::Found)
            } else {
                (1.0, Case::None)
            };
        Sample {
            ao,
            weight: self.weight,
            points: self.points,
            case,
        }
    }
}

fn gather(grid: &Grid, buckets: &[Bucket], cells: &[Cell], x: Vec3, n: Vec3, sums: &mut Sums) {
    let dims = IVec3::from(grid.dims.map(i32::from));
    let scaled = (x / grid.cell_edge).clamp(Vec3::splat(-2.0), Vec3::splat(65537.0));
    let base = scaled.floor();
    let near = scaled - base;
    let side = near.map(|f| if f >= 0.5 { 1.0 } else { -1.0 });
    let window = (near - 0.5).abs() * 2.0;
    for corner in 0..8u32 {
        let pick = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
        let offset = Vec3::from(pick.map(|p| p as f32)) * side;
        let at = (base + offset).as_ivec3();
        if at.cmplt(IVec3::ZERO).any() || at.cmpge(dims).any() {
            continue;
        }
        let cell_window = (0..3)
            .filter(|&axis| pick[axis] == 1)
            .map(|axis| window[axis]);
        let cell_window = cell_window.product::<f32>();
        let cell = at.as_uvec3().to_array();
        let key = grid.key(cell);
        // x relative to the cell's corner, as the points are: keeps precision far from the origin.
        let x_cell = x - at.as_vec3() * grid.cell_edge;
        let Some(bucket) = buckets.get(grid.bucket(cell) as usize) else {
            continue;
        };
        for index in bucket
            .0
            .iter()
            .take(BUCKET_ENTRIES)
            .take_while(|i| **i != EMPTY)
        {
            let Some(cell) = cells.get(*index as usize).filter(|cell| cell.key == key) else {
                continue;
            };
            for word in cell.points.iter().take(CELL_POINTS) {
                if grid.widths.is_used(*word) {
                    let point = unpack(grid, *word);
                    sums.add(&point, x_cell, n, grid.radius, cell_window);
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "sample_tests.rs"]
pub(crate) mod tests;
