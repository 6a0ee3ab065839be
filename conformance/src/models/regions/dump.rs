//! Lines of `regions` in dumps (`spec/dump.md`).

use std::fmt::Write as _;

use dapple_codec::TrackState;
use dapple_codec::regions::{RegionSet, State};

use crate::text::{commas, floats};

/// The line of the parameters.
pub fn parameters(id: u32, set: &RegionSet, out: &mut String) {
    let RegionSet {
        signals,
        count,
        capacity,
        exponent,
        step,
        ..
    } = set;
    let _ = write!(out, "regions {id} {count} {capacity} {exponent} {step} ");
    let [first, second] = signals.kernels;
    let _ = write!(out, "{} {},{}", signals.count, first.kind, second.kind);
    floats(&[first.distance, second.distance, signals.share], out);
    out.push('\n');
}

/// Each region with its box, its centre and its values.
pub fn regions(state: &State, live: &TrackState, out: &mut String) {
    let id = live.track.id;
    let pairs = state.pairs_of(live);
    for (index, region) in state.regions_of(live).iter().enumerate() {
        let Some(form) = region.form() else {
            continue;
        };
        let numbers = [form.derivatives as u8, form.degree, form.signals];
        let _ = write!(out, "region {id} {index} ");
        commas(numbers, out, |number, out| write!(out, "{number}"));
        floats(&region.min, out);
        floats(&region.max, out);
        match form.centred {
            true => out.push_str(" - - -"),
            false => floats(&region.centre, out),
        }
        out.push(' ');
        let first = region.first as usize;
        let values = pairs[first..first + form.pairs()].as_flattened();
        let values = values[..form.coefficients()].iter();
        commas(values, out, |value, out| {
            write!(out, "{:04x}", *value as u16)
        });
        out.push('\n');
    }
}
