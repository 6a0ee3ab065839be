//! Regions and which of them open into each other.

use super::space::Space;
use crate::trace::{Aabb, Ray, Tracer};
use glam::Vec3;

/// Segments across a contact, per side: as many as a region has samples.
const ACROSS: usize = super::samples::SIDE;
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

/// A boundary that two regions share.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The lower number first.
    pub regions: [usize; 2],
    /// Square metres of the part that is open.
    pub area: f32,
    /// The point of that part nearest to its mean, `b` of the paper.
    pub centre: Vec3,
}

/// Regions with the links between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    pub regions: Vec<Region>,
    pub links: Vec<Link>,
}

/// What two boxes share: a box that is flat where they only touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    pub bounds: Aabb,
    /// Its thinnest axis, across which one leaves a box for the other.
    pub axis: usize,
    /// Square metres of its side across that axis.
    pub area: f32,
}

/// What two boxes share; `None` where that has no area: they are apart, or meet in an edge.
pub fn contact(a: &Aabb, b: &Aabb) -> Option<Contact> {
    let slack = TOUCH * a.reach().max(b.reach());
    let (min, max) = (a.min.max(b.min), a.max.min(b.max));
    if !(max - min).cmpge(Vec3::splat(-slack)).all() {
        return None;
    }
    let bounds = Aabb {
        min: min.min(max),
        max: max.max(min),
    };
    let size = bounds.max - bounds.min;
    let axis = (0..3)
        .min_by(|&i, &j| size[i].total_cmp(&size[j]))
        .unwrap_or(0);
    let area = size[(axis + 1) % 3] * size[(axis + 2) % 3];
    (area > slack * slack).then_some(Contact { bounds, axis, area })
}

/// The link over a contact: the part of it that can be crossed. `None` where nothing can pass.
///
/// Segments cross the contact from the first layer of samples on one side to that on the other, or half
/// a cell of the space if that is more; those that meet a surface are closed, and so are those that
/// lie outside the space.
pub fn open_link(
    tracer: &Tracer,
    space: &Space,
    regions: [usize; 2],
    boxes: [&Aabb; 2],
    contact: &Contact,
) -> Option<Link> {
    let Contact { bounds, axis, area } = *contact;
    let thinnest = (boxes[0].max - boxes[0].min)[axis].min((boxes[1].max - boxes[1].min)[axis]);
    let reach = (thinnest / (2 * ACROSS) as f32)
        .max(0.5 * space.cell())
        .min(0.5 * thinnest);
    let mut step = Vec3::ZERO;
    step[axis] = reach;
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let size = bounds.max - bounds.min;
    let mut open = Vec::new();
    for i in 0..ACROSS * ACROSS {
        let mut point = bounds.centre();
        point[u] = bounds.min[u] + ((i % ACROSS) as f32 + 0.5) / ACROSS as f32 * size[u];
        point[v] = bounds.min[v] + ((i / ACROSS) as f32 + 0.5) / ACROSS as f32 * size[v];
        let (from, to) = (point - step, point + step);
        let crosses = !tracer.occluded(&segment(from, to)) && !tracer.occluded(&segment(to, from));
        if crosses && (space.sees(tracer, from) || space.sees(tracer, to)) {
            open.push(point);
        }
    }
    let mean = open.iter().sum::<Vec3>() / open.len().max(1) as f32;
    let nearest = |a: &&Vec3, b: &&Vec3| {
        let distance = |p: &Vec3| p.distance_squared(mean);
        distance(a).total_cmp(&distance(b))
    };
    let centre = *open.iter().min_by(nearest)?;
    let area = area * open.len() as f32 / (ACROSS * ACROSS) as f32;
    Some(Link {
        regions,
        area,
        centre,
    })
}

/// The ray that ends at `to` where `t` is 1.
pub(super) fn segment(from: Vec3, to: Vec3) -> Ray {
    Ray {
        origin: from,
        direction: to - from,
        t_max: 1.0,
    }
}

/// All links between boxes that touch or overlap, in ascending order.
pub fn links(tracer: &Tracer, space: &Space, regions: &[Region]) -> Vec<Link> {
    use rayon::prelude::*;
    (0..regions.len())
        .into_par_iter()
        .flat_map_iter(|i| {
            (i + 1..regions.len()).filter_map(move |j| {
                let boxes = [&regions[i].bounds, &regions[j].bounds];
                let contact = contact(boxes[0], boxes[1])?;
                open_link(tracer, space, [i, j], boxes, &contact)
            })
        })
        .collect()
}
