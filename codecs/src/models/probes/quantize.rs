//! From radiance to codes: what an encoder needs beside the format. Only additions, multiplications
//! and divisions of f64, which are the same everywhere.

use super::f16::{f16_from_units, round};
use super::values::{MOST_LOG, MOST_RELATIVE, Scales, log_luma};
use super::{CODES, COEFFICIENTS, Coding, GROUPS, Probe, Volume};

/// How far the luma and the chroma of a coefficient of each degree may be from what was asked for,
/// in the units of radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Of luma, (R + 2 G + B) / 4, for degrees 0, 1 and 2.
    pub luma: [f32; 3],
    /// Of chroma, (R - B) / 2 and (2 G - R - B) / 4.
    pub chroma: [f32; 3],
}

impl Volume {
    /// The probe nearest to these coefficients, R, G, B each: in `packed` to within half a step
    /// where the range allows it, and 2^-24 times two to the exponent, before the rounding to f16.
    ///
    /// Numbers too large, infinite or not numbers become what is nearest, or 0.
    pub fn quantize(&self, coefficients: &[[f32; 3]; COEFFICIENTS]) -> Probe {
        self.quantize_near(coefficients, &Probe::ABSENT, &Tolerance::default())
    }

    /// As [`Volume::quantize`], but each code is the nearest to that of `base` whose error is within
    /// the tolerance, where there is one: a dead zone, so that little changes from frame to frame.
    /// Errors do not add up, since they are counted from what is asked for.
    pub fn quantize_near(
        &self,
        coefficients: &[[f32; 3]; COEFFICIENTS],
        base: &Probe,
        tolerance: &Tolerance,
    ) -> Probe {
        let units = self.units_of_one();
        match self.coding {
            Coding::Raw => raw(coefficients, units),
            Coding::Packed(steps) => {
                let scaled = |t: f32| f64::from(t).max(0.0) * units;
                let quantizer = Quantizer {
                    scales: Scales::new(&steps),
                    luma: tolerance.luma.map(scaled),
                    chroma: tolerance.chroma.map(scaled),
                };
                quantizer.probe(coefficients, units, base)
            }
        }
    }

    /// Units of 2^-24 in a radiance of 1: 2^(24 - exponent).
    fn units_of_one(&self) -> f64 {
        let exponent = 1023 + 24 - i64::from(self.exponent);
        f64::from_bits((exponent as u64) << 52)
    }
}

fn raw(coefficients: &[[f32; 3]; COEFFICIENTS], units: f64) -> Probe {
    let mut codes = [0; CODES];
    for (at, &value) in coefficients.as_flattened().iter().enumerate() {
        let value = round(finite(value) * units);
        let value = if at < 3 { value.max(0) } else { value };
        codes[at] = f16_from_units(value) as i16;
    }
    Probe { level: 3, codes }
}

struct Quantizer {
    scales: Scales,
    /// Tolerances in units.
    luma: [f64; 3],
    chroma: [f64; 3],
}

impl Quantizer {
    fn probe(&self, coefficients: &[[f32; 3]; COEFFICIENTS], units: f64, base: &Probe) -> Probe {
        let mut probe = Probe {
            level: 3,
            codes: [0; CODES],
        };
        let number = |value: f32| finite(value) * units;
        // A dead zone is about a code that was there.
        let known = |degree: usize| usize::from(base.level) > degree;
        let near = |tolerances: &[f64; 3], degree: usize| match known(degree) {
            true => tolerances[degree],
            false => 0.0,
        };
        let [r, g, b] = coefficients[0].map(number);
        let code = self.log_code((r + 2.0 * g + b) / 4.0, near(&self.luma, 0), base.codes[0]);
        let luma = log_luma(i32::from(code) * self.scales.0[0]);
        probe.codes[0] = code;
        if luma == 0 {
            return probe;
        }
        for degree in 0..3 {
            let (lumas, chromas) = (GROUPS[2 * degree], GROUPS[2 * degree + 1]);
            let of_degree = &coefficients[degree * degree..(degree + 1) * (degree + 1)];
            for (i, rgb) in of_degree.iter().enumerate() {
                let [r, g, b] = rgb.map(number);
                let mut put = |at: usize, group: usize, value: f64, tolerance: f64| {
                    probe.codes[at] =
                        self.relative_code(luma, group, value, tolerance, base.codes[at]);
                };
                if degree > 0 {
                    let y = (r + 2.0 * g + b) / 4.0;
                    put(lumas.start + i, 2 * degree, y, near(&self.luma, degree));
                }
                let (co, cg) = ((r - b) / 2.0, (2.0 * g - r - b) / 4.0);
                let at = chromas.start + 2 * i;
                put(at, 2 * degree + 1, co, near(&self.chroma, degree));
                put(at + 1, 2 * degree + 1, cg, near(&self.chroma, degree));
            }
        }
        probe
    }

    /// The code of the luma of degree 0.
    fn log_code(&self, value: f64, tolerance: f64, base: i16) -> i16 {
        let step = self.scales.0[0];
        let most = MOST_LOG / step;
        let luma = |code: i32| log_luma(code * step) as f64;
        // The first code whose luma is no less than a bound; one too many where none is.
        let no_less = |bound: f64| {
            let (mut low, mut high) = (0, most + 1);
            while low < high {
                let middle = low + (high - low) / 2;
                if luma(middle) < bound {
                    low = middle + 1;
                } else {
                    high = middle;
                }
            }
            low
        };
        let first = no_less(value - tolerance);
        let end = no_less((value + tolerance).next_up());
        let code = if first < end {
            i32::from(base).clamp(first, end - 1)
        } else {
            // The nearer one of two.
            let above = no_less(value).min(most);
            let under = (above - 1).max(0);
            if value - luma(under) <= luma(above) - value {
                under
            } else {
                above
            }
        };
        code as i16
    }

    /// Any other code.
    fn relative_code(&self, luma: i64, group: usize, value: f64, tolerance: f64, base: i16) -> i16 {
        let step = self.scales.0[group];
        let most = (MOST_RELATIVE / step).min(i32::from(i16::MAX));
        let codes = 4096.0 / (luma as f64 * f64::from(step));
        let nearest = round(value * codes).clamp(-i64::from(most), i64::from(most)) as i32;
        // From the base towards the nearest one, the first that is near enough.
        let low = ceil((value - tolerance) * codes).max(-i64::from(most));
        let high = floor((value + tolerance) * codes).min(i64::from(most));
        if low <= high {
            i64::from(base).clamp(low, high) as i16
        } else {
            nearest as i16
        }
    }
}

/// Infinities are as large as it goes; what is not a number is 0.
fn finite(value: f32) -> f64 {
    match value.is_nan() {
        true => 0.0,
        false => value.clamp(f32::MIN, f32::MAX).into(),
    }
}

fn floor(value: f64) -> i64 {
    let value = value.clamp(-1e15, 1e15);
    let whole = value as i64;
    whole - i64::from(whole as f64 > value)
}

fn ceil(value: f64) -> i64 {
    -floor(-value)
}
