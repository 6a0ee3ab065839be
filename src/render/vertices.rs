//! The pass of the `vertices` model: AO at points of triangles, on the device (`vertices.wgsl`) or on
//! the CPU (`vertices/sample.rs`).

use super::gpu::Gpu;
use super::sampler::{Content, Sampler};
use super::shaders;
use crate::Result;
use crate::vertices::sample::MeshValues;
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// A point of a triangle. 32 bytes, as in `vertices.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Query {
    /// As the track counts them.
    pub vertices: [u32; 3],
    /// Index into [`State::meshes`].
    pub mesh: u32,
    /// Barycentric, with the sum 1.
    pub weights: [f32; 3],
    pub pad: u32,
}

/// What queries are answered from.
#[derive(Clone, Copy, Debug)]
pub struct State<'a> {
    /// Values of all tracks.
    pub values: &'a [u8],
    pub meshes: &'a [MeshValues],
}

/// 12 bytes, as in `embed/shaders/wgsl/vertices.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuMesh {
    first: u32,
    signals: u32,
    share: f32,
}

/// The pass on a device.
pub struct VerticesPass(Sampler);

impl VerticesPass {
    /// # Errors
    /// As [`Sampler::new`].
    pub fn new(gpu: &Gpu) -> Result<VerticesPass> {
        Ok(VerticesPass(Sampler::new(gpu, &shaders::VERTICES, 40)?))
    }

    /// AO of each query.
    ///
    /// # Errors
    /// As [`Sampler::run`].
    pub fn sample(&self, gpu: &Gpu, queries: &[Query], state: &State) -> Result<Vec<f32>> {
        let meshes: Vec<GpuMesh> = state
            .meshes
            .iter()
            .map(|mesh| GpuMesh {
                first: mesh.first,
                signals: mesh.signals,
                share: mesh.share,
            })
            .collect();
        let contents = [
            Content::Storage(state.values),
            Content::Storage(bytemuck::cast_slice(&meshes)),
        ];
        let bytes = bytemuck::cast_slice(queries);
        self.0.run(gpu, queries.len(), bytes, &contents)
    }
}

/// Twin of [`VerticesPass::sample`].
pub fn sample_on_cpu(queries: &[Query], state: &State) -> Vec<f32> {
    let sample = |q: &Query| state.meshes[q.mesh as usize].ao(state.values, q.vertices, q.weights);
    queries.par_iter().map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::super::gpu;
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn device_and_cpu_agree() {
        let Some(gpu) = gpu::for_test() else { return };
        let pass = VerticesPass::new(&gpu).expect("a pass");
        let mut random = Rng::new(5);
        // Two tracks, the second beginning after a pad.
        let values: Vec<u8> = (0..4 + 2 * 30).map(|_| random.draw() as u8).collect();
        let meshes = [
            MeshValues {
                first: 0,
                signals: 1,
                share: 0.0,
            },
            MeshValues {
                first: 4,
                signals: 2,
                share: 0.97,
            },
        ];
        let state = State {
            values: &values,
            meshes: &meshes,
        };
        let queries: Vec<Query> = (0..1000)
            .map(|i| {
                let mesh = i % 2;
                let count = [3, 30][mesh as usize];
                let (a, b) = (random.unit(), random.unit());
                let (u, v) = if a + b > 1.0 {
                    (1.0 - a, 1.0 - b)
                } else {
                    (a, b)
                };
                Query {
                    vertices: [0; 3].map(|_| (random.draw() % count) as u32),
                    mesh,
                    weights: [1.0 - u - v, u, v],
                    pad: 0,
                }
            })
            .collect();
        let on_device = pass.sample(&gpu, &queries, &state).expect("answers");
        let on_cpu = sample_on_cpu(&queries, &state);
        assert_eq!(on_device.len(), on_cpu.len());
        for (device, cpu) in on_device.iter().zip(&on_cpu) {
            assert!((device - cpu).abs() < 1e-5, "{device} {cpu}");
        }
        let distinct = on_cpu.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert!(distinct > 900);
    }
}
