//! Materials of files built here: where textures are read, vertex colours, extensions.

use super::tests::{Builder, F32, ONE_NODE, SQUARE, U8, U16, scene};
use crate::scene::{Alpha, Scene, Surface};
use glam::{Vec2, Vec3};

/// A unit square in the XY plane, two triangles, with further attributes, images and materials.
#[derive(Default)]
struct Sheet {
    builder: Builder,
    attributes: String,
    images: Vec<String>,
}

impl Sheet {
    fn new() -> Sheet {
        let mut sheet = Sheet::default();
        sheet.builder.vec3(&SQUARE);
        sheet
    }

    fn attribute(&mut self, name: &str, bytes: &[u8], component: u32, kind: &str, more: &str) {
        let index = self.builder.accessor(bytes, component, kind, 4, more);
        self.attributes += &format!(r#","{name}":{index}"#);
    }

    fn floats(&mut self, name: &str, values: &[f32], kind: &str) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.attribute(name, &bytes, F32, kind, "");
    }

    /// Texture number of a row of RGBA texels.
    fn image(&mut self, texels: &[[u8; 4]]) -> usize {
        let mut png = Vec::new();
        image::ImageEncoder::write_image(
            image::codecs::png::PngEncoder::new(&mut png),
            texels.as_flattened(),
            texels.len() as u32,
            1,
            image::ExtendedColorType::Rgba8,
        )
        .expect("a PNG");
        let view = self.builder.view(&png);
        self.images
            .push(format!(r#"{{"bufferView":{view},"mimeType":"image/png"}}"#));
        self.images.len() - 1
    }

    fn read(&self, material: &str) -> Scene {
        let textures: Vec<String> = (0..self.images.len())
            .map(|i| format!(r#"{{"source":{i}}}"#))
            .collect();
        scene(&self.builder.glb(&format!(
            r#""images":[{}],"textures":[{}],"materials":[{material}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{}}},"material":0,"mode":6}}]}}],{ONE_NODE}"#,
            self.images.join(","),
            textures.join(","),
            self.attributes
        )))
    }
}

/// The surface at a place of the square.
fn at(scene: &Scene, x: f32, y: f32) -> Surface {
    // The fan is [1, 2, 0], [2, 3, 0]: weights of the second and third corner.
    let (triangle, u, v) = if x >= y {
        (0, y, 1.0 - x)
    } else {
        (1, y - x, 1.0 - y)
    };
    let surface = scene.surface(&scene.rest_pose(), 0, triangle, u, v);
    assert!(
        surface.position.abs_diff_eq(Vec3::new(x, y, 0.0), 1e-6),
        "{surface:?}"
    );
    surface
}

/// Coordinates that grow with x, and ones that grow with y.
const ALONG_X: [f32; 8] = [0.0, 0.5, 1.0, 0.5, 1.0, 0.5, 0.0, 0.5];
const ALONG_Y: [f32; 8] = [0.0, 0.5, 0.0, 0.5, 1.0, 0.5, 1.0, 0.5];

#[test]
fn textures_are_read_by_their_own_set() {
    let mut sheet = Sheet::new();
    sheet.floats("TEXCOORD_0", &ALONG_X, "VEC2");
    sheet.floats("TEXCOORD_1", &ALONG_Y, "VEC2");
    let colour = sheet.image(&[[255, 0, 0, 255], [0, 255, 0, 255]]);
    let bumps = sheet.image(&[[255, 128, 128, 255], [0, 128, 128, 255]]);
    let rough = sheet.image(&[[0, 0, 255, 255], [0, 255, 0, 255]]);
    let scene = sheet.read(&format!(
        r#"{{"normalTexture":{{"index":{bumps},"texCoord":1}},"pbrMetallicRoughness":{{
        "baseColorTexture":{{"index":{colour}}},"metallicRoughnessTexture":{{"index":{rough},"texCoord":1}}}}}}"#
    ));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    for (x, y) in [(0.2, 0.1), (0.2, 0.8), (0.8, 0.2), (0.9, 0.8)] {
        let here = at(&scene, x, y);
        assert_eq!(here.base_color.x > 0.5, x < 0.5, "{here:?}");
        // The tangent runs along the set of the normal map: up the square.
        assert_eq!(here.normal.y > 0.5, y < 0.5, "{here:?}");
        assert!(here.normal.x.abs() < 0.02, "{here:?}");
        assert_eq!(here.metallic > 0.5, y < 0.5, "{here:?}");
        assert_eq!(here.roughness < 0.5, y < 0.5, "{here:?}");
    }
}

#[test]
fn texture_transforms_are_those_of_their_texture() {
    let mut sheet = Sheet::new();
    sheet.floats("TEXCOORD_0", &ALONG_X, "VEC2");
    sheet.floats("TEXCOORD_3", &ALONG_Y, "VEC2");
    let colour = sheet.image(&[[255, 0, 0, 255], [0, 255, 0, 255]]);
    let bumps = sheet.image(&[[255, 128, 128, 255], [0, 128, 128, 255]]);
    let scene = sheet.read(&format!(
        r#"{{"normalTexture":{{"index":{bumps},"extensions":{{"KHR_texture_transform":{{"texCoord":3}}}}}},
        "pbrMetallicRoughness":{{"baseColorTexture":{{"index":{colour},
        "extensions":{{"KHR_texture_transform":{{"offset":[0.5,0],"scale":[2,1]}}}}}}}}}}"#
    ));
    for (x, y) in [(0.1, 0.2), (0.4, 0.7), (0.6, 0.3), (0.9, 0.8)] {
        let here = at(&scene, x, y);
        let u = (2.0 * x + 0.5f32).fract();
        assert_eq!(here.base_color.x > 0.5, u < 0.5, "{x} {here:?}");
        assert_eq!(here.normal.y > 0.5, y < 0.5, "{here:?}");
    }
    // A quarter turn takes u to -v.
    let turned = sheet.read(&format!(
        r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{colour},
        "extensions":{{"KHR_texture_transform":{{"rotation":1.5707963267948966}}}}}}}}}}"#
    ));
    let texture = turned.materials[0].base_color_texture.expect("a texture");
    let uv = texture.transform.transform_point2(Vec2::new(0.25, 0.0));
    assert!(uv.abs_diff_eq(Vec2::new(0.0, -0.25), 1e-6), "{uv}");
}

#[test]
fn texture_sets_out_of_bounds_are_dropped_with_a_warning() {
    let mut sheet = Sheet::new();
    let colour = sheet.image(&[[0, 0, 0, 255]]);
    for set in ["4000000000", "1"] {
        let scene = sheet.read(&format!(
            r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{colour},"texCoord":{set}}}}}}}"#
        ));
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert_eq!(at(&scene, 0.5, 0.2).base_color, Vec3::ONE);
    }
}

#[test]
fn vertex_colours_of_all_types_multiply_colour_and_mask() {
    let rgba = [
        [1.0f32, 0.5, 0.25, 0.0],
        [1.0, 0.5, 0.25, 0.0],
        [1.0, 0.5, 0.25, 1.0],
        [1.0, 0.5, 0.25, 1.0],
    ];
    let material = r#"{"alphaMode":"MASK","pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1]}}"#;
    let check = |sheet: &Sheet, alpha: bool, error: f32| {
        let scene = sheet.read(material);
        let here = at(&scene, 0.7, 0.3);
        let expected = Vec3::new(0.5, 0.5, 0.25);
        assert!(here.base_color.abs_diff_eq(expected, error), "{here:?}");
        // Alpha grows with y, which is the weight of the second corner.
        assert_eq!(scene.alpha_is_hole(0, 0, 0.3, 0.3), alpha);
        assert!(!scene.alpha_is_hole(0, 0, 0.6, 0.3));
    };
    let mut sheet = Sheet::new();
    sheet.floats("COLOR_0", rgba.as_flattened(), "VEC4");
    check(&sheet, true, 1e-6);
    let mut sheet = Sheet::new();
    let rgb: Vec<f32> = rgba.iter().flat_map(|c| c[..3].to_vec()).collect();
    sheet.floats("COLOR_0", &rgb, "VEC3");
    check(&sheet, false, 1e-6);
    let mut sheet = Sheet::new();
    let bytes: Vec<u8> = rgba
        .as_flattened()
        .iter()
        .map(|v| (v * 255.0) as u8)
        .collect();
    sheet.attribute("COLOR_0", &bytes, U8, "VEC4", r#","normalized":true"#);
    check(&sheet, true, 0.01);
    let mut sheet = Sheet::new();
    let bytes: Vec<u8> = rgba
        .as_flattened()
        .iter()
        .flat_map(|v| ((v * 65535.0) as u16).to_le_bytes())
        .collect();
    sheet.attribute("COLOR_0", &bytes, U16, "VEC4", r#","normalized":true"#);
    check(&sheet, true, 1e-4);
}

const HALF: [[u8; 4]; 2] = [[255, 255, 255, 255], [255, 255, 255, 100]];

#[test]
fn blended_surfaces_of_alpha_1_are_opaque() {
    let read = |sheet: &Sheet, factor: f32, more: &str| {
        let scene = sheet.read(&format!(
            r#"{{"alphaMode":"BLEND","pbrMetallicRoughness":{{"baseColorFactor":[1,1,1,{factor}]{more}}}}}"#
        ));
        scene.materials[0].alpha
    };
    let plain = Sheet::new();
    assert_eq!(read(&plain, 1.0, ""), Alpha::Opaque);
    assert_eq!(read(&plain, 0.9, ""), Alpha::Blend);
    let mut textured = Sheet::new();
    textured.floats("TEXCOORD_0", &ALONG_X, "VEC2");
    let solid = textured.image(&[[9, 9, 9, 255]]);
    let half = textured.image(&HALF);
    let by = |i: usize| format!(r#","baseColorTexture":{{"index":{i}}}"#);
    assert_eq!(read(&textured, 1.0, &by(solid)), Alpha::Opaque);
    assert_eq!(read(&textured, 0.5, &by(half)), Alpha::Blend);
    assert_eq!(
        read(&textured, 1.0, &by(half)),
        Alpha::Mask { cutoff: 0.99 }
    );
    let mut faded = Sheet::new();
    let mut colours = [1.0f32; 16];
    faded.floats("COLOR_0", &colours, "VEC4");
    assert_eq!(read(&faded, 1.0, ""), Alpha::Opaque);
    let mut faded = Sheet::new();
    colours[3] = 0.2;
    faded.floats("COLOR_0", &colours, "VEC4");
    assert_eq!(read(&faded, 1.0, ""), Alpha::Mask { cutoff: 0.99 });
}

#[test]
fn transmitting_triangles_are_windows() {
    let mut sheet = Sheet::new();
    sheet.floats("TEXCOORD_0", &ALONG_X, "VEC2");
    let left = sheet.image(&[[255, 0, 0, 255], [255, 0, 0, 255], [0; 4], [0; 4]]);
    let read = |more: &str| {
        sheet.read(&format!(
            r#"{{"pbrMetallicRoughness":{{"metallicFactor":0}},"extensions":{{"KHR_materials_transmission":{{{more}}}}}}}"#
        ))
    };
    for (factor, window) in [(1.0, true), (0.6, true), (0.4, false), (0.0, false)] {
        let scene = read(&format!(r#""transmissionFactor":{factor}"#));
        assert_eq!(scene.materials[0].window, window);
        assert_eq!(scene.alpha_is_hole(0, 0, 0.3, 0.3), window);
        assert_eq!(at(&scene, 0.5, 0.2).transmission, factor as f32);
    }
    // By texture: the triangle on the right is opaque on the whole, the left one is a window.
    let scene = read(&format!(
        r#""transmissionFactor":1,"transmissionTexture":{{"index":{left}}}"#
    ));
    assert!(at(&scene, 0.25, 0.5).transmission > 0.9);
    assert!(at(&scene, 0.75, 0.5).transmission < 0.1);
    let holes = [0, 1].map(|t| scene.alpha_is_hole(0, t, 0.3, 0.3));
    assert_eq!(holes, [false, true]);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn unlit_materials_keep_their_base_colour_alone() {
    let sheet = Sheet::new();
    let scene = sheet.read(
        r#"{"emissiveFactor":[1,1,1],"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1]},"extensions":{"KHR_materials_unlit":{}}}"#,
    );
    let here = at(&scene, 0.5, 0.2);
    assert!(here.unlit && here.emissive == Vec3::ZERO);
    assert_eq!(here.base_color, Vec3::new(0.5, 0.25, 0.125));
    assert!(!scene.has_light());
}

#[test]
fn specular_glossiness_becomes_metallic_roughness() {
    let mut sheet = Sheet::new();
    sheet.floats("TEXCOORD_0", &ALONG_X, "VEC2");
    // Gold on the left, black gloss on the right.
    let shine = sheet.image(&[[255, 226, 155, 255], [0, 0, 0, 51]]);
    let diffuse = sheet.image(&[[0, 0, 0, 255], [255, 0, 0, 255]]);
    let scene = sheet.read(&format!(
        r#"{{"extensions":{{"KHR_materials_pbrSpecularGlossiness":{{"glossinessFactor":0.5,
        "diffuseTexture":{{"index":{diffuse}}},"specularGlossinessTexture":{{"index":{shine}}}}}}}}}"#
    ));
    let gold = at(&scene, 0.25, 0.1);
    assert!(gold.metallic > 0.99, "{gold:?}");
    assert!(
        gold.base_color
            .abs_diff_eq(Vec3::new(1.0, 0.76, 0.33), 0.02),
        "{gold:?}"
    );
    assert!((gold.roughness - 0.5).abs() < 0.01, "{gold:?}");
    let red = at(&scene, 0.75, 0.1);
    assert_eq!(red.metallic, 0.0);
    assert!(
        red.base_color.x > 0.99 && red.base_color.y < 0.01,
        "{red:?}"
    );
    assert!((red.roughness - 0.9).abs() < 0.01, "{red:?}");
}
