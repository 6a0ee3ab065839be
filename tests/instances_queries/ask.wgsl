// Asks the sampler of `instances`, which stands before this: an invocation a question.

struct Question {
    position: vec3f,
    local: f32,
    entry: u32,
}

@group(0) @binding(0) var<storage, read> questions: array<Question>;
@group(1) @binding(0) var<uniform> table: DappleInstancesTable;
@group(0) @binding(1) var<storage, read_write> answers: array<f32>;

@compute @workgroup_size(64)
fn ask(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&questions) {
        return;
    }
    let q = questions[id.x];
    answers[id.x] = dapple_instances_ao(table, q.entry, q.position, q.local);
}
