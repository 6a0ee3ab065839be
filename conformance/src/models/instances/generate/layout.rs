//! A section with two faults before the next track's id.

use super::{Content, Draft, Table, ordered, some, streams};
use crate::stream_builder::{kind, set_word};

pub fn add(drafts: &mut Vec<Draft>) {
    let tables = [Table::packed(7), Table::raw(9).of_two()];
    let contents = [1, 2].map(|id| Content::new(id, some(&tables[id as usize - 1], 1)));
    let frames = streams(&tables);
    let mut payload = frames.instances_payload(&contents);
    payload.extend([0; 9]);
    let both = (payload.len() - 40) as u32;
    set_word(&mut payload, 20, both);
    payload[28] = 9;
    drafts.push(ordered(
        (3306, "first-section-then-second-id"),
        &["I-034", "I-016"],
        "The first section, of both sizes, comes before the second's id.",
        frames.refused_of(kind::INSTANCES, &payload),
    ));
}
