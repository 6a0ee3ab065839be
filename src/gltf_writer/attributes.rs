//! Values per vertex and per instance as attributes.

use super::document::Document;
use super::json::Json;
use super::{Target, Written, colors, occlusion};
use crate::bake::{Baked, InstanceSignals};
use crate::obscurance::Blend;
use crate::scene::GltfFile as File;
use crate::scene::{Mesh, Scene};
use serde_json::json;
use std::collections::BTreeMap;

/// The attribute: one number, or two where the bake has two signals. glTF leaves names that begin with
/// an underscore to applications.
pub const NAME: &str = "_AO";
/// Open: the value of vertices that belong to no triangle.
const OPEN: u8 = 255;
/// Bytes of an element: vertex attributes begin at multiples of four.
const STRIDE: usize = 4;
/// `ARRAY_BUFFER`.
pub(super) const VERTICES: u32 = 34962;
/// `UNSIGNED_BYTE`.
const U8: u32 = 5121;
/// Most names of meshes in a sentence.
const SHOWN: usize = 4;
const GPU_INSTANCING: &str = "EXT_mesh_gpu_instancing";
/// Its decoders may give vertices another order than the accessors have.
const DRACO: &str = "KHR_draco_mesh_compression";

/// How values are written.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub target: Target,
    /// Texels a side of an occlusion texture.
    pub texture_side: u32,
}

/// The copy of a file with the values of a bake of its scene.
///
/// # Errors
/// A sentence for a file that cannot be read.
pub fn write(
    file: &File,
    scene: &Scene,
    baked: &Baked,
    options: Options,
) -> std::result::Result<(Document, Written), String> {
    let document = Document::new(file)?;
    let mut writer = Writer {
        file,
        scene,
        baked,
        options,
        document,
        written: Written::default(),
        sampler: None,
        without_texture: BTreeMap::new(),
    };
    let mut of_mesh: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut of_node: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        let Some(place) = instance.file else {
            continue;
        };
        if place.number.is_some() {
            of_node.entry(place.node).or_default().push(i);
        } else if let Some(mesh) = &scene.meshes[instance.mesh].file {
            of_mesh.entry(mesh.mesh).or_default().push(i);
        }
    }
    let users = writer.users();
    for (mesh, instances) in of_mesh {
        let is_shared_with_others = users.get(&mesh).is_some_and(|n| *n > instances.len());
        writer.write_mesh(mesh, &instances, is_shared_with_others);
    }
    for (node, instances) in of_node {
        writer.write_gpu_instances(node, &instances);
    }
    for (reason, names) in &writer.without_texture {
        let (shown, more) = names.split_at(names.len().min(SHOWN));
        let more = match more.len() {
            0 => String::new(),
            n => format!(" and {n} more"),
        };
        writer.written.notes.push(format!(
            "the values of {}{more} are in {NAME}: {reason}",
            shown.join(", ")
        ));
    }
    Ok((writer.document, writer.written))
}

pub(super) struct Writer<'a, 'f> {
    pub file: &'a File<'f>,
    pub scene: &'a Scene,
    pub baked: &'a Baked,
    pub options: Options,
    pub document: Document,
    pub written: Written,
    /// The sampler of occlusion textures.
    pub sampler: Option<usize>,
    /// Names of meshes that got no occlusion texture, by the reason.
    without_texture: BTreeMap<String, Vec<String>>,
}

/// Primitives that share all attributes, and their values by vertex of the file.
pub(super) struct Group {
    pub primitives: Vec<usize>,
    attributes: String,
    /// Per vertex the sums of its signals and how many vertices of the scene they are of.
    sums: Vec<([u32; 2], u32)>,
    signals: usize,
}

impl Group {
    /// The signals of each vertex. A vertex that the scene has several times, as with flat normals, has
    /// their mean.
    pub fn values(&self) -> impl Iterator<Item = Vec<u8>> {
        self.sums.iter().map(|(sums, count)| {
            let mean = |sum: &u32| match count {
                0 => OPEN,
                _ => ((sum + count / 2) / count) as u8,
            };
            sums[..self.signals].iter().map(mean).collect()
        })
    }

    pub fn vertices(&self) -> usize {
        self.sums.len()
    }
}

impl Writer<'_, '_> {
    /// Nodes of the whole file that use each mesh.
    fn users(&mut self) -> BTreeMap<usize, usize> {
        let mut users = BTreeMap::new();
        for node in 0..self.document.count("nodes") {
            let node = self.document.element("nodes", node);
            if let Some(mesh) = node.and_then(|node| node.get("mesh")?.index()) {
                *users.entry(mesh).or_default() += 1;
            }
        }
        users
    }

    /// Writes the values of the instances of a mesh. Instances with equal values share a mesh; the first
    /// of them have the mesh that was there, unless nodes that were not baked use it.
    fn write_mesh(&mut self, mesh: usize, instances: &[usize], is_shared_with_others: bool) {
        let Some(original) = self.document.element("meshes", mesh).cloned() else {
            return;
        };
        let mut made: Vec<(usize, &InstanceSignals)> = Vec::new();
        let baked = self.baked;
        for &instance in instances {
            let signals = &baked.instances[instance];
            let known = made.iter().find(|(_, known)| *known == signals);
            let index = match known {
                Some((index, _)) => *index,
                None => {
                    let index = match made.is_empty() && !is_shared_with_others {
                        true => mesh,
                        false => {
                            self.written.copies += 1;
                            self.document.push("meshes", original.clone())
                        }
                    };
                    made.push((index, signals));
                    self.write_values(index, instance);
                    index
                }
            };
            if index != mesh
                && let Some(place) = self.scene.instances[instance].file
                && let Some(node) = self.document.element("nodes", place.node)
            {
                node.set("mesh", index);
            }
            self.written.instances += 1;
        }
    }

    /// Writes an instance's values into a mesh of the file.
    fn write_values(&mut self, index: usize, instance: usize) {
        let mesh = &self.scene.meshes[self.scene.instances[instance].mesh];
        if self.options.target == Target::Occlusion {
            match occlusion::write(self, index, instance) {
                Ok(()) => {
                    self.written.textures += 1;
                    return;
                }
                Err(reason) => {
                    let names = self.without_texture.entry(reason).or_default();
                    if names.last() != Some(&mesh.name) {
                        names.push(mesh.name.clone());
                    }
                }
            }
        }
        for group in self.groups(index, mesh, &self.baked.instances[instance]) {
            self.written.vertices += group.vertices();
            let values: Vec<Vec<u8>> = group.values().collect();
            let accessor = self.push_bytes(&values, Some(VERTICES));
            for &primitive in &group.primitives {
                self.set_attribute(index, primitive, NAME, accessor);
            }
            if self.options.target == Target::Color {
                colors::multiply(self, index, &group);
            }
        }
    }

    /// The primitives of a mesh of the file, grouped by their attributes, with an instance's values.
    fn groups(&mut self, index: usize, mesh: &Mesh, signals: &InstanceSignals) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        for part in mesh.file.iter().flat_map(|file| &file.primitives) {
            let Some(attributes) = self.attributes(index, part.primitive) else {
                continue;
            };
            if attributes.get(NAME).is_some() {
                self.written.replaced = true;
            }
            let Some(attributes) = self.attributes(index, part.primitive) else {
                continue;
            };
            let text = attributes.to_text();
            let position = attributes.get("POSITION").and_then(|p| p.index());
            let known = groups.iter().position(|group| group.attributes == text);
            let at = known.unwrap_or_else(|| {
                groups.push(Group {
                    primitives: Vec::new(),
                    attributes: text,
                    sums: vec![Default::default(); self.accessor_count(position)],
                    signals: signals.vertices.len().min(2),
                });
                groups.len() - 1
            });
            let group = &mut groups[at];
            group.primitives.push(part.primitive);
            for vertex in part.vertices.clone() {
                let of_file = mesh.file_vertices[vertex] as usize;
                let Some((sums, count)) = group.sums.get_mut(of_file) else {
                    continue;
                };
                *count += 1;
                for (sum, signal) in sums.iter_mut().zip(&signals.vertices) {
                    *sum += u32::from(signal[vertex]);
                }
            }
        }
        groups
    }

    fn accessor_count(&mut self, accessor: Option<usize>) -> usize {
        let accessor = accessor.and_then(|index| self.document.element("accessors", index));
        accessor.and_then(|a| a.get("count")?.index()).unwrap_or(0)
    }

    /// A primitive of a mesh of the file.
    pub fn primitive(&mut self, mesh: usize, primitive: usize) -> Option<&mut Json> {
        let mesh = self.document.element("meshes", mesh)?;
        mesh.get("primitives")?.item(primitive)
    }

    /// The attributes of a primitive.
    pub fn attributes(&mut self, mesh: usize, primitive: usize) -> Option<&mut Json> {
        self.primitive(mesh, primitive)?.get("attributes")
    }

    /// Sets an attribute of a primitive. Compression by Draco, beside which its vertices are also there
    /// uncompressed, is taken off: values go with the vertices of the accessors.
    pub fn set_attribute(&mut self, mesh: usize, primitive: usize, name: &str, accessor: usize) {
        let Some(primitive) = self.primitive(mesh, primitive) else {
            return;
        };
        if let Some(extensions) = primitive.get("extensions")
            && extensions.get(DRACO).is_some()
        {
            extensions.remove(DRACO);
            if extensions.members().is_some_and(|m| m.is_empty()) {
                primitive.remove("extensions");
            }
        }
        primitive
            .member("attributes", Json::object())
            .set(name, accessor);
    }

    /// An accessor of normalised bytes: one or two an element, each element at a multiple of four.
    fn push_bytes(&mut self, values: &[Vec<u8>], target: Option<u32>) -> usize {
        let mut bytes = Vec::with_capacity(values.len() * STRIDE);
        for value in values {
            bytes.extend_from_slice(value);
            bytes.resize(bytes.len().next_multiple_of(STRIDE), 0);
        }
        let two = values.first().is_some_and(|value| value.len() == 2);
        let mut properties = json!({"byteStride": STRIDE});
        if let Some(target) = target {
            properties["target"] = target.into();
        }
        let view = self.document.push_view(&bytes, properties);
        let accessor = json!({
            "bufferView": view,
            "componentType": U8,
            "normalized": true,
            "count": values.len(),
            "type": if two { "VEC2" } else { "SCALAR" },
        });
        self.document.push("accessors", accessor)
    }

    /// Writes the mean of each instance of a node as an attribute of `EXT_mesh_gpu_instancing`.
    fn write_gpu_instances(&mut self, node: usize, instances: &[usize]) {
        let baked = self.baked;
        let means = instances.iter().map(|i| baked.instances[*i].mean.clone());
        let means: Vec<Vec<u8>> = means.collect();
        let accessor = self.push_bytes(&means, None);
        let node = self.document.element("nodes", node);
        if let Some(extension) = node.and_then(|node| node.path(&["extensions", GPU_INSTANCING])) {
            extension
                .member("attributes", Json::object())
                .set(NAME, accessor);
            self.written.gpu_instances += instances.len();
        }
    }

    pub fn blend(&self) -> Blend {
        self.baked.blend
    }
}
