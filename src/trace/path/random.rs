//! Random numbers of a path, from a counter and never from a state that threads share.
//!
//! A number depends on (seed, stream, sample, dimension) alone: a stream is a pixel or a probe, a
//! dimension is one decision of a path. Along the samples of one stream every dimension is an
//! Owen-scrambled Sobol' sequence, shuffled against the other dimensions (Burley 2020, *Practical
//! Hash-based Owen Scrambling*, section 5): any aligned 2^k successive samples are spread evenly,
//! so that a mean over them converges at least as fast as one of independent numbers. Different
//! streams or seeds are independent.

use crate::trace::sampler::{hash, scramble, sobol};

/// The numbers of one sample of one stream, to be drawn one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    stream: u32,
    sample: u32,
    dimension: u32,
}

impl Random {
    /// The numbers of sample `sample` of stream `stream`.
    pub fn new(seed: u32, stream: u32, sample: u32) -> Random {
        Random {
            stream: hash(stream ^ hash(seed ^ 0x9e37_79b9)),
            sample,
            dimension: 0,
        }
    }

    /// The seed of the next dimension and the shuffled number of the sample in it.
    fn next(&mut self) -> (u32, u32) {
        self.dimension += 1;
        let seed = hash(self.stream ^ self.dimension.wrapping_mul(0x9e37_79b9));
        (seed, scramble(self.sample, seed))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        let (seed, index) = self.next();
        fraction(scramble(index.reverse_bits(), hash(seed ^ 1)))
    }

    /// Uniform in [0, 1)², spread evenly in both at once.
    pub fn pair(&mut self) -> [f32; 2] {
        let (seed, index) = self.next();
        let [x, y] = sobol(index);
        [
            fraction(scramble(x, hash(seed ^ 1))),
            fraction(scramble(y, hash(seed ^ 2))),
        ]
    }
}

fn fraction(x: u32) -> f32 {
    (x >> 8) as f32 / (1u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_aligned_block_of_samples_fills_every_elementary_interval() {
        for (stream, start) in [(0, 0), (7, 64), (7, 4096)] {
            for a in 0..=6 {
                let mut seen = [0; 64];
                for sample in start..start + 64 {
                    let mut random = Random::new(3, stream, sample);
                    random.unit();
                    let [x, y] = random.pair();
                    let cell = |v: f32, bits: u32| (v * (1 << bits) as f32) as usize;
                    seen[cell(x, a) << (6 - a) | cell(y, 6 - a)] += 1;
                }
                assert_eq!(seen, [1; 64], "stream {stream} from {start}, split {a}");
            }
        }
    }

    /// Means over streams of products of numbers that must not know each other.
    #[test]
    fn dimensions_streams_and_seeds_are_independent() {
        let n = 1 << 16;
        let mut sums = [0.0f64; 4];
        for stream in 0..n {
            let mut a = Random::new(1, stream, 5);
            let (first, [second, _]) = (a.unit(), a.pair());
            let neighbour = Random::new(1, stream + 1, 5).unit();
            let other = Random::new(2, stream, 5).unit();
            let next = Random::new(1, stream, 1 << 20).unit();
            for (sum, y) in sums.iter_mut().zip([second, neighbour, other, next]) {
                *sum += f64::from((first - 0.5) * (y - 0.5));
            }
        }
        // The product has a standard deviation of 1/12; four of the mean's.
        let bound = 4.0 / 12.0 / f64::from(n).sqrt();
        for sum in sums {
            assert!((sum / f64::from(n)).abs() < bound, "{sums:?}");
        }
    }
}
