//! The ways to describe a scene that are compared.

use super::setting::{Look, Measured, Setting};
use crate::bake::ladder::Rung;
use crate::bake::stream::{Options, write};
use crate::bake::{Baked, InstanceSignals, Plan, Settings, Traced, regions};
use crate::cli::progress::Progress;
use crate::codec::{Compression, Limits};
use crate::measure::metrics::psnr;
use crate::obscurance::{Gather, Obscurance};
use crate::regions::server::{self as regions_server, Derivatives, Form};
use crate::vertices::server::{self as vertices, InstanceBake, Report, Shape, baseline};
use crate::world::World;
use crate::{Error, Result};
use serde::Serialize;

/// Most samples of a face, from few to those of `bake`.
const FACE_SAMPLES: [u32; 3] = [1, 4, 16];

/// Weights of smoothness, besides that of the settings.
const ALPHAS: [f64; 5] = [10.0, 1.0, 0.1, 0.01, 0.001];

/// Tolerances by which instances take rungs.
const TOLERANCES: [f64; 4] = [0.2, 0.1, 0.05, 0.025];

/// The chart that a method belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    Vertices,
    Alpha,
    Rungs,
    Regions,
    /// None of them: AO = 1.
    Open,
}

/// A way to describe a scene, and how well that does.
#[derive(Debug, Serialize)]
pub struct Row {
    #[serde(skip)]
    pub family: Family,
    pub method: &'static str,
    /// What varies along the method's curve.
    pub setting: String,
    #[serde(flatten)]
    pub measured: Measured,
    /// AO per pixel, and the name of its file, where a picture of it is shown.
    #[serde(skip)]
    pub picture: Option<(&'static str, Vec<f32>)>,
}

/// All ways that were measured.
pub struct Results {
    pub rows: Vec<Row>,
    /// Why some are missing, and what else a reader must know.
    pub notes: Vec<String>,
    /// PSNR of values at vertices, fitted to the most samples, at the points that regions are measured at.
    pub beside_regions: Option<f64>,
}

/// Measures all of them.
///
/// # Errors
/// As [`Plan::new`], [`Plan::trace`] and [`write`].
pub fn run<'s>(setting: &mut Setting<'s>, world: &World, settings: &Settings) -> Result<Results> {
    let open = Row {
        family: Family::Open,
        method: "AO = 1",
        setting: String::new(),
        measured: setting.without()?,
        picture: None,
    };
    let mut methods = Methods {
        setting,
        world,
        settings,
        rows: vec![open],
        notes: Vec::new(),
        fitted: Vec::new(),
        beside_regions: None,
    };
    methods.vertices()?;
    methods.rungs()?;
    methods.regions()?;
    Ok(Results {
        rows: methods.rows,
        notes: methods.notes,
        beside_regions: methods.beside_regions,
    })
}

struct Methods<'a, 's, 'w> {
    setting: &'a mut Setting<'s>,
    world: &'a World<'w>,
    settings: &'a Settings,
    rows: Vec<Row>,
    notes: Vec<String>,
    /// AO at the points by values at vertices, fitted to the most samples.
    fitted: Vec<f32>,
    beside_regions: Option<f64>,
}

impl<'s> Methods<'_, 's, '_> {
    /// Values at vertices by the number of samples: the fit at 8 and 5 bits, what bakers commonly do, and the means
    /// of the fit's samples. All have the same number of rays.
    fn vertices(&mut self) -> Result<()> {
        for per_face in FACE_SAMPLES {
            let mut settings = self.settings.clone();
            settings.vertices.sampling.max_per_face = per_face;
            let plan = self.plan(&settings)?;
            let traced = trace(&plan)?;
            let (fitted, _) = plan.fit(&traced, &|| ())?;
            let gathers = plan.by_instance(&traced);
            let label = &per_face.to_string();
            let shown = per_face == FACE_SAMPLES[2];
            for (method, bits, file) in [
                ("least squares, 8 bits", 8, "least_squares"),
                ("least squares, 5 bits", 5, "least_squares_5"),
            ] {
                let file = shown.then_some(file);
                let stream = stream(&plan, &fitted, bits)?;
                let look = self.add(Family::Vertices, method, label, &stream, file)?;
                if bits == 8 {
                    self.fitted = look.points;
                }
            }
            if shown {
                self.alphas(&settings, &traced)?;
            }
            let at_vertices = stream(&plan, &self.point_sampled(&plan)?, 8)?;
            let file = shown.then_some("at_vertices");
            self.add(Family::Vertices, "at vertices", label, &at_vertices, file)?;
            let means = stream(&plan, &self.means(&plan, &gathers), 8)?;
            self.add(Family::Vertices, "mean of samples", label, &means, None)?;
        }
        Ok(())
    }

    /// Fitted values at 8 bits by the weight of smoothness.
    fn alphas(&mut self, settings: &Settings, traced: &[Traced]) -> Result<()> {
        for alpha in ALPHAS {
            let mut settings = settings.clone();
            settings.vertices.alpha = alpha;
            let plan = self.plan(&settings)?;
            let (fitted, _) = plan.fit(traced, &|| ())?;
            let stream = stream(&plan, &fitted, 8)?;
            let method = "least squares, by alpha";
            self.add(Family::Alpha, method, &alpha.to_string(), &stream, None)?;
        }
        Ok(())
    }

    /// Values traced at the vertices, by as many rays in all as the samples of a plan have.
    fn point_sampled(&self, plan: &Plan) -> Result<Baked> {
        let kernels = &self.settings.vertices.kernels;
        let shapes = &self.setting.shapes;
        let faces = shapes.iter().flat_map(|shape| &shape.receives);
        let corners = 3 * faces.filter(|receives| **receives).count();
        let rays = plan.samples() as f64 * f64::from(self.settings.vertices.rays);
        let rays = (rays / corners.max(1) as f64).ceil() as u32;
        let tracer = self.world.tracer();
        let obscurance = Obscurance::new(plan.scene(), tracer, kernels, rays.clamp(1, 65_536))?;
        Ok(self.at_vertices(|instance, shape| {
            baseline::at_vertices(&obscurance, plan.pose(), instance, shape)
        }))
    }

    /// The mean of the samples about each vertex.
    fn means(&self, plan: &Plan, gathers: &[Vec<Gather>]) -> Baked {
        let kernels = self.settings.vertices.kernels.len();
        self.at_vertices(|instance, shape| {
            let samples =
                vertices::valid_samples(plan.sites(instance), &gathers[instance], kernels);
            baseline::splat(shape, samples, kernels)
        })
    }

    /// A bake of values per kernel and variable of each instance.
    fn at_vertices(&self, values: impl Fn(usize, &Shape) -> Vec<Vec<f64>>) -> Baked {
        let tone = &self.settings.tone;
        let instances = self.setting.shapes.iter().enumerate();
        let signals = instances.map(|(instance, shape)| {
            let values = values(instance, shape);
            let values = values.iter().map(|all| vertices::of_vertices(shape, all));
            let fitted = InstanceBake {
                values: values.collect(),
                report: Report::default(),
            };
            let mean = vec![1.0; self.settings.vertices.kernels.len()];
            InstanceSignals::new(tone, &fitted, &mean)
        });
        Baked::of_vertices(signals.collect(), tone.blend)
    }

    /// One rung for all instances, rungs by tolerance, and functions of instances times local values.
    fn rungs(&mut self) -> Result<()> {
        let instances = Settings {
            instances: true,
            ..self.settings.clone()
        };
        let plan = self.plan(&instances)?;
        let traced = trace(&plan)?;
        if plan.has_groups() {
            let (baked, _) = plan.fit(&traced, &|| ())?;
            let method = "local values, times an instance's function";
            for (rung, label, file) in [
                (Rung::Local, "none", Some("instances_none")),
                (Rung::LocalScalar, "scalar", None),
                (Rung::LocalLinear, "linear", Some("instances_linear")),
            ] {
                let stream = stream(&plan, &baked.everywhere(rung), 8)?;
                self.add(Family::Rungs, method, label, &stream, file)?;
            }
        } else {
            let text = "No mesh has several instances, so that local values have nothing to share.";
            self.notes.push(text.into());
        }
        let bar = Progress::new("Choosing rungs", TOLERANCES.len() as u64);
        for tolerance in TOLERANCES {
            let settings = Settings {
                tolerance: Some(tolerance),
                ..instances.clone()
            };
            // The same samples: a tolerance does not move them.
            let plan = self.plan(&settings)?;
            let (baked, _) = plan.fit(&traced, &|| ())?;
            if tolerance == TOLERANCES[0] {
                let method = "one rung for all";
                for (rung, file) in [
                    (Rung::Scalar, Some("scalar")),
                    (Rung::Linear, Some("linear")),
                    (Rung::Vertices, None),
                ] {
                    let stream = stream(&plan, &baked.everywhere(rung), 8)?;
                    self.add(Family::Rungs, method, rung.name(), &stream, file)?;
                }
            }
            let stream = stream(&plan, &baked, 8)?;
            let label = &tolerance.to_string();
            self.add(Family::Rungs, "by tolerance", label, &stream, None)?;
            bar.step(1);
        }
        Ok(())
    }

    /// Regions by their form.
    fn regions(&mut self) -> Result<()> {
        let settings = regions_server::Settings {
            kernels: self.settings.vertices.kernels.clone(),
            rays: self.settings.vertices.rays,
            blend: self.settings.tone.blend,
            ..regions_server::Settings::default()
        };
        let (scene, pose) = (self.setting.scene, self.setting.pose);
        let (tracer, sided) = (self.world.tracer(), Derivatives::Sided);
        let spinner = Progress::spinner("Baking regions");
        let bake = match regions_server::bake(scene, pose, tracer, None, sided, &settings) {
            Ok((_, bake, _)) if !bake.regions.is_empty() => bake,
            Ok(_) => {
                self.notes.push("No region was found in the scene.".into());
                return Ok(());
            }
            Err(Error::Invalid(message)) => {
                self.notes.push(format!("There are no regions: {message}."));
                return Ok(());
            }
            Err(other) => return Err(other),
        };
        drop(spinner);
        let mut in_region = None;
        let plan = self.plan(self.settings)?;
        for (degree, method) in [
            (0, "regions, degree 0"),
            (1, "regions, degree 1"),
            (2, "regions, degree 2"),
        ] {
            for (derivatives, label) in [
                (Derivatives::None, "constant"),
                (Derivatives::Gradient, "gradient"),
                (Derivatives::Sided, "six derivatives"),
            ] {
                let form = Form {
                    derivatives,
                    degree,
                    signals: 1,
                };
                let regions = regions::of_form(&bake.regions, form, self.settings)?;
                let (stream, _) = write(&plan, &Baked::default(), Some(&regions), options(8))?;
                let shown = degree == 1 && derivatives == Derivatives::Sided;
                let file = shown.then_some("regions");
                let look = self.add(Family::Regions, method, label, &stream, file)?;
                in_region = look.in_region;
            }
        }
        if let Some(in_region) = &in_region {
            self.notes.push(format!(
                "{} regions, which describe free space for objects that move, are looked up at the surfaces of the \
                 scene here, where space is least even: at {} of the points, which are in a region or next to one, \
                 and at all pixels. Those with six derivatives are regularised.",
                bake.regions.len(),
                in_region.iter().filter(|is| **is).count()
            ));
            let mse = self.setting.error(&self.fitted, Some(in_region));
            self.beside_regions = Some(psnr(mse));
        }
        Ok(())
    }

    fn plan(&self, settings: &Settings) -> Result<Plan<'s>> {
        Plan::new(self.setting.scene, self.setting.pose, settings.clone())
    }

    /// Measures a stream; with a `file` its picture is shown.
    fn add(
        &mut self,
        family: Family,
        method: &'static str,
        setting: &str,
        stream: &[u8],
        file: Option<&'static str>,
    ) -> Result<Look> {
        let look = self.setting.measure(stream)?;
        self.rows.push(Row {
            family,
            method,
            setting: setting.into(),
            measured: look.measured.clone(),
            picture: file.map(|file| (file, look.ao.clone())),
        });
        Ok(look)
    }
}

/// A bake's stream with so many bits a value.
fn stream(plan: &Plan, baked: &Baked, bits: u8) -> Result<Vec<u8>> {
    Ok(write(plan, baked, None, options(bits))?.0)
}

fn options(bits: u8) -> Options {
    Options {
        bits,
        // As `bake` has it.
        compression: Compression::Zstd {
            level: 19,
            lazy: false,
        },
        limits: Limits::default(),
    }
}

/// Traces a whole plan with a progress bar.
fn trace(plan: &Plan) -> Result<Vec<Traced>> {
    let bar = Progress::new("Tracing samples", plan.samples() as u64);
    plan.trace(0..plan.items().len(), &|samples| bar.step(samples as u64))
}
