//! Error, size and time of the rungs of `instances`, beside values of their own at the vertices of every instance.
//!
//! ```text
//! cargo bench --no-default-features --features encode --bench instances -- SCENE.glb
//!     [--instances N] [--points N] [--reference RAYS] [--rays N] [--samples N]
//!     [--spacing METRES] [--volume-rays N] [--vertex-rays N] [--vertex-samples N] [--foliage POINTS]
//! ```
//!
//! Errors are root mean square over points spread evenly by area over the fronts of N instances of each mesh, `--points`
//! each, against obscurance there with `--reference` rays; points inside geometry are left out. Fits see other points.
//! Methods:
//!
//! - `local alone`: local obscurance of the mesh, the rung none.
//! - `scalar`, `linear`: times the global function, fitted to rays from samples (the default).
//! - `two signals`: the linear functions of 2 m and 300 m, blended as a client does that has both apart: the blend of the
//!   functions times the blend of the local values. It differs in the last column alone.
//! - `linear, refined local`: local values from alternating least squares over the chosen instances.
//! - `linear, no local`: the linear function by itself.
//! - `decorator`: a scalar by itself, from the surfaces about the foot of the instance. For small instances alone.
//! - `linear by volume`: fitted to the volume of spherical harmonics around the instances.
//! - `per vertex`: a least squares fit of every instance by itself (`dapple::vertices`), with at most
//!   `--vertex-samples` samples a face.
//!
//! With `--foliage` nothing of this is measured, but obscurance at so many points of meshes with one instance, with the
//! leaves traced as they are and as foliage (`dapple::obscurance::foliage`).
//!
//! The volume is made around the chosen instances only; its cost is told per instance.

use dapple::codec::instances::{Coding, Form, Update};
use dapple::codec::signals::{Kernel, Signals};
use dapple::codec::vertices::{self as vertices_codec, Vertices};
use dapple::codec::{
    Compression, Encoder, EncoderConfig, GroupStart, LookupSpace, Model, Target, Track,
};
use dapple::instances::server::fit::{self, Linear};
use dapple::instances::server::solve::{self, Traced, UnitBox};
use dapple::instances::server::{self, Context, Function, Group, Layout, Site, Solved, Volume};
use dapple::obscurance::{self, Blend, Gather, Obscurance, foliage};
use dapple::scene::{Mesh, Pose, Scene};
use dapple::trace::{Aabb, Tracer};
use dapple::vertices::server as vertices;
use rayon::prelude::*;
use std::path::Path;
use std::time::Instant;

/// Metres across up to which a mesh is a small decorator.
const SMALL: f32 = 2.0;

/// 2 m, 300 m, and their blend.
const SIGNALS: usize = 3;

struct Options {
    scene: String,
    instances: usize,
    points: usize,
    reference: u32,
    rays: u32,
    samples: u32,
    spacing: f32,
    volume_rays: u32,
    vertex_rays: u32,
    vertex_samples: u32,
    foliage: u32,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        scene: String::new(),
        instances: 50,
        points: 100,
        reference: 1024,
        rays: dapple::obscurance::SURFACE_RAYS,
        samples: server::SAMPLES,
        spacing: 2.0,
        volume_rays: dapple::obscurance::VOLUME_RAYS,
        vertex_rays: 64,
        vertex_samples: 4,
        foliage: 0,
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
            "--instances" => options.instances = number as usize,
            "--points" => options.points = number as usize,
            "--reference" => options.reference = number as u32,
            "--rays" => options.rays = number as u32,
            "--samples" => options.samples = number as u32,
            "--spacing" => options.spacing = number as f32,
            "--volume-rays" => options.volume_rays = number as u32,
            "--vertex-rays" => options.vertex_rays = number as u32,
            "--foliage" => options.foliage = number as u32,
            "--vertex-samples" => options.vertex_samples = number as u32,
            _ => return Err(format!("no option {argument}")),
        }
    }
    match options.scene.is_empty() {
        true => Err("name a scene: cargo bench --bench instances -- SCENE.glb".into()),
        false => Ok(options),
    }
}

fn main() {
    if let Err(message) = options().and_then(|o| run(&o).map_err(|e| e.to_string())) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// The short one, the long one, and the blend of both.
fn signals(values: &[f32]) -> Vec<f32> {
    let blend = Blend::default().apply(values[0], values[1]);
    vec![values[0], values[1], blend]
}

/// Of a point: where it is, and what obscurance is there.
struct Point {
    site: Site,
    truth: Vec<f32>,
}

/// Sums of weighted squares by method and signal.
#[derive(Clone, Default)]
struct Errors {
    methods: Vec<(&'static str, [f64; SIGNALS])>,
    weight: f64,
}

impl Errors {
    fn add(&mut self, method: &'static str, squares: [f64; SIGNALS]) {
        let known = self.methods.iter_mut().find(|(name, _)| *name == method);
        match known {
            Some((_, sums)) => (0..SIGNALS).for_each(|k| sums[k] += squares[k]),
            None => self.methods.push((method, squares)),
        }
    }
}

fn timed<R>(what: &str, each: f64, f: impl FnOnce() -> R) -> R {
    let (begin, before) = (Instant::now(), processor_seconds());
    let result = f();
    let (clock, processor) = (begin.elapsed().as_secs_f64(), processor_seconds() - before);
    println!(
        "{what:<44} {clock:>8.2} s {processor:>8.2} s of processors {:>9.2} ms each",
        1e3 * processor / each
    );
    result
}

fn run(options: &Options) -> dapple::Result<()> {
    let scene = Scene::load(Path::new(&options.scene))?;
    let pose = scene.pose(0.0);
    let tracer = Tracer::new(&scene, &pose);
    let kernels = vertices::Settings::default().kernels;
    if options.foliage > 0 {
        return compare_foliage(options, &scene, &pose, &tracer, &kernels);
    }
    let groups = server::groups(&scene, &pose);
    if groups.is_empty() {
        return Err(dapple::Error::Invalid(format!(
            "{}: no mesh has several instances",
            scene.name
        )));
    }
    let obscurance = Obscurance::new(&scene, &tracer, &kernels, options.rays)?;
    let context = Context {
        scene: &scene,
        pose: &pose,
        obscurance: &obscurance,
        samples: options.samples,
        signals: &signals,
    };
    let reference = Obscurance::new(&scene, &tracer, &kernels, options.reference)?;
    let corner = Obscurance::new(&scene, &tracer, &kernels, options.volume_rays)?;
    let mut total = Errors::default();
    for group in &groups {
        let errors = measure(options, &context, &reference, &corner, group)?;
        print(&scene.meshes[group.mesh].name, &errors);
        for (name, squares) in &errors.methods {
            total.add(name, *squares);
        }
        total.weight += errors.weight;
    }
    print("all", &total);
    Ok(())
}

/// Obscurance of what stands there once, with leaves as they are and as foliage.
fn compare_foliage(
    options: &Options,
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    kernels: &[obscurance::Kernel],
) -> dapple::Result<()> {
    let kinds = foliage::classify(scene, pose, &foliage::Rules::default());
    for (mesh, kind) in scene.meshes.iter().zip(&kinds) {
        println!("{}: {kind:?}", mesh.name);
    }
    let leaves = foliage::Foliage::new(scene, pose, &kinds, foliage::DENSITY)?;
    let attenuation = leaves.attenuation();
    let bare = Tracer::new(scene, &leaves.without(pose));
    let as_they_are = Obscurance::new(scene, tracer, kernels, options.rays)?;
    let as_foliage = Obscurance::new(scene, &bare, kernels, options.rays)?;
    let as_foliage = as_foliage.with_foliage(&attenuation);
    let grouped: Vec<usize> = server::groups(scene, pose).iter().map(|g| g.mesh).collect();
    let single = (0..scene.instances.len())
        .filter(|i| !grouped.contains(&scene.instances[*i].mesh))
        .flat_map(|i| {
            let sites = server::place::place(scene, pose, i, options.foliage, i as u64);
            sites.into_iter().map(move |site| (i, site))
        });
    let single: Vec<(usize, Site)> = single.collect();
    let [shrubs, trees] = leaves.counts();
    println!("{shrubs} shrubs, {trees} trees; {} points", single.len());
    for (name, obscurance) in [("as they are", &as_they_are), ("as foliage", &as_foliage)] {
        let gathers: Vec<Gather> = timed(name, single.len() as f64, || {
            single
                .par_iter()
                .map(|(i, site)| obscurance.at_surface(&site.surface(scene, pose, *i), site.seed))
                .collect()
        });
        let mean = |k: usize| {
            let sum: f64 = gathers.iter().map(|g| f64::from(g.values[k])).sum();
            sum / gathers.len() as f64
        };
        println!("{name:<28} mean {:>12.4} {:>7.4}", mean(0), mean(1));
    }
    Ok(())
}

fn print(name: &str, errors: &Errors) {
    println!();
    println!("{name:<28} half-distance 2 m   300 m   97 % : 3 %");
    for (method, squares) in &errors.methods {
        let e = squares.map(|s| (s / errors.weight).sqrt());
        println!("{method:<28} {:>17.4} {:>7.4} {:>12.4}", e[0], e[1], e[2]);
    }
    println!();
}

/// The errors of all methods on some instances of a group.
fn measure(
    options: &Options,
    context: &Context,
    reference: &Obscurance,
    corner: &Obscurance,
    group: &Group,
) -> dapple::Result<Errors> {
    let (scene, pose) = (context.scene, context.pose);
    let mesh = &scene.meshes[group.mesh];
    let vertices = mesh.positions.len();
    println!(
        "{}: {} instances of {vertices} vertices, {} triangles; {} parts beside; median scale {}",
        mesh.name,
        group.instances.len(),
        mesh.triangles.len(),
        group.companions.len(),
        group.scale
    );
    let local = timed("local obscurance", 1.0, || local(scene, pose, group))?;
    let step = group.instances.len().div_ceil(options.instances.max(1));
    let chosen: Vec<usize> = group.instances.iter().copied().step_by(step).collect();
    let count = chosen.len() as f64;
    let traced: Vec<(Vec<Traced>, usize)> = timed("samples of instances by rays", count, || {
        chosen.iter().map(|i| solve::trace(context, *i)).collect()
    });
    let solve_all = |traced: &[(Vec<Traced>, usize)], local: &[Vec<f32>]| -> Vec<Solved> {
        let pairs = chosen.iter().zip(traced);
        pairs
            .map(|(i, (t, invalid))| solve::solve_traced(scene, *i, local, t, *invalid))
            .collect()
    };
    let solved = timed("fits", count, || solve_all(&traced, &local));
    let white = vec![vec![1.0; vertices]; SIGNALS];
    let alone = solve_all(&traced, &white);
    let refined: Vec<Vec<f32>> = timed("refinement of local values", 1.0, || {
        let pairs = chosen.iter().zip(&traced);
        let instances: Vec<(usize, &[Traced])> = pairs.map(|(i, (t, _))| (*i, &t[..])).collect();
        let one = |signal: usize| {
            let of = server::refine(scene, group.mesh, &instances, &local[signal], signal);
            println!(
                "refinement, signal {signal}: held-out error {:.4}, then {:.4}, {} turns",
                of.errors[0], of.errors[1], of.turns
            );
            of.local
        };
        (0..SIGNALS).map(one).collect()
    });
    let after = solve_all(&traced, &refined);
    let size = group.scale * Aabb::of(mesh.positions.iter().copied()).radius();
    let decorated = match 2.0 * size <= SMALL {
        true => Some(timed("decorators", count, || {
            decorators(context, group, &chosen)
        })?),
        false => None,
    };
    let volume = timed("volume", count, || {
        volume(options, scene, pose, corner, &chosen)
    })?;
    let by_volume: Vec<(Vec<Traced>, usize)> =
        timed("samples of instances by volume", count, || {
            let pairs = chosen.iter().zip(&traced);
            pairs
                .map(|(i, (t, invalid))| (from_volume(context, &volume, *i, t), *invalid))
                .collect()
        });
    let by_volume = solve_all(&by_volume, &local);
    let own = timed("per vertex", count, || {
        per_vertex(options, context, &chosen)
    })?;
    let points = timed("reference", count, || {
        chosen
            .iter()
            .map(|i| points(options, context, reference, *i))
            .collect::<Vec<_>>()
    });

    let unit = UnitBox::new(&mesh.positions);
    let mut errors = Errors::default();
    for (k, points) in points.iter().enumerate() {
        for Point { site, truth } in points {
            let corners = mesh.triangles[site.triangle as usize].map(|v| v as usize);
            let weights = site.weights();
            let interpolate = |values: &[f32]| -> f64 {
                let sum: f32 = (0..3).map(|c| weights[c] * values[corners[c]]).sum();
                f64::from(sum)
            };
            let place = unit.place(
                (0..3)
                    .map(|c| weights[c] * mesh.positions[corners[c]])
                    .sum(),
            );
            let squares = |value: &dyn Fn(usize) -> f64| -> [f64; SIGNALS] {
                std::array::from_fn(|s| site.area * (value(s) - f64::from(truth[s])).powi(2))
            };
            let with = |global: &dyn Fn(usize) -> Linear, local: &[Vec<f32>]| {
                squares(&|s| fit::shown(&global(s), place, interpolate(&local[s])))
            };
            errors.add("local alone", with(&|_| fit::ONE, &local));
            errors.add("scalar", with(&|s| solved[k].fits[s].scalar.global, &local));
            errors.add("linear", with(&|s| solved[k].fits[s].linear.global, &local));
            let both = |s: usize| {
                let [a, b, _] = [0, 1, 2].map(|s| &solved[k].fits[s].linear.global);
                let share = f64::from([0.0, 1.0, Blend::default().long][s]);
                let value = |c| fit::evaluate(c, place) * (interpolate(&local[s]));
                (value(a) * (1.0 - share) + value(b) * share).clamp(0.0, 1.0)
            };
            errors.add("two signals", squares(&both));
            errors.add(
                "linear, refined local",
                with(&|s| after[k].fits[s].linear.global, &refined),
            );
            if let Some(decorated) = &decorated {
                let scalar = |s: usize| [f64::from(decorated[k][s]), 0.0, 0.0, 0.0];
                errors.add("decorator", with(&scalar, &white));
            }
            errors.add(
                "linear, no local",
                with(&|s| alone[k].fits[s].linear.global, &white),
            );
            errors.add(
                "linear by volume",
                with(&|s| by_volume[k].fits[s].linear.global, &local),
            );
            errors.add("per vertex", squares(&|s| interpolate(&own[k][s])));
            errors.weight += site.area;
        }
    }
    let held_out = |pick: usize| -> f64 {
        let sum: f64 = solved.iter().map(|s| s.errors()[pick].powi(2)).sum();
        (sum / count).sqrt()
    };
    println!(
        "held-out error of the fits: none {:.4}, scalar {:.4}, linear {:.4}",
        held_out(0),
        held_out(1),
        held_out(2)
    );
    for (name, form) in [("scalar", Form::Scalar), ("linear", Form::Linear)] {
        let [raw, packed] = [Coding::Raw, Coding::Packed].map(|coding| {
            let functions: Vec<Function> = chosen
                .iter()
                .zip(&solved)
                .map(|(i, solved)| {
                    let blend = match form {
                        Form::Scalar => solved.fits[2].scalar.global,
                        Form::Linear => solved.fits[2].linear.global,
                    };
                    Function::new(&scene.instances[*i].name, form, &[blend])
                })
                .collect();
            record_bytes(mesh, &functions, coding)
        });
        println!(
            "record of {} {name} functions of one signal: raw {} bytes, packed {}",
            chosen.len(),
            raw?,
            packed?
        );
    }
    let blends =
        |of: &[Vec<Vec<f32>>]| -> Vec<Vec<f32>> { of.iter().map(|o| o[2].clone()).collect() };
    println!(
        "records of vertices, one signal of 8 bits, packed and zstd: {} instances {} bytes, local {}",
        chosen.len(),
        vertices_bytes(mesh, &blends(&own))?,
        vertices_bytes(mesh, &[local[2].clone()])?,
    );
    let n = group.instances.len();
    println!(
        "values of one signal: per vertex {}; local {vertices}, scalar {n}, linear {}",
        n * vertices,
        4 * n
    );
    Ok(errors)
}

/// Bytes of a record with the table of these functions.
fn record_bytes(mesh: &Mesh, functions: &[Function], coding: Coding) -> dapple::Result<usize> {
    let bound = server::table::BOUND;
    let Some((table, entries)) = server::table(blend_signal(), functions, bound, coding)? else {
        return Ok(0);
    };
    let update = Update {
        track: 1,
        entries: &entries,
    };
    content_bytes(mesh, 1, Model::Instances(table), |encoder, bytes| {
        encoder.instances(bytes, &[update], Compression::None)
    })
}

/// Bytes of a record with a track of values at the vertices for each of these.
fn vertices_bytes(mesh: &Mesh, values: &[Vec<f32>]) -> dapple::Result<usize> {
    let parameters = Vertices {
        signals: blend_signal(),
        count: mesh.positions.len() as u32,
        bits: 8,
        order: Vertices::FILE_ORDER,
        coding: vertices_codec::Coding::Packed,
    };
    let zstd = Compression::Zstd {
        level: 19,
        lazy: false,
    };
    let code = |v: &f32| vertices_codec::nearest(*v, 8);
    let codes: Vec<Vec<u8>> = values
        .iter()
        .map(|v| v.iter().map(code).collect())
        .collect();
    let updates: Vec<vertices_codec::Update> = (1..)
        .zip(&codes)
        .map(|(track, codes)| vertices_codec::Update { track, codes })
        .collect();
    content_bytes(
        mesh,
        values.len(),
        Model::Vertices(parameters),
        |encoder, bytes| encoder.vertices(bytes, &updates, zstd),
    )
}

fn blend_signal() -> Signals {
    let [short, long] = obscurance::HALF_DISTANCES.map(Kernel::exponential);
    Signals::blended(short, long, Blend::default().long)
}

/// Bytes that `write` appends to a stream of `tracks` tracks of a model; their declarations do not count.
fn content_bytes(
    mesh: &Mesh,
    tracks: usize,
    model: Model,
    write: impl FnOnce(&mut Encoder, &mut Vec<u8>) -> Result<(), dapple::codec::Error>,
) -> dapple::Result<usize> {
    let bounds = Aabb::of(mesh.positions.iter().copied());
    let track = |id: u32| Track {
        id,
        target: Target {
            content_hash: Some(1),
            ..Target::default()
        },
        aabb_min: bounds.min.to_array(),
        aabb_max: bounds.max.to_array(),
        space: LookupSpace::Mesh,
        model,
    };
    let tracks: Vec<Track> = (1..=tracks as u32).map(track).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
    encoder.group(&mut bytes, GroupStart::Keyframes)?;
    encoder.tracks(&mut bytes, &tracks)?;
    let before = bytes.len();
    write(&mut encoder, &mut bytes)?;
    Ok(bytes.len() - before)
}

/// Local obscurance of a group's mesh, per signal and vertex.
fn local(scene: &Scene, pose: &Pose, group: &Group) -> dapple::Result<Vec<Vec<f32>>> {
    let (alone, at) = group.alone(scene, pose);
    let tracer = Tracer::new(&alone, &at);
    let settings = vertices::Settings::default();
    let (bake, _) = vertices::bake(&alone, &at, &tracer, &settings)?;
    Ok(blended(&bake.instances[0].values))
}

/// Per signal and vertex, from values per kernel and vertex.
fn blended(values: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let mut all = vec![Vec::new(); SIGNALS];
    for (short, long) in values[0].iter().zip(&values[1]) {
        for (all, value) in all.iter_mut().zip(signals(&[*short, *long])) {
            all.push(value);
        }
    }
    all
}

/// Scalars of instances as small decorators, 1 where nothing is near; the mesh and its companions are taken out of the scene.
fn decorators(context: &Context, group: &Group, chosen: &[usize]) -> dapple::Result<Vec<Vec<f32>>> {
    let scene = context.scene;
    let is_part = |instance: usize| {
        let mesh = scene.instances[instance].mesh;
        mesh == group.mesh || group.companions.iter().any(|c| c.mesh == mesh)
    };
    let bare = Tracer::new(scene, &foliage::without(context.pose, is_part));
    let kernels = context.obscurance.kernels();
    let obscurance = Obscurance::new(scene, &bare, kernels, context.obscurance.rays())?;
    let context = Context {
        obscurance: &obscurance,
        ..*context
    };
    let one = |instance: &usize| server::decorator::scalar(&context, &bare, *instance);
    let all = chosen.iter().map(one);
    Ok(all.map(|s| s.unwrap_or(vec![1.0; SIGNALS])).collect())
}

fn volume(
    options: &Options,
    scene: &Scene,
    pose: &Pose,
    corner: &Obscurance,
    chosen: &[usize],
) -> dapple::Result<Volume> {
    let boxes: Vec<Aabb> = chosen
        .iter()
        .map(|i| {
            let positions = &scene.meshes[scene.instances[*i].mesh].positions;
            let world = &pose.world_from_mesh[*i];
            Aabb::of(positions.iter().map(|p| world.transform_point3(*p))).grown(1e-3)
        })
        .collect();
    let layout = Layout::new(&boxes, options.spacing)?;
    let volume = Volume::new(layout, corner);
    println!(
        "volume: spacing {} m, {} corners, {} inside geometry",
        options.spacing,
        volume.layout.len(),
        volume.invalid()
    );
    Ok(volume)
}

/// The same samples with values of the volume.
fn from_volume(
    context: &Context,
    volume: &Volume,
    instance: usize,
    traced: &[Traced],
) -> Vec<Traced> {
    traced
        .iter()
        .filter_map(|Traced { site, .. }| {
            let surface = site.surface(context.scene, context.pose, instance);
            let values = volume.at(surface.position, surface.normal)?;
            Some(Traced {
                site: *site,
                gold: signals(&values),
            })
        })
        .collect()
}

/// Values per instance, signal and vertex.
fn per_vertex(
    options: &Options,
    context: &Context,
    chosen: &[usize],
) -> dapple::Result<Vec<Vec<Vec<f32>>>> {
    let (scene, pose) = (context.scene, context.pose);
    let default = vertices::Settings::default();
    let sampling = vertices::Sampling {
        max_per_face: options.vertex_samples,
        ..default.sampling
    };
    let tracer = Tracer::new(scene, pose);
    let obscurance = Obscurance::new(scene, &tracer, &default.kernels, options.vertex_rays)?;
    let one = |instance: &usize| {
        let shape = vertices::Shape::new(scene, pose, *instance);
        let sites = vertices::place::place(scene, *instance, &shape, sampling);
        let gathers = vertices::trace(&obscurance, pose, *instance, &sites);
        let samples = vertices::valid_samples(&sites, &gathers, 2);
        let mean = vertices::mean(samples.clone(), 2);
        let fit = vertices::fit(&shape, samples, 2, default.alpha, &mean);
        let values = fit.values.iter();
        let values: Vec<_> = values.map(|v| vertices::of_vertices(&shape, v)).collect();
        blended(&values)
    };
    Ok(chosen.iter().map(one).collect())
}

/// Random points of an instance, others than its samples.
fn points(
    options: &Options,
    context: &Context,
    reference: &Obscurance,
    instance: usize,
) -> Vec<Point> {
    let (scene, pose) = (context.scene, context.pose);
    let count = options.points as u32;
    let sites = server::place::place(scene, pose, instance, count, !(instance as u64));
    let gathers: Vec<Gather> = sites
        .par_iter()
        .map(|site| reference.at_surface(&site.surface(scene, pose, instance), site.seed))
        .collect();
    sites
        .into_iter()
        .zip(gathers)
        .filter(|(_, gather)| gather.is_valid())
        .map(|(site, gather)| Point {
            site,
            truth: signals(&gather.values[..2]),
        })
        .collect()
}

/// Processor time of all threads so far, 0 where Linux does not tell it: user and system time in
/// hundredths of a second are the 14th and 15th field, the second being a name in parentheses.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(") ").next().unwrap_or_default();
    let fields = after_name.split(' ').skip(11).take(2);
    fields.filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}
