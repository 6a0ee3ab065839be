// The client's sampler of the `vertices` model: ambient obscurance at a point of a triangle. Twin of
// `sample.rs`: same names, same order of operations.

// 12 bytes: where the values of a mesh are, and what they are.
struct MeshValues {
    // Index of the first value.
    first: u32,
    // Signals of a vertex, 1 or 2.
    signals: u32,
    // Share of the second signal; 0 where there is one.
    share: f32,
}

// The decoder's values, four a word, low byte first.
@group(1) @binding(0) var<storage, read> values: array<u32>;

fn value(index: u32) -> f32 {
    return f32((values[index / 4u] >> (8u * (index % 4u))) & 0xffu);
}

fn signal(mesh: MeshValues, vertices: vec3u, weights: vec3f, which: u32) -> f32 {
    let at = vertices * mesh.signals + mesh.first + which;
    let sum = weights.x * value(at.x) + weights.y * value(at.y) + weights.z * value(at.z);
    return sum / 255.0;
}

// AO at barycentric weights with the sum 1. `vertices` are counted as the track counts them.
fn ao(mesh: MeshValues, vertices: vec3u, weights: vec3f) -> f32 {
    let a = signal(mesh, vertices, weights, 0u);
    if mesh.signals == 1u {
        return a;
    }
    let b = signal(mesh, vertices, weights, 1u);
    return a + (b - a) * mesh.share;
}
