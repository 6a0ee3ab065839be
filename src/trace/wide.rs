//! A hierarchy with eight children a node, over leaves that it knows by number only.
//!
//! It serves triangles (a leaf is a packet) and instances (a leaf is an instance) alike. Boxes are
//! full `f32`, one array per plane, so that a node is tested by eight-wide arithmetic. Nodes stand
//! after their parents, which makes refitting one backward sweep.

use super::aabb::Aabb;
use super::instructions::Instructions;
use super::slab::{Lanes, SlabRay};
use glam::Vec3;

/// Children per node.
pub const WIDTH: usize = 8;

/// No path from the root is longer, in nodes; the builder sees to it.
pub const MAX_DEPTH: usize = 32;

/// Set in a child reference to a leaf; the rest is the leaf's number.
const LEAF: u32 = 1 << 31;

#[derive(Clone, Debug)]
#[repr(C, align(32))]
struct Node {
    /// `[axis][0: min, 1: max][child]`; an unused child has the empty box, which no ray passes.
    planes: [[Lanes; 2]; 3],
    children: [u32; WIDTH],
}

impl Node {
    const EMPTY: Node = Node {
        planes: [[
            Lanes([f32::INFINITY; WIDTH]),
            Lanes([f32::NEG_INFINITY; WIDTH]),
        ]; 3],
        children: [NONE; WIDTH],
    };

    fn set_box(&mut self, child: usize, b: &Aabb) {
        for axis in 0..3 {
            self.planes[axis][0].0[child] = b.min[axis];
            self.planes[axis][1].0[child] = b.max[axis];
        }
    }

    fn child_box(&self, child: usize) -> Aabb {
        let side = |s: usize| {
            Vec3::new(
                self.planes[0][s].0[child],
                self.planes[1][s].0[child],
                self.planes[2][s].0[child],
            )
        };
        Aabb {
            min: side(0),
            max: side(1),
        }
    }
}

/// The reference to a leaf in [`WideBvh::from_children`].
pub fn leaf(number: u32) -> u32 {
    number | LEAF
}

/// The number of the leaf that a reference is to, if it is to one.
pub fn leaf_number(reference: u32) -> Option<u32> {
    (reference & LEAF != 0 && reference != NONE).then_some(reference & !LEAF)
}

/// The reference to no child at all.
pub const NONE: u32 = u32::MAX;

/// The hierarchy. Empty hierarchies have a root without children.
#[derive(Clone, Debug)]
pub struct WideBvh {
    nodes: Vec<Node>,
}

impl WideBvh {
    /// From each node's children: a node's number, [`leaf`] of a leaf's, or [`NONE`]. Node 0 is
    /// the root and children stand after their parents. Boxes are empty until [`WideBvh::refit`].
    pub fn from_children(children: &[[u32; WIDTH]]) -> WideBvh {
        let mut nodes = vec![Node::EMPTY; children.len().max(1)];
        for (node, &children) in nodes.iter_mut().zip(children) {
            node.children = children;
        }
        WideBvh { nodes }
    }

    /// Recomputes every box from the leaves' boxes.
    pub fn refit(&mut self, leaf_box: impl Fn(u32) -> Aabb) {
        for n in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                let child = self.nodes[n].children[slot];
                let b = if child == NONE {
                    continue;
                } else if child & LEAF != 0 {
                    leaf_box(child & !LEAF)
                } else {
                    self.node_box(child as usize)
                };
                self.nodes[n].set_box(slot, &b);
            }
        }
    }

    fn node_box(&self, node: usize) -> Aabb {
        let node = &self.nodes[node];
        (0..WIDTH)
            .map(|c| node.child_box(c))
            .fold(Aabb::EMPTY, |a, b| a.union(&b))
    }

    /// The box of everything.
    pub fn bounds(&self) -> Aabb {
        self.node_box(0)
    }

    /// The boxes of the root's children: a closer fit than [`WideBvh::bounds`].
    pub fn root_boxes(&self) -> impl Iterator<Item = Aabb> + '_ {
        (0..WIDTH)
            .map(|c| self.nodes[0].child_box(c))
            .filter(|b| !b.is_empty())
    }

    /// Sum of the surface areas of all boxes over that of the whole: the boxes that a random ray
    /// through the whole is expected to pass. 0 for a hierarchy without area.
    pub fn cost(&self) -> f64 {
        let all = self
            .nodes
            .iter()
            .flat_map(|n| (0..WIDTH).map(|c| f64::from(n.child_box(c).half_area())));
        let whole = f64::from(self.bounds().half_area());
        if whole > 0.0 {
            all.sum::<f64>() / whole
        } else {
            0.0
        }
    }

    /// Begins a walk over the leaves whose boxes a ray passes, in no order.
    #[inline(always)]
    pub fn walk(&self) -> Walk<'_> {
        Walk {
            nodes: &self.nodes,
            entering: 0,
            index: 0,
            mask: 0,
            depth: 0,
            stack: [(0, 0); MAX_DEPTH],
        }
    }

    /// Begins a walk over the leaves whose boxes the ray passes, from near to far.
    #[inline(always)]
    pub fn walk_sorted<'t>(&'t self, stack: &'t mut SortedStack) -> SortedWalk<'t> {
        stack[0] = 0;
        SortedWalk {
            nodes: &self.nodes,
            depth: 1,
            stack,
        }
    }

    /// Visits every leaf whose box comes within `distance` of `point`, until `leaf` returns true.
    /// Returns whether it did.
    pub fn near(&self, point: Vec3, distance: f32, mut leaf: impl FnMut(u32) -> bool) -> bool {
        let limit = distance * distance;
        let mut stack = [0u32; WIDTH * MAX_DEPTH];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[stack[depth] as usize];
            for slot in 0..WIDTH {
                let child = node.children[slot];
                if child == NONE || node.child_box(slot).distance_squared(point) > limit {
                    continue;
                }
                if child & LEAF == 0 {
                    stack[depth] = child;
                    depth += 1;
                } else if leaf(child & !LEAF) {
                    return true;
                }
            }
        }
        false
    }
}

/// The leaves a ray comes to. A walk hands out leaves instead of calling back, so that all of a
/// traversal is compiled into the one function that knows the instruction set: closures are not
/// reliably inlined, and outside of it they lose the wide vectors.
pub struct Walk<'t> {
    nodes: &'t [Node],
    /// The node to be tested next, or [`NONE`].
    entering: u32,
    /// The node whose children are being visited, and those left to visit.
    index: u32,
    mask: u32,
    depth: usize,
    /// Nodes with children left to visit, one per level at most.
    stack: [(u32, u32); MAX_DEPTH],
}

impl Walk<'_> {
    /// The next leaf whose box is passed within `0..=t_max`; both the same from call to call.
    #[inline(always)]
    pub fn next(&mut self, with: impl Instructions, ray: &SlabRay, t_max: f32) -> Option<u32> {
        loop {
            if self.entering != NONE {
                if self.mask != 0 {
                    self.stack[self.depth] = (self.index, self.mask);
                    self.depth += 1;
                }
                self.index = self.entering;
                self.entering = NONE;
                let node = &self.nodes[self.index as usize];
                self.mask = with.intersect8(ray, &node.planes, t_max, &mut Lanes([0.0; WIDTH]));
            }
            if self.mask == 0 {
                if self.depth == 0 {
                    return None;
                }
                self.depth -= 1;
                (self.index, self.mask) = self.stack[self.depth];
            }
            let node = &self.nodes[self.index as usize];
            let child = node.children[self.mask.trailing_zeros() as usize % WIDTH];
            self.mask &= self.mask - 1;
            if child & LEAF != 0 {
                return Some(child & !LEAF);
            }
            self.entering = child;
        }
    }
}

/// Children that are left to visit, as [`entry`] packs them. A ray walks many hierarchies: it clears one
/// such stack for all of them.
pub type SortedStack = [u64; WIDTH * MAX_DEPTH];

pub const EMPTY_STACK: SortedStack = [0; WIDTH * MAX_DEPTH];

/// A child and where the ray enters it, in one number: bits of a float of at least 0 are in its order, so
/// the nearer of two is the lesser number, which is found without a branch.
#[inline(always)]
fn entry(entered: f32, child: u32) -> u64 {
    u64::from(entered.to_bits()) << 32 | u64::from(child)
}

/// The leaves a ray comes to, from near to far.
pub struct SortedWalk<'t> {
    nodes: &'t [Node],
    depth: usize,
    stack: &'t mut SortedStack,
}

impl SortedWalk<'_> {
    /// The next leaf whose box is passed within `0..=t_max`; `t_max` may shrink from call to call.
    /// A box that begins exactly there is still visited, so that ties can be told.
    #[inline(always)]
    pub fn next(&mut self, with: impl Instructions, ray: &SlabRay, t_max: f32) -> Option<u32> {
        let mut near = Lanes([0.0; WIDTH]);
        loop {
            if self.depth == 0 {
                return None;
            }
            self.depth -= 1;
            let top = self.stack[self.depth];
            if f32::from_bits((top >> 32) as u32) > t_max {
                continue;
            }
            let mut child = top as u32;
            // Down through the nearest children, without a way over the stack.
            while child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                let mut mask = with.intersect8(ray, &node.planes, t_max, &mut near);
                if mask == 0 {
                    break;
                }
                let mut next = || {
                    let i = mask.trailing_zeros() as usize % WIDTH;
                    mask &= mask.wrapping_sub(1);
                    (entry(near.0[i], node.children[i]), mask != 0)
                };
                let (mut nearest, mut more) = next();
                let first = self.depth;
                while more {
                    let other;
                    (other, more) = next();
                    let farther = nearest.max(other);
                    nearest = nearest.min(other);
                    // Insertion keeps the nearest of the others on top.
                    let mut at = self.depth;
                    while at > first && self.stack[at - 1] < farther {
                        self.stack[at] = self.stack[at - 1];
                        at -= 1;
                    }
                    self.stack[at] = farther;
                    self.depth += 1;
                }
                child = nearest as u32;
            }
            if child & LEAF != 0 {
                return Some(child & !LEAF);
            }
        }
    }
}
