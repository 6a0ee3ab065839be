//! The `probes` model from the volume to the surface: light gathered at probes by rays, looked up
//! between them, against the same light gathered at the surface itself.
use dapple::codec::{Compression, Decoder, Event, Limits, TickRate};
use dapple::models::ModelOptions;
use dapple::probes::lattice::Lattice;
use dapple::probes::sample::{Field, trilinear, visibility_weighted};
use dapple::probes::server::{Draw, Hysteresis, IncomingRadiance, Nearest, Options, Server};
use dapple::probes::sh::{self, L2};
use dapple::probes::source::Request;
use dapple::probes::volume::Volume;
use dapple::rng::Rng;
use dapple::scene::{Pose, Scene, Surface};
use dapple::stream::{Job, Stream, View};
use dapple::trace::offset::offset_origin;
use dapple::trace::{Ray, Tracer};
use glam::{IVec3, Vec3};
use std::f32::consts::PI;

const SUN: Vec3 = Vec3::new(0.3, 0.9, 0.32);
const SKY: f32 = 0.8;

/// A scene under a sun and a grey sky, one reflection deep.
struct World<'s> {
    scene: &'s Scene,
    pose: Pose,
    tracer: Tracer<'s>,
}

impl<'s> World<'s> {
    fn new(scene: &'s Scene) -> Self {
        let pose = scene.pose(0.0);
        let tracer = Tracer::new(scene, &pose);
        World {
            scene,
            pose,
            tracer,
        }
    }

    fn first(&self, origin: Vec3, direction: Vec3) -> Option<(Surface, f32)> {
        let ray = Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
        };
        let hit = self.tracer.closest(&ray)?;
        let (instance, triangle) = (hit.instance as usize, hit.triangle as usize);
        let at = self
            .scene
            .surface(&self.pose, instance, triangle, hit.u, hit.v);
        Some((at, hit.t))
    }

    fn nearest(&self, origin: Vec3, direction: Vec3) -> Nearest {
        let met = self.first(origin, direction);
        let back = |at: &Surface| {
            let single = !self.scene.materials[at.material].double_sided;
            single && at.geometric_normal.dot(direction) > 0.0
        };
        Nearest {
            distance: met.as_ref().map_or(f32::INFINITY, |(_, t)| *t),
            back_face: met.is_some_and(|(at, _)| back(&at)),
        }
    }

    /// Light along a ray; backs of single-sided surfaces let it through.
    fn arrive(&self, origin: Vec3, direction: Vec3) -> IncomingRadiance {
        let mut from = origin;
        let mut back_face = false;
        for _ in 0..16 {
            let Some((at, t)) = self.first(from, direction) else {
                break;
            };
            let back = at.geometric_normal.dot(direction) > 0.0;
            let at = at.facing(direction);
            if back && !self.scene.materials[at.material].double_sided {
                back_face = true;
                from = offset_origin(at.position, direction, self.tracer.reach());
                continue;
            }
            let n = at.normal;
            let start = offset_origin(at.position, at.geometric_normal, self.tracer.reach());
            let shadow = Ray {
                origin: start,
                direction: SUN.normalize(),
                t_max: f32::INFINITY,
            };
            let sun = if self.tracer.occluded(&shadow) {
                0.0
            } else {
                4.0
            };
            let light = sun * n.dot(SUN.normalize()).max(0.0) / PI + 0.15;
            return IncomingRadiance {
                radiance: at.base_color * light + at.emissive,
                distance: (from - origin).length() + t,
                back_face,
            };
        }
        IncomingRadiance {
            radiance: Vec3::splat(SKY),
            distance: f32::INFINITY,
            back_face,
        }
    }

    /// Irradiance at a surface by cosine-distributed rays.
    fn irradiance(&self, at: &Surface, rays: usize, rng: &mut Rng) -> Vec3 {
        let start = offset_origin(at.position, at.geometric_normal, self.tracer.reach());
        let mut sum = Vec3::ZERO;
        for _ in 0..rays {
            let (z, turn) = (rng.unit() * 2.0 - 1.0, rng.unit() * 2.0 * PI);
            let ball = Vec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
            let direction = (at.normal + ball).normalize_or(at.normal);
            if direction.dot(at.geometric_normal) > 0.0 {
                sum += self.arrive(start, direction).radiance;
            }
        }
        sum * (PI / rays as f32)
    }

    /// Surfaces that cameras see, and the directions to the viewer.
    fn seen(&self, count: usize, rng: &mut Rng) -> Vec<(Surface, Vec3)> {
        let camera = match self.pose.cameras.first() {
            Some(camera) => *camera,
            None => self.scene.framing_camera(&self.pose),
        };
        let mut found = Vec::new();
        for _ in 0..20 * count {
            let direction = camera.ray(rng.unit(), rng.unit(), 1, 1);
            if let Some((at, _)) = self.first(camera.eye(), direction) {
                found.push((at.facing(direction), -direction));
            }
            if found.len() == count {
                break;
            }
        }
        found
    }
}

/// Absent probes get the mean of their neighbours that are one step nearer to a present one, as the
/// format's decoder does.
fn fill(lattice: &Lattice, present: &[bool], radiance: &mut [L2]) {
    let mut done = present.to_vec();
    while done.contains(&true) && done.contains(&false) {
        let before = done.clone();
        for probe in (0..lattice.count()).filter(|p| !before[*p]) {
            let at = lattice.place(probe).as_ivec3();
            let near: Vec<usize> = IVec3::AXES
                .iter()
                .flat_map(|axis| [at + *axis, at - *axis])
                .filter(|n| n.cmpge(IVec3::ZERO).all())
                .filter(|n| n.cmplt(IVec3::from(lattice.dims.map(i32::from))).all())
                .map(|n| lattice.index(n.as_uvec3()))
                .filter(|n| before[*n])
                .collect();
            if !near.is_empty() {
                let share = 1.0 / near.len() as f32;
                radiance[probe] =
                    std::array::from_fn(|i| near.iter().map(|n| radiance[*n][i] * share).sum());
                done[probe] = true;
            }
        }
    }
}

struct Measured {
    present: usize,
    /// Relative rms errors of irradiance.
    trilinear: f64,
    visibility_weighted: f64,
    leaks: usize,
}

fn measure(scene: &Scene, dims: [u16; 3], frames: usize, points: usize) -> Measured {
    let world = World::new(scene);
    let volume = Volume::fit(scene, &world.pose, &world.tracer, dims).expect("a volume");
    let options = Options {
        hysteresis: Hysteresis::Adaptive(0.99),
        visibility: 16,
        ..Options::default()
    };
    let mut server = Server::new(volume, options).expect("a server");
    server.measure_geometry(|origin, direction| world.nearest(origin, direction));
    let mut tick = Default::default();
    for _ in 0..frames {
        tick = server.update(|origin, direction, _: Draw| world.arrive(origin, direction));
    }
    println!("{}: {volume:?}\n{tick:?}", scene.name);
    let count = volume.lattice.count();
    let mut radiance: Vec<L2> = (0..count).map(|p| server.l2(p)).collect();
    let present: Vec<bool> = (0..count).map(|p| server.is_present(p)).collect();
    fill(&volume.lattice, &present, &mut radiance);
    let field = Field {
        lattice: volume.lattice,
        radiance: &radiance,
        present: &present,
        visibility: server.visibility(),
    };
    let mut rng = Rng::new(5);
    let (mut truth, mut errors, mut leaks) = (0.0f64, [0.0f64; 2], 0);
    for (at, v) in world.seen(points, &mut rng) {
        let exact = world.irradiance(&at, 512, &mut rng);
        let x = volume.to_grid(at.position);
        truth += f64::from(exact.length_squared());
        let lights = [
            trilinear(&field, x),
            visibility_weighted(&field, x, at.normal, v),
        ];
        for (error, light) in errors.iter_mut().zip(lights) {
            let got = sh::irradiance(&light, at.normal).max(Vec3::ZERO);
            *error += f64::from((got - exact).length_squared());
            leaks += usize::from(got.max_element() > 4.0 * exact.max_element());
        }
    }
    let [trilinear, visibility_weighted] = errors.map(|e| (e / truth).sqrt());
    let present = tick.present;
    let measured = Measured {
        present,
        trilinear,
        visibility_weighted,
        leaks,
    };
    println!(
        "{present} of {count} probes; irradiance off by {trilinear:.3} trilinear, {visibility_weighted:.3} visibility-weighted"
    );
    measured
}

#[test]
fn light_between_probes_is_near_the_light_at_the_surface() {
    let hall = Scene::hall();
    let measured = measure(&hall, [12, 5, 12], 8, 300);
    assert!(measured.present > 500);
    assert!(
        measured.visibility_weighted < 0.25,
        "{}",
        measured.visibility_weighted
    );
    assert!(measured.visibility_weighted <= measured.trilinear);
    assert!(measured.leaks < 60, "{}", measured.leaks);
}

/// A client that starts at any keyframe has light and visibility block together, however few frames the
/// server has run, and no later frame takes the block away.
#[test]
fn every_frame_has_its_visibility_block() {
    let scene = Scene::hall();
    let pose = scene.pose(0.0);
    let request = Request {
        dims: [3, 2, 3],
        server: Options {
            samples: 4,
            ..Options::default()
        },
        warm_up: 0,
        ..Request::default()
    };
    for (frames, keyframe_interval) in [(1, 0), (5, 2)] {
        let job = Job {
            models: vec![ModelOptions::Probes(request)],
            view: View::Fixed(scene.framing_camera(&pose)),
            frames,
            rate: TickRate::default(),
            start: 0.0,
            keyframe_interval,
            compression: Compression::None,
            limits: Limits::default(),
        };
        let mut bytes = Vec::new();
        let mut stream = Stream::start(&scene, job, &mut bytes, &mut |_, _| {}).expect("a stream");
        while stream.next_frame(&mut bytes).expect("a frame").is_some() {}
        let report = stream.finish(&mut bytes).expect("a report");
        let probes = report.models.probes.expect("of probes");
        assert!(probes.bytes_first > 0);
        // Coded, in fewer bytes than the maps have.
        assert!((1..18 * 2 * 256).contains(&probes.bytes_visibility));

        let mut decoder = Decoder::new(Limits::default());
        let (mut rest, mut shown, mut first) = (&bytes[..], 0, Vec::new());
        loop {
            let (used, event) = decoder.push(rest).expect("a valid stream");
            rest = &rest[used..];
            match event {
                Event::End | Event::NeedInput => break,
                Event::Frame(_) => {
                    let live = decoder.tracks().first().expect("a track");
                    let block = decoder.probes().visibility_of(live).expect("a block");
                    if shown == 0 {
                        first = block.to_vec();
                    }
                    assert!(block == first, "frame {shown}");
                    shown += 1;
                }
                _ => {}
            }
        }
        assert_eq!(shown, frames);
    }
}

/// Fits, presence and errors of the scenes that are measured elsewhere.
#[test]
#[ignore = "minutes; needs DAPPLE_SCENES"]
fn survey_of_scenes() {
    let folder = std::env::var("DAPPLE_SCENES").expect("DAPPLE_SCENES");
    for (name, dims) in [
        ("sponza_boulders", [16, 8, 8]),
        ("sibenik_lit", [16, 8, 4]),
        ("cornell_original", [4, 4, 4]),
    ] {
        let path = std::path::Path::new(&folder).join(format!("{name}.glb"));
        let scene = Scene::load(&path).expect("a scene");
        measure(&scene, dims, 20, 400);
    }
}
