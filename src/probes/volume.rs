//! Irradiance volumes in a scene: a box by hand, or one that fits what can be seen.

use super::lattice::Lattice;
use crate::scene::{Pose, Scene};
use crate::trace::offset::offset_origin;
use crate::trace::{Aabb, Ray, Tracer};
use crate::{Error, Result};
use glam::Vec3;

/// Probes that a volume can have at most, as in the format.
pub const MAX_PROBES: usize = 1 << 24;
/// Share of the spacing that lies between the outermost probes and the box that was fitted: probes
/// stand clear of outer walls, and no surface lies farther than this outside the grid.
pub const INSET: f32 = 0.25;
/// Rays that feel out what can be seen, and how often each is reflected.
const FEELERS: usize = 2048;
const BOUNCES: usize = 4;
/// Share of what was felt that is left out on each side of each axis: what is seen through a
/// keyhole is not worth a grid's resolution.
const OUTLIERS: f32 = 0.002;

/// A grid of probes in world space, its axes the world's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    pub lattice: Lattice,
    /// Position of the first probe.
    pub origin: Vec3,
}

impl Volume {
    /// Probes over a box, the outermost on its faces; along an axis of one probe it stands in the
    /// middle. An empty or infinite box, or dimensions that the format does not hold, are errors.
    pub fn over(bounds: Aabb, dims: [u16; 3]) -> Result<Volume> {
        let count: usize = dims.iter().map(|d| usize::from(*d)).product();
        if count == 0 || count > MAX_PROBES {
            let [x, y, z] = dims;
            return Err(Error::Invalid(format!(
                "a volume of {x}x{y}x{z} probes cannot be: it takes 1 to {MAX_PROBES}"
            )));
        }
        let size = bounds.max - bounds.min;
        if bounds.is_empty() || !size.is_finite() || !bounds.min.is_finite() {
            return Err(Error::Invalid(
                "a volume needs a box of finite, not negative size".into(),
            ));
        }
        let mut spacing = Vec3::ZERO;
        let mut origin = bounds.min;
        for axis in 0..3 {
            if dims[axis] > 1 {
                spacing[axis] = size[axis] / f32::from(dims[axis] - 1);
            } else {
                spacing[axis] = size[axis];
                origin[axis] += 0.5 * size[axis];
            }
            // The format's spacing is positive; where a box is flat, any will do.
            if spacing[axis] <= 0.0 {
                spacing[axis] = 1.0;
            }
        }
        let lattice = Lattice { dims, spacing };
        Ok(Volume { lattice, origin })
    }

    /// Probes over what can be seen of a scene and never moves: the box about it, less [`INSET`] of a
    /// spacing on every side.
    pub fn fit(scene: &Scene, pose: &Pose, tracer: &Tracer, dims: [u16; 3]) -> Result<Volume> {
        let bounds = visible(scene, pose, tracer).ok_or_else(|| {
            Error::Invalid(format!(
                "scene {} has no surface that stands still to fit a volume to; give a box",
                scene.name
            ))
        })?;
        let size = bounds.max - bounds.min;
        let inset = Vec3::from(dims.map(|d| INSET / (f32::from(d.max(1) - 1) + 2.0 * INSET)));
        Volume::over(
            Aabb {
                min: bounds.min + inset * size,
                max: bounds.max - inset * size,
            },
            dims,
        )
    }

    /// World position of a probe.
    pub fn position(&self, index: usize) -> Vec3 {
        self.origin + self.lattice.position(index)
    }

    /// World position to grid space.
    pub fn to_grid(&self, world: Vec3) -> Vec3 {
        world - self.origin
    }

    /// The rows of the format's `grid_from_mesh`, for a track in world space.
    pub fn grid_from_world(&self) -> [[f32; 4]; 3] {
        let o = self.origin;
        [
            [1.0, 0.0, 0.0, -o.x],
            [0.0, 1.0, 0.0, -o.y],
            [0.0, 0.0, 1.0, -o.z],
        ]
    }
}

/// The box about the still surfaces that light can reach from where cameras stand, the scene's own and
/// the one that frames it: the inside of a building, not its outer shell. `None` where there are none.
///
/// Rays are followed from the eyes over a few reflections off diffuse surfaces.
fn visible(scene: &Scene, pose: &Pose, tracer: &Tracer) -> Option<Aabb> {
    let mut eyes: Vec<Vec3> = pose.cameras.iter().map(|c| c.eye()).collect();
    if eyes.is_empty() {
        eyes.push(scene.framing_camera(pose).eye());
    }
    let mut felt: [Vec<f32>; 3] = Default::default();
    for i in 0..FEELERS {
        let mut origin = eyes[i % eyes.len()];
        let mut direction = spiral(i, FEELERS);
        for bounce in 0..BOUNCES {
            let ray = Ray {
                origin,
                direction,
                t_max: f32::INFINITY,
            };
            let Some(hit) = tracer.closest(&ray) else {
                break;
            };
            let instance = hit.instance as usize;
            let at = scene
                .surface(pose, instance, hit.triangle as usize, hit.u, hit.v)
                .facing(direction);
            let moves = scene.can_move(instance);
            if !moves && !scene.materials[at.material].is_see_through() {
                (0..3).for_each(|axis| felt[axis].push(at.position[axis]));
            }
            let n = at.geometric_normal;
            origin = offset_origin(at.position, n, tracer.reach());
            // Uniform on the unit sphere about the normal's tip is cosine-distributed.
            let number = i * 7919 + bounce * 104_729 + 1;
            direction = (n + spiral(number % FEELERS, FEELERS)).normalize_or(n);
        }
    }
    if felt[0].is_empty() {
        return None;
    }
    let mut bounds = Aabb::EMPTY;
    for (axis, values) in felt.iter_mut().enumerate() {
        values.sort_by(f32::total_cmp);
        let cut = (values.len() as f32 * OUTLIERS) as usize;
        bounds.min[axis] = values[cut];
        bounds.max[axis] = values[values.len() - 1 - cut];
    }
    Some(bounds)
}

/// Evenly spread unit directions: the spherical Fibonacci lattice.
pub fn spiral(i: usize, n: usize) -> Vec3 {
    let z = 1.0 - (2 * i + 1) as f64 / n as f64;
    let turn = (i as f64 * 0.618_033_988_749_894_8).fract();
    let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
    let r = (1.0 - z * z).sqrt();
    Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32)
}
