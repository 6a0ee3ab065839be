//! Shadow maps on a graphics device: the scene's buffers of the visibility pass, drawn through every
//! face into the layers of one depth texture.

use super::{Face, Plan, Projection, ROUNDING};
use crate::render::gpu::Gpu;
use crate::render::raster::{self, DEPTH, Raster};
use crate::scene::{Deformed, Pose};
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::Affine3A;

/// 64 bytes, as in `shadow.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct GpuFace {
    right: [f32; 3],
    half_width: f32,
    up: [f32; 3],
    half_height: f32,
    forward: [f32; 3],
    range: f32,
    origin: [f32; 3],
    rounding: f32,
}

impl From<&Face> for GpuFace {
    fn from(face: &Face) -> GpuFace {
        GpuFace {
            right: face.right.to_array(),
            half_width: face.half.x,
            up: face.up.to_array(),
            half_height: face.half.y,
            forward: face.forward.to_array(),
            range: match face.projection {
                Projection::Perspective => 0.0,
                Projection::Orthographic { range } => range,
            },
            origin: face.origin.to_array(),
            rounding: ROUNDING,
        }
    }
}

/// Draws the maps and keeps them from call to call: a face is drawn again when it or the scene has
/// moved.
pub struct ShadowPass {
    pipeline: wgpu::RenderPipeline,
    maps: Option<wgpu::Texture>,
    /// What the maps show.
    shown: Option<Shown>,
}

struct Shown {
    faces: Vec<Face>,
    world_from_mesh: Vec<Affine3A>,
    deformed: Vec<Option<Deformed>>,
}

impl Shown {
    fn same_scene(&self, pose: &Pose) -> bool {
        self.world_from_mesh == pose.world_from_mesh && self.deformed == pose.deformed
    }
}

impl ShadowPass {
    pub fn new(gpu: &Gpu) -> Result<ShadowPass> {
        let pipeline = raster::pipeline(gpu, "shadow", "covers", &[]);
        gpu.check()?;
        Ok(ShadowPass {
            pipeline,
            maps: None,
            shown: None,
        })
    }

    /// Brings all faces up to date; returns the maps, a layer each (one blank layer where there is no
    /// face). The scene is always the same.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        raster: &Raster,
        pose: &Pose,
        plan: &Plan,
    ) -> Result<&wgpu::Texture> {
        let (maps, kept) = Self::sized(&mut self.maps, gpu, plan)?;
        let shown = self.shown.take().filter(|s| kept && s.same_scene(pose));
        let drawn: &[Face] = shown.as_ref().map_or(&[], |s| &s.faces);
        raster.place(gpu, pose)?;
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        for (layer, face) in (0..).zip(&plan.faces) {
            if drawn.get(layer as usize) == Some(face) {
                continue;
            }
            let matrix = face.clip_from_world().to_cols_array();
            let camera = gpu.uniform("light", bytemuck::cast_slice(&matrix));
            let bindings = raster.seen_by(gpu, &self.pipeline, &camera);
            let view = maps.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            });
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow"),
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &bindings, &[]);
            raster.draw_instances(&mut pass);
        }
        gpu.queue.submit([commands.finish()]);
        gpu.check()?;
        self.shown = Some(match shown {
            Some(shown) => Shown {
                faces: plan.faces.clone(),
                ..shown
            },
            None => Shown {
                faces: plan.faces.clone(),
                world_from_mesh: pose.world_from_mesh.clone(),
                deformed: pose.deformed.clone(),
            },
        });
        Ok(maps)
    }

    /// A texture for the plan, and whether it is that of the last call.
    fn sized<'a>(
        slot: &'a mut Option<wgpu::Texture>,
        gpu: &Gpu,
        plan: &Plan,
    ) -> Result<(&'a wgpu::Texture, bool)> {
        let layers = (plan.faces.len() as u32).max(1);
        let limits = gpu.device.limits();
        if layers > limits.max_texture_array_layers || plan.side > limits.max_texture_dimension_2d {
            return Err(Error::Gpu(format!(
                "{}: {layers} shadow maps of {} texels a side are more than it holds ({} of {})",
                gpu.name(),
                plan.side,
                limits.max_texture_array_layers,
                limits.max_texture_dimension_2d
            )));
        }
        let size = wgpu::Extent3d {
            width: plan.side,
            height: plan.side,
            depth_or_array_layers: layers,
        };
        let last = slot.take().filter(|maps| maps.size() == size);
        let kept = last.is_some();
        let maps = last.unwrap_or_else(|| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("shadow maps"),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: DEPTH,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        });
        Ok((slot.insert(maps), kept))
    }
}

/// The depths of all layers, as in [`super::Maps`].
#[cfg(test)]
pub fn read(gpu: &Gpu, maps: &wgpu::Texture) -> Result<Vec<f32>> {
    let size = maps.size();
    let bytes = u64::from(size.width) * 4 * u64::from(size.height * size.depth_or_array_layers);
    let staging = gpu.staging(bytes);
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    commands.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo {
            aspect: wgpu::TextureAspect::DepthOnly,
            ..maps.as_image_copy()
        },
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size.width * 4),
                rows_per_image: Some(size.height),
            },
        },
        size,
    );
    gpu.read(commands, &staging, |bytes| {
        bytemuck::pod_collect_to_vec(bytes)
    })
}
