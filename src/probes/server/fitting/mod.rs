//! Probes fitted to the surfaces that they light.
//!
//! A client looks up between probes, and light at the places of probes says little of folds, corners
//! and what stands between. So probes need not hold the light at their place: here they get the
//! values that make the look-up right on surfaces (Kavan et al. 2011, *Least Squares Vertex Baking*,
//! one dimension up). For irradiance E_r at receivers r on surfaces, M the client's own look-up and c
//! the coefficients of all probes, they minimise
//!
//! ```text
//! sum_r w_r |M_r c - E_r|² + strength * sum_p |c_p - traced_p|²
//! ```
//!
//! The weights w are equal and add up to the number of probes that stand in the open, so that strength
//! has no unit. The second term keeps what no receiver says anything of, and stands for the air
//! between surfaces and for glossy light. Measured in Sponza with 16x8x8 probes and trilinear look-up
//! (PSNR of the picture, 19.7 dB traced with as many paths a probe): 21.7 dB for any strength from 0.1
//! to 3. Weights by the area that a receiver stands for lose 0.4 dB, by its square root 0.1, by albedo
//! 0.4; a second term of irradiance instead of coefficients, 0.1 at its best and up to 2.6 where it is
//! weak.
//!
//! [`receivers`] are the places, [`rows`] the look-up as a linear map, [`solve`] the least squares,
//! [`choose`] the strength, by receivers that are held out. None of it has a trace in the format.

mod choose;
mod receivers;
mod rows;
mod solve;

pub use choose::Choice;

use super::{IncomingRadiance, Server, turned};
use crate::probes::sample::Field;
use crate::probes::sh::{L2, L2_COUNT};
use crate::probes::volume::spiral;
use crate::trace::path::Random;
use glam::Vec3;
use rayon::prelude::*;
use receivers::Receiver;
use rows::Rows;
use std::f32::consts::PI;

/// Paths of a probe and frame for each ray of it that looks for receivers.
const PATHS_OF_RECEIVER: usize = 4;
/// Least and most rays of a probe that look for receivers.
const FEWEST: usize = 4;
const MOST: usize = 64;
/// Share in a receiver's light from which a probe whose history was dropped makes it forget, too.
const NEAR: f32 = 0.1;
/// Bit that tells random numbers of receivers from those of probes.
const STREAM: u32 = 1 << 31;

/// A surface that a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// World space.
    pub position: Vec3,
    /// Where rays start that leave the surface.
    pub origin: Vec3,
    /// Unit, on the side that was met.
    pub geometric_normal: Vec3,
    /// Unit, for shading.
    pub normal: Vec3,
}

/// The receivers of a volume and the fit to them.
#[derive(Clone, Debug)]
pub struct Fitting {
    receivers: Vec<Receiver>,
    /// Paths of each receiver in a frame.
    paths: u32,
    seed: u32,
    frame: u32,
    known: Known,
    rows: Option<Rows>,
    /// What the last fit added to the traced light.
    change: Vec<L2>,
    choice: Option<Choice>,
}

/// What rows depend on besides the receivers.
#[derive(Clone, Debug, Default, PartialEq)]
struct Known {
    present: Vec<bool>,
    codes: Vec<[u8; 2]>,
}

impl Fitting {
    /// Receivers where rays from the probes meet surfaces, as dense as probes see them. `server` has
    /// traced a frame. `meet(origin, direction)` is the first surface on a ray that a client shades
    /// with this light and that never moves.
    pub fn new(server: &Server, meet: impl Fn(Vec3, Vec3) -> Option<Place> + Sync) -> Fitting {
        let options = server.options();
        let samples = options.samples as usize;
        let rays = (samples / PATHS_OF_RECEIVER).clamp(FEWEST, MOST);
        let pattern: Vec<Vec3> = (0..rays).map(|i| spiral(i, rays)).collect();
        let probes: Vec<usize> = (0..server.probes.len())
            .filter(|&p| server.is_present(p))
            .collect();
        let found = |&probe: &usize| {
            let directions = turned(&pattern, !options.seed, probe, 0);
            let origin = server.starts[probe];
            let look = |d: Vec3| Some(Receiver::new(&meet(origin, d)?, d, &server.volume));
            directions.into_iter().filter_map(look).collect::<Vec<_>>()
        };
        let lists: Vec<Vec<Receiver>> = probes.par_iter().map(found).collect();
        let receivers = lists.concat();
        let paths = samples * probes.len() / receivers.len().max(1);
        Fitting {
            receivers,
            paths: paths.max(1) as u32,
            seed: options.seed as u32,
            frame: 0,
            known: Known::default(),
            rows: None,
            change: vec![[Vec3::ZERO; L2_COUNT]; server.probes.len()],
            choice: None,
        }
    }

    /// Number of receivers.
    pub fn len(&self) -> usize {
        self.receivers.len()
    }

    /// Whether the probes see no surface.
    pub fn is_empty(&self) -> bool {
        self.receivers.is_empty()
    }

    /// The choice of [`Fitting::choose`].
    pub fn choice(&self) -> Option<Choice> {
        self.choice
    }

    /// Traces a frame of the receivers' light, after one of the server. `arrive(origin, direction,
    /// random)` is the light that reaches a surface. Returns the number of rays.
    pub fn update(
        &mut self,
        server: &Server,
        arrive: impl Fn(Vec3, Vec3, Random) -> IncomingRadiance + Sync,
    ) -> u64 {
        self.refresh(server);
        let (paths, seed, frame) = (self.paths, self.seed, self.frame);
        let rows = self.rows.as_ref();
        let near = server.volume.lattice.spacing.length();
        let receivers = self.receivers.par_iter_mut().enumerate();
        let rays = receivers.map(|(number, receiver)| {
            let (mut sum, mut backs, mut rays) = (Vec3::ZERO, 0, 0);
            for path in 0..paths {
                let sample = frame.wrapping_mul(paths).wrapping_add(path);
                let mut random = Random::new(seed, STREAM | number as u32, sample);
                let Some(direction) = receiver.direction(&mut random) else {
                    continue;
                };
                let light = arrive(receiver.origin, direction, random);
                rays += 1;
                backs += u32::from(light.back_face && light.distance <= near);
                if light.radiance.is_finite() {
                    sum += light.radiance;
                }
            }
            let mut probes = rows.into_iter().flat_map(|r| r.probes_of(number, NEAR));
            if probes.any(|probe| server.probes[probe].dropped) {
                receiver.age = 0;
            }
            let share = backs as f32 / paths as f32;
            let irradiance = (sum * (PI / paths as f32)).min(Vec3::splat(f32::MAX));
            receiver.update(irradiance, share, server.options.hysteresis);
            rays
        });
        let rays = rays.sum();
        self.frame = self.frame.wrapping_add(1);
        rays
    }

    /// Chooses between traced and fitted light, and the strength of the fit.
    pub fn choose(&mut self, server: &Server) -> Choice {
        self.refresh(server);
        let traced = traced(server);
        let choice = match &self.rows {
            Some(rows) => choose::choose(rows, &self.weights(server), &self.wanted(), &traced),
            None => Choice::default(),
        };
        self.choice = Some(choice);
        choice
    }

    /// The light of all probes, fitted with the chosen strength.
    pub fn fit(&mut self, server: &Server) -> Vec<L2> {
        self.refresh(server);
        let mut light = traced(server);
        let (Some(choice), Some(rows)) = (self.choice, &self.rows) else {
            return light;
        };
        let mut missing = self.wanted();
        for (wanted, got) in missing.iter_mut().zip(rows.look_up(&light)) {
            *wanted -= got;
        }
        let start = std::mem::take(&mut self.change);
        let weights = self.weights(server);
        self.change = solve::solve(rows, &weights, &missing, choice.strength, start);
        for (light, change) in light.iter_mut().zip(&self.change) {
            for (l, c) in light.iter_mut().zip(change) {
                *l += *c;
            }
        }
        light
    }

    fn wanted(&self) -> Vec<Vec3> {
        self.receivers.iter().map(|r| r.irradiance).collect()
    }

    /// The weights of receivers: equal, 0 for those that are covered.
    fn weights(&self, server: &Server) -> Vec<f32> {
        let present = server.probes.iter().filter(|p| p.present).count();
        let one = present as f32 / self.receivers.len().max(1) as f32;
        let weight = |r: &Receiver| if r.covered { 0.0 } else { one };
        self.receivers.iter().map(weight).collect()
    }

    /// Makes the rows anew where presence or visibility has changed.
    fn refresh(&mut self, server: &Server) {
        let known = Known {
            present: server.probes.iter().map(|p| p.present).collect(),
            codes: server.codes.clone(),
        };
        if self.rows.is_some() && known == self.known {
            return;
        }
        let field = Field {
            lattice: server.volume.lattice,
            radiance: &[],
            present: &known.present,
            visibility: server.visibility(),
        };
        self.rows = Some(Rows::new(&field, &self.receivers));
        self.known = known;
    }
}

/// The light at the places of all probes.
pub fn traced(server: &Server) -> Vec<L2> {
    (0..server.probes.len()).map(|p| server.l2(p)).collect()
}

#[cfg(test)]
mod tests;
