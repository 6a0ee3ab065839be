//! Bakes of whole scenes: what there is to trace, in items of work that a farm can share out, and the
//! values that come of it.
//!
//! - [`ladder`]: the rungs by which an instance can be described, and the choice among them.
//! - [`plan`]: the surfaces of a scene, their samples, and the [`plan::Item`]s.
//! - [`escalate`]: points where no rung is within the tolerance.
//! - `fit`: from the results to what a bake says of each instance ([`Plan::fit`]).
//! - `refine`: local values that suit the instances of a mesh.
//! - [`part`]: files with the results of some items.
//! - [`regions`]: regions for objects that move.
//! - [`signals`]: from fitted obscurance to the values of a file.
//! - [`surface_points()`]: places to measure errors at.
//! - [`stream`]: those values as a stream. [`crate::gltf_writer`] writes them into a copy of the scene.
//!
//! A bake places samples, traces them item by item, and fits every instance. Placing and fitting are
//! cheap beside tracing, so that each task of a farm does the first and the merge both; the items carry
//! nothing but what the rays found. The result does not depend on who traced which item.

pub mod escalate;
mod fit;
pub mod ladder;
pub mod part;
pub mod plan;
mod refine;
pub mod regions;
pub mod signals;
pub mod stream;
mod surface_points;
#[cfg(test)]
mod tests;

pub use plan::{Item, Plan, Traced};
pub use signals::{Baked, InstanceSignals, Tone};
pub use surface_points::surface_points;

use crate::codec::signals::{Kernel as Distance, Signals};
use crate::obscurance::{Kernel, foliage};
use crate::vertices::server as vertices;

/// Everything that decides the bytes of a bake, besides the scene and its pose.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Kernels, rays, samples and the regulariser.
    pub vertices: vertices::Settings,
    pub tone: Tone,
    /// Meshes with several instances share local values, and each instance has a function of place (the model
    /// `instances`).
    pub instances: bool,
    /// Error up to which an instance takes a cheaper rung of the [`ladder`]. Without it values stand at vertices, and
    /// instances of a shared mesh have the function with the least error.
    pub tolerance: Option<f64>,
    /// How shrubs and trees attenuate rays; `None` where they stop them as other meshes do.
    pub foliage: Option<FoliageSettings>,
}

impl Settings {
    /// What the values of a stream are.
    pub fn block(&self) -> Signals {
        let kernel = |kernel: &Kernel| match *kernel {
            Kernel::Exponential { half_distance } => Distance::exponential(half_distance),
            Kernel::CutOff { distance } => Distance::cut_off(distance),
        };
        let share = self.tone.blend.long;
        let kernels: Vec<Distance> = self.vertices.kernels.iter().map(kernel).collect();
        match kernels[..] {
            [short, long] if self.tone.separate => Signals::two(short, long, share),
            [short, long] => Signals::blended(short, long, share),
            [one, ..] => Signals::one(one),
            [] => Signals::one(Distance::NONE),
        }
    }
}

/// Foliage that attenuates rays.
#[derive(Clone, Debug, PartialEq)]
pub struct FoliageSettings {
    /// What is foliage.
    pub rules: foliage::Rules,
    /// Extinction of a shrub per metre.
    pub density: f32,
}
