//! Files with faults in optional parts: the rest of them is read.

use super::tests::{
    Builder, F32, ONE_NODE, SQUARE, U8, U16, busy, from_bytes, scene, square, warned,
};
use crate::scene::{LoadOptions, Scene};
use ::gltf::json::Value;

/// A file of JSON alone with the square's data inside.
fn text(rest: &str) -> String {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    let letters = base64(&b.data, "");
    b.json(
        &format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{rest}"#
        ),
        &format!(r#","uri":"data:application/octet-stream;base64,{letters}""#),
    )
}

/// Base64, with `between` after every fourth letter.
pub(super) fn base64(bytes: &[u8], between: &str) -> String {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for group in bytes.chunks(3) {
        let at = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for i in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * i) & 63) as usize] as char;
            out.push(if i <= group.len() { letter } else { '=' });
        }
        out += between;
    }
    out
}

#[test]
fn json_is_read_as_the_schema_allows() {
    let plain = text(ONE_NODE);
    let loads = |bytes: &[u8]| {
        let scene = scene(bytes);
        assert_eq!(scene.meshes[0].triangles.len(), 2);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    };
    loads(plain.as_bytes());
    loads(format!("\u{feff}{plain}").as_bytes());
    loads(format!("\r\n {plain}\n\0\0").as_bytes());
    loads(plain.replace(r#""count":4"#, r#""count":4.0"#).as_bytes());
    loads(
        plain
            .replace(r#""mesh":0"#, r#""mesh":0e0,"skin":null,"extras":7"#)
            .as_bytes(),
    );
    for rest in [
        r#""nodes":[{"mesh":0}]"#,
        r#""nodes":[{"mesh":0}],"scenes":[]"#,
        r#""nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]"#,
        r#""nodes":[{"mesh":0}],"cameras":null,"extensions":{"KHR_lights_punctual":{}}"#,
        r#""nodes":[{"mesh":0}],"animations":[{"channels":[{"sampler":0,"target":{"path":"scale"}}],"samplers":[{"input":0,"output":0}]}]"#,
        r#""nodes":[{"mesh":0}],"animations":[{}],"skins":[],"textures":[{}],"images":[{}],"samplers":[{}]"#,
    ] {
        loads(text(rest).as_bytes());
    }
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    let letters = base64(&b.data, "\\n ");
    loads(
        b.json(
            &format!(r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{ONE_NODE}"#),
            &format!(r#","uri":"data:;base64,{letters}""#),
        )
        .as_bytes(),
    );
    // Padding of the JSON chunk with NUL.
    let mut glb = square(r#","mode":6"#, ONE_NODE);
    let end = glb
        .windows(8)
        .position(|w| &w[4..] == b"BIN\0")
        .expect("a chunk");
    for byte in glb[..end].iter_mut().rev().take_while(|b| **b == b' ') {
        *byte = 0;
    }
    loads(&glb);
}

#[test]
fn an_empty_default_scene_gives_way() {
    let s = warned(
        text(r#""nodes":[{"mesh":0}],"scenes":[{"name":"empty"},{"nodes":[0]}],"scene":0"#)
            .as_bytes(),
        "scene 0 (empty) has no nodes",
    );
    assert_eq!(s.instances.len(), 1);
}

/// A square under `primitive`, with `nodes`, beside a sound one.
fn beside(primitive: &str, rest: &str) -> Vec<u8> {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    b.accessor(&[0, 1, 9, 0, 1, 2], U8, "SCALAR", 6, "");
    let bytes =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let nan = f32::NAN;
    let normals = [0.0, 0.0, 1.0, nan, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    b.accessor(&bytes(&normals), F32, "VEC3", 4, "");
    let uvs = [0.0, 1.0, 1.0, 1.0, nan, 0.0, 0.0, 0.0];
    b.accessor(&bytes(&uvs), F32, "VEC2", 4, "");
    b.accessor(&bytes(&[f32::INFINITY; 16]), F32, "VEC4", 4, "");
    b.accessor(&bytes(&[nan; 12]), F32, "VEC3", 4, "");
    b.accessor(&[0; 16], U8, "VEC4", 4, "");
    b.accessor(
        &bytes(&[1.0, -1e-7, 0.0, 0.0].repeat(4)),
        F32,
        "VEC4",
        4,
        "",
    );
    b.accessor(&bytes(&[1.0, -0.5, 0.0, 0.0].repeat(4)), F32, "VEC4", 4, "");
    b.accessor(&[9, 0, 9, 0].repeat(8), U16, "VEC4", 4, "");
    b.glb(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}},
        {{"name":"b","primitives":[{primitive}]}}],{rest}"#
    ))
}

const TWO_NODES: &str = r#""nodes":[{"mesh":0},{"mesh":1}]"#;

#[test]
fn a_bad_part_of_a_primitive_is_left_out() {
    let with = |attributes: &str, more: &str| {
        format!(r#"{{"attributes":{{"POSITION":0{attributes}}},"mode":6{more}}}"#)
    };
    for (primitive, expected, triangles) in [
        (
            with(r#","NORMAL":2"#, ""),
            "NORMAL of primitive 0 of mesh b holds numbers",
            2,
        ),
        (with(r#","NORMAL":1"#, ""), "NORMAL of primitive 0", 2),
        (with(r#","NORMAL":99"#, ""), "accessor 99", 2),
        (with(r#","TANGENT":4"#, ""), "TANGENT of primitive 0", 2),
        (with(r#","COLOR_0":4"#, ""), "COLOR_0 of primitive 0", 2),
        (with(r#","COLOR_0":1"#, ""), "COLOR_0 of primitive 0", 2),
        (
            with(r#","JOINTS_0":6,"WEIGHTS_0":8"#, ""),
            "negative weights",
            2,
        ),
        (
            with(r#","JOINTS_0":7,"WEIGHTS_0":7"#, ""),
            "JOINTS_0 of primitive 0",
            2,
        ),
        (
            with("", r#","targets":[{"POSITION":5}]"#),
            "morph target 0",
            2,
        ),
        (
            with("", r#","targets":[{"POSITION":1}]"#),
            "morph target 0",
            2,
        ),
        (
            with("", r#","material":3"#),
            "the material of primitive 0",
            2,
        ),
        (
            with("", r#","material":-1"#),
            "material of primitive 0 of mesh 1",
            2,
        ),
        (
            with("", r#","indices":1"#).replace("6", "4"),
            "1 of 2 triangles",
            1,
        ),
        (with("", r#","indices":77"#), "accessor 77", 0),
        (with("", "").replace(":6", ":1"), "points or lines", 0),
        (with("", "").replace(":6", ":99"), "unknown mode", 0),
        (
            r#"{"attributes":{"NORMAL":0}}"#.to_owned(),
            "no positions",
            0,
        ),
        (
            r#"{"attributes":{"POSITION":5},"mode":6}"#.to_owned(),
            "not finite",
            0,
        ),
    ] {
        let s = warned(&beside(&primitive, TWO_NODES), expected);
        let all: usize = s.meshes.iter().map(|m| m.triangles.len()).sum();
        assert_eq!(all, 2 + triangles, "{primitive}");
        s.rest_pose();
    }
    // What rounding makes of a weight of 0 is worth no word.
    let s = scene(&beside(
        &with(r#","JOINTS_0":6,"WEIGHTS_0":7"#, ""),
        TWO_NODES,
    ));
    assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    assert_eq!(s.meshes[1].weights[0], glam::Vec4::X);
}

#[test]
fn bad_coordinates_are_said_also_without_a_texture() {
    let primitive = r#"{"attributes":{"POSITION":0,"TEXCOORD_0":3},"mode":6}"#;
    warned(&beside(primitive, TWO_NODES), "TEXCOORD_0 of primitive 0");
}

#[test]
fn a_bad_node_camera_light_or_skin_is_left_out() {
    let primitive = r#"{"attributes":{"POSITION":0,"JOINTS_0":6,"WEIGHTS_0":7},"mode":6}"#;
    for (rest, expected) in [
        (r#""nodes":[{"mesh":0},{"mesh":5}]"#, "mesh 5"),
        (r#""nodes":[{"mesh":0},{"mesh":1,"skin":0}]"#, "skin 0"),
        (
            r#""nodes":[{"mesh":0},{"mesh":1,"skin":0}],"skins":[{}]"#,
            "skin 0",
        ),
        (
            r#""nodes":[{"mesh":0},{"mesh":0,"skin":0}],"skins":[{"joints":[0]}]"#,
            "no joints",
        ),
        (
            r#""nodes":[{"mesh":0},{"children":[2]},{"children":[1]}]"#,
            "its own ancestor",
        ),
        (
            r#""nodes":[{"mesh":0},{"children":[3]},{"children":[3]},{}]"#,
            "two parents",
        ),
        (r#""nodes":[{"mesh":0,"children":[7]}]"#, "node 7"),
        (
            r#""nodes":[{"mesh":0,"children":[-7]}]"#,
            "children of node 0",
        ),
        (
            r#""nodes":[{"mesh":0,"mesh_":1,"skin":"x"}]"#,
            "skin of node 0",
        ),
        (
            r#""nodes":[{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,1,0,0,0,1]}]"#,
            "not affine",
        ),
        (
            r#""nodes":[{"mesh":0,"scale":[1e39,1,1]}]"#,
            "scale of node 0",
        ),
        (r#""nodes":[{"mesh":0,"scale":[1,1]}]"#, "scale of node 0"),
        (
            r#""nodes":[{"mesh":0,"camera":0}],"cameras":[{"type":"perspective","perspective":{"yfov":0,"znear":1}}]"#,
            "field of view",
        ),
        (
            r#""nodes":[{"mesh":0,"camera":0}],"cameras":[{"type":"orthographic"}]"#,
            "not a perspective",
        ),
        (r#""nodes":[{"mesh":0,"camera":4}]"#, "camera 4"),
        (
            r#""nodes":[{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"area"}]}}"#,
            "unknown type",
        ),
        (
            r#""nodes":[{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":8}}}],"extensions":{"KHR_lights_punctual":{"lights":[]}}"#,
            "light 8",
        ),
        (
            r#""nodes":[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"SCALE":2}}}}]"#,
            "GPU instances",
        ),
        (
            r#""nodes":[{"mesh":0}],"animations":[{"channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}],"samplers":[{"input":0,"output":0}]}]"#,
            "channel 0 of animation 0",
        ),
        (
            r#""nodes":[{"mesh":0}],"animations":[{"channels":[{"sampler":3,"target":{"node":0,"path":"scale"}}],"samplers":[]}]"#,
            "channel 0 of animation 0",
        ),
        (
            r#""nodes":[{"mesh":0}],"materials":[{"alphaMode":"FADE"}]"#,
            "alpha mode",
        ),
        (
            r#""nodes":[{"mesh":0}],"materials":[{"emissiveFactor":[1e39,0,0]}]"#,
            "factor of material",
        ),
        (
            r#""nodes":[{"mesh":0}],"materials":[{"pbrMetallicRoughness":{"metallicFactor":"1"}}]"#,
            "metallicFactor of material 0",
        ),
        (
            r#""nodes":[{"mesh":0}],"scene":9,"scenes":[{"nodes":[0]}]"#,
            "scene 9",
        ),
        (
            r#""nodes":[{"mesh":0}],"extensionsUsed":["ACME_glow"]"#,
            "ACME_glow has no effect",
        ),
    ] {
        let s = warned(&beside(primitive, rest), expected);
        s.pose(0.5);
    }
}

#[test]
fn a_skin_on_some_primitives_moves_the_others_with_its_first_joint() {
    let primitives = r#"{"attributes":{"POSITION":0,"JOINTS_0":6,"WEIGHTS_0":7},"mode":6},{"attributes":{"POSITION":0},"mode":6}"#;
    let rest = r#""nodes":[{"mesh":1,"skin":0},{"translation":[0,0,5]}],"skins":[{"joints":[1]}]"#;
    let s = warned(&beside(primitives, rest), "having joints or not");
    let (min, max) = s.bounds(&s.rest_pose()).expect("triangles");
    assert_eq!((min.z, max.z), (5.0, 5.0));
}

#[test]
fn stride_0_is_tightly_packed() {
    let glb = square(r#","mode":6"#, ONE_NODE);
    let text = String::from_utf8_lossy(&glb).into_owned();
    assert!(text.contains(r#""byteLength":48}"#));
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    b.views[0] = b.views[0].replace('}', r#","byteStride":0}"#);
    let s = warned(
        &b.glb(&format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{ONE_NODE}"#
        )),
        "stride of 0",
    );
    assert_eq!(s.meshes[0].triangles.len(), 2);
}

#[test]
fn draco_is_named_with_the_command_that_converts() {
    let draco = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_draco_mesh_compression"],"accessors":[{"componentType":5126,"type":"VEC3","count":4}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":6,"extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}}]}],"nodes":[{"mesh":0}]}"#;
    for text in [
        draco.to_owned(),
        draco.replace("extensionsUsed", "extensionsRequired"),
    ] {
        let error = from_bytes(text.as_bytes())
            .expect_err("compressed")
            .to_string();
        assert!(error.contains("KHR_draco_mesh_compression"), "{error}");
        assert!(error.contains("npx @gltf-transform/cli copy"), "{error}");
    }
}

/// Calls back with copies of a document in which one value is another.
fn each_mutation(root: &Value, each: &mut impl FnMut(&Value)) {
    fn paths(value: &Value, at: String, out: &mut Vec<String>) {
        match value {
            Value::Object(fields) => {
                for (key, value) in fields {
                    paths(value, format!("{at}/{key}"), out);
                }
            }
            Value::Array(items) => {
                for (i, value) in items.iter().enumerate() {
                    paths(value, format!("{at}/{i}"), out);
                }
            }
            _ => {}
        }
        out.push(at);
    }
    let mut all = Vec::new();
    paths(root, String::new(), &mut all);
    for path in all {
        for other in [
            "null",
            "-1",
            "1.5",
            "4294967295",
            "1e30",
            "\"x\"",
            "[]",
            "{}",
            "[-1]",
            "true",
        ] {
            let mut changed = root.clone();
            if let Some(slot) = changed.pointer_mut(&path) {
                *slot = ::gltf::json::deserialize::from_str(other).expect("JSON");
                each(&changed);
            }
        }
    }
}

#[test]
fn any_field_may_be_anything() {
    let glb = busy();
    let length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    let json = String::from_utf8_lossy(&glb[20..20 + length]).into_owned();
    let data = base64(&glb[28 + length..], "");
    let mut root: Value = ::gltf::json::deserialize::from_str(json.trim_end()).expect("JSON");
    root["buffers"][0]["uri"] = Value::from(format!("data:;base64,{data}"));
    let (mut read, mut refused) = (0, 0);
    each_mutation(
        &root,
        &mut |changed| match from_bytes(changed.to_string().as_bytes()) {
            Ok(scene) => {
                read += 1;
                let pose = scene.pose(0.3);
                for (i, instance) in scene.instances.iter().enumerate() {
                    for t in 0..scene.meshes[instance.mesh].triangles.len() {
                        scene.surface(&pose, i, t, 0.2, 0.2);
                        scene.alpha_is_hole(instance.mesh, t, 0.2, 0.2);
                    }
                }
            }
            Err(e) => {
                refused += 1;
                assert!(!e.to_string().contains('\n'), "{e}");
            }
        },
    );
    // What the only mesh and its buffer need is refused, all else is read.
    assert!(read > 4 * refused, "{read} read, {refused} refused");
}

fn chosen(bytes: &[u8], animation: Option<&str>, scene: Option<&str>) -> Result<Scene, String> {
    let options = LoadOptions {
        animation: animation.map(str::to_owned),
        scene: scene.map(str::to_owned),
        ..LoadOptions::default()
    };
    super::from_bytes("test", bytes, None, &options).map_err(|e| e.to_string())
}

/// The animations move node 0 along x, node 0 along y, and node 1.
fn three_clips() -> Vec<u8> {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    let times = b.scalars(&[0.0, 1.0]);
    let x = b.vec3(&[[0.0; 3], [1.0, 0.0, 0.0]]);
    let y = b.vec3(&[[0.0; 3], [0.0, 1.0, 0.0]]);
    let clip = |name: &str, node: usize, output: usize| {
        format!(
            r#"{{"name":"{name}","samplers":[{{"input":{times},"output":{output}}}],"channels":[{{"sampler":0,"target":{{"node":{node},"path":"translation"}}}}]}}"#
        )
    };
    let clips = [clip("walk", 0, x), clip("jump", 0, y), clip("wave", 1, y)].join(",");
    b.glb(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],"nodes":[{{"mesh":0}},{{"mesh":0}}],"animations":[{clips}]"#
    ))
}

#[test]
fn of_overlapping_animations_one_plays() {
    let bytes = three_clips();
    let at = |s: &Scene, node: usize| s.pose(0.999).world_from_mesh[node].translation;
    let s = warned(&bytes, "walk, wave plays, jump does not");
    assert!(at(&s, 0).x > 0.9 && at(&s, 0).y == 0.0 && at(&s, 1).y > 0.9);
    for name in ["jump", "1"] {
        let s = chosen(&bytes, Some(name), None).expect("a clip");
        assert!(at(&s, 0).x == 0.0 && at(&s, 0).y > 0.9 && at(&s, 1).y == 0.0);
        assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    }
    let error = chosen(&bytes, Some("run"), None).expect_err("no such clip");
    assert!(
        error.contains("no animation run; it has walk, jump, wave"),
        "{error}"
    );
}

#[test]
fn scenes_are_chosen_by_number_or_name() {
    let bytes = square(
        r#","mode":6"#,
        r#""nodes":[{"mesh":0,"name":"a"},{"mesh":0,"name":"b"}],"scenes":[{"nodes":[0]},{"name":"attic","nodes":[1]}]"#,
    );
    assert_eq!(
        warned(&bytes, "scene 0 of 2 was taken").instances[0].name,
        "a"
    );
    for name in ["1", "attic"] {
        let s = chosen(&bytes, None, Some(name)).expect("a scene");
        assert_eq!((s.instances.len(), s.instances[0].name.as_str()), (1, "b"));
        assert!(s.warnings.is_empty(), "{:?}", s.warnings);
    }
    let error = chosen(&bytes, None, Some("cellar")).expect_err("no such scene");
    assert!(
        error.contains("no scene cellar; it has scene 0, attic"),
        "{error}"
    );
}

/// A file with one image in `count` textures, one of them a normal map.
fn one_image(count: usize, image: &str, colors: bool) -> Scene {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    let uvs: Vec<u8> = [0.0f32; 8].iter().flat_map(|v| v.to_le_bytes()).collect();
    b.accessor(&uvs, F32, "VEC2", 4, "");
    let mut png = Vec::new();
    let encoder = ::image::codecs::png::PngEncoder::new(&mut png);
    let kind = ::image::ExtendedColorType::Rgba8;
    ::image::ImageEncoder::write_image(encoder, &[9; 16], 2, 2, kind).expect("a PNG");
    let view = b.view(&png);
    let textures = vec![r#"{"source":0}"#; count].join(",");
    let materials: Vec<String> = (0..count)
        .map(|i| match i {
            0 => r#"{"normalTexture":{"index":0}}"#.to_owned(),
            i => format!(
                r#"{{"pbrMetallicRoughness":{{"metallicRoughnessTexture":{{"index":{i}}}}}}}"#
            ),
        })
        .collect();
    let image = image.replace("VIEW", &view.to_string());
    let bytes = b.glb(&format!(
        r#""images":[{image}],"textures":[{textures}],"materials":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"mode":6,"material":0}}]}}],{ONE_NODE}"#,
        materials.join(",")
    ));
    let options = LoadOptions {
        colors,
        ..LoadOptions::default()
    };
    super::from_bytes("test", &bytes, None, &options).expect("a scene")
}

#[test]
fn textures_of_one_image_share_its_texels() {
    let all = one_image(5, r#"{"bufferView":VIEW}"#, true);
    assert_eq!(all.textures.len(), 5);
    for texture in &all.textures {
        assert!(std::sync::Arc::ptr_eq(
            &texture.texels,
            &all.textures[0].texels
        ));
    }
    let few = one_image(5, r#"{"bufferView":VIEW}"#, false);
    assert_eq!(few.textures.len(), 1);
    assert!(few.warnings.is_empty(), "{:?}", few.warnings);
    for colors in [true, false] {
        let none = one_image(5, r#"{"uri":"gone.png"}"#, colors);
        assert_eq!((none.textures.len(), none.warnings.len()), (0, 1));
    }
}
