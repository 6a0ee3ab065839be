//! Lines of `instances` in dumps (`spec/dump.md`).

use std::fmt::Write as _;

use dapple_codec::TrackState;
use dapple_codec::instances::{State, Table};

use crate::text::{commas, floats};

/// The line of the parameters.
pub fn parameters(id: u32, table: &Table, out: &mut String) {
    let (signals, [a, b]) = (&table.signals, table.signals.kernels);
    let _ = write!(
        out,
        "instances {id} {} {} {} {} {},{}",
        table.count, table.exponent, table.step, signals.count, a.kind, b.kind
    );
    floats(&[a.distance, b.distance, signals.share], out);
    out.push('\n');
}

/// Each entry with its values.
pub fn entries(state: &State, live: &TrackState, table: &Table, out: &mut String) {
    let id = live.track.id;
    let values = state.values_of(live);
    let values = values.chunks(usize::from(table.signals.count).max(1));
    for (key, values) in state.keys_of(live).iter().zip(values) {
        let _ = write!(out, "entry {id} {key:016x}");
        for value in values {
            out.push(' ');
            commas(value, out, |number, out| {
                write!(out, "{:04x}", *number as u16)
            });
        }
        out.push('\n');
    }
}
