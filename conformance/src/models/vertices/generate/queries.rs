//! Query vectors, clauses V-050 and O-010.

use super::{AREA, Draft, Vertices, some, streams};
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::models::Query;
use crate::models::signals::SignalsBlock;
use crate::models::vertices::queries::VerticesQuery;

/// How far a sampler may be from the exact AO: 4 of the 65536 steps of a query's bounds. In f32 each of
/// some ten roundings is below 2^-24 of a number up to 1.
const TOLERANCE: f64 = 4.0 / 65536.0;

pub fn add(drafts: &mut Vec<Draft>) {
    let share = |share: f32| SignalsBlock {
        share,
        ..SignalsBlock::TWO
    };
    let with = |signals: SignalsBlock, vertices: Vertices| Vertices {
        signals,
        ..vertices
    };
    let cases: [(&str, &str, Vertices); 7] = [
        ("one-signal", "One signal.", Vertices::raw(9)),
        (
            "five-bits",
            "One signal at 5 bits.",
            Vertices::packed(9).five(),
        ),
        (
            "blended",
            "One signal that is a blend already: the share does nothing more.",
            with(SignalsBlock::BLENDED, Vertices::raw(9)),
        ),
        ("two-signals", "Two signals.", Vertices::packed(9).two()),
        (
            "share-0",
            "Two signals of which the first is shown.",
            with(share(0.0), Vertices::raw(9)),
        ),
        (
            "share-1",
            "Two signals of which the second is shown.",
            with(share(1.0), Vertices::raw(9)),
        ),
        (
            "two-signals-five-bits",
            "Two signals at 5 bits.",
            with(share(0.97), Vertices::packed(9).five()),
        ),
    ];
    for (name, comment, vertices) in cases {
        let codes = some(&vertices, 3);
        let frames = streams(&[Vertices::raw(3), vertices])
            .vertices(&[(1, vec![1, 2, 3]), (2, codes)])
            .commit();
        drafts.push(draft(name, comment, &frames, 2));
    }
    let open = streams(&[Vertices::packed(9).two()]).commit();
    drafts.push(draft("open", "A track without content: AO is 1.", &open, 1));
}

/// A stream with queries about a track of nine vertices.
fn draft(name: &str, comment: &str, frames: &Frames, track: u32) -> Draft {
    let queries = queries(frames, track).into_iter().map(Query::Vertices);
    Draft::query(
        AREA,
        name,
        &["V-050", "O-010"],
        comment,
        frames.ended(),
        queries.collect(),
    )
}

/// At corners, on edges, and within triangles.
fn queries(frames: &Frames, track: u32) -> Vec<VerticesQuery> {
    let content = frames.tracks.iter().find(|t| t.entry.id == track);
    let Some(values) = content.and_then(|content| content.values()) else {
        return Vec::new();
    };
    let mut draw = Draw(11);
    let mut weights = vec![
        [65536, 0, 0],
        [0, 65536, 0],
        [0, 0, 65536],
        [32768, 32768, 0],
        [1, 0, 65535],
        [21845, 21845, 21846],
    ];
    for _ in 0..10 {
        let first = draw.below(65537);
        let second = draw.below(65537 - first);
        weights.push([first, second, 65536 - first - second]);
    }
    weights
        .into_iter()
        .map(|weights| {
            let vertices = [0, 1, 2].map(|_| draw.below(values.vertices.count));
            let ao = values.look_up(vertices, weights);
            let end = |ao: f64| (ao * 65536.0).clamp(0.0, 65536.0);
            VerticesQuery {
                track,
                vertices,
                weights,
                ao: [
                    end(ao - TOLERANCE).floor() as u32,
                    end(ao + TOLERANCE).ceil() as u32,
                ],
            }
        })
        .collect()
}
