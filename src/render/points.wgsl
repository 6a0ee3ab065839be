// The pass of the `points` model: the sampler for each query, one a pixel.

struct Pass {
    width: u32,
    height: u32,
    fallback: u32,
    pad: u32,
}

// 32 bytes. Position and unit normal in grid space.
struct Query {
    position: vec3f,
    track: u32,
    normal: vec3f,
    pad: u32,
}

@group(0) @binding(0) var<uniform> pass_: Pass;
@group(0) @binding(1) var<storage, read> queries: array<Query>;
@group(0) @binding(2) var<storage, read_write> results: array<DapplePointsResult>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= pass_.width || id.y >= pass_.height {
        return;
    }
    let i = id.y * pass_.width + id.x;
    let query = queries[i];
    if query.track == DAPPLE_POINTS_NONE {
        results[i] = DapplePointsResult(1.0, DAPPLE_POINTS_CASE_NONE);
        return;
    }
    let track = dapple_points_track(query.track);
    results[i] = dapple_points_sample(track, query.position, query.normal, pass_.fallback);
}
