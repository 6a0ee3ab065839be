// The client's sampler of the `instances` model: the ambient obscurance of a place on a mesh
// instance. Twin of `sample.rs`: same names, same order of operations.

// What an instance without an entry passes as its entry.
const NO_ENTRY: u32 = 0xffffffffu;

// 48 bytes: a table, which belongs to one mesh.
struct Table {
    // Middle of the mesh's bounds, mesh space, metres.
    centre: vec3f,
    // Share of the second signal; 0 where there is one.
    share: f32,
    // One over half the extent; 0 along an axis without extent.
    per_half_extent: vec3f,
    // Two to the table's exponent.
    scale: f32,
    // 1 or 2.
    signals: u32,
}

@group(1) @binding(0) var<uniform> table: Table;
// The decoder's values: four snorm16 for each signal of an entry.
@group(1) @binding(1) var<storage, read> values: array<vec2u>;

// A coefficient from the low 16 bits: a signed normalised number, times the scale.
fn coefficient(bits: u32) -> f32 {
    return f32(bitcast<i32>(bits << 16u) >> 16u) / 32767.0 * table.scale;
}

fn coefficients(value: vec2u) -> vec4f {
    return vec4f(coefficient(value.x), coefficient(value.x >> 16u), coefficient(value.y), coefficient(value.y >> 16u));
}

fn normalized(position: vec3f) -> vec3f {
    return clamp((position - table.centre) * table.per_half_extent, vec3f(-1.0), vec3f(1.0));
}

fn signal(c: vec4f, u: vec3f) -> f32 {
    return max(c.x + c.y * u.x + c.z * u.y + c.w * u.z, 0.0);
}

// What the rest of the scene leaves of the local AO; it may be above 1.
fn global(entry: u32, position: vec3f) -> f32 {
    if entry == NO_ENTRY {
        return 1.0;
    }
    let u = normalized(position);
    let first = entry * table.signals;
    let a = signal(coefficients(values[first]), u);
    if table.signals == 1u {
        return a;
    }
    let b = signal(coefficients(values[first + 1u]), u);
    return a + (b - a) * table.share;
}

// AO at a position in mesh space, with the local AO of the mesh there, 1 where it has none.
fn ao(entry: u32, position: vec3f, local: f32) -> f32 {
    return clamp(global(entry, position) * local, 0.0, 1.0);
}
