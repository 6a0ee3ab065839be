//! What records and groups make of what was there, clauses; other models.

use super::{Content, Draft, Set, both, entries, invalid, ordered, payload, some, streams, valid};
use crate::generate::frames::Frames;
use crate::generate::plan::moved;
use crate::models::entry::Entry;
use crate::models::points::frames::{self as grids, WIDTHS, filled};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::{Pack, kind};

pub fn add(drafts: &mut Vec<Draft>) {
    for (coding, set) in both(5) {
        frames(drafts, coding, &set);
    }
    others(drafts);
}

fn frames(drafts: &mut Vec<Draft>, coding: &str, set: &Set) {
    let content = |id, seed| Content::new(id, some(set, seed));
    let begun = streams(std::slice::from_ref(set))
        .regions(&[content(1, 1)])
        .commit();
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        let name = format!("{name}-{coding}");
        drafts.push(valid(&name, clauses, comment, &frames));
    };
    case(
        "record-replaces",
        &["R-010"],
        "A record replaces all that was there.",
        begun.clone().regions(&[content(1, 2)]).commit(),
    );
    case(
        "frame-without-a-record",
        &["R-010"],
        "Regions stay through frames without a record of them.",
        begun.clone().commit().commit(),
    );
    case(
        "same-again",
        &["R-010"],
        "A record has what is there already.",
        begun.clone().regions(&[content(1, 1)]).commit(),
    );
    case(
        "group-empties",
        &["R-010", "C-062"],
        "A group that starts from keyframes, without regions, empties their track.",
        begun.clone().group().commit().commit(),
    );
    case(
        "group-on-state-keeps",
        &["R-010"],
        "A group that builds on a state keeps regions.",
        begun.clone().group_on_state().commit(),
    );
    case(
        "after-a-group",
        &["R-010", "C-062"],
        "Regions come again in the second frame of a group that started without.",
        begun
            .clone()
            .group()
            .commit()
            .regions(&[content(1, 3)])
            .commit(),
    );
    case(
        "track-declared-again",
        &["C-078", "R-010"],
        "A track that is declared again keeps its regions.",
        begun
            .clone()
            .declare(&entries(std::slice::from_ref(set)))
            .commit(),
    );
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        case(
            &format!("record-in-{name}"),
            &["R-010"],
            "A record is packed as a whole.",
            begun
                .clone()
                .packed(pack)
                .regions(&[content(1, 4)])
                .commit(),
        );
    }
    let two = [set.clone(), set.clone()];
    let begun = streams(&two)
        .regions(&[content(1, 5), content(2, 6)])
        .commit();
    case(
        "record-of-one-track",
        &["R-010"],
        "A record of one track leaves the other, and transforms.",
        begun
            .clone()
            .transforms(&[(1, moved(2.0))])
            .commit()
            .regions(&[content(2, 7)])
            .commit(),
    );
    case(
        "two-records-of-a-frame",
        &["R-011"],
        "Two records of a frame, ids descending from one to the other.",
        begun
            .clone()
            .regions(&[content(2, 8)])
            .regions(&[content(1, 9)])
            .commit(),
    );
    case(
        "removed-with-its-regions",
        &["R-010"],
        "A track with regions is removed, and another comes.",
        begun
            .clone()
            .remove(&[1])
            .commit()
            .declare(&[Entry::of_set(3, set.clone())])
            .regions(&[content(3, 10)])
            .commit(),
    );
    case(
        "track-without-content",
        &["R-050"],
        "Two tracks, one of which has no content yet.",
        streams(&two).regions(&[content(2, 11)]).commit(),
    );
    case(
        "record-of-no-tracks",
        &["R-012", "C-046"],
        "A record names no track.",
        begun.regions(&[]).commit(),
    );
}

/// Records of models with tracks of others (B-017), and both in a frame.
fn others(drafts: &mut Vec<Draft>) {
    let set = Set::packed(3);
    let grid = grids::entry(1, WIDTHS[0]);
    let entries = [grid.clone(), Entry::of_set(2, set.clone())];
    let part = filled(&grid, &[(1, 3, grids::some(&grid, 9, 2))]);
    let content = Content::new(2, some(&set, 1));
    let frames = Frames::new(&entries);
    let comment = "A record of points and one of regions, in a frame and in the next.";
    let both = frames
        .clone()
        .keyframe(std::slice::from_ref(&part))
        .regions(std::slice::from_ref(&content))
        .commit()
        .regions(&[Content::new(2, some(&set, 2))])
        .delta(&[])
        .commit();
    drafts.push(valid(
        "points-and-regions",
        &["R-011", "B-012"],
        comment,
        &both,
    ));
    let mut sections = frames.region_sections(&[content]);
    sections[0].id = 1;
    let refused = frames
        .clone()
        .refused_of(kind::REGIONS, &payload(&sections));
    let comment = "A record of regions names a track of points.";
    drafts.push(invalid(
        (2027, "regions-of-points"),
        &["B-017"],
        comment,
        refused,
    ));
    sections[0].reserved = 1;
    let refused = frames
        .clone()
        .refused_of(kind::REGIONS, &payload(&sections));
    let comment = "The model of a track before the reserved word.";
    drafts.push(ordered(
        (2027, "model-then-reserved"),
        &["B-017", "R-013"],
        comment,
        refused,
    ));
    let own = Part { id: 2, ..part };
    let refused = frames.refused(&points(None, &[own]));
    let comment = "A record of points names a track of regions.";
    drafts.push(invalid(
        (2027, "points-of-regions"),
        &["B-017"],
        comment,
        refused,
    ));
}
