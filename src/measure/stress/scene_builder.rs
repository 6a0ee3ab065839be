//! Builds scenes of matte walls, boxes, sheets and lamps.

use crate::scene::{Instance, Light, LightKind, Material, Mesh, Node, Scene};
use crate::trace::Aabb;
use glam::{Quat, Vec3};

/// Adds meshes and lights to a scene. Material 0 is that of all walls.
pub struct SceneBuilder {
    scene: Scene,
}

impl SceneBuilder {
    /// Walls reflect the share `albedo` of light, in all directions alike.
    pub fn new(name: &str, albedo: f32) -> SceneBuilder {
        let matte = Material {
            base_color: Vec3::splat(albedo).extend(1.0),
            metallic: 0.0,
            roughness: 1.0,
            ..Material::default()
        };
        let scene = Scene {
            name: name.into(),
            materials: vec![matte],
            ..Scene::default()
        };
        SceneBuilder { scene }
    }

    /// A mesh where it is, as an instance of its own.
    pub fn mesh(&mut self, mesh: Mesh) {
        let number = self.scene.meshes.len();
        self.scene.instances.push(Instance {
            name: number.to_string(),
            mesh: number,
            ..Instance::default()
        });
        self.scene.meshes.push(mesh);
    }

    /// A parallelogram of half extents `x`, `y`, seen from `x` cross `y`.
    pub fn quad(mesh: &mut Mesh, centre: Vec3, x: Vec3, y: Vec3, material: u32) {
        let first = mesh.positions.len() as u32;
        mesh.positions
            .extend([-x - y, x - y, x + y, y - x].map(|d| centre + d));
        mesh.normals.extend([x.cross(y).normalize_or(Vec3::Y); 4]);
        mesh.triangles
            .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| first + v)));
        mesh.materials.extend([material; 2]);
    }

    fn cuboid(&mut self, bounds: Aabb, inside: bool) {
        let (centre, half) = (
            0.5 * (bounds.min + bounds.max),
            0.5 * (bounds.max - bounds.min),
        );
        let mut mesh = Mesh::default();
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let along = |axis: usize| Vec3::AXES[axis % 3] * half[axis % 3];
                let (x, y) = (along(axis + 1), along(axis + 2));
                let out = Vec3::AXES[axis] * (half[axis] * side);
                // x cross y looks along the positive axis.
                let (x, y) = if (side > 0.0) == inside {
                    (y, x)
                } else {
                    (x, y)
                };
                Self::quad(&mut mesh, centre + out, x, y, 0);
            }
        }
        self.mesh(mesh);
    }

    /// A room that is seen from inside alone.
    pub fn room(&mut self, min: Vec3, max: Vec3) {
        self.cuboid(Aabb { min, max }, true);
    }

    /// A box that is seen from outside alone.
    pub fn solid(&mut self, min: Vec3, max: Vec3) {
        self.cuboid(Aabb { min, max }, false);
    }

    /// A wall without thickness that is seen from both sides.
    pub fn sheet(&mut self, centre: Vec3, x: Vec3, y: Vec3) {
        let material = self.scene.materials.len() as u32;
        self.scene.materials.push(Material {
            double_sided: true,
            ..self.scene.materials[0].clone()
        });
        let mut mesh = Mesh::default();
        Self::quad(&mut mesh, centre, x, y, material);
        self.mesh(mesh);
    }

    /// A square below a ceiling that shines down with this radiance.
    pub fn lamp(&mut self, centre: Vec3, side: f32, radiance: f32) {
        let material = self.scene.materials.len() as u32;
        self.scene.materials.push(Material {
            emissive: Vec3::splat(radiance),
            base_color: Vec3::ZERO.extend(1.0),
            ..self.scene.materials[0].clone()
        });
        let mut mesh = Mesh::default();
        let half = 0.5 * side;
        Self::quad(&mut mesh, centre, Vec3::X * half, Vec3::Z * half, material);
        self.mesh(mesh);
    }

    fn light(&mut self, kind: LightKind, translation: Vec3, rotation: Quat, intensity: f32) {
        self.scene.lights.push(Light {
            name: String::new(),
            node: Some(self.scene.nodes.len()),
            kind,
            intensity: Vec3::splat(intensity),
            range: f32::INFINITY,
        });
        self.scene.nodes.push(Node {
            name: String::new(),
            parent: None,
            translation,
            rotation,
            scale: Vec3::ONE,
            matrix: None,
            morph_weights: Vec::new(),
        });
    }

    /// A lamp without size, in candela.
    pub fn point(&mut self, at: Vec3, intensity: f32) {
        self.light(LightKind::Point, at, Quat::IDENTITY, intensity);
    }

    /// A sun that shines along `direction`, in lux.
    pub fn sun(&mut self, direction: Vec3, lux: f32) {
        let turn = Quat::from_rotation_arc(Vec3::NEG_Z, direction.normalize());
        self.light(LightKind::Directional, Vec3::ZERO, turn, lux);
    }

    pub fn build(self) -> Scene {
        self.scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::Ray;
    use crate::world::World;

    #[test]
    fn rooms_face_inwards_solids_outwards() {
        let mut builder = SceneBuilder::new("test", 0.5);
        builder.room(Vec3::splat(-2.0), Vec3::splat(2.0));
        builder.solid(Vec3::splat(-1.0), Vec3::splat(1.0));
        let scene = builder.build();
        let world = World::new(&scene, 0.0);
        for axis in Vec3::AXES {
            for direction in [axis, -axis] {
                let hit = |origin: Vec3, direction: Vec3| {
                    let ray = Ray {
                        origin,
                        direction,
                        t_max: f32::INFINITY,
                    };
                    let hit = world.tracer().closest(&ray).expect("a wall");
                    (hit.t, hit.back)
                };
                let outwards = hit(direction * 1.5, direction);
                let inwards = hit(direction * 1.5, -direction);
                assert_eq!((outwards, inwards), ((0.5, false), (0.5, false)));
            }
        }
    }
}
