//! What a sampler must find, in f64 and from `spec/points.md` §8 alone. A query too near to any
//! of its thresholds, so that rounding could decide it, is refused.

use crate::models::entry::Entry;
use crate::models::points::queries::PointsQuery;

use crate::generate::expected::TrackContent;

/// Smallest cosine between the normals of point and fragment (Eq. 3).
pub const T_N: f64 = 0.1;
/// Largest squared cosine between a point's normal and the direction to it (Eq. 3).
pub const T_D: f64 = 0.7;

/// How far a sampler may be from the oracle: 16 of the 65536 steps of a [`PointsQuery`]'s bounds.
///
/// In f32 a weight errs by a few roundings of numbers up to 1 and of a distance over the radius:
/// below [`WEIGHT_ERROR`]. What that does to the AO is worked out for each query and limited to
/// half of the tolerance; the sums, of at most 64 points here, have the other half.
pub const TOLERANCE: f64 = 1.0 / 4096.0;
/// Error of a weight that a sampler may make.
pub const WEIGHT_ERROR: f64 = 1.0 / 262144.0;
/// Distance that a query keeps from each threshold: of cosines, of distances over r, and of
/// positions over the cell edge.
pub const MARGIN: f64 = 1.0 / 1024.0;

/// A point's values (P-040 to P-042), grid space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Metres.
    pub position: [f64; 3],
    /// Unit.
    pub normal: [f64; 3],
    /// 0 closed, 1 open.
    pub ao: f64,
}

/// What a query finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    pub ao: f64,
    /// Sum of the weights.
    pub weight: f64,
}

/// The values of a point of a cube.
pub fn values(entry: &Entry, cube: [u32; 3], word: u32) -> Point {
    let [p, n, a] = entry.grid().widths.map(u32::from);
    let field = |shift: u32, bits: u32| word >> shift & ((1 << bits) - 1);
    let edge = f64::from(entry.grid().cell_edge);
    let position = [0, 1, 2].map(|axis| {
        let code = f64::from(field(a + 2 * n + axis * p, p));
        (f64::from(cube[axis as usize]) + (code + 0.5) / f64::from(1 << p)) * edge
    });
    let octahedral = |shift: u32| {
        let code = i64::from(field(shift, n));
        let top = 1i64 << (n - 1);
        let signed = if code >= top { code - 2 * top } else { code };
        (signed as f64 / (top - 1) as f64).max(-1.0)
    };
    Point {
        position,
        normal: direction(octahedral(a), octahedral(a + n)),
        ao: f64::from(field(0, a)) / f64::from((1 << a) - 1),
    }
}

fn direction(u: f64, v: f64) -> [f64; 3] {
    let sign = |t: f64| if t < 0.0 { -1.0 } else { 1.0 };
    let z = 1.0 - u.abs() - v.abs();
    match z < 0.0 {
        true => unit([(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v), z]),
        false => unit([u, v, z]),
    }
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Position (metres) and unit normal of a query.
pub fn place(query: &PointsQuery) -> ([f64; 3], [f64; 3]) {
    let position = query.position.map(|v| f64::from(v) / 65536.0);
    (position, unit(query.normal.map(f64::from)))
}

/// The 2 x 2 x 2 cubes of a position (P-043), some of them outside the grid perhaps.
fn block(entry: &Entry, x: [f64; 3]) -> Result<[[i64; 3]; 8], String> {
    let mut own = [0; 3];
    let mut other = [0; 3];
    for axis in 0..3 {
        let at = x[axis] / f64::from(entry.grid().cell_edge);
        let cube = at.floor();
        let within = at - cube;
        if [0.0, 0.5, 1.0].iter().any(|t| (within - t).abs() < MARGIN) {
            return Err(format!("{within} of a cube along axis {axis}"));
        }
        own[axis] = cube as i64;
        other[axis] = cube as i64 + if within < 0.5 { -1 } else { 1 };
    }
    Ok([0, 1, 2, 3, 4, 5, 6, 7]
        .map(|corner: usize| [0, 1, 2].map(|axis| [own, other][corner >> axis & 1][axis])))
}

/// The points that a query has to look at: those of its block (P-043, P-044).
///
/// # Errors
/// A sentence that names a threshold which is too near.
pub fn within_block(content: &TrackContent, x: [f64; 3]) -> Result<Vec<Point>, String> {
    let mut points = Vec::new();
    for cube in block(&content.entry, x)? {
        let dims = content.entry.grid().dims.map(i64::from);
        if (0..3).any(|axis| cube[axis] < 0 || cube[axis] >= dims[axis]) {
            continue;
        }
        let cube = cube.map(|c| c as u32);
        let key = content.entry.grid().key(cube);
        for (_, words) in content
            .cells()
            .named(content.entry.grid().bucket(key))
            .filter(|(other, _)| *other == key)
        {
            points.extend(words.iter().map(|&word| values(&content.entry, cube, word)));
        }
    }
    Ok(points)
}

/// All points of a track that a bucket names, each where its key says, without any hash.
pub fn all(content: &TrackContent) -> Vec<Point> {
    let [dx, dy, _] = content.entry.grid().dims.map(u32::from);
    let mut points = Vec::new();
    for &bucket in content.cells().buckets.keys() {
        for (key, words) in content.cells().named(bucket) {
            let cube = [key % dx, key / dx % dy, key / dx / dy];
            points.extend(words.iter().map(|&word| values(&content.entry, cube, word)));
        }
    }
    points
}

/// What points give at a position with a unit normal (P-045 to P-048).
///
/// # Errors
/// A sentence that names a threshold which is too near, or says that rounding of the weights would
/// move the AO too far.
pub fn occlusion(
    points: &[Point],
    radius: f64,
    x: [f64; 3],
    normal: [f64; 3],
) -> Result<Found, String> {
    let mut weights = Vec::new();
    for point in points {
        let to = [0, 1, 2].map(|axis| point.position[axis] - x[axis]);
        let distance = dot(to, to).sqrt() / radius;
        if (distance - 1.0).abs() < MARGIN {
            return Err(format!("a point {distance} r away"));
        }
        if distance > 1.0 {
            continue;
        }
        let agreement = dot(point.normal, normal);
        if (agreement - T_N).abs() < MARGIN {
            return Err(format!("normals with a cosine of {agreement}"));
        }
        let mut slope = 0.0;
        if distance > 0.0 {
            if distance < MARGIN {
                return Err(format!("a point {distance} r away"));
            }
            let cosine = dot(point.normal, to) / (distance * radius);
            slope = cosine * cosine;
            if (slope - T_D).abs() < MARGIN {
                return Err(format!("a direction with a squared cosine of {slope}"));
            }
        }
        if agreement > T_N && slope < T_D {
            weights.push((1.0 - distance, point.ao));
        }
    }
    let weight: f64 = weights.iter().map(|(alpha, _)| alpha).sum();
    if weights.is_empty() {
        return Ok(Found { ao: 1.0, weight });
    }
    let ao = weights.iter().map(|(alpha, ao)| alpha * ao).sum::<f64>() / weight;
    let moved: f64 = weights.iter().map(|(_, own)| (own - ao).abs()).sum();
    if moved * WEIGHT_ERROR / weight > TOLERANCE / 2.0 {
        return Err(format!("weights of {weight} in all"));
    }
    Ok(Found { ao, weight })
}

/// What a query to a track finds.
///
/// # Errors
/// As [`occlusion`]; also where the position is no f32, and where the normal is none.
pub fn look_up(content: &TrackContent, query: &PointsQuery) -> Result<Found, String> {
    if let Some(v) = query
        .position
        .iter()
        .find(|&&v| f64::from(v as f32) != f64::from(v))
    {
        return Err(format!("{v}/65536, which is no f32"));
    }
    if query.normal == [0; 3] {
        return Err("a normal of length 0".to_string());
    }
    let (x, normal) = place(query);
    let points = within_block(content, x)?;
    occlusion(&points, f64::from(content.entry.grid().radius), x, normal)
}

/// The bounds of a query's result, in 1/65536: exactly 1 where there is no point.
pub fn bounds(found: Found) -> [u32; 2] {
    if found.weight == 0.0 {
        return [65536; 2];
    }
    let steps = |ao: f64| (ao * 65536.0).clamp(0.0, 65536.0);
    [
        steps(found.ao - TOLERANCE).floor() as u32,
        steps(found.ao + TOLERANCE).ceil() as u32,
    ]
}
