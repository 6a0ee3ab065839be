//! The reference that every method is held to: ambient occlusion ray-traced per pixel (RTAO).

use super::metrics::{Difference, Field, Values, compare_fields, compare_pictures};
use super::stability::noise_of_mean;
use crate::Result;
use crate::render::Frame;
use crate::render::gbuffer::{GBuffer, NONE};
use crate::rng::Rng;
use crate::scene::Pose;
use crate::trace::Tracer;
use rayon::prelude::*;

/// Rays per pixel of the reference (PSAO §4.1).
pub const RAYS: u32 = 512;

/// AO of every pixel by `rays` rays of `distance` metres, 1 in the sky. `tracer` stands at the
/// picture's pose. The halves are independent: their difference is the reference's own noise.
pub fn rtao(
    tracer: &Tracer,
    gbuffer: &GBuffer,
    rays: u32,
    distance: f32,
    seed: u64,
) -> (Vec<f32>, Vec<f32>) {
    let half = |which: u64| {
        gbuffer
            .fragments
            .par_iter()
            .enumerate()
            .map(|(i, f)| {
                if f.instance == NONE {
                    return 1.0;
                }
                let seed = Rng::new(seed ^ which << 62 ^ i as u64).draw() as u32;
                let rays = rays.div_ceil(2);
                tracer.ambient_occlusion(
                    f.position,
                    f.geometric_normal,
                    f.normal,
                    rays,
                    distance,
                    seed,
                )
            })
            .collect()
    };
    (half(1), half(2))
}

/// The AO that two halves of [`rtao`] come to together.
pub fn mean_of_halves(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect()
}

/// A frame with its reference.
pub struct Reference {
    /// Animation time in seconds.
    pub time: f64,
    pub frame: Frame,
    /// RTAO per pixel.
    pub ao: Vec<f32>,
    /// Rms noise of `ao` over geometry, from two independent halves.
    pub noise: f64,
    mask: Vec<bool>,
}

/// How far a method is from the reference in one frame.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Score {
    /// Composited pictures.
    pub picture: Difference,
    /// Linear AO over geometry.
    pub ao: Difference,
}

impl Reference {
    /// Traces the reference of a frame drawn at `pose`, where `tracer` stands, too.
    ///
    /// # Errors
    /// `Invalid` for a picture without geometry.
    pub fn new(
        tracer: &Tracer,
        pose: &Pose,
        frame: Frame,
        rays: u32,
        distance: f32,
        seed: u64,
    ) -> Result<Self> {
        let halves = rtao(tracer, &frame.gbuffer, rays, distance, seed);
        Self::of_halves(pose.time, frame, halves)
    }

    /// A reference by AO per pixel of two independent halves, 1 in the sky.
    ///
    /// # Errors
    /// `Invalid` for a picture without geometry.
    pub fn of_halves(time: f64, frame: Frame, (a, b): (Vec<f32>, Vec<f32>)) -> Result<Self> {
        let mask: Vec<bool> = frame
            .gbuffer
            .fragments
            .iter()
            .map(|f| f.instance != NONE)
            .collect();
        let (width, height) = (frame.gbuffer.width, frame.gbuffer.height);
        let field = |values| Field {
            width,
            height,
            values,
            mask: &mask,
        };
        let noise = noise_of_mean(&field(&a), &field(&b))?;
        let ao = mean_of_halves(&a, &b);
        Ok(Reference {
            time,
            frame,
            ao,
            noise,
            mask,
        })
    }

    /// `values` as a field over this frame's geometry.
    pub fn field<'a>(&'a self, values: &'a [f32]) -> Field<'a> {
        let GBuffer { width, height, .. } = self.frame.gbuffer;
        Field {
            width,
            height,
            values,
            mask: &self.mask,
        }
    }

    /// Scores AO of the same frame.
    pub fn score(&self, ao: &[f32]) -> Result<Score> {
        let picture = self.frame.composite(Some(ao));
        let reference = self.frame.composite(Some(&self.ao));
        Ok(Score {
            picture: compare_pictures(&picture, &reference, Values::Srgb)?,
            ao: compare_fields(&self.field(ao), &self.field(&self.ao))?,
        })
    }
}
