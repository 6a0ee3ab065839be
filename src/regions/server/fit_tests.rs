//! Models of regions against functions that are known.

use super::absorb::absorb;
use super::basis::{self, COUNT};
use super::fit::{Centres, fit};
use super::model::{self, Derivatives, Form, Model};
use super::samples::{
    HeldOut, MAX_SIGNALS, NORMALS, RegionSamples, SIDE, Sample, direction, lattice,
};
use super::*;
use crate::rng::Rng;
use crate::trace::Aabb;
use glam::Vec3;

const BOX: Aabb = Aabb {
    min: Vec3::new(-1.0, 0.0, 2.0),
    max: Vec3::new(3.0, 2.0, 5.0),
};

/// Samples of a function of position at the points of the lattice that `keep` wants.
fn samples(
    bounds: Aabb,
    keep: impl Fn(Vec3) -> bool,
    channels: impl Fn(Vec3) -> samples::Channels,
) -> RegionSamples {
    let points = (0..SIDE * SIDE * SIDE).map(|i| lattice(&bounds, i));
    let mut random = Rng::new(5);
    let held_out = (0..32).map(|_| {
        let at = Vec3::new(random.unit(), random.unit(), random.unit());
        let position = bounds.min + at * (bounds.max - bounds.min);
        let normals: [Vec3; NORMALS] = std::array::from_fn(|_| direction(&mut random));
        let values = normals.map(|n| model::evaluate(&channels(position), 2, n));
        HeldOut {
            position,
            normals,
            values: [0, 1].map(|signal| values.map(|v| v[signal] as f32)),
        }
    });
    RegionSamples {
        bounds,
        signals: 2,
        valid: [0; SIDE],
        held_out: held_out.collect(),
        samples: points
            .filter(|p| keep(*p))
            .map(|position| Sample {
                position,
                channels: channels(position),
            })
            .collect(),
    }
}

/// A model of small random terms.
fn random_model(bounds: Aabb, centre: Vec3, derivatives: Derivatives, seed: u64) -> Model {
    let mut random = Rng::new(seed);
    let mut terms = vec![[0.0; MAX_SIGNALS * COUNT]; derivatives.terms()];
    for term in &mut terms {
        term.fill_with(|| 0.05 * (random.unit_f64() - 0.5));
    }
    terms[0][0] = 0.5;
    terms[0][COUNT] = 0.6;
    Model {
        bounds,
        centre,
        derivatives,
        terms,
    }
}

fn largest_difference(a: &Model, b: &Model) -> f64 {
    let mut worst = 0.0f64;
    for i in 0..512 {
        let p = lattice(&a.bounds, i) + 0.01;
        for (a, b) in a.channels(p).iter().zip(b.channels(p)) {
            worst = worst.max((a - b).abs());
        }
    }
    worst
}

#[test]
fn signals_of_the_model_itself_are_recovered() {
    for (derivatives, seed) in [
        (Derivatives::None, 1),
        (Derivatives::Gradient, 2),
        (Derivatives::Sided, 3),
    ] {
        let truth = random_model(BOX, BOX.centre(), derivatives, seed);
        let all = samples(BOX, |_| true, |p| truth.channels(p));
        let (layout, fitted) = fit(BOX, &all, Centres::Both);
        assert_eq!(layout, Layout::Space);
        let got = &fitted[derivatives as usize].model;
        assert!(largest_difference(got, &truth) < 1e-6, "{derivatives:?}");
        let region = fit_region(BOX, &all, 0.97, Centres::Both);
        for rung in &region.rungs {
            let holds = rung.form.degree == 2 && rung.form.derivatives >= derivatives;
            let error = rung.error.expect("there are held-out samples");
            assert_eq!(error < 1e-6, holds, "{:?}: {error}", rung.form);
        }
    }
}

#[test]
fn centre_of_mass_is_taken_where_it_is_the_better_one() {
    // Samples of two thirds of the box, kinked at their own middle.
    let keep = |p: Vec3| p.x < 1.6;
    let mass = samples(BOX, keep, |_| [0.0; _]).centre_of_mass();
    let truth = random_model(BOX, mass, Derivatives::Sided, 9);
    let part = samples(BOX, keep, |p| truth.channels(p));
    let (_, fitted) = fit(BOX, &part, Centres::Both);
    assert_eq!(fitted[2].model.centre, mass);
    assert!(fitted[2].residual < 1e-12);
    let (_, fitted) = fit(BOX, &part, Centres::Box);
    assert!(fitted[2].residual > 1e-6);
}

#[test]
fn search_finds_a_centre_between_the_two() {
    let centre = Vec3::new(0.0, 1.25, 3.0);
    let truth = random_model(BOX, centre, Derivatives::Sided, 4);
    let all = samples(BOX, |_| true, |p| truth.channels(p));
    let residual = |centres| fit(BOX, &all, centres).1[2].residual;
    let (both, search) = (residual(Centres::Both), residual(Centres::Search));
    assert!(search < 0.05 * both, "{search:e} {both:e}");
}

#[test]
fn singular_layouts_fall_to_simpler_forms() {
    let truth = random_model(BOX, BOX.centre(), Derivatives::Sided, 6);
    let first = lattice(&BOX, 0);
    let step = lattice(&BOX, 1).x - first.x;
    type Keep<'a> = &'a dyn Fn(Vec3) -> bool;
    let cases: [(Keep, Layout); 8] = [
        (&|_| true, Layout::Space),
        (&|p| p.x == first.x, Layout::Plane),
        // A plane that leans.
        (
            &|p| {
                (p.x - first.x) / (BOX.max.x - BOX.min.x)
                    == (p.z - first.z) / (BOX.max.z - BOX.min.z)
            },
            Layout::Plane,
        ),
        (&|p| p.x == first.x && p.y == first.y, Layout::Line),
        (&|p| p == first, Layout::Point),
        // Two layers: nothing bends between them.
        (&|p| p.x < first.x + 1.5 * step, Layout::OneSided),
        (
            &|p| p.distance(first) < 1.01 * step && p.z == first.z,
            Layout::Line,
        ),
        (&|_| false, Layout::Empty),
    ];
    for (i, (keep, layout)) in cases.into_iter().enumerate() {
        let some = samples(BOX, keep, |p| truth.channels(p));
        let region = fit_region(BOX, &some, 0.97, Centres::Both);
        if i != 6 {
            assert_eq!(region.layout, layout, "{i}");
        }
        let richest = region.models.last().expect("there is a model");
        assert_eq!(richest.derivatives, region.layout.richest(), "{i}");
        for model in &region.models {
            let finite = model.terms.iter().flatten().all(|t| t.is_finite());
            assert!(finite, "{i}");
            // What no sample tells of has no slope that could grow.
            let small = model.terms.iter().flatten().all(|t| t.abs() < 2.0);
            assert!(small, "{i}");
        }
        assert!(
            region
                .rungs
                .iter()
                .all(|r| r.form.derivatives <= richest.derivatives)
        );
    }
}

#[test]
fn flat_boxes_and_boxes_of_one_point_are_fitted() {
    for flat in [
        Aabb {
            max: Vec3::new(3.0, 0.0, 5.0),
            ..BOX
        },
        Aabb {
            max: BOX.min,
            ..BOX
        },
    ] {
        let truth = random_model(BOX, BOX.centre(), Derivatives::Sided, 8);
        let some = samples(flat, |_| true, |p| truth.channels(p));
        let region = fit_region(flat, &some, 0.97, Centres::Search);
        assert_ne!(region.layout, Layout::Space);
        for model in &region.models {
            assert!(model.channels(flat.min).iter().all(|c| c.is_finite()));
        }
    }
}

#[test]
fn coefficients_are_the_terms_of_the_form() {
    let model = random_model(BOX, BOX.centre(), Derivatives::Sided, 7);
    let form = |derivatives, degree, signals| Form {
        derivatives,
        degree,
        signals,
    };
    let all = model.coefficients(form(Derivatives::Sided, 2, 2), 2, 0.97);
    assert_eq!(all.len(), 126);
    for (i, value) in all.iter().enumerate() {
        let (term, function, signal) = (i / 18, i % 18 / 2, i % 2);
        assert_eq!(*value, model.terms[term][signal * COUNT + function] as f32);
    }
    let one = model.coefficients(form(Derivatives::Gradient, 1, 1), 2, 0.25);
    assert_eq!(one.len(), 16);
    let expected = 0.75 * model.terms[2][3] + 0.25 * model.terms[2][COUNT + 3];
    assert!((f64::from(one[11]) - expected).abs() < 1e-7);
    let first = model.coefficients(form(Derivatives::None, 0, 1), 1, 0.5);
    assert_eq!(first, [0.5]);
}

/// Means over the sphere by the product of a Gauss rule and an even one, exact for these polynomials.
#[test]
fn basis_constants_are_its_integrals() {
    let n = 400;
    let mut squares = [0.0f64; COUNT];
    let mut axis = [0.0f64; COUNT];
    for i in 0..n {
        // Midpoints in z; the error is of the order 1 / n^2.
        let z = (2.0 * (i as f64 + 0.5)) / n as f64 - 1.0;
        for k in 0..16 {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / 16.0).sin_cos();
            let r = (1.0 - z * z).sqrt();
            // Turned so that +X is the axis and no function vanishes about a normal of (1, 2, 2) / 3.
            let d = Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32);
            let weight = 1.0 / (n * 16) as f64;
            let visible = f64::from(Vec3::new(1.0, 2.0, 2.0).dot(d) / 3.0).powi(2);
            for (j, value) in basis::values(d).map(f64::from).iter().enumerate() {
                squares[j] += weight * value * value;
                axis[j] += weight * visible * value;
            }
        }
    }
    for (got, expected) in squares.iter().zip(basis::SQUARE) {
        assert!((got - expected).abs() < 1e-4, "{squares:?}");
    }
    // Visibility (a . w)^2 about the axis a itself: 1/pi * integral of z^3 is 1/2; at right angles to it
    // 1/4 (Beta functions).
    let mut channels = [0.0; MAX_SIGNALS * COUNT];
    for i in 0..COUNT {
        channels[i] = basis::COSINE[i] * axis[i];
    }
    let a = Vec3::new(1.0, 2.0, 2.0) / 3.0;
    let across = Vec3::new(2.0, -2.0, 1.0) / 3.0;
    let values = [a, -a, across].map(|n| model::evaluate(&channels, 2, n)[0]);
    for (got, expected) in values.iter().zip([0.5, 0.5, 0.25]) {
        assert!((got - expected).abs() < 1e-3, "{values:?}");
    }
}

/// Three rooms in a row, whose own models know nothing of each other.
fn row() -> (Vec<Model>, Vec<RegionSamples>, Vec<Link>) {
    let mut models = Vec::new();
    let mut of_regions = Vec::new();
    for i in 0..3 {
        let shift = Vec3::X * (4.0 * i as f32);
        let bounds = Aabb {
            min: BOX.min + shift,
            max: BOX.max + shift,
        };
        let derivatives = Derivatives::ALL[2 - i];
        let model = random_model(bounds, bounds.centre(), derivatives, 20 + i as u64);
        of_regions.push(samples(bounds, |_| true, |p| model.channels(p)));
        models.push(model);
    }
    let link = |i: usize| Link {
        regions: [i, i + 1],
        area: 6.0 / (i + 1) as f32,
        centre: Vec3::new(3.0 + 4.0 * i as f32, 1.0, 3.5),
    };
    (models, of_regions, vec![link(0), link(1)])
}

#[test]
fn regularisation_never_raises_its_energy() {
    for beta in [0.0, 0.01, 1.0, 100.0] {
        let (mut models, of_regions, links) = row();
        let before = models.clone();
        let of_regions: Vec<&RegionSamples> = of_regions.iter().collect();
        let settings = regularise::Settings { beta, sweeps: 50 };
        let energies = regularise(&mut models, &of_regions, &links, settings);
        for pair in energies.windows(2) {
            assert!(
                pair[1].total() <= pair[0].total() + 1e-15,
                "{beta}: {energies:?}"
            );
        }
        assert_eq!(energies[0].moved, 0.0);
        let jump = |models: &[Model]| -> f64 {
            let of_link = |link: &Link| {
                let [a, b] = link.regions.map(|i| models[i].channels(link.centre));
                fit::distance(&a, &b)
            };
            links.iter().map(of_link).sum()
        };
        if beta == 0.0 {
            assert_eq!(models, before);
        } else {
            assert!(jump(&models) < jump(&before));
            assert!(energies.len() > 2);
        }
        if beta == 100.0 {
            assert!(jump(&models) < 0.01 * jump(&before));
        }
    }
}

/// The minimum of a convex function has no slope: no term of any region, moved a little either way,
/// lowers E. Here E is computed from its definition.
#[test]
fn regularisation_ends_at_a_minimum() {
    let (mut models, of_regions, links) = row();
    let originals = models.clone();
    let refs: Vec<&RegionSamples> = of_regions.iter().collect();
    let settings = regularise::Settings {
        beta: 0.5,
        sweeps: 10_000,
    };
    let mut last = f64::INFINITY;
    // Sweeps end when they gain little; go on from there until they gain nothing.
    let energy = |models: &[Model]| -> f64 {
        let mut sum = 0.0;
        for (i, model) in models.iter().enumerate() {
            let of_sample = |s: &Sample| {
                let (a, b) = (
                    model.channels(s.position),
                    originals[i].channels(s.position),
                );
                fit::distance(&a, &b)
            };
            let all: f64 = of_regions[i].samples.iter().map(of_sample).sum();
            sum += all / of_regions[i].samples.len() as f64;
        }
        for link in &links {
            let [i, j] = link.regions;
            let area = |i: usize| f64::from(models[i].bounds.half_area());
            let weight = f64::from(link.area) / (area(i) * area(j)).sqrt();
            let [a, b] = [i, j].map(|i| models[i].channels(link.centre));
            sum += 2.0 * 0.5 * weight * fit::distance(&a, &b);
        }
        sum
    };
    let energies = regularise(&mut models, &refs, &links, settings);
    let end = energies[energies.len() - 1].total();
    assert!(
        (energy(&models) / end - 1.0).abs() < 1e-3,
        "{} {end}",
        energy(&models)
    );
    last = last.min(energy(&models));
    for region in 0..3 {
        for term in 0..models[region].terms.len() {
            for step in [-0.01, 0.01] {
                let mut moved = models.clone();
                moved[region].terms[term][0] += step;
                assert!(energy(&moved) > last, "{region} {term} {step}");
            }
        }
    }
}

#[test]
fn small_region_goes_to_the_neighbour_that_is_like_it() {
    // A niche between two rooms: it continues the second, and differs from the first.
    let room = |x: f32, width: f32| Aabb {
        min: Vec3::new(x, 0.0, 0.0),
        max: Vec3::new(x + width, 2.0, 2.0),
    };
    let boxes = [room(-4.0, 4.0), room(0.5, 4.0), room(0.0, 0.5)];
    let flat = |value: f64| {
        let mut channels = [0.0; MAX_SIGNALS * COUNT];
        channels[0] = value;
        channels
    };
    let levels = [0.2, 0.8, 0.79];
    let mut of_regions: Vec<RegionSamples> = boxes
        .iter()
        .zip(levels)
        .map(|(b, level)| samples(*b, |_| true, |_| flat(level)))
        .collect();
    let mut regions: Vec<Region> = boxes
        .iter()
        .enumerate()
        .map(|(i, bounds)| Region {
            name: format!("{i}"),
            bounds: *bounds,
        })
        .collect();
    let link = |a, b, x| Link {
        regions: [a, b],
        area: 4.0,
        centre: Vec3::new(x, 1.0, 1.0),
    };
    let mut links = vec![link(0, 2, 0.0), link(1, 2, 0.5)];
    let absorbed = absorb(
        &mut regions,
        &mut of_regions,
        &mut links,
        3.0,
        Centres::Both,
    );
    assert_eq!(
        absorbed,
        [Absorbed {
            name: "2".into(),
            by: "1".into()
        }]
    );
    assert_eq!(regions.len(), 2);
    assert_eq!(regions[1].bounds, room(0.0, 4.5));
    assert_eq!(of_regions[1].samples.len(), 1024);
    assert_eq!(links, [link(0, 1, 0.0)]);
    // Nothing is left that is small.
    assert!(
        absorb(
            &mut regions,
            &mut of_regions,
            &mut links,
            3.0,
            Centres::Both
        )
        .is_empty()
    );
}

/// What a client shows of what is stored is the model, to the bound.
#[test]
fn stored_models_are_within_the_bound() {
    use crate::codec::regions::Coding;
    use crate::codec::signals::{Kernel, Signals};
    use crate::regions::sample::Regions;
    let kernels = [2.0, 300.0].map(Kernel::exponential);
    let signals = Signals::two(kernels[0], kernels[1], 0.75);
    let mut random = Rng::new(11);
    let mut models = Vec::new();
    for i in 0..18 {
        let shift = Vec3::X * (4.0 * i as f32);
        let bounds = Aabb {
            min: BOX.min + shift,
            max: BOX.max + shift,
        };
        let off = Vec3::new(random.unit(), random.unit(), random.unit()) - 0.5;
        let centre = Model::middle(&bounds) + if i % 2 == 0 { off } else { Vec3::ZERO };
        models.push(random_model(
            bounds,
            centre,
            Derivatives::ALL[i % 3],
            i as u64,
        ));
    }
    for bound in [1e-3, 1e-2, 0.1] {
        let forms: Vec<(&Model, Form)> = models
            .iter()
            .enumerate()
            .map(|(i, model)| {
                let form = Form {
                    derivatives: model.derivatives,
                    degree: i / 3 % 3,
                    signals: 1 + i / 9,
                };
                (model, form)
            })
            .collect();
        let (set, content) =
            stored::store(&forms, 2, signals, bound, Coding::Packed).expect("sound models");
        let client = Regions::new(&set, &content.regions, &content.pairs);
        for _ in 0..2000 {
            let at = Vec3::new(random.unit(), random.unit(), random.unit());
            let i = (random.unit() * 18.0) as usize;
            let (model, form) = forms[i];
            let p = model.bounds.min + at * (model.bounds.max - model.bounds.min);
            let n = direction(&mut random);
            let [a, b] = model::evaluate(&model.channels(p), form.degree, n);
            let got = f64::from(client.sample(i, p, n));
            let error = (got - model::blend(a, b, 0.75)).abs();
            assert!(
                error <= f64::from(bound) + 1e-5,
                "{bound} {form:?}: {error}"
            );
        }
    }
    let form = Form {
        derivatives: Derivatives::None,
        degree: 0,
        signals: 1,
    };
    assert!(stored::store(&[(&models[0], form)], 2, signals, 0.0, Coding::Raw).is_err());
    assert!(stored::store(&[], 2, signals, f32::NAN, Coding::Raw).is_err());
}
