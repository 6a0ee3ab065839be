//! Shadow maps: how far each punctual light sees.
//!
//! A map is a square of depths through a [`Face`]: one for a directional light, fitted to the
//! scene's bounds, one for a spot, six for a point light (or a spot that is too wide for one).
//! [`device`] rasterises them; [`trace`] is its twin with one ray a texel. Both see what blocks a
//! shadow ray of the path tracer: both sides of everything but [`crate::scene::Alpha::Blend`], with
//! the holes of masks.
//!
//! A lookup filters the nine comparisons about a point, weighted as a box of 3 x 3 texels
//! (percentage-closer filtering, Reeves et al. 1987). A surface must not shade itself where a tap
//! lies beside the point, so that each tap is compared with the depth of the surface's own plane
//! there (the receiver plane of Isidoro 2006, *Shadow Mapping: GPU-based Tips and Techniques*):
//! through both projections depth is affine over the map, and its gradient comes from the geometric
//! normal. That is a bias which grows with the slope exactly as it must. Lifting the point off its
//! surface instead is as safe, but moves shadows by twice the filter's reach: with it the direct
//! light of three scenes was 0.5 to 4.5 dB farther from traced shadows (`tests/probes_client.rs`).
//!
//! What is left is rounding: of depth ([`ROUNDING`]), and of outlines, which rasterisers snap to a
//! grid within the texel ([`SNAP`]).

pub mod device;

use crate::scene::{LightKind, LightPose, Pose};
use crate::trace::{Ray, Tracer};
use glam::{Mat4, Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// Texels by which a map's samples may be off, along each axis. SHARED with `shadow.wgsl`.
pub const SNAP: f32 = 0.125;
/// Cosine between light and surface below which the plane's slope grows no more: what is lit by less
/// than a thousandth may shade itself. SHARED with `shadow.wgsl`.
pub const GRAZING: f32 = 1e-3;
/// Texels about a map that no lookup starts from, so that the filter stays within.
pub const GUARD: f32 = 4.0;
/// Nearest depth of a map in metres: nothing is nearer to a lamp ([`LightPose::ray`]). SHARED with
/// `shadow.wgsl`.
pub const NEAR: f32 = 0.01;
/// Rounding of depth, relative to it in a perspective and to the whole depth in an orthographic
/// projection: a few hundred times that of f32, for positions were transformed.
pub const ROUNDING: f32 = 3e-5;
/// A spot of a greater half angle gets six faces, for one would be mostly rim.
const WIDE: f32 = 1.0;
/// Least texels a side of a map.
pub const MIN_SIDE: u32 = 64;
/// Texels a side that [`Plan::new`] is usually given.
pub const SIDE: u32 = 2048;
/// Most bytes of all maps together; the side is halved until they fit.
const MOST_BYTES: u64 = 512 << 20;

/// How depth is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Depth is [`NEAR`] / z.
    Perspective,
    /// Depth is 1 - z / `range`.
    Orthographic { range: f32 },
}

/// What one map is seen through: right, up and forward are an orthonormal basis; z is along forward.
/// Depth grows towards the light and is 0 at the far end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// The light, or the middle of the near plane. World space.
    pub origin: Vec3,
    pub right: Vec3,
    pub up: Vec3,
    pub forward: Vec3,
    /// Half the map's width and height: tangents, or metres in an orthographic projection.
    pub half: Vec2,
    pub projection: Projection,
}

impl Face {
    fn perspective(origin: Vec3, forward: Vec3, up: Vec3, tangent: f32) -> Face {
        Face {
            origin,
            right: forward.cross(up),
            up,
            forward,
            half: Vec2::splat(tangent),
            projection: Projection::Perspective,
        }
    }

    /// Looks along `forward` (unit) at all of a box.
    fn fitted(forward: Vec3, (min, max): (Vec3, Vec3), guard: f32) -> Face {
        let up = forward.any_orthonormal_vector();
        let right = forward.cross(up);
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min } else { max }[axis];
            let p = Vec3::new(pick(0), pick(1), pick(2));
            let p = Vec3::new(p.dot(right), p.dot(up), p.dot(forward));
            (low, high) = (low.min(p), high.max(p));
        }
        let margin = (high - low).max_element().max(NEAR) * 1e-3;
        let (low, high) = (low - margin, high + margin);
        let middle = 0.5 * (low + high);
        Face {
            origin: right * middle.x + up * middle.y + forward * low.z,
            right,
            up,
            forward,
            half: (0.5 * (high - low)).truncate() * guard,
            projection: Projection::Orthographic {
                range: high.z - low.z,
            },
        }
    }

    /// The projection as a matrix, depth reversed as everywhere.
    pub fn clip_from_world(&self) -> Mat4 {
        let row = |axis: Vec3, scale: f32| {
            let axis = axis * scale;
            axis.extend(-axis.dot(self.origin))
        };
        let x = row(self.right, 1.0 / self.half.x);
        let y = row(self.up, 1.0 / self.half.y);
        let (z, w) = match self.projection {
            Projection::Perspective => (Vec4::W * NEAR, row(self.forward, 1.0)),
            Projection::Orthographic { range } => {
                (Vec4::W - row(self.forward, 1.0 / range), Vec4::W)
            }
        };
        Mat4::from_cols(x, y, z, w).transpose()
    }

    /// A point in the face's axes.
    fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.right), v.dot(self.up), v.dot(self.forward))
    }

    /// Coordinates in texels and depth of a point in the face's axes.
    fn project(&self, p: Vec3, side: u32) -> (Vec2, f32) {
        let (across, depth) = match self.projection {
            Projection::Perspective => (p.truncate() / (self.half * p.z), NEAR / p.z),
            Projection::Orthographic { range } => (p.truncate() / self.half, 1.0 - p.z / range),
        };
        let at = Vec2::new(0.5 + 0.5 * across.x, 0.5 - 0.5 * across.y);
        (at * side as f32, depth)
    }

    /// What depth grows by, a texel right and a texel down, over the plane through `p` with normal
    /// `n`, which faces the light; both in the face's axes.
    fn gradient(&self, p: Vec3, n: Vec3, side: u32) -> Vec2 {
        let slope = match self.projection {
            Projection::Perspective => n.truncate() * (NEAR / n.dot(p).min(-GRAZING * p.length())),
            Projection::Orthographic { range } => n.truncate() / (n.z.min(-GRAZING) * range),
        };
        slope * self.half * Vec2::new(2.0, -2.0) / side as f32
    }

    /// The ray through a texel's centre, from the near plane; `t` counts in metres of z.
    fn ray(&self, x: u32, y: u32, side: u32) -> Ray {
        let at = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32;
        let across = Vec2::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y) * self.half;
        let across = self.right * across.x + self.up * across.y;
        let (origin, direction) = match self.projection {
            Projection::Perspective => {
                let direction = across + self.forward;
                (self.origin + direction * NEAR, direction)
            }
            Projection::Orthographic { .. } => (self.origin + across, self.forward),
        };
        Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        }
    }

    /// Depth of what a [`Face::ray`] meets after `t`.
    fn depth(&self, t: f32) -> f32 {
        match self.projection {
            Projection::Perspective => NEAR / (NEAR + t),
            Projection::Orthographic { range } => 1.0 - t / range,
        }
    }
}

/// The faces of all lights of a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Texels a side of every map.
    pub side: u32,
    pub faces: Vec<Face>,
    /// First face and number of faces of each light: 1, or 6 in the order +x, -x, +y, -y, +z, -z.
    pub of_light: Vec<(u32, u32)>,
}

/// Depths through the faces of a [`Plan`].
#[derive(Clone, Debug, PartialEq)]
pub struct Maps {
    pub plan: Plan,
    /// `side * side` a face, row by row from the top.
    pub depths: Vec<f32>,
}

impl Plan {
    /// `bounds` is the box of all that casts shadows; `side` is rounded to a power of two and halved
    /// while the maps take more than 512 MiB.
    pub fn new(pose: &Pose, bounds: (Vec3, Vec3), side: u32) -> Plan {
        let faces: u32 = pose.lights.iter().map(faces_of).sum();
        let mut side = side.clamp(MIN_SIDE, 1 << 14).next_power_of_two();
        while side > MIN_SIDE && u64::from(faces) * u64::from(side).pow(2) * 4 > MOST_BYTES {
            side /= 2;
        }
        let guard = side as f32 / (side as f32 - 2.0 * GUARD);
        let mut plan = Plan {
            side,
            faces: Vec::new(),
            of_light: Vec::new(),
        };
        for light in &pose.lights {
            let first = plan.faces.len() as u32;
            match light.kind {
                LightKind::Directional => {
                    plan.faces
                        .push(Face::fitted(light.direction, bounds, guard));
                }
                LightKind::Spot { outer, .. } if outer <= WIDE => {
                    let up = light.direction.any_orthonormal_vector();
                    let tangent = outer.max(0.01).tan() * guard;
                    let face = Face::perspective(light.position, light.direction, up, tangent);
                    plan.faces.push(face);
                }
                _ => {
                    for axis in Vec3::AXES {
                        for forward in [axis, -axis] {
                            // Cyclic: the next axis is across.
                            let up = Vec3::new(axis.z, axis.x, axis.y);
                            let face = Face::perspective(light.position, forward, up, guard);
                            plan.faces.push(face);
                        }
                    }
                }
            }
            plan.of_light.push((first, faces_of(light)));
        }
        plan
    }

    /// Number of the face through which a light sees a point; `None` for a light without any.
    fn face(&self, light: usize, position: Vec3) -> Option<usize> {
        let (first, count) = *self.of_light.get(light)?;
        let first = first as usize;
        if count < 6 {
            return Some(first);
        }
        let d = position - self.faces.get(first)?.origin;
        let a = d.abs();
        let axis = if a.x >= a.y && a.x >= a.z {
            0
        } else if a.y >= a.z {
            1
        } else {
            2
        };
        Some(first + 2 * axis + usize::from(d[axis] < 0.0))
    }
}

fn faces_of(light: &LightPose) -> u32 {
    match light.kind {
        LightKind::Directional => 1,
        LightKind::Spot { outer, .. } if outer <= WIDE => 1,
        _ => 6,
    }
}

impl Maps {
    /// Share of a light that reaches a surface at `position` with unit geometric normal `n` on the
    /// side that the light shines on: 0 to 1. Twin of `lit` in `shadow.wgsl`.
    pub fn lit(&self, light: usize, position: Vec3, n: Vec3) -> f32 {
        let Plan { side, faces, .. } = &self.plan;
        let Some((number, face)) = self
            .plan
            .face(light, position)
            .and_then(|i| Some((i, faces.get(i)?)))
        else {
            return 1.0;
        };
        let p = face.local(position - face.origin);
        let (scale, add) = match face.projection {
            Projection::Perspective if p.z <= NEAR => return 1.0,
            Projection::Perspective => (1.0 + ROUNDING, 0.0),
            Projection::Orthographic { .. } => (1.0, ROUNDING),
        };
        let (at, depth) = face.project(p, *side);
        let gradient = face.gradient(p, face.local(n), *side);
        let depth = depth * scale + add + SNAP * gradient.abs().element_sum();
        let base = (at - 0.5).floor();
        let f = at - 0.5 - base;
        let (across, down) = (weights(f.x), weights(f.y));
        let mut sum = 0.0;
        for (row, wy) in down.into_iter().enumerate() {
            for (column, wx) in across.into_iter().enumerate() {
                let x = base.x as i32 + column as i32 - 1;
                let y = base.y as i32 + row as i32 - 1;
                let tap = Vec2::new(column as f32, row as f32) - 1.0 - f;
                // Beyond the plane's horizon only what is nearer than infinity blocks light.
                if self.depth(number, x, y) <= (depth + gradient.dot(tap)).max(0.0) {
                    sum += wx * wy;
                }
            }
        }
        (sum / 9.0).min(1.0)
    }

    /// Of the nearest texel of a map.
    fn depth(&self, face: usize, x: i32, y: i32) -> f32 {
        let side = self.plan.side as i32;
        let (x, y) = (x.clamp(0, side - 1) as usize, y.clamp(0, side - 1) as usize);
        let side = side as usize;
        let at = (face * side + y) * side + x;
        self.depths.get(at).copied().unwrap_or(0.0)
    }
}

/// A box of three texels over four.
fn weights(f: f32) -> [f32; 4] {
    [1.0 - f, 1.0, 1.0, f]
}

/// The maps by one ray a texel. `tracer` stands at the pose of the plan.
pub fn trace(plan: Plan, tracer: &Tracer) -> Maps {
    let side = plan.side as usize;
    let mut depths = vec![0.0; plan.faces.len() * side * side];
    depths
        .par_chunks_mut(side.max(1))
        .enumerate()
        .for_each(|(row, depths)| {
            let face = &plan.faces[row / side];
            for (x, depth) in depths.iter_mut().enumerate() {
                let ray = face.ray(x as u32, (row % side) as u32, plan.side);
                if let Some(hit) = tracer.closest(&ray) {
                    *depth = face.depth(hit.t).clamp(0.0, 1.0);
                }
            }
        });
    Maps { plan, depths }
}

#[cfg(test)]
#[path = "shadow/tests.rs"]
pub(super) mod tests;
