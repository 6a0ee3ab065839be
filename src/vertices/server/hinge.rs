//! The regulariser: how much a function bends across the edges of a mesh.
//!
//! Kavan, Bargteil and Sloan 2011, *Least Squares Vertex Baking*: for each interior edge its two
//! triangles are unfolded into a plane, and the difference of the function's gradients on them is
//! weighted by their area, `GD = (A1 + A2) (grad1 - grad2)`. Both gradients agree along the edge,
//! so that only the slopes away from it remain: with the opposite vertex k at the height h above
//! the edge and its foot at the share t from i to j,
//!
//! ```text
//! slope = (f_k - (1 - t) f_i - t f_j) / h        GD = (A1 + A2) (slope1 + slope2)
//! ```
//!
//! It is zero for every function that is linear once the surface is unrolled. Two things differ
//! from the paper, [`AREA_RATIO`] and [`Hinge::weight`]; between flat triangles of about equal area and
//! no less than half as high as their edge is long neither has an effect.

use super::shape::Shape;
use glam::DVec3;

/// `A1 + A2` counts as at most this many times the smaller of the two. Beside a huge triangle a tiny
/// one would else be bound to its gradient with a weight that grows with the ratio of their
/// areas and leaves nothing of its own samples. Triangles within a factor of three are not affected.
const AREA_RATIO: f64 = 4.0;

/// Pairs of triangles at one edge beyond which the edge is left alone: no surface looks like that.
const MAX_PAIRS: usize = 64;

/// An interior edge: its energy is `weight` times the square of the form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hinge {
    /// The ends of the edge and the two opposite vertices, all different.
    pub variables: [u32; 4],
    /// Of GD, in metres.
    pub coefficients: [f64; 4],
    /// Between 0 and 1, a product of two factors.
    ///
    /// The squared cosine of the fold, 0 beyond a right angle: light changes where a surface is
    /// folded, and smoothing across would wash the fold out.
    ///
    /// Twice the lesser height over the length of the edge, at most 1. By GD alone the bend across
    /// strips that are a hundred times as long as wide, as on a pole, weighs a hundred times as much
    /// against their samples as that of a square mesh: all around the pole would get one value.
    pub weight: f64,
}

/// The hinges of all edges that two triangles share in opposite directions. Degenerate triangles
/// have none, and coincident ones, which run along their edges the same way, none between them.
pub fn hinges(shape: &Shape) -> Vec<Hinge> {
    let mut edges = Vec::with_capacity(3 * shape.triangles.len());
    for (t, triangle) in shape.triangles.iter().enumerate() {
        if shape.areas[t] > 0.0 {
            for k in 0..3 {
                let [opposite, from, to] = [k, (k + 1) % 3, (k + 2) % 3].map(|k| triangle[k]);
                edges.push(Edge {
                    ends: [from.min(to), from.max(to)],
                    backward: from > to,
                    triangle: t as u32,
                    opposite,
                });
            }
        }
    }
    edges.sort_unstable();
    let mut hinges = Vec::with_capacity(edges.len() / 2);
    for same in edges.chunk_by(|a, b| a.ends == b.ends) {
        let (forward, backward) = same.split_at(same.partition_point(|edge| !edge.backward));
        if forward.len() * backward.len() > MAX_PAIRS {
            continue;
        }
        // Where coincident triangles repeat a pair, its weight stays that of one.
        let share = 1.0 / forward.len().max(backward.len()) as f64;
        for a in forward {
            for b in backward {
                hinges.extend(hinge(shape, a, b, share));
            }
        }
    }
    hinges
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    ends: [u32; 2],
    backward: bool,
    triangle: u32,
    opposite: u32,
}

fn hinge(shape: &Shape, a: &Edge, b: &Edge, share: f64) -> Option<Hinge> {
    let (ta, tb) = (a.triangle as usize, b.triangle as usize);
    let fold = shape.facings[ta].dot(shape.facings[tb]).max(0.0);
    if a.opposite == b.opposite || fold == 0.0 {
        return None;
    }
    let at = |variable: u32| shape.positions[variable as usize];
    let [i, j] = a.ends.map(at);
    let (slope_a, slope_b) = (slope(i, j, at(a.opposite)), slope(i, j, at(b.opposite)));
    let (area_a, area_b) = (shape.areas[ta], shape.areas[tb]);
    let area = (area_a + area_b).min(AREA_RATIO * area_a.min(area_b));
    // The slopes' last coefficients are one over the heights.
    let height = 1.0 / slope_a[2].max(slope_b[2]);
    let aspect = (2.0 * height / i.distance(j)).min(1.0);
    Some(Hinge {
        variables: [a.ends[0], a.ends[1], a.opposite, b.opposite],
        coefficients: [
            area * (slope_a[0] + slope_b[0]),
            area * (slope_a[1] + slope_b[1]),
            area * slope_a[2],
            area * slope_b[2],
        ],
        weight: share * fold * fold * aspect,
    })
}

/// Coefficients of i, j and k in the slope from the edge ij towards k.
fn slope(i: DVec3, j: DVec3, k: DVec3) -> [f64; 3] {
    let edge = j - i;
    let along = (k - i).dot(edge) / edge.length_squared();
    let height = (k - i).cross(edge).length() / edge.length();
    [(along - 1.0) / height, -along / height, 1.0 / height]
}
