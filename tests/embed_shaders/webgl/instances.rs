//! The query vectors of `instances` in WebGL 2.

use super::*;
use crate::instances_queries::{DeviceTable, Question, check, queries, track, vectors};
use dapple_conformance::reference;

const MAIN: &str = "layout(std140) uniform Parameters { DappleInstancesTable table; };
void main() {
    vec4 x = question(0);
    vec4 other = question(1);
    uint entry = other.y < 0.0 ? DAPPLE_INSTANCES_NO_ENTRY : uint(other.y);
    answer = vec4(dapple_instances_ao(table, entry, x.xyz, other.x));
}";

fn job(vector: &Vector, decoder: &Decoder) -> Job {
    let (live, table) = track(decoder);
    let question = |query| {
        let q = Question::of(decoder, query);
        let entry = if q.entry == u32::MAX {
            -1.0
        } else {
            q.entry as f32
        };
        let [x, y, z] = q.position;
        [[x, y, z, 0.0], [q.local, entry, 0.0, 0.0]]
    };
    let questions: Vec<_> = queries(vector).into_iter().map(question).collect();
    let values = cast_slice(decoder.instances().values_of(live));
    Job {
        name: vector.path(),
        fragment: fragment("instances", "textures", MAIN),
        size: [questions.len(), 1],
        textures: vec![
            Texture::questions(&questions),
            Texture::rows("dapple_instances_values", "rg32uint", 8, values),
        ],
        parameters: bytes_of(&DeviceTable::of(live, table)).to_vec(),
    }
}

#[test]
fn instances_answer_the_vectors() {
    let vectors = vectors();
    let decode = |vector: &Vector| reference::decoded(&vector.bytes).expect("a valid stream");
    let jobs: Vec<Job> = vectors.iter().map(|v| job(v, &decode(v))).collect();
    for (vector, pixels) in vectors.iter().zip(draw(&jobs).unwrap_or_default()) {
        for (number, pixel) in pixels.iter().enumerate() {
            check(vector, number, pixel[0]);
        }
    }
}
