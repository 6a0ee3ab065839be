//! Queries to tracks of `regions`: the AO of an object at a place. The intervals come from
//! [`super::super::oracle`].

use super::{Content, Draft, Region, Set, some};
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::generate::plan::moved;
use crate::models::Query;
use crate::models::entry::Entry;
use crate::models::regions::oracle::with_intervals;
use crate::models::regions::queries::RegionsQuery;

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query that rounding could decide.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    rows(drafts)?;
    polynomials(drafts)?;
    lookups(drafts)?;
    clamps(drafts)?;
    blends(drafts)?;
    boxes(drafts)?;
    drawn(drafts)?;
    states(drafts)
}

/// Normals along and across the axes.
const NORMALS: [[i32; 3]; 6] = [
    [0, 1, 0],
    [-1, 0, 0],
    [0, 0, 1],
    [3, -4, 2],
    [-2, -1, -3],
    [1, 1, 1],
];
const BOX: [f32; 6] = [-1.0, 2.0, 0.5, 3.0, 4.0, 1.5];

/// A stream with its queries.
struct QuerySet<'n> {
    name: &'n str,
    frames: Frames,
    queries: Vec<RegionsQuery>,
}

impl<'n> QuerySet<'n> {
    /// One track, one frame.
    fn of(name: &'n str, set: &Set, regions: Vec<Region>) -> QuerySet<'n> {
        let frames = Frames::new(&[Entry::of_set(1, set.clone())]);
        QuerySet {
            name,
            frames: frames.regions(&[Content::new(1, regions)]).commit(),
            queries: Vec::new(),
        }
    }

    /// Queries of a track at a place with each of the normals.
    fn at(&mut self, track: u32, p: [f64; 3]) -> Result<&mut Self, String> {
        for normal in NORMALS {
            self.one(track, p, normal)
                .map_err(|near| format!("{}: at {p:?}: {near}", self.name))?;
        }
        Ok(self)
    }

    fn one(&mut self, track: u32, p: [f64; 3], normal: [i32; 3]) -> Result<(), String> {
        let content = self.frames.tracks.iter().find(|t| t.entry.id == track);
        let content = content.ok_or_else(|| format!("no track {track}"))?;
        let query = RegionsQuery {
            track,
            position: p.map(|v| (v * 65536.0).round() as i32),
            normal,
            obscurance: [0; 2],
        };
        self.queries.push(with_intervals(content, query)?);
        Ok(())
    }

    /// Queries at drawn places and normals; those that rounding could decide are drawn again.
    fn draw(&mut self, track: u32, seed: u64, count: usize, reach: f64) -> Result<(), String> {
        let mut draw = Draw(seed);
        let mut tries = 0;
        let wanted = self.queries.len() + count;
        while self.queries.len() < wanted {
            tries += 1;
            if tries > 20_000 {
                return Err(format!("{}: no place for a query", self.name));
            }
            let p = [0; 3].map(|_| reach * draw.signed());
            let n = [0; 3].map(|_| (1000.0 * draw.signed()) as i32);
            if n != [0; 3] {
                let _ = self.one(track, p, n);
            }
        }
        Ok(())
    }

    fn finish(&mut self, drafts: &mut Vec<Draft>, clauses: &[&'static str], comment: &str) {
        let queries = self.queries.drain(..).map(Query::Regions).collect();
        let (name, bytes) = (self.name, self.frames.ended());
        drafts.push(Draft::query(
            super::AREA,
            name,
            clauses,
            comment,
            bytes,
            queries,
        ));
    }
}

/// A track of one region and one signal whose coefficients may be up to 1.
fn single() -> Set {
    Set {
        exponent: 0,
        step: 1,
        ..Set::raw(1).of_one()
    }
}

/// A number as a code of [`single`].
fn code(value: f64) -> i32 {
    (value * 32767.0).round() as i32
}

/// Each row by itself beside the mean, on both sides of the centre.
fn rows(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let places = [
        [0.0, 2.25, 0.75],
        [2.0, 3.5, 1.25],
        [0.5, 3.75, 0.625],
        [2.75, 2.5, 1.375],
    ];
    for (derivatives, names) in [
        (1u8, &["gradient-x", "gradient-y", "gradient-z"][..]),
        (
            2,
            &[
                "sided-x-up",
                "sided-x-down",
                "sided-y-up",
                "sided-y-down",
                "sided-z-up",
                "sided-z-down",
            ],
        ),
    ] {
        for (row, name) in names.iter().enumerate() {
            for own in [false, true] {
                let mut region = Region::new(BOX, [derivatives, 0, 1]);
                region.codes[0] = code(0.5);
                region.codes[1 + row] = code(0.25);
                region.centre = own.then_some([0.25, 2.5, 0.75]);
                let name = format!("{name}{}", if own { "-own-centre" } else { "" });
                let mut set = QuerySet::of(&name, &single(), vec![region]);
                for p in places {
                    set.at(1, p)?;
                }
                let comment =
                    "One derivative beside the mean, at places on both sides of the centre.";
                set.finish(drafts, &["R-061", "R-062"], comment);
            }
        }
    }
    Ok(())
}

/// Each polynomial by itself beside the constant.
fn polynomials(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for k in 0..9 {
        let mut region = Region::new(BOX, [0, 2, 1]);
        region.codes[0] = code(0.5);
        region.codes[k] += code(0.1875);
        let name = format!("polynomial-{k}");
        let mut set = QuerySet::of(&name, &single(), vec![region]);
        set.at(1, [0.5, 3.0, 1.0])?;
        for n in [
            [5, 0, 0],
            [0, -3, 0],
            [0, 0, -1],
            [1, 1, 0],
            [0, 1, -1],
            [-1, 0, 1],
            [7, 2, -3],
        ] {
            set.one(1, [1.5, 2.5, 0.75], n)?;
        }
        let comment = format!("Polynomial {k} beside the constant.");
        set.finish(drafts, &["R-063"], &comment);
    }
    Ok(())
}

/// Which region a place has: each has a number of its own.
fn lookups(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let constant = |bounds, value: f64| {
        let mut region = Region::new(bounds, [0, 0, 1]);
        region.codes[0] = code(value);
        region
    };
    let set = |count| Set {
        count,
        capacity: count,
        ..single()
    };
    let big = [0.0, 0.0, 0.0, 8.0, 8.0, 8.0];
    let regions = vec![
        constant(big, 0.1),
        constant([2.0, 2.0, 2.0, 4.0, 4.0, 4.0], 0.3),
        constant([1.0, 1.0, 1.0, 5.0, 5.0, 5.0], 0.5),
        constant(big, 0.7),
        constant([6.0, 0.0, 0.0, 8.0, 8.0, 1.0], 0.9),
    ];
    let mut nested = QuerySet::of("lookup-nested", &set(5), regions);
    for p in [
        [3.0, 3.0, 3.0],
        [1.5, 4.5, 3.0],
        [0.5, 7.0, 2.0],
        [7.0, 4.0, 0.5],
        [7.5, 7.5, 7.5],
    ] {
        nested.at(1, p)?;
    }
    let comment =
        "Boxes within boxes: the least volume, and the lower index of two that are alike.";
    nested.finish(drafts, &["R-060"], comment);

    let regions = vec![
        constant([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], 0.2),
        constant([4.0, 0.0, 0.0, 6.0, 1.0, 1.0], 0.4),
        constant([0.0, 5.0, 0.0, 1.0, 6.0, 4.0], 0.6),
        constant([-3.0, -3.0, -3.0, -2.0, -2.0, -2.0], 0.8),
    ];
    let mut outside = QuerySet::of("lookup-outside", &set(4), regions);
    for p in [
        [1.5, 0.5, 0.5],
        [3.5, 0.5, 0.5],
        [9.0, 3.0, 2.0],
        [0.5, 4.0, 2.0],
        [0.5, 20.0, -7.0],
        [-1.75, -1.5, -1.5],
        [-9.0, -9.0, -9.0],
        [2.0, 2.0, 2.0],
        [3.0, 3.0, 0.25],
    ] {
        outside.at(1, p)?;
    }
    let comment = "Places outside all boxes: the nearest, by the distance from its nearest point.";
    outside.finish(drafts, &["R-060"], comment);

    // Two boxes whose distance from a place is the same, and whose volumes are not.
    let regions = vec![
        constant([0.0, 0.0, 0.0, 4.0, 2.0, 2.0], 0.2),
        constant([0.0, 0.0, 0.0, 2.0, 2.0, 2.0], 0.4),
        constant([0.0, -4.0, 0.0, 1.0, 2.0, 1.0], 0.6),
    ];
    let mut shared = QuerySet::of("lookup-shared-face", &set(3), regions);
    for p in [
        [-2.0, 1.0, 1.5],
        [-0.5, 0.5, 1.75],
        [3.0, 3.0, 1.5],
        [-1.0, 1.0, 0.5],
        [0.5, 7.0, 0.5],
    ] {
        shared.at(1, p)?;
    }
    let comment = "Places as far from two boxes: the least volume decides.";
    shared.finish(drafts, &["R-060"], comment);

    let regions = vec![
        constant([0.0, 0.0, 0.0, 4.0, 4.0, 0.0], 0.2),
        constant([0.0, 0.0, 0.0, 4.0, 4.0, 4.0], 0.4),
        constant([9.0, 1.0, 1.0, 9.0, 1.0, 1.0], 0.6),
    ];
    let mut flat = QuerySet::of("lookup-flat", &set(3), regions);
    for p in [
        [2.0, 2.0, 1.0],
        [2.0, 2.0, -1.0],
        [8.0, 1.5, 1.0],
        [5.0, 2.0, 2.0],
    ] {
        flat.at(1, p)?;
    }
    let comment = "Flat boxes and one that is a point have the least volume, 0.";
    flat.finish(drafts, &["R-060", "R-061"], comment);
    Ok(())
}

/// Signals and positions that are clamped.
fn clamps(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let set = Set {
        exponent: 3,
        ..single()
    };
    for (name, mean, comment) in [
        ("clamp-at-1", 20_000, "A signal above 1."),
        ("clamp-at-0", -20_000, "A signal below 0."),
    ] {
        let mut region = Region::new(BOX, [1, 1, 1]);
        region.codes[0] = mean;
        region.codes[5] = 300;
        let mut query = QuerySet::of(name, &set, vec![region]);
        query.at(1, [0.0, 2.5, 1.0])?.at(1, [2.5, 3.5, 0.75])?;
        query.finish(drafts, &["R-063"], comment);
    }
    let mut region = Region::new(BOX, [2, 1, 1]);
    region.codes[0] = code(0.5);
    for at in 1..7 {
        region.codes[4 * at] = code(0.02 * at as f64);
    }
    let mut query = QuerySet::of("clamp-position", &single(), vec![region]);
    for p in [
        [-50.0, 3.25, 1.0],
        [90.0, 30.0, 20.0],
        [0.5, -7.0, 1.25],
        [-4.0, 9.0, -3.0],
    ] {
        query.at(1, p)?;
    }
    let comment = "Places outside the box count as its nearest point.";
    query.finish(drafts, &["R-061"], comment);
    Ok(())
}

/// Tracks of two signals, and regions of one in them.
fn blends(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, share, signals, kinds) in [
        ("blend-three-quarters", 0.75, 2u8, [1, 1]),
        ("blend-0", 0.0, 2, [1, 2]),
        ("blend-1", 1.0, 2, [2, 1]),
        ("blend-applied", 0.25, 1, [1, 1]),
    ] {
        let set = Set {
            share,
            signals,
            kinds,
            step: 8,
            exponent: 1,
            ..Set::packed(2)
        };
        let mut first = Region::new(BOX, [2, 2, signals]);
        let mut second = Region::new([5.0, 2.0, 0.0, 8.0, 4.0, 2.0], [1, 1, 1]);
        let mut draw = Draw(9);
        for region in [&mut first, &mut second] {
            for code in &mut region.codes {
                *code = draw.below_i32(301) - 150;
            }
            region.codes[0] += 1100;
        }
        if signals == 2 {
            first.codes[1] += 700;
        }
        let mut query = QuerySet::of(name, &set, vec![first, second]);
        query
            .at(1, [0.0, 2.5, 1.0])?
            .at(1, [2.5, 3.5, 0.75])?
            .at(1, [6.0, 3.25, 1.5])?;
        let comment = "Two regions, the second of one signal, in a track with this share.";
        query.finish(drafts, &["O-010", "R-063"], comment);
    }
    // Each signal is clamped before the blend.
    let set = Set {
        share: 0.5,
        step: 1,
        exponent: 1,
        ..Set::raw(1)
    };
    let mut region = Region::new(BOX, [0, 0, 2]);
    region.codes = vec![32767, -16384];
    let mut query = QuerySet::of("blend-of-clamped", &set, vec![region]);
    query.at(1, [0.0, 2.5, 1.0])?;
    let comment = "One signal is above 1 and the other below 0: both are clamped, then blended.";
    query.finish(drafts, &["O-010", "R-063"], comment);
    Ok(())
}

/// Boxes of all shapes.
fn boxes(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, bounds, p, comment) in [
        (
            "box-flat",
            [0.0, 1.0, 0.0, 4.0, 1.0, 2.0],
            [3.0, 5.0, 0.5],
            "A box that is flat in y.",
        ),
        (
            "box-point",
            [1.0; 6],
            [3.0, 5.0, 0.5],
            "A box that is a point.",
        ),
        (
            "box-line",
            [0.0, 1.0, 2.0, 0.0, 9.0, 2.0],
            [3.0, 5.5, 0.5],
            "A box that is a line.",
        ),
        (
            "box-long",
            [-100.0, 0.0, 0.0, 300.0, 0.25, 0.125],
            [250.0, 0.0625, 0.125],
            "A box much longer than wide.",
        ),
        (
            "box-far",
            [4096.0, -2048.0, 0.0, 4100.0, -2040.0, 16.0],
            [4097.0, -2046.5, 12.0],
            "A box far from the origin.",
        ),
    ] {
        for derivatives in [1u8, 2] {
            let mut region = Region::new(bounds, [derivatives, 1, 1]);
            let mut draw = Draw(5);
            for code in &mut region.codes {
                *code = draw.below_i32(4001) - 2000;
            }
            region.codes[0] = code(0.5);
            let form = ["", "gradient", "sided"][usize::from(derivatives)];
            let name = format!("{name}-{form}");
            let mut query = QuerySet::of(&name, &single(), vec![region]);
            query.at(1, p)?.at(1, p.map(|v| v + 0.03125))?;
            query.finish(drafts, &["R-061", "R-062"], comment);
        }
    }
    Ok(())
}

/// Many regions, places and normals.
fn drawn(drafts: &mut Vec<Draft>) -> Result<(), String> {
    for (name, set, seed) in [
        ("drawn-raw", Set::raw(24), 3),
        ("drawn-packed", Set::packed(24), 4),
        ("drawn-one-signal", Set::packed(24).of_one(), 5),
    ] {
        let mut regions = some(&set, seed);
        for region in &mut regions {
            // Mostly within 0 and 1: small coefficients about a half.
            for code in &mut region.codes {
                *code %= 40;
            }
            for code in &mut region.codes[..usize::from(region.signals)] {
                *code += 256;
            }
        }
        let mut query = QuerySet::of(name, &set, regions);
        query.draw(1, seed, 150, 18.0)?;
        let comment = "24 regions of all forms at drawn places, some of them outside of all.";
        query.finish(
            drafts,
            &["R-060", "R-061", "R-062", "R-063", "O-010"],
            comment,
        );
    }
    Ok(())
}

/// Tracks without content, with a transform, and after further frames.
fn states(drafts: &mut Vec<Draft>) -> Result<(), String> {
    let set = Set::packed(3);
    let frames = Frames::new(&[Entry::of_set(1, set.clone()), Entry::of_set(2, set.clone())]);
    let frames = frames.regions(&[Content::new(2, some(&set, 1))]).commit();
    let frames = frames
        .regions(&[Content::new(2, some(&set, 2))])
        .transforms(&[(2, moved(3.0))])
        .commit();
    let mut query = QuerySet {
        name: "states",
        frames,
        queries: Vec::new(),
    };
    query.at(1, [1.0, 2.0, 3.0])?;
    query.draw(2, 6, 30, 10.0)?;
    let comment = "A track without content has AO 1. The other has its second content, and a transform: queries are in its space.";
    query.finish(drafts, &["R-060", "R-010"], comment);
    Ok(())
}
