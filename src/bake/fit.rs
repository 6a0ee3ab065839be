//! From what rays found to what a bake says of each instance.

use super::ladder::{self, Ladder, Rung, Sample};
use super::plan::{Kind, Plan, Surface, Traced};
use super::signals::{Baked, Choice, InstanceSignals, Local, unorm8};
use crate::Result;
use crate::instances::server::solve::UnitBox;
use crate::instances::server::{self as instances, Group};
use crate::obscurance::{Gather, Obscurance};
use crate::trace::Tracer;
use crate::vertices::server::place::{self, Site};
use crate::vertices::server::{self as vertices, Report, Shape};
use rayon::prelude::*;

/// An instance after the fit.
struct Fitted {
    signals: InstanceSignals,
    choice: Choice,
    report: Report,
}

impl Plan<'_> {
    /// Fits all instances to the results of all items, in their order; `done` is told each instance that
    /// is finished, from any thread.
    ///
    /// # Errors
    /// As [`Obscurance::new`].
    pub fn fit(&self, traced: &[Traced], done: &(dyn Fn() + Sync)) -> Result<(Baked, Vec<Report>)> {
        let of_instance = self.by_instance(traced);
        let locals: Vec<Local> = self
            .groups
            .par_iter()
            .map(|group| {
                let alone = self.bake_alone(group)?;
                Ok(self.refine_local(group, alone, &of_instance))
            })
            .collect::<Result<_>>()?;
        let mut fitted: Vec<Fitted> = self
            .surfaces
            .par_iter()
            .zip(&of_instance)
            .enumerate()
            .map(|(instance, (surface, gathers))| {
                let fitted = self.fit_instance(instance, surface, gathers, &locals);
                done();
                fitted
            })
            .collect();
        self.choose_in_groups(&mut fitted, &locals);
        let mut baked = Baked {
            blend: self.settings.tone.blend,
            locals,
            ..Baked::default()
        };
        let mut reports = Vec::new();
        for fitted in fitted {
            baked.instances.push(fitted.signals);
            baked.choices.push(fitted.choice);
            reports.push(fitted.report);
        }
        Ok((baked, reports))
    }

    /// The results of all items, in their order, by instance: one for each of its samples.
    pub fn by_instance(&self, traced: &[Traced]) -> Vec<Vec<Gather>> {
        let mut of_instance = vec![Vec::new(); self.surfaces.len()];
        for (item, traced) in self.items().iter().zip(traced) {
            of_instance[item.instance].extend_from_slice(traced);
        }
        of_instance
    }

    /// The local values of a mesh: those of the object alone in the world.
    pub(super) fn bake_alone(&self, group: &Group) -> Result<Local> {
        let (scene, pose) = group.alone(self.scene, self.pose);
        let settings = &self.settings.vertices;
        let tracer = Tracer::new(&scene, &pose);
        let obscurance = Obscurance::new(&scene, &tracer, &settings.kernels, settings.rays)?;
        let shape = Shape::new(&scene, &pose, 0);
        let sites = place::place(&scene, 0, &shape, settings.sampling);
        let gathers = vertices::trace(&obscurance, &pose, 0, &sites);
        let (signals, _) = self.fit_vertices(&shape, &sites, &gathers, |_| true);
        Ok(Local {
            mesh: group.mesh,
            signals: signals.vertices,
        })
    }

    fn fit_instance(
        &self,
        instance: usize,
        surface: &Surface,
        gathers: &[Gather],
        locals: &[Local],
    ) -> Fitted {
        let sites = &surface.sites;
        match &surface.kind {
            Kind::Vertices(shape) => {
                let (signals, report) = self.fit_vertices(shape, sites, gathers, |_| true);
                Fitted {
                    signals,
                    choice: Choice::vertices(),
                    report,
                }
            }
            Kind::Any(shape) => self.fit_any(instance, shape, sites, gathers),
            Kind::Grouped(group) => self.fit_grouped(instance, sites, gathers, &locals[*group]),
        }
    }

    /// An instance of its own by the cheapest rung within the tolerance.
    fn fit_any(
        &self,
        instance: usize,
        shape: &Shape,
        sites: &[Site],
        gathers: &[Gather],
    ) -> Fitted {
        let tone = &self.settings.tone;
        let (samples, numbers) = self.ladder_samples(instance, sites, gathers);
        let mut ladder = Ladder::functions(&samples, self.signals(), tone, None);
        let mut held_out = vec![false; sites.len()];
        for (sample, &number) in samples.iter().zip(&numbers) {
            held_out[number] = sample.held_out;
        }
        let (part, _) = self.fit_vertices(shape, sites, gathers, |site| !held_out[site]);
        let mesh = &self.scene.meshes[self.scene.instances[instance].mesh];
        ladder.add_vertices(&samples, tone, |sample| {
            part.at(&mesh.triangles, &sites[numbers[sample]])
        });
        let tolerance = self.settings.tolerance.unwrap_or(0.0);
        let size = (self.signals(), mesh.positions.len());
        let chosen = ladder.choose(tolerance, size, |_| true);
        let (signals, report) = self.fit_vertices(shape, sites, gathers, |_| true);
        let mut fitted = Fitted {
            signals,
            choice: Choice {
                ladder: ladder.clone(),
                ..Choice::vertices()
            },
            report,
        };
        if let Some(chosen) = chosen {
            self.take(instance, &mut fitted, chosen, None);
        }
        fitted
    }

    /// The ladder of an instance of a group. Which rung it takes is decided for all of them together.
    fn fit_grouped(
        &self,
        instance: usize,
        sites: &[Site],
        gathers: &[Gather],
        local: &Local,
    ) -> Fitted {
        let (samples, numbers) = self.ladder_samples(instance, sites, gathers);
        let mesh = &self.scene.meshes[self.scene.instances[instance].mesh];
        let at = |sample: usize| local.at(&mesh.triangles, &sites[numbers[sample]]);
        let tone = &self.settings.tone;
        let ladder = Ladder::functions(&samples, self.signals(), tone, Some(&at));
        let kernels = self.settings.vertices.kernels.len();
        let mean = vertices::mean(vertices::valid_samples(sites, gathers, kernels), kernels);
        Fitted {
            signals: InstanceSignals {
                vertices: Vec::new(),
                mean: tone.means(&mean),
            },
            choice: Choice {
                rung: Rung::Local,
                ladder,
                ..Choice::vertices()
            },
            report: Report {
                vertices: mesh.positions.len(),
                triangles: mesh.triangles.len(),
                samples: sites.len(),
                invalid: sites.len() - samples.len(),
                ..Report::default()
            },
        }
    }

    /// Chooses the rungs of grouped instances.
    fn choose_in_groups(&self, fitted: &mut [Fitted], locals: &[Local]) {
        let tolerance = self.settings.tolerance.unwrap_or(0.0);
        for (group, local) in self.groups.iter().zip(locals) {
            let size = (
                self.signals(),
                self.scene.meshes[group.mesh].positions.len(),
            );
            let members = &group.instances;
            let ladders: Vec<&Ladder> = members.iter().map(|i| &fitted[*i].choice.ladder).collect();
            let has_local =
                self.settings.tolerance.is_none() || ladder::takes_local(&ladders, tolerance, size);
            for &instance in members {
                let ladder = fitted[instance].choice.ladder.clone();
                let allowed = |rung: Rung| rung.has_local() == has_local;
                if let Some(chosen) = ladder.choose(tolerance, size, allowed) {
                    self.take(instance, &mut fitted[instance], chosen, Some(local));
                }
            }
        }
    }

    /// Gives an instance the values of a rung.
    fn take(
        &self,
        instance: usize,
        fitted: &mut Fitted,
        chosen: &ladder::Measured,
        local: Option<&Local>,
    ) {
        fitted.choice.rung = chosen.rung;
        fitted.choice.functions = chosen.functions.clone();
        if chosen.rung == Rung::Vertices {
            return;
        }
        let local = local.filter(|_| chosen.rung.has_local());
        let values = self.values(instance, &chosen.functions, local);
        let before = std::mem::replace(&mut fitted.signals.vertices, values);
        fitted.choice.fitted = (!before.is_empty()).then_some(before);
    }

    /// Per signal the values at the vertices of an instance that come of functions of place times local values. Where
    /// either is missing it counts as 1.
    fn values(
        &self,
        instance: usize,
        functions: &[instances::fit::Linear],
        local: Option<&Local>,
    ) -> Vec<Vec<u8>> {
        let signals = self.signals();
        let mesh = &self.scene.meshes[self.scene.instances[instance].mesh];
        let unit = UnitBox::new(&mesh.positions);
        let ones = vec![instances::fit::ONE; signals];
        let functions = match functions.is_empty() {
            true => &ones[..],
            false => functions,
        };
        let mut values = vec![Vec::with_capacity(mesh.positions.len()); signals];
        for (vertex, position) in mesh.positions.iter().enumerate() {
            let local = match local {
                Some(local) => local.of_vertex(vertex),
                None => vec![1.0; signals],
            };
            let shown = ladder::shown(functions, unit.place(*position), &local);
            for (values, value) in values.iter_mut().zip(shown) {
                values.push(unorm8(value));
            }
        }
        values
    }

    /// A bake in two parts, whose product it is: local values alone, and what the scene makes of each instance. An
    /// instance without local values is open (1) in the first and as it is in the second. `None` where none has any.
    pub fn local_and_global(&self, baked: &Baked) -> Option<[Baked; 2]> {
        let has_local = |choice: &Choice| choice.rung.has_local();
        if !baked.choices.iter().any(has_local) {
            return None;
        }
        let [mut of_local, mut of_global] = [baked.clone(), baked.clone()];
        for (instance, choice) in baked.choices.iter().enumerate() {
            let mesh = self.scene.instances[instance].mesh;
            let mut of_mesh = baked.locals.iter();
            let local = of_mesh.find(|local| has_local(choice) && local.mesh == mesh);
            of_local.instances[instance].vertices = self.values(instance, &[], local);
            if local.is_some() {
                let global = self.values(instance, &choice.functions, None);
                of_global.instances[instance].vertices = global;
            }
        }
        Some([of_local, of_global])
    }

    /// Values at vertices from those samples of an instance that `takes` picks by number.
    fn fit_vertices(
        &self,
        shape: &Shape,
        sites: &[Site],
        gathers: &[Gather],
        takes: impl Fn(usize) -> bool + Clone,
    ) -> (InstanceSignals, Report) {
        let vertices::Settings { kernels, alpha, .. } = &self.settings.vertices;
        let all = sites.iter().zip(gathers).enumerate();
        let samples = all
            .filter(|(number, (_, gather))| gather.is_valid() && takes(*number))
            .map(|(_, (site, gather))| vertices::Sample {
                site,
                values: &gather.values[..kernels.len()],
            });
        let mean = vertices::mean(samples.clone(), kernels.len());
        let fitted = vertices::fit_instance(shape, sites.len(), samples, kernels.len(), *alpha);
        let signals = InstanceSignals::new(&self.settings.tone, &fitted, &mean);
        (signals, fitted.report)
    }

    /// The valid samples of an instance, and their numbers among its sites.
    pub(super) fn ladder_samples(
        &self,
        instance: usize,
        sites: &[Site],
        gathers: &[Gather],
    ) -> (Vec<Sample>, Vec<usize>) {
        let mesh = &self.scene.meshes[self.scene.instances[instance].mesh];
        let unit = UnitBox::new(&mesh.positions);
        let kernels = self.settings.vertices.kernels.len();
        let valid = sites.iter().zip(gathers).enumerate();
        let valid = valid.filter(|(_, (_, gather))| gather.is_valid());
        let sample = |(k, (number, (site, gather))): (usize, (usize, (&Site, &Gather)))| {
            let weights = site.weights();
            let corners = mesh.triangles[site.triangle as usize];
            let at = (0..3)
                .map(|c| weights[c] as f32 * mesh.positions[corners[c] as usize])
                .sum();
            let sample = Sample {
                at: unit.place(at),
                weight: site.area,
                gold: self.settings.tone.apply(&gather.values[..kernels]),
                held_out: ladder::is_held_out(k),
            };
            (sample, number)
        };
        valid.enumerate().map(sample).unzip()
    }

    /// Signals of a value.
    fn signals(&self) -> usize {
        let kernels = self.settings.vertices.kernels.len();
        self.settings.tone.signals(kernels)
    }
}
