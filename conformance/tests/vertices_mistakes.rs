//! The query vectors of `vertices` against samplers with a mistake: each mistake must show.

use dapple_codec::{Decoder, TrackState};
use dapple_conformance::generate;
use dapple_conformance::models::Query;
use dapple_conformance::models::vertices::queries::VerticesQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{Kind, Vector};

use Mistake::*;

/// What a sampler may get wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mistake {
    /// Values stand for v / 256.
    Over256,
    /// The corners in another order than the weights.
    CornersTurned,
    /// One third of each corner, whatever the weights.
    EqualWeights,
    /// The nearest corner alone.
    Nearest,
    /// The first signal alone.
    FirstSignal,
    /// The second signal alone.
    SecondSignal,
    /// The share is that of the first signal.
    ShareTurned,
    /// The share is 0.97, whatever the track says.
    UsualShare,
    /// The mean of both signals.
    MeanOfSignals,
    /// All values of the first signal, then all of the second.
    Planes,
    /// A share is applied to the one signal of a blend once more, as if the other were open.
    BlendsTwice,
    /// 5-bit codes are shifted to the top and not filled.
    Shifted,
    /// The track that comes first.
    FirstTrack,
    /// A track without content is closed.
    Closed,
}

const MISTAKES: [Mistake; 14] = [
    Over256,
    CornersTurned,
    EqualWeights,
    Nearest,
    FirstSignal,
    SecondSignal,
    ShareTurned,
    UsualShare,
    MeanOfSignals,
    Planes,
    BlendsTwice,
    Shifted,
    FirstTrack,
    Closed,
];

fn sample(decoder: &Decoder, query: &VerticesQuery, mistake: Option<Mistake>) -> Option<f64> {
    let wrong = |which: Mistake| mistake == Some(which);
    let named = |track: &&TrackState| track.track.id == query.track || wrong(FirstTrack);
    let live = decoder.tracks().iter().find(named)?;
    let vertices = live.track.vertices()?;
    let values = decoder.vertices().values_of(live);
    let count = usize::from(vertices.signals.count);
    if wrong(Closed) && values.iter().all(|&value| value == 255) {
        return Some(0.0);
    }
    let mut weights = query.weights.map(|weight| f64::from(weight) / 65536.0);
    if wrong(EqualWeights) {
        weights = [1.0 / 3.0; 3];
    }
    if wrong(Nearest) {
        let most = weights.iter().copied().fold(0.0, f64::max);
        weights = weights.map(|weight| f64::from(u8::from(weight == most)));
    }
    if wrong(CornersTurned) {
        weights.rotate_left(1);
    }
    let signal = |signal: usize| {
        let mut sum = 0.0;
        for (vertex, weight) in query.vertices.into_iter().zip(weights) {
            let at = match wrong(Planes) {
                true => signal * vertices.count as usize + vertex as usize,
                false => vertex as usize * count + signal,
            };
            let mut value = *values.get(at)?;
            if wrong(Shifted) && vertices.bits == 5 {
                value &= 0xf8;
            }
            sum += weight * f64::from(value);
        }
        Some(sum / if wrong(Over256) { 256.0 } else { 255.0 })
    };
    let first = signal(0)?;
    let share = f64::from(vertices.signals.share);
    if count == 1 {
        return Some(match wrong(BlendsTwice) {
            true => first + (1.0 - first) * share,
            false => first,
        });
    }
    let second = signal(1)?;
    let share = match mistake {
        Some(FirstSignal) => 0.0,
        Some(SecondSignal) => 1.0,
        Some(ShareTurned) => 1.0 - share,
        Some(UsualShare) => f64::from(0.97f32),
        Some(MeanOfSignals) => 0.5,
        _ => share,
    };
    Some(first + (second - first) * share)
}

fn right(decoder: &Decoder, query: &Query, mistake: Option<Mistake>) -> bool {
    let Query::Vertices(asked) = query else {
        return false;
    };
    sample(decoder, asked, mistake).is_some_and(|ao| query.accepts(&[ao]))
}

#[test]
fn each_mistake_of_a_sampler_of_vertices_shows() {
    let vectors = generate::all().expect("the vectors").into_iter();
    let asked = vectors.filter(|v| v.kind == Kind::Queries && v.area == "vertices");
    let decoded: Vec<(Vector, Decoder)> = asked
        .map(|vector| {
            let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
            (vector, decoder)
        })
        .collect();
    assert!(decoded.len() >= 8);
    let fails = |(vector, decoder): &&(Vector, Decoder), mistake| {
        let mut queries = vector.info.queries.iter();
        !queries.all(|query| right(decoder, query, mistake))
    };
    let failures = |mistake| decoded.iter().filter(|d| fails(d, mistake)).count();
    assert_eq!(failures(None), 0, "a sampler without a mistake");
    let unseen = MISTAKES.iter().filter(|&&m| failures(Some(m)) == 0);
    let unseen: Vec<_> = unseen.collect();
    assert!(
        unseen.is_empty(),
        "mistakes that no query shows: {unseen:?}"
    );
}
