//! The syntax of `packed` entries, `spec/instances.md` §6: one walk for reader and writer.
//!
//! Keys are hashes, so entries that are neighbours in their order have nothing to do with each
//! other: a code is predicted by the mean of those before it, which on made-up tables of 4 to 500
//! entries took 3 to 7 % fewer bits than the code before it.

use super::state::Entries;
use super::{COEFFICIENTS, Entry, Form, Table};
use crate::entropy::{Coder, Context};
use crate::error::ErrorKind;

/// The quotient of a difference of keys goes on.
const KEY: usize = 0;
/// The entry is linear: by the form of the one before.
const FORM: usize = KEY + 1;
/// A code has a residual: by signal, and whether it is of the constant. So are all that follow.
const SIGNIFICANT: usize = FORM + 2;
/// The residual is negative.
const SIGN: usize = SIGNIFICANT + GROUPS;
/// A bit of the Exp-Golomb prefix of the magnitude: by how many came before, too.
const PREFIX: usize = SIGN + GROUPS;
/// The first bit of the Exp-Golomb suffix.
const SUFFIX: usize = PREFIX + GROUPS * LENGTHS;
const CONTEXTS: usize = SUFFIX + GROUPS;

/// Two kinds of coefficients of two signals.
const GROUPS: usize = 4;
/// Lengths of a magnitude that are told apart.
const LENGTHS: usize = 8;
/// Bits of a magnitude, at most.
const LONGEST: usize = 16;

/// What the constant is expected to be before there is any: 3/4, in 1/32767.
const FIRST_CONSTANT: i32 = 24575;

/// Probabilities of a 0, in 1/256.
const INITIAL: [u8; CONTEXTS] = [
    140, 180, 40, 8, 11, 8, 11, 128, 128, 128, 128, 8, 16, 33, 63, 123, 196, 240, 240, 21, 43, 84,
    142, 215, 248, 240, 240, 8, 16, 33, 63, 123, 196, 240, 240, 21, 43, 84, 142, 215, 248, 240,
    240, 152, 152, 152, 152,
];

/// All contexts with their initial probabilities.
pub(super) fn contexts() -> [Context; CONTEXTS] {
    INITIAL.map(Context::new)
}

#[cfg(all(test, feature = "std"))]
pub(super) fn initial_table() -> &'static [u8] {
    &INITIAL
}

/// The codes of a coefficient so far.
#[derive(Clone, Copy)]
struct Mean {
    sum: i64,
    count: i64,
}

impl Mean {
    /// Rounded down.
    fn get(self) -> i32 {
        self.sum.div_euclid(self.count) as i32
    }

    fn add(&mut self, code: i32) {
        self.sum += i64::from(code);
        self.count += 1;
    }
}

/// The bits of a key's quotient, which is below two to them, and those below it.
fn key_bits(table: &Table) -> (u32, u32) {
    let quotient_bits = table.count.next_power_of_two().trailing_zeros();
    (quotient_bits, 64 - quotient_bits)
}

/// A section of this many bytes may hold all entries: the lower bits of their keys are as many bits
/// there. So the work of a section is bounded by its bytes.
pub(super) fn check_size(table: &Table, bytes: usize) -> Result<(), ErrorKind> {
    let bits = u64::from(table.count) * u64::from(key_bits(table).1);
    match 8 * (bytes as u64 + 1) >= bits {
        true => Ok(()),
        false => Err(ErrorKind::InstancesEntropy),
    }
}

/// Codes all entries of a table. `wanted` is what a writer wants, and nothing for a reader.
pub(super) fn code<C: Coder>(
    coder: &mut C,
    table: &Table,
    wanted: Option<&[Entry]>,
    entries: &mut Entries,
) -> Result<(), ErrorKind> {
    let expected = FIRST_CONSTANT / (i32::from(table.step) << table.exponent);
    let first = |code: i32| Mean {
        sum: code.into(),
        count: 1,
    };
    let mut means = [[first(expected), first(0), first(0), first(0)]; 2];
    let (quotient_bits, low_bits) = key_bits(table);
    let quotients = 1 << quotient_bits;
    let mut least = Some(0);
    let mut form = Form::Scalar;
    for index in 0..table.count as usize {
        let wanted = wanted.map(|wanted| &wanted[index]);
        let from = least.ok_or(ErrorKind::InstanceKey)?;
        let difference = wanted.map_or(0, |wanted| wanted.key - from);
        let difference = code_difference(coder, quotients, low_bits, difference)?;
        let key = from.checked_add(difference).ok_or(ErrorKind::InstanceKey)?;
        least = key.checked_add(1);
        entries.start(key)?;
        let linear = wanted.is_some_and(|wanted| wanted.form == Form::Linear);
        form = match coder.bit(FORM + usize::from(form == Form::Linear), linear) {
            true => Form::Linear,
            false => Form::Scalar,
        };
        for (signal, means) in means[..table.signals()].iter_mut().enumerate() {
            let wanted = wanted.map_or([0; COEFFICIENTS], |wanted| wanted.codes[signal]);
            let mut codes = [0; COEFFICIENTS];
            for (at, code) in codes[..form.coefficients()].iter_mut().enumerate() {
                let predicted = means[at].get();
                let residual = i32::from(wanted[at]) - predicted;
                let group = 2 * signal + usize::from(at > 0);
                *code = predicted + code_residual(coder, group, residual);
                means[at].add(*code);
                table.check_code(*code)?;
            }
            entries.signal(table, codes)?;
        }
    }
    Ok(())
}

/// A difference of keys: a Golomb-Rice code, whose parameter suits keys that are hashes. The
/// quotients of all keys together are fewer than those of a key may be, `quotients`.
fn code_difference<C: Coder>(
    coder: &mut C,
    quotients: u32,
    low_bits: u32,
    wanted: u64,
) -> Result<u64, ErrorKind> {
    let wanted_quotient = wanted.checked_shr(low_bits).unwrap_or(0);
    let mut quotient = 0;
    while coder.bit(KEY, quotient < wanted_quotient) {
        quotient += 1;
        if quotient == u64::from(quotients) {
            return Err(ErrorKind::InstanceKey);
        }
    }
    let mut difference = quotient;
    for below in (0..low_bits).rev() {
        let bit = coder.bypass_bit(wanted >> below & 1 == 1);
        difference = difference << 1 | u64::from(bit);
    }
    Ok(difference)
}

/// A residual: whether it is other than 0, its sign, and an Exp-Golomb code of its magnitude.
fn code_residual<C: Coder>(coder: &mut C, group: usize, wanted: i32) -> i32 {
    if !coder.bit(SIGNIFICANT + group, wanted != 0) {
        return 0;
    }
    let negative = coder.bit(SIGN + group, wanted < 0);
    let prefix = |length: usize| PREFIX + group * LENGTHS + length.min(LENGTHS - 1);
    let suffix = |_| SUFFIX + group;
    let magnitude = coder.exp_golomb(LONGEST - 1, prefix, suffix, wanted.unsigned_abs()) as i32;
    if negative { -magnitude } else { magnitude }
}
