//! Streams of both models: clauses B-012 and B-017.

use super::{Content, Draft, Frames, Volume, invalid, ordered, payload, some, valid};
use crate::generate::plan::moved;
use crate::models::entry::Entry;
use crate::models::points::frames::{self, WIDTHS, filled};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::kind;

/// Track 1 a volume, track 2 a grid, track 3 a volume.
fn mixed() -> (Frames, [Content; 2], Part) {
    let volumes = [Volume::packed([2, 2, 2]), Volume::raw([2, 1, 2]).seeing(4)];
    let grid = frames::entry(2, WIDTHS[0]);
    let entries = [
        Entry::of_volume(1, volumes[0].clone()),
        grid.clone(),
        Entry::of_volume(3, volumes[1].clone()),
    ];
    let first = Content::new(1, some(&volumes[0], 1));
    let mut second = Content::new(3, some(&volumes[1], 1));
    second.visibility = Some(super::seen(&volumes[1], 4));
    let part = filled(&grid, &[(1, 3, frames::some(&grid, 9, 2))]);
    (Frames::new(&entries), [first, second], part)
}

pub fn add(drafts: &mut Vec<Draft>) {
    others(drafts);
    together(drafts);
}

/// Records that name a track of the other model.
fn others(drafts: &mut Vec<Draft>) {
    let (frames, contents, part) = mixed();
    let begun = frames
        .clone()
        .keyframe(std::slice::from_ref(&part))
        .probes(true, &contents)
        .commit();
    for (place, frames, base) in [("keyframe", &frames, None), ("delta", &begun, Some(0))] {
        let mut section = frames.sections(base.is_none(), &contents[..1]).remove(0);
        section.id = 2;
        let refused = frames
            .clone()
            .refused_of(kind::PROBES, &payload(base, &[section]));
        let comment = format!("A record of probes names a track of points, in a {place}.");
        let name = format!("probes-of-points-{place}");
        drafts.push(invalid((2027, &name), &["B-017"], &comment, refused));
        let own = Part {
            id: 1,
            ..part.clone()
        };
        let refused = frames.clone().refused(&points(base, &[own]));
        let comment = format!("A record of points names a volume, in a {place}.");
        let name = format!("points-of-probes-{place}");
        drafts.push(invalid((2027, &name), &["B-017"], &comment, refused));
    }
    let mut sections = begun.sections(false, &contents);
    sections[1].id = 2;
    let record = payload(Some(0), &sections);
    let refused = begun.clone().refused_of(kind::PROBES, &record);
    let comment = "The second track of a record of probes is one of points.";
    drafts.push(invalid(
        (2027, "second-track"),
        &["B-017"],
        comment,
        refused,
    ));
    sections[1].flags = Some(2);
    sections[1].size = Some(u32::MAX);
    let refused = begun
        .clone()
        .refused_of(kind::PROBES, &payload(Some(0), &sections));
    let comment = "The model of a track is checked before its flags and its size.";
    drafts.push(ordered(
        (2027, "model-then-flags"),
        &["B-017", "B-014"],
        comment,
        refused,
    ));
    let open = begun.clone().delta(&[Part {
        id: 2,
        ..Part::default()
    }]);
    let refused = open.refused_of(kind::PROBES, &record);
    let comment = "The model of a track is checked before whether it comes twice.";
    drafts.push(ordered(
        (2027, "model-then-twice"),
        &["B-017", "B-016"],
        comment,
        refused,
    ));
    let removed = begun.remove(&[2]);
    let refused = removed.refused_of(kind::PROBES, &record);
    let comment = "That a track is removed is found before its model.";
    drafts.push(ordered(
        (2019, "removed-then-model"),
        &["B-016", "B-017"],
        comment,
        refused,
    ));
}

/// Both models in a stream.
fn together(drafts: &mut Vec<Draft>) {
    let (frames, contents, part) = mixed();
    let [first, second] = contents.clone();
    let later = |content: &Content, volume, seed| {
        Content::new(content.id, super::later(&volume, &content.probes, seed))
    };
    let first_later = later(&first, Volume::packed([2, 2, 2]), 5);
    let second_later = later(&second, Volume::raw([2, 1, 2]), 6);
    let begun = frames
        .probes(true, &contents)
        .keyframe(std::slice::from_ref(&part))
        .transforms(&[(1, moved(1.0)), (2, moved(2.0)), (3, moved(3.0))])
        .commit();
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        drafts.push(valid(name, clauses, comment, frames));
    };
    case(
        "both-models",
        &["B-012", "B-062"],
        "A keyframe of two volumes and one of points, with transforms.",
        begun.clone(),
    );
    let frames = begun
        .clone()
        .probes(false, std::slice::from_ref(&first_later))
        .delta(&[Part {
            id: 2,
            ..part.clone()
        }])
        .probes(true, std::slice::from_ref(&second_later))
        .commit();
    case(
        "both-models-keyframe-and-delta",
        &["B-010", "B-011", "B-012"],
        "A frame of a delta of a volume, a delta of points, and a keyframe of another volume, whose visibility goes.",
        frames,
    );
    let frames = begun
        .clone()
        .keyframe(std::slice::from_ref(&part))
        .probes(false, std::slice::from_ref(&second_later))
        .probes(false, std::slice::from_ref(&first_later))
        .commit();
    case(
        "both-models-later-track-first",
        &["B-012"],
        "Two records of a frame, that of the later track first, after a keyframe of points.",
        frames,
    );
    let frames = begun.clone().delta(std::slice::from_ref(&part)).commit();
    case(
        "points-alone-leave-probes",
        &["B-011", "B-012"],
        "A frame of points alone leaves the probes as they are.",
        frames,
    );
    let frames = begun
        .clone()
        .probes(false, std::slice::from_ref(&first_later))
        .commit();
    case(
        "probes-alone-leave-points",
        &["B-011", "B-012"],
        "A frame of probes alone leaves the points as they are.",
        frames,
    );
    let frames = begun
        .clone()
        .group()
        .keyframe(std::slice::from_ref(&part))
        .commit();
    case(
        "group-of-points-empties-probes",
        &["B-010", "C-062"],
        "A group that starts from keyframes and has none of probes empties the volumes.",
        frames,
    );
    let frames = begun.clone().group().probes(true, &[second]).commit();
    case(
        "group-of-one-volume",
        &["B-010", "C-062"],
        "A group that starts from a keyframe of one volume empties all else.",
        frames,
    );
    let frames = begun
        .clone()
        .group_on_state()
        .probes(false, std::slice::from_ref(&first_later))
        .commit();
    case(
        "group-on-state",
        &["B-011", "B-062", "C-063"],
        "A group builds on the state: its delta is one on the last frame.",
        frames,
    );
    let frames = begun
        .clone()
        .probes(true, &[])
        .probes(false, &[])
        .probes(true, &[])
        .commit();
    case(
        "records-of-no-tracks",
        &["B-012", "C-046"],
        "A frame of three records of no tracks leaves all as it is.",
        frames,
    );
    let frames = begun
        .clone()
        .remove(&[1])
        .commit()
        .probes(false, std::slice::from_ref(&second_later))
        .commit();
    case(
        "volume-removed",
        &["C-081", "B-011"],
        "A volume ends with its frame; a delta of the other goes on.",
        frames,
    );
    let frames = begun.remove(&[3]).probes(false, &[first_later]).commit();
    case(
        "volume-removed-beside-a-delta",
        &["C-081", "B-011"],
        "A frame removes a volume with visibility and changes another.",
        frames,
    );
}
