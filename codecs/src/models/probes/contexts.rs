//! The sorts of bits in `packed` probes, and how each one starts: `spec/probes.md` §6.

use crate::entropy::Context;

/// Whether a probe changes: with and without a base, by how many neighbours do.
const CHANGED: usize = 0;
/// Whether its level does.
const OTHER_LEVEL: usize = CHANGED + 2 * 4;
/// Which level it has then, by the one of the base: whether it is the highest of the three others,
/// and if not whether it is the next.
const LEVEL: usize = OTHER_LEVEL + 1;
/// Whether a group has a residual: intra or not, by group, by how many neighbours have one there,
/// and whether the group before has one.
const ANY: usize = LEVEL + 4 * 2;
/// Whether a code has one: intra or not, by group, by how many neighbours have one there.
const SOME: usize = ANY + 2 * 6 * 4 * 2;
/// Whether the sign is against that of the neighbours: intra or not, luma or chroma, by how sure
/// they are.
const AGAINST: usize = SOME + 2 * 6 * 4;
/// Whether the magnitude has another bit: intra or not, by group, by how many it has.
const LONGER: usize = AGAINST + 2 * 2 * 3;
/// The bit below the highest one: intra or not, by group.
const SECOND: usize = LONGER + 2 * 6 * LENGTHS;
/// Number of contexts.
pub(super) const CONTEXTS: usize = SECOND + 2 * 6;

/// Lengths of a magnitude that are told apart.
const LENGTHS: usize = 6;

#[inline(always)]
pub(super) fn changed(intra: bool, neighbours: usize) -> usize {
    CHANGED + usize::from(intra) * 4 + neighbours
}

#[inline(always)]
pub(super) fn other_level() -> usize {
    OTHER_LEVEL
}

#[inline(always)]
pub(super) fn level(base: u8, second: bool) -> usize {
    LEVEL + usize::from(base) * 2 + usize::from(second)
}

#[inline(always)]
pub(super) fn any(intra: bool, group: usize, neighbours: usize, before: bool) -> usize {
    ANY + ((usize::from(intra) * 6 + group) * 4 + neighbours) * 2 + usize::from(before)
}

#[inline(always)]
pub(super) fn some(intra: bool, group: usize, neighbours: usize) -> usize {
    SOME + (usize::from(intra) * 6 + group) * 4 + neighbours
}

#[inline(always)]
pub(super) fn against(intra: bool, group: usize, sure: usize) -> usize {
    AGAINST + (usize::from(intra) * 2 + group % 2) * 3 + sure
}

#[inline(always)]
pub(super) fn longer(intra: bool, group: usize, length: usize) -> usize {
    LONGER + (usize::from(intra) * 6 + group) * LENGTHS + length.min(LENGTHS - 1)
}

#[inline(always)]
pub(super) fn second(intra: bool, group: usize) -> usize {
    SECOND + usize::from(intra) * 6 + group
}

/// All contexts at their start.
pub(super) fn initial() -> [Context; CONTEXTS] {
    INITIAL.map(Context::new)
}

#[cfg(all(test, feature = "std"))]
pub(super) fn initial_table() -> &'static [u8] {
    &INITIAL
}

/// Probabilities of a 0, in 1/256.
const INITIAL: [u8; CONTEXTS] = [
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
