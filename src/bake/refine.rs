//! Shared local values that suit the instances of a mesh better than those of the object alone.

use super::plan::Plan;
use super::signals::{Local, unorm8};
use crate::instances::server::place::Site;
use crate::instances::server::solve::Traced;
use crate::instances::server::{self as instances, Group};
use crate::obscurance::Gather;

impl Plan<'_> {
    /// The local values of a group, refined to the samples of its instances, signal by signal where that lowers the error
    /// over those held out ([`mod@instances::refine`]). `gathers` are those of each instance of the scene.
    pub(super) fn refine_local(
        &self,
        group: &Group,
        local: Local,
        gathers: &[Vec<Gather>],
    ) -> Local {
        let traced: Vec<(usize, Vec<Traced>)> = group
            .instances
            .iter()
            .map(|&instance| (instance, self.traced(instance, &gathers[instance])))
            .collect();
        let borrowed: Vec<(usize, &[Traced])> = traced.iter().map(|(i, t)| (*i, &t[..])).collect();
        let refined = |(signal, values): (usize, &Vec<u8>)| {
            let given: Vec<f32> = values.iter().map(|v| f32::from(*v) / 255.0).collect();
            let refined = instances::refine(self.scene, group.mesh, &borrowed, &given, signal);
            refined.local.iter().map(|v| unorm8(*v)).collect()
        };
        let signals = local.signals.iter().enumerate().map(refined).collect();
        Local { signals, ..local }
    }

    /// The valid samples of an instance and what is there.
    fn traced(&self, instance: usize, gathers: &[Gather]) -> Vec<Traced> {
        let sites = &self.surfaces[instance].sites;
        let (samples, numbers) = self.ladder_samples(instance, sites, gathers);
        let pairs = samples.into_iter().zip(numbers);
        let traced = pairs.map(|(sample, number)| Traced {
            site: Site {
                triangle: sites[number].triangle,
                u: sites[number].u,
                v: sites[number].v,
                area: sites[number].area,
                seed: sites[number].seed,
                held_out: sample.held_out,
            },
            gold: sample.gold,
        });
        traced.collect()
    }
}
