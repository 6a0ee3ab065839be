//! Ringing: an expansion of degree 2 cannot hold a small hot emitter, and swings below zero on the far
//! side.

use super::fixture;
use super::panels::{self, ramp};
use super::places::{DIRECTIONS, grey, spread};
use super::scene_builder::SceneBuilder;
use super::{Bound, Case, Effort, Finding, Shot};
use crate::Result;
use crate::probes::dering::{Keep, dering, minimum};
use crate::probes::sh::{self, COSINE, L2, Y0};
use crate::scene::Scene;
use crate::trace::path::{PathTracer, Paths, Random, Sky};
use crate::world::World;
use glam::Vec3;
use rayon::prelude::*;

pub const RINGING: Case = Case {
    name: "ringing",
    about: "A dark room of 4 m (albedo 0.1) with a square lamp in the ceiling whose power stays the \
            same as it shrinks; 64 probes. Least irradiance over all directions, by its closed form, \
            as a share of a probe's mean; and the relative rms error of irradiance over 64 directions \
            against direct sums over the lamp: of the expansion, of the expansion where it is cut off at \
            zero when it is looked up, after dering, which scales degrees 1 and 2 by as much as is \
            needed, and with the window that does it in Sloan 2017. No noise of sampling is in these; it is in the last column.",
    parameter: "lamp's side (m)",
    beyond: "Below a side of about half the distance to the lamp nothing more changes for the \
             expansion, which is that of a point. What grows without bound as the lamp shrinks is \
             noise, for a probe's rays find it by chance alone; lamps that small belong among the \
             punctual lights, which are sampled.",
    run: ringing,
};

/// The least irradiance after dering, as a share of the mean.
const LOWEST: f64 = -1e-5;
/// Half the room's edge.
const HALF: f32 = 2.0;
/// The lamp hangs so far below the ceiling.
const BELOW: f32 = 0.01;
/// Places of the lamp along its side.
const GRID: u32 = 24;

fn room(side: f32) -> Scene {
    let mut builder = SceneBuilder::new("ringing", 0.1);
    builder.room(Vec3::splat(-HALF), Vec3::splat(HALF));
    builder.lamp(Vec3::new(0.0, HALF - BELOW, 0.0), side, radiance(side));
    builder.build()
}

/// Of a lamp of one power.
fn radiance(side: f32) -> f32 {
    10.0 / (side * side)
}

/// Samples of all light at a place: directions, radiance, and solid angle.
fn samples(paths: &PathTracer, side: f32, at: Vec3, seed: u32, rays: u32) -> Vec<(Vec3, f32, f32)> {
    let even = (0..rays).map(|ray| {
        let direction = spread(ray as usize, rays as usize);
        let vertex = paths.first(at, direction, true).0;
        // The lamp's own light is summed below.
        let light = vertex.map_or(0.0, |vertex| {
            let mut random = Random::new(17, seed, ray);
            let bounces = Paths::default().max_bounces;
            grey(paths.scattered(&vertex, &mut random, bounces, true))
        });
        (direction, light, 4.0 * std::f32::consts::PI / rays as f32)
    });
    let lamp = (0..GRID * GRID).map(|i| {
        let along = |k: u32| ((k as f32 + 0.5) / GRID as f32 - 0.5) * side;
        let offset = Vec3::new(along(i % GRID), HALF - BELOW, along(i / GRID)) - at;
        let direction = offset.normalize();
        let area = (side / GRID as f32).powi(2);
        let angle = area * direction.y.max(0.0) / offset.length_squared();
        (direction, radiance(side), angle)
    });
    even.chain(lamp).collect()
}

/// The least and the mean irradiance of an expansion.
fn least(light: &L2) -> (f32, f32) {
    let c = std::array::from_fn(|i| grey(light[i]) * COSINE[sh::degree_of(i)]);
    (minimum(&c), c[0] * Y0)
}

/// What else keeps an expansion from negative irradiance: the window `1 / (1 + lambda l^2 (l + 1)^2)` with
/// the smallest lambda that does (Sloan 2017).
fn windowed(light: &L2) -> L2 {
    let by = |lambda: f32| -> L2 {
        std::array::from_fn(|i| {
            let l = sh::degree_of(i) as f32;
            light[i] / (1.0 + lambda * (l * (l + 1.0)).powi(2))
        })
    };
    let (mut low, mut high) = (0.0, 1.0);
    if least(light).0 >= 0.0 {
        return *light;
    }
    while least(&by(high)).0 < 0.0 && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        match least(&by(middle)).0 < 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    by(high)
}

/// Sums of squares: error of an expansion as it is, cut off at zero, after dering and windowed; and
/// what is right.
fn squares(samples: &[(Vec3, f32, f32)], plain: &L2, calm: &L2) -> [f64; 5] {
    let windowed = windowed(plain);
    let mut sums = [0.0f64; 5];
    for i in 0..DIRECTIONS {
        let n = spread(i, DIRECTIONS);
        let right: f32 = samples
            .iter()
            .map(|(d, light, angle)| light * angle * d.dot(n).max(0.0))
            .sum();
        let of = |l: &L2| grey(sh::irradiance(l, n));
        let off = [
            of(plain) - right,
            of(plain).max(0.0) - right,
            of(calm) - right,
            of(&windowed) - right,
            right,
        ];
        for (sum, value) in sums.iter_mut().zip(off) {
            *sum += f64::from(value).powi(2);
        }
    }
    sums
}

fn ringing(effort: Effort) -> Result<Finding> {
    let sides = [
        (3.0, false),
        (2.0, true),
        (1.0, false),
        (0.5, false),
        (0.25, true),
        (0.1, false),
        (0.05, false),
    ];
    let rays = effort.of(256, 1024);
    let dims = effort.of([2, 2, 2], [4, 4, 4]);
    let mut finding = Finding::default();
    for side in effort.settings(&sides) {
        let scene = room(side);
        let world = World::new(&scene, 0.0);
        let paths = world.paths(Sky::default());
        let request = fixture::request(Vec3::splat(-1.5), Vec3::splat(1.5), dims, 256);
        let mut source = fixture::warmed_up(&world, &request)?;
        source.update(&world);
        let server = source.server();
        let volume = *server.volume();
        let probe = |probe: usize| {
            let position = volume.position(probe);
            let samples = samples(&paths, side, position, probe as u32, rays);
            let mut plain = [Vec3::ZERO; sh::L2_COUNT];
            for (direction, light, angle) in &samples {
                sh::project(&mut plain, *direction, Vec3::splat(*light), *angle);
            }
            let mut calm = plain;
            let share = dering(&mut calm, Keep::Irradiance);
            let mut noise = server.l2(probe);
            noise.iter_mut().zip(&plain).for_each(|(n, p)| *n -= *p);
            let noise: f64 = (0..DIRECTIONS)
                .map(|i| f64::from(grey(sh::irradiance(&noise, spread(i, DIRECTIONS)))).powi(2))
                .sum();
            (plain, calm, share, squares(&samples, &plain, &calm), noise)
        };
        let count = volume.lattice.count();
        let probes: Vec<_> = (0..count).into_par_iter().map(probe).collect();

        let share = |light: &L2| {
            let (least, mean) = least(light);
            f64::from(least / mean)
        };
        let lowest = |of: &dyn Fn(usize) -> f64| (0..count).map(of).fold(f64::INFINITY, f64::min);
        let sum = |i: usize| probes.iter().map(|p| p.3[i]).sum::<f64>();
        let at = format!("{side}");
        finding.add(&at, "least, plain", lowest(&|p| share(&probes[p].0)));
        let calm = lowest(&|p| share(&probes[p].1));
        finding.bounded(&at, "least, dering", calm, Bound::AtLeast(LOWEST));
        let touched = probes.iter().filter(|p| p.2 < 1.0).count();
        finding.add(&at, "probes touched (share)", touched as f64 / count as f64);
        let names = [
            "error, plain",
            "error, cut off",
            "error, dering",
            "error, windowed",
        ];
        for (i, name) in names.into_iter().enumerate() {
            finding.add(&at, name, (sum(i) / sum(4)).sqrt());
        }
        let noise: f64 = probes.iter().map(|p| p.4).sum();
        let name = "noise, 256 rays, 25 frames";
        finding.add(&at, name, (noise / sum(4)).sqrt());

        if side == 0.25 {
            // The probe that rings most, over all directions.
            let ringing = |p: &usize| share(&probes[*p].0);
            let Some(most) = (0..count).min_by(|a, b| ringing(a).total_cmp(&ringing(b))) else {
                continue;
            };
            let samples = samples(&paths, side, volume.position(most), most as u32, rays);
            let (width, height) = (160u32, 80u32);
            let panel = |value: &(dyn Fn(Vec3) -> f32 + Sync)| {
                let pixel = |i: u32| {
                    let (x, y) = (i % width, i / width);
                    let phi = (x as f32 + 0.5) / width as f32 * std::f32::consts::TAU;
                    let theta = (y as f32 + 0.5) / height as f32 * std::f32::consts::PI;
                    let r = theta.sin();
                    Some(value(Vec3::new(r * phi.cos(), theta.cos(), r * phi.sin())))
                };
                (0..width * height)
                    .into_par_iter()
                    .map(pixel)
                    .collect::<Vec<_>>()
            };
            let right = panel(&|n| {
                let part = |(d, l, a): &(Vec3, f32, f32)| l * a * d.dot(n).max(0.0);
                samples.iter().map(part).sum()
            });
            let peak = right.iter().flatten().fold(0.0f32, |m, v| m.max(*v));
            let shown = |values: Vec<Option<f32>>| {
                let share: Vec<_> = values.iter().map(|v| v.map(|v| v / peak)).collect();
                ramp(width, &share)
            };
            let of = |light: &L2| shown(panel(&|n| grey(sh::irradiance(light, n))));
            let (plain, calm) = (&probes[most].0, &probes[most].1);
            let panels = [shown(right), of(plain), of(calm), of(&windowed(plain))];
            finding.pictures.push(Shot {
                name: "",
                caption: "Irradiance at one probe by direction (up at the top) with a lamp of \
                          0.25 m: what is right, the expansion; after dering, with Sloan's window. Cyan is negative."
                    .into(),
                picture: panels::joined(&panels, 2)?,
            });
        }
    }
    Ok(finding)
}
