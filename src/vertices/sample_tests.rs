//! What the sampler must hold to whatever the values are.

use super::*;
use crate::client::{Client, Instance};
use crate::codec::signals::{Kernel, Signals};
use crate::codec::vertices::{Coding, Update, Vertices};
use crate::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, Limits, LookupSpace, Model, Target, Track,
};
use crate::vertices::client::VerticesView;

const TWO: MeshValues = MeshValues {
    first: 1,
    signals: 2,
    share: 0.25,
};

#[test]
fn corners_have_their_own_values() {
    let values = [9, 0, 255, 51, 102, 255, 0];
    let one = MeshValues {
        first: 1,
        signals: 1,
        share: 0.0,
    };
    for (vertex, value) in [(0, 0), (1, 255), (4, 255)] {
        let mut vertices = [2; 3];
        for corner in 0..3 {
            vertices[corner] = vertex;
            let mut weights = [0.0; 3];
            weights[corner] = 1.0;
            let ao = one.ao(&values, vertices, weights);
            assert_eq!(ao, value as f32 / 255.0);
            vertices[corner] = 2;
        }
    }
    // a = 0, b = 1.
    let ao = TWO.ao(&values, [0; 3], [0.5, 0.25, 0.25]);
    assert!((ao - 0.25).abs() < 1e-6);
}

#[test]
fn blend_and_interpolation_are_linear() {
    let values = [0, 10, 200, 30, 150, 250, 0];
    let at = |vertex: usize| {
        let [a, b] = [0, 1].map(|k| f32::from(values[1 + 2 * vertex + k]) / 255.0);
        a + (b - a) * 0.25
    };
    let weights = [0.2, 0.5, 0.3];
    let expected: f32 = (0..3).map(|k| weights[k] * at(k)).sum();
    let ao = TWO.ao(&values, [0, 1, 2], weights);
    assert!((ao - expected).abs() < 1e-6);
}

#[test]
fn value_beyond_the_end_is_open() {
    assert_eq!(TWO.ao(&[], [u32::MAX; 3], [0.0, 1.0, 0.0]), 1.0);
}

/// Two instances of mesh 7, of which one has values of its own, and one of mesh 8, which has none.
#[test]
fn view_prefers_the_values_of_an_instance() {
    let vertices = Vertices {
        signals: Signals::one(Kernel::exponential(2.0)),
        count: 2,
        bits: 8,
        order: Vertices::FILE_ORDER,
        coding: Coding::Packed,
    };
    let track = |id, path: &str| Track {
        id,
        target: Target {
            path: path.into(),
            content_hash: Some(7),
            ..Target::default()
        },
        aabb_min: [0.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Vertices(vertices),
    };
    let instance = |path: &str, content_hash| Instance {
        path: path.into(),
        content_hash,
    };
    let instances = vec![instance("a", 7), instance("b", 7), instance("c", 8)];
    // Whichever of the two tracks comes first.
    for paths in [["b", ""], ["", "b"]] {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("an encoder");
        encoder
            .group(&mut bytes, GroupStart::Keyframes)
            .expect("a group");
        let tracks = [track(1, paths[0]), track(2, paths[1])];
        encoder.tracks(&mut bytes, &tracks).expect("tracks");
        let codes = |path: &str| {
            if path.is_empty() {
                [51, 51]
            } else {
                [102, 102]
            }
        };
        let [first, second] = paths.map(codes);
        let updates = [(1, &first), (2, &second)].map(|(track, codes)| Update { track, codes });
        encoder
            .vertices(&mut bytes, &updates, Compression::None)
            .expect("values");
        encoder.commit(&mut bytes, 0, None).expect("a commit");
        encoder.end(&mut bytes).expect("an end");
        let mut client = Client::new(instances.clone(), Limits::default());
        client.push(&bytes).expect("a stream");
        let view = VerticesView::new(&client);
        let ao = |instance| {
            let own = view.of_instance(instance)?;
            let ao = own.values.ao(view.values, [0, 1, 1], [0.5, 0.25, 0.25]);
            Some(((ao * 255.0).round() as u8, own.is_own))
        };
        assert_eq!(ao(0), Some((51, false)));
        assert_eq!(ao(1), Some((102, true)));
        assert_eq!(ao(2), None);
    }
}
