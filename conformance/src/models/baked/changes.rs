//! What records, groups and removals leave of tracks, and records of other models beside them.

use super::{Baked, Drafts, streams};
use crate::generate::Draft;
use crate::generate::frames::Frames;
use crate::generate::plan::moved;
use crate::models::entry::{Entry, tracks};
use crate::models::points::frames::{self as grids, WIDTHS, filled};
use crate::models::points::writer::{Part, points};
use crate::models::probes::expected::Content;
use crate::models::probes::generate::some;
use crate::models::probes::writer::Volume;
use crate::stream_builder::{Pack, group, kind, set_word};

pub(super) fn add<M: Baked>(drafts: &mut Vec<Draft>) {
    let mut drafts = Drafts::<M>::of(drafts);
    follow(&mut drafts);
    refused(&mut drafts);
    others(&mut drafts);
}

fn follow<M: Baked>(drafts: &mut Drafts<'_, M>) {
    let begun = M::put(streams::<M>(2), &[1, 2], 1).commit();
    let put = |frames: &Frames, ids: &[u32]| M::put(frames.clone(), ids, 2);
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        drafts.valid(name, clauses, comment, frames);
    };
    case(
        "declared-alone",
        &["C-079", M::EMPTY],
        "Tracks are declared and have no content.",
        streams::<M>(2).commit(),
    );
    case(
        "replaced",
        &[M::REPLACES],
        "The next frame replaces the content of both tracks.",
        put(&begun, &[1, 2]).commit(),
    );
    case(
        "same-again",
        &[M::REPLACES],
        "The next frame has what is there already.",
        M::put(begun.clone(), &[1, 2], 1).commit(),
    );
    case(
        "one-replaced",
        &[M::REPLACES],
        "The next frame replaces the content of the second track, and the first keeps its own.",
        put(&begun, &[2]).commit().commit(),
    );
    case(
        "one-later",
        &[M::REPLACES, M::EMPTY],
        "The second track has no content in the first frame, and gets some in the next.",
        put(&put(&streams::<M>(2), &[1]).commit(), &[2]).commit(),
    );
    case(
        "two-records",
        &[M::SEVERAL],
        "A frame has two records, that of the later track first.",
        put(&put(&begun, &[2]), &[1]).commit(),
    );
    case(
        "records-of-no-tracks",
        &["C-046", M::SEVERAL],
        "Records of no tracks stand alone, before and after one of two.",
        put(&put(&put(&put(&begun, &[]).commit(), &[]), &[1, 2]), &[]).commit(),
    );
    case(
        "kept",
        &[M::REPLACES, "C-105"],
        "Frames without records of the model keep its content, one with a transform too.",
        begun
            .clone()
            .commit()
            .transforms(&[(1, moved(1.0))])
            .commit(),
    );
    case(
        "group-empties",
        &["C-062", M::EMPTY],
        "A group that starts from keyframes empties all tracks; they are filled again later.",
        put(&begun.clone().group().commit(), &[1, 2]).commit(),
    );
    case(
        "group-of-one",
        &["C-062", M::EMPTY],
        "A group that starts from a keyframe of one track empties the other.",
        put(&begun.clone().group(), &[1]).commit(),
    );
    case(
        "group-on-state",
        &["C-063", M::REPLACES],
        "A group that builds on the state keeps what is not sent.",
        put(&begun.clone().group_on_state(), &[1]).commit(),
    );
    case(
        "declared-again",
        &["C-078", M::REPLACES],
        "A track that is declared again keeps its content.",
        begun.clone().declare(&[M::entry(1)]).commit(),
    );
    case(
        "removed",
        &["C-080", "C-081", M::REPLACES],
        "A track is removed, and the other is replaced in the same frame.",
        put(&begun.clone().remove(&[1]), &[2]).commit().commit(),
    );
    let after = begun.clone().remove(&[1]).commit();
    case(
        "place-of-a-removed-one",
        &["C-081", "C-079", M::EMPTY],
        "A new track where one was removed has no content, and gets some.",
        put(&after.declare(&[M::entry(3)]).commit(), &[3]).commit(),
    );
    for (name, pack) in [("lz4", Pack::Lz4), ("zstd", Pack::Zstd(3))] {
        case(
            &format!("record-in-{name}"),
            &[M::REPLACES],
            "The record is packed as a whole.",
            put(&begun.clone().packed(pack), &[1, 2]).commit(),
        );
    }
}

/// Records of the container that content of the model makes wrong.
fn refused<M: Baked>(drafts: &mut Drafts<'_, M>) {
    let begun = M::put(streams::<M>(2), &[1, 2], 1).commit();
    let other = Entry {
        id: 1,
        ..M::entry(2)
    };
    drafts.invalid(
        (2006, "declared-again-as-another"),
        &["C-075"],
        "Track 1 is declared again with the coding and the parameters of track 2.",
        begun.clone().refused_of(kind::TRACK, &tracks(&[other])),
    );
    drafts.invalid(
        (4006, "no-tracks-open-a-frame"),
        &["C-061", "C-046", "C-044"],
        "A record of no tracks opens a frame, in which no group may start.",
        M::put(begun, &[], 1).refused_of(kind::GROUP, &group(0, 0, 0)),
    );
}

/// Track 1 of the model, track 2 of points, track 3 of probes.
fn mixed<M: Baked>() -> (Frames, Part, Content) {
    let volume = Volume::packed([2, 2, 2]);
    let grid = grids::entry(2, WIDTHS[0]);
    let entries = [
        M::entry(1),
        grid.clone(),
        Entry::of_volume(3, volume.clone()),
    ];
    let part = filled(&grid, &[(1, 3, grids::some(&grid, 9, 2))]);
    let content = Content::new(3, some(&volume, 1));
    (Frames::new(&entries), part, content)
}

/// Records that name a track of another model, and frames of several models.
fn others<M: Baked>(drafts: &mut Drafts<'_, M>) {
    let name = M::NAME;
    let (frames, part, probes) = mixed::<M>();
    let record = M::payload(&frames, &[1], 1);
    let of = |id| {
        let mut record = record.clone();
        set_word(&mut record, 16, id);
        record
    };
    for (id, model) in [(2, "points"), (3, "probes")] {
        let comment = format!("A record of {name} names a track of {model}.");
        let error = (2027, &*format!("{name}-of-{model}"));
        drafts.refused(error, &["B-017"], &comment, frames.clone(), &of(id));
    }
    let mut wrong = of(2);
    set_word(&mut wrong, 20, u32::MAX);
    set_word(&mut wrong, 24, 1);
    drafts.refused(
        (2027, "order-model-then-reserved"),
        &["B-017", M::RESERVED.1, "C-112"],
        "The model of a track is checked before its reserved field and its size.",
        frames.clone(),
        &wrong,
    );
    drafts.refused(
        (2027, "order-model-then-twice"),
        &["B-017", M::IDS, "C-112"],
        "The model of a track is checked before it is found to be in the frame already.",
        frames.clone().keyframe(std::slice::from_ref(&part)),
        &of(2),
    );
    let own = Part {
        id: 1,
        ..part.clone()
    };
    drafts.invalid(
        (2027, &format!("points-of-{name}")),
        &["B-017"],
        &format!("A record of points names a track of {name}."),
        frames.clone().refused(&points(None, &[own])),
    );
    let all = M::put(frames, &[1], 1)
        .keyframe(std::slice::from_ref(&part))
        .probes(true, std::slice::from_ref(&probes))
        .transforms(&[(1, moved(1.0)), (3, moved(3.0))])
        .commit();
    drafts.valid(
        "beside-points-and-probes",
        &[M::SEVERAL, "B-012", "C-105"],
        "A frame has content of three models, with transforms.",
        all.clone(),
    );
    drafts.valid(
        "others-alone",
        &[M::REPLACES, "B-012"],
        "A frame of points alone leaves the content of the other models.",
        all.clone().delta(std::slice::from_ref(&part)).commit(),
    );
    drafts.valid(
        "alone",
        &[M::REPLACES, "B-012"],
        "A frame of this model alone leaves the content of the others.",
        M::put(all, &[1], 2).commit(),
    );
}
