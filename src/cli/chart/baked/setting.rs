//! What baked obscurance is measured against, and the measurement.

use super::super::Args;
use crate::bake::{Settings, surface_points};
use crate::cli::progress::Progress;
use crate::client::Client;
use crate::codec::Limits;
use crate::measure::metrics::{Difference, psnr};
use crate::measure::reference::Reference;
use crate::obscurance::{Gather, Obscurance};
use crate::regions::client::RegionsView;
use crate::render::gbuffer::{Fragment, GBuffer, Lookup, NONE};
use crate::render::obscurance::Baked;
use crate::render::{Backend, Renderer};
use crate::rng::Rng;
use crate::scene::{CameraPose, Pose, Scene};
use crate::vertices::server::{Shape, Site};
use crate::world::World;
use crate::{Error, Result};
use rayon::prelude::*;
use serde::Serialize;
use std::time::Instant;

/// Rays a pixel of the picture's reference, in two halves.
pub const PIXEL_RAYS: u32 = 128;

/// Distance from a region's box within which a point belongs to it (m), in scenes of 4 to 40 m.
const REACH: f32 = 0.05;

/// Look-ups of a picture that are timed.
const LOOK_UPS: usize = 7;

/// Points of the surfaces and a picture, with what is right there.
pub struct Setting<'s> {
    pub scene: &'s Scene,
    pub pose: &'s Pose,
    /// One per instance.
    pub shapes: Vec<Shape>,
    /// The points, as if they were the pixels of a picture.
    points: GBuffer,
    truth: Vec<f32>,
    /// Reach about a region's box within which a point belongs to it (m).
    reach: f32,
    pub picture: Reference,
    /// Looks up on the CPU, so that times are of one kind.
    renderer: Renderer<'s>,
    drawn_by: String,
}

/// How well a stream describes a scene, and what was looked up.
pub struct Look {
    pub measured: Measured,
    /// AO at the points.
    pub points: Vec<f32>,
    /// AO per pixel.
    pub ao: Vec<f32>,
    /// Of regions: whether each point is within one or next to it; elsewhere all points count.
    pub in_region: Option<Vec<bool>>,
}

/// How well a scene is described.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// Of the stream; 0 for what has none.
    pub bytes: usize,
    /// Root mean square error at the points.
    pub rmse: f64,
    /// The same in dB below 1.
    pub psnr: f64,
    /// Of the picture.
    pub picture: Difference,
    /// Of AO over the picture's geometry.
    pub ao: Difference,
    /// Milliseconds to look up AO for all pixels of the picture, the least of some runs; `None` without a look-up.
    pub look_up_ms: Option<f64>,
}

impl<'s> Setting<'s> {
    /// Traces the references.
    ///
    /// # Errors
    /// `Scene` for a scene without a surface that can be baked, `Invalid` for a picture without geometry and for
    /// settings that [`Obscurance::new`] refuses.
    pub fn new(
        scene: &'s Scene,
        world: &'s World<'_>,
        settings: &Settings,
        camera: &CameraPose,
        args: &Args,
    ) -> Result<Setting<'s>> {
        let (pose, tracer) = (world.pose(), world.tracer());
        let kernels = &settings.vertices.kernels;
        let shapes: Vec<Shape> = (0..scene.instances.len())
            .into_par_iter()
            .map(|instance| Shape::new(scene, pose, instance))
            .collect();
        let sites = surface_points(scene, &shapes, args.points as usize);
        if sites.is_empty() {
            return Err(Error::Scene {
                name: scene.name.clone(),
                message: "no face of it can be baked: each is see-through or has no area".into(),
            });
        }
        let bar = Progress::new("Tracing references", sites.len() as u64);
        let obscurance = Obscurance::new(scene, tracer, kernels, args.reference)?;
        let gathers: Vec<Gather> = sites
            .par_iter()
            .map(|(instance, site)| {
                bar.step(1);
                obscurance.at_surface(&site.surface(scene, pose, *instance), site.seed)
            })
            .collect();
        let shown = |gather: &Gather| {
            let tone = &settings.tone;
            tone.shown(&tone.apply(&gather.values[..kernels.len()]))
        };
        let valid = sites.iter().zip(&gathers).filter(|(_, g)| g.is_valid());
        let (fragments, truth): (Vec<Fragment>, Vec<f32>) = valid
            .map(|((instance, site), gather)| {
                (fragment(scene, pose, *instance, site), shown(gather))
            })
            .unzip();
        drop(bar);

        let mut renderer = Renderer::new(scene, Backend::Auto)?;
        let (width, height) = args.scene.view.size;
        let frame = renderer.frame(pose, Lookup::Rest, camera, width, height)?;
        let obscurance = Obscurance::new(scene, tracer, kernels, PIXEL_RAYS / 2)?;
        let half = |which: u64| -> Vec<f32> {
            let pixels = frame.gbuffer.fragments.par_iter().enumerate();
            let value = |(pixel, f): (usize, &Fragment)| {
                if f.instance == NONE {
                    return 1.0;
                }
                let seed = Rng::new(which << 62 ^ pixel as u64).draw() as u32;
                shown(&obscurance.about(f.position, f.geometric_normal, f.normal, seed))
            };
            pixels.map(value).collect()
        };
        let halves = (half(1), half(2));
        Ok(Setting {
            scene,
            pose,
            shapes,
            points: GBuffer {
                width: fragments.len() as u32,
                height: 1,
                fragments,
            },
            truth,
            reach: REACH * scene.length_scale(),
            picture: Reference::of_halves(pose.time, frame, halves)?,
            drawn_by: renderer.name().to_owned(),
            renderer: Renderer::new(scene, Backend::Cpu)?,
        })
    }

    /// What draws pictures.
    pub fn drawn_by(&self) -> &str {
        &self.drawn_by
    }

    /// Points that are outside geometry.
    pub fn points(&self) -> usize {
        self.truth.len()
    }

    /// How well a stream describes the scene, by the client's own look-up. Errors of regions are those of the points
    /// that are within one, or next to it: the others are in no place that regions are for.
    ///
    /// # Errors
    /// `Codec` and `Invalid` for a stream that is not one of this scene.
    pub fn measure(&mut self, stream: &[u8]) -> Result<Look> {
        let mut client = Client::of_scene(self.scene, Limits::default());
        client.push(stream)?;
        let regions = RegionsView::new(&client);
        let baked = Baked::new(&client, self.scene, self.pose)?;
        let renderer = &mut self.renderer;
        let mut look_up = |gbuffer: &GBuffer| -> Result<Vec<f32>> {
            if regions.tracks.is_empty() {
                return Ok(renderer.baked_ao(gbuffer, &baked)?.ao);
            }
            // Each place by its own region, where the renderer takes one region for a whole instance.
            let ao = |f: &Fragment| match f.instance {
                NONE => 1.0,
                _ => regions.ao(f.position, f.normal),
            };
            Ok(gbuffer.fragments.par_iter().map(ao).collect())
        };
        let points = look_up(&self.points)?;
        let ao = look_up(&self.picture.frame.gbuffer)?;
        // The least of some, which what else the machine does disturbs least.
        let mut seconds = f64::INFINITY;
        for _ in 0..LOOK_UPS {
            let clock = Instant::now();
            look_up(&self.picture.frame.gbuffer)?;
            seconds = seconds.min(clock.elapsed().as_secs_f64());
        }
        let in_region = (!regions.tracks.is_empty()).then(|| {
            let fragments = self.points.fragments.iter();
            let is_near = |f: &Fragment| {
                let place = regions.find(f.position);
                let distance = place.map(|place| regions.distance(place, f.position));
                distance.is_some_and(|distance| distance <= self.reach)
            };
            fragments.map(is_near).collect::<Vec<bool>>()
        });
        let measured = self.score(&points, &ao, in_region.as_deref())?;
        Ok(Look {
            measured: Measured {
                bytes: stream.len(),
                look_up_ms: Some(1e3 * seconds),
                ..measured
            },
            points,
            ao,
            in_region,
        })
    }

    /// How well the scene is described without a look-up: AO = 1.
    ///
    /// # Errors
    /// As [`Reference::score`].
    pub fn without(&self) -> Result<Measured> {
        let pixels = self.picture.frame.gbuffer.fragments.len();
        self.score(&vec![1.0; self.points()], &vec![1.0; pixels], None)
    }

    /// Mean squared error of AO at the points, or at those of them that `takes` picks.
    pub fn error(&self, points: &[f32], takes: Option<&[bool]>) -> f64 {
        let errors = points.iter().zip(&self.truth).enumerate();
        let errors = errors.filter(|(i, _)| takes.is_none_or(|takes| takes[*i]));
        let (sum, count) = errors.fold((0.0, 0usize), |(sum, count), (_, (a, b))| {
            (sum + f64::from(a - b).powi(2), count + 1)
        });
        sum / count.max(1) as f64
    }

    fn score(&self, points: &[f32], ao: &[f32], takes: Option<&[bool]>) -> Result<Measured> {
        let mse = self.error(points, takes);
        let score = self.picture.score(ao)?;
        Ok(Measured {
            bytes: 0,
            rmse: mse.sqrt(),
            psnr: psnr(mse),
            picture: score.picture,
            ao: score.ao,
            look_up_ms: None,
        })
    }
}

/// A place on a surface as a pixel that sees it.
fn fragment(scene: &Scene, pose: &Pose, instance: usize, site: &Site) -> Fragment {
    let surface = site.surface(scene, pose, instance);
    Fragment {
        instance: instance as u32,
        triangle: site.triangle,
        weights: [site.u, site.v],
        position: surface.position,
        geometric_normal: surface.geometric_normal,
        normal: surface.normal,
        lookup_position: surface.rest_position,
        lookup_normal: surface.rest_normal,
        ..Fragment::SKY
    }
}
