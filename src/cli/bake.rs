//! `dapple bake`: ambient obscurance at the vertices of a static scene.

mod farm;
mod figures;
mod gltf;
mod report;
mod source;
mod stream;

use super::args::{self, SceneArgs};
use super::effects::{self, Given};
use super::output;
use super::progress::Progress;
use crate::bake::regions::{self, Regions};
use crate::bake::{FoliageSettings, Plan, Settings, Tone, Traced};
use crate::gltf_writer::Target;
use crate::obscurance::foliage::{DENSITY, Rules};
use crate::obscurance::{Blend, Kernel, Remap};
use crate::regions::server::Given as GivenRegions;
use crate::regions::server::file::parse;
use crate::vertices::server::{self as vertices, Sampling};
use crate::world::World;
use crate::{Error, Result, files};
use farm::{Farm, Task};
use figures::{Figures, RegionFigures, Seconds};
use source::Source;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Examples in the help.
const EXAMPLES: &str = "\
Examples:
  dapple bake scene.glb -o scene.dapple                           a stream of the model `vertices`
  dapple bake scene.glb -o scene.dapple --tolerance 0.05          each instance in the cheapest way that holds
  dapple bake scene.glb -o scene.dapple --tolerance 0.05 --escalate points     and points where none does
  dapple bake scene.glb -o scene.dapple --regions                 and regions for objects that move
  dapple bake scene.glb --gltf baked.glb                          vertex attribute _AO
  dapple bake scene.glb --gltf baked.glb --into color             and multiplied into COLOR_0
  dapple bake scene.glb --gltf baked.glb --ao 0.5 --rays 64       plain occlusion within 0.5 m
  dapple bake scene.glb --task 3/8 --parts parts                  one of eight tasks of a farm
  dapple bake scene.glb --merge parts --gltf baked.glb            all of them put together";

/// Bake ambient obscurance of a scene: at vertices, of instances, in regions.
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    quality: QualityArgs,
    #[command(flatten)]
    foliage: FoliageArgs,
    #[command(flatten)]
    stream: stream::StreamArgs,
    #[command(flatten)]
    gltf: gltf::GltfArgs,
    #[command(flatten)]
    farm: farm::FarmArgs,
    /// Write a page with pictures and figures into this folder; missing folders are made.
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    report: Option<PathBuf>,
    /// Print the figures as one JSON document.
    #[arg(long, help_heading = "Output")]
    json: bool,
}

/// What is baked, and how finely.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Obscurance")]
struct QualityArgs {
    /// Samples per square metre; a face takes at least one.
    #[arg(long, value_name = "N", default_value = "64", value_parser = args::density)]
    samples: f64,
    /// Most samples of a face.
    #[arg(long, value_name = "N", default_value = "16",
        value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    face_samples: u32,
    /// Rays of a sample.
    #[arg(long, value_name = "COUNT", default_value = "256",
        value_parser = clap::value_parser!(u32).range(1..=65_536))]
    rays: u32,
    /// Distances in metres at which a blocker halves what comes from its direction, the shorter one
    /// first; one or two.
    #[arg(long, value_name = "M,M", default_value = "2,300", value_delimiter = ',',
        value_parser = args::distance)]
    distances: Vec<f32>,
    /// Plain ambient occlusion instead: a blocker within so many metres blocks all, one beyond nothing.
    #[arg(long, value_name = "M", value_parser = args::distance, conflicts_with = "distances")]
    ao: Option<f32>,
    /// Share of the longer of two distances in what is shown.
    #[arg(long, value_name = "SHARE", default_value = "0.97", value_parser = args::share)]
    blend: f32,
    /// Keep two distances as two values, which the client blends.
    #[arg(long)]
    separate: bool,
    /// A curve for contrast, straight between its knots: `0:0.1,0.5:0.6,1:1` makes black 0.1.
    #[arg(long, value_name = "IN:OUT,...", value_parser = remap)]
    remap: Option<Remap>,
    /// Describe meshes with several instances by local values that they share and, for each instance, a linear
    /// function of place.
    #[arg(long)]
    instances: bool,
    /// Describe each instance in the cheapest way whose error is at most this: a number, a linear function of
    /// place, the same times shared local values, or values at its vertices. The error is the root mean square over
    /// samples that are held out, noise of their rays included.
    #[arg(long, value_name = "ERROR", value_parser = args::share)]
    tolerance: Option<f32>,
    /// Give instances that no way describes within --tolerance points of their own in the stream, as dense as it takes.
    #[arg(long, value_name = "MODEL", requires = "tolerance")]
    escalate: Option<Escalate>,
    /// Add regions, for objects that move: those of a JSON file (docs/regions.md), or without a file, or
    /// `auto`, those that are found in free space.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = FOUND)]
    regions: Option<PathBuf>,
    /// Weight of smoothness between neighbouring faces.
    #[arg(long, value_name = "WEIGHT", default_value = "1", value_parser = args::weight)]
    alpha: f64,
}

/// What stands in where a tolerance is missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Escalate {
    /// A static track of the model `points`.
    Points,
}

/// Foliage that attenuates rays.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Foliage")]
struct FoliageArgs {
    /// Shrubs and trees attenuate rays in place of stopping them: those that the file calls so in
    /// `extras.foliage` of a mesh, those named below, and meshes of several instances that are mostly MASK
    /// or BLEND.
    #[arg(long)]
    foliage: bool,
    /// Names of meshes or paths of nodes that are shrubs; `*` stands for any text.
    #[arg(long, value_name = "PATTERN,...", value_delimiter = ',')]
    shrubs: Vec<String>,
    /// Names of meshes or paths of nodes that are trees.
    #[arg(long, value_name = "PATTERN,...", value_delimiter = ',')]
    trees: Vec<String>,
    /// What a metre of a shrub takes from a ray: 1 leaves e^-1.
    #[arg(long, value_name = "DENSITY", default_value_t = DENSITY, value_parser = density)]
    shrub_density: f32,
}

fn density(text: &str) -> std::result::Result<f32, String> {
    args::weight(text).map(|density| density as f32)
}

impl FoliageArgs {
    fn settings(&self) -> Option<FoliageSettings> {
        self.foliage.then(|| FoliageSettings {
            rules: Rules {
                shrubs: self.shrubs.clone(),
                trees: self.trees.clone(),
                by_material: true,
            },
            density: self.shrub_density,
        })
    }
}

impl QualityArgs {
    fn settings(&self, foliage: Option<FoliageSettings>) -> Result<Settings> {
        let kernels = match (self.ao, &self.distances[..]) {
            (Some(distance), _) => vec![Kernel::CutOff { distance }],
            (None, distances @ ([_] | [_, _])) if distances.is_sorted_by(|a, b| a < b) => {
                let kernel = |&half_distance| Kernel::Exponential { half_distance };
                distances.iter().map(kernel).collect()
            }
            _ => {
                let text = "--distances takes one distance, or two with the shorter one first";
                return Err(Error::Usage(text.into()));
            }
        };
        if self.separate && kernels.len() < 2 {
            let text = "--separate needs two distances";
            return Err(Error::Usage(text.into()));
        }
        if self.regions.is_some() && self.remap.is_some() {
            let text = "regions cannot follow a curve of values; leave out --remap or --regions";
            return Err(Error::Usage(text.into()));
        }
        Ok(Settings {
            vertices: vertices::Settings {
                kernels,
                rays: self.rays,
                sampling: Sampling {
                    density: self.samples,
                    max_per_face: self.face_samples,
                },
                alpha: self.alpha,
            },
            tone: Tone {
                blend: Blend { long: self.blend },
                separate: self.separate,
                remap: self.remap.clone().unwrap_or_default(),
            },
            foliage,
            instances: self.instances || self.tolerance.is_some(),
            tolerance: self.tolerance.map(f64::from),
        })
    }
}

/// A curve from text such as `0:0,0.5:0.7,1:1`.
fn remap(text: &str) -> std::result::Result<Remap, String> {
    let wanted = "expected knots such as 0:0.1,0.5:0.6,1:1, numbers from 0 to 1, those before the \
                  colons ascending";
    let knot = |text: &str| {
        let (x, y) = text.split_once(':')?;
        Some([x.trim().parse().ok()?, y.trim().parse().ok()?])
    };
    let knots: Option<Vec<[f32; 2]>> = text.split(',').map(knot).collect();
    let curve = knots.and_then(|knots| Remap::new(&knots).ok());
    curve.ok_or_else(|| wanted.into())
}

/// Runs the command.
///
/// # Errors
/// `Scene` for an unusable scene, `Io` for files that cannot be read or written, `Invalid` for parts that
/// do not fit, `Usage` for arguments that contradict each other.
pub fn run(args: &Args, given: &Given) -> Result<ExitCode> {
    let clock = Instant::now();
    let settings = args.quality.settings(args.foliage.settings())?;
    let farm = args.farm.farm()?;
    args.check_outputs(&farm)?;
    given.warn_without_effect(&args.active(&farm));
    let source = Source::read(&args.scene, args.gltf.gltf.is_some())?;
    let scene = source.scene(&args.scene, args.report_folder(&farm).is_some())?;
    let time = args.scene.view.time_at(FPS).unwrap_or(0.0);
    let key = source.key(&format!(
        "{settings:?} time {time:?} scene {:?} animation {:?}",
        args.scene.gltf_scene, args.scene.view.animation
    ));
    if let Farm::Task(task) = &farm
        && task.is_done(key)
    {
        output::print(&format!("{}: it is done\n", task.part(key).display()))?;
        return Ok(ExitCode::SUCCESS);
    }
    let given_regions = match args.quality.regions.as_deref() {
        Some(file) if file.as_os_str() != FOUND => Some(read_regions(file)?),
        _ => None,
    };
    let is_task = matches!(farm, Farm::Task(_));
    let stream = args.stream.create(is_task)?;
    let gltf = match is_task {
        true => None,
        false => args.gltf.create(&source)?,
    };
    if args.quality.regions.is_none() || gltf.is_some() {
        warn_of_motion(&scene, time);
    }

    let world = World::new(&scene, time);
    let placing = Progress::spinner("Placing samples");
    let plan = Plan::new(&scene, world.pose(), settings)?;
    drop(placing);
    let mut seconds = Seconds {
        place: clock.elapsed().as_secs_f64(),
        ..Seconds::default()
    };
    warn_of_unsampled(&plan);
    if let Some(stream) = &stream {
        stream.check(&plan)?;
    }

    let tracing = Instant::now();
    let traced = match &farm {
        Farm::Task(task) => {
            let text = run_task(task, &plan, key)?;
            output::print(&text)?;
            return Ok(ExitCode::SUCCESS);
        }
        Farm::Merge(paths) => farm::merge(paths, &plan, key)?,
        Farm::None => trace(&plan, 0..plan.items().len())?,
    };
    seconds.trace = tracing.elapsed().as_secs_f64();

    let fitting = Instant::now();
    let bar = Progress::new("Fitting vertices", scene.instances.len() as u64);
    let (mut baked, reports) = plan.fit(&traced, &|| bar.step(1))?;
    drop(bar);
    if args.quality.escalate.is_some() && stream.is_some() {
        let placing = Progress::spinner("Tracing points");
        plan.escalate(&world, &traced, &mut baked)?;
        drop(placing);
    }
    seconds.fit = fitting.elapsed().as_secs_f64();

    let regions = match &args.quality.regions {
        None => None,
        Some(_) => Some(bake_regions(&plan, given_regions)?),
    };
    let mut figures = Figures::new(&plan, &baked, &reports);
    warn_of_darkness(&plan, figures.mean);
    figures.regions = regions.as_ref().map(|r| RegionFigures::new(&r.report));
    if let Some(stream) = stream {
        figures.stream = Some(stream.write(&plan, &baked, regions.as_ref())?);
    }
    if let Some(gltf) = gltf {
        figures.gltf = Some(gltf.write(&source, &scene, &baked)?);
    }
    seconds.total = clock.elapsed().as_secs_f64();
    figures.seconds = seconds;
    if let Some(folder) = args.report_folder(&farm) {
        let drawing = Progress::spinner("Drawing pictures");
        report::create(folder, &args.scene.view, &plan, &baked, &reports, &figures)?;
        drop(drawing);
    }
    print(args, &figures)?;
    Ok(ExitCode::SUCCESS)
}

/// In the place of a file of regions: those that are found.
const FOUND: &str = "auto";

/// The regions of a file.
fn read_regions(file: &Path) -> Result<GivenRegions> {
    let text = std::fs::read_to_string(file).map_err(|source| Error::Io {
        path: file.to_owned(),
        source,
    })?;
    files::protect(file);
    parse(&file.display().to_string(), &text)
}

/// Bakes regions: those that are given, or those that are found.
fn bake_regions(plan: &Plan, given: Option<GivenRegions>) -> Result<Regions> {
    let baking = Progress::spinner("Baking regions");
    let regions = regions::bake(plan, given);
    drop(baking);
    regions
}

/// Frames a second of `--frame`.
const FPS: f64 = 60.0;

fn print(args: &Args, figures: &Figures) -> Result<()> {
    if args.json {
        return output::print_report(figures);
    }
    match args.stream.is_stdout() {
        true => output::progress_line(figures.summary().trim_end()),
        false => output::print(&figures.summary())?,
    }
    Ok(())
}

/// Traces items with a progress bar.
fn trace(plan: &Plan, items: std::ops::Range<usize>) -> Result<Vec<Traced>> {
    let samples = plan.items()[items.clone()].iter().map(|i| i.samples.len());
    let bar = Progress::new("Tracing samples", samples.sum::<usize>() as u64);
    plan.trace(items, &|samples| bar.step(samples as u64))
}

/// Traces the items of a task and writes its part; returns what there is to say.
fn run_task(task: &Task, plan: &Plan, key: u64) -> Result<String> {
    let file = task.create(key)?;
    let items = plan.share(task.index, task.tasks);
    let traced = trace(plan, items.clone())?;
    farm::write_part(file, plan, key, items.clone(), &traced)?;
    Ok(format!(
        "{}: {} of {} items of work, {} samples\n",
        task.part(key).display(),
        items.len(),
        plan.items().len(),
        traced.iter().map(Vec::len).sum::<usize>(),
    ))
}

/// A baked scene is one moment of an animation.
fn warn_of_motion(scene: &crate::scene::Scene, time: f64) {
    let moves = |i: &usize| scene.can_move(*i);
    let mut moving = (0..scene.instances.len()).filter(moves);
    if let Some(first) = moving.next() {
        let (name, more) = (&scene.instances[first].name, moving.count());
        let text = match more {
            0 => format!("{name} moves or deforms; its values are those of {time} s"),
            n => format!("{name} and {n} more move or deform; their values are those of {time} s"),
        };
        output::warn(&format!("{}: {text}", scene.name));
    }
}

/// Mean below which most of a scene looks black.
const DARK: f64 = 0.2;

/// A half-distance beyond the size of a closed scene leaves it black.
fn warn_of_darkness(plan: &Plan, mean: f64) {
    let kernels = plan.settings().vertices.kernels.iter();
    let longest = kernels.fold(0.0, |longest, kernel| match *kernel {
        Kernel::Exponential { half_distance } => half_distance.max(longest),
        Kernel::CutOff { .. } => longest,
    });
    let scene = plan.scene();
    let size = scene.size();
    if mean < DARK && longest > size {
        let [short, long] = [(0.03 * size).min(2.0), 0.3 * size].map(|m| {
            let scale = 10f32.powi(1 - m.log10().floor() as i32);
            output::significant(f64::from((m * scale).round() / scale))
        });
        output::warn(&format!(
            "{}: the mean is {mean:.2}, nearly black, since blockers count half at {longest} m and the scene is {} m \
             across; try --distances {short},{long}",
            scene.name,
            output::significant(f64::from(size)),
        ));
    }
}

fn warn_of_unsampled(plan: &Plan) {
    let unsampled: Vec<usize> = plan.unsampled().collect();
    if let Some(&first) = unsampled.first() {
        let name = &plan.scene().instances[first].name;
        let text = match unsampled.len() - 1 {
            0 => format!("{name} is see-through or has no area; its vertices are open"),
            n => format!(
                "{name} and {n} more are see-through or have no area; their vertices are open"
            ),
        };
        output::warn(&format!("{}: {text}", plan.scene().name));
    }
}

impl Args {
    /// The choices that decide which other options have an effect.
    fn active(&self, farm: &Farm) -> Vec<&'static str> {
        let is_task = matches!(farm, Farm::Task(_));
        let gltf = self.gltf.gltf.is_some() && !is_task;
        let choices = [
            (self.foliage.foliage, effects::FOLIAGE),
            (is_task, effects::TASK),
            (self.stream.output.is_some() && !is_task, effects::OUTPUT),
            (!is_task, effects::NO_TASK),
            (gltf, effects::GLTF),
            (self.report_folder(farm).is_some(), effects::REPORT),
            (
                gltf && self.gltf.into == Target::Occlusion,
                effects::OCCLUSION,
            ),
            (
                self.quality.ao.is_none() && self.quality.distances.len() == 2,
                effects::TWO_DISTANCES,
            ),
        ];
        let active = choices.iter().filter(|(active, _)| *active);
        active.map(|(_, choice)| *choice).collect()
    }

    /// Where the report goes; a task has none.
    fn report_folder(&self, farm: &Farm) -> Option<&Path> {
        self.report
            .as_deref()
            .filter(|_| !matches!(farm, Farm::Task(_)))
    }

    /// # Errors
    /// `Usage` where nothing would be written.
    fn check_outputs(&self, farm: &Farm) -> Result<()> {
        let has_stream = self.stream.output.is_some();
        let has_output = has_stream || self.gltf.gltf.is_some() || self.report.is_some();
        if self.json && self.stream.is_stdout() {
            let text =
                "standard output can have the stream (-o -) or the figures (--json), not both";
            return Err(Error::Usage(text.into()));
        }
        if !has_output && !matches!(farm, Farm::Task(_)) {
            let text = "name an output with -o, --gltf or --report";
            return Err(Error::Usage(text.into()));
        }
        Ok(())
    }
}
