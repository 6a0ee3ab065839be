//! The visibility pass on a graphics device: `raster.wgsl` and the scene in its buffers.

use super::gbuffer::{FirstHit, NONE, Visibility};
use super::gpu::Gpu;
use super::shaders;
use super::view::View;
use crate::scene::{Alpha, Mesh, Pose, Scene, TextureRef, Wrap};
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};

const DOUBLE_SIDED: u32 = 1; // SHARED with `raster.wgsl`
const MASKED: u32 = 2; // SHARED
const BLENDED: u32 = 4; // SHARED

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuInstance {
    /// Columns of the 3x4 matrix, each padded to 16 bytes.
    world_from_mesh: [[f32; 4]; 4],
    first_position: u32,
    first_corner: u32,
    first_triangle: u32,
    mirrored: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuMaterial {
    flags: u32,
    cutoff: f32,
    alpha: f32,
    first_texel: u32,
    width: u32,
    height: u32,
    wrap_s: u32,
    wrap_t: u32,
}

/// Where an instance's data lie in the shared buffers.
#[derive(Clone, Copy)]
struct Place {
    first_position: u32,
    first_corner: u32,
    first_triangle: u32,
    triangles: u32,
}

/// A scene on the device. Meshes, materials and masks are uploaded once; a frame uploads transforms
/// and the posed vertices of deforming instances.
pub struct Raster {
    pipeline: wgpu::RenderPipeline,
    places: Vec<Place>,
    /// First of an instance's own posed vertices; `None` draws the mesh's.
    posed: Vec<Option<u32>>,
    /// Instances, positions, corners of masks, triangles, materials, masks: what a binding of the
    /// scene holds beside its camera.
    buffers: [wgpu::Buffer; 6],
    camera: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    target: Option<Target>,
}

struct Target {
    width: u32,
    height: u32,
    color: wgpu::Texture,
    color_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
    staging: wgpu::Buffer,
    row_bytes: u32,
}

impl Raster {
    /// Uploads what never changes. `pose` says which instances deform; it may be any pose of the
    /// scene.
    pub fn new(gpu: &Gpu, scene: &Scene, pose: &Pose) -> Result<Raster> {
        let mut positions: Vec<f32> = Vec::new();
        let mut corners: Vec<[f32; 4]> = Vec::new();
        let mut triangles: Vec<[u32; 4]> = Vec::new();
        let mut mesh_places = Vec::with_capacity(scene.meshes.len());
        for mesh in &scene.meshes {
            let masked = mask_corners(scene, mesh);
            mesh_places.push(Place {
                first_position: count(positions.len() / 3)?,
                first_corner: if masked.is_empty() {
                    NONE
                } else {
                    count(corners.len())?
                },
                first_triangle: count(triangles.len())?,
                triangles: count(mesh.triangles.len())?,
            });
            positions.extend(mesh.positions.iter().flat_map(|p| p.to_array()));
            corners.extend(masked);
            let with_material = mesh.triangles.iter().zip(&mesh.materials);
            triangles.extend(with_material.map(|([a, b, c], m)| [*a, *b, *c, *m]));
        }
        let mut places = Vec::with_capacity(scene.instances.len());
        let mut posed = Vec::with_capacity(scene.instances.len());
        for (i, instance) in scene.instances.iter().enumerate() {
            let deforms = pose.deformed.get(i).is_some_and(Option::is_some);
            places.push(mesh_places[instance.mesh]);
            posed.push(if deforms {
                Some(count(positions.len() / 3)?)
            } else {
                None
            });
            if deforms {
                let floats = scene.meshes[instance.mesh].positions.len() * 3;
                positions.resize(positions.len() + floats, 0.0);
            }
        }
        count(positions.len())?;
        let (materials, alphas) = materials(scene)?;

        let size = (places.len() * size_of::<GpuInstance>()) as u64;
        let instances = gpu.empty_storage("instances", size)?;
        let positions = gpu.storage("positions", bytemuck::cast_slice(&positions))?;
        let corners = gpu.storage("corners of masks", bytemuck::cast_slice(&corners))?;
        let triangles = gpu.storage("triangles", bytemuck::cast_slice(&triangles))?;
        let materials = gpu.storage("materials", bytemuck::cast_slice(&materials))?;
        let alphas = gpu.storage("masks", &alphas)?;
        let camera = gpu.uniform("camera", &[0; 64]);
        let pipeline = pipeline(gpu, "visibility", "seen", &[Some(COLOR.into())]);
        let buffers = [instances, positions, corners, triangles, materials, alphas];
        let bindings = bind(gpu, &pipeline, &camera, &buffers);
        gpu.check()?;
        Ok(Raster {
            pipeline,
            places,
            posed,
            buffers,
            camera,
            bindings,
            target: None,
        })
    }

    /// The scene as a camera (`clip_from_world`) of another pipeline over `raster.wgsl` sees it.
    pub(super) fn seen_by(
        &self,
        gpu: &Gpu,
        pipeline: &wgpu::RenderPipeline,
        camera: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        bind(gpu, pipeline, camera, &self.buffers)
    }

    /// Draws every instance with the pipeline and bindings that are set.
    pub(super) fn draw_instances(&self, pass: &mut wgpu::RenderPass) {
        for (i, place) in (0..).zip(&self.places) {
            pass.draw(0..place.triangles * 3, i..i + 1);
        }
    }

    /// Draws the scene at a pose and reads back what each pixel sees.
    pub fn draw(&mut self, gpu: &Gpu, pose: &Pose, view: &View) -> Result<Visibility> {
        self.place(gpu, pose)?;
        let camera = view.clip_from_world().to_cols_array();
        gpu.queue
            .write_buffer(&self.camera, 0, bytemuck::cast_slice(&camera));
        self.resize(gpu, view.width, view.height)?;
        let Some(target) = &self.target else {
            return Err(Error::Gpu(format!("{}: no target to draw to", gpu.name())));
        };
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("visibility"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &target.color_view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &target.depth_view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            self.draw_instances(&mut pass);
        }
        commands.copy_texture_to_buffer(
            target.color.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &target.staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(target.row_bytes),
                    rows_per_image: None,
                },
            },
            target.color.size(),
        );
        let (width, row) = (view.width as usize, target.row_bytes as usize);
        let seen = gpu.read(commands, &target.staging, |bytes| {
            let rows = bytes.chunks_exact(row);
            rows.flat_map(|row| row.chunks_exact(8).take(width))
                .map(seen)
                .collect()
        })?;
        Ok(Visibility {
            width: view.width,
            height: view.height,
            seen,
        })
    }

    /// Uploads transforms and posed vertices.
    pub(super) fn place(&self, gpu: &Gpu, pose: &Pose) -> Result<()> {
        let [instance_buffer, positions, ..] = &self.buffers;
        let mut instances = Vec::with_capacity(self.places.len());
        for (i, (place, posed)) in self.places.iter().zip(&self.posed).enumerate() {
            let (Some(m), deformed) = (pose.world_from_mesh.get(i), pose.deformed.get(i)) else {
                return Err(Error::Invalid(format!(
                    "the pose has no transform of instance {i}"
                )));
            };
            let vertices = deformed.and_then(Option::as_ref).zip(*posed);
            if let Some((deformed, first)) = vertices {
                let bytes = bytemuck::cast_slice(&deformed.positions);
                gpu.queue
                    .write_buffer(positions, u64::from(first) * 12, bytes);
            }
            let columns = [
                m.matrix3.x_axis,
                m.matrix3.y_axis,
                m.matrix3.z_axis,
                m.translation,
            ];
            instances.push(GpuInstance {
                world_from_mesh: columns.map(|c| [c.x, c.y, c.z, 0.0]),
                first_position: vertices.map_or(place.first_position, |(_, first)| first),
                first_corner: place.first_corner,
                first_triangle: place.first_triangle,
                mirrored: u32::from(m.matrix3.determinant() < 0.0),
            });
        }
        gpu.queue
            .write_buffer(instance_buffer, 0, bytemuck::cast_slice(&instances));
        Ok(())
    }

    fn resize(&mut self, gpu: &Gpu, width: u32, height: u32) -> Result<()> {
        if self
            .target
            .as_ref()
            .is_some_and(|t| (t.width, t.height) == (width, height))
        {
            return Ok(());
        }
        let most = gpu.device.limits().max_texture_dimension_2d;
        if width == 0 || height == 0 || width > most || height > most {
            return Err(Error::Gpu(format!(
                "{}: cannot draw {width}x{height} pixels, each side must be 1 to {most} with \
                 sub-pixels counted",
                gpu.name()
            )));
        }
        let texture = |format, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("visibility"),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let color = texture(COLOR, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(DEPTH, wgpu::TextureUsages::empty());
        let row_bytes = (width * 8).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        self.target = Some(Target {
            width,
            height,
            color_view: color.create_view(&Default::default()),
            depth_view: depth.create_view(&Default::default()),
            color,
            staging: gpu.staging(u64::from(row_bytes) * u64::from(height)),
            row_bytes,
        });
        gpu.check()
    }
}

fn seen(texel: &[u8]) -> FirstHit {
    let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|i| texel[at + i]));
    match word(0) {
        0 => FirstHit {
            instance: NONE,
            triangle: NONE,
        },
        instance => FirstHit {
            instance: instance - 1,
            triangle: word(4),
        },
    }
}

fn count(n: usize) -> Result<u32> {
    let small = u32::try_from(n).ok().filter(|n| *n < NONE);
    small.ok_or_else(|| {
        Error::Gpu(format!(
            "the scene has {n} items of a kind, too many to draw"
        ))
    })
}

/// What masks need of each corner of a mesh's triangles: coordinates on the base colour texture, the
/// alpha of the vertex, and 1 where there are such coordinates. Empty for a mesh without masks.
fn mask_corners(scene: &Scene, mesh: &Mesh) -> Vec<[f32; 4]> {
    let material = |m: &u32| &scene.materials[*m as usize];
    let masked = |m: &u32| matches!(material(m).alpha, Alpha::Mask { .. });
    if !mesh.materials.iter().any(masked) {
        return Vec::new();
    }
    let mut corners = Vec::with_capacity(mesh.triangles.len() * 3);
    for (t, (triangle, m)) in mesh.triangles.iter().zip(&mesh.materials).enumerate() {
        let texture = material(m).base_color_texture;
        let uvs = texture.and_then(|texture| mesh.corner_uvs(&texture, t));
        for (k, v) in triangle.iter().enumerate() {
            let uv = uvs.map_or([0.0; 2], |uvs| uvs[k].to_array());
            let alpha = mesh.colors.get(*v as usize).map_or(1.0, |c| c.w);
            let textured = if uvs.is_some() { 1.0 } else { 0.0 };
            corners.push([uv[0], uv[1], alpha, textured]);
        }
    }
    corners
}

/// Materials, and the alpha channels of the textures that masks need, one byte a texel.
fn materials(scene: &Scene) -> Result<(Vec<GpuMaterial>, Vec<u8>)> {
    let mut alphas = Vec::new();
    let mut first_texels = vec![None; scene.textures.len()];
    let mut materials = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let mut out = GpuMaterial {
            flags: if material.double_sided {
                DOUBLE_SIDED
            } else {
                0
            },
            alpha: material.base_color.w,
            first_texel: NONE,
            ..GpuMaterial::zeroed()
        };
        if material.is_see_through() {
            out.flags |= BLENDED;
        }
        match material.alpha {
            Alpha::Opaque | Alpha::Blend => {}
            Alpha::Mask { cutoff } => {
                out.flags |= MASKED;
                out.cutoff = cutoff;
                if let Some(TextureRef { texture: index, .. }) = material.base_color_texture {
                    let texture = &scene.textures[index];
                    let first = match first_texels[index] {
                        Some(first) => first,
                        None => count(alphas.len())?,
                    };
                    if first_texels[index].is_none() {
                        alphas.extend(texture.texels.iter().map(|t| t[3]));
                        first_texels[index] = Some(first);
                    }
                    out.first_texel = first;
                    (out.width, out.height) = (texture.width, texture.height);
                    (out.wrap_s, out.wrap_t) = (wrap(texture.wrap_s), wrap(texture.wrap_t));
                }
            }
        }
        materials.push(out);
    }
    alphas.resize(alphas.len().next_multiple_of(4), 0);
    Ok((materials, alphas))
}

fn wrap(mode: Wrap) -> u32 {
    match mode {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

fn bind(
    gpu: &Gpu,
    pipeline: &wgpu::RenderPipeline,
    camera: &wgpu::Buffer,
    [instances, positions, corners, triangles, materials, alphas]: &[wgpu::Buffer; 6],
) -> wgpu::BindGroup {
    let buffers = [
        camera, instances, positions, corners, triangles, materials, alphas,
    ];
    gpu.bind(&pipeline.get_bind_group_layout(0), &buffers)
}

/// A pipeline of `raster.wgsl` that keeps the nearest surface: its fragment entry point, and what that
/// writes beside depth.
pub(super) fn pipeline(
    gpu: &Gpu,
    label: &str,
    fragment: &str,
    targets: &[Option<wgpu::ColorTargetState>],
) -> wgpu::RenderPipeline {
    let module = gpu.module(&shaders::RASTER);
    gpu.device
        .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets,
            }),
            multiview_mask: None,
            cache: None,
        })
}
