//! Tracks of `vertices` for the vectors that the baked models share.

use super::generate::some;
use super::writer::{Section, Vertices, payload};
use crate::generate::frames::Frames;
use crate::models::baked::{Baked, Fault};
use crate::models::entry::Entry;
use crate::stream_builder::kind;

impl Baked for Vertices {
    const NAME: &'static str = "vertices";
    const RECORD: u16 = kind::VERTICES;
    const SIZE: (u16, &'static str) = (3201, "V-011");
    const RESERVED: (u16, &'static str) = (3202, "V-012");
    const IDS: &'static str = "V-013";
    const FRAME_BYTES: &'static str = "V-015";
    const REPLACES: &'static str = "V-010";
    const SEVERAL: &'static str = "V-010";
    const EMPTY: &'static str = "V-040";

    fn entry(id: u32) -> Entry {
        let vertices = match id {
            2 => Vertices::raw(3).five(),
            _ => Vertices::packed(5).two().five(),
        };
        Entry::of_vertices(id, vertices)
    }

    fn put(frames: Frames, ids: &[u32], seed: u64) -> Frames {
        let contents = contents(&frames, ids, seed);
        frames.vertices(&contents)
    }

    fn payload(frames: &Frames, ids: &[u32], seed: u64) -> Vec<u8> {
        payload(&sections(frames, ids, seed))
    }

    fn faults(frames: &Frames) -> Vec<Fault> {
        let fault = |name, error, comment, ids: &[u32], change: fn(&mut Section)| {
            let mut sections = sections(frames, ids, 2);
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
                "bits",
                "codec 3202",
                "Bits after the last code of the second track are set, after a whole first track.",
                &[1, 2],
                |section| section.bytes[1] |= 0x80,
            ),
            fault(
                "size",
                "codec 3201",
                "The second section is too short, after a whole first one.",
                &[1, 2],
                |section| _ = section.bytes.pop(),
            ),
            fault(
                "difference",
                "codec 3205",
                "A difference of the last value is out of range.",
                &[1],
                |section| section.bytes[9] = 0xff,
            ),
            fault(
                "second-record",
                "codec 3202",
                "The second record of a frame is wrong, after a whole first one.",
                &[2],
                |section| section.bytes[1] |= 0x80,
            ),
        ]
    }
}

/// Codes of tracks, others for each seed.
fn contents(frames: &Frames, ids: &[u32], seed: u64) -> Vec<(u32, Vec<u8>)> {
    let tracks = frames.live(ids).into_iter();
    let vertices = tracks.filter_map(|entry| Some((entry.id, entry.vertices()?)));
    vertices.map(|(id, v)| (id, some(v, seed))).collect()
}

fn sections(frames: &Frames, ids: &[u32], seed: u64) -> Vec<Section> {
    frames.vertices_sections(&contents(frames, ids, seed))
}
