//! The bits of visibility maps in packed volumes, from `spec/probes.md` §9.2 alone.

use super::range::Bit;
use super::writer::Volume;

/// Numbers of the contexts (§6.4).
pub mod context {
    pub fn changed(intra: bool, near: usize) -> usize {
        257 + 4 * usize::from(intra) + near
    }
    pub const DEVIATES: usize = 265;
    pub fn significant(plane: usize, class: usize, beside: usize, spread: usize) -> usize {
        266 + 96 * plane + 12 * class + 4 * beside + spread
    }
    pub fn sign(plane: usize, class: usize, side: usize) -> usize {
        458 + 24 * plane + 3 * class + side
    }
    pub fn prefix(plane: usize, class: usize, e: usize) -> usize {
        506 + 56 * plane + 7 * class + e
    }
    pub fn suffix(plane: usize, e: usize) -> usize {
        618 + 7 * plane + e - 1
    }
}

/// What a writer may choose beside the maps themselves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choices {
    /// Maps that are written as changing though they may not.
    pub touched: Vec<usize>,
    /// Maps without deviations that are written as having some.
    pub deviating: Vec<usize>,
    /// A residual in place of the right one: probe, texel, plane, residual. The bits end behind it.
    pub wrong: Option<(usize, usize, usize, i32)>,
}

/// The map code of a byte.
pub fn code_of(byte: u8, step: u8) -> i32 {
    i32::from(byte.div_ceil(step))
}

/// The byte of a map code.
pub fn byte_of(code: i32, step: u8) -> u8 {
    (code * i32::from(step)).min(255) as u8
}

/// The bits of the maps of a block that change from `base`, or from open maps.
pub fn bits(volume: &Volume, base: Option<&[u8]>, block: &[u8], choices: &Choices) -> Vec<Bit> {
    let size = block.len() / volume.count();
    let open = [255, 0].repeat(block.len() / 2);
    let priors = base.unwrap_or(&open);
    let [dx, dy, _] = volume.dims.map(usize::from);
    let mut bits = Vec::new();
    let mut changed = vec![false; volume.count()];
    for probe in 0..volume.count() {
        let map_of = |block: &'_ [u8]| block[probe * size..(probe + 1) * size].to_vec();
        let (map, prior) = (map_of(block), map_of(priors));
        let near = volume.next_to(probe, true);
        let near_changed = near.iter().filter(|&&near| changed[near]).count();
        changed[probe] = map != prior || choices.touched.contains(&probe);
        let context = context::changed(base.is_none(), near_changed);
        bits.push(Bit::In(context, changed[probe]));
        if !changed[probe] {
            continue;
        }
        let some = map
            .iter()
            .skip(1)
            .step_by(2)
            .any(|&deviation| deviation > 0);
        let deviates = some || choices.deviating.contains(&probe);
        bits.push(Bit::In(context::DEVIATES, deviates));
        let around = [1, dx, dx * dy].map(|stride| {
            let there = near.iter().find(|&&near| near + stride == probe);
            there.map(|near| &block[near * size..(near + 1) * size])
        });
        let mut planes = [0, 1].map(|plane| Plane::new(volume, plane, around, &prior, &map));
        for texel in 0..size / 2 {
            for plane in 0..1 + usize::from(deviates) {
                let of_mean = (plane == 1).then(|| planes[0].residuals[texel].abs());
                let wrong = choices.wrong;
                let wrong = wrong.filter(|w| (w.0, w.1, w.2) == (probe, texel, plane));
                planes[plane].code(texel, of_mean, wrong.map(|wrong| wrong.3), &mut bits);
                if wrong.is_some() {
                    return bits;
                }
            }
        }
    }
    bits
}

/// The means or the deviations of a map.
struct Plane {
    plane: usize,
    side: i32,
    largest: i32,
    around: [Option<Vec<i32>>; 3],
    prior: Vec<i32>,
    codes: Vec<i32>,
    /// By texel, of those so far.
    residuals: Vec<i32>,
    errors: Vec<[i32; 5]>,
}

impl Plane {
    fn new(
        volume: &Volume,
        plane: usize,
        around: [Option<&[u8]>; 3],
        prior: &[u8],
        map: &[u8],
    ) -> Plane {
        let step = volume.map_steps[plane];
        let codes = |map: &[u8]| -> Vec<i32> {
            let bytes = map.iter().skip(plane).step_by(2);
            bytes.map(|&byte| code_of(byte, step)).collect()
        };
        Plane {
            plane,
            side: volume.side.into(),
            largest: code_of(255, step),
            around: around.map(|map| map.map(codes)),
            prior: codes(prior),
            codes: codes(map),
            residuals: Vec::new(),
            errors: Vec::new(),
        }
    }

    /// The texel a step of (columns, rows) away, where it is in the map.
    fn beside(&self, texel: usize, (dx, dy): (i32, i32)) -> Option<usize> {
        let (x, y) = (texel as i32 % self.side + dx, texel as i32 / self.side + dy);
        let inside = (0..self.side).contains(&x) && (0..self.side).contains(&y);
        inside.then_some((y * self.side + x) as usize)
    }

    fn candidates(&self, texel: usize) -> [Option<i32>; 5] {
        let prior = self.prior[texel];
        let code = |step| self.beside(texel, step).map(|texel| self.codes[texel]);
        let own = match (code((-1, 0)), code((0, -1)), code((-1, -1))) {
            (Some(w), Some(n), Some(nw)) => {
                let mut three = [w, n, w + n - nw];
                three.sort_unstable();
                three[1]
            }
            (w, n, _) => w.or(n).unwrap_or(prior),
        };
        let near = |axis: usize| self.around[axis].as_ref().map(|codes| codes[texel]);
        [near(0), near(1), near(2), Some(own), Some(prior)]
    }

    /// Error of a candidate at the texels before.
    fn error(&self, texel: usize, which: usize) -> i32 {
        let steps = [((-1, 0), 2), ((0, -1), 2), ((-1, -1), 1), ((1, -1), 1)];
        let errors = steps.map(|(step, weight)| {
            let there = self.beside(texel, step);
            weight * there.map_or(0, |texel| self.errors[texel][which])
        });
        errors.iter().sum()
    }

    fn code(&mut self, texel: usize, of_mean: Option<i32>, wrong: Option<i32>, out: &mut Vec<Bit>) {
        let candidates = self.candidates(texel);
        let there = (0..5).filter_map(|which| Some((self.error(texel, which), candidates[which]?)));
        // The first of those that are least.
        let (error, best) = there.min_by_key(|(error, _)| *error).unwrap_or_default();
        let near = candidates[..3].iter().flatten();
        let spread = near.map(|code| (code - best).abs()).max();
        let spread = of_mean.or(spread).unwrap_or(0);
        let digits = |v: i32| (32 - v.leading_zeros()) as usize;
        let class = digits(error).min(7);
        let spread = digits(spread).div_ceil(2).min(3);
        let residual_at = |step| {
            let there = self.beside(texel, step);
            usize::from(there.is_some_and(|texel| self.residuals[texel] != 0))
        };
        let beside = residual_at((-1, 0)) + residual_at((0, -1));
        let residual = wrong.unwrap_or(self.codes[texel] - best);
        let context = context::significant(self.plane, class, beside, spread);
        out.push(Bit::In(context, residual != 0));
        if residual != 0 {
            if best > 0 && best < self.largest {
                let own = candidates[3].unwrap_or(best) - best;
                let context = context::sign(self.plane, class, (1 + own.signum()) as usize);
                out.push(Bit::In(context, residual < 0));
            }
            self.magnitude(class, residual.unsigned_abs(), out);
        }
        let code = self.codes[texel];
        let error = |candidate: Option<i32>| candidate.map_or(0, |c| (c - code).abs());
        self.residuals.push(residual);
        self.errors.push(candidates.map(error));
    }

    fn magnitude(&self, class: usize, m: u32, out: &mut Vec<Bit>) {
        let e = m.ilog2() as usize;
        for at in 0..e {
            out.push(Bit::In(context::prefix(self.plane, class, at), true));
        }
        if e < 7 {
            out.push(Bit::In(context::prefix(self.plane, class, e), false));
        }
        for at in 0..e {
            let one = m >> (e - 1 - at) & 1 == 1;
            out.push(match at {
                0 => Bit::In(context::suffix(self.plane, e), one),
                _ => Bit::Even(one),
            });
        }
    }
}
