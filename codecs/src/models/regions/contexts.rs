//! The contexts of bits in `packed` regions: `spec/regions.md` §7.

use crate::entropy::Context;

/// Whether the form is not that of the region before.
pub(super) const OTHER: usize = 0;
/// Which derivatives: not none; not a gradient.
pub(super) const DERIVATIVES: usize = OTHER + 1;
/// Which degree: not 0; not 1.
pub(super) const DEGREE: usize = DERIVATIVES + 2;
/// Whether there are two signals.
pub(super) const SIGNALS: usize = DEGREE + 2;
/// Whether a code is significant (has a residual): by group, and by the digits of the last residual there.
const SIGNIFICANT: usize = SIGNALS + 1;
/// Whether a residual is negative: by row and polynomial.
const SIGN: usize = SIGNIFICANT + GROUPS * 4;
/// A bit of the Exp-Golomb prefix of the magnitude: by group, and by how many came before.
const PREFIX: usize = SIGN + ROWS * POLYNOMIALS;
/// The first bit of the Exp-Golomb suffix: by group.
const SUFFIX: usize = PREFIX + GROUPS * LONGEST;
/// Number of contexts.
pub(super) const CONTEXTS: usize = SUFFIX + GROUPS;

/// Rows: the mean, three of a gradient, six sided.
pub(super) const ROWS: usize = 10;
pub(super) const POLYNOMIALS: usize = 9;
/// Bits of an Exp-Golomb prefix, at most.
pub(super) const LONGEST: usize = 15;
/// Signals, classes of rows, degrees.
const GROUPS: usize = 2 * 3 * 3;

/// The group of a code.
#[inline(always)]
pub(super) fn group(signal: usize, class: usize, polynomial: usize) -> usize {
    const DEGREES: [usize; POLYNOMIALS] = [0, 1, 1, 1, 2, 2, 2, 2, 2];
    (3 * signal + class) * 3 + DEGREES[polynomial]
}

/// By the magnitude of the last residual of the same coefficient.
#[inline(always)]
pub(super) fn significant(group: usize, last: u16) -> usize {
    let digits = u16::BITS - last.leading_zeros();
    SIGNIFICANT + 4 * group + digits.min(3) as usize
}

#[inline(always)]
pub(super) fn sign(row: usize, polynomial: usize) -> usize {
    SIGN + row * POLYNOMIALS + polynomial
}

#[inline(always)]
pub(super) fn prefix(group: usize, length: usize) -> usize {
    PREFIX + group * LONGEST + length
}

#[inline(always)]
pub(super) fn suffix(group: usize) -> usize {
    SUFFIX + group
}

/// All contexts, none of which knows anything.
pub(super) fn initial() -> [Context; CONTEXTS] {
    [Context::new(128); CONTEXTS]
}
