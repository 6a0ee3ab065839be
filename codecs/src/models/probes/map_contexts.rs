//! The contexts of bits in coded visibility maps and their initial probabilities: `spec/probes.md` §9.

use super::contexts;

/// Whether a map changes: intra or not, by how many neighbours' maps do.
const CHANGED: usize = contexts::PROBE_CONTEXTS;
/// Whether a map has deviations.
const DEVIATES: usize = CHANGED + 2 * 4;
/// Whether a code is significant (has a residual): by plane, class of errors, how many texels beside it
/// have one, and spread.
const SIGNIFICANT: usize = DEVIATES + 1;
/// Whether a residual is negative: by plane, class of errors, and where the prediction from the same map
/// lies.
const SIGN: usize = SIGNIFICANT + PLANES * CLASSES * 3 * SPREADS;
/// A bit of the Exp-Golomb prefix: by plane, class of errors, and how many came before.
const PREFIX: usize = SIGN + PLANES * CLASSES * 3;
/// The first bit of the Exp-Golomb suffix: by plane and length.
const SUFFIX: usize = PREFIX + PLANES * CLASSES * LONGEST;
/// One past the last context.
pub(super) const END: usize = SUFFIX + PLANES * LONGEST;
/// Number of contexts.
pub(super) const MAP_CONTEXTS: usize = END - CHANGED;

/// Means and deviations.
const PLANES: usize = 2;
/// Classes of local errors.
pub(super) const CLASSES: usize = 8;
/// Classes of how far candidates lie apart.
pub(super) const SPREADS: usize = 4;
/// Ones in a prefix, at most: a magnitude is at most 255.
pub(super) const LONGEST: usize = 7;

#[inline(always)]
pub(super) fn changed(intra: bool, neighbours: usize) -> usize {
    CHANGED + usize::from(intra) * 4 + neighbours
}

#[inline(always)]
pub(super) fn deviates() -> usize {
    DEVIATES
}

#[inline(always)]
pub(super) fn significant(plane: usize, class: usize, beside: usize, spread: usize) -> usize {
    SIGNIFICANT + ((plane * CLASSES + class) * 3 + beside) * SPREADS + spread
}

#[inline(always)]
pub(super) fn sign(plane: usize, class: usize, side: usize) -> usize {
    SIGN + (plane * CLASSES + class) * 3 + side
}

#[inline(always)]
pub(super) fn prefix(plane: usize, class: usize, length: usize) -> usize {
    PREFIX + (plane * CLASSES + class) * LONGEST + length
}

#[inline(always)]
pub(super) fn suffix(plane: usize, length: usize) -> usize {
    SUFFIX + plane * LONGEST + length - 1
}

/// Probabilities of a 0, in 1/256.
pub(super) const INITIAL: [u8; MAP_CONTEXTS] = [
    248, 160, 112, 64, 107, 49, 10, 4, 251, 251, 225, 236, 240, 246, 201, 202, 209, 237, 182, 189,
    205, 237, 179, 187, 194, 233, 160, 169, 180, 222, 186, 184, 192, 230, 152, 163, 182, 207, 140,
    142, 147, 201, 134, 131, 139, 224, 133, 143, 170, 191, 110, 110, 120, 157, 100, 93, 100, 217,
    122, 122, 159, 174, 91, 86, 103, 130, 70, 61, 65, 208, 129, 112, 147, 160, 85, 69, 88, 108, 51,
    42, 46, 189, 137, 98, 136, 143, 79, 59, 75, 93, 38, 31, 34, 158, 140, 99, 108, 108, 73, 54, 60,
    66, 25, 24, 24, 251, 225, 236, 240, 246, 201, 202, 209, 237, 182, 189, 205, 237, 179, 187, 194,
    233, 160, 169, 180, 222, 186, 184, 192, 230, 152, 163, 182, 207, 140, 142, 147, 201, 134, 131,
    139, 224, 133, 143, 170, 191, 110, 110, 120, 157, 100, 93, 100, 217, 122, 122, 159, 174, 91,
    86, 103, 130, 70, 61, 65, 208, 129, 112, 147, 160, 85, 69, 88, 108, 51, 42, 46, 189, 137, 98,
    136, 143, 79, 59, 75, 93, 38, 31, 34, 158, 140, 99, 108, 108, 73, 54, 60, 66, 25, 24, 24, 95,
    125, 164, 85, 132, 149, 68, 132, 165, 65, 130, 167, 63, 124, 170, 61, 121, 169, 59, 119, 171,
    54, 118, 176, 95, 125, 164, 85, 132, 149, 68, 132, 165, 65, 130, 167, 63, 124, 170, 61, 121,
    169, 59, 119, 171, 54, 118, 176, 115, 114, 129, 146, 166, 183, 204, 153, 152, 168, 185, 195,
    232, 220, 130, 143, 161, 177, 196, 217, 237, 101, 135, 162, 180, 194, 217, 249, 68, 106, 150,
    179, 196, 221, 247, 42, 71, 116, 165, 197, 223, 246, 25, 43, 75, 128, 182, 218, 245, 14, 23,
    41, 73, 126, 187, 233, 115, 114, 129, 146, 166, 183, 204, 153, 152, 168, 185, 195, 232, 220,
    130, 143, 161, 177, 196, 217, 237, 101, 135, 162, 180, 194, 217, 249, 68, 106, 150, 179, 196,
    221, 247, 42, 71, 116, 165, 197, 223, 246, 25, 43, 75, 128, 182, 218, 245, 14, 23, 41, 73, 126,
    187, 233, 155, 159, 166, 172, 180, 203, 186, 155, 159, 166, 172, 180, 203, 186,
];
