// Sampler of the `instances` model: the ambient obscurance of a place on a mesh instance. Twin of
// `src/instances/sample.rs`: same names without the prefix, same order of operations.
//
// The values come through a function, which `instances_buffers.wgsl` and `instances_textures.wgsl` define:
// - dapple_instances_value(index: u32) -> vec2u: four snorm16

// What an instance without an entry passes as its entry.
const DAPPLE_INSTANCES_NO_ENTRY: u32 = 0xffffffffu;

// 48 bytes: a table, which belongs to one mesh.
struct DappleInstancesTable {
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

// A coefficient from the low 16 bits: a signed normalised number, times the scale.
fn dapple_instances_coefficient(table: DappleInstancesTable, bits: u32) -> f32 {
    return f32(bitcast<i32>(bits << 16u) >> 16u) / 32767.0 * table.scale;
}

fn dapple_instances_coefficients(table: DappleInstancesTable, value: vec2u) -> vec4f {
    return vec4f(
        dapple_instances_coefficient(table, value.x),
        dapple_instances_coefficient(table, value.x >> 16u),
        dapple_instances_coefficient(table, value.y),
        dapple_instances_coefficient(table, value.y >> 16u),
    );
}

fn dapple_instances_normalized(table: DappleInstancesTable, position: vec3f) -> vec3f {
    return clamp((position - table.centre) * table.per_half_extent, vec3f(-1.0), vec3f(1.0));
}

fn dapple_instances_signal(c: vec4f, u: vec3f) -> f32 {
    return max(c.x + c.y * u.x + c.z * u.y + c.w * u.z, 0.0);
}

// What the rest of the scene leaves of the local AO; it may be above 1.
fn dapple_instances_global(table: DappleInstancesTable, entry: u32, position: vec3f) -> f32 {
    if entry == DAPPLE_INSTANCES_NO_ENTRY {
        return 1.0;
    }
    let u = dapple_instances_normalized(table, position);
    let first = entry * table.signals;
    let a = dapple_instances_signal(dapple_instances_coefficients(table, dapple_instances_value(first)), u);
    if table.signals == 1u {
        return a;
    }
    let b = dapple_instances_signal(dapple_instances_coefficients(table, dapple_instances_value(first + 1u)), u);
    return a + (b - a) * table.share;
}

// AO at a position in mesh space, with the local AO of the mesh there, 1 where it has none.
fn dapple_instances_ao(table: DappleInstancesTable, entry: u32, position: vec3f, local: f32) -> f32 {
    return clamp(dapple_instances_global(table, entry, position) * local, 0.0, 1.0);
}
