// Sampler of the `regions` model: the ambient obscurance of an object at a place. Twin of
// `src/regions/sample.rs`: same names without the prefix, same order of operations. The index of the region comes
// with the object. Positions and normals are in the track's space.
//
// The arrays come through three functions, which `regions_buffers.wgsl` and `regions_textures.wgsl` define:
// - dapple_regions_count() -> u32
// - dapple_regions_region(index: u32) -> DappleRegionsRegion
// - dapple_regions_pair(index: u32) -> u32: two signed values of 16 bits

// 48 bytes.
struct DappleRegionsRegion {
    min: vec3f,
    // Index of its first pair.
    first: u32,
    max: vec3f,
    // Bits 0 and 1 derivatives, 2 and 3 degree, 4 signals less one.
    form: u32,
    centre: vec3f,
    reserved: u32,
}

// 16 bytes.
struct DappleRegionsSet {
    // What a value of 1 stands for.
    scale: f32,
    // Share of the second signal.
    share: f32,
}

fn dapple_regions_value(region_set: DappleRegionsSet, at: u32) -> f32 {
    let pair = dapple_regions_pair(at / 2u);
    let low = select(pair << 16u, pair, (at & 1u) == 1u);
    return f32(bitcast<i32>(low) >> 16u) * region_set.scale;
}

// How far a place is from the centre, in half extents.
fn dapple_regions_offsets(region: DappleRegionsRegion, p: vec3f) -> vec3f {
    let half_extent = (region.max - region.min) * 0.5;
    let away = min(max(p, region.min), region.max) - region.centre;
    let flat_axis = half_extent <= vec3f(0.0);
    return select(away / select(half_extent, vec3f(1.0), flat_axis), vec3f(0.0), flat_axis);
}

fn dapple_regions_polynomial(k: u32, n: vec3f) -> f32 {
    switch k {
        case 0u: { return 1.0; }
        case 1u: { return n.y; }
        case 2u: { return n.z; }
        case 3u: { return n.x; }
        case 4u: { return n.x * n.y; }
        case 5u: { return n.y * n.z; }
        case 6u: { return 3.0 * n.z * n.z - 1.0; }
        case 7u: { return n.x * n.z; }
        default: { return n.x * n.x - n.y * n.y; }
    }
}

// AO at a place with unit normal n by the region of an index; 1 where there is none of the index.
fn dapple_regions_sample(region_set: DappleRegionsSet, index: u32, p: vec3f, n: vec3f) -> f32 {
    if index >= dapple_regions_count() {
        return 1.0;
    }
    let region = dapple_regions_region(index);
    let u = dapple_regions_offsets(region, p);
    let derivatives = region.form & 3u;
    let side = ((region.form >> 2u) & 3u) + 1u;
    let count = side * side;
    let signals = ((region.form >> 4u) & 1u) + 1u;
    // The row of each axis on this side of the centre.
    var rows = vec3u(1u, 2u, 3u);
    if derivatives == 2u {
        rows = vec3u(1u, 3u, 5u) + vec3u(u < vec3f(0.0));
    }
    let first = 2u * region.first;
    var sum = vec2f(0.0);
    for (var k = 0u; k < count; k++) {
        var at = first + k * signals;
        var c = vec2f(
            dapple_regions_value(region_set, at),
            dapple_regions_value(region_set, at + signals - 1u),
        );
        if derivatives != 0u {
            for (var axis = 0u; axis < 3u; axis++) {
                at = first + (rows[axis] * count + k) * signals;
                c += vec2f(
                    dapple_regions_value(region_set, at),
                    dapple_regions_value(region_set, at + signals - 1u),
                ) * u[axis];
            }
        }
        sum += c * dapple_regions_polynomial(k, n);
    }
    let signal = clamp(sum, vec2f(0.0), vec2f(1.0));
    return signal.x + (signal.y - signal.x) * region_set.share;
}
