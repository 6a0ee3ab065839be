//! The passes of `light.wgsl` on a graphics device.

use super::{Indirect, NO_VOLUME, Pixel, Source, Timings};
use crate::render::gpu::Gpu;
use crate::render::probes::device::{Tables, Volume};
use crate::render::shaders;
use crate::render::shadow::Plan;
use crate::render::shadow::device::GpuFace;
use crate::scene::{LightKind, LightPose};
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::time::Instant;

/// 32 bytes, as in `light.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Pass {
    eye: [f32; 3],
    width: u32,
    height: u32,
    lights: u32,
    volume: u32,
    interpolation: u32,
}

/// 64 bytes, as in `light.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuLight {
    position: [f32; 3],
    kind: u32,
    direction: [f32; 3],
    range: f32,
    intensity: [f32; 3],
    first_face: u32,
    cos_inner: f32,
    cos_outer: f32,
    face_count: u32,
    unlimited: u32,
}

fn gpu_light(light: &LightPose, (first_face, face_count): (u32, u32)) -> GpuLight {
    let (kind, inner, outer) = match light.kind {
        LightKind::Directional => (0, 0.0, 0.0),
        LightKind::Point => (1, 0.0, 0.0),
        LightKind::Spot { inner, outer } => (2, inner, outer),
    };
    let unlimited = !light.range.is_finite();
    GpuLight {
        position: light.position.to_array(),
        kind,
        direction: light.direction.to_array(),
        range: if unlimited { 1.0 } else { light.range },
        intensity: light.intensity.to_array(),
        first_face,
        cos_inner: inner.cos(),
        cos_outer: outer.cos(),
        face_count,
        unlimited: u32::from(unlimited),
    }
}

/// Three vectors, each padded to 16 bytes.
const RESULT_BYTES: u64 = 48;

/// What the passes light.
pub struct View<'a> {
    pub(in crate::render) pixels: &'a [Pixel],
    pub width: u32,
    pub eye: Vec3,
}

/// The pipelines of `light.wgsl`.
pub struct LightPass {
    direct: wgpu::ComputePipeline,
    indirect: wgpu::ComputePipeline,
    tables: Tables,
}

impl LightPass {
    pub fn new(gpu: &Gpu) -> Result<LightPass> {
        let module = gpu.module(&shaders::LIGHT);
        let pipeline = |entry_point| {
            gpu.device
                .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(entry_point),
                    layout: None,
                    module: &module,
                    entry_point: Some(entry_point),
                    compilation_options: Default::default(),
                    cache: None,
                })
        };
        let pass = LightPass {
            direct: pipeline("direct"),
            indirect: pipeline("indirect"),
            tables: Tables::new(gpu)?,
        };
        gpu.check()?;
        Ok(pass)
    }

    /// Twin of `on_cpu` in `light.rs`. `maps` are the shadow maps of `plan`.
    pub fn light(
        &self,
        gpu: &Gpu,
        view: &View,
        lights: &[LightPose],
        (plan, maps): (&Plan, &wgpu::Texture),
        source: &Source,
        timings: &mut Timings,
    ) -> Result<(Vec<Vec3>, Vec<Indirect>)> {
        if view.pixels.is_empty() {
            return Ok((Vec::new(), Vec::new()));
        }
        let clock = Instant::now();
        let (volumes, interpolation) = match source {
            Source::Probes {
                volumes,
                interpolation,
                ..
            } => (*volumes, *interpolation),
            _ => (&[][..], Default::default()),
        };
        let pixels = gpu.storage("pixels", bytemuck::cast_slice(view.pixels))?;
        let result_bytes = RESULT_BYTES * view.pixels.len() as u64;
        let results = gpu.empty_storage("results", result_bytes)?;
        let light_count = lights.len() as u32;
        let mut lights: Vec<GpuLight> = lights
            .iter()
            .zip(&plan.of_light)
            .map(|(l, faces)| gpu_light(l, *faces))
            .collect();
        let mut faces: Vec<GpuFace> = plan.faces.iter().map(GpuFace::from).collect();
        if faces.is_empty() {
            // A binding holds one item at least.
            lights.push(GpuLight::zeroed());
            faces.push(GpuFace::zeroed());
        }
        let light_buffer = gpu.storage("lights", bytemuck::cast_slice(&lights))?;
        let face_buffer = gpu.storage("faces", bytemuck::cast_slice(&faces))?;
        let volumes: Result<Vec<Volume>> = volumes.iter().map(|v| Volume::new(gpu, v)).collect();
        let volumes = volumes?;
        let parameters = |volume| {
            let pass = Pass {
                eye: view.eye.to_array(),
                width: view.width,
                height: view.pixels.len() as u32 / view.width,
                lights: light_count,
                volume,
                interpolation: interpolation as u32,
            };
            gpu.uniform("pass", bytemuck::bytes_of(&pass))
        };
        gpu.queue.submit([]);
        wait(gpu)?;
        timings.upload += clock.elapsed();

        let run = |pipeline: &wgpu::ComputePipeline, volume, entries: &[wgpu::BindGroupEntry]| {
            let parameters = parameters(volume);
            let shared = gpu.bind(
                &pipeline.get_bind_group_layout(0),
                &[&parameters, &pixels, &results],
            );
            let own = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(1),
                entries,
            });
            let mut commands = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = commands.begin_compute_pass(&Default::default());
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &shared, &[]);
                pass.set_bind_group(1, &own, &[]);
                let height = view.pixels.len() as u32 / view.width;
                pass.dispatch_workgroups(view.width.div_ceil(8), height.div_ceil(8), 1);
            }
            gpu.queue.submit([commands.finish()]);
        };

        let clock = Instant::now();
        let maps = maps.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            aspect: wgpu::TextureAspect::DepthOnly,
            ..Default::default()
        });
        let resources = [
            light_buffer.as_entire_binding(),
            face_buffer.as_entire_binding(),
            wgpu::BindingResource::TextureView(&maps),
        ];
        let entries: Vec<_> = (20..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        run(&self.direct, NO_VOLUME, &entries);
        wait(gpu)?;
        timings.direct = clock.elapsed();

        let clock = Instant::now();
        for (number, volume) in (0..).zip(&volumes) {
            run(&self.indirect, number, &volume.entries(&self.tables));
        }
        wait(gpu)?;
        timings.indirect = clock.elapsed();

        let clock = Instant::now();
        let staging = gpu.staging(result_bytes);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        commands.copy_buffer_to_buffer(&results, 0, &staging, 0, result_bytes);
        let (by_lights, by_probes) = gpu.read(commands, &staging, |bytes| {
            let result = |bytes: &[u8]| {
                let r: [[f32; 4]; 3] = bytemuck::pod_read_unaligned(bytes);
                let [direct, diffuse, glossy] = r.map(|[x, y, z, _]| Vec3::new(x, y, z));
                (direct, Indirect { diffuse, glossy })
            };
            bytes
                .chunks_exact(RESULT_BYTES as usize)
                .map(result)
                .unzip()
        })?;
        timings.read = clock.elapsed();
        match source {
            Source::Supplied(light) => Ok((by_lights, light.to_vec())),
            _ => Ok((by_lights, by_probes)),
        }
    }
}

/// Until the device has done all that was submitted.
pub(in crate::render) fn wait(gpu: &Gpu) -> Result<()> {
    let waited = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    gpu.check()?;
    waited
        .map(|_| ())
        .map_err(|e| Error::Gpu(format!("{}: {e}", gpu.name())))
}
