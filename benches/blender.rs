//! Error and time of vertex ambient occlusion: least squares beside Blender's bake to vertex colours (Cycles).
//!
//! ```text
//! cargo bench --no-default-features --features encode --bench blender -- SCENE.glb
//!     [--metres D] [--rays N] [--points N] [--reference RAYS]
//! ```
//!
//! Blender (Debian: `blender`, `python3-numpy`) imports the scene, bakes ambient occlusion up to D metres (2)
//! with N rays (256) at each corner of each face, and exports the scene with the result as COLOR_0
//! (`benches/blender/bake.py`). Then `dapple::vertices::server::bake` bakes the exported scene with the same number of
//! rays in all. The error of both is the root mean square over points spread evenly by area over all fronts
//! against ambient occlusion there with RAYS rays (1,024); points inside geometry are left out. Times are of the bake
//! alone, hierarchies included, without import and export: by the clock, and processor time of all threads.
//!
//! Blender is first held to a known answer: a floor of one metre under a large ceiling one metre above. With rays of two
//! metres, those less than 60 degrees from the normal are blocked: AO is 1 - sin^2 60 = 0.25 on the floor, and 1
//! at the corners of the ceiling.

mod common;

use common::{points, processor_seconds};
use dapple::obscurance::{Gather, Kernel, Obscurance};
use dapple::scene::Scene;
use dapple::trace::Tracer;
use dapple::vertices::server::{self as vertices, Settings, Shape, Site, place};
use rayon::prelude::*;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

struct Options {
    scene: String,
    metres: f32,
    rays: u32,
    points: usize,
    reference: u32,
}

fn options() -> Result<Options, String> {
    let mut options = Options {
        scene: String::new(),
        metres: 2.0,
        rays: 256,
        points: 200_000,
        reference: 1024,
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
            "--metres" => options.metres = number as f32,
            "--rays" => options.rays = number as u32,
            "--points" => options.points = number as usize,
            "--reference" => options.reference = number as u32,
            _ => return Err(format!("no option {argument}")),
        }
    }
    match options.scene.is_empty() {
        true => Err("name a scene: cargo bench --bench blender -- SCENE.glb".into()),
        false => Ok(options),
    }
}

fn main() {
    let result = options().and_then(|options| {
        let file = std::env::temp_dir().join(format!("dapple-blender-{}.glb", std::process::id()));
        let result = run(&options, &file);
        let _ = std::fs::remove_file(&file);
        result
    });
    if let Err(message) = result {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// A bake's cost.
struct Cost {
    /// By the clock.
    seconds: f64,
    processor_seconds: f64,
    rays: f64,
}

fn run(options: &Options, file: &Path) -> Result<(), String> {
    check_blender(file)?;
    let (corners, blender) = bake_with_blender(options, file)?;
    let scene = Scene::load(file).map_err(|e| e.to_string())?;
    let pose = scene.pose(0.0);
    let kernels = vec![Kernel::CutOff {
        distance: options.metres,
    }];

    let begin = (Instant::now(), processor_seconds());
    let tracer = Tracer::new(&scene, &pose);
    let shapes: Vec<Shape> = (0..scene.instances.len())
        .map(|instance| Shape::new(&scene, &pose, instance))
        .collect();
    let sampling = place::Sampling::default();
    let samples: usize = shapes
        .iter()
        .enumerate()
        .map(|(instance, shape)| place::place(&scene, instance, shape, sampling).len())
        .sum();
    let rays = (blender.rays / samples as f64).round().max(1.0) as u32;
    let settings = Settings {
        kernels: kernels.clone(),
        rays,
        sampling,
        ..Settings::default()
    };
    let (bake, _) = vertices::bake(&scene, &pose, &tracer, &settings).map_err(|e| e.to_string())?;
    let ours = Cost {
        seconds: begin.0.elapsed().as_secs_f64(),
        processor_seconds: processor_seconds() - begin.1,
        rays: f64::from(rays) * samples as f64,
    };

    let points = points(&scene, &shapes, options.points);
    let truth =
        Obscurance::new(&scene, &tracer, &kernels, options.reference).map_err(|e| e.to_string())?;
    let gathers: Vec<Gather> = points
        .par_iter()
        .map(|(instance, site)| {
            truth.at_surface(&site.surface(&scene, &pose, *instance), site.seed)
        })
        .collect();
    println!(
        "{}: {} instances, {corners} corners, {samples} samples of {rays} rays; {} points",
        options.scene,
        scene.instances.len(),
        points.len()
    );
    println!("method              RMSE   Mrays  seconds  processor seconds");
    let print = |name: &str, error: f64, cost: &Cost| {
        println!(
            "{name:<16} {error:>7.4} {:>7.1} {:>8.1} {:>18.1}",
            cost.rays * 1e-6,
            cost.seconds,
            cost.processor_seconds
        );
    };
    let colour = |instance: usize, vertex: u32| {
        let mesh = &scene.meshes[scene.instances[instance].mesh];
        mesh.colors
            .get(vertex as usize)
            .map_or(1.0, |c| f64::from(c.x))
    };
    print(
        "Blender, Cycles",
        rmse(&scene, &points, &gathers, &colour),
        &blender,
    );
    let baked = |instance: usize, vertex: u32| {
        f64::from(bake.instances[instance].values[0][vertex as usize])
    };
    print(
        "least squares",
        rmse(&scene, &points, &gathers, &baked),
        &ours,
    );
    Ok(())
}

/// Holds Blender to the known answer.
fn check_blender(file: &Path) -> Result<(), String> {
    let (source, buffer) = (file.with_extension("gltf"), file.with_extension("bin"));
    let corners: [[f32; 3]; 8] = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [-9.5, 1.0, -9.5],
        [10.5, 1.0, -9.5],
        [10.5, 1.0, 10.5],
        [-9.5, 1.0, 10.5],
    ];
    let indices = [0u32, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7];
    let floats = corners.iter().flatten().flat_map(|x| x.to_le_bytes());
    let bytes: Vec<u8> = floats
        .chain(indices.iter().flat_map(|i| i.to_le_bytes()))
        .collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "buffers":[{{"byteLength":144,"uri":{:?}}}],
        "bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":48}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3",
        "min":[-9.5,0,-9.5],"max":[10.5,1,10.5]}},
        {{"bufferView":1,"componentType":5125,"count":12,"type":"SCALAR"}}]}}"#,
        buffer.file_name().unwrap_or_default()
    );
    let written = std::fs::write(&source, json).and_then(|()| std::fs::write(&buffer, bytes));
    let options = Options {
        scene: source.display().to_string(),
        metres: 2.0,
        rays: 4096,
        points: 0,
        reference: 0,
    };
    let result = written
        .map_err(|e| e.to_string())
        .and_then(|()| bake_with_blender(&options, file));
    for file in [&source, &buffer] {
        let _ = std::fs::remove_file(file);
    }
    result?;
    let scene = Scene::load(file).map_err(|e| e.to_string())?;
    let mesh = &scene.meshes[0];
    for (at, colour) in mesh.positions.iter().zip(&mesh.colors) {
        let expected = if at.y < 0.5 { 0.25 } else { 1.0 };
        if (colour.x - expected).abs() > 0.01 {
            return Err(format!(
                "Blender bakes {} at {at}, where the answer is {expected}",
                colour.x
            ));
        }
    }
    match mesh.colors.is_empty() {
        true => Err("Blender exported no colours".into()),
        false => Ok(()),
    }
}

/// Bakes and exports the scene to `file`. Returns the number of corners and what it cost.
fn bake_with_blender(options: &Options, file: &Path) -> Result<(usize, Cost), String> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/blender/bake.py");
    let output = Command::new("blender")
        .args(["--background", "--python-exit-code", "1", "--python"])
        .arg(script)
        .args(["--", &options.scene])
        .arg(file)
        .args([options.rays.to_string(), options.metres.to_string()])
        .output()
        .map_err(|e| format!("blender: {e}; install the packages blender and python3-numpy"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    if !output.status.success() {
        let errors = String::from_utf8_lossy(&output.stderr);
        return Err(format!("blender failed:\n{text}{errors}"));
    }
    let words = |key: &str| -> Vec<f64> {
        let lines = text.lines().map(|line| line.split(' '));
        let mut found = lines.filter(|words| words.clone().next() == Some(key));
        let words = found.next().into_iter().flatten().skip(1);
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let (&[corners], &[seconds, processor_seconds]) = (&words("corners")[..], &words("bake")[..])
    else {
        return Err(format!("blender printed no times:\n{text}"));
    };
    let cost = Cost {
        seconds,
        processor_seconds,
        rays: corners * f64::from(options.rays),
    };
    Ok((corners as usize, cost))
}

/// Root mean square error of a value per vertex of an instance, interpolated over its triangles.
fn rmse(
    scene: &Scene,
    points: &[(usize, Site)],
    truth: &[Gather],
    value: &dyn Fn(usize, u32) -> f64,
) -> f64 {
    let valid = points
        .iter()
        .zip(truth)
        .filter(|(_, gather)| gather.is_valid());
    let (mut sum, mut count) = (0.0, 0);
    for ((instance, site), gather) in valid {
        let mesh = &scene.meshes[scene.instances[*instance].mesh];
        let triangle = mesh.triangles[site.triangle as usize];
        let weights = site.weights();
        let shown: f64 = (0..3)
            .map(|k| weights[k] * value(*instance, triangle[k]))
            .sum();
        sum += (shown - f64::from(gather.values[0])).powi(2);
        count += 1;
    }
    (sum / f64::from(count.max(1))).sqrt()
}
