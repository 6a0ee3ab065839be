//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error
//! Visibility to Structural Similarity", IEEE TIP 2004).

/// Pixels from a window's centre to its edge: windows are 11 x 11.
const REACH: usize = 5;
/// Standard deviation of the window's Gaussian weights, in pixels.
const SIGMA: f64 = 1.5;
/// (K1 L)^2 and (K2 L)^2 for values whose range L is 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean SSIM of two fields of `width * height` values in 0..=1.
///
/// As published: 11 x 11 Gaussian windows with sigma 1.5, population variances, and only windows
/// that lie within the picture. With a mask, only its pixels have weight in a window, the weights
/// being scaled to sum to 1, and the mean is over windows whose centre is in the mask. `None` where
/// there is no such window.
///
/// # Panics
/// Where a length is not `width * height`.
pub fn ssim(
    width: usize,
    height: usize,
    a: &[f64],
    b: &[f64],
    mask: Option<&[bool]>,
) -> Option<f64> {
    assert_eq!((a.len(), b.len()), (width * height, width * height));
    if width <= 2 * REACH || height <= 2 * REACH {
        return None;
    }
    let weight = |i: usize| match mask {
        Some(mask) => f64::from(u8::from(mask[i])),
        None => 1.0,
    };
    let blur = |value: &dyn Fn(usize) -> f64| blur(width, height, |i| weight(i) * value(i));
    let total = blur(&|_| 1.0);
    let (mean_a, mean_b) = (blur(&|i| a[i]), blur(&|i| b[i]));
    let (square_a, square_b) = (blur(&|i| a[i] * a[i]), blur(&|i| b[i] * b[i]));
    let product = blur(&|i| a[i] * b[i]);

    let inner = width - 2 * REACH;
    let (mut sum, mut count) = (0.0, 0u64);
    for (i, &total) in total.iter().enumerate() {
        let centre = (i / inner + REACH) * width + i % inner + REACH;
        if mask.is_some_and(|mask| !mask[centre]) {
            continue;
        }
        let (ma, mb) = (mean_a[i] / total, mean_b[i] / total);
        let variances = square_a[i] / total - ma * ma + square_b[i] / total - mb * mb;
        let covariance = product[i] / total - ma * mb;
        sum += (2.0 * ma * mb + C1) * (2.0 * covariance + C2)
            / ((ma * ma + mb * mb + C1) * (variances + C2));
        count += 1;
    }
    (count > 0).then(|| sum / count as f64)
}

/// Weights of one axis, sum 1.
fn kernel() -> [f64; 2 * REACH + 1] {
    let raw: [f64; 2 * REACH + 1] = std::array::from_fn(|i| {
        let d = i as f64 - REACH as f64;
        (-d * d / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = raw.iter().sum();
    raw.map(|w| w / sum)
}

/// Gaussian mean about every pixel whose window lies within the picture, row by row.
fn blur(width: usize, height: usize, value: impl Fn(usize) -> f64) -> Vec<f64> {
    let kernel = kernel();
    let inner = width - 2 * REACH;
    let mut rows = vec![0.0; inner * height];
    let mut row = vec![0.0; width];
    for (y, out) in rows.chunks_exact_mut(inner).enumerate() {
        for (x, v) in row.iter_mut().enumerate() {
            *v = value(y * width + x);
        }
        for (x, out) in out.iter_mut().enumerate() {
            *out = kernel.iter().zip(&row[x..]).map(|(w, v)| w * v).sum();
        }
    }
    let mut result = vec![0.0; inner * (height - 2 * REACH)];
    for (y, out) in result.chunks_exact_mut(inner).enumerate() {
        for (k, w) in kernel.iter().enumerate() {
            let source = &rows[(y + k) * inner..][..inner];
            for (out, v) in out.iter_mut().zip(source) {
                *out += w * v;
            }
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize, seed: u32) -> Vec<f64> {
        let mut state = seed;
        (0..n)
            .map(|_| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                f64::from(state >> 8) / f64::from(1 << 24)
            })
            .collect()
    }

    /// The definition, one window at a time with two-pass variances.
    fn naive(width: usize, height: usize, a: &[f64], b: &[f64], mask: &[bool]) -> f64 {
        let (mut total, mut count) = (0.0, 0.0);
        for cy in 5..height - 5 {
            for cx in 5..width - 5 {
                if !mask[cy * width + cx] {
                    continue;
                }
                let mut window = Vec::new();
                for y in cy - 5..=cy + 5 {
                    for x in cx - 5..=cx + 5 {
                        if mask[y * width + x] {
                            let r2 =
                                (x as f64 - cx as f64).powi(2) + (y as f64 - cy as f64).powi(2);
                            let w = (-r2 / 4.5).exp();
                            window.push((w, a[y * width + x], b[y * width + x]));
                        }
                    }
                }
                let weight: f64 = window.iter().map(|v| v.0).sum();
                let mean = |f: &dyn Fn(f64, f64) -> f64| {
                    window.iter().map(|&(w, a, b)| w * f(a, b)).sum::<f64>() / weight
                };
                let (ma, mb) = (mean(&|a, _| a), mean(&|_, b| b));
                let va = mean(&|a, _| (a - ma).powi(2));
                let vb = mean(&|_, b| (b - mb).powi(2));
                let cov = mean(&|a, b| (a - ma) * (b - mb));
                total += (2.0 * ma * mb + 1e-4) * (2.0 * cov + 9e-4)
                    / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
                count += 1.0;
            }
        }
        total / count
    }

    #[test]
    fn agrees_with_the_definition() {
        for (width, height) in [(11, 11), (12, 17), (33, 25)] {
            let n = width * height;
            let (a, b) = (noise(n, 1), noise(n, 2));
            let b: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.7 * a + 0.3 * b).collect();
            let all = vec![true; n];
            let fast = ssim(width, height, &a, &b, None).expect("windows");
            assert!((fast - naive(width, height, &a, &b, &all)).abs() < 1e-12);
            assert_eq!(ssim(width, height, &a, &b, Some(&all)), Some(fast));

            let mask: Vec<bool> = (0..n).map(|i| i % 7 < 4 || i == n / 2).collect();
            let fast = ssim(width, height, &a, &b, Some(&mask)).expect("windows");
            assert!((fast - naive(width, height, &a, &b, &mask)).abs() < 1e-12);
        }
    }

    #[test]
    fn constant_fields_by_hand() {
        // No variance: SSIM is the luminance term (2 ab + C1) / (a^2 + b^2 + C1).
        let (a, b) = (vec![0.25; 400], vec![0.5; 400]);
        let expected = (0.25 + 1e-4) / (0.3125 + 1e-4);
        assert!((ssim(20, 20, &a, &b, None).expect("windows") - expected).abs() < 1e-12);
    }

    #[test]
    fn is_symmetric_and_needs_a_window() {
        let (a, b) = (noise(900, 3), noise(900, 4));
        let forward = ssim(30, 30, &a, &b, None).expect("windows");
        assert!((forward - ssim(30, 30, &b, &a, None).expect("windows")).abs() < 1e-14);
        assert_eq!(ssim(10, 90, &a, &b, None), None);
        assert_eq!(ssim(30, 30, &a, &b, Some(&[false; 900])), None);
    }
}
