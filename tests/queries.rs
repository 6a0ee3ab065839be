//! The samplers of the client against the query vectors of `points`: `points/sample.rs` on the CPU and, where
//! there is an adapter, `embed/shaders/wgsl/points.wgsl`; both as Eq. 4 has it, without filling gaps.

use dapple::codec::Decoder;
use dapple::points::client::{PointsState, PointsTrack};
use dapple::points::sample::{Fallback, sample};
use dapple::render::gbuffer::{Fragment, GBuffer};
use dapple::render::gpu::Gpu;
use dapple::render::points::PointsPass;
use dapple_conformance::models::POSITION_UNIT;
use dapple_conformance::models::Query;
use dapple_conformance::models::points::queries::PointsQuery;
use dapple_conformance::reference;
use dapple_conformance::vector::{self, Kind, Vector};
use glam::{DVec3, Vec3};

pub(crate) fn vectors() -> Vec<Vector> {
    let mut vectors = vector::load(&vector::folder()).expect("the vectors");
    vectors.retain(|vector| vector.kind == Kind::Queries && vector.area == "points");
    assert!(vectors.len() >= 12, "{} vectors", vectors.len());
    vectors
}

pub(crate) fn queries(vector: &Vector) -> impl Iterator<Item = &PointsQuery> {
    vector.info.queries.iter().map(|query| match query {
        Query::Points(query) => query,
        _ => panic!("{}: not of points", vector.path()),
    })
}

/// What a stream leaves.
pub(crate) struct Decoded {
    pub(crate) decoder: Decoder,
    pub(crate) tracks: Vec<PointsTrack>,
}

pub(crate) fn decoded(vector: &Vector) -> Decoded {
    let decoder = reference::decoded(&vector.bytes).expect("a valid stream with its end");
    let track = |live: &dapple::codec::TrackState| {
        let place = decoder.points().place_of(live).expect("a track of points");
        PointsTrack {
            grid: place.grid,
            first_bucket: place.first_bucket,
            first_cell: place.first_cell,
        }
    };
    let tracks = decoder.tracks().iter().map(track).collect();
    Decoded { decoder, tracks }
}

impl Decoded {
    /// Index of a query's track.
    pub(crate) fn track(&self, query: &PointsQuery) -> usize {
        let mut live = self.decoder.tracks().iter();
        let index = live.position(|live| live.track.id == query.track);
        index.expect("a live track")
    }
}

/// Grid-space position and unit normal.
pub(crate) fn place(query: &PointsQuery) -> (Vec3, Vec3) {
    let position = Vec3::from(query.position.map(|v| v as f32)) * POSITION_UNIT;
    let normal = DVec3::from(query.normal.map(f64::from)).normalize();
    (position, normal.as_vec3())
}

pub(crate) fn check(vector: &Vector, results: &[f32]) {
    assert_eq!(results.len(), vector.info.queries.len());
    for (query, ao) in queries(vector).zip(results) {
        let steps = f64::from(*ao) * 65536.0;
        let [low, high] = query.ao.map(f64::from);
        let path = vector.path();
        assert!(
            (low..=high).contains(&steps),
            "{path}: {steps} for {query:?}"
        );
    }
}

#[test]
fn on_the_cpu() {
    for vector in vectors() {
        let decoded = decoded(&vector);
        let ao = |query: &PointsQuery| {
            let live = &decoded.decoder.tracks()[decoded.track(query)];
            let state = decoded.decoder.points();
            let (buckets, cells) = (state.buckets_of(live), state.cells_of(live));
            let (x, n) = place(query);
            sample(
                live.track.grid().unwrap(),
                buckets,
                cells,
                x,
                n,
                Fallback::One,
            )
            .ao
        };
        let results: Vec<f32> = queries(&vector).map(ao).collect();
        check(&vector, &results);
    }
}

/// Every query is a pixel of a picture one high; the grids of the vectors are in mesh space.
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
    let mut pass = PointsPass::new(&gpu).expect("the pass");
    for vector in vectors() {
        let decoded = decoded(&vector);
        let instances: Vec<_> = (0..decoded.tracks.len() as u32).map(Some).collect();
        let fragment = |query: &PointsQuery| {
            let (lookup_position, lookup_normal) = place(query);
            Fragment {
                instance: decoded.track(query) as u32,
                lookup_position,
                lookup_normal,
                ..Fragment::SKY
            }
        };
        let picture = GBuffer {
            width: vector.info.queries.len() as u32,
            height: 1,
            fragments: queries(&vector).map(fragment).collect(),
        };
        let state = PointsState {
            tracks: &decoded.tracks,
            buckets: decoded.decoder.points().buckets(),
            cells: decoded.decoder.points().cells(),
            track_of_instance: &instances,
            dirty: None,
        };
        let ao = pass.ao(&gpu, &picture, &state, Fallback::One);
        check(&vector, &ao.expect("the pass runs").ao);
    }
}
