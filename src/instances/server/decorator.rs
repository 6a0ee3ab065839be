//! One scalar for a small object, clumps of grass above all, so that it matches the ground it stands on (section
//! 2.2.1): obscurance of the surfaces within a small sphere about the object, found by rays from the boundary of the
//! sphere towards its centre.
//!
//! Rays towards the foot of an object end below it, where it shades the ground itself, or the ground is inside it. So
//! decorators are taken out of the scene first ([`crate::obscurance::foliage::without`]): both tracers
//! are of what remains. The shade of foliage may be put back as boxes ([`crate::obscurance::foliage`]).

use super::Context;
use crate::scene::Scene;
use crate::trace::sampler::{Frame, Patterns};
use crate::trace::{Aabb, Hit, Ray, Tracer};
use glam::Vec3;

/// Rays of an object.
const RAYS: u32 = 64;

/// A share of the radius below which a hit has no weight: rays start there.
const AT_BOUNDARY: f32 = 1e-4;

/// What is looked for about an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decorator {
    /// World space.
    pub centre: Vec3,
    /// Metres.
    pub radius: f32,
}

impl Decorator {
    /// About the foot of an instance: the middle of the bottom of its box, as large as half the box is wide, but at
    /// least a tenth of its height. `None` for an instance without extent.
    pub fn about(bounds: &Aabb) -> Option<Decorator> {
        if bounds.is_empty() {
            return None;
        }
        let extent = bounds.max - bounds.min;
        let radius = (0.25 * (extent.x + extent.z)).max(0.1 * extent.y);
        let middle = bounds.centre();
        let centre = Vec3::new(middle.x, bounds.min.y, middle.z);
        (radius > 0.0 && radius.is_finite()).then_some(Decorator { centre, radius })
    }

    /// The surfaces that rays from the boundary to the centre meet first, each with its weight: the way from the
    /// boundary, so that what is near the object counts most. The backs of single-sided triangles are passed.
    pub fn surroundings(&self, scene: &Scene, tracer: &Tracer, seed: u32) -> Vec<(Hit, Vec3, f32)> {
        let patterns = Patterns::new(RAYS);
        let (directions, turn) = patterns.pick(seed);
        let frame = Frame::new(Vec3::Z, turn);
        let mut found = Vec::new();
        for d in directions {
            // Uniform over the sphere, as in `Obscurance::in_volume`.
            let d = frame.to_world(*d);
            let inwards = d * (2.0 * d.z) - Vec3::Z;
            let ray = Ray {
                origin: self.centre - inwards * self.radius,
                direction: inwards,
                t_max: self.radius,
            };
            let hit = tracer.closest_of(&ray, |instance, triangle, back| {
                let (instance, triangle) = (instance as usize, triangle as usize);
                !back || scene.is_double_sided(instance, triangle)
            });
            if let Some(hit) = hit.filter(|hit| hit.t > AT_BOUNDARY * self.radius) {
                found.push((hit, inwards, hit.t));
            }
        }
        found
    }
}

/// Obscurance of the surroundings of a small instance, one value per signal, to be its scalar where it has no local
/// obscurance; `None` where nothing is near, or only the insides of things. The tracer and that of the context are of
/// the scene without decorators.
pub fn scalar(context: &Context, tracer: &Tracer, instance: usize) -> Option<Vec<f32>> {
    let (scene, pose) = (context.scene, context.pose);
    let positions = pose.shape(scene, instance);
    let world = &pose.world_from_mesh[instance];
    let bounds = Aabb::of(positions.iter().map(|p| world.transform_point3(*p)));
    let decorator = Decorator::about(&bounds)?;
    let seed = instance as u32;
    let around = decorator.surroundings(scene, tracer, seed);
    let kernels = context.obscurance.kernels().len();
    let (mut sums, mut total) = (Vec::new(), 0.0);
    for (k, (hit, inwards, weight)) in around.into_iter().enumerate() {
        let (of, triangle) = (hit.instance as usize, hit.triangle as usize);
        let surface = scene.surface(pose, of, triangle, hit.u, hit.v);
        let ray_seed = seed.wrapping_mul(RAYS).wrapping_add(k as u32);
        let gather = context
            .obscurance
            .at_surface(&surface.facing(inwards), ray_seed);
        if !gather.is_valid() {
            continue;
        }
        let values = (context.signals)(&gather.values[..kernels]);
        sums.resize(values.len(), 0.0);
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += f64::from(weight) * f64::from(value);
        }
        total += f64::from(weight);
    }
    (total > 0.0).then(|| sums.iter().map(|sum| (sum / total) as f32).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obscurance::foliage::without;
    use crate::obscurance::shapes::{cuboid, floor, scene};
    use crate::obscurance::{Kernel, Obscurance};

    fn at(centre: Vec3, radius: f32) -> Decorator {
        Decorator { centre, radius }
    }

    /// A plane through the centre is met by half of the rays, at the centre; a plane at height h over it by those that
    /// come from above it, after radius - h / cos.
    #[test]
    fn weights_are_the_way_from_the_boundary() {
        let (scene, pose) = scene(vec![floor(Vec3::new(-9.0, 0.0, -9.0), 18.0, 1)]);
        let tracer = Tracer::new(&scene, &pose);
        for h in [0.01f32, 0.2, 0.7] {
            let sphere = at(Vec3::new(0.1, -h, 0.2), 1.0);
            let around = sphere.surroundings(&scene, &tracer, 1);
            for (_, inwards, weight) in &around {
                let expected = 1.0 - h / -inwards.y;
                assert!((weight - expected).abs() < 1e-4, "{weight} {expected}");
            }
            // Uniform over the sphere: the share of directions with -y above h is (1 - h) / 2.
            let share = around.len() as f32 / RAYS as f32;
            assert!((share - 0.5 * (1.0 - h)).abs() < 0.05, "{h}: {share}");
            // From below it is the floor's back.
            let below = at(Vec3::new(0.1, h, 0.2), 1.0).surroundings(&scene, &tracer, 1);
            assert!(below.is_empty());
        }
    }

    #[test]
    fn grass_takes_the_value_of_the_ground() {
        let ground = floor(Vec3::new(-50.0, 0.0, -50.0), 100.0, 1);
        let wall = cuboid(Vec3::new(-50.0, -1.0, 1.0), Vec3::new(50.0, 30.0, 2.0));
        let tuft = |x: f32, z: f32| {
            let half = Vec3::new(0.15, 0.0, 0.15);
            let foot = Vec3::new(x, -0.02, z);
            cuboid(foot - half, foot + half + Vec3::Y * 0.4)
        };
        let near = tuft(0.0, 0.7);
        let far = tuft(0.0, -40.0);
        let (scene, pose) = scene(vec![ground, wall, near, far]);
        let tracer = Tracer::new(&scene, &without(&pose, |instance| instance > 1));
        let kernels = [Kernel::Exponential {
            half_distance: 20.0,
        }];
        let obscurance = Obscurance::new(&scene, &tracer, &kernels, 256).expect("kernels");
        let context = Context {
            scene: &scene,
            pose: &pose,
            obscurance: &obscurance,
            samples: 0,
            signals: &|values| values.to_vec(),
        };
        let value = |i: usize| scalar(&context, &tracer, i).expect("ground")[0];
        for (instance, z) in [(2, 0.7), (3, -40.0)] {
            let at = Vec3::new(0.0, 0.0, z);
            let ground = obscurance.about(at, Vec3::Y, Vec3::Y, 9).values[0];
            let got = value(instance);
            assert!((got - ground).abs() < 0.02, "{instance}: {got} {ground}");
        }
        assert!(value(2) < value(3) - 0.2, "{} {}", value(2), value(3));
        let nothing = Tracer::new(&scene, &without(&pose, |_| true));
        assert_eq!(scalar(&context, &nothing, 2), None);
    }
}
