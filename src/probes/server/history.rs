//! What a probe remembers of earlier frames, and when it forgets.
//!
//! Hysteresis a keeps the share a of the old light and takes 1 - a of the new (DDISH-GI §5). A high
//! one is calm and late: with 0.99 a light that is switched off glows for seconds. The adaptive one
//! tells a change from noise and starts over:
//!
//! - The noise of one frame's estimate is followed as half the mean square difference between
//!   successive frames, which knows nothing of slow changes and little of sudden ones.
//! - Light has changed when two frames in a row lie farther from the mean than noise explains
//!   ([`GATE`]), and to the same side. One frame alone may be a lucky path to a small lamp.
//! - Then the mean of these two frames replaces the history, and the next frames are averaged with
//!   equal weights until they make up the set hysteresis again. Starting over costs half a frame's
//!   variance where the error that it ends was [`GATE`] times as large.

use glam::Vec3;

/// How the new estimate is mixed with the old.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hysteresis {
    /// This share of the old in every frame but the first, which has none.
    Fixed(f32),
    /// At most this share of the old: equal weights from the first frame or the last change on.
    Adaptive(f32),
}

impl Hysteresis {
    /// The set share of the old.
    pub fn share(self) -> f32 {
        match self {
            Hysteresis::Fixed(a) | Hysteresis::Adaptive(a) => a,
        }
    }
}

/// Squared distance from the mean, in variances of one frame, beyond which it is no noise. For
/// estimates of 9 coefficients with equal noise the squared distance is 1 +- 0.5, and passes 4 in
/// one frame of 10^5; two in a row and to the same side never.
const GATE: f32 = 4.0;
/// Frames before the mean is good enough to tell a change by.
const MIN_AGE: u32 = 4;
/// Share of a frame in the noise that is followed, once so many frames are in it. A jump of d adds
/// d² / 32, far below what makes [`GATE`] miss it; a lucky path adds enough for the mean that it
/// spoils not to be taken for a change of the light.
const NOISE_RATE: f32 = 1.0 / 16.0;
/// Noise below this share of the light is none: not visible, and above rounding.
const NOISE_FLOOR: f32 = 1e-3;

/// The memory of one probe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    /// The light as it is given out; empty before the first frame.
    pub mean: Vec<Vec3>,
    /// The last frame's own estimate.
    recent: Vec<Vec3>,
    /// Variance of one frame's estimate, summed over coefficients and channels.
    noise: f32,
    /// Frames in the mean since it was started.
    age: u32,
}

impl History {
    /// Takes in a frame's estimate, whose noise, by itself, is about `noise`. Returns whether the
    /// history was dropped for a change.
    pub fn update(&mut self, new: Vec<Vec3>, noise: f32, hysteresis: Hysteresis) -> bool {
        if self.age == 0 {
            *self = History {
                mean: new.clone(),
                recent: new,
                noise,
                age: 1,
            };
            return false;
        }
        let step = 0.5 * distance_squared(&new, &self.recent);
        let dropped = matches!(hysteresis, Hysteresis::Adaptive(_)) && self.has_changed(&new);
        if dropped {
            for ((mean, new), recent) in self.mean.iter_mut().zip(&new).zip(&self.recent) {
                *mean = (*new + *recent) * 0.5;
            }
            self.age = 2;
            self.noise = 0.5 * (noise + step);
        } else {
            let old = match hysteresis {
                Hysteresis::Fixed(a) => a,
                Hysteresis::Adaptive(a) => a.min(self.age as f32 / (self.age as f32 + 1.0)),
            };
            for (mean, new) in self.mean.iter_mut().zip(&new) {
                *mean += (*new - *mean) * (1.0 - old);
            }
            self.age = self.age.saturating_add(1);
            let rate = NOISE_RATE.max(1.0 / self.age as f32);
            self.noise += (step - self.noise) * rate;
        }
        self.recent = new;
        dropped
    }

    /// The last frame's own estimate.
    #[cfg(test)]
    pub fn recent(&self) -> &[Vec3] {
        &self.recent
    }

    /// Variance of one frame's estimate as it is followed.
    #[cfg(test)]
    pub fn noise(&self) -> f32 {
        self.noise
    }

    /// Starts over with the next frame.
    pub fn forget(&mut self) {
        self.age = 0;
    }

    fn variance(&self) -> f32 {
        let light: f32 = self.mean.iter().map(|c| c.length_squared()).sum();
        self.noise.max(NOISE_FLOOR * NOISE_FLOOR * light)
    }

    fn has_changed(&self, new: &[Vec3]) -> bool {
        if self.age < MIN_AGE {
            return false;
        }
        let expected = self.variance() * (1.0 + 1.0 / self.age as f32);
        let now = distance_squared(new, &self.mean);
        let before = distance_squared(&self.recent, &self.mean);
        let along: f32 = new
            .iter()
            .zip(&self.recent)
            .zip(&self.mean)
            .map(|((n, r), m)| (*n - *m).dot(*r - *m))
            .sum();
        now.min(before) > GATE * expected && along > 0.5 * (now * before).sqrt()
    }
}

fn distance_squared(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a.distance_squared(*b)).sum()
}
