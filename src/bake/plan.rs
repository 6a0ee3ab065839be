//! What a bake of a scene consists of.

use super::Settings;
use crate::instances::server::{self as instances, Group};
use crate::obscurance::foliage::{self, Foliage, Verdict};
use crate::obscurance::{Gather, Obscurance};
use crate::scene::{Pose, Scene};
use crate::trace::Tracer;
use crate::vertices::server::place::{self, Site};
use crate::vertices::server::{self as vertices, Shape};
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
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
    pub(super) scene: &'s Scene,
    pub(super) pose: &'s Pose,
    pub(super) settings: Settings,
    /// Meshes whose instances share local values; one of each hash.
    pub(super) groups: Vec<Group>,
    pub(super) surfaces: Vec<Surface>,
    items: Vec<Item>,
}

/// An instance and its samples.
pub(super) struct Surface {
    pub kind: Kind,
    pub sites: Vec<Site>,
}

/// How an instance is described.
pub(super) enum Kind {
    /// Whatever rung suits it, up to values at its vertices.
    Any(Shape),
    /// Values at its vertices: its mesh is the same as that of a group, whose local values it must not get.
    Vertices(Shape),
    /// An instance of a group, which has few samples.
    Grouped(usize),
}

impl<'s> Plan<'s> {
    /// Places the samples.
    ///
    /// # Errors
    /// `Invalid` for settings out of bounds, and where no face of the scene takes a sample.
    pub fn new(scene: &'s Scene, pose: &'s Pose, settings: Settings) -> Result<Plan<'s>> {
        settings.vertices.check()?;
        settings.tone.blend.check()?;
        let mut groups = match settings.instances {
            true => instances::groups(scene, pose),
            false => Vec::new(),
        };
        // Equal meshes have one track of local values.
        let mut hashes = BTreeMap::new();
        groups.retain(|group| hashes.insert(scene.mesh_hash(group.mesh), ()).is_none());
        let mut group_of = vec![None; scene.instances.len()];
        for (number, group) in groups.iter().enumerate() {
            for &instance in &group.instances {
                group_of[instance] = Some(number);
            }
        }
        let surfaces: Vec<Surface> = (0..scene.instances.len())
            .into_par_iter()
            .map(|instance| {
                if let Some(group) = group_of[instance] {
                    return Surface {
                        kind: Kind::Grouped(group),
                        sites: few_sites(scene, pose, instance),
                    };
                }
                let shape = Shape::new(scene, pose, instance);
                let sites = place::place(scene, instance, &shape, settings.vertices.sampling);
                let hash = scene.mesh_hash(scene.instances[instance].mesh);
                let kind = match hashes.contains_key(&hash) || settings.tolerance.is_none() {
                    true => Kind::Vertices(shape),
                    false => Kind::Any(shape),
                };
                Surface { kind, sites }
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
            groups,
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

    /// The samples of an instance.
    pub fn sites(&self, instance: usize) -> &[Site] {
        &self.surfaces[instance].sites
    }

    /// Whether the instances of some mesh share local values.
    pub fn has_groups(&self) -> bool {
        !self.groups.is_empty()
    }

    /// Whether an instance shares local values with others of its mesh.
    pub fn is_grouped(&self, instance: usize) -> bool {
        matches!(self.surfaces[instance].kind, Kind::Grouped(_))
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

    /// What each mesh is taken for where foliage attenuates rays.
    pub fn foliage(&self) -> Vec<Option<Verdict>> {
        match &self.settings.foliage {
            Some(settings) => foliage::classify(self.scene, self.pose, &settings.rules),
            None => vec![None; self.scene.meshes.len()],
        }
    }

    /// Traces items; `done` is told the samples of each as it is finished, from any thread, and 0 when the
    /// hierarchies are built.
    ///
    /// # Errors
    /// `Invalid` for settings that [`Obscurance::new`] or [`Foliage::new`] refuses.
    pub fn trace(&self, items: Range<usize>, done: &(dyn Fn(usize) + Sync)) -> Result<Vec<Traced>> {
        self.with_obscurance(self.settings.vertices.rays, |obscurance| {
            done(0);
            let traced = self.items[items].par_iter().map(|item| {
                let sites = &self.surfaces[item.instance].sites[item.samples.clone()];
                let traced = vertices::trace(obscurance, self.pose, item.instance, sites);
                done(sites.len());
                traced
            });
            traced.collect()
        })
    }

    /// Calls `work` with what traces obscurance as the samples of the plan have it, by so many rays.
    ///
    /// # Errors
    /// `Invalid` for settings that [`Obscurance::new`] or [`Foliage::new`] refuses.
    pub fn with_obscurance<T>(&self, rays: u32, work: impl FnOnce(&Obscurance) -> T) -> Result<T> {
        let (scene, pose) = (self.scene, self.pose);
        let density = self
            .settings
            .foliage
            .as_ref()
            .map(|settings| settings.density);
        let foliage = density.map(|density| Foliage::new(scene, pose, &self.foliage(), density));
        let foliage = foliage.transpose()?;
        let attenuation = foliage.as_ref().map(Foliage::attenuation);
        let tracer = match &foliage {
            Some(foliage) => Tracer::new(scene, &foliage.without(pose)),
            None => Tracer::new(scene, pose),
        };
        let kernels = &self.settings.vertices.kernels;
        let mut obscurance = Obscurance::new(scene, &tracer, kernels, rays)?;
        if let Some(attenuation) = &attenuation {
            obscurance = obscurance.with_foliage(attenuation);
        }
        Ok(work(&obscurance))
    }

    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    pub fn pose(&self) -> &'s Pose {
        self.pose
    }
}

/// The samples of an instance of a group.
fn few_sites(scene: &Scene, pose: &Pose, instance: usize) -> Vec<Site> {
    let sites = instances::place::place(scene, pose, instance, instances::SAMPLES, instance as u64);
    let same = sites.iter().map(|site| Site {
        triangle: site.triangle,
        u: site.u,
        v: site.v,
        area: site.area,
        seed: site.seed,
    });
    same.collect()
}
