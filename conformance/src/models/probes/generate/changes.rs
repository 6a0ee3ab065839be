//! What keyframes, deltas and groups make of what was there, clauses B-010 to B-012, B-061, B-062.

use super::{Content, Draft, Frames, Volume, seen, some, streams, valid};
use crate::models::probes::writer::Probe;
use crate::stream_builder::kind;

pub fn add(drafts: &mut Vec<Draft>) {
    for (coding, volume) in [
        ("raw", Volume::raw([3, 2, 2]).seeing(8)),
        ("packed", Volume::packed([3, 2, 2]).seeing(8)),
    ] {
        frames(drafts, coding, &volume);
        visibility(drafts, coding, &volume);
    }
    digests(drafts);
}

fn frames(drafts: &mut Vec<Draft>, coding: &str, volume: &Volume) {
    let first = some(volume, 1);
    let later = super::later(volume, &first, 2);
    let other = some(volume, 3);
    let content = |probes: &[Probe]| [Content::new(1, probes.to_vec())];
    let begun = streams(std::slice::from_ref(volume))
        .probes(true, &content(&first))
        .commit();
    let none = vec![Probe::ABSENT; volume.count()];
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        let name = format!("{name}-{coding}");
        drafts.push(valid(&name, clauses, comment, frames));
    };
    case(
        "keyframe-replaces",
        &["B-010"],
        "A keyframe replaces all that was there.",
        begun.clone().probes(true, &content(&other)).commit(),
    );
    case(
        "keyframe-empties",
        &["B-010"],
        "A keyframe without a present probe empties its track.",
        begun.clone().probes(true, &content(&none)).commit(),
    );
    case(
        "keyframe-then-delta",
        &["B-010", "B-011"],
        "A delta on a second keyframe.",
        begun
            .clone()
            .probes(true, &content(&other))
            .commit()
            .probes(false, &content(&first))
            .commit(),
    );
    case(
        "delta-of-nothing",
        &["B-011"],
        "A delta in which nothing changes, and a frame without a record.",
        begun
            .clone()
            .probes(false, &content(&first))
            .commit()
            .commit(),
    );
    case(
        "delta-empties",
        &["B-011"],
        "A delta in which all probes become absent, and one in which they come back.",
        begun
            .clone()
            .probes(false, &content(&none))
            .commit()
            .probes(false, &content(&later))
            .commit(),
    );
    case(
        "delta-of-a-track-that-never-came",
        &["B-011"],
        "A delta is the first that comes of a track.",
        streams(std::slice::from_ref(volume))
            .commit()
            .probes(false, &content(&later))
            .commit(),
    );
    case(
        "group-empties",
        &["B-010", "C-062"],
        "A group that starts from keyframes, without one of the volume, empties it.",
        begun
            .clone()
            .group()
            .commit()
            .probes(false, &content(&later))
            .commit(),
    );
    let two = [volume.clone(), volume.clone()];
    let both = [
        Content::new(1, first.clone()),
        Content::new(2, other.clone()),
    ];
    let begun = streams(&two).probes(true, &both).commit();
    case(
        "keyframe-of-one-track",
        &["B-010"],
        "A keyframe of one track leaves the other, and transforms.",
        begun
            .clone()
            .transforms(&[(1, crate::generate::plan::moved(2.0))])
            .commit()
            .probes(true, &[Content::new(2, later.clone())])
            .commit(),
    );
    case(
        "keyframe-and-delta-in-a-frame",
        &["B-010", "B-011", "B-012"],
        "A keyframe of one track and a delta of the other, in a frame.",
        begun
            .clone()
            .probes(true, &[Content::new(2, later.clone())])
            .probes(false, &[Content::new(1, later.clone())])
            .commit(),
    );
    case(
        "two-deltas-in-a-frame",
        &["B-011", "B-012"],
        "Two deltas of a frame, each on the last frame.",
        begun
            .probes(false, &[Content::new(2, first)])
            .probes(false, &[Content::new(1, other)])
            .commit(),
    );
}

/// The visibility block comes, stays, is replaced and goes (B-061).
fn visibility(drafts: &mut Vec<Draft>, coding: &str, volume: &Volume) {
    let first = some(volume, 1);
    let later = super::later(volume, &first, 2);
    let with = |probes: &[Probe], seed| {
        [Content {
            visibility: Some(seen(volume, seed)),
            ..Content::new(1, probes.to_vec())
        }]
    };
    let without = |probes: &[Probe]| [Content::new(1, probes.to_vec())];
    let begun = streams(std::slice::from_ref(volume))
        .probes(true, &with(&first, 5))
        .commit();
    let mut case = |name: &str, clauses: &[&'static str], comment: &str, frames: Frames| {
        let name = format!("visibility-{name}-{coding}");
        drafts.push(valid(&name, clauses, comment, frames));
    };
    case(
        "stays",
        &["B-061", "B-011", "B-062"],
        "A delta without a visibility block keeps it, so does a frame without a record.",
        begun
            .clone()
            .probes(false, &without(&later))
            .commit()
            .commit(),
    );
    case(
        "comes-again",
        &["B-061", "B-011"],
        "A delta brings another visibility block, with probes that do not change.",
        begun.clone().probes(false, &with(&first, 6)).commit(),
    );
    case(
        "goes",
        &["B-010", "B-061"],
        "A keyframe without a visibility block leaves none.",
        begun.clone().probes(true, &without(&later)).commit(),
    );
    case(
        "is-replaced",
        &["B-010", "B-061"],
        "A keyframe brings another visibility block.",
        begun.clone().probes(true, &with(&later, 7)).commit(),
    );
    case(
        "comes-late",
        &["B-061", "B-011"],
        "The visibility block comes with a delta.",
        streams(std::slice::from_ref(volume))
            .probes(true, &without(&first))
            .commit()
            .probes(false, &with(&later, 8))
            .commit(),
    );
    case(
        "goes-with-the-group",
        &["B-061", "C-062"],
        "A group that starts from keyframes empties the track of its visibility too.",
        begun.clone().group().commit(),
    );
    case(
        "without-probes",
        &["B-061", "B-062"],
        "A visibility block of a volume without a present probe.",
        streams(std::slice::from_ref(volume))
            .probes(true, &with(&vec![Probe::ABSENT; 12], 9))
            .commit(),
    );
}

/// A wrong digest of probes, and the same state in different forms.
fn digests(drafts: &mut Vec<Draft>) {
    let volume = Volume::packed([2, 1, 1]).seeing(4);
    let probes = some(&volume, 91);
    let content = [Content {
        visibility: Some(seen(&volume, 5)),
        ..Content::new(1, probes.clone())
    }];
    let frames = streams(std::slice::from_ref(&volume)).probes(true, &content);
    // The digest of a state that differs in one thing.
    let mut case = |name: &str, comment: &str, change: fn(&mut Content)| {
        let mut other = content.clone();
        change(&mut other[0]);
        let state = streams(std::slice::from_ref(&volume))
            .probes(true, &other)
            .commit()
            .digest();
        let payload = crate::stream_builder::commit(0, 0, Some(state));
        let refused = frames.clone().refused_of(kind::COMMIT, &payload);
        drafts.push(super::invalid(
            (4005, &format!("digest-{name}")),
            &["C-090"],
            comment,
            refused,
        ));
    };
    case(
        "last-code",
        "The digest is that of a state whose last code differs.",
        |c| {
            c.probes[1] = Probe::new(3, &c.probes[1].codes);
            c.probes[1].codes[26] = 3;
        },
    );
    case(
        "level",
        "The digest is that of a state with another level, and the same codes.",
        |c| {
            c.probes[0] = Probe::new(2, &[1]);
        },
    );
    case(
        "visibility",
        "The digest is that of a state whose last byte of visibility differs.",
        |c| {
            let bytes = c.visibility.iter_mut().flatten();
            bytes.for_each(|byte| *byte ^= 1);
        },
    );
    case(
        "no-visibility",
        "The digest is that of a state without visibility.",
        |c| c.visibility = None,
    );
    case(
        "absent",
        "The digest is that of a state with a probe less.",
        |c| {
            c.probes[1] = Probe::ABSENT;
            c.probes[0] = Probe::new(1, &[4]);
        },
    );
}
