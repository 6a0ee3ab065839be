//! The surface that values are fitted over: an instance as it is placed, its vertices welded.

use crate::scene::{Pose, Scene};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Vertices at one position are one where their normals differ by less than this cosine (2.6
/// degrees): exporters split vertices where texture coordinates are cut, and creases by normal.
const SAME_NORMAL: f32 = 0.999;

/// Triangles with a doubled area below this share of their longest edge squared have none: their
/// gradients would be noise.
const DEGENERATE: f64 = 1e-7;

/// A mesh in world space with one variable per welded vertex.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// The variable of each vertex of the mesh.
    pub variable_of: Vec<u32>,
    /// World space, metres, of each variable.
    pub positions: Vec<DVec3>,
    /// World space, unit, of each variable: that of its first vertex.
    pub normals: Vec<Vec3>,
    /// Variables of each triangle of the mesh.
    pub triangles: Vec<[u32; 3]>,
    /// Square metres of each triangle; 0 for degenerate ones.
    pub areas: Vec<f64>,
    /// World space, unit, of each triangle by its winding; zero for degenerate ones.
    pub facings: Vec<DVec3>,
    /// Whether each triangle takes samples: it has an area and is not see-through.
    pub receives: Vec<bool>,
}

impl Shape {
    /// An instance of a scene at a pose.
    pub fn new(scene: &Scene, pose: &Pose, instance: usize) -> Shape {
        let mesh = &scene.meshes[scene.instances[instance].mesh];
        let world = &pose.world_from_mesh[instance];
        let deformed = pose.deformed.get(instance).and_then(Option::as_ref);
        let normals = deformed.map_or(&mesh.normals, |d| &d.normals);
        // By the file's own positions: vertices that only meet in one pose are not one.
        let variable_of = weld(&mesh.positions, &mesh.normals);
        let count = variable_of
            .iter()
            .max()
            .map_or(0, |last| *last as usize + 1);
        let mut shape = Shape {
            positions: vec![DVec3::ZERO; count],
            normals: vec![Vec3::Y; count],
            ..Shape::default()
        };
        let placed = pose.shape(scene, instance);
        for (vertex, &variable) in variable_of.iter().enumerate().rev() {
            let position = world.transform_point3(placed[vertex]);
            shape.positions[variable as usize] = position.as_dvec3();
            let normal = normals.get(vertex).copied().unwrap_or(Vec3::Y);
            shape.normals[variable as usize] =
                crate::scene::surface::normal_to_world(world, normal);
        }
        let mirrored = world.matrix3.determinant() < 0.0;
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let variables = triangle.map(|vertex| variable_of[vertex as usize]);
            let corners = variables.map(|variable| shape.positions[variable as usize]);
            let (area, facing) = area(corners);
            let see_through = scene
                .material_of(instance, index)
                .is_some_and(|material| material.is_see_through());
            shape.triangles.push(variables);
            shape.areas.push(area);
            shape.facings.push(if mirrored { -facing } else { facing });
            shape.receives.push(area > 0.0 && !see_through);
        }
        shape.variable_of = variable_of;
        shape
    }

    /// Number of variables.
    pub fn variables(&self) -> usize {
        self.positions.len()
    }

    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|variable| self.positions[variable as usize])
    }
}

/// Area and unit normal; both zero for a degenerate triangle.
fn area([a, b, c]: [DVec3; 3]) -> (f64, DVec3) {
    let cross = (b - a).cross(c - a);
    let edges = [b - a, c - b, a - c].map(DVec3::length_squared);
    let longest = edges.into_iter().fold(0.0, f64::max);
    let doubled = cross.length();
    match doubled.is_finite() && doubled > DEGENERATE * longest {
        true => (0.5 * doubled, cross / doubled),
        false => (0.0, DVec3::ZERO),
    }
}

/// A number per vertex, the same for vertices at one position whose normals agree. Numbers ascend
/// by their first vertices.
fn weld(positions: &[Vec3], normals: &[Vec3]) -> Vec<u32> {
    let mut count = 0;
    let mut at: HashMap<[u32; 3], Vec<(Vec3, u32)>> = HashMap::with_capacity(positions.len());
    let number = |(vertex, position): (usize, &Vec3)| {
        // Adding zero makes -0 into 0.
        let key = position.to_array().map(|x| (x + 0.0).to_bits());
        let here = at.entry(key).or_default();
        let normal = normals.get(vertex).copied().unwrap_or(Vec3::Y);
        let found = here.iter().find(|(n, _)| n.dot(normal) >= SAME_NORMAL);
        if let Some((_, variable)) = found {
            return *variable;
        }
        here.push((normal, count));
        count += 1;
        count - 1
    };
    positions.iter().enumerate().map(number).collect()
}
