//! What stands in the place of absent probes, since trilinear filtering in hardware reads them:
//! `spec/probes.md` §8.

use alloc::vec::Vec;

use super::f16::{f16_from_units, units_from_f16};
use super::{Probe, TEXELS, Texel};

/// A probe that no present one can be reached from, as there is none.
const UNREACHED: u32 = u32::MAX;

/// Absent probes in the order in which they are filled.
#[derive(Default)]
pub(super) struct Fill {
    /// Steps along the axes to the nearest present probe.
    distances: Vec<u32>,
    /// Absent probes by distance, then by where they were found from.
    order: Vec<u32>,
}

impl Fill {
    /// Room for a volume of `count` probes.
    pub(super) fn with_room(count: usize) -> Fill {
        let mut fill = Fill::default();
        fill.distances.reserve_exact(count);
        fill.order.reserve_exact(count);
        fill
    }

    /// There is nothing to fill.
    pub(super) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Finds the distances of all probes, breadth first from the present ones.
    pub(super) fn find(&mut self, dims: [u16; 3], probes: &[Probe]) {
        let distances = &mut self.distances;
        distances.clear();
        distances.extend(probes.iter().map(|probe| match probe.level {
            0 => UNREACHED,
            _ => 0,
        }));
        self.order.clear();
        // First from all present ones, then from those found in the round before.
        for probe in 0..probes.len() as u32 {
            if distances[probe as usize] == 0 {
                reach(dims, probe, 1, distances, &mut self.order);
            }
        }
        let mut done = 0;
        while done < self.order.len() {
            let probe = self.order[done];
            let distance = distances[probe as usize] + 1;
            reach(dims, probe, distance, distances, &mut self.order);
            done += 1;
        }
        if self.order.is_empty() && distances.first() == Some(&UNREACHED) {
            // Nothing is present: all of them, each without a neighbour to take from.
            self.order.extend(0..probes.len() as u32);
        }
    }

    /// Fills the texels of absent probes.
    pub(super) fn write(&self, dims: [u16; 3], texels: &mut [Texel]) {
        let count = self.distances.len();
        for &probe in &self.order {
            let distance = self.distances[probe as usize];
            let (mut from, mut sources) = ([0; 6], 0);
            neighbours(dims, probe, |near| {
                if distance != UNREACHED && self.distances[near as usize] == distance - 1 {
                    from[sources] = near as usize;
                    sources += 1;
                }
            });
            for plane in texels.chunks_exact_mut(count).take(TEXELS) {
                let mut sums = [0i64; 4];
                for &near in &from[..sources] {
                    for (sum, bits) in sums.iter_mut().zip(plane[near]) {
                        *sum += units_from_f16(bits);
                    }
                }
                plane[probe as usize] = match sources {
                    0 => [0; 4],
                    _ => sums.map(|sum| f16_from_units(sum.div_euclid(sources as i64))),
                };
            }
        }
    }
}

/// Gives a distance to the neighbours that have none, and puts them in order.
fn reach(dims: [u16; 3], probe: u32, distance: u32, distances: &mut [u32], order: &mut Vec<u32>) {
    neighbours(dims, probe, |near| {
        if distances[near as usize] == UNREACHED {
            distances[near as usize] = distance;
            order.push(near);
        }
    });
}

/// The probes one step away along an axis.
fn neighbours(dims: [u16; 3], probe: u32, mut each: impl FnMut(u32)) {
    let mut stride = 1;
    for dim in dims.map(u32::from) {
        let at = probe / stride % dim;
        if at > 0 {
            each(probe - stride);
        }
        if at + 1 < dim {
            each(probe + stride);
        }
        stride *= dim;
    }
}
