//! Several tracks, of points of all widths, in one record and in several.

use super::{AREA, Draft};
use crate::generate::frames::Frames;
use crate::models::points::frames::{WIDTHS, entry, filled, point, some};
use crate::models::points::writer::Part;
use crate::stream_builder::IDENTITY;

pub fn add(drafts: &mut Vec<Draft>) {
    let entries = [2, 3, 10].map(|id| entry(id, WIDTHS[id as usize % 3]));
    let part = |i: usize, first: u32| {
        let entry = &entries[i];
        filled(
            entry,
            &[
                (0, 0, some(entry, first, 2)),
                (5, 13, some(entry, first + 2, 1)),
            ],
        )
    };
    let all = |first| [part(0, first), part(1, first + 10), part(2, first + 20)];
    let change =
        |i: usize, first: u32| Part::of(&entries[i]).cell(5, 13, &some(&entries[i], first, 3));
    let frames = Frames::new(&entries).keyframe(&all(1)).commit();
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        drafts.push(Draft::valid(AREA, name, clauses, comment, frames.ended()));
    };
    let comment = "Three tracks of three widths in one record, a keyframe and a delta.";
    let two = frames
        .clone()
        .delta(&[change(0, 50), change(1, 60), change(2, 70)]);
    case(
        "tracks-in-one-record",
        &["P-008", "P-017", "P-013"],
        comment,
        two.commit(),
    );
    let comment = "Three tracks in three records of a frame, ids ascending.";
    let three = frames
        .clone()
        .delta(&[change(0, 50)])
        .delta(&[change(1, 60)]);
    case(
        "records-of-a-frame",
        &["P-017"],
        comment,
        three.delta(&[change(2, 70)]).commit(),
    );
    let comment = "Records of a frame whose ids descend from record to record.";
    let three = frames
        .clone()
        .delta(&[change(2, 50)])
        .delta(&[change(0, 60), change(1, 70)]);
    case(
        "records-of-a-frame-descending",
        &["P-017", "P-013"],
        comment,
        three.commit(),
    );
    let comment = "A keyframe of one track and deltas of others in a frame.";
    let both = frames
        .clone()
        .delta(&[change(0, 50)])
        .keyframe(&[change(1, 60)]);
    case(
        "keyframe-and-deltas",
        &["P-017"],
        comment,
        both.delta(&[change(2, 70)]).commit(),
    );
    let comment = "A keyframe of one track leaves the others and their transforms.";
    let moved = frames
        .clone()
        .transforms(&[(2, IDENTITY), (10, IDENTITY)])
        .commit();
    case(
        "keyframe-of-one-track",
        &["P-015"],
        comment,
        moved.keyframe(&[part(2, 80)]).commit(),
    );
    let comment = "A new group begins with a keyframe of one track; the others are empty.";
    let group = frames.clone().group().keyframe(&[part(1, 80)]).commit();
    case("group-with-one-track", &["C-062", "P-015"], comment, group);
    let comment = "Two tracks with the same cells and keys; a delta changes one of them.";
    let alike = [0, 2].map(|i| Part {
        id: entries[i].id,
        ..part(0, 30)
    });
    let same = Frames::new(&[entry(2, WIDTHS[2]), entry(10, WIDTHS[2])]).keyframe(&alike);
    let same = same.commit().delta(&[Part {
        id: 10,
        ..change(0, 90)
    }]);
    case("tracks-share-nothing", &["P-016"], comment, same.commit());
    let comment = "A track is removed, its room goes to a new one, which is empty.";
    let later = [11, 12].map(|id| entry(id, WIDTHS[0]));
    let gone = frames.clone().remove(&[3]).delta(&[change(0, 50)]).commit();
    let gone = gone.declare(&later).commit();
    let filled_later = gone.delta(&[filled(&later[1], &[(1, 8, some(&later[1], 70, 2))])]);
    case(
        "removed-and-replaced",
        &["C-081", "C-079"],
        comment,
        filled_later.commit(),
    );
    let comment = "A track that was declared since the last frame takes a delta.";
    let added = entry(20, WIDTHS[1]);
    let new = frames.clone().declare(std::slice::from_ref(&added));
    let new = new.delta(&[filled(&added, &[(2, 5, some(&added, 40, 3))])]);
    case(
        "delta-of-a-new-track",
        &["C-079", "P-016"],
        comment,
        new.commit(),
    );
    let comment = "A track is declared after a record of the same frame, and has a record.";
    let new = frames
        .clone()
        .delta(&[change(0, 50)])
        .declare(std::slice::from_ref(&added));
    let new = new.keyframe(&[filled(&added, &[(2, 5, some(&added, 40, 3))])]);
    case(
        "declared-within-a-frame",
        &["C-045", "P-017"],
        comment,
        new.commit(),
    );
    let comment = "Tracks 0 and 2^32 - 1.";
    let ends = [entry(0, WIDTHS[0]), entry(u32::MAX, WIDTHS[1])];
    let parts = ends
        .each_ref()
        .map(|entry| filled(entry, &[(1, 8, vec![point(entry, 4)])]));
    case(
        "first-and-last-id",
        &["P-013"],
        comment,
        Frames::new(&ends).keyframe(&parts).commit(),
    );
    let comment = "A frame of three records, all of no tracks.";
    let none = frames.keyframe(&[]).delta(&[]).keyframe(&[]);
    case(
        "records-of-no-tracks",
        &["P-017", "C-046"],
        comment,
        none.commit(),
    );
}
