//! Before the first tick: which points an instance has, and the grid, hash and memory they need.

use super::fit::{Surfaces, fit};
use super::options::{Options, Space};
use super::track::{Template, Track};
use crate::points::chunks::Chunks;
use crate::points::grid::{self, Extent};
use crate::points::place::{area, place};
use crate::points::sample::GridTransform;
use crate::points::store::Store;
use crate::rng::Rng;
use crate::scene::{Pose, Scene};
use crate::trace::Aabb;
use crate::{Error, Result};
use glam::{Mat3, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Entries left free in every bucket of a deforming mesh, for the poses that were not looked at.
const POSED_SPARE: u32 = 2;
/// Most candidates that are placed in a scene, all instances together: about 4 GB of memory at
/// the worst, and as many points as a decoder's default limits accept.
const MAX_CANDIDATES: f64 = (1u32 << 25) as f64;
/// A deforming mesh is placed by another shape than that at rest where its surface grows by more than
/// this factor.
const GROWN: f64 = 1.1;
/// Shapes that differ by less than this share of their size hold the same points.
const SAME_SHAPE: f32 = 1e-4;

/// Lays out the grid, hash and memory of one instance.
pub(super) fn track(
    scene: &Scene,
    rest: &Pose,
    samples: &[Pose],
    instance: usize,
    template: Arc<Template>,
    options: &Options,
) -> Result<Track> {
    let deforms = scene.is_deformed_instance(instance);
    let posed = deforms && options.space == Space::Posed;
    let mesh = &scene.meshes[template.mesh];
    let points = &template.placement.points;
    let scale = if deforms && !posed {
        template.scale * stored_scale(scene, rest, instance)
    } else {
        template.scale
    };
    // Where the points are at every pose looked at, in scaled mesh space.
    let shapes: Vec<Vec<Vec3>> = if posed {
        let poses = samples.iter().chain([rest]);
        poses
            .filter_map(|pose| pose.deformed[instance].as_ref())
            .map(|d| {
                points
                    .iter()
                    .map(|s| scale * s.on(&mesh.triangles, &d.positions))
                    .collect()
            })
            .collect()
    } else {
        // Vertices as stored: what a client has at hand without posing the mesh.
        vec![
            points
                .iter()
                .map(|s| scale * s.on(&mesh.triangles, &mesh.positions))
                .collect(),
        ]
    };
    let mut bounds = Aabb::of(shapes.iter().flatten().copied());
    if posed {
        // Between the sampled poses vertices may reach a little farther.
        let slack = (bounds.max - bounds.min) * 0.1;
        bounds = Aabb {
            min: bounds.min - slack,
            max: bounds.max + slack,
        };
    }
    let extent = Extent {
        min: bounds.min,
        max: bounds.max,
    };
    let mut grid = grid::lay(extent, scale, template.density.radius(), options.widths)
        .ok_or_else(|| {
            Error::Invalid(format!(
                "instance '{}' is {:.0} m across, which is more cells of {:.3} m than a grid can number; \
                 lower --density or split the mesh",
                scene.instances[instance].name,
                (bounds.max - bounds.min).max_element(),
                2.0 * template.density.radius(),
            ))
        })?;
    let to_grid = GridTransform::new(&grid);
    let origin = to_grid.position(Vec3::ZERO);
    let occupancies: Vec<Vec<([u32; 3], u32)>> = shapes
        .iter()
        .map(|shape| {
            let mut cells: Vec<[u32; 3]> = shape
                .iter()
                .filter_map(|&p| grid::cell_at(&grid, p + origin))
                .collect();
            cells.sort_unstable();
            cells
                .chunk_by(|a, b| a == b)
                .map(|same| (same[0], options.overflow.cells_for(same.len())))
                .collect()
        })
        .collect();
    grid.bucket_count =
        grid::search_bucket_count(&grid, &occupancies, if posed { POSED_SPARE } else { 0 });
    let most = occupancies
        .iter()
        .map(|o| o.iter().map(|c| c.1).sum::<u32>())
        .max()
        .unwrap_or(0);
    // A point that never moves needs no spare cells; cells that move do.
    grid.cell_capacity = if posed { most + most / 2 + 64 } else { most };

    let point_count = points.len();
    let chunks = template.chunks.bounds.len();
    Ok(Track {
        instance,
        to_grid,
        grid_scale: scale,
        posed,
        deforms,
        movable: scene.can_move(instance),
        store: Store::new(grid, point_count, options.overflow),
        sent_ao: vec![0; point_count],
        hidden: vec![false; point_count],
        sent_at: if posed {
            vec![(Vec3::ZERO, Vec3::ZERO); point_count]
        } else {
            Vec::new()
        },
        stale: vec![false; point_count],
        stale_chunks: Vec::new(),
        chunk_is_stale: vec![false; chunks],
        template,
    })
}

/// Metres in the bind pose per metre of the stored vertices: inverse bind matrices may hide a scale.
fn stored_scale(scene: &Scene, rest: &Pose, instance: usize) -> f32 {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let area = |positions: &[Vec3]| -> f64 {
        let corners = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| positions[i as usize]));
        corners
            .map(|[a, b, c]| (b - a).cross(c - a).length() as f64)
            .sum()
    };
    let ratio = (area(rest.shape(scene, instance)) / area(&mesh.positions)).sqrt() as f32;
    if ratio.is_finite() && ratio > 0.0 {
        ratio
    } else {
        1.0
    }
}

pub(super) struct Templates {
    pub(super) of_instance: Vec<Option<Arc<Template>>>,
}

/// The scene as points are placed on it: every instance where it is largest within the span that is
/// encoded, by its transform and, of the shapes in `samples`, by its surface.
pub(super) fn placing_pose(
    scene: &Scene,
    rest: &Pose,
    samples: &[Pose],
    time: f64,
    options: &Options,
) -> Pose {
    let mut placing = rest.clone();
    placing.world_from_mesh = scene.largest_placement(time, options.span);
    for i in (0..scene.instances.len()).filter(|&i| scene.is_deforming_instance(i)) {
        let area = |pose: &Pose| area(scene, pose, i, Mat3::IDENTITY);
        let mut largest = GROWN * area(rest);
        for pose in samples {
            let area = area(pose);
            if area > largest {
                largest = area;
                placing.deformed[i].clone_from(&pose.deformed[i]);
            }
        }
    }
    placing
}

/// Places points once for every mesh, scale and shape in `placing`; instances that share all three
/// share their points; those that `takes` does not pick have none. Skins over one mesh may bind it at different sizes.
pub(super) fn templates(
    scene: &Scene,
    rest: &Pose,
    placing: &Pose,
    options: &Options,
    takes: &dyn Fn(usize) -> bool,
) -> Result<Templates> {
    let mut kinds: Vec<(usize, Mat3, usize)> = Vec::new();
    let mut kinds_of: BTreeMap<(usize, [u32; 9]), Vec<usize>> = BTreeMap::new();
    let of_instance: Vec<Option<usize>> = (0..scene.instances.len())
        .map(|i| {
            if !takes(i) {
                return None;
            }
            let (_, scale) = grid::split(&placing.world_from_mesh[i])?;
            let mesh = scene.instances[i].mesh;
            let alike = kinds_of.entry((mesh, scale_key(scale))).or_default();
            let known = alike
                .iter()
                .find(|&&k| same_shape(scene, placing, kinds[k].2, i));
            Some(known.copied().unwrap_or_else(|| {
                kinds.push((mesh, scale, i));
                alike.push(kinds.len() - 1);
                kinds.len() - 1
            }))
        })
        .collect();
    let areas: Vec<f64> = kinds
        .par_iter()
        .map(|&(_, scale, instance)| area(scene, placing, instance, scale))
        .collect();
    let mut instances = vec![0; kinds.len()];
    for &k in of_instance.iter().flatten() {
        instances[k] += 1;
    }
    let densities = if options.fitted {
        let surfaces: Vec<Surfaces> = kinds
            .iter()
            .zip(&areas)
            .zip(&instances)
            .map(|((&(_, scale, instance), &area), &count)| Surfaces {
                area,
                count,
                size: {
                    let shape = placing.shape(scene, instance).iter();
                    let bounds = Aabb::of(shape.map(|p| scale * *p));
                    bounds.max - bounds.min
                },
            })
            .collect();
        fit(&surfaces, options.density)
    } else {
        vec![options.density; kinds.len()]
    };
    let all = areas.iter().zip(&instances).zip(&densities);
    check_candidates(
        scene,
        areas
            .iter()
            .zip(&instances)
            .map(|(a, n)| a * *n as f64)
            .sum(),
        all.map(|((a, n), d)| a * *n as f64 * f64::from(d.candidates))
            .sum(),
    )?;
    let built: Vec<Arc<Template>> = kinds
        .par_iter()
        .enumerate()
        .map(|(k, &(mesh, scale, instance))| {
            let seed = options.seed ^ Rng::new(k as u64).draw();
            let placement = place(scene, placing, instance, scale, densities[k], seed);
            let triangles = &scene.meshes[mesh].triangles;
            let shape = rest.shape(scene, instance);
            let positions: Vec<Vec3> = placement
                .points
                .iter()
                .map(|s| s.on(triangles, shape))
                .collect();
            Arc::new(Template {
                mesh,
                scale,
                density: densities[k],
                chunks: Chunks::new(&positions),
                placement,
                positions,
            })
        })
        .collect();
    Ok(Templates {
        of_instance: of_instance
            .iter()
            .map(|k| k.map(|k| built[k].clone()))
            .collect(),
    })
}

/// Whether two instances of one mesh have the same vertices at rest.
fn same_shape(scene: &Scene, rest: &Pose, a: usize, b: usize) -> bool {
    if rest.deformed[a].is_none() && rest.deformed[b].is_none() {
        return true;
    }
    let (a, b) = (rest.shape(scene, a), rest.shape(scene, b));
    let bounds = Aabb::of(a.iter().copied());
    let tolerance = (bounds.max - bounds.min).length() * SAME_SHAPE;
    a.iter().zip(b).all(|(a, b)| a.abs_diff_eq(*b, tolerance))
}

/// Refuses more surface, in square metres, than memory holds points for, before any is placed.
fn check_candidates(scene: &Scene, area: f64, candidates: f64) -> Result<()> {
    if candidates <= MAX_CANDIDATES {
        return Ok(());
    }
    let remedy = if area.is_finite() {
        format!(
            "; lower the density to at most {:.3e}",
            MAX_CANDIDATES / area
        )
    } else {
        String::new()
    };
    Err(Error::Invalid(format!(
        "{}: {area:.3e} m2 of surface at {} candidates per m2 make more than {MAX_CANDIDATES} \
         candidates{remedy}",
        scene.name,
        (candidates / area) as f32
    )))
}

/// Scales that differ by rounding alone are one scale: within 1/4096 of their power of two.
fn scale_key(scale: Mat3) -> [u32; 9] {
    let entries = scale.to_cols_array();
    let largest = entries
        .iter()
        .fold(f32::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let step = f32::from_bits(largest.to_bits() & 0x7f80_0000) / 4096.0;
    entries.map(|x| ((x / step).round() * step + 0.0).to_bits())
}
