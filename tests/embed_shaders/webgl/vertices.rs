//! The query vectors of `vertices` in WebGL 2.

use super::*;
use crate::vertices_queries::answer_all;
use dapple::render::vertices::{Query, State};
use std::cell::RefCell;

const MAIN: &str = "void main() {
    vec4 vertices = question(0);
    vec4 weights = question(1);
    DappleVerticesMesh mesh = DappleVerticesMesh(uint(vertices.w), uint(weights.w), question(2).x);
    answer = vec4(dapple_vertices_ao(mesh, uvec3(vertices.xyz), weights.xyz));
}";

fn job(questions: &[Query], state: &State) -> Job {
    let question = |q: &Query| {
        let mesh = &state.meshes[q.mesh as usize];
        let ([a, b, c], [u, v, w]) = (q.vertices.map(|v| v as f32), q.weights);
        [
            [a, b, c, mesh.first as f32],
            [u, v, w, mesh.signals as f32],
            [mesh.share, 0.0, 0.0, 0.0],
        ]
    };
    let questions: Vec<_> = questions.iter().map(question).collect();
    Job {
        name: "vertices".into(),
        fragment: fragment("vertices", "textures", MAIN),
        size: [questions.len(), 1],
        textures: vec![
            Texture::questions(&questions),
            Texture::rows("dapple_vertices_values", "r8uint", 1, state.values),
        ],
        parameters: Vec::new(),
    }
}

#[test]
fn vertices_answer_the_vectors() {
    let jobs = RefCell::new(Vec::new());
    // Once to collect the questions, then to check the answers to all of them.
    answer_all(|questions, state| {
        jobs.borrow_mut().push(job(questions, state));
        dapple::render::vertices::sample_on_cpu(questions, state)
    });
    let Some(answers) = draw(&jobs.into_inner()) else {
        return;
    };
    let answers = RefCell::new(answers.into_iter());
    answer_all(|_, _| {
        let pixels = answers
            .borrow_mut()
            .next()
            .expect("a drawing for each vector");
        pixels.iter().map(|p| p[0]).collect()
    });
}
