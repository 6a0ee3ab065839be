//! Tracks of `instances` and entries for them.
#![allow(dead_code)]

use crate::common::Random;
use dapple_codec::instances::*;
use dapple_codec::signals::{Kernel, Signals};
use dapple_codec::*;

/// Parameters for `count` entries of two signals.
pub fn table(count: u32, coding: Coding) -> Table {
    Table {
        signals: Signals::two(Kernel::exponential(2.0), Kernel::exponential(300.0), 0.97),
        count,
        exponent: 1,
        step: 32,
        coding,
    }
}

pub fn table_track(id: u32, table: Table) -> Track {
    Track {
        id,
        target: Target {
            content_hash: Some(u64::from(id)),
            ..Target::default()
        },
        aabb_min: [-10.0; 3],
        aabb_max: [10.0; 3],
        space: LookupSpace::Mesh,
        model: Model::Instances(table),
    }
}

/// Entries of a track, scalars and linear ones.
pub fn entries(table: &Table, random: &mut Random) -> Vec<Entry> {
    let first = random.next();
    let keys = (0..table.count).map(|at| key(&format!("{first}/{at}")));
    let entry = |key| {
        let form = match random.below(3) {
            0 => Form::Scalar,
            _ => Form::Linear,
        };
        let mut coefficients = [[0.0; COEFFICIENTS]; 2];
        for coefficient in coefficients.as_flattened_mut() {
            let unit = random.below(2001) as f32 / 1000.0 - 1.0;
            *coefficient = unit * if random.below(4) > 0 { 0.1 } else { 1.9 };
        }
        let signals = &coefficients[..usize::from(table.signals.count)];
        table.quantize(key, form, signals).unwrap()
    };
    let mut entries: Vec<Entry> = keys.map(entry).collect();
    entries.sort_by_key(|entry| entry.key);
    entries
}

/// Keys and values of entries, as a decoder shows them.
pub fn shown(table: &Table, entries: &[Entry]) -> (Vec<u64>, Vec<Value>) {
    let signals = usize::from(table.signals.count);
    let values = entries.iter().flat_map(|entry| &entry.codes[..signals]);
    let value = |codes: &[i16; 4]| codes.map(|code| code * table.step as i16);
    (
        entries.iter().map(|e| e.key).collect(),
        values.map(value).collect(),
    )
}

pub fn update(track: u32, entries: &[Entry]) -> Update<'_> {
    Update { track, entries }
}
