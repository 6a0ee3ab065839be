//! A house whose walls are closed boxes, with light in one room or outside, and a dark room.

use super::fixture::{self, LookUp};
use super::leaks::LEAK;
use super::panels::{self, decades, ramp};
use super::places::{self, Place, mean, worst};
use super::scene_builder::SceneBuilder;
use super::{Bound, Case, Effort, Finding, Shot};
use crate::Result;
use crate::probes::client::ProbesVolume;
use crate::probes::sample::Field;
use crate::probes::source::Request;
use crate::scene::Scene;
use crate::scene::camera::look_at;
use crate::trace::path::Sky;
use crate::world::World;
use glam::Vec3;
use rayon::prelude::*;

pub const SEALED_HOUSE: Case = Case {
    name: "sealed-house",
    about: "A house of two sealed rooms, floor, roof and walls closed boxes 0.2 m thick; probes 1 m apart, \
            the grid shifted along all axes: at 0 probes lie in the faces of floor and walls. Light from a \
            lamp in the other room, or from a sky around the house. Light on the walls of the dark room, as \
            a share of the mean irradiance in the bright room or on the roof, at the worst frame of a \
            stream with a keyframe every third: seen from straight above, and from eyes in the corners, \
            along the walls. Places are 0.09 m and more from the edges of the room; for those within \
            0.06 m of an edge, the share of looks that get more than 0.01.",
    parameter: "light, shift (m)",
    beyond: "Within a few centimetres of an edge the only probe in the room may be a cell away, count \
             little, and see the place along a wall, at an angle where texels blur the distance most: then \
             no probe counts as seeing it, and it gets the light of all of them. A room narrower than a \
             cell may have no probe of its own, with the same result. Walls below 0.2 m are in sealed-room.",
    run: sealed_house,
};

/// Of all walls, floor and roof.
const WALL: f32 = 0.2;
/// The dark room.
const DARK: [Vec3; 2] = [Vec3::new(0.1, 0.0, -2.0), Vec3::new(4.1, 3.0, 2.0)];
/// The other one.
const OTHER: [Vec3; 2] = [Vec3::new(-4.1, 0.0, -2.0), Vec3::new(-0.1, 3.0, 2.0)];
/// Frames of the stream, and from keyframe to keyframe.
const FRAMES: usize = 5;
const INTERVAL: usize = 3;

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Light {
    Lamp,
    Sky,
}

fn house(from: Light) -> Scene {
    let mut builder = SceneBuilder::new("sealed-house", 0.7);
    let (low, high) = (OTHER[0], DARK[1]);
    let mut solid = |min: [f32; 3], max: [f32; 3]| builder.solid(min.into(), max.into());
    let out = [low.x - WALL, low.y - WALL, low.z - WALL];
    let end = [high.x + WALL, high.y + WALL, high.z + WALL];
    solid(out, [end[0], low.y, end[2]]);
    solid([out[0], high.y, out[2]], end);
    solid([out[0], low.y, out[2]], [low.x, high.y, end[2]]);
    solid([high.x, low.y, out[2]], [end[0], high.y, end[2]]);
    solid([low.x, low.y, out[2]], [high.x, high.y, low.z]);
    solid([low.x, low.y, high.z], [high.x, high.y, end[2]]);
    solid([OTHER[1].x, low.y, low.z], [DARK[0].x, high.y, high.z]);
    if from == Light::Lamp {
        builder.point(Vec3::new(-2.5, 2.4, -1.0), 20.0);
    }
    builder.build()
}

fn sealed_house(effort: Effort) -> Result<Finding> {
    let settings = [
        ((Light::Lamp, 0.0), false),
        ((Light::Lamp, 0.25), false),
        ((Light::Lamp, 0.5), false),
        ((Light::Lamp, 0.75), true),
        ((Light::Sky, 0.0), true),
        ((Light::Sky, 0.02), false),
        ((Light::Sky, 0.06), false),
        ((Light::Sky, 0.25), true),
        ((Light::Sky, 0.5), false),
        ((Light::Sky, 0.75), false),
        ((Light::Sky, 0.95), false),
    ];
    let samples = effort.of(16, 128);
    let dark = places::in_room(DARK[0], DARK[1], effort.of(7, 12));
    let eyes = places::eyes(DARK[0], DARK[1]);
    // Within 6 cm of two walls and more.
    let close = |place: &Place| {
        let [low, high] = DARK.map(|end| (place.position - end).abs());
        low.min(high)
            .to_array()
            .iter()
            .filter(|d| **d < 0.06)
            .count()
            > 1
    };
    let mut corners = places::in_room(DARK[0], DARK[1], 40);
    corners.retain(close);
    let mut finding = Finding::default();
    for (from, shift) in effort.settings(&settings) {
        let (scene, sky, name) = match from {
            Light::Lamp => (house(from), Sky::default(), "lamp"),
            Light::Sky => (house(from), Sky::uniform(Vec3::ONE), "sky"),
        };
        let world = World::new(&scene, 0.0);
        let paths = world.paths(sky);
        let bright = match from {
            Light::Lamp => places::in_room(OTHER[0], OTHER[1], effort.of(3, 6)),
            Light::Sky => {
                let roof = DARK[1].y + WALL;
                let [min, max] = [OTHER[0], DARK[1]].map(|p| Vec3::new(p.x, roof, p.z));
                places::on_wall(min, max, Vec3::Y, effort.of(3, 6))
            }
        };
        let right = places::truth(&paths, &bright, effort.of(64, 512), world.tracer().reach());
        let whole = mean(&right);
        let request = Request {
            sky,
            warm_up: effort.of(4, fixture::WARM_UP),
            ..fixture::request(
                Vec3::new(-5.9, -1.0, -3.0) + shift,
                Vec3::new(5.1, 4.0, 3.0) + shift,
                [12, 6, 7],
                samples,
            )
        };
        let mut source = fixture::warmed_up(&world, &request)?;
        let volume = *source.server().volume();
        let look = |field: &Field, how: LookUp, place: &Place, view: Vec3| {
            f64::from(fixture::irradiance(field, &volume, how, place, view)) / whole
        };
        let along = |places: &[Place], field: &Field| {
            let at = |place: &Place| {
                let view = |eye: &Vec3| (*eye - place.position).normalize();
                let lights = eyes.iter().map(view);
                lights
                    .map(|v| look(field, LookUp::VisibilityWeighted, place, v) as f32)
                    .collect::<Vec<f32>>()
            };
            places.par_iter().flat_map_iter(at).collect::<Vec<f32>>()
        };
        let straight = |field: &Field, how: LookUp| -> Vec<f32> {
            let at = |place: &Place| look(field, how, place, place.normal) as f32;
            dark.iter().map(at).collect()
        };

        let mut worsts = [f64::NEG_INFINITY; 2];
        let mut client = None;
        fixture::frames(
            &world,
            &mut source,
            request.packing,
            FRAMES,
            INTERVAL,
            |volume| {
                let field = volume.field();
                let found = [
                    straight(&field, LookUp::VisibilityWeighted),
                    along(&dark, &field),
                ]
                .map(|l| worst(&l));
                for (all, one) in worsts.iter_mut().zip(found) {
                    // Also if it is not a number.
                    *all = if one <= *all { *all } else { one };
                }
                client = Some(volume.into_owned());
            },
        )?;
        let client: ProbesVolume = client.ok_or_else(fixture::no_frame)?;
        let field = client.field();
        let at = format!("{name}, {shift}");
        let plain = straight(&field, LookUp::Trilinear);
        finding.add(&at, "trilinear, worst", worst(&plain));
        let bound = Bound::AtMost(LEAK);
        finding.bounded(&at, "visibility-weighted, worst", worsts[0], bound);
        finding.bounded(
            &at,
            "visibility-weighted along walls, worst",
            worsts[1],
            bound,
        );
        finding.add(
            &at,
            "visibility-weighted along walls, mean",
            mean(&along(&dark, &field)),
        );
        let light: Vec<f32> = bright
            .iter()
            .map(|p| look(&field, LookUp::VisibilityWeighted, p, p.normal) as f32)
            .collect();
        finding.add(&at, "bright side, visibility-weighted", mean(&light));
        let pictured = (from, shift) == (Light::Sky, 0.25);
        if effort == Effort::Quick && !pictured {
            continue;
        }

        let light = along(&corners, &field);
        let over = light.iter().filter(|l| f64::from(**l) > LEAK).count();
        let share = over as f64 / light.len() as f64;
        finding.add(&at, "corners, share above 0.01", share);

        let mut coarser = request;
        coarser.server.visibility = 8;
        let mut source = fixture::warmed_up(&world, &coarser)?;
        let coarse = fixture::decoded(&mut source, coarser.packing)?;
        let light = along(&dark, &coarse.field());
        finding.add(&at, "8 texels, along walls, worst", worst(&light));
        if pictured {
            let camera = look_at(Vec3::new(0.5, 1.6, 1.6), Vec3::new(3.0, 1.3, -1.2), 1.3);
            let seen = panels::seen(&paths, &camera);
            let blind = Field {
                visibility: None,
                ..field
            };
            let panel = |field: &Field, how: LookUp| {
                let share = |p: &Place, v: Vec3| decades(look(field, how, p, v) as f32, 4.0);
                ramp(panels::WIDTH, &panels::values(&seen, share))
            };
            let four = [
                panel(&field, LookUp::Trilinear),
                panel(&blind, LookUp::VisibilityWeighted),
                panel(&coarse.field(), LookUp::VisibilityWeighted),
                panel(&field, LookUp::VisibilityWeighted),
            ];
            finding.pictures.push(Shot {
                name: "",
                caption:
                    "The dark room under a sky, the grid shifted by 0.25 m: irradiance as a share \
                          of that on the roof, black for 0.0001 and less, pale for 1. Trilinear, \
                          presence alone; visibility-weighted with 8 texels, with 16."
                        .into(),
                picture: panels::joined(&four, 2)?,
            });
        }
    }
    Ok(finding)
}
