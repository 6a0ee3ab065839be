// Lookup in shadow maps. Twin of `shadow.rs`: same names, same order of operations. Constants marked
// SHARED stand on both sides.

const REACH: f32 = 2.0; // SHARED
const NEAR: f32 = 0.01; // SHARED

// 64 bytes: three axes and the origin, each with a number in w.
struct Face {
    right: vec3f,
    half_width: f32,
    up: vec3f,
    half_height: f32,
    forward: vec3f,
    // Whole depth of an orthographic projection; 0 is a perspective one.
    range: f32,
    origin: vec3f,
    rounding: f32,
}

@group(1) @binding(21) var<storage, read> faces: array<Face>;
@group(1) @binding(22) var maps: texture_depth_2d_array;

// Share of the light that reaches a place with geometric normal n. Six faces, in the order +x, -x,
// +y, -y, +z, -z, or one.
fn lit(first: u32, count: u32, position: vec3f, n: vec3f) -> f32 {
    var number = first;
    if count == 6u {
        let d = position - faces[first].origin;
        let a = abs(d);
        if a.x >= a.y && a.x >= a.z {
            number += select(0u, 1u, d.x < 0.0);
        } else if a.y >= a.z {
            number += select(2u, 3u, d.y < 0.0);
        } else {
            number += select(4u, 5u, d.z < 0.0);
        }
    }
    let face = faces[number];
    let perspective = face.range == 0.0;
    let z = dot(position - face.origin, face.forward);
    if perspective && z <= NEAR {
        return 1.0;
    }
    let side = i32(textureDimensions(maps).x);
    let half_size = vec2f(face.half_width, face.half_height);
    let texel = 2.0 * half_size * select(1.0, z, perspective) / f32(side);
    let lift = REACH * (abs(dot(n, face.right)) * texel.x + abs(dot(n, face.up)) * texel.y);
    let p = position + n * lift - face.origin;
    let across = vec2f(dot(p, face.right), dot(p, face.up));
    let along = dot(p, face.forward);
    var at = vec2f(0.0);
    var depth = 0.0;
    if perspective {
        at = across / (half_size * along);
        depth = NEAR / along * (1.0 + face.rounding);
    } else {
        at = across / half_size;
        depth = 1.0 - along / face.range + face.rounding;
    }
    at = vec2f(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y) * f32(side) - 0.5;
    let base = floor(at);
    let f = at - base;
    let columns = vec4f(1.0 - f.x, 1.0, 1.0, f.x);
    let rows = vec4f(1.0 - f.y, 1.0, 1.0, f.y);
    var sum = 0.0;
    for (var row = 0; row < 4; row++) {
        for (var column = 0; column < 4; column++) {
            let texel = clamp(vec2i(base) + vec2i(column, row) - 1, vec2i(0), vec2i(side - 1));
            if textureLoad(maps, texel, number, 0) <= depth {
                sum += columns[column] * rows[row];
            }
        }
    }
    return min(sum / 9.0, 1.0);
}
