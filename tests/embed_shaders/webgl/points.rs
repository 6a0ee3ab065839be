//! The query vectors of `points` in WebGL 2.

use super::*;
use crate::queries::{check, decoded, place, queries, vectors};

const MAIN: &str = "void main() {
    vec4 position = question(0);
    answer = vec4(dapple_points_ao(uint(position.w), position.xyz, question(1).xyz, 0u));
}";

/// A mirror, a turn and a shift, all of them exact: grid space has (2 - y, z - 4, x + 8).
const GRID_FROM_MESH: [[f32; 4]; 3] = [
    [0.0, -1.0, 0.0, 2.0],
    [0.0, 0.0, 1.0, -4.0],
    [1.0, 0.0, 0.0, 8.0],
];

fn job(vector: &Vector) -> Job {
    let decoded = decoded(vector);
    let mut tracks: Vec<u32> = Vec::new();
    for track in &decoded.tracks {
        let (grid, w) = (&track.grid, track.grid.widths);
        tracks.extend([track.first_bucket, track.first_cell]);
        tracks.extend([grid.bucket_count, grid.cell_capacity]);
        tracks.extend(grid.dims.map(u32::from));
        tracks.push(u32::from(w.position) | u32::from(w.normal) << 8 | u32::from(w.ao) << 16);
        tracks.extend([grid.cell_edge.to_bits(), grid.radius.to_bits(), 0, 0]);
        tracks.extend(GRID_FROM_MESH.as_flattened().iter().map(|v| v.to_bits()));
    }
    let question = |query| {
        let (x, n) = place(query);
        let track = decoded.track(query) as f32;
        [
            [x.z - 8.0, 2.0 - x.x, x.y + 4.0, track],
            [n.z, -n.x, n.y, 0.0],
        ]
    };
    let questions: Vec<_> = queries(vector).map(question).collect();
    let state = decoded.decoder.points();
    let words = |name, bytes: &[u8]| Texture::rows(name, "rgba32uint", 16, bytes);
    Job {
        name: vector.path(),
        fragment: fragment("points", "textures", MAIN),
        size: [questions.len(), 1],
        textures: vec![
            Texture::questions(&questions),
            words("dapple_points_tracks", cast_slice(&tracks)),
            words("dapple_points_buckets", cast_slice(state.buckets())),
            words("dapple_points_cells", cast_slice(state.cells())),
        ],
        parameters: Vec::new(),
    }
}

#[test]
fn points_answer_the_vectors() {
    let vectors = vectors();
    let jobs: Vec<Job> = vectors.iter().map(job).collect();
    for (vector, pixels) in vectors.iter().zip(draw(&jobs).unwrap_or_default()) {
        let results: Vec<f32> = pixels.iter().map(|p| p[0]).collect();
        check(vector, &results);
    }
}
