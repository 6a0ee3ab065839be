// A fragment shader with `instances.wgsl` and one of its accessors: the ambient term times AO.

struct Fragment {
    // Mesh space.
    @location(0) position: vec3f,
    // The instance's entry, or DAPPLE_INSTANCES_NO_ENTRY.
    @location(1) @interpolate(flat) entry: u32,
    // Local AO of the mesh there, 1 where it has none.
    @location(2) local: f32,
    @location(3) ambient: vec3f,
}

@group(0) @binding(0) var<uniform> table: DappleInstancesTable;

@fragment
fn example(f: Fragment) -> @location(0) vec4f {
    return vec4f(f.ambient * dapple_instances_ao(table, f.entry, f.position, f.local), 1.0);
}
