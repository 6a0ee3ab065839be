//! Regions and which of them open into each other.

use super::space::Space;
use crate::trace::{Aabb, Ray, Tracer};
use glam::Vec3;
use rayon::prelude::*;

/// Patches of a boundary per side, and segments across a patch per side.
const PATCHES: usize = 2;
const ACROSS: usize = 4;
/// Boxes count as touching up to this share of their largest coordinate: files write decimals.
const TOUCH: f32 = 1e-5;

/// A box of space that has a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Unique within the graph.
    pub name: String,
    /// World space, metres.
    pub bounds: Aabb,
}

/// A patch of a boundary that two regions share. Two regions may have several.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The lower number first.
    pub regions: [usize; 2],
    /// Square metres of the part that is open.
    pub area: f32,
    /// The point of that part nearest to its mean, `b` of the paper. One point for a whole boundary left
    /// models apart at its ends.
    pub centre: Vec3,
}

/// Regions with the links between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    pub regions: Vec<Region>,
    pub links: Vec<Link>,
}

/// A rectangle in which one leaves a region's box into another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boundary {
    /// Flat along `axis`.
    pub bounds: Aabb,
    pub axis: usize,
}

impl Boundary {
    /// Square metres.
    pub fn area(&self) -> f32 {
        let size = self.bounds.max - self.bounds.min;
        size[(self.axis + 1) % 3] * size[(self.axis + 2) % 3]
    }
}

/// Where a client that takes the smallest box leaves one of two for the other: the faces of the smaller
/// (of the first, if they are equal) that lie in the larger, which goes on behind them. Empty where the boxes
/// are apart or meet in an edge.
pub fn boundaries(a: &Aabb, b: &Aabb) -> Vec<Boundary> {
    let slack = TOUCH * a.reach().max(b.reach());
    let volume = |b: &Aabb| (b.max - b.min).element_product();
    let (small, large) = if volume(a) <= volume(b) {
        (a, b)
    } else {
        (b, a)
    };
    let sides = (0..6).filter_map(|side| {
        let axis = side / 2;
        let is_low = side % 2 == 0;
        let face = if is_low { small.min } else { small.max }[axis];
        let goes_on = match is_low {
            true => large.min[axis] < face - slack && face <= large.max[axis] + slack,
            false => large.min[axis] - slack <= face && face + slack < large.max[axis],
        };
        let mut bounds = Aabb {
            min: small.min.max(large.min),
            max: small.max.min(large.max),
        };
        (bounds.min[axis], bounds.max[axis]) = (face, face);
        let has_area = (1..3).all(|i| {
            let other = (axis + i) % 3;
            bounds.max[other] - bounds.min[other] > slack
        });
        (goes_on && has_area).then_some(Boundary { bounds, axis })
    });
    sides.collect()
}

/// The links over a boundary: a patch each, of the part that can be crossed.
///
/// Segments cross it from `reach` metres before it to as far behind; those that meet a surface are closed,
/// and so are those that lie outside the space.
pub fn open_links(
    tracer: &Tracer,
    space: &Space,
    regions: [usize; 2],
    boundary: &Boundary,
    reach: f32,
) -> Vec<Link> {
    let mut step = Vec3::ZERO;
    step[boundary.axis] = reach;
    let crosses = |point: &Vec3| {
        let (from, to) = (*point - step, *point + step);
        !tracer.occluded(&segment(from, to))
            && !tracer.occluded(&segment(to, from))
            && (space.sees(tracer, from) || space.sees(tracer, to))
    };
    let link = |patch: Vec<Vec3>| {
        let open: Vec<Vec3> = patch.into_iter().filter(crosses).collect();
        let mean = open.iter().sum::<Vec3>() / open.len().max(1) as f32;
        let distance = |p: &Vec3| p.distance_squared(mean);
        let nearest = open
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let cells = (PATCHES * ACROSS).pow(2);
        nearest.map(|&centre| Link {
            regions,
            area: boundary.area() * open.len() as f32 / cells as f32,
            centre,
        })
    };
    let (u, v) = ((boundary.axis + 1) % 3, (boundary.axis + 2) % 3);
    let size = boundary.bounds.max - boundary.bounds.min;
    let patches = (0..PATCHES * PATCHES).map(|patch| {
        let point = |i: usize| {
            let mut point = boundary.bounds.min;
            let at = |patch: usize, i: usize| {
                ((patch * ACROSS + i) as f32 + 0.5) / (PATCHES * ACROSS) as f32
            };
            point[u] += at(patch % PATCHES, i % ACROSS) * size[u];
            point[v] += at(patch / PATCHES, i / ACROSS) * size[v];
            point
        };
        (0..ACROSS * ACROSS).map(point).collect()
    });
    patches.filter_map(link).collect()
}

/// How far segments across a boundary of two boxes reach: to the first layer of samples, or half a cell
/// of the space if that is more.
pub fn reach(space: &Space, boxes: [&Aabb; 2], axis: usize) -> f32 {
    let thinnest = boxes
        .map(|b| (b.max - b.min)[axis])
        .into_iter()
        .fold(f32::INFINITY, f32::min);
    let layer = thinnest / (2 * super::samples::SIDE) as f32;
    layer.max(0.5 * space.cell()).min(0.5 * thinnest)
}

/// The ray that ends at `to` where `t` is 1.
pub(super) fn segment(from: Vec3, to: Vec3) -> Ray {
    Ray {
        origin: from,
        direction: to - from,
        t_max: 1.0,
    }
}

/// All links between boxes that touch or overlap, by the numbers of their regions.
pub fn links(tracer: &Tracer, space: &Space, regions: &[Region]) -> Vec<Link> {
    (0..regions.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            (i + 1..regions.len()).flat_map(move |j| {
                let boxes = [&regions[i].bounds, &regions[j].bounds];
                let boundaries = boundaries(boxes[0], boxes[1]);
                boundaries.into_iter().flat_map(move |boundary| {
                    let reach = reach(space, boxes, boundary.axis);
                    open_links(tracer, space, [i, j], &boundary, reach)
                })
            })
        })
        .collect()
}
