//! Runs a model's sampler on a device: one query a lane, one number back.

use super::gpu::Gpu;
use super::shaders::Shader;
use crate::Result;

/// Queries of a workgroup. SHARED with the modules' `main`.
const GROUP: u32 = 64;
/// Most workgroups along an axis of a dispatch.
const MAX_GROUPS: u32 = 65_535;

/// A compute pipeline whose group 0 is (count, queries, results), and whose group 1 is what its model
/// samples.
pub struct Sampler {
    shader: Shader,
    pipeline: wgpu::ComputePipeline,
    /// Number of the first binding of group 1.
    first_binding: u32,
}

/// A buffer of group 1.
pub enum Content<'a> {
    Uniform(&'a [u8]),
    Storage(&'a [u8]),
}

impl Sampler {
    /// Compiles a module with an entry point `main`. The bindings of group 1 are numbered from `first_binding`.
    ///
    /// # Errors
    /// [`crate::Error::Gpu`] for a module that the device refuses.
    pub fn new(gpu: &Gpu, shader: &Shader, first_binding: u32) -> Result<Sampler> {
        let module = gpu.module(shader);
        let descriptor = wgpu::ComputePipelineDescriptor {
            label: Some(shader.name),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        };
        let pipeline = gpu.device.create_compute_pipeline(&descriptor);
        gpu.check()?;
        Ok(Sampler {
            shader: *shader,
            pipeline,
            first_binding,
        })
    }

    /// The answers to `count` queries, in their order.
    ///
    /// # Errors
    /// [`crate::Error::Gpu`] for what the device cannot do.
    pub fn run(
        &self,
        gpu: &Gpu,
        count: usize,
        queries: &[u8],
        contents: &[Content],
    ) -> Result<Vec<f32>> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let name = self.shader.name;
        let groups = (count as u32).div_ceil(GROUP);
        let across = groups.min(MAX_GROUPS);
        let size = 4 * count as u64;
        let pass = gpu.uniform(
            name,
            bytemuck::cast_slice(&[count as u32, across * GROUP, 0, 0]),
        );
        let queries = gpu.storage(name, queries)?;
        let results = gpu.empty_storage(name, size)?;
        let staging = gpu.staging(size);
        let buffers: Vec<wgpu::Buffer> = contents
            .iter()
            .map(|content| match content {
                Content::Uniform(bytes) => Ok(gpu.uniform(name, bytes)),
                Content::Storage(bytes) => gpu.storage(name, bytes),
            })
            .collect::<Result<_>>()?;
        let own = gpu.bind(
            &self.pipeline.get_bind_group_layout(0),
            &[&pass, &queries, &results],
        );
        let numbered: Vec<_> = (self.first_binding..).zip(&buffers).collect();
        let model = gpu.bind_numbered(&self.pipeline.get_bind_group_layout(1), &numbered);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = commands.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &own, &[]);
            pass.set_bind_group(1, &model, &[]);
            pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
        }
        commands.copy_buffer_to_buffer(&results, 0, &staging, 0, size);
        gpu.read(commands, &staging, |bytes| {
            let (values, _) = bytes[..size as usize].as_chunks::<4>();
            values.iter().map(|v| f32::from_le_bytes(*v)).collect()
        })
    }
}
