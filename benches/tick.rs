//! What a tick of the server costs: a still one, and one whether or not the scene is twice as large.
//!
//! ```text
//! cargo bench --no-default-features --features encode --bench tick [-- SCENE.glb] [--density N] [--ticks K]
//! ```
//!
//! Without a file it takes `../shared/scenes/sponza_boulders.glb` (or that in `DAPPLE_SCENES`), and
//! where that is absent the built-in hall.
//!
//! The doubled scene has a copy of every instance that never moves, shifted by the scene's own size
//! and ten metres more, out of reach of all movers. Both are ticked in turn in one process, every point that movers
//! reach is traced (no visibility), and the medians of the two are compared: the ratio is to stay
//! below 1.15. The noise of such a ratio is shown by that of the scene against a second server of
//! its own.

use dapple::codec::{Compression, Limits, TickRate};
use dapple::models::ModelOptions;
use dapple::points::place::Density;
use dapple::points::server::{Options, Server, Tick};
use dapple::scene::{Instance, Node, Scene};
use dapple::stream::{Job, Stream, View};
use dapple::world::World;
use glam::{Mat4, Vec3};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The largest ratio of a tick's time in the doubled scene to that in the scene.
const BOUND: f64 = 1.15;
/// Ticks a second.
const RATE: f64 = 60.0;

fn main() {
    let mut file = None;
    let (mut density, mut ticks) = (256.0f32, 60usize);
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        let mut value = || {
            arguments
                .next()
                .and_then(|a| a.parse::<f64>().ok())
                .filter(|v| *v >= 1.0)
        };
        match argument.as_str() {
            "--density" => density = value().expect("--density takes a number from 1 up") as f32,
            "--ticks" => ticks = value().expect("--ticks takes a number from 1 up") as usize,
            _ => file = Some(PathBuf::from(argument)),
        }
    }
    let scene = load(file);
    let options = Options {
        density: Density {
            candidates: density,
            thinning: 2.0,
        },
        visibility: false,
        ..Options::default()
    };
    println!(
        "{}: {} instances, N = {density}, {} rays a point, {} threads",
        scene.name,
        scene.instances.len(),
        options.rays,
        rayon::current_num_threads()
    );
    still(&scene, options);
    doubled(&scene, options, ticks);
}

fn load(file: Option<PathBuf>) -> Scene {
    let shared = std::env::var_os("DAPPLE_SCENES").map(PathBuf::from);
    let shared = shared
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes"));
    let path = file.unwrap_or_else(|| shared.join("sponza_boulders.glb"));
    if path.exists() {
        return Scene::load(&path).unwrap_or_else(|e| panic!("{e}"));
    }
    println!("{} is not there: the built-in hall instead", path.display());
    Scene::hall()
}

/// A tick in which nothing moves.
fn still(scene: &Scene, options: Options) {
    const TICKS: usize = 200;
    let mut frozen = scene.clone();
    frozen.channels.clear();
    let view = match frozen.cameras.is_empty() {
        true => View::Fixed(frozen.framing_camera(&frozen.pose(0.0))),
        false => View::Camera(0),
    };
    let job = Job {
        models: vec![ModelOptions::Points(Options {
            visibility: true,
            density: Density {
                candidates: 16.0,
                thinning: 2.0,
            },
            ..options
        })],
        view,
        frames: TICKS + 2,
        rate: TickRate::default(),
        start: 0.0,
        keyframe_interval: 0,
        compression: Compression::Zstd {
            level: 15,
            lazy: true,
        },
        limits: Limits::default(),
    };
    let mut bytes = Vec::new();
    let mut stream = Stream::start(&frozen, job, &mut bytes, &mut |_, _| {}).expect("a stream");
    let (mut rays, before, mut times) = (0, bytes.len(), Vec::new());
    for _ in 0..TICKS {
        let clock = Instant::now();
        let tick = stream
            .next_frame(&mut bytes)
            .expect("a frame")
            .expect("not the last");
        times.push(clock.elapsed());
        rays += tick.rays;
    }
    println!(
        "\nstill tick: {rays} rays, {} bytes (a commit record has 48), {:.3} ms\n",
        (bytes.len() - before) as f64 / TICKS as f64,
        median(&mut times)
    );
}

/// One tick.
struct Measured {
    time: Duration,
    tick: Tick,
    pose_time: Duration,
    update_time: Duration,
}

/// One scene under measurement.
struct Run<'s> {
    name: &'static str,
    world: World<'s>,
    server: Server,
    points: usize,
    ticks: Vec<Measured>,
}

impl<'s> Run<'s> {
    fn new(name: &'static str, scene: &'s Scene, options: Options) -> Run<'s> {
        let world = World::new(scene, 0.0);
        let mut server = Server::new(&world, options).expect("a server");
        server.start(&world, &mut |_, _| {});
        let points = server.tracks().iter().map(|t| t.points()).sum();
        Run {
            name,
            world,
            server,
            points,
            ticks: Vec::new(),
        }
    }

    fn tick(&mut self, time: f64) {
        let clock = Instant::now();
        let tick = self.server.advance(&mut self.world, time);
        let time = clock.elapsed();
        for track in self.server.tracks_mut() {
            track.store.take_dirty();
        }
        self.ticks.push(Measured {
            time,
            tick,
            pose_time: self.world.pose_time(),
            update_time: self.world.update_time(),
        });
    }

    fn median(&self, of: impl Fn(&Measured) -> Duration) -> f64 {
        median(&mut self.ticks.iter().map(of).collect::<Vec<_>>())
    }
}

/// Ticks of the scene, of the scene again, and of the scene with its still part doubled, in turn.
fn doubled(scene: &Scene, options: Options, ticks: usize) {
    let large = with_a_copy(scene);
    let mut runs = [
        Run::new("scene", scene, options),
        Run::new("scene again", scene, options),
        Run::new("doubled", &large, options),
    ];
    // One tick to warm up; which one goes first changes from tick to tick.
    for k in 0..=ticks {
        for turn in 0..runs.len() {
            let run = (k + turn) % runs.len();
            runs[run].tick((k + 1) as f64 / RATE);
        }
    }
    for run in &mut runs {
        run.ticks.remove(0);
    }

    println!("medians of {ticks} ticks, ms");
    println!(
        "             instances     points   traced    pose  update  select   trace   store    tick"
    );
    for run in &runs {
        let mut traced: Vec<usize> = run.ticks.iter().map(|t| t.tick.traced_points).collect();
        traced.sort_unstable();
        println!(
            "{:12} {:9}  {:9}  {:7} {:7.3} {:7.3} {:7.3} {:7.3} {:7.3} {:7.3}",
            run.name,
            run.world.scene().instances.len(),
            run.points,
            traced[traced.len() / 2],
            run.median(|t| t.pose_time),
            run.median(|t| t.update_time),
            run.median(|t| t.tick.select_time),
            run.median(|t| t.tick.trace_time),
            run.median(|t| t.tick.store_time),
            run.median(|t| t.time),
        );
    }
    let total = |run: &Run| run.median(|t| t.time);
    let same = runs[0]
        .ticks
        .iter()
        .zip(&runs[2].ticks)
        .all(|(a, b)| a.tick.traced_points == b.tick.traced_points);
    // Pairs of the same tick: what slows the machine down for a while slows both.
    let paired = |run: &Run| {
        let pairs = run.ticks.iter().zip(&runs[0].ticks);
        let mut ratios: Vec<f64> = pairs
            .map(|(a, b)| a.time.as_secs_f64() / b.time.as_secs_f64())
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        ratios[ratios.len() / 2]
    };
    println!("\nratio to scene  of medians  median of pairs   (bound {BOUND})");
    for run in &runs[1..] {
        let of_medians = total(run) / total(&runs[0]);
        println!("{:14}  {of_medians:10.3}  {:15.3}", run.name, paired(run));
    }
    println!(
        "the same number of points traced: {}",
        if same { "yes" } else { "no" }
    );
}

/// The scene with a copy of every instance that never moves, out of reach of all that does.
fn with_a_copy(scene: &Scene) -> Scene {
    let pose = scene.pose(0.0);
    let (min, max) = scene.bounds(&pose).unwrap_or((Vec3::ZERO, Vec3::ZERO));
    // Sideways: the span of all movers over the animation is taken to lie about the scene.
    let shift = Vec3::X * (2.0 * (max.x - min.x) + 10.0);
    let mut large = scene.clone();
    large.name += " doubled";
    for (i, instance) in scene.instances.iter().enumerate() {
        let moves = scene.is_moving_instance(i)
            || scene.is_deforming_instance(i)
            || scene.is_deformed_instance(i);
        if moves {
            continue;
        }
        let mut world = pose.world_from_mesh[i];
        world.translation += glam::Vec3A::from(shift);
        large.nodes.push(Node {
            name: format!("{} copy", instance.name),
            parent: None,
            translation: Vec3::ZERO,
            rotation: glam::Quat::IDENTITY,
            scale: Vec3::ONE,
            matrix: Some(Mat4::from(world)),
            morph_weights: Vec::new(),
        });
        large.instances.push(Instance {
            name: format!("{} copy", instance.name),
            node: Some(large.nodes.len() - 1),
            offset: glam::Affine3A::IDENTITY,
            ..instance.clone()
        });
    }
    large
}

/// Milliseconds.
fn median(times: &mut [Duration]) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}
