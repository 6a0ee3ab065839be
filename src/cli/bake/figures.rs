//! The figures of a bake.

use super::super::output::{counted, significant};
use super::gltf::GltfFigures;
use super::stream::{Alternative, StreamFigures};
use crate::bake::ladder::Rung;
use crate::bake::regions;
use crate::bake::signals::shown;
use crate::bake::{Baked, Plan};
use crate::measure::table::grouped;
use crate::obscurance::foliage::{Kind, Reason, Verdict};
use crate::vertices::server::Report;
use serde::Serialize;

/// Seconds by the clock.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Loading the scene and placing samples.
    pub place: f64,
    pub trace: f64,
    pub fit: f64,
    pub total: f64,
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct Figures {
    pub scene: String,
    pub instances: usize,
    pub vertices: usize,
    /// Vertices after welding.
    pub variables: usize,
    pub triangles: usize,
    pub samples: usize,
    pub samples_inside_geometry: usize,
    pub rays: u64,
    /// Values of a vertex.
    pub signals: usize,
    /// Mean over the vertices of what is shown.
    pub mean: f64,
    pub values_at_bounds: usize,
    /// Connected parts whose best values were not reached in the steps allowed.
    pub inexact_parts: usize,
    /// Parts too entangled to solve, which have the mean of samples at each vertex.
    pub averaged_parts: usize,
    pub vertices_from_neighbours: usize,
    pub vertices_from_mean: usize,
    pub vertices_see_through: usize,
    pub seconds: Seconds,
    pub stream: Option<StreamFigures>,
    pub gltf: Option<GltfFigures>,
    /// Meshes whose instances attenuate rays.
    pub foliage: Vec<FoliageFigures>,
    pub regions: Option<RegionFigures>,
    /// Instances by rung; empty where all have values at their vertices.
    pub rungs: Vec<RungFigures>,
    /// Instances of which no rung is within the tolerance.
    pub beyond_tolerance: Vec<BeyondTolerance>,
    /// Instances that have points, since no rung was within the tolerance.
    pub points: Vec<PointsFigures>,
}

/// The points of an instance.
#[derive(Clone, Debug, Serialize)]
pub struct PointsFigures {
    pub instance: String,
    /// Candidates per square metre, before thinning.
    pub density: f32,
    pub points: usize,
    /// Held-out error.
    pub error: f64,
    /// The rung that the instance would have, and its error.
    pub instead_of: &'static str,
    pub error_before: f64,
}

/// What the bake of regions met.
#[derive(Clone, Debug, Serialize)]
pub struct RegionFigures {
    pub regions: usize,
    /// Very small ones that became part of a neighbour.
    pub absorbed: usize,
    /// Share of the free space that the regions hold, where they were found.
    pub covered: Option<f64>,
    pub coefficients: usize,
    /// Root mean square of the regions' held-out errors.
    pub error: Option<f64>,
    /// Regions that no form describes within the tolerance.
    pub beyond_tolerance: usize,
}

impl RegionFigures {
    pub fn new(report: &regions::Report) -> RegionFigures {
        let &regions::Report {
            regions,
            absorbed,
            covered,
            coefficients,
            error,
            beyond_tolerance,
        } = report;
        RegionFigures {
            regions,
            absorbed,
            covered,
            coefficients,
            error,
            beyond_tolerance,
        }
    }

    fn summary(&self) -> String {
        let mut text = counted(self.regions as u64, "region");
        if let Some(covered) = self.covered {
            text += &format!(" in {:.1} % of the free space", 100.0 * covered);
        }
        text += &format!(", {}", counted(self.coefficients as u64, "coefficient"));
        if let Some(error) = self.error {
            text += &format!(", error {error:.4}");
        }
        if self.beyond_tolerance > 0 {
            text += &format!(", {} beyond the tolerance", self.beyond_tolerance);
        }
        text + "\n"
    }
}

/// Instances that take a rung.
#[derive(Clone, Debug, Serialize)]
pub struct RungFigures {
    pub rung: &'static str,
    pub instances: usize,
}

/// An instance that no rung describes within the tolerance.
#[derive(Clone, Debug, Serialize)]
pub struct BeyondTolerance {
    pub instance: String,
    /// The rung with the least error, which it takes.
    pub rung: &'static str,
    pub error: f64,
}

/// A mesh that is foliage.
#[derive(Clone, Debug, Serialize)]
pub struct FoliageFigures {
    pub mesh: String,
    /// `shrub` or `tree`.
    pub kind: &'static str,
    /// Why: `extras`, `name` or `material`.
    pub reason: &'static str,
}

impl Figures {
    pub fn new(plan: &Plan, baked: &Baked, reports: &[Report]) -> Figures {
        let sum = |of: fn(&Report) -> usize| reports.iter().map(of).sum();
        let samples: usize = sum(|r| r.samples);
        let settings = plan.settings();
        Figures {
            scene: plan.scene().name.clone(),
            instances: reports.len(),
            vertices: sum(|r| r.vertices),
            variables: sum(|r| r.variables),
            triangles: sum(|r| r.triangles),
            samples,
            samples_inside_geometry: sum(|r| r.invalid),
            rays: samples as u64 * u64::from(settings.vertices.rays),
            signals: settings.tone.signals(settings.vertices.kernels.len()),
            mean: mean(baked),
            values_at_bounds: sum(|r| r.fit.at_bounds),
            inexact_parts: sum(|r| r.fit.inexact),
            averaged_parts: sum(|r| r.fit.averaged),
            vertices_from_neighbours: sum(|r| r.fit.filled.from_neighbours),
            vertices_from_mean: sum(|r| r.fit.filled.from_default),
            vertices_see_through: sum(|r| r.fit.filled.see_through),
            foliage: foliage(plan),
            rungs: rungs(baked),
            beyond_tolerance: beyond_tolerance(plan, baked),
            points: points(plan, baked),
            ..Figures::default()
        }
    }

    /// Text for the terminal.
    pub fn summary(&self) -> String {
        let mut text = format!(
            "{}: {} instances, {} vertices, mean {}\n\
             {} samples ({} inside geometry), {} rays; {:.1} s placing, {:.1} s tracing, {:.1} s fitting\n",
            self.scene,
            grouped(self.instances as u64),
            grouped(self.vertices as u64),
            significant(self.mean),
            grouped(self.samples as u64),
            grouped(self.samples_inside_geometry as u64),
            grouped(self.rays),
            self.seconds.place,
            self.seconds.trace,
            self.seconds.fit,
        );
        if !self.foliage.is_empty() {
            let names = self.foliage.iter().take(SHOWN).map(|f| {
                let FoliageFigures { mesh, kind, reason } = f;
                format!("{mesh} ({kind} by {reason})")
            });
            let names: Vec<String> = names.collect();
            let more = match self.foliage.len().saturating_sub(SHOWN) {
                0 => String::new(),
                n => format!(" and {n} more"),
            };
            text += &format!("foliage: {}{more}\n", names.join(", "));
        }
        if !self.rungs.is_empty() {
            let rungs = self.rungs.iter();
            let rungs =
                rungs.map(|r| format!("{} {}", counted(r.instances as u64, "instance"), r.rung));
            text += &format!("{}\n", rungs.collect::<Vec<_>>().join("; "));
        }
        for it in self.points.iter().take(SHOWN) {
            text += &format!(
                "points: {} has {} at a density of {} per m2 and errs by {:.4} ({:.4} by {})\n",
                it.instance,
                grouped(it.points as u64),
                significant(f64::from(it.density)),
                it.error,
                it.error_before,
                it.instead_of
            );
        }
        if let Some(more) = self.points.len().checked_sub(SHOWN + 1) {
            text += &format!("points: {} more\n", grouped(more as u64 + 1));
        }
        let beyond = self.beyond_tolerance.iter().take(SHOWN);
        for BeyondTolerance {
            instance,
            rung,
            error,
        } in beyond
        {
            text += &format!("beyond the tolerance: {instance} errs by {error:.4} ({rung})\n");
        }
        if let Some(more) = self.beyond_tolerance.len().checked_sub(SHOWN + 1) {
            text += &format!("beyond the tolerance: {} more\n", grouped(more as u64 + 1));
        }
        if let Some(regions) = &self.regions {
            text += &regions.summary();
        }
        if let Some(stream) = &self.stream {
            text += &format!(
                "{}: {} bytes, {}\n",
                stream.file,
                grouped(stream.bytes),
                counted(stream.tracks as u64, "track")
            );
            if let Some(all) = &stream.alternatives {
                let line = |name: &str, it: &Alternative| {
                    let error = it
                        .error
                        .map_or(String::new(), |e| format!(", error {e:.4}"));
                    format!("{name}: {} bytes{error}", grouped(it.bytes))
                };
                text += &format!(
                    "{}; {}; {}\n",
                    line("chosen", &all.chosen),
                    line("cheapest everywhere", &all.cheapest),
                    line("richest everywhere", &all.richest)
                );
            }
        }
        if let Some(gltf) = &self.gltf {
            text += &format!(
                "{}: {} bytes ({} in the source)",
                gltf.file,
                grouped(gltf.bytes),
                grouped(gltf.source_bytes)
            );
            for (count, what) in [
                (gltf.vertices, "vertices with values"),
                (gltf.mesh_copies, "meshes copied for their instances"),
                (gltf.textures, "occlusion textures"),
                (gltf.gpu_instances, "GPU instances"),
            ] {
                if count > 0 {
                    text += &format!(", {} {what}", grouped(count as u64));
                }
            }
            text += "\n";
        }
        text
    }
}

/// Instances by rung; empty where all have values at their vertices.
fn rungs(baked: &Baked) -> Vec<RungFigures> {
    let count = |rung: Rung| {
        let choices = baked.choices.iter();
        choices.filter(|choice| choice.rung == rung).count()
    };
    if count(Rung::Vertices) == baked.choices.len() {
        return Vec::new();
    }
    let all = Rung::ALL.map(|rung| RungFigures {
        rung: rung.name(),
        instances: count(rung),
    });
    all.into_iter().filter(|r| r.instances > 0).collect()
}

/// Instances of which no rung is within the tolerance, the worst first.
fn beyond_tolerance(plan: &Plan, baked: &Baked) -> Vec<BeyondTolerance> {
    let Some(tolerance) = plan.settings().tolerance else {
        return Vec::new();
    };
    let choices = plan.scene().instances.iter().zip(&baked.choices);
    let beyond = choices.filter_map(|(instance, choice)| {
        let error = choice.error().filter(|error| *error > tolerance)?;
        Some(BeyondTolerance {
            instance: instance.name.clone(),
            rung: choice.rung.name(),
            error,
        })
    });
    let mut beyond: Vec<BeyondTolerance> = beyond.collect();
    beyond.sort_by(|a, b| b.error.total_cmp(&a.error));
    beyond
}

/// Instances that have points.
fn points(plan: &Plan, baked: &Baked) -> Vec<PointsFigures> {
    let figures = baked.points.iter().map(|points| PointsFigures {
        instance: plan.scene().instances[points.instance].name.clone(),
        density: points.density,
        points: points.points,
        error: points.error,
        instead_of: points.instead_of.0.name(),
        error_before: points.instead_of.1,
    });
    figures.collect()
}

/// Most meshes that are named.
const SHOWN: usize = 6;

fn foliage(plan: &Plan) -> Vec<FoliageFigures> {
    let verdicts = plan.foliage().into_iter().zip(&plan.scene().meshes);
    let figures = verdicts.filter_map(|(verdict, mesh)| {
        let Verdict { kind, reason } = verdict?;
        Some(FoliageFigures {
            mesh: mesh.name.clone(),
            kind: match kind {
                Kind::Shrub => "shrub",
                Kind::Tree => "tree",
            },
            reason: match reason {
                Reason::Extras => "extras",
                Reason::Name => "name",
                Reason::Material => "material",
            },
        })
    });
    figures.collect()
}

/// Mean over all vertices of what is shown.
fn mean(baked: &Baked) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for instance in &baked.instances {
        let vertices = instance.vertices.first().map_or(0, Vec::len);
        for vertex in 0..vertices {
            let signals: Vec<u8> = instance.vertices.iter().map(|s| s[vertex]).collect();
            sum += f64::from(shown(&signals, baked.blend));
        }
        count += vertices;
    }
    sum / count.max(1) as f64
}
