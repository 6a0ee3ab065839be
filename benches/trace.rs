//! Any-hit and closest-hit throughput beside Embree's, on the same two-level scene and the same rays.
//!
//! ```text
//! cargo bench --no-default-features --features encode --bench trace [-- SCENE.glb]
//! ```
//!
//! Without a file it takes `../shared/scenes/sponza_boulders.glb` (or that in `DAPPLE_SCENES`), and
//! where that is absent a built-in one. Embree runs as a program of its own, `benches/embree`, which
//! is compiled here where Embree 3 and g++ are present; elsewhere its columns stay empty.
//!
//! Rays: ambient-occlusion rays, 0.6 m, cosine-distributed, from points spread evenly over all
//! surfaces. `grouped` traces 64 rays from one origin after the other; `random` takes the same number of
//! rays, each from an origin of its own, in random order. `closest` sets are the same rays without an
//! end, as obscurance takes them. All materials are opaque and
//! skinned meshes at rest, on both sides. Times are the
//! greatest processor time of a thread, least of several runs, ours and Embree's in turn.

use dapple::rng::Rng;
use dapple::scene::{Alpha, Instance, Material, Mesh, Pose, Scene};
use dapple::trace::sampler::{Frame, Patterns};
use dapple::trace::{Ray, Tracer, offset};
use glam::{Affine3A, Vec3};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

const ORIGINS: usize = 16_384;
const RAYS: u32 = 64;
const DISTANCE: f32 = 0.6;
const REPEATS: usize = 5;

/// A point on a surface and its normal.
type Point = (Vec3, Vec3);

/// Rays of one measurement.
struct RaySet {
    name: &'static str,
    rays: Vec<Ray>,
    /// The nearest hit is asked for, and not whether there is any.
    is_closest: bool,
}

impl RaySet {
    fn any_hit(name: &'static str, rays: &[Ray]) -> RaySet {
        RaySet {
            name,
            rays: rays.to_vec(),
            is_closest: false,
        }
    }

    /// The rays without an end.
    fn closest(name: &'static str, rays: &[Ray]) -> RaySet {
        let mut set = RaySet::any_hit(name, rays);
        set.is_closest = true;
        set.rays
            .iter_mut()
            .for_each(|ray| ray.t_max = f32::INFINITY);
        set
    }
}

fn main() {
    let file = std::env::args()
        .skip(1)
        .find(|a| !a.starts_with("--"))
        .map(PathBuf::from);
    let (scene, pose) = load(file);
    let scene = opaque(scene);
    let triangles: usize = scene
        .instances
        .iter()
        .map(|i| scene.meshes[i.mesh].triangles.len())
        .sum();
    println!(
        "{}: {} instances, {triangles} triangles",
        scene.name,
        scene.instances.len()
    );

    let begin = Instant::now();
    let mut tracer = Tracer::new(&scene, &pose);
    println!("build: {:.0} ms", begin.elapsed().as_secs_f64() * 1e3);
    top_level(&mut tracer, &scene, &pose);

    let points = points(&scene, &pose);
    let [grouped, random] = [grouped(&tracer, &points), random(&tracer, &points)];
    let sets = [
        RaySet::any_hit("grouped", &grouped),
        RaySet::any_hit("random", &random),
        RaySet::closest("closest, grouped", &grouped),
        RaySet::closest("closest, random", &random),
    ];
    let embree = embree(&scene, &pose, &sets);

    println!();
    println!(
        "Mrays/s             threads   ours  Embree  ratio  Embree flat     hits  Embree hits"
    );
    for (number, set) in sets.iter().enumerate() {
        for threads in [1, 2] {
            let (seconds, hits) = best(threads, set.rays.len(), |range| {
                let rays = set.rays[range].iter();
                match set.is_closest {
                    true => rays.filter(|r| tracer.closest(r).is_some()).count(),
                    false => rays.filter(|r| tracer.occluded(r)).count(),
                }
            });
            report(
                set.name,
                threads,
                set.rays.len(),
                seconds,
                hits,
                &embree,
                number,
            );
        }
    }
    for threads in [1, 2] {
        let (seconds, hits) = best(threads, points.len(), |range| {
            range.map(|i| blocked(&tracer, points[i], i)).sum()
        });
        report(
            "grouped, as AO",
            threads,
            grouped.len(),
            seconds,
            hits,
            &embree,
            0,
        );
    }
    if embree.is_empty() {
        println!("Embree: skipped. Install g++ and libembree-dev (Embree 3) to compare.");
    }
}

fn blocked(tracer: &Tracer, (position, normal): Point, seed: usize) -> usize {
    let open = tracer.ambient_occlusion(position, normal, normal, RAYS, DISTANCE, seed as u32);
    ((1.0 - open) * RAYS as f32).round() as usize
}

/// Time of a rebuild of the upper level, and of an update in which nothing moved.
fn top_level(tracer: &mut Tracer, scene: &Scene, pose: &Pose) {
    let mut moved = pose.clone();
    let mut milliseconds = |pose: &Pose| {
        let begin = Instant::now();
        let _work = tracer.update(pose);
        begin.elapsed().as_secs_f64() * 1e3
    };
    let (mut moving, mut still) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..20 {
        if let Some(last) = moved.world_from_mesh.last_mut() {
            last.translation.x += 0.01;
        }
        moving = moving.min(milliseconds(&moved));
        still = still.min(milliseconds(&moved));
    }
    milliseconds(pose);
    let later = scene.pose(1.0);
    let begin = Instant::now();
    let work = tracer.update(&later);
    println!(
        "update to t = 1 s: {:.2} ms, {work:?}",
        begin.elapsed().as_secs_f64() * 1e3
    );
    tracer.update(pose);
    println!("update: {moving:.3} ms when one instance moves, {still:.3} ms when none does");
}

fn report(
    name: &str,
    threads: usize,
    rays: usize,
    seconds: f64,
    hits: usize,
    embree: &[Line],
    set: usize,
) {
    let rate = |s: f64| rays as f64 / s / 1e6;
    let find = |levels: &str| {
        embree
            .iter()
            .find(|l| l.set == set && l.levels == levels && l.threads == threads)
    };
    print!("{name:<20} {threads:>6} {:>6.2}", rate(seconds));
    if let (Some(two), Some(flat)) = (find("two"), find("flat")) {
        println!(
            "  {:>6.2} {:>6.2}  {:>11.2} {hits:>8}     {:>8}",
            rate(two.seconds),
            two.seconds / seconds,
            rate(flat.seconds),
            two.hits
        );
    } else {
        println!("       -      -            - {hits:>8}            -");
    }
}

/// The least time over the repeats, and what `work` counts.
fn best(
    threads: usize,
    items: usize,
    work: impl Fn(std::ops::Range<usize>) -> usize + Sync,
) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0);
    for _ in 0..REPEATS {
        let results: Vec<(f64, usize)> = std::thread::scope(|s| {
            let team: Vec<_> = (0..threads)
                .map(|i| {
                    let range = items * i / threads..items * (i + 1) / threads;
                    let work = &work;
                    s.spawn(move || {
                        let begin = thread_seconds();
                        let count = work(range);
                        (thread_seconds() - begin, count)
                    })
                })
                .collect();
            team.into_iter()
                .map(|t| t.join().expect("a worker panicked"))
                .collect()
        });
        let seconds = results.iter().map(|r| r.0).fold(0.0, f64::max);
        if seconds < best.0 {
            best = (seconds, results.iter().map(|r| r.1).sum());
        }
    }
    best
}

/// Processor time of this thread where Linux tells it, else the clock.
fn thread_seconds() -> f64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|s| s.split(' ').next()?.parse::<f64>().ok())
        .map_or_else(
            || START.get_or_init(Instant::now).elapsed().as_secs_f64(),
            |ns| ns * 1e-9,
        )
}

fn load(file: Option<PathBuf>) -> (Scene, Pose) {
    let folder = std::env::var_os("DAPPLE_SCENES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"),
        PathBuf::from,
    );
    let file = file.unwrap_or_else(|| folder.join("sponza_boulders.glb"));
    if file.exists() {
        match Scene::load(&file) {
            Ok(scene) => {
                let mut pose = scene.pose(0.0);
                pose.deformed.fill(None);
                return (scene, pose);
            }
            Err(e) => println!("{e}"),
        }
    }
    println!("{} is absent: a built-in scene instead", file.display());
    built_in()
}

/// 400 wrinkled balls over a wrinkled floor.
fn built_in() -> (Scene, Pose) {
    let wrinkle = |p: Vec3| 0.05 * ((9.0 * p.x).sin() + (11.0 * p.y).sin() + (13.0 * p.z).sin());
    let grid = |n: u32, at: &dyn Fn(f32, f32) -> Vec3| Mesh {
        positions: (0..n * n)
            .map(|i| {
                at(
                    (i % n) as f32 / (n - 1) as f32,
                    (i / n) as f32 / (n - 1) as f32,
                )
            })
            .collect(),
        triangles: (0..(n - 1) * (n - 1))
            .flat_map(|i| {
                let a = i / (n - 1) * n + i % (n - 1);
                [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]
            })
            .collect(),
        materials: vec![0; 2 * ((n - 1) * (n - 1)) as usize],
        ..Mesh::default()
    };
    let floor = grid(256, &|u, v| {
        let p = Vec3::new(30.0 * u - 15.0, 0.0, 30.0 * v - 15.0);
        p + Vec3::Y * wrinkle(p)
    });
    let ball = grid(24, &|u, v| {
        let (theta, phi) = (std::f32::consts::PI * v, std::f32::consts::TAU * u);
        let p = Vec3::new(
            theta.sin() * phi.cos(),
            theta.cos(),
            -theta.sin() * phi.sin(),
        );
        p * (0.5 + wrinkle(p))
    });
    let mut world_from_mesh = vec![Affine3A::IDENTITY];
    world_from_mesh.extend((0..400).map(|i| {
        let at = Vec3::new((i % 20) as f32, 0.4, (i / 20) as f32) * Vec3::new(1.4, 1.0, 1.4)
            - Vec3::new(13.0, 0.0, 13.0);
        Affine3A::from_rotation_translation(glam::Quat::from_rotation_y(i as f32), at)
    }));
    let instances = (0..world_from_mesh.len())
        .map(|i| Instance {
            name: format!("{i}"),
            mesh: usize::from(i > 0),
            ..Instance::default()
        })
        .collect();
    let pose = Pose {
        deformed: vec![None; world_from_mesh.len()],
        world_from_mesh,
        ..Pose::default()
    };
    let scene = Scene {
        name: "built-in".into(),
        meshes: vec![floor, ball],
        materials: vec![Material::default()],
        instances,
        ..Scene::default()
    };
    (scene, pose)
}

/// Embree's side has no alpha test, so ours must not pay for one.
fn opaque(mut scene: Scene) -> Scene {
    for material in &mut scene.materials {
        material.alpha = Alpha::Opaque;
    }
    scene
}

/// Points spread evenly by area over all instances, in the order of the surface, as a server holds
/// them.
fn points(scene: &Scene, pose: &Pose) -> Vec<Point> {
    let mut all = Vec::new();
    let mut total = 0.0;
    for (instance, to) in scene.instances.iter().zip(&pose.world_from_mesh) {
        let mesh = &scene.meshes[instance.mesh];
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| to.transform_point3(mesh.positions[i as usize]));
            let n = (b - a).cross(c - a);
            if let Some(normal) = n.try_normalize() {
                total += f64::from(n.length());
                all.push((total, [a, b, c], normal));
            }
        }
    }
    let mut r = Rng::new(1);
    (0..ORIGINS)
        .map(|i| {
            let at = (i as f64 + r.unit_f64()) / ORIGINS as f64 * total;
            let found = all.partition_point(|x| x.0 < at).min(all.len() - 1);
            let (_, [a, b, c], n) = all[found];
            let (mut u, mut v) = (r.unit_f64() as f32, r.unit_f64() as f32);
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            (a + (b - a) * u + (c - a) * v, n)
        })
        .collect()
}

fn rays_at<'p>(
    tracer: &Tracer,
    patterns: &'p Patterns,
    (position, normal): Point,
    seed: usize,
) -> impl Iterator<Item = Ray> + 'p {
    let origin = offset::offset_origin(position, normal, tracer.reach());
    let (directions, turn) = patterns.pick(seed as u32);
    let frame = Frame::new(normal, turn);
    directions.iter().map(move |d| Ray {
        origin,
        direction: frame.to_world(*d),
        t_max: DISTANCE,
    })
}

fn grouped(tracer: &Tracer, points: &[Point]) -> Vec<Ray> {
    let patterns = Patterns::new(RAYS);
    points
        .iter()
        .enumerate()
        .flat_map(|(i, p)| rays_at(tracer, &patterns, *p, i))
        .collect()
}

/// As many rays with as many origins: ray k of a point, the points in random order for every k.
fn random(tracer: &Tracer, points: &[Point]) -> Vec<Ray> {
    let mut rays = grouped(tracer, points);
    let mut r = Rng::new(2);
    for i in (1..rays.len()).rev() {
        rays.swap(i, (r.unit_f64() * (i + 1) as f64) as usize);
    }
    rays
}

/// One line of what the Embree program prints.
struct Line {
    set: usize,
    levels: String,
    threads: usize,
    seconds: f64,
    hits: u64,
}

/// Empty where Embree cannot be had.
fn embree(scene: &Scene, pose: &Pose, sets: &[RaySet]) -> Vec<Line> {
    let folder = std::env::temp_dir().join(format!("dapple-embree-{}", std::process::id()));
    let lines = run_embree(&folder, scene, pose, sets).unwrap_or_else(|e| {
        println!("Embree: {e}");
        Vec::new()
    });
    let _ = std::fs::remove_dir_all(&folder);
    lines
}

fn run_embree(
    folder: &Path,
    scene: &Scene,
    pose: &Pose,
    sets: &[RaySet],
) -> std::io::Result<Vec<Line>> {
    std::fs::create_dir_all(folder)?;
    let (program, data) = (folder.join("embree"), folder.join("scene"));
    let compiled = Command::new("g++")
        .args(["-O3", "-march=native", "-std=c++17", "-o"])
        .arg(&program)
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/embree/embree.cpp"))
        .args(["-lembree3", "-lpthread"])
        .output()?;
    if !compiled.status.success() {
        return Err(std::io::Error::other(
            "g++ could not compile benches/embree/embree.cpp against libembree3",
        ));
    }
    write_scene(&data, scene, pose, sets)?;
    let output = Command::new(&program)
        .arg(&data)
        .arg(REPEATS.to_string())
        .output()?;
    if !output.status.success() {
        return Err(std::io::Error::other(String::from_utf8_lossy(
            &output.stderr,
        )));
    }
    let mut lines = Vec::new();
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["build", levels, seconds] => {
                println!(
                    "Embree build, {levels}: {:.0} ms",
                    seconds.parse().unwrap_or(f64::NAN) * 1e3
                );
            }
            ["rays", set, levels, threads, seconds, hits] => lines.push(Line {
                set: set.parse().unwrap_or(usize::MAX),
                levels: levels.into(),
                threads: threads.parse().unwrap_or(0),
                seconds: seconds.parse().unwrap_or(f64::NAN),
                hits: hits.parse().unwrap_or(0),
            }),
            _ => {}
        }
    }
    Ok(lines)
}

/// Little-endian words: meshes (counts, positions, indices), instances (mesh, three axes and the
/// translation), ray sets (1 for closest hits; origin, direction, length of each ray); each list after its
/// length.
fn write_scene(path: &Path, scene: &Scene, pose: &Pose, sets: &[RaySet]) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut word = |x: u32| out.write_all(&x.to_le_bytes());
    word(scene.meshes.len() as u32)?;
    for mesh in &scene.meshes {
        word(mesh.positions.len() as u32)?;
        word(mesh.triangles.len() as u32)?;
        for p in &mesh.positions {
            p.to_array()
                .into_iter()
                .try_for_each(|x| word(x.to_bits()))?;
        }
        mesh.triangles.iter().flatten().try_for_each(|&i| word(i))?;
    }
    word(scene.instances.len() as u32)?;
    for (instance, to) in scene.instances.iter().zip(&pose.world_from_mesh) {
        word(instance.mesh as u32)?;
        to.to_cols_array()
            .into_iter()
            .try_for_each(|x| word(x.to_bits()))?;
    }
    word(sets.len() as u32)?;
    for set in sets {
        word(set.is_closest.into())?;
        word(set.rays.len() as u32)?;
        for r in &set.rays {
            let [a, b, c] = r.origin.to_array();
            let [d, e, f] = r.direction.to_array();
            [a, b, c, d, e, f, r.t_max]
                .into_iter()
                .try_for_each(|x| word(x.to_bits()))?;
        }
    }
    out.flush()
}
