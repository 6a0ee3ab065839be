//! `--report`: a page with pictures and figures of a bake.

use super::super::args::ViewArgs;
use super::figures::Figures;
use crate::bake::signals::shown;
use crate::bake::{Baked, Plan};
use crate::files;
use crate::measure::report::{Figure, Image, Report, Section, Source, write};
use crate::measure::table::{Table, Value, grouped};
use crate::render::gbuffer::{Fragment, GBuffer, Lookup, NONE};
use crate::render::{Backend, Picture, Renderer, composite};
use crate::rng::Rng;
use crate::scene::{Pose, Scene};
use crate::{Result, vertices};
use glam::Vec3;
use rayon::prelude::*;
use std::path::Path;

/// Instances in the table of the page.
const SHOWN: usize = 40;

/// Rays of a pixel of the ray-traced picture.
const TRACED_RAYS: u32 = 64;

/// Files and captions of the parts of obscurance that instances are described by. Figure 2 of the paper shows the second,
/// both together and the ray-traced picture.
const PARTS: [[&str; 2]; 2] = [
    [
        "local_ao",
        "Local: the values that instances of a mesh share",
    ],
    ["global_ao", "Global: what the scene makes of each instance"],
];

/// Draws the pictures and writes the page.
///
/// # Errors
/// `Io` where the folder cannot be written, `Gpu` and `Invalid` where nothing can be drawn.
pub fn create(
    folder: &Path,
    view: &ViewArgs,
    plan: &Plan,
    baked: &Baked,
    reports: &[vertices::server::Report],
    figures: &Figures,
) -> Result<()> {
    files::create_folder(folder)?;
    let (scene, pose) = (plan.scene(), plan.pose());
    let mut renderer = Renderer::new(scene, Backend::Auto)?;
    let eye = view.view(scene)?;
    let (width, height) = view.size;
    let frame = renderer.frame(pose, Lookup::Rest, &eye.at(pose), width, height)?;
    let ao = vertex_ao(scene, pose, &frame.gbuffer, baked);
    let save = |name: &str, caption: &str, picture: Picture| -> Result<Image> {
        picture.write_png(&folder.join(format!("{name}.png")))?;
        Ok(Image {
            caption: caption.into(),
            detail: String::new(),
            source: Source::File(format!("{name}.png")),
        })
    };
    let [without, with] = [None, Some(&ao[..])].map(|ao| frame.composite(ao));
    let mut images = vec![
        save(
            "without_and_with",
            "Without obscurance, and with that of the vertices",
            Picture::halves(&without, &with),
        )?,
        save("vertices", "With that of the vertices", with)?,
        save(
            "vertices_ao",
            "Obscurance alone, interpolated between vertices",
            composite::ao_picture(&frame.gbuffer, &ao),
        )?,
        save("no_ao", "Without", without)?,
    ];
    if let Some(parts) = plan.local_and_global(baked) {
        for ([file, caption], part) in PARTS.into_iter().zip(&parts) {
            let ao = vertex_ao(scene, pose, &frame.gbuffer, part);
            let picture = composite::ao_picture(&frame.gbuffer, &ao);
            images.push(save(file, caption, picture)?);
        }
        let picture = composite::ao_picture(&frame.gbuffer, &traced_ao(plan, &frame.gbuffer)?);
        images.push(save("traced_ao", "Ray-traced for each pixel", picture)?);
    }
    let camera = view.describe(scene, &eye);
    let page = page(
        plan,
        baked,
        reports,
        figures,
        images,
        &camera,
        renderer.name(),
    );
    write(&page, figures, folder)
}

/// The baked value of each fragment; 1 where there is none.
fn vertex_ao(scene: &Scene, pose: &Pose, gbuffer: &GBuffer, baked: &Baked) -> Vec<f32> {
    let value = |fragment: &Fragment| {
        if fragment.instance == NONE {
            return 1.0;
        }
        let (instance, triangle) = (fragment.instance as usize, fragment.triangle as usize);
        let corners = scene.meshes[scene.instances[instance].mesh].triangles[triangle];
        let corners = corners.map(|vertex| vertex as usize);
        let world = &pose.world_from_mesh[instance];
        let shape = pose.shape(scene, instance);
        let weights = weights(
            corners.map(|vertex| world.transform_point3(shape[vertex])),
            fragment.position,
        );
        let signals = &baked.instances[instance].vertices;
        let at = |vertex: usize| {
            let values: Vec<u8> = signals.iter().map(|signal| signal[vertex]).collect();
            shown(&values, baked.blend)
        };
        corners
            .iter()
            .zip(weights)
            .map(|(vertex, weight)| weight * at(*vertex))
            .sum()
    };
    gbuffer.fragments.iter().map(value).collect()
}

/// Obscurance of each fragment, ray-traced; 1 in the sky.
fn traced_ao(plan: &Plan, gbuffer: &GBuffer) -> Result<Vec<f32>> {
    let settings = plan.settings();
    let kernels = settings.vertices.kernels.len();
    plan.with_obscurance(TRACED_RAYS, |obscurance| {
        let pixels = gbuffer.fragments.par_iter().enumerate();
        let value = |(pixel, f): (usize, &Fragment)| {
            if f.instance == NONE {
                return 1.0;
            }
            let seed = Rng::new(pixel as u64).draw() as u32;
            let gather = obscurance.about(f.position, f.geometric_normal, f.normal, seed);
            let tone = &settings.tone;
            tone.shown(&tone.apply(&gather.values[..kernels]))
        };
        pixels.map(value).collect()
    })
}

/// Barycentric weights of the point of a triangle that is next to `point`, roughly: within 0 and 1.
fn weights([a, b, c]: [Vec3; 3], point: Vec3) -> [f32; 3] {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    let weight = |p: Vec3, q: Vec3| (q - p).cross(point - p).dot(normal) / square;
    let weights = [weight(b, c), weight(c, a), weight(a, b)].map(|w| w.clamp(0.0, 1.0));
    let sum: f32 = weights.iter().sum();
    match sum > 0.0 {
        true => weights.map(|w| w / sum),
        false => [1.0 / 3.0; 3],
    }
}

fn page(
    plan: &Plan,
    baked: &Baked,
    reports: &[vertices::server::Report],
    figures: &Figures,
    images: Vec<Image>,
    camera: &str,
    drawn_by: &str,
) -> Report {
    let figure = |label: &str, value: String, unit: &str, note: String| Figure {
        label: label.into(),
        value,
        unit: unit.into(),
        note,
    };
    let count = |n: usize| grouped(n as u64);
    let seconds = &figures.seconds;
    let per_million = seconds.fit / (figures.vertices.max(1) as f64 / 1e6);
    let top = vec![
        figure(
            "Vertices",
            count(figures.vertices),
            "",
            format!(
                "of {} instances; {} after welding",
                figures.instances,
                count(figures.variables)
            ),
        ),
        figure(
            "Samples",
            count(figures.samples),
            "",
            format!(
                "{} of them inside geometry",
                count(figures.samples_inside_geometry)
            ),
        ),
        figure(
            "Tracing",
            format!("{:.1}", seconds.trace),
            "s",
            format!("{} rays", grouped(figures.rays)),
        ),
        figure(
            "Fitting",
            format!("{:.1}", seconds.fit),
            "s",
            format!("{per_million:.1} s a million vertices"),
        ),
        figure(
            "Mean",
            format!("{:.3}", figures.mean),
            "",
            "over the vertices; 1 is open".into(),
        ),
    ];
    let row = |name: &str, value: usize| vec![Value::Text(name.into()), Value::Count(value as u64)];
    let fit = Table {
        title: "Fit".into(),
        columns: vec!["figure".into(), "value".into()],
        rows: vec![
            row("values at 0 or 1", figures.values_at_bounds),
            row("parts not solved to the last digit", figures.inexact_parts),
            row("parts with means of samples", figures.averaged_parts),
            row(
                "vertices from their neighbours",
                figures.vertices_from_neighbours,
            ),
            row(
                "vertices from the mean of their instance",
                figures.vertices_from_mean,
            ),
            row("see-through vertices", figures.vertices_see_through),
        ],
        note: String::new(),
    };
    let mut order: Vec<usize> = (0..reports.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse(reports[i].samples), i));
    let rows = order.iter().take(SHOWN).map(|&i| {
        let mean = f64::from(shown(&baked.instances[i].mean, baked.blend));
        vec![
            Value::Text(plan.scene().instances[i].name.clone()),
            Value::Count(reports[i].vertices as u64),
            Value::Count(reports[i].samples as u64),
            Value::Count(reports[i].invalid as u64),
            Value::Number(mean, 3),
        ]
    });
    let instances = Table {
        title: "Instances".into(),
        columns: ["instance", "vertices", "samples", "inside geometry", "mean"]
            .map(Into::into)
            .to_vec(),
        rows: rows.collect(),
        note: match reports.len() > SHOWN {
            true => format!("The {SHOWN} with the most samples, of {}.", reports.len()),
            false => String::new(),
        },
    };
    let foliage = figures.foliage.iter().map(|f| {
        let text = |text: &str| Value::Text(text.into());
        vec![text(&f.mesh), text(f.kind), text(f.reason)]
    });
    let foliage = Table {
        title: "Foliage".into(),
        columns: ["mesh", "kind", "by"].map(Into::into).to_vec(),
        rows: foliage.collect(),
        note: "Meshes whose instances attenuate rays in place of stopping them.".into(),
    };
    let mut tables = vec![fit, instances];
    if !foliage.rows.is_empty() {
        tables.push(foliage);
    }
    Report {
        title: "Dapple: baked obscurance".into(),
        subtitle: format!("Scene {}, seen by {camera}", plan.scene().name),
        figures: top,
        sections: vec![
            Section {
                title: "Pictures".into(),
                images,
                ..Section::default()
            },
            Section {
                title: "Figures".into(),
                tables,
                ..Section::default()
            },
        ],
        notes: vec![format!("Drawn by {drawn_by}.")],
    }
}
