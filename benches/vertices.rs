//! Error and time of vertex bakes: least squares beside point sampling, at the same number of rays.
//!
//! ```text
//! cargo bench --no-default-features --features encode --bench vertices -- SCENE.glb
//!     [--points N] [--reference RAYS] [--rays N] [--density D] [--max-per-face N] [--alpha A]
//! ```
//!
//! The error is the root mean square over points spread evenly by area over all surfaces that are
//! not see-through, on their fronts, against obscurance there with 1,024 rays; points inside geometry are left out.
//! Methods:
//!
//! - `least squares`: `dapple::vertices::server::bake`.
//! - `at vertices`: rays from the corners of the faces, averaged at each vertex by area; as many
//!   rays in all as the samples of the fit took.
//! - `mean of samples`: the samples of the fit, averaged at each vertex by area.
//!
//! Times are by the clock, all threads; `per million` divides by the vertices of all instances. On a
//! machine that does other work the clock says little: for the fit, which is all that is not ray
//! tracing, seconds of processor time of all threads together stand beside it (Linux only).

mod common;

use common::{points, processor_seconds};
use dapple::obscurance::{Gather, Obscurance};
use dapple::scene::{Pose, Scene};
use dapple::trace::Tracer;
use dapple::vertices::server::{self as vertices, Settings, Shape, Site, baseline, place};
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;

/// What a method gives for one instance: per signal, per variable of its shape.
type Values = Vec<Vec<f64>>;

struct Options {
    scene: String,
    points: usize,
    reference: u32,
    settings: Settings,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        scene: String::new(),
        points: 200_000,
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
        let number: f64 = value
            .parse()
            .map_err(|_| format!("{argument}: {value} is no number"))?;
        match argument.as_str() {
            "--points" => options.points = number as usize,
            "--reference" => options.reference = number as u32,
            "--rays" => options.settings.rays = number as u32,
            "--density" => options.settings.sampling.density = number,
            "--max-per-face" => options.settings.sampling.max_per_face = number as u32,
            "--alpha" => options.settings.alpha = number,
            _ => return Err(format!("no option {argument}")),
        }
    }
    match options.scene.is_empty() {
        true => Err("name a scene: cargo bench --bench vertices -- SCENE.glb".into()),
        false => Ok(options),
    }
}

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
    let begin = Instant::now();
    let tracer = Tracer::new(&scene, &pose);
    let build = begin.elapsed().as_secs_f64();

    let (bake, seconds) = vertices::bake(&scene, &pose, &tracer, settings)?;
    report(&scene, &bake, build, seconds);

    let shapes: Vec<Shape> = (0..scene.instances.len())
        .map(|instance| Shape::new(&scene, &pose, instance))
        .collect();
    let methods = methods(&scene, &pose, &tracer, settings, &shapes, &bake)?;
    let points = points(&scene, &shapes, options.points);
    println!(
        "reference: {} points, {} rays",
        points.len(),
        options.reference
    );
    let truth = Obscurance::new(&scene, &tracer, &settings.kernels, options.reference)?;
    let gathers: Vec<Gather> = points
        .par_iter()
        .map(|(instance, site)| {
            truth.at_surface(&site.surface(&scene, &pose, *instance), site.seed)
        })
        .collect();
    let inside = gathers.iter().filter(|gather| !gather.is_valid()).count();
    println!("  inside geometry, left out: {inside}");
    println!();
    println!("RMSE                 half-distance 2 m   300 m   97 % : 3 %");
    for (name, values) in &methods {
        let errors = errors(&shapes, values, &points, &gathers);
        println!(
            "{name:<20} {:>17.5} {:>7.5}  {:>11.5}",
            errors[0], errors[1], errors[2]
        );
    }
    Ok(())
}

fn report(scene: &Scene, bake: &vertices::Bake, build: f64, seconds: vertices::Seconds) {
    let sum = |f: &dyn Fn(&vertices::Report) -> usize| -> usize {
        bake.instances.iter().map(|i| f(&i.report)).sum()
    };
    let vertices = sum(&|r| r.vertices);
    println!(
        "{}: {} instances, {vertices} vertices ({} welded), {} triangles",
        scene.name,
        scene.instances.len(),
        sum(&|r| r.variables),
        sum(&|r| r.triangles)
    );
    println!(
        "samples {}, inside geometry {}; parts {}, at a bound {}, inexact {}, averaged {}; \
         filled from neighbours {}, from the mean {}, see-through {}",
        sum(&|r| r.samples),
        sum(&|r| r.invalid),
        sum(&|r| r.fit.parts),
        sum(&|r| r.fit.at_bounds),
        sum(&|r| r.fit.inexact),
        sum(&|r| r.fit.averaged),
        sum(&|r| r.fit.filled.from_neighbours),
        sum(&|r| r.fit.filled.from_default),
        sum(&|r| r.fit.filled.see_through),
    );
    println!("stage                        s   per million vertices");
    let millions = vertices as f64 / 1e6;
    for (stage, s) in [
        ("build hierarchies", build),
        ("weld and place samples", seconds.place),
        ("trace samples", seconds.trace),
        ("least squares", seconds.fit),
    ] {
        println!("{stage:<24} {s:>6.2} {:>8.2}", s / millions);
    }
    println!();
}

fn methods(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    settings: &Settings,
    shapes: &[Shape],
    bake: &vertices::Bake,
) -> dapple::Result<Vec<(&'static str, Vec<Values>)>> {
    let signals = settings.kernels.len();
    let obscurance = Obscurance::new(scene, tracer, &settings.kernels, settings.rays)?;
    let corners: usize = shapes
        .iter()
        .map(|shape| 3 * shape.receives.iter().filter(|receives| **receives).count())
        .sum();
    let samples: usize = bake.instances.iter().map(|i| i.report.samples).sum();
    let rays = (samples as f64 * f64::from(settings.rays) / corners as f64).ceil() as u32;
    println!("at vertices: {rays} rays a corner");
    let corner_obscurance = Obscurance::new(scene, tracer, &settings.kernels, rays.max(1))?;
    let mut placed = Vec::new();
    for (instance, shape) in shapes.iter().enumerate() {
        let sites = place::place(scene, instance, shape, settings.sampling);
        let gathers = vertices::trace(&obscurance, pose, instance, &sites);
        placed.push((shape, sites, gathers));
    }
    let begin = processor_seconds();
    let shapes_again = (0..shapes.len()).into_par_iter();
    shapes_again.for_each(|instance| drop(Shape::new(scene, pose, instance)));
    placed.par_iter().for_each(|(shape, sites, gathers)| {
        let samples = vertices::valid_samples(sites, gathers, signals);
        let default = vec![1.0; signals];
        drop(vertices::fit(
            shape,
            samples,
            signals,
            settings.alpha,
            &default,
        ));
    });
    let seconds = processor_seconds() - begin;
    let vertices: usize = bake.instances.iter().map(|i| i.report.vertices).sum();
    println!(
        "welding and least squares, processor time: {seconds:.2} s, {:.2} per million vertices",
        seconds / vertices as f64 * 1e6
    );
    let mut all = vec![
        ("least squares", Vec::new()),
        ("at vertices", Vec::new()),
        ("mean of samples", Vec::new()),
    ];
    for (instance, shape) in shapes.iter().enumerate() {
        // Values per vertex, back to one per variable.
        let values = bake.instances[instance].values.iter().map(|values| {
            let mut own = vec![0.0; shape.variables()];
            for (variable, value) in shape.variable_of.iter().zip(values) {
                own[*variable as usize] = f64::from(*value);
            }
            own
        });
        all[0].1.push(values.collect());
        all[1].1.push(baseline::at_vertices(
            &corner_obscurance,
            pose,
            instance,
            shape,
        ));
        let (_, sites, gathers) = &placed[instance];
        let samples = vertices::valid_samples(sites, gathers, signals);
        all[2].1.push(baseline::splat(shape, samples, signals));
    }
    Ok(all)
}

/// Root mean square errors of the two distances, and of their blend.
fn errors(
    shapes: &[Shape],
    values: &[Values],
    points: &[(usize, Site)],
    truth: &[Gather],
) -> [f64; 3] {
    let mut sums = [0.0; 3];
    let mut count = 0;
    let valid = points
        .iter()
        .zip(truth)
        .filter(|(_, gather)| gather.is_valid());
    for ((instance, site), gather) in valid {
        let triangle = shapes[*instance].triangles[site.triangle as usize];
        let weights = site.weights();
        let error = [0, 1].map(|kernel| {
            let values = &values[*instance][kernel];
            let value: f64 = (0..3)
                .map(|k| weights[k] * values[triangle[k] as usize])
                .sum();
            value - f64::from(gather.values[kernel])
        });
        for (sum, error) in
            sums.iter_mut()
                .zip([error[0], error[1], 0.03 * error[0] + 0.97 * error[1]])
        {
            *sum += error * error;
        }
        count += 1;
    }
    sums.map(|sum| (sum / f64::from(count.max(1))).sqrt())
}
