//! The client's sampler: the ambient obscurance of a place on a mesh instance, from the instance's
//! entry (`spec/instances.md` §8, whose query vectors hold it). `embed/shaders/wgsl/instances.wgsl` is its twin on a device.

use crate::codec::instances::{COEFFICIENTS, Table, Value};

/// The bounds of a mesh, ready to be looked up in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Middle, mesh space, metres.
    pub centre: [f32; 3],
    /// One over half the extent; 0 along an axis without extent.
    pub per_half_extent: [f32; 3],
}

/// What an instance has: a linear function of position within the bounds of its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceEntry {
    pub bounds: Bounds,
    /// Coefficients of 1, x, y and z, of one signal or two.
    pub signals: [[f32; COEFFICIENTS]; 2],
    /// Share of the second signal; 0 where there is one.
    pub share: f32,
}

impl Bounds {
    /// The bounds from their corners.
    pub fn new(min: [f32; 3], max: [f32; 3]) -> Bounds {
        let axes = [0, 1, 2];
        Bounds {
            centre: axes.map(|i| 0.5 * min[i] + 0.5 * max[i]),
            per_half_extent: axes.map(|i| match max[i] > min[i] {
                true => 1.0 / (0.5 * max[i] - 0.5 * min[i]),
                false => 0.0,
            }),
        }
    }

    /// Where a position is: -1 to 1 along each axis.
    pub fn normalized(&self, position: [f32; 3]) -> [f32; 3] {
        [0, 1, 2].map(|i| {
            let u = (position[i] - self.centre[i]) * self.per_half_extent[i];
            u.clamp(-1.0, 1.0)
        })
    }
}

impl InstanceEntry {
    /// The entry of a table from its decoded values, one or two.
    pub fn new(table: &Table, bounds: Bounds, values: &[Value]) -> InstanceEntry {
        let signal = |at: usize| values.get(at).map_or([0.0; 4], |v| table.coefficients(*v));
        InstanceEntry {
            bounds,
            signals: [signal(0), signal(1)],
            share: match table.signals.count {
                2 => table.signals.share,
                _ => 0.0,
            },
        }
    }

    /// What the rest of the scene leaves of the local AO at `position` in mesh space (metres); it may be
    /// above 1.
    pub fn global(&self, position: [f32; 3]) -> f32 {
        let u = self.bounds.normalized(position);
        let [a, b] = self.signals.map(|c| signal(c, u));
        a + (b - a) * self.share
    }

    /// AO at `position` in mesh space (metres), 0 to 1, with the local AO of the mesh there, 1 where it
    /// has none.
    pub fn ao(&self, position: [f32; 3], local: f32) -> f32 {
        (self.global(position) * local).clamp(0.0, 1.0)
    }
}

/// A linear function at `u`, and 0 where that is below 0.
fn signal(c: [f32; COEFFICIENTS], u: [f32; 3]) -> f32 {
    (c[0] + c[1] * u[0] + c[2] * u[1] + c[3] * u[2]).max(0.0)
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
