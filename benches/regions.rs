//! Error, jumps, size and time of region bakes.
//!
//! ```text
//! cargo bench --no-default-features --features encode --bench regions -- SCENE.glb
//!     [--given FILE.json] [--points N] [--reference RAYS] [--rays N] [--regions N] [--cells N]
//!     [--least-cells N] [--small M3] [--tolerance E] [--divisions N] [--beta B] [--sweeps N] [--centres 0|1|2|3]
//! ```
//!
//! - `rung`: root mean square over random points of the free space, evenly by volume, and random normals,
//!   against obscurance there with 1,024 rays about the normal (2 m, 300 m, and 97 % of the second with 3 %
//!   of the first); points inside geometry are left out. Each region has the model of the rung, or the
//!   richest that its samples allow; `regularised` says whether neighbours were made to agree.
//! - `bytes a region`: of the blend alone, in both codings, with no AO off by more than 1/256 by quantising.
//! - `jump`: the difference of the blend between a point just inside and one just outside a face of a box,
//!   at random points of the faces and random normals, where both lie in the free space, see each other
//!   and have different boxes.
//! - `centres`: root mean square over the samples, by how the centre of Eq. 4 is chosen.
//!
//! Times are by the clock, all threads.

use dapple::codec::regions::{Coding, Update};
use dapple::codec::signals::{Kernel, Signals};
use dapple::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model as TrackModel, Target,
    Track,
};
use dapple::obscurance::{HALF_DISTANCES, Obscurance};
use dapple::regions::server::{
    self, Bake, Centres, Derivatives, Form, Layout, Model, Plan, RegionSamples, Seconds, Settings,
    file, fit, model, regularise, samples, stored,
};
use dapple::rng::Rng;
use dapple::scene::Scene;
use dapple::trace::{Ray, Tracer};
use glam::Vec3;
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;

/// How far quantising may move AO: what 8 bits can show.
const BOUND: f32 = 1.0 / 256.0;

struct Options {
    scene: String,
    given: Option<String>,
    points: usize,
    reference: u32,
    settings: Settings,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        scene: String::new(),
        given: None,
        points: 20_000,
        reference: 1024,
        settings: Settings::default(),
    };
    // Cargo adds its own.
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        if !argument.starts_with("--") {
            options.scene = argument;
            continue;
        }
        let value = arguments.next();
        let value = value.ok_or(format!("{argument} needs a value"))?;
        if argument == "--given" {
            options.given = Some(value);
            continue;
        }
        let number: f64 = value
            .parse()
            .map_err(|_| format!("{argument}: {value} is no number"))?;
        let settings = &mut options.settings;
        match argument.as_str() {
            "--points" => options.points = number as usize,
            "--reference" => options.reference = number as u32,
            "--rays" => settings.rays = number as u32,
            "--regions" => settings.regions = number as usize,
            "--cells" => settings.cells = number as usize,
            "--least-cells" => settings.least_cells = number as usize,
            "--small" => settings.small = number,
            "--tolerance" => settings.tolerance = number,
            "--divisions" => settings.divisions = number as usize,
            "--beta" => settings.regularise.beta = number,
            "--sweeps" => settings.regularise.sweeps = number as usize,
            "--centres" => settings.centres = CENTRES[number as usize % 4].1,
            _ => return Err(format!("no option {argument}")),
        }
    }
    match options.scene.is_empty() {
        true => Err("name a scene: cargo bench --bench regions -- SCENE.glb".into()),
        false => Ok(options),
    }
}

const CENTRES: [(&str, Centres); 4] = [
    ("box", Centres::Box),
    ("mass", Centres::Mass),
    ("both", Centres::Both),
    ("search", Centres::Search),
];

fn main() {
    if let Err(message) = options().and_then(|o| run(&o).map_err(|e| e.to_string())) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

fn run(options: &Options) -> dapple::Result<()> {
    let settings = &options.settings;
    let scene = Scene::load(Path::new(&options.scene))?;
    let pose = scene.pose(0.0);
    let tracer = Tracer::new(&scene, &pose);
    let given = options.given.as_ref().map(|path| {
        let text = std::fs::read_to_string(path).map_err(|source| dapple::Error::Io {
            path: path.into(),
            source,
        })?;
        file::parse(path, &text)
    });
    let given = given.transpose()?;
    let sided = Derivatives::Sided;
    let (plan, bake, seconds) = server::bake(&scene, &pose, &tracer, given, sided, settings)?;
    report(&scene, &plan, &bake, seconds);

    let begin = Instant::now();
    let truth = Obscurance::new(&scene, &tracer, &settings.kernels, options.reference)?;
    let bench = Bench {
        bake: &bake,
        share: f64::from(settings.blend.long),
        points: points(&tracer, &plan, &bake, options.points),
        crossings: crossings(&truth, &tracer, &plan, &bake, options.points),
    };
    let truth: Vec<Option<[f64; 2]>> = bench
        .points
        .par_iter()
        .map(|point| {
            let Point { p, n, seed, .. } = *point;
            let inside = truth.in_volume(p, seed, |_, _| ());
            let gather = truth.about(p, n, n, seed);
            let values = [gather.values[0], gather.values[1]].map(f64::from);
            inside.is_valid().then_some(values)
        })
        .collect();
    println!(
        "reference: {} points, {} rays, {:.1} s; {} crossings of boundaries",
        truth.iter().flatten().count(),
        options.reference,
        begin.elapsed().as_secs_f64(),
        bench.crossings.len()
    );
    println!();
    println!("rung                 bytes a region  RMSE                        jump");
    println!(
        "                     raw   packed    2 m     300 m   blend     mean    99 %    largest"
    );
    for derivatives in Derivatives::ALL {
        let own = bench.models(derivatives);
        let mut regularised = own.clone();
        bench.regularise(&mut regularised, settings.regularise);
        for degree in 0..=2 {
            let name = format!("{derivatives:?} L{degree}");
            bench.row(&name, &own, &truth, degree);
            if degree > 0 {
                bench.row("  regularised", &regularised, &truth, degree);
            }
        }
    }
    println!();
    println!(
        "beta (Sided L1)      raw   packed    2 m     300 m   blend     mean    99 %    largest"
    );
    for beta in [0.1, 0.3, 1.0, 3.0, 10.0, 100.0] {
        let mut models = bench.models(sided);
        let energies = bench.regularise(&mut models, regularise::Settings { beta, sweeps: 64 });
        let name = format!("  {beta}, {} sweeps", energies.len() - 1);
        bench.row(&name, &models, &truth, 1);
    }
    println!();
    println!("convergence: sweep, E, moved, at boundaries");
    for (i, energy) in bake.energies.iter().enumerate() {
        println!(
            "  {i:>3} {:.6} {:.6} {:.6}",
            energy.total(),
            energy.moved,
            energy.differences
        );
    }
    println!();
    println!("centre of Eq. 4      RMSE over samples and normals, mean of the signals    s");
    for (name, centres) in CENTRES {
        let begin = Instant::now();
        let sums: Vec<(f64, usize)> = bake
            .regions
            .par_iter()
            .map(|r| {
                let (_, fitted) = fit::fit(r.region.bounds, &r.samples, centres);
                let count = r.samples.samples.len();
                let residual = fitted.last().map_or(0.0, |f| f.residual);
                (residual / 2.0 * count as f64, count)
            })
            .collect();
        let total: f64 = sums.iter().map(|s| s.0).sum();
        let count: usize = sums.iter().map(|s| s.1).sum();
        println!(
            "  {name:<18} {:.5}   {:.2}",
            (total / count.max(1) as f64).sqrt(),
            begin.elapsed().as_secs_f64()
        );
    }
    Ok(())
}

fn report(scene: &Scene, plan: &Plan, bake: &Bake, seconds: Seconds) {
    let dims = plan.space.dims();
    println!(
        "{}: grid {}x{}x{}, cell {:.2} m, {} cells reached",
        scene.name,
        dims.x,
        dims.y,
        dims.z,
        plan.space.cell(),
        plan.space.reached()
    );
    println!(
        "regions {}, links {}; covered {}; absorbed {}, empty {}, left {} with {} links",
        plan.graph.regions.len(),
        plan.graph.links.len(),
        plan.covered
            .map_or("-".into(), |c| format!("{:.1} %", 100.0 * c)),
        bake.absorbed.len(),
        bake.empty.len(),
        bake.regions.len(),
        bake.links.len()
    );
    let count = |layout: Layout| {
        bake.regions
            .iter()
            .filter(|r| r.fit.layout == layout)
            .count()
    };
    let layouts = [
        Layout::Space,
        Layout::OneSided,
        Layout::Plane,
        Layout::Line,
        Layout::Point,
        Layout::Empty,
    ];
    for layout in layouts {
        print!("{layout:?} {}; ", count(layout));
    }
    let valid: usize = bake.regions.iter().map(|r| r.samples.samples.len()).sum();
    println!("valid samples {valid}");
    let terms = bake.regions.iter().flat_map(|r| &r.model.terms).flatten();
    let largest = terms.map(|term| term.abs()).fold(0.0, f64::max);
    println!("largest coefficient {largest:.3}");
    println!(
        "seconds: plan {:.2}, trace {:.2}, absorb {:.2}, fit {:.2}, regularise {:.2}",
        seconds.plan, seconds.trace, seconds.absorb, seconds.fit, seconds.regularise
    );
}

/// A point with a normal, and the region whose box it was drawn in.
struct Point {
    region: usize,
    p: Vec3,
    n: Vec3,
    seed: u32,
}

/// A step from one region into another.
struct Crossing {
    regions: [usize; 2],
    points: [Vec3; 2],
    n: Vec3,
}

struct Bench<'a> {
    bake: &'a Bake,
    share: f64,
    points: Vec<Point>,
    crossings: Vec<Crossing>,
}

impl Bench<'_> {
    fn models(&self, derivatives: Derivatives) -> Vec<Model> {
        let form = Form {
            derivatives,
            degree: 2,
            signals: 2,
        };
        let regions = self.bake.regions.iter();
        regions.map(|r| r.fit.model(form).clone()).collect()
    }

    fn regularise(
        &self,
        models: &mut [Model],
        settings: regularise::Settings,
    ) -> Vec<server::Energy> {
        let samples: Vec<&RegionSamples> = self.bake.regions.iter().map(|r| &r.samples).collect();
        server::regularise(models, &samples, &self.bake.links, settings)
    }

    fn row(&self, name: &str, models: &[Model], truth: &[Option<[f64; 2]>], degree: usize) {
        let blend = |v: [f64; 2]| model::blend(v[0], v[1], self.share);
        let mut sums = [0.0; 3];
        let mut count = 0;
        for (point, truth) in self.points.iter().zip(truth) {
            let Some(truth) = truth else {
                continue;
            };
            let channels = models[point.region].channels(point.p);
            let got = model::evaluate(&channels, degree, point.n);
            let errors = [
                got[0] - truth[0],
                got[1] - truth[1],
                blend(got) - blend(*truth),
            ];
            for (sum, error) in sums.iter_mut().zip(errors) {
                *sum += error * error;
            }
            count += 1;
        }
        let rmse = sums.map(|sum: f64| (sum / f64::from(count.max(1))).sqrt());
        let mut jumps: Vec<f64> = self
            .crossings
            .iter()
            .map(|crossing| {
                let [a, b] = [0, 1].map(|i| {
                    let channels = models[crossing.regions[i]].channels(crossing.points[i]);
                    blend(model::evaluate(&channels, degree, crossing.n))
                });
                (a - b).abs()
            })
            .collect();
        let mean = jumps.iter().sum::<f64>() / jumps.len().max(1) as f64;
        jumps.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let last = jumps.len().saturating_sub(1) as f64;
            jumps.get((share * last) as usize).copied().unwrap_or(0.0)
        };
        let [raw, packed] =
            [Coding::Raw, Coding::Packed].map(|coding| self.bytes(models, degree, coding));
        println!(
            "{name:<20} {raw:>5.1} {packed:>6.1}   {:>7.4} {:>7.4} {:>7.4}   {mean:>7.4} {:>7.4} {:>7.4}",
            rmse[0],
            rmse[1],
            rmse[2],
            at(0.99),
            at(1.0)
        );
    }
}

impl Bench<'_> {
    /// Bytes a region of one signal, quantised so that no AO is off by more than [`BOUND`]: of the record's
    /// payload, header and table included.
    fn bytes(&self, models: &[Model], degree: usize, coding: Coding) -> f64 {
        let form = |model: &Model| Form {
            derivatives: model.derivatives,
            degree,
            signals: 1,
        };
        let regions: Vec<(&Model, Form)> = models.iter().map(|m| (m, form(m))).collect();
        let signals = Signals {
            count: 1,
            kernels: HALF_DISTANCES.map(Kernel::exponential),
            share: self.share as f32,
        };
        let (set, content) =
            stored::store(&regions, 2, signals, BOUND, coding).expect("models can be stored");
        let track = Track {
            id: 1,
            target: Target::default(),
            aabb_min: [0.0; 3],
            aabb_max: [1.0; 3],
            space: LookupSpace::Mesh,
            model: TrackModel::Regions(set),
        };
        let mut out = Vec::new();
        let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).expect("a stream");
        encoder
            .group(&mut out, GroupStart::Keyframes)
            .expect("a group");
        encoder.tracks(&mut out, &[track]).expect("a track");
        let before = out.len();
        let update = Update {
            track: 1,
            regions: &content.regions,
            pairs: &content.pairs,
        };
        encoder
            .regions(&mut out, &[update], Compression::None)
            .expect("content of the track");
        (out.len() - before) as f64 / models.len().max(1) as f64
    }
}

/// The region that a client takes for a point: the smallest box that holds it, else the nearest.
fn find(bake: &Bake, p: Vec3) -> usize {
    let volume = |i: usize| {
        let size = bake.regions[i].region.bounds.max - bake.regions[i].region.bounds.min;
        size.x * size.y * size.z
    };
    let distance = |i: usize| bake.regions[i].region.bounds.distance_squared(p);
    (0..bake.regions.len())
        .min_by(|&a, &b| {
            let by_distance = distance(a).total_cmp(&distance(b));
            by_distance.then(volume(a).total_cmp(&volume(b)))
        })
        .unwrap_or(0)
}

/// Random points in the free space, evenly by volume. Where no box holds one, the client takes the nearest.
fn points(tracer: &Tracer, plan: &Plan, bake: &Bake, count: usize) -> Vec<Point> {
    let cells: Vec<_> = plan.space.cells().collect();
    (0..count)
        .into_par_iter()
        .filter_map(|i| {
            let mut random = Rng::new(i as u64 + 1);
            let cell = cells[(random.unit_f64() * cells.len() as f64) as usize];
            let at = Vec3::new(random.unit(), random.unit(), random.unit());
            let p = cell.min + at * (cell.max - cell.min);
            let n = samples::direction(&mut random);
            plan.space.sees(tracer, p).then(|| Point {
                region: find(bake, p),
                p,
                n,
                seed: random.draw() as u32,
            })
        })
        .collect()
}

/// Steps of 2 mm out of random points of the faces of boxes.
fn crossings(
    obscurance: &Obscurance,
    tracer: &Tracer,
    plan: &Plan,
    bake: &Bake,
    count: usize,
) -> Vec<Crossing> {
    let regions = bake.regions.len();
    (0..count)
        .into_par_iter()
        .filter_map(|i| {
            let mut random = Rng::new(!(i as u64));
            let bounds = bake.regions[i % regions].region.bounds;
            let at = Vec3::new(random.unit(), random.unit(), random.unit());
            let mut p = bounds.min + at * (bounds.max - bounds.min);
            let side = i / regions % 6;
            let mut out = Vec3::ZERO;
            out[side / 2] = [-1e-3, 1e-3][side % 2];
            p[side / 2] = [bounds.min, bounds.max][side % 2][side / 2];
            let points = [p - out, p + out];
            let regions = points.map(|p| find(bake, p));
            let step = Ray {
                origin: points[0],
                direction: points[1] - points[0],
                t_max: 1.0,
            };
            let crosses = regions[0] != regions[1]
                && points.iter().all(|p| plan.space.sees(tracer, *p))
                && !tracer.occluded(&step)
                && obscurance.in_volume(p, i as u32, |_, _| ()).is_valid();
            crosses.then(|| Crossing {
                regions,
                points,
                n: samples::direction(&mut random),
            })
        })
        .collect()
}
