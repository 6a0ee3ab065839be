// A fragment shader with `probes.wgsl` and one of its accessors: indirect light of a metallic-roughness material.

struct Fragment {
    // World space.
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) to_viewer: vec3f,
    @location(3) base_color: vec3f,
    // Metallic and roughness.
    @location(4) material: vec2f,
    // 1: weighted by visibility, which keeps light from passing through walls; 0: the texture unit's filter.
    @location(5) @interpolate(flat) weighted: u32,
}

@group(0) @binding(0) var<uniform> volume: DappleProbesVolume;

@fragment
fn example(f: Fragment) -> @location(0) vec4f {
    let x = volume.grid_from_world * vec4f(f.position, 1.0);
    let n = volume.grid_from_world * vec4f(normalize(f.normal), 0.0);
    let v = volume.grid_from_world * vec4f(normalize(f.to_viewer), 0.0);
    var radiance: DappleProbesL2;
    if f.weighted == 1u {
        radiance = dapple_probes_visibility_weighted(volume, x, n, v);
    } else {
        radiance = dapple_probes_trilinear(volume, x);
    }
    let light = dapple_probes_shade(radiance, f.base_color, f.material.x, f.material.y, n, v);
    return vec4f(light.diffuse + light.glossy, 1.0);
}
