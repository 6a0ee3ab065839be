//! How far a probe sees: a block of n x n texels a probe over the octahedral map of directions, each
//! the mean and the standard deviation of the distance to what lies that way (Majercik et al. 2019,
//! *Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields*, after variance shadow
//! maps).

use glam::{Vec2, Vec3};

/// Shares below this are crushed: `share (share / CRUSH)²`, which is continuous (Majercik 2019). In a
/// dark room beside one a thousand times brighter it takes the leak from 0.4 % of the bright light to
/// 0.01 % (`a_sealed_dark_room_stays_dark`). SHARED with the client's shader.
pub const CRUSH: f32 = 0.2;

/// Side lengths that the format knows.
pub const SIDES: [u32; 3] = [4, 8, 16];

/// The blocks of all probes of a volume.
#[derive(Clone, Copy, Debug)]
pub struct Visibility<'a> {
    /// Texels a side: n.
    pub side: u32,
    /// Metres that code 255 stands for. Farther is as good as no obstacle.
    pub range: f32,
    /// n² texels a probe, (row, column): codes of mean and standard deviation.
    pub texels: &'a [[u8; 2]],
}

impl Visibility<'_> {
    /// Share of the light from probe `probe` that reaches a point at `offset` from it, 0 to 1:
    /// 1 up to the mean distance, beyond it Chebyshev's bound on the share of distances that are
    /// as long, cubed as in DDGI (Majercik 2019) and crushed below [`CRUSH`] to be done with leaks
    /// sooner.
    ///
    /// The deviation counts at least one code, for the mean is no better known.
    pub fn share(&self, probe: usize, offset: Vec3) -> f32 {
        let distance = offset.length();
        let (mean, square) = self.moments(probe, offset);
        let code = self.range / 255.0;
        // Rounding may leave a mean of texels that are all 255 a little below the range.
        if distance <= mean || mean >= self.range - 0.5 * code {
            return 1.0;
        }
        let variance = (square - mean * mean).max(code * code);
        let beyond = distance - mean;
        let bound = variance / (variance + beyond * beyond);
        let share = bound * bound * bound;
        share * (share / CRUSH).min(1.0).powi(2)
    }

    /// Means of distance and squared distance in a direction, bilinear between texels.
    fn moments(&self, probe: usize, direction: Vec3) -> (f32, f32) {
        let n = self.side as i32;
        let at = (octahedral(direction) + 1.0) * (0.5 * n as f32) - 0.5;
        let base = at.floor();
        let f = at - base;
        let mut sums = (0.0, 0.0);
        for (row, wr) in [(0, 1.0 - f.y), (1, f.y)] {
            for (column, wc) in [(0, 1.0 - f.x), (1, f.x)] {
                let texel = fold(base.y as i32 + row, base.x as i32 + column, n);
                let index = probe * (n * n) as usize + texel;
                let [mean, deviation] = self.texels.get(index).copied().unwrap_or([255, 0]);
                let metres = |code: u8| f32::from(code) * (self.range / 255.0);
                let (mean, deviation) = (metres(mean), metres(deviation));
                let weight = wr * wc;
                sums.0 += weight * mean;
                sums.1 += weight * (mean * mean + deviation * deviation);
            }
        }
        sums
    }
}

/// Number within the block of the texel at (row, column), which may lie one outside: the map's edges
/// are each folded in the middle, its corners are one direction.
fn fold(row: i32, column: i32, n: i32) -> usize {
    let (mut row, mut column) = (row, column);
    if column < 0 || column >= n {
        (row, column) = (n - 1 - row, column.clamp(0, n - 1));
    }
    if row < 0 || row >= n {
        (row, column) = (row.clamp(0, n - 1), n - 1 - column);
    }
    (row * n + column).clamp(0, n * n - 1) as usize
}

/// The direction of a texel's middle.
pub fn texel_direction(texel: usize, side: u32) -> Vec3 {
    let n = side as usize;
    let middle = |i: usize| (2 * i + 1) as f32 / side as f32 - 1.0;
    from_octahedral(Vec2::new(middle(texel % n), middle(texel / n)))
}

/// Octahedral coordinates of a direction, -1 to 1: the map of the points' normals.
pub fn octahedral(d: Vec3) -> Vec2 {
    let sum = d.abs().element_sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return Vec2::ZERO;
    }
    let p = d.truncate() / sum;
    if d.z < 0.0 { fold_over(p) } else { p }
}

/// Unit direction of octahedral coordinates.
pub fn from_octahedral(p: Vec2) -> Vec3 {
    let z = 1.0 - p.abs().element_sum();
    let p = if z < 0.0 { fold_over(p) } else { p };
    p.extend(z).normalize()
}

fn fold_over(p: Vec2) -> Vec2 {
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..2000).map(|i| {
            let z = 1.0 - (2.0 * i as f32 + 1.0) / 2000.0;
            let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
            Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        })
    }

    #[test]
    fn the_map_goes_both_ways() {
        for d in directions() {
            assert!((from_octahedral(octahedral(d)) - d).length() < 1e-5);
        }
    }

    /// Every texel by its own direction, filtered: each is itself.
    #[test]
    fn texel_middles_read_their_texel() {
        for side in SIDES {
            let n = (side * side) as usize;
            let texels: Vec<[u8; 2]> = (0..2 * n).map(|i| [(i % 199) as u8, 3]).collect();
            let range = 25.5;
            let v = Visibility {
                side,
                range,
                texels: &texels,
            };
            for t in 0..n {
                let (mean, square) = v.moments(1, texel_direction(t, side));
                let expected = f32::from(texels[n + t][0]) * 0.1;
                assert!((mean - expected).abs() < 1e-3, "{side} {t}");
                assert!((square - expected * expected - 0.09).abs() < 2e-2);
            }
        }
    }

    /// Filtering has no seam: a small step makes a small change, over the edges of the map, too.
    #[test]
    fn the_filter_is_continuous_everywhere() {
        let texels: Vec<[u8; 2]> = (0..64u32).map(|i| [(i * 37 % 251) as u8, 0]).collect();
        let v = Visibility {
            side: 8,
            range: 255.0,
            texels: &texels,
        };
        for d in directions().chain([Vec3::NEG_Z, Vec3::new(1.0, 0.0, -1e-4)]) {
            for step in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X] {
                let (a, b) = (v.moments(0, d).0, v.moments(0, d + step * 1e-4).0);
                // 250 codes a texel, 8 texels over 2 units of the map, which stretches by 3 at most.
                assert!((a - b).abs() < 0.5, "{d}: {a} {b}");
            }
        }
    }

    #[test]
    fn a_wall_hides_what_is_behind_it() {
        let texels = [[100, 2]; 16];
        let v = Visibility {
            side: 4,
            range: 2.55,
            texels: &texels,
        };
        assert_eq!(v.share(0, Vec3::X * 0.99), 1.0);
        assert!(v.share(0, Vec3::Y * 1.2) < 1e-4);
        let falling: Vec<f32> = (0..20)
            .map(|i| v.share(0, Vec3::Z * (1.0 + 0.005 * i as f32)))
            .collect();
        assert!(falling.windows(2).all(|w| w[1] <= w[0]) && falling[19] < 0.1);
        // A block that is not there hides nothing.
        assert_eq!(v.share(7, Vec3::X * 2.0), 1.0);
    }
}
