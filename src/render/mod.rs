//! Pictures: the G-buffer (raster on wgpu, primary rays on the CPU), shading, one pass per method,
//! composite.
//!
//! [`Renderer`] draws with a graphics device where there is one and with primary rays otherwise.
//! Both only find out which triangle each pixel sees ([`gbuffer::Visibility`]); the rest is shared,
//! so that the pictures are the same. AO is one value a pixel, at its centre, multiplied onto
//! colour that is supersampled four times (PSAO §4.1). [`Renderer::lit`] is all light of a picture by
//! its parts: [`shadow`] maps and [`light`] on the device or its twin, one value a pixel.

pub mod composite;
pub mod gbuffer;
pub mod gpu;
pub mod image;
pub mod light;
pub mod obscurance;
pub mod path;
pub mod points;
pub mod probes;
pub mod raster;
pub mod sampler;
pub mod shade;
pub mod shaders;
pub mod shadow;
pub mod tone;
pub mod vertices;
pub mod view;

use crate::points::client::PointsState;
use crate::points::sample::Fallback;
use crate::scene::{CameraPose, Pose, Scene};
use crate::trace::Tracer;
use crate::trace::path::{PathTracer, Sky};
use crate::{Error, Result};
pub use gbuffer::Lookup;
use gbuffer::{GBuffer, Visibility};
use gpu::Gpu;
pub use image::Picture;
use light::device::LightPass;
use light::{Lit, Source, Timings};
use obscurance::{Baked, BakedAo};
use points::{PointsAo, PointsPass};
use raster::Raster;
use shade::{SUBPIXELS, Shade};
use shadow::device::ShadowPass;
use vertices::VerticesPass;
use view::View;

/// Most pixels along a side of a picture.
pub const MAX_SIDE: u32 = 8192;

/// Which machine draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Backend {
    /// A graphics device if there is one, else the CPU.
    #[default]
    Auto,
    /// A graphics device, or an error.
    Gpu,
    /// Primary rays on the CPU.
    Cpu,
}

/// One picture before AO.
pub struct Frame {
    /// At pixel centres.
    pub gbuffer: GBuffer,
    /// Supersampled colour, one a pixel.
    pub shades: Vec<Shade>,
}

impl Frame {
    /// The finished picture. `None` leaves AO out.
    pub fn composite(&self, ao: Option<&[f32]>) -> Picture {
        composite::composite(self.gbuffer.width, self.gbuffer.height, &self.shades, ao)
    }
}

/// Draws frames of one scene and looks up AO.
pub struct Renderer<'s> {
    scene: &'s Scene,
    machine: Machine<'s>,
    name: String,
}

struct Device {
    gpu: Gpu,
    raster: Raster,
    points: PointsPass,
    /// Made when first asked for.
    vertices: Option<VerticesPass>,
    lit: Option<(ShadowPass, LightPass)>,
}

enum Machine<'s> {
    Gpu(Box<Device>),
    Cpu { tracer: Option<Box<Tracer<'s>>> },
}

impl<'s> Renderer<'s> {
    /// Prepares to draw the scene. `Auto` falls back to the CPU with the device's complaint in
    /// [`Renderer::name`].
    pub fn new(scene: &'s Scene, backend: Backend) -> Result<Renderer<'s>> {
        let cpu = |name: String| Renderer {
            scene,
            machine: Machine::Cpu { tracer: None },
            name,
        };
        if backend == Backend::Cpu {
            return Ok(cpu("CPU, primary rays".into()));
        }
        match Self::on_gpu(scene) {
            Err(e) if backend == Backend::Auto => Ok(cpu(format!("CPU, primary rays ({e})"))),
            result => result,
        }
    }

    fn on_gpu(scene: &'s Scene) -> Result<Renderer<'s>> {
        let gpu = Gpu::new()?;
        let raster = Raster::new(&gpu, scene, &scene.rest_pose())?;
        let points = PointsPass::new(&gpu)?;
        let name = gpu.name().to_owned();
        Ok(Renderer {
            scene,
            machine: Machine::Gpu(Box::new(Device {
                gpu,
                raster,
                points,
                vertices: None,
                lit: None,
            })),
            name,
        })
    }

    /// What draws: the device, or the CPU and why.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Draws the scene at `pose` from `camera`.
    ///
    /// `lookup` names the vertices that the light is looked up by: for a client, those of the pose
    /// it last received, or those at rest.
    pub fn frame(
        &mut self,
        pose: &Pose,
        lookup: Lookup,
        camera: &CameraPose,
        width: u32,
        height: u32,
    ) -> Result<Frame> {
        let gbuffer = self.gbuffer(pose, lookup, camera, width, height)?;
        let view = View::new(
            camera,
            width.saturating_mul(SUBPIXELS),
            height.saturating_mul(SUBPIXELS),
        );
        let fine = self.see(pose, &view)?;
        let shades = shade::supersampled(self.scene, pose, &view, &fine);
        Ok(Frame { gbuffer, shades })
    }

    /// The G-buffer alone, as [`Renderer::frame`] makes it.
    pub fn gbuffer(
        &mut self,
        pose: &Pose,
        lookup: Lookup,
        camera: &CameraPose,
        width: u32,
        height: u32,
    ) -> Result<GBuffer> {
        if let Lookup::Posed(pose) = lookup {
            self.check(pose)?;
        }
        let view = View::new(camera, width, height);
        let seen = self.see(pose, &view)?;
        Ok(GBuffer::resolve(self.scene, pose, lookup, &view, &seen))
    }

    /// All light of a picture by its parts: punctual lights through shadow maps of `shadow_side` texels a side
    /// (usually [`shadow::SIDE`]), and indirect light from `source`. `gbuffer` is what `camera`
    /// sees of `pose`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a source or pose that does not fit, [`Error::Gpu`] for what the device
    /// cannot do.
    pub fn lit(
        &mut self,
        gbuffer: &GBuffer,
        pose: &Pose,
        camera: &CameraPose,
        sky: &Sky,
        source: &Source,
        shadow_side: u32,
    ) -> Result<(Lit, Timings)> {
        self.check(pose)?;
        light::check(gbuffer, source)?;
        let mut timings = Timings::default();
        let view = View::new(camera, gbuffer.width, gbuffer.height);
        let eye = camera.eye();
        let pixels = light::pixels(gbuffer, source);
        let bounds = self.scene.bounds(pose).unwrap_or_default();
        let plan = shadow::Plan::new(pose, bounds, shadow_side);
        let (mut direct, indirect) = match &mut self.machine {
            Machine::Gpu(d) => {
                let (shadows, light) = match &mut d.lit {
                    Some(passes) => passes,
                    None => d
                        .lit
                        .insert((ShadowPass::new(&d.gpu)?, LightPass::new(&d.gpu)?)),
                };
                let clock = std::time::Instant::now();
                let maps = shadows.draw(&d.gpu, &d.raster, pose, &plan)?;
                light::device::wait(&d.gpu)?;
                timings.shadows = clock.elapsed();
                let view = light::device::View {
                    pixels: &pixels,
                    width: gbuffer.width,
                    eye,
                };
                let maps = (&plan, maps);
                light.light(&d.gpu, &view, &pose.lights, maps, source, &mut timings)?
            }
            Machine::Cpu { tracer } => {
                let tracer = stand(tracer, self.scene, pose);
                let clock = std::time::Instant::now();
                let maps = shadow::trace(plan, tracer);
                timings.shadows = clock.elapsed();
                light::on_cpu(&pixels, eye, pose, &maps, source, &mut timings)
            }
        };
        if self.scene.transmits() && !pose.lights.is_empty() {
            let own;
            let tracer = match &mut self.machine {
                Machine::Cpu { tracer } => stand(tracer, self.scene, pose),
                Machine::Gpu(_) => {
                    own = Tracer::new(self.scene, pose);
                    &own
                }
            };
            let paths = PathTracer::new(self.scene, pose, tracer, *sky);
            light::transmit(&mut direct, gbuffer, &view, &paths);
        }
        let lit = Lit {
            width: gbuffer.width,
            height: gbuffer.height,
            direct,
            diffuse: indirect.iter().map(|i| i.diffuse).collect(),
            glossy: indirect.iter().map(|i| i.glossy).collect(),
            emitted: light::emitted(gbuffer, &view, sky),
        };
        Ok((lit, timings))
    }

    fn check(&self, pose: &Pose) -> Result<()> {
        let instances = self.scene.instances.len();
        if pose.world_from_mesh.len() == instances && pose.deformed.len() == instances {
            return Ok(());
        }
        Err(Error::Invalid(format!(
            "the pose is of {} instances and scene {} has {instances}; take a pose of this scene",
            pose.world_from_mesh.len(),
            self.scene.name
        )))
    }

    fn see(&mut self, pose: &Pose, view: &View) -> Result<Visibility> {
        let sides = 1..=MAX_SIDE * SUBPIXELS;
        if !sides.contains(&view.width) || !sides.contains(&view.height) {
            return Err(Error::Invalid(format!(
                "a picture must have 1 to {MAX_SIDE} pixels a side"
            )));
        }
        self.check(pose)?;
        match &mut self.machine {
            Machine::Gpu(d) => d.raster.draw(&d.gpu, pose, view),
            Machine::Cpu { tracer } => {
                let tracer = stand(tracer, self.scene, pose);
                Ok(Visibility::trace(self.scene, pose, tracer, view))
            }
        }
    }

    /// AO of the `points` model for every pixel, sampled at the G-buffer's lookup positions.
    pub fn points_ao(
        &mut self,
        gbuffer: &GBuffer,
        state: &PointsState,
        fallback: Fallback,
    ) -> Result<PointsAo> {
        match &mut self.machine {
            Machine::Gpu(d) => d.points.ao(&d.gpu, gbuffer, state, fallback),
            Machine::Cpu { .. } => points::ao_on_cpu(gbuffer, state, fallback),
        }
    }

    /// AO of the baked models for every pixel, and of points on instances that have them. `gbuffer` must be one
    /// for [`Lookup::Rest`].
    ///
    /// # Errors
    /// [`Error::Gpu`] for what the device cannot do.
    pub fn baked_ao(&mut self, gbuffer: &GBuffer, baked: &Baked) -> Result<BakedAo> {
        let (pixels, queries): (Vec<usize>, Vec<vertices::Query>) =
            baked.queries(self.scene, gbuffer).into_iter().unzip();
        let state = baked.state();
        let points = match baked.points() {
            Some(state) => Some(self.points_ao(gbuffer, &state, Fallback::Fill)?.ao),
            None => None,
        };
        let local = match &mut self.machine {
            Machine::Gpu(d) => {
                let pass = match &mut d.vertices {
                    Some(pass) => pass,
                    None => d.vertices.insert(VerticesPass::new(&d.gpu)?),
                };
                pass.sample(&d.gpu, &queries, &state)?
            }
            Machine::Cpu { .. } => vertices::sample_on_cpu(&queries, &state),
        };
        let local: Vec<(usize, f32)> = pixels.into_iter().zip(local).collect();
        Ok(baked.combine(gbuffer, &local, points))
    }
}

/// The tracer of the scene, at a pose.
fn stand<'t, 's>(
    tracer: &'t mut Option<Box<Tracer<'s>>>,
    scene: &'s Scene,
    pose: &Pose,
) -> &'t Tracer<'s> {
    match tracer {
        Some(tracer) => {
            tracer.update(pose);
            tracer
        }
        None => tracer.insert(Box::new(Tracer::new(scene, pose))),
    }
}

#[cfg(test)]
mod tests;
