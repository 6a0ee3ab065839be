// Visibility pass: which instance and triangle does each pixel's centre see. Vertices are pulled
// from storage buffers and each triangle is drawn without an index buffer, so that
// `vertex_index / 3` names the triangle on any device. One pipeline draws everything: culling and
// alpha masks are decided per fragment, from flags.

const DOUBLE_SIDED: u32 = 1u; // SHARED with `raster.rs`
const MASKED: u32 = 2u; // SHARED
const BLENDED: u32 = 4u; // SHARED
const NONE: u32 = 0xffffffffu; // SHARED

struct Camera {
    clip_from_world: mat4x4f,
}

// 80 bytes.
struct Instance {
    world_from_mesh: mat4x3f,
    // First vertex in `positions`, first corner in `corners` (NONE: no masks), first triangle.
    first_position: u32,
    first_corner: u32,
    first_triangle: u32,
    mirrored: u32,
}

// 32 bytes.
struct Material {
    flags: u32,
    cutoff: f32,
    alpha: f32,
    // Byte of the first texel in `alphas`, or NONE; size; wrap modes.
    first_texel: u32,
    width: u32,
    height: u32,
    wrap_s: u32,
    wrap_t: u32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> positions: array<f32>;
// What masks need of each corner of each triangle: coordinates on the texture, the alpha of the vertex,
// and 1 where there are such coordinates.
@group(0) @binding(3) var<storage, read> corners: array<vec4f>;
// Three corners and the material.
@group(0) @binding(4) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var<storage, read> alphas: array<u32>;

struct Corner {
    @builtin(position) clip: vec4f,
    // Of `corners`.
    @location(0) mask: vec4f,
    // Instance, triangle, material, mirrored.
    @location(1) @interpolate(flat) id: vec4u,
}

@vertex
fn corner(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Corner {
    let instance = instances[index];
    let triangle = triangles[instance.first_triangle + vertex / 3u];
    var vertices = array<u32, 3>(triangle.x, triangle.y, triangle.z);
    let at = vertices[vertex % 3u];
    let p = 3u * (instance.first_position + at);
    let position = vec3f(positions[p], positions[p + 1u], positions[p + 2u]);
    let world = instance.world_from_mesh * vec4f(position, 1.0);
    var out: Corner;
    out.clip = camera.clip_from_world * vec4f(world, 1.0);
    if (materials[triangle.w].flags & BLENDED) != 0u {
        // All three corners beyond one side: clipped away.
        out.clip = vec4f(2.0, 2.0, 2.0, 1.0);
    }
    if instance.first_corner != NONE {
        out.mask = corners[instance.first_corner + vertex];
    }
    out.id = vec4u(index, vertex / 3u, triangle.w, instance.mirrored);
    return out;
}

fn wrap(at: i32, size: i32, mode: u32) -> i32 {
    if mode == 2u {
        return clamp(at, 0, size - 1);
    }
    let period = select(size, 2 * size, mode == 1u);
    let i = ((at % period) + period) % period;
    return select(i, 2 * size - 1 - i, i >= size);
}

// Twin of `Scene::alpha_is_hole`: nearest texel.
fn is_hole(m: Material, mask: vec4f) -> bool {
    var alpha = m.alpha * mask.z;
    if m.first_texel != NONE && mask.w > 0.5 {
        let at = vec2i(floor(mask.xy * vec2f(vec2u(m.width, m.height))));
        let s = u32(wrap(at.x, i32(m.width), m.wrap_s));
        let t = u32(wrap(at.y, i32(m.height), m.wrap_t));
        let byte = m.first_texel + t * m.width + s;
        alpha *= f32(extractBits(alphas[byte / 4u], 8u * (byte % 4u), 8u)) / 255.0;
    }
    return alpha < m.cutoff;
}

// Instance + 1 (0 is the sky) and triangle.
@fragment
fn seen(in: Corner, @builtin(front_facing) front: bool) -> @location(0) vec2u {
    let m = materials[in.id.z];
    if front == (in.id.w != 0u) && (m.flags & DOUBLE_SIDED) == 0u {
        discard;
    }
    if (m.flags & MASKED) != 0u && is_hole(m, in.mask) {
        discard;
    }
    return vec2u(in.id.x + 1u, in.id.y);
}

// Nothing but depth, of both sides of a surface: what a shadow map sees.
@fragment
fn covers(in: Corner) {
    let m = materials[in.id.z];
    if (m.flags & MASKED) != 0u && is_hole(m, in.mask) {
        discard;
    }
}
