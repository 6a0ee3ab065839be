//! Spatial chunks of points, so that a tick touches only what movers can reach and never walks over
//! all points.

use crate::trace::Aabb;
use glam::Vec3;

/// Points in a chunk: enough to make the tree small, few enough to fit a mover's reach closely.
const CHUNK_POINTS: usize = 64;

/// The points of one placement in spatial order, cut into chunks.
#[derive(Clone, Debug, Default)]
pub struct Chunks {
    /// Points by chunk: a permutation of the placement's order.
    pub order: Vec<u32>,
    pub bounds: Vec<Aabb>,
}

impl Chunks {
    pub fn new(positions: &[Vec3]) -> Chunks {
        let all = Aabb::of(positions.iter().copied());
        // One scale for all axes: a flat mesh must not be cut into slices.
        let scale = 1023.0 / (all.max - all.min).max_element().max(1e-6);
        let mut order: Vec<u32> = (0..positions.len() as u32).collect();
        order.sort_by_cached_key(|&i| morton((positions[i as usize] - all.min) * scale));
        let bounds = order
            .chunks(CHUNK_POINTS)
            .map(|c| Aabb::of(c.iter().map(|&i| positions[i as usize])))
            .collect();
        Chunks { order, bounds }
    }

    /// Points of a chunk.
    pub fn points(&self, chunk: u32) -> &[u32] {
        let first = chunk as usize * CHUNK_POINTS;
        &self.order[first..(first + CHUNK_POINTS).min(self.order.len())]
    }
}

/// Interleaves ten bits of each coordinate.
fn morton(p: Vec3) -> u32 {
    let spread = |x: f32| {
        let mut x = (x as u32).min(1023);
        x = (x | x << 16) & 0x0300_00FF;
        x = (x | x << 8) & 0x0300_F00F;
        x = (x | x << 4) & 0x030C_30C3;
        (x | x << 2) & 0x0924_9249
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

/// A bounding volume hierarchy over boxes that never move, laid out implicitly: node `i` has
/// children `2i + 1` and `2i + 2`, leaves are the items in Morton order.
#[derive(Clone, Debug, Default)]
pub struct AabbTree {
    items: Vec<u32>,
    nodes: Vec<Aabb>,
    leaves: usize,
}

impl AabbTree {
    pub fn new(boxes: &[Aabb]) -> AabbTree {
        let all = boxes.iter().fold(Aabb::EMPTY, |a, b| a.union(b));
        let scale = 1023.0 / (all.max - all.min).max_element().max(1e-6);
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        items.sort_by_cached_key(|&i| morton((boxes[i as usize].centre() - all.min) * scale));
        let leaves = boxes.len().next_power_of_two();
        let mut nodes = vec![Aabb::EMPTY; 2 * leaves - 1];
        for (slot, &i) in items.iter().enumerate() {
            nodes[leaves - 1 + slot] = boxes[i as usize];
        }
        for i in (0..leaves - 1).rev() {
            nodes[i] = nodes[2 * i + 1].union(&nodes[2 * i + 2]);
        }
        AabbTree {
            items,
            nodes,
            leaves,
        }
    }

    /// Calls `found` with every item whose box comes within `distance` of `bounds`.
    pub fn near(&self, bounds: &Aabb, distance: f32, mut found: impl FnMut(u32)) {
        if self.items.is_empty() {
            return;
        }
        let mut stack = vec![0usize];
        while let Some(i) = stack.pop() {
            // An empty node is infinitely far away.
            if self.nodes[i].gap_squared(bounds) > distance * distance {
                continue;
            }
            if i >= self.leaves - 1 {
                found(self.items[i - (self.leaves - 1)]);
            } else {
                stack.push(2 * i + 2);
                stack.push(2 * i + 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn the_tree_finds_what_a_loop_finds() {
        let mut rng = Rng::new(3);
        let mut point = || Vec3::new(rng.unit(), rng.unit(), rng.unit()) * 10.0;
        let boxes: Vec<Aabb> = (0..777)
            .map(|_| {
                let p = point();
                Aabb {
                    min: p,
                    max: p + point() * 0.05,
                }
            })
            .collect();
        let tree = AabbTree::new(&boxes);
        for _ in 0..200 {
            let p = point();
            let query = Aabb {
                min: p,
                max: p + point() * 0.1,
            };
            let mut found = Vec::new();
            tree.near(&query, 0.6, |i| found.push(i));
            found.sort_unstable();
            let brute: Vec<u32> = (0..777)
                .filter(|&i| boxes[i as usize].gap_squared(&query) <= 0.6 * 0.6)
                .collect();
            assert_eq!(found, brute);
        }
        AabbTree::new(&[]).near(&boxes[0], 1.0, |_| panic!("an empty tree has nothing"));
    }

    #[test]
    fn chunks_hold_every_point_once_inside_their_bounds() {
        let mut rng = Rng::new(5);
        let positions: Vec<Vec3> = (0..1000)
            .map(|_| Vec3::new(rng.unit() * 30.0, rng.unit(), 0.0))
            .collect();
        let chunks = Chunks::new(&positions);
        let mut seen = vec![false; 1000];
        for c in 0..chunks.bounds.len() as u32 {
            for &p in chunks.points(c) {
                assert!(!std::mem::replace(&mut seen[p as usize], true));
                assert!(chunks.bounds[c as usize].distance_squared(positions[p as usize]) == 0.0);
            }
        }
        assert!(seen.iter().all(|s| *s));
        assert!(
            chunks.bounds.iter().map(|b| b.radius()).sum::<f32>() / (chunks.bounds.len() as f32)
                < 2.0
        );
    }
}
