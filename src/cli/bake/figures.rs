//! The figures of a bake.

use super::super::output::significant;
use super::gltf::GltfFigures;
use super::stream::StreamFigures;
use crate::bake::signals::shown;
use crate::bake::{Baked, Plan};
use crate::measure::table::grouped;
use crate::obscurance::foliage::{Kind, Reason, Verdict};
use crate::vertices::Report;
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
        if let Some(stream) = &self.stream {
            text += &format!(
                "{}: {} bytes, {} tracks\n",
                stream.file,
                grouped(stream.bytes),
                grouped(stream.tracks as u64)
            );
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
