//! The query vectors of `regions` against samplers with a mistake: each mistake must show.

use dapple_codec::regions::{Derivatives, Region};
use dapple_codec::{Decoder, TrackState};
use dapple_conformance::models::Query;
use dapple_conformance::models::regions::queries::RegionsQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{self, Kind};

/// What a sampler may get wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mistake {
    Right,
    /// The first of the smallest boxes becomes the last.
    LastOfEqual,
    LargestVolume,
    SumOfEdges,
    FirstBox,
    DistanceToMiddle,
    ManhattanDistance,
    NoClampOfPosition,
    CentreIgnored,
    WholeExtent,
    FlatOffset,
    SidesSwapped,
    SidesPositive,
    AxesRotated,
    PolynomialsInOrderXyz,
    SquareOfY,
    SquareWithoutThree,
    ExponentIgnored,
    OneSignalOnlyFirst,
    NotClampedBelow,
    NotClampedAbove,
    ClampedAfterBlend,
    ShareOfFirst,
    SignalsApart,
    EmptyIsDark,
}

use Mistake::*;

const MISTAKES: [Mistake; 24] = [
    LastOfEqual,
    LargestVolume,
    SumOfEdges,
    FirstBox,
    DistanceToMiddle,
    ManhattanDistance,
    NoClampOfPosition,
    CentreIgnored,
    WholeExtent,
    FlatOffset,
    SidesSwapped,
    SidesPositive,
    AxesRotated,
    PolynomialsInOrderXyz,
    SquareOfY,
    SquareWithoutThree,
    ExponentIgnored,
    OneSignalOnlyFirst,
    NotClampedBelow,
    NotClampedAbove,
    ClampedAfterBlend,
    ShareOfFirst,
    SignalsApart,
    EmptyIsDark,
];

fn along(v: [f32; 3]) -> [f64; 3] {
    v.map(f64::from)
}

/// What decides between boxes, the least first.
fn key(region: &Region, p: [f64; 3], mistake: Mistake) -> [f64; 2] {
    let (min, max) = (along(region.min), along(region.max));
    let size = [0, 1, 2].map(|axis| max[axis] - min[axis]);
    let away = [0, 1, 2].map(|axis| match mistake {
        DistanceToMiddle => p[axis] - 0.5 * (min[axis] + max[axis]),
        _ => p[axis] - p[axis].clamp(min[axis], max[axis]),
    });
    let distance = match mistake {
        ManhattanDistance => away.iter().map(|d| d.abs()).sum(),
        _ => away.iter().map(|d| d * d).sum(),
    };
    let volume = size.iter().product::<f64>();
    match mistake {
        LargestVolume => [distance, -volume],
        SumOfEdges => [distance, size.iter().sum()],
        FirstBox => [distance, 0.0],
        _ => [distance, volume],
    }
}

/// The AO of a query, in f64.
fn sample(decoder: &Decoder, live: &TrackState, query: &RegionsQuery, mistake: Mistake) -> f64 {
    let set = live.track.region_set().expect("a track of regions");
    let regions = decoder.regions().regions_of(live);
    let p = query.position.map(|v| f64::from(v) / 65536.0);
    let mut best: Option<(&Region, [f64; 2])> = None;
    for region in regions {
        let key = key(region, p, mistake);
        let wins = best.is_none_or(|(_, best)| match mistake {
            LastOfEqual => key <= best,
            _ => key < best,
        });
        if wins {
            best = Some((region, key));
        }
    }
    let Some((region, _)) = best else {
        return if mistake == EmptyIsDark { 0.0 } else { 1.0 };
    };
    let form = region.form().expect("a form");
    let values = decoder.regions().pairs_of(live)[region.first as usize..].as_flattened();
    let u = [0, 1, 2].map(|axis| offset(region, p[axis], axis, mistake));
    let n = query.normal.map(f64::from);
    let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
    let functions = polynomials(n.map(|v| v / length), mistake);
    let exponent = match mistake {
        ExponentIgnored => 0,
        _ => i32::from(set.exponent),
    };
    let (signals, count) = (usize::from(form.signals), form.polynomials());
    let mut sums = [0.0; 2];
    for (i, &value) in values[..form.coefficients()].iter().enumerate() {
        let (s, k, row) = match mistake {
            SignalsApart => {
                let each = form.coefficients() / signals;
                (i / each, i % each % count, i % each / count)
            }
            _ => (i % signals, i / signals % count, i / signals / count),
        };
        let value = f64::from(value) / 32767.0 * 2f64.powi(exponent);
        let term = value * factor(form.derivatives, row, u, mistake) * functions[k];
        sums[s] += term;
        if signals == 1 && mistake != OneSignalOnlyFirst {
            sums[1] += term;
        }
    }
    let share = f64::from(set.signals.share);
    let blend = |[a, b]: [f64; 2]| match (set.signals.count, mistake) {
        (1, _) => a,
        (_, ShareOfFirst) => b + (a - b) * share,
        _ => a + (b - a) * share,
    };
    match mistake {
        NotClampedBelow => blend(sums.map(|s| s.min(1.0))),
        NotClampedAbove => blend(sums.map(|s| s.max(0.0))),
        ClampedAfterBlend => blend(sums).clamp(0.0, 1.0),
        _ => blend(sums.map(|s| s.clamp(0.0, 1.0))),
    }
}

fn offset(region: &Region, p: f64, axis: usize, mistake: Mistake) -> f64 {
    let (min, max) = (along(region.min)[axis], along(region.max)[axis]);
    let centre = match mistake {
        CentreIgnored => 0.5 * (min + max),
        _ => along(region.centre)[axis],
    };
    let half = match mistake {
        WholeExtent => max - min,
        _ => 0.5 * (max - min),
    };
    let p = match mistake {
        NoClampOfPosition => p,
        _ => p.clamp(min, max),
    };
    match half > 0.0 {
        true => (p - centre) / half,
        false => f64::from(u8::from(mistake == FlatOffset)),
    }
}

/// What a row is multiplied by.
fn factor(derivatives: Derivatives, row: usize, u: [f64; 3], mistake: Mistake) -> f64 {
    let axis_of = |axis: usize| match mistake {
        AxesRotated => u[(axis + 1) % 3],
        _ => u[axis],
    };
    match (derivatives, row) {
        (_, 0) => 1.0,
        (Derivatives::Sided, _) => {
            let u = axis_of((row - 1) / 2);
            let below = (row - 1) % 2 == 1;
            match mistake {
                SidesSwapped if below => u.max(0.0),
                SidesSwapped => u.min(0.0),
                SidesPositive if below => (-u).max(0.0),
                _ if below => u.min(0.0),
                _ => u.max(0.0),
            }
        }
        _ => axis_of(row - 1),
    }
}

fn polynomials([x, y, z]: [f64; 3], mistake: Mistake) -> [f64; 9] {
    let first = match mistake {
        PolynomialsInOrderXyz => [x, y, z],
        _ => [y, z, x],
    };
    let square = match mistake {
        SquareOfY => 3.0 * y * y - 1.0,
        SquareWithoutThree => z * z - 1.0,
        _ => 3.0 * z * z - 1.0,
    };
    let [a, b, c] = first;
    [1.0, a, b, c, x * y, y * z, square, x * z, x * x - y * y]
}

#[test]
fn each_mistake_of_a_sampler_of_regions_shows() {
    let mut vectors = vector::load(&vector::folder()).expect("the vectors");
    vectors.retain(|v| v.kind == Kind::Queries && v.area == "regions");
    let mut wrong = [0; MISTAKES.len()];
    for vector in &vectors {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        for query in &vector.info.queries {
            let Query::Regions(of_regions) = query else {
                panic!("{}: not of regions", vector.path());
            };
            let mut tracks = decoder.tracks().iter();
            let live = tracks.find(|live| live.track.id == of_regions.track);
            let live = live.expect("a track");
            let right = |mistake| query.accepts(&[sample(&decoder, live, of_regions, mistake)]);
            assert!(right(Right), "{}: {query:?}", vector.path());
            for (wrong, mistake) in wrong.iter_mut().zip(MISTAKES) {
                *wrong += usize::from(!right(mistake));
            }
        }
    }
    let silent: Vec<_> = MISTAKES
        .iter()
        .zip(wrong)
        .filter(|(_, wrong)| *wrong == 0)
        .collect();
    assert!(silent.is_empty(), "no vector shows {silent:?}");
}
