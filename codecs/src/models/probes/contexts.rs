//! The contexts of bits in `packed` probes and their initial probabilities: `spec/probes.md` §6.

use super::map_contexts;
use crate::entropy::Context;

/// Whether a probe changes: with a prior or without, by how many neighbours do.
const CHANGED: usize = 0;
/// Whether its level does.
const LEVEL_CHANGED: usize = CHANGED + 2 * 4;
/// Which level it has then, by that of the prior: whether it is the highest of the three others,
/// and if not whether it is the next.
const LEVEL: usize = LEVEL_CHANGED + 1;
/// Whether a band is significant (has a residual): intra or not, by band, by how many neighbours have a
/// residual there, and whether the band before is significant.
const BAND: usize = LEVEL + 4 * 2;
/// Whether a code is significant (has a residual): intra or not, by band, by how many neighbours have one there.
const SIGNIFICANT: usize = BAND + 2 * 6 * 4 * 2;
/// Whether the sign differs from that of the neighbours: intra or not, luma or chroma, by how many
/// neighbours agree.
const SIGN: usize = SIGNIFICANT + 2 * 6 * 4;
/// A bit of the Exp-Golomb prefix of the magnitude: intra or not, by band, by how many came before.
const PREFIX: usize = SIGN + 2 * 2 * 3;
/// The first bit of the Exp-Golomb suffix: intra or not, by band.
const SUFFIX: usize = PREFIX + 2 * 6 * LENGTHS;
/// Number of contexts; those of visibility maps follow ([`map_contexts`]).
pub(super) const PROBE_CONTEXTS: usize = SUFFIX + 2 * 6;

/// Lengths of a magnitude that are told apart.
const LENGTHS: usize = 6;

#[inline(always)]
pub(super) fn changed(intra: bool, neighbours: usize) -> usize {
    CHANGED + usize::from(intra) * 4 + neighbours
}

#[inline(always)]
pub(super) fn level_changed() -> usize {
    LEVEL_CHANGED
}

#[inline(always)]
pub(super) fn level(prior: u8, not_highest: bool) -> usize {
    LEVEL + usize::from(prior) * 2 + usize::from(not_highest)
}

#[inline(always)]
pub(super) fn band_significant(intra: bool, band: usize, neighbours: usize, before: bool) -> usize {
    BAND + ((usize::from(intra) * 6 + band) * 4 + neighbours) * 2 + usize::from(before)
}

#[inline(always)]
pub(super) fn code_significant(intra: bool, band: usize, neighbours: usize) -> usize {
    SIGNIFICANT + (usize::from(intra) * 6 + band) * 4 + neighbours
}

#[inline(always)]
pub(super) fn sign(intra: bool, band: usize, sure: usize) -> usize {
    SIGN + (usize::from(intra) * 2 + band % 2) * 3 + sure
}

#[inline(always)]
pub(super) fn prefix(intra: bool, band: usize, length: usize) -> usize {
    PREFIX + (usize::from(intra) * 6 + band) * LENGTHS + length.min(LENGTHS - 1)
}

#[inline(always)]
pub(super) fn suffix(intra: bool, band: usize) -> usize {
    SUFFIX + usize::from(intra) * 6 + band
}

/// All contexts with their initial probabilities.
pub(super) fn initial() -> [Context; map_contexts::END] {
    core::array::from_fn(|at| {
        let of_maps = || map_contexts::INITIAL[at - PROBE_CONTEXTS];
        Context::new(INITIAL.get(at).copied().unwrap_or_else(of_maps))
    })
}

/// The start values of all contexts, those of maps included.
#[cfg(all(test, feature = "std"))]
pub(super) fn initial_table() -> alloc::vec::Vec<u8> {
    [&INITIAL[..], &map_contexts::INITIAL[..]].concat()
}

/// Probabilities of a 0, in 1/256.
const INITIAL: [u8; PROBE_CONTEXTS] = [
    196, 117, 69, 17, 251, 247, 129, 4, 251, 251, 128, 128, 128, 128, 128, 128, 128, 183, 128, 148,
    128, 85, 128, 34, 128, 215, 217, 183, 180, 137, 121, 80, 51, 113, 139, 99, 97, 70, 53, 45, 25,
    199, 206, 172, 167, 146, 122, 105, 68, 179, 168, 148, 128, 112, 83, 81, 46, 235, 228, 204, 186,
    174, 139, 127, 83, 33, 128, 14, 128, 14, 128, 13, 128, 137, 68, 51, 40, 45, 33, 21, 28, 128,
    25, 5, 4, 4, 4, 4, 4, 128, 40, 128, 14, 64, 5, 18, 4, 128, 21, 30, 4, 10, 4, 8, 4, 128, 130,
    51, 53, 64, 17, 32, 12, 128, 128, 128, 128, 179, 56, 14, 4, 176, 146, 96, 50, 218, 158, 100,
    50, 203, 171, 127, 75, 229, 185, 148, 92, 128, 128, 128, 128, 122, 71, 61, 46, 42, 25, 24, 23,
    137, 100, 92, 72, 75, 53, 49, 42, 198, 135, 125, 95, 121, 214, 248, 123, 234, 251, 138, 140,
    160, 179, 147, 173, 195, 215, 218, 227, 235, 180, 240, 233, 229, 199, 112, 121, 226, 228, 227,
    214, 207, 168, 249, 238, 220, 152, 98, 163, 246, 239, 224, 198, 160, 164, 251, 226, 136, 97,
    188, 182, 26, 56, 108, 171, 203, 207, 154, 196, 206, 211, 198, 144, 49, 96, 154, 193, 217, 218,
    177, 203, 201, 200, 190, 200, 101, 163, 194, 217, 222, 221, 218, 208, 201, 195, 148, 200, 205,
    216, 211, 219, 218, 221, 152, 195, 160, 198, 174, 196,
];
