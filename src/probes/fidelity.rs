//! How near the irradiance that clients get is to the server's own: PSNR over directions, probes and
//! frames.

use super::sh::{self, L2};
use glam::Vec3;

/// Directions in which irradiance is compared.
const DIRECTIONS: usize = 64;
/// Steps of an octave in which values are counted, to find the peak: it is known to 0.3 %.
const STEPS: f32 = 256.0;
/// Octaves below 1 where counting starts.
const BELOW: f32 = 40.0;

/// Sums over all that was compared.
#[derive(Clone, Debug)]
pub struct Fidelity {
    directions: Vec<Vec3>,
    counts: Vec<u64>,
    /// Numbers compared: a colour counts three times.
    numbers: u64,
    squared_error: f64,
    squared: f64,
}

impl Default for Fidelity {
    fn default() -> Self {
        let direction = |i: usize| {
            let z = 1.0 - (2.0 * i as f32 + 1.0) / DIRECTIONS as f32;
            let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        };
        Fidelity {
            directions: (0..DIRECTIONS).map(direction).collect(),
            counts: vec![0; (2.0 * BELOW * STEPS) as usize + 1],
            numbers: 0,
            squared_error: 0.0,
            squared: 0.0,
        }
    }
}

impl Fidelity {
    /// Compares one probe.
    pub fn add(&mut self, exact: &L2, got: &L2) {
        for &direction in &self.directions {
            let a = sh::irradiance(exact, direction);
            let error = sh::irradiance(got, direction) - a;
            self.squared_error += f64::from(error.length_squared());
            self.squared += f64::from(a.length_squared());
            for value in a.to_array() {
                let step = (value.max(0.0).log2() + BELOW) * STEPS;
                let last = self.counts.len() - 1;
                // Black, and the logarithm of it, count as the lowest.
                self.counts[(step.max(0.0) as usize).min(last)] += 1;
                self.numbers += 1;
            }
        }
    }

    /// PSNR in dB against the 99.9th percentile of the exact irradiance; `None` where nothing was
    /// compared or all was black.
    pub fn psnr(&self) -> Option<f64> {
        let peak = self.peak()?;
        Some(10.0 * (peak * peak * self.numbers as f64 / self.squared_error).log10())
    }

    /// Rms error over rms irradiance.
    pub fn relative_rms(&self) -> Option<f64> {
        (self.squared > 0.0).then(|| (self.squared_error / self.squared).sqrt())
    }

    fn peak(&self) -> Option<f64> {
        let above = self.numbers / 1000;
        let mut seen = 0;
        for (step, count) in self.counts.iter().enumerate().rev() {
            seen += count;
            if seen > above {
                let octaves = (step as f32 + 0.5) / STEPS - BELOW;
                return (step > 0).then(|| f64::from(octaves).exp2());
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: f32) -> L2 {
        let mut l2 = [Vec3::ZERO; sh::L2_COUNT];
        l2[0] = Vec3::splat(value);
        l2
    }

    #[test]
    fn an_error_of_one_part_in_a_hundred_is_forty_decibels() {
        let mut fidelity = Fidelity::default();
        assert_eq!(fidelity.psnr(), None);
        for _ in 0..10 {
            fidelity.add(&grey(2.0), &grey(2.02));
        }
        let psnr = fidelity.psnr().expect("a figure");
        assert!((psnr - 40.0).abs() < 0.03, "{psnr}");
        let relative = fidelity.relative_rms().expect("a figure");
        assert!((relative - 0.01).abs() < 1e-4, "{relative}");
    }

    #[test]
    fn the_peak_leaves_out_the_brightest_thousandth() {
        let mut fidelity = Fidelity::default();
        for _ in 0..9999 {
            fidelity.add(&grey(1.0), &grey(1.01));
        }
        fidelity.add(&grey(1e4), &grey(1e4));
        let psnr = fidelity.psnr().expect("a figure");
        assert!((psnr - 40.0).abs() < 0.03, "{psnr}");
    }
}
