//! Files that were written are read again, by the reader of scenes and piece by piece.

use super::*;
use crate::bake::{Baked, InstanceSignals};
use crate::obscurance::Blend;
use crate::scene::{GltfFile, LoadOptions, Scene};
use serde_json::{Value, json};

/// What the tests' file has that this program does not understand.
const EXTRAS: &str = r#"{"note":"kept","number":1.10e-2,"list":[ 1 , 2 ]}"#;

/// A square of four vertices that three nodes use, of which the last is in another scene. It has colours
/// of 16 bits, texture coordinates, and things that nobody knows.
pub(super) fn square() -> (Value, Vec<u8>) {
    let mut data = Vec::new();
    for [x, z] in [[0.0f32, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]] {
        data.extend([x, 0.0, z].iter().flat_map(|f| f.to_le_bytes()));
    }
    data.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    for vertex in 0..4u16 {
        let color = [65535, 20000, 1000 * vertex, 77];
        data.extend(color.iter().flat_map(|c| c.to_le_bytes()));
    }
    for uv in [[0.0f32, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]] {
        data.extend(uv.iter().flat_map(|f| f.to_le_bytes()));
    }
    let extras: Value = serde_json::from_str(EXTRAS).expect("JSON");
    let document = json!({
        "asset": {"version": "2.0", "generator": "a test"},
        "extensionsUsed": ["EXT_nobody_knows"],
        "extensions": {"EXT_nobody_knows": {"mesh": 0, "extras": extras}},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}, {"nodes": [2]}],
        "nodes": [
            {"name": "low", "mesh": 0, "extras": {"id": 7}},
            {"name": "high", "mesh": 0, "translation": [0, 2, 0]},
            {"name": "elsewhere", "mesh": 0},
        ],
        "materials": [{"name": "stone", "extensions": {"EXT_nobody_knows": {"x": 1.5}}}],
        "meshes": [{"name": "square", "primitives": [{
            "attributes": {"POSITION": 0, "COLOR_0": 2, "TEXCOORD_0": 3},
            "indices": 1, "material": 0,
            "extensions": {"EXT_nobody_knows": [1, 2]},
        }], "extras": {"size": "1.0 m"}}],
        "buffers": [{"byteLength": data.len()}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
            {"buffer": 0, "byteOffset": 60, "byteLength": 32, "byteStride": 8},
            {"buffer": 0, "byteOffset": 92, "byteLength": 32},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4,
             "min": [0, 0, 0], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 6},
            {"bufferView": 2, "componentType": 5123, "type": "VEC3", "count": 4, "normalized": true},
            {"bufferView": 3, "componentType": 5126, "type": "VEC2", "count": 4},
        ],
    });
    (document, data)
}

pub(super) fn glb(document: &Value, data: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((28 + text.len() as u32 + data.len() as u32 + 12).to_le_bytes());
    let further: (&[u8], &[u8]) = (b"ODD ", b"1234");
    for (kind, content) in [(&b"JSON"[..], &text[..]), (b"BIN\0", data), further] {
        out.extend((content.len() as u32).to_le_bytes());
        out.extend_from_slice(kind);
        out.extend_from_slice(content);
    }
    out
}

fn load(bytes: &[u8]) -> Scene {
    Scene::from_bytes("a test", bytes, None).expect("a scene")
}

/// A bake in which every vertex of every instance has a value of its own.
fn baked(scene: &Scene, signals: usize) -> Baked {
    let mut next = 0u8;
    let mut value = || {
        next = next.wrapping_add(13);
        next
    };
    let instances = scene.instances.iter().map(|instance| {
        let count = scene.meshes[instance.mesh].positions.len();
        let vertices = (0..signals).map(|_| (0..count).map(|_| value()).collect());
        InstanceSignals {
            vertices: vertices.collect(),
            mean: (0..signals).map(|_| value()).collect(),
        }
    });
    Baked {
        instances: instances.collect(),
        blend: Blend::default(),
        ..Baked::default()
    }
}

fn written(bytes: &[u8], baked: &Baked, target: Target) -> (Document, Written) {
    let options = LoadOptions::default();
    let file = GltfFile::open(bytes, None, &options).expect("a file");
    let options = Options {
        target,
        texture_side: 32,
    };
    write(&file, &load(bytes), baked, options).expect("written")
}

/// The JSON of a file, and elements of its accessors.
struct Read<'a> {
    json: Value,
    file: GltfFile<'a>,
}

fn read<'a>(bytes: &'a [u8], options: &'a LoadOptions) -> Read<'a> {
    let file = GltfFile::open(bytes, None, options).expect("a file");
    let (text, _) = file.chunks().expect("chunks");
    let json = serde_json::from_str(&text).expect("JSON");
    Read { json, file }
}

impl Read<'_> {
    fn primitive(&self, node: usize, primitive: usize) -> &Value {
        let mesh = self.json["nodes"][node]["mesh"].as_u64().expect("a mesh");
        &self.json["meshes"][mesh as usize]["primitives"][primitive]
    }

    /// The bytes of an attribute of a node's primitive.
    fn attribute(&self, node: usize, primitive: usize, name: &str) -> Option<Vec<u8>> {
        let accessor = self.primitive(node, primitive)["attributes"][name].as_u64()?;
        let elements = self.file.elements(accessor as usize, name);
        Some(elements.expect("elements").bytes)
    }
}

/// What the writer may change is taken out of both files; the rest has to be equal.
pub(super) fn without_changes(json: &Value) -> Value {
    let mut json = json.clone();
    for array in ["accessors", "bufferViews", "buffers"] {
        json[array] = Value::Null;
    }
    for node in json["nodes"].as_array_mut().expect("nodes") {
        node["mesh"] = Value::Null;
    }
    let meshes = json["meshes"].as_array_mut().expect("meshes");
    meshes.truncate(1);
    for primitive in meshes[0]["primitives"].as_array_mut().expect("primitives") {
        let attributes = primitive["attributes"].as_object_mut().expect("attributes");
        attributes.retain(|name, _| name != NAME && name != "COLOR_0");
    }
    json
}

#[test]
fn values_are_read_back_and_the_rest_stays() {
    let (document, data) = square();
    let source = glb(&document, &data);
    let scene = load(&source);
    let options = LoadOptions::default();
    for signals in [1, 2] {
        let baked = baked(&scene, signals);
        let (out, report) = written(&source, &baked, Target::Attribute);
        let out = out.to_glb().expect("a file");
        assert_eq!((report.instances, report.copies), (2, 2));
        let again = load(&out);
        assert_eq!(again.meshes.len(), 2);
        for (instance, original) in again.instances.iter().zip(&scene.instances) {
            let (new, old) = (&again.meshes[instance.mesh], &scene.meshes[original.mesh]);
            assert_eq!(instance.name, original.name);
            assert_eq!(new.positions, old.positions);
            assert_eq!(new.triangles, old.triangles);
            assert_eq!(new.colors, old.colors);
        }
        let read = read(&out, &options);
        // Flat normals split the vertices of the two triangles; those on the diagonal have means.
        let corners = [vec![0, 3], vec![1], vec![2, 4], vec![5]];
        for (node, signals) in baked.instances.iter().enumerate() {
            let expected: Vec<u8> = corners
                .iter()
                .flat_map(|corners| {
                    signals.vertices.iter().map(|signal| {
                        let sum: u32 = corners.iter().map(|c| u32::from(signal[*c])).sum();
                        (f64::from(sum) / corners.len() as f64).round() as u8
                    })
                })
                .collect();
            assert_eq!(read.attribute(node, 0, NAME), Some(expected));
        }
        // The node of the other scene keeps the mesh that it had.
        assert_eq!(read.attribute(2, 0, NAME), None);
        assert_eq!(read.json["nodes"][2]["mesh"], 0);
        assert_eq!(without_changes(&read.json), without_changes(&document));
        let (text, blob) = read.file.chunks().expect("chunks");
        assert!(blob.expect("a chunk").starts_with(&data));
        assert!(text.contains("1.10e-2") || text.contains("0.011"));
        assert_eq!(read.file.further_chunks(), [(&b"ODD "[..], &b"1234"[..])]);
        for accessor in read.json["accessors"]
            .as_array()
            .expect("a list")
            .iter()
            .skip(4)
        {
            let view = accessor["bufferView"].as_u64().expect("a view") as usize;
            let view = &read.json["bufferViews"][view];
            assert_eq!(view["byteStride"], 4);
            assert_eq!(view["byteOffset"].as_u64().expect("an offset") % 4, 0);
        }
    }
}

#[test]
fn numbers_keep_their_digits() {
    let (document, data) = square();
    let text = document.to_string().replace("0.011", "1.10e-2");
    let text = text.replace(r#""x":1.5"#, r#""x":0.10000000000000000555"#);
    let uri = "data:;base64,".to_owned() + &crate::base64::encode(&data);
    let text = text.replace(
        &format!(r#"{{"byteLength":{}}}"#, data.len()),
        &format!(r#"{{"byteLength":{},"uri":"{uri}"}}"#, data.len()),
    );
    let scene = load(text.as_bytes());
    let (out, _) = written(text.as_bytes(), &baked(&scene, 1), Target::Attribute);
    let (out, buffer) = out.to_gltf("a b.bin");
    for kept in ["1.10e-2", "0.10000000000000000555", "a%20b.bin"] {
        assert!(out.contains(kept), "{kept}: {out}");
    }
    assert!(buffer.starts_with(&data));
}

#[test]
fn equal_instances_share_a_mesh() {
    let (mut document, data) = square();
    document["scenes"][0]["nodes"] = json!([0, 1, 2]);
    let source = glb(&document, &data);
    let scene = load(&source);
    let mut baked = baked(&scene, 1);
    baked.instances[2] = baked.instances[0].clone();
    let (out, report) = written(&source, &baked, Target::Attribute);
    assert_eq!((report.instances, report.copies), (3, 1));
    let out = out.to_glb().expect("a file");
    let options = LoadOptions::default();
    let read = read(&out, &options);
    let mesh = |node: usize| read.json["nodes"][node]["mesh"].as_u64();
    assert_eq!([mesh(0), mesh(1), mesh(2)], [Some(0), Some(1), Some(0)]);
    assert_eq!(
        read.json["meshes"][1]["extras"],
        document["meshes"][0]["extras"]
    );
}

#[test]
fn colors_are_multiplied_in_their_own_type() {
    let (mut document, data) = square();
    let options = LoadOptions::default();
    let color = |out: &[u8], node| read(out, &options).attribute(node, 0, "COLOR_0");
    let source = glb(&document, &data);
    let baked = baked(&load(&source), 1);
    let (out, _) = written(&source, &baked, Target::Color);
    let out = out.to_glb().expect("a file");
    let ao = read(&out, &options).attribute(0, 0, NAME).expect("values");
    let colors = color(&out, 0).expect("colours");
    for (vertex, ao) in ao.iter().enumerate() {
        let rgb = [65535, 20000, 1000 * vertex as u32];
        for (i, value) in rgb.into_iter().enumerate() {
            let at = 6 * vertex + 2 * i;
            let got = u16::from_le_bytes([colors[at], colors[at + 1]]);
            let expected = (f64::from(value) * f64::from(*ao) / 255.0).round();
            assert!((f64::from(got) - expected).abs() <= 1.0, "{got} {expected}");
        }
    }
    // Without colours there are some afterwards: gray, and opaque.
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    attributes
        .as_object_mut()
        .expect("attributes")
        .remove("COLOR_0");
    let source = glb(&document, &data);
    let (out, _) = written(&source, &baked, Target::Color);
    let out = out.to_glb().expect("a file");
    let expected: Vec<u8> = ao.iter().flat_map(|a| [*a, *a, *a, 255]).collect();
    assert_eq!(color(&out, 0), Some(expected));
}

#[test]
fn occlusion_textures_show_the_values() {
    let (document, data) = square();
    let source = glb(&document, &data);
    let scene = load(&source);
    let mut baked = baked(&scene, 1);
    for (instance, value) in baked.instances.iter_mut().zip([60, 200]) {
        instance.vertices[0].fill(value);
    }
    let (out, report) = written(&source, &baked, Target::Occlusion);
    assert_eq!(
        (report.textures, report.vertices),
        (2, 0),
        "{:?}",
        report.notes
    );
    let out = out.to_glb().expect("a file");
    let options = LoadOptions::default();
    let read = read(&out, &options);
    for (node, value) in [(0, 60), (1, 200)] {
        assert_eq!(read.attribute(node, 0, NAME), None);
        let material = read.primitive(node, 0)["material"].as_u64().expect("one") as usize;
        let material = &read.json["materials"][material];
        assert_eq!(material["name"], "stone");
        assert_eq!(
            material["extensions"],
            document["materials"][0]["extensions"]
        );
        let occlusion = &material["occlusionTexture"];
        assert_eq!(occlusion["texCoord"], 0);
        let texture = occlusion["index"].as_u64().expect("a texture") as usize;
        let image = read.json["textures"][texture]["source"]
            .as_u64()
            .expect("an image");
        let view = read.json["images"][image as usize]["bufferView"]
            .as_u64()
            .expect("a view");
        let view = &read.json["bufferViews"][view as usize];
        let start = view["byteOffset"].as_u64().expect("an offset") as usize;
        let (_, blob) = read.file.chunks().expect("chunks");
        let png = &blob.expect("a chunk")[start..];
        let png = &png[..view["byteLength"].as_u64().expect("a length") as usize];
        let picture = image::load_from_memory(png)
            .expect("a picture")
            .into_luma8();
        assert_eq!(picture.dimensions(), (32, 32));
        assert!(picture.pixels().all(|p| p.0 == [value]));
    }
}

#[test]
fn coordinates_that_do_not_fit_are_told() {
    let (document, data) = square();
    let uv = |corner: usize, uv: [f32; 2]| {
        let mut data = data.clone();
        let bytes: Vec<u8> = uv.iter().flat_map(|x| x.to_le_bytes()).collect();
        data[92 + 8 * corner..][..8].copy_from_slice(&bytes);
        data
    };
    let mut occupied = document.clone();
    occupied["materials"][0]["occlusionTexture"] = json!({"index": 0});
    let mut bare = document.clone();
    let attributes = &mut bare["meshes"][0]["primitives"][0]["attributes"];
    attributes
        .as_object_mut()
        .expect("attributes")
        .remove("TEXCOORD_0");
    for (document, data, reason) in [
        (&document, uv(3, [-0.5, 0.0]), "outside"),
        (&document, uv(3, [0.0, 0.0]), "no area"),
        (
            &document,
            [&data[..92], &[0; 16], &data[108..]].concat(),
            "no area",
        ),
        (&document, uv(1, [0.5, 0.0]), "overlap"),
        (&occupied, data.clone(), "already"),
        (&bare, data.clone(), "no texture coordinates"),
    ] {
        let source = glb(document, &data);
        let baked = baked(&load(&source), 1);
        let (_, report) = written(&source, &baked, Target::Occlusion);
        assert_eq!(report.textures, 0);
        assert_eq!(report.vertices, 8);
        assert!(
            report.notes[0].contains(reason),
            "{reason}: {:?}",
            report.notes
        );
        assert!(report.notes[0].contains("square"));
    }
}

#[test]
fn gpu_instances_have_one_value_each() {
    let (mut document, mut data) = square();
    let start = data.len();
    for x in 0..3 {
        data.extend(
            [x as f32 * 3.0, 0.0, 0.0]
                .iter()
                .flat_map(|f| f.to_le_bytes()),
        );
    }
    document["buffers"][0]["byteLength"] = data.len().into();
    let view = json!({"buffer": 0, "byteOffset": start, "byteLength": 36});
    document["bufferViews"]
        .as_array_mut()
        .expect("views")
        .push(view);
    let accessor = json!({"bufferView": 4, "componentType": 5126, "type": "VEC3", "count": 3});
    document["accessors"]
        .as_array_mut()
        .expect("accessors")
        .push(accessor);
    document["nodes"][1]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 4}, "extras": 1}});
    let source = glb(&document, &data);
    let scene = load(&source);
    assert_eq!(scene.instances.len(), 4);
    let baked = baked(&scene, 2);
    let (out, report) = written(&source, &baked, Target::Attribute);
    assert_eq!((report.instances, report.gpu_instances), (1, 3));
    let out = out.to_glb().expect("a file");
    let options = LoadOptions::default();
    let read = read(&out, &options);
    let extension = &read.json["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"];
    assert_eq!(extension["extras"], 1);
    let accessor = extension["attributes"][NAME].as_u64().expect("an accessor");
    let elements = read
        .file
        .elements(accessor as usize, NAME)
        .expect("elements");
    let expected: Vec<u8> = baked.instances[1..]
        .iter()
        .flat_map(|i| i.mean.clone())
        .collect();
    assert_eq!(elements.bytes, expected);
    // The node's mesh is shared with them, and stays.
    assert_eq!(read.attribute(1, 0, NAME), None);
    assert!(read.attribute(0, 0, NAME).is_some());
}

/// The values go with the uncompressed vertices, which decoders of Draco would not look at.
#[test]
fn draco_beside_plain_vertices_is_taken_off() {
    let (mut document, data) = square();
    document["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    document["meshes"][0]["primitives"][0]["extensions"] = json!({
        "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}},
        "EXT_nobody_knows": 1,
    });
    let source = glb(&document, &data);
    let (out, _) = written(&source, &baked(&load(&source), 1), Target::Attribute);
    let out = out.to_glb().expect("a file");
    let options = LoadOptions::default();
    let read = read(&out, &options);
    assert_eq!(
        read.primitive(0, 0)["extensions"],
        json!({"EXT_nobody_knows": 1})
    );
    assert!(
        read.primitive(2, 0)["extensions"]
            .get("KHR_draco_mesh_compression")
            .is_some()
    );
}

/// A file of which the first buffer has no data of its own: that of compressed views.
#[test]
fn new_data_has_a_buffer_of_its_own_where_the_first_has_no_data() {
    let (mut document, data) = square();
    let uri = "data:;base64,".to_owned() + &crate::base64::encode(&data);
    let fallback = json!({"EXT_meshopt_compression": {"fallback": true}});
    document["buffers"] = json!([
        {"byteLength": 8, "extensions": fallback},
        {"byteLength": data.len(), "uri": uri},
    ]);
    for view in document["bufferViews"].as_array_mut().expect("views") {
        view["buffer"] = 1.into();
    }
    let source = document.to_string();
    let scene = load(source.as_bytes());
    let (out, _) = written(source.as_bytes(), &baked(&scene, 1), Target::Attribute);
    let out = out.to_glb().expect("a file");
    let options = LoadOptions::default();
    let read = read(&out, &options);
    assert_eq!(read.json["buffers"][0], document["buffers"][0]);
    assert_eq!(read.json["buffers"][1], document["buffers"][1]);
    assert!(read.attribute(0, 0, NAME).is_some());
    assert_eq!(load(&out).instances.len(), 2);
}
