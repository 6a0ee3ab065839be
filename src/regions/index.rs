//! A hierarchy over the boxes of regions, which finds the region of a place without a look at each.

use super::sample::{Key, distance_squared};
use crate::codec::regions::Region;
use glam::Vec3;

/// Regions of a leaf.
const LEAF: usize = 4;

/// From places to regions, as [`super::sample::Regions::find`].
#[derive(Clone, Debug, Default)]
pub struct Index {
    nodes: Vec<Node>,
    /// Regions, those of a leaf beside each other.
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: Vec3,
    max: Vec3,
    /// First of its regions in the order, and how many; of an inner node none, and its second child: the
    /// first one stands next to it.
    first: u32,
    count: u32,
}

impl Index {
    /// Splits regions at the median of their middles along the longest axis, down to a few.
    pub fn new(regions: &[Region]) -> Index {
        let mut index = Index {
            nodes: Vec::new(),
            order: (0..regions.len() as u32).collect(),
        };
        if !regions.is_empty() {
            index.split(regions, 0, regions.len());
        }
        index
    }

    fn split(&mut self, regions: &[Region], start: usize, end: usize) {
        let part = &mut self.order[start..end];
        let corners = |&at: &u32| {
            let region = &regions[at as usize];
            (Vec3::from(region.min), Vec3::from(region.max))
        };
        let outer = |(low, high): (Vec3, Vec3), at: &u32| {
            let (min, max) = corners(at);
            (low.min(min), high.max(max))
        };
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = part.iter().fold(none, outer);
        let node = self.nodes.len();
        let leaf = part.len() <= LEAF;
        self.nodes.push(Node {
            min,
            max,
            first: start as u32,
            count: if leaf { part.len() as u32 } else { 0 },
        });
        if leaf {
            return;
        }
        let middle = |at: &u32| {
            let (min, max) = corners(at);
            min + max
        };
        let within = part.iter().map(middle);
        let (low, high) = within.fold(none, |(l, h), m| (l.min(m), h.max(m)));
        let axis = (high - low).max_position();
        part.sort_by(|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b)));
        let half = start + (end - start) / 2;
        self.split(regions, start, half);
        self.nodes[node].first = self.nodes.len() as u32;
        self.split(regions, half, end);
    }

    /// Index of the region of a place among `regions`, which it was made of: the same that
    /// [`super::sample::Regions::find`] gives. A node is left out only where its box is farther than the best
    /// region, and roundings of nested boxes keep their order, so the result is the same bit for bit.
    pub fn find(&self, regions: &[Region], p: Vec3) -> Option<usize> {
        let mut best: Option<(Key, u32)> = None;
        // Depth is at most the logarithm of 2^20 regions.
        let mut stack = [0u32; 32];
        let mut left = usize::from(!self.nodes.is_empty());
        while left > 0 {
            left -= 1;
            let at = stack[left];
            let node = &self.nodes[at as usize];
            let distance = distance_squared(node.min, node.max, p);
            if best.is_some_and(|(best, _)| distance > best.distance_squared) {
                continue;
            }
            if node.count == 0 {
                let children = [at + 1, node.first];
                let away = children.map(|child| {
                    let child = &self.nodes[child as usize];
                    distance_squared(child.min, child.max, p)
                });
                // The nearer one comes first, from the top of the stack.
                let swap = usize::from(away[1] < away[0]);
                stack[left] = children[1 - swap];
                stack[left + 1] = children[swap];
                left += 2;
                continue;
            }
            let first = node.first as usize;
            for &region in &self.order[first..first + node.count as usize] {
                let key = Key::of(&regions[region as usize], p);
                let wins = match best {
                    None => true,
                    Some((best, index)) => key.is_before(best) || (key == best && region < index),
                };
                if wins {
                    best = Some((key, region));
                }
            }
        }
        best.map(|(_, region)| region as usize)
    }
}
