//! Beyond the range: light too bright for the format's numbers, and places where no probes stand.

use super::fixture::{self, LookUp};
use super::panels::{self, ramp};
use super::places::{self, DIRECTIONS, Place, grey, mean, spread, worst};
use super::scene_builder::SceneBuilder;
use super::{Bound, Case, Effort, Finding, Shot};
use crate::Result;
use crate::codec::probes::f32_from_f16;
use crate::probes::sample::Field;
use crate::probes::sh::{self, L2};
use crate::probes::source::{Packing, Request};
use crate::scene::Scene;
use crate::scene::camera::look_at;
use crate::trace::path::Sky;
use crate::world::World;
use glam::Vec3;

pub const BRIGHT_SUN: Case = Case {
    name: "bright-sun",
    about: "A court in the sun (albedo 0.8) beside a sealed room, behind a wall of 0.2 m. Relative \
            rms error of irradiance in 64 directions from the server's light through encoder and \
            decoder, as sent and if the volume's exponent were 0; and the worst light in the sealed \
            room, as a share of the court's.",
    parameter: "sun (lux)",
    beyond: "Without an exponent, values above 65504 are clipped, and light keeps no more than that. \
             The server chooses the exponent before the first keyframe with 8 bits of headroom and \
             cannot change it within a stream: light that grows more than 256 times brighter than \
             all probes were then is clipped, and needs a new track.",
    run: bright_sun,
};

pub const OUTSIDE: Case = Case {
    name: "outside",
    about: "A hall of 12 m with a lamp at one end; the volume, 1 m from probe to probe, covers that \
            end alone. Mean error of irradiance over the mean of paths on floor, ceiling and walls, at \
            a distance from the volume's last probes, in cells; the largest step at the border; and how much \
            light there changes from a camera straight above to one far outside.",
    parameter: "outside by (cells)",
    beyond: "Outside counts the light of the nearest point of the box. It never jumps and is always \
             finite, but it does not fall off any more: two cells out it is that of another place. A \
             volume has to hold what is seen.",
    run: outside,
};

/// Error of `packed` with tolerance 0.004 and of `raw`.
const PACKED_ERROR: f64 = 0.05;
const RAW_ERROR: f64 = 0.001;
/// Share of the court's light that the worst place of the sealed room may get.
const LEAK: f64 = 0.01;
/// Largest step of irradiance at the border over 2 mm, as a share of what is there.
const STEP: f64 = 0.01;

/// A court (x < 0) and a sealed room (x > 0.2), both 3 m high.
fn court(lux: f32) -> Scene {
    let mut builder = SceneBuilder::new("bright-sun", 0.8);
    let mut slab = |x: [f32; 2], y: [f32; 2], z: [f32; 2]| {
        builder.solid(Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]));
    };
    slab([-4.0, 4.2], [-0.5, 0.0], [-3.0, 3.0]);
    slab([-3.5, -3.0], [-0.1, 3.0], [-2.5, 2.5]);
    slab([3.2, 3.7], [-0.1, 3.4], [-2.5, 2.5]);
    slab([-3.5, 3.7], [-0.1, 3.4], [-2.5, -2.0]);
    slab([-3.5, 3.7], [-0.1, 3.4], [2.0, 2.5]);
    slab([0.0, 0.2], [-0.1, 3.4], [-2.1, 2.1]);
    slab([0.0, 3.7], [3.0, 3.4], [-2.5, 2.5]);
    builder.sun(Vec3::new(0.5, -1.0, 0.15), lux);
    builder.build()
}

/// The inside of the sealed room, and of the court.
const SEALED: [Vec3; 2] = [Vec3::new(0.2, 0.0, -2.0), Vec3::new(3.2, 3.0, 2.0)];
const COURT: [Vec3; 2] = [Vec3::new(-3.0, 0.0, -2.0), Vec3::new(0.0, 3.0, 2.0)];

/// Relative rms error of irradiance.
fn error(found: &[L2], right: &[L2], present: &[bool]) -> f64 {
    let (mut error, mut square) = (0.0, 0.0);
    for ((found, right), _) in found.iter().zip(right).zip(present).filter(|(_, p)| **p) {
        for n in (0..DIRECTIONS).map(|i| spread(i, DIRECTIONS)) {
            let [found, right] = [found, right].map(|l| f64::from(grey(sh::irradiance(l, n))));
            error += (found - right).powi(2);
            square += right.powi(2);
        }
    }
    (error / square).sqrt()
}

fn bright_sun(effort: Effort) -> Result<Finding> {
    let suns = [
        (1.0, true),
        (1e2, false),
        (1e4, false),
        (1e5, true),
        (1e6, true),
        (1e8, false),
        (1e12, false),
    ];
    let mut finding = Finding::default();
    for lux in effort.settings(&suns) {
        let scene = court(lux);
        let world = World::new(&scene, 0.0);
        let request = fixture::request(
            Vec3::new(-2.6, 0.4, -1.5),
            Vec3::new(2.9, 2.6, 1.5),
            [6, 3, 4],
            effort.of(64, 256),
        );
        let mut source = fixture::warmed_up(&world, &request)?;
        let at = if lux < 1e4 {
            format!("{lux}")
        } else {
            format!("{lux:.0e}")
        };
        let volume = *source.server().volume();
        let right = fixture::light(source.server());

        let raw = fixture::decoded(&mut source, Packing::Raw)?;
        let field = raw.field();
        let figure = error(field.radiance, &right, field.present);
        finding.bounded(&at, "error, raw", figure, Bound::AtMost(RAW_ERROR));
        let mut plain = *source.volume();
        plain.exponent = 0;
        let clipped: Vec<L2> = right
            .iter()
            .map(|light| {
                let probe = plain.quantize(&light.map(|c| c.to_array()));
                let values = plain.values(&probe).map(f32_from_f16);
                std::array::from_fn(|lm| Vec3::from_slice(&values[3 * lm..]))
            })
            .collect();
        let figure = error(&clipped, &right, field.present);
        finding.add(&at, "error, raw, exponent 0", figure);

        let packed = fixture::decoded(&mut source, request.packing)?;
        let field = packed.field();
        let figure = error(field.radiance, &right, field.present);
        finding.bounded(&at, "error, packed", figure, Bound::AtMost(PACKED_ERROR));
        finding.add(&at, "exponent", f64::from(packed.exponent));

        let side = effort.of(5, 10);
        let dark = places::in_room(SEALED[0], SEALED[1], side);
        let bright = places::in_room(COURT[0], COURT[1], side);
        let look = |places: &[Place]| {
            fixture::at_places(&field, &volume, LookUp::VisibilityWeighted, places)
        };
        let whole = mean(&look(&bright));
        let leak = worst(&look(&dark)) / whole;
        finding.bounded(&at, "leak, worst", leak, Bound::AtMost(LEAK));
        let light = fixture::at_places(&field, &volume, LookUp::Trilinear, &dark);
        finding.add(&at, "leak, trilinear, worst", worst(&light) / whole);

        if lux == 1e6 {
            let paths = world.paths(Sky::default());
            let camera = look_at(Vec3::new(-2.8, 2.4, 1.8), Vec3::new(-0.6, 0.6, -1.0), 1.2);
            let seen = panels::seen(&paths, &camera);
            let clipped = Field {
                radiance: &clipped,
                ..field
            };
            let panel = |field: &Field| {
                let how = LookUp::VisibilityWeighted;
                let share = |place: &Place, view: Vec3| {
                    0.5 * fixture::irradiance(field, &volume, how, place, view) / whole as f32
                };
                ramp(panels::WIDTH, &panels::values(&seen, share))
            };
            finding.pictures.push(Shot {
                name: "",
                caption:
                    "Indirect irradiance of the court in a sun of 1e6, pale for twice the mean: \
                          as sent, and with exponent 0."
                        .into(),
                picture: panels::joined(&[panel(&field), panel(&clipped)], 2)?,
            });
        }
    }
    Ok(finding)
}

/// Half the hall's width and height.
const HALL: Vec3 = Vec3::new(6.0, 1.5, 2.0);
/// Where the last probes stand.
const BORDER: f32 = -1.7;

/// Places all around the hall, on floor, ceiling and side walls, at one x.
fn around(x: f32, side: usize) -> Vec<Place> {
    let mut places = Vec::new();
    for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        let across = if normal.y != 0.0 { Vec3::Z } else { Vec3::Y };
        for i in 0..side {
            let share = (i as f32 + 0.5) / side as f32 * 2.0 - 1.0;
            places.push(Place {
                position: Vec3::X * x - normal * HALL + across * HALL * share,
                normal,
            });
        }
    }
    places
}

fn outside(effort: Effort) -> Result<Finding> {
    let distances = [
        (-1.0, true),
        (0.0, false),
        (0.5, false),
        (1.0, true),
        (2.0, false),
        (4.0, true),
        (7.0, false),
    ];
    let mut builder = SceneBuilder::new("outside", 0.6);
    builder.room(-HALL, HALL);
    builder.point(Vec3::new(-4.0, 0.8, 0.2), 20.0);
    let scene = builder.build();
    let world = World::new(&scene, 0.0);
    let paths = world.paths(Sky::default());
    let reach = world.tracer().reach();
    let request = Request {
        packing: Packing::Raw,
        ..fixture::request(
            Vec3::new(-5.7, -1.0, -1.5),
            Vec3::new(BORDER, 1.0, 1.5),
            [5, 3, 4],
            effort.of(64, 256),
        )
    };
    let mut source = fixture::warmed_up(&world, &request)?;
    let decoded = fixture::decoded(&mut source, request.packing)?;
    let volume = *source.server().volume();
    let field = decoded.field();
    let ways = [LookUp::Trilinear, LookUp::VisibilityWeighted];
    let look = |how, places: &[Place]| fixture::at_places(&field, &volume, how, places);

    let mut finding = Finding::default();
    for distance in effort.settings(&distances) {
        let places = around(BORDER + distance, effort.of(4, 10));
        let right = places::truth(&paths, &places, effort.of(128, 1024), reach);
        let names = ["error, trilinear", "error, visibility-weighted"];
        for (how, name) in ways.into_iter().zip(names) {
            let off: Vec<f32> = look(how, &places)
                .iter()
                .zip(&right)
                .map(|(f, r)| (f - r).abs())
                .collect();
            finding.add(&format!("{distance}"), name, mean(&off) / mean(&right));
        }
    }
    let sides = [-1e-3, 1e-3].map(|off| around(BORDER + off, effort.of(10, 50)));
    for (how, name) in ways
        .into_iter()
        .zip(["step, trilinear", "step, visibility-weighted"])
    {
        let [inside, beyond] = sides.each_ref().map(|places| look(how, places));
        let steps: Vec<f32> = inside
            .iter()
            .zip(&beyond)
            .map(|(a, b)| (a - b).abs() / a.abs().max(b.abs()))
            .collect();
        finding.bounded("border", name, worst(&steps), Bound::AtMost(STEP));
    }
    // The same places seen from straight above and from far beyond the end of the volume.
    let places = around(BORDER - 0.5, effort.of(10, 50));
    let above = look(LookUp::VisibilityWeighted, &places);
    let aslant: Vec<f32> = places
        .iter()
        .map(|place| {
            let view = (place.normal * 0.17 + Vec3::X).normalize();
            fixture::irradiance(&field, &volume, LookUp::VisibilityWeighted, place, view)
        })
        .collect();
    let changes: Vec<f32> = above
        .iter()
        .zip(&aslant)
        .map(|(a, b)| (a - b).abs() / a.abs().max(b.abs()))
        .collect();
    finding.add(
        "border",
        "change with the camera, visibility-weighted",
        worst(&changes),
    );
    // Far away, and where there is no place at all.
    let nowhere = [
        1e3,
        1e9,
        f32::MAX,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let places: Vec<Place> = nowhere
        .iter()
        .flat_map(|x| Vec3::AXES.map(|axis| axis * *x))
        .map(|position| Place {
            position,
            normal: Vec3::Y,
        })
        .collect();
    for (how, name) in ways
        .into_iter()
        .zip(["finite, trilinear", "finite, visibility-weighted"])
    {
        let light = look(how, &places);
        let finite = light.iter().filter(|l| l.is_finite()).count() as f64;
        let share = finite / light.len() as f64;
        finding.bounded("1000 to infinity", name, share, Bound::AtLeast(1.0));
    }

    let camera = look_at(Vec3::new(-5.6, 0.9, 1.7), Vec3::new(3.0, -0.6, -0.6), 0.9);
    let seen = panels::seen(&paths, &camera);
    let spots: Vec<Place> = seen.iter().flatten().map(|(place, _)| *place).collect();
    let mut right = places::truth(&paths, &spots, effort.of(8, 128), reach).into_iter();
    let truth: Vec<Option<f32>> = seen
        .iter()
        .map(|p| p.as_ref().and_then(|_| right.next()))
        .collect();
    let found = panels::values(&seen, |place, view| {
        fixture::irradiance(&field, &volume, LookUp::VisibilityWeighted, place, view)
    });
    let scale = truth.iter().flatten().sum::<f32>() / spots.len().max(1) as f32;
    let shown = |values: &[Option<f32>]| {
        let share: Vec<_> = values.iter().map(|v| v.map(|v| 0.5 * v / scale)).collect();
        ramp(panels::WIDTH, &share)
    };
    finding.pictures.push(Shot {
        name: "",
        caption: "Indirect irradiance of the hall, pale for twice the mean, from within the volume to \
                  8 cells beyond its end: paths, probes, their difference (red: too bright, full at \
                  the mean)."
            .into(),
        picture: panels::joined(
            &[
                shown(&truth),
                shown(&found),
                panels::difference(&found, &truth, scale)?,
            ],
            2,
        )?,
    });
    Ok(finding)
}
