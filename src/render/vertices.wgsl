// The pass of the `vertices` model: the sampler for each query.

struct Pass {
    count: u32,
    // Lanes of a row of workgroups.
    row: u32,
}

// 32 bytes.
struct Query {
    vertices: vec3u,
    mesh: u32,
    weights: vec3f,
}

@group(0) @binding(0) var<uniform> pass_: Pass;
@group(0) @binding(1) var<storage, read> queries: array<Query>;
@group(0) @binding(2) var<storage, read_write> results: array<f32>;
@group(1) @binding(41) var<storage, read> meshes: array<DappleVerticesMesh>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.y * pass_.row + id.x;
    if i >= pass_.count {
        return;
    }
    let query = queries[i];
    results[i] = dapple_vertices_ao(meshes[query.mesh], query.vertices, query.weights);
}
