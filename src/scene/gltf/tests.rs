//! Files built here, sound and broken.

use crate::scene::{FoliageWord, Pose, Scene};
use glam::{Quat, Vec3};

/// Builds a GLB: binary data with its accessors, and the rest of the JSON as text.
#[derive(Default)]
pub(super) struct Builder {
    pub(super) data: Vec<u8>,
    pub(super) views: Vec<String>,
    accessors: Vec<String>,
    /// Buffers after the first, each after a comma.
    pub(super) more_buffers: String,
}

pub(super) const F32: u32 = 5126;
pub(super) const U8: u32 = 5121;
pub(super) const I8: u32 = 5120;
pub(super) const I16: u32 = 5122;
pub(super) const U16: u32 = 5123;
pub(super) const U32: u32 = 5125;

impl Builder {
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.data.len().is_multiple_of(4) {
            self.data.push(0);
        }
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
            self.data.len(),
            bytes.len()
        ));
        self.data.extend_from_slice(bytes);
        self.views.len() - 1
    }

    pub(super) fn accessor(
        &mut self,
        bytes: &[u8],
        component: u32,
        kind: &str,
        count: usize,
        more: &str,
    ) -> usize {
        let view = self.view(bytes);
        self.accessor_of(view, component, kind, count, more)
    }

    /// An accessor of a view that is there already.
    pub(super) fn accessor_of(
        &mut self,
        view: usize,
        component: u32,
        kind: &str,
        count: usize,
        more: &str,
    ) -> usize {
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"type":"{kind}","count":{count}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    pub(super) fn vec3(&mut self, values: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = values
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        self.accessor(&bytes, F32, "VEC3", values.len(), "")
    }

    pub(super) fn scalars(&mut self, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, F32, "SCALAR", values.len(), "")
    }

    pub(super) fn json(&self, rest: &str, uri: &str) -> String {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}{uri}}}{}],"bufferViews":[{}],"accessors":[{}],{rest}}}"#,
            self.data.len(),
            self.more_buffers,
            self.views.join(","),
            self.accessors.join(",")
        )
    }

    pub(super) fn glb(&self, rest: &str) -> Vec<u8> {
        glb(&self.json(rest, ""), &self.data)
    }
}

/// A binary file of JSON and data.
pub(super) fn glb(json: &str, data: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut data = data.to_vec();
    data.resize(data.len().next_multiple_of(4), 0);
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((28 + json.len() as u32 + data.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", data)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

pub(super) const SQUARE: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];
pub(super) const ONE_NODE: &str = r#""nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0"#;

pub(super) fn scene(bytes: &[u8]) -> Scene {
    from_bytes(bytes).expect("a sound file")
}

pub(super) fn from_bytes(bytes: &[u8]) -> crate::Result<Scene> {
    Scene::from_bytes("test", bytes, None)
}

/// A scene that was read with one warning, which has the given text in it.
pub(super) fn warned(bytes: &[u8], expected: &str) -> Scene {
    let scene = from_bytes(bytes).unwrap_or_else(|e| panic!("{expected}: {e}"));
    match &scene.warnings[..] {
        [warning] => assert!(warning.contains(expected), "{expected}: {warning}"),
        warnings => panic!("{expected}: {warnings:?}"),
    }
    scene
}

pub(super) fn error(bytes: &[u8]) -> String {
    match from_bytes(bytes) {
        Ok(_) => panic!("a broken file was read"),
        Err(e) => e.to_string(),
    }
}

/// A square with the given primitive text; `POSITION` is accessor 0.
pub(super) fn square(primitive: &str, nodes: &str) -> Vec<u8> {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    b.accessor(&[0, 1, 2, 0, 2, 3], U8, "SCALAR", 6, "");
    let indices16: Vec<u8> = [0u16, 1, 3, 2]
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect();
    b.accessor(&indices16, U16, "SCALAR", 4, "");
    let indices32: Vec<u8> = [0u32, 1, 2, 3]
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect();
    b.accessor(&indices32, U32, "SCALAR", 4, "");
    b.accessor(&[0, 1, 9], U8, "SCALAR", 3, "");
    b.glb(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}{primitive}}}]}}],{nodes}"#
    ))
}

pub(super) fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let mut corners = Vec::new();
    scene.for_each_triangle(&scene.rest_pose(), |t| corners.push(t));
    corners
}

#[test]
fn lists_strips_and_fans_of_all_index_types() {
    let list = scene(&square(r#","indices":1"#, ONE_NODE));
    let strip = scene(&square(r#","indices":2,"mode":5"#, ONE_NODE));
    let fan = scene(&square(r#","indices":3,"mode":6"#, ONE_NODE));
    let fan_without = scene(&square(r#","mode":6"#, ONE_NODE));
    for s in [&list, &strip, &fan, &fan_without] {
        let corners = corners(s);
        assert_eq!(corners.len(), 2);
        let area: f32 = corners
            .iter()
            .map(|[a, b, c]| (b - a).cross(c - a).z * 0.5)
            .sum();
        assert_eq!(area, 1.0);
        assert!(s.meshes[0].normals.iter().all(|n| *n == Vec3::Z));
        assert!(
            corners
                .iter()
                .all(|[a, b, c]| (*b - *a).cross(*c - *a).z > 0.0)
        );
    }
    // Without indices a list takes the vertices as they come: one triangle, the rest is left over.
    assert_eq!(corners(&scene(&square("", ONE_NODE))).len(), 1);
}

#[test]
fn extras_of_meshes_name_foliage() {
    let file = |extras: &str| {
        let mut b = Builder::default();
        b.vec3(&SQUARE);
        b.glb(&format!(
            r#""meshes":[{{"extras":{extras},"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{ONE_NODE}"#
        ))
    };
    for (extras, expected) in [
        (r#"{"foliage":"shrub"}"#, Some(FoliageWord::Shrub)),
        (r#"{"foliage":"tree","lod":2.0}"#, Some(FoliageWord::Tree)),
        (r#"{"foliage":"none"}"#, Some(FoliageWord::None)),
        (r#"{"foliage":null}"#, None),
        (r#"{"leaves":"tree"}"#, None),
        ("[1, 2]", None),
    ] {
        let scene = scene(&file(extras));
        assert_eq!(scene.meshes[0].foliage, expected, "{extras}");
        assert!(scene.warnings.is_empty(), "{extras}");
    }
    for extras in [r#"{"foliage":"grass"}"#, r#"{"foliage":1}"#] {
        let scene = warned(&file(extras), "extras.foliage of mesh");
        assert_eq!(scene.meshes[0].foliage, None);
    }
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut b = Builder::default();
    let values: Vec<u8> = [0.0f32, 5.0, 0.0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let (indices, values) = (b.view(&[3]), b.view(&values));
    let base: Vec<u8> = SQUARE
        .iter()
        .flatten()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let sparse = format!(
        r#","sparse":{{"count":1,"indices":{{"bufferView":{indices},"componentType":5121}},"values":{{"bufferView":{values}}}}}"#
    );
    b.accessor(&base, F32, "VEC3", 4, &sparse);
    let rest = format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{ONE_NODE}"#
    );
    let s = scene(&b.glb(&rest));
    assert_eq!(corners(&s)[1].iter().map(|p| p.y).fold(0.0, f32::max), 5.0);
}

#[test]
fn transforms_and_normals_under_mirroring() {
    let nodes = r#""nodes":[{"children":[1],"translation":[0,0,7]},
        {"mesh":0,"scale":[-2,3,1],"rotation":[0,0.70710678,0,0.70710678]}],"scenes":[{"nodes":[0]}]"#;
    let s = scene(&square(r#","indices":1"#, nodes));
    let pose = s.rest_pose();
    let here = s.surface(&pose, 0, 0, 0.5, 0.25);
    // Mesh point (0.75, 0.25, 0): scaled to (-1.5, 0.75, 0), turned by 90 degrees about Y to
    // (0, 0.75, 1.5), moved to z + 7. The normal +Z turns to +X; mirroring along X leaves it.
    assert!(
        here.position.abs_diff_eq(Vec3::new(0.0, 0.75, 8.5), 1e-5),
        "{here:?}"
    );
    assert!(here.geometric_normal.abs_diff_eq(Vec3::X, 1e-6), "{here:?}");
    assert!(here.normal.abs_diff_eq(Vec3::X, 1e-6));
    assert_eq!(here.mesh_position, Vec3::new(0.75, 0.25, 0.0));
    assert_eq!(here.mesh_normal, Vec3::Z);
    for [a, b, c] in corners(&s) {
        assert!((b - a).cross(c - a).x > 0.0, "winding follows the mirror");
    }
    let back = here.facing(Vec3::X);
    assert_eq!(back.geometric_normal, -here.geometric_normal);
    assert_eq!(here.facing(Vec3::NEG_X), here);
}

#[test]
fn sloped_normals_under_uneven_scale() {
    let mut b = Builder::default();
    // A roof plane that rises at 45 degrees: normal (-1, 1, 0) / sqrt 2.
    b.vec3(&[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 0.0]]);
    let nodes = r#""nodes":[{"mesh":0,"scale":[1,0.5,-1]}],"scenes":[{"nodes":[0]}]"#;
    let s = scene(&b.glb(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],{nodes}"#
    )));
    let here = s.surface(&s.rest_pose(), 0, 0, 0.3, 0.3);
    let expected = Vec3::new(-1.0, 2.0, 0.0).normalize();
    assert!(
        here.geometric_normal.abs_diff_eq(expected, 1e-6),
        "{here:?}"
    );
    assert!(here.normal.abs_diff_eq(expected, 1e-6), "{here:?}");
}

#[test]
fn morph_weights_of_the_node_override_and_animate() {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    b.vec3(&[[0.0, 0.0, 2.0]; 4]);
    let times = b.scalars(&[0.0, 2.0]);
    let values = b.scalars(&[0.0, 1.0]);
    let mesh = r#""meshes":[{"weights":[0.25],"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":1}],"mode":6}]}]"#;
    let depth = |s: &Scene, pose: &Pose| {
        let mut z = 0.0f32;
        s.for_each_triangle(pose, |t| z = z.max(t[0].z));
        z
    };
    let plain = scene(&b.glb(&format!("{mesh},{ONE_NODE}")));
    assert_eq!(depth(&plain, &plain.rest_pose()), 0.5);
    assert!(plain.is_deformed_instance(0) && !plain.is_deforming_instance(0));
    let node = r#""nodes":[{"mesh":0,"weights":[0.5]}]"#;
    let animation = format!(
        r#""animations":[{{"samplers":[{{"input":{times},"output":{values}}}],"channels":[{{"sampler":0,"target":{{"node":0,"path":"weights"}}}}]}}]"#
    );
    let s = scene(&b.glb(&format!("{mesh},{node},{animation}")));
    assert_eq!(depth(&s, &s.rest_pose()), 1.0);
    assert_eq!(depth(&s, &s.pose(1.5)), 1.5);
    assert!(s.is_deforming_instance(0) && !s.is_moving_instance(0));
    let here = s.surface(&s.pose(1.5), 0, 0, 0.1, 0.1);
    assert_eq!((here.mesh_position.z, here.rest_position.z), (1.5, 0.0));
}

#[test]
fn gpu_instances_with_normalized_rotations() {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    b.vec3(&[[1.0, 0.0, 0.0], [0.0, 5.0, 0.0]]);
    let turns: Vec<u8> = [0i16, 0, 0, 32767, 0, 32767, 0, 0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    b.accessor(&turns, I16, "VEC4", 2, r#","normalized":true"#);
    let rest = r#""extensionsRequired":["EXT_mesh_gpu_instancing"],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":6}]}],
        "nodes":[{"name":"grass","mesh":0,"translation":[0,0,1],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":1,"ROTATION":2}}}}]"#;
    let s = scene(&b.glb(rest));
    let names: Vec<&str> = s.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["grass#0", "grass#1"]);
    let pose = s.rest_pose();
    let at = |i: usize, p: Vec3| pose.world_from_mesh[i].transform_point3(p);
    assert_eq!(at(0, Vec3::X), Vec3::new(2.0, 0.0, 1.0));
    assert!(at(1, Vec3::X).abs_diff_eq(
        Quat::from_rotation_y(std::f32::consts::PI) * Vec3::X + Vec3::new(0.0, 5.0, 1.0),
        1e-6
    ));
}

#[test]
fn json_files_with_data_uris_and_files_beside_them() {
    let mut b = Builder::default();
    b.accessor(&[0; 9], U8, "VEC3", 3, "");
    b.data = vec![0, 0, 0, 1, 0, 0, 0, 1, 0];
    let rest = r#""extensionsRequired":["KHR_mesh_quantization"],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]"#;
    let inline = b.json(
        rest,
        r#","uri":"data:application/octet-stream;base64,AAAAAQAAAAEA""#,
    );
    assert_eq!(
        corners(&scene(inline.as_bytes())),
        [[Vec3::ZERO, Vec3::X, Vec3::Y]]
    );
    let beside = b.json(rest, r#","uri":"some%20data.bin""#);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.gltf");
    std::fs::write(&path, &beside).expect("written");
    let missing = Scene::load(&path)
        .map(|_| ())
        .expect_err("no buffer yet")
        .to_string();
    assert!(missing.contains("some data.bin"), "{missing}");
    std::fs::write(folder.path().join("some data.bin"), &b.data).expect("written");
    let s = Scene::load(&path).expect("whole now");
    assert_eq!((corners(&s).len(), s.name.as_str()), (1, "scene"));
}

#[test]
fn what_is_wrong_is_said() {
    let two_nodes = |text: &str| format!(r#""nodes":[{text}],"scenes":[{{"nodes":[0]}}]"#);
    let mut nan = Builder::default();
    nan.vec3(&[[0.0; 3], [1.0, f32::NAN, 0.0], [0.0, 1.0, 0.0]]);
    let mesh = r#""meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]"#;
    let with = |text: &str| nan.glb(&format!("{text},{mesh},{ONE_NODE}"));
    let huge = |count: &str, view: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"accessors":[{{{view}"componentType":5126,"type":"VEC3","count":{count}}}],{mesh},{ONE_NODE}}}"#
        )
        .into_bytes()
    };
    for (bytes, expected) in [
        (Vec::new(), "is empty"),
        (b"\x89PNG....".to_vec(), "neither a binary nor a JSON"),
        (b"{".to_vec(), "JSON cannot be read"),
        (br#"{"asset":{"version":"1.0"}}"#.to_vec(), "version 1.0"),
        (br#"{"asset":{"version":"2.0"}}"#.to_vec(), "no triangles"),
        (with(r#""extras":0"#), "not finite"),
        (
            with(r#""extensionsRequired":["KHR_draco_mesh_compression"]"#),
            "KHR_draco_mesh_compression",
        ),
        (with(r#""extensionsRequired":["ACME_mesh"]"#), "ACME_mesh"),
        (square(r#","indices":4"#, ONE_NODE), "vertex 9 of 4"),
        (square(r#","indices":77"#, ONE_NODE), "accessor 77"),
        (square(r#","indices":0"#, ONE_NODE), "components"),
        (square(r#","mode":0"#, ONE_NODE), "points or lines"),
        (square("", &two_nodes(r#"{"mesh":5}"#)), "mesh 5"),
        (huge("4000000000", ""), "more than the file's data"),
        (
            huge("18446744073709551615", ""),
            "more than the file's data",
        ),
        (huge("3", r#""bufferView":0,"#), "buffer view 0"),
    ] {
        let error = error(&bytes);
        assert!(
            error.starts_with("test: ") && error.contains(expected),
            "{expected}: {error}"
        );
        assert!(!error.contains('\n'), "{error}");
    }
    let missing = Scene::load(std::path::Path::new("/nowhere/at.glb")).map(|_| ());
    assert!(matches!(missing, Err(crate::Error::Io { .. })));
}

/// A skinned, animated, morphed, textured file of about 2 kB.
pub(super) fn busy() -> Vec<u8> {
    let mut b = Builder::default();
    b.vec3(&SQUARE);
    b.vec3(&[[0.0, 0.1, 0.2]; 4]);
    b.accessor(
        &[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0],
        U8,
        "VEC4",
        4,
        "",
    );
    let weights: Vec<u8> = [[192u8, 63, 0, 0]; 4].concat();
    b.accessor(&weights, U8, "VEC4", 4, r#","normalized":true"#);
    let times = b.scalars(&[0.0, 0.5, 1.0]);
    let turns: Vec<u8> = [
        [0.0f32, 0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
    .iter()
    .flatten()
    .flat_map(|v| v.to_le_bytes())
    .collect();
    let turns = b.accessor(&turns, F32, "VEC4", 3, "");
    let uvs: Vec<u8> = [0.0f32, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let uvs = b.accessor(&uvs, F32, "VEC2", 4, "");
    let mut png = Vec::new();
    let pixels = [10u8, 20, 30, 255, 40, 50, 60, 0];
    let encoder = image::codecs::png::PngEncoder::new(&mut png);
    image::ImageEncoder::write_image(encoder, &pixels, 2, 1, image::ExtendedColorType::Rgba8)
        .expect("a PNG");
    let png = b.view(&png);
    b.glb(&format!(
        r#""images":[{{"bufferView":{png},"mimeType":"image/png"}}],"textures":[{{"source":0}}],
        "materials":[{{"alphaMode":"MASK","normalTexture":{{"index":0}},"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":{uvs},"JOINTS_0":2,"WEIGHTS_0":3}},"targets":[{{"POSITION":1}}],"material":0,"mode":6}}]}}],
        "nodes":[{{"mesh":0,"skin":0}},{{"children":[2]}},{{"translation":[0,1,0]}},{{"camera":0,"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
        "skins":[{{"joints":[1,2]}}],"cameras":[{{"type":"perspective","perspective":{{"yfov":1,"znear":0.1}}}}],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","spot":{{}},"range":3}}]}}}},
        "animations":[{{"samplers":[{{"input":{times},"output":{turns}}}],"channels":[{{"sampler":0,"target":{{"node":2,"path":"rotation"}}}}]}}]"#
    ))
}

#[test]
fn cut_anywhere_and_any_bit_flipped() {
    let bytes = busy();
    let whole = scene(&bytes);
    assert_eq!(
        (whole.skins.len(), whole.lights.len(), whole.cameras.len()),
        (1, 1, 1)
    );
    for cut in 0..bytes.len() {
        error(&bytes[..cut]);
    }
    let mut read = 0;
    for at in 0..bytes.len() {
        for bit in 0..8 {
            let mut spoilt = bytes.clone();
            spoilt[at] ^= 1 << bit;
            match from_bytes(&spoilt) {
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
                Err(e) => assert!(!e.to_string().contains('\n'), "{e}"),
            }
        }
    }
    // Names and colours may change freely; the rest must have been refused.
    assert!(read > 100, "{read}");
}
