//! Values of vertices that no sample says anything about: hidden ones, and those of glass.

use super::shape::Shape;

/// Rounds in which filled values take the mean of their neighbours once more.
const SMOOTHING: usize = 32;

/// Where the values came from that [`fill`] adds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Filled {
    /// Variables that took the values of their neighbours.
    pub from_neighbours: usize,
    /// Variables of parts without any value, which took the default.
    pub from_default: usize,
    /// Variables of parts that are all see-through, which are open: 1.
    pub see_through: usize,
}

/// Gives every variable a value that has none. From those that have one, values spread over the
/// edges of the triangles, ring by ring, each the mean of its neighbours; then the new ones are
/// smoothed. A part of the mesh that nothing spreads to takes `default`, one number a signal.
pub fn fill(shape: &Shape, values: &mut [Vec<f64>], is_known: &[bool], default: &[f64]) -> Filled {
    let mut filled = Filled::default();
    if is_known.iter().all(|known| *known) {
        return filled;
    }
    let neighbours = Neighbours::new(shape);
    let mut known = is_known.to_vec();
    let mut order: Vec<u32> = Vec::new();
    let mut ring: Vec<u32> = (0..known.len() as u32)
        .filter(|&i| known[i as usize])
        .collect();
    while !ring.is_empty() {
        let mut next: Vec<u32> = ring
            .iter()
            .flat_map(|&i| neighbours.of(i as usize))
            .copied()
            .filter(|&j| !known[j as usize])
            .collect();
        next.sort_unstable();
        next.dedup();
        for signal in values.iter_mut() {
            let mean = |i: &u32| neighbours.mean(*i as usize, signal, |j| known[j]);
            let new: Vec<f64> = next.iter().map(mean).collect();
            for (&i, value) in next.iter().zip(new) {
                signal[i as usize] = value;
            }
        }
        next.iter().for_each(|&i| known[i as usize] = true);
        order.extend(&next);
        ring = next;
    }
    for _ in 0..SMOOTHING {
        for signal in values.iter_mut() {
            for &i in &order {
                signal[i as usize] = neighbours.mean(i as usize, signal, |_| true);
            }
        }
    }
    filled.from_neighbours = order.len();
    let mut receives = vec![false; known.len()];
    for (triangle, _) in shape
        .triangles
        .iter()
        .zip(&shape.receives)
        .filter(|(_, r)| **r)
    {
        triangle.iter().for_each(|v| receives[*v as usize] = true);
    }
    for i in (0..known.len()).filter(|&i| !known[i]) {
        match receives[i] {
            true => filled.from_default += 1,
            false => filled.see_through += 1,
        }
        for (signal, default) in values.iter_mut().zip(default) {
            signal[i] = if receives[i] { *default } else { 1.0 };
        }
    }
    filled
}

/// Which variables share an edge of a triangle.
struct Neighbours {
    starts: Vec<usize>,
    list: Vec<u32>,
}

impl Neighbours {
    fn new(shape: &Shape) -> Neighbours {
        let mut pairs = Vec::with_capacity(6 * shape.triangles.len());
        for &[a, b, c] in &shape.triangles {
            pairs.extend([[a, b], [b, a], [b, c], [c, b], [c, a], [a, c]]);
        }
        pairs.retain(|[a, b]| a != b);
        pairs.sort_unstable();
        pairs.dedup();
        let starts = (0..=shape.variables() as u32)
            .map(|i| pairs.partition_point(|pair| pair[0] < i))
            .collect();
        Neighbours {
            starts,
            list: pairs.into_iter().map(|pair| pair[1]).collect(),
        }
    }

    fn of(&self, i: usize) -> &[u32] {
        &self.list[self.starts[i]..self.starts[i + 1]]
    }

    /// Mean of the neighbours for which `counts` holds; of none, the value itself.
    fn mean(&self, i: usize, values: &[f64], counts: impl Fn(usize) -> bool) -> f64 {
        let (mut sum, mut number) = (0.0, 0.0);
        for &j in self.of(i).iter().filter(|&&j| counts(j as usize)) {
            sum += values[j as usize];
            number += 1.0;
        }
        if number > 0.0 {
            sum / number
        } else {
            values[i]
        }
    }
}
