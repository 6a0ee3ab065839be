//! The virtual grid of a mesh instance and its hash (PSAO §3.2).

use crate::codec::points::{BUCKET_ENTRIES, Coding, Grid, PointWidths};
use glam::{Affine3A, DMat3, DVec3, Mat3, Vec3};

/// Scales below this share of the largest flatten.
const FLAT: f64 = 1e-6;

/// Splits the linear part of a transform into `(rotation, scale)` with `linear = rotation * scale`:
/// grid space keeps the scale, so that r stays isotropic, and loses rotation and translation.
/// Polar decomposition by Newton's iteration (Higham 1986). A transform that flattens has a scale that
/// does; `None` for one that leaves a line or a point, or is not finite.
pub fn split(world_from_mesh: &Affine3A) -> Option<(Mat3, Mat3)> {
    let linear = Mat3::from(world_from_mesh.matrix3).as_dmat3();
    let regular = regular(&linear)?;
    // A reflection belongs to the scale.
    let mut rotation = if regular.determinant() < 0.0 {
        regular * -1.0
    } else {
        regular
    };
    for _ in 0..64 {
        let next = (rotation + rotation.inverse().transpose()) * 0.5;
        let step = (next - rotation)
            .to_cols_array()
            .iter()
            .fold(0.0f64, |m, x| m.max(x.abs()));
        rotation = next;
        if step < 1e-12 {
            break;
        }
    }
    let scale = rotation.transpose() * linear;
    Some((rotation.as_mat3(), scale.as_mat3()))
}

/// The scale of [`split`], with something in the place of a direction that it flattens.
pub fn invertible(scale: Mat3) -> Mat3 {
    regular(&scale.as_dmat3())
        .unwrap_or(DMat3::IDENTITY)
        .as_mat3()
}

/// The matrix, or one that maps the direction that it flattens to the normal of its plane. `None`
/// where it leaves a line or a point.
fn regular(m: &DMat3) -> Option<DMat3> {
    let size = m
        .x_axis
        .length()
        .max(m.y_axis.length())
        .max(m.z_axis.length());
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let unit = *m * (1.0 / size);
    // The largest cross product of two columns, or of two rows: a normal of what they span.
    let normal = |m: &DMat3| -> DVec3 {
        let all = [m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis)];
        all.into_iter().fold(m.x_axis.cross(m.y_axis), |a, b| {
            if b.length_squared() > a.length_squared() {
                b
            } else {
                a
            }
        })
    };
    let (onto, from) = (normal(&unit), normal(&unit.transpose()));
    if onto.length() <= FLAT {
        return None;
    }
    if unit.determinant().abs() > FLAT * onto.length() {
        return Some(*m);
    }
    let (onto, from) = (onto.normalize(), from.normalize());
    let lifted = DMat3::from_cols(onto * from.x, onto * from.y, onto * from.z);
    // Either normal of the plane will do: the one that makes no mirror.
    let mirrors = (unit + lifted).determinant() < 0.0;
    Some(*m + lifted * if mirrors { -size } else { size })
}

/// What a grid has to hold: bounds of all points it may ever see, in scaled mesh space.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    pub min: Vec3,
    pub max: Vec3,
}

/// Lays a grid over `extent` with cells of twice the interpolation radius: the 2x2x2 block about a
/// fragment then holds every point within the radius. The hash is not chosen yet
/// ([`search_bucket_count`]). `None` when the grid has more cells than 32 bits can number.
pub fn lay(extent: Extent, scale: Mat3, radius: f32, widths: PointWidths) -> Option<Grid> {
    let cell_edge = 2.0 * radius;
    // Half a cell of margin keeps points that animation or rounding moves a little inside.
    let origin = extent.min - Vec3::splat(0.5 * cell_edge);
    let cells = ((extent.max - origin) / cell_edge + 0.5)
        .ceil()
        .max(Vec3::ONE);
    if cells.is_nan()
        || cells.max_element() > u16::MAX as f32
        || cells.x as f64 * cells.y as f64 * cells.z as f64 >= u32::MAX as f64
    {
        return None;
    }
    let rows = scale.transpose();
    Some(Grid {
        grid_from_mesh: [
            [rows.x_axis.x, rows.x_axis.y, rows.x_axis.z, -origin.x],
            [rows.y_axis.x, rows.y_axis.y, rows.y_axis.z, -origin.y],
            [rows.z_axis.x, rows.z_axis.y, rows.z_axis.z, -origin.z],
        ],
        dims: [cells.x as u16, cells.y as u16, cells.z as u16],
        cell_edge,
        radius,
        widths,
        bucket_count: 1,
        cell_capacity: 0,
        coding: Coding::Cells,
    })
}

/// Whether [`lay`] can lay a grid over points that reach so far along each axis, with room for poses
/// that reach farther.
pub fn fits(size: Vec3, radius: f32) -> bool {
    let cells = size.as_dvec3() * 1.2 / f64::from(2.0 * radius) + 4.0;
    cells.max_element() < f64::from(u16::MAX) && cells.element_product() < f64::from(u32::MAX)
}

/// Grid cell of a position in grid space, or `None` outside the grid.
pub fn cell_at(grid: &Grid, position: Vec3) -> Option<[u32; 3]> {
    let c = (position / grid.cell_edge).floor();
    let inside = c.cmpge(Vec3::ZERO).all()
        && c.x < grid.dims[0] as f32
        && c.y < grid.dims[1] as f32
        && c.z < grid.dims[2] as f32;
    inside.then_some([c.x as u32, c.y as u32, c.z as u32])
}

/// Finds a bucket count for which no bucket overflows at any of the given occupancies.
///
/// `occupancies` lists, for each pose that is looked at, the grid cells in use and how many
/// `Cell`s each needs. The search starts from the paper's size (4x the cells over 8 entries) and
/// tries odd counts upwards: Eq. 1 has strides that share factors with even counts, and some grids
/// then fall onto a fraction of the buckets. Gives up at 4x the paper's size and returns the count
/// that overflowed least. `spare` entries of every bucket are to stay free.
pub fn search_bucket_count(grid: &Grid, occupancies: &[Vec<([u32; 3], u32)>], spare: u32) -> u32 {
    let cells = occupancies
        .iter()
        .map(|o| o.iter().map(|c| c.1 as usize).sum())
        .max()
        .unwrap_or(0);
    let paper = (4 * cells).div_ceil(BUCKET_ENTRIES).max(1) as u32 | 1;
    let room = BUCKET_ENTRIES as u32 - spare;
    let mut best = (usize::MAX, paper);
    let mut load = Vec::new();
    let mut count = paper;
    let mut tries = 0;
    while count <= paper.saturating_mul(4).max(65) && tries < 400 {
        let mut overflow = 0usize;
        for occupancy in occupancies {
            load.clear();
            load.resize(count as usize, 0u32);
            let trial = Grid {
                bucket_count: count,
                ..*grid
            };
            for &(cell, chained) in occupancy {
                load[trial.bucket(cell) as usize] += chained;
            }
            overflow += load
                .iter()
                .map(|&l| l.saturating_sub(room) as usize)
                .sum::<usize>();
        }
        if overflow < best.0 {
            best = (overflow, count);
        }
        if overflow == 0 {
            break;
        }
        tries += 1;
        // Small steps first, then growing ones: a collapse is cured by any odd count, a crowded
        // table only by a larger one.
        count += 2 + ((paper / 64) & !1) * (tries / 16);
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    #[test]
    fn split_takes_rotation_off_and_keeps_scale() {
        let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0);
        for scale in [
            Vec3::ONE,
            Vec3::new(0.5, 2.0, 3.0),
            Vec3::new(-1.0, 1.0, 2.0),
            Vec3::splat(-0.01),
        ] {
            let transform = Affine3A::from_scale_rotation_translation(scale, rotation, Vec3::X);
            let (r, s) = split(&transform).unwrap();
            assert!((r.determinant() - 1.0).abs() < 1e-5);
            assert!((r * s).abs_diff_eq(Mat3::from(transform.matrix3), 1e-5));
            // Distances in grid space are distances in the world.
            let (a, b) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(-2.0, 0.5, 1.0));
            let world = transform
                .transform_point3(a)
                .distance(transform.transform_point3(b));
            assert!((s * (a - b)).length() / world - 1.0 < 1e-5);
        }
        assert!(split(&Affine3A::from_scale(Vec3::new(1.0, 0.0, 0.0))).is_none());
        assert!(split(&Affine3A::from_scale(Vec3::ZERO)).is_none());
        assert!(split(&Affine3A::from_scale(Vec3::splat(f32::NAN))).is_none());
    }

    #[test]
    fn split_flattens_where_the_transform_does() {
        let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0);
        for scale in [
            Vec3::new(2.0, 0.0, 3.0),
            Vec3::new(0.0, 1e-3, 1e-3),
            Vec3::new(5.0, 5.0, 1e-9),
        ] {
            let transform = Affine3A::from_scale_rotation_translation(scale, rotation, Vec3::X);
            let (r, s) = split(&transform).expect("a plane is left");
            assert!((r.determinant() - 1.0).abs() < 1e-5);
            let size = scale.max_element();
            assert!((r * s).abs_diff_eq(Mat3::from(transform.matrix3), 1e-5 * size));
            assert!(
                s.abs_diff_eq(Mat3::from_diagonal(scale), 1e-5 * size),
                "{s}"
            );
        }
    }

    #[test]
    fn a_grid_too_fine_for_32_bits_is_refused() {
        let extent = Extent {
            min: Vec3::ZERO,
            max: Vec3::splat(200.0),
        };
        assert!(lay(extent, Mat3::IDENTITY, 0.05, PointWidths::BITS_32).is_none());
        let grid = lay(extent, Mat3::IDENTITY, 0.5, PointWidths::BITS_32).unwrap();
        assert_eq!(grid.dims, [201, 201, 201]);
        let transform = crate::points::sample::GridTransform::new(&grid);
        for corner in [extent.min, extent.max] {
            assert!(cell_at(&grid, transform.position(corner)).is_some());
        }
        assert!(cell_at(&grid, Vec3::splat(-0.01)).is_none());
        assert!(cell_at(&grid, Vec3::splat(f32::NAN)).is_none());
    }

    /// A floor in a 64x32x64 grid: with 2048 buckets Eq. 1 falls onto 1/8 of them.
    #[test]
    fn the_search_mends_a_hash_that_collapses() {
        let mut grid = lay(
            Extent {
                min: Vec3::ZERO,
                max: Vec3::new(62.9, 30.9, 62.9),
            },
            Mat3::IDENTITY,
            0.5,
            PointWidths::BITS_32,
        )
        .unwrap();
        grid.dims = [64, 32, 64];
        let floor: Vec<([u32; 3], u32)> = (0..64)
            .flat_map(|x| (0..64).map(move |z| ([x, 3, z], 1)))
            .collect();
        let overflow = |bucket_count: u32| {
            let grid = Grid {
                bucket_count,
                ..grid
            };
            let mut load = vec![0u32; bucket_count as usize];
            floor
                .iter()
                .for_each(|(c, _)| load[grid.bucket(*c) as usize] += 1);
            load.iter().map(|l| l.saturating_sub(8)).sum::<u32>()
        };
        assert!(
            overflow(2048) > 4096 * 8 / 10,
            "the trap is gone: {}",
            overflow(2048)
        );
        let found = search_bucket_count(&grid, std::slice::from_ref(&floor), 0);
        assert_eq!(overflow(found), 0, "{found} buckets");
        assert!(found < 2 * 2048);
    }
}
