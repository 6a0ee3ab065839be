//! Cosine-distributed directions from a fixed low-discrepancy sequence.
//!
//! For every ray count there are [`PATTERNS`] base patterns: Owen-scrambled Sobol' points (Burley
//! 2020, *Practical Hash-based Owen Scrambling*), mapped to the hemisphere and put in an order in
//! which successive directions are neighbours (Hilbert's curve over the disk below them), because
//! that order is worth much to the caches. A point on a surface takes one of the patterns and turns it about its
//! normal, both chosen by its seed: so it has the same directions in every frame, its neighbour has
//! others, and a direction costs nine multiplications.

use glam::Vec3;

/// Base patterns per ray count.
pub const PATTERNS: usize = 16;

/// The base patterns of one ray count.
#[derive(Clone, Debug)]
pub struct Patterns {
    /// [`PATTERNS`] times `rays` unit directions about +Z.
    directions: Vec<Vec3>,
    rays: usize,
}

impl Patterns {
    pub fn new(rays: u32) -> Patterns {
        let rays = rays as usize;
        let mut directions = Vec::with_capacity(PATTERNS * rays);
        for pattern in 0..PATTERNS as u32 {
            let (s0, s1) = (hash(2 * pattern + 1), hash(2 * pattern + 2));
            let mut disk: Vec<(u32, [f64; 2])> = (0..rays as u32)
                .map(|i| {
                    let [x, y] = sobol(i);
                    let r = unit(scramble(x, s0)).sqrt();
                    let (sin, cos) = (std::f64::consts::TAU * unit(scramble(y, s1))).sin_cos();
                    let p = [r * cos, r * sin];
                    (hilbert(p), p)
                })
                .collect();
            disk.sort_by_key(|&(key, _)| key);
            directions.extend(disk.iter().map(|(_, [x, y])| {
                Vec3::new(
                    *x as f32,
                    *y as f32,
                    (1.0 - x * x - y * y).max(0.0).sqrt() as f32,
                )
            }));
        }
        Patterns { directions, rays }
    }

    /// Rays per pattern.
    pub fn rays(&self) -> u32 {
        self.rays as u32
    }

    /// The directions about +Z for a seed, before they are turned, and the turn.
    pub fn pick(&self, seed: u32) -> (&[Vec3], Rotation) {
        let h = hash(seed ^ 0x9e37_79b9);
        let pattern = h as usize % PATTERNS;
        let angle = std::f64::consts::TAU * unit(hash(h));
        let (sin, cos) = angle.sin_cos();
        let turn = Rotation {
            cos: cos as f32,
            sin: sin as f32,
        };
        (&self.directions[pattern * self.rays..][..self.rays], turn)
    }
}

/// A rotation about +Z.
#[derive(Clone, Copy, Debug)]
pub struct Rotation {
    cos: f32,
    sin: f32,
}

/// Axes of a frame whose third axis is a normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

impl Frame {
    /// A right-handed orthonormal frame about a unit normal (Duff et al. 2017, *Building an
    /// Orthonormal Basis, Revisited*), turned about it.
    pub fn new(normal: Vec3, turn: Rotation) -> Frame {
        let n = normal;
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        let x = Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
        let y = Vec3::new(b, sign + n.y * n.y * a, -n.y);
        Frame {
            x: x * turn.cos + y * turn.sin,
            y: y * turn.cos - x * turn.sin,
            z: n,
        }
    }

    /// [`Frame::new`] without a turn.
    pub fn about(normal: Vec3) -> Frame {
        Frame::new(normal, Rotation { cos: 1.0, sin: 0.0 })
    }

    #[inline(always)]
    pub fn to_local(self, d: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(d), self.y.dot(d), self.z.dot(d))
    }

    #[inline(always)]
    pub fn to_world(self, d: Vec3) -> Vec3 {
        self.x * d.x + self.y * d.y + self.z * d.z
    }
}

/// The first two dimensions of Sobol's sequence, as fractions of 2^32.
pub(super) fn sobol(index: u32) -> [u32; 2] {
    // The second dimension's direction numbers are Pascal's triangle modulo 2: bit j is the sum
    // over all bits i of the index with j a subset of i (Lucas), which is a product of five steps.
    let mut y = index;
    y ^= y >> 1 & 0x5555_5555;
    y ^= y >> 2 & 0x3333_3333;
    y ^= y >> 4 & 0x0f0f_0f0f;
    y ^= y >> 8 & 0x00ff_00ff;
    y ^= y >> 16 & 0x0000_ffff;
    [index.reverse_bits(), y.reverse_bits()]
}

/// Nested uniform scrambling of a fraction of 2^32 (Laine and Karras 2011, constants of Burley
/// 2020).
pub(super) fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x.reverse_bits()
}

/// A well-mixed permutation of 32 bits (Wellons, `lowbias32`).
pub(super) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// In [0, 1), the middle of the fraction's cell, so that no direction lies on the horizon.
fn unit(x: u32) -> f64 {
    (f64::from(x) + 0.5) / 4_294_967_296.0
}

/// Position along Hilbert's curve of a point of [-1, 1]².
fn hilbert(p: [f64; 2]) -> u32 {
    const BITS: u32 = 12;
    let cells = f64::from(1u32 << BITS);
    let cell = |v: f64| (((v + 1.0) * 0.5 * cells) as u32).min((1 << BITS) - 1);
    let (mut x, mut y) = (cell(p[0]), cell(p[1]));
    let mut d = 0;
    let mut s = 1u32 << (BITS - 1);
    while s > 0 {
        let (rx, ry) = (u32::from(x & s != 0), u32::from(y & s != 0));
        d += s * s * ((3 * rx) ^ ry);
        if ry == 0 {
            if rx == 1 {
                (x, y) = (
                    s.wrapping_sub(1).wrapping_sub(x),
                    s.wrapping_sub(1).wrapping_sub(y),
                );
            }
            (x, y) = (y, x);
        }
        x &= s.wrapping_sub(1);
        y &= s.wrapping_sub(1);
        s >>= 1;
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_dimension_follows_its_direction_numbers() {
        for index in (0..1 << 12).chain((0..32).map(|b| 0xdead_beef >> b)) {
            let (mut y, mut direction) = (0, 1u32 << 31);
            for bit in 0..32 {
                if index >> bit & 1 != 0 {
                    y ^= direction;
                }
                direction ^= direction >> 1;
            }
            assert_eq!(sobol(index)[1], y, "{index}");
        }
    }

    /// Sobol' points in base 2 are a (0, 2)-sequence, and Owen scrambling keeps it so.
    #[test]
    fn every_elementary_interval_holds_one_point() {
        for log in [4u32, 6, 7] {
            let n = 1u32 << log;
            for a in 0..=log {
                let mut seen = vec![0; n as usize];
                for i in 0..n {
                    let [x, y] = sobol(i);
                    let (x, y) = (scramble(x, 77), scramble(y, 12345));
                    let (cx, cy) = ((u64::from(x) << a) >> 32, (u64::from(y) << (log - a)) >> 32);
                    seen[((cx << (log - a)) + cy) as usize] += 1;
                }
                assert!(seen.iter().all(|&s| s == 1), "2^{log} points, split {a}");
            }
        }
    }

    #[test]
    fn directions_are_cosine_distributed_and_unit() {
        for rays in [1u32, 7, 64, 128, 512] {
            let patterns = Patterns::new(rays);
            for seed in 0..40 {
                let (directions, turn) = patterns.pick(seed);
                assert_eq!(directions.len(), rays as usize);
                let frame = Frame::new(Vec3::new(0.6, -0.48, -0.64), turn);
                let mut mean = 0.0;
                for d in directions {
                    let w = frame.to_world(*d);
                    assert!((w.length() - 1.0).abs() < 1e-5);
                    assert!(d.z > 0.0);
                    mean += w.dot(frame.z) / rays as f32;
                }
                // E[cos] = 2/3; stratification makes it far better than 0.24 / sqrt(n).
                if rays >= 64 {
                    assert!(
                        (mean - 2.0 / 3.0).abs() < 0.5 / rays as f32,
                        "{rays}: {mean}"
                    );
                }
            }
        }
    }

    /// The share of directions in any half space through the normal has error O(1/n), averaged over
    /// seeds none at all.
    #[test]
    fn half_spaces_are_sampled_evenly() {
        let patterns = Patterns::new(128);
        let mut total = 0.0;
        for seed in 0..2000 {
            let (directions, turn) = patterns.pick(seed);
            let frame = Frame::new(Vec3::Y, turn);
            let share = directions
                .iter()
                .filter(|d| frame.to_world(**d).x > 0.0)
                .count() as f32
                / 128.0;
            assert!((share - 0.5).abs() < 0.08, "{share}");
            total += share / 2000.0;
        }
        assert!((total - 0.5).abs() < 0.002, "{total}");
    }

    #[test]
    fn successive_directions_are_neighbours() {
        let patterns = Patterns::new(128);
        let (d, _) = patterns.pick(3);
        let step = d.windows(2).map(|w| w[0].distance(w[1])).sum::<f32>() / 127.0;
        // 128 points on a disk of area pi are 0.16 apart; in the sequence's own order 0.9.
        assert!(step < 0.3, "{step}");
    }

    #[test]
    fn frames_are_orthonormal_for_every_normal() {
        let turn = Rotation { cos: 0.8, sin: 0.6 };
        let mut normals = vec![
            Vec3::Z,
            -Vec3::Z,
            Vec3::X,
            -Vec3::Y,
            Vec3::new(1e-20, 0.0, -1.0),
        ];
        normals.extend((0..1000).map(|i| {
            let h = |k: u32| unit(hash(3 * i + k)) as f32 - 0.5;
            Vec3::new(h(0), h(1), h(2)).normalize()
        }));
        for n in normals {
            let f = Frame::new(n, turn);
            assert!(
                f.x.dot(f.y).abs() < 1e-6 && f.x.dot(f.z).abs() < 1e-6 && f.y.dot(f.z).abs() < 1e-6
            );
            assert!((f.x.cross(f.y) - f.z).length() < 1e-6, "{n}");
        }
    }
}
