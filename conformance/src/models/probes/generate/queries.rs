//! Queries to tracks of `probes`: what light a surface finds. The intervals come from
//! [`super::super::lighting`].

mod content;
mod fine;
mod geometry;
mod sight;

use crate::generate::Draft;
use crate::generate::draw::Draw;
use crate::generate::expected::TrackContent;
use crate::generate::frames::Frames;
use crate::models::Query;
use crate::models::entry::Entry;
use crate::models::probes::expected::Content;
use crate::models::probes::oracle::with_intervals;
use crate::models::probes::queries::Interpolation;
use crate::models::probes::queries::ProbesQuery;
use crate::models::probes::writer::{GROUPS, Probe, Volume};
use Interpolation::{Trilinear, VisibilityWeighted};

/// Adds the vectors of this part.
///
/// # Errors
/// A sentence that names a vector with a query that rounding could decide.
pub fn add(drafts: &mut Vec<Draft>) -> Result<(), String> {
    geometry::places(drafts)?;
    geometry::outside(drafts)?;
    geometry::layers(drafts)?;
    geometry::spacings(drafts)?;
    geometry::turned(drafts)?;
    content::absent(drafts)?;
    content::levels(drafts)?;
    content::exponents(drafts)?;
    content::ringing(drafts)?;
    content::roughness(drafts)?;
    content::states(drafts)?;
    sight::maps(drafts)?;
    sight::walls(drafts)?;
    sight::lifted(drafts)?;
    sight::nothing_seen(drafts)?;
    sight::blocks(drafts)?;
    fine::on_axes(drafts)?;
    fine::weights(drafts)?;
    fine::threshold(drafts)
}

/// The f16 of a number, cut off; 0 below 2^-14.
fn half(value: f64) -> u16 {
    let bits = value.to_bits();
    let exponent = (bits >> 52 & 2047) as i32 - 1023 + 15;
    let magnitude = match exponent {
        1..=30 => (exponent as u16) << 10 | (bits >> 42 & 1023) as u16,
        _ => 0,
    };
    magnitude | (bits >> 63 << 15) as u16
}

/// A raw probe of one function's coefficients in grey.
fn grey(coefficients: &[f64]) -> Probe {
    let values = coefficients.iter().flat_map(|&c| [half(c); 3]);
    Probe::raw(&values.collect::<Vec<_>>())
}

/// Light from all sides, more from some, other light for each probe; degrees up to that of `level`
/// where the volume is packed.
fn lit(volume: &Volume, draw: &mut Draw, level: u8) -> Probe {
    if !volume.is_packed() {
        let mut value = |v: usize| match v {
            0..3 => 2.0 + 4.0 * draw.signed().abs(),
            3..12 => 1.5 * draw.signed(),
            _ => draw.signed(),
        };
        return Probe::raw(&std::array::from_fn::<_, 27, _>(|v| half(value(v))));
    }
    let mut probe = Probe::new(level, &[]);
    for group in 0..2 * usize::from(level) {
        let step = f64::from(volume.steps[group]);
        for code in GROUPS[group]..GROUPS[group + 1] {
            probe.codes[code] = match code {
                // Light of 2 to 8.
                0 => (6400.0 + 512.0 * draw.signed().abs()) / step,
                _ => 1200.0 * draw.signed() / step,
            } as i32;
        }
    }
    probe
}

/// Such light at each probe.
fn all_lit(volume: &Volume, seed: u64) -> Vec<Probe> {
    let mut draw = Draw(seed);
    let probes = 0..volume.count();
    probes.map(|_| lit(volume, &mut draw, 3)).collect()
}

/// A track of one frame.
fn still(volume: &Volume, probes: Vec<Probe>, visibility: Option<Vec<u8>>) -> Frames {
    let content = Content {
        visibility,
        ..Content::new(1, probes)
    };
    Frames::new(&[Entry::of_volume(1, volume.clone())])
        .probes(true, &[content])
        .commit()
}

/// A stream with its queries.
struct QuerySet<'n> {
    name: &'n str,
    frames: Frames,
    queries: Vec<ProbesQuery>,
}

/// A surface to ask at.
#[derive(Clone, Copy)]
struct At {
    /// Metres.
    x: [f64; 3],
    n: [i32; 3],
    v: [i32; 3],
    /// 0 to 1.
    roughness: f64,
}

/// A surface that faces up, seen from above.
const FLOOR: At = At {
    x: [0.0; 3],
    n: [1, 9, 2],
    v: [-5, 6, 2],
    roughness: 0.4,
};

/// Normals along and across the axes.
const NORMALS: [[i32; 3]; 5] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1], [3, -4, 2], [-2, -1, -3]];

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

    /// Queries at a surface, its numbers rounded to what a query can say.
    fn query(
        &mut self,
        track: u32,
        at: At,
        interpolations: &[Interpolation],
    ) -> Result<&mut Self, String> {
        for &interpolation in interpolations {
            let query = with_intervals(self.track(track)?, query(track, at, interpolation));
            let query = query.map_err(|near| format!("{}: at {:?}: {near}", self.name, at.x))?;
            self.queries.push(query);
        }
        Ok(self)
    }

    /// Queries at places with each of the normals.
    fn facing(
        &mut self,
        places: &[[f64; 3]],
        interpolations: &[Interpolation],
    ) -> Result<&mut Self, String> {
        for &x in places {
            for n in NORMALS {
                let v = [n[0] + 1, n[1] + 1, n[2] - 1];
                self.query(1, At { x, n, v, ..FLOOR }, interpolations)?;
            }
        }
        Ok(self)
    }

    /// Queries `count` times at drawn places in the box of the grid and about it; those that rounding
    /// could decide are drawn again.
    fn draw(
        &mut self,
        track: u32,
        seed: u64,
        count: usize,
        interpolations: &[Interpolation],
    ) -> Result<&mut Self, String> {
        let mut draw = Draw(seed);
        let expected = self.track(track)?.clone();
        let volume = expected.entry.volume();
        let volume = volume.ok_or_else(|| format!("{}: no volume", self.name))?;
        let (mut found, mut tries) = (0, 0);
        while found < count {
            tries += 1;
            if tries > 10_000 {
                return Err(format!("{}: no place for a query", self.name));
            }
            let x = [0, 1, 2].map(|axis| {
                let spaces = f64::from(volume.dims[axis]) - 1.0;
                let at = 0.5 * spaces + (0.5 * spaces + 0.2) * draw.signed();
                at * f64::from(volume.spacing[axis])
            });
            let n = [0; 3].map(|_| (1000.0 * draw.signed()) as i32);
            let v = n.map(|c| c + (900.0 * draw.signed()) as i32);
            let roughness = draw.signed().abs();
            let at = At { x, n, v, roughness };
            let interpolation = interpolations[found % interpolations.len()];
            if let Ok(query) = with_intervals(&expected, query(track, at, interpolation)) {
                self.queries.push(query);
                found += 1;
            }
        }
        Ok(self)
    }

    fn finish(&mut self, drafts: &mut Vec<Draft>, clauses: &[&'static str], comment: &str) {
        let queries = self.queries.drain(..).map(Query::Probes).collect();
        let (name, bytes) = (self.name, self.frames.ended());
        let draft = Draft::query("probes", name, clauses, comment, bytes, queries);
        drafts.push(draft.shows(&self.frames.shown));
    }
}

fn query(track: u32, at: At, interpolation: Interpolation) -> ProbesQuery {
    ProbesQuery {
        track,
        position: at.x.map(|v| (v * 65536.0).round() as i32),
        normal: at.n,
        view: at.v,
        roughness: (at.roughness * 65536.0).round() as u32,
        interpolation,
        irradiance: [[0; 2]; 3],
        radiance: [[0; 2]; 3],
    }
}
