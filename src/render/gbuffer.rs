//! The G-buffer: what each pixel's centre sees.
//!
//! Both ways of drawing (rasterisation, primary rays) end at the same small thing, the instance and
//! triangle of each pixel ([`Visibility`]); [`GBuffer::resolve`] makes everything else from that and
//! from the pixel's ray. So a GPU and a CPU picture can differ in nothing but which triangle they
//! saw. Culling follows glTF: the back of a triangle is drawn if its material is double-sided, with
//! normals turned to the viewer. Surfaces with [`Alpha::Blend`] are not drawn.

use super::surface::{self, Corners};
use super::view::View;
use crate::scene::{Alpha, Deformed, Mesh, Pose, Scene};
use crate::trace::{Ray, Tracer};
use glam::Vec3;
use rayon::prelude::*;

/// Instance of a pixel that sees the sky.
pub const NONE: u32 = u32::MAX;

/// The triangle that a pixel's centre sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Index into [`Scene::instances`], or [`NONE`].
    pub instance: u32,
    /// Index into the mesh's triangles.
    pub triangle: u32,
}

/// One [`Seen`] per pixel, row by row from the top.
pub struct Visibility {
    pub width: u32,
    pub height: u32,
    pub seen: Vec<Seen>,
}

/// What one pixel's centre sees. Only `instance` means anything where it is [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    pub instance: u32,
    pub triangle: u32,
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
    /// Linear.
    pub base_color: Vec3,
    /// Linear radiance.
    pub emissive: Vec3,
}

impl Fragment {
    /// A pixel that sees the sky.
    pub const SKY: Fragment = Fragment {
        instance: NONE,
        triangle: NONE,
        depth: f32::INFINITY,
        position: Vec3::ZERO,
        geometric_normal: Vec3::ZERO,
        normal: Vec3::ZERO,
        lookup_position: Vec3::ZERO,
        lookup_normal: Vec3::ZERO,
        base_color: Vec3::ZERO,
        emissive: Vec3::ZERO,
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

    /// Fills a G-buffer from what was seen. See [`fragment`] for `pose` and `lookup`.
    pub fn resolve(
        scene: &Scene,
        pose: &Pose,
        lookup: &[Option<Deformed>],
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

/// Everything about the place where a ray from the eye meets the triangle it is known to see.
///
/// `pose` places what is drawn. `lookup` holds, per instance, the vertices whose positions and
/// normals the light is looked up by: those of the pose that the light was computed for
/// ([`Pose::deformed`] of that pose), or `None` for the mesh's own vertices. An instance beyond its
/// end counts as `None`.
pub fn fragment(
    scene: &Scene,
    pose: &Pose,
    lookup: &[Option<Deformed>],
    view: &View,
    direction: Vec3,
    seen: Seen,
) -> Fragment {
    let index = seen.instance as usize;
    let (Some(instance), Some(world_from_mesh)) =
        (scene.instances.get(index), pose.world_from_mesh.get(index))
    else {
        return Fragment::SKY;
    };
    let mesh = &scene.meshes[instance.mesh];
    let corners = mesh.triangles[seen.triangle as usize];
    let drawn = pose.deformed.get(index).and_then(Option::as_ref);
    let looked_up = lookup.get(index).and_then(Option::as_ref);

    let at_mesh = Corners::new(mesh, drawn, corners);
    let [a, b, c] = at_mesh
        .positions
        .map(|p| world_from_mesh.transform_point3(p));
    let weights = surface::barycentrics(view.origin, direction, a, b, c);
    let position = a * weights.x + b * weights.y + c * weights.z;

    let mut geometric_normal = (b - a).cross(c - a).normalize_or(-direction);
    if world_from_mesh.matrix3.determinant() < 0.0 {
        geometric_normal = -geometric_normal;
    }
    let side = if geometric_normal.dot(direction) > 0.0 {
        -1.0
    } else {
        1.0
    };

    let material = &scene.materials[mesh.materials[seen.triangle as usize] as usize];
    let uv = surface::uv(mesh, corners, weights);
    let bump = surface::normal_map(scene, material, uv);
    let normal = surface::normal(&at_mesh, weights, bump);
    let normal = surface::transform_normal(world_from_mesh, normal).normalize_or(geometric_normal);
    let at_lookup = Corners::new(mesh, looked_up, corners);
    let lookup_normal = surface::normal(&at_lookup, weights, bump);

    Fragment {
        instance: seen.instance,
        triangle: seen.triangle,
        depth: (position - view.origin).dot(view.forward),
        position,
        geometric_normal: geometric_normal * side,
        normal: normal * side,
        lookup_position: at_lookup.position(weights),
        lookup_normal: lookup_normal * side,
        base_color: surface::base_color(scene, material, uv).truncate(),
        emissive: material.emissive,
    }
}

impl Visibility {
    /// Primary rays through the pixel centres. `tracer` must stand at `pose`.
    pub fn trace(scene: &Scene, pose: &Pose, tracer: &Tracer, view: &View) -> Visibility {
        let width = view.width as usize;
        let sky = Seen {
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
) -> Option<Seen> {
    let mut t = view.znear / direction.dot(view.forward);
    // A ray passes the backs of single-sided triangles, so it may need several hits; one that
    // grazes along such a surface is given up.
    for _ in 0..64 {
        let ray = Ray {
            origin: view.origin + direction * t,
            direction,
            t_max: f32::INFINITY,
        };
        let hit = tracer.closest(&ray)?;
        let instance = &scene.instances[hit.instance as usize];
        let mesh = &scene.meshes[instance.mesh];
        if is_drawn(scene, pose, mesh, hit.instance, hit.triangle, direction) {
            return Some(Seen {
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
    if material.alpha == Alpha::Blend {
        return false;
    }
    if material.double_sided {
        return true;
    }
    let deformed = pose
        .deformed
        .get(instance as usize)
        .and_then(Option::as_ref);
    let m = &pose.world_from_mesh[instance as usize];
    let corners = Corners::new(mesh, deformed, mesh.triangles[triangle as usize]);
    let [a, b, c] = corners.positions.map(|p| m.transform_point3(p));
    let facing = (b - a).cross(c - a).dot(direction);
    if m.matrix3.determinant() < 0.0 {
        facing > 0.0
    } else {
        facing < 0.0
    }
}
