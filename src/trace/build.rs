//! Builds hierarchies: a binary one first, then the best eight-wide one within it.
//!
//! The binary hierarchy is obvhs' PLOC with reinsertion (Meister and Bittner 2018, 2022 as obvhs
//! implements them). The collapse to eight children picks, by dynamic programming over the binary
//! tree, which nodes to keep and which subtrees to make leaves of, at the least surface-area cost
//! (Ylitie, Karras and Laine 2017, section 3.1).

use super::aabb::Aabb;
use super::packet::LANES;
use super::wide::{self, MAX_DEPTH, NONE, WIDTH};
use glam::{Vec3, Vec3A};
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Cost of testing a packet relative to a node.
const LEAF_COST: f32 = 1.0;

/// Coordinates beyond this are pulled in before building: areas must not overflow. Only the shape
/// of the tree depends on it, the boxes do not.
const BUILD_LIMIT: f32 = 1e15;

/// What [`build`] makes: children per node (see [`wide::WideBvh::from_children`]) and primitives
/// per leaf, filled up with [`NONE`].
#[derive(Debug, Default)]
pub struct Topology {
    pub nodes: Vec<[u32; WIDTH]>,
    pub leaves: Vec<[u32; LANES]>,
}

/// How much time a build may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effort {
    /// For what is traced a long time.
    Thorough,
    /// For what is built every frame.
    Quick,
}

/// A node of a binary tree; a leaf has the same child twice: the primitive.
#[derive(Clone, Copy, Debug)]
struct Binary {
    children: [u32; 2],
    is_leaf: bool,
    half_area: f32,
}

/// Builds a hierarchy over boxes, none of them empty, with up to `leaf_size` of them in a leaf (at most [`LANES`]).
pub fn build(boxes: &[Aabb], leaf_size: usize, effort: Effort) -> Topology {
    if boxes.is_empty() {
        return Topology::default();
    }
    let leaf_size = leaf_size.clamp(1, LANES);
    let boxes: Vec<Aabb> = boxes
        .iter()
        .map(|b| Aabb {
            min: b
                .min
                .clamp(Vec3::splat(-BUILD_LIMIT), Vec3::splat(BUILD_LIMIT)),
            max: b
                .max
                .clamp(Vec3::splat(-BUILD_LIMIT), Vec3::splat(BUILD_LIMIT)),
        })
        .collect();
    collapse(&ploc(&boxes, effort), leaf_size)
        // Sizes in geometric progression can make the tree a chain. Halving by count cannot.
        .or_else(|| collapse(&halved(&boxes), leaf_size))
        .unwrap_or_default()
}

fn ploc(boxes: &[Aabb], effort: Effort) -> Vec<Binary> {
    let boxes: Vec<obvhs::aabb::Aabb> = boxes
        .iter()
        .map(|b| obvhs::aabb::Aabb {
            min: Vec3A::from(b.min),
            max: Vec3A::from(b.max),
        })
        .collect();
    let (distance, reinsertion) = match effort {
        Effort::Thorough => (PlocSearchDistance::Medium, 0.15),
        Effort::Quick => (PlocSearchDistance::Medium, 0.0),
    };
    let indices = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
        distance,
        &boxes,
        indices,
        SortPrecision::U64,
        0,
    );
    ReinsertionOptimizer::default().run(&mut tree, reinsertion, None);
    tree.nodes
        .iter()
        .map(|node| {
            let first = node.first_index;
            let is_leaf = node.is_leaf();
            let children = if is_leaf {
                [tree.primitive_indices[first as usize]; 2]
            } else {
                [first, first + 1]
            };
            Binary {
                children,
                is_leaf,
                half_area: node.aabb().half_area(),
            }
        })
        .collect()
}

/// A balanced tree: halves by count along the longest axis of the centres.
fn halved(boxes: &[Aabb]) -> Vec<Binary> {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let centre = |i: u32| boxes[i as usize].min + boxes[i as usize].max;
    let empty = Binary {
        children: [0; 2],
        is_leaf: true,
        half_area: 0.0,
    };
    let mut nodes = vec![empty];
    let mut todo = vec![(0usize, 0..order.len())];
    while let Some((node, range)) = todo.pop() {
        let part = &mut order[range.clone()];
        let bounds = part
            .iter()
            .fold(Aabb::EMPTY, |b, &i| b.union(&boxes[i as usize]));
        let half_area = bounds.half_area();
        if part.len() == 1 {
            nodes[node] = Binary {
                children: [part[0]; 2],
                is_leaf: true,
                half_area,
            };
            continue;
        }
        let (lo, hi) = part
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), &i| {
                (lo.min(centre(i)), hi.max(centre(i)))
            });
        let axis = (hi - lo).max_position();
        part.sort_unstable_by(|&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b)));
        let first = nodes.len();
        nodes[node] = Binary {
            children: [first as u32, first as u32 + 1],
            is_leaf: false,
            half_area,
        };
        nodes.extend([empty; 2]);
        let middle = range.start + range.len() / 2;
        todo.push((first, range.start..middle));
        todo.push((first + 1, middle..range.end));
    }
    nodes
}

/// The best way to stand for one binary subtree by at most `i + 1` wide children.
#[derive(Clone, Copy)]
struct Choice {
    cost: [f32; WIDTH - 1],
    /// How many of the children go to the left subtree; 0: one fewer does as well.
    left: [u8; WIDTH - 1],
    /// The same for the children of this very node, should it become a wide node.
    left_of_node: u8,
    primitives: u32,
    is_leaf: bool,
}

/// `None` when the result would be deeper than [`MAX_DEPTH`].
fn collapse(tree: &[Binary], leaf_size: usize) -> Option<Topology> {
    let mut order = Vec::with_capacity(tree.len());
    let mut todo = vec![0u32];
    while let Some(n) = todo.pop() {
        order.push(n);
        let node = &tree[n as usize];
        if !node.is_leaf {
            todo.extend(node.children);
        }
    }
    let nothing = Choice {
        cost: [0.0; WIDTH - 1],
        left: [0; WIDTH - 1],
        left_of_node: 0,
        primitives: 1,
        is_leaf: true,
    };
    let mut choices = vec![nothing; tree.len()];
    for &n in order.iter().rev() {
        let node = &tree[n as usize];
        choices[n as usize] = if node.is_leaf {
            Choice {
                cost: [node.half_area * LEAF_COST; WIDTH - 1],
                ..nothing
            }
        } else {
            let [l, r] = node.children.map(|c| &choices[c as usize]);
            choose(l, r, node.half_area, leaf_size as u32)
        };
    }

    let mut topology = Topology::default();
    topology.nodes.push([NONE; WIDTH]);
    // (binary node, wide node it becomes, depth)
    let mut todo = vec![(0u32, 0usize, 1usize)];
    let mut roots = Vec::with_capacity(WIDTH);
    while let Some((n, wide_node, depth)) = todo.pop() {
        if depth > MAX_DEPTH {
            return None;
        }
        roots.clear();
        if choices[n as usize].is_leaf {
            roots.push(n); // the root itself is a leaf
        } else {
            let k = choices[n as usize].left_of_node as usize;
            let [l, r] = tree[n as usize].children;
            gather(tree, &choices, l, k, &mut roots);
            gather(tree, &choices, r, WIDTH - k, &mut roots);
        }
        for (slot, &root) in roots.iter().enumerate() {
            topology.nodes[wide_node][slot] = if choices[root as usize].is_leaf {
                topology.leaves.push(primitives(tree, root));
                wide::leaf(topology.leaves.len() as u32 - 1)
            } else {
                topology.nodes.push([NONE; WIDTH]);
                todo.push((root, topology.nodes.len() - 1, depth + 1));
                topology.nodes.len() as u32 - 1
            };
        }
    }
    Some(topology)
}

fn choose(l: &Choice, r: &Choice, half_area: f32, leaf_size: u32) -> Choice {
    // The cheapest split of `width` children over both subtrees.
    let distribute = |width: usize| {
        let mut best = (f32::INFINITY, 1);
        for k in 1..width {
            let cost = l.cost[k - 1] + r.cost[width - k - 1];
            if cost < best.0 {
                best = (cost, k as u8);
            }
        }
        best
    };
    let primitives = l.primitives + r.primitives;
    let (below, left_of_node) = distribute(WIDTH);
    let as_node = half_area + below;
    let as_leaf = half_area * LEAF_COST;
    let is_leaf = primitives <= leaf_size && as_leaf <= as_node;
    let mut choice = Choice {
        cost: [if is_leaf { as_leaf } else { as_node }; WIDTH - 1],
        left: [0; WIDTH - 1],
        left_of_node,
        primitives,
        is_leaf,
    };
    for i in 1..WIDTH - 1 {
        let (cost, k) = distribute(i + 1);
        choice.cost[i] = choice.cost[i - 1];
        if cost < choice.cost[i] {
            choice.cost[i] = cost;
            choice.left[i] = k;
        }
    }
    choice
}

fn gather(tree: &[Binary], choices: &[Choice], n: u32, width: usize, roots: &mut Vec<u32>) {
    let choice = &choices[n as usize];
    let mut width = width;
    while width > 1 && choice.left[width - 1] == 0 {
        width -= 1;
    }
    if width <= 1 {
        roots.push(n);
        return;
    }
    let k = choice.left[width - 1] as usize;
    let [l, r] = tree[n as usize].children;
    gather(tree, choices, l, k, roots);
    gather(tree, choices, r, width - k, roots);
}

fn primitives(tree: &[Binary], root: u32) -> [u32; LANES] {
    let mut out = [NONE; LANES];
    let mut count = 0;
    let mut todo = vec![root];
    while let Some(n) = todo.pop() {
        let node = &tree[n as usize];
        if node.is_leaf {
            out[count] = node.children[0];
            count += 1;
        } else {
            todo.extend(node.children);
        }
    }
    out[..count].sort_unstable();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(boxes: &[Aabb], topology: &Topology) {
        let mut seen = vec![0; boxes.len()];
        for p in topology.leaves.iter().flatten().filter(|&&p| p != NONE) {
            seen[*p as usize] += 1;
        }
        assert!(seen.iter().all(|&n| n == 1), "every box is in one leaf");
        let mut referenced = vec![0; topology.nodes.len()];
        for (n, children) in topology.nodes.iter().enumerate() {
            for &c in children.iter().filter(|&&c| c < 1 << 31) {
                assert!(c as usize > n, "children stand after parents");
                referenced[c as usize] += 1;
            }
        }
        assert!(referenced[1..].iter().all(|&n| n == 1));
    }

    fn cube(at: Vec3, size: f32) -> Aabb {
        Aabb {
            min: at,
            max: at + size,
        }
    }

    #[test]
    fn every_box_lands_in_one_leaf() {
        let spread: Vec<Aabb> = (0..1000)
            .map(|i| {
                cube(
                    Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32),
                    0.9,
                )
            })
            .collect();
        let same = vec![cube(Vec3::ONE, 1.0); 777];
        let huge: Vec<Aabb> = (0..50)
            .map(|i| cube(Vec3::splat(i as f32 * 1e30), 1e30))
            .collect();
        let flat: Vec<Aabb> = (0..100)
            .map(|i| Aabb {
                min: Vec3::new(i as f32, 0.0, 0.0),
                max: Vec3::new(i as f32, 0.0, 1.0),
            })
            .collect();
        for boxes in [
            &spread[..],
            &spread[..1],
            &spread[..2],
            &spread[..5],
            &same,
            &huge,
            &flat,
        ] {
            for leaf_size in [1, LANES] {
                for effort in [Effort::Thorough, Effort::Quick] {
                    check(boxes, &build(boxes, leaf_size, effort));
                }
                check(boxes, &collapse(&halved(boxes), leaf_size).unwrap());
            }
        }
        assert!(build(&[], 4, Effort::Thorough).nodes.is_empty());
    }

    #[test]
    fn a_chain_is_refused_and_halving_is_not() {
        let n = 500u32;
        let boxes = vec![cube(Vec3::ZERO, 1.0); n as usize];
        // Node 2i is inner, with leaf 2i + 1 and the rest of the chain at 2i + 2. Areas that
        // shrink fast make pulling children up pay the least for small subtrees.
        let mut chain = Vec::new();
        for i in 0..n - 1 {
            let half_area = 1e30 * 0.8f32.powi(i as i32);
            chain.push(Binary {
                children: [2 * i + 1, 2 * i + 2],
                is_leaf: false,
                half_area,
            });
            chain.push(Binary {
                children: [i; 2],
                is_leaf: true,
                half_area: 0.0,
            });
        }
        chain.push(Binary {
            children: [n - 1; 2],
            is_leaf: true,
            half_area: 0.0,
        });
        assert!(collapse(&chain, 1).is_none());
        check(&boxes, &collapse(&halved(&boxes), 1).unwrap());
    }
}
