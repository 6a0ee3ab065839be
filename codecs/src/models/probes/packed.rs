//! The syntax of `packed` probes, `spec/probes.md` §6: one walk for reader and writer.

use super::contexts;
use super::values::{MOST_LOG, MOST_RELATIVE, Scales};
use super::{CODES, GROUPS, Probe, Volume, codes_below};
use crate::entropy::Coder;
use crate::error::ErrorKind;
use crate::memory::index_set::IndexSet;

/// What is remembered of a probe for those after it: bits 0 to 26 which codes have a residual, bits
/// 32 to 58 which of those are negative.
pub(super) type Mark = u64;
/// The probe is one of those that are coded.
const CHANGED: Mark = 1 << 31;
const SIGNS: u32 = 32;
/// Bits of a magnitude, at most.
const LONGEST: usize = 16;

/// What a walk over the probes of a volume reads and writes.
pub(super) struct Walk<'a> {
    /// At first what the probes change from, afterwards what they come to.
    pub(super) probes: &'a mut [Probe],
    /// Which of them are present at first; none of them without a set.
    pub(super) present: Option<&'a IndexSet>,
    /// One for each probe, of those that change; 0 at first.
    pub(super) marks: &'a mut [Mark],
    /// Gets the probes that change; empty at first.
    pub(super) changed: &'a mut IndexSet,
}

/// Codes probes in the order of their indices. `wanted` is what a writer wants, and nothing for a
/// reader. Returns how many changed.
///
/// A reader takes runs of probes that do not change in one step, so that its work grows with the
/// bytes and with the probes that change.
pub(super) fn code<C: Coder>(
    coder: &mut C,
    volume: &Volume,
    scales: &Scales,
    wanted: Option<&[Probe]>,
    walk: &mut Walk<'_>,
) -> Result<u32, ErrorKind> {
    let dims = volume.dims.map(usize::from);
    let strides = [1, dims[0], dims[0] * dims[1]];
    let mut changed_probes = 0;
    let mut place = [0; 3];
    let mut at = 0;
    while at < walk.probes.len() {
        let before = |axis: usize| (place[axis] > 0).then(|| at - strides[axis]);
        let marks = [0, 1, 2].map(|axis| before(axis).map_or(0, |near| walk.marks[near]));
        let base = walk.probes[at];
        let intra = base.level == 0;
        let context = contexts::changed(intra, count(marks, CHANGED));
        if count(marks, CHANGED) == 0 && coder.is_sure(context) {
            let most = walk.quiet(at, strides, coder.is_sure(contexts::changed(!intra, 0)));
            let run = coder.zeros(most);
            if run > 0 {
                at += run;
                place = place_of(at, dims);
                continue;
            }
        }
        let wanted = wanted.map_or(&Probe::ABSENT, |wanted| &wanted[at]);
        if coder.bit(context, *wanted != base) {
            let (done, rest) = walk.probes.split_at_mut(at);
            let neighbours = Neighbours {
                probes: [0, 1, 2].map(|axis| before(axis).map(|near| &done[near])),
                marks,
            };
            walk.changed.insert(at);
            let probe = &mut rest[0];
            walk.marks[at] = code_probe(coder, scales, &neighbours, &base, wanted, probe)?;
            changed_probes += 1;
        }
        at += 1;
        place[0] += 1;
        for axis in 0..2 {
            if place[axis] == dims[axis] {
                place[axis] = 0;
                place[axis + 1] += 1;
            }
        }
    }
    Ok(changed_probes)
}

impl Walk<'_> {
    /// How many probes from `at` on have no neighbour that changed so far and, unless both kinds
    /// are alike, are present as the first one is, or absent.
    fn quiet(&self, at: usize, strides: [usize; 3], alike: bool) -> usize {
        let mut end = quiet_end(self.changed, at, strides, self.probes.len());
        if let Some(present) = self.present.filter(|_| !alike) {
            end = match self.probes[at].level {
                0 => present.next(at).map_or(end, |other| end.min(other)),
                _ => end.min(present.next_missing(at)),
            };
        }
        end - at
    }
}

/// The first probe after `at` that has a neighbour of those in `changed`; `end` where none has.
pub(super) fn quiet_end(changed: &IndexSet, at: usize, strides: [usize; 3], end: usize) -> usize {
    let near = strides.map(|stride| Some((changed.next(at.saturating_sub(stride))?, stride)));
    let near = near.into_iter().flatten();
    near.fold(end, |end, (near, stride)| {
        end.min((near + stride).max(at + 1))
    })
}

/// Where the probe of an index stands.
pub(super) fn place_of(index: usize, dims: [usize; 3]) -> [usize; 3] {
    let [x, y, _] = dims;
    [index % x, index / x % y, index / (x * y)]
}

/// How many marks have one of these bits.
#[inline(always)]
fn count(marks: [Mark; 3], bits: Mark) -> usize {
    let marks = marks.map(|mark| usize::from(mark & bits != 0));
    marks[0] + marks[1] + marks[2]
}

/// The neighbours that come before a probe, one step back along each axis.
struct Neighbours<'a> {
    probes: [Option<&'a Probe>; 3],
    marks: [Mark; 3],
}

impl Neighbours<'_> {
    /// How many have one of these bits.
    #[inline(always)]
    fn count(&self, bits: Mark) -> usize {
        count(self.marks, bits)
    }

    /// Positive residuals of a code less the negative ones.
    #[inline(always)]
    fn sign(&self, code: usize) -> i32 {
        let signs = self.marks.map(|mark| {
            let some = (mark >> code & 1) as i32;
            some - 2 * (mark >> (SIGNS + code as u32) & 1) as i32
        });
        signs[0] + signs[1] + signs[2]
    }

    /// The mean of a code over those that have its degree, rounded down; 0 where none has.
    #[inline(always)]
    fn mean(&self, degree: usize, code: usize) -> i32 {
        let (mut sum, mut count) = (0, 0);
        for probe in self.probes.into_iter().flatten() {
            if usize::from(probe.level) > degree {
                sum += i32::from(probe.codes[code]);
                count += 1;
            }
        }
        match count {
            0 => 0,
            2 => sum >> 1,
            3 => sum.div_euclid(3),
            _ => sum,
        }
    }
}

/// A probe that changes. Returns its mark.
#[inline(always)]
fn code_probe<C: Coder>(
    coder: &mut C,
    scales: &Scales,
    neighbours: &Neighbours<'_>,
    base: &Probe,
    wanted: &Probe,
    probe: &mut Probe,
) -> Result<Mark, ErrorKind> {
    let level = code_level(coder, base.level, wanted.level);
    probe.level = level;
    if level < base.level {
        probe.codes[codes_below(level)..].fill(0);
    }
    let mut mark = CHANGED;
    let mut before = false;
    for (index, group) in GROUPS[..2 * usize::from(level)].iter().enumerate() {
        let intra = usize::from(base.level) <= group.degree;
        if intra {
            for code in group.start..group.end {
                // A mean of codes in range.
                probe.codes[code] = neighbours.mean(group.degree, code) as i16;
            }
        }
        let codes = group.start..group.end;
        let bits = ((1 << group.end) - (1 << group.start)) as Mark;
        let wanted_any = wanted.codes[codes.clone()] != probe.codes[codes.clone()];
        let context = contexts::band_significant(intra, index, neighbours.count(bits), before);
        before = coder.bit(context, wanted_any);
        if !before {
            continue;
        }
        let last = group.end - 1;
        for code in codes {
            let predicted = i32::from(probe.codes[code]);
            let residual = i32::from(wanted.codes[code]) - predicted;
            // The last one has a residual for sure where none before has.
            let sure = code == last && mark & bits == 0;
            let context = contexts::code_significant(intra, index, neighbours.count(1 << code));
            if !(sure || coder.bit(context, residual != 0)) {
                continue;
            }
            let sign = neighbours.sign(code);
            let context = contexts::sign(intra, index, sign.unsigned_abs().min(2) as usize);
            let against = coder.bit(context, (residual < 0) != (sign < 0));
            let negative = against != (sign < 0);
            let magnitude = code_magnitude(coder, intra, index, residual.unsigned_abs());
            let value = match negative {
                true => predicted - magnitude as i32,
                false => predicted + magnitude as i32,
            };
            check_code(scales, index, value)?;
            probe.codes[code] = value as i16;
            mark |= 1 << code | Mark::from(negative) << (SIGNS + code as u32);
        }
    }
    Ok(mark)
}

/// A level that is not that of an absent base, or may be that of a present one.
#[inline(always)]
fn code_level<C: Coder>(coder: &mut C, base: u8, wanted: u8) -> u8 {
    if base > 0 && !coder.bit(contexts::level_changed(), wanted != base) {
        return base;
    }
    // The three other levels, from the highest.
    let others = match base {
        0 => [3, 2, 1],
        1 => [3, 2, 0],
        2 => [3, 1, 0],
        _ => [2, 1, 0],
    };
    if !coder.bit(contexts::level(base, false), wanted != others[0]) {
        return others[0];
    }
    if !coder.bit(contexts::level(base, true), wanted != others[1]) {
        return others[1];
    }
    others[2]
}

/// A magnitude of 1 or more.
#[inline(always)]
fn code_magnitude<C: Coder>(coder: &mut C, intra: bool, group: usize, wanted: u32) -> u32 {
    let prefix = |length| contexts::prefix(intra, group, length);
    coder.exp_golomb(
        LONGEST - 1,
        prefix,
        |_| contexts::suffix(intra, group),
        wanted,
    )
}

/// A code in its range.
#[inline(always)]
fn check_code(scales: &Scales, group: usize, code: i32) -> Result<(), ErrorKind> {
    // Codes are within 2^16, or a sum of two such, and steps too.
    let scaled = i64::from(code) * i64::from(scales.0[group]);
    let fits = match group {
        0 => (0..=i64::from(MOST_LOG)).contains(&scaled),
        _ => scaled.unsigned_abs() <= MOST_RELATIVE as u64,
    };
    // A step of 1 allows for one code more than 16 bits have.
    if fits && i16::try_from(code).is_ok() {
        Ok(())
    } else {
        Err(ErrorKind::ProbeCode)
    }
}

/// A probe that an encoder may write.
pub(super) fn check_probe(scales: &Scales, probe: &Probe) -> Result<(), ErrorKind> {
    let used = codes_below(probe.level);
    if probe.level > 3 || probe.codes[used..] != [0; CODES][used..] {
        return Err(ErrorKind::EncoderUse);
    }
    for (index, group) in GROUPS.iter().enumerate() {
        for &code in &probe.codes[group.start..group.end] {
            check_code(scales, index, code.into())?;
        }
    }
    Ok(())
}
