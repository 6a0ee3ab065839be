//! The syntax of `packed` probes, `spec/probes.md` §6: one walk for reader and writer.

use super::contexts;
use super::values::{MOST_LOG, MOST_RELATIVE, Scales};
use super::{CODES, GROUPS, Probe, Volume, codes_below};
use crate::entropy::Coder;
use crate::error::Fault;

/// What is remembered of a probe for those after it: bits 0 to 26 which codes have a residual, bits
/// 32 to 58 which of those are negative.
pub(super) type Mark = u64;
/// The probe is one of those that are coded.
const CHANGED: Mark = 1 << 31;
const SIGNS: u32 = 32;
/// Bits of a magnitude, at most.
const LONGEST: usize = 16;

/// Codes probes in the order of their indices. `base` is what they change from: nothing in a
/// keyframe. `wanted` is what a writer wants, and nothing for a reader. What they come to stands in
/// `probes` afterwards. Returns how many changed.
pub(super) fn code<C: Coder>(
    coder: &mut C,
    volume: &Volume,
    scales: &Scales,
    base: Option<&[Probe]>,
    wanted: Option<&[Probe]>,
    probes: &mut [Probe],
    marks: &mut [Mark],
) -> Result<u32, Fault> {
    let [dx, dy, dz] = volume.dims.map(usize::from);
    let strides = [1, dx, dx * dy];
    let mut changed_probes = 0;
    let mut at = 0;
    for z in 0..dz {
        for y in 0..dy {
            for x in 0..dx {
                let (done, rest) = probes.split_at_mut(at);
                let (marked, unmarked) = marks.split_at_mut(at);
                let inside = [x > 0, y > 0, z > 0];
                let before = |axis: usize| inside[axis].then(|| at - strides[axis]);
                let around = Around {
                    probes: [0, 1, 2].map(|axis| before(axis).map(|near| &done[near])),
                    marks: [0, 1, 2].map(|axis| before(axis).map_or(0, |near| marked[near])),
                };
                let base = base.map_or(&Probe::ABSENT, |base| &base[at]);
                let wanted = wanted.map_or(&Probe::ABSENT, |wanted| &wanted[at]);
                let probe = &mut rest[0];
                *probe = *base;
                let fresh = base.level == 0;
                let context = contexts::changed(fresh, around.count(CHANGED));
                let changed = coder.bit(context, wanted != base);
                unmarked[0] = 0;
                if changed {
                    unmarked[0] = code_probe(coder, scales, &around, base, wanted, probe)?;
                    changed_probes += 1;
                }
                at += 1;
            }
        }
    }
    Ok(changed_probes)
}

/// The neighbours that come before a probe, one step back along each axis.
struct Around<'a> {
    probes: [Option<&'a Probe>; 3],
    marks: [Mark; 3],
}

impl Around<'_> {
    /// How many have one of these bits.
    #[inline(always)]
    fn count(&self, bits: Mark) -> usize {
        let marks = self.marks.map(|mark| usize::from(mark & bits != 0));
        marks[0] + marks[1] + marks[2]
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
    around: &Around<'_>,
    base: &Probe,
    wanted: &Probe,
    probe: &mut Probe,
) -> Result<Mark, Fault> {
    let level = code_level(coder, base.level, wanted.level);
    probe.level = level;
    if level < base.level {
        probe.codes[codes_below(level)..].fill(0);
    }
    let mut mark = CHANGED;
    let mut before = false;
    for (index, group) in GROUPS[..2 * usize::from(level)].iter().enumerate() {
        let fresh = usize::from(base.level) <= group.degree;
        if fresh {
            for code in group.start..group.end {
                // A mean of codes in range.
                probe.codes[code] = around.mean(group.degree, code) as i16;
            }
        }
        let codes = group.start..group.end;
        let bits = ((1 << group.end) - (1 << group.start)) as Mark;
        let wanted_any = wanted.codes[codes.clone()] != probe.codes[codes.clone()];
        let context = contexts::any(fresh, index, around.count(bits), before);
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
            let context = contexts::some(fresh, index, around.count(1 << code));
            if !(sure || coder.bit(context, residual != 0)) {
                continue;
            }
            let sign = around.sign(code);
            let context = contexts::against(fresh, index, sign.unsigned_abs().min(2) as usize);
            let against = coder.bit(context, (residual < 0) != (sign < 0));
            let negative = against != (sign < 0);
            let magnitude = code_magnitude(coder, fresh, index, residual.unsigned_abs());
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
    if base > 0 && !coder.bit(contexts::other_level(), wanted != base) {
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

/// A magnitude of 1 or more: its length in bits, then the bits below the highest one.
#[inline(always)]
fn code_magnitude<C: Coder>(coder: &mut C, fresh: bool, group: usize, wanted: u32) -> u32 {
    let wanted_length = wanted.max(1).ilog2() as usize;
    let mut length = 0;
    while length < LONGEST - 1
        && coder.bit(
            contexts::longer(fresh, group, length),
            length < wanted_length,
        )
    {
        length += 1;
    }
    let mut magnitude = 1;
    for below in (0..length).rev() {
        let bit = wanted >> below & 1 == 1;
        let bit = match below + 1 == length {
            true => coder.bit(contexts::second(fresh, group), bit),
            false => coder.even_bit(bit),
        };
        magnitude = magnitude << 1 | u32::from(bit);
    }
    magnitude
}

/// A code in its range.
#[inline(always)]
fn check_code(scales: &Scales, group: usize, code: i32) -> Result<(), Fault> {
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
        Err(Fault::ProbeCode)
    }
}

/// A probe that an encoder may write.
pub(super) fn check_probe(scales: &Scales, probe: &Probe) -> Result<(), Fault> {
    let used = codes_below(probe.level);
    if probe.level > 3 || probe.codes[used..] != [0; CODES][used..] {
        return Err(Fault::EncoderUse);
    }
    for (index, group) in GROUPS.iter().enumerate() {
        for &code in &probe.codes[group.start..group.end] {
            check_code(scales, index, code.into())?;
        }
    }
    Ok(())
}
