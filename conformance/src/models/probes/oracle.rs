//! What a sampler of probes must find, in f64 and from `spec/probes.md` §12 alone. A query that
//! rounding could decide is refused: its answer would move too far where the numbers in it do.

use super::values;
use crate::generate::expected::TrackContent;
use crate::models::probes::queries::Interpolation;
use crate::models::probes::queries::ProbesQuery;
use crate::models::probes::writer::Volume;
use std::f64::consts::PI;

/// Least weight of a probe behind the surface.
pub const WRAP: f64 = 0.2;
/// Lift along the normal, in smallest spacings.
pub const NORMAL_BIAS: f64 = 0.045;
/// Lift towards the viewer, in smallest spacings.
pub const VIEW_BIAS: f64 = 0.18;
/// Shares below this are crushed.
pub const CRUSH: f64 = 0.2;
/// Weight of a probe that does not see the place.
pub const UNSEEN: f64 = 1e-6;
/// Weight of an absent probe.
pub const ABSENT: f64 = 1e-12;

/// All of them, by their names in the specification.
pub const CONSTANTS: [(&str, f64); 6] = [
    ("WRAP", WRAP),
    ("NORMAL_BIAS", NORMAL_BIAS),
    ("VIEW_BIAS", VIEW_BIAS),
    ("CRUSH", CRUSH),
    ("UNSEEN", UNSEEN),
    ("ABSENT", ABSENT),
];

/// How far a sampler may be from the oracle, of the sum of magnitudes that a result is made of, beside
/// what rounding of its input moves it.
pub const TOLERANCE: f64 = 1.0 / 2048.0;
/// The most that rounding may move it, of the same.
pub const MOVED: f64 = 1.0 / 256.0;
/// How far a texture unit's coordinates may be off, in spacings.
pub const SUBTEXEL: f64 = 1.0 / 256.0;
/// Relative error of positions, moments and directions in f32, some roundings each.
const ROUNDING: f64 = 1.0 / 2097152.0;

type V = [f64; 3];
/// Nine coefficients of three channels.
type L2 = [V; 9];

fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a + b * s`.
fn plus(a: V, b: V, s: f64) -> V {
    [0, 1, 2].map(|axis| a[axis] + b[axis] * s)
}

fn unit(v: V) -> V {
    plus([0.0; 3], v, 1.0 / dot(v, v).sqrt())
}

fn sign(t: f64) -> f64 {
    if t < 0.0 { -1.0 } else { 1.0 }
}

/// A volume as a sampler sees it.
#[derive(Clone, Debug)]
pub struct Field {
    dims: [i64; 3],
    spacing: V,
    light: Vec<L2>,
    present: Vec<bool>,
    /// Side, range and texels of the visibility block.
    seen: Option<(i64, f64, Vec<[u8; 2]>)>,
}

impl Field {
    /// Of a track.
    ///
    /// # Errors
    /// A sentence where it is none of probes.
    pub fn of(content: &TrackContent) -> Result<Field, String> {
        let expected = content.probes();
        let expected =
            expected.ok_or_else(|| format!("track {} has no probes", content.entry.id))?;
        let volume = &expected.volume;
        let scale = f64::from(i32::from(volume.exponent) - 24).exp2();
        let shown = values::shown(volume, &expected.probes);
        let light = shown.iter().map(|values| {
            std::array::from_fn(|lm| [0, 1, 2].map(|c| values[3 * lm + c] as f64 * scale))
        });
        let texels = |bytes: &Vec<u8>| bytes.as_chunks::<2>().0.to_vec();
        let Volume { side, range, .. } = *volume;
        let seen = expected.visibility.as_ref().map(texels);
        Ok(Field {
            dims: volume.dims.map(i64::from),
            spacing: volume.spacing.map(f64::from),
            light: light.collect(),
            present: expected
                .probes
                .iter()
                .map(|probe| probe.level > 0)
                .collect(),
            seen: seen.map(|texels| (side.into(), range.into(), texels)),
        })
    }

    /// Index and position of a probe.
    fn probe(&self, place: [i64; 3]) -> (usize, V) {
        let [dx, dy, _] = self.dims;
        let index = place[0] + dx * (place[1] + dy * place[2]);
        let position = [0, 1, 2].map(|axis| place[axis] as f64 * self.spacing[axis]);
        (index as usize, position)
    }

    /// The corners: index, position and trilinear weight of each (B-070).
    fn corners(&self, x: V) -> [(usize, V, f64); 8] {
        let sides = [0, 1, 2].map(|axis| {
            let dim = self.dims[axis];
            let at = (x[axis] / self.spacing[axis]).clamp(0.0, (dim - 1) as f64);
            let base = (at.floor() as i64).min((dim - 2).max(0));
            let f = at - base as f64;
            [(base, 1.0 - f), ((base + 1).min(dim - 1), f)]
        });
        [0, 1, 2, 3, 4, 5, 6, 7].map(|corner: usize| {
            let sides = [0, 1, 2].map(|axis| sides[axis][corner >> axis & 1]);
            let (index, position) = self.probe(sides.map(|side| side.0));
            (index, position, sides.iter().map(|side| side.1).product())
        })
    }

    /// What a probe's word counts at `q` from it (B-073 to B-076).
    fn trust(&self, probe: usize, q: V, nudge: &Nudge) -> Result<f64, String> {
        if !self.present[probe] {
            return Ok(ABSENT);
        }
        let Some((side, range, texels)) = &self.seen else {
            return Ok(1.0);
        };
        let texels = &texels[probe * (side * side) as usize..];
        let (mean, square) = moments(*side, *range, texels, q);
        let (mean, square) = (mean * (1.0 + nudge.mean), square * (1.0 + nudge.square));
        let d = dot(q, q).sqrt();
        let code = range / 255.0;
        let nothing = range - code / 2.0;
        if d > mean * (1.0 - ROUNDING) && (mean - nothing).abs() < code / 10.0 {
            return Err(format!("a mean distance of {mean} of {range}"));
        }
        if d <= mean || mean >= nothing {
            return Ok(1.0);
        }
        Ok(share(mean, square, d, code).max(UNSEEN))
    }

    /// The light at a surface (B-071, B-072), and the same of magnitudes.
    fn light(&self, surface: &Surface, nudge: &Nudge) -> Result<[L2; 2], String> {
        let x = plus(surface.x, nudge.position, 1.0);
        let n = unit(plus(surface.n, nudge.normal, 1.0));
        let v = unit(plus(surface.v, nudge.view, 1.0));
        let least = self.spacing.into_iter().fold(f64::INFINITY, f64::min);
        let lifted = plus(plus(x, n, NORMAL_BIAS * least), v, VIEW_BIAS * least);
        let mut weights = Vec::new();
        for (probe, position, t) in self.corners(x) {
            let weight = match surface.interpolation {
                Interpolation::Trilinear => t,
                Interpolation::VisibilityWeighted => {
                    let to = plus(position, x, -1.0);
                    let distance = dot(to, to).sqrt();
                    let cosine = match distance > 0.0 {
                        true => dot(to, n) / distance,
                        false => 1.0,
                    };
                    let wrapped = ((1.0 + cosine) / 2.0).powi(2) + WRAP;
                    t * wrapped * self.trust(probe, plus(lifted, position, -1.0), nudge)?
                }
            };
            weights.push((probe, weight));
        }
        let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
        let mut sums = [[[0.0; 3]; 9]; 2];
        for (probe, weight) in weights {
            for (lm, own) in self.light[probe].iter().enumerate() {
                sums[0][lm] = plus(sums[0][lm], *own, weight / total);
                sums[1][lm] = plus(sums[1][lm], own.map(f64::abs), weight / total);
            }
        }
        Ok(sums)
    }
}

/// The share of visibility at a distance above the mean, `code` being the metres of one (B-076).
pub fn share(mean: f64, square: f64, d: f64, code: f64) -> f64 {
    let variance = (square - mean * mean).max(code * code);
    let cubed = (variance / (variance + (d - mean).powi(2))).powi(3);
    cubed * (cubed / CRUSH).min(1.0).powi(2)
}

/// Moments of the distance in a direction (B-074, B-075).
pub fn moments(side: i64, range: f64, texels: &[[u8; 2]], q: [f64; 3]) -> (f64, f64) {
    let sum = q.iter().map(|c| c.abs()).sum::<f64>();
    let p = if sum > 0.0 {
        [q[0] / sum, q[1] / sum]
    } else {
        [0.0; 2]
    };
    let [u, v] = match q[2] < 0.0 {
        true => [
            (1.0 - p[1].abs()) * sign(p[0]),
            (1.0 - p[0].abs()) * sign(p[1]),
        ],
        false => p,
    };
    let place = |t: f64| {
        let at = (t + 1.0) * side as f64 / 2.0 - 0.5;
        (at.floor() as i64, at - at.floor())
    };
    let ((column, fi), (row, fj)) = (place(u), place(v));
    let mut sums = (0.0, 0.0);
    for (i, wi) in [(column, 1.0 - fi), (column + 1, fi)] {
        for (j, wj) in [(row, 1.0 - fj), (row + 1, fj)] {
            let (mut i, mut j) = (i, j);
            if !(0..side).contains(&i) {
                (i, j) = (i.clamp(0, side - 1), side - 1 - j);
            }
            if !(0..side).contains(&j) {
                (i, j) = (side - 1 - i, j.clamp(0, side - 1));
            }
            let codes = texels[(j * side + i) as usize];
            let [m, e] = codes.map(|code| f64::from(code) * range / 255.0);
            sums.0 += wi * wj * m;
            sums.1 += wi * wj * (m * m + e * e);
        }
    }
    sums
}

/// What is lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Metres.
    pub x: V,
    /// Unit.
    pub n: V,
    /// Unit, to the viewer.
    pub v: V,
    pub roughness: f64,
    pub interpolation: Interpolation,
}

impl Surface {
    /// Of a query.
    pub fn of(query: &ProbesQuery) -> Surface {
        Surface {
            x: query.position.map(|v| f64::from(v) / 65536.0),
            n: unit(query.normal.map(f64::from)),
            v: unit(query.view.map(f64::from)),
            roughness: f64::from(query.roughness) / 65536.0,
            interpolation: query.interpolation,
        }
    }

    /// Irradiance and filtered radiance before the clamp (B-077 to B-079); with magnitudes, the sums of
    /// those.
    fn results(&self, light: &L2, magnitudes: bool) -> Result<[V; 2], String> {
        let r = self.roughness;
        let mirror = plus(self.v.map(|c| -c), self.n, 2.0 * dot(self.n, self.v));
        let a = r * r;
        let share = (1.0 - a) * ((1.0 - a).sqrt() + a);
        let h = plus(self.n, plus(mirror, self.n, -1.0), share);
        if dot(h, h) < 0.01 {
            return Err("a lobe without direction".to_string());
        }
        let sum = |factors: [f64; 3], d: V| {
            let mut sum = [0.0; 3];
            for (lm, y) in basis(d).into_iter().enumerate() {
                let y = if magnitudes { y.abs() } else { y };
                sum = plus(sum, light[lm], y * factors[lm.isqrt()]);
            }
            sum
        };
        let cosine = [PI, 2.0 * PI / 3.0, PI / 4.0];
        let lobe = [1.0, 0.8 - 2.0 * r / 15.0, 0.5 - r / 4.0];
        Ok([sum(cosine, self.n), sum(lobe, unit(h))])
    }
}

/// The functions of §2.
pub fn basis([x, y, z]: V) -> [f64; 9] {
    let [c0, c1, c2, c6, c8] =
        [1.0 / 4.0, 3.0 / 4.0, 15.0 / 4.0, 5.0 / 16.0, 15.0 / 16.0].map(|q: f64| (q / PI).sqrt());
    [
        c0,
        c1 * y,
        c1 * z,
        c1 * x,
        c2 * x * y,
        c2 * y * z,
        c6 * (3.0 * z * z - 1.0),
        c2 * x * z,
        c8 * (x * x - y * y),
    ]
}

/// What rounding may do to what a query is made of.
#[derive(Clone, Copy, Debug, Default)]
struct Nudge {
    position: V,
    normal: V,
    view: V,
    /// Of the moments, relative.
    mean: f64,
    square: f64,
}

/// What a query finds: irradiance and filtered radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Without the clamp.
    pub values: [V; 2],
    /// The least and the most of each, without the clamp.
    pub ends: [[[f64; 2]; 3]; 2],
}

/// What a surface of a track finds.
///
/// # Errors
/// A sentence that says what rounding could decide.
pub fn look_up(field: &Field, surface: &Surface) -> Result<Found, String> {
    let at = |nudge: &Nudge| surface.results(&field.light(surface, nudge)?[0], false);
    let values = at(&Nudge::default())?;
    let sizes = surface.results(&field.light(surface, &Nudge::default())?[1], true)?;
    let mut moved = [[0.0; 3]; 2];
    for nudge in nudges(field, surface) {
        for (result, other) in at(&nudge)?.iter().enumerate() {
            for channel in 0..3 {
                moved[result][channel] += (other[channel] - values[result][channel]).abs() / 2.0;
            }
        }
    }
    let (mut least, mut most) = (values, values);
    if surface.interpolation == Interpolation::Trilinear {
        for position in subtexels(field, surface.x) {
            let nudge = Nudge {
                position,
                ..Nudge::default()
            };
            for (result, other) in at(&nudge)?.iter().enumerate() {
                for channel in 0..3 {
                    least[result][channel] = least[result][channel].min(other[channel]);
                    most[result][channel] = most[result][channel].max(other[channel]);
                }
            }
        }
    }
    let mut ends = [[[0.0; 2]; 3]; 2];
    for result in 0..2 {
        for channel in 0..3 {
            let (size, moved) = (sizes[result][channel], moved[result][channel]);
            if moved > MOVED * size {
                return Err(format!("rounding moves {size} by {moved}"));
            }
            let margin = TOLERANCE * size + moved;
            ends[result][channel] = [
                least[result][channel] - margin,
                most[result][channel] + margin,
            ];
        }
    }
    Ok(Found { values, ends })
}

/// Each number up and down by as much as rounding may be off.
fn nudges(field: &Field, surface: &Surface) -> Vec<Nudge> {
    let mut nudges = Vec::new();
    for sign in [-ROUNDING, ROUNDING] {
        for axis in 0..3 {
            let far = field.dims[axis] as f64 * field.spacing[axis];
            let along = |size: f64| {
                let mut v = [0.0; 3];
                v[axis] = sign * size;
                v
            };
            let size = far.max(surface.x[axis].abs());
            let (position, turned) = (along(size), along(1.0));
            nudges.extend([
                Nudge {
                    position,
                    ..Nudge::default()
                },
                Nudge {
                    normal: turned,
                    ..Nudge::default()
                },
                Nudge {
                    view: turned,
                    ..Nudge::default()
                },
            ]);
        }
        nudges.extend([
            Nudge {
                mean: sign,
                ..Nudge::default()
            },
            Nudge {
                square: sign,
                ..Nudge::default()
            },
        ]);
    }
    nudges
}

/// Steps to where light is at its least and most as far as a texture unit may be off: it is
/// multilinear between the planes of probes.
fn subtexels(field: &Field, x: V) -> Vec<V> {
    let steps = [0, 1, 2].map(|axis| {
        let at = x[axis] / field.spacing[axis];
        let plane = (at.round() - at).clamp(-SUBTEXEL, SUBTEXEL);
        [-SUBTEXEL, plane, SUBTEXEL].map(|step| step * field.spacing[axis])
    });
    let number = |i: usize| [steps[0][i % 3], steps[1][i / 3 % 3], steps[2][i / 9]];
    (0..27).map(number).collect()
}

/// The bounds of a query's results, in 1/65536.
pub fn bounds(found: &Found) -> [[[u64; 2]; 3]; 2] {
    let steps = |[low, high]: [f64; 2]| {
        let steps = |value: f64| value.max(0.0) * 65536.0;
        [steps(low).floor() as u64, steps(high).ceil() as u64]
    };
    found.ends.map(|channels| channels.map(steps))
}

/// A query with its bounds.
///
/// # Errors
/// As [`look_up`]; also where a number is no f32, or a direction none.
pub fn with_intervals(content: &TrackContent, query: ProbesQuery) -> Result<ProbesQuery, String> {
    let mut numbers = query.position.iter();
    if let Some(v) = numbers.find(|&&v| f64::from(v as f32) != f64::from(v)) {
        return Err(format!("{v}/65536, which is no f32"));
    }
    if query.normal == [0; 3] || query.view == [0; 3] || query.roughness > 65536 {
        return Err("a direction without length, or a roughness above 1".to_string());
    }
    let found = look_up(&Field::of(content)?, &Surface::of(&query))?;
    let [irradiance, radiance] = bounds(&found);
    Ok(ProbesQuery {
        irradiance,
        radiance,
        ..query
    })
}
