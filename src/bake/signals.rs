//! From fitted obscurance to the values of a file.

use crate::obscurance::{Blend, Remap};
use crate::vertices::InstanceBake;

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
}

/// A baked scene: one entry per instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Baked {
    pub instances: Vec<InstanceSignals>,
    /// Share of the second signal in what is shown.
    pub blend: Blend,
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
        let mean: Vec<f32> = mean.iter().map(|m| *m as f32).collect();
        InstanceSignals {
            vertices,
            mean: tone.apply(&mean).into_iter().map(unorm8).collect(),
        }
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
