//! What look-ups must hold to whatever the regions say.

use super::*;
use crate::client::Client;
use crate::codec::regions::{Coding, Content, Form, Update};
use crate::codec::signals::{Kernel, Signals};
use crate::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, Limits, LookupSpace, Model, Target, Track,
    Transform,
};
use crate::regions::client::{Place, RegionsView, TemporalBlend};
use crate::regions::index::Index;

fn set(count: u32, signals: Signals) -> RegionSet {
    RegionSet {
        signals,
        count,
        capacity: 63 * count,
        exponent: 0,
        step: 1,
        coding: Coding::Packed,
    }
}

fn one() -> Signals {
    Signals::one(Kernel::exponential(2.0))
}

fn two(share: f32) -> Signals {
    Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), share)
}

fn form(derivatives: Derivatives, degree: u8, signals: u8) -> Form {
    Form {
        derivatives,
        degree,
        signals,
        centred: true,
    }
}

/// The same numbers everywhere, 0 to 1.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn place(&mut self, reach: f32) -> Vec3 {
        Vec3::from([0; 3].map(|_| reach * (2.0 * self.unit() - 1.0)))
    }

    fn direction(&mut self) -> Vec3 {
        (self.place(1.0) + Vec3::splat(1e-3)).normalize()
    }
}

/// Regions of all forms, many of which overlap, share faces and have the same volume.
fn many(set: &RegionSet, seed: u64) -> Content {
    let mut random = Random(seed);
    let mut content = Content::default();
    for at in 0..set.count {
        let form = Form {
            centred: at % 2 == 0,
            ..form(
                Derivatives::ALL[at as usize % 3],
                (at / 3 % 3) as u8,
                1 + (at % u32::from(set.signals.count)) as u8,
            )
        };
        // On a grid of halves, so that ties are many.
        let min = (random.place(8.0) * 2.0).round() / 2.0;
        let size = (random.place(1.5) + 1.5).round();
        let bounds = [min.to_array(), (min + size).to_array()];
        let centre = (!form.centred).then_some((min + size * 0.25).to_array());
        let mut coefficients = vec![0.0; form.coefficients()];
        for (i, coefficient) in coefficients.iter_mut().enumerate() {
            *coefficient = 0.1 * (random.unit() - 0.5) + if i < 2 { 0.5 } else { 0.0 };
        }
        set.push(&mut content, bounds, centre, form, &coefficients)
            .unwrap();
    }
    content
}

#[test]
fn index_finds_what_a_scan_finds() {
    for (count, seed) in [(1, 1), (4, 2), (5, 3), (60, 4), (700, 5)] {
        let set = set(count, two(0.5));
        let content = many(&set, seed);
        let regions = Regions::new(&set, &content.regions, &content.pairs);
        let index = Index::new(&content.regions);
        let mut random = Random(seed + 10);
        for round in 0..4000 {
            let mut p = random.place(if round % 2 == 0 { 11.0 } else { 40.0 });
            if round % 3 == 0 {
                p = (p * 2.0).round() / 2.0;
            }
            assert_eq!(index.find(&content.regions, p), regions.find(p), "{p}");
        }
    }
    assert_eq!(Index::new(&[]).find(&[], Vec3::ZERO), None);
}

#[test]
fn region_of_a_place_is_the_smallest_that_holds_it_or_the_nearest() {
    let set = set(4, one());
    let mut content = Content::default();
    let constant = form(Derivatives::Constant, 0, 1);
    for (min, max) in [
        ([0.0; 3], [8.0; 3]),
        ([2.0; 3], [4.0; 3]),
        ([2.0; 3], [4.0; 3]),
        ([20.0, 0.0, 0.0], [21.0, 1.0, 1.0]),
    ] {
        set.push(&mut content, [min, max], None, constant, &[0.5])
            .unwrap();
    }
    let regions = Regions::new(&set, &content.regions, &content.pairs);
    for (p, expected) in [
        ([1.0, 1.0, 1.0], 0),
        ([3.0, 3.0, 3.0], 1),
        ([2.0, 4.0, 2.0], 1),
        ([13.9, 0.5, 0.5], 0),
        ([14.1, 0.5, 0.5], 3),
        ([-90.0, 0.0, 0.0], 0),
    ] {
        assert_eq!(regions.find(p.into()), Some(expected), "{p:?}");
    }
}

/// A room with six walls: 1 in its centre, darker towards each wall by a number of its own (§2.3 of the
/// paper: the case that a single gradient cannot have).
#[test]
fn sided_derivatives_darken_towards_each_wall() {
    let set = set(1, one());
    let mut content = Content::default();
    let walls = [-0.1, 0.2, -0.3, 0.4, -0.5, 0.6];
    let mut coefficients = vec![1.0];
    coefficients.extend(walls);
    let bounds = [[-2.0, -3.0, -4.0], [2.0, 3.0, 4.0]];
    let sided = form(Derivatives::Sided, 0, 1);
    set.push(&mut content, bounds, None, sided, &coefficients)
        .unwrap();
    let regions = Regions::new(&set, &content.regions, &content.pairs);
    let near = |p: Vec3, expected: f32| {
        let got = regions.ao(p, Vec3::Y);
        assert!((got - expected).abs() < 1e-4, "{p}: {got}, not {expected}");
    };
    near(Vec3::ZERO, 1.0);
    for (side, wall) in walls.iter().enumerate() {
        let mut p = Vec3::ZERO;
        p[side / 2] = bounds[usize::from(side % 2 == 0)][side / 2];
        near(p, 1.0 - wall.abs());
        near(p * 0.5, 1.0 - 0.5 * wall.abs());
        near(p * 9.0, 1.0 - wall.abs());
    }
}

/// Against a second evaluation, in f64 and in another order.
#[test]
fn samples_are_those_of_the_formula() {
    for signals in [one(), two(0.25)] {
        let set = set(40, signals);
        let content = many(&set, 8);
        let regions = Regions::new(&set, &content.regions, &content.pairs);
        let mut random = Random(3);
        for round in 0..4000 {
            let at = round % 40;
            let (p, n) = (random.place(12.0), random.direction());
            let expected = formula(&set, &content, at, p, n);
            let got = f64::from(regions.sample(at, p, n));
            assert!((got - expected).abs() < 1e-5, "{got}, not {expected}");
        }
    }
}

fn formula(set: &RegionSet, content: &Content, at: usize, p: Vec3, n: Vec3) -> f64 {
    let region = &content.regions[at];
    let form = region.form().unwrap();
    let offset = |axis: usize| {
        let [low, high, centre] =
            [region.min, region.max, region.centre].map(|v| f64::from(v[axis]));
        let half = (high - low) / 2.0;
        match half > 0.0 {
            true => (f64::from(p[axis]).clamp(low, high) - centre) / half,
            false => 0.0,
        }
    };
    let [x, y, z] = n.to_array().map(f64::from);
    let functions = [
        1.0,
        y,
        z,
        x,
        x * y,
        y * z,
        3.0 * z * z - 1.0,
        x * z,
        x * x - y * y,
    ];
    let values = content.pairs[region.first as usize..].as_flattened();
    let mut sums = [0.0; 2];
    for (i, &value) in values[..form.coefficients()].iter().enumerate() {
        let signals = usize::from(form.signals);
        let (s, k) = (i % signals, i / signals % form.polynomials());
        let row = i / signals / form.polynomials();
        let factor = match (form.derivatives, row) {
            (_, 0) => 1.0,
            (Derivatives::Sided, _) => match (row - 1) % 2 {
                0 => offset((row - 1) / 2).max(0.0),
                _ => offset((row - 1) / 2).min(0.0),
            },
            _ => offset(row - 1),
        };
        let term = f64::from(value) / 32767.0 * factor * functions[k];
        sums[s] += term;
        if signals == 1 {
            sums[1] += term;
        }
    }
    let [a, b] = sums.map(|sum: f64| sum.clamp(0.0, 1.0));
    a + (b - a) * f64::from(set.signals.share)
}

#[test]
fn view_reads_a_stream_in_world_space() {
    let set = set(30, two(0.5));
    let content = many(&set, 4);
    let other = many(&set, 5);
    let track = |id| Track {
        id,
        target: Target::default(),
        aabb_min: [-16.0; 3],
        aabb_max: [16.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Regions(set),
    };
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes).unwrap();
    encoder.group(&mut bytes, GroupStart::Keyframes).unwrap();
    encoder
        .tracks(&mut bytes, &[track(3), track(5), track(8)])
        .unwrap();
    let update = |track, content: &Content| -> Update<'static> {
        let content: &'static Content = Box::leak(Box::new(content.clone()));
        Update {
            track,
            regions: &content.regions,
            pairs: &content.pairs,
        }
    };
    let updates = [update(3, &content), update(8, &other)];
    encoder
        .regions(&mut bytes, &updates, Compression::None)
        .unwrap();
    // A quarter turn about y, and 100 m away.
    let turned = Transform {
        world_from_grid: [
            [0.0, 0.0, 1.0, 100.0],
            [0.0, 1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0, 0.0],
        ],
    };
    encoder
        .transforms(&mut bytes, &[(8, turned)], Compression::None)
        .unwrap();
    encoder.commit(&mut bytes, 0, None).unwrap();
    encoder.end(&mut bytes).unwrap();
    let mut client = Client::new(Vec::new(), Limits::default());
    client.push(&bytes).unwrap();
    let view = RegionsView::new(&client);
    // A track without content is left out.
    assert_eq!(view.tracks.len(), 2);
    let mut random = Random(6);
    for _ in 0..500 {
        let (p, n) = (random.place(12.0), random.direction());
        let regions = Regions::new(&set, &content.regions, &content.pairs);
        let region = regions.find(p).unwrap();
        assert_eq!(view.find(p), Some(Place { track: 0, region }));
        assert_eq!(view.ao(p, n), regions.ao(p, n));
        let regions = Regions::new(&set, &other.regions, &other.pairs);
        let (x, m) = (Vec3::new(100.0 + p.z, p.y, -p.x), Vec3::new(n.z, n.y, -n.x));
        assert_eq!(view.find(x).map(|place| place.track), Some(1));
        let difference = view.ao(x, m) - regions.ao(p, n);
        // A place that rounding moves across a boundary would be another region.
        let same = view.find(x).map(|place| place.region) == regions.find(p);
        assert!(!same || difference.abs() < 1e-4, "{difference}");
    }
    let nowhere = Place {
        track: 9,
        region: 0,
    };
    assert_eq!(view.sample(nowhere, Vec3::ZERO, Vec3::Y), 1.0);
}

#[test]
fn blend_decays_by_time_and_not_by_frames() {
    let mut steps = TemporalBlend::new(0.2);
    let mut leap = TemporalBlend::new(0.2);
    assert_eq!(
        steps.update(0.25, 1.0),
        0.25,
        "it starts with what is sampled"
    );
    assert_eq!(leap.update(0.25, 0.0), 0.25);
    let mut shown = 0.0;
    for _ in 0..20 {
        shown = steps.update(1.0, 0.01);
    }
    let at_once = leap.update(1.0, 0.2);
    assert!((shown - at_once).abs() < 1e-5, "{shown} {at_once}");
    let expected = 1.0 - 0.75 * (-1.0f32).exp();
    assert!((at_once - expected).abs() < 1e-6);
    steps.reset();
    assert_eq!(steps.update(0.5, 0.0), 0.5);
    let mut none = TemporalBlend::new(0.0);
    none.update(0.0, 0.1);
    assert_eq!(none.update(1.0, 0.0), 1.0);
}
