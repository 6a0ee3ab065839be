//! Triangles in packets, and the triangle test.
//!
//! Möller and Trumbore 1997 over [`LANES`] triangles at once, without fused multiply-add, so that
//! every instruction set gives the same bits. A candidate counts as a hit only when the ray also
//! passes the triangle's own box, and its distance is clamped to the interval in that box: this
//! throws out what the division by a tiny determinant makes of slivers seen edge-on, and together
//! with the monotone box test it makes any traversal find exactly what a loop over all triangles
//! finds.

use super::aabb::Aabb;
use super::slab::SlabRay;
use glam::Vec3;

/// Triangles per packet.
pub const LANES: usize = 4;

/// Set in [`Packet::id`] when the triangle's material may have holes.
const MASKED: u32 = 1 << 31;

/// Up to [`LANES`] triangles: a corner and the two edges from it. Unused lanes are degenerate.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub struct Packet {
    corner: [[f32; LANES]; 3],
    edge1: [[f32; LANES]; 3],
    edge2: [[f32; LANES]; 3],
    id: [u32; LANES],
}

/// An intersection with one triangle. `t` in units of the ray's direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    pub t: f32,
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
    /// The material may have a hole here.
    pub masked: bool,
    /// The ray meets the side from which the corners run clockwise.
    pub back: bool,
}

impl Packet {
    pub const EMPTY: Packet = Packet {
        corner: [[0.0; LANES]; 3],
        edge1: [[0.0; LANES]; 3],
        edge2: [[0.0; LANES]; 3],
        id: [u32::MAX; LANES],
    };

    /// Puts a triangle into a lane. Corners that are not finite leave it degenerate: never hit.
    pub fn set(&mut self, lane: usize, triangle: u32, masked: bool, corners: [Vec3; 3]) {
        self.id[lane] = triangle | if masked { MASKED } else { 0 };
        let (mut a, mut e1, mut e2) =
            (corners[0], corners[1] - corners[0], corners[2] - corners[0]);
        if !(a.is_finite() && e1.is_finite() && e2.is_finite()) {
            (a, e1, e2) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        }
        for axis in 0..3 {
            self.corner[axis][lane] = a[axis];
            self.edge1[axis][lane] = e1[axis];
            self.edge2[axis][lane] = e2[axis];
        }
    }

    /// Triangle index and whether it is masked, of a lane in use.
    pub fn triangle(&self, lane: usize) -> Option<(u32, bool)> {
        let id = self.id[lane];
        (id != u32::MAX).then_some((id & !MASKED, id & MASKED != 0))
    }

    /// The box of one triangle, a rounding error larger than its corners.
    #[inline(always)]
    fn lane_box(&self, lane: usize) -> Aabb {
        let (mut lo, mut hi) = ([0.0f32; 3], [0.0f32; 3]);
        for axis in 0..3 {
            let a = self.corner[axis][lane];
            let b = a + self.edge1[axis][lane];
            let c = a + self.edge2[axis][lane];
            let (min, max) = (a.min(b).min(c), a.max(b).max(c));
            lo[axis] = min - min.abs() * f32::EPSILON;
            hi[axis] = max + max.abs() * f32::EPSILON;
        }
        Aabb {
            min: lo.into(),
            max: hi.into(),
        }
    }

    /// The box of all triangles in the packet. Degenerate ones, which nothing hits, count too
    /// unless they are not finite.
    pub fn bounds(&self) -> Aabb {
        (0..LANES)
            .filter(|&lane| self.id[lane] != u32::MAX)
            .map(|lane| self.lane_box(lane))
            .fold(Aabb::EMPTY, |a, b| a.union(&b))
    }

    /// The triangles whose planes and edges say that the line of the ray meets them.
    #[inline(always)]
    pub fn candidates(&self, ray: &SlabRay) -> Candidates {
        let [ox, oy, oz] = ray.origin;
        let [dx, dy, dz] = ray.direction;
        let (a, e1, e2) = (&self.corner, &self.edge1, &self.edge2);
        let (mut det, mut us, mut vs, mut ts) = (
            [0.0f32; LANES],
            [0.0f32; LANES],
            [0.0f32; LANES],
            [0.0f32; LANES],
        );
        let mut inside = [0u32; LANES];
        let mut behind = [0u32; LANES];
        for i in 0..LANES {
            let px = dy * e2[2][i] - dz * e2[1][i];
            let py = dz * e2[0][i] - dx * e2[2][i];
            let pz = dx * e2[1][i] - dy * e2[0][i];
            let d = e1[0][i] * px + e1[1][i] * py + e1[2][i] * pz;
            let (sx, sy, sz) = (ox - a[0][i], oy - a[1][i], oz - a[2][i]);
            // Everything is kept times |det|; the sign of det is folded in by its bit.
            let sign = d.to_bits() & 0x8000_0000;
            let flip = |x: f32| f32::from_bits(x.to_bits() ^ sign);
            let u = flip(sx * px + sy * py + sz * pz);
            let qx = sy * e1[2][i] - sz * e1[1][i];
            let qy = sz * e1[0][i] - sx * e1[2][i];
            let qz = sx * e1[1][i] - sy * e1[0][i];
            let v = flip(dx * qx + dy * qy + dz * qz);
            let t = flip(e2[0][i] * qx + e2[1][i] * qy + e2[2][i] * qz);
            let d = d.abs();
            (det[i], us[i], vs[i], ts[i]) = (d, u, v, t);
            behind[i] = sign >> 31;
            inside[i] = u32::from((u >= 0.0) & (v >= 0.0) & (u + v <= d) & (t > 0.0) & (d > 0.0));
        }
        let (mut mask, mut back) = (0, 0);
        for i in 0..LANES {
            mask |= inside[i] << i;
            back |= behind[i] << i;
        }
        Candidates {
            mask,
            back,
            det,
            u: us,
            v: vs,
            t: ts,
        }
    }

    /// The next hit at `0 < t <= t_max` among the candidates, in lane order.
    #[inline(always)]
    pub fn next_hit(
        &self,
        from: &mut Candidates,
        ray: &SlabRay,
        t_max: f32,
    ) -> Option<TriangleHit> {
        while from.mask != 0 {
            let i = from.mask.trailing_zeros() as usize % LANES;
            from.mask &= from.mask - 1;
            let Some((near, far)) = ray.interval(&self.lane_box(i)) else {
                continue;
            };
            let det = from.det[i];
            let t = (from.t[i] / det).max(near).min(far);
            if t > 0.0 && t <= t_max {
                return Some(TriangleHit {
                    t,
                    triangle: self.id[i] & !MASKED,
                    u: from.u[i] / det,
                    v: from.v[i] / det,
                    masked: self.id[i] & MASKED != 0,
                    back: from.back >> i & 1 != 0,
                });
            }
        }
        None
    }
}

/// What [`Packet::candidates`] found: a bit per lane, another for those seen from behind, and the
/// solution times the determinant.
#[derive(Clone, Copy, Debug)]
pub struct Candidates {
    mask: u32,
    back: u32,
    det: [f32; LANES],
    u: [f32; LANES],
    v: [f32; LANES],
    t: [f32; LANES],
}
