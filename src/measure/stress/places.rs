//! Places on walls where light is looked at, and the light that is there.

use crate::trace::offset::offset_origin;
use crate::trace::path::{PathTracer, Paths, Random};
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

/// A place on a surface, seen from straight above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    pub position: Vec3,
    /// Unit.
    pub normal: Vec3,
}

/// Directions in which a probe's irradiance is asked.
pub const DIRECTIONS: usize = 64;
/// Turn from one direction to the next: the golden angle.
const GOLDEN: f32 = 2.399_963_2;

/// Unit directions spread evenly: the spherical Fibonacci lattice.
pub fn spread(i: usize, count: usize) -> Vec3 {
    let z = 1.0 - (2 * i + 1) as f32 / count as f32;
    let (sin, cos) = (GOLDEN * i as f32).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(r * cos, r * sin, z)
}

/// `side` x `side` places on the wall of a room that looks along `normal`, an axis; none nearer to an
/// edge than a quarter of their distance.
pub fn on_wall(min: Vec3, max: Vec3, normal: Vec3, side: usize) -> Vec<Place> {
    let axis = normal.abs().max_position();
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let place = |i: usize| {
        let share = |k: usize| (k as f32 + 0.37) / (side as f32 - 0.26);
        let mut position = if normal[axis] > 0.0 { min } else { max };
        position[a] = min[a] + (max[a] - min[a]) * share(i % side);
        position[b] = min[b] + (max[b] - min[b]) * share(i / side);
        Place { position, normal }
    };
    (0..side * side).map(place).collect()
}

/// [`on_wall`] on all six walls.
pub fn in_room(min: Vec3, max: Vec3, side: usize) -> Vec<Place> {
    let normals = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    normals.flat_map(|n| on_wall(min, max, n, side)).collect()
}

/// Eyes in a room, from which its walls are seen from straight above and along them: in the middle,
/// and near the middles of its walls, edges and corners, at a twelfth of its size.
pub fn eyes(min: Vec3, max: Vec3) -> Vec<Vec3> {
    const SHARES: [f32; 3] = [1.0 / 12.0, 0.5, 11.0 / 12.0];
    let share = |i: usize| Vec3::new(SHARES[i % 3], SHARES[i / 3 % 3], SHARES[i / 9]);
    (0..27).map(|i| min + (max - min) * share(i)).collect()
}

/// Irradiance at each place by paths: indirect light, and that of emitters. `rays` are spread over the
/// hemisphere by the cosine, so that what is left of noise is that of the paths.
pub fn truth(paths: &PathTracer, places: &[Place], rays: u32, reach: f32) -> Vec<f32> {
    let options = Paths {
        cull_back_faces: false,
        ..Paths::default()
    };
    let at = |(number, place): (usize, &Place)| {
        let origin = offset_origin(place.position, place.normal, reach);
        let (x, y) = place.normal.any_orthonormal_pair();
        let turn = Random::new(11, number as u32, 0).unit() * TAU;
        let light = |ray: u32| {
            let r2 = (ray as f32 + 0.5) / rays as f32;
            let (sin, cos) = (GOLDEN * ray as f32 + turn).sin_cos();
            let r = r2.sqrt();
            let direction = x * (r * cos) + y * (r * sin) + place.normal * (1.0 - r2).sqrt();
            let random = Random::new(13, number as u32, ray);
            f64::from(grey(
                paths
                    .radiance(origin, direction.normalize(), random, &options)
                    .radiance,
            ))
        };
        ((0..rays).map(light).sum::<f64>() / f64::from(rays)) as f32 * PI
    };
    places.par_iter().enumerate().map(at).collect()
}

/// The mean of a colour's channels; all lights here are grey.
pub fn grey(colour: Vec3) -> f32 {
    colour.element_sum() / 3.0
}

/// The mean; 0 of nothing.
pub fn mean(values: &[f32]) -> f64 {
    values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64
}

/// The largest, and not a number if one is none.
pub fn worst(values: &[f32]) -> f64 {
    let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
    values
        .iter()
        .map(|v| f64::from(*v))
        .fold(f64::NEG_INFINITY, larger)
}

/// Rms error over the rms of what is right.
pub fn relative_rms(found: &[f32], right: &[f32]) -> f64 {
    let square = |v: f32| f64::from(v).powi(2);
    let error: f64 = found.iter().zip(right).map(|(f, r)| square(f - r)).sum();
    (error / right.iter().map(|r| square(*r)).sum::<f64>()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::scene_builder::SceneBuilder;
    use super::*;
    use crate::trace::path::Sky;
    use crate::world::World;

    /// A place that sees nothing but a sky of radiance 1 has the irradiance pi.
    #[test]
    fn truth_is_the_sky_over_a_plate() {
        let mut builder = SceneBuilder::new("plate", 0.0);
        builder.solid(Vec3::new(-50.0, -1.0, -50.0), Vec3::new(50.0, 0.0, 50.0));
        let scene = builder.build();
        let world = World::new(&scene, 0.0);
        let paths = world.paths(Sky::uniform(Vec3::ONE));
        let up = Place {
            position: Vec3::ZERO,
            normal: Vec3::Y,
        };
        let side = Place {
            position: Vec3::new(50.0, -0.5, 0.0),
            normal: Vec3::X,
        };
        let light = truth(&paths, &[up, side], 256, world.tracer().reach());
        assert!(light.iter().all(|e| (e - PI).abs() < 1e-3), "{light:?}");
    }

    #[test]
    fn places_lie_on_their_walls() {
        let (min, max) = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(3.0, 1.0, 5.0));
        let places = in_room(min, max, 4);
        assert_eq!(places.len(), 96);
        for place in places {
            let p = place.position;
            assert!(p.cmpge(min).all() && p.cmple(max).all());
            let inside = p + place.normal * 0.5;
            assert!(inside.cmpgt(min).all() && inside.cmplt(max).all());
            let walls = (0..3).filter(|&a| p[a] == min[a] || p[a] == max[a]);
            assert_eq!(walls.count(), 1);
        }
    }

    #[test]
    fn worst_is_no_number_if_one_is_none() {
        assert!(worst(&[1.0, f32::NAN, 2.0]).is_nan());
        assert_eq!(worst(&[1.0, 3.0, 2.0]), 3.0);
    }
}
