//! Regions for objects that move, baked beside the instances of a scene. They are no items of work: the process
//! that fits a bake traces them, too.

use super::{Plan, Settings};
use crate::codec::regions::{Coding, Content, RegionSet};
use crate::regions::server::stored::store;
use crate::regions::server::{self as regions, Derivatives, Form, Given, Model, RegionBake, Rung};
use crate::trace::Tracer;
use crate::{Error, Result};

/// Rays of a sample in space for each ray of one on a surface: 1,024 and 256 (section 4 of the paper).
const RAYS: u32 = 4;

/// How far AO may be from that of the model, by quantising: a quarter of a step of 8-bit obscurance.
const BOUND: f32 = 1.0 / 1024.0;

/// The track of a scene's regions.
#[derive(Clone, Debug)]
pub struct Regions {
    pub set: RegionSet,
    pub content: Content,
    pub report: Report,
}

/// What the bake of regions met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    pub regions: usize,
    /// Very small ones that became part of a neighbour.
    pub absorbed: usize,
    /// Share of the free space that the regions hold, where they were found.
    pub covered: Option<f64>,
    /// Numbers that the track holds.
    pub coefficients: usize,
    /// Root mean square over the regions' held-out errors; `None` where none was measured.
    pub error: Option<f64>,
    /// Regions that no form describes within the tolerance.
    pub beyond_tolerance: usize,
}

/// Bakes the regions that are given, or those that are found.
///
/// With a tolerance a region takes the form of fewest coefficients whose held-out error is at most that, or else
/// the one with the least error. Otherwise all have six derivatives of degree 1, as in the paper's engine.
///
/// # Errors
/// As [`regions::bake`] and [`store`]; `Invalid` for a curve, which a sum of functions cannot follow.
pub fn bake(plan: &Plan, given: Option<Given>) -> Result<Regions> {
    let (scene, pose, settings) = (plan.scene(), plan.pose(), plan.settings());
    if settings.tone.remap != Default::default() {
        let text = "regions cannot follow a curve of values; bake them without --remap";
        return Err(Error::Invalid(text.into()));
    }
    let tracer = Tracer::new(scene, pose);
    let of_regions = regions::Settings {
        kernels: settings.vertices.kernels.clone(),
        rays: RAYS * settings.vertices.rays,
        blend: settings.tone.blend,
        ..regions::Settings::default()
    };
    let (found, bake, _) =
        regions::bake(scene, pose, &tracer, given, Derivatives::Sided, &of_regions)?;
    let kernels = of_regions.kernels.len();
    let signals = settings.tone.signals(kernels);
    let chosen: Vec<Rung> = bake
        .regions
        .iter()
        .map(|region| choose(region, settings.tolerance, signals))
        .collect();
    let models: Vec<(&Model, Form)> = bake
        .regions
        .iter()
        .zip(&chosen)
        .map(|(region, rung)| (model(region, rung.form), rung.form))
        .collect();
    let signals = settings.block();
    let (set, content) = store(&models, kernels, signals, BOUND, Coding::Packed)?;
    let errors: Vec<f64> = chosen.iter().filter_map(|rung| rung.error).collect();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    let tolerance = settings.tolerance.unwrap_or(f64::INFINITY);
    let report = Report {
        regions: bake.regions.len(),
        absorbed: bake.absorbed.len(),
        covered: found.covered,
        coefficients: chosen.iter().map(|rung| rung.form.coefficients()).sum(),
        error: (!errors.is_empty()).then(|| (squares / errors.len() as f64).sqrt()),
        beyond_tolerance: errors.iter().filter(|error| **error > tolerance).count(),
    };
    Ok(Regions {
        set,
        content,
        report,
    })
}

/// The track of baked regions that all have this form, or as many of its derivatives as their samples allow.
/// `settings` are those that they were baked with.
///
/// # Errors
/// As [`store`].
pub fn of_form(regions: &[RegionBake], form: Form, settings: &Settings) -> Result<Regions> {
    let models: Vec<(&Model, Form)> = regions
        .iter()
        .map(|region| {
            let model = model(region, form);
            let derivatives = model.derivatives.min(form.derivatives);
            (
                model,
                Form {
                    derivatives,
                    ..form
                },
            )
        })
        .collect();
    let kernels = settings.vertices.kernels.len();
    let (set, content) = store(&models, kernels, settings.block(), BOUND, Coding::Packed)?;
    Ok(Regions {
        set,
        content,
        report: Report {
            regions: regions.len(),
            coefficients: models.iter().map(|(_, form)| form.coefficients()).sum(),
            ..Report::default()
        },
    })
}

/// The rung of a region.
fn choose(region: &RegionBake, tolerance: Option<f64>, signals: usize) -> Rung {
    let richest = region.model.derivatives;
    let rungs = region.fit.rungs.iter().copied();
    let rungs: Vec<Rung> = rungs.filter(|rung| rung.form.signals == signals).collect();
    let error = |rung: &Rung| rung.error.unwrap_or(0.0);
    let found = match tolerance {
        Some(tolerance) => {
            let within = rungs.iter().find(|rung| error(rung) <= tolerance);
            within.or_else(|| rungs.iter().min_by(|a, b| error(a).total_cmp(&error(b))))
        }
        None => rungs
            .iter()
            .find(|rung| rung.form.derivatives == richest && rung.form.degree == 1),
    };
    found.copied().unwrap_or(Rung {
        form: Form {
            derivatives: Derivatives::None,
            degree: 0,
            signals,
        },
        error: None,
    })
}

/// The model that a form is taken from: the regularised one where it has the same derivatives.
fn model(region: &RegionBake, form: Form) -> &Model {
    match region.model.derivatives == form.derivatives {
        true => &region.model,
        false => region.fit.model(form),
    }
}
