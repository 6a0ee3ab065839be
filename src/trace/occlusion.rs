//! Ambient occlusion at a point: many short rays from one origin.
//!
//! The instances that come within reach of the rays are looked for once per point instead of once
//! per ray. The result is bit for bit that of [`Tracer::occluded`] for every ray.

use super::instructions::{Avx2, Instructions, Portable};
use super::offset::offset_origin;
use super::sampler::{Frame, Patterns};
use super::{Ray, Tracer};
use glam::Vec3;
use std::sync::{Arc, PoisonError};

impl Tracer<'_> {
    /// Share of `rays` cosine-distributed rays about `normal` that travel `distance` metres
    /// unhindered: 1 is open, 0 is closed. `seed` picks the directions ([`super::sampler`]); the
    /// same seed gives the same directions in every frame.
    ///
    /// Rays start at `position`, moved off the surface along `geometric_normal`
    /// ([`super::offset`]). `normal`, which may come from a normal map or from smooth shading,
    /// leans some rays below the surface: these count as blocked, as they would be by any closed surface that
    /// is not infinitely thin. Both normals are unit length and on the side that is asked about.
    ///
    /// No rays, or a point or normal that is not finite: 1.
    pub fn ambient_occlusion(
        &self,
        position: Vec3,
        geometric_normal: Vec3,
        normal: Vec3,
        rays: u32,
        distance: f32,
        seed: u32,
    ) -> f32 {
        if rays == 0
            || !(position.is_finite() && geometric_normal.is_finite() && normal.is_finite())
        {
            return 1.0;
        }
        let patterns = self.patterns(rays);
        let origin = offset_origin(position, geometric_normal, self.reach());
        let (directions, turn) = patterns.pick(seed);
        let frame = Frame::new(normal, turn);
        let fan = Fan {
            origin,
            geometric_normal,
            frame,
            directions,
            distance,
        };
        let open = self.count_open(&fan);
        open as f32 / rays as f32
    }

    fn patterns(&self, rays: u32) -> Arc<Patterns> {
        let find = |all: &Vec<Arc<Patterns>>| all.iter().find(|p| p.rays() == rays).cloned();
        if let Some(found) = find(&self.patterns.read().unwrap_or_else(PoisonError::into_inner)) {
            return found;
        }
        let mut all = self
            .patterns
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        find(&all).unwrap_or_else(|| {
            let made = Arc::new(Patterns::new(rays));
            all.push(made.clone());
            made
        })
    }

    fn count_open(&self, fan: &Fan) -> u32 {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = self.avx2 {
            // SAFETY: an `Avx2` exists only where the processor was found to have AVX2.
            return unsafe { self.count_open_avx2(avx2, fan) };
        }
        self.count_open_body(Portable, fan)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn count_open_avx2(&self, avx2: Avx2, fan: &Fan) -> u32 {
        self.count_open_body(avx2, fan)
    }

    #[inline(always)]
    fn count_open_body(&self, with: impl Instructions, fan: &Fan) -> u32 {
        let mut near = Vec::new();
        self.instances_within(fan.origin, fan.distance, &mut near);
        let mut open = 0;
        for d in fan.directions {
            let direction = fan.frame.to_world(*d);
            if direction.dot(fan.geometric_normal) <= 0.0 {
                continue;
            }
            let ray = Ray {
                origin: fan.origin,
                direction,
                t_max: fan.distance,
            };
            let Some(world) = self.world_ray(&ray) else {
                continue;
            };
            let mut blocked = false;
            for &instance in &near {
                blocked = self.instance_occluded(with, instance, &world, fan.distance);
                if blocked {
                    break;
                }
            }
            open += u32::from(!blocked);
        }
        open
    }

    /// Instances with geometry that may lie within `distance` of `point`.
    fn instances_within(&self, point: Vec3, distance: f32, found: &mut Vec<u32>) {
        // What a unit direction's length may be off, and the box test's own error.
        let reach = (distance + self.slack * point.abs().max_element()) * (1.0 + 1e-5);
        self.top.near(point, reach, |instance| {
            if self.within(instance as usize, point, reach) {
                found.push(instance);
            }
            false
        });
    }
}

/// The rays of one point.
struct Fan<'a> {
    origin: Vec3,
    geometric_normal: Vec3,
    frame: Frame,
    directions: &'a [Vec3],
    distance: f32,
}
