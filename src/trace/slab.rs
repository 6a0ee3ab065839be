//! A ray made ready for box tests, and the box test.
//!
//! The test is *monotone*: every operation on a box plane is a monotone function of it also after
//! rounding, so a ray that passes a box passes every box around it. All of "no hit is lost"
//! rests on this: a triangle only counts as hit when the ray passes the triangle's own box (see
//! [`super::packet`]), hence no ancestor box can have hidden it.
//!
//! It is also *conservative*: the far distance is widened by the rounding error of its computation
//! (Ize 2013, *Robust BVH Ray Traversal*), so a true intersection is never refused.

// An axis runs over several arrays at once here.
#![allow(clippy::needless_range_loop)]

use super::aabb::Aabb;

/// 1 + 2 gamma(3) for `f32`, rounded up (Ize 2013).
pub(super) const WIDEN: f32 = 1.000_000_5;

/// A ray in the space of one hierarchy. The direction need not be unit length.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub(super) inverse: [f32; 3],
    /// The origin as near planes see it, and as far planes see it: both are the origin itself, or
    /// moved apart so that boxes look larger.
    pub(super) near_origin: [f32; 3],
    pub(super) far_origin: [f32; 3],
    /// 1 where the direction is negative: which of the two planes of an axis is the near one.
    pub(super) negative: [usize; 3],
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

    /// Tests eight boxes (`planes[axis][0: min, 1: max]`) over `0..=t_max`. Bit i is set when
    /// box i is passed; `near` is where each is entered.
    #[inline(always)]
    pub fn intersect8(&self, planes: &[[Lanes; 2]; 3], t_max: f32, near: &mut Lanes) -> u32 {
        let mut enter = Lanes([0.0; 8]);
        let mut leave = Lanes([t_max; 8]);
        for axis in 0..3 {
            let n = self.negative[axis] & 1;
            let scale = self.inverse[axis];
            enter = planes[axis][n]
                .along(self.near_origin[axis], scale)
                .max(enter);
            leave = planes[axis][n ^ 1]
                .along(self.far_origin[axis], scale)
                .min(leave);
        }
        *near = enter;
        enter.at_most(leave.times(WIDEN))
    }
}

/// Eight numbers. Each operation is a loop of its own over all eight, which compilers turn into
/// one or two vector instructions.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Lanes(pub [f32; 8]);

impl Lanes {
    /// `(self - origin) * scale`.
    #[inline(always)]
    fn along(self, origin: f32, scale: f32) -> Lanes {
        let mut out = self;
        for x in &mut out.0 {
            *x = (*x - origin) * scale;
        }
        out
    }

    #[inline(always)]
    fn times(self, factor: f32) -> Lanes {
        let mut out = self;
        for x in &mut out.0 {
            *x *= factor;
        }
        out
    }

    #[inline(always)]
    fn max(self, other: Lanes) -> Lanes {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(other.0) {
            *x = max(*x, y);
        }
        out
    }

    #[inline(always)]
    fn min(self, other: Lanes) -> Lanes {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(other.0) {
            *x = min(*x, y);
        }
        out
    }

    /// A bit for each lane that is at most the other's.
    #[inline(always)]
    fn at_most(self, other: Lanes) -> u32 {
        let mut mask = 0;
        for i in 0..8 {
            mask |= u32::from(self.0[i] <= other.0[i]) << i;
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
