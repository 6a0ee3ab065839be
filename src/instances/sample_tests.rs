//! What the sampler must hold to whatever an entry says.

use super::*;
use crate::client::{Client, Instance};
use crate::codec::instances::{Coding, Entry, Form, Update, key};
use crate::codec::signals::{Kernel, Signals};
use crate::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, Limits, LookupSpace, Model, Target, Track,
};
use crate::instances::client::InstancesView;

const BOUNDS: ([f32; 3], [f32; 3]) = ([-1.0, 0.0, 2.0], [3.0, 0.5, 2.0]);

fn table(signals: Signals, count: u32) -> Table {
    Table {
        signals,
        count,
        exponent: 1,
        step: 1,
        coding: Coding::Packed,
    }
}

fn two() -> Signals {
    Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), 0.75)
}

#[test]
fn bounds_normalise_to_their_corners() {
    let bounds = Bounds::new(BOUNDS.0, BOUNDS.1);
    assert_eq!(bounds.normalized(BOUNDS.0), [-1.0, -1.0, 0.0]);
    assert_eq!(bounds.normalized(BOUNDS.1), [1.0, 1.0, 0.0]);
    assert_eq!(bounds.normalized([1.0, 0.25, 9.0]), [0.0; 3]);
    assert_eq!(bounds.normalized([2.0, -8.0, -9.0]), [0.5, -1.0, 0.0]);
    // The largest f32 do not overflow.
    let wide = Bounds::new([f32::MIN; 3], [f32::MAX; 3]);
    let u = wide.normalized([0.0, f32::MAX, f32::MIN]);
    assert!(u[0] == 0.0 && (u[1] - 1.0).abs() < 1e-6 && (u[2] + 1.0).abs() < 1e-6);
}

#[test]
fn scalar_is_the_same_everywhere() {
    let bounds = Bounds::new(BOUNDS.0, BOUNDS.1);
    let one = Signals::one(Kernel::cut_off(1.0));
    let entry = InstanceEntry::new(&table(one, 1), bounds, &[[8192, 0, 0, 0]]);
    for x in [[0.0; 3], BOUNDS.0, BOUNDS.1, [1e9; 3]] {
        assert!((entry.global(x) - 8192.0 / 32767.0 * 2.0).abs() < 1e-6);
        assert!((entry.ao(x, 0.5) - 8192.0 / 32767.0).abs() < 1e-6);
    }
}

#[test]
fn signals_blend_after_each_is_kept_above_zero() {
    let bounds = Bounds::new([-1.0; 3], [1.0; 3]);
    // Signal a is x, below 0 on one side; signal b is 1/4.
    let values = [[0, 16384, 0, 0], [4096, 0, 0, 0]];
    let entry = InstanceEntry::new(&table(two(), 1), bounds, &values);
    for (x, a) in [(-0.5, 0.0), (0.0, 0.0), (0.5, 0.5), (1.0, 1.0)] {
        let expected = 0.25 * a + 0.75 * 0.25;
        let got = entry.global([x, 0.0, 0.0]);
        assert!((got - expected).abs() < 1e-4, "{x}: {got} {expected}");
    }
    // AO never leaves 0 to 1.
    let bright = InstanceEntry::new(&table(two(), 1), bounds, &[[32767; 4]; 2]);
    assert_eq!(bright.ao([1.0; 3], 1.0), 1.0);
    assert_eq!(bright.ao([-1.0; 3], 1.0), 0.0);
}

/// The bound that the codec states for quantised coefficients holds for what is sampled.
#[test]
fn sampled_error_is_within_the_bound_of_the_quantiser() {
    let mut rng = crate::rng::Rng::new(3);
    let bounds = Bounds::new(BOUNDS.0, BOUNDS.1);
    let one = Signals::one(Kernel::exponential(2.0));
    let coarse = Table {
        step: 400,
        ..table(one, 1)
    };
    let bound = coarse.worst_error(Form::Linear);
    let mut worst: f32 = 0.0;
    for _ in 0..3000 {
        let mut number = |low: f32, high: f32| low + (high - low) * rng.unit();
        let c = [0, 1, 2, 3].map(|i| {
            number(
                if i == 0 { 0.8 } else { -0.2 },
                if i == 0 { 1.2 } else { 0.2 },
            )
        });
        let x = [0, 1, 2].map(|i| number(BOUNDS.0[i], BOUNDS.1[i]));
        let quantized = coarse.quantize(0, Form::Linear, &[c]).expect("in range");
        let values = quantized.codes[0].map(|code| code * 400);
        let entry = InstanceEntry::new(&coarse, bounds, &[values]);
        let exact = InstanceEntry {
            signals: [c, [0.0; 4]],
            ..entry
        };
        worst = worst.max((entry.global(x) - exact.global(x)).abs());
    }
    assert!(worst <= bound + 1e-6, "{worst} {bound}");
    // Along z there is no extent, so three of four coefficients err.
    assert!(worst > 0.4 * bound, "{worst} {bound}");
}

/// Two instances of mesh 7, one of mesh 8, which has no track, and one of mesh 7 without an entry.
#[test]
fn view_finds_the_entries_of_a_client() {
    let track = Track {
        id: 1,
        target: Target {
            content_hash: Some(7),
            ..Target::default()
        },
        aabb_min: [-1.0; 3],
        aabb_max: [1.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Instances(table(two(), 2)),
    };
    let entry = |path, c: f32| {
        let c = [c, 0.0, 0.0, 0.0];
        let table = track.instance_table().expect("instances");
        let entry = table.quantize(key(path), Form::Scalar, &[c, c]);
        entry.expect("in range")
    };
    let mut entries: Vec<Entry> = vec![entry("a/tree", 0.25), entry("b/tree", 0.5)];
    entries.sort_by_key(|entry| entry.key);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).expect("encoder");
    encoder
        .group(&mut bytes, GroupStart::Keyframes)
        .expect("group");
    encoder
        .tracks(&mut bytes, std::slice::from_ref(&track))
        .expect("track");
    let update = Update {
        track: 1,
        entries: &entries,
    };
    let written = encoder.instances(&mut bytes, &[update], Compression::None);
    written.expect("entries");
    encoder.commit(&mut bytes, 0, None).expect("commit");
    let instance = |path: &str, content_hash| Instance {
        path: path.into(),
        content_hash,
    };
    let instances = vec![
        instance("b/tree", 7),
        instance("rock", 8),
        instance("a/tree", 7),
        instance("c/tree", 7),
    ];
    let mut client = Client::new(instances, Limits::default());
    client.push(&bytes).expect("a frame");
    let view = InstancesView::new(&client);
    for (index, ao) in [(0, 0.25), (1, 0.5), (2, 0.125), (3, 0.5)] {
        let got = view.ao(index, [0.0; 3], 0.5);
        assert!((got - ao).abs() < 1e-4, "{index}: {got}");
    }
    // Of a scene without the mesh the stream is refused.
    let mut client = Client::new(vec![instance("rock", 8)], Limits::default());
    assert!(client.push(&bytes).is_err());
}
