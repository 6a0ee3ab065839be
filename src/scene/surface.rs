//! What lies at a point of a triangle: the one place where points, the reference renderer and the
//! CPU G-buffer get positions, normals and colours from.

use super::pose::normal_matrix;
use super::{Material, Mesh, Pose, Scene, TextureRef, specular};
use glam::{Affine3A, Vec3, Vec3A, Vec4};

/// A shading normal is kept at least this cosine above the geometric surface, so that a normal map
/// cannot turn a point's hemisphere into its own triangle.
const MIN_COSINE: f32 = 0.02;

/// A point on an instance's surface, on the front side of its triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// World space, metres.
    pub position: Vec3,
    /// World space, unit, by the winding of the triangle; mirrored instances are accounted for, so
    /// it points to the side from which the corners are seen counter-clockwise in mesh space.
    pub geometric_normal: Vec3,
    /// World space, unit: interpolated, normal map applied, on the geometric normal's side.
    pub normal: Vec3,
    /// Posed mesh space.
    pub mesh_position: Vec3,
    /// `normal` in posed mesh space, unit.
    pub mesh_normal: Vec3,
    /// Mesh space as stored in [`Mesh::positions`], before skinning and morphing.
    pub rest_position: Vec3,
    /// Shading normal of the stored mesh, normal map applied, unit.
    pub rest_normal: Vec3,
    /// Linear RGB, vertex colour included.
    pub base_color: Vec3,
    /// Linear RGB radiance.
    pub emissive: Vec3,
    pub roughness: f32,
    pub metallic: f32,
    /// Share of light that passes straight through, times the base colour.
    pub transmission: f32,
    /// Shown in its base colour whatever the light.
    pub unlit: bool,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

impl Surface {
    /// The same point on the back of the triangle: all normals turned.
    pub fn flipped(self) -> Surface {
        Surface {
            geometric_normal: -self.geometric_normal,
            normal: -self.normal,
            mesh_normal: -self.mesh_normal,
            rest_normal: -self.rest_normal,
            ..self
        }
    }

    /// The side that a ray of this direction hits.
    pub fn facing(self, direction: Vec3) -> Surface {
        if self.geometric_normal.dot(direction) > 0.0 {
            self.flipped()
        } else {
            self
        }
    }
}

/// The vertices of a mesh in some state.
struct Vertices<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    /// xyz of the tangents, or empty; see [`Mesh::tangents`] for the handedness.
    tangents: Option<&'a [Vec3]>,
}

/// Weights of a triangle's corners.
fn interpolate(values: [Vec3; 3], u: f32, v: f32) -> Vec3 {
    let [a, b, c] = values;
    a + (b - a) * u + (c - a) * v
}

/// The unit normal of a triangle by its winding; `None` when it has no area.
fn triangle_normal(corners: [Vec3; 3]) -> Option<Vec3> {
    let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
    let scale = e1.abs().max(e2.abs()).max_element();
    if scale <= 0.0 {
        return None;
    }
    (e1 / scale).cross(e2 / scale).try_normalize()
}

/// Lifts a unit normal to the geometric side.
fn keep_above(normal: Vec3, geometric: Vec3) -> Vec3 {
    let cosine = normal.dot(geometric);
    if cosine >= MIN_COSINE {
        return normal;
    }
    (normal + geometric * (MIN_COSINE - cosine))
        .try_normalize()
        .unwrap_or(geometric)
}

impl Scene {
    /// The material of a triangle of an instance, if there is such a one.
    pub fn material_of(&self, instance: usize, triangle: usize) -> Option<&Material> {
        let mesh = &self.meshes[self.instances[instance].mesh];
        let material = *mesh.materials.get(triangle)?;
        self.materials.get(material as usize)
    }

    /// Whether a triangle's back is a surface like its front, to what culls backs.
    pub fn is_double_sided(&self, instance: usize, triangle: usize) -> bool {
        self.material_of(instance, triangle)
            .is_some_and(|m| m.double_sided)
    }

    /// The surface at barycentric coordinates `u`, `v` (weights of the second and third corner) of
    /// a triangle of an instance. The pose must be one of this scene.
    ///
    /// Interpolated normals that point away from the winding's side are turned, since it is the
    /// winding that says what is the front (glTF 2.0, section 3.7.2.1). Normal maps are applied in
    /// mesh space and then taken to the world by the inverse transpose.
    pub fn surface(
        &self,
        pose: &Pose,
        instance: usize,
        triangle: usize,
        u: f32,
        v: f32,
    ) -> Surface {
        let placed = &self.instances[instance];
        let mesh = &self.meshes[placed.mesh];
        let corners = mesh.triangles[triangle].map(|v| v as usize);
        let material_index = mesh.materials.get(triangle).map_or(0, |m| *m as usize);
        let material = self.materials.get(material_index);

        // Where on a texture this is, if the mesh has the coordinates that it is read by.
        let read = |texture: Option<TextureRef>| {
            let texture = texture?;
            let uv = mesh.uv(&texture, triangle, u, v)?;
            Some((&self.textures[texture.texture], uv))
        };
        // The normal map's vector in tangent space.
        let bump = material
            .filter(|_| !mesh.tangents.is_empty())
            .and_then(|m| Some((read(m.normal_texture)?, m.normal_scale)))
            .map(|((texture, uv), scale)| {
                let n = texture.sample_linear(uv).truncate() * 2.0 - 1.0;
                Vec3::new(n.x * scale, n.y * scale, n.z)
            });

        let rest = Vertices {
            positions: &mesh.positions,
            normals: &mesh.normals,
            tangents: None,
        };
        let (rest_position, rest_normal, rest_geometric) = shade(mesh, &rest, corners, u, v, bump);
        let deformed = pose.deformed.get(instance).and_then(|d| d.as_ref());
        let (mesh_position, mesh_normal, mesh_geometric) = match deformed {
            Some(d) => {
                let posed = Vertices {
                    positions: &d.positions,
                    normals: &d.normals,
                    tangents: (!d.tangents.is_empty()).then_some(&d.tangents[..]),
                };
                shade(mesh, &posed, corners, u, v, bump)
            }
            None => (rest_position, rest_normal, rest_geometric),
        };

        let world_from_mesh = &pose.world_from_mesh[instance];
        let geometric_normal = normal_to_world(world_from_mesh, mesh_geometric);
        let normal = keep_above(
            normal_to_world(world_from_mesh, mesh_normal),
            geometric_normal,
        );
        let mut surface = Surface {
            position: world_from_mesh.transform_point3(mesh_position),
            geometric_normal,
            normal,
            mesh_position,
            mesh_normal,
            rest_position,
            rest_normal,
            base_color: Vec3::ONE,
            emissive: Vec3::ZERO,
            roughness: 1.0,
            metallic: 0.0,
            transmission: 0.0,
            unlit: false,
            material: material_index,
        };
        if let Some(material) = material {
            surface.base_color = material.base_color.truncate();
            if let Some((texture, uv)) = read(material.base_color_texture) {
                surface.base_color *= texture.sample_srgb(uv).truncate();
            }
            if let Some(color) = mesh.color(triangle, u, v) {
                surface.base_color *= color.truncate();
            }
            surface.emissive = self.emission(placed.mesh, triangle, u, v);
            surface.unlit = material.unlit;
            surface.roughness = material.roughness;
            surface.metallic = material.metallic;
            if let Some((texture, uv)) = read(material.metallic_roughness_texture) {
                let texel = texture.sample_linear(uv);
                surface.roughness *= texel.y;
                surface.metallic *= texel.z;
            }
            if let Some(factors) = &material.specular_glossiness {
                let texel = read(factors.texture).map(|(texture, uv)| texture.sample_srgb(uv));
                let texel = texel.unwrap_or(Vec4::ONE);
                let specular = factors.specular * texel.truncate();
                let (base, metallic) = specular::metallic(surface.base_color, specular);
                (surface.base_color, surface.metallic) = (base, metallic);
                surface.roughness = 1.0 - factors.glossiness * texel.w;
            }
            if material.transmission > 0.0 {
                let dielectric = 1.0 - surface.metallic.clamp(0.0, 1.0);
                surface.transmission = dielectric * self.transmission(placed.mesh, triangle, u, v);
            }
        }
        surface
    }
}

/// Takes a mesh-space normal to the world: inverse transpose, mirroring included. The result is the
/// outside of the triangle also where the instance is mirrored, which is where the corners of the
/// transformed triangle run clockwise.
pub fn normal_to_world(world_from_mesh: &Affine3A, normal: Vec3) -> Vec3 {
    let m = world_from_mesh.matrix3;
    // Small scales would underflow in the cofactors.
    let scale = [m.x_axis, m.y_axis, m.z_axis]
        .map(|axis| axis.abs().max_element())
        .into_iter()
        .fold(0.0, f32::max);
    if scale <= 0.0 {
        return normal;
    }
    let unit = m * (1.0 / scale);
    Vec3::from(normal_matrix(&unit) * Vec3A::from(normal))
        .try_normalize()
        .unwrap_or(normal)
}

/// Position, shading normal and geometric normal in the space of the vertices.
fn shade(
    mesh: &Mesh,
    vertices: &Vertices,
    corners: [usize; 3],
    u: f32,
    v: f32,
    bump: Option<Vec3>,
) -> (Vec3, Vec3, Vec3) {
    let positions = corners.map(|v| vertices.positions[v]);
    let position = interpolate(positions, u, v);
    let smooth = interpolate(corners.map(|v| vertices.normals[v]), u, v).try_normalize();
    let geometric = triangle_normal(positions).or(smooth).unwrap_or(Vec3::Y);
    let mut normal = smooth.unwrap_or(geometric);
    if normal.dot(geometric) < 0.0 {
        normal = -normal;
    }
    if let Some(bump) = bump {
        let tangent = match vertices.tangents {
            Some(tangents) => interpolate(corners.map(|v| tangents[v]), u, v),
            None => interpolate(corners.map(|v| mesh.tangents[v].truncate()), u, v),
        };
        let tangent = (tangent - normal * normal.dot(tangent)).try_normalize();
        if let Some(tangent) = tangent {
            let bitangent = normal.cross(tangent) * mesh.tangents[corners[0]].w;
            normal = (tangent * bump.x + bitangent * bump.y + normal * bump.z)
                .try_normalize()
                .unwrap_or(normal);
        }
    }
    (position, keep_above(normal, geometric), geometric)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Instance, Material, Node, Texture, normals};
    use glam::Vec2;
    use glam::{Mat3A, Quat};

    /// A unit square in the XY plane that faces +Z, u along +X, v along -Y as glTF has it, with a
    /// normal map of one texel.
    fn bumpy(texel: [u8; 3], scale: Vec3) -> Scene {
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let mut mesh = Mesh {
            positions: vec![
                corner(0.0, 0.0),
                corner(1.0, 0.0),
                corner(1.0, 1.0),
                corner(0.0, 1.0),
            ],
            normals: vec![Vec3::Z; 4],
            uvs: vec![vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![0; 2],
            ..Mesh::default()
        };
        normals::generate_tangents(&mut mesh, &0.into());
        Scene {
            meshes: vec![mesh],
            materials: vec![Material {
                normal_texture: Some(0.into()),
                ..Material::default()
            }],
            textures: vec![Texture {
                width: 1,
                height: 1,
                texels: [[texel[0], texel[1], texel[2], 255]].into(),
                ..Texture::default()
            }],
            nodes: vec![Node {
                name: String::new(),
                parent: None,
                translation: Vec3::ZERO,
                rotation: Quat::IDENTITY,
                scale,
                matrix: None,
                morph_weights: Vec::new(),
            }],
            instances: vec![Instance {
                node: Some(0),
                ..Instance::default()
            }],
            ..Scene::default()
        }
    }

    #[test]
    fn normal_maps_lean_to_the_right_and_up() {
        for (texel, expected) in [
            ([255, 128, 255], Vec3::new(1.0, 0.0, 1.0)),
            ([128, 255, 255], Vec3::new(0.0, 1.0, 1.0)),
            ([0, 128, 255], Vec3::new(-1.0, 0.0, 1.0)),
        ] {
            let scene = bumpy(texel, Vec3::ONE);
            let here = scene.surface(&scene.rest_pose(), 0, 0, 0.3, 0.3);
            assert!(
                here.normal.abs_diff_eq(expected.normalize(), 5e-3),
                "{texel:?} {}",
                here.normal
            );
            assert_eq!(here.geometric_normal, Vec3::Z);
            assert_eq!(here.rest_normal, here.mesh_normal);
        }
    }

    #[test]
    fn a_normal_map_cannot_turn_below_the_surface() {
        let scene = bumpy([255, 128, 0], Vec3::ONE);
        let here = scene.surface(&scene.rest_pose(), 0, 1, 0.3, 0.3);
        assert!(
            here.normal.z > 0.0 && here.normal.x > 0.9,
            "{}",
            here.normal
        );
    }

    #[test]
    fn mirrored_instances_mirror_their_bumps() {
        let scene = bumpy([255, 128, 255], Vec3::new(-1.0, 1.0, 1.0));
        let here = scene.surface(&scene.rest_pose(), 0, 0, 0.3, 0.3);
        let expected = Vec3::new(-1.0, 0.0, 1.0).normalize();
        assert!(here.normal.abs_diff_eq(expected, 5e-3), "{}", here.normal);
    }

    #[test]
    fn the_normal_matrix_is_the_inverse_transpose() {
        let m = Mat3A::from_cols(
            Vec3A::new(1.0, 0.3, -0.2),
            Vec3A::new(0.1, -2.0, 0.4),
            Vec3A::new(0.5, 0.2, 3.0),
        );
        let n = Vec3A::new(0.3, -0.5, 0.8);
        let expected = (m.inverse().transpose() * n).normalize();
        assert!(
            (normal_matrix(&m) * n)
                .normalize()
                .abs_diff_eq(expected, 1e-6)
        );
        let world = Affine3A::from_mat3((m * 1e-15).into());
        let tiny = normal_to_world(&world, n.into());
        assert!(tiny.abs_diff_eq(expected.into(), 1e-5), "{tiny}");
    }
}
