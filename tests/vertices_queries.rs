//! The samplers of the client against the query vectors of `vertices`: `vertices/sample.rs` on the CPU and,
//! where there is an adapter, `embed/shaders/wgsl/vertices.wgsl` in its pass.

use dapple::codec::Decoder;
use dapple::render::gpu::Gpu;
use dapple::render::vertices::{Query as Question, State, VerticesPass, sample_on_cpu};
use dapple::vertices::client::values_of;
use dapple::vertices::sample::MeshValues;
use dapple_conformance::models::Query;
use dapple_conformance::models::vertices::queries::VerticesQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{self, Kind, Vector};

/// Checks what `sample` answers to the questions of every vector.
pub(crate) fn answer_all(sample: impl Fn(&[Question], &State) -> Vec<f32>) {
    let mut vectors = vector::load(&vector::folder()).expect("the vectors");
    vectors.retain(|vector| vector.kind == Kind::Queries && vector.area == "vertices");
    assert!(vectors.len() >= 4, "{} vectors", vectors.len());
    for vector in vectors {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        let (tracks, meshes) = meshes(&decoder);
        let questions: Vec<Question> = vector
            .info
            .queries
            .iter()
            .map(|q| question(q, &tracks))
            .collect();
        let state = State {
            values: decoder.vertices().values(),
            meshes: &meshes,
        };
        check(&vector, &sample(&questions, &state));
    }
}

/// Ids of the tracks, and where their values are.
fn meshes(decoder: &Decoder) -> (Vec<u32>, Vec<MeshValues>) {
    let tracks = decoder.tracks().iter();
    let found = tracks.filter_map(|live| {
        let values = values_of(decoder.vertices(), live, live.track.vertices()?)?;
        Some((live.track.id, values))
    });
    found.unzip()
}

fn question(query: &Query, tracks: &[u32]) -> Question {
    let Query::Vertices(VerticesQuery {
        track,
        vertices,
        weights,
        ..
    }) = query
    else {
        panic!("not of vertices: {query:?}");
    };
    let mesh = tracks.iter().position(|id| id == track).expect("a track");
    Question {
        vertices: *vertices,
        mesh: mesh as u32,
        weights: weights.map(|w| w as f32 / 65536.0),
        pad: 0,
    }
}

fn check(vector: &Vector, answers: &[f32]) {
    assert_eq!(answers.len(), vector.info.queries.len());
    for (query, ao) in vector.info.queries.iter().zip(answers) {
        let path = vector.path();
        assert!(
            query.accepts(&[f64::from(*ao)]),
            "{path}: {ao} for {query:?}"
        );
    }
}

#[test]
fn on_the_cpu() {
    answer_all(sample_on_cpu);
}

#[test]
fn on_a_device() {
    let gpu = match Gpu::new() {
        Ok(gpu) => gpu,
        Err(e) if std::env::var_os("CI").is_some() => panic!("CI needs an adapter: {e}"),
        Err(e) => {
            eprintln!("skipped: {e}");
            return;
        }
    };
    let pass = VerticesPass::new(&gpu).expect("the shader is sound");
    answer_all(|questions, state| pass.sample(&gpu, questions, state).expect("answers"));
}
