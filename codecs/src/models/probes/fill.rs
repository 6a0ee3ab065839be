//! What stands in the place of absent probes, since trilinear filtering in hardware reads them:
//! `spec/probes.md` §8.

use alloc::vec::Vec;

use super::f16::{f16_from_units, units_from_f16};
use super::{Probe, TEXELS, Texel};
use crate::error::ErrorKind;
use crate::memory::index_set::IndexSet;
use crate::memory::reserve::filled;

/// Absent probes that are more steps than this from each present one are 0. A change of a probe
/// reaches no further, which bounds its work.
const REACH: usize = 4;
/// The distance of a probe beyond the reach of all present ones.
const FAR: u8 = REACH as u8 + 1;

/// The distances of probes, and what a frame changed about them.
pub(super) struct Fill {
    /// Steps along the axes to the nearest present probe, or [`FAR`].
    distances: Vec<u8>,
    /// Probes that came or went, then all whose distance that may change.
    region: IndexSet,
    /// By distance: probes whose texels changed, or have to be computed again.
    levels: [IndexSet; REACH + 1],
}

impl Fill {
    /// Sets of a fill.
    pub(super) const SETS: usize = REACH + 2;

    /// The fill of `count` absent probes.
    pub(super) fn new(count: usize) -> Result<Fill, ErrorKind> {
        let set = || IndexSet::new(count);
        Ok(Fill {
            distances: filled(count, FAR)?,
            region: set()?,
            levels: [set()?, set()?, set()?, set()?, set()?],
        })
    }

    /// The texels of a present probe changed.
    pub(super) fn changed(&mut self, probe: usize) {
        self.levels[0].insert(probe);
    }

    /// A probe came or went.
    pub(super) fn came_or_went(&mut self, probe: usize) {
        self.region.insert(probe);
    }

    /// Fills absent probes in again about those that changed. Calls `dirty` with each whose texels
    /// are others now. Returns how many were looked at.
    pub(super) fn update(
        &mut self,
        dims: [u16; 3],
        probes: &[Probe],
        texels: &mut [Texel],
        mut dirty: impl FnMut(usize),
    ) -> u64 {
        let mut steps = 0;
        if !self.region.is_empty() {
            steps += self.find_distances(dims, probes);
            let Fill {
                distances,
                region,
                levels,
            } = self;
            region.each(|probe| match distances[probe] {
                0 => {}
                FAR => {
                    if put(texels, probes.len(), probe, |_| [0; 4]) {
                        dirty(probe);
                    }
                }
                distance => {
                    levels[usize::from(distance)].insert(probe);
                }
            });
            region.clear();
        }
        for distance in 0..=REACH {
            let (done, next) = self.levels.split_at_mut(distance + 1);
            let (level, distances) = (&mut done[distance], &self.distances);
            level.each(|probe| {
                steps += 1;
                if distance > 0 {
                    if !average(dims, probe, distances, texels) {
                        return;
                    }
                    dirty(probe);
                }
                if let Some(next) = next.first_mut() {
                    neighbours(dims, probe, |near| {
                        if usize::from(distances[near]) == distance + 1 {
                            next.insert(near);
                        }
                    });
                }
            });
            level.clear();
        }
        steps
    }

    /// Extends the region to all probes within reach of those that came or went, and finds their
    /// distances. Those of others cannot change.
    fn find_distances(&mut self, dims: [u16; 3], probes: &[Probe]) -> u64 {
        let mut steps = 0;
        let [_, border, next, ..] = &mut self.levels;
        self.region.each(|probe| {
            border.insert(probe);
        });
        for _ in 0..REACH {
            border.each(|probe| {
                neighbours(dims, probe, |near| {
                    if self.region.insert(near) {
                        next.insert(near);
                    }
                });
            });
            border.clear();
            core::mem::swap(border, next);
        }
        border.clear();
        let distances = &mut self.distances;
        self.region.each(|probe| {
            distances[probe] = if probes[probe].level > 0 { 0 } else { FAR };
        });
        for distance in 1..FAR {
            self.region.each(|probe| {
                steps += 1;
                if distances[probe] != FAR {
                    return;
                }
                let mut found = false;
                neighbours(dims, probe, |near| found |= distances[near] == distance - 1);
                if found {
                    distances[probe] = distance;
                }
            });
        }
        steps
    }
}

/// Fills a probe from its neighbours that are one step nearer to a present one. Returns whether its
/// texels changed.
fn average(dims: [u16; 3], probe: usize, distances: &[u8], texels: &mut [Texel]) -> bool {
    let nearer = distances[probe] - 1;
    let (mut from, mut sources) = ([0; 6], 0);
    neighbours(dims, probe, |near| {
        if distances[near] == nearer {
            from[sources] = near;
            sources += 1;
        }
    });
    put(texels, distances.len(), probe, |plane| {
        let mut sums = [0i64; 4];
        for &near in &from[..sources] {
            for (sum, bits) in sums.iter_mut().zip(plane[near]) {
                *sum += units_from_f16(bits);
            }
        }
        sums.map(|sum| f16_from_units(sum.div_euclid(sources.max(1) as i64)))
    })
}

/// Writes the texels of a probe, each computed from its plane. Returns whether they changed.
fn put(
    texels: &mut [Texel],
    count: usize,
    probe: usize,
    texel: impl Fn(&[Texel]) -> Texel,
) -> bool {
    let mut changed = false;
    for plane in texels.chunks_exact_mut(count).take(TEXELS) {
        let texel = texel(plane);
        changed |= plane[probe] != texel;
        plane[probe] = texel;
    }
    changed
}

/// The probes one step away along an axis.
#[inline]
fn neighbours(dims: [u16; 3], probe: usize, mut visit: impl FnMut(usize)) {
    let mut stride = 1;
    for dim in dims.map(usize::from) {
        let at = probe / stride % dim;
        if at > 0 {
            visit(probe - stride);
        }
        if at + 1 < dim {
            visit(probe + stride);
        }
        stride *= dim;
    }
}
