//! Point generation (PSAO §3.1): uniform candidates on the surface of a mesh instance, thinned by
//! sample elimination.

use super::eliminate::{eliminate, packed_distance};
use super::sample::T_N;
use crate::rng::Rng;
use crate::scene::{Alpha, Pose, Scene};
use glam::{Mat3, Vec3};

/// A point on a mesh: fixed to a triangle, whatever the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third vertex.
    pub u: f32,
    pub v: f32,
    /// On the back of a double-sided triangle.
    pub back: bool,
}

impl SurfacePoint {
    /// The position, given the mesh's triangles and vertex positions in any pose.
    pub fn on(&self, triangles: &[[u32; 3]], positions: &[Vec3]) -> Vec3 {
        let [a, b, c] = triangles[self.triangle as usize].map(|i| positions[i as usize]);
        a + (b - a) * self.u + (c - a) * self.v
    }
}

/// How densely points are placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// Candidates per square metre of surface, N in the paper: *before* thinning.
    pub candidates: f32,
    /// Candidates per point that is kept, at least 1. The paper keeps half: 2.
    pub thinning: f32,
}

impl Density {
    /// Points per square metre that are kept.
    pub fn kept(&self) -> f64 {
        self.candidates as f64 / self.thinning as f64
    }

    /// Interpolation radius r of Eq. 2 in metres: the distance between neighbours of an ideally
    /// packed set of this density, which is what elimination spreads the points by.
    pub fn radius(&self) -> f32 {
        packed_distance(self.kept())
    }
}

/// The points of one mesh at one scale, in progressive order: every prefix is well distributed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Placement {
    pub points: Vec<SurfacePoint>,
    /// Candidates before thinning, those that fell into masked holes left out.
    pub candidates: usize,
}

/// Surface of an instance of the rest pose that points are placed on, in square metres, summed up
/// triangle by triangle. Both sides of double-sided triangles count; glass holds no points.
fn running_area(scene: &Scene, rest: &Pose, instance: usize, scale: Mat3) -> Vec<f64> {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let shape = rest.shape(scene, instance);
    let mut total = 0.0f64;
    let triangles = mesh.triangles.iter().zip(&mesh.materials);
    triangles
        .map(|(triangle, &material)| {
            let material = &scene.materials[material as usize];
            if !material.is_see_through() {
                let [a, b, c] = triangle.map(|i| scale * shape[i as usize]);
                let sides = if material.double_sided { 2.0 } else { 1.0 };
                total += 0.5 * (b - a).cross(c - a).length() as f64 * sides;
            }
            total
        })
        .collect()
}

/// Surface of an instance of the rest pose that [`place`] spreads points over, in square metres.
pub fn area(scene: &Scene, rest: &Pose, instance: usize, scale: Mat3) -> f64 {
    running_area(scene, rest, instance, scale)
        .last()
        .copied()
        .unwrap_or(0.0)
}

/// Places points on an instance of the rest pose. `scale` is the part of its transform that is
/// not rotation or translation (see [`super::grid::split`]); areas are measured with it.
/// Deterministic: the same mesh, scale, density and seed give the same points.
pub fn place(
    scene: &Scene,
    rest: &Pose,
    instance: usize,
    scale: Mat3,
    density: Density,
    seed: u64,
) -> Placement {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let shape = rest.shape(scene, instance);
    let corner = |t: usize, k: usize| scale * shape[mesh.triangles[t][k] as usize];

    let area = running_area(scene, rest, instance, scale);
    let total = area.last().copied().unwrap_or(0.0);
    if total <= 0.0 || !total.is_finite() {
        return Placement::default();
    }

    let count = (total * density.candidates as f64).ceil() as usize;
    let mut rng = Rng::new(seed);
    let mut points = Vec::with_capacity(count);
    let mut positions = Vec::with_capacity(count);
    let mut normals = Vec::with_capacity(count);
    for i in 0..count {
        // One candidate in each of `count` equal strata of area: uniform, with less clumping.
        let at = (i as f64 + rng.unit() as f64) / count as f64 * total;
        let t = area.partition_point(|&a| a <= at).min(area.len() - 1);
        let (u, v) = uniform_barycentrics(rng.unit(), rng.unit());
        let double_sided = scene.materials[mesh.materials[t] as usize].double_sided;
        let back = rng.draw() & 1 == 1 && double_sided;
        let material = &scene.materials[mesh.materials[t] as usize];
        if matches!(material.alpha, Alpha::Mask { .. })
            && scene.alpha_is_hole(scene.instances[instance].mesh, t, u, v)
        {
            continue;
        }
        let [a, b, c] = [0, 1, 2].map(|k| corner(t, k));
        let surface = scene.surface(rest, instance, t, u, v);
        positions.push(a + (b - a) * u + (c - a) * v);
        normals.push(if back {
            -surface.normal
        } else {
            surface.normal
        });
        points.push(SurfacePoint {
            triangle: t as u32,
            u,
            v,
            back,
        });
    }

    let candidates = points.len();
    let target = ((candidates as f64 / density.thinning as f64).ceil() as usize).min(candidates);
    let order = eliminate(&positions, &normals, target, density.radius(), T_N);
    Placement {
        points: order.iter().map(|&i| points[i as usize]).collect(),
        candidates,
    }
}

/// Maps the unit square to barycentric weights of the second and third vertex, uniform in area
/// (the square is folded along its diagonal, which is cheaper than a square root).
fn uniform_barycentrics(a: f32, b: f32) -> (f32, f32) {
    if a + b > 1.0 {
        (1.0 - a, 1.0 - b)
    } else {
        (a, b)
    }
}
