//! Query vectors: streams, and what a sampler must find in them. The intervals come from
//! [`super::sampling`].

use super::Draft;
use super::frames::{Frames, Held, WIDTHS, entry, filled};
use super::sampling::{Point, all, bounds, look_up};
use crate::forge::{Entry, Part};
use crate::vector::Query;

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a question too near to a threshold.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    one_point(drafts)?;
    distances(drafts)?;
    octants(drafts)?;
    outside(drafts)?;
    widths(drafts)?;
    normals(drafts)?;
    shared_buckets(drafts)?;
    large(drafts)?;
    sizes(drafts)?;
    states(drafts)
}

const X: [i32; 3] = [1, 0, 0];
const Y: [i32; 3] = [0, 1, 0];
const Z: [i32; 3] = [0, 0, 1];

/// A grid of 3 x 3 x 3 cubes of half a metre with the largest radius.
fn cube_of_27(widths: [u8; 3]) -> Entry {
    Entry {
        dims: [3; 3],
        capacity: 64,
        buckets: 17,
        ..entry(1, widths)
    }
}

/// A point of a cube from signed normal codes.
fn oriented(entry: &Entry, position: [u32; 3], normal: [i32; 2], ao: u32) -> u32 {
    let mask = (1u32 << entry.widths[1]) - 1;
    entry.point(position, normal.map(|code| code as u32 & mask), ao)
}

/// Small numbers, the same on every machine.
struct Draw(u64);

impl Draw {
    /// 0 to `bound - 1`.
    fn below(&mut self, bound: u32) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 33) % u64::from(bound)) as u32
    }

    /// -1 to 1.
    fn signed(&mut self) -> f64 {
        f64::from(self.below(1 << 20)) / f64::from(1 << 19) - 1.0
    }

    /// Any point.
    fn point(&mut self, entry: &Entry) -> u32 {
        let bits = 8 * entry.point_bytes() as u32 - 1;
        self.below(1 << bits) | 1 << bits
    }
}

/// A part with points in cubes, seven a cell and as many cells as that takes.
fn cubes(entry: &Entry, content: &[([u32; 3], Vec<u32>)]) -> Part {
    let mut cells = Vec::new();
    for (cube, points) in content {
        for chunk in points.chunks(7) {
            cells.push((cells.len() as u32, entry.key(*cube), chunk.to_vec()));
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

/// A stream with its questions.
struct Asked<'n> {
    name: &'n str,
    frames: Frames,
    queries: Vec<Query>,
}

impl<'n> Asked<'n> {
    fn of(name: &'n str, frames: Frames) -> Asked<'n> {
        Asked {
            name,
            frames,
            queries: Vec::new(),
        }
    }

    fn held(&self, track: u32) -> Result<&Held, String> {
        let held = self.frames.held.iter().find(|h| h.entry.id == track);
        held.ok_or_else(|| format!("{}: no track {track}", self.name))
    }

    /// Asks at a position in metres, rounded to what a query can say.
    fn ask(&mut self, track: u32, x: [f64; 3], normal: [i32; 3]) -> Result<&mut Self, String> {
        let mut query = Query {
            track,
            position: x.map(|v| (v * 65536.0).round() as i32),
            normal,
            ao: [0; 2],
        };
        let found = look_up(self.held(track)?, &query)
            .map_err(|near| format!("{}: query at {x:?}: {near}", self.name))?;
        query.ao = bounds(found);
        self.queries.push(query);
        Ok(self)
    }

    /// Asks at a point with normals all around its own, `count` just within T_n and as many beyond:
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
            self.ask(track, point.position, normal)?;
        }
        Ok(self)
    }

    /// Asks `count` times within reach of drawn points, every fourth time with any normal; places
    /// too near to a threshold, and all but a few where there is nothing, are drawn again.
    fn draw(&mut self, track: u32, seed: u64, count: usize) -> Result<&mut Self, String> {
        let mut draw = Draw(seed);
        let held = self.held(track)?.clone();
        let points = all(&held);
        let (mut asked, mut tries) = (0, 0);
        while asked < count {
            tries += 1;
            if tries > 10_000 {
                return Err(format!("{}: no place for a question", self.name));
            }
            let point = points[draw.below(points.len() as u32) as usize];
            let reach = f64::from(held.entry.radius);
            let x = point.position.map(|v| v + draw.signed() * reach);
            let any = asked % 4 == 3;
            let normal = point.normal.map(|v| {
                let own = if any { 0.0 } else { v };
                ((own + 0.4 * draw.signed()) * 1000.0).round() as i32
            });
            let query = Query {
                track,
                position: x.map(|v| (v * 65536.0).round() as i32),
                normal,
                ao: [0; 2],
            };
            let Ok(found) = look_up(&held, &query) else {
                continue;
            };
            if found.weight > 0.1 || (any && found.weight == 0.0) {
                asked += 1;
                self.queries.push(Query {
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
            std::mem::take(&mut self.queries),
        ));
    }
}

/// The middle cube's point of [`one_point`] and [`distances`], in metres.
const MIDDLE: f64 = (1.0 + 16.5 / 32.0) * 0.5;

fn beside([dx, dy, dz]: [f64; 3]) -> [f64; 3] {
    [MIDDLE + dx, MIDDLE + dy, MIDDLE + dz]
}

/// Both criteria of Eq. 3 from both sides.
fn one_point(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]);
    let point = oriented(&entry, [16; 3], [0, 0], 100);
    let mut asked = Asked::of("at-the-point", still(&entry, &[([1; 3], vec![point])]));
    asked
        .ask(1, beside([0.0; 3]), Z)?
        .ask(1, beside([0.0; 3]), [3, 4, 12])?
        .ask(1, beside([0.0; 3]), [0, 0, -1])?
        .ask(1, beside([0.0; 3]), X)?;
    asked.finish(
        drafts,
        &["P-046", "P-045", "P-040", "P-041"],
        "The fragment is at a point: only the normals count.",
    );
    let frames = still(&entry, &[([1; 3], vec![point])]);
    let mut asked = Asked::of("normals-that-agree", frames);
    // Cosines of 0.102, 0.098, 0.11, 0.09, 0.9, 0 and -1.
    for normal in [
        [994_784, 0, 102_000],
        [0, 995_186, 98_000],
        [-993_932, 0, 110_000],
        [0, -995_942, 90_000],
        [435_890, 0, 900_000],
        [1, 1, 0],
        [0, 0, -7],
    ] {
        asked.ask(1, beside([0.1, 0.02, 0.0]), normal)?;
    }
    asked.finish(
        drafts,
        &["P-045", "P-048"],
        "The cosine between the normals of point and fragment is on either side of T_n.",
    );
    let frames = still(&entry, &[([1; 3], vec![point])]);
    let mut asked = Asked::of("directions-across", frames);
    // Squared cosines of the direction to the point.
    for slope in [0.0, 0.3, 0.5, 0.69, 0.698f64, 0.702, 0.71, 0.84, 1.0] {
        let (along, across) = (0.1 * slope.sqrt(), 0.1 * (1.0 - slope).sqrt());
        asked.ask(1, beside([across, 0.0, along]), Z)?;
        asked.ask(1, beside([0.0, -across, -along]), Z)?;
    }
    asked.finish(
        drafts,
        &["P-045", "P-048"],
        "The squared cosine between the point's normal and the direction to it is on either side of T_d.",
    );
    Ok(())
}

/// The weight of Eq. 2: a second point at another distance takes its share.
fn distances(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]);
    let near = oriented(&entry, [16; 3], [0, 0], 255);
    let far = oriented(&entry, [24, 16, 16], [0, 0], 0);
    let mut asked = Asked::of("distances", still(&entry, &[([1; 3], vec![near, far])]));
    for dx in [-0.2, -0.1, -0.03, 0.02, 0.05, 0.0625, 0.1, 0.12, 0.2, 0.3] {
        asked.ask(1, beside([dx, 0.03, 0.0]), Z)?;
    }
    asked.finish(
        drafts,
        &["P-045", "P-047"],
        "Two points share a fragment by their distances.",
    );
    let mut asked = Asked::of(
        "edge-of-the-radius",
        still(&entry, &[([1; 3], vec![near - 99])]),
    );
    for share in [0.9, 0.99, 0.998, 1.002, 1.01, 1.1] {
        let d = 0.25 * share;
        asked.ask(1, beside([d, 0.0, 0.0]), Z)?;
        asked.ask(1, beside([-0.6 * d, 0.8 * d, 0.0]), Z)?;
    }
    asked.finish(
        drafts,
        &["P-045", "P-047", "P-048"],
        "A single point just within the radius counts as much as a near one, and just beyond it not at all.",
    );
    Ok(())
}

/// Points in each of the eight cubes of a block, and of all blocks of the grid.
fn octants(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = cube_of_27(WIDTHS[0]);
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1];
    // About the corner of cubes 0 and 1; cube i has an AO of 32 i + 20.
    let content: Vec<_> = (0..8)
        .map(|i| {
            let at = corner(i).map(|high| if high == 1 { 4 } else { 27 });
            (corner(i), vec![oriented(&entry, at, [0, 0], 32 * i + 20)])
        })
        .collect();
    let mut asked = Asked::of("eight-cubes", still(&entry, &content));
    for i in 0..8 {
        let step = corner(i).map(|high| if high == 1 { 0.02 } else { -0.02 });
        asked.ask(1, step.map(|v| 0.5 + v), [1, 1, 3])?;
        asked.ask(1, step.map(|v| 0.5 + 2.5 * v), [-1, 0, 4])?;
    }
    asked.finish(
        drafts,
        &["P-043", "P-044", "P-047"],
        "Each of the eight cubes about a corner has a point.",
    );
    for (i, one) in content.iter().enumerate() {
        // Only one of the eight has a point, so that a sampler which leaves it out finds nothing.
        let name = match i {
            0 => "own-cube-alone".to_string(),
            _ => format!(
                "neighbour-alone-{}",
                ["x", "y", "x-y", "z", "x-z", "y-z", "x-y-z"][i - 1]
            ),
        };
        let mut only = Asked::of(&name, still(&entry, std::slice::from_ref(one)));
        only.ask(1, [0.48; 3], [1, 1, 3])?;
        only.ask(1, [0.46, 0.47, 0.48], Z)?;
        only.ask(1, [0.52; 3], [1, 1, 3])?;
        let comment = "A single cube of the block has a point.";
        only.finish(drafts, &["P-043", "P-044"], comment);
    }
    let mut draw = Draw(5);
    let everywhere: Vec<_> = (0..27)
        .map(|i| {
            let points = (0..2).map(|_| draw.point(&entry)).collect();
            ([i % 3, i / 3 % 3, i / 9], points)
        })
        .collect();
    let mut asked = Asked::of("all-cubes", still(&entry, &everywhere));
    asked.draw(1, 6, 16)?;
    asked.finish(
        drafts,
        &["P-043", "P-044", "P-045", "P-047"],
        "Two points in every cube of the grid, with any position and normal.",
    );
    Ok(())
}

/// Fragments beyond the grid, on each side.
fn outside(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = Entry {
        dims: [2; 3],
        ..cube_of_27(WIDTHS[0])
    };
    // A point near the middle of each side, its normal along the side.
    let mut content = Vec::new();
    for (axis, normal) in [[0, 7], [7, 0], [7, 0]].into_iter().enumerate() {
        for high in [0, 1] {
            let (mut cube, mut at) = ([1; 3], [8; 3]);
            (cube[axis], at[axis]) = (high, if high == 1 { 30 } else { 1 });
            let ao = 40 * axis as u32 + 20 * high + 7;
            content.push((cube, vec![oriented(&entry, at, normal, ao)]));
        }
    }
    let mut asked = Asked::of("outside", still(&entry, &content));
    for axis in 0..3 {
        let normal = [Y, X, X][axis];
        for (low, high) in [
            (-0.02, 1.03),
            (-0.1, 1.1),
            (-0.3, 1.3),
            (-0.6, 1.6),
            (-3.1, 4.1),
        ] {
            for beyond in [low, high] {
                let mut x = [0.64; 3];
                x[axis] = beyond;
                asked.ask(1, x, normal)?;
            }
        }
    }
    for x in [[-0.05; 3], [1.05; 3], [-30_000.625; 3], [30_000.625; 3]] {
        asked.ask(1, x, [1, 1, 1])?;
    }
    asked.finish(
        drafts,
        &["P-043", "P-048"],
        "Fragments lie beyond the grid, at negative and at large coordinates.",
    );
    Ok(())
}

/// Points of many widths.
fn widths(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for widths in [
        WIDTHS[0],
        WIDTHS[1],
        WIDTHS[2],
        [1, 6, 8],
        [8, 2, 3],
        [2, 8, 1],
        [3, 8, 6],
        [6, 6, 1],
    ] {
        let entry = Entry {
            dims: [3, 2, 3],
            cell_edge: 0.3,
            radius: 0.15,
            ..cube_of_27(widths)
        };
        let mut draw = Draw(u64::from(widths[0]) * 100 + u64::from(widths[1]));
        let content: Vec<_> = (0..18)
            .map(|i| {
                let count = 1 + draw.below(4);
                let points = (0..count).map(|_| draw.point(&entry)).collect();
                ([i % 3, i / 3 % 2, i / 6], points)
            })
            .collect();
        let [p, n, a] = widths;
        let name = format!("widths-{p}-{n}-{a}");
        let mut asked = Asked::of(&name, still(&entry, &content));
        asked.draw(1, 77, 10)?;
        asked.finish(
            drafts,
            &["P-007", "P-040", "P-041", "P-042", "P-047"],
            "Points with any bits, in a grid whose cell edge is no sum of powers of two.",
        );
    }
    Ok(())
}

/// Normals of one point at a time: lowest codes, folds, axes.
fn normals(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let codes = [
        // The lowest code is -1, as is the one above it.
        [-8, 0],
        [0, -8],
        [-8, -8],
        [-7, 0],
        // Straight down, at a corner of the folded half.
        [7, -7],
        // Folded.
        [6, 4],
        [-6, 4],
        [4, -6],
        [-4, -6],
        // On the rim and above it.
        [0, 7],
        [3, -2],
        [-3, 4],
    ];
    let entry = cube_of_27(WIDTHS[0]);
    let content: Vec<_> = (0..12u32)
        .zip(codes)
        .map(|(i, code)| {
            let cube = [i % 3, i / 3 % 3, i / 9 * 2];
            let point = oriented(&entry, [15, 16, 14], code, 20 * i + 9);
            (cube, vec![point])
        })
        .collect();
    let mut asked = Asked::of("normal-codes", still(&entry, &content));
    for point in all(&asked.held(1)?.clone()) {
        let own = point.normal.map(|v| (v * 1e6).round() as i32);
        asked.ask(1, point.position, own)?.ring(1, &point, 4)?;
    }
    asked.finish(
        drafts,
        &["P-042", "P-046", "P-045"],
        "Normal codes -8 and -7, folded ones with either sign, axes and rims.",
    );
    for widths in [
        [2, 2, 5],
        [4, 3, 5],
        [1, 5, 2],
        [1, 6, 8],
        [2, 7, 3],
        [2, 8, 1],
    ] {
        let [p, n, _] = widths;
        let entry = cube_of_27(widths);
        let (middle, top) = (1 << (p - 1), (1 << (n - 1)) - 1);
        let codes = [
            [-top - 1, 1],
            [top, -top],
            [-top, top - 1],
            [top / 2, -1 - top / 2],
        ];
        let content: Vec<_> = [[0, 0, 0], [1, 1, 1], [2, 0, 1], [0, 2, 2]]
            .into_iter()
            .zip(codes)
            .map(|(cube, code)| (cube, vec![oriented(&entry, [middle; 3], code, 0)]))
            .collect();
        let name = format!("normal-codes-of-{n}-bits");
        let mut asked = Asked::of(&name, still(&entry, &content));
        for point in all(&asked.held(1)?.clone()) {
            asked.ring(1, &point, 2)?;
        }
        let comment = "Cosines with point normals are on either side of T_n, all around them.";
        asked.finish(drafts, &["P-042", "P-046"], comment);
    }
    // Two sides of a thin wall.
    let content: Vec<_> = [[0, 1, 1], [1, 1, 1], [2, 1, 1]]
        .into_iter()
        .map(|cube| {
            let side = |normal, ao| oriented(&entry, [12, 16, 16], normal, ao);
            (cube, vec![side([0, 0], 30), side([7, 7], 220)])
        })
        .collect();
    let mut asked = Asked::of("opposite-normals", still(&entry, &content));
    for x in [0.13, 0.3, 0.63, 0.71, 1.2] {
        for normal in [Z, [0, 0, -1], [2, 1, 9], [2, 1, -9]] {
            asked.ask(1, [x, MIDDLE + 0.02, MIDDLE], normal)?;
        }
    }
    asked.finish(
        drafts,
        &["P-042", "P-045"],
        "Two points at one place face opposite ways, as on the sides of a thin wall.",
    );
    Ok(())
}

/// Buckets of several cubes, and cubes of several cells.
fn shared_buckets(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entry = Entry {
        dims: [4, 2, 1],
        buckets: 1,
        ..cube_of_27(WIDTHS[1])
    };
    let mut draw = Draw(21);
    let mut content: Vec<_> = (0..8)
        .map(|i| {
            let points = (0..2).map(|_| draw.point(&entry)).collect();
            ([i % 4, i / 4, 0], points)
        })
        .collect();
    let mut asked = Asked::of("one-bucket", still(&entry, &content));
    asked.draw(1, 22, 10)?;
    asked.finish(
        drafts,
        &["P-044", "P-005"],
        "All cubes have the same bucket, so that most of its cells are of other cubes.",
    );
    content.truncate(2);
    // 21 points of one cube in three cells, and 8 of another in two, entries of both interleaved.
    content[0].1 = (0..21).map(|_| draw.point(&entry)).collect();
    content[1].1 = (0..8).map(|_| draw.point(&entry)).collect();
    let mut part = cubes(&entry, &content);
    part.buckets[0].1 = vec![3, 0, 4, 1, 2];
    let frames = Frames::new(std::slice::from_ref(&entry));
    let mut asked = Asked::of("several-cells-of-a-cube", frames.keyframe(&[part]).commit());
    asked.draw(1, 23, 12)?;
    asked.finish(
        drafts,
        &["P-044", "P-019", "P-047"],
        "Two cubes of three and two cells, interleaved in one bucket.",
    );
    // Cubes (0, 0, 0) and (1, 1, 0) have one bucket, and both are in the block.
    let collide = Entry {
        dims: [3, 3, 1],
        buckets: 52,
        ..cube_of_27(WIDTHS[0])
    };
    let content = [
        (
            [0, 0, 0],
            vec![oriented(&collide, [28, 28, 16], [0, 0], 10)],
        ),
        ([1, 1, 0], vec![oriented(&collide, [3, 3, 16], [0, 0], 200)]),
        ([1, 0, 0], vec![oriented(&collide, [3, 28, 16], [0, 0], 90)]),
    ];
    let mut asked = Asked::of("colliding-neighbours", still(&collide, &content));
    for x in [
        [0.47, 0.47],
        [0.53, 0.53],
        [0.48, 0.54],
        [0.54, 0.46],
        [0.3, 0.3],
        [0.7, 0.7],
    ] {
        asked.ask(1, [x[0], x[1], MIDDLE - 0.5], Z)?;
    }
    asked.finish(
        drafts,
        &["P-044", "P-005"],
        "Two cubes of a block share a bucket: the points of each count once.",
    );
    // Eight full cells in the eight cubes of a block.
    let full = cube_of_27(WIDTHS[2]);
    let content: Vec<_> = (0..8u32)
        .map(|i| {
            let points = (0..7).map(|_| draw.point(&full)).collect();
            ([1 + (i & 1), 1 + (i >> 1 & 1), 1 + (i >> 2)], points)
        })
        .collect();
    let mut asked = Asked::of("full-block", still(&full, &content));
    asked.draw(1, 24, 10)?;
    asked.finish(
        drafts,
        &["P-044", "P-047"],
        "Eight full cells in one block.",
    );
    Ok(())
}

/// Grids so large that the hash wraps; all their numbers are exact in f32.
fn large(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let grids: [(&str, [u16; 3], u32, f32); 4] = [
        ("large-block", [4000, 4000, 200], 997, 0.25),
        ("large-layer", [65535, 65535, 1], 11, 0.5),
        ("large-wall", [1, 65535, 65535], 64, 0.25),
        ("large-row", [65535, 1, 1], 7, 0.125),
    ];
    for (name, dims, buckets, cell_edge) in grids {
        let entry = Entry {
            dims,
            buckets,
            cell_edge,
            radius: cell_edge / 2.0,
            ..cube_of_27([3, 4, 6])
        };
        let last = dims.map(|dim| u32::from(dim) - 1);
        let middle = dims.map(|dim| u32::from(dim) / 3);
        let content: Vec<_> = [[0; 3], middle, last]
            .into_iter()
            .zip([13, 31, 57])
            .map(|(cube, ao)| (cube, vec![oriented(&entry, [2, 5, 3], [0, 0], ao)]))
            .collect();
        let mut asked = Asked::of(name, still(&entry, &content));
        for (cube, _) in &content {
            // In 32nds of a cube from its corner.
            for step in [
                [10, 22, 14],
                [12, 20, 15],
                [6, 25, 12],
                [14, 18, 17],
                [30, 30, 30],
            ] {
                let x = [0, 1, 2].map(|axis| {
                    (f64::from(cube[axis]) + f64::from(step[axis]) / 32.0) * f64::from(cell_edge)
                });
                asked.ask(1, x, [1, 2, 4])?;
            }
        }
        let comment = "The hash of far cubes wraps, and positions are far from the origin.";
        asked.finish(drafts, &["P-005", "P-043", "P-044"], comment);
    }
    Ok(())
}

/// Small and large cubes, and radii from half an edge down.
fn sizes(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, cell_edge, radius) in [
        ("small-cubes", 0.03125, 0.015625),
        ("large-cubes", 64.0, 30.0),
        ("radius-of-a-tenth", 0.5, 0.05f32),
        ("radius-half-of-a-third", 1.0 / 3.0, 0.5 / 3.0),
    ] {
        let entry = Entry {
            cell_edge,
            radius,
            ..cube_of_27(WIDTHS[0])
        };
        let mut draw = Draw(31);
        let content: Vec<_> = (0..10)
            .map(|i| {
                let points = (0..3).map(|_| draw.point(&entry)).collect();
                ([i % 3, i / 3 % 3, i / 9], points)
            })
            .collect();
        let mut asked = Asked::of(name, still(&entry, &content));
        asked.draw(1, 32, 8)?;
        let comment = format!("Cubes of {cell_edge} m and a radius of {radius} m.");
        asked.finish(drafts, &["P-040", "P-043", "P-045"], &comment);
    }
    Ok(())
}

/// What a sampler sees of several frames and of several tracks.
fn states(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let entries = [1, 2].map(|id| Entry {
        id,
        ..cube_of_27(WIDTHS[id as usize - 1])
    });
    let point = |i: usize, ao| oriented(&entries[i], [5, 5, 5], [0, 0], ao);
    let place = |i: usize, ao| cubes(&entries[i], &[([1; 3], vec![point(i, ao)])]);
    let spots = [[0.58, 0.6, 0.585], [0.66, 0.6, 0.6], [1.1, 1.1, 1.1]];
    let frames = Frames::new(&entries).keyframe(&[place(0, 10), place(1, 30)]);
    let mut asked = Asked::of("two-tracks", frames.clone().commit());
    for x in spots {
        asked.ask(1, x, Z)?.ask(2, x, Z)?;
    }
    let comment = "Two tracks have the same grid and other points.";
    asked.finish(drafts, &["P-044", "P-047"], comment);

    let cell = Part::of(&entries[0]).cell(0, entries[0].key([1; 3]), &[point(0, 200)]);
    let mut asked = Asked::of(
        "last-frame",
        frames.clone().commit().delta(&[cell]).commit(),
    );
    for x in spots {
        asked.ask(1, x, Z)?.ask(2, x, [1, 0, 5])?;
    }
    let comment = "A delta changes the AO of one track's point.";
    asked.finish(drafts, &["P-016", "P-047"], comment);

    let bucket = entries[0].bucket(entries[0].key([1; 3]));
    let forgotten = Part::of(&entries[0]).bucket(bucket, &[]);
    let frames = frames.commit().delta(&[forgotten]).commit();
    let mut asked = Asked::of("cell-that-no-bucket-names", frames);
    for x in spots {
        asked.ask(1, x, Z)?.ask(2, x, Z)?;
    }
    let comment = "A cell with points is named by no bucket any more.";
    asked.finish(drafts, &["P-018", "P-048"], comment);

    let mut asked = Asked::of("no-points", Frames::new(&entries).commit());
    for x in spots {
        asked.ask(1, x, Z)?.ask(2, x, [0, 0, -1])?;
    }
    let comment = "Tracks without content are open everywhere.";
    asked.finish(drafts, &["P-048"], comment);
    Ok(())
}
