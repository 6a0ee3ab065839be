//! Obscurance about a point in space, as a function of the normal that a surface there would have.
//!
//! Visibility over the sphere is expanded in spherical harmonics of degree 2 and convolved with the clamped
//! cosine (Ramamoorthi and Hanrahan 2001, *An Efficient Representation for Irradiance Environment Maps*).
//! Coefficients go with polynomials that have no constants of their own, so that Eq. 1 is a plain sum:
//!
//! ```text
//! AO(n) = sum_k c_k p_k(n),   p = 1, y, z, x, xy, yz, 3z^2 - 1, xz, x^2 - y^2
//! ```

use super::{Gather, MAX_KERNELS, Obscurance};
use glam::Vec3;

/// Coefficients of an expansion.
pub const COUNT: usize = 9;

/// Obscurance by one kernel.
pub type Expansion = [f32; COUNT];

/// From the mean over the sphere of visibility times a polynomial to its coefficient: 4 pi times the square of the
/// harmonic's constant, times the cosine's 1, 2/3, 1/4 for the degrees 0, 1, 2.
const FACTORS: Expansion = [1.0, 2.0, 2.0, 2.0, 3.75, 3.75, 0.3125, 3.75, 0.9375];

/// The polynomials at a unit vector.
pub fn basis(n: Vec3) -> Expansion {
    let Vec3 { x, y, z } = n;
    [
        1.0,
        y,
        z,
        x,
        x * y,
        y * z,
        3.0 * z * z - 1.0,
        x * z,
        x * x - y * y,
    ]
}

/// Obscurance at a unit normal. It may leave 0..=1 a little, where the expansion rings.
pub fn evaluate(expansion: &Expansion, n: Vec3) -> f32 {
    let terms = expansion.iter().zip(basis(n));
    terms.map(|(c, p)| c * p).sum()
}

impl Obscurance<'_, '_> {
    /// Obscurance about a point in space, one expansion per kernel, by uniform rays over the sphere; zero
    /// beyond the number of kernels. A point that is not finite is open.
    pub fn about_point(&self, position: Vec3, seed: u32) -> ([Expansion; MAX_KERNELS], Gather) {
        let mut sums = [[0.0f64; COUNT]; MAX_KERNELS];
        let gather = self.in_volume(position, seed, |direction, visible| {
            let basis = basis(direction);
            for (sums, visible) in sums.iter_mut().zip(visible) {
                for (sum, p) in sums.iter_mut().zip(basis) {
                    *sum += f64::from(*visible) * f64::from(p);
                }
            }
        });
        let rays = f64::from(self.rays());
        let mut expansions = sums.map(|sums| {
            let mut expansion = FACTORS;
            for (c, sum) in expansion.iter_mut().zip(sums) {
                *c *= (sum / rays) as f32;
            }
            expansion
        });
        // The mean is that of the gather, also where no ray was traced.
        for (expansion, mean) in expansions.iter_mut().zip(gather.values) {
            expansion[0] = mean;
        }
        (expansions, gather)
    }
}
