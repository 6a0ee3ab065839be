//! Functions of the normal: polynomials on the unit sphere, without the constants of spherical
//! harmonics.
//!
//! They are 1; y, z, x; xy, yz, 3z^2 - 1, xz, x^2 - y^2, in the order of real spherical harmonics
//! (Ramamoorthi and Hanrahan 2001). Each is a harmonic times a constant, so they are orthogonal.

/// All functions in a unit direction.
pub use crate::regions::sample::polynomials as values;

/// Functions up to degree 2.
pub const COUNT: usize = 9;

/// Functions up to a degree of 0 to 2.
pub const fn count(degree: usize) -> usize {
    (degree + 1) * (degree + 1)
}

/// What takes the mean over the sphere of visibility times a function to the coefficient of that
/// function in `1/pi * integral of visibility(w) * max(0, n . w) dw`: `4 A_l K^2`, with the convolution
/// factor `A_l` of the clamped cosine (pi, 2 pi / 3, pi / 4) and the constant K of the harmonic.
pub const COSINE: [f64; COUNT] = [1.0, 2.0, 2.0, 2.0, 3.75, 3.75, 0.3125, 3.75, 0.9375];

/// Mean of the square of each over the sphere.
pub const SQUARE: [f64; COUNT] = [
    1.0,
    1.0 / 3.0,
    1.0 / 3.0,
    1.0 / 3.0,
    1.0 / 15.0,
    1.0 / 15.0,
    0.8,
    1.0 / 15.0,
    4.0 / 15.0,
];
