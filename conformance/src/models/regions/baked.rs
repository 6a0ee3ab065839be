//! Tracks of `regions` for the vectors that the baked models share.

use super::expected::Content;
use super::generate::some;
use super::writer::{Section, Set, payload};
use crate::generate::frames::Frames;
use crate::models::baked::{Baked, Fault};
use crate::models::entry::Entry;
use crate::stream_builder::kind;

impl Baked for Set {
    const NAME: &'static str = "regions";
    const RECORD: u16 = kind::REGIONS;
    const SIZE: (u16, &'static str) = (3401, "R-012");
    const RESERVED: (u16, &'static str) = (3402, "R-013");
    const IDS: &'static str = "R-014";
    const FRAME_BYTES: &'static str = "R-015";
    const REPLACES: &'static str = "R-010";
    const SEVERAL: &'static str = "R-011";
    const EMPTY: &'static str = "R-050";

    fn entry(id: u32) -> Entry {
        let set = match id {
            2 => Set::packed(5),
            _ => Set::raw(4),
        };
        Entry::of_set(id, set)
    }

    fn put(frames: Frames, ids: &[u32], seed: u64) -> Frames {
        let contents = contents(&frames, ids, seed);
        frames.regions(&contents)
    }

    fn payload(frames: &Frames, ids: &[u32], seed: u64) -> Vec<u8> {
        frames.regions_payload(&contents(frames, ids, seed))
    }

    fn faults(frames: &Frames) -> Vec<Fault> {
        let fault = |name, error, comment, ids: &[u32], change: fn(&mut Section)| {
            let mut sections = frames.region_sections(&contents(frames, ids, 2));
            sections.last_mut().map(change);
            Fault {
                name,
                error,
                comment,
                payload: payload(&sections),
                after_a_record: ids == [2],
            }
        };
        vec![
            fault(
                "box",
                "codec 3403",
                "The last box of the second track is inside out, after a whole first track.",
                &[1, 2],
                |section| section.head[4 * 24 + 3] = 0x7f,
            ),
            fault(
                "size",
                "codec 3406",
                "The codes of the second section are too long, after a whole first one.",
                &[1, 2],
                |section| section.codes.extend([0; 9]),
            ),
            fault(
                "second-record",
                "codec 3406",
                "The second record of a frame is wrong, after a whole first one.",
                &[2],
                |section| section.codes[..4].fill(0xff),
            ),
        ]
    }
}

/// Regions of tracks, others for each seed.
fn contents(frames: &Frames, ids: &[u32], seed: u64) -> Vec<Content> {
    let tracks = frames.live(ids).into_iter();
    let sets = tracks.filter_map(|entry| Some((entry.id, entry.set()?)));
    sets.map(|(id, set)| Content::new(id, some(set, seed)))
        .collect()
}
