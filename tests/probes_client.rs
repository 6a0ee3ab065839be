//! The client's light against path tracing: probes are traced here as they are, neither coded nor
//! averaged over frames, so that what differs is the client's.
use dapple::probes::client::ProbesVolume;
use dapple::probes::dering::{Keep, dering};
use dapple::probes::lattice::Lattice;
use dapple::probes::sh::{self, L2};
use dapple::probes::visibility::{Visibility, texel_direction};
use dapple::render::gbuffer::{GBuffer, Lookup, NONE};
use dapple::render::light::{Interpolation, Lit, Source};
use dapple::render::probes::{exponent, texels};
use dapple::render::{Backend, Picture, Renderer, tone};
use dapple::scene::{CameraPose, Pose, Scene};
use dapple::trace::Tracer;
use dapple::trace::path::{PathTracer, Paths, Random, Sky, Vertex};
use glam::{Affine3A, Vec3};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

const SIDE: u32 = 8;

/// A volume of traced probes.
struct Probes {
    lattice: Lattice,
    origin: Vec3,
    radiance: Vec<L2>,
    present: Vec<bool>,
    blocks: Vec<[u8; 2]>,
    range: f32,
    texels: Vec<dapple::render::probes::Texel>,
    exponent: i8,
}

fn spiral(i: u32, n: u32) -> Vec3 {
    let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
    let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
    Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
}

impl Probes {
    fn trace(paths: &PathTracer, (min, max): (Vec3, Vec3), dims: [u16; 3], rays: u32) -> Probes {
        // Outermost probes a quarter of a spacing from the walls.
        let spacing = (max - min) / (Vec3::from(dims.map(f32::from)) - 0.5);
        let lattice = Lattice { dims, spacing };
        let origin = min + 0.25 * spacing;
        let range = 1.5 * spacing.length();
        let probe = |p: usize| {
            let mut light: L2 = [Vec3::ZERO; 9];
            let mut backs = 0;
            let mut sums = vec![[0.0f32; 3]; (SIDE * SIDE) as usize];
            for ray in 0..rays {
                let direction = spiral(ray, rays);
                let random = Random::new(5, p as u32, ray);
                let options = Paths::default();
                let at = origin + lattice.position(p);
                let arrived = paths.radiance(at, direction, random, &options);
                let weight = 4.0 * std::f32::consts::PI / rays as f32;
                sh::project(&mut light, direction, arrived.radiance, weight);
                backs += u32::from(arrived.back_face);
                let distance = arrived.distance.min(range);
                for (t, sum) in sums.iter_mut().enumerate() {
                    let near = direction.dot(texel_direction(t, SIDE)).max(0.0).powi(40);
                    *sum = [
                        sum[0] + near,
                        sum[1] + near * distance,
                        sum[2] + near * distance * distance,
                    ];
                }
            }
            dering(&mut light, Keep::Irradiance);
            let block: Vec<[u8; 2]> = sums
                .iter()
                .map(|[w, d, d2]| {
                    let mean = d / w;
                    let deviation = (d2 / w - mean * mean).max(0.0).sqrt();
                    [mean, deviation].map(|m| (m * 255.0 / range).round() as u8)
                })
                .collect();
            (light, backs * 4 < rays, block)
        };
        let probes: Vec<_> = (0..lattice.count()).into_par_iter().map(probe).collect();
        let radiance: Vec<L2> = probes.iter().map(|p| p.0).collect();
        let exponent = exponent(&radiance);
        Probes {
            lattice,
            origin,
            present: probes.iter().map(|p| p.1).collect(),
            blocks: probes.into_iter().flat_map(|p| p.2).collect(),
            range,
            texels: texels(&radiance, exponent),
            radiance,
            exponent,
        }
    }

    fn volume(&self) -> ProbesVolume<'_> {
        assert_eq!(self.radiance.len(), self.lattice.count());
        ProbesVolume::from_parts(
            self.lattice,
            Affine3A::from_translation(-self.origin),
            self.exponent,
            &self.texels,
            &self.present,
            Some(Visibility {
                side: SIDE,
                range: self.range,
                texels: &self.blocks,
            }),
        )
    }
}

/// Something of what every pixel's centre sees; black in the sky.
fn each<F>(paths: &PathTracer, camera: &CameraPose, buffer: &GBuffer, of: F) -> Vec<Vec3>
where
    F: Fn(u32, &Vertex) -> Vec3 + Sync,
{
    let pixel = |i: usize| {
        if buffer.fragments[i].instance == NONE {
            return Vec3::ZERO;
        }
        let (x, y) = (i as u32 % buffer.width, i as u32 / buffer.width);
        let direction = camera.ray(x as f32 + 0.5, y as f32 + 0.5, buffer.width, buffer.height);
        let Some(vertex) = paths.first(camera.eye(), direction, true).0 else {
            return Vec3::ZERO;
        };
        of(i as u32, &vertex)
    };
    let pixels = 0..buffer.fragments.len();
    pixels.into_par_iter().map(pixel).collect()
}

/// Indirect light by paths.
fn reference(paths: &PathTracer, camera: &CameraPose, buffer: &GBuffer, samples: u32) -> Vec<Vec3> {
    each(paths, camera, buffer, |i, vertex| {
        let sample = |s| paths.scattered(vertex, &mut Random::new(1, i, s), 32, false);
        (0..samples).map(sample).sum::<Vec3>() / samples as f32
    })
}

/// Direct light with traced shadows.
fn direct(paths: &PathTracer, camera: &CameraPose, buffer: &GBuffer) -> Vec<Vec3> {
    each(paths, camera, buffer, |_, vertex| paths.direct(vertex))
}

/// PSNR of a picture that the tone curve makes of radiance.
fn psnr(a: &[Vec3], b: &[Vec3], exposure: f32) -> f64 {
    let (a, b) = (tone::develop(a, exposure), tone::develop(b, exposure));
    let square = |(a, b): (&Vec3, &Vec3)| f64::from((*a - *b).length_squared()) / 3.0;
    let mean = a.iter().zip(&b).map(square).sum::<f64>() / a.len() as f64;
    -10.0 * mean.log10()
}

fn scene_of(name: &str) -> Option<Scene> {
    if name == "hall" {
        return Some(Scene::hall());
    }
    let folder = std::env::var_os("DAPPLE_SCENES")?;
    Scene::load(&Path::new(&folder).join(name).with_extension("glb")).ok()
}

struct Case {
    name: &'static str,
    dims: [u16; 3],
    exposure: f32,
    sky: Sky,
    /// Eye and target instead of the scene's camera.
    from: Option<[Vec3; 2]>,
}

/// A picture of all light by an interpolation, beside its parts.
fn draw(
    case: &Case,
    scene: &Scene,
    pose: &Pose,
    (width, height): (u32, u32),
    samples: u32,
    pictures: Option<&PathBuf>,
) -> [f64; 3] {
    let camera = match case.from {
        Some([eye, target]) => dapple::scene::camera::look_at(eye, target, 0.9),
        None => scene.camera(pose, "").unwrap(),
    };
    let tracer = Tracer::new(scene, pose);
    let paths = PathTracer::new(scene, pose, &tracer, case.sky);
    let clock = std::time::Instant::now();
    let probes = Probes::trace(&paths, scene.bounds(pose).unwrap(), case.dims, 1024);
    println!(
        "{}: {} of {} probes present, traced in {:.1?}",
        case.name,
        probes.present.iter().filter(|p| **p).count(),
        probes.present.len(),
        clock.elapsed()
    );
    let volumes = [probes.volume()];
    let mut renderer = Renderer::new(scene, Backend::Auto).unwrap();
    let buffer = renderer
        .gbuffer(pose, Lookup::Rest, &camera, width, height)
        .unwrap();
    let expected = reference(&paths, &camera, &buffer, samples);
    let traced = direct(&paths, &camera, &buffer);
    let save = |name: &str, light: &[Vec3]| {
        let Some(folder) = pictures else { return };
        let shown = tone::develop(light, case.exposure);
        let path = folder.join(format!("{}_{name}.png", case.name));
        Picture::from_linear(width, height, &shown)
            .write_png(&path)
            .unwrap();
    };
    let mut lit = |source: &Source| -> Lit {
        let (lit, timings) = renderer
            .lit(&buffer, pose, &camera, &case.sky, source, 2048)
            .unwrap();
        println!("{timings:?}");
        lit
    };
    let mut psnrs = [0.0; 3];
    let none = lit(&Source::None);
    save("direct", &none.radiance());
    let sharp = psnr(&none.direct, &traced, case.exposure);
    println!("{}: direct PSNR {sharp:.1}", case.name);
    save("reference_direct", &traced);
    psnrs[2] = psnr(&none.indirect(), &expected, case.exposure);
    for (i, interpolation) in [Interpolation::VisibilityWeighted, Interpolation::Trilinear]
        .into_iter()
        .enumerate()
    {
        let lit = lit(&Source::Probes {
            volumes: &volumes,
            interpolation,
            occlusion: None,
        });
        let name = format!("{interpolation:?}").to_lowercase();
        save(&name, &lit.radiance());
        save(&format!("{name}_diffuse"), &lit.diffuse);
        save(&format!("{name}_glossy"), &lit.glossy);
        let mean = |light: &[Vec3]| light.iter().sum::<Vec3>().element_sum();
        let share = mean(&lit.indirect()) / mean(&expected);
        println!(
            "{}: {share:.3} of the reference's indirect light",
            case.name
        );
        psnrs[i] = psnr(&lit.indirect(), &expected, case.exposure);
    }
    let all = (0..expected.len()).map(|i| expected[i] + traced[i] + none.emitted[i]);
    save("reference", &all.collect::<Vec<_>>());
    save("reference_indirect", &expected);
    println!(
        "{}: indirect PSNR visibility-weighted, trilinear, none {psnrs:.1?}",
        case.name
    );
    psnrs
}

/// In the built-in scene the probes explain most of the indirect light, on whatever machine draws.
#[test]
fn probes_explain_most_of_indirect_light() {
    let case = Case {
        name: "hall",
        dims: [10, 5, 10],
        exposure: 1.0,
        sky: Sky::uniform(Vec3::new(0.6, 0.7, 0.9)),
        from: None,
    };
    let scene = scene_of("hall").unwrap();
    let pose = scene.pose(0.0);
    let [visibility_weighted, trilinear, none] = draw(&case, &scene, &pose, (80, 45), 64, None);
    assert!(visibility_weighted > none + 6.0 && trilinear > none + 6.0);
}

/// Writes pictures of several scenes to the folder DAPPLE_PICTURES.
#[test]
#[ignore = "writes pictures"]
fn pictures() {
    let folder = PathBuf::from(std::env::var_os("DAPPLE_PICTURES").expect("DAPPLE_PICTURES"));
    let only = std::env::var("DAPPLE_PICTURE").ok();
    let blue = Sky {
        up: Vec3::new(0.5, 0.75, 1.1),
        down: Vec3::splat(0.3),
    };
    let case = |name, dims, exposure, sky| Case {
        name,
        dims,
        exposure,
        sky,
        from: None,
    };
    for case in [
        case("hall", [12, 6, 12], 1.0, blue),
        case("cornell_original", [6, 6, 6], 1.0, Sky::default()),
        case("sibenik_lit", [16, 8, 8], 0.25, Sky::default()),
        case("sponza_boulders", [16, 8, 8], 2.0, blue),
    ] {
        if only.as_ref().is_some_and(|name| name != case.name) {
            continue;
        }
        let Some(scene) = scene_of(case.name) else {
            continue;
        };
        let pose = scene.pose(0.0);
        draw(&case, &scene, &pose, (480, 270), 32, Some(&folder));
    }
}
