//! Path tracing: all light that arrives along a ray.
//!
//! A [`PathTracer`] is a scene at one pose with its lights. It answers from any number of threads
//! at once, and an answer depends on the ray and its [`Random`] alone.
//!
//! - [`bsdf`] is the material: glTF metallic-roughness, shared with all other shading.
//! - [`emitters`] are the surfaces that shine; punctual lights are [`crate::scene::light`]'s; the
//!   [`Sky`] is what a ray meets that meets nothing.
//! - [`random`] makes numbers from counters.
//!
//! At each surface one punctual light is chosen by what it would contribute if nothing stood in its
//! way, and one point on an emitter by power; emitters are found by the next segment of the path
//! as well, and the two ways are weighted by the power heuristic (Veach 1997, section 9.2.4). The
//! sky is smooth, so that the path alone finds it well.
//!
//! Surfaces have two sides to a path: what it hits from behind is shaded like the front. Emission
//! alone is one-sided unless the material is double-sided. The first segment can pass the backs of
//! single-sided materials, as a rasteriser's camera does, and as probes do (DDISH-GI §5). Light
//! never crosses the geometric surface: directions below it are dropped, wherever the shading
//! normal leans.

pub mod bsdf;
pub mod emitters;
pub mod random;

use super::offset::offset_origin;
use super::{Hit, Ray, Tracer};
use crate::scene::{Pose, Scene};
use bsdf::{Bsdf, Scattered, luminance, seen_normal};
use emitters::Emitters;
use glam::Vec3;
pub use random::Random;

/// Bounces before Russian roulette begins.
const ROULETTE_AFTER: u32 = 3;

/// Most that a path survives roulette with: none is followed for nothing.
const MAX_SURVIVAL: f32 = 0.95;

/// Radiance of what lies behind everything: a gradient from straight down to straight up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sky {
    pub up: Vec3,
    pub down: Vec3,
}

impl Sky {
    /// The same in all directions.
    pub fn uniform(radiance: Vec3) -> Sky {
        Sky {
            up: radiance,
            down: radiance,
        }
    }

    /// Along a unit direction.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.down.lerp(self.up, 0.5 + 0.5 * direction.y)
    }
}

/// How paths are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paths {
    /// Most surfaces that scatter along a path: 0 is emission alone, 1 direct light.
    pub max_bounces: u32,
    /// Whether the first segment passes the backs of single-sided materials.
    pub cull_back_faces: bool,
}

impl Default for Paths {
    /// 32 bounces (DDISH-GI §5), backs culled.
    fn default() -> Self {
        Paths {
            max_bounces: 32,
            cull_back_faces: true,
        }
    }
}

/// What comes along a ray, against its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrived {
    /// All light but that of punctual lights themselves, which no ray hits.
    pub radiance: Vec3,
    /// Metres to the first surface that stopped the ray; infinite for the sky.
    pub distance: f32,
    /// Whether the ray met the back of a single-sided material before that, or there.
    pub back_face: bool,
}

/// A place where a path scatters.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// World space.
    pub position: Vec3,
    /// Unit, on the side that is seen.
    pub geometric_normal: Vec3,
    /// Unit, for shading: [`seen_normal`].
    pub normal: Vec3,
    /// Unit, towards where the path comes from.
    pub view: Vec3,
    pub bsdf: Bsdf,
    /// Radiance that the surface itself sends to `view`.
    pub emitted: Vec3,
    /// Metres along the ray that found it.
    pub distance: f32,
    /// Where rays start that leave it.
    origin: Vec3,
}

/// A scene at a pose, lit.
pub struct PathTracer<'a> {
    scene: &'a Scene,
    pose: &'a Pose,
    tracer: &'a Tracer<'a>,
    emitters: Emitters,
    sky: Sky,
    coat: bool,
}

impl<'a> PathTracer<'a> {
    /// `tracer` stands at `pose`, and both are of `scene`. Lights are the pose's; a scene without
    /// any is dark unless it has emitters or a sky.
    pub fn new(scene: &'a Scene, pose: &'a Pose, tracer: &'a Tracer<'a>, sky: Sky) -> Self {
        PathTracer {
            scene,
            pose,
            tracer,
            emitters: Emitters::new(scene, pose, tracer),
            sky,
            coat: true,
        }
    }

    /// Takes the coats off all surfaces: what is left is Lambert's, and light is diffuse.
    pub fn without_coats(self) -> Self {
        PathTracer {
            coat: false,
            ..self
        }
    }

    pub fn sky(&self) -> &Sky {
        &self.sky
    }

    /// The light that arrives at `origin` from `direction` (unit), by one path.
    pub fn radiance(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut random: Random,
        paths: &Paths,
    ) -> Arrived {
        let (vertex, back_face) = self.first(origin, direction, paths.cull_back_faces);
        let Some(vertex) = vertex else {
            return Arrived {
                radiance: self.sky.radiance(direction),
                distance: f32::INFINITY,
                back_face,
            };
        };
        let scattered = self.scattered(&vertex, &mut random, paths.max_bounces, true);
        Arrived {
            radiance: vertex.emitted + scattered,
            distance: vertex.distance,
            back_face,
        }
    }

    /// The first surface on a ray, and whether the back of a single-sided material was met up to
    /// there. `cull` lets the ray pass such backs.
    pub fn first(&self, origin: Vec3, direction: Vec3, cull: bool) -> (Option<Vertex>, bool) {
        let ray = Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        };
        if cull {
            let (hit, nearest_back) = self.tracer.closest_front(&ray);
            let end = hit.map_or(f32::INFINITY, |hit| hit.t);
            return (hit.map(|h| self.vertex(&h, direction)), nearest_back < end);
        }
        let hit = self.tracer.closest(&ray);
        let back = hit.is_some_and(|h| {
            h.back
                && !self
                    .scene
                    .is_double_sided(h.instance as usize, h.triangle as usize)
        });
        (hit.map(|h| self.vertex(&h, direction)), back)
    }

    /// The surface where a ray in `direction` hit.
    fn vertex(&self, hit: &Hit, direction: Vec3) -> Vertex {
        let (instance, triangle) = (hit.instance as usize, hit.triangle as usize);
        let surface = self
            .scene
            .surface(self.pose, instance, triangle, hit.u, hit.v)
            .facing(direction);
        let dark = hit.back && !self.scene.is_double_sided(instance, triangle);
        let view = -direction;
        let bsdf = Bsdf::new(surface.base_color, surface.metallic, surface.roughness);
        Vertex {
            position: surface.position,
            geometric_normal: surface.geometric_normal,
            normal: seen_normal(surface.normal, view),
            view,
            bsdf: if self.coat { bsdf } else { bsdf.without_coat() },
            emitted: if dark { Vec3::ZERO } else { surface.emissive },
            distance: hit.t,
            origin: offset_origin(
                surface.position,
                surface.geometric_normal,
                self.tracer.reach(),
            ),
        }
    }

    /// Light of all punctual lights that `vertex` sends to its view, each with its shadow ray.
    pub fn direct(&self, vertex: &Vertex) -> Vec3 {
        (0..self.pose.lights.len())
            .map(|light| {
                let (light, ray) = self.unshadowed(vertex, light);
                if light != Vec3::ZERO && !self.tracer.occluded(&ray) {
                    light
                } else {
                    Vec3::ZERO
                }
            })
            .sum()
    }

    /// Light that `vertex` sends to its view by one path that scatters at most `max_bounces` times,
    /// there the first time. Its own emission is not in it, and the direct light of punctual lights
    /// only if `punctual`: without, it is the indirect light that probes stand for.
    pub fn scattered(
        &self,
        vertex: &Vertex,
        random: &mut Random,
        max_bounces: u32,
        punctual: bool,
    ) -> Vec3 {
        let mut vertex = *vertex;
        let mut light = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        for bounce in 0..max_bounces {
            if punctual || bounce > 0 {
                light += throughput * self.one_light(&vertex, random.unit());
            }
            if !self.emitters.is_empty() {
                let (choice, u) = (random.unit(), random.pair());
                light += throughput * self.one_emitter(&vertex, choice, u);
            }
            let Some(next) = vertex.scatter(random) else {
                break;
            };
            throughput *= next.weight;
            if bounce >= ROULETTE_AFTER {
                let survival = throughput.max_element().min(MAX_SURVIVAL);
                if random.unit() >= survival {
                    break;
                }
                throughput /= survival;
            }
            let hit = self.tracer.closest(&Ray {
                origin: vertex.origin,
                direction: next.direction,
                t_max: f32::INFINITY,
            });
            let Some(hit) = hit else {
                light += throughput * self.sky.radiance(next.direction);
                break;
            };
            vertex = self.vertex(&hit, next.direction);
            if vertex.emitted != Vec3::ZERO {
                let cosine = vertex.geometric_normal.dot(vertex.view);
                let density = self.emitters.density(vertex.emitted);
                let other = density * vertex.distance * vertex.distance / cosine;
                light += throughput * vertex.emitted * heuristic(next.pdf, other);
            }
        }
        light
    }

    /// The indirect light of [`PathTracer::scattered`], by one path: what the Lambert base reflects, and
    /// what the coat does.
    pub fn scattered_apart(
        &self,
        vertex: &Vertex,
        random: &mut Random,
        max_bounces: u32,
    ) -> [Vec3; 2] {
        let Some(next) = vertex.scatter(random) else {
            return [Vec3::ZERO; 2];
        };
        let coat = Bsdf {
            diffuse: Vec3::ZERO,
            ..vertex.bsdf
        };
        let coat = coat.evaluate(vertex.normal, vertex.view, next.direction) / next.pdf;
        let paths = Paths {
            max_bounces: max_bounces.saturating_sub(1),
            cull_back_faces: false,
        };
        let light = self
            .radiance(vertex.origin, next.direction, *random, &paths)
            .radiance;
        [(next.weight - coat) * light, coat * light]
    }

    /// What a punctual light contributes where nothing stands in its way, and the ray that finds
    /// out.
    fn unshadowed(&self, vertex: &Vertex, light: usize) -> (Vec3, Ray) {
        let light = &self.pose.lights[light];
        let to = light.ray(vertex.position);
        let mut arriving = Vec3::ZERO;
        if to.falloff > 0.0 && to.direction.dot(vertex.geometric_normal) > 0.0 {
            let f = vertex
                .bsdf
                .evaluate(vertex.normal, vertex.view, to.direction);
            arriving = f * light.intensity * to.falloff;
        }
        let ray = Ray {
            origin: vertex.origin,
            direction: to.direction,
            t_max: to.distance,
        };
        (arriving, ray)
    }

    /// An estimate of [`PathTracer::direct`] by one shadow ray: the light is drawn by what it would
    /// contribute.
    fn one_light(&self, vertex: &Vertex, mut u: f32) -> Vec3 {
        let mut total = 0.0;
        let mut chosen: Option<(Vec3, f32, Ray)> = None;
        for light in 0..self.pose.lights.len() {
            let (arriving, ray) = self.unshadowed(vertex, light);
            let weight = luminance(arriving);
            if weight.is_nan() || weight <= 0.0 {
                continue;
            }
            total += weight;
            // A reservoir of one; u is stretched to be uniform again after each choice.
            let share = weight / total;
            if u < share {
                u /= share;
                chosen = Some((arriving, weight, ray));
            } else {
                u = (u - share) / (1.0 - share);
            }
        }
        match chosen {
            Some((arriving, weight, ray)) if !self.tracer.occluded(&ray) => {
                arriving * (total / weight)
            }
            _ => Vec3::ZERO,
        }
    }

    /// An estimate of the light of all emitters by one shadow ray, weighted against what
    /// [`Vertex::scatter`] finds.
    fn one_emitter(&self, vertex: &Vertex, choice: f32, u: [f32; 2]) -> Vec3 {
        let Some(source) = self.emitters.sample(self.scene, choice, u) else {
            return Vec3::ZERO;
        };
        let offset = source.position - vertex.position;
        let d2 = offset.length_squared();
        let Some(direction) = offset.try_normalize() else {
            return Vec3::ZERO;
        };
        let mut cosine = -direction.dot(source.normal);
        let mut side = source.normal;
        if source.double_sided && cosine < 0.0 {
            (cosine, side) = (-cosine, -side);
        }
        if cosine <= 0.0 || direction.dot(vertex.geometric_normal) <= 0.0 {
            return Vec3::ZERO;
        }
        let (f, scatter_pdf) = vertex
            .bsdf
            .evaluate_with_pdf(vertex.normal, vertex.view, direction);
        let pdf = source.density * d2 / cosine;
        if f == Vec3::ZERO || !pdf.is_normal() {
            return Vec3::ZERO;
        }
        // To a point just before the emitter, which would else block itself.
        let target = offset_origin(source.position, side, self.tracer.reach());
        let way = target - vertex.origin;
        let blocked = self.tracer.occluded(&Ray {
            origin: vertex.origin,
            direction: way,
            t_max: 1.0,
        });
        if blocked {
            return Vec3::ZERO;
        }
        f * source.radiance * (heuristic(pdf, scatter_pdf) / pdf)
    }
}

impl Vertex {
    /// Draws the next segment of a path; `None` where it ends.
    fn scatter(&self, random: &mut Random) -> Option<Scattered> {
        let (choice, u) = (random.unit(), random.pair());
        self.bsdf
            .sample(self.normal, self.view, choice, u)
            .filter(|s| s.direction.dot(self.geometric_normal) > 0.0)
    }
}

/// Power heuristic: the weight of a sample of density `a` where `b` is that of the other way.
fn heuristic(a: f32, b: f32) -> f32 {
    // As a ratio, since squares of narrow lobes' densities overflow.
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests;
