//! Where the probes of a volume stand in its own space, grid space: metres, axes of the grid, origin
//! at the first probe.

use glam::{UVec3, Vec3};

/// A grid of probes: `dims` of them along x, y, z, `spacing` metres apart. Each is at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    pub dims: [u16; 3],
    /// Greater than 0, also along an axis of one probe.
    pub spacing: Vec3,
}

/// A probe that a point lies next to, and its trilinear weight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    pub probe: usize,
    pub weight: f32,
}

impl Lattice {
    /// Number of probes.
    pub fn count(&self) -> usize {
        self.dims.iter().map(|d| usize::from(*d)).product()
    }

    /// Number of the probe at (i, j, k): `i + Dx (j + Dy k)`.
    pub fn index(&self, at: UVec3) -> usize {
        let [dx, dy, _] = self.dims.map(usize::from);
        at.x as usize + dx * (at.y as usize + dy * at.z as usize)
    }

    /// The place (i, j, k) of a probe.
    pub fn place(&self, index: usize) -> UVec3 {
        let [dx, dy, _] = self.dims.map(|d| usize::from(d).max(1));
        let (i, j, k) = (index % dx, index / dx % dy, index / (dx * dy));
        UVec3::new(i as u32, j as u32, k as u32)
    }

    /// Position of a probe in grid space.
    pub fn position(&self, index: usize) -> Vec3 {
        self.place(index).as_vec3() * self.spacing
    }

    /// The last probe's position: the box of the grid reaches from the origin to here.
    pub fn extent(&self) -> Vec3 {
        (self.last()).as_vec3() * self.spacing
    }

    fn last(&self) -> UVec3 {
        UVec3::from(self.dims.map(|d| u32::from(d).max(1) - 1))
    }

    /// The eight probes about a point and their weights, which add up to 1. A point outside the
    /// box is taken for the nearest point of the box, one that is not a number for the origin. The
    /// same as a texture unit's filter that clamps to the edge. Along an axis of one probe both
    /// sides are that probe.
    pub fn corners(&self, x: Vec3) -> [Corner; 8] {
        let last = self.last();
        let at = (x / self.spacing).map(|c| c.max(0.0)).min(last.as_vec3());
        let base = at.as_uvec3().min(last.saturating_sub(UVec3::ONE));
        let f = at - base.as_vec3();
        std::array::from_fn(|corner| {
            let pick = UVec3::new(
                corner as u32 & 1,
                corner as u32 >> 1 & 1,
                corner as u32 >> 2,
            );
            let weight = (0..3).map(|a| if pick[a] == 1 { f[a] } else { 1.0 - f[a] });
            Corner {
                probe: self.index((base + pick).min(last)),
                weight: weight.product(),
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Lattice = Lattice {
        dims: [4, 3, 1],
        spacing: Vec3::new(0.5, 2.0, 1.0),
    };

    #[test]
    fn places_and_numbers_go_both_ways() {
        assert_eq!(GRID.count(), 12);
        for i in 0..12 {
            assert_eq!(GRID.index(GRID.place(i)), i);
        }
        assert_eq!(GRID.position(7), Vec3::new(1.5, 2.0, 0.0));
        assert_eq!(GRID.extent(), Vec3::new(1.5, 4.0, 0.0));
    }

    /// Weights that add up to 1 and reproduce positions are trilinear ones.
    #[test]
    fn weights_reproduce_positions() {
        for step in 0..1000 {
            let s = |k: u32| (step * k % 97) as f32 / 97.0;
            let x = Vec3::new(s(13) * 1.5, s(29) * 4.0, 0.0);
            let corners = GRID.corners(x);
            let sum: f32 = corners.iter().map(|c| c.weight).sum();
            let back: Vec3 = corners
                .iter()
                .map(|c| GRID.position(c.probe) * c.weight)
                .sum();
            assert!((sum - 1.0).abs() < 1e-6 && (back - x).length() < 1e-5);
            assert!(corners.iter().all(|c| c.weight >= 0.0));
        }
    }

    #[test]
    fn outside_is_the_nearest_point_of_the_box() {
        let inside = Vec3::new(1.5, 1.0, 0.0);
        for outside in [
            Vec3::new(9.0, 1.0, -5.0),
            Vec3::new(f32::INFINITY, 1.0, 7.0),
        ] {
            assert_eq!(GRID.corners(outside), GRID.corners(inside));
        }
        assert_eq!(
            GRID.corners(Vec3::NAN).map(|c| c.probe),
            GRID.corners(Vec3::ZERO).map(|c| c.probe)
        );
    }
}
