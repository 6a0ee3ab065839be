//! The client's look-up as a sparse linear map: from the coefficients of all probes to the
//! irradiance at every receiver.
//!
//! A row is the product of few probes' interpolation weights and the nine values of the cosine's
//! convolution at the receiver's normal, so that it takes 8 + 9 numbers instead of 72.

use super::receivers::Receiver;
use crate::probes::lattice::Lattice;
use crate::probes::sample::{Field, visibility_weights};
use crate::probes::sh::{self, COSINE, L2, L2_COUNT};
use glam::Vec3;
use rayon::prelude::*;

/// Weights below this share of a row's are left out.
const LEAST: f32 = 1e-6;
/// Steps from a present probe within which the format fills absent ones (`spec/probes.md` §8).
const FILLED: usize = 4;

/// A probe or a receiver, and its weight.
type Entry = (u32, f32);

/// The map and its transpose.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Probes of each receiver; their weights add up to 1.
    probes: Lists,
    /// Receivers of each probe, in ascending order.
    receivers: Lists,
    /// Irradiance of each function of the basis at a receiver's normal.
    basis: Vec<[f32; L2_COUNT]>,
}

/// Lists of entries, one after the other.
#[derive(Clone, Debug, Default)]
struct Lists {
    /// Where each list starts, and the end.
    starts: Vec<usize>,
    entries: Vec<Entry>,
}

impl Lists {
    fn new(lists: impl IntoIterator<Item = Vec<Entry>>) -> Lists {
        let mut starts = vec![0];
        let mut entries = Vec::new();
        for list in lists {
            entries.extend(list);
            starts.push(entries.len());
        }
        Lists { starts, entries }
    }

    fn of(&self, number: usize) -> &[Entry] {
        &self.entries[self.starts[number]..self.starts[number + 1]]
    }

    /// Lists by the other number, of `count`.
    fn transposed(&self, count: usize) -> Lists {
        let mut lists = vec![Vec::new(); count];
        for list in 0..self.starts.len() - 1 {
            for &(other, weight) in self.of(list) {
                lists[other as usize].push((list as u32, weight));
            }
        }
        Lists::new(lists)
    }
}

impl Rows {
    /// The rows of `receivers` for what clients of `field` look up: visibility-weighted if it has a
    /// visibility block, and trilinear with absent probes filled if it has none. The radiance of
    /// `field` is not looked at.
    pub fn new(field: &Field, receivers: &[Receiver]) -> Rows {
        let fill = fill(&field.lattice, field.present);
        let list = |r: &Receiver| {
            let corners = match field.visibility {
                Some(_) => visibility_weights(field, r.x, r.geometric_normal, r.view),
                None => field.lattice.corners(r.x),
            };
            let total: f32 = corners.iter().map(|c| c.weight).sum();
            let mut entries: Vec<Entry> = Vec::with_capacity(8);
            for corner in corners {
                let share = corner.weight / total;
                if share < LEAST {
                    continue;
                }
                for &(probe, weight) in &fill[corner.probe] {
                    match entries.iter_mut().find(|(p, _)| *p == probe) {
                        Some((_, w)) => *w += share * weight,
                        None => entries.push((probe, share * weight)),
                    }
                }
            }
            entries
        };
        let lists: Vec<Vec<Entry>> = receivers.par_iter().map(list).collect();
        let probes = Lists::new(lists);
        Rows {
            receivers: probes.transposed(field.lattice.count()),
            probes,
            basis: receivers.iter().map(|r| irradiance_of(r.normal)).collect(),
        }
    }

    /// Number of receivers.
    pub fn len(&self) -> usize {
        self.basis.len()
    }

    /// Irradiance at every receiver by probes of these expansions.
    pub fn look_up(&self, light: &[L2]) -> Vec<Vec3> {
        let row = |r: usize| -> Vec3 {
            let basis = &self.basis[r];
            let probe = |&(probe, weight): &Entry| {
                let c = &light[probe as usize];
                let value: Vec3 = c.iter().zip(basis).map(|(c, b)| *c * *b).sum();
                value * weight
            };
            self.probes.of(r).iter().map(probe).sum()
        };
        (0..self.len()).into_par_iter().map(row).collect()
    }

    /// The transposed map: what the values at all receivers add to each coefficient.
    pub fn spread(&self, values: &[Vec3]) -> Vec<L2> {
        let probe = |p: usize| {
            let mut sum = [Vec3::ZERO; L2_COUNT];
            for &(r, weight) in self.receivers.of(p) {
                let value = values[r as usize] * weight;
                for (s, b) in sum.iter_mut().zip(&self.basis[r as usize]) {
                    *s += value * *b;
                }
            }
            sum
        };
        let count = self.receivers.starts.len() - 1;
        (0..count).into_par_iter().map(probe).collect()
    }

    /// The diagonal of the normal equations for receivers of these weights.
    pub fn diagonal(&self, weights: &[f32]) -> Vec<[f32; L2_COUNT]> {
        let probe = |p: usize| {
            let mut sum = [0.0; L2_COUNT];
            for &(r, weight) in self.receivers.of(p) {
                let factor = weights[r as usize] * weight * weight;
                for (s, b) in sum.iter_mut().zip(&self.basis[r as usize]) {
                    *s += factor * b * b;
                }
            }
            sum
        };
        let count = self.receivers.starts.len() - 1;
        (0..count).into_par_iter().map(probe).collect()
    }

    /// Probes that a receiver's light comes from, those with a share of at least `least`.
    pub fn probes_of(&self, receiver: usize, least: f32) -> impl Iterator<Item = usize> {
        let entries = self.probes.of(receiver).iter();
        entries
            .filter(move |(_, weight)| *weight >= least)
            .map(|(probe, _)| *probe as usize)
    }
}

/// Irradiance on normal `n` by each function of the basis.
fn irradiance_of(n: Vec3) -> [f32; L2_COUNT] {
    let y = sh::basis_l2(n);
    std::array::from_fn(|i| COSINE[sh::degree_of(i)] * y[i])
}

/// Every probe's value as a mean of present ones', by the format's rule less its rounding: an absent
/// probe has the mean over those neighbours that are one step nearer to a present one.
fn fill(lattice: &Lattice, present: &[bool]) -> Vec<Vec<Entry>> {
    let mut lists: Vec<Vec<Entry>> = present
        .iter()
        .enumerate()
        .map(|(p, present)| match present {
            true => vec![(p as u32, 1.0)],
            false => Vec::new(),
        })
        .collect();
    let [dx, dy, _] = lattice.dims.map(usize::from);
    let strides = [1, dx, dx * dy];
    for _ in 0..FILLED {
        let before = lists.clone();
        for (p, list) in lists.iter_mut().enumerate() {
            if !list.is_empty() {
                continue;
            }
            let place = lattice.place(p);
            let mut near = Vec::new();
            for axis in 0..3 {
                if place[axis] > 0 {
                    near.push(&before[p - strides[axis]]);
                }
                if place[axis] + 1 < u32::from(lattice.dims[axis]) {
                    near.push(&before[p + strides[axis]]);
                }
            }
            near.retain(|list| !list.is_empty());
            let share = 1.0 / near.len().max(1) as f32;
            for &(probe, weight) in near.into_iter().flatten() {
                match list.iter_mut().find(|(p, _)| *p == probe) {
                    Some((_, w)) => *w += share * weight,
                    None => list.push((probe, share * weight)),
                }
            }
        }
    }
    lists
}
