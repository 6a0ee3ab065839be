// Accessors of `regions.wgsl` by textures alone. The binding numbers are yours to change.

// `rgba32uint`, three texels wide: a region a row.
@group(1) @binding(56) var dapple_regions_regions: texture_2d<u32>;
// `r32uint`, any width: the pairs row by row.
@group(1) @binding(57) var dapple_regions_pairs: texture_2d<u32>;

fn dapple_regions_count() -> u32 {
    return textureDimensions(dapple_regions_regions).y;
}

fn dapple_regions_region(index: u32) -> DappleRegionsRegion {
    let a = textureLoad(dapple_regions_regions, vec2u(0u, index), 0);
    let b = textureLoad(dapple_regions_regions, vec2u(1u, index), 0);
    let c = textureLoad(dapple_regions_regions, vec2u(2u, index), 0);
    return DappleRegionsRegion(
        bitcast<vec3f>(a.xyz), a.w, bitcast<vec3f>(b.xyz), b.w, bitcast<vec3f>(c.xyz), c.w,
    );
}

fn dapple_regions_pair(index: u32) -> u32 {
    let width = textureDimensions(dapple_regions_pairs).x;
    return textureLoad(dapple_regions_pairs, vec2u(index % width, index / width), 0).x;
}
