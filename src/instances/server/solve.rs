//! The work of one instance.

use super::fit::{self, Fit, Sample};
use super::place::{Site, place};
use crate::obscurance::Obscurance;
use crate::scene::{Pose, Scene};
use crate::trace::Aabb;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// What all instances share.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    pub scene: &'a Scene,
    pub pose: &'a Pose,
    /// Of that scene at that pose.
    pub obscurance: &'a Obscurance<'a, 'a>,
    /// Samples an instance, [`super::SAMPLES`] by default.
    pub samples: u32,
    /// The signals that are stored, from the values of the kernels: each as it is, or a blend of two, remapped.
    pub signals: &'a (dyn Fn(&[f32]) -> Vec<f32> + Sync),
}

/// An instance's ladder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solved {
    /// One per signal. All are 1 where there is no valid sample.
    pub fits: Vec<Fit>,
    /// Valid samples.
    pub samples: usize,
    /// Samples inside geometry, which were left out.
    pub invalid: usize,
}

impl Solved {
    /// Held-out errors of none, scalar and linear, the root mean square over the signals.
    pub fn errors(&self) -> [f64; 3] {
        let rungs = |pick: &dyn Fn(&Fit) -> f64| {
            let sum: f64 = self.fits.iter().map(|fit| pick(fit).powi(2)).sum();
            (sum / self.fits.len().max(1) as f64).sqrt()
        };
        [
            rungs(&|f| f.none.error),
            rungs(&|f| f.scalar.error),
            rungs(&|f| f.linear.error),
        ]
    }
}

/// A sample with values: one per signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    pub site: Site,
    pub gold: Vec<f32>,
}

/// Fits the global function of an instance by all rungs. `local` has per signal a value per vertex of its mesh.
///
/// A pure function: the same whatever was solved before, and on any number of threads.
pub fn solve(context: &Context, instance: usize, local: &[Vec<f32>]) -> Solved {
    let (traced, invalid) = trace(context, instance);
    solve_traced(context.scene, instance, local, &traced, invalid)
}

/// [`solve`] from samples that have values already.
pub fn solve_traced(
    scene: &Scene,
    instance: usize,
    local: &[Vec<f32>],
    traced: &[Traced],
    invalid: usize,
) -> Solved {
    let mut samples = Vec::new();
    let fits = (0..local.len()).map(|signal| {
        samples.clear();
        samples.extend(samples_of(scene, instance, &local[signal], traced, signal));
        fit::fit(&samples)
    });
    Solved {
        fits: fits.collect(),
        samples: traced.len(),
        invalid,
    }
}

/// The samples of an instance outside geometry with obscurance in the scene, and how many others there are.
pub fn trace(context: &Context, instance: usize) -> (Vec<Traced>, usize) {
    let Context { scene, pose, .. } = *context;
    let sites = place(scene, pose, instance, context.samples, instance as u64);
    let kernels = context.obscurance.kernels().len();
    let traced: Vec<Traced> = sites
        .par_iter()
        .filter_map(|site| {
            let surface = site.surface(scene, pose, instance);
            let gather = context.obscurance.at_surface(&surface, site.seed);
            gather.is_valid().then(|| Traced {
                site: *site,
                gold: (context.signals)(&gather.values[..kernels]),
            })
        })
        .collect();
    let invalid = sites.len() - traced.len();
    (traced, invalid)
}

/// One signal at the samples of an instance.
pub fn samples_of<'a>(
    scene: &'a Scene,
    instance: usize,
    local: &'a [f32],
    traced: &'a [Traced],
    signal: usize,
) -> impl Iterator<Item = Sample> + 'a {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let unit = UnitBox::new(&mesh.positions);
    traced.iter().map(move |Traced { site, gold }| {
        let corners = mesh.triangles[site.triangle as usize].map(|v| v as usize);
        let weights = site.weights();
        let at = (0..3)
            .map(|k| weights[k] * mesh.positions[corners[k]])
            .sum();
        let local: f32 = (0..3).map(|k| weights[k] * local[corners[k]]).sum();
        Sample {
            at: unit.place(at),
            weight: site.area,
            local: f64::from(local),
            gold: f64::from(gold[signal]),
            held_out: site.held_out,
        }
    })
}

/// The box of a mesh, to count from -1 to 1 in.
#[derive(Clone, Copy, Debug)]
pub struct UnitBox {
    centre: Vec3,
    half: Vec3,
}

impl UnitBox {
    pub fn new(positions: &[Vec3]) -> UnitBox {
        let bounds = Aabb::of(positions.iter().copied());
        UnitBox {
            centre: bounds.centre(),
            half: 0.5 * (bounds.max - bounds.min),
        }
    }

    /// `(p - centre) / half extent`; 0 on axes without extent.
    pub fn place(&self, p: Vec3) -> DVec3 {
        let from_centre = (p - self.centre).as_dvec3();
        let half = self.half.as_dvec3();
        let axis = |i: usize| match half[i] > 0.0 {
            true => from_centre[i] / half[i],
            false => 0.0,
        };
        DVec3::new(axis(0), axis(1), axis(2))
    }
}
