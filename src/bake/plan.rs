//! What a bake of a scene consists of.

use super::signals::{Baked, InstanceSignals};
use super::{Settings, Tone};
use crate::obscurance::{Gather, Obscurance};
use crate::scene::{Pose, Scene};
use crate::vertices::place::{self, Site};
use crate::vertices::{self, Report, Shape};
use crate::{Error, Result};
use rayon::prelude::*;
use std::ops::Range;

/// Most samples of an item: a fraction of a second of tracing.
const ITEM_SAMPLES: usize = 2048;

/// A piece of work whose result depends on nothing but the scene and the settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    pub instance: usize,
    /// Which of the instance's samples.
    pub samples: Range<usize>,
}

/// What the rays of an item's samples found.
pub type Traced = Vec<Gather>;

/// The surfaces of a scene at a pose, their samples, and the items of work.
pub struct Plan<'s> {
    scene: &'s Scene,
    pose: &'s Pose,
    settings: Settings,
    surfaces: Vec<Surface>,
    items: Vec<Item>,
}

struct Surface {
    shape: Shape,
    sites: Vec<Site>,
}

impl<'s> Plan<'s> {
    /// Places the samples.
    ///
    /// # Errors
    /// `Invalid` for settings out of bounds, and where no face of the scene takes a sample.
    pub fn new(scene: &'s Scene, pose: &'s Pose, settings: Settings) -> Result<Plan<'s>> {
        settings.vertices.check()?;
        settings.tone.blend.check()?;
        let surfaces: Vec<Surface> = (0..scene.instances.len())
            .into_par_iter()
            .map(|instance| {
                let shape = Shape::new(scene, pose, instance);
                let sites = place::place(scene, instance, &shape, settings.vertices.sampling);
                Surface { shape, sites }
            })
            .collect();
        let items: Vec<Item> = surfaces
            .iter()
            .enumerate()
            .flat_map(|(instance, surface)| {
                let count = surface.sites.len();
                (0..count).step_by(ITEM_SAMPLES).map(move |first| Item {
                    instance,
                    samples: first..count.min(first + ITEM_SAMPLES),
                })
            })
            .collect();
        if items.is_empty() {
            return Err(Error::Scene {
                name: scene.name.clone(),
                message: "no face of it can be baked: each is see-through or has no area".into(),
            });
        }
        Ok(Plan {
            scene,
            pose,
            settings,
            surfaces,
            items,
        })
    }

    /// The items, in an order that follows from the scene and the settings.
    pub fn items(&self) -> &[Item] {
        &self.items
    }

    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Numbers that stand for the result of a sample: one per kernel, and the share of rays that met a
    /// back.
    pub fn numbers(&self) -> usize {
        self.settings.vertices.kernels.len() + 1
    }

    /// Samples of all items.
    pub fn samples(&self) -> usize {
        self.items.iter().map(|item| item.samples.len()).sum()
    }

    /// Instances without a sample: see-through, or without area.
    pub fn unsampled(&self) -> impl Iterator<Item = usize> {
        let numbered = self.surfaces.iter().enumerate();
        numbered.filter_map(|(i, surface)| surface.sites.is_empty().then_some(i))
    }

    /// The items of task `task` of `tasks`, from 0: neighbours, of about the same cost for each task.
    pub fn share(&self, task: usize, tasks: usize) -> Range<usize> {
        let total = self.samples() as u128;
        let mut before = 0u128;
        // The task in whose part of the whole cost an item begins.
        let owners = self.items.iter().map(|item| {
            let owner = before * tasks as u128 / total.max(1);
            before += item.samples.len() as u128;
            owner as usize
        });
        let owners: Vec<usize> = owners.collect();
        owners.partition_point(|o| *o < task)..owners.partition_point(|o| *o <= task)
    }

    /// Traces items; `done` is told the samples of each as it is finished, from any thread.
    pub fn trace(
        &self,
        obscurance: &Obscurance,
        items: Range<usize>,
        done: &(dyn Fn(usize) + Sync),
    ) -> Vec<Traced> {
        self.items[items]
            .par_iter()
            .map(|item| {
                let sites = &self.surfaces[item.instance].sites[item.samples.clone()];
                let traced = vertices::trace(obscurance, self.pose, item.instance, sites);
                done(sites.len());
                traced
            })
            .collect()
    }

    /// Fits all instances to the results of all items, in their order; `done` is told each instance that
    /// is finished, from any thread.
    pub fn fit(&self, traced: &[Traced], done: &(dyn Fn() + Sync)) -> (Baked, Vec<Report>) {
        let mut of_instance = vec![Vec::new(); self.surfaces.len()];
        for (item, traced) in self.items.iter().zip(traced) {
            of_instance[item.instance].extend_from_slice(traced);
        }
        let fitted: Vec<(InstanceSignals, Report)> = self
            .surfaces
            .par_iter()
            .zip(&of_instance)
            .map(|(surface, gathers)| {
                let fitted = self.fit_instance(surface, gathers);
                done();
                fitted
            })
            .collect();
        let (instances, reports) = fitted.into_iter().unzip();
        let Tone { blend, .. } = self.settings.tone;
        (Baked { instances, blend }, reports)
    }

    fn fit_instance(&self, surface: &Surface, gathers: &[Gather]) -> (InstanceSignals, Report) {
        let Surface { shape, sites } = surface;
        let vertices::Settings { kernels, alpha, .. } = &self.settings.vertices;
        let samples = vertices::valid_samples(sites, gathers, kernels.len());
        let mean = vertices::mean(samples.clone(), kernels.len());
        let fitted = vertices::fit_instance(shape, sites.len(), samples, kernels.len(), *alpha);
        let signals = InstanceSignals::new(&self.settings.tone, &fitted, &mean);
        (signals, fitted.report)
    }

    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    pub fn pose(&self) -> &'s Pose {
        self.pose
    }
}
