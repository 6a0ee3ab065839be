//! The one place where code differs by processor: the test of eight boxes.
//!
//! Compilers split eight-wide loops in two here (rustc 1.95), which costs a third of the speed, so
//! the AVX2 form is spelled out. A value of [`Avx2`] is the proof that the processor has it; code
//! that takes [`Instructions`] is compiled once for each, into functions that enable the same.

// An axis runs over several arrays at once here.
#![allow(clippy::needless_range_loop)]

use super::slab::{Lanes, SlabRay};

/// How eight boxes are tested. All ways give the same bits.
pub trait Instructions: Copy {
    /// [`SlabRay::intersect8`].
    fn intersect8(
        self,
        ray: &SlabRay,
        planes: &[[Lanes; 2]; 3],
        t_max: f32,
        near: &mut Lanes,
    ) -> u32;
}

/// What every processor can do.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Instructions for Portable {
    #[inline(always)]
    fn intersect8(
        self,
        ray: &SlabRay,
        planes: &[[Lanes; 2]; 3],
        t_max: f32,
        near: &mut Lanes,
    ) -> u32 {
        ray.intersect8(planes, t_max, near)
    }
}

/// Made by [`Avx2::detect`] only.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

impl Avx2 {
    pub fn detect() -> Option<Avx2> {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            return Some(Avx2(()));
        }
        None
    }
}

#[cfg(target_arch = "x86_64")]
impl Instructions for Avx2 {
    #[inline(always)]
    fn intersect8(
        self,
        ray: &SlabRay,
        planes: &[[Lanes; 2]; 3],
        t_max: f32,
        near: &mut Lanes,
    ) -> u32 {
        // SAFETY: an `Avx2` exists only where the processor was found to have AVX2.
        unsafe { intersect8_avx2(ray, planes, t_max, near) }
    }
}

/// [`SlabRay::intersect8`] operation by operation; `max_ps` and `min_ps` give their second operand
/// when the first is NaN, as that does.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn intersect8_avx2(ray: &SlabRay, planes: &[[Lanes; 2]; 3], t_max: f32, near: &mut Lanes) -> u32 {
    use std::arch::x86_64::*;
    let mut enter = _mm256_setzero_ps();
    let mut leave = _mm256_set1_ps(t_max);
    for axis in 0..3 {
        let n = ray.negative[axis] & 1;
        let scale = _mm256_set1_ps(ray.inverse[axis]);
        let plane: __m256 = bytemuck::cast(planes[axis][n].0);
        let t = _mm256_mul_ps(
            _mm256_sub_ps(plane, _mm256_set1_ps(ray.near_origin[axis])),
            scale,
        );
        enter = _mm256_max_ps(t, enter);
        let plane: __m256 = bytemuck::cast(planes[axis][n ^ 1].0);
        let t = _mm256_mul_ps(
            _mm256_sub_ps(plane, _mm256_set1_ps(ray.far_origin[axis])),
            scale,
        );
        leave = _mm256_min_ps(t, leave);
    }
    let leave = _mm256_mul_ps(leave, _mm256_set1_ps(super::slab::WIDEN));
    near.0 = bytemuck::cast(enter);
    _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(enter, leave)) as u32
}
