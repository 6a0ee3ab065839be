//! Ray tracing on the CPU: one hierarchy per mesh, one over the instances.
//!
//! A [`Tracer`] holds the acceleration structures of a scene at one pose, follows it to others, and
//! answers from any number of threads at once. Answers depend on the scene, the pose and the ray
//! alone: not on threads, not on the instruction set, not on how the hierarchies came to be. That
//! holds because no hit is ever lost to a box test; [`slab`] and [`packet`] say why.
//!
//! - [`blas`] is a mesh: triangles in [`packet`]s under an eight-wide hierarchy ([`wide`], made by
//!   [`build`]). Skinned and morphed instances have one of their own, which is refitted.
//! - [`blas_instance`] is an instance: rays go into mesh space with their direction unnormalised, so that
//!   distances stay metres. Moving instances only rebuild the hierarchy over the instances. One that
//!   is flattened, which no ray can be carried back through, has a mesh of its own as it is placed.
//! - [`occlusion`] traces the many short rays of ambient occlusion about one point.
//! - [`instructions`] is where the processor's vectors come in.
//! - [`offset`] and [`sampler`] say where rays start and where they go.
//! - [`path`] follows light along whole paths.
//!
//! Triangles of MASK materials let rays through where the texture has a hole
//! ([`Scene::alpha_is_hole`]); those of BLEND materials stop nothing. Windows
//! ([`crate::scene::Material::window`]) stop rays of light alone, which ask what passes. Triangles
//! have two sides.

mod aabb;
mod blas;
mod blas_instance;
mod build;
mod instructions;
mod occlusion;
pub mod offset;
mod packet;
pub mod path;
pub mod sampler;
mod slab;
mod wide;

#[cfg(test)]
mod tests;

pub use aabb::Aabb;

use crate::scene::{Pose, Scene};
use blas::Blas;
use blas_instance::BlasInstance;
use build::Effort;
use glam::{Affine3A, Vec3};
use instructions::{Avx2, Instructions, Portable};
use packet::TriangleHit;
use rayon::prelude::*;
use sampler::Patterns;
use slab::SlabRay;
use std::cell::Cell;
use std::sync::{Arc, RwLock};
use wide::WideBvh;

/// A ray in world space. `t` counts in lengths of `direction`: metres when it is unit length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub t_max: f32,
}

/// The nearest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    /// Index into [`Scene::instances`].
    pub instance: u32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third vertex.
    pub u: f32,
    pub v: f32,
    /// The ray meets the triangle from behind, where its corners run clockwise (in mesh space: a
    /// mirrored instance has its front where its mesh has it).
    pub back: bool,
}

/// What [`Tracer::update`] had to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Instances with another transform.
    pub moved: usize,
    /// Instances whose own hierarchy was refitted.
    pub refitted: usize,
    /// Of these, those that were built anew.
    pub rebuilt: usize,
}

/// The acceleration structures of a scene at one pose.
pub struct Tracer<'s> {
    scene: &'s Scene,
    /// One per mesh, at rest; then one per instance, empty unless the instance is deformed.
    blases: Vec<Blas>,
    /// One per instance; `None` cannot be hit.
    instances: Vec<Option<BlasInstance>>,
    top: WideBvh,
    /// The greatest [`BlasInstance::slack_per_metre`].
    slack: f32,
    reach: f32,
    /// The pose as it was, to tell what changes.
    transforms: Vec<Affine3A>,
    deformed: Vec<Option<Vec<Vec3>>>,
    patterns: RwLock<Vec<Arc<Patterns>>>,
    avx2: Option<Avx2>,
}

impl<'s> Tracer<'s> {
    pub fn new(scene: &'s Scene, pose: &Pose) -> Self {
        let mut blases: Vec<Blas> = scene
            .meshes
            .par_iter()
            .map(|mesh| Blas::build(mesh, &scene.materials, &mesh.positions))
            .collect();
        blases.resize_with(scene.meshes.len() + scene.instances.len(), Blas::empty);
        let mut tracer = Tracer {
            scene,
            blases,
            instances: vec![None; scene.instances.len()],
            top: WideBvh::from_children(&[]),
            slack: 0.0,
            reach: 0.0,
            transforms: vec![Affine3A::ZERO; scene.instances.len()],
            deformed: vec![None; scene.instances.len()],
            patterns: RwLock::default(),
            avx2: Avx2::detect(),
        };
        tracer.update(pose);
        tracer.reach = tracer.measure_reach();
        tracer
    }

    /// Follows the scene to another pose. Only what moved or deformed is touched: where nothing
    /// did, this compares the poses and returns.
    pub fn update(&mut self, pose: &Pose) -> Work {
        let scene = self.scene;
        let (shared, own) = self.blases.split_at_mut(scene.meshes.len());
        let shared = &*shared;
        let changes: Vec<(bool, Option<bool>)> = own
            .par_iter_mut()
            .zip(&mut self.deformed)
            .zip(&mut self.transforms)
            .enumerate()
            .map(|(i, ((own, last), transform))| {
                let now = pose
                    .world_from_mesh
                    .get(i)
                    .copied()
                    .unwrap_or(Affine3A::ZERO);
                let moved = *transform != now;
                *transform = now;
                let number = scene.instances[i].mesh;
                let posed = pose.deformed.get(i).and_then(|d| d.as_ref());
                let flat = blas_instance::flattens(transform).then(|| {
                    let positions = posed.map_or(&scene.meshes[number].positions, |d| &d.positions);
                    let flatten = |p: &Vec3| transform.transform_vector3(*p);
                    positions.iter().map(flatten).collect::<Vec<Vec3>>()
                });
                let now = flat.as_ref().or(posed.map(|d| &d.positions));
                if now == last.as_ref() {
                    return (moved, None);
                }
                let Some(positions) = now else {
                    (*own, *last) = (Blas::empty(), None);
                    return (moved, Some(false));
                };
                if last.is_none() {
                    *own = shared[number].clone();
                }
                let rebuilt = own.refit(&scene.meshes[number], &scene.materials, positions);
                last.get_or_insert_default().clone_from(positions);
                (moved, Some(rebuilt))
            })
            .collect();
        let mut work = Work::default();
        for (i, (moved, refitted)) in changes.iter().enumerate() {
            work.moved += usize::from(*moved);
            work.refitted += usize::from(refitted.is_some());
            work.rebuilt += usize::from(*refitted == Some(true));
            if *moved || refitted.is_some() {
                let blas = match self.deformed[i] {
                    Some(_) => scene.meshes.len() + i,
                    None => scene.instances[i].mesh,
                };
                let placement = match blas_instance::flattens(&self.transforms[i]) {
                    true => Affine3A::from_translation(self.transforms[i].translation.into()),
                    false => self.transforms[i],
                };
                self.instances[i] = BlasInstance::new(&placement, blas as u32, &self.blases[blas]);
            }
        }
        if work != Work::default() {
            self.rebuild_top();
        }
        work
    }

    fn rebuild_top(&mut self) {
        let (numbers, boxes): (Vec<u32>, Vec<Aabb>) = (0u32..)
            .zip(&self.instances)
            .filter_map(|(i, p)| p.as_ref().map(|p| (i, p.bounds)))
            .unzip();
        let topology = build::build(&boxes, 1, Effort::Quick);
        let nodes: Vec<[u32; wide::WIDTH]> = topology
            .nodes
            .iter()
            .map(|children| {
                children.map(|c| match wide::leaf_number(c) {
                    Some(leaf) => wide::leaf(numbers[topology.leaves[leaf as usize][0] as usize]),
                    None => c,
                })
            })
            .collect();
        let instances = &self.instances;
        self.top = WideBvh::from_children(&nodes);
        self.top.refit(|i| {
            instances[i as usize]
                .as_ref()
                .map_or(Aabb::EMPTY, |p| p.bounds)
        });
        self.slack = instances
            .iter()
            .flatten()
            .map(BlasInstance::slack_per_metre)
            .fold(0.0, f32::max);
    }

    /// The scale of mesh coordinates in metres, which the offset of rays depends on: the largest
    /// coordinate of any mesh at rest, times its instance's scale. It is taken once, from the first
    /// pose, and rounded up to a multiple of an eighth of its power of two, so that a static point
    /// keeps its rays whatever moves elsewhere.
    pub fn reach(&self) -> f32 {
        self.reach
    }

    fn measure_reach(&self) -> f32 {
        let exact = self
            .scene
            .instances
            .iter()
            .zip(&self.instances)
            .zip(&self.transforms)
            .filter_map(|((i, p), transform)| {
                let p = p.as_ref()?;
                let blas = match blas_instance::flattens(transform) {
                    true => p.blas as usize,
                    false => i.mesh,
                };
                Some(p.scale * self.blases[blas].bounds().reach())
            })
            .fold(0.0, f32::max);
        // Keeps the sign, the exponent and three bits of the mantissa, rounding up.
        f32::from_bits((exact.to_bits() + 0x000f_ffff) & 0xfff0_0000)
    }

    /// Whether anything opaque lies on the ray at `0 < t <= t_max`. A ray that is not finite, or
    /// has no direction, hits nothing; `t_max` may be infinite.
    pub fn occluded(&self, ray: &Ray) -> bool {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = self.avx2 {
            // SAFETY: an `Avx2` exists only where the processor was found to have AVX2.
            return unsafe { self.occluded_avx2(avx2, ray) };
        }
        self.occluded_body(Portable, ray)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn occluded_avx2(&self, avx2: Avx2, ray: &Ray) -> bool {
        self.occluded_body(avx2, ray)
    }

    #[inline(always)]
    fn occluded_body(&self, with: impl Instructions, ray: &Ray) -> bool {
        let Some(world) = self.world_ray(ray) else {
            return false;
        };
        let mut walk = self.top.walk();
        while let Some(instance) = walk.next(with, &world, ray.t_max) {
            if self.instance_occluded(with, instance, &world, ray.t_max) {
                return true;
            }
        }
        false
    }

    #[inline(always)]
    fn instance_occluded(
        &self,
        with: impl Instructions,
        instance: u32,
        world: &SlabRay,
        t_max: f32,
    ) -> bool {
        let Some(blas_instance) = &self.instances[instance as usize] else {
            return false;
        };
        let ray = blas_instance.ray(world);
        self.blases[blas_instance.blas as usize].occluded(with, &ray, t_max, |hit| {
            self.is_opaque(instance, hit, false)
        })
    }

    /// The nearest opaque intersection at `0 < t <= t_max`; of several at the same `t` the one with
    /// the lowest instance, then the lowest triangle.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_with(ray, &AllSides { windows: false })
    }

    /// [`Tracer::closest`], windows included.
    pub fn closest_or_window(&self, ray: &Ray) -> Option<Hit> {
        self.closest_with(ray, &AllSides { windows: true })
    }

    /// [`Tracer::closest`] of a ray that passes the backs of single-sided materials, as a
    /// rasteriser does that culls them; and the distance of the nearest back that it passed (also
    /// of one that lies behind the hit, so compare), infinite if there was none.
    pub fn closest_front(&self, ray: &Ray) -> (Option<Hit>, f32) {
        self.front(ray, false)
    }

    /// [`Tracer::closest_front`], windows included.
    pub fn closest_front_or_window(&self, ray: &Ray) -> (Option<Hit>, f32) {
        self.front(ray, true)
    }

    fn front(&self, ray: &Ray, windows: bool) -> (Option<Hit>, f32) {
        let fronts = FrontSides {
            scene: self.scene,
            windows,
            nearest_back: Cell::new(f32::INFINITY),
        };
        let hit = self.closest_with(ray, &fronts);
        (hit, fronts.nearest_back.get())
    }

    /// [`Tracer::closest`] among triangles that `keep` wants: of an instance, by number, met from
    /// behind or not.
    pub fn closest_of(&self, ray: &Ray, keep: impl Fn(u32, u32, bool) -> bool) -> Option<Hit> {
        self.closest_with(ray, &HitFilter(keep))
    }

    /// Calls `each` for every opaque intersection at `0 < t <= t_max`, in no order that means anything.
    pub fn for_each_hit(&self, ray: &Ray, each: impl Fn(Hit)) {
        let nothing = self.closest_with(ray, &EveryHit(each));
        debug_assert!(nothing.is_none());
    }

    #[inline(always)]
    fn closest_with(&self, ray: &Ray, sides: &impl Sides) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = self.avx2 {
            // SAFETY: an `Avx2` exists only where the processor was found to have AVX2.
            return unsafe { self.closest_avx2(avx2, ray, sides) };
        }
        self.closest_body(Portable, ray, sides)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn closest_avx2(&self, avx2: Avx2, ray: &Ray, sides: &impl Sides) -> Option<Hit> {
        self.closest_body(avx2, ray, sides)
    }

    #[inline(always)]
    fn closest_body(&self, with: impl Instructions, ray: &Ray, sides: &impl Sides) -> Option<Hit> {
        let world = self.world_ray(ray)?;
        let mut best: Option<Hit> = None;
        let mut t_max = ray.t_max;
        let (mut stack, mut inner) = (wide::EMPTY_STACK, wide::EMPTY_STACK);
        let mut walk = self.top.walk_sorted(&mut stack);
        while let Some(instance) = walk.next(with, &world, t_max) {
            let Some(blas_instance) = &self.instances[instance as usize] else {
                continue;
            };
            let ray = blas_instance.ray(&world);
            let opaque = |hit: &TriangleHit| {
                (!hit.masked || self.is_opaque(instance, hit, sides.windows()))
                    && sides.stop(instance, hit)
            };
            let blas = &self.blases[blas_instance.blas as usize];
            if let Some(hit) = blas.closest(with, &ray, t_max, opaque, &mut inner) {
                let TriangleHit {
                    t,
                    triangle,
                    u,
                    v,
                    back,
                    ..
                } = hit;
                let hit = Hit {
                    t,
                    instance,
                    triangle,
                    u,
                    v,
                    back,
                };
                if best.is_none_or(|b| hit.precedes(&b)) {
                    best = Some(hit);
                    t_max = t;
                }
            }
        }
        best
    }

    #[inline(always)]
    fn world_ray(&self, ray: &Ray) -> Option<SlabRay> {
        let finite = ray.origin.is_finite() && ray.direction.is_finite();
        if !finite || ray.direction == Vec3::ZERO || ray.t_max.is_nan() || ray.t_max <= 0.0 {
            return None;
        }
        let slack = self.slack * ray.origin.abs().max_element();
        Some(SlabRay::new(
            ray.origin.to_array(),
            ray.direction.to_array(),
            slack,
        ))
    }

    #[cold]
    fn is_opaque(&self, instance: u32, hit: &TriangleHit, windows: bool) -> bool {
        let mesh = self.scene.instances[instance as usize].mesh;
        let (triangle, u, v) = (hit.triangle as usize, hit.u, hit.v);
        if windows {
            !self.scene.mask_is_hole(mesh, triangle, u, v)
        } else {
            !self.scene.alpha_is_hole(mesh, triangle, u, v)
        }
    }

    /// The instance's box in world space, a rounding error larger than it need be; empty for an
    /// instance that nothing can hit or that does not exist.
    pub fn bounds(&self, instance: usize) -> Aabb {
        self.instances
            .get(instance)
            .and_then(|p| p.as_ref())
            .map_or(Aabb::EMPTY, |p| p.bounds)
    }

    /// Whether geometry of the instance may come within `distance` metres of a point. It never
    /// misses any; it may say yes when only the box of a few triangles comes that near.
    pub fn within(&self, instance: usize, point: Vec3, distance: f32) -> bool {
        let Some(Some(blas_instance)) = self.instances.get(instance) else {
            return false;
        };
        let distance = distance + self.slack * point.abs().max_element();
        if blas_instance.bounds.distance_squared(point) > distance * distance * (1.0 + 1e-5) {
            return false;
        }
        let point = Vec3::from(blas_instance.point(point.to_array()));
        self.blases[blas_instance.blas as usize]
            .within(point, distance * blas_instance.stretch * (1.0 + 1e-5))
    }
}

/// Which sides of opaque triangles stop a ray.
trait Sides {
    /// Whether windows do.
    fn windows(&self) -> bool;
    fn stop(&self, instance: u32, hit: &TriangleHit) -> bool;
}

struct AllSides {
    windows: bool,
}

impl Sides for AllSides {
    #[inline(always)]
    fn windows(&self) -> bool {
        self.windows
    }

    #[inline(always)]
    fn stop(&self, _: u32, _: &TriangleHit) -> bool {
        true
    }
}

struct HitFilter<F>(F);

impl<F: Fn(u32, u32, bool) -> bool> Sides for HitFilter<F> {
    #[inline(always)]
    fn windows(&self) -> bool {
        false
    }

    #[inline(always)]
    fn stop(&self, instance: u32, hit: &TriangleHit) -> bool {
        (self.0)(instance, hit.triangle, hit.back)
    }
}

/// None, after a call with each.
struct EveryHit<F>(F);

impl<F: Fn(Hit)> Sides for EveryHit<F> {
    #[inline(always)]
    fn windows(&self) -> bool {
        false
    }

    #[inline(always)]
    fn stop(&self, instance: u32, hit: &TriangleHit) -> bool {
        (self.0)(Hit {
            t: hit.t,
            instance,
            triangle: hit.triangle,
            u: hit.u,
            v: hit.v,
            back: hit.back,
        });
        false
    }
}

/// Fronts, and the backs of double-sided materials.
struct FrontSides<'s> {
    scene: &'s Scene,
    windows: bool,
    nearest_back: Cell<f32>,
}

impl Sides for FrontSides<'_> {
    #[inline(always)]
    fn windows(&self) -> bool {
        self.windows
    }

    #[inline(always)]
    fn stop(&self, instance: u32, hit: &TriangleHit) -> bool {
        if !hit.back
            || self
                .scene
                .is_double_sided(instance as usize, hit.triangle as usize)
        {
            return true;
        }
        // The walk comes to all triangles before the nearest that stops it, and a minimum does not
        // depend on their order.
        self.nearest_back.set(self.nearest_back.get().min(hit.t));
        false
    }
}

impl Hit {
    fn precedes(&self, other: &Hit) -> bool {
        (self.t, self.instance, self.triangle) < (other.t, other.instance, other.triangle)
    }
}
