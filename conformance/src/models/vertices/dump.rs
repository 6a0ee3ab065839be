//! Lines of `vertices` in dumps (`spec/dump.md`).

use std::fmt::Write as _;

use dapple_codec::TrackState;
use dapple_codec::vertices::{State, Vertices};

use crate::models::signals;
use crate::text::commas;

/// The line of the parameters.
pub fn parameters(id: u32, vertices: &Vertices, out: &mut String) {
    let (count, bits, order) = (vertices.count, vertices.bits, vertices.order);
    let _ = write!(out, "vertices {id} {count} {bits} {order} ");
    signals::dump(&vertices.signals, out);
    out.push('\n');
}

/// Each vertex that is not open, with its values.
pub fn values(state: &State, live: &TrackState, vertices: &Vertices, out: &mut String) {
    let signals = usize::from(vertices.signals.count);
    for (index, values) in state.values_of(live).chunks(signals).enumerate() {
        if values.iter().all(|&value| value == 255) {
            continue;
        }
        let _ = write!(out, "vertex {} {index} ", live.track.id);
        commas(values, out, |value, out| write!(out, "{value}"));
        out.push('\n');
    }
}
