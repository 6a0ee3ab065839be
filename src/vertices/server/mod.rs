//! Ambient obscurance per mesh vertex, fitted to samples on the faces (Sloan, Tranchida, Chen and
//! Kavan 2013, *Ambient Obscurance Baking on the GPU*, section 2.1).
//!
//! [`bake`] does the whole job for a scene at one pose:
//!
//! - [`shape`]: an instance as it is placed, its vertices welded by position and normal.
//! - [`place`]: samples on the faces, at most so many a face. [`crate::obscurance`] traces them; those
//!   inside geometry are left out.
//! - [`fit()`]: the values that minimise the error over the surface plus what they bend across edges
//!   ([`energy`], [`hinge`]), within 0..=1 ([`bounded`]), by a sparse Cholesky factor ([`sparse`],
//!   [`dissect`], [`cholesky`]). [`fill`] gives values to vertices that no sample says anything of.
//! - [`resample`]: values of a lower level of detail from those of the full mesh.
//! - [`baseline`]: what bakers commonly do, to compare with.
//!
//! Each instance is fitted on its own and by itself has the values that its vertices need, in the
//! order of its mesh. The result does not depend on the number of threads.
//!
//! What was measured, and where this differs from the papers, is in `docs/vertices.md`.

pub mod baseline;
pub mod bounded;
pub mod cholesky;
pub mod dissect;
pub mod energy;
pub mod fill;
pub mod fit;
pub mod hinge;
pub mod place;
pub mod resample;
pub mod shape;
pub mod sparse;

#[cfg(test)]
mod solver_tests;
#[cfg(test)]
mod tests;

pub use energy::Sample;
pub use fit::{FitReport, fit};
pub use place::{Sampling, Site};
pub use shape::Shape;

use crate::obscurance::{Gather, HALF_DISTANCES, Kernel, Obscurance, SURFACE_RAYS};
use crate::scene::{Pose, Scene};
use crate::trace::Tracer;
use crate::{Error, Result};
use rayon::prelude::*;
use std::time::Instant;

/// How a scene is baked.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Each gives one value a vertex.
    pub kernels: Vec<Kernel>,
    /// Rays a sample.
    pub rays: u32,
    pub sampling: Sampling,
    /// Weight of the regulariser (section 2.1 finds 1 to work well).
    pub alpha: f64,
}

impl Default for Settings {
    /// Those of the paper: half-distances of 2 m and 300 m, 256 rays, alpha 1.
    fn default() -> Self {
        Settings {
            kernels: HALF_DISTANCES
                .map(|half_distance| Kernel::Exponential { half_distance })
                .to_vec(),
            rays: SURFACE_RAYS,
            sampling: Sampling::default(),
            alpha: 1.0,
        }
    }
}

impl Settings {
    /// # Errors
    /// `Invalid` for a density or alpha that is no number of at least 0.
    pub fn check(&self) -> Result<()> {
        for (name, number) in [
            ("density of samples", self.sampling.density),
            ("weight of the regulariser", self.alpha),
        ] {
            if !(number >= 0.0 && number.is_finite()) {
                return Err(Error::Invalid(format!(
                    "the {name} is {number}; it must be a number of at least 0"
                )));
            }
        }
        Ok(())
    }
}

/// A baked scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bake {
    /// One per instance of the scene.
    pub instances: Vec<InstanceBake>,
}

/// A baked instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InstanceBake {
    /// Per kernel a value in 0..=1 per vertex of the instance's mesh, in its order.
    pub values: Vec<Vec<f32>>,
    pub report: Report,
}

/// What the bake of an instance met.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    pub vertices: usize,
    /// Vertices after welding.
    pub variables: usize,
    /// Triangles with an area that are not see-through.
    pub triangles: usize,
    pub samples: usize,
    /// Samples inside geometry, which were left out.
    pub invalid: usize,
    pub fit: FitReport,
}

/// Seconds of the stages of a bake, by the clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Welding, and placing samples.
    pub place: f64,
    pub trace: f64,
    /// Everything else: building the systems, solving them, filling.
    pub fit: f64,
}

/// Bakes all instances of a scene at a pose, which the tracer is at, too.
///
/// # Errors
/// `Invalid` for kernels or a number of rays that [`Obscurance::new`] refuses, or for a density or
/// alpha that is no number of at least 0.
pub fn bake(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    settings: &Settings,
) -> Result<(Bake, Seconds)> {
    let obscurance = Obscurance::new(scene, tracer, &settings.kernels, settings.rays)?;
    settings.check()?;
    let mut seconds = Seconds::default();
    let begin = Instant::now();
    let surfaces: Vec<(Shape, Vec<Site>)> = (0..scene.instances.len())
        .into_par_iter()
        .map(|instance| {
            let shape = Shape::new(scene, pose, instance);
            let sites = place::place(scene, instance, &shape, settings.sampling);
            (shape, sites)
        })
        .collect();
    seconds.place = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let gathers: Vec<Vec<Gather>> = surfaces
        .par_iter()
        .enumerate()
        .map(|(instance, (_, sites))| trace(&obscurance, pose, instance, sites))
        .collect();
    seconds.trace = begin.elapsed().as_secs_f64();

    let begin = Instant::now();
    let instances = surfaces
        .par_iter()
        .zip(&gathers)
        .map(|((shape, sites), gathers)| {
            let signals = settings.kernels.len();
            let samples = valid_samples(sites, gathers, signals);
            fit_instance(shape, sites.len(), samples, signals, settings.alpha)
        })
        .collect();
    seconds.fit = begin.elapsed().as_secs_f64();
    Ok((Bake { instances }, seconds))
}

/// What the rays of each site of an instance found.
pub fn trace(obscurance: &Obscurance, pose: &Pose, instance: usize, sites: &[Site]) -> Vec<Gather> {
    sites
        .par_iter()
        .map(|site| {
            let surface = site.surface(obscurance.scene(), pose, instance);
            obscurance.at_surface(&surface, site.seed)
        })
        .collect()
}

/// The bake of an instance from those of its `placed` samples that have values.
pub fn fit_instance<'a>(
    shape: &Shape,
    placed: usize,
    samples: impl Iterator<Item = Sample<'a>> + Clone,
    signals: usize,
    alpha: f64,
) -> InstanceBake {
    let valid = samples.clone().count();
    let default = mean(samples.clone(), signals);
    let fit = fit(shape, samples, signals, alpha, &default);
    let values = fit.values.iter();
    InstanceBake {
        values: values.map(|all| of_vertices(shape, all)).collect(),
        report: Report {
            vertices: shape.variable_of.len(),
            variables: shape.variables(),
            triangles: shape.receives.iter().filter(|receives| **receives).count(),
            samples: placed,
            invalid: placed - valid,
            fit: fit.report,
        },
    }
}

/// The samples that are outside geometry, with `signals` values each.
pub fn valid_samples<'a>(
    sites: &'a [Site],
    gathers: &'a [Gather],
    signals: usize,
) -> impl Iterator<Item = Sample<'a>> + Clone {
    let all = sites.iter().zip(gathers);
    all.filter(|(_, gather)| gather.is_valid())
        .map(move |(site, gather)| Sample {
            site,
            values: &gather.values[..signals],
        })
}

/// Mean of each signal over the area that the samples stand for; 1 (open) where there is none.
pub fn mean<'a>(samples: impl Iterator<Item = Sample<'a>>, signals: usize) -> Vec<f64> {
    let (mut sums, mut area) = (vec![0.0; signals], 0.0);
    for Sample { site, values } in samples {
        area += site.area;
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += site.area * f64::from(*value);
        }
    }
    sums.iter()
        .map(|sum| if area > 0.0 { sum / area } else { 1.0 })
        .collect()
}

/// Values of variables, per vertex of the mesh.
pub fn of_vertices(shape: &Shape, values: &[f64]) -> Vec<f32> {
    let variables = shape.variable_of.iter();
    variables.map(|v| values[*v as usize] as f32).collect()
}
