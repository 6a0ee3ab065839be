//! Probe volumes on a graphics device: the texels as a storage buffer and as seven 3D textures.

use crate::codec::probes::TEXELS;
use crate::probes::client::ProbesVolume;
use crate::probes::ggx::ENVIRONMENT;
use crate::render::gpu::Gpu;
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};

/// 112 bytes, as in `embed/shaders/wgsl/probes.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct GpuVolume {
    grid_from_world: [[f32; 4]; 4],
    dims: [u32; 3],
    side: u32,
    spacing: [f32; 3],
    scale: f32,
    range: f32,
    pad: [u32; 3],
}

impl GpuVolume {
    pub fn of(volume: &ProbesVolume) -> GpuVolume {
        let grid = &volume.grid_from_world;
        let columns = [
            grid.matrix3.x_axis,
            grid.matrix3.y_axis,
            grid.matrix3.z_axis,
            grid.translation,
        ];
        let visibility = volume.visibility();
        GpuVolume {
            grid_from_world: columns.map(|c| [c.x, c.y, c.z, 0.0]),
            dims: volume.lattice.dims.map(u32::from),
            side: visibility.map_or(0, |v| v.side),
            spacing: volume.lattice.spacing.to_array(),
            scale: volume.scale(),
            range: visibility.map_or(1.0, |v| v.range),
            pad: [0; 3],
        }
    }
}

/// What all volumes share: the table of environment BRDFs and the texture unit's filter.
pub struct Tables {
    environments: wgpu::Buffer,
    filtering: wgpu::Sampler,
}

impl Tables {
    pub fn new(gpu: &Gpu) -> Result<Tables> {
        let linear = wgpu::FilterMode::Linear;
        Ok(Tables {
            environments: gpu.storage("environments", bytemuck::cast_slice(&ENVIRONMENT))?,
            filtering: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("probes"),
                mag_filter: linear,
                min_filter: linear,
                ..Default::default()
            }),
        })
    }
}

/// A volume on the device.
pub struct Volume {
    parameters: wgpu::Buffer,
    texels: wgpu::Buffer,
    present: wgpu::Buffer,
    visibility: wgpu::Buffer,
    planes: Vec<wgpu::TextureView>,
}

impl Volume {
    /// Uploads a volume whole. It must pass [`ProbesVolume::check`].
    pub fn new(gpu: &Gpu, volume: &ProbesVolume) -> Result<Volume> {
        let parameters = GpuVolume::of(volume);
        let visibility = volume.visibility();
        let mut bits = vec![0u32; volume.present.len().div_ceil(32)];
        for (i, _) in volume.present.iter().enumerate().filter(|(_, p)| **p) {
            bits[i / 32] |= 1 << (i % 32);
        }
        // Whole words, as the shader reads them.
        let mut blocks: Vec<u8> = visibility
            .map_or(&[][..], |v| v.texels.as_flattened())
            .to_vec();
        blocks.resize(blocks.len().next_multiple_of(4), 0);
        Ok(Volume {
            parameters: gpu.uniform("volume", bytemuck::bytes_of(&parameters)),
            texels: gpu.storage("texels", bytemuck::cast_slice(&volume.texels))?,
            present: gpu.storage("presence", bytemuck::cast_slice(&bits))?,
            visibility: gpu.storage("visibility", &blocks)?,
            planes: planes(gpu, volume)?,
        })
    }

    /// The volume at binding 0 and bindings 1 to 12 of `embed/shaders/wgsl/probes_buffers.wgsl`.
    pub fn entries<'a>(&'a self, tables: &'a Tables) -> Vec<wgpu::BindGroupEntry<'a>> {
        let buffers = [
            &self.parameters,
            &self.texels,
            &self.present,
            &self.visibility,
            &tables.environments,
        ];
        let buffers = buffers.map(|b| b.as_entire_binding());
        let sampler = wgpu::BindingResource::Sampler(&tables.filtering);
        let planes = self.planes.iter().map(wgpu::BindingResource::TextureView);
        let resources = buffers.into_iter().chain([sampler]).chain(planes);
        (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect()
    }
}

/// The seven planes as textures for the hardware's trilinear filter.
fn planes(gpu: &Gpu, volume: &ProbesVolume) -> Result<Vec<wgpu::TextureView>> {
    let [width, height, depth] = volume.lattice.dims.map(u32::from);
    let most = gpu.device.limits().max_texture_dimension_3d;
    if width.max(height).max(depth) > most {
        return Err(Error::Gpu(format!(
            "{}: a volume of {width}x{height}x{depth} probes is too large for a texture of {most} \
             a side",
            gpu.name()
        )));
    }
    let size = wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: depth,
    };
    let texels = volume.texels.chunks_exact(volume.lattice.count());
    let plane = |texels: &[super::Texel]| {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("probes"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(8 * width),
            rows_per_image: Some(height),
        };
        let bytes = bytemuck::cast_slice(texels);
        gpu.queue
            .write_texture(texture.as_image_copy(), bytes, layout, size);
        texture.create_view(&Default::default())
    };
    Ok(texels.take(TEXELS).map(plane).collect())
}
