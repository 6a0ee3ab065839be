//! Weighted sample elimination: a blue-noise subset of random samples, in progressive order.
//!
//! Yuksel, "Sample Elimination for Generating Poisson Disk Sample Sets", Eurographics 2015: the
//! sample with the largest weight is removed until enough are left, where a sample's weight is the
//! sum of a falloff over its neighbours.

use glam::Vec3;

/// Falloff exponent (Yuksel 2015, Eq. 3).
const ALPHA: i32 = 8;
/// Weight limiting (Yuksel 2015, Eq. 4).
const BETA: f32 = 0.65;
const GAMMA: f32 = 1.5;

/// Distance between neighbours when `density` disks per square metre are packed as tightly as they
/// go: twice the maximum Poisson disk radius in two dimensions (Yuksel 2015, Eq. 1). Metres.
///
/// The surface's own area has to be used: Yuksel's automatic choice takes the bounding box.
pub fn packed_distance(density: f64) -> f32 {
    2.0 * (1.0 / (2.0 * 3f64.sqrt() * density)).sqrt() as f32
}

/// Picks `target` of the samples and returns their indices in progressive order: every prefix is
/// itself well distributed. `d_max` is [`packed_distance`] at the density of `target` samples.
///
/// Samples whose normals' cosine is not above `normal_threshold` do not repel each other. They never
/// serve the same fragment (PSAO Eq. 3), and the two sides of a thin sheet would otherwise leave
/// holes in each other.
pub fn eliminate(
    positions: &[Vec3],
    normals: &[Vec3],
    target: usize,
    d_max: f32,
    normal_threshold: f32,
) -> Vec<u32> {
    let samples = Samples {
        positions,
        normals,
        normal_threshold,
    };
    let mut kept: Vec<u32> = (0..positions.len() as u32).collect();
    if target < kept.len() {
        samples.thin(&mut kept, target, d_max);
    }
    // The kept samples are eliminated further, by halves, and what goes first comes last
    // (Yuksel 2015, §3.4). Half the samples stand sqrt(2) times as far apart.
    let mut tail = Vec::with_capacity(kept.len());
    let mut d_max = d_max;
    while kept.len() > 1 {
        d_max *= std::f32::consts::SQRT_2;
        let half = kept.len() / 2;
        tail.extend(samples.thin(&mut kept, half, d_max));
    }
    kept.extend(tail.into_iter().rev());
    kept
}

struct Samples<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    normal_threshold: f32,
}

impl Samples<'_> {
    /// Removes samples from `kept` until `target` are left; returns them in the order of removal.
    fn thin(&self, kept: &mut Vec<u32>, target: usize, d_max: f32) -> Vec<u32> {
        let neighbours = self.neighbours(kept, d_max);
        let d_min = d_max * (1.0 - (target as f32 / kept.len() as f32).powf(GAMMA)) * BETA;
        let falloff = |distance: f32| (1.0 - distance.max(d_min) / d_max).max(0.0).powi(ALPHA);

        let weights = (0..kept.len())
            .map(|i| neighbours.of(i).iter().map(|n| falloff(n.distance)).sum())
            .collect();
        let mut heap = WeightHeap::new(weights);
        let mut removed = Vec::with_capacity(kept.len() - target);
        let mut gone = vec![false; kept.len()];
        while kept.len() - removed.len() > target {
            let i = heap.pop();
            gone[i] = true;
            removed.push(kept[i]);
            for n in neighbours.of(i) {
                if !gone[n.sample as usize] {
                    heap.reduce(n.sample as usize, falloff(n.distance));
                }
            }
        }
        let mut index = 0;
        kept.retain(|_| {
            index += 1;
            !gone[index - 1]
        });
        removed
    }

    /// All pairs of `kept` that repel each other, by a sorted uniform grid with cells of `d_max`.
    fn neighbours(&self, kept: &[u32], d_max: f32) -> Neighbours {
        let origin = kept
            .iter()
            .fold(Vec3::INFINITY, |m, &s| m.min(self.positions[s as usize]));
        let cell_of = |s: u32| ((self.positions[s as usize] - origin) / d_max).as_ivec3();
        let mut sorted: Vec<([i32; 3], u32)> = kept
            .iter()
            .enumerate()
            .map(|(i, &s)| (cell_of(s).to_array(), i as u32))
            .collect();
        sorted.sort_unstable();

        let mut list = Neighbours {
            first: vec![0; kept.len() + 1],
            pairs: Vec::new(),
        };
        // One pass in sample order per list would need random access; collect per sorted sample,
        // then put the lists into sample order.
        let mut found: Vec<(u32, Neighbour)> = Vec::with_capacity(kept.len() * 8);
        let row = |x: i32, y: i32, z: i32, from: usize| {
            from + sorted[from..].partition_point(|&(c, _)| c < [x, y, z])
        };
        // The nine columns of three z-adjacent cells around a cell advance with it.
        let mut start = [0usize; 9];
        let mut last = None;
        for &([x, y, z], i) in &sorted {
            if last != Some([x, y, z]) {
                for (k, s) in start.iter_mut().enumerate() {
                    let (dx, dy) = (k as i32 / 3 - 1, k as i32 % 3 - 1);
                    *s = row(x + dx, y + dy, z - 1, *s);
                }
                last = Some([x, y, z]);
            }
            let (p, n) = (
                self.positions[kept[i as usize] as usize],
                self.normals[kept[i as usize] as usize],
            );
            for (k, &s) in start.iter().enumerate() {
                let (cx, cy) = (x + k as i32 / 3 - 1, y + k as i32 % 3 - 1);
                for &(c, j) in sorted[s..]
                    .iter()
                    .take_while(|(c, _)| *c <= [cx, cy, z + 1])
                {
                    debug_assert!(c[0] == cx && c[1] == cy);
                    let other = kept[j as usize] as usize;
                    let distance = p.distance(self.positions[other]);
                    if j != i
                        && distance < d_max
                        && n.dot(self.normals[other]) > self.normal_threshold
                    {
                        found.push((
                            i,
                            Neighbour {
                                sample: j,
                                distance,
                            },
                        ));
                    }
                }
            }
        }
        for &(i, _) in &found {
            list.first[i as usize + 1] += 1;
        }
        for i in 0..kept.len() {
            list.first[i + 1] += list.first[i];
        }
        let mut next = list.first.clone();
        list.pairs = vec![
            Neighbour {
                sample: 0,
                distance: 0.0
            };
            found.len()
        ];
        for (i, n) in found {
            list.pairs[next[i as usize] as usize] = n;
            next[i as usize] += 1;
        }
        list
    }
}

#[derive(Clone, Copy)]
struct Neighbour {
    sample: u32,
    distance: f32,
}

struct Neighbours {
    first: Vec<u32>,
    pairs: Vec<Neighbour>,
}

impl Neighbours {
    fn of(&self, i: usize) -> &[Neighbour] {
        &self.pairs[self.first[i] as usize..self.first[i + 1] as usize]
    }
}

/// A binary max-heap over samples by weight whose weights can be reduced in place; ties go to the
/// lower index, so that the result does not depend on the heap's history.
struct WeightHeap {
    weights: Vec<f32>,
    heap: Vec<u32>,
    place: Vec<u32>,
}

impl WeightHeap {
    fn new(weights: Vec<f32>) -> Self {
        let count = weights.len() as u32;
        let mut heap = WeightHeap {
            weights,
            heap: (0..count).collect(),
            place: (0..count).collect(),
        };
        for i in (0..heap.heap.len() / 2).rev() {
            heap.sink(i);
        }
        heap
    }

    fn above(&self, a: u32, b: u32) -> bool {
        let (wa, wb) = (self.weights[a as usize], self.weights[b as usize]);
        wa > wb || (wa == wb && a < b)
    }

    fn swap(&mut self, i: usize, j: usize) {
        self.heap.swap(i, j);
        self.place[self.heap[i] as usize] = i as u32;
        self.place[self.heap[j] as usize] = j as u32;
    }

    fn sink(&mut self, mut i: usize) {
        loop {
            let mut top = i;
            for child in [2 * i + 1, 2 * i + 2] {
                if child < self.heap.len() && self.above(self.heap[child], self.heap[top]) {
                    top = child;
                }
            }
            if top == i {
                return;
            }
            self.swap(i, top);
            i = top;
        }
    }

    /// Takes the sample with the largest weight out.
    fn pop(&mut self) -> usize {
        let top = self.heap[0] as usize;
        self.swap(0, self.heap.len() - 1);
        self.heap.pop();
        if !self.heap.is_empty() {
            self.sink(0);
        }
        top
    }

    /// Lowers a sample's weight; the sample is still in the heap.
    fn reduce(&mut self, sample: usize, by: f32) {
        self.weights[sample] -= by;
        self.sink(self.place[sample] as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random samples on the unit square, facing up.
    fn square(count: usize) -> (Vec<Vec3>, Vec<Vec3>) {
        let mut rng = crate::rng::Rng::new(7);
        let positions = (0..count)
            .map(|_| Vec3::new(rng.unit(), 0.0, rng.unit()))
            .collect();
        (positions, vec![Vec3::Y; count])
    }

    fn nearest_distance(positions: &[Vec3]) -> f32 {
        let mut nearest = f32::INFINITY;
        for (i, a) in positions.iter().enumerate() {
            for b in &positions[..i] {
                nearest = nearest.min(a.distance(*b));
            }
        }
        nearest
    }

    #[test]
    fn keeps_samples_apart_at_every_level() {
        let (positions, normals) = square(4000);
        let order = eliminate(&positions, &normals, 800, packed_distance(800.0), 0.1);
        assert_eq!(order.len(), 800);
        let mut unique = order.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), 800, "no sample is taken twice");
        // 5:1 of random samples reaches about 0.7 of the packed distance; random samples have ~0.02.
        for level in [800, 400, 200, 100] {
            let prefix: Vec<Vec3> = order[..level]
                .iter()
                .map(|&i| positions[i as usize])
                .collect();
            let relative = nearest_distance(&prefix) / packed_distance(level as f64);
            assert!(
                relative > 0.55,
                "{level} samples stand {relative} of the packed distance apart"
            );
        }
    }

    #[test]
    fn weights_follow_the_definition() {
        let (positions, normals) = square(300);
        let d_max = packed_distance(100.0);
        let samples = Samples {
            positions: &positions,
            normals: &normals,
            normal_threshold: 0.1,
        };
        let kept: Vec<u32> = (0..300).collect();
        let neighbours = samples.neighbours(&kept, d_max);
        for i in 0..300 {
            let mut found: Vec<u32> = neighbours.of(i).iter().map(|n| n.sample).collect();
            found.sort_unstable();
            let brute: Vec<u32> = (0..300u32)
                .filter(|&j| {
                    j as usize != i && positions[i].distance(positions[j as usize]) < d_max
                })
                .collect();
            assert_eq!(found, brute);
        }
        // Elimination by recomputing every weight each time, as the paper defines it.
        let mut slow = kept.clone();
        let d_min = d_max * (1.0 - (100f32 / 300.0).powf(GAMMA)) * BETA;
        while slow.len() > 100 {
            let weight = |i: u32| -> f64 {
                slow.iter()
                    .filter(|&&j| j != i)
                    .map(|&j| positions[i as usize].distance(positions[j as usize]))
                    .filter(|d| *d < d_max)
                    .map(|d| ((1.0 - d.max(d_min) / d_max) as f64).powi(ALPHA))
                    .sum()
            };
            let heaviest = (0..slow.len())
                .max_by(|&a, &b| weight(slow[a]).total_cmp(&weight(slow[b])))
                .unwrap();
            slow.remove(heaviest);
        }
        let mut fast = eliminate(&positions, &normals, 100, d_max, 0.1);
        fast.sort_unstable();
        let common = fast.iter().filter(|i| slow.contains(i)).count();
        assert!(
            common >= 95,
            "only {common} of 100 samples agree with the definition"
        );
    }

    #[test]
    fn sides_of_a_sheet_do_not_repel() {
        // The same samples on both sides: thinning each side alone must give the same sets.
        let (positions, normals) = square(1000);
        let d_max = packed_distance(500.0);
        let mut alone = eliminate(&positions, &normals, 500, d_max, 0.1);
        alone.sort_unstable();
        let both: Vec<Vec3> = positions.iter().chain(&positions).copied().collect();
        let facing: Vec<Vec3> = normals
            .iter()
            .copied()
            .chain(normals.iter().map(|n| -*n))
            .collect();
        let together = eliminate(&both, &facing, 1000, d_max, 0.1);
        let up = together.iter().filter(|&&i| i < 1000).count();
        assert!(
            (480..=520).contains(&up),
            "{up} of 1000 points are on the upper side"
        );
        let upper: Vec<Vec3> = together
            .iter()
            .filter(|&&i| i < 1000)
            .map(|&i| positions[i as usize])
            .collect();
        let single: Vec<Vec3> = alone.iter().map(|&i| positions[i as usize]).collect();
        assert!(nearest_distance(&upper) > 0.8 * nearest_distance(&single));
    }

    #[test]
    fn small_and_empty_sets_survive() {
        assert!(eliminate(&[], &[], 0, 1.0, 0.1).is_empty());
        assert_eq!(eliminate(&[Vec3::ZERO], &[Vec3::Y], 1, 1.0, 0.1), [0]);
        assert_eq!(
            eliminate(&[Vec3::ZERO; 3], &[Vec3::Y; 3], 2, 1.0, 0.1).len(),
            2
        );
    }
}
