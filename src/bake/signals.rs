//! From fitted obscurance to the values of a file.

use super::escalate::InstancePoints;
use super::ladder::{Ladder, Rung};
use crate::instances::server::fit::Linear;
use crate::obscurance::{Blend, Remap};
use crate::vertices::server::{InstanceBake, Site};

/// How the kernels' values become signals.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tone {
    /// Share of the second kernel in what is shown.
    pub blend: Blend,
    /// Two kernels stay two signals, which the client blends.
    pub separate: bool,
    /// Applied to each signal before it is rounded.
    pub remap: Remap,
}

impl Tone {
    /// Signals of a value made from so many kernels.
    pub fn signals(&self, kernels: usize) -> usize {
        match kernels {
            2 if !self.separate => 1,
            kernels => kernels,
        }
    }

    /// The signals of a value of one number a kernel.
    pub fn apply(&self, kernels: &[f32]) -> Vec<f32> {
        let signals = match *kernels {
            [short, long] if !self.separate => vec![self.blend.apply(short, long)],
            _ => kernels.to_vec(),
        };
        signals.iter().map(|x| self.remap.apply(*x)).collect()
    }

    /// The signals of means of the kernels.
    pub fn means(&self, mean: &[f64]) -> Vec<u8> {
        let mean: Vec<f32> = mean.iter().map(|m| *m as f32).collect();
        self.apply(&mean).into_iter().map(unorm8).collect()
    }

    /// What a picture shows of signals.
    pub fn shown(&self, signals: &[f32]) -> f32 {
        match *signals {
            [short, long] => self.blend.apply(short, long),
            [one, ..] => one,
            [] => 1.0,
        }
    }
}

/// A baked scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Baked {
    /// One per instance, at its vertices, by whichever rung it takes.
    pub instances: Vec<InstanceSignals>,
    /// One per instance.
    pub choices: Vec<Choice>,
    /// Local values of meshes with several instances; used where an instance's rung has them.
    pub locals: Vec<Local>,
    /// Points of instances, by instance; used where the instance's rung is that.
    pub points: Vec<InstancePoints>,
    /// Share of the second signal in what is shown.
    pub blend: Blend,
}

impl Baked {
    /// A bake of values at vertices alone.
    pub fn of_vertices(instances: Vec<InstanceSignals>, blend: Blend) -> Baked {
        Baked {
            choices: vec![Choice::vertices(); instances.len()],
            instances,
            blend,
            ..Baked::default()
        }
    }
}

/// The rung that an instance takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    pub rung: Rung,
    /// Per signal the function of its entry; empty for a rung without.
    pub functions: Vec<Linear>,
    /// What was tried; empty where there was no choice.
    pub ladder: Ladder,
    /// Values at the vertices where they were fitted and another rung is taken.
    pub fitted: Option<Vec<Vec<u8>>>,
}

impl Choice {
    /// Values at the vertices, without another way.
    pub fn vertices() -> Choice {
        Choice {
            rung: Rung::Vertices,
            functions: Vec::new(),
            ladder: Ladder::default(),
            fitted: None,
        }
    }

    /// The held-out error of the rung; `None` where it was not measured.
    pub fn error(&self) -> Option<f64> {
        self.ladder.get(self.rung).map(|measured| measured.error)
    }

    /// The same instance by another rung that was tried.
    fn with(&self, rung: Rung) -> Choice {
        let Some(measured) = self.ladder.get(rung) else {
            return self.clone();
        };
        Choice {
            rung,
            functions: measured.functions.clone(),
            ..self.clone()
        }
    }
}

impl Baked {
    /// The same bake with the cheapest rung everywhere: one number an instance.
    pub fn cheapest(&self) -> Baked {
        self.everywhere(Rung::Scalar)
    }

    /// The same bake with this rung for each instance for which it was tried.
    pub fn everywhere(&self, rung: Rung) -> Baked {
        self.with(&|_| rung)
    }

    /// The same bake with the richest rung that was tried everywhere.
    pub fn richest(&self) -> Baked {
        let richest = |choice: &Choice| {
            let rungs = choice.ladder.rungs.iter().map(|measured| measured.rung);
            rungs.max().unwrap_or(choice.rung)
        };
        self.with(&richest)
    }

    fn with(&self, rung: &dyn Fn(&Choice) -> Rung) -> Baked {
        let choices = self.choices.iter().map(|choice| choice.with(rung(choice)));
        Baked {
            choices: choices.collect(),
            ..self.clone()
        }
    }

    /// Root mean square error over the held-out samples of all instances, by area; `None` where none was measured.
    pub fn error(&self) -> Option<f64> {
        let measured = self.choices.iter();
        let measured = measured.filter_map(|choice| Some((choice.ladder.weight, choice.error()?)));
        let (sum, weight) = measured.fold((0.0, 0.0), |(sum, all), (weight, error)| {
            (sum + weight * error * error, all + weight)
        });
        (weight > 0.0).then(|| (sum / weight).sqrt())
    }
}

/// Values of a mesh that its instances share.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Local {
    pub mesh: usize,
    /// Per signal one UNORM8 value per vertex.
    pub signals: Vec<Vec<u8>>,
}

impl Local {
    /// Per signal the value of a vertex.
    pub fn of_vertex(&self, vertex: usize) -> Vec<f32> {
        let value = |signal: &Vec<u8>| f32::from(signal[vertex]) / 255.0;
        self.signals.iter().map(value).collect()
    }

    /// Per signal the value at a sample's place.
    pub fn at(&self, triangles: &[[u32; 3]], site: &Site) -> Vec<f32> {
        interpolated(&self.signals, triangles, site)
    }
}

/// Per signal the value at a sample's place.
fn interpolated(signals: &[Vec<u8>], triangles: &[[u32; 3]], site: &Site) -> Vec<f32> {
    let corners = triangles[site.triangle as usize];
    let weights = site.weights();
    let value = |signal: &Vec<u8>| {
        let corner = |k: usize| weights[k] as f32 * f32::from(signal[corners[k] as usize]);
        (corner(0) + corner(1) + corner(2)) / 255.0
    };
    signals.iter().map(value).collect()
}

/// The signals of an instance as UNORM8: 0 is blocked, 255 open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InstanceSignals {
    /// Per signal one value per vertex of the instance's mesh, in its order.
    pub vertices: Vec<Vec<u8>>,
    /// Per signal the mean over the instance's surface.
    pub mean: Vec<u8>,
}

impl InstanceSignals {
    /// Of fitted values per kernel, and their means.
    pub fn new(tone: &Tone, fitted: &InstanceBake, mean: &[f64]) -> InstanceSignals {
        let kernels = fitted.values.len();
        let count = fitted.values.first().map_or(0, Vec::len);
        let mut vertices = vec![Vec::with_capacity(count); tone.signals(kernels)];
        let mut values = vec![0.0; kernels];
        for vertex in 0..count {
            for (value, all) in values.iter_mut().zip(&fitted.values) {
                *value = all[vertex];
            }
            for (signal, value) in vertices.iter_mut().zip(tone.apply(&values)) {
                signal.push(unorm8(value));
            }
        }
        InstanceSignals {
            vertices,
            mean: tone.means(mean),
        }
    }

    /// Per signal the value at a sample's place.
    pub fn at(&self, triangles: &[[u32; 3]], site: &Site) -> Vec<f32> {
        interpolated(&self.vertices, triangles, site)
    }
}

/// A value in 0..=1 to the nearest 1/255.
pub fn unorm8(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// What a picture shows of one or two signals, in 0..=1.
pub fn shown(signals: &[u8], blend: Blend) -> f32 {
    let value = |signal: u8| f32::from(signal) / 255.0;
    match *signals {
        [one] => value(one),
        [short, long] => blend.apply(value(short), value(long)),
        _ => 1.0,
    }
}
