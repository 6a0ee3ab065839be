//! Ambient occlusion of `points` on the light of probes: what it gains over its strength, and whether it
//! darkens twice.

use super::{Args, Setting};
use crate::Result;
use crate::client::Client;
use crate::codec::Limits;
use crate::measure::table::{Table, Value};
use crate::models::ModelOptions;
use crate::points::client::PointsView;
use crate::points::sample::Fallback;
use crate::points::server::Options;
use crate::probes::sample::Indirect;
use crate::render::gbuffer::Lookup;
use crate::render::light::Occlusion;
use crate::render::{Backend, Renderer};
use crate::scene::Scene;
use crate::stream::{Job, Stream};
use crate::trace::path::bsdf::luminance;
use glam::Vec3;

/// Strengths that are compared.
const STRENGTHS: [f32; 6] = [0.0, 0.25, 0.5, 0.75, 0.9, 1.0];

/// AO of every pixel from one frame of points that went through a stream, its distance in metres, and the
/// stream's bytes.
///
/// # Errors
/// Those of the stream and of the look-up.
pub fn ao(args: &Args, scene: &Scene) -> Result<(Vec<f32>, f32, usize)> {
    let options = Options {
        span: 0.0,
        ..args.encode.options(scene, args.scene.view.aspect())
    };
    let job = Job {
        models: vec![ModelOptions::Points(options)],
        frames: 1,
        ..args.encode.job(scene, &args.scene.view)?
    };
    let (view, time) = (job.view, job.start);
    let mut bytes = Vec::new();
    let stream = Stream::start(scene, job, &mut bytes, &mut |_, _| {})?;
    stream.finish(&mut bytes)?;
    let mut client = Client::of_scene(scene, Limits::default());
    client.push(&bytes)?;
    let points = PointsView::new(&client);
    let pose = scene.pose(time);
    let lookup = match points.looks_up_rest_pose() {
        true => Lookup::Rest,
        false => Lookup::Posed(&pose),
    };
    // Primary rays, as those of the pictures.
    let mut renderer = Renderer::new(scene, Backend::Cpu)?;
    let (width, height) = args.scene.view.size;
    let gbuffer = renderer.gbuffer(&pose, lookup, &view.at(&pose), width, height)?;
    let found = renderer.points_ao(&gbuffer, &points.state(), Fallback::default())?;
    Ok((found.ao, options.distance, bytes.len()))
}

/// Scores of `methods` with the AO at each strength on their light.
///
/// # Errors
/// As [`Setting::score`].
pub fn table(
    title: &str,
    scored: &Setting,
    methods: &[(String, Vec<Indirect>)],
    (ao, distance, bytes): &(Vec<f32>, f32, usize),
) -> Result<Table> {
    let right = total(&scored.indirect);
    let mut rows = Vec::new();
    for (method, indirect) in methods {
        for strength in STRENGTHS {
            let occlusion = Occlusion { ao, strength };
            let darkened = |(i, light): (usize, &Indirect)| {
                let open = occlusion.factor(i);
                Indirect {
                    diffuse: light.diffuse * open,
                    glossy: light.glossy * open,
                }
            };
            let light: Vec<Indirect> = indirect.iter().enumerate().map(darkened).collect();
            let [picture, own] = scored.score(&light)?;
            let all: Vec<Vec3> = light.iter().map(|l| l.diffuse + l.glossy).collect();
            rows.push(vec![
                Value::Text(method.clone()),
                Value::Number(strength.into(), 2),
                Value::Number(picture.psnr, 2),
                Value::Number(picture.flip, 4),
                Value::Number(own.psnr, 2),
                Value::Number(total(&all) / right, 3),
            ]);
        }
    }
    let columns = [
        "method",
        "strength of AO",
        "PSNR (dB)",
        "FLIP",
        "indirect PSNR (dB)",
        "indirect light, mean over right",
    ];
    Ok(Table {
        title: format!("{title}: ambient occlusion of points on the light of probes"),
        columns: columns.map(String::from).to_vec(),
        rows,
        note: format!(
            "AO of {distance} m, {:.1} kB of points, on diffuse and glossy light alike.",
            *bytes as f64 / 1e3
        ),
    })
}

/// Sum of luminances.
fn total(light: &[Vec3]) -> f64 {
    let lights = light.iter().map(|c| f64::from(luminance(*c)));
    lights.sum::<f64>().max(f64::MIN_POSITIVE)
}
