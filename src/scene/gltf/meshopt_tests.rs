//! Compressed and quantised files, made with meshoptimizer's encoders.

use super::tests::{
    Builder, F32, I8, I16, ONE_NODE, SQUARE, U8, U16, U32, corners, error, from_bytes, scene,
    square, warned,
};
use super::{container, meshopt};
use crate::scene::{ChannelValues, Scene, corpus_tests};
use ::gltf::json::{self, Value};
use ::meshopt::{EncodeExpMode, ffi};
use glam::{Quat, Vec2, Vec3, Vec4};

const TRIANGLES: &str = "TRIANGLES";
const INDICES: &str = "INDICES";

/// Encodes elements of `stride` bytes for the mode ATTRIBUTES, in a version of the codec.
fn encode_attributes(data: &[u8], stride: usize, version: i32) -> Vec<u8> {
    let count = data.len() / stride;
    // Only so far as the data are whole elements, and the encoder reads words.
    assert_eq!(data.len(), count * stride);
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(data);
    // SAFETY: `words` are `count` elements of `stride` bytes, `out` has the room that is asked for.
    unsafe {
        let mut out = vec![0; ffi::meshopt_encodeVertexBufferBound(count, stride)];
        let (to, from) = (out.as_mut_ptr(), words.as_ptr().cast());
        let room = out.len();
        let size = ffi::meshopt_encodeVertexBufferLevel(to, room, from, count, stride, 3, version);
        out.truncate(size);
        out
    }
}

fn encode_indices(indices: &[u32], mode: &str) -> Vec<u8> {
    let vertices = indices.iter().max().map_or(0, |m| *m as usize + 1);
    match mode {
        TRIANGLES => ::meshopt::encode_index_buffer(indices, vertices),
        _ => ::meshopt::encode_index_sequence(indices, vertices),
    }
    .expect("encoded")
}

fn bytes_of<T: bytemuck::NoUninit>(values: &[T]) -> &[u8] {
    bytemuck::cast_slice(values)
}

/// What the extension's object says of a view's encoded bytes, beside where they are.
fn object(mode: &str, filter: &str, stride: usize, count: usize) -> String {
    format!(r#""mode":"{mode}","filter":"{filter}","byteStride":{stride},"count":{count}"#)
}

/// A builder whose second buffer has a length and no data.
fn builder() -> Builder {
    let mut b = Builder::default();
    b.more_buffers =
        r#",{"byteLength":1000000,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}"#
            .to_owned();
    b
}

/// Adds a view with compressed data to `b`. `outer` is what the view itself has, with a comma.
fn compressed(b: &mut Builder, name: &str, data: &[u8], object: &str, outer: &str) -> usize {
    let view = b.view(data);
    let offset = b.data.len() - data.len();
    b.views[view] = format!(
        r#"{{"buffer":1,"byteLength":9{outer},"extensions":{{"{name}":{{"buffer":0,"byteOffset":{offset},"byteLength":{},{object}}}}}}}"#,
        data.len()
    );
    view
}

/// A bent sheet of 20x20 vertices: enough for several groups and blocks of the codec.
struct Sheet {
    positions: Vec<Vec3>,
    normals: Vec<Vec4>,
    colors: Vec<Vec4>,
    uvs: Vec<Vec2>,
    indices: Vec<u32>,
}

const SIDE: u32 = 20;

fn sheet() -> Sheet {
    let vertices = (0..SIDE * SIDE).map(|i| Vec2::new((i % SIDE) as f32, (i / SIDE) as f32));
    let at: Vec<Vec2> = vertices.map(|v| v / (SIDE - 1) as f32).collect();
    let quads = (0..SIDE * (SIDE - 1)).filter(|i| i % SIDE + 1 < SIDE);
    Sheet {
        positions: at.iter().map(|v| v.extend(v.x * v.y * 0.3)).collect(),
        normals: at
            .iter()
            .map(|v| {
                Vec3::new(-0.3 * v.y, -0.3 * v.x, 1.0)
                    .normalize()
                    .extend(0.0)
            })
            .collect(),
        colors: at
            .iter()
            .map(|v| Vec4::new(v.x, v.y, 1.0 - v.x, 0.5 + 0.5 * v.y))
            .collect(),
        uvs: at.iter().map(|v| *v * 3.0 - Vec2::ONE).collect(),
        indices: quads
            .flat_map(|i| [i, i + 1, i + SIDE, i + 1, i + SIDE + 1, i + SIDE])
            .collect(),
    }
}

/// A sheet in a file of compressed views: `wide` takes 16 instead of 8 bits, and words for indices.
fn sheet_file(name: &str, version: i32, wide: bool, mode: &str) -> Vec<u8> {
    let sheet = sheet();
    let count = sheet.positions.len();
    let mut b = builder();
    let add = |b: &mut Builder, data: &[u8], filter, stride, component, kind, more| {
        let encoded = encode_attributes(data, stride, version);
        let object = object("ATTRIBUTES", filter, stride, count);
        let view = compressed(
            b,
            name,
            &encoded,
            &object,
            &format!(r#","byteStride":{stride}"#),
        );
        b.accessor_of(view, component, kind, count, more)
    };
    let norm = r#","normalized":true"#;
    add(
        &mut b,
        bytes_of(&sheet.positions),
        "NONE",
        12,
        F32,
        "VEC3",
        "",
    );
    let normals: Vec<[f32; 4]> = sheet.normals.iter().map(|n| n.to_array()).collect();
    let colors: Vec<[f32; 4]> = sheet.colors.iter().map(|c| c.to_array()).collect();
    let uvs: Vec<[f32; 2]> = sheet.uvs.iter().map(|uv| uv.to_array()).collect();
    let uvs = ::meshopt::encode_filter_exp(&uvs, 20, EncodeExpMode::SharedVector);
    if wide {
        let normals = ::meshopt::encode_filter_oct::<i16>(&normals, 14);
        add(
            &mut b,
            bytes_of(&normals),
            "OCTAHEDRAL",
            8,
            I16,
            "VEC3",
            norm,
        );
        let colors = ::meshopt::encode_filter_color::<u16>(&colors, 14);
        add(&mut b, bytes_of(&colors), "COLOR", 8, U16, "VEC4", norm);
    } else {
        let normals = ::meshopt::encode_filter_oct::<i8>(&normals, 8);
        add(
            &mut b,
            bytes_of(&normals),
            "OCTAHEDRAL",
            4,
            I8,
            "VEC3",
            norm,
        );
        let colors = ::meshopt::encode_filter_color::<u8>(&colors, 8);
        add(&mut b, bytes_of(&colors), "COLOR", 4, U8, "VEC4", norm);
    }
    add(&mut b, bytes_of(&uvs), "EXPONENTIAL", 8, F32, "VEC2", "");
    let (stride, component) = if wide { (4, U32) } else { (2, U16) };
    let object = object(mode, "NONE", stride, sheet.indices.len());
    let view = compressed(
        &mut b,
        name,
        &encode_indices(&sheet.indices, mode),
        &object,
        "",
    );
    let indices = b.accessor_of(view, component, "SCALAR", sheet.indices.len(), "");
    b.glb(&format!(
        r#""extensionsUsed":["{name}"],"extensionsRequired":["{name}","KHR_mesh_quantization"],
        "materials":[{{"normalTexture":{{"index":0}}}}],"textures":[{{}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"COLOR_0":2,"TEXCOORD_0":3}},"indices":{indices}}}]}}],{ONE_NODE}"#
    ))
}

/// The triangle that begins with its least corner and turns the same way.
fn turned(t: [Vec3; 3]) -> [[f32; 3]; 3] {
    let [a, b, c] = t.map(|v| v.to_array());
    let turns = [[a, b, c], [b, c, a], [c, a, b]];
    turns
        .into_iter()
        .min_by(|p, q| p.partial_cmp(q).expect("numbers"))
        .expect("three")
}

#[test]
fn every_mode_filter_and_version_decodes() {
    let sheet = sheet();
    let at = |i: u32| sheet.positions[i as usize];
    let expected: Vec<_> = sheet
        .indices
        .chunks(3)
        .map(|t| turned([at(t[0]), at(t[1]), at(t[2])]))
        .collect();
    for name in meshopt::NAMES {
        for (version, wide, mode) in [
            (0, false, TRIANGLES),
            (0, true, INDICES),
            (1, false, INDICES),
            (1, true, TRIANGLES),
        ] {
            let s = from_bytes(&sheet_file(name, version, wide, mode)).expect(name);
            let found: Vec<_> = corners(&s).into_iter().map(turned).collect();
            assert_eq!(found, expected, "{name} {version} {mode}");
            let mesh = &s.meshes[0];
            let bound = if wide { 1e-3 } else { 0.02 };
            for (i, position) in mesh.positions.iter().enumerate() {
                let source = sheet
                    .positions
                    .iter()
                    .position(|p| p == position)
                    .expect("it");
                assert!(mesh.normals[i].distance(sheet.normals[source].truncate()) < bound);
                assert!(mesh.colors[i].distance(sheet.colors[source]) < bound);
            }
        }
    }
}

#[test]
fn exponents_and_quaternions_of_animations_decode() {
    let turns: Vec<Quat> = (0..40)
        .map(|i| Quat::from_rotation_y(i as f32 * 0.1))
        .collect();
    let times: Vec<[f32; 1]> = (0..40).map(|i| [i as f32 / 30.0]).collect();
    let mut b = builder();
    b.vec3(&SQUARE);
    let add = |b: &mut Builder, data: &[u8], filter, stride| {
        let encoded = encode_attributes(data, stride, 0);
        compressed(
            b,
            meshopt::NAMES[0],
            &encoded,
            &object("ATTRIBUTES", filter, stride, 40),
            "",
        )
    };
    let encoded = ::meshopt::encode_filter_exp(&times, 23, EncodeExpMode::Separate);
    let view = add(&mut b, bytes_of(&encoded), "EXPONENTIAL", 4);
    let input = b.accessor_of(view, F32, "SCALAR", 40, "");
    let arrays: Vec<[f32; 4]> = turns.iter().map(|q| q.to_array()).collect();
    let view = add(
        &mut b,
        bytes_of(&::meshopt::encode_filter_quat(&arrays, 16)),
        "QUATERNION",
        8,
    );
    let output = b.accessor_of(view, I16, "VEC4", 40, r#","normalized":true"#);
    let s = scene(&b.glb(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{ONE_NODE},
        "animations":[{{"samplers":[{{"input":{input},"output":{output}}}],"channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}]}}]"#
    )));
    let ChannelValues::Rotation(found) = &s.channels[0].values else {
        panic!("no rotations");
    };
    assert_eq!(s.channels[0].times.len(), 40);
    for (time, [expected]) in s.channels[0].times.iter().zip(&times) {
        assert!((time - expected).abs() < 1e-6);
    }
    for (found, expected) in found.iter().zip(&turns) {
        assert!(found.angle_between(*expected) < 1e-3, "{found} {expected}");
    }
}

/// The square with compressed positions, whose extension has the given object; the view's own
/// buffer is 1.
fn square_with(data: &[u8], object: &str, more_buffers: &str) -> Vec<u8> {
    let mut b = builder();
    b.more_buffers = more_buffers.to_owned();
    let view = compressed(&mut b, meshopt::NAMES[0], data, object, "");
    b.views[view] = b.views[view].replacen(r#""byteLength":9"#, r#""byteLength":48"#, 1);
    b.accessor_of(view, F32, "VEC3", 4, "");
    b.glb(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":6}}]}}],{ONE_NODE}"#
    ))
}

#[test]
fn damaged_streams_name_the_view_or_give_way_to_the_copy() {
    let placeholder = r#",{"byteLength":48}"#;
    let positions = bytes_of(&SQUARE);
    let copy = format!(
        r#",{{"byteLength":48,"uri":"data:;base64,{}"}}"#,
        super::lenient_tests::base64(positions, "")
    );
    for version in [0, 1] {
        let data = encode_attributes(positions, 12, version);
        let whole = object("ATTRIBUTES", "NONE", 12, 4);
        let sound = scene(&square_with(&data, &whole, placeholder));
        assert_eq!(
            corners(&sound),
            corners(&scene(&square(r#","mode":6"#, ONE_NODE)))
        );
        for cut in 0..data.len() {
            let error = error(&square_with(&data[..cut], &whole, placeholder));
            assert!(
                error.contains("buffer view 0 cannot be decompressed: its data"),
                "{error}"
            );
        }
        let s = warned(
            &square_with(&data[..20], &whole, &copy),
            "its uncompressed copy was read",
        );
        assert_eq!(corners(&s), corners(&sound));
        // Any damage gives an error, other positions or none that are finite.
        for at in 0..data.len() {
            for bit in 0..8 {
                let mut spoilt = data.clone();
                spoilt[at] ^= 1 << bit;
                if let Err(e) = from_bytes(&square_with(&spoilt, &whole, placeholder)) {
                    assert!(!e.to_string().contains('\n'), "{e}");
                }
            }
        }
    }
    for mode in [TRIANGLES, INDICES] {
        let data = encode_indices(&sheet().indices, mode);
        let object = object(mode, "NONE", 4, sheet().indices.len());
        for cut in [0, 1, 2, data.len() / 2, data.len() - 1] {
            let mut b = builder();
            b.vec3(&[[0.5; 3]; 400]);
            let view = compressed(&mut b, meshopt::NAMES[1], &data[..cut], &object, "");
            b.accessor_of(view, U32, "SCALAR", sheet().indices.len(), "");
            let error = error(&b.glb(&format!(
                r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],{ONE_NODE}"#
            )));
            assert!(
                error.contains("buffer view 1 cannot be decompressed: its data"),
                "{error}"
            );
        }
    }
}

#[test]
fn objects_that_make_no_sense_are_named() {
    let data = encode_attributes(bytes_of(&SQUARE), 12, 1);
    for (object, expected) in [
        (object("ATTRIBUTES", "NONE", 0, 4), "stride of 0 bytes"),
        (object("ATTRIBUTES", "NONE", 6, 4), "stride of 6 bytes"),
        (object("ATTRIBUTES", "NONE", 260, 4), "stride of 260 bytes"),
        (
            object("ATTRIBUTES", "OCTAHEDRAL", 12, 4),
            "stride of 12 bytes",
        ),
        (
            object("ATTRIBUTES", "QUATERNION", 4, 4),
            "stride of 4 bytes",
        ),
        (object("ATTRIBUTES", "COLOR", 16, 4), "stride of 16 bytes"),
        (
            object("ATTRIBUTES", "EXPONENTIAL", 2, 4),
            "stride of 2 bytes",
        ),
        (object("ATTRIBUTES", "ACME", 4, 4), "filter is not known"),
        (object("ACME", "NONE", 4, 4), "mode is not known"),
        (
            object(TRIANGLES, "NONE", 4, 4),
            "4 indices are no whole triangles",
        ),
        (object(TRIANGLES, "NONE", 8, 3), "stride of 8 bytes"),
        (
            object(INDICES, "OCTAHEDRAL", 4, 4),
            "indices have no compression filter",
        ),
        (object("ATTRIBUTES", "NONE", 12, 5), "its data"),
        (object(INDICES, "NONE", 4, 12), "not of the mode"),
        (object("ATTRIBUTES", "NONE", 256, usize::MAX), "larger than"),
        (object("ATTRIBUTES", "NONE", 4, 1 << 29), "larger than"),
        (
            r#""mode":"ATTRIBUTES","byteStride":4"#.to_owned(),
            "has no count",
        ),
        (
            r#""mode":"ATTRIBUTES","byteStride":4,"count":-1"#.to_owned(),
            "count of its compression is no whole number",
        ),
    ] {
        let error = error(&square_with(&data, &object, ""));
        assert!(
            error.contains("buffer view 0 cannot be decompressed") && error.contains(expected),
            "{expected}: {error}"
        );
    }
    let whole = object("ATTRIBUTES", "NONE", 12, 4);
    for (from, to, expected) in [
        (
            r#"{"buffer":0"#,
            r#"{"buffer":7"#,
            "names buffer 7, which is not there",
        ),
        (
            r#","byteOffset":0"#,
            r#","byteOffset":9"#,
            "its compression reaches beyond its buffer",
        ),
        (
            r#"{"buffer":0,"#,
            r#"{"buffer":1,"#,
            "names buffer 1, which is not there",
        ),
    ] {
        let glb = square_with(&data, &whole, "");
        let text = String::from_utf8_lossy(&glb);
        assert!(text.contains(from), "{from}");
        let at = text.find("EXT_meshopt").expect("the name");
        let start = at
            + glb[at..]
                .windows(from.len())
                .position(|w| w == from.as_bytes())
                .expect("it");
        let mut changed = glb.clone();
        changed.splice(start..start + from.len(), to.bytes());
        let error = error(&changed);
        assert!(
            error.contains("buffer view 0") && error.contains(expected),
            "{expected}: {error}"
        );
    }
}

#[test]
fn views_may_share_compressed_bytes() {
    let data = encode_attributes(bytes_of(&SQUARE), 12, 0);
    let mut b = builder();
    let whole = object("ATTRIBUTES", "NONE", 12, 4);
    let view = compressed(&mut b, meshopt::NAMES[0], &data, &whole, "");
    let same = b.views[view].clone();
    let other = same.replace(r#""byteStride":12"#, r#""byteStride":4"#);
    b.views.extend([same, other]);
    for view in 0..3 {
        b.accessor_of(view, F32, "VEC3", 4, "");
    }
    let meshes = (0..3)
        .map(|a| format!(r#"{{"primitives":[{{"attributes":{{"POSITION":{a}}},"mode":6}}]}}"#));
    let meshes: Vec<String> = meshes.collect();
    let s = warned(
        &b.glb(&format!(
            r#""meshes":[{}],"nodes":[{{"mesh":0}},{{"mesh":1}},{{"mesh":2}}]"#,
            meshes.join(",")
        )),
        "buffer view 2 cannot be decompressed",
    );
    assert_eq!(s.instances.len(), 2);
    assert_eq!(s.meshes[0].positions, s.meshes[1].positions);
}

/// The bytes of integers of a component type, three a row, each row padded to four.
fn rows(component: u32, rows: &[[i32; 3]]) -> Vec<u8> {
    let padded = rows.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0]);
    padded
        .flat_map(|v| match component {
            I8 | U8 => vec![v as u8],
            _ => (v as u16).to_le_bytes().to_vec(),
        })
        .collect()
}

#[test]
fn quantized_attributes_of_every_type_are_read() {
    for (component, most) in [(I8, 127), (U8, 255), (I16, 32767), (U16, 65535)] {
        let is_signed = matches!(component, I8 | I16);
        let stride = if matches!(component, I8 | U8) { 4 } else { 8 };
        for normalized in [false, true] {
            let mut b = Builder::default();
            let more = if normalized {
                r#","normalized":true"#
            } else {
                ""
            };
            let low = if is_signed { -most } else { 0 };
            let scale = if normalized { most as f32 } else { 1.0 };
            let add = |b: &mut Builder, values: &[[i32; 3]], kind| {
                let accessor = b.accessor(&rows(component, values), component, kind, 4, more);
                let view = b.views.last_mut().expect("a view");
                *view = view.replace('}', &format!(r#","byteStride":{stride}}}"#));
                accessor
            };
            let square = [
                [low, low, 0],
                [most, low, 0],
                [most, most, 0],
                [low, most, 0],
            ];
            let positions = add(&mut b, &square, "VEC3");
            let uvs = add(
                &mut b,
                &[[0, most, 0], [most, 0, 0], [low, 0, 0], [1, 2, 0]],
                "VEC2",
            );
            let moved = add(
                &mut b,
                &[[0, 0, most], [0, 0, 1], [0, 0, 2], [0, 0, 3]],
                "VEC3",
            );
            // Normals are signed and normalized whatever the positions are.
            let (small, large) = if stride == 4 { (I8, 127) } else { (I16, 32767) };
            let normals = rows(small, &[[0, 0, large]; 4]);
            let norm = r#","normalized":true"#;
            let normals = b.accessor(&normals, small, "VEC3", 4, norm);
            let view = b.views.last_mut().expect("a view");
            *view = view.replace('}', &format!(r#","byteStride":{stride}}}"#));
            let turned = rows(small, &[[large, 0, -large]; 4]);
            let turned = b.accessor(&turned, small, "VEC3", 4, norm);
            let view = b.views.last_mut().expect("a view");
            *view = view.replace('}', &format!(r#","byteStride":{stride}}}"#));
            let mut tangents = rows(small, &[[0, large, 0]; 4]);
            for row in tangents.chunks_mut(stride) {
                let last = &mut row[stride / 4 * 3..];
                last.copy_from_slice(&(-large as i16).to_le_bytes()[..stride / 4]);
            }
            let tangents = b.accessor(&tangents, small, "VEC4", 4, norm);
            let s = scene(&b.glb(&format!(
                r#""extensionsRequired":["KHR_mesh_quantization"],
                "images":[{{"uri":"data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="}}],
                "textures":[{{"source":0}}],"materials":[{{"normalTexture":{{"index":0}}}}],
                "meshes":[{{"weights":[1],"primitives":[{{"attributes":{{"POSITION":{positions},"NORMAL":{normals},"TANGENT":{tangents},"TEXCOORD_0":{uvs}}},
                "targets":[{{"POSITION":{moved},"NORMAL":{turned}}}],"material":0,"mode":6}}]}}],{ONE_NODE}"#
            )));
            let mesh = &s.meshes[0];
            let at = |x: i32, y: i32, z: i32| Vec3::new(x as f32, y as f32, z as f32) / scale;
            assert_eq!(mesh.positions, square.map(|[x, y, z]| at(x, y, z)));
            assert_eq!(mesh.normals, [Vec3::Z; 4]);
            assert_eq!(mesh.tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]);
            let uvs = [[0, most], [most, 0], [low, 0], [1, 2]];
            assert_eq!(
                mesh.uvs[0],
                uvs.map(|[x, y]| Vec2::new(x as f32, y as f32) / scale)
            );
            let target = &mesh.morph_targets[0];
            assert_eq!(target.positions, [most, 1, 2, 3].map(|z| at(0, 0, z)));
            assert_eq!(target.normals, [Vec3::new(1.0, 0.0, -1.0); 4]);
            let pose = s.rest_pose();
            let posed = pose.deformed[0].as_ref().expect("morphed");
            assert_eq!(posed.positions[0], at(low, low, most));
            assert!(posed.normals[0].abs_diff_eq(Vec3::X, 1e-6), "{posed:?}");
        }
    }
}

#[test]
fn quantized_skins_are_read() {
    for (component, most) in [(U8, 255i32), (U16, 65535)] {
        let mut b = Builder::default();
        b.vec3(&SQUARE.map(|p| p.map(|v| v * 10_000.0)));
        let four = |values: [i32; 4]| match component {
            U8 => values.map(|v| v as u8).to_vec(),
            _ => values
                .iter()
                .flat_map(|v| (*v as u16).to_le_bytes())
                .collect(),
        };
        b.accessor(&four([1, 0, 0, 0]).repeat(4), component, "VEC4", 4, "");
        // Rounded as exporters do: the sum is a step short of 1.
        let weights = four([most / 3, most / 3 * 2 - 1, 0, 0]).repeat(4);
        b.accessor(&weights, component, "VEC4", 4, r#","normalized":true"#);
        // The joints' matrices undo the quantisation of the mesh, as gltfpack writes them.
        let scale = glam::Mat4::from_scale(Vec3::splat(0.5e-4)).to_cols_array();
        b.accessor(bytes_of(&[scale, scale]), F32, "MAT4", 2, "");
        let s = scene(&b.glb(
            r#""meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2},"mode":6}]}],
            "nodes":[{"mesh":0,"skin":0},{"children":[2]},{"translation":[0,0,3]}],"skins":[{"joints":[1,2],"inverseBindMatrices":3}]"#,
        ));
        assert!(s.warnings.is_empty(), "{:?}", s.warnings);
        let weight = (most / 3) as f32 / (most / 3 * 3 - 1) as f32;
        let here = s.surface(&s.rest_pose(), 0, 0, 0.0, 0.0);
        assert!(
            here.position
                .abs_diff_eq(Vec3::new(0.5, 0.0, 3.0 * weight), 1e-5),
            "{here:?}"
        );
    }
}

/// The file with every view that accessors read compressed without loss, and nothing else changed.
fn compress(glb: &[u8], name: &str) -> Vec<u8> {
    let (text, blob) = container::split(glb).expect("a GLB");
    let mut root: Value = json::deserialize::from_slice(text).expect("JSON");
    let blob = blob.expect("a chunk");
    let size = |v: &Value, key: &str| v.get(key).and_then(Value::as_u64).unwrap_or(0) as usize;
    let list = |key: &str| {
        root.get(key)
            .and_then(Value::as_array)
            .cloned()
            .unwrap_or_default()
    };
    let (accessors, mut views) = (list("accessors"), list("bufferViews"));
    let meshes = list("meshes");
    let primitives = meshes
        .iter()
        .flat_map(|m| m["primitives"].as_array().expect("a list"));
    let index_accessors: Vec<usize> = primitives
        .filter_map(|p| p.get("indices")?.as_u64())
        .map(|i| i as usize)
        .collect();
    let (mut data, mut compressed) = (Vec::new(), 0);
    for (v, view) in views.iter_mut().enumerate() {
        let bytes = &blob[size(view, "byteOffset")..][..size(view, "byteLength")];
        let readers: Vec<usize> = (0..accessors.len())
            .filter(|a| {
                accessors[*a].get("bufferView").is_some() && size(&accessors[*a], "bufferView") == v
            })
            .collect();
        data.resize(data.len().next_multiple_of(4), 0);
        let offset = data.len();
        let (mode, stride, encoded) = match readers[..] {
            [a] if index_accessors.contains(&a) && size(&accessors[a], "componentType") != 5121 => {
                let wide = size(&accessors[a], "componentType") as u32 == U32;
                let stride = if wide { 4 } else { 2 };
                let indices: Vec<u32> = match wide {
                    true => bytemuck::pod_collect_to_vec(bytes),
                    false => bytes
                        .chunks(2)
                        .map(|b| u16::from_le_bytes([b[0], b[1]]).into())
                        .collect(),
                };
                let mode = if indices.len().is_multiple_of(3) {
                    TRIANGLES
                } else {
                    INDICES
                };
                (mode, stride, encode_indices(&indices, mode))
            }
            [_, ..] if bytes.len().is_multiple_of(4) => {
                let stride = size(view, "byteStride").max(4);
                let stride = if bytes.len().is_multiple_of(stride) {
                    stride
                } else {
                    4
                };
                (
                    "ATTRIBUTES",
                    stride,
                    encode_attributes(bytes, stride, (v % 2) as i32),
                )
            }
            _ => {
                data.extend_from_slice(bytes);
                view["byteOffset"] = Value::from(offset);
                continue;
            }
        };
        let object = format!(
            r#"{{"{name}":{{"buffer":0,"byteOffset":{offset},"byteLength":{},{}}}}}"#,
            encoded.len(),
            object(mode, "NONE", stride, bytes.len() / stride)
        );
        view["buffer"] = Value::from(1);
        view["extensions"] = json::deserialize::from_str(&object).expect("JSON");
        data.extend(encoded);
        compressed += 1;
    }
    assert!(compressed > 3);
    root["bufferViews"] = Value::from(views);
    let buffers = format!(
        r#"[{{"byteLength":{}}},{{"byteLength":{}}}]"#,
        data.len(),
        blob.len()
    );
    root["buffers"] = json::deserialize::from_str(&buffers).expect("JSON");
    super::tests::glb(&json::serialize::to_string(&root).expect("JSON"), &data)
}

#[test]
fn scenes_are_the_same_after_compression() {
    let Some(folder) = corpus_tests::folder() else {
        return;
    };
    for (file, name) in [
        ("cesium_man.glb", meshopt::NAMES[0]),
        ("gpu_instancing_field.glb", meshopt::NAMES[1]),
        ("animated_morph_cube.glb", meshopt::NAMES[1]),
    ] {
        let bytes = std::fs::read(folder.join(file)).expect(file);
        let (plain, small) = (scene(&bytes), scene(&compress(&bytes, name)));
        assert_eq!(plain.warnings, small.warnings, "{file}");
        let triangles = |s: &Scene, time: f32| {
            let mut all = Vec::new();
            s.for_each_triangle(&s.pose(time.into()), |t| all.push(turned(t)));
            all
        };
        for time in [0.0, 0.7] {
            assert!(
                triangles(&plain, time) == triangles(&small, time),
                "{file} at {time}"
            );
        }
    }
}
