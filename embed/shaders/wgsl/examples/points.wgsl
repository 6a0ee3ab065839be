// A fragment shader with `points.wgsl` and one of its accessors: the ambient term times AO.

struct Fragment {
    // Mesh space; of the rest pose where the track is looked up there.
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    // Number of the instance's track, or DAPPLE_POINTS_NONE.
    @location(2) @interpolate(flat) track: u32,
    @location(3) ambient: vec3f,
}

@fragment
fn example(f: Fragment) -> @location(0) vec4f {
    let n = normalize(f.normal);
    let ao = dapple_points_ao(f.track, f.position, n, DAPPLE_POINTS_FALLBACK_FILL);
    return vec4f(f.ambient * ao, 1.0);
}
