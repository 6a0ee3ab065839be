//! The client's sampler: ambient obscurance at a point of a triangle from the values of its vertices
//! (`spec/vertices.md` §9, whose query vectors hold it). `embed/shaders/wgsl/vertices.wgsl` is its twin on a device.

/// Where the values of a mesh are in those of all tracks, and what they are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshValues {
    /// Index of the first value.
    pub first: u32,
    /// Signals of a vertex, 1 or 2, which lie side by side.
    pub signals: u32,
    /// Share of the second signal; 0 where there is one.
    pub share: f32,
}

impl MeshValues {
    /// AO, 0 to 1, at the point of a triangle that has barycentric `weights` with the sum 1. `vertices`
    /// are its corners, counted as the track counts them. Values beyond the end of `values` are open.
    pub fn ao(&self, values: &[u8], vertices: [u32; 3], weights: [f32; 3]) -> f32 {
        let a = self.signal(values, vertices, weights, 0);
        if self.signals == 1 {
            return a;
        }
        let b = self.signal(values, vertices, weights, 1);
        a + (b - a) * self.share
    }

    fn signal(&self, values: &[u8], vertices: [u32; 3], weights: [f32; 3], signal: u32) -> f32 {
        let value = |k: usize| {
            let index = u64::from(vertices[k]) * u64::from(self.signals);
            let index = index + u64::from(self.first) + u64::from(signal);
            let value = usize::try_from(index).ok().and_then(|i| values.get(i));
            f32::from(*value.unwrap_or(&u8::MAX))
        };
        let sum = weights[0] * value(0) + weights[1] * value(1) + weights[2] * value(2);
        sum / 255.0
    }
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
