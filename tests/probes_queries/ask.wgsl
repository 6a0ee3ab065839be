// Asks the sampler of `probes`, which stands before this: an invocation a question.

struct Question {
    position: vec3f,
    roughness: f32,
    normal: vec3f,
    visibility_weighted: u32,
    view: vec3f,
}

@group(0) @binding(0) var<storage, read> questions: array<Question>;
@group(1) @binding(0) var<uniform> volume: DappleProbesVolume;
@group(0) @binding(1) var<storage, read_write> answers: array<DappleProbesIncomingLight>;

@compute @workgroup_size(64)
fn ask(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) {
        return;
    }
    let q = questions[id.x];
    var radiance: DappleProbesL2;
    if q.visibility_weighted == 1u {
        radiance = dapple_probes_visibility_weighted(volume, q.position, q.normal, q.view);
    } else {
        radiance = dapple_probes_trilinear(volume, q.position);
    }
    answers[id.x] = dapple_probes_incoming_light(radiance, q.normal, q.view, q.roughness);
}
