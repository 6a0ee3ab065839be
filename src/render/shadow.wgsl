// Lookup in shadow maps. Twin of `shadow.rs`: same names, same order of operations. Constants marked
// SHARED stand on both sides.

const SNAP: f32 = 0.125; // SHARED
const GRAZING: f32 = 1e-3; // SHARED
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

fn local(face: Face, v: vec3f) -> vec3f {
    return vec3f(dot(v, face.right), dot(v, face.up), dot(v, face.forward));
}

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
    let p = local(face, position - face.origin);
    if perspective && p.z <= NEAR {
        return 1.0;
    }
    let side = i32(textureDimensions(maps).x);
    let half_size = vec2f(face.half_width, face.half_height);
    let m = local(face, n);
    var at = vec2f(0.0);
    var depth = 0.0;
    var slope = vec2f(0.0);
    if perspective {
        at = p.xy / (half_size * p.z);
        depth = NEAR / p.z * (1.0 + face.rounding);
        slope = m.xy * (NEAR / min(dot(m, p), -GRAZING * length(p)));
    } else {
        at = p.xy / half_size;
        depth = 1.0 - p.z / face.range + face.rounding;
        slope = m.xy / (min(m.z, -GRAZING) * face.range);
    }
    let gradient = slope * half_size * vec2f(2.0, -2.0) / f32(side);
    depth += SNAP * (abs(gradient.x) + abs(gradient.y));
    at = vec2f(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y) * f32(side) - 0.5;
    let base = floor(at);
    let f = at - base;
    let columns = vec4f(1.0 - f.x, 1.0, 1.0, f.x);
    let rows = vec4f(1.0 - f.y, 1.0, 1.0, f.y);
    var sum = 0.0;
    for (var row = 0; row < 4; row++) {
        for (var column = 0; column < 4; column++) {
            let texel = clamp(vec2i(base) + vec2i(column, row) - 1, vec2i(0), vec2i(side - 1));
            let tap = vec2f(f32(column), f32(row)) - 1.0 - f;
            if textureLoad(maps, texel, number, 0) <= max(depth + dot(gradient, tap), 0.0) {
                sum += columns[column] * rows[row];
            }
        }
    }
    return min(sum / 9.0, 1.0);
}
