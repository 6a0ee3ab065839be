//! Real spherical harmonics of degree 0 to 4 (DDISH-GI §3, Appendix A).
//!
//! Orthonormal, in the order and with the signs of Ramamoorthi and Hanrahan 2001 (*An Efficient
//! Representation for Irradiance Environment Maps*), which know no Condon-Shortley phase: function
//! `l * l + l + m` of degree l and order m; (1, -1), (1, 0), (1, 1) go with y, z, x. An expansion of
//! degree L is a slice of its `(L + 1)^2` RGB coefficients. Of radiance, the direction is the one
//! that light comes from.

use glam::Vec3;
use std::f32::consts::PI;

/// The highest degree here; the format's is 2.
pub const MAX_DEGREE: usize = 4;
/// Functions of degree 0 to [`MAX_DEGREE`].
pub const MAX_COUNT: usize = count(MAX_DEGREE);
/// Functions of degree 0 to 2.
pub const L2_COUNT: usize = count(2);

/// An expansion of degree 2: what the format holds.
pub type L2 = [Vec3; L2_COUNT];

/// `A_l`: the factor of degree l that takes radiance to irradiance (Ramamoorthi and Hanrahan 2001,
/// Eq. 9). SHARED with the client's shader.
pub const COSINE: [f32; MAX_DEGREE + 1] = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0];

/// The value of the function of degree 0.
pub const Y0: f32 = 0.282_094_79;

/// Functions of degree 0 to `degree`.
pub const fn count(degree: usize) -> usize {
    (degree + 1) * (degree + 1)
}

/// The degree of a function.
pub const fn degree_of(index: usize) -> usize {
    index.isqrt()
}

/// The functions of degree 0 to 2 in a unit direction. SHARED with the client's shader.
pub fn basis_l2(d: Vec3) -> [f32; L2_COUNT] {
    let Vec3 { x, y, z } = d;
    [
        Y0,
        0.488_602_5 * y,
        0.488_602_5 * z,
        0.488_602_5 * x,
        1.092_548_4 * x * y,
        1.092_548_4 * y * z,
        0.315_391_57 * (3.0 * z * z - 1.0),
        1.092_548_4 * x * z,
        0.546_274_2 * (x * x - y * y),
    ]
}

/// The functions of degree 0 to 4 in a unit direction.
pub fn basis(d: Vec3) -> [f32; MAX_COUNT] {
    let Vec3 { x, y, z } = d;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let mut values = [0.0; MAX_COUNT];
    values[..L2_COUNT].copy_from_slice(&basis_l2(d));
    values[L2_COUNT..].copy_from_slice(&[
        0.590_043_6 * y * (3.0 * xx - yy),
        2.890_611_4 * x * y * z,
        0.457_045_8 * y * (5.0 * zz - 1.0),
        0.373_176_33 * z * (5.0 * zz - 3.0),
        0.457_045_8 * x * (5.0 * zz - 1.0),
        1.445_305_7 * z * (xx - yy),
        0.590_043_6 * x * (xx - 3.0 * yy),
        2.503_343 * x * y * (xx - yy),
        1.770_130_8 * y * z * (3.0 * xx - yy),
        0.946_174_7 * x * y * (7.0 * zz - 1.0),
        0.669_046_5 * y * z * (7.0 * zz - 3.0),
        0.105_785_55 * (35.0 * zz * zz - 30.0 * zz + 3.0),
        0.669_046_5 * x * z * (7.0 * zz - 3.0),
        0.473_087_35 * (xx - yy) * (7.0 * zz - 1.0),
        1.770_130_8 * x * z * (xx - 3.0 * yy),
        0.625_835_7 * (xx * xx - 6.0 * xx * yy + yy * yy),
    ]);
    values
}

/// The value of an expansion of any degree in a unit direction.
pub fn evaluate(coefficients: &[Vec3], d: Vec3) -> Vec3 {
    basis(d)
        .iter()
        .zip(coefficients)
        .map(|(y, c)| *c * *y)
        .sum()
}

/// The value of an expansion of degree 2 in a unit direction.
pub fn evaluate_l2(coefficients: &L2, d: Vec3) -> Vec3 {
    basis_l2(d)
        .iter()
        .zip(coefficients)
        .map(|(y, c)| *c * *y)
        .sum()
}

/// Adds a sample of a function to its expansion: `value * weight` times every basis function. With
/// uniform directions the weight is `4 pi / samples`.
pub fn project(coefficients: &mut [Vec3], d: Vec3, value: Vec3, weight: f32) {
    for (c, y) in coefficients.iter_mut().zip(basis(d)) {
        *c += value * (y * weight);
    }
}

/// Multiplies every coefficient by the factor of its degree: a window, or a convolution.
pub fn scale(coefficients: &mut [Vec3], factors: &[f32; MAX_DEGREE + 1]) {
    for (index, c) in coefficients.iter_mut().enumerate() {
        *c *= factors[degree_of(index)];
    }
}

/// Convolves an expansion with a zonal one of coefficients `zonal[l]` (DDISH-GI Eq. 1).
pub fn convolve(coefficients: &mut [Vec3], zonal: &[f32; MAX_DEGREE + 1]) {
    scale(coefficients, &convolution(zonal));
}

/// The factors `sqrt(4 pi / (2 l + 1)) g_l` of Eq. 1.
pub fn convolution(zonal: &[f32; MAX_DEGREE + 1]) -> [f32; MAX_DEGREE + 1] {
    std::array::from_fn(|l| (4.0 * PI / (2 * l + 1) as f32).sqrt() * zonal[l])
}

/// Irradiance on a surface of unit normal `n` under radiance of degree 2. May be negative where
/// the expansion rings.
pub fn irradiance(radiance: &L2, n: Vec3) -> Vec3 {
    convolved(radiance, &[COSINE[0], COSINE[1], COSINE[2]], n)
}

/// The value in direction `d` of an expansion whose degrees are multiplied by `factors`.
pub fn convolved(coefficients: &L2, factors: &[f32; 3], d: Vec3) -> Vec3 {
    let y = basis_l2(d);
    let c = coefficients;
    let band1 = c[1] * y[1] + c[2] * y[2] + c[3] * y[3];
    let band2 = c[4] * y[4] + c[5] * y[5] + c[6] * y[6] + c[7] * y[7] + c[8] * y[8];
    c[0] * (y[0] * factors[0]) + band1 * factors[1] + band2 * factors[2]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Nodes and weights of Gauss-Legendre quadrature on [-1, 1], exact to degree `2 n - 1`.
    pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
        (0..n)
            .map(|i| {
                let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
                let mut slope = 0.0;
                for _ in 0..100 {
                    let (mut p, mut last) = (1.0, 0.0);
                    for k in 1..=n {
                        let k = k as f64;
                        (p, last) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * last) / k, p);
                    }
                    slope = n as f64 * (x * p - last) / (x * x - 1.0);
                    x -= p / slope;
                }
                (x, 2.0 / ((1.0 - x * x) * slope * slope))
            })
            .collect()
    }

    /// Directions and weights that integrate polynomials of degree 11 over the sphere exactly.
    pub fn quadrature() -> Vec<(Vec3, f32)> {
        let around = 24;
        gauss_legendre(12)
            .into_iter()
            .flat_map(|(z, w)| {
                (0..around).map(move |k| {
                    let (sin, cos) = (std::f64::consts::TAU * k as f64 / around as f64).sin_cos();
                    let r = (1.0 - z * z).sqrt();
                    let d = Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32);
                    (d, (w * std::f64::consts::TAU / around as f64) as f32)
                })
            })
            .collect()
    }

    fn projected(f: impl Fn(Vec3) -> f32) -> [Vec3; MAX_COUNT] {
        let mut c = [Vec3::ZERO; MAX_COUNT];
        for (d, w) in quadrature() {
            project(&mut c, d, Vec3::splat(f(d)), w);
        }
        c
    }

    fn l2(f: impl Fn(Vec3) -> f32) -> L2 {
        std::array::from_fn(|i| projected(&f)[i])
    }

    #[test]
    fn the_basis_is_orthonormal() {
        for i in 0..MAX_COUNT {
            let c = projected(|d| basis(d)[i]);
            for (k, c) in c.iter().enumerate() {
                let expected = if i == k { 1.0 } else { 0.0 };
                assert!((c.x - expected).abs() < 2e-6, "{i}, {k}: {}", c.x);
            }
        }
    }

    /// Orders and signs: which of the functions of a degree is which cannot be told from
    /// orthonormality.
    #[test]
    fn functions_lean_the_way_they_should() {
        let at = |x, y, z| basis(Vec3::new(x, y, z).normalize());
        let (x, y, z) = (at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, 0.0, 1.0));
        assert!(y[1] > 0.4 && z[2] > 0.4 && x[3] > 0.4);
        assert!(at(1.0, 1.0, 0.0)[4] > 0.5 && at(0.0, 1.0, 1.0)[5] > 0.5);
        assert!(z[6] > 0.6 && at(1.0, 0.0, 1.0)[7] > 0.5 && x[8] > 0.5 && y[8] < -0.5);
        assert!(z[12] > 0.7 && x[15] > 0.5 && at(1.0, 1.0, 1.0)[10] > 0.5 && y[9] < -0.5);
        assert!(z[20] > 0.8 && x[24] > 0.6 && at(2.0, 1.0, 0.0)[16] > 0.5);
    }

    /// Zonal functions are Legendre's polynomials, and the values of a degree add up by Unsoeld's
    /// theorem to `(2 l + 1) / 4 pi` in any direction: a check of every constant by itself.
    #[test]
    fn degrees_add_up_in_every_direction() {
        for (d, _) in quadrature() {
            let y = basis(d);
            for l in 0..=MAX_DEGREE {
                let sum: f32 = y[l * l..count(l)].iter().map(|y| y * y).sum();
                let expected = (2 * l + 1) as f32 / (4.0 * PI);
                assert!((sum - expected).abs() < 1e-5, "{l} at {d}: {sum}");
            }
        }
    }

    #[test]
    fn polynomials_come_back_from_their_projection() {
        let f = |d: Vec3| 2.0 - d.x + 3.0 * d.y * d.z - d.z.powi(3) + 4.0 * (d.x * d.y).powi(2);
        let c = projected(f);
        for (d, _) in quadrature() {
            assert!((evaluate(&c, d).x - f(d)).abs() < 1e-5);
        }
    }

    #[test]
    fn irradiance_of_known_fields() {
        let n = Vec3::new(0.48, -0.6, 0.64);
        // Uniform radiance: pi. Radiance 1 + cos to an axis: pi + 2 pi / 3 cos.
        let axis = Vec3::new(2.0, 1.0, -2.0) / 3.0;
        assert!((irradiance(&l2(|_| 1.0), n).x - PI).abs() < 1e-5);
        let got = irradiance(&l2(|d| 1.0 + d.dot(axis)), n).x;
        let expected = PI + 2.0 * PI / 3.0 * n.dot(axis);
        assert!((got - expected).abs() < 1e-5);
        // Any field of degree 2 against the integral itself, whose kink at the horizon the
        // quadrature about the normal's own axis does not see.
        let field = |d: Vec3| 1.5 + d.x - 0.5 * d.y + d.x * d.z - 2.0 * d.y * d.y;
        let c = l2(field);
        let mut expected = 0.0;
        for (z, w) in gauss_legendre(12) {
            let z = 0.5 * (z + 1.0);
            for k in 0..24 {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / 24.0).sin_cos();
                let r = (1.0 - z * z).sqrt();
                // The normal is +x here: the field's terms are not symmetric about it.
                let d = Vec3::new(z as f32, (r * cos) as f32, (r * sin) as f32);
                expected += f64::from(field(d)) * z * 0.5 * w * std::f64::consts::TAU / 24.0;
            }
        }
        let got = irradiance(&c, Vec3::X).x;
        assert!((f64::from(got) - expected).abs() < 1e-4, "{got} {expected}");
    }

    /// `A_l` is the convolution (Eq. 1) with the clamped cosine's zonal coefficients.
    #[test]
    fn cosine_factors_are_the_convolution_with_a_clamped_cosine() {
        let zonal: [f32; 5] = std::array::from_fn(|l| {
            let sum: f64 = gauss_legendre(12)
                .into_iter()
                .map(|(x, w)| {
                    let z = 0.5 * (x + 1.0);
                    let d = Vec3::new((1.0 - z * z).sqrt() as f32, 0.0, z as f32);
                    0.5 * w * z * f64::from(basis(d)[l * l + l])
                })
                .sum();
            (sum * std::f64::consts::TAU) as f32
        });
        for (got, a) in convolution(&zonal).iter().zip(COSINE) {
            assert!((got - a).abs() < 1e-5, "{got} {a}");
        }
        // A convolution with an axis of order 0 is a rotation average: degree by degree.
        let mut c = projected(|d| 1.0 + d.x + d.x * d.y + d.z.powi(4));
        let before = c;
        convolve(&mut c, &zonal);
        for (i, (after, before)) in c.iter().zip(before).enumerate() {
            assert!((after.x - before.x * COSINE[degree_of(i)]).abs() < 1e-5);
        }
    }

    #[test]
    fn the_short_forms_agree_with_the_long_ones() {
        let c: L2 = std::array::from_fn(|i| Vec3::new(i as f32, 1.0 - i as f32, 0.5));
        for (d, _) in quadrature() {
            assert_eq!(basis(d)[..L2_COUNT], basis_l2(d));
            assert!((evaluate(&c, d) - evaluate_l2(&c, d)).length() < 1e-4);
            assert!((convolved(&c, &[1.0; 3], d) - evaluate_l2(&c, d)).length() < 1e-4);
        }
    }
}
