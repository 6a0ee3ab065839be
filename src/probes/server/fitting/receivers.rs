//! Places on surfaces whose light the probes shall reproduce, and what is known of it.

use super::Place;
use crate::probes::server::Hysteresis;
use crate::probes::volume::Volume;
use crate::trace::path::Random;
use glam::Vec3;

/// A place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Grid space.
    pub x: Vec3,
    /// World space, where rays start that leave the surface.
    pub origin: Vec3,
    /// Unit, on the side that is lit.
    pub geometric_normal: Vec3,
    /// Unit, for shading.
    pub normal: Vec3,
    /// Unit, towards a place from which it is seen.
    pub view: Vec3,
    /// Irradiance, a mean over paths.
    pub irradiance: Vec3,
    /// Frames in the mean.
    pub age: u32,
    /// Whether something stands on it now, so that no one sees it.
    pub covered: bool,
}

/// Share of a frame's paths that meet backs of surfaces from which a receiver is taken to be covered.
const COVERED: f32 = 0.5;

impl Receiver {
    /// A receiver where a ray of `direction` met a surface.
    pub fn new(place: &Place, direction: Vec3, volume: &Volume) -> Receiver {
        Receiver {
            x: volume.to_grid(place.position),
            origin: place.origin,
            geometric_normal: place.geometric_normal,
            normal: place.normal,
            view: -direction,
            irradiance: Vec3::ZERO,
            age: 0,
            covered: false,
        }
    }

    /// A direction about the normal, as probable as its cosine, from two numbers in 0..1; `None`
    /// below the surface.
    pub fn direction(&self, random: &mut Random) -> Option<Vec3> {
        let [u, v] = random.pair();
        let z = 1.0 - 2.0 * u;
        let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
        let around = Vec3::new(cos, sin, 0.0) * (1.0 - z * z).max(0.0).sqrt() + Vec3::Z * z;
        // Uniform on the sphere about the normal's tip is cosine-distributed.
        let direction = (self.normal + around).try_normalize()?;
        (direction.dot(self.geometric_normal) > 0.0).then_some(direction)
    }

    /// Takes in the mean irradiance of a frame's paths; `backs` is the share of them that met the
    /// back of a surface.
    pub fn update(&mut self, irradiance: Vec3, backs: f32, hysteresis: Hysteresis) {
        let covered = backs > COVERED;
        if covered != self.covered {
            self.age = 0;
        }
        self.covered = covered;
        // Equal weights until they make up the hysteresis: also a fixed one begins so, for the first
        // frame of a receiver has few paths.
        let old = hysteresis
            .share()
            .min(self.age as f32 / (self.age as f32 + 1.0));
        self.irradiance += (irradiance - self.irradiance) * (1.0 - old);
        self.age = self.age.saturating_add(1);
    }
}
