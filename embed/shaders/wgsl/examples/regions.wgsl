// A fragment shader with `regions.wgsl` and one of its accessors: the ambient term times AO.

struct Fragment {
    // In the track's space.
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Index of the region of the object's place.
    @location(2) @interpolate(flat) region: u32,
    @location(3) ambient: vec3f,
}

@group(0) @binding(0) var<uniform> region_set: DappleRegionsSet;

@fragment
fn example(f: Fragment) -> @location(0) vec4f {
    let ao = dapple_regions_sample(region_set, f.region, f.position, normalize(f.normal));
    return vec4f(f.ambient * ao, 1.0);
}
