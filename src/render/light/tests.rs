use super::device::LightPass;
use super::*;
use crate::render::gbuffer::{Lookup, Visibility};
use crate::render::gpu;
use crate::render::probes::tests::MadeUp;
use crate::render::raster::Raster;
use crate::render::shadow::device::{ShadowPass, read};
use crate::render::shadow::tests::lamps;
use crate::render::shadow::{Plan, trace};
use crate::render::tests::eye;
use crate::render::{Backend, Renderer, path};
use crate::scene::camera::look_at;
use crate::scene::{LightKind, Scene};
use crate::trace::Tracer;
use crate::trace::path::tests::{quad, scene as plain};
use glam::{Affine3A, Quat};

/// The lamps' scene with every kind of material.
fn materials() -> (Scene, Pose) {
    let (mut scene, pose) = lamps();
    let kinds = [(0.7, 0.0), (0.25, 0.0), (0.4, 1.0), (0.02, 0.5)];
    for (material, (roughness, metallic)) in scene.materials.iter_mut().zip(kinds) {
        (material.roughness, material.metallic) = (roughness, metallic);
    }
    scene.materials[1].base_color = glam::Vec4::new(0.8, 0.5, 0.2, 1.0);
    scene.materials[1].emissive = Vec3::new(0.0, 0.1, 0.3);
    (scene, pose)
}

fn picture(scene: &Scene, pose: &Pose) -> (GBuffer, View, Vec3) {
    let view = View::new(&eye(), 96, 54);
    let tracer = Tracer::new(scene, pose);
    let seen = Visibility::trace(scene, pose, &tracer, &view);
    let gbuffer = GBuffer::resolve(scene, pose, Lookup::Rest, &view, &seen);
    (gbuffer, view, eye().eye())
}

/// Two volumes that do not cover the scene, the second turned and of one layer.
fn volumes() -> [MadeUp; 2] {
    let turn = Quat::from_axis_angle(Vec3::new(0.2, 1.0, -0.4).normalize(), 0.6);
    let first = Affine3A::from_translation(Vec3::new(3.0, -0.1, 2.0));
    let second = Affine3A::from_rotation_translation(turn, Vec3::new(-0.2, 0.3, 2.5));
    [
        MadeUp::new(3, [4, 3, 5], Vec3::new(0.9, 0.7, 1.1), first),
        MadeUp::new(8, [3, 1, 4], Vec3::new(0.8, 0.8, 0.7), second),
    ]
}

/// The device's lookups on its own maps are the twin's on the same maps.
#[test]
fn device_and_cpu_light_alike_by_the_same_maps() {
    let Some(gpu) = gpu::for_test() else { return };
    let (scene, pose) = materials();
    let (gbuffer, view, eye) = picture(&scene, &pose);
    let raster = Raster::new(&gpu, &scene, &pose).unwrap();
    let plan = Plan::new(&pose, scene.bounds(&pose).unwrap(), 256);
    let mut shadows = ShadowPass::new(&gpu).unwrap();
    let maps = shadows.draw(&gpu, &raster, &pose, &plan).unwrap();
    let pass = LightPass::new(&gpu).unwrap();
    let pixels = pixels(&gbuffer, &Source::None);
    let question = device::View {
        pixels: &pixels,
        width: view.width,
        eye,
    };
    let mut timings = Timings::default();
    let (on_gpu, dark) = pass
        .light(
            &gpu,
            &question,
            &pose.lights,
            (&plan, maps),
            &Source::None,
            &mut timings,
        )
        .unwrap();
    assert!(dark.iter().all(|i| *i == Indirect::default()));
    let maps = Maps {
        depths: read(&gpu, maps).unwrap(),
        plan,
    };
    let on_cpu: Vec<Vec3> = pixels
        .iter()
        .map(|p| direct(p, eye, &pose.lights, &maps))
        .collect();
    let mut strays = 0;
    let (mut lit, mut partly) = (0, 0);
    for ((a, b), p) in on_gpu.iter().zip(&on_cpu).zip(&pixels) {
        lit += usize::from(*b != Vec3::ZERO);
        if p.volume != SKY {
            let open = maps.lit(0, p.position.into(), p.geometric_normal.into());
            partly += usize::from(open > 0.0 && open < 1.0);
        }
        // One comparison in rounding's reach of its texel counts on one side only.
        strays += usize::from((*a - *b).abs().max_element() > 2e-4 * (0.1 + b.max_element()));
    }
    assert!(lit > 2000 && partly > 20, "{lit}, {partly}");
    println!("{strays} of {} pixels stray", pixels.len());
    assert!(strays <= 5, "{strays} of {}", pixels.len());
}

/// The least and the most light of a pixel by places of which each coordinate is off by a 256th of a
/// spacing: what a texture unit may find whose fractions have eight bits, which is what devices
/// have. Between the corners light is multilinear.
fn within_a_subtexel(
    pixel: &Pixel,
    eye: Vec3,
    volumes: &[ProbesVolume],
    fields: &[Field],
) -> (Indirect, Indirect) {
    let volume = &volumes[pixel.volume as usize];
    let mut low = indirect(pixel, eye, volumes, fields, Interpolation::Trilinear);
    let mut high = low;
    for corner in 0..8 {
        let side = Vec3::from([0, 1, 2].map(|axis| (corner >> axis & 1) as f32 * 2.0 - 1.0));
        let shift = volume
            .grid_from_world
            .inverse()
            .transform_vector3(side * volume.lattice.spacing / 256.0);
        let mut moved = *pixel;
        moved.position = (Vec3::from(pixel.position) + shift).to_array();
        let light = indirect(
            &moved,
            eye + shift,
            volumes,
            fields,
            Interpolation::Trilinear,
        );
        low.diffuse = low.diffuse.min(light.diffuse);
        low.glossy = low.glossy.min(light.glossy);
        high.diffuse = high.diffuse.max(light.diffuse);
        high.glossy = high.glossy.max(light.glossy);
    }
    (low, high)
}

/// Indirect light on both machines. The interpolation from buffers is the same arithmetic; that of
/// the texture unit may round fractions.
#[test]
fn device_and_cpu_interpolate_alike() {
    let Some(gpu) = gpu::for_test() else { return };
    let (scene, pose) = materials();
    let (gbuffer, view, eye) = picture(&scene, &pose);
    let made = volumes();
    let pass = LightPass::new(&gpu).unwrap();
    let raster = Raster::new(&gpu, &scene, &pose).unwrap();
    let dark = Pose {
        lights: Vec::new(),
        ..pose.clone()
    };
    let plan = Plan::new(&dark, scene.bounds(&dark).unwrap(), 64);
    let mut shadows = ShadowPass::new(&gpu).unwrap();
    let maps = shadows.draw(&gpu, &raster, &dark, &plan).unwrap();
    let mut lights: Vec<Vec<Vec3>> = Vec::new();
    for (interpolation, visible) in [
        (Interpolation::Trilinear, false),
        (Interpolation::VisibilityWeighted, false),
        (Interpolation::VisibilityWeighted, true),
    ] {
        let volumes = made.each_ref().map(|m| m.volume(visible));
        let ao: Vec<f32> = (0..gbuffer.fragments.len())
            .map(|i| 0.5 + (i % 7) as f32 / 12.0)
            .collect();
        let source = Source::Probes {
            volumes: &volumes,
            interpolation,
            occlusion: Some(Occlusion {
                ao: &ao,
                strength: 0.75,
            }),
        };
        let pixels = pixels(&gbuffer, &source);
        for number in [0, 1, SKY] {
            assert!(pixels.iter().filter(|p| p.volume == number).count() > 100);
        }
        let question = device::View {
            pixels: &pixels,
            width: view.width,
            eye,
        };
        let mut timings = Timings::default();
        let (direct, on_gpu) = pass
            .light(&gpu, &question, &[], (&plan, maps), &source, &mut timings)
            .unwrap();
        assert!(direct.iter().all(|d| *d == Vec3::ZERO));
        let empty = Maps {
            plan: plan.clone(),
            depths: Vec::new(),
        };
        let (_, on_cpu) = on_cpu(&pixels, eye, &dark, &empty, &source, &mut timings);
        let fields: Vec<_> = volumes.iter().map(ProbesVolume::field).collect();
        // A block's share falls by powers beyond the mean distance, and rounding with it.
        let rounding = if visible { 2e-4 } else { 1e-5 };
        let mut farthest = 0.0f32;
        for ((a, b), pixel) in on_gpu.iter().zip(&on_cpu).zip(&pixels) {
            if pixel.volume == SKY {
                assert_eq!(a, b);
                continue;
            }
            let (low, high) = match interpolation {
                Interpolation::Trilinear => within_a_subtexel(pixel, eye, &volumes, &fields),
                Interpolation::VisibilityWeighted => (*b, *b),
            };
            for (a, low, high) in [
                (a.diffuse, low.diffuse, high.diffuse),
                (a.glossy, low.glossy, high.glossy),
            ] {
                let within = a.cmpge(low - rounding).all() && a.cmple(high + rounding).all();
                assert!(
                    within,
                    "{interpolation:?}, {visible}: {a} beyond {low} to {high}, {pixel:?}"
                );
            }
            let off = (a.diffuse - b.diffuse)
                .abs()
                .max((a.glossy - b.glossy).abs());
            farthest = farthest.max(off.max_element());
        }
        println!("{interpolation:?}, visibility {visible}: {farthest:.2e}");
        let lit = on_cpu
            .iter()
            .filter(|l| l.diffuse.max_element() > 0.05)
            .count();
        let shine = on_cpu
            .iter()
            .filter(|l| l.glossy.max_element() > 0.05)
            .count();
        assert!(lit > 1000 && shine > 500, "{lit}, {shine}");
        // Each of the three is another light, pixel by pixel: sums of all pixels can be alike.
        let light: Vec<Vec3> = on_cpu.iter().map(|l| l.diffuse + l.glossy).collect();
        let total = |light: &[Vec3]| light.iter().map(|l| l.length()).sum::<f32>();
        for other in &lights {
            let differences: Vec<Vec3> = light.iter().zip(other).map(|(a, b)| *a - *b).collect();
            let share = total(&differences) / total(&light);
            assert!(share > 1e-3, "{interpolation:?}, {visible}: {share}");
        }
        lights.push(light);
    }
}

/// The whole way on both machines, by their own maps and G-buffers.
#[test]
fn both_machines_light_the_same_picture() {
    if gpu::for_test().is_none() {
        return;
    }
    let (scene, lamps) = materials();
    // As the scene says by itself: what deforms is known from its rest pose.
    let pose = Pose {
        lights: lamps.lights,
        ..scene.pose(0.0)
    };
    let made = volumes();
    let volumes = made.each_ref().map(|m| m.volume(true));
    let source = Source::Probes {
        volumes: &volumes,
        interpolation: Interpolation::VisibilityWeighted,
        occlusion: None,
    };
    let sky = Sky {
        up: Vec3::new(0.1, 0.2, 0.4),
        down: Vec3::splat(0.05),
    };
    let draw = |backend| {
        let mut renderer = Renderer::new(&scene, backend).unwrap();
        let gbuffer = renderer
            .gbuffer(&pose, Lookup::Rest, &eye(), 96, 54)
            .unwrap();
        renderer
            .lit(&gbuffer, &pose, &eye(), &sky, &source, 512)
            .unwrap()
            .0
    };
    let (a, b) = (draw(Backend::Gpu), draw(Backend::Cpu));
    for (part, a, b) in [
        ("direct", &a.direct, &b.direct),
        ("diffuse", &a.diffuse, &b.diffuse),
        ("glossy", &a.glossy, &b.glossy),
        ("emitted", &a.emitted, &b.emitted),
        ("all", &a.radiance(), &b.radiance()),
    ] {
        let pairs = || a.iter().zip(b);
        let far = pairs()
            .filter(|(a, b)| (**a - **b).abs().max_element() > 5e-3 * (0.2 + b.max_element()));
        let far = far.count();
        assert!(
            far * 100 < 2 * a.len(),
            "{part}: {far} of {} differ",
            a.len()
        );
        assert!(
            b.iter().filter(|b| **b != Vec3::ZERO).count() > 500,
            "{part}"
        );
    }
}

/// Supplied light passes as it is; what does not fit is an error.
#[test]
fn light_of_another_method_is_taken_as_it_is() {
    let (scene, pose) = materials();
    let mut renderer = Renderer::new(&scene, Backend::Cpu).unwrap();
    let gbuffer = renderer
        .gbuffer(&pose, Lookup::Rest, &eye(), 32, 18)
        .unwrap();
    let sky = Sky::default();
    let light: Vec<Indirect> = (0..32 * 18)
        .map(|i| Indirect {
            diffuse: Vec3::splat(i as f32),
            glossy: Vec3::X * i as f32,
        })
        .collect();
    let mut lit = |source: &Source| renderer.lit(&gbuffer, &pose, &eye(), &sky, source, 64);
    let (with, _) = lit(&Source::Supplied(&light)).unwrap();
    assert!((0..light.len()).all(|i| with.diffuse[i] == light[i].diffuse));
    assert_eq!(with.indirect()[9], Vec3::new(18.0, 9.0, 9.0));
    let (without, _) = lit(&Source::None).unwrap();
    assert_eq!(without.direct, with.direct);
    assert!(without.indirect().iter().all(|l| *l == Vec3::ZERO));
    let error = lit(&Source::Supplied(&light[1..])).unwrap_err();
    assert!(error.to_string().contains("575 pixels"), "{error}");
}

/// Direct light is the path tracer's wherever the map's edge is not near.
#[test]
fn direct_light_is_the_path_tracers() {
    use crate::trace::path::PathTracer;
    let (scene, pose) = materials();
    let (gbuffer, view, eye) = picture(&scene, &pose);
    let tracer = Tracer::new(&scene, &pose);
    let paths = PathTracer::new(&scene, &pose, &tracer, Sky::default());
    let plan = Plan::new(&pose, scene.bounds(&pose).unwrap(), 1024);
    let maps = trace(plan, &tracer);
    let pixels = pixels(&gbuffer, &Source::None);
    let (mut lit, mut off) = (0, 0);
    for (i, pixel) in pixels.iter().enumerate() {
        let direction = view.direction(i as u32 % 96, i as u32 / 96);
        let (Some(vertex), _) = paths.first(eye, direction, true) else {
            assert_eq!(pixel.volume, SKY);
            continue;
        };
        let expected = paths.direct(&vertex);
        let got = direct(pixel, eye, &pose.lights, &maps);
        lit += usize::from(expected != Vec3::ZERO);
        off += usize::from(
            (got - expected).abs().max_element() > 1e-2 * (0.05 + expected.max_element()),
        );
    }
    println!("{off} of {lit} lit pixels differ");
    assert!(lit > 2000 && off * 100 < 8 * lit, "{off} of {lit}");
}

#[test]
fn unlit_surfaces_are_shown_as_they_are() {
    let (mut scene, pose) = lamps();
    scene.materials[0].unlit = true;
    scene.materials[0].base_color = glam::Vec4::new(0.3, 0.2, 0.1, 1.0);
    for backend in [Backend::Cpu, Backend::Auto] {
        let mut renderer = Renderer::new(&scene, backend).unwrap();
        let gbuffer = renderer
            .gbuffer(&pose, Lookup::Rest, &eye(), 48, 27)
            .unwrap();
        let sky = Sky::default();
        let lit = renderer.lit(&gbuffer, &pose, &eye(), &sky, &Source::None, 64);
        let radiance = lit.unwrap().0.radiance();
        let mut shown = 0;
        for (fragment, light) in gbuffer.fragments.iter().zip(radiance) {
            if fragment.unlit {
                assert_eq!(light, Vec3::new(0.3, 0.2, 0.1));
                shown += 1;
            }
        }
        assert!(shown > 50, "{shown}");
    }
}

#[test]
fn direct_light_has_the_tint_of_windows() {
    let material = |color: Vec3, transmission: f32| crate::scene::Material {
        base_color: color.extend(1.0),
        metallic: 0.0,
        transmission,
        window: transmission >= 0.5,
        ..Default::default()
    };
    for transmission in [0.8, 0.3] {
        let floor = quad(Vec3::ZERO, Vec3::Z * 4.0, Vec3::X * 4.0, 0);
        let pane = quad(Vec3::Y * 2.0, Vec3::Z * 9.0, Vec3::X * 9.0, 1);
        let tint = Vec3::new(1.0, 0.5, 0.25);
        let materials = vec![
            material(Vec3::splat(0.5), 0.0),
            material(tint, transmission),
        ];
        let scene = plain(vec![floor, pane], materials);
        let mut pose = scene.rest_pose();
        pose.lights = vec![LightPose {
            position: Vec3::new(0.3, 3.0, 0.2),
            direction: Vec3::NEG_Y,
            kind: LightKind::Point,
            intensity: Vec3::splat(9.0),
            range: f32::INFINITY,
        }];
        let camera = look_at(Vec3::new(0.1, 1.0, 1.5), Vec3::ZERO, 0.8);
        let tracer = Tracer::new(&scene, &pose);
        let paths = PathTracer::new(&scene, &pose, &tracer, Sky::default());
        let expected = path::direct(&paths, &camera, (24, 16), &Default::default(), 1);
        assert!(expected[200].x > 0.02 && expected[200].z < 0.3 * expected[200].x);
        for backend in [Backend::Cpu, Backend::Auto] {
            let mut renderer = Renderer::new(&scene, backend).unwrap();
            let gbuffer = renderer.gbuffer(&pose, Lookup::Rest, &camera, 24, 16);
            let (gbuffer, sky) = (gbuffer.unwrap(), Sky::default());
            let lit = renderer.lit(&gbuffer, &pose, &camera, &sky, &Source::None, 256);
            for (light, expected) in lit.unwrap().0.direct.iter().zip(&expected) {
                assert!(light.abs_diff_eq(*expected, 1e-3), "{light} {expected}");
            }
        }
    }
}
