//! Scenes: meshes, instances, materials, cameras and lights, and what animation makes of them at a
//! given time. Metres, right-handed, Y up, counter-clockwise front faces, as in glTF 2.0.
//!
//! A [`Scene`] never changes after it was loaded. [`Scene::pose`] evaluates animation, skinning and
//! morphing at a time into a [`Pose`], which is all that tracing and rendering look at.

mod animation;
pub mod camera;
mod collapsed;
#[cfg(test)]
mod corpus_tests;
mod derived;
mod framing;
pub(crate) mod gltf;
mod hall;
pub mod light;
mod normals;
mod paths;
mod pose;
mod recentre;
mod size;
mod specular;
pub mod surface;
pub mod texture;

use std::ops::Range;
use std::sync::Arc;

use glam::{Affine2, Affine3A, DVec3, Mat4, Quat, Vec2, Vec3, Vec4};

pub use gltf::{Elements, File as GltfFile, STREAM_EXTENSION, uri_paths};
pub use size::length_scale;
pub use surface::Surface;

/// Everything that is loaded once.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// File stem or the built-in scene's name.
    pub name: String,
    pub meshes: Vec<Mesh>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub nodes: Vec<Node>,
    /// What is drawn. Indices into this list name an instance everywhere (tracks, hits, G-buffer).
    pub instances: Vec<Instance>,
    pub skins: Vec<Skin>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<Light>,
    /// All channels of the chosen animations; a scene plays them together.
    pub channels: Vec<Channel>,
    /// Length of the animation in seconds; 0 when nothing moves. Playback loops.
    pub duration: f32,
    /// World space counts from here, in the coordinates of the file: zero but for scenes that lie far
    /// from the file's origin.
    pub origin: DVec3,
    /// Degenerate triangles that were dropped, over all meshes (each mesh counted once).
    pub dropped_triangles: usize,
    /// What the file asked for and this crate does not honour, one sentence each.
    pub warnings: Vec<String>,
    /// Made from the above on first use; [`Scene::default`] gives an empty one.
    pub cache: derived::Cache,
}

/// A triangle mesh in its own space, in the rest pose.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub name: String,
    pub positions: Vec<Vec3>,
    /// Mesh space counts from here, in the coordinates of the file: zero but for meshes whose vertices
    /// lie far from the file's origin.
    pub origin: Vec3,
    /// Unit length, one per position (generated where the file has none).
    pub normals: Vec<Vec3>,
    /// Sets of texture coordinates by number. Each has one element per position, or is empty.
    pub uvs: Vec<Vec<Vec2>>,
    /// Linear RGBA in 0..=1 that multiplies the base colour, one per position, or empty.
    pub colors: Vec<Vec4>,
    /// Tangents (xyz, handedness w) for normal maps, one per position, or empty.
    pub tangents: Vec<Vec4>,
    /// Vertex indices; degenerate triangles have been dropped.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle, an index into [`Scene::materials`].
    pub materials: Vec<u32>,
    /// Four joints of the instance's skin per position, or empty.
    pub joints: Vec<[u16; 4]>,
    /// Weights of the four joints, sum 1, or empty.
    pub weights: Vec<Vec4>,
    pub morph_targets: Vec<MorphTarget>,
    /// Morph weights in rest, one per target.
    pub morph_weights: Vec<f32>,
    /// Degenerate triangles that were dropped when the mesh was made.
    pub dropped_triangles: usize,
    /// What `extras.foliage` of the mesh says, if it says something.
    pub foliage: Option<FoliageWord>,
    /// Which vertices of its file these are; `None` for built-in meshes.
    pub file: Option<FileMesh>,
    /// The vertex within its primitive of the file, one per position; empty for built-in meshes.
    /// Several positions may share one: flat normals split vertices.
    pub file_vertices: Vec<u32>,
}

/// Where a mesh comes from in its glTF file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileMesh {
    /// Index into the file's meshes.
    pub mesh: usize,
    /// The primitives of which something is left, in their order.
    pub primitives: Vec<FilePrimitive>,
}

/// The part of a mesh that comes from one primitive.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FilePrimitive {
    /// Index into the primitives of the file's mesh.
    pub primitive: usize,
    /// Its vertices, a range of [`Mesh::positions`].
    pub vertices: Range<usize>,
}

/// Where an instance comes from in its glTF file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FileInstance {
    /// Index into the file's nodes.
    pub node: usize,
    /// Its number among the node's instances (`EXT_mesh_gpu_instancing`).
    pub number: Option<usize>,
}

/// How a mesh attenuates rays, in the word of its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoliageWord {
    Shrub,
    Tree,
    /// It stops rays, whatever its material.
    None,
}

/// Displacements of one morph target.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    pub positions: Vec<Vec3>,
    /// Empty when the target moves no normals.
    pub normals: Vec<Vec3>,
}

/// How a material's alpha is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    #[default]
    Opaque,
    /// Texels with alpha below the cutoff are holes.
    Mask { cutoff: f32 },
    /// Blended: glass and the like. Holds no points and stops no ray.
    Blend,
}

/// Factors of `KHR_materials_pbrSpecularGlossiness`, whose diffuse colour is the base colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularGlossiness {
    /// Linear.
    pub specular: Vec3,
    pub glossiness: f32,
    /// sRGB specular colour, glossiness in alpha.
    pub texture: Option<TextureRef>,
}

/// Where a material reads a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// Index into [`Mesh::uvs`]. A mesh without that set is drawn without the texture.
    pub set: usize,
    /// Applied to the coordinates of the set (`KHR_texture_transform`).
    pub transform: Affine2,
}

impl From<usize> for TextureRef {
    /// A texture that is read by the first set as it is.
    fn from(texture: usize) -> Self {
        TextureRef {
            texture,
            set: 0,
            transform: Affine2::IDENTITY,
        }
    }
}

/// A glTF metallic-roughness material. A texture multiplies the factor of the same name.
#[derive(Clone, Debug)]
pub struct Material {
    pub name: String,
    /// Linear RGBA.
    pub base_color: Vec4,
    /// sRGB, alpha linear.
    pub base_color_texture: Option<TextureRef>,
    /// Linear; a direction in tangent space.
    pub normal_texture: Option<TextureRef>,
    pub normal_scale: f32,
    /// Linear radiance, emissive strength included.
    pub emissive: Vec3,
    /// sRGB.
    pub emissive_texture: Option<TextureRef>,
    pub roughness: f32,
    pub metallic: f32,
    /// Linear: roughness in green, metallic in blue.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// What metallic and roughness are made from where the material has it.
    pub specular_glossiness: Option<SpecularGlossiness>,
    pub alpha: Alpha,
    pub double_sided: bool,
    /// The base colour is shown as it is, and no other surface is lit by it.
    pub unlit: bool,
    /// Share of light that passes straight through, times the base colour
    /// (`KHR_materials_transmission` of a thin wall).
    pub transmission: f32,
    /// Linear, in red.
    pub transmission_texture: Option<TextureRef>,
    /// Transmits at least half: not drawn, holds no points and casts no occlusion, like BLEND.
    pub window: bool,
}

impl Material {
    /// Every texture of the material.
    pub fn textures(&self) -> impl Iterator<Item = TextureRef> {
        [
            self.base_color_texture,
            self.normal_texture,
            self.emissive_texture,
            self.metallic_roughness_texture,
            self.specular_glossiness.and_then(|s| s.texture),
            self.transmission_texture,
        ]
        .into_iter()
        .flatten()
    }

    /// Whether cameras and occlusion rays pass it everywhere: BLEND and windows.
    pub fn is_see_through(&self) -> bool {
        self.window || self.alpha == Alpha::Blend
    }
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            roughness: 1.0,
            metallic: 1.0,
            metallic_roughness_texture: None,
            specular_glossiness: None,
            alpha: Alpha::Opaque,
            double_sided: false,
            unlit: false,
            transmission: 0.0,
            transmission_texture: None,
            window: false,
        }
    }
}

/// An RGBA8 image with its wrap modes; texels as stored (sRGB for base colour, linear for normals).
#[derive(Clone, Debug, Default)]
pub struct Texture {
    pub width: u32,
    pub height: u32,
    /// Shared by textures that show one image.
    pub texels: Arc<[[u8; 4]]>,
    pub wrap_s: Wrap,
    pub wrap_t: Wrap,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Wrap {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// A node of the hierarchy. Parents stand before their children.
#[derive(Clone, Debug)]
pub struct Node {
    pub name: String,
    pub parent: Option<usize>,
    pub translation: Vec3,
    pub rotation: Quat,
    pub scale: Vec3,
    /// A matrix that is no translation-rotation-scale (glTF `matrix`); such a node is not animated.
    pub matrix: Option<Mat4>,
    /// Morph weights that override the mesh's.
    pub morph_weights: Vec<f32>,
}

/// One drawn mesh.
#[derive(Clone, Debug, Default)]
pub struct Instance {
    /// glTF node path, with `#k` appended for GPU instances; unique within the scene.
    pub name: String,
    pub mesh: usize,
    /// The node that places the instance. For a skinned instance it is the node *above* the skin's
    /// common root joint, and skinned vertices are expressed in that node's space: the skinned
    /// mesh's own node is ignored, as glTF asks, and a walker's grid walks with it.
    pub node: Option<usize>,
    /// Applied below the node (`EXT_mesh_gpu_instancing`), else identity.
    pub offset: Affine3A,
    pub skin: Option<usize>,
    /// The node whose morph weights apply: the one that holds the mesh in the file. It differs from
    /// `node` for skinned instances; `None` stands for `node`.
    pub morph_node: Option<usize>,
    /// `None` for built-in scenes.
    pub file: Option<FileInstance>,
}

#[derive(Clone, Debug)]
pub struct Skin {
    /// Nodes.
    pub joints: Vec<usize>,
    pub inverse_bind: Vec<Mat4>,
}

#[derive(Clone, Debug)]
pub struct Camera {
    pub name: String,
    pub node: Option<usize>,
    /// Vertical field of view in radians.
    pub yfov: f32,
    pub znear: f32,
    /// World from camera where there is no node.
    pub world_from_camera: Affine3A,
}

#[derive(Clone, Debug)]
pub struct Light {
    pub name: String,
    pub node: Option<usize>,
    pub kind: LightKind,
    /// Linear RGB times intensity: candela for point and spot lights, lux for directional ones.
    pub intensity: Vec3,
    /// Metres; infinity when unlimited.
    pub range: f32,
}

/// Lights shine along the node's -Z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    Directional,
    Point,
    /// Half angles in radians.
    Spot {
        inner: f32,
        outer: f32,
    },
}

/// One animated property of one node.
#[derive(Clone, Debug)]
pub struct Channel {
    pub node: usize,
    pub interpolation: Interpolation,
    pub times: Vec<f32>,
    pub values: ChannelValues,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Interpolation {
    Step,
    Linear,
    /// Three values a key: in-tangent, value, out-tangent.
    Cubic,
}

#[derive(Clone, Debug)]
pub enum ChannelValues {
    Translation(Vec<Vec3>),
    Rotation(Vec<Quat>),
    Scale(Vec<Vec3>),
    /// `targets` values a key.
    MorphWeights {
        targets: usize,
        values: Vec<f32>,
    },
}

/// The scene at one time.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// Seconds.
    pub time: f64,
    /// World from mesh space, one per instance.
    pub world_from_mesh: Vec<Affine3A>,
    /// Posed vertices in mesh space of instances that are skinned or morphed, else `None`.
    pub deformed: Vec<Option<Deformed>>,
    pub cameras: Vec<CameraPose>,
    pub lights: Vec<LightPose>,
}

impl Pose {
    /// Vertex positions of an instance in mesh space: deformed, or those of its mesh.
    pub fn shape<'a>(&'a self, scene: &'a Scene, instance: usize) -> &'a [Vec3] {
        match self.deformed.get(instance).and_then(Option::as_ref) {
            Some(deformed) => &deformed.positions,
            None => &scene.meshes[scene.instances[instance].mesh].positions,
        }
    }
}

/// Skinned or morphed vertices, in the order of the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Deformed {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// xyz only; handedness stays the mesh's. Empty when the mesh has none.
    pub tangents: Vec<Vec3>,
}

/// A pinhole camera: looks along -Z of its space, +Y up.
#[derive(Clone, Copy, Debug)]
pub struct CameraPose {
    /// Rigid.
    pub world_from_camera: Affine3A,
    /// Vertical field of view in radians.
    pub yfov: f32,
    pub znear: f32,
}

#[derive(Clone, Copy, Debug)]
pub struct LightPose {
    pub position: Vec3,
    /// Unit; where the light shines.
    pub direction: Vec3,
    pub kind: LightKind,
    pub intensity: Vec3,
    pub range: f32,
}

/// What is read of a file.
#[derive(Clone, Debug)]
pub struct LoadOptions {
    /// Whether colours are needed. Ambient occlusion is without: then the only images that are
    /// decoded are normal maps and those that make holes.
    pub colors: bool,
    /// The animation that plays, by name or number. Otherwise all play that drive different
    /// properties of nodes; of two that drive the same one, the first.
    pub animation: Option<String>,
    /// The glTF scene that is shown, by number or name; otherwise the file's default.
    pub scene: Option<String>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        LoadOptions {
            colors: true,
            animation: None,
            scene: None,
        }
    }
}

impl Scene {
    /// Loads a glTF 2.0 file (`.glb` or `.gltf`) with default options.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub fn load(path: &std::path::Path) -> crate::Result<Scene> {
        Self::load_with(path, &LoadOptions::default())
    }

    /// Loads a glTF 2.0 file (`.glb` or `.gltf`).
    ///
    /// Parts of the file that cannot be used are left out, each with a sentence in
    /// [`Scene::warnings`].
    ///
    /// # Errors
    /// [`crate::Error::Io`] for a file that cannot be read; [`crate::Error::Scene`] for one that is
    /// no glTF 2.0, that has nothing to draw, or that lacks what the options name.
    pub fn load_with(path: &std::path::Path, options: &LoadOptions) -> crate::Result<Scene> {
        gltf::load(path, options).map(Scene::placed)
    }

    /// The bytes of a glTF file, which may be given to [`Scene::from_bytes_with`].
    ///
    /// # Errors
    /// [`crate::Error::Io`] for a file that cannot be read; [`crate::Error::Scene`] for a folder, a
    /// device, or a file that is too large.
    pub fn read_file(path: &std::path::Path) -> crate::Result<Vec<u8>> {
        gltf::read_file(path)
    }

    /// Loads glTF 2.0 from memory with default options.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub fn from_bytes(
        name: &str,
        bytes: &[u8],
        folder: Option<&std::path::Path>,
    ) -> crate::Result<Scene> {
        Self::from_bytes_with(name, bytes, folder, &LoadOptions::default())
    }

    /// Loads glTF 2.0 from memory, binary or JSON. `folder` is where external buffers and images
    /// are looked up; without it they are left out.
    ///
    /// # Errors
    /// As [`Scene::load_with`].
    pub fn from_bytes_with(
        name: &str,
        bytes: &[u8],
        folder: Option<&std::path::Path>,
        options: &LoadOptions,
    ) -> crate::Result<Scene> {
        gltf::from_bytes(name, bytes, folder, options).map(Scene::placed)
    }

    /// What is done with every scene that was loaded, once its nodes are known.
    fn placed(self) -> Scene {
        let mut scene = self.recentred();
        scene.warnings.extend(scene.collapsed());
        scene
    }
}
