//! Preamble, record headers, packing, the end of a stream.

use super::Draft;
use crate::forge::{Forge, commit, group, kind};

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    drafts.push(Draft::valid(
        "container",
        "least",
        &["C-001", "C-002"],
        "The smallest stream that shows something: one empty frame.",
        empty_frame().ended(),
    ));
    let mut bytes = empty_frame().ended();
    bytes[0] ^= 1;
    drafts.push(Draft::invalid(
        "container",
        (1001, "magic-first-byte"),
        0,
        &["C-001"],
        "The first byte of the magic is another.",
        bytes,
    ));
}

/// A stream with one frame of nothing.
pub fn empty_frame() -> Forge {
    let mut forge = Forge::started();
    forge
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    forge
}
