//! A ray made ready for box tests, and the box test.
//!
//! The test is *monotone*: every operation on a box plane is a monotone function of it also after
//! rounding, so a ray that passes a box passes every box around it. All of "no hit is lost"
//! rests on this: a triangle only counts as hit when the ray passes the triangle's own box (see
//! [`super::packet`]), hence no ancestor box can have hidden it.
//!
//! It is also *conservative*: the far distance is widened by the rounding error of its computation
//! (Ize 2013, *Robust BVH Ray Traversal*), so a true intersection is never refused.

use super::aabb::Aabb;

/// 1 + 2 gamma(3) for `f32`, rounded up (Ize 2013).
const WIDEN: f32 = 1.000_000_5;

/// A ray in the space of one hierarchy. The direction need not be unit length.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    inverse: [f32; 3],
    /// The origin as near planes see it, and as far planes see it: both are the origin itself, or
    /// moved apart so that boxes look larger.
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    /// 1 where the direction is negative: which of the two planes of an axis is the near one.
    negative: [usize; 3],
}

impl SlabRay {
    /// `slack` is a length by which every box is widened, in the space of the ray.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], slack: f32) -> SlabRay {
        let mut ray = SlabRay {
            origin,
            direction,
            inverse: [0.0; 3],
            near_origin: origin,
            far_origin: origin,
            negative: [0; 3],
        };
        for axis in 0..3 {
            let d = direction[axis];
            ray.inverse[axis] = 1.0 / d;
            ray.negative[axis] = d.is_sign_negative() as usize;
            let shift = slack.copysign(d);
            ray.near_origin[axis] = origin[axis] + shift;
            ray.far_origin[axis] = origin[axis] - shift;
        }
        ray
    }

    /// The same ray, with boxes at their own size.
    #[inline(always)]
    pub fn without_slack(&self) -> SlabRay {
        SlabRay {
            near_origin: self.origin,
            far_origin: self.origin,
            ..*self
        }
    }

    /// Where the ray enters and leaves one box: `Some((enter, leave))` when it passes.
    #[inline(always)]
    pub fn interval(&self, b: &Aabb) -> Option<(f32, f32)> {
        let planes = [b.min.to_array(), b.max.to_array()];
        let (mut near, mut far) = (0.0, f32::INFINITY);
        for axis in 0..3 {
            let n = self.negative[axis] & 1;
            let enter = (planes[n][axis] - self.near_origin[axis]) * self.inverse[axis];
            let leave = (planes[n ^ 1][axis] - self.far_origin[axis]) * self.inverse[axis];
            near = max(enter, near);
            far = min(leave, far);
        }
        let far = far * WIDEN;
        (near <= far).then_some((near, far))
    }

    /// Tests eight boxes (`planes[axis][0: min, 1: max][box]`) over `0..=t_max`. Bit i is set when
    /// box i is passed; `near[i]` is where it is entered.
    #[inline(always)]
    pub fn intersect8(&self, planes: &[[[f32; 8]; 2]; 3], t_max: f32, near: &mut [f32; 8]) -> u32 {
        let n = self.negative;
        let (x0, x1) = (&planes[0][n[0] & 1], &planes[0][(n[0] ^ 1) & 1]);
        let (y0, y1) = (&planes[1][n[1] & 1], &planes[1][(n[1] ^ 1) & 1]);
        let (z0, z1) = (&planes[2][n[2] & 1], &planes[2][(n[2] ^ 1) & 1]);
        let mut far = [0.0; 8];
        for i in 0..8 {
            let a = max((x0[i] - self.near_origin[0]) * self.inverse[0], 0.0);
            let a = max((y0[i] - self.near_origin[1]) * self.inverse[1], a);
            let a = max((z0[i] - self.near_origin[2]) * self.inverse[2], a);
            let b = min((x1[i] - self.far_origin[0]) * self.inverse[0], t_max);
            let b = min((y1[i] - self.far_origin[1]) * self.inverse[1], b);
            let b = min((z1[i] - self.far_origin[2]) * self.inverse[2], b);
            near[i] = a;
            far[i] = b * WIDEN;
        }
        let mut mask = 0;
        for i in 0..8 {
            mask |= u32::from(near[i] <= far[i]) << i;
        }
        mask
    }
}

/// The greater of the two; the second when the first is NaN. A ray that runs in a plane of the box
/// gives 0 * inf = NaN there: that axis then does not speak against the box.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
