//! What foliage leaves of a ray.
//!
//! The opaque scene is traced first. Then the ray, up to what it met, is traced through a hierarchy of its own of shrubs and
//! trees. A shrub transmits `T = exp(-density * length within its box)`, a triangle of a tree `T = 1/2`. Each multiplies
//! visibility by
//!
//! ```text
//! 1 - (1 - T) (1 - rho(t))
//! ```
//!
//! where t is the distance at which the ray meets it, and rho the kernel. The paper multiplies by T alone. Then a tree
//! 100 m away would halve obscurance of 2 m, while the same tree, if it were opaque, would not be seen there at all.

use super::classify::{Kind, Verdict};
use crate::obscurance::Kernel;
use crate::scene::{Alpha, Instance, Material, Mesh, Pose, Scene};
use crate::trace::{Aabb, Ray, Tracer};
use crate::{Error, Result};
use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use std::cell::RefCell;

/// Extinction of a shrub per metre by default: 70 cm of it halve what is seen.
pub const DENSITY: f32 = 1.0;

/// Share of a ray that a triangle of a tree lets through.
const TREE_TRANSMISSION: f32 = 0.5;

/// A box is at least so thick, as a share of its largest extent: crossed cards have volume, a single one has none.
const THINNEST: f32 = 0.05;

/// A pose in which the instances that `gone` names are nowhere: no ray meets them.
pub fn without(pose: &Pose, gone: impl Fn(usize) -> bool) -> Pose {
    let mut pose = pose.clone();
    let numbered = pose.world_from_mesh.iter_mut().enumerate();
    for (_, world) in numbered.filter(|(instance, _)| gone(*instance)) {
        *world = Affine3A::NAN;
    }
    pose
}

/// The shrubs and trees of a scene, as a scene of their own.
#[derive(Clone, Debug)]
pub struct Foliage {
    scene: Scene,
    pose: Pose,
    /// Per instance of `scene`; `None` for a tree.
    shrubs: Vec<Option<Shrub>>,
    /// Whether each instance of the source is foliage.
    is_foliage: Vec<bool>,
    /// Largest diagonal of a shrub, in metres.
    largest: f32,
}

/// A box with a density.
#[derive(Clone, Copy, Debug)]
struct Shrub {
    /// To where the box is -1 to 1 on each axis.
    from_world: Affine3A,
    /// Per metre.
    density: f32,
}

impl Foliage {
    /// The instances of meshes that [`super::classify()`] took for foliage. `density` is that of a shrub by itself, per
    /// metre; where boxes overlap it is lowered (section 2.1): by 1 plus the volume that others share with a box, as
    /// a share of its own. So any number of shrubs at one place count as one.
    ///
    /// # Errors
    /// `Invalid` for a density that is not a number of at least 0.
    pub fn new(
        scene: &Scene,
        pose: &Pose,
        kinds: &[Option<Verdict>],
        density: f32,
    ) -> Result<Foliage> {
        if !(density >= 0.0 && density.is_finite()) {
            return Err(Error::Invalid(format!(
                "the density of shrubs is {density}; it must be a number of at least 0"
            )));
        }
        let unit = scene.meshes.len();
        let mut foliage = Foliage {
            scene: Scene {
                name: scene.name.clone(),
                materials: scene.materials.iter().map(solid).collect(),
                textures: scene.textures.clone(),
                meshes: vec![Mesh::default(); unit],
                ..Scene::default()
            },
            pose: Pose::default(),
            shrubs: Vec::new(),
            is_foliage: vec![false; scene.instances.len()],
            largest: 0.0,
        };
        foliage.scene.materials.push(Material::default());
        let box_material = foliage.scene.materials.len() - 1;
        foliage.scene.meshes.push(unit_box(box_material as u32));
        let mut boxes = Vec::new();
        for (index, instance) in scene.instances.iter().enumerate() {
            let Some(Some(Verdict { kind, .. })) = kinds.get(instance.mesh) else {
                continue;
            };
            let world = pose.world_from_mesh[index];
            if scene.is_deformed_instance(index) || !world.is_finite() {
                continue;
            }
            let mesh = &scene.meshes[instance.mesh];
            let (mesh_number, placed, shrub) = match kind {
                Kind::Tree => {
                    if foliage.scene.meshes[instance.mesh].triangles.is_empty() {
                        foliage.scene.meshes[instance.mesh] = mesh.clone();
                    }
                    (instance.mesh, world, None)
                }
                Kind::Shrub => {
                    let Some(placed) = placed_box(mesh, &world) else {
                        continue;
                    };
                    let from_world = placed.inverse();
                    if !from_world.is_finite() {
                        continue;
                    }
                    let shrub = Shrub {
                        from_world,
                        density,
                    };
                    (unit, placed, Some(shrub))
                }
            };
            foliage.is_foliage[index] = true;
            if shrub.is_some() {
                let unit_bounds = Aabb {
                    min: Vec3::NEG_ONE,
                    max: Vec3::ONE,
                };
                let bounds = unit_bounds.transformed(&placed);
                foliage.largest = foliage.largest.max(2.0 * bounds.radius());
                boxes.push((foliage.shrubs.len(), bounds));
            }
            foliage.shrubs.push(shrub);
            foliage.scene.instances.push(Instance {
                name: instance.name.clone(),
                mesh: mesh_number,
                ..Instance::default()
            });
            foliage.pose.world_from_mesh.push(placed);
            foliage.pose.deformed.push(None);
        }
        for ((number, _), overlap) in boxes.iter().zip(overlaps(&boxes)) {
            if let Some(shrub) = &mut foliage.shrubs[*number] {
                shrub.density /= 1.0 + overlap;
            }
        }
        Ok(foliage)
    }

    /// Number of shrubs and of trees.
    pub fn counts(&self) -> [usize; 2] {
        let shrubs = self.shrubs.iter().filter(|s| s.is_some()).count();
        [shrubs, self.shrubs.len() - shrubs]
    }

    /// A pose of the source in which foliage is nowhere, for the tracer of opaque things.
    pub fn without(&self, pose: &Pose) -> Pose {
        without(pose, |instance| self.is_foliage[instance])
    }

    /// Ready to be traced.
    pub fn attenuation(&self) -> Attenuation<'_> {
        Attenuation {
            foliage: self,
            tracer: Tracer::new(&self.scene, &self.pose),
        }
    }
}

/// BLEND leaves have holes where they are more than half transparent.
fn solid(material: &Material) -> Material {
    let alpha = match material.alpha {
        Alpha::Blend => Alpha::Mask { cutoff: 0.5 },
        other => other,
    };
    Material {
        alpha,
        ..material.clone()
    }
}

/// From the unit box, -1 to 1, to that of a mesh in the world; `None` for a mesh without extent.
fn placed_box(mesh: &Mesh, world: &Affine3A) -> Option<Affine3A> {
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let half = 0.5 * (bounds.max - bounds.min);
    let thin = THINNEST * half.max_element();
    let usable = !bounds.is_empty() && thin > 0.0 && thin.is_finite();
    usable.then(|| {
        let scale = Mat3A::from_diagonal(half.max(Vec3::splat(thin)));
        *world * Affine3A::from_mat3_translation(scale.into(), bounds.centre())
    })
}

/// The six faces of the box from -1 to 1.
fn unit_box(material: u32) -> Mesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        Vec3::new(sign(0), sign(1), sign(2))
    };
    let mut triangles = Vec::with_capacity(12);
    for axis in 0..3 {
        let (a, b) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        for side in [0, 1 << axis] {
            triangles.push([side, side | a, side | b]);
            triangles.push([side | a | b, side | b, side | a]);
        }
    }
    Mesh {
        name: "box".to_owned(),
        positions: (0..8).map(corner).collect(),
        normals: (0..8).map(|i| corner(i).normalize()).collect(),
        materials: vec![material; triangles.len()],
        triangles,
        ..Mesh::default()
    }
}

/// For each box, the volume that others share with it as a share of its own.
fn overlaps(boxes: &[(usize, Aabb)]) -> Vec<f32> {
    let volume = |b: &Aabb| (b.max - b.min).max(Vec3::ZERO).as_dvec3().element_product();
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|a, b| boxes[*a].1.min.x.total_cmp(&boxes[*b].1.min.x));
    let mut shared = vec![0.0f64; boxes.len()];
    for (i, &a) in order.iter().enumerate() {
        let mine = &boxes[a].1;
        for &b in &order[i + 1..] {
            let other = &boxes[b].1;
            if other.min.x > mine.max.x {
                break;
            }
            let common = volume(&Aabb {
                min: mine.min.max(other.min),
                max: mine.max.min(other.max),
            });
            shared[a] += common;
            shared[b] += common;
        }
    }
    let share = |(shared, (_, b)): (&f64, &(usize, Aabb))| match volume(b) {
        own if own > 0.0 => (shared / own) as f32,
        _ => 0.0,
    };
    shared.iter().zip(boxes).map(share).collect()
}

/// The hierarchy of foliage. It may be shared by threads.
pub struct Attenuation<'f> {
    foliage: &'f Foliage,
    tracer: Tracer<'f>,
}

impl Attenuation<'_> {
    /// [`Tracer::reach`] of the foliage.
    pub fn reach(&self) -> f32 {
        self.tracer.reach()
    }

    /// What a ray of unit direction meets within `length` metres, nearest first.
    pub fn along(&self, origin: Vec3, direction: Vec3, length: f32) -> Vec<Met> {
        if self.foliage.shrubs.is_empty() {
            return Vec::new();
        }
        // A shrub that the ray ends in is met where the ray would leave it.
        let ray = Ray {
            origin,
            direction,
            t_max: length + 1.01 * self.foliage.largest,
        };
        let found = RefCell::new((Vec::new(), Vec::new()));
        self.tracer.for_each_hit(&ray, |hit| {
            let (met, shrubs) = &mut *found.borrow_mut();
            if self.foliage.shrubs[hit.instance as usize].is_some() {
                shrubs.push(hit.instance);
            } else if hit.t <= length {
                met.push(Met {
                    distance: hit.t,
                    transmission: TREE_TRANSMISSION,
                });
            }
        });
        let (mut met, mut shrubs) = found.into_inner();
        // Most are met twice.
        shrubs.sort_unstable();
        shrubs.dedup();
        met.extend(shrubs.into_iter().filter_map(|instance| {
            let shrub = self.foliage.shrubs[instance as usize]?;
            shrub.met(origin, direction, length)
        }));
        // Products of floats depend on their order.
        met.sort_unstable_by(|a, b| {
            let by_distance = a.distance.total_cmp(&b.distance);
            by_distance.then(a.transmission.total_cmp(&b.transmission))
        });
        met
    }
}

/// Something that a ray goes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Met {
    /// Metres along the ray; 0 where it starts inside.
    pub distance: f32,
    /// Share of the ray that passes.
    pub transmission: f32,
}

impl Met {
    /// What it leaves of visibility by a kernel.
    pub fn visibility(&self, kernel: Kernel) -> f32 {
        1.0 - (1.0 - self.transmission) * (1.0 - kernel.visibility(self.distance))
    }
}

impl Shrub {
    /// The part of a ray of unit direction within the box, up to `length` metres.
    fn met(&self, origin: Vec3, direction: Vec3, length: f32) -> Option<Met> {
        let o = self.from_world.transform_point3a(Vec3A::from(origin));
        let d = self.from_world.transform_vector3a(Vec3A::from(direction));
        let (mut near, mut far) = (0.0f32, length);
        for axis in 0..3 {
            if d[axis] == 0.0 {
                if o[axis].abs() > 1.0 {
                    return None;
                }
                continue;
            }
            let (a, b) = ((-1.0 - o[axis]) / d[axis], (1.0 - o[axis]) / d[axis]);
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (far > near).then(|| Met {
            distance: near,
            transmission: (-self.density * (far - near)).exp(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::classify::Reason;
    use super::*;
    use crate::obscurance::Obscurance;
    use crate::obscurance::shapes::{cuboid, floor, scene};
    use crate::rng::Rng;
    use glam::Quat;

    fn verdict(kind: Kind) -> Option<Verdict> {
        let reason = Reason::Name;
        Some(Verdict { kind, reason })
    }

    /// Of all that a ray meets.
    fn transmission(through: &Attenuation, origin: Vec3, direction: Vec3, length: f32) -> f32 {
        let met = through.along(origin, direction, length);
        assert!(met.is_sorted_by(|a, b| a.distance <= b.distance));
        met.iter().map(|m| m.transmission).product()
    }

    fn random_direction(random: &mut Rng) -> Vec3 {
        let mut number = || 2.0 * random.unit() - 1.0;
        let d = Vec3::new(number(), number(), number());
        d.try_normalize().unwrap_or(Vec3::X)
    }

    /// Shrubs placed at random, some over others, against the length within each box by small steps.
    #[test]
    fn shrubs_attenuate_by_the_length_within_their_boxes() {
        let mut random = Rng::new(5);
        let bush = cuboid(Vec3::new(-1.0, 0.0, -0.5), Vec3::new(2.0, 0.7, 0.5));
        let (scene, mut pose) = scene(vec![bush; 12]);
        for world in &mut pose.world_from_mesh {
            let at = Vec3::from_array(std::array::from_fn(|_| 6.0 * random.unit() - 3.0));
            let turn = Quat::from_rotation_y(6.0 * random.unit());
            let scale = Vec3::new(1.0, 0.5 + random.unit(), 2.0);
            *world = Affine3A::from_scale_rotation_translation(scale, turn, at);
        }
        let kinds = vec![verdict(Kind::Shrub); 12];
        let foliage = Foliage::new(&scene, &pose, &kinds, 0.8).expect("a density");
        assert_eq!(foliage.counts(), [12, 0]);
        let attenuation = foliage.attenuation();
        let inside = |shrub: &Shrub, p: Vec3| {
            let p = shrub.from_world.transform_point3(p);
            p.abs().max_element() <= 1.0
        };
        let mut attenuated = 0;
        for _ in 0..600 {
            let origin = Vec3::from_array(std::array::from_fn(|_| 8.0 * random.unit() - 4.0));
            let direction = random_direction(&mut random);
            let length = 6.0 * random.unit();
            let steps = 4000;
            let mut depth = 0.0;
            for k in 0..steps {
                let p = origin + direction * length * (k as f32 + 0.5) / steps as f32;
                for shrub in foliage.shrubs.iter().flatten() {
                    depth += f32::from(u8::from(inside(shrub, p))) * shrub.density;
                }
            }
            let expected = (-depth * length / steps as f32).exp();
            let got = transmission(&attenuation, origin, direction, length);
            assert!((got - expected).abs() < 0.01, "{got} {expected}");
            attenuated += u32::from(expected < 0.9);
        }
        assert!(attenuated > 50, "{attenuated}");
    }

    /// Any number of shrubs at one place count as one.
    #[test]
    fn coincident_shrubs_are_as_dense_as_one() {
        let bush = cuboid(Vec3::ZERO, Vec3::splat(2.0));
        for count in [1, 2, 7] {
            let (scene, pose) = scene(vec![bush.clone(); count]);
            let kinds = vec![verdict(Kind::Shrub); count];
            let foliage = Foliage::new(&scene, &pose, &kinds, 0.5).expect("a density");
            let through = foliage.attenuation();
            let from = Vec3::new(-1.0, 0.9, 1.1);
            for (length, within) in [(0.9, 0.0), (2.0, 1.0), (9.0, 2.0), (f32::MAX, 2.0)] {
                let got = transmission(&through, from, Vec3::X, length);
                let expected = (-0.5f32 * within).exp();
                assert!((got - expected).abs() < 1e-5, "{count}: {got} {expected}");
            }
        }
    }

    #[test]
    fn trees_halve_at_each_triangle_before_the_end_of_the_ray() {
        let layers: Vec<Mesh> = (1..=5)
            .map(|k| floor(Vec3::new(-9.0, k as f32, -9.0), 18.0, 1))
            .collect();
        let (scene, pose) = scene(layers);
        let mut kinds = vec![verdict(Kind::Tree); 5];
        kinds[4] = None;
        let foliage = Foliage::new(&scene, &pose, &kinds, 1.0).expect("a density");
        assert_eq!(foliage.counts(), [0, 4]);
        let through = foliage.attenuation();
        for (length, layers) in [(0.5, 0), (1.5, 1), (3.5, 3), (50.0, 4)] {
            let origin = Vec3::new(0.3, 0.0, 0.1);
            let got = transmission(&through, origin, Vec3::Y, length);
            assert_eq!(got, 0.5f32.powi(layers));
        }
    }

    /// One layer of leaves takes half of what an opaque one would, by any kernel, and does not stop rays.
    #[test]
    fn ground_under_a_wide_tree_is_half_open() {
        let ground = floor(Vec3::new(-500.0, 0.0, -500.0), 1000.0, 1);
        let crown = floor(Vec3::new(-500.0, 3.0, -500.0), 1000.0, 1);
        let (scene, pose) = scene(vec![ground, crown]);
        let kinds = [None, verdict(Kind::Tree)];
        let foliage = Foliage::new(&scene, &pose, &kinds, 1.0).expect("a density");
        let attenuation = foliage.attenuation();
        let kernels = [
            Kernel::CutOff { distance: 100.0 },
            Kernel::Exponential { half_distance: 2.0 },
        ];
        let tracer = Tracer::new(&scene, &foliage.without(&pose));
        let obscurance = Obscurance::new(&scene, &tracer, &kernels, 256).expect("kernels");
        let with = obscurance.with_foliage(&attenuation);
        let got = with.about(Vec3::ZERO, Vec3::Y, Vec3::Y, 1);
        // Half of what an opaque layer takes: at distance 3 / cos, whose cosine squared is uniform under these rays.
        let opaque = |kernel: Kernel| {
            let at = |i: u32| (i as f32 + 0.5) / 2e4;
            let sum: f32 = (0..20_000)
                .map(|i| kernel.visibility(3.0 / at(i).sqrt()))
                .sum();
            sum / 2e4
        };
        for (kernel, value) in kernels.iter().zip(got.values) {
            let expected = 0.5 + 0.5 * opaque(*kernel);
            assert!((value - expected).abs() < 0.01, "{value} {expected}");
        }
        // On the leaves themselves the sky is open: a ray does not meet what it leaves.
        let above = with.about(Vec3::new(0.0, 3.0, 0.0), Vec3::Y, Vec3::Y, 1);
        assert_eq!(above.values[..2], [1.0; 2]);
        assert_eq!(above.back_share, 0.0);
    }

    /// A scene without foliage has the same bits with and without the pass.
    #[test]
    fn scene_without_foliage_is_untouched() {
        let ground = floor(Vec3::new(-5.0, 0.0, -5.0), 10.0, 3);
        let (scene, pose) = scene(vec![ground, cuboid(Vec3::ONE, Vec3::splat(3.0))]);
        let foliage = Foliage::new(&scene, &pose, &[None, None], 1.0).expect("a density");
        assert_eq!(foliage.counts(), [0, 0]);
        let attenuation = foliage.attenuation();
        let kernels = [Kernel::Exponential { half_distance: 2.0 }];
        let tracer = Tracer::new(&scene, &pose);
        let plain = Obscurance::new(&scene, &tracer, &kernels, 64).expect("kernels");
        let bare = Tracer::new(&scene, &foliage.without(&pose));
        let pass = Obscurance::new(&scene, &bare, &kernels, 64).expect("kernels");
        let pass = pass.with_foliage(&attenuation);
        for seed in 0..50 {
            let p = Vec3::new(seed as f32 / 20.0, 0.0, 1.5);
            let both = [&plain, &pass].map(|o| o.about(p, Vec3::Y, Vec3::Y, seed));
            assert_eq!(both[0], both[1]);
            assert!(seed > 20 || both[0].values[0] < 1.0);
        }
    }

    #[test]
    fn bad_densities_are_refused() {
        let (scene, pose) = scene(vec![cuboid(Vec3::ZERO, Vec3::ONE)]);
        for density in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(Foliage::new(&scene, &pose, &[None], density).is_err());
        }
    }

    /// A single card and a mesh without extent make no trouble.
    #[test]
    fn flat_and_empty_shrubs_are_sound() {
        let card = floor(Vec3::ZERO, 2.0, 1);
        let mut dot = floor(Vec3::ZERO, 2.0, 1);
        dot.positions.fill(Vec3::ONE);
        let (scene, pose) = scene(vec![card, dot]);
        let kinds = [verdict(Kind::Shrub); 2];
        let foliage = Foliage::new(&scene, &pose, &kinds, 1.0).expect("a density");
        assert_eq!(foliage.counts(), [1, 0]);
        let through = foliage.attenuation();
        let got = transmission(&through, Vec3::new(1.0, -1.0, 1.0), Vec3::Y, 5.0);
        assert!((got - (-0.1f32).exp()).abs() < 1e-5, "{got}");
    }
}
