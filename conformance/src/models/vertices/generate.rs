//! The model `vertices`: its parameters, its records and what they leave.

mod layout;
mod limits;
mod parameters;
mod queries;
mod values;

use crate::generate::Draft;
use crate::generate::draw::Draw;
use crate::generate::frames::Frames;
use crate::models::baked;
use crate::models::entry::Entry;
use crate::models::vertices::writer::{Section, Vertices, payload};
use crate::stream_builder::kind;

/// Folder of these vectors.
pub(crate) const AREA: &str = "vertices";

/// Adds the vectors of this part.
pub fn add(drafts: &mut Vec<Draft>) {
    parameters::add(drafts);
    layout::add(drafts);
    values::add(drafts);
    baked::add::<Vertices>(drafts);
    limits::add(drafts);
    queries::add(drafts);
}

/// A stream that is decoded to its end.
fn valid(name: &str, clauses: &[&'static str], comment: &str, frames: &Frames) -> Draft {
    Draft::valid(AREA, name, clauses, comment, frames.ended())
}

/// A stream that is refused, where and with what.
fn invalid(
    error: (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    (offset, bytes): (usize, Vec<u8>),
) -> Draft {
    Draft::invalid(AREA, error, offset, clauses, comment, bytes)
}

/// A check of one before another, by name and sentence.
fn ordered(
    error: (u16, &str),
    clauses: &[&'static str],
    comment: &str,
    refused: (usize, Vec<u8>),
) -> Draft {
    let name = format!("order-{}", error.1);
    let clauses = &[clauses, &["C-112"]].concat();
    invalid((error.0, &name), clauses, comment, refused)
}

/// Codes of a track, others for each seed.
pub(crate) fn some(vertices: &Vertices, seed: u64) -> Vec<u8> {
    let mut draw = Draw(seed);
    let most = u32::from(vertices.most());
    (0..vertices.values())
        .map(|_| draw.below(most + 1) as u8)
        .collect()
}

/// A stream of these tracks, with ids from 1 up.
fn streams(tracks: &[Vertices]) -> Frames {
    let numbered = (1..).zip(tracks.iter().cloned());
    let entries: Vec<Entry> = numbered.map(|(id, v)| Entry::of_vertices(id, v)).collect();
    Frames::new(&entries)
}

/// Two tracks of both codings, and their contents.
fn two() -> (Frames, [(u32, Vec<u8>); 2]) {
    let tracks = [Vertices::packed(5).two(), Vertices::raw(3).five()];
    let contents = [1, 2].map(|id| (id, some(&tracks[id as usize - 1], 1)));
    (streams(&tracks), contents)
}

/// A stream of one track whose section was altered, and the offset of its fault.
fn section(vertices: &Vertices, change: impl FnOnce(&mut Section)) -> (usize, Vec<u8>) {
    let frames = streams(std::slice::from_ref(vertices));
    let mut sections = frames.vertices_sections(&[(1, some(vertices, 1))]);
    change(&mut sections[0]);
    frames.refused_of(kind::VERTICES, &payload(&sections))
}
