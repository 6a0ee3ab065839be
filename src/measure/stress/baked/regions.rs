//! The step between the models of two rooms.

use super::super::places::{DIRECTIONS, spread};
use super::super::scene_builder::SceneBuilder;
use super::super::{Bound, Case, Effort, Finding};
use super::obscurance;
use crate::regions::server::{
    Derivatives, Form, Given, Model, Region, RegionSamples, Settings, fit_region, ladder, model,
    plan, regularise, sample,
};
use crate::scene::Scene;
use crate::trace::Aabb;
use crate::world::World;
use crate::{Error, Result};
use glam::Vec3;

pub const BOUNDARY: Case = Case {
    name: "region-boundary",
    about: "A room of 4 m and a lower one of 2 m, a region each, joined by a door of 1 m. The largest and the rms \
            step between the two models in the door, over places and 64 normals; rms error at the test points of a \
            room and at those within 0.5 m of the boundary, the larger of both rooms; and the energy that \
            regularisation leaves, as a share of that before.",
    parameter: "beta",
    beyond: "A model has one value at its centre and slopes for its whole room. What makes two of them agree in a \
             door changes them everywhere else: with a large beta the rooms are wrong, and the step, which counts at a few \
             points of the boundary alone, falls no further.",
    run: boundary,
};

const FORM: Form = Form {
    derivatives: Derivatives::Sided,
    degree: 2,
    signals: 1,
};

fn boxes() -> [Aabb; 2] {
    let bounds = |min: [f32; 3], max: [f32; 3]| Aabb {
        min: min.into(),
        max: max.into(),
    };
    [
        bounds([-4.0, 0.0, -2.0], [0.0, 3.0, 2.0]),
        bounds([0.0, 0.0, -2.0], [2.0, 2.2, 2.0]),
    ]
}

fn rooms() -> Scene {
    let mut builder = SceneBuilder::new("region-boundary", 0.5);
    builder.room(Vec3::new(-4.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0));
    // The ceiling of the lower room, and the wall about the door.
    for (min, max) in [
        ([0.05, 2.2, -2.1], [2.1, 3.1, 2.1]),
        ([-0.05, -0.1, -2.1], [0.05, 3.1, -0.5]),
        ([-0.05, -0.1, 0.5], [0.05, 3.1, 2.1]),
        ([-0.05, 2.0, -0.5], [0.05, 3.1, 0.5]),
    ] {
        builder.solid(Vec3::from(min), Vec3::from(max));
    }
    builder.build()
}

/// The largest and the root mean square difference of two models in the door.
fn step([a, b]: [&Model; 2]) -> (f64, f64) {
    const SIDE: usize = 9;
    let (mut largest, mut sum) = (0.0f64, 0.0);
    for i in 0..SIDE * SIDE {
        let share = |k: usize| (k as f32 + 0.5) / SIDE as f32;
        let p = Vec3::new(0.0, 2.0 * share(i % SIDE), share(i / SIDE) - 0.5);
        let channels = [a, b].map(|model| model.channels(p));
        for k in 0..DIRECTIONS {
            let normal = spread(k, DIRECTIONS);
            let [a, b] = channels.map(|c| model::evaluate(&c, FORM.degree, normal)[0]);
            largest = largest.max((a - b).abs());
            sum += (a - b).powi(2);
        }
    }
    (largest, (sum / (SIDE * SIDE * DIRECTIONS) as f64).sqrt())
}

fn boundary(effort: Effort) -> Result<Finding> {
    let scene = rooms();
    let world = World::new(&scene, 0.0);
    let tracer = world.tracer();
    let traced = obscurance(&world, effort.of(64, 1024))?;
    let settings = Settings {
        kernels: traced.kernels().to_vec(),
        cells: effort.of(1 << 11, 1 << 14),
        ..Settings::default()
    };
    let regions = boxes().into_iter().enumerate().map(|(i, bounds)| Region {
        name: i.to_string(),
        bounds,
    });
    let given = Given {
        regions: regions.collect(),
        links: None,
    };
    let plan = plan(&scene, world.pose(), tracer, Some(given), &settings)?;
    if plan.graph.links.is_empty() {
        return Err(Error::Invalid("no link goes through the door".into()));
    }
    let samples: Vec<RegionSamples> = boxes()
        .into_iter()
        .map(|bounds| sample(&traced, tracer, &plan.space, bounds))
        .collect::<Result<_>>()?;
    let fitted: Vec<Model> = boxes()
        .into_iter()
        .zip(&samples)
        .map(|(bounds, samples)| {
            fit_region(bounds, samples, 0.0, settings.centres)
                .model(FORM)
                .clone()
        })
        .collect();
    let near: Vec<RegionSamples> = samples
        .iter()
        .map(|samples| {
            let mut near = samples.clone();
            near.held_out.retain(|h| h.position.x.abs() < 0.5);
            near
        })
        .collect();
    let of_regions: Vec<&RegionSamples> = samples.iter().collect();

    let betas = [
        (0.0, true),
        (0.03, false),
        (0.3, true),
        (1.0, false),
        (10.0, false),
        (100.0, true),
        (10000.0, false),
    ];
    let mut finding = Finding::default();
    for beta in effort.settings(&betas) {
        let mut models = fitted.clone();
        let how = regularise::Settings {
            beta,
            ..settings.regularise
        };
        let energies = regularise(&mut models, &of_regions, &plan.graph.links, how);
        let at = beta.to_string();
        let (largest, rms) = step([&models[0], &models[1]]);
        finding.add(&at, "step, largest", largest);
        finding.add(&at, "step, rms", rms);
        let worse = |samples: &[RegionSamples]| {
            let errors = models.iter().zip(samples);
            let errors =
                errors.filter_map(|(model, samples)| ladder::error(model, FORM, samples, 0.0));
            errors.fold(0.0, f64::max)
        };
        finding.add(&at, "error, room", worse(&samples));
        finding.add(&at, "error, near the boundary", worse(&near));
        if let [first, .., last] = &energies[..] {
            let left = last.total() / first.total();
            finding.bounded(&at, "energy left", left, Bound::AtMost(1.0));
        }
    }
    Ok(finding)
}
