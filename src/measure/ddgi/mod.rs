//! Dynamic Diffuse Global Illumination, the method that DDISH-GI is compared with: Majercik et al.,
//! "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields" (JCGT 8(2), 2019), with
//! the glossy approximation of "Scaling Probe-Based Real-Time Dynamic Global Illumination for
//! Production" (2021), as DDISH-GI §5 compares against it.
//!
//! A baseline that is weak voids what is measured against it, so where the papers leave a choice it
//! is the one that gives the better picture: radiance is blended in linear light, which has no bias;
//! texels are interpolated bilinearly with exact wrapping; metals reflect at the ends of probe rays.
//!
//! - [`blend`]: probe rays into the texels of a probe (§4.1 of the first paper)
//! - [`sample`]: irradiance at a place from the eight probes around it (§5 of the first paper)

mod blend;
mod octahedron;
mod sample;
#[cfg(test)]
mod tests;

use crate::codec::probes::f16_from_f32;
use crate::rng::Rng;
use glam::{Mat3, Quat, UVec3, Vec3};
use octahedron::Octahedron;
use rayon::prelude::*;

/// Texels along the side of a probe's irradiance map (§5 of DDISH-GI).
pub const IRRADIANCE_SIDE: usize = 8;
/// Texels along the side of a probe's visibility map.
pub const VISIBILITY_SIDE: usize = 16;

/// Where the probes are, and how they are updated.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Position of probe (0, 0, 0), world space.
    pub origin: Vec3,
    /// Metres between neighbours.
    pub spacing: Vec3,
    pub dims: UVec3,
    /// Rays a probe and frame.
    pub rays: u32,
    /// Share of the old value that an update keeps.
    pub hysteresis: f32,
    pub seed: u64,
}

/// The end of a probe ray.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Metres; infinite where the ray leaves the scene.
    pub distance: f32,
    /// It is the back of a surface, which sends no light and passes for near (RTXGI).
    pub back_face: bool,
    /// World space; anything where the ray leaves the scene.
    pub position: Vec3,
    /// Unit, turned to the ray.
    pub normal: Vec3,
    /// Emission and reflected light of the scene's lights, or the sky.
    pub radiance: Vec3,
    /// Diffuse albedo.
    pub diffuse: Vec3,
    /// Share of glossily reflected light: the environment BRDF at the end of the ray.
    pub glossy: Vec3,
}

/// Irradiance and visibility of all probes.
pub struct Ddgi {
    options: Options,
    irradiance_map: Octahedron,
    visibility_map: Octahedron,
    /// `IRRADIANCE_SIDE^2` texels a probe: irradiance of a surface that faces the texel.
    irradiance: Vec<Vec3>,
    /// `VISIBILITY_SIDE^2` texels a probe: mean distance and mean squared distance, metres.
    visibility: Vec<[f32; 2]>,
    /// Probes that no place is lit by; those beyond the end are not among them.
    disabled: Vec<bool>,
    frame: u32,
}

impl Ddgi {
    pub fn new(options: Options) -> Ddgi {
        let probes = options.dims.element_product() as usize;
        let irradiance_map = Octahedron::new(IRRADIANCE_SIDE);
        let visibility_map = Octahedron::new(VISIBILITY_SIDE);
        Ddgi {
            irradiance: vec![Vec3::ZERO; probes * irradiance_map.texels()],
            visibility: vec![[0.0; 2]; probes * visibility_map.texels()],
            options,
            irradiance_map,
            visibility_map,
            disabled: Vec::new(),
            frame: 0,
        }
    }

    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Leaves the probes that are marked out of every look-up, as RTXGI's classification does.
    pub fn disable(&mut self, disabled: Vec<bool>) {
        self.disabled = disabled;
    }

    /// Keeps another share of the old values from now on.
    pub fn set_hysteresis(&mut self, share: f32) {
        self.options.hysteresis = share;
    }

    /// The textures of irradiance and of distances as the method keeps them (§4 of DDISH-GI: "a minimum
    /// of 1280 bytes" a probe): 64 texels of RGB10A2, the fifth root of the share of the brightest
    /// as in RTXGI, and 256 of two f16. Disabled probes are left out.
    pub fn textures(&self) -> [Vec<u8>; 2] {
        let kept = |probe: usize| !self.disabled.get(probe).is_some_and(|d| *d);
        let brightest = self.irradiance.iter().map(|c| c.max_element());
        let scale = brightest.fold(f32::MIN_POSITIVE, f32::max).recip();
        let packed = |c: &Vec3| {
            let [r, g, b] = c.to_array().map(|c| {
                let share = (c * scale).clamp(0.0, 1.0).powf(0.2);
                (share * 1023.0).round() as u32
            });
            (r | g << 10 | b << 20).to_le_bytes()
        };
        let of_kept = |texels: usize| move |i: &usize| kept(i / texels);
        let light = (0..self.irradiance.len()).filter(of_kept(self.irradiance_map.texels()));
        let distances = (0..self.visibility.len()).filter(of_kept(self.visibility_map.texels()));
        [
            light.flat_map(|i| packed(&self.irradiance[i])).collect(),
            distances
                .flat_map(|i| self.visibility[i].map(|m| f16_from_f32(m).to_le_bytes()))
                .flatten()
                .collect(),
        ]
    }

    /// One frame: traces every probe's rays and blends what they found. Light that was reflected
    /// more than once comes from the probes as the last frame left them.
    pub fn update(&mut self, trace: impl Fn(Vec3, Vec3) -> End + Sync) {
        let directions = self.directions();
        let probes = self.options.dims.element_product() as usize;
        let this = &*self;
        let blended: Vec<(Vec<Vec3>, Vec<[f32; 2]>)> = (0..probes)
            .into_par_iter()
            .map(|probe| {
                let origin = this.position(probe);
                let rays: Vec<(Vec3, End)> = directions
                    .iter()
                    .map(|&direction| {
                        let mut end = trace(origin, direction);
                        if end.distance.is_finite() && !end.back_face {
                            end.radiance += this.reflected(&end, direction);
                        }
                        (direction, end)
                    })
                    .collect();
                this.blend(probe, &rays)
            })
            .collect();
        for (probe, (irradiance, visibility)) in blended.into_iter().enumerate() {
            let (i, v) = (irradiance.len(), visibility.len());
            self.irradiance[probe * i..][..i].copy_from_slice(&irradiance);
            self.visibility[probe * v..][..v].copy_from_slice(&visibility);
        }
        self.frame += 1;
    }

    /// Indirect light that the end of a probe ray sends back along the ray.
    fn reflected(&self, end: &End, direction: Vec3) -> Vec3 {
        if self.frame == 0 {
            return Vec3::ZERO;
        }
        let diffuse = self.irradiance(end.position, end.normal, -direction);
        let mirrored = direction - 2.0 * direction.dot(end.normal) * end.normal;
        let glossy = self.glossy(end.position, end.normal, mirrored, -direction);
        end.diffuse * diffuse / std::f32::consts::PI + end.glossy * glossy
    }

    /// A spherical Fibonacci set, turned at random each frame (§4.1).
    fn directions(&self) -> Vec<Vec3> {
        let mut random = Rng::new(self.options.seed ^ u64::from(self.frame) << 20);
        // A uniform rotation (Shoemake 1992).
        let (a, b, c) = (random.unit(), random.unit(), random.unit());
        let (s, t) = ((1.0 - a).sqrt(), a.sqrt());
        let (b, c) = (b * std::f32::consts::TAU, c * std::f32::consts::TAU);
        let turn = Mat3::from_quat(Quat::from_xyzw(
            s * b.sin(),
            s * b.cos(),
            t * c.sin(),
            t * c.cos(),
        ));
        let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
        let count = self.options.rays;
        (0..count)
            .map(|i| {
                let z = 1.0 - (2.0 * i as f32 + 1.0) / count as f32;
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (sin, cos) = (golden * i as f32).sin_cos();
                turn * Vec3::new(r * cos, r * sin, z)
            })
            .collect()
    }

    /// Position of a probe, world space; x runs fastest.
    fn position(&self, probe: usize) -> Vec3 {
        let probe = probe as u32;
        let dims = self.options.dims;
        let at = UVec3::new(
            probe % dims.x,
            probe / dims.x % dims.y,
            probe / (dims.x * dims.y),
        );
        self.options.origin + at.as_vec3() * self.options.spacing
    }

    /// Distances are cut off here: no more is ever compared (1.5 times the cell's diagonal, as in
    /// G3D).
    fn reach(&self) -> f32 {
        1.5 * self.options.spacing.length()
    }
}
