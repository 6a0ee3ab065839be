//! Light over time: lag after a change, flicker without one.

use super::fixture::{self, WARM_UP};
use super::panels::{self, ramp};
use super::places::{self, DIRECTIONS, grey, spread};
use super::scene_builder::SceneBuilder;
use super::{Bound, Case, Effort, Finding, Shot};
use crate::Result;
use crate::codec::probes::{Probe, f32_from_f16};
use crate::codec::{Compression, Encoder, EncoderConfig, GroupStart};
use crate::models::Source as _;
use crate::probes::sample::Field;
use crate::probes::server::{Hysteresis, IncomingRadiance, Options, Server};
use crate::probes::sh::{self, L2};
use crate::probes::source::{self, Packing, Request, Source};
use crate::probes::volume::Volume;
use crate::scene::camera::look_at;
use crate::trace::Aabb;
use crate::trace::path::{PathTracer, Sky};
use crate::world::World;
use glam::Vec3;

pub const LAG: Case = Case {
    name: "lag",
    about: "A lamp in a closed room is switched off (or dimmed, or fades) at once; what is left of \
            the old light in the probes, as a share of the change; for a fade, beyond what the lamp itself \
            still gives. The ghost is what is left after 30 frames.",
    parameter: "hysteresis",
    beyond: "A fixed hysteresis a takes ln 0.01 / ln a frames to a hundredth, whatever the scene. The \
             adaptive one starts over once two frames differ from the mean by twice their noise: a \
             change below that, or one slower than the noise, comes with the lag of the fixed one.",
    run: lag,
};

pub const FLICKER: Case = Case {
    name: "flicker",
    about: "A still room under a square lamp of 0.5 m that rays find by chance: rms difference of \
            irradiance between frames over the mean irradiance, of the server's probes and of what a \
            client decodes; and the bytes that this noise costs in `packed` with tolerance 0.004, less the \
            60 of a record that no probe has.",
    parameter: "rays, hysteresis",
    beyond: "Noise falls with the root of the rays and of what hysteresis leaves out. Below the \
             tolerance of the coding it is hardly sent; above, each frame brings steps as large as the \
             tolerance, and the stream grows towards that of a scene whose light moves everywhere. A \
             lamp that few rays find looks like a change of the light when two frames find it: then \
             the adaptive hysteresis drops a history that was right, and the probe jumps.",
    run: flicker,
};

/// Frames after which the ghost is measured.
const GHOST: usize = 30;
/// Frames in which the adaptive hysteresis is to be rid of all but a hundredth of a light that went
/// out: two until it is sure, whose mean is the new light, and one that came before them.
const ADAPTIVE_FRAMES: f64 = 4.0;
/// Flicker of clients at the default of 256 rays and 0.99, as a share of the mean.
const FLICKER_MOST: f64 = 0.01;

const DIMS: [u16; 3] = [4, 3, 4];
const BOUNDS: Aabb = Aabb {
    min: Vec3::new(-1.6, -1.1, -1.6),
    max: Vec3::new(1.6, 1.1, 1.6),
};

fn room() -> SceneBuilder {
    let mut builder = SceneBuilder::new("room", 0.6);
    builder.room(Vec3::new(-2.0, -1.5, -2.0), Vec3::new(2.0, 1.5, 2.0));
    builder
}

/// The lamp's intensity over its intensity before the change, by frames since then.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    To(f32),
    /// Goes out evenly within so many frames.
    Fade(u32),
}

impl Change {
    fn at(self, frame: usize) -> f32 {
        match self {
            Change::To(share) => share,
            Change::Fade(frames) => (1.0 - (frame + 1) as f32 / frames as f32).max(0.0),
        }
    }
}

/// Shares of the whole change that have not come yet, frame by frame: until a hundredth is left, and for
/// [`GHOST`] frames at least. Less than nothing where light is darker than it should be.
fn remains(hysteresis: Hysteresis, change: Change, effort: Effort) -> Result<Vec<f64>> {
    let mut builder = room();
    builder.point(Vec3::new(0.4, 0.9, 0.3), 8.0);
    let scene = builder.build();
    let mut world = World::new(&scene, 0.0);
    let volume = Volume::over(BOUNDS, effort.of([3, 2, 3], DIMS))?;
    let options = Options {
        samples: effort.of(64, 128),
        hysteresis,
        threshold: 0.0,
        visibility: 0,
        ..Options::default()
    };
    let mut server = Server::new(volume, options)?;
    let light = |server: &Server| {
        let all = 0..server.volume().lattice.count();
        all.map(|p| f64::from(grey(server.l2(p)[0]))).sum::<f64>()
    };
    for _ in 0..WARM_UP {
        source::update(&mut server, &world.paths(Sky::default()));
    }
    let before = light(&server);
    let intensity = world.pose().lights[0].intensity;
    let change_of = |share: f64| before * (1.0 - share);
    let whole = change_of(f64::from(change.at(usize::MAX - 1)));
    let ends = match change {
        Change::To(_) => 0,
        Change::Fade(frames) => frames as usize,
    };
    let mut remains: Vec<f64> = Vec::new();
    let goes_on = |remains: &[f64]| {
        let calm = remains.last().is_some_and(|r| *r < 0.01);
        remains.len() < MOST_FRAMES && !(calm && remains.len() >= GHOST.max(ends))
    };
    while goes_on(&remains) {
        let share = change.at(remains.len());
        world.lights_mut()[0].intensity = intensity * share;
        let paths = world.paths(Sky::default());
        if share > 0.0 {
            source::update(&mut server, &paths);
        } else {
            // No light, no paths to follow: rays alone.
            server.update(|origin, direction, _| dark(&paths, origin, direction));
        }
        let come = before - light(&server);
        remains.push((change_of(f64::from(share)) - come) / whole);
    }
    Ok(remains)
}

/// Frames after which a change counts as not come.
const MOST_FRAMES: usize = 3000;

fn dark(paths: &PathTracer, origin: Vec3, direction: Vec3) -> IncomingRadiance {
    let (vertex, back_face) = paths.first(origin, direction, true);
    IncomingRadiance {
        radiance: Vec3::ZERO,
        distance: vertex.map_or(f32::INFINITY, |v| v.distance),
        back_face,
    }
}

fn lag(effort: Effort) -> Result<Finding> {
    let off = Change::To(0.0);
    let settings = [
        (("fixed 0.8", Hysteresis::Fixed(0.8), off), true),
        (("fixed 0.9", Hysteresis::Fixed(0.9), off), false),
        (("fixed 0.95", Hysteresis::Fixed(0.95), off), true),
        (("fixed 0.99", Hysteresis::Fixed(0.99), off), false),
        (("fixed 0.998", Hysteresis::Fixed(0.998), off), false),
        (("adaptive 0.99", Hysteresis::Adaptive(0.99), off), true),
        (("adaptive 0.998", Hysteresis::Adaptive(0.998), off), false),
        (
            (
                "adaptive 0.99, to 0.5",
                Hysteresis::Adaptive(0.99),
                Change::To(0.5),
            ),
            false,
        ),
        (
            (
                "adaptive 0.99, to 0.95",
                Hysteresis::Adaptive(0.99),
                Change::To(0.95),
            ),
            false,
        ),
        (
            (
                "adaptive 0.99, out in 60",
                Hysteresis::Adaptive(0.99),
                Change::Fade(60),
            ),
            false,
        ),
    ];
    let mut finding = Finding::default();
    let mut strips: Vec<Vec<Option<f32>>> = Vec::new();
    for (at, hysteresis, change) in effort.settings(&settings) {
        let remains = remains(hysteresis, change, effort)?;
        // From the frame on that is the farthest behind.
        let most = (0..remains.len()).max_by(|a, b| remains[*a].total_cmp(&remains[*b]));
        let below = |share: f64| {
            let mut later = most.unwrap_or(0)..remains.len();
            let first = later.find(|frame| remains[*frame] < share);
            first.map_or(f64::NAN, |f| (f + 1) as f64)
        };
        finding.add(at, "frames to 10 %", below(0.1));
        // What a mean that forgets by a has to take, and a frame for rounding.
        let bound = match hysteresis {
            Hysteresis::Fixed(a) => Some((0.01f64.ln() / f64::from(a).ln()).ceil() + 1.0),
            Hysteresis::Adaptive(_) if change == off => Some(ADAPTIVE_FRAMES),
            Hysteresis::Adaptive(_) => None,
        };
        match bound {
            Some(b) => finding.bounded(at, "frames to 1 %", below(0.01), Bound::AtMost(b)),
            None => finding.add(at, "frames to 1 %", below(0.01)),
        }
        let left = |frame: usize| remains.get(frame).or(remains.last()).copied();
        finding.add(at, "ghost", left(GHOST - 1).unwrap_or(f64::NAN));
        let strip = (0..80).map(|frame| left(frame).map(|r| r.abs() as f32));
        strips.push(strip.collect());
    }
    let lines: Vec<_> = strips
        .iter()
        .flat_map(|s| std::iter::repeat_n(s, 4))
        .collect();
    let values: Vec<Option<f32>> = lines.into_iter().flatten().copied().collect();
    finding.pictures.push(Shot {
        name: "",
        caption:
            "What is left of the old light over 80 frames from left to right, pale for all of \
                  it, a row a setting in the order of the table."
                .into(),
        picture: panels::enlarged(&ramp(80, &values), 4),
    });
    Ok(finding)
}

/// Bytes of a record of one track that are no probe's: header, payload's head, table.
const RECORD: usize = 32 + 16 + 12;

/// Irradiance of all probes in all directions.
fn irradiances(light: &[L2]) -> Vec<f32> {
    let directions = || (0..DIRECTIONS).map(|i| spread(i, DIRECTIONS));
    let probe = |l| directions().map(move |n| grey(sh::irradiance(l, n)));
    light.iter().flat_map(probe).collect()
}

/// The probes as clients have them.
fn sent(probes: &Source) -> Vec<L2> {
    let volume = probes.volume();
    let scale = 2f32.powi(volume.exponent.into());
    let probe = |probe: &Probe| {
        let values = volume.values(probe).map(|bits| f32_from_f16(bits) * scale);
        std::array::from_fn(|lm| Vec3::from_slice(&values[3 * lm..]))
    };
    probes.sent().iter().map(probe).collect()
}

/// Flicker and bit rate of a scene without change.
struct StillScene {
    server: f64,
    client: f64,
    /// Coded, a probe and frame.
    bytes: f64,
    /// Share of probes and frames whose history was dropped for a change, though nothing changes.
    dropped: f64,
    /// Light as clients have it in the last two frames.
    last: [Vec<L2>; 2],
    volume: Volume,
}

fn measure_still(
    world: &World,
    samples: u32,
    hysteresis: Hysteresis,
    effort: Effort,
) -> Result<StillScene> {
    let request = Request {
        dims: effort.of([3, 2, 3], DIMS),
        bounds: Some(BOUNDS),
        server: Options {
            samples,
            hysteresis,
            visibility: 0,
            ..Options::default()
        },
        warm_up: effort.of(16, 64),
        packing: Packing::packed(0.004),
        sky: Sky::default(),
        ..Request::default()
    };
    let mut probes = fixture::warmed_up(world, &request)?;
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut bytes)?;
    encoder.group(&mut bytes, GroupStart::Keyframes)?;
    encoder.tracks(&mut bytes, &[probes.track()])?;
    probes.write_keyframe(&mut encoder, Compression::None, &mut bytes)?;
    encoder.commit(&mut bytes, 0, None)?;
    let frames = effort.of(12, 32);
    let mut before = [fixture::light(probes.server()), sent(&probes)];
    let mut squares = [0.0; 2];
    let (mut dropped, mut coded) = (0, 0);
    let (mut level, mut last) = (0.0, [Vec::new(), Vec::new()]);
    for frame in 0..frames {
        dropped += probes.update(world).dropped;
        let written = bytes.len();
        probes.write_delta(&mut encoder, Compression::None, &mut bytes)?;
        coded += (bytes.len() - written).saturating_sub(RECORD);
        encoder.commit(&mut bytes, frame + 1, None)?;
        let now = [fixture::light(probes.server()), sent(&probes)];
        for (sum, (now, before)) in squares.iter_mut().zip(now.iter().zip(&before)) {
            let (now, before) = (irradiances(now), irradiances(before));
            let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
            *sum += now.iter().zip(&before).map(square).sum::<f64>() / now.len() as f64;
        }
        level += places::mean(&irradiances(&now[0])) / frames as f64;
        last = [before[1].clone(), now[1].clone()];
        before = now;
    }
    let [server, client] = squares.map(|s| (s / frames as f64).sqrt() / level);
    let all = (frames * before[0].len() as u64) as f64;
    Ok(StillScene {
        server,
        client,
        bytes: coded as f64 / all,
        dropped: dropped as f64 / all,
        last,
        volume: *probes.server().volume(),
    })
}

fn flicker(effort: Effort) -> Result<Finding> {
    let fixed = Hysteresis::Fixed;
    let settings = [
        (("16, fixed 0.99", 16, fixed(0.99)), true),
        (("64, fixed 0.99", 64, fixed(0.99)), true),
        (("256, fixed 0.99", 256, fixed(0.99)), true),
        (("1024, fixed 0.99", 1024, fixed(0.99)), false),
        (("256, fixed 0.8", 256, fixed(0.8)), true),
        (("256, fixed 0.9", 256, fixed(0.9)), false),
        (("256, fixed 0.95", 256, fixed(0.95)), false),
        (("256, fixed 0.998", 256, fixed(0.998)), false),
        (
            ("256, adaptive 0.99", 256, Hysteresis::Adaptive(0.99)),
            false,
        ),
    ];
    let mut builder = room();
    builder.lamp(Vec3::new(0.3, 1.49, 0.2), 0.5, 30.0);
    let scene = builder.build();
    let world = World::new(&scene, 0.0);
    let paths = world.paths(Sky::default());
    let camera = look_at(Vec3::new(-1.8, 0.6, 1.8), Vec3::new(1.0, -0.7, -1.0), 1.1);
    let seen = panels::seen(&paths, &camera);
    let mut finding = Finding::default();
    let mut panels = Vec::new();
    for (at, samples, hysteresis) in effort.settings(&settings) {
        let still = measure_still(&world, samples, hysteresis, effort)?;
        finding.add(at, "flicker, server", still.server);
        let name = "flicker, client";
        match at {
            "256, fixed 0.99" => {
                finding.bounded(at, name, still.client, Bound::AtMost(FLICKER_MOST));
            }
            _ => finding.add(at, name, still.client),
        }
        finding.add(at, "coded bytes a probe and frame", still.bytes);
        finding.add(at, "histories dropped (share)", still.dropped);
        if [
            "16, fixed 0.99",
            "64, fixed 0.99",
            "256, fixed 0.99",
            "256, fixed 0.8",
        ]
        .contains(&at)
        {
            let present = vec![true; still.last[0].len()];
            let look = |light: &[L2]| {
                let field = Field {
                    lattice: still.volume.lattice,
                    radiance: light,
                    present: &present,
                    visibility: None,
                };
                let how = fixture::LookUp::Trilinear;
                panels::values(&seen, |place, view| {
                    fixture::irradiance(&field, &still.volume, how, place, view)
                })
            };
            let [before, now] = [look(&still.last[0]), look(&still.last[1])];
            let values: Vec<f32> = now.iter().flatten().copied().collect();
            let scale = 0.05 * places::mean(&values) as f32;
            panels.push(panels::difference(&now, &before, scale)?);
        }
    }
    finding.pictures.push(Shot {
        name: "",
        caption:
            "The last frame's irradiance less that of the one before as a client sees it, full \
                  colour at 5 % of the mean. 16, 64 and 256 rays with 0.99; 256 with 0.8."
                .into(),
        picture: panels::joined(&panels, 2)?,
    });
    Ok(finding)
}
