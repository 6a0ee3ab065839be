//! Query vectors: streams, and what a sampler must find in them. Those of points are made here, with
//! intervals from `oracle.rs`; those of probes in `probes/`.

mod content;
mod geometry;

use crate::generate::Draft;
use crate::generate::draw::Draw;
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::Query;
use crate::models::entry::Entry;
use crate::models::points::frames::{entry, filled};
use crate::models::points::oracle::{Point, all, bounds, look_up};
use crate::models::points::queries::PointsQuery;
use crate::models::points::writer::Part;

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query too near to a threshold.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    geometry::one_point(drafts)?;
    geometry::distances(drafts)?;
    geometry::octants(drafts)?;
    geometry::outside(drafts)?;
    content::widths(drafts)?;
    content::normals(drafts)?;
    content::shared_buckets(drafts)?;
    geometry::large(drafts)?;
    geometry::sizes(drafts)?;
    content::states(drafts)
}

const X: [i32; 3] = [1, 0, 0];
const Y: [i32; 3] = [0, 1, 0];
const Z: [i32; 3] = [0, 0, 1];

/// A grid of 3 x 3 x 3 cubes of half a metre with the largest radius.
fn cube_of_27(widths: [u8; 3]) -> Entry {
    entry(1, widths).with_grid(|grid| {
        grid.dims = [3; 3];
        grid.capacity = 64;
        grid.buckets = 17;
    })
}

/// A point of a cube from signed normal codes.
fn oriented(entry: &Entry, position: [u32; 3], normal: [i32; 2], ao: u32) -> u32 {
    let mask = (1u32 << entry.grid().widths[1]) - 1;
    entry
        .grid()
        .point(position, normal.map(|code| code as u32 & mask), ao)
}

/// Any point of a track.
fn any_point(draw: &mut Draw, entry: &Entry) -> u32 {
    let bits = 8 * entry.grid().point_bytes() as u32 - 1;
    draw.below(1 << bits) | 1 << bits
}

/// A part with points in cubes, seven a cell and as many cells as that takes.
fn cubes(entry: &Entry, content: &[([u32; 3], Vec<u32>)]) -> Part {
    let mut cells = Vec::new();
    for (cube, points) in content {
        for chunk in points.chunks(7) {
            cells.push((cells.len() as u32, entry.grid().key(*cube), chunk.to_vec()));
        }
    }
    filled(entry, &cells)
}

/// A track of one frame.
fn still(entry: &Entry, content: &[([u32; 3], Vec<u32>)]) -> Frames {
    Frames::new(std::slice::from_ref(entry))
        .keyframe(&[cubes(entry, content)])
        .commit()
}

/// A stream with its queries.
struct QuerySet<'n> {
    name: &'n str,
    frames: Frames,
    queries: Vec<PointsQuery>,
}

impl<'n> QuerySet<'n> {
    fn of(name: &'n str, frames: Frames) -> QuerySet<'n> {
        QuerySet {
            name,
            frames,
            queries: Vec::new(),
        }
    }

    fn track(&self, track: u32) -> Result<&TrackContent, String> {
        let content = self.frames.tracks.iter().find(|h| h.entry.id == track);
        content.ok_or_else(|| format!("{}: no track {track}", self.name))
    }

    /// Queries at a position in metres, rounded to what a query can say.
    fn query(&mut self, track: u32, x: [f64; 3], normal: [i32; 3]) -> Result<&mut Self, String> {
        let mut query = PointsQuery {
            track,
            position: x.map(|v| (v * 65536.0).round() as i32),
            normal,
            ao: [0; 2],
        };
        let found = look_up(self.track(track)?, &query)
            .map_err(|near| format!("{}: query at {x:?}: {near}", self.name))?;
        query.ao = bounds(found);
        self.queries.push(query);
        Ok(self)
    }

    /// Queries at a point with normals all around its own, `count` just within T_n and as many beyond:
    /// so the point's normal shows, which otherwise only decides whether it counts.
    fn ring(&mut self, track: u32, point: &Point, count: usize) -> Result<&mut Self, String> {
        let [x, y, z] = point.normal;
        // Two directions across the normal.
        let first = if z.abs() < 0.9 {
            [y, -x, 0.0]
        } else {
            [0.0, z, -y]
        };
        let length = first.map(|v| v * v).iter().sum::<f64>().sqrt();
        let [a, b, c] = first.map(|v| v / length);
        let second = [y * c - z * b, z * a - x * c, x * b - y * a];
        // Unit vectors in numbers that no library's sine decides.
        let around = [(0.96, 0.28), (-0.28, 0.96), (-0.96, -0.28), (0.28, -0.96)];
        for i in 0..2 * count {
            let cosine = [0.125, 0.075][i % 2];
            let (cos, sin) = around[i / 2 % 4];
            let normal = [0, 1, 2].map(|axis| {
                let across = cos * [a, b, c][axis] + sin * second[axis];
                let turned = cosine * point.normal[axis] + (1.0 - cosine * cosine).sqrt() * across;
                (turned * 1e6).round() as i32
            });
            self.query(track, point.position, normal)?;
        }
        Ok(self)
    }

    /// Queries `count` times within reach of drawn points, every fourth time with any normal; places
    /// too near to a threshold, and all but a few where there is nothing, are drawn again.
    fn draw(&mut self, track: u32, seed: u64, count: usize) -> Result<&mut Self, String> {
        let mut draw = Draw(seed);
        let expected = self.track(track)?.clone();
        let points = all(&expected);
        let (mut drawn, mut tries) = (0, 0);
        while drawn < count {
            tries += 1;
            if tries > 10_000 {
                return Err(format!("{}: no place for a query", self.name));
            }
            let point = points[draw.below(points.len() as u32) as usize];
            let reach = f64::from(expected.entry.grid().radius);
            let x = point.position.map(|v| v + draw.signed() * reach);
            let any = drawn % 4 == 3;
            let normal = point.normal.map(|v| {
                let own = if any { 0.0 } else { v };
                ((own + 0.4 * draw.signed()) * 1000.0).round() as i32
            });
            let query = PointsQuery {
                track,
                position: x.map(|v| (v * 65536.0).round() as i32),
                normal,
                ao: [0; 2],
            };
            let Ok(found) = look_up(&expected, &query) else {
                continue;
            };
            if found.weight > 0.1 || (any && found.weight == 0.0) {
                drawn += 1;
                self.queries.push(PointsQuery {
                    ao: bounds(found),
                    ..query
                });
            }
        }
        Ok(self)
    }

    fn finish(&mut self, drafts: &mut Vec<Draft>, clauses: &[&'static str], comment: &str) {
        drafts.push(Draft::query(
            "points",
            self.name,
            clauses,
            comment,
            self.frames.ended(),
            self.queries.drain(..).map(Query::Points).collect(),
        ));
    }
}

/// The middle cube's point of [`one_point`] and [`distances`], in metres.
const MIDDLE: f64 = (1.0 + 16.5 / 32.0) * 0.5;

fn beside([dx, dy, dz]: [f64; 3]) -> [f64; 3] {
    [MIDDLE + dx, MIDDLE + dy, MIDDLE + dz]
}
