//! The rays of one point.

use super::foliage::Attenuation;
use super::{Kernel, MAX_BACK_SHARE, MAX_KERNELS};
use crate::scene::{Scene, Surface};
use crate::trace::offset::offset_origin;
use crate::trace::sampler::{Frame, Patterns};
use crate::trace::{Ray, Tracer};
use crate::{Error, Result};
use glam::Vec3;

/// Most rays of a point: their directions are kept, sixteen patterns of them.
pub const MAX_RAYS: u32 = 1 << 20;

/// What the rays of a point found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gather {
    /// Mean visibility by each kernel, in their order; 0 beyond the number of kernels.
    pub values: [f32; MAX_KERNELS],
    /// Share of the rays that met a triangle from behind, those of double-sided materials aside.
    pub back_share: f32,
}

impl Gather {
    /// Whether the point is outside geometry: at most [`MAX_BACK_SHARE`] of its rays met the inside
    /// of something (section 2.1).
    pub fn is_valid(&self) -> bool {
        self.back_share <= MAX_BACK_SHARE
    }
}

/// Measures obscurance by a list of kernels in a scene at one pose. It may be shared by threads; the
/// result depends on the point and its seed alone.
pub struct Obscurance<'t, 's> {
    scene: &'s Scene,
    tracer: &'t Tracer<'s>,
    kernels: Vec<Kernel>,
    patterns: Patterns,
    /// Greatest reach of the kernels, in metres.
    reach: f32,
    foliage: Option<&'t Attenuation<'t>>,
}

impl<'t, 's> Obscurance<'t, 's> {
    /// For `rays` rays a point. The tracer must be of this scene.
    ///
    /// # Errors
    /// `Invalid` for no kernel, more than [`MAX_KERNELS`], a distance that is none, or a number of
    /// rays outside 1..=[`MAX_RAYS`].
    pub fn new(
        scene: &'s Scene,
        tracer: &'t Tracer<'s>,
        kernels: &[Kernel],
        rays: u32,
    ) -> Result<Obscurance<'t, 's>> {
        if kernels.is_empty() || kernels.len() > MAX_KERNELS {
            return Err(Error::Invalid(format!(
                "{} distances of obscurance; there must be 1 to {MAX_KERNELS}",
                kernels.len()
            )));
        }
        kernels.iter().try_for_each(|kernel| kernel.check())?;
        if rays == 0 || rays > MAX_RAYS {
            return Err(Error::Invalid(format!(
                "{rays} rays a point; there must be 1 to {MAX_RAYS}"
            )));
        }
        Ok(Obscurance {
            scene,
            tracer,
            kernels: kernels.to_vec(),
            patterns: Patterns::new(rays),
            reach: kernels.iter().fold(0.0, |r, kernel| kernel.reach().max(r)),
            foliage: None,
        })
    }

    /// With foliage that attenuates rays; the tracer must be of the scene without it
    /// ([`super::foliage::Foliage::without`]).
    pub fn with_foliage(mut self, foliage: &'t Attenuation<'t>) -> Self {
        self.foliage = Some(foliage);
        self
    }

    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    pub fn kernels(&self) -> &[Kernel] {
        &self.kernels
    }

    /// Rays of a point.
    pub fn rays(&self) -> u32 {
        self.patterns.rays()
    }

    /// Obscurance at a point of a surface (Eq. 1): cosine-distributed rays about the shading normal,
    /// from the side that its normals are on. Rays that the shading normal leans below the surface
    /// count as blocked, as in [`Tracer::ambient_occlusion`].
    ///
    /// A point that is not finite is open by every kernel.
    pub fn at_surface(&self, surface: &Surface, seed: u32) -> Gather {
        self.about(
            surface.position,
            surface.geometric_normal,
            surface.normal,
            seed,
        )
    }

    /// [`Obscurance::at_surface`] by position and the two unit normals.
    pub fn about(&self, position: Vec3, geometric_normal: Vec3, normal: Vec3, seed: u32) -> Gather {
        if !(position.is_finite() && geometric_normal.is_finite() && normal.is_finite()) {
            return self.open();
        }
        let reach = self.tracer.reach();
        // Points may lie on foliage, too.
        let reach = self.foliage.map_or(reach, |f| reach.max(f.reach()));
        let origin = offset_origin(position, geometric_normal, reach);
        let (directions, turn) = self.patterns.pick(seed);
        let frame = Frame::new(normal, turn);
        let directions = directions.iter().map(|d| frame.to_world(*d));
        self.gather(
            origin,
            directions,
            |d| d.dot(geometric_normal) > 0.0,
            |_, _| (),
        )
    }

    /// Obscurance at a point in space: rays over the whole sphere, uniform. `each` is called for
    /// every ray with its direction and its visibility by each kernel, for those who want more than
    /// the mean (spherical harmonics of it).
    ///
    /// A point that is not finite is open by every kernel, and `each` is not called.
    pub fn in_volume(&self, position: Vec3, seed: u32, each: impl FnMut(Vec3, &[f32])) -> Gather {
        if !position.is_finite() {
            return self.open();
        }
        // The mirror image of +Z in a cosine-distributed normal is uniform over the sphere: with
        // (x, y) uniform over the disk its height 2z^2 - 1 = 1 - 2r^2 is uniform (Archimedes).
        let (directions, turn) = self.patterns.pick(seed);
        let frame = Frame::new(Vec3::Z, turn);
        let directions = directions.iter().map(|d| {
            let d = frame.to_world(*d);
            d * (2.0 * d.z) - Vec3::Z
        });
        self.gather(position, directions, |_| true, each)
    }

    fn open(&self) -> Gather {
        let mut gather = Gather::default();
        gather.values[..self.kernels.len()].fill(1.0);
        gather
    }

    /// Traces every direction for which `leaves` holds; the others are blocked at the origin.
    fn gather(
        &self,
        origin: Vec3,
        directions: impl Iterator<Item = Vec3>,
        leaves: impl Fn(Vec3) -> bool,
        mut each: impl FnMut(Vec3, &[f32]),
    ) -> Gather {
        let mut sums = [0.0f64; MAX_KERNELS];
        let mut backs = 0u32;
        for direction in directions {
            let distance = if leaves(direction) {
                let ray = Ray {
                    origin,
                    direction,
                    t_max: self.reach,
                };
                match self.tracer.closest(&ray) {
                    Some(hit) => {
                        let (instance, triangle) = (hit.instance as usize, hit.triangle as usize);
                        let back = hit.back && !self.scene.is_double_sided(instance, triangle);
                        backs += u32::from(back);
                        hit.t
                    }
                    None => f32::INFINITY,
                }
            } else {
                0.0
            };
            let mut visible = [0.0; MAX_KERNELS];
            for (kernel, visible) in self.kernels.iter().zip(&mut visible) {
                *visible = kernel.visibility(distance);
            }
            if let Some(foliage) = self.foliage.filter(|_| distance > 0.0) {
                for met in foliage.along(origin, direction, distance.min(self.reach)) {
                    for (kernel, visible) in self.kernels.iter().zip(&mut visible) {
                        *visible *= met.visibility(*kernel);
                    }
                }
            }
            for (visible, sum) in visible.iter().zip(&mut sums) {
                *sum += f64::from(*visible);
            }
            each(direction, &visible[..self.kernels.len()]);
        }
        let rays = f64::from(self.rays());
        Gather {
            values: sums.map(|sum| (sum / rays) as f32),
            back_share: (f64::from(backs) / rays) as f32,
        }
    }
}
