//! Values of a lower level of detail from those of the full mesh (section 2.1, "Resample LOD").
//!
//! The lower level is not traced again: samples on its faces take the values of the nearest surface of
//! the full mesh, and a fit of its own makes vertices of them. Taking values at its vertices alone
//! is worse, for the same reason as in the bake.

use super::{InstanceBake, Sample, Sampling, Shape, fit_instance, place};
use crate::scene::{Pose, Scene};
use crate::trace::offset::offset_origin;
use crate::trace::{Hit, Ray, Tracer};
use crate::{Error, Result};
use rayon::prelude::*;

/// How values are carried over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resampling {
    pub sampling: Sampling,
    /// Weight of the regulariser.
    pub alpha: f64,
    /// Metres from the lower level, along its normal, within which the full mesh is looked for.
    pub distance: f32,
}

/// Values of the instance `target`, from the bake of the instance `source`, which shows the same
/// object. Both are instances of the tracer's scene at its pose; only sides that face the same way
/// count. Samples that meet nothing of the source count as invalid in the report.
///
/// # Errors
/// `Invalid` for an instance that the scene lacks, values that are not those of the source, or a
/// distance that is not a positive number of metres.
pub fn resample(
    scene: &Scene,
    pose: &Pose,
    tracer: &Tracer,
    source: usize,
    values: &[Vec<f32>],
    target: usize,
    settings: &Resampling,
) -> Result<InstanceBake> {
    let refuse = |message: String| Err(Error::Invalid(message));
    let count = scene.instances.len();
    if source >= count || target >= count {
        return refuse(format!("there is no instance {}", source.max(target)));
    }
    let mesh = &scene.meshes[scene.instances[source].mesh];
    if values.is_empty() || values.iter().any(|v| v.len() != mesh.positions.len()) {
        return refuse(format!("the values are not of the mesh {}", mesh.name));
    }
    let distance = settings.distance;
    if !(distance > 0.0 && distance.is_finite()) {
        return refuse(format!("the distance is {distance} m; it must be positive"));
    }
    let shape = Shape::new(scene, pose, target);
    let sites = place::place(scene, target, &shape, settings.sampling);
    let found: Vec<Option<Vec<f32>>> = sites
        .par_iter()
        .map(|site| {
            let surface = site.surface(scene, pose, target);
            let hit = nearest(tracer, scene, source, &surface, distance)?;
            let corners = mesh.triangles[hit.triangle as usize].map(|v| v as usize);
            let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
            let at = |values: &Vec<f32>| (0..3).map(|k| weights[k] * values[corners[k]]).sum();
            Some(values.iter().map(at).collect())
        })
        .collect();
    let samples = sites.iter().zip(&found).filter_map(|(site, values)| {
        let values = values.as_deref()?;
        Some(Sample { site, values })
    });
    let signals = values.len();
    Ok(fit_instance(
        &shape,
        sites.len(),
        samples,
        signals,
        settings.alpha,
    ))
}

/// The hit on the source nearest along the normal, before or behind the point, on a side that faces
/// as the point does.
fn nearest(
    tracer: &Tracer,
    scene: &Scene,
    source: usize,
    surface: &crate::scene::Surface,
    distance: f32,
) -> Option<Hit> {
    let (at, normal) = (surface.position, surface.geometric_normal);
    let one_way = |direction: glam::Vec3, from_behind: bool| {
        // Starts on the other side of the point, so that a surface through it is met.
        let origin = offset_origin(at, -direction, tracer.reach());
        let ray = Ray {
            origin,
            direction,
            t_max: distance,
        };
        tracer.closest_of(&ray, |instance, triangle, back| {
            instance as usize == source
                && (back == from_behind
                    || scene.is_double_sided(instance as usize, triangle as usize))
        })
    };
    // What lies before the point and faces the same way is met from behind.
    let (before, behind) = (one_way(normal, true), one_way(-normal, false));
    match (before, behind) {
        (Some(a), Some(b)) => Some(if b.t < a.t { b } else { a }),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::obscurance::shapes::{floor, scene};
    use glam::Vec3;

    #[test]
    fn coarse_floor_takes_the_function_of_the_fine_one() {
        let f = |p: Vec3| 0.2 + 0.05 * p.x + 0.02 * p.z;
        let fine = floor(Vec3::ZERO, 8.0, 32);
        let values = vec![
            fine.positions.iter().map(|p| f(*p)).collect(),
            vec![0.5; fine.positions.len()],
        ];
        for height in [-0.05f32, 0.0, 0.05] {
            let coarse = floor(Vec3::new(0.0, height, 0.0), 8.0, 3);
            let (scene, pose) = scene(vec![fine.clone(), coarse]);
            let tracer = Tracer::new(&scene, &pose);
            let settings = Resampling {
                sampling: Sampling::default(),
                alpha: 1.0,
                distance: 0.1,
            };
            let run =
                |settings: Resampling| resample(&scene, &pose, &tracer, 0, &values, 1, &settings);
            let got = run(settings).expect("two floors");
            assert_eq!(got.report.invalid, 0);
            let expected = scene.meshes[1].positions.iter().map(|p| f(*p));
            for ((value, other), expected) in got.values[0].iter().zip(&got.values[1]).zip(expected)
            {
                assert!((value - expected).abs() < 1e-3, "{value} {expected}");
                assert!((other - 0.5).abs() < 1e-6);
            }
            let near = run(Resampling {
                distance: 0.01,
                ..settings
            });
            let missed = near.expect("two floors").report.invalid;
            assert_eq!(missed > 0, height != 0.0);
            assert!(
                run(Resampling {
                    distance: 0.0,
                    ..settings
                })
                .is_err()
            );
        }
    }
}
