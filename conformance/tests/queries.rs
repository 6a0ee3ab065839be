//! The oracle of the query vectors against a resynchronisation over all points, and the vectors against
//! samplers with a mistake: each mistake must show.

use dapple_codec::Decoder;
use dapple_codec::points::{Cell, EMPTY, Grid};
use dapple_conformance::generate;
use dapple_conformance::generate::draw::Draw;
use dapple_conformance::generate::frames::Frames;
use dapple_conformance::models::Query;
use dapple_conformance::models::entry::Entry;
use dapple_conformance::models::points::frames::{entry, filled};
use dapple_conformance::models::points::oracle::{all, look_up, occlusion, place, within_block};
use dapple_conformance::models::points::queries::PointsQuery;
use dapple_conformance::models::points::writer;
use dapple_conformance::reference;
use dapple_conformance::vector::{Kind, Vector};

#[test]
fn the_oracle_finds_what_a_search_over_all_points_finds() {
    let mut draw = Draw(1);
    let (mut found, mut queried) = (0, 0);
    for round in 0..60 {
        let grid = writer::Grid {
            dims: [0; 3].map(|_| 1 + draw.below(5) as u16),
            buckets: 1 + draw.below(200),
            capacity: 1000,
            radius: [0.25, 0.2, 0.05][round % 3],
            widths: [[5, 4, 8], [4, 3, 5], [2, 2, 5], [1, 6, 8]][round % 4],
            ..writer::Grid::default()
        };
        let entry = Entry::of_grid(1, grid.clone());
        let volume = grid.dims.iter().map(|d| u32::from(*d)).product();
        let mut left_in = vec![8; grid.buckets as usize];
        let mut cells = Vec::new();
        for cell in 0..60 {
            let key = draw.below(volume);
            let left = &mut left_in[grid.bucket(key) as usize];
            if *left > 0 {
                *left -= 1;
                let top = 8 * grid.point_bytes() as u32 - 1;
                let count = draw.below(8);
                let points = (0..count).map(|_| draw.below(1 << top) | 1 << top);
                cells.push((cell, key, points.collect()));
            }
        }
        let content = Frames::new(std::slice::from_ref(&entry))
            .keyframe(&[filled(&entry, &cells)])
            .commit()
            .tracks
            .remove(0);
        let points = all(&content);
        let radius = f64::from(grid.radius);
        for _ in 0..400 {
            let spread = |dim: u16, draw: &mut Draw| {
                let span = (u32::from(dim) + 2) * 32768;
                draw.below(span) as i32 - 32768
            };
            let query = PointsQuery {
                track: 1,
                position: grid.dims.map(|dim| spread(dim, &mut draw)),
                normal: [0; 3].map(|_| draw.below(2001) as i32 - 1000),
                ao: [0; 2],
            };
            let Ok(one) = look_up(&content, &query) else {
                continue;
            };
            queried += 1;
            let (x, normal) = place(&query);
            let other = occlusion(&points, radius, x, normal).expect("no threshold is near");
            assert!(
                (one.ao - other.ao).abs() < 1e-12,
                "{query:?}: {one:?} {other:?}"
            );
            found += u32::from(other.weight > 0.0);
        }
    }
    assert!(queried > 10_000 && found > 2_000, "{queried} {found}");
}

#[test]
fn questions_at_a_threshold_are_refused() {
    // A point at 0.7578125 along each axis, its normal along z.
    let entry = entry(1, [5, 4, 8]);
    let point = entry.grid().point([16; 3], [0; 2], 100);
    let content = Frames::new(std::slice::from_ref(&entry))
        .keyframe(&[filled(
            &entry,
            &[(0, entry.grid().key([1; 3]), vec![point])],
        )])
        .commit()
        .tracks
        .remove(0);
    let ask = |x: [f64; 3], normal| {
        let position = x.map(|v| (v * 65536.0) as i32);
        look_up(
            &content,
            &PointsQuery {
                track: 1,
                position,
                normal,
                ao: [0; 2],
            },
        )
    };
    let at = 0.7578125;
    assert!(ask([at, at, at], [0, 0, 1]).is_ok());
    assert!(
        ask([0.75, at, at], [0, 0, 1]).is_err(),
        "the middle of a cube"
    );
    assert!(ask([at, 0.5, at], [0, 0, 1]).is_err(), "the side of a cube");
    assert!(
        ask([at + 0.25, at, at], [0, 0, 1]).is_err(),
        "at the radius"
    );
    assert!(ask([at, at, at], [0, 994_987, 100_000]).is_err(), "at T_n");
    let across = 0.3f64.sqrt() * 0.125;
    assert!(
        ask([at + across, at, at + 0.7f64.sqrt() * 0.125], [0, 0, 1]).is_err(),
        "at T_d"
    );
    assert!(
        ask([at + 1.0 / 65536.0, at, at], [0, 0, 1]).is_err(),
        "almost at the point"
    );
    assert!(ask([at, at, at], [0; 3]).is_err(), "no normal");
    let far = PointsQuery {
        track: 1,
        position: [(1 << 25) + 1, 7, 7],
        normal: [1; 3],
        ao: [0; 2],
    };
    assert!(look_up(&content, &far).is_err(), "no f32");
    assert!(within_block(&content, [at; 3]).is_ok_and(|points| points.len() == 1));
}

/// An enum, and a list of all its variants.
macro_rules! listed {
    ($(#[$doc:meta])* enum $name:ident, $all:ident { $($(#[$about:meta])* $variant:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        enum $name { $($(#[$about])* $variant,)* }
        const $all: &[$name] = &[$($name::$variant,)*];
    };
}

listed! {
    /// What a sampler may get wrong. Cutting coordinates off towards 0 is not among them: it differs from
    /// the floor below 0 alone, where the block has the rim's cubes either way as far as r reaches.
    enum Mistake, MISTAKES {
        /// Every cell of a bucket counts.
        NoKey,
        /// A cube's first cell alone counts.
        FirstCell,
        /// A bucket's first entry alone counts.
        FirstEntry,
        /// Cells count that no bucket names.
        Unnamed,
        /// The first track is queried.
        FirstTrack,
        OwnCube,
        FartherSide,
        UpperSide,
        /// Cubes beyond the grid are those at its rim.
        Clamp,
        HashOf64Bits,
        HashReducedEarly,
        HashWithoutZ,
        /// The cube is searched at its key.
        HashIsKey,
        NoTn,
        /// The cosine may have any sign.
        EitherNormal,
        NoTd,
        /// The cosine of Eq. 3 is compared with T_d without its square.
        NoSquare,
        /// Points at the fragment are left out.
        NoPointAtFragment,
        CornerOfStep,
        PositionToTheEnd,
        PositionsReversed,
        AoBelowOne,
        NormalOverAll,
        LowestNotClamped,
        NormalUnsigned,
        NormalsSwapped,
        NoFold,
        FoldWithNewU,
        FoldWithoutSign,
        /// n_x is taken as it comes.
        NormalAsGiven,
        EqualWeights,
        /// `1 - (d / r)^2`.
        SquaredWeights,
        HalfTheEdge,
        NotDivided,
        ClosedWithoutPoints,
    }
}

use Mistake::*;

type V = [f64; 3];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Position, in cell edges from the cube's corner, normal and AO of a point.
fn unpack(grid: &Grid, word: u32, wrong: impl Fn(Mistake) -> bool) -> (V, V, f64) {
    let [p, n, a] = [grid.widths.position, grid.widths.normal, grid.widths.ao].map(u32::from);
    let mut rest = word;
    let mut next = |bits: u32| {
        let field = rest & ((1 << bits) - 1);
        rest >>= bits;
        f64::from(field)
    };
    let top = |bits: u32| f64::from(1u32 << bits);
    let ao = next(a) / (top(a) - if wrong(AoBelowOne) { 0.0 } else { 1.0 });
    let mut normal = || {
        let code = next(n);
        let half = top(n - 1);
        let signed = match code >= half && !wrong(NormalUnsigned) {
            true => code - 2.0 * half,
            false => code,
        };
        let value = signed
            / if wrong(NormalOverAll) {
                half
            } else {
                half - 1.0
            };
        if wrong(LowestNotClamped) {
            value
        } else {
            value.max(-1.0)
        }
    };
    let (mut u, mut v) = (normal(), normal());
    if wrong(NormalsSwapped) {
        (u, v) = (v, u);
    }
    let z = 1.0 - u.abs() - v.abs();
    if z < 0.0 && !wrong(NoFold) {
        let sign = |t: f64| {
            if t < 0.0 && !wrong(FoldWithoutSign) {
                -1.0
            } else {
                1.0
            }
        };
        let folded = (1.0 - v.abs()) * sign(u);
        v = (1.0 - if wrong(FoldWithNewU) { folded } else { u }.abs()) * sign(v);
        u = folded;
    }
    let length = dot([u, v, z], [u, v, z]).sqrt();
    let mut position = [next(p), next(p), next(p)].map(|code| match () {
        () if wrong(CornerOfStep) => code / top(p),
        () if wrong(PositionToTheEnd) => code / (top(p) - 1.0),
        () => (code + 0.5) / top(p),
    });
    if wrong(PositionsReversed) {
        position.reverse();
    }
    (position, [u / length, v / length, z / length], ao)
}

fn bucket(grid: &Grid, cube: [u32; 3], wrong: impl Fn(Mistake) -> bool) -> u32 {
    let [dx, dy, _] = grid.dims.map(u64::from);
    let [x, y, z] = cube.map(u64::from);
    let count = u64::from(grid.bucket_count);
    let (rows, slices) = (y * (dx * 17), z * (dx * dy * 31));
    let hash = match () {
        () if wrong(HashOf64Bits) => x + rows + slices,
        () if wrong(HashReducedEarly) => x + rows % count + slices % count,
        () if wrong(HashWithoutZ) => x + rows,
        () if wrong(HashIsKey) => x + dx * (y + dy * z),
        () => u64::from((x + rows + slices) as u32),
    };
    (hash % count) as u32
}

fn sample(decoder: &Decoder, query: &PointsQuery, mistake: Option<Mistake>) -> f64 {
    let wrong = |m: Mistake| mistake == Some(m);
    let mut tracks = decoder.tracks().iter();
    let live = match wrong(FirstTrack) {
        true => tracks.next(),
        false => tracks.find(|live| live.track.id == query.track),
    };
    let live = live.expect("a live track");
    let grid = live.track.grid().unwrap();
    let edge = f64::from(grid.cell_edge);
    let radius = if wrong(HalfTheEdge) {
        edge / 2.0
    } else {
        f64::from(grid.radius)
    };
    let (x, unit) = place(query);
    let normal = if wrong(NormalAsGiven) {
        query.normal.map(f64::from)
    } else {
        unit
    };
    let (mut weight, mut weighted) = (0.0, 0.0);
    let mut add = |cube: V, word: u32| {
        let (at, n, ao) = unpack(grid, word, wrong);
        let to = [0, 1, 2].map(|axis| (cube[axis] + at[axis]) * edge - x[axis]);
        let d = dot(to, to).sqrt();
        let agreement = dot(n, normal);
        let agreement = if wrong(EitherNormal) {
            agreement.abs()
        } else {
            agreement
        };
        let slope = if d > 0.0 { dot(n, to) / d } else { 0.0 };
        let slope = if wrong(NoSquare) {
            slope
        } else {
            slope * slope
        };
        let kept = (agreement > 0.1 || wrong(NoTn))
            && (slope < 0.7 || wrong(NoTd))
            && (d > 0.0 || !wrong(NoPointAtFragment));
        if kept && d < radius {
            let alpha = match () {
                () if wrong(EqualWeights) => 1.0,
                () if wrong(SquaredWeights) => 1.0 - (d / radius).powi(2),
                () => (radius - d) / radius,
            };
            weight += alpha;
            weighted += alpha * ao;
        }
    };
    let used = |cell: &Cell| cell.points.into_iter().take_while(|&word| word != 0);
    for corner in 0..if wrong(OwnCube) { 1 } else { 8 } {
        let cube = [0, 1, 2].map(|axis| {
            let at = x[axis] / edge;
            let own = at.floor();
            let upper = (at - own >= 0.5) != wrong(FartherSide) || wrong(UpperSide);
            let side = if upper { 1.0 } else { -1.0 };
            own + if corner >> axis & 1 == 1 { side } else { 0.0 }
        });
        let top = grid.dims.map(|dim| f64::from(dim) - 1.0);
        let inside = (0..3).all(|axis| (0.0..=top[axis]).contains(&cube[axis]));
        if !inside && !wrong(Clamp) {
            continue;
        }
        let rim = [0, 1, 2].map(|axis| cube[axis].clamp(0.0, top[axis]) as u32);
        let key = grid.key(rim);
        if wrong(Unnamed) {
            let cells = decoder.points().cells_of(live);
            for cell in cells.iter().filter(|cell| cell.key == key) {
                used(cell).for_each(|word| add(cube, word));
            }
            continue;
        }
        let index = bucket(grid, rim, wrong) as usize;
        let state = decoder.points();
        let bucket = &state.buckets_of(live)[index];
        assert!(bucket.0[0] == EMPTY || state.cells_in(live, bucket).count() > 0);
        for (entry, cell) in state.cells_in(live, bucket).enumerate() {
            if wrong(FirstEntry) && entry > 0 {
                break;
            }
            if cell.key != key && !wrong(NoKey) {
                continue;
            }
            used(cell).for_each(|word| add(cube, word));
            if wrong(FirstCell) {
                break;
            }
        }
    }
    match weight > 0.0 {
        true if wrong(NotDivided) => weighted,
        true => weighted / weight,
        false if wrong(ClosedWithoutPoints) => 0.0,
        false => 1.0,
    }
}

/// Vectors with queries of points, and what their streams decode to.
fn decoded() -> Vec<(Vector, Decoder)> {
    let vectors = generate::all().expect("the vectors");
    let queries = vectors
        .into_iter()
        .filter(|v| v.kind == Kind::Queries && v.area == "points");
    let decode = |vector: Vector| {
        let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
        (vector, decoder)
    };
    queries.map(decode).collect()
}

fn right(query: &Query, sample: impl Fn(&PointsQuery) -> f64) -> bool {
    match query {
        Query::Points(points) => query.accepts(&[sample(points)]),
        Query::Probes(_) | Query::Vertices(_) | Query::Instances(_) | Query::Regions(_) => false,
    }
}

#[test]
fn each_mistake_of_a_sampler_shows() {
    let decoded = decoded();
    let count: usize = decoded.iter().map(|(v, _)| v.info.queries.len()).sum();
    assert!(
        decoded.len() >= 12 && count >= 150,
        "{} {count}",
        decoded.len()
    );
    let failures = |mistake: Option<Mistake>| {
        let mut names = Vec::new();
        for (vector, decoder) in &decoded {
            let mut queries = vector.info.queries.iter();
            if !queries.all(|query| right(query, |query| sample(decoder, query, mistake))) {
                names.push(vector.name.as_str());
            }
        }
        names
    };
    assert_eq!(failures(None), [""; 0], "a sampler without a mistake");
    let unseen: Vec<Mistake> = MISTAKES
        .iter()
        .copied()
        .filter(|&mistake| {
            let names = failures(Some(mistake));
            println!("{mistake:?}: {} vectors, {:?}", names.len(), names.first());
            names.is_empty()
        })
        .collect();
    assert_eq!(unseen, [], "mistakes that no query shows");
}
