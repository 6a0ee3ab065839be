//! Tracks of `instances` for the vectors that the baked models share.

use super::expected::Content;
use super::generate::some;
use super::writer::Table;
use crate::generate::frames::Frames;
use crate::models::baked::{Baked, Fault};
use crate::models::entry::Entry;
use crate::stream_builder::kind;

impl Baked for Table {
    const NAME: &'static str = "instances";
    const RECORD: u16 = kind::INSTANCES;
    const SIZE: (u16, &'static str) = (3301, "I-013");
    const RESERVED: (u16, &'static str) = (3302, "I-014");
    const IDS: &'static str = "I-016";
    const FRAME_BYTES: &'static str = "I-018";
    const REPLACES: &'static str = "I-010";
    const SEVERAL: &'static str = "I-011";
    const EMPTY: &'static str = "I-050";

    fn entry(id: u32) -> Entry {
        let table = match id {
            2 => Table::raw(4).of_two(),
            _ => Table::packed(6),
        };
        Entry::of_table(id, table)
    }

    fn put(frames: Frames, ids: &[u32], seed: u64) -> Frames {
        let contents = contents(&frames, ids, seed);
        frames.instances(&contents)
    }

    fn payload(frames: &Frames, ids: &[u32], seed: u64) -> Vec<u8> {
        frames.instances_payload(&contents(frames, ids, seed))
    }

    fn faults(frames: &Frames) -> Vec<Fault> {
        let fault = |name, error, comment, ids: &[u32], change: fn(&mut Content)| {
            let mut contents = contents(frames, ids, 2);
            contents.last_mut().map(change);
            Fault {
                name,
                error,
                comment,
                payload: frames.instances_payload(&contents),
                after_a_record: ids == [2],
            }
        };
        vec![
            fault(
                "code",
                "codec 3305",
                "The last code of a packed table is out of range.",
                &[1],
                |content| content.instances[5].codes[0][0] = 256,
            ),
            fault(
                "key",
                "codec 3303",
                "The last key of the second table does not ascend, after a whole first one.",
                &[1, 2],
                |content| content.instances[3].key = 0,
            ),
            fault(
                "second-record",
                "codec 3305",
                "The second record of a frame is wrong, after a whole first one.",
                &[2],
                |content| content.instances[0].codes[1][0] = -256,
            ),
        ]
    }
}

/// Entries of tracks, others for each seed.
fn contents(frames: &Frames, ids: &[u32], seed: u64) -> Vec<Content> {
    let tracks = frames.live(ids).into_iter();
    let tables = tracks.filter_map(|entry| Some((entry.id, entry.table()?)));
    tables
        .map(|(id, table)| Content::new(id, some(table, seed)))
        .collect()
}
