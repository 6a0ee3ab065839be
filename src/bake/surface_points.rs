//! Points on the surfaces of a scene at which a bake can be held against the truth.

use crate::rng::Rng;
use crate::scene::Scene;
use crate::vertices::server::{Shape, Site};

/// Random points on the fronts of all surfaces that take samples, spread evenly by area: instance and place.
///
/// `shapes` has one entry per instance. There are fewer than `count` points where some would lie in the holes of
/// MASK materials, and none where nothing takes samples. The same scene always has the same points, none of which
/// a bake samples.
pub fn surface_points(scene: &Scene, shapes: &[Shape], count: usize) -> Vec<(usize, Site)> {
    let mut total = 0.0;
    let mut running = Vec::new();
    for (instance, shape) in shapes.iter().enumerate() {
        for (t, area) in shape.areas.iter().enumerate() {
            if shape.receives[t] {
                total += area;
                running.push((total, instance, t));
            }
        }
    }
    let Some(last) = running.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut random = Rng::new(1);
    let mut points = Vec::with_capacity(count);
    for i in 0..count {
        let at = (i as f64 + random.unit_f64()) / count as f64 * total;
        let found = running.partition_point(|r| r.0 <= at).min(last);
        let (_, instance, t) = running[found];
        let (mut u, mut v) = (random.unit_f64() as f32, random.unit_f64() as f32);
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        if scene.alpha_is_hole(scene.instances[instance].mesh, t, u, v) {
            continue;
        }
        let site = Site {
            triangle: t as u32,
            u,
            v,
            area: 0.0,
            seed: (random.unit_f64() * 4e9) as u32,
        };
        points.push((instance, site));
    }
    points
}
