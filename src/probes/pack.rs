//! Expansions as textures of 36 bytes a probe that a texture unit can filter, where the format's take 56: nine of
//! RGB9E5, one for each function.
//!
//! RGB9E5 holds no negative numbers. But light is not negative, so that no value of an expansion is further from
//! 0 than degree 0 times the largest ratio of the two functions; with that much of degree 0 added ([`SHIFTS`]) it is not
//! negative. The sum is linear, and so is the filter: between probes there is no error but that of the probes. Values
//! as ratios to degree 0, which fit 8 bits, do not have this: `examples/pack_probes.rs` measures both. On a device:
//! `embed/shaders/wgsl/probes_packed.wgsl`.

use super::lattice::Lattice;
use super::sh::{L2, L2_COUNT};
use glam::Vec3;

/// Bytes of a probe.
pub const BYTES: usize = 4 * L2_COUNT;

/// How much of degree 0 is added to each function. The largest values of the functions over that of degree 0 are the
/// square roots of 3 and, of degree 2, of 15 / 4, and of 5 for order 0; these are a little more, and 2 keeps the
/// values of uniform light exact. SHARED with `embed/shaders/wgsl/probes_packed.wgsl`.
pub const SHIFTS: [f32; L2_COUNT] = [0.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.25, 2.0, 2.0];

/// The probes of a volume as textures.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed {
    /// A texture of `rgb9e5ufloat` a function, a texel a probe: red in the low 9 bits, the exponent in the high 5.
    pub planes: [Vec<u32>; L2_COUNT],
}

impl Packed {
    /// Packs expansions in units of `scale`, which the sampler multiplies by: two to the volume's exponent.
    /// What is out of range is clamped: to 65408 units, and to what light can be.
    pub fn new(radiance: &[L2], scale: f32) -> Packed {
        let mut planes = [const { Vec::new() }; L2_COUNT];
        for expansion in radiance {
            // As the device reads it, so that its error does not carry over.
            let light = from_rgb9e5(rgb9e5(expansion[0] / scale));
            for ((plane, value), shift) in planes.iter_mut().zip(expansion).zip(SHIFTS) {
                plane.push(rgb9e5(*value / scale + light * shift));
            }
        }
        Packed { planes }
    }

    /// The expansion that a device reads at a probe; black for a probe that is not there.
    pub fn expansion(&self, probe: usize, scale: f32) -> L2 {
        let texel = |plane: &Vec<u32>| from_rgb9e5(plane.get(probe).copied().unwrap_or_default());
        let texels = self.planes.each_ref().map(texel);
        let value = |lm: usize| (texels[lm] - texels[0] * SHIFTS[lm]) * scale;
        std::array::from_fn(value)
    }

    /// What a texture unit's filter makes of the textures at `x`.
    pub fn trilinear(&self, lattice: &Lattice, x: Vec3, scale: f32) -> L2 {
        let mut sum = [Vec3::ZERO; L2_COUNT];
        for corner in lattice.corners(x) {
            let expansion = self.expansion(corner.probe, scale);
            for (s, value) in sum.iter_mut().zip(expansion) {
                *s += value * corner.weight;
            }
        }
        sum
    }
}

/// Bits of a mantissa, bias of the exponent, and the largest value of RGB9E5 (OpenGL 4.6 §8.5.2).
const MANTISSA: i32 = 9;
const BIAS: i32 = 15;
const LARGEST: f32 = 65408.0;

/// The nearest RGB9E5; what is negative or not a number is 0.
pub fn rgb9e5(color: Vec3) -> u32 {
    let color = color.map(|c| if c > 0.0 { c.min(LARGEST) } else { 0.0 });
    let peak = color.max_element();
    let floor_log2 = (peak.to_bits() >> 23) as i32 - 127;
    let mut exponent = floor_log2.max(-BIAS - 1) + 1 + BIAS;
    let step = |exponent: i32| 2f32.powi(exponent - BIAS - MANTISSA);
    if (peak / step(exponent)).round() >= 512.0 {
        exponent += 1;
    }
    let mantissas = color.map(|c| (c / step(exponent)).round());
    let [r, g, b] = mantissas.to_array().map(|m| m as u32);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The colour of an RGB9E5.
pub fn from_rgb9e5(word: u32) -> Vec3 {
    let step = 2f32.powi((word >> 27) as i32 - BIAS - MANTISSA);
    Vec3::from([word, word >> 9, word >> 18].map(|m| (m & 511) as f32)) * step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probes::sh;
    use crate::rng::Rng;

    /// The expansion of a few distant lights.
    fn lights(random: &mut Rng) -> L2 {
        let mut expansion = [Vec3::ZERO; L2_COUNT];
        for _ in 0..1 + random.draw() % 4 {
            let mut part = || random.unit();
            let color = Vec3::new(part(), part(), part()) * 8.0;
            let d = Vec3::new(part() - 0.5, part() - 0.5, part() - 0.5);
            for (value, y) in expansion
                .iter_mut()
                .zip(sh::basis_l2(d.normalize_or(Vec3::Z)))
            {
                *value += color * y;
            }
        }
        expansion
    }

    #[test]
    fn rgb9e5_errs_by_half_a_step_at_most() {
        let mut random = Rng::new(3);
        for _ in 0..10_000 {
            let scale = 2f32.powi((random.draw() % 30) as i32 - 15);
            let color = Vec3::new(random.unit(), random.unit(), random.unit()) * scale;
            let error = (from_rgb9e5(rgb9e5(color)) - color).abs().max_element();
            // Half the least step of all, that of the least exponent.
            let bound = (color.max_element() / 512.0).max(2f32.powi(-25));
            assert!(error <= bound, "{color} {error}");
        }
        for exact in [
            Vec3::ZERO,
            Vec3::ONE,
            Vec3::new(2.0, 256.0, 1.0),
            Vec3::splat(LARGEST),
        ] {
            assert_eq!(from_rgb9e5(rgb9e5(exact)), exact);
        }
        assert_eq!(rgb9e5(Vec3::new(-1.0, f32::NAN, 0.0)), 0);
        assert_eq!(from_rgb9e5(rgb9e5(Vec3::splat(1e9))), Vec3::splat(LARGEST));
        // Rounds up into the next exponent.
        let edge = Vec3::new(511.9, 0.0, 0.0);
        assert_eq!(from_rgb9e5(rgb9e5(edge)).x, 512.0);
    }

    #[test]
    fn unpacked_values_err_by_half_a_step_at_most() {
        let mut random = Rng::new(4);
        for _ in 0..2000 {
            let expansion = lights(&mut random);
            let scale = 4.0;
            let got = Packed::new(&[expansion], scale).expansion(0, scale);
            let peak = expansion[0].max_element();
            for lm in 0..L2_COUNT {
                let error = (got[lm] - expansion[lm]).abs().max_element();
                // The shifted value is at most twice the shift and the error of degree 0.
                let bound = peak * (1.0 + 4.1 * SHIFTS[lm]) / 512.0;
                assert!(
                    error <= bound.min(peak / 50.0),
                    "{lm}: {error} above {bound}"
                );
            }
        }
    }

    #[test]
    fn light_is_within_the_shifts() {
        let mut random = Rng::new(6);
        for _ in 0..10_000 {
            let expansion = lights(&mut random);
            for (value, shift) in expansion.iter().zip(SHIFTS) {
                let least = (*value + expansion[0] * shift).min_element();
                assert!(least >= 0.0, "{least}");
            }
        }
    }

    #[test]
    fn filtered_at_a_probe_is_that_probe() {
        let mut random = Rng::new(5);
        let lattice = Lattice {
            dims: [3, 2, 2],
            spacing: Vec3::new(1.0, 2.0, 0.5),
        };
        let radiance: Vec<L2> = (0..lattice.count()).map(|_| lights(&mut random)).collect();
        let packed = Packed::new(&radiance, 1.0);
        for probe in 0..lattice.count() {
            let at = packed.trilinear(&lattice, lattice.position(probe), 1.0);
            assert_eq!(at, packed.expansion(probe, 1.0));
        }
        assert_eq!(packed.expansion(99, 1.0), [Vec3::ZERO; L2_COUNT]);
    }

    #[test]
    fn uniform_light_stays_uniform() {
        let mut uniform = [Vec3::ZERO; L2_COUNT];
        uniform[0] = Vec3::new(1.0, 0.5, 0.25);
        let got = Packed::new(&[uniform], 1.0).expansion(0, 1.0);
        assert_eq!(got, uniform);
    }
}
