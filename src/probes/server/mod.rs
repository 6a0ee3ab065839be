//! The server: keeps the light at every probe up to date (DDISH-GI §3.1).
//!
//! A frame sends rays from every probe, fits an expansion to what arrives ([`projection`]), mixes it
//! with what the probe remembers ([`history`]) and finds probes inside geometry ([`sight`]). What arrives
//! along a ray is the caller's: a path tracer, or a formula. Where rays start and how far probes see
//! is measured once, from the geometry alone ([`Server::measure_geometry`]). [`fitting`] takes what is
//! traced to values that make the client's look-up right on surfaces.

pub mod fitting;
mod history;
mod projection;
mod sight;

pub use history::Hysteresis;
pub use projection::fit;
pub use sight::Nearest;

use super::sh::{L2, MAX_DEGREE};
use super::visibility::{SIDES, Visibility};
use super::volume::{Volume, spiral};
use crate::rng::Rng;
pub use crate::trace::path::IncomingRadiance;
use crate::{Error, Result};
use glam::Vec3;
use history::History;
use rayon::prelude::*;
use sight::Presence;
use std::time::{Duration, Instant};

/// Reach of the visibility block in diagonals of a cell: a point within the grid asks probes at most
/// one diagonal away, and the rest is for the bias and for points outside.
const RANGE: f32 = 1.5;
/// A disabled probe is traced again every so many frames.
const DISABLED_PERIOD: u32 = 8;

/// What is done with probes inside geometry. Light passes the backs of single-sided materials in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum InsideGeometry {
    /// They are detected and left out of the stream, and see no farther than the backs around them: no
    /// light leaks through geometry.
    #[default]
    Disabled,
    /// They ignore the geometry around them, as in DDISH-GI §5: surfaces on both of its sides have
    /// probes behind them, and light may leak from one side to the other.
    Kept,
}

/// The options of the server.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Rays a probe and frame.
    pub samples: u32,
    pub hysteresis: Hysteresis,
    pub inside: InsideGeometry,
    /// Degree of the expansions, 0 to 4; the format holds 2.
    pub degree: usize,
    /// A probe is given out anew when a coefficient differs from what was given out last by more
    /// than this share of the mean radiance's coefficient. 0: at any change.
    pub threshold: f32,
    /// Texels a side of the visibility block: 4, 8 or 16; 0 for none.
    pub visibility: u32,
    /// What distances in the visibility block are rounded to, in 1/255 of its range: 1 to 255.
    pub visibility_step: u8,
    /// Maps of the visibility block that are measured again in a frame where geometry has moved near them. 0: the
    /// block has what never moves, and no more.
    pub visibility_updates: u32,
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            samples: 256,
            hysteresis: Hysteresis::Fixed(0.99),
            inside: InsideGeometry::Disabled,
            degree: 2,
            threshold: 1.0 / 512.0,
            visibility: 16,
            visibility_step: 1,
            visibility_updates: 0,
            seed: 0,
        }
    }
}

/// Which ray of which probe in which frame: what a ray's random numbers may depend on, and no more. A
/// low-discrepancy sequence by `sample`, another for each probe and frame, suits the directions,
/// which are even over `sample` and turned at random from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draw {
    pub probe: u32,
    pub frame: u32,
    /// 0 to [`Options::samples`].
    pub sample: u32,
}

/// What one frame did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tick {
    pub rays: u64,
    /// Probes that are not disabled.
    pub present: usize,
    /// Probes to send: light or presence differ from what was given out last.
    pub changed: usize,
    /// Probes whose history was dropped because their light changed.
    pub dropped: usize,
    pub update_time: Duration,
}

/// One probe as given out.
#[derive(Clone, Debug, Default)]
struct Probe {
    history: History,
    presence: Presence,
    /// Whether its history was dropped in the last frame.
    dropped: bool,
    rays: u32,
    /// As given out: `(degree + 1)²` coefficients.
    radiance: Vec<Vec3>,
    present: bool,
    changed: bool,
}

/// The probes of one volume.
#[derive(Clone, Debug)]
pub struct Server {
    volume: Volume,
    options: Options,
    probes: Vec<Probe>,
    frame: u32,
    /// The spread of directions before it is turned.
    pattern: Vec<Vec3>,
    /// Where the rays of each probe start.
    starts: Vec<Vec3>,
    /// The visibility block; empty before it is measured.
    codes: Vec<[u8; 2]>,
}

impl Server {
    /// Options out of their range are errors. No ray is sent yet: all is dark.
    pub fn new(volume: Volume, options: Options) -> Result<Server> {
        let share = options.hysteresis.share();
        let wrong = if options.samples == 0 {
            Some("a probe needs at least one sample a frame".to_string())
        } else if !(0.8..=0.998).contains(&share) {
            Some(format!("hysteresis is between 0.8 and 0.998, not {share}"))
        } else if options.visibility_step == 0 {
            Some("a step of distances is at least 1".to_string())
        } else if options.degree > MAX_DEGREE {
            let degree = options.degree;
            Some(format!(
                "degrees go from 0 to {MAX_DEGREE}, not to {degree}"
            ))
        } else if options.visibility != 0 && !SIDES.contains(&options.visibility) {
            let side = options.visibility;
            Some(format!(
                "a visibility block has 4, 8 or 16 texels a side, or 0 for none, not {side}"
            ))
        } else {
            None
        };
        if let Some(message) = wrong {
            return Err(Error::Invalid(message));
        }
        let count = volume.lattice.count();
        let samples = options.samples as usize;
        Ok(Server {
            volume,
            options,
            probes: vec![Probe::default(); count],
            frame: 0,
            pattern: (0..samples).map(|i| spiral(i, samples)).collect(),
            starts: (0..count).map(|probe| volume.position(probe)).collect(),
            codes: Vec::new(),
        })
    }

    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Sends so many rays from a probe from the next frame on, at least one.
    pub fn set_samples(&mut self, samples: u32) {
        self.options.samples = samples.max(1);
        let count = self.options.samples as usize;
        self.pattern = (0..count).map(|i| spiral(i, count)).collect();
    }

    /// Frames so far.
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// The light at a probe as of the last frame that changed it, `(degree + 1)²` coefficients; empty before the first
    /// frame. World axes, which are the grid's.
    pub fn radiance(&self, probe: usize) -> &[Vec3] {
        &self.probes[probe].radiance
    }

    /// The same as the format holds it: cut or filled up to degree 2.
    pub fn l2(&self, probe: usize) -> L2 {
        let radiance = self.radiance(probe);
        std::array::from_fn(|i| radiance.get(i).copied().unwrap_or_default())
    }

    /// Whether the probe stands in the open.
    pub fn is_present(&self, probe: usize) -> bool {
        self.probes[probe].present
    }

    /// Whether the last frame changed what is given out.
    pub fn is_changed(&self, probe: usize) -> bool {
        self.probes[probe].changed
    }

    /// How far the probes see; `None` if it was not asked for, or before
    /// [`Server::measure_geometry`].
    pub fn visibility(&self) -> Option<Visibility<'_>> {
        (!self.codes.is_empty()).then(|| Visibility {
            side: self.options.visibility,
            range: self.range(),
            texels: &self.codes,
        })
    }

    /// Metres that code 255 of the visibility block stands for.
    pub fn range(&self) -> f32 {
        RANGE * self.volume.lattice.spacing.length()
    }

    /// Measures how far probes see, and moves the starts of their rays clear of surfaces: before the
    /// first frame, and again when geometry has moved for good. `nearest(origin, direction)` is the
    /// nearest surface along a ray in world space.
    pub fn measure_geometry(&mut self, nearest: impl Fn(Vec3, Vec3) -> Nearest + Sync) {
        let lattice = &self.volume.lattice;
        let (volume, range, side) = (&self.volume, self.range(), self.options.visibility);
        let step = self.options.visibility_step;
        let start = |probe| sight::start(volume.position(probe), lattice.spacing, &nearest);
        let starts: Vec<Vec3> = (0..lattice.count()).into_par_iter().map(start).collect();
        let texels = (side * side) as usize;
        let mut codes = vec![[255, 0]; lattice.count() * texels];
        if side > 0 {
            let blocks = codes.par_chunks_mut(texels).enumerate();
            blocks.for_each(|(number, block)| {
                let probe = (lattice, lattice.place(number), starts[number]);
                sight::write(block, side, (range, step), probe, &nearest);
            });
        }
        self.starts = starts;
        self.codes = codes;
    }

    /// Measures the maps of some probes again, from where their rays start. Returns the number of rays.
    pub fn measure_maps(
        &mut self,
        probes: &[usize],
        nearest: impl Fn(Vec3, Vec3) -> Nearest + Sync,
    ) -> u64 {
        let (lattice, range) = (&self.volume.lattice, self.range());
        let (side, step) = (self.options.visibility, self.options.visibility_step);
        let texels = (side * side) as usize;
        if self.codes.is_empty() {
            return 0;
        }
        let starts = &self.starts;
        let map = |&number: &usize| {
            let mut map = vec![[255, 0]; texels];
            let probe = (lattice, lattice.place(number), starts[number]);
            sight::write(&mut map, side, (range, step), probe, &nearest);
            map
        };
        let maps: Vec<Vec<[u8; 2]>> = probes.par_iter().map(map).collect();
        for (&number, map) in probes.iter().zip(maps) {
            self.codes[number * texels..][..texels].copy_from_slice(&map);
        }
        probes.len() as u64 * sight::RAYS_A_MAP
    }

    /// One frame. `arrive(origin, direction, draw)` is the light that reaches `origin` from unit
    /// `direction`, both in world space; a sample that is not finite counts as black. It is called
    /// from many threads, and the result depends on what it returns alone.
    pub fn update(&mut self, arrive: impl Fn(Vec3, Vec3, Draw) -> IncomingRadiance + Sync) -> Tick {
        let clock = Instant::now();
        let near = self.volume.lattice.spacing.length();
        let (options, frame) = (&self.options, self.frame);
        let (pattern, starts) = (&self.pattern, &self.starts);

        self.probes
            .par_iter_mut()
            .enumerate()
            .for_each(|(number, probe)| {
                probe.dropped = false;
                probe.changed = false;
                probe.rays = 0;
                let asleep = frame > 0 && !probe.presence.present;
                if asleep && (frame.wrapping_add(number as u32)) % DISABLED_PERIOD != 0 {
                    return;
                }
                let origin = starts[number];
                let directions = turned(pattern, options.seed, number, frame);
                let incoming: Vec<IncomingRadiance> = directions
                    .iter()
                    .zip(0..)
                    .map(|(d, sample)| {
                        let draw = Draw {
                            probe: number as u32,
                            frame,
                            sample,
                        };
                        arrive(origin, *d, draw)
                    })
                    .collect();
                probe.rays = incoming.len() as u32;
                probe.take(&directions, &incoming, near, options);
            });

        self.frame = self.frame.wrapping_add(1);
        let count = |test: fn(&Probe) -> bool| self.probes.iter().filter(|p| test(p)).count();
        Tick {
            rays: self.probes.iter().map(|p| u64::from(p.rays)).sum(),
            present: count(|p| p.present),
            changed: count(|p| p.changed),
            dropped: count(|p| p.dropped),
            update_time: clock.elapsed(),
        }
    }
}

impl Probe {
    /// Takes in the rays of a frame.
    fn take(
        &mut self,
        directions: &[Vec3],
        incoming: &[IncomingRadiance],
        near: f32,
        options: &Options,
    ) {
        let was_present = self.presence.present;
        if options.inside == InsideGeometry::Disabled {
            self.presence.update(incoming, near);
        }
        if !was_present && self.presence.present {
            self.history.forget();
        }
        let finite = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
        let samples: Vec<Vec3> = incoming.iter().map(|a| finite(a.radiance)).collect();
        let estimate = projection::fit(options.degree, directions, &samples);
        self.dropped = self
            .history
            .update(estimate.radiance, estimate.noise, options.hysteresis);

        let mean = &self.history.mean;
        let allowed = options.threshold * mean[0].max_element().max(0.0);
        let differs = self.radiance.len() != mean.len()
            || self
                .radiance
                .iter()
                .zip(mean)
                .any(|(old, new)| (*old - *new).abs().max_element() > allowed);
        let present = self.presence.present;
        self.changed = self.radiance.is_empty() || present != self.present || (present && differs);
        if self.changed {
            self.radiance.clone_from(mean);
            self.present = present;
        }
    }
}

/// The frame's directions of a probe.
fn turned(pattern: &[Vec3], seed: u64, probe: usize, frame: u32) -> Vec<Vec3> {
    let mut rng = Rng::new(Rng::new(seed ^ (probe as u64) << 32 ^ u64::from(frame)).draw());
    let turn = projection::rotation(std::array::from_fn(|_| rng.unit()));
    pattern.iter().map(|d| (turn * *d).normalize()).collect()
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod traced_tests;
