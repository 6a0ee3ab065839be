//! The syntax of visibility maps in `packed` tracks, `spec/probes.md` §9.2: one walk for reader and writer.

use super::map_contexts::{self, CLASSES, LONGEST, SPREADS};
use super::packed::{place_of, quiet_end};
use super::{MapTexel, OPEN, Volume};
use crate::entropy::Coder;
use crate::error::ErrorKind;
use crate::memory::index_set::IndexSet;

/// Texels of the largest map.
const MOST_TEXELS: usize = 256;
/// Predictions of a code: the same texel of three neighbours' maps, texels before it in its own map,
/// and the same texel of the prior.
const CANDIDATES: usize = 5;
/// Which of those is that from its own map.
const OWN: usize = 3;

/// What a walk over the maps of a volume reads and writes.
pub(super) struct Walk<'a> {
    /// At first the priors, afterwards the maps: n² texels a probe.
    pub(super) maps: &'a mut [MapTexel],
    /// Whether the priors are open, not maps of the last frame.
    pub(super) intra: bool,
    /// Gets the probes whose maps change; empty at first.
    pub(super) changed: &'a mut IndexSet,
}

/// Codes the maps of a volume in the order of their probes. `wanted` is what a writer wants, and
/// nothing for a reader. Returns how many maps change. Runs of maps that do not are taken in one step.
pub(super) fn code<C: Coder>(
    coder: &mut C,
    volume: &Volume,
    wanted: Option<&[MapTexel]>,
    walk: &mut Walk<'_>,
) -> Result<u32, ErrorKind> {
    let side = usize::from(volume.visibility.side);
    let texels = side * side;
    let planes = volume.visibility.steps.map(Plane::new);
    let dims = volume.dims.map(usize::from);
    let strides = [1, dims[0], dims[0] * dims[1]];
    let count = volume.count();
    let mut changed_maps = 0;
    let mut at = 0;
    while at < count {
        let place = place_of(at, dims);
        let near = [0, 1, 2].map(|axis| (place[axis] > 0).then(|| at - strides[axis]));
        let near_changed = near.iter().flatten();
        let near_changed = near_changed.filter(|&&near| walk.changed.contains(near));
        let context = map_contexts::changed(walk.intra, near_changed.count());
        if coder.is_sure(context) {
            let quiet = quiet_end(walk.changed, at, strides, count) - at;
            let run = coder.zeros(quiet);
            if run > 0 {
                at += run;
                continue;
            }
        }
        let (done, rest) = walk.maps.split_at_mut(at * texels);
        let map = &mut rest[..texels];
        let wanted = wanted.map(|wanted| &wanted[at * texels..][..texels]);
        if coder.bit(context, wanted.is_some_and(|wanted| wanted != map)) {
            walk.changed.insert(at);
            changed_maps += 1;
            let near = near.map(|near| near.map(|near| &done[near * texels..][..texels]));
            code_map(coder, &planes, (side, near), wanted, map)?;
        }
        at += 1;
    }
    Ok(changed_maps)
}

/// A map that changes.
fn code_map<C: Coder>(
    coder: &mut C,
    planes: &[Plane; 2],
    (side, near): (usize, [Option<&[MapTexel]>; 3]),
    wanted: Option<&[MapTexel]>,
    map: &mut [MapTexel],
) -> Result<(), ErrorKind> {
    let wanted_deviates = wanted.is_some_and(|map| map.iter().any(|texel| texel[1] != 0));
    let deviates = coder.bit(map_contexts::deviates(), wanted_deviates);
    let mut histories = [History::new(side), History::new(side)];
    for at in 0..map.len() {
        let wanted = wanted.map_or(OPEN, |wanted| wanted[at]);
        let mut mean_residual = None;
        for (plane, history) in histories.iter_mut().enumerate() {
            if plane == 1 && !deviates {
                map[at][1] = 0;
                break;
            }
            let code_of = |texel: MapTexel| planes[plane].codes[usize::from(texel[plane])];
            let near = near.map(|near| near.map(|near| code_of(near[at])));
            let candidates = history.candidates(at, near, code_of(map[at]));
            let spread = mean_residual.unwrap_or_else(|| candidates.spread());
            let code = code_code(
                coder,
                (plane, planes[plane].largest),
                (&candidates, history.beside(at), spread),
                code_of(wanted).into(),
            )?;
            history.add(at, &candidates, code);
            mean_residual = Some(candidates.residual(code));
            map[at][plane] = planes[plane].byte(code);
        }
    }
    Ok(())
}

/// A code: its residual from the best candidate.
fn code_code<C: Coder>(
    coder: &mut C,
    (plane, largest): (usize, i32),
    (candidates, beside, spread): (&Candidates, usize, u32),
    wanted: i32,
) -> Result<i32, ErrorKind> {
    let Candidates {
        predicted, class, ..
    } = *candidates;
    let spread = (length(spread).div_ceil(2)).min(SPREADS - 1);
    let residual = wanted - predicted;
    let context = map_contexts::significant(plane, class, beside, spread);
    if !coder.bit(context, residual != 0) {
        return Ok(predicted);
    }
    let negative = if predicted == 0 {
        false
    } else if predicted == largest {
        true
    } else {
        let own = candidates.codes[OWN].unwrap_or(predicted);
        let side = (own - predicted).signum() + 1;
        coder.bit(
            map_contexts::sign(plane, class, side as usize),
            residual < 0,
        )
    };
    let magnitude = code_magnitude(coder, (plane, class), residual.unsigned_abs().max(1));
    let code = match negative {
        true => predicted - magnitude as i32,
        false => predicted + magnitude as i32,
    };
    match (0..=largest).contains(&code) {
        true => Ok(code),
        false => Err(ErrorKind::ProbeCode),
    }
}

/// A magnitude from 1 to 255.
fn code_magnitude<C: Coder>(coder: &mut C, (plane, class): (usize, usize), wanted: u32) -> u32 {
    let prefix = |length| map_contexts::prefix(plane, class, length);
    let suffix = |length| map_contexts::suffix(plane, length);
    coder.exp_golomb(LONGEST, prefix, suffix, wanted)
}

/// Whether an encoder may write these maps: their bytes are those of codes.
pub(super) fn check(volume: &Volume, maps: &[MapTexel]) -> Result<(), ErrorKind> {
    let planes = volume.visibility.steps.map(Plane::new);
    let fits = |texel: &MapTexel| planes[0].has(texel[0]) && planes[1].has(texel[1]);
    match maps.iter().all(fits) {
        true => Ok(()),
        false => Err(ErrorKind::EncoderUse),
    }
}

/// Bits of a number.
fn length(number: u32) -> usize {
    (u32::BITS - number.leading_zeros()) as usize
}

/// The bytes of means or of deviations as codes, and back: a code is worth its multiple of the step, and
/// the largest one 255.
pub(super) struct Plane {
    step: i32,
    largest: i32,
    /// By byte; of one that is no code's, that of the code above.
    codes: [u8; 256],
}

impl Plane {
    pub(super) fn new(step: u8) -> Plane {
        let step = step.max(1);
        Plane {
            step: step.into(),
            largest: u8::MAX.div_ceil(step).into(),
            codes: core::array::from_fn(|byte| (byte as u8).div_ceil(step)),
        }
    }

    fn byte(&self, code: i32) -> u8 {
        (code * self.step).min(255) as u8
    }

    /// Whether a byte is that of a code.
    pub(super) fn has(&self, byte: u8) -> bool {
        self.byte(self.codes[usize::from(byte)].into()) == byte
    }

    /// The nearest byte that a code has, the lower of two.
    pub(super) fn nearest(&self, byte: u8) -> u8 {
        let code = i32::from(self.codes[usize::from(byte)]);
        let (below, above) = (self.byte((code - 1).max(0)), self.byte(code));
        if byte.abs_diff(below) <= byte.abs_diff(above) {
            below
        } else {
            above
        }
    }
}

/// The candidates of a code, and the best of them.
struct Candidates {
    codes: [Option<i32>; CANDIDATES],
    predicted: i32,
    /// Class of the error that the best had nearby.
    class: usize,
}

impl Candidates {
    /// How far neighbours' maps are from the prediction, at most.
    fn spread(&self) -> u32 {
        let near = self.codes[..OWN].iter().flatten();
        let far = near.map(|&code| (code - self.predicted).unsigned_abs());
        far.max().unwrap_or(0)
    }

    fn residual(&self, code: i32) -> u32 {
        (code - self.predicted).unsigned_abs()
    }
}

/// What is remembered of the texels of a map so far, in one plane.
struct History {
    side: usize,
    codes: [i32; MOST_TEXELS],
    /// Errors of the candidates; 0 for those that are not there.
    errors: [[u8; CANDIDATES]; MOST_TEXELS],
    significant: [bool; MOST_TEXELS],
}

impl History {
    fn new(side: usize) -> History {
        History {
            side,
            codes: [0; MOST_TEXELS],
            errors: [[0; CANDIDATES]; MOST_TEXELS],
            significant: [false; MOST_TEXELS],
        }
    }

    /// Texels before one: left, above, above left, above right.
    fn before(&self, at: usize) -> [Option<usize>; 4] {
        let (side, column) = (self.side, at % self.side);
        let (first, last) = (column == 0, column + 1 == side);
        let above = at.checked_sub(side);
        [
            (!first).then(|| at - 1),
            above,
            above.filter(|_| !first).map(|above| above - 1),
            above.filter(|_| !last).map(|above| above + 1),
        ]
    }

    /// How many of the texels left and above have a residual.
    fn beside(&self, at: usize) -> usize {
        let [left, above, ..] = self.before(at);
        let some = [left, above].into_iter().flatten();
        some.filter(|&at| self.significant[at]).count()
    }

    fn candidates(&self, at: usize, near: [Option<u8>; 3], prior: u8) -> Candidates {
        let before = self.before(at);
        let prior = i32::from(prior);
        let [x, y, z] = near.map(|code| code.map(i32::from));
        let own = self.own(before).unwrap_or(prior);
        let codes = [x, y, z, Some(own), Some(prior)];
        let mut best = (u32::MAX, prior);
        for (which, code) in codes.iter().enumerate() {
            if let &Some(code) = code {
                let error = self.local_error(before, which);
                if error < best.0 {
                    best = (error, code);
                }
            }
        }
        Candidates {
            codes,
            predicted: best.1,
            class: length(best.0).min(CLASSES - 1),
        }
    }

    /// The median of left, above, and their sum less what is above left.
    fn own(&self, [left, above, corner, _]: [Option<usize>; 4]) -> Option<i32> {
        let code = |at: Option<usize>| at.map(|at| self.codes[at]);
        match (code(left), code(above), code(corner)) {
            (Some(left), Some(above), Some(corner)) => {
                Some((left + above - corner).clamp(left.min(above), left.max(above)))
            }
            (left, above, _) => left.or(above),
        }
    }

    /// Error of a candidate at the texels before, those left and above twice.
    fn local_error(&self, before: [Option<usize>; 4], which: usize) -> u32 {
        let errors = before.map(|at| at.map_or(0, |at| self.errors[at][which].into()));
        2 * (errors[0] + errors[1]) + errors[2] + errors[3]
    }

    fn add(&mut self, at: usize, candidates: &Candidates, code: i32) {
        self.codes[at] = code;
        self.significant[at] = code != candidates.predicted;
        for (error, candidate) in self.errors[at].iter_mut().zip(candidates.codes) {
            *error = candidate.map_or(0, |candidate| candidate.abs_diff(code) as u8);
        }
    }
}
