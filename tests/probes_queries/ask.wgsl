// Asks the sampler of `probes/sample.wgsl`, which stands before this: an invocation a question.

struct Question {
    position: vec3f,
    roughness: f32,
    normal: vec3f,
    visibility_weighted: u32,
    view: vec3f,
}

@group(0) @binding(0) var<storage, read> questions: array<Question>;
@group(0) @binding(1) var<storage, read_write> answers: array<IncomingLight>;

@compute @workgroup_size(64)
fn ask(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) {
        return;
    }
    let q = questions[id.x];
    var radiance: L2;
    if q.visibility_weighted == 1u {
        radiance = visibility_weighted(q.position, q.normal, q.view);
    } else {
        radiance = trilinear(q.position);
    }
    answers[id.x] = incoming_light(radiance, q.normal, q.view, q.roughness);
}
