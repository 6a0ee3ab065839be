// Accessor of `instances.wgsl` by a texture. The binding number is yours to change.

// `rg32uint`, any width: the decoder's values of a track, row by row.
@group(1) @binding(48) var dapple_instances_values: texture_2d<u32>;

fn dapple_instances_value(index: u32) -> vec2u {
    let width = textureDimensions(dapple_instances_values).x;
    return textureLoad(dapple_instances_values, vec2u(index % width, index / width), 0).xy;
}
