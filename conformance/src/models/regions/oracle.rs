//! What a sampler of regions must find, in f64 and from `spec/regions.md` §10 alone. A query that
//! rounding could decide is refused.

use super::queries::RegionsQuery;
use super::writer::{Region, Set};
use crate::generate::expected::TrackContent;

/// How far a sampler may be from the oracle, of the sum of magnitudes that a signal is made of, beside
/// what rounding of its input moves it.
const TOLERANCE: f64 = 1.0 / 4096.0;
/// The most that rounding may move it, of the same.
const MOVED: f64 = 1.0 / 256.0;
/// Relative error of positions and centres.
const ROUNDING: f64 = 1.0 / 2097152.0;

type V = [f64; 3];

/// Both corners of a box.
fn corners(region: &Region) -> [V; 2] {
    let at = |first: usize| [0, 1, 2].map(|axis| f64::from(region.bounds[first + axis]));
    [at(0), at(3)]
}

/// Squared distance of a place from the box of a region.
fn distance(region: &Region, p: V) -> f64 {
    let [min, max] = corners(region);
    let along = |axis: usize| p[axis] - p[axis].clamp(min[axis], max[axis]);
    (0..3).map(|axis| along(axis).powi(2)).sum()
}

/// The volume of a box in f32, multiplied in three orders.
fn volumes(region: &Region) -> [f32; 3] {
    let [x, y, z] = [0, 1, 2].map(|axis| region.bounds[3 + axis] - region.bounds[axis]);
    [x * y * z, y * z * x, z * x * y]
}

/// The region of a place; an error where the order of multiplications decides.
fn look_up(regions: &[Region], p: V) -> Result<usize, String> {
    let mut best = 0;
    for at in 1..regions.len() {
        let [new, old] = [at, best].map(|r| distance(&regions[r], p));
        if new < old {
            best = at;
        } else if new == old {
            let (new, old) = (volumes(&regions[at]), volumes(&regions[best]));
            let near = |a: f32, b: f32| a != b && (a - b).abs() <= 1e-5 * a.abs().max(b.abs());
            let mut pairs = new.into_iter().zip(old);
            if new.iter().any(|&v| v != new[0]) || pairs.any(|(a, b)| near(a, b)) {
                return Err("two volumes are too near to each other".into());
            }
            if new[0] < old[0] {
                best = at;
            }
        }
    }
    Ok(best)
}

/// The nine polynomials at a normal (§2).
pub fn polynomials([x, y, z]: V) -> [f64; 9] {
    let second = [x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
    let [a, b, c, d, e] = second;
    [1.0, y, z, x, a, b, c, d, e]
}

/// A signal of a region at a place in its box: its value, the sum of magnitudes, and how far rounding
/// moves it.
fn signal(set: &Set, region: &Region, s: usize, p: V, n: V) -> [f64; 3] {
    let [min, max] = corners(region);
    let middle = [0, 1, 2].map(|axis| 0.5 * (min[axis] + max[axis]));
    let centre = region.centre.map_or(middle, |centre| centre.map(f64::from));
    let scale = f64::from(set.step) * f64::from(1 << set.exponent) / 32767.0;
    let functions = polynomials(n);
    let offset = |axis: usize| {
        let half = 0.5 * (max[axis] - min[axis]);
        let at = p[axis].clamp(min[axis], max[axis]);
        match half > 0.0 {
            true => (
                (at - centre[axis]) / half,
                (at.abs() + centre[axis].abs()) * ROUNDING / half,
            ),
            false => (0.0, 0.0),
        }
    };
    let [mut value, mut sum, mut moved] = [0.0; 3];
    for ([row, k, own], &code) in region.places().into_iter().zip(&region.codes) {
        if own != s.min(usize::from(region.signals) - 1) {
            continue;
        }
        let part = f64::from(code) * scale * functions[k];
        let (u, off) = match row {
            0 => (1.0, 0.0),
            1..4 => offset(row - 1),
            _ => {
                let (u, off) = offset((row - 4) / 2);
                let positive = (row - 4) % 2 == 0;
                (if (u >= 0.0) == positive { u } else { 0.0 }, off)
            }
        };
        value += part * u;
        sum += (part * u).abs();
        moved += part.abs() * off;
    }
    [value, sum, moved]
}

/// A query with the interval that its answer must lie in.
///
/// # Errors
/// A sentence where rounding could decide between regions, or moves the answer too far.
pub fn with_intervals(content: &TrackContent, query: RegionsQuery) -> Result<RegionsQuery, String> {
    let expected = content.regions();
    let expected = expected.ok_or_else(|| format!("track {} has no regions", content.entry.id))?;
    let (set, regions) = (&expected.set, &expected.regions);
    if regions.is_empty() {
        return Ok(RegionsQuery {
            obscurance: [65536; 2],
            ..query
        });
    }
    let p = query.position.map(|v| f64::from(v) / 65536.0);
    let found = look_up(regions, p)?;
    for corner in 0..27 {
        let near = [0, 1, 2].map(|axis: usize| {
            let side = f64::from(corner / 3i32.pow(axis as u32) % 3 - 1);
            p[axis] + side * (p[axis].abs() + 1.0) * 2.0 * ROUNDING
        });
        if look_up(regions, near)? != found {
            return Err("it is near a boundary of regions".into());
        }
    }
    let n = query.normal.map(f64::from);
    let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
    let n = n.map(|v| v / length);
    let mut ends = [[0.0; 2]; 2];
    for (s, ends) in ends.iter_mut().enumerate() {
        let [value, sum, moved] = signal(set, &regions[found], s, p, n);
        if moved > MOVED * sum {
            return Err("its answer moves too far where its position does".into());
        }
        let off = TOLERANCE * sum + moved;
        *ends = [value - off, value + off].map(|end| end.clamp(0.0, 1.0));
    }
    let share = match set.signals {
        2 => f64::from(set.share),
        _ => 0.0,
    };
    let blend = |end: usize| ends[0][end] + (ends[1][end] - ends[0][end]) * share;
    Ok(RegionsQuery {
        obscurance: [
            (blend(0) * 65536.0).floor() as u64,
            (blend(1) * 65536.0).ceil() as u64,
        ],
        ..query
    })
}
