//! Surfaces that shine: a table of their triangles to send shadow rays to.
//!
//! A triangle is drawn with a probability proportional to its area times the luminance of its
//! radiance. Where a texture says what shines, the triangle is cut into cells, each drawn by an
//! estimate of its own mean luminance. A ray that happens upon an emitter asks for the density that
//! the place would have been drawn with; it is 0 in a cell whose estimate is 0, and such a cell is
//! found by rays alone.

use super::bsdf::luminance;
use crate::scene::{Alpha, Pose, Scene};
use crate::trace::offset::offset_origin;
use crate::trace::{Hit, Ray, Tracer};
use glam::Vec3;
use rayon::prelude::*;

/// Most parts that an edge of a textured triangle is cut into.
const MAX_CUTS: usize = 16;
/// Most cells of all textured triangles together, unless there are more triangles than that: few
/// enough that a random number of 24 bits tells them apart.
const MAX_CELLS: usize = 1 << 16;
/// Texels along an edge of a cell, as far as [`MAX_CUTS`] allows.
const CELL_TEXELS: f32 = 2.0;
/// Parts that an edge of a cell is cut into to estimate its mean: 16 places.
const ESTIMATE_CUTS: usize = 4;
/// In [`Emitters::of_instance`]: the triangle does not shine.
const NONE: u32 = u32::MAX;

/// All emissive triangles at one pose.
pub struct Emitters {
    triangles: Vec<Triangle>,
    /// Emitter of each triangle of each instance, or [`NONE`]; empty for an instance without.
    of_instance: Vec<Vec<u32>>,
    /// Mean luminance of each cell.
    cells: Vec<f32>,
    /// Power up to and with each cell, over that of all.
    cumulative: Vec<f64>,
    /// Sum of area times luminance.
    power: f64,
}

struct Triangle {
    instance: u32,
    triangle: u32,
    corner: Vec3,
    edges: [Vec3; 2],
    /// Unit, of the front.
    normal: Vec3,
    double_sided: bool,
    /// Parts of each edge: there are `cuts * cuts` cells.
    cuts: usize,
    first_cell: usize,
}

/// A place on an emitter.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    pub position: Vec3,
    /// Unit, of the front.
    pub normal: Vec3,
    pub radiance: Vec3,
    /// Whether the back shines, too.
    pub double_sided: bool,
    /// Per square metre.
    pub density: f32,
}

impl Emitters {
    /// Those of a scene at a pose, at which `tracer` stands. What no ray can hit is left out (BLEND
    /// materials, instances without extent), since light is found by rays, too.
    pub fn new(scene: &Scene, pose: &Pose, tracer: &Tracer) -> Emitters {
        let shines: Vec<bool> = scene
            .materials
            .iter()
            .map(|m| luminance(m.emissive) > 0.0 && m.alpha != Alpha::Blend)
            .collect();
        let mut all = Emitters {
            triangles: Vec::new(),
            of_instance: vec![Vec::new(); scene.instances.len()],
            cells: Vec::new(),
            cumulative: Vec::new(),
            power: 0.0,
        };
        let max_cuts = max_cuts(scene, &shines);
        for (i, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            if tracer.bounds(i).is_empty() || !mesh.materials.iter().any(|m| shines[*m as usize]) {
                continue;
            }
            let positions = pose.shape(scene, i);
            let world = &pose.world_from_mesh[i];
            let mirrored = world.matrix3.determinant() < 0.0;
            all.of_instance[i] = vec![NONE; mesh.triangles.len()];
            for (t, corners) in mesh.triangles.iter().enumerate() {
                let material = mesh.materials[t] as usize;
                if !shines[material] {
                    continue;
                }
                let [a, b, c] = corners.map(|v| world.transform_point3(positions[v as usize]));
                let edges = [b - a, c - a];
                let cross = edges[0].cross(edges[1]);
                let Some(normal) = cross.try_normalize() else {
                    continue;
                };
                let cuts = cuts(scene, instance.mesh, t, max_cuts);
                let cells = cells(scene, instance.mesh, t, cuts);
                let area = 0.5 * cross.length() / cells.len() as f32;
                let powers = cells.iter().map(|mean| f64::from(area * mean));
                let power: f64 = powers.clone().sum();
                if !(power > 0.0 && power.is_finite()) {
                    continue;
                }
                let first_cell = all.cells.len();
                for power in powers {
                    all.power += power;
                    all.cumulative.push(all.power);
                }
                all.cells.extend(cells);
                all.of_instance[i][t] = all.triangles.len() as u32;
                all.triangles.push(Triangle {
                    instance: i as u32,
                    triangle: t as u32,
                    corner: a,
                    edges,
                    normal: if mirrored { -normal } else { normal },
                    double_sided: scene.materials[material].double_sided,
                    cuts,
                    first_cell,
                });
            }
        }
        for sum in &mut all.cumulative {
            *sum /= all.power;
        }
        all
    }

    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    fn find(&self, instance: u32, triangle: u32) -> Option<&Triangle> {
        let of_triangle = self.of_instance.get(instance as usize)?;
        let number = of_triangle.get(triangle as usize)?;
        self.triangles.get(*number as usize)
    }

    /// Whether a triangle shines to the side that is met.
    pub fn shines(&self, instance: u32, triangle: u32, back: bool) -> bool {
        let found = self.find(instance, triangle);
        found.is_some_and(|t| !back || t.double_sided)
    }

    /// Whether another surface lies in the plane of an emitter and hides it from rays that come from
    /// its front: a lamp in the plane of a ceiling. Some places of each emitter are tried.
    pub fn any_hidden(&self, tracer: &Tracer) -> bool {
        self.triangles.par_iter().any(|t| {
            (0..4).any(|part| {
                let (v, w) = place_in(2, part, 1.0 / 3.0, 1.0 / 3.0);
                let position = t.corner + t.edges[0] * v + t.edges[1] * w;
                let origin = offset_origin(position, t.normal, tracer.reach());
                let ray = Ray {
                    origin,
                    direction: (position - origin) * 2.0,
                    t_max: 1.0,
                };
                let hit = tracer.closest(&ray);
                hit.is_some_and(|hit| self.find(hit.instance, hit.triangle).is_none())
            })
        })
    }

    /// The density per square metre with which the place of a hit is drawn.
    pub fn density(&self, hit: &Hit) -> f32 {
        match self.find(hit.instance, hit.triangle) {
            Some(t) => self.cell_density(t.first_cell + cell_at(t.cuts, hit.u, hit.v)),
            None => 0.0,
        }
    }

    fn cell_density(&self, cell: usize) -> f32 {
        (f64::from(self.cells[cell]) / self.power) as f32
    }

    /// Draws a place: the cell by `choice`, the point in it by `u`, all uniform in [0, 1).
    /// `None` where there are no emitters or the place is a hole of a MASK material.
    pub fn sample(&self, scene: &Scene, choice: f32, u: [f32; 2]) -> Option<Source> {
        let cell = self.cumulative.partition_point(|c| *c <= f64::from(choice));
        let cell = cell.min(self.cells.len().wrapping_sub(1));
        let after = self.triangles.partition_point(|t| t.first_cell <= cell);
        let t = self.triangles.get(after.wrapping_sub(1))?;
        let r = u[0].sqrt();
        let (v, w) = place_in(t.cuts, cell - t.first_cell, r * (1.0 - u[1]), r * u[1]);
        let mesh = scene.instances[t.instance as usize].mesh;
        if scene.mask_is_hole(mesh, t.triangle as usize, v, w) {
            return None;
        }
        Some(Source {
            position: t.corner + t.edges[0] * v + t.edges[1] * w,
            normal: t.normal,
            radiance: scene.emission(mesh, t.triangle as usize, v, w),
            double_sided: t.double_sided,
            density: self.cell_density(cell),
        })
    }
}

/// Most cuts an edge so that the cells of all textured emitters stay below [`MAX_CELLS`].
fn max_cuts(scene: &Scene, shines: &[bool]) -> usize {
    let textured = |m: &&u32| {
        let m = **m as usize;
        shines[m] && scene.materials[m].emissive_texture.is_some()
    };
    let of_mesh: Vec<usize> = scene
        .meshes
        .iter()
        .map(|mesh| mesh.materials.iter().filter(textured).count())
        .collect();
    let count: usize = scene.instances.iter().map(|i| of_mesh[i.mesh]).sum();
    ((MAX_CELLS / count.max(1)).isqrt()).clamp(1, MAX_CUTS)
}

/// Parts of an edge of a triangle: by its extent in texels.
fn cuts(scene: &Scene, mesh: usize, triangle: usize, most: usize) -> usize {
    let mesh = &scene.meshes[mesh];
    let material = &scene.materials[mesh.materials[triangle] as usize];
    let Some(texture) = material.emissive_texture else {
        return 1;
    };
    let Some([a, b, c]) = mesh.corner_uvs(&texture, triangle) else {
        return 1;
    };
    let image = &scene.textures[texture.texture];
    let size = glam::Vec2::new(image.width as f32, image.height as f32);
    let longest = [b - a, c - b, a - c]
        .map(|edge| (edge * size).length())
        .into_iter()
        .fold(0.0, f32::max);
    ((longest / CELL_TEXELS).ceil() as usize).clamp(1, most)
}

/// Mean luminance of each cell of a triangle.
fn cells(scene: &Scene, mesh: usize, triangle: usize, cuts: usize) -> Vec<f32> {
    let material = scene.meshes[mesh].materials[triangle] as usize;
    let material = &scene.materials[material];
    if material.emissive_texture.is_none() {
        return vec![luminance(material.emissive)];
    }
    let places = ESTIMATE_CUTS * ESTIMATE_CUTS;
    let mean = |cell: usize| {
        let sum: f32 = (0..places)
            .map(|place| place_in(ESTIMATE_CUTS, place, 1.0 / 3.0, 1.0 / 3.0))
            .map(|(u, v)| place_in(cuts, cell, u, v))
            .map(|(u, v)| luminance(scene.emission(mesh, triangle, u, v)))
            .sum();
        sum / places as f32
    };
    (0..cuts * cuts).map(mean).collect()
}

/// The cell that holds barycentric `u`, `v`. Row after row along v, cells alternate between upright
/// triangles and inverted ones; row j has `2 (cuts - j) - 1`.
fn cell_at(cuts: usize, u: f32, v: f32) -> usize {
    let scaled = |x: f32| (x * cuts as f32).clamp(0.0, cuts as f32);
    let (u, v) = (scaled(u), scaled(v));
    let j = (v as usize).min(cuts - 1);
    let i = (u as usize).min(cuts - 1 - j);
    let inverted = (u - i as f32) + (v - j as f32) > 1.0 && i + j + 1 < cuts;
    j * (2 * cuts - j) + 2 * i + usize::from(inverted)
}

/// Barycentric coordinates in the triangle of `u`, `v` in one of its cells.
fn place_in(cuts: usize, cell: usize, u: f32, v: f32) -> (f32, f32) {
    let mut j = 0;
    while (j + 1) * (2 * cuts - (j + 1)) <= cell && j + 1 < cuts {
        j += 1;
    }
    let along = cell - j * (2 * cuts - j);
    let (i, j, n) = ((along / 2) as f32, j as f32, cuts as f32);
    if along.is_multiple_of(2) {
        ((i + u) / n, (j + v) / n)
    } else {
        ((i + 1.0 - u) / n, (j + 1.0 - v) / n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_tile_the_triangle() {
        for cuts in 1..=MAX_CUTS {
            for cell in 0..cuts * cuts {
                for (u, v) in [(0.3, 0.3), (0.05, 0.05), (0.9, 0.05), (0.05, 0.9)] {
                    let (x, y) = place_in(cuts, cell, u, v);
                    assert!(x >= 0.0 && y >= 0.0 && x + y <= 1.0, "{cuts} {cell}");
                    assert_eq!(cell_at(cuts, x, y), cell, "{cuts} {u} {v}");
                }
            }
        }
        for odd in [f32::NAN, -1.0, 1.0, 2.0] {
            assert!(cell_at(3, odd, odd) < 9);
        }
    }
}
