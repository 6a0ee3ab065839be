//! Frames that follow each other, groups, removal, and other models: clauses V-010 and B-017.

use super::{Draft, Section, Vertices, invalid, ordered, payload, some, two, valid};
use crate::generate::frames::Frames;
use crate::generate::plan::moved;
use crate::models::entry::Entry;
use crate::models::points::frames::{self, WIDTHS, filled};
use crate::models::points::writer::Part;
use crate::models::probes::expected::Content;
use crate::models::probes::writer::Volume;
use crate::stream_builder::kind;

pub fn add(drafts: &mut Vec<Draft>) {
    follow(drafts);
    others(drafts);
}

fn follow(drafts: &mut Vec<Draft>) {
    let (frames, contents) = two();
    let begun = frames.vertices(&contents).commit();
    let tracks = [Vertices::packed(5).two(), Vertices::raw(3).five()];
    let other = [1, 2].map(|id| (id, some(&tracks[id as usize - 1], 7)));
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        drafts.push(valid(name, clauses, comment, &frames));
    };
    case(
        "declared-alone",
        &["C-079", "V-040"],
        "Tracks without content are open.",
        two().0.commit(),
    );
    case(
        "replaced",
        &["V-010"],
        "The next frame replaces all values.",
        begun.clone().vertices(&other).commit(),
    );
    case(
        "one-replaced",
        &["V-010"],
        "The next frame replaces those of the second track, and the first keeps its own.",
        begun.clone().vertices(&other[1..]).commit(),
    );
    case(
        "two-records",
        &["V-010"],
        "A frame of two records, that of the later track first.",
        begun
            .clone()
            .vertices(&other[1..])
            .vertices(&other[..1])
            .commit(),
    );
    case(
        "kept",
        &["V-010"],
        "Frames without content keep all values.",
        begun
            .clone()
            .commit()
            .transforms(&[(1, moved(1.0))])
            .commit(),
    );
    case(
        "group-empties",
        &["C-062", "V-040"],
        "A group that starts from keyframes without content opens all tracks.",
        begun.clone().group().commit(),
    );
    case(
        "group-of-one",
        &["C-062", "V-010"],
        "A group that starts from a keyframe of one track opens the other.",
        begun.clone().group().vertices(&other[..1]).commit(),
    );
    case(
        "group-on-state",
        &["C-063", "V-010"],
        "A group on the state keeps what is not sent.",
        begun
            .clone()
            .group_on_state()
            .vertices(&other[..1])
            .commit(),
    );
    case(
        "removed",
        &["C-081"],
        "A track ends with its frame; the other goes on.",
        begun
            .clone()
            .remove(&[1])
            .vertices(&other[1..])
            .commit()
            .commit(),
    );
    let again = Entry::of_vertices(3, Vertices::raw(4));
    case(
        "place-of-a-removed-one",
        &["C-081", "C-079"],
        "A new track where one was removed is open.",
        begun.remove(&[1]).commit().declare(&[again]).commit(),
    );
}

/// Track 1 of vertices, track 2 of points, track 3 of probes.
fn mixed() -> (Frames, Vec<u8>, Part, Content) {
    let vertices = Vertices::packed(4);
    let volume = Volume::packed([2, 2, 2]);
    let grid = frames::entry(2, WIDTHS[0]);
    let entries = [
        Entry::of_vertices(1, vertices.clone()),
        grid.clone(),
        Entry::of_volume(3, volume.clone()),
    ];
    let part = filled(&grid, &[(1, 3, frames::some(&grid, 9, 2))]);
    let probes = crate::models::probes::generate::some(&volume, 1);
    let content = Content::new(3, probes);
    (Frames::new(&entries), some(&vertices, 1), part, content)
}

/// Records that name a track of another model, and frames of all models.
fn others(drafts: &mut Vec<Draft>) {
    let (frames, codes, part, probes) = mixed();
    let section = |id: u32| Section {
        id,
        bytes: codes.clone(),
        ..Section::default()
    };
    for (id, model) in [(2, "points"), (3, "probes")] {
        let record = payload(&[section(id)]);
        let refused = frames.clone().refused_of(kind::VERTICES, &record);
        let comment = format!("A record of vertices names a track of {model}.");
        let name = format!("vertices-of-{model}");
        drafts.push(invalid((2027, &name), &["B-017"], &comment, refused));
    }
    let mut wrong = section(2);
    wrong.reserved = 1;
    let refused = frames
        .clone()
        .refused_of(kind::VERTICES, &payload(&[wrong]));
    let comment = "The model of a track is checked before its reserved field.";
    let clauses = ["B-017", "V-012"];
    drafts.push(ordered(
        (2027, "model-then-reserved"),
        &clauses,
        comment,
        refused,
    ));
    let own = Part {
        id: 1,
        ..part.clone()
    };
    let record = crate::models::points::writer::points(None, &[own]);
    let refused = frames.clone().refused(&record);
    let comment = "A record of points names a track of vertices.";
    drafts.push(invalid(
        (2027, "points-of-vertices"),
        &["B-017"],
        comment,
        refused,
    ));
    let all = frames
        .vertices(&[(1, codes.clone())])
        .keyframe(std::slice::from_ref(&part))
        .probes(true, std::slice::from_ref(&probes))
        .transforms(&[(1, moved(1.0)), (3, moved(3.0))])
        .commit();
    drafts.push(valid(
        "all-models",
        &["V-010", "C-105"],
        "A frame of vertices, points and probes, with transforms.",
        &all,
    ));
    let next = all.clone().delta(std::slice::from_ref(&part)).commit();
    drafts.push(valid(
        "others-leave-vertices",
        &["V-010", "B-012"],
        "A frame of points alone leaves the vertices.",
        &next,
    ));
    let next = all.vertices(&[(1, vec![0, 1, 2, 3])]).commit();
    drafts.push(valid(
        "vertices-leave-others",
        &["V-010", "B-012"],
        "A frame of vertices alone leaves points and probes.",
        &next,
    ));
}
