// Accessor of `vertices.wgsl` by a storage buffer. The binding number is yours to change.

// `VerticesValues` as it is: four values a word, low byte first.
@group(1) @binding(40) var<storage, read> dapple_vertices_values: array<u32>;

fn dapple_vertices_value(index: u32) -> u32 {
    return (dapple_vertices_values[index / 4u] >> (8u * (index % 4u))) & 0xffu;
}
