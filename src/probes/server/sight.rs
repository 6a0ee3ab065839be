//! What a probe's rays tell of the geometry about it: whether it stands inside a body, and how far
//! it sees in which direction.

use super::Arrived;
use crate::probes::visibility::texel_direction;
use glam::Vec3;

/// Share of rays that meet back faces from which a probe is taken to stand inside (that of RTXGI), and
/// how far beyond it the share must go to turn a decision: 256 rays err by 0.03.
const INSIDE: f32 = 0.25;
const MARGIN: f32 = 0.05;
/// From this share on it stands inside whatever else it sees: the floor, in a box that stands on it
/// and has no bottom. Beside a wall that is a sheet it stays below.
const BURIED: f32 = 0.5;
/// Share of rays that meet a front face within a cell from which a probe lights something in the open
/// and is kept: bodies that are open sheets show their back there.
const OPEN: f32 = 0.05;
/// Frames in a row that must speak against a decision to turn it.
const HOLD: u8 = 3;

/// Whether a probe is present, decided so that it does not flicker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Presence {
    pub present: bool,
    decided: bool,
    contrary: u8,
}

impl Default for Presence {
    fn default() -> Self {
        Presence {
            present: true,
            decided: false,
            contrary: 0,
        }
    }
}

impl Presence {
    /// Takes in a frame's rays; `near` is the length of a cell's diagonal in metres. No rays decide
    /// nothing.
    pub fn update(&mut self, arrived: &[Arrived], near: f32) {
        if arrived.is_empty() {
            return;
        }
        let share = |test: &dyn Fn(&Arrived) -> bool| {
            arrived.iter().filter(|a| test(a)).count() as f32 / arrived.len() as f32
        };
        let back = share(&|a| a.back_face);
        let open = share(&|a| !a.back_face && a.distance <= near);
        // A decision stands until the shares are well on the other side.
        let margin = match (self.decided, self.present) {
            (false, _) => 0.0,
            (true, true) => MARGIN,
            (true, false) => -MARGIN,
        };
        let inside =
            back > BURIED + margin || (back > INSIDE + margin && open < OPEN - 0.5 * margin);
        if inside != self.present {
            self.contrary = 0;
        } else if !self.decided {
            self.present = !inside;
        } else {
            self.contrary += 1;
            if self.contrary >= HOLD {
                self.present = !inside;
                self.contrary = 0;
            }
        }
        self.decided = true;
    }
}

/// Power of the cosine by which a ray counts for a texel's direction (DDGI, Majercik 2019).
const SHARPNESS: i32 = 50;
/// Cosine below which it counts less than 0.001 and is left out.
const REACH: f32 = 0.871;
/// What is left of the distance of a ray that met a back face: nothing is seen through it (RTXGI).
const BACK_SHARE: f32 = 0.2;

/// Sums for a visibility block while it is gathered: weight, distance, squared distance a texel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sums(Vec<[f32; 3]>);

impl Sums {
    /// Takes in a frame's rays. Farther than `range` metres counts as `range`; a back face that was
    /// met stops the sight, unless it goes `through`.
    pub fn add(
        &mut self,
        texels: &[Vec3],
        directions: &[Vec3],
        arrived: &[Arrived],
        range: f32,
        through: bool,
    ) {
        self.0.resize(texels.len(), [0.0; 3]);
        for (direction, ray) in directions.iter().zip(arrived) {
            let stopped = ray.back_face && !through;
            let share = if stopped { BACK_SHARE } else { 1.0 };
            let distance = (ray.distance * share).min(range);
            for (texel, sum) in texels.iter().zip(&mut self.0) {
                let cosine = texel.dot(*direction);
                if cosine > REACH {
                    let weight = cosine.powi(SHARPNESS);
                    sum[0] += weight;
                    sum[1] += weight * distance;
                    sum[2] += weight * distance * distance;
                }
            }
        }
    }

    /// Writes the codes of mean and deviation; a texel without rays sees no obstacle.
    pub fn write(&self, range: f32, codes: &mut [[u8; 2]]) {
        for (sum, code) in self.0.iter().zip(codes) {
            *code = if sum[0] > 0.0 {
                let mean = sum[1] / sum[0];
                let variance = (sum[2] / sum[0] - mean * mean).max(0.0);
                [mean, variance.sqrt()].map(|metres| (metres / range * 255.0).round() as u8)
            } else {
                [255, 0]
            };
        }
    }
}

/// The directions of a block's texels.
pub fn texels(side: u32) -> Vec<Vec3> {
    (0..(side * side) as usize)
        .map(|t| texel_direction(t, side))
        .collect()
}
