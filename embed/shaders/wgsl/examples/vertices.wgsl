// A fragment shader with `vertices.wgsl` and one of its accessors: the ambient term times AO.

struct Fragment {
    // The triangle's vertices as the track counts them, and weights with the sum 1.
    @location(0) @interpolate(flat) vertices: vec3u,
    @location(1) weights: vec3f,
    @location(2) ambient: vec3f,
}

@group(0) @binding(0) var<uniform> mesh: DappleVerticesMesh;

@fragment
fn example(f: Fragment) -> @location(0) vec4f {
    return vec4f(f.ambient * dapple_vertices_ao(mesh, f.vertices, f.weights), 1.0);
}
