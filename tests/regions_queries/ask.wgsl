// Asks the sampler of `regions`, which stands before this: an invocation a question.

struct Question {
    position: vec3f,
    region: u32,
    normal: vec3f,
}

@group(0) @binding(0) var<storage, read> questions: array<Question>;
@group(1) @binding(0) var<uniform> region_set: DappleRegionsSet;
@group(0) @binding(1) var<storage, read_write> answers: array<f32>;

@compute @workgroup_size(64)
fn ask(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) {
        return;
    }
    let q = questions[id.x];
    answers[id.x] = dapple_regions_sample(region_set, q.region, q.position, q.normal);
}
