//! A made-up light field, for tests and measurements of the model `probes`: a room with lamps that
//! move, a window, a wall with a door, and the noise of a path tracer after hysteresis. It has no
//! geometry but the wall, so it is smoother than a scene in some places and harsher at the wall; the
//! noise is that of few samples. Nothing here is tuned to the codec.
#![allow(dead_code)]

use std::f64::consts::PI;
use std::vec::Vec;

pub type Coefficients = [[f32; 3]; 9];

/// Linear congruential generator: the same numbers everywhere.
pub struct Noise(pub u64);

impl Noise {
    /// 0 to 1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Mean 0, deviation 1: Irwin and Hall's sum.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// What a field is like.
#[derive(Clone, Copy)]
pub struct FieldOptions {
    pub dims: [u16; 3],
    pub lamps: usize,
    /// Metres a frame.
    pub speed: f64,
    /// Deviation of a coefficient of one frame's estimate, relative to that of degree 0.
    pub noise: f64,
    /// Share of the past that is kept.
    pub hysteresis: f64,
    pub seed: u64,
}

/// A lamp bounces through the room in 60 s; 256 samples; hysteresis 0.95.
pub const USUAL: FieldOptions = FieldOptions {
    dims: [16, 8, 8],
    lamps: 3,
    speed: 0.03,
    noise: 0.1,
    hysteresis: 0.95,
    seed: 1,
};

/// A field that goes on frame by frame; a probe is a metre from the next.
pub struct Field {
    options: FieldOptions,
    noise: Noise,
    frame: u32,
    state: Vec<Option<Coefficients>>,
}

impl Field {
    pub fn new(options: FieldOptions) -> Field {
        Field {
            options,
            noise: Noise(options.seed),
            frame: 0,
            state: Vec::new(),
        }
    }

    /// Coefficients of all probes; none of those inside the wall.
    pub fn next(&mut self) -> &[Option<Coefficients>] {
        let FieldOptions {
            dims, hysteresis, ..
        } = self.options;
        let [dx, dy, dz] = dims.map(usize::from);
        let first = self.state.is_empty();
        let mut at = 0;
        for z in 0..dz {
            for y in 0..dy {
                for x in 0..dx {
                    let estimate = self.estimate([x, y, z]);
                    match (first, estimate) {
                        (true, _) => self.state.push(estimate),
                        (_, Some(new)) => {
                            let old = self.state[at].get_or_insert(new);
                            for (old, new) in
                                old.as_flattened_mut().iter_mut().zip(new.as_flattened())
                            {
                                let mixed = f64::from(*old) * hysteresis
                                    + f64::from(*new) * (1.0 - hysteresis);
                                *old = mixed as f32;
                            }
                        }
                        _ => {}
                    }
                    at += 1;
                }
            }
        }
        self.frame += 1;
        &self.state
    }

    /// One frame's path-traced estimate: as of a hundred frames at the start, so that the first state
    /// is as settled as those after it.
    fn estimate(&mut self, probe: [usize; 3]) -> Option<Coefficients> {
        let [dx, dy, dz] = self.options.dims.map(f64::from);
        let [x, y, z] = probe.map(|i| i as f64);
        let wall = (dx * 0.6).floor();
        let door = z < dz * 0.4 && y < dy * 0.5;
        if x == wall && !door {
            return None;
        }
        let mut sum = [[0.0f64; 3]; 9];
        let mut add = |direction: [f64; 3], radiance: [f64; 3], cosine_lobe: f64| {
            // A light of some extent: its higher degrees are weaker.
            let basis = basis(direction);
            for (lm, values) in sum.iter_mut().enumerate() {
                let degree = [0, 1, 1, 1, 2, 2, 2, 2, 2][lm];
                let weight = basis[lm] * cosine_lobe.powi(degree);
                for c in 0..3 {
                    values[c] += weight * radiance[c];
                }
            }
        };
        for lamp in 0..self.options.lamps {
            let t = f64::from(self.frame) * self.options.speed + lamp as f64 * 7.3;
            let bounce = |size: f64, phase: f64| {
                let s = (t * 0.37 + phase).sin();
                (s * 0.45 + 0.5) * (size - 1.0)
            };
            let at = [
                bounce(dx, 0.0),
                bounce(dy, 1.1 * lamp as f64),
                bounce(dz, 2.3),
            ];
            let to = [at[0] - x, at[1] - y, at[2] - z];
            let d2 = to.iter().map(|c| c * c).sum::<f64>() + 0.3;
            let behind = (x - wall) * (at[0] - wall) < 0.0;
            let shade = if behind { 0.03 } else { 1.0 };
            let tint = [[1.0, 0.8, 0.6], [0.5, 0.8, 1.0], [0.9, 0.3, 0.2]][lamp % 3];
            add(to, tint.map(|c| c * 4.0 * shade / d2), 0.9);
            // What comes back from the walls: soft, from everywhere.
            add(
                [0.2, -1.0, 0.1],
                tint.map(|c| c * 0.5 * shade / (d2 + 6.0)),
                0.3,
            );
        }
        // A window, and its light on the floor.
        let window = [-x - 0.5, dy * 0.7 - y, dz * 0.5 - z];
        let d2 = window.iter().map(|c| c * c).sum::<f64>() + 1.0;
        let shade = if x > wall { 0.05 } else { 1.0 };
        add(window, [1.0, 1.1, 1.3].map(|c| c * 8.0 * shade / d2), 0.8);
        add(
            [0.0, -1.0, 0.0],
            [0.5, 0.45, 0.4].map(|c| c * shade / (1.0 + y)),
            0.6,
        );
        add([0.0, 1.0, 0.0], [0.02; 3], 0.1);
        let mean = sum[0].iter().sum::<f64>() / 3.0;
        let settled = if self.state.is_empty() { 0.16 } else { 1.0 };
        Some(sum.map(|rgb| {
            let noise = self.options.noise * mean * settled;
            let luma = self.noise.normal() * noise;
            rgb.map(|v| (v + luma + self.noise.normal() * noise * 0.25) as f32)
        }))
    }
}

/// Real spherical harmonics of degrees 0 to 2 in a direction of any length.
pub fn basis(direction: [f64; 3]) -> [f64; 9] {
    let length = direction
        .iter()
        .map(|c| c * c)
        .sum::<f64>()
        .sqrt()
        .max(1e-9);
    let [x, y, z] = direction.map(|c| c / length);
    [
        0.282095,
        0.488603 * y,
        0.488603 * z,
        0.488603 * x,
        1.092548 * x * y,
        1.092548 * y * z,
        0.315392 * (3.0 * z * z - 1.0),
        1.092548 * x * z,
        0.546274 * (x * x - y * y),
    ]
}

/// Irradiance in 64 directions.
pub fn irradiance(coefficients: &Coefficients) -> impl Iterator<Item = [f64; 3]> + use<> {
    let coefficients = *coefficients;
    (0..64).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / 64.0;
        let (s, c) = (f64::from(i) * 2.399963).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let basis = basis([r * c, r * s, z]);
        let (pi, third, quarter) = (PI, PI * 2.0 / 3.0, PI / 4.0);
        let lobe = [
            pi, third, third, third, quarter, quarter, quarter, quarter, quarter,
        ];
        let mut sum = [0.0; 3];
        for (lm, rgb) in coefficients.iter().enumerate() {
            for ch in 0..3 {
                sum[ch] += lobe[lm] * basis[lm] * f64::from(rgb[ch]);
            }
        }
        sum
    })
}

/// Peak signal-to-noise ratio of irradiance in dB, the peak being the 99.9th percentile, and the
/// error's root mean square relative to that of the irradiance.
pub fn psnr(wanted: &[Coefficients], got: &[Coefficients]) -> (f64, f64) {
    let mut values = Vec::new();
    let (mut error, mut power) = (0.0, 0.0);
    for (wanted, got) in wanted.iter().zip(got) {
        for (w, g) in irradiance(wanted).zip(irradiance(got)) {
            for c in 0..3 {
                values.push(w[c]);
                power += w[c] * w[c];
                error += (w[c] - g[c]).powi(2);
            }
        }
    }
    values.sort_unstable_by(f64::total_cmp);
    let peak = values[(values.len() - 1) * 999 / 1000];
    let mse = error / values.len() as f64;
    (10.0 * (peak * peak / mse).log10(), (error / power).sqrt())
}
