//! Bytes per frame over a stream of any length, in a fixed number of bins.

use serde::Serialize;

/// Bins at most; a power of two, so that full bins pair up.
const BINS: usize = 64;
/// Eight heights.
const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Bins of equally many successive frames. When all are full they merge pairwise, so memory does
/// not grow with the stream.
#[derive(Clone, Debug, Serialize)]
pub struct Sparkline {
    /// Frames in each bin but the last, which may have fewer; a power of two.
    frames_per_bin: u64,
    bins: Vec<Bin>,
}

/// Successive frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
struct Bin {
    frames: u64,
    bytes: u64,
    /// Bytes of the smallest frame.
    min: u64,
    /// Bytes of the largest frame.
    max: u64,
}

impl Default for Sparkline {
    fn default() -> Self {
        Sparkline {
            frames_per_bin: 1,
            bins: Vec::with_capacity(BINS),
        }
    }
}

impl Bin {
    fn plus(self, other: Bin) -> Bin {
        Bin {
            frames: self.frames + other.frames,
            bytes: self.bytes + other.bytes,
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    fn mean(self) -> f64 {
        self.bytes as f64 / self.frames as f64
    }
}

impl Sparkline {
    /// The next frame's bytes.
    pub fn push(&mut self, bytes: u64) {
        let frame = Bin {
            frames: 1,
            bytes,
            min: bytes,
            max: bytes,
        };
        if let Some(last) = self.bins.last_mut()
            && last.frames < self.frames_per_bin
        {
            *last = last.plus(frame);
            return;
        }
        if self.bins.len() == BINS {
            for i in 0..BINS / 2 {
                self.bins[i] = self.bins[2 * i].plus(self.bins[2 * i + 1]);
            }
            self.bins.truncate(BINS / 2);
            self.frames_per_bin *= 2;
        }
        self.bins.push(frame);
    }

    /// A line of blocks, one a bin, and the figures; nothing for no frames.
    ///
    /// Heights are logarithmic: the first frame is often a thousand times as large as the rest,
    /// which a linear scale would flatten.
    pub fn to_text(&self) -> String {
        let Some(all) = self.bins.iter().copied().reduce(Bin::plus) else {
            return String::new();
        };
        let means = || self.bins.iter().map(|bin| bin.mean());
        let low = means().fold(f64::INFINITY, f64::min);
        let span = (means().fold(0.0, f64::max) / low).ln();
        let top = (BLOCKS.len() - 1) as f64;
        let line: String = means()
            .map(|mean| {
                let height = if span > 0.0 {
                    (mean / low).ln() / span
                } else {
                    0.0
                };
                BLOCKS[(height * top).round() as usize]
            })
            .collect();
        let frames = match self.frames_per_bin {
            1 => "a frame each".to_string(),
            n => format!("the mean of {n} frames each"),
        };
        format!(
            "bytes per frame: {} to {}, mean {:.0}; log scale, {frames}\n{line}\n",
            all.min,
            all.max,
            all.mean()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// After any number of frames the bins are what a list of all frames cut at once gives.
    #[test]
    fn bins_are_those_of_the_whole_list() {
        let size = |frame: u64| 48 + (frame.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 50);
        let mut sparkline = Sparkline::default();
        let mut sizes = Vec::new();
        for frame in 0..1000 {
            sparkline.push(size(frame));
            sizes.push(size(frame));
            let width = sizes.len().div_ceil(BINS).next_power_of_two();
            assert_eq!(sparkline.frames_per_bin, width as u64);
            let bin = |chunk: &[u64]| Bin {
                frames: chunk.len() as u64,
                bytes: chunk.iter().sum(),
                min: *chunk.iter().min().expect("a frame"),
                max: *chunk.iter().max().expect("a frame"),
            };
            let expected: Vec<Bin> = sizes.chunks(width).map(bin).collect();
            assert_eq!(sparkline.bins, expected, "{} frames", sizes.len());
            assert!(sparkline.bins.len() <= BINS);
        }
    }

    #[test]
    fn heights_are_logarithmic() {
        let line = |sizes: &[u64]| {
            let mut sparkline = Sparkline::default();
            sizes.iter().for_each(|&bytes| sparkline.push(bytes));
            let text = sparkline.to_text();
            text.lines().nth(1).unwrap_or_default().to_string()
        };
        assert_eq!(
            line(&[1, 2, 4, 8, 16, 32, 64, 128]),
            String::from_iter(BLOCKS)
        );
        assert_eq!(line(&[48, 48, 48]), "▁▁▁");
        assert_eq!(line(&[]), "");
    }
}
