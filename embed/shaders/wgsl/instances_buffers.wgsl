// Accessor of `instances.wgsl` by a storage buffer. The binding number is yours to change.

// The decoder's values of a track: four snorm16 for each signal of an entry.
@group(1) @binding(48) var<storage, read> dapple_instances_values: array<vec2u>;

fn dapple_instances_value(index: u32) -> vec2u {
    return dapple_instances_values[index];
}
