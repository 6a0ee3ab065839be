//! The G-buffer: what each pixel's centre sees.
//!
//! Both ways of drawing (rasterisation, primary rays) end at the same small thing, the instance and
//! triangle of each pixel ([`Visibility`]); [`GBuffer::resolve`] makes everything else from that and
//! from the pixel's ray. So a GPU and a CPU picture can differ in nothing but which triangle they
//! saw. Culling follows glTF: the back of a triangle is drawn if its material is double-sided, with
//! normals turned to the viewer. Surfaces that are seen through
//! ([`crate::scene::Material::is_see_through`]) are not drawn.

use super::view::View;
use crate::scene::{Mesh, Pose, Scene};
use crate::trace::{Ray, Tracer};
use glam::Vec3;
use rayon::prelude::*;

/// Instance of a pixel that sees the sky.
pub const NONE: u32 = u32::MAX;

/// The first hit of a pixel's centre: a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FirstHit {
    /// Index into [`Scene::instances`], or [`NONE`].
    pub instance: u32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
}

/// One [`FirstHit`] per pixel, row by row from the top.
pub struct Visibility {
    pub width: u32,
    pub height: u32,
    pub seen: Vec<FirstHit>,
}

/// What one pixel's centre sees. Only `instance` means anything where it is [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    pub instance: u32,
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third corner.
    pub weights: [f32; 2],
    /// Distance from the camera's plane in metres.
    pub depth: f32,
    /// World space.
    pub position: Vec3,
    /// World space, unit, towards the viewer.
    pub geometric_normal: Vec3,
    /// World space, unit, with the normal map; that of the seen side.
    pub normal: Vec3,
    /// Mesh space of the lookup pose: where the light is looked up.
    pub lookup_position: Vec3,
    /// Unit, mesh space of the lookup pose, with the normal map; that of the seen side.
    pub lookup_normal: Vec3,
    /// Linear. Black where the surface is unlit.
    pub base_color: Vec3,
    /// Linear radiance; the colour of an unlit surface.
    pub emissive: Vec3,
    /// No light is reflected.
    pub unlit: bool,
    /// Perceptual, 0 to 1.
    pub roughness: f32,
    pub metallic: f32,
}

impl Fragment {
    /// A pixel that sees the sky.
    pub const SKY: Fragment = Fragment {
        instance: NONE,
        triangle: NONE,
        weights: [0.0; 2],
        depth: f32::INFINITY,
        position: Vec3::ZERO,
        geometric_normal: Vec3::ZERO,
        normal: Vec3::ZERO,
        lookup_position: Vec3::ZERO,
        lookup_normal: Vec3::ZERO,
        base_color: Vec3::ZERO,
        emissive: Vec3::ZERO,
        unlit: false,
        roughness: 1.0,
        metallic: 0.0,
    };
}

/// A [`Fragment`] per pixel, row by row from the top.
pub struct GBuffer {
    pub width: u32,
    pub height: u32,
    pub fragments: Vec<Fragment>,
}

impl GBuffer {
    /// Share of pixels that see geometry.
    pub fn coverage(&self) -> f64 {
        let seen = self.fragments.iter().filter(|f| f.instance != NONE).count();
        seen as f64 / self.fragments.len().max(1) as f64
    }

    /// Fills a G-buffer from what was seen at `pose`.
    pub fn resolve(
        scene: &Scene,
        pose: &Pose,
        lookup: Lookup,
        view: &View,
        visibility: &Visibility,
    ) -> GBuffer {
        let width = visibility.width as usize;
        let mut fragments = vec![Fragment::SKY; visibility.seen.len()];
        fragments
            .par_chunks_mut(width.max(1))
            .enumerate()
            .for_each(|(y, row)| {
                for (x, out) in row.iter_mut().enumerate() {
                    let seen = visibility.seen[y * width + x];
                    let direction = view.direction(x as u32, y as u32);
                    *out = fragment(scene, pose, lookup, view, direction, seen);
                }
            });
        GBuffer {
            width: visibility.width,
            height: visibility.height,
            fragments,
        }
    }
}

/// Which vertices the light is looked up by.
#[derive(Clone, Copy, Debug)]
pub enum Lookup<'a> {
    /// The mesh's own, before skinning and morphing: for light that is kept in the rest pose.
    Rest,
    /// Those of a pose: the one that the light was computed for, which lags behind what is drawn
    /// when the server does.
    Posed(&'a Pose),
}

/// Everything about the place where a ray from the eye meets the triangle it is known to see.
pub fn fragment(
    scene: &Scene,
    pose: &Pose,
    lookup: Lookup,
    view: &View,
    direction: Vec3,
    seen: FirstHit,
) -> Fragment {
    let (instance, triangle) = (seen.instance as usize, seen.triangle as usize);
    let (Some(placed), Some(world_from_mesh)) = (
        scene.instances.get(instance),
        pose.world_from_mesh.get(instance),
    ) else {
        return Fragment::SKY;
    };
    let mesh = &scene.meshes[placed.mesh];
    let corners = corners(mesh, pose, instance, triangle);
    let corners = corners.map(|p| world_from_mesh.transform_point3(p));
    let (u, v) = barycentrics(view.camera.eye(), direction, corners);
    let surface = scene.surface(pose, instance, triangle, u, v);
    let flip = surface.geometric_normal.dot(direction) > 0.0;
    let side = if flip { -1.0 } else { 1.0 };
    let (lookup_position, lookup_normal) = match lookup {
        Lookup::Rest => (surface.rest_position, surface.rest_normal),
        Lookup::Posed(other) if pose.deformed.get(instance).is_some_and(Option::is_some) => {
            let surface = scene.surface(other, instance, triangle, u, v);
            (surface.mesh_position, surface.mesh_normal)
        }
        // Nothing deforms: mesh space is the same at every pose.
        Lookup::Posed(_) => (surface.mesh_position, surface.mesh_normal),
    };
    let (base_color, emissive) = if surface.unlit {
        (Vec3::ZERO, surface.base_color)
    } else {
        (surface.base_color, surface.emissive)
    };
    Fragment {
        instance: seen.instance,
        triangle: seen.triangle,
        weights: [u, v],
        depth: (surface.position - view.camera.eye()).dot(view.forward()),
        position: surface.position,
        geometric_normal: surface.geometric_normal * side,
        normal: surface.normal * side,
        lookup_position,
        lookup_normal: lookup_normal * side,
        base_color,
        emissive,
        unlit: surface.unlit,
        roughness: surface.roughness,
        metallic: surface.metallic,
    }
}

/// Corners in posed mesh space.
fn corners(mesh: &Mesh, pose: &Pose, instance: usize, triangle: usize) -> [Vec3; 3] {
    let positions = match pose.deformed.get(instance).and_then(Option::as_ref) {
        Some(deformed) => &deformed.positions,
        None => &mesh.positions,
    };
    mesh.triangles[triangle].map(|v| positions[v as usize])
}

/// Weights of the second and third corner where the line meets the triangle's plane, kept within
/// the triangle: a rasterised pixel centre can lie a rounding error outside of it.
fn barycentrics(origin: Vec3, direction: Vec3, [a, b, c]: [Vec3; 3]) -> (f32, f32) {
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let s = origin - a;
    let u = s.dot(p) / determinant;
    let v = direction.dot(s.cross(e1)) / determinant;
    if !(u.is_finite() && v.is_finite()) {
        return (1.0 / 3.0, 1.0 / 3.0);
    }
    let (u, v) = (u.max(0.0), v.max(0.0));
    let sum = (u + v).max(1.0);
    (u / sum, v / sum)
}

impl Visibility {
    /// Primary rays through the pixel centres. `tracer` must stand at `pose`.
    pub fn trace(scene: &Scene, pose: &Pose, tracer: &Tracer, view: &View) -> Visibility {
        let width = view.width as usize;
        let sky = FirstHit {
            instance: NONE,
            triangle: NONE,
        };
        let mut seen = vec![sky; width * view.height as usize];
        seen.par_chunks_mut(width.max(1))
            .enumerate()
            .for_each(|(y, row)| {
                for (x, out) in row.iter_mut().enumerate() {
                    let direction = view.direction(x as u32, y as u32);
                    *out = primary(scene, pose, tracer, view, direction).unwrap_or(sky);
                }
            });
        Visibility {
            width: view.width,
            height: view.height,
            seen,
        }
    }
}

/// The first surface on a primary ray that is to be drawn.
fn primary(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    view: &View,
    direction: Vec3,
) -> Option<FirstHit> {
    let mut t = view.camera.znear / direction.dot(view.forward());
    // A ray passes the backs of single-sided triangles, so it may need several hits; one that
    // grazes along such a surface is given up.
    for _ in 0..64 {
        let ray = Ray {
            origin: view.camera.eye() + direction * t,
            direction,
            t_max: f32::INFINITY,
        };
        let hit = tracer.closest(&ray)?;
        let instance = &scene.instances[hit.instance as usize];
        let mesh = &scene.meshes[instance.mesh];
        if is_drawn(scene, pose, mesh, hit.instance, hit.triangle, direction) {
            return Some(FirstHit {
                instance: hit.instance,
                triangle: hit.triangle,
            });
        }
        t += hit.t;
        t += (t * 4e-6).max(1e-6);
    }
    None
}

fn is_drawn(
    scene: &Scene,
    pose: &Pose,
    mesh: &Mesh,
    instance: u32,
    triangle: u32,
    direction: Vec3,
) -> bool {
    let material = &scene.materials[mesh.materials[triangle as usize] as usize];
    if material.is_see_through() {
        return false;
    }
    if material.double_sided {
        return true;
    }
    let m = &pose.world_from_mesh[instance as usize];
    let corners = corners(mesh, pose, instance as usize, triangle as usize);
    let [a, b, c] = corners.map(|p| m.transform_point3(p));
    let facing = (b - a).cross(c - a).dot(direction);
    if m.matrix3.determinant() < 0.0 {
        facing > 0.0
    } else {
        facing < 0.0
    }
}
