//! Path-traced pictures: the references that methods are held to.
//!
//! A picture grows in passes, may be put away in a [`state`] file between them, and states its own
//! noise: every pass adds as many samples to each of two halves that share none. A pixel is what
//! its centre sees, as in the G-buffer of the methods that it judges; a box filter over the pixel
//! is an option.
//!
//! Light is kept in two parts ([`Part`]), for methods compute the one and look the other up.

pub mod state;

use super::image::srgb_from_linear;
use super::tone::develop;
use super::view::View;
use crate::scene::CameraPose;
use crate::trace::path::{PathTracer, Random, Vertex};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// What makes one picture another, apart from scene and camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Most surfaces that scatter along a path, the seen one included. 1 is direct light of all
    /// sources.
    pub max_bounces: u32,
    /// Spread samples over the pixel's square instead of its centre.
    pub supersample: bool,
    pub seed: u32,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            max_bounces: 32,
            supersample: false,
            seed: 0,
        }
    }
}

/// Which light of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    All,
    /// What the seen surface emits and what it reflects of punctual lights, shadowed; the sky where
    /// no surface is seen. Without supersampling it has no noise.
    Direct,
    /// What the seen surface reflects of everything else: of other surfaces, emitters and the sky.
    /// It is what probes stand for.
    Indirect,
}

/// Sums over the samples of one half.
#[derive(Clone, Debug, PartialEq)]
struct SampleSums {
    direct: Vec<DVec3>,
    indirect: Vec<DVec3>,
}

/// A path-traced picture to which samples are added.
#[derive(Clone, Debug, PartialEq)]
pub struct PathPicture {
    pub width: u32,
    pub height: u32,
    /// Samples that each half has of each pixel.
    samples: u32,
    halves: [SampleSums; 2],
}

impl PathPicture {
    /// Without samples.
    pub fn new(width: u32, height: u32) -> PathPicture {
        let zero = vec![DVec3::ZERO; width as usize * height as usize];
        let half = SampleSums {
            direct: zero.clone(),
            indirect: zero,
        };
        PathPicture {
            width,
            height,
            samples: 0,
            halves: [half.clone(), half],
        }
    }

    /// Samples per pixel, both halves together.
    pub fn samples(&self) -> u32 {
        2 * self.samples
    }

    /// Adds `samples` samples of each pixel to each half. The camera's aspect is the picture's.
    /// `step` is called with the number of rows that are done since it was last called, from any
    /// thread. The result is the same for any number of threads and any cutting into passes.
    pub fn add(
        &mut self,
        tracer: &PathTracer,
        camera: &CameraPose,
        options: &Options,
        samples: u32,
        step: &(dyn Fn(u64) + Sync),
    ) {
        let view = View::new(camera, self.width, self.height);
        let numbers = self.samples..self.samples + samples;
        let width = self.width.max(1) as usize;
        let [a, b] = &mut self.halves;
        a.direct
            .par_chunks_mut(width)
            .zip(a.indirect.par_chunks_mut(width))
            .zip(b.direct.par_chunks_mut(width))
            .zip(b.indirect.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, (((a_direct, a_indirect), b_direct), b_indirect))| {
                for x in 0..width {
                    let pixel = Pixel::new(tracer, &view, options, x as u32, y as u32);
                    let sums = [
                        (&mut a_direct[x], &mut a_indirect[x]),
                        (&mut b_direct[x], &mut b_indirect[x]),
                    ];
                    for (half, (direct, indirect)) in sums.into_iter().enumerate() {
                        for number in numbers.clone() {
                            let light = pixel.sample(half as u32, number);
                            *direct += light.direct.as_dvec3();
                            *indirect += light.indirect.as_dvec3();
                        }
                    }
                }
                step(1);
            });
        self.samples += samples;
    }

    /// Linear radiance of each pixel, row by row from the top.
    pub fn light(&self, part: Part) -> Vec<Vec3> {
        let [a, b] = &self.halves;
        let mean = |i: usize| (a.sum(part, i) + b.sum(part, i)) / f64::from(self.samples().max(1));
        (0..a.direct.len()).map(|i| mean(i).as_vec3()).collect()
    }

    /// The same of one half alone, 0 or 1.
    pub fn half(&self, half: usize, part: Part) -> Vec<Vec3> {
        let half = &self.halves[half & 1];
        let mean = |i: usize| half.sum(part, i) / f64::from(self.samples.max(1));
        (0..half.direct.len()).map(|i| mean(i).as_vec3()).collect()
    }

    /// Rms noise of the finished picture, in sRGB of 0..=1 through the tone curve: half the rms
    /// difference of the halves (A - B has four times the variance of their mean). Light that
    /// hardly any path has found yet is in neither half, and not in this figure.
    pub fn noise(&self, part: Part, exposure: f32) -> f64 {
        let [a, b] = [0, 1].map(|half| develop(&self.half(half, part), exposure));
        let shown = |c: Vec3| DVec3::from(c.to_array().map(|v| f64::from(srgb_from_linear(v))));
        let sum: f64 = a
            .iter()
            .zip(&b)
            .map(|(a, b)| (shown(*a) - shown(*b)).length_squared() / 3.0)
            .sum();
        0.5 * (sum / a.len().max(1) as f64).sqrt()
    }
}

impl SampleSums {
    fn sum(&self, part: Part, pixel: usize) -> DVec3 {
        match part {
            Part::All => self.direct[pixel] + self.indirect[pixel],
            Part::Direct => self.direct[pixel],
            Part::Indirect => self.indirect[pixel],
        }
    }
}

/// Light of one sample.
#[derive(Clone, Copy)]
struct Light {
    direct: Vec3,
    indirect: Vec3,
}

/// One pixel of a pass.
struct Pixel<'a> {
    tracer: &'a PathTracer<'a>,
    view: &'a View,
    options: &'a Options,
    x: u32,
    y: u32,
    /// What its centre sees, and the direct light there; `None` where samples are spread.
    centre: Option<(Option<Vertex>, Vec3)>,
}

impl<'a> Pixel<'a> {
    fn new(
        tracer: &'a PathTracer<'a>,
        view: &'a View,
        options: &'a Options,
        x: u32,
        y: u32,
    ) -> Self {
        let mut pixel = Pixel {
            tracer,
            view,
            options,
            x,
            y,
            centre: None,
        };
        if !options.supersample {
            pixel.centre = Some(pixel.see([0.5; 2]));
        }
        pixel
    }

    /// The surface at a place of the pixel, and direct light from there.
    fn see(&self, place: [f32; 2]) -> (Option<Vertex>, Vec3) {
        let camera = &self.view.camera;
        let (px, py) = (self.x as f32 + place[0], self.y as f32 + place[1]);
        let direction = camera.ray(px, py, self.view.width, self.view.height);
        let near = camera.znear / direction.dot(self.view.forward());
        let (seen, _) = self
            .tracer
            .first(camera.eye() + direction * near, direction, true);
        match seen {
            Some(vertex) => {
                let direct = vertex.emitted + vertex.unlit + self.tracer.direct(&vertex);
                (Some(vertex), direct)
            }
            None => (None, self.tracer.sky().radiance(direction)),
        }
    }

    fn sample(&self, half: u32, number: u32) -> Light {
        let stream = self.y * self.view.width + self.x;
        let seed = self.options.seed.wrapping_mul(2).wrapping_add(half);
        let mut random = Random::new(seed, stream, number);
        let (vertex, direct) = match self.centre {
            Some(seen) => seen,
            None => self.see(random.pair()),
        };
        let bounces = self.options.max_bounces;
        let indirect = vertex.map_or(Vec3::ZERO, |vertex| {
            self.tracer.scattered(&vertex, &mut random, bounces, false)
        });
        Light { direct, indirect }
    }
}

/// A picture of direct light alone: [`Part::Direct`] without the paths that the rest takes.
/// `samples` a pixel count where they are spread over it; else one is enough.
pub fn direct(
    tracer: &PathTracer,
    camera: &CameraPose,
    (width, height): (u32, u32),
    options: &Options,
    samples: u32,
) -> Vec<Vec3> {
    let options = Options {
        max_bounces: 0,
        ..*options
    };
    let mut picture = PathPicture::new(width, height);
    let samples = if options.supersample {
        samples.div_ceil(2)
    } else {
        1
    };
    picture.add(tracer, camera, &options, samples, &|_| ());
    picture.light(Part::Direct)
}

#[cfg(test)]
mod tests;
