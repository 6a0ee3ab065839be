// Sampler of the `vertices` model: ambient obscurance at a point of a triangle. Twin of `src/vertices/sample.rs`:
// same names without the prefix, same order of operations.
//
// The values come through a function, which `vertices_buffers.wgsl` and `vertices_textures.wgsl` define:
// - dapple_vertices_value(index: u32) -> u32: a byte of `VerticesValues`

// 12 bytes: where the values of a mesh are, and what they are.
struct DappleVerticesMesh {
    // Index of the first value.
    first: u32,
    // Signals of a vertex, 1 or 2.
    signals: u32,
    // Share of the second signal; 0 where there is one.
    share: f32,
}

fn dapple_vertices_signal(mesh: DappleVerticesMesh, vertices: vec3u, weights: vec3f, which: u32) -> f32 {
    let at = vertices * mesh.signals + mesh.first + which;
    let sum = weights.x * f32(dapple_vertices_value(at.x)) + weights.y * f32(dapple_vertices_value(at.y))
        + weights.z * f32(dapple_vertices_value(at.z));
    return sum / 255.0;
}

// AO at barycentric weights with the sum 1. `vertices` are counted as the track counts them.
fn dapple_vertices_ao(mesh: DappleVerticesMesh, vertices: vec3u, weights: vec3f) -> f32 {
    let a = dapple_vertices_signal(mesh, vertices, weights, 0u);
    if mesh.signals == 1u {
        return a;
    }
    let b = dapple_vertices_signal(mesh, vertices, weights, 1u);
    return a + (b - a) * mesh.share;
}
