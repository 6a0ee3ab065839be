//! From command-line arguments to the options of the library.

use super::args::{self, EncodeArgs, ProbesArgs, Quality, SceneArgs, ViewArgs};
use super::progress::Progress;
use super::{effects, output};
use crate::models::{Model, ModelOptions};
use crate::points::place::Density;
use crate::points::server::Options;
use crate::probes;
use crate::probes::server::Hysteresis;
use crate::probes::source::{Packing, Request};
use crate::scene::Scene;
use crate::scene::camera::DEFAULT_YFOV;
use crate::stream::{Job, Stream, View};
use crate::trace::Aabb;
use crate::trace::path::Sky;
use crate::{Error, Result};
use glam::DVec3;

/// Most frames that are encoded unasked: as many as `--frames` allows.
const MAX_FRAMES: f64 = 1e6;

impl ViewArgs {
    /// The eyes that `--camera`, or `--eye` and `--target`, ask for.
    ///
    /// # Errors
    /// `Invalid` for a camera that the scene does not have.
    pub fn view(&self, scene: &Scene) -> Result<View> {
        if let Some((eye, target)) = self.look() {
            let [eye, target] = [eye, target].map(|at| (at - scene.origin).as_vec3());
            return Ok(View::Fixed(scene.look_at(eye, target, DEFAULT_YFOV)));
        }
        Ok(
            match scene.find_camera(self.camera.as_deref().unwrap_or(""))? {
                Some(camera) => View::Camera(camera),
                None => View::Fixed(scene.framing_camera(&scene.pose(0.0))),
            },
        )
    }

    /// The camera that [`ViewArgs::view`] chose, such as ``camera `door` ``.
    pub fn describe(&self, scene: &Scene, view: &View) -> String {
        match view {
            View::Camera(camera) => format!("camera `{}`", scene.cameras[*camera].name),
            View::Fixed(camera) => {
                let eye = camera.eye().as_dvec3() + scene.origin;
                let target = eye + camera.ray(0.5, 0.5, 1, 1).as_dvec3();
                let text = |v: DVec3| format!("{:.2},{:.2},{:.2}", v.x, v.y, v.z);
                let chosen = match self.look() {
                    Some(_) => "",
                    None => ", chosen for a scene without cameras",
                };
                format!(
                    "camera --eye {} --target {}{chosen}",
                    text(eye),
                    text(target)
                )
            }
        }
    }

    /// Width over height.
    pub fn aspect(&self) -> f32 {
        self.size.0 as f32 / self.size.1 as f32
    }
}

impl EncodeArgs {
    /// The choices that decide which other options have an effect.
    pub fn active(&self) -> Vec<&'static str> {
        let points = self.model.contains(&Model::Points);
        let probes = self.model.contains(&Model::Probes);
        let packed = self.probes.coding == args::Coding::Packed;
        let choices = [
            (points, effects::POINTS),
            (points && !self.no_visibility, effects::VISIBILITY),
            (probes, effects::PROBES),
            (probes && packed, effects::PACKED),
        ];
        let active = choices.iter().filter(|(active, _)| *active);
        active.map(|(_, choice)| *choice).collect()
    }

    /// The server's options for a scene, and for its whole animation.
    pub fn options(&self, scene: &Scene, aspect: f32) -> Options {
        let fitted = Options::for_scene(scene);
        let standard = fitted.density.candidates * self.quality.density_factor();
        Options {
            density: Density {
                candidates: self.density.map_or(standard, |d| d as f32),
                thinning: self.thinning as f32,
            },
            fitted: self.density.is_none(),
            span: fitted.span,
            rays: self.rays.unwrap_or(self.quality.rays()),
            distance: self.distance.unwrap_or(fitted.distance),
            threshold: f32::from(self.threshold.unwrap_or(self.quality.threshold())) / 255.0,
            widths: self.width.widths(),
            overflow: self.overflow,
            space: self.space,
            min_ao: self.min_ao,
            seed: self.seed as u64,
            visibility: !self.no_visibility,
            margin: self.fov_margin.to_radians(),
            aspect,
            budget: self.budget.map(|b| b as usize),
        }
    }

    /// The options of the model `probes`.
    pub fn probes_request(&self, scene: &Scene) -> Request {
        self.probes.request(scene, self.quality, self.seed)
    }

    /// The whole job. Without `--frames` it takes the length of the animation, or one frame.
    ///
    /// # Errors
    /// As [`ViewArgs::view`], and `Invalid` for an animation too long to be encoded whole.
    pub fn job(&self, scene: &Scene, view: &ViewArgs) -> Result<Job> {
        let rate = self.fps.into();
        let whole = (scene.duration as f64 * self.fps.hz()).round().max(1.0);
        if self.frames.is_none() && whole > MAX_FRAMES {
            return Err(Error::Invalid(format!(
                "{}: its animation of {} s makes {whole} frames; say with --frames how many to encode",
                scene.name, scene.duration
            )));
        }
        let frames = self.frames.map_or(whole as usize, |f| f as usize);
        let options = |model: &Model| match model {
            Model::Points => ModelOptions::Points(Options {
                span: frames as f64 / self.fps.hz(),
                ..self.options(scene, view.aspect())
            }),
            Model::Probes => ModelOptions::Probes(self.probes_request(scene)),
        };
        let models = Model::ALL.iter().filter(|model| self.model.contains(model));
        Ok(Job {
            models: models.map(options).collect(),
            view: view.view(scene)?,
            frames,
            rate,
            // Frames lie on ticks: a stream can say no other time.
            start: (view.seconds(self.fps) * self.fps.hz()).round() / self.fps.hz(),
            keyframe_interval: self.keyframe_interval.unwrap_or(0) as usize,
            compression: self.compression,
            limits: self.limits.limits(),
        })
    }
}

impl ProbesArgs {
    fn request(&self, scene: &Scene, quality: Quality, seed: u32) -> Request {
        Request {
            dims: self.probes.unwrap_or(quality.probes()),
            bounds: self.volume.map(|(min, max)| Aabb {
                min: (min - scene.origin).as_vec3(),
                max: (max - scene.origin).as_vec3(),
            }),
            server: probes::server::Options {
                samples: self.samples.unwrap_or(quality.samples()),
                hysteresis: match self.adaptive {
                    true => Hysteresis::Adaptive(self.hysteresis),
                    false => Hysteresis::Fixed(self.hysteresis),
                },
                inside: self.inside,
                visibility: self.visibility_side,
                visibility_step: self.visibility_step,
                visibility_updates: self.visibility_updates,
                seed: seed.into(),
                ..Default::default()
            },
            warm_up: self.warm_up,
            packing: match self.coding {
                args::Coding::Raw => Packing::Raw,
                args::Coding::Packed => Packing::packed(self.tolerance),
            },
            sky: Sky::uniform(self.sky),
            fit: self.fit,
        }
    }
}

impl SceneArgs {
    /// Loads the scene, for ambient occlusion alone without `colors`, and tells its warnings.
    ///
    /// # Errors
    /// As [`SceneArgs::load`].
    pub fn open(&self, colors: bool) -> Result<Scene> {
        let scene = self.load(colors)?;
        for warning in &scene.warnings {
            output::warn(&format!("{}: {warning}", scene.name));
        }
        Ok(scene)
    }
}

/// Warns where nothing in a scene or its sky sends light, so that all light would be black.
pub fn warn_if_dark(scene: &Scene, sky: &Sky) {
    if !scene.has_light() && *sky == Sky::default() {
        output::warn(&format!(
            "{}: the scene has no light, so its indirect light is black; give --sky R,G,B, or add \
             punctual lights or emissive materials to the scene",
            scene.name
        ));
    }
}

/// [`Stream::start`] with a progress bar.
///
/// # Errors
/// As [`Stream::start`].
pub fn start<'s>(scene: &'s Scene, job: Job, out: &mut Vec<u8>) -> Result<Stream<'s>> {
    let mut placing = job
        .points()
        .is_some()
        .then(|| Progress::spinner("Placing points"));
    let mut tracing = None;
    Stream::start(scene, job, out, &mut |done, all| {
        placing = None;
        let bar = tracing.get_or_insert_with(|| Progress::new("Tracing all points", all as u64));
        bar.at(done as u64);
    })
}
