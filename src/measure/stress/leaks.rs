//! Light that comes through walls: from the next room, and from probes that stand inside a wall.

use super::fixture::{self, LookUp};
use super::panels::{self, decades, ramp};
use super::places::{self, Place, grey, mean, relative_rms, worst};
use super::scene_builder::SceneBuilder;
use super::{Bound, Case, Effort, Finding, Shot};
use crate::Result;
use crate::probes::sample::Field;
use crate::probes::source::{Packing, Request};
use crate::scene::Scene;
use crate::scene::camera::look_at;
use crate::trace::path::Sky;
use crate::world::World;
use glam::Vec3;

pub const SEALED_ROOM: Case = Case {
    name: "sealed-room",
    about: "Two rooms of 4 m with a wall between them, a lamp in one, the other sealed and so black; \
            probes 1 m apart. Light on the walls of the dark room, as a share of the mean irradiance \
            in the bright one, by all ways to look up the same probes; and the light of the bright room \
            itself over that of paths.",
    parameter: "wall (m)",
    beyond: "A texel of the visibility block blurs distances over some ten degrees: behind a wall that is \
             thin beside what this makes of a cell, probes of the bright room pass for seeing the place, \
             and it glows in spots. Finer texels push that down. Presence alone knows of probes inside \
             the wall, and passes all light until the wall is so thick that each cell has one.",
    run: sealed_room,
};

pub const PROBES_IN_WALLS: Case = Case {
    name: "probes-in-walls",
    about: "A closed room with walls of 0.6 m under a bright sky, a lamp inside; the grid, 1 m from \
            probe to probe, is pushed through the wall. Relative rms error of irradiance on that \
            wall against paths.",
    parameter: "probes behind the wall (m)",
    beyond: "Probes inside geometry look out through backs of faces and hold the light of the wrong side; \
             the deeper they stand, the more. Left out, the wall has the light of the next probes before \
             it, up to a cell away. Probes beyond the wall are in the open, and the visibility block \
             alone keeps their light out; so it does where geometry is an open sheet and has no inside.",
    run: probes_in_walls,
};

/// Share of the bright room's light that the worst place of the dark one may get.
pub(super) const LEAK: f64 = 0.01;
/// Relative rms error that the wall may have, wherever the probes stand.
const WALL_ERROR: f64 = 0.25;

/// The two rooms, along x: bright to the left of the wall, dark to the right.
fn two_rooms(wall: f32) -> Scene {
    let mut builder = SceneBuilder::new("sealed-room", 0.6);
    builder.room(Vec3::new(-4.0, -1.5, -2.0), Vec3::new(4.0, 1.5, 2.0));
    if wall > 0.0 {
        let half = Vec3::new(0.5 * wall, 1.6, 2.1);
        builder.solid(-half, half);
    } else {
        builder.sheet(Vec3::ZERO, Vec3::Y * 1.6, Vec3::Z * 2.1);
    }
    builder.point(Vec3::new(-2.2, 0.9, 0.3), 20.0);
    builder.build()
}

/// The ways of Dapple to look up.
const WAYS: [[&str; 2]; 3] = [
    ["trilinear, worst", "trilinear, mean"],
    ["presence alone, worst", "presence alone, mean"],
    ["visibility-weighted, worst", "visibility-weighted, mean"],
];

fn sealed_room(effort: Effort) -> Result<Finding> {
    let walls = [
        (0.0, false),
        (0.02, false),
        (0.05, false),
        (0.1, false),
        (0.2, true),
        (0.5, false),
        (1.0, true),
    ];
    let samples = effort.of(64, 256);
    let side = effort.of(6, 12);
    let mut finding = Finding::default();
    for wall in effort.settings(&walls) {
        let scene = two_rooms(wall);
        let world = World::new(&scene, 0.0);
        let paths = world.paths(Sky::default());
        let request = fixture::request(
            Vec3::new(-3.4, -1.0, -1.5),
            Vec3::new(3.6, 1.0, 1.5),
            [8, 3, 4],
            samples,
        );
        let mut source = fixture::warmed_up(&world, &request)?;
        let decoded = fixture::decoded(&mut source, request.packing)?;
        let volume = *source.server().volume();
        let field = decoded.field();
        let blind = Field {
            visibility: None,
            ..field
        };
        let ddgi = fixture::ddgi(&paths, &volume, samples);

        let half = 0.5 * wall;
        let corner = Vec3::new(4.0, 1.5, 2.0);
        let dark = places::in_room(Vec3::new(half, -1.5, -2.0), corner, side);
        let eyes = places::eyes(Vec3::new(half, -1.5, -2.0), corner);
        let bright = places::in_room(-corner, Vec3::new(-half, 1.5, 2.0), effort.of(3, 6));
        let right = places::truth(&paths, &bright, effort.of(64, 512), world.tracer().reach());
        let whole = mean(&right);

        let of_way = |way: usize, place: &Place, view: Vec3| match way {
            0 => fixture::irradiance(&field, &volume, LookUp::Trilinear, place, view),
            1 => fixture::irradiance(&blind, &volume, LookUp::VisibilityWeighted, place, view),
            2 => fixture::irradiance(&field, &volume, LookUp::VisibilityWeighted, place, view),
            _ => grey(ddgi.irradiance(place.position, place.normal, view)),
        };
        let at = format!("{wall}");
        for (way, [most, average]) in WAYS.iter().enumerate() {
            let light: Vec<f32> = dark.iter().map(|p| of_way(way, p, p.normal)).collect();
            let share = worst(&light) / whole;
            if way == 2 {
                finding.bounded(&at, most, share, Bound::AtMost(LEAK));
            } else {
                finding.add(&at, most, share);
            }
            finding.add(&at, average, mean(&light) / whole);
        }
        let along = |place: &Place| {
            let view = |eye: &Vec3| (*eye - place.position).normalize();
            let lights = eyes.iter().map(|eye| of_way(2, place, view(eye)));
            worst(&lights.collect::<Vec<f32>>()) as f32
        };
        let light: Vec<f32> = dark.iter().map(along).collect();
        let share = worst(&light) / whole;
        let figure = "visibility-weighted along walls, worst";
        finding.bounded(&at, figure, share, Bound::AtMost(LEAK));
        let light: Vec<f32> = dark.iter().map(|p| of_way(3, p, p.normal)).collect();
        finding.add(&at, "DDGI, worst", worst(&light) / whole);
        finding.add(&at, "DDGI, mean", mean(&light) / whole);
        if effort == Effort::Full {
            let mut coarser = request;
            coarser.server.visibility = 8;
            let mut source = fixture::warmed_up(&world, &coarser)?;
            let decoded = fixture::decoded(&mut source, coarser.packing)?;
            let light =
                fixture::at_places(&decoded.field(), &volume, LookUp::VisibilityWeighted, &dark);
            finding.add(
                &at,
                "visibility-weighted, 8 texels, worst",
                worst(&light) / whole,
            );
        }
        // Darkness everywhere would be no merit.
        let ways = [
            "bright room, trilinear",
            "",
            "bright room, visibility-weighted",
        ];
        for way in [0, 2] {
            let light: Vec<f32> = bright.iter().map(|p| of_way(way, p, p.normal)).collect();
            finding.add(&at, ways[way], mean(&light) / whole);
        }

        if wall == effort.of(0.2, 0.1) {
            let camera = look_at(Vec3::new(3.6, 0.5, 1.0), Vec3::new(0.0, -0.2, -0.1), 1.0);
            let seen = panels::seen(&paths, &camera);
            let panel = |way: usize| {
                let share = |place: &Place, view: Vec3| {
                    decades(of_way(way, place, view) / whole as f32, 4.0)
                };
                ramp(panels::WIDTH, &panels::values(&seen, share))
            };
            finding.pictures.push(Shot {
                name: "",
                caption: format!(
                    "The dark room behind a wall of {wall} m: irradiance as a share of the bright \
                          room's, black for 0.0001 and less, pale for 1. Trilinear, presence alone; \
                          visibility-weighted, DDGI."
                ),
                picture: panels::joined(&[panel(0), panel(1), panel(2), panel(3)], 2)?,
            });
        }
    }
    Ok(finding)
}

fn walled_room() -> Scene {
    let mut builder = SceneBuilder::new("probes-in-walls", 0.6);
    let half = Vec3::new(2.0, 1.5, 2.0);
    builder.room(-half, half);
    builder.solid(-half - 0.6, half + 0.6);
    builder.point(Vec3::new(-0.4, 0.8, 0.3), 8.0);
    builder.build()
}

/// Presence and visibility of each way, and its name.
const KNOWN: [(&str, bool, bool); 4] = [
    ("neither", false, false),
    ("visibility alone", false, true),
    ("presence alone", true, false),
    ("both", true, true),
];

fn probes_in_walls(effort: Effort) -> Result<Finding> {
    let behind = [
        (-0.5, false),
        (-0.25, true),
        (-0.05, false),
        (0.02, false),
        (0.1, false),
        (0.3, true),
        (0.5, false),
        (0.7, false),
        (0.9, false),
    ];
    let sky = Sky::uniform(Vec3::splat(5.0));
    let scene = walled_room();
    let world = World::new(&scene, 0.0);
    let paths = world.paths(sky);
    let half = Vec3::new(2.0, 1.5, 2.0);
    let wall = places::on_wall(-half, half, Vec3::NEG_X, effort.of(5, 10));
    let reach = world.tracer().reach();
    let right = places::truth(&paths, &wall, effort.of(128, 1024), reach);
    let camera = look_at(Vec3::new(-1.6, 0.5, 1.2), Vec3::new(2.0, -0.2, -0.2), 1.1);
    let seen = panels::seen(&paths, &camera);

    let mut finding = Finding::default();
    for behind in effort.settings(&behind) {
        let end = 2.0 + behind;
        let request = Request {
            sky,
            ..fixture::request(
                Vec3::new(end - 4.0, -1.0, -1.5),
                Vec3::new(end, 1.0, 1.5),
                [5, 3, 4],
                effort.of(128, 256),
            )
        };
        let mut source = fixture::warmed_up(&world, &request)?;
        let decoded = fixture::decoded(&mut source, Packing::Raw)?;
        let volume = *source.server().volume();
        // As a server would send that does not detect probes inside geometry.
        let everywhere = fixture::light(source.server());
        let all = vec![true; everywhere.len()];
        let field = decoded.field();
        let of = |presence: bool, visibility: bool| Field {
            radiance: if presence {
                field.radiance
            } else {
                &everywhere
            },
            present: if presence { field.present } else { &all },
            visibility: field.visibility.filter(|_| visibility),
            ..field
        };
        let at = format!("{behind}");
        let light = fixture::at_places(&of(false, false), &volume, LookUp::Trilinear, &wall);
        finding.add(&at, "trilinear, neither", relative_rms(&light, &right));
        let light = fixture::at_places(&field, &volume, LookUp::Trilinear, &wall);
        finding.add(&at, "trilinear, filled", relative_rms(&light, &right));
        for (name, presence, visibility) in KNOWN {
            let field = of(presence, visibility);
            let light = fixture::at_places(&field, &volume, LookUp::VisibilityWeighted, &wall);
            let error = relative_rms(&light, &right);
            if name == "both" {
                finding.bounded(&at, name, error, Bound::AtMost(WALL_ERROR));
            } else {
                finding.add(&at, name, error);
            }
        }
        let disabled = source.sent().iter().filter(|p| p.level == 0).count();
        finding.add(&at, "probes disabled", disabled as f64);

        if behind == 0.3 {
            let of_room = |place: &Option<(Place, Vec3)>| place.map(|(place, _)| place);
            let places: Vec<Place> = seen.iter().filter_map(of_room).collect();
            let mut right = places::truth(&paths, &places, effort.of(8, 128), reach).into_iter();
            let truth: Vec<Option<f32>> = seen
                .iter()
                .map(|p| p.as_ref().and_then(|_| right.next()))
                .collect();
            let scale = 2.0 * mean(&truth.iter().flatten().copied().collect::<Vec<_>>()) as f32;
            let panel = |presence: bool, visibility: bool| {
                let field = of(presence, visibility);
                let how = LookUp::VisibilityWeighted;
                panels::values(&seen, |place, view| {
                    fixture::irradiance(&field, &volume, how, place, view)
                })
            };
            let shown = |values: &[Option<f32>]| {
                let share: Vec<_> = values.iter().map(|v| v.map(|v| v / scale)).collect();
                ramp(panels::WIDTH, &share)
            };
            let (neither, both) = (panel(false, false), panel(true, true));
            finding.pictures.push(Shot {
                name: "",
                caption: "Irradiance of the room where probes stand 0.3 m inside the wall ahead, \
                          pale for twice the mean. Paths, neither presence nor visibility; both, \
                          error of both (red: too bright, full at the mean)."
                    .into(),
                picture: panels::joined(
                    &[
                        shown(&truth),
                        shown(&neither),
                        shown(&both),
                        panels::difference(&both, &truth, 0.5 * scale)?,
                    ],
                    2,
                )?,
            });
        }
    }

    Ok(finding)
}
