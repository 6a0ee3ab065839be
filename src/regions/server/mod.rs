//! The server half of `regions`: boxes of free space, and a small model of obscurance in each.
//!
//! 1. [`space`]: where objects can be; [`cover`]: boxes of it. Or boxes and links of a [`file`](mod@file).
//!    [`graph`]: which regions open into each other, and by how much.
//! 2. [`samples`]: obscurance for any normal at 8x8x8 points of each box, and test points.
//!    Regions that were found and that no model fits are divided ([`split`]).
//! 3. [`absorb`](mod@absorb): very small regions become part of a neighbour.
//! 4. [`ladder`]: every form of the [`model`] that the samples of a region allow ([`fit`](mod@fit)), with
//!    its error on the test points.
//! 5. [`regularise`](mod@regularise): models that agree better at the boundaries.
//! 6. [`stored`]: what the format holds of them.
//!
//! [`plan`] does the first step, [`bake`] all but the last. Steps 2 and 4 are pure functions of one region. Nothing
//! depends on the number of threads.

pub mod absorb;
pub mod basis;
pub mod cover;
mod dense;
pub mod file;
pub mod fit;
pub mod graph;
pub mod ladder;
pub mod model;
pub mod regularise;
pub mod samples;
pub mod space;
pub mod split;
pub mod stored;

#[cfg(test)]
mod fit_tests;
#[cfg(test)]
mod tests;

pub use absorb::Absorbed;
pub use cover::Cover;
pub use file::Given;
pub use fit::{Centres, Layout};
pub use graph::{Graph, Link, Region};
pub use ladder::{RegionFit, Rung, fit_region};
pub use model::{Derivatives, Form, Model};
pub use regularise::{Energy, regularise};
pub use samples::{RegionSamples, sample};
pub use space::Space;

use crate::obscurance::{Blend, HALF_DISTANCES, Kernel, Obscurance, VOLUME_RAYS};
use crate::scene::{Pose, Scene};
use crate::trace::Tracer;
use crate::{Error, Result};
use rayon::prelude::*;
use std::time::Instant;

/// How regions are found and baked.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// One or two.
    pub kernels: Vec<Kernel>,
    /// Rays a sample.
    pub rays: u32,
    /// Share of the second kernel where both are one signal.
    pub blend: Blend,
    /// Cells of the grid that is flooded.
    pub cells: usize,
    /// Most regions that are found.
    pub regions: usize,
    /// Cells that a region must add to those before it.
    pub least_cells: usize,
    /// Error of the blend above which a region that was found is divided, and how often it may be.
    pub tolerance: f64,
    pub divisions: usize,
    /// Regions smaller than so many cubic metres are absorbed, in scenes of a size of 4 to 40 m.
    pub small: f64,
    pub centres: Centres,
    pub regularise: regularise::Settings,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            kernels: HALF_DISTANCES
                .map(|half_distance| Kernel::Exponential { half_distance })
                .to_vec(),
            rays: VOLUME_RAYS,
            blend: Blend::default(),
            cells: 1 << 17,
            regions: 256,
            least_cells: 8,
            tolerance: 0.05,
            divisions: 2,
            small: 1.0,
            centres: Centres::Both,
            regularise: regularise::Settings {
                beta: 0.3,
                sweeps: 32,
            },
        }
    }
}

/// Free space, its regions and their links.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pub space: Space,
    pub graph: Graph,
    /// Share of the free space that the regions hold, where they were found.
    pub covered: Option<f64>,
}

/// A baked region.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionBake {
    pub region: Region,
    pub samples: RegionSamples,
    pub fit: RegionFit,
    /// The model with the derivatives that were asked for, regularised.
    pub model: Model,
}

/// A baked scene.
#[derive(Clone, Debug, Default)]
pub struct Bake {
    pub regions: Vec<RegionBake>,
    pub links: Vec<Link>,
    pub absorbed: Vec<Absorbed>,
    /// Names of found regions that were left out: none of their samples is valid.
    pub empty: Vec<String>,
    pub energies: Vec<Energy>,
}

/// Seconds of the stages of a bake, by the clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    pub plan: f64,
    pub trace: f64,
    pub absorb: f64,
    pub fit: f64,
    pub regularise: f64,
}

/// The regions of a scene: those given, or boxes that cover its free space.
///
/// # Errors
/// `Invalid` where a given region overlaps no free space, or none is found.
pub fn plan(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    given: Option<Given>,
    settings: &Settings,
) -> Result<Plan> {
    let seeds = given.as_ref().map(Given::seeds).unwrap_or_default();
    let space = Space::flood(scene, pose, tracer, &seeds, settings.cells);
    if let Some(given) = given {
        let graph = given.graph(tracer, &space)?;
        return Ok(Plan {
            space,
            graph,
            covered: None,
        });
    }
    let cover = cover::cover(&space, tracer, settings.regions, settings.least_cells);
    if cover.boxes.is_empty() {
        return Err(Error::Invalid(format!(
            "scene {} has no free space about its cameras to find regions in; give regions",
            scene.name
        )));
    }
    let regions: Vec<Region> = cover
        .boxes
        .iter()
        .enumerate()
        .map(|(i, &bounds)| Region {
            name: format!("{i}"),
            bounds,
        })
        .collect();
    let links = graph::links(tracer, &space, &regions);
    Ok(Plan {
        space,
        graph: Graph { regions, links },
        covered: Some(cover.share),
    })
}

/// Bakes the regions of a scene at a pose, which the tracer is at, too. All regions get models of the
/// same derivatives, or of the richest that their samples allow, if that is less.
///
/// # Errors
/// As [`plan`], and `Invalid` for kernels or rays that [`Obscurance::new`] refuses, more than two
/// kernels, or a setting that is no number of at least 0.
pub fn bake(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    given: Option<Given>,
    derivatives: Derivatives,
    settings: &Settings,
) -> Result<(Plan, Bake, Seconds)> {
    check(settings)?;
    let obscurance = Obscurance::new(scene, tracer, &settings.kernels, settings.rays)?;
    let mut seconds = Seconds::default();
    let is_given = given.is_some();
    let begin = Instant::now();
    let plan = plan(scene, pose, tracer, given, settings)?;
    seconds.plan = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let divisions = if is_given { 0 } else { settings.divisions };
    let sampled = plan
        .graph
        .regions
        .par_iter()
        .map(|region| {
            let region = region.clone();
            let space = &plan.space;
            split::sample_and_split(&obscurance, tracer, space, region, settings, divisions)
        })
        .collect::<Result<Vec<_>>>()?;
    let (mut regions, mut samples): (Vec<Region>, Vec<RegionSamples>) =
        sampled.into_iter().flatten().unzip();
    let mut links = match regions.len() == plan.graph.regions.len() {
        true => plan.graph.links.clone(),
        false => graph::links(tracer, &plan.space, &regions),
    };
    seconds.trace = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let mut bake = Bake::default();
    if !is_given {
        bake.empty = absorb::drop_empty(&mut regions, &mut samples, &mut links);
    }
    let volume = settings.small * f64::from(scene.length_scale()).powi(3);
    bake.absorbed = absorb::absorb(
        &mut regions,
        &mut samples,
        &mut links,
        volume,
        Centres::Both,
    );
    seconds.absorb = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let share = f64::from(settings.blend.long);
    let fits: Vec<RegionFit> = regions
        .par_iter()
        .zip(&samples)
        .map(|(region, samples)| fit_region(region.bounds, samples, share, settings.centres))
        .collect();
    seconds.fit = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let form = Form {
        derivatives,
        degree: 2,
        signals: settings.kernels.len(),
    };
    let mut models: Vec<Model> = fits.iter().map(|fit| fit.model(form).clone()).collect();
    let of_regions: Vec<&RegionSamples> = samples.iter().collect();
    bake.energies = regularise(&mut models, &of_regions, &links, settings.regularise);
    seconds.regularise = begin.elapsed().as_secs_f64();

    bake.links = links;
    bake.regions = regions
        .into_iter()
        .zip(samples)
        .zip(fits)
        .zip(models)
        .map(|(((region, samples), fit), model)| RegionBake {
            region,
            samples,
            fit,
            model,
        })
        .collect();
    Ok((plan, bake, seconds))
}

fn check(settings: &Settings) -> Result<()> {
    settings.blend.check()?;
    for (name, number) in [
        ("tolerance of regions", settings.tolerance),
        ("size of small regions", settings.small),
        ("weight of the boundaries", settings.regularise.beta),
    ] {
        if !(number >= 0.0 && number.is_finite()) {
            return Err(Error::Invalid(format!(
                "the {name} is {number}; it must be a number of at least 0"
            )));
        }
    }
    if settings.kernels.len() > samples::MAX_SIGNALS {
        return Err(Error::Invalid(format!(
            "{} distances of obscurance; regions have at most {}",
            settings.kernels.len(),
            samples::MAX_SIGNALS
        )));
    }
    Ok(())
}
