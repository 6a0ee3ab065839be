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
//!
//! Transmission ([`crate::scene::Material::transmission`]) is that of a thin wall that is clear as far
//! as it transmits: by chance, a path that meets it goes straight on, times the base colour, or
//! scatters as off an opaque surface; shadow rays are weighted instead. What a clear window reflects is
//! left out. A camera looks through a window as if it were not there ([`PathTracer::first`]), as
//! a rasteriser does. Unlit surfaces stop light and send none; cameras alone see their colour.

pub mod bsdf;
pub mod emitters;
pub mod random;

use super::offset::offset_origin;
use super::{Hit, Ray, Tracer};
use crate::scene::light::NEAREST;
use crate::scene::{Pose, Scene};
use bsdf::{Bsdf, Scattered, luminance, seen_normal};
use emitters::Emitters;
use glam::Vec3;
pub use random::Random;

/// Bounces before Russian roulette begins.
const ROULETTE_AFTER: u32 = 3;

/// Most that a path survives roulette with: none is followed for nothing.
const MAX_SURVIVAL: f32 = 0.95;

/// Most windows that a ray passes one after the other.
const MAX_WINDOWS: u32 = 64;

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

/// Radiance that travels along a ray against its direction, and where it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IncomingRadiance {
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
    /// What a camera sees of an unlit surface; black for others.
    pub unlit: Vec3,
    /// Share of light that passes straight through, and its colour.
    pub transmission: f32,
    pub tint: Vec3,
    /// Per square metre, with which the place is drawn as that of an emitter.
    pub density: f32,
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
    /// Whether an emitter lies in the plane of another surface.
    hidden_emitters: bool,
    /// Whether any material transmits light.
    windows: bool,
    sky: Sky,
    coat: bool,
}

impl<'a> PathTracer<'a> {
    /// `tracer` stands at `pose`, and both are of `scene`. Lights are the pose's; a scene without
    /// any is dark unless it has emitters or a sky.
    pub fn new(scene: &'a Scene, pose: &'a Pose, tracer: &'a Tracer<'a>, sky: Sky) -> Self {
        let emitters = Emitters::new(scene, pose, tracer);
        PathTracer {
            scene,
            pose,
            tracer,
            hidden_emitters: emitters.any_hidden(tracer),
            emitters,
            windows: scene.transmits(),
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

    /// The radiance at `origin` from `direction` (unit), estimated by one path.
    pub fn radiance(
        &self,
        origin: Vec3,
        direction: Vec3,
        mut random: Random,
        paths: &Paths,
    ) -> IncomingRadiance {
        let cull = paths.cull_back_faces;
        let (vertex, tint, back_face) = self.follow(origin, direction, cull, &mut random);
        let Some(vertex) = vertex else {
            return IncomingRadiance {
                radiance: tint * self.sky.radiance(direction),
                distance: f32::INFINITY,
                back_face,
            };
        };
        let scattered = self.scattered(&vertex, &mut random, paths.max_bounces, true);
        IncomingRadiance {
            radiance: tint * (vertex.emitted + scattered),
            distance: vertex.distance,
            back_face,
        }
    }

    /// The first surface on a ray that does not let it through, by chance; what windows before it
    /// make of its light; and whether the back of a single-sided material was met up to there.
    fn follow(
        &self,
        mut origin: Vec3,
        direction: Vec3,
        cull: bool,
        random: &mut Random,
    ) -> (Option<Vertex>, Vec3, bool) {
        let (mut tint, mut before, mut back_face) = (Vec3::ONE, 0.0, false);
        for _ in 0..MAX_WINDOWS {
            let ray = Ray {
                origin,
                direction,
                t_max: f32::INFINITY,
            };
            let (hit, back) = self.hit(&ray, cull, true);
            back_face |= back;
            let Some(hit) = hit else {
                return (None, tint, back_face);
            };
            let mut vertex = self.vertex(&hit, direction);
            if self.hidden_emitters
                && vertex.emitted == Vec3::ZERO
                && let Some(lamp) = self.emitter_in_plane(&vertex, direction)
            {
                vertex = lamp;
            }
            vertex.distance += before;
            if vertex.transmission <= 0.0 || random.unit() >= vertex.transmission {
                return (Some(vertex), tint, back_face);
            }
            tint *= vertex.tint;
            before = vertex.distance;
            origin = self.beyond(&vertex);
        }
        (None, Vec3::ZERO, back_face)
    }

    /// An emitter in the plane of the surface that a ray met, which rounding alone puts before or
    /// behind it. Shadow rays take it for open, and so must the rays that they are weighted against.
    fn emitter_in_plane(&self, vertex: &Vertex, direction: Vec3) -> Option<Vertex> {
        let offset = vertex.origin - vertex.position;
        let cosine = vertex.geometric_normal.dot(vertex.view).max(0.01);
        let ray = Ray {
            origin: vertex.origin,
            direction,
            t_max: 2.0 * offset.length() / cosine,
        };
        let hit = self
            .tracer
            .closest_of(&ray, |i, t, back| self.emitters.shines(i, t, back))?;
        let mut lamp = self.vertex(&hit, direction);
        lamp.distance = vertex.distance;
        Some(lamp)
    }

    /// Where a ray goes on that passes a surface.
    fn beyond(&self, vertex: &Vertex) -> Vec3 {
        offset_origin(
            vertex.position,
            -vertex.geometric_normal,
            self.tracer.reach(),
        )
    }

    /// The share of light that comes along a ray to its origin from its end.
    fn open(&self, ray: &Ray) -> Vec3 {
        if !self.windows {
            let occluded = self.tracer.occluded(ray);
            return if occluded { Vec3::ZERO } else { Vec3::ONE };
        }
        let (mut ray, mut share) = (*ray, Vec3::ONE);
        let end = ray.origin + ray.direction * ray.t_max;
        for _ in 0..MAX_WINDOWS {
            let Some(hit) = self.tracer.closest_or_window(&ray) else {
                return share;
            };
            let vertex = self.vertex(&hit, ray.direction);
            if vertex.transmission <= 0.0 {
                return Vec3::ZERO;
            }
            share *= vertex.tint * vertex.transmission;
            ray.origin = self.beyond(&vertex);
            if ray.t_max.is_finite() {
                // To the very same end, which may lie just before a surface.
                let rest = end - ray.origin;
                if rest.dot(ray.direction) <= 0.0 {
                    return share;
                }
                (ray.direction, ray.t_max) = (rest, 1.0);
            }
        }
        Vec3::ZERO
    }

    /// The first surface on a ray that is no window, and whether the back of a single-sided material
    /// was met up to there: what a camera sees. `cull` lets the ray pass such backs.
    pub fn first(&self, origin: Vec3, direction: Vec3, cull: bool) -> (Option<Vertex>, bool) {
        let ray = Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        };
        let (hit, back) = self.hit(&ray, cull, false);
        (hit.map(|h| self.vertex(&h, direction)), back)
    }

    /// The nearest hit, and whether the back of a single-sided material was met up to there.
    fn hit(&self, ray: &Ray, cull: bool, windows: bool) -> (Option<Hit>, bool) {
        let tracer = self.tracer;
        if cull {
            let (hit, nearest_back) = if windows {
                tracer.closest_front_or_window(ray)
            } else {
                tracer.closest_front(ray)
            };
            let end = hit.map_or(f32::INFINITY, |hit| hit.t);
            return (hit, nearest_back < end);
        }
        let hit = if windows {
            tracer.closest_or_window(ray)
        } else {
            tracer.closest(ray)
        };
        let back = hit.is_some_and(|h| {
            h.back
                && !self
                    .scene
                    .is_double_sided(h.instance as usize, h.triangle as usize)
        });
        (hit, back)
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
        let bsdf = if surface.unlit {
            Bsdf::BLACK
        } else {
            Bsdf::new(surface.base_color, surface.metallic, surface.roughness)
        };
        let emitted = if dark { Vec3::ZERO } else { surface.emissive };
        let density = if emitted == Vec3::ZERO {
            0.0
        } else {
            self.emitters.density(hit)
        };
        Vertex {
            position: surface.position,
            geometric_normal: surface.geometric_normal,
            normal: seen_normal(surface.normal, view),
            view,
            bsdf: if self.coat { bsdf } else { bsdf.without_coat() },
            emitted,
            unlit: if surface.unlit {
                surface.base_color
            } else {
                Vec3::ZERO
            },
            transmission: surface.transmission,
            tint: surface.base_color,
            density,
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
                if light == Vec3::ZERO {
                    return Vec3::ZERO;
                }
                light * self.open(&ray)
            })
            .sum()
    }

    /// What is to be added to direct light for which what transmits was either no obstacle (windows)
    /// or opaque, as in a shadow map: tint and attenuation. Usually negative.
    pub fn transmitted(&self, vertex: &Vertex) -> Vec3 {
        (0..self.pose.lights.len())
            .map(|light| {
                let (light, ray) = self.unshadowed(vertex, light);
                if light == Vec3::ZERO {
                    return Vec3::ZERO;
                }
                let mapped = if self.tracer.occluded(&ray) { 0.0 } else { 1.0 };
                light * (self.open(&ray) - mapped)
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
            if throughput == Vec3::ZERO {
                break;
            }
            if bounce >= ROULETTE_AFTER {
                let survival = throughput.max_element().min(MAX_SURVIVAL);
                if random.unit() >= survival {
                    break;
                }
                throughput /= survival;
            }
            let (hit, tint, _) = self.follow(vertex.origin, next.direction, false, random);
            throughput *= tint;
            let Some(hit) = hit else {
                light += throughput * self.sky.radiance(next.direction);
                break;
            };
            vertex = hit;
            if vertex.emitted != Vec3::ZERO {
                let cosine = vertex.geometric_normal.dot(vertex.view);
                let other = vertex.density * vertex.distance * vertex.distance / cosine;
                light += throughput * vertex.emitted * heuristic(next.pdf, other);
            }
        }
        light
    }

    /// The indirect light of [`PathTracer::scattered`], by one path: what the Lambert base reflects, and
    /// what the coat does.
    pub fn scattered_parts(
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
        let mut incoming_light = Vec3::ZERO;
        if to.falloff > 0.0 && to.direction.dot(vertex.geometric_normal) > 0.0 {
            let f = vertex
                .bsdf
                .evaluate(vertex.normal, vertex.view, to.direction);
            incoming_light = f * light.intensity * to.falloff;
        }
        let ray = Ray {
            origin: vertex.origin,
            direction: to.direction,
            t_max: to.distance - NEAREST,
        };
        (incoming_light, ray)
    }

    /// An estimate of [`PathTracer::direct`] by one shadow ray: the light is drawn by what it would
    /// contribute.
    fn one_light(&self, vertex: &Vertex, mut u: f32) -> Vec3 {
        let mut total = 0.0;
        let mut chosen: Option<(Vec3, f32, Ray)> = None;
        for light in 0..self.pose.lights.len() {
            let (incoming_light, ray) = self.unshadowed(vertex, light);
            let weight = luminance(incoming_light);
            if weight.is_nan() || weight <= 0.0 {
                continue;
            }
            total += weight;
            // A reservoir of one; u is stretched to be uniform again after each choice.
            let share = weight / total;
            if u < share {
                u /= share;
                chosen = Some((incoming_light, weight, ray));
            } else {
                u = (u - share) / (1.0 - share);
            }
        }
        match chosen {
            Some((incoming_light, weight, ray)) => {
                incoming_light * self.open(&ray) * (total / weight)
            }
            None => Vec3::ZERO,
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
        let open = self.open(&Ray {
            origin: vertex.origin,
            direction: way,
            t_max: 1.0,
        });
        if open == Vec3::ZERO {
            return Vec3::ZERO;
        }
        open * f * source.radiance * (heuristic(pdf, scatter_pdf) / pdf)
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
mod material_tests;
#[cfg(test)]
pub(crate) mod tests;
