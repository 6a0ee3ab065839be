// Accessor of `vertices.wgsl` by a texture. The binding number is yours to change.

// `r8uint`, any width: the bytes of `VerticesValues` row by row.
@group(1) @binding(40) var dapple_vertices_values: texture_2d<u32>;

fn dapple_vertices_value(index: u32) -> u32 {
    let width = textureDimensions(dapple_vertices_values).x;
    return textureLoad(dapple_vertices_values, vec2u(index % width, index / width), 0).x;
}
