//! What benchmarks of vertex bakes share.

use dapple::rng::Rng;
use dapple::scene::Scene;
use dapple::vertices::server::{Shape, Site};

/// Random points, evenly by area over everything that receives samples.
pub fn points(scene: &Scene, shapes: &[Shape], count: usize) -> Vec<(usize, Site)> {
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
    let mut random = Rng::new(1);
    let mut points = Vec::with_capacity(count);
    for i in 0..count {
        let at = (i as f64 + random.unit_f64()) / count as f64 * total;
        let found = running
            .partition_point(|r| r.0 <= at)
            .min(running.len() - 1);
        let (_, instance, t) = running[found];
        let (mut u, mut v) = (random.unit_f64() as f32, random.unit_f64() as f32);
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        if scene.alpha_is_hole(scene.instances[instance].mesh, t, u, v) {
            continue;
        }
        points.push((
            instance,
            Site {
                triangle: t as u32,
                u,
                v,
                area: 0.0,
                seed: (random.unit_f64() * 4e9) as u32,
            },
        ));
    }
    points
}

/// Processor time of all threads so far, 0 where Linux does not tell it: user and system time in
/// hundredths of a second are the 14th and 15th field, the second being a name in parentheses.
pub fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(") ").next().unwrap_or_default();
    let fields = after_name.split(' ').skip(11).take(2);
    fields.filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}
