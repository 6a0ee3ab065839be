//! Faults in the base and the track ids of a record, clauses P-012 and P-013.

use super::{AREA, Draft, content, started};
use crate::generate::frames::Frames;
use crate::models::points::frames::{WIDTHS, entry, filled, some};
use crate::models::points::writer::{Part, points};

pub fn add(drafts: &mut Vec<Draft>) {
    bases(drafts);
    ids(drafts);
}

/// Deltas on another frame than the last (P-012).
fn bases(drafts: &mut Vec<Draft>) {
    let (frames, entry) = started(WIDTHS[0]);
    let parts = [Part::of(&entry).cell(1, 3, &some(&entry, 2, 2))];
    // Frames 0, 1 and 2 are committed; the record is of frame 3.
    let frames = frames.delta(&parts).commit().delta(&parts).commit();
    let mut case = |name: &str, frames: &Frames, base: u32, comment: &str| {
        let payload = points(Some(base), &parts);
        let (offset, bytes) = frames.clone().refused(&payload);
        drafts.push(Draft::invalid(
            AREA,
            (4001, name),
            offset,
            &["P-012"],
            comment,
            bytes,
        ));
    };
    let comment = "The base is the last frame but one.";
    case("last-frame-but-one", &frames, 1, comment);
    case(
        "first-frame",
        &frames,
        0,
        "The base is frame 0 and the last is frame 2.",
    );
    case(
        "own-frame",
        &frames,
        3,
        "The base is the frame that the record is in.",
    );
    case("maximum", &frames, u32::MAX, "The base is 2^32 - 1.");
    case(
        "bit-16",
        &frames,
        0x1_0002,
        "The base agrees with the last frame in its low 16 bits.",
    );
    let skipped = frames.clone().numbered(9).commit();
    let comment = "The base is a frame number that was left out.";
    case("left-out-frame", &skipped, 8, comment);
    let comment = "A group that starts from keyframes begins with a delta on the last frame.";
    case("first-of-a-group", &frames.clone().group(), 2, comment);
    let comment = "A delta stands after a keyframe in the first frame of a group.";
    let two = [entry.clone(), self::entry(8, WIDTHS[0])];
    let keyed = frames.clone().declare(&two).group();
    let keyed = keyed.keyframe(&[content(&two[1])]);
    case("after-a-keyframe-of-the-group", &keyed, 2, comment);
    let unstarted = Frames::new(std::slice::from_ref(&entry));
    case(
        "no-frame",
        &unstarted,
        0,
        "The first frame of the stream is a delta on frame 0.",
    );
    let comment = "The first frame of the stream is a delta on frame 2^32 - 1.";
    case("no-frame-maximum", &unstarted, u32::MAX, comment);
    let empty = points(Some(1), &[]);
    let (offset, bytes) = frames.refused(&empty);
    drafts.push(Draft::invalid(
        AREA,
        (4001, "no-tracks"),
        offset,
        &["P-012"],
        "A delta of no tracks has the last frame but one as its base.",
        bytes,
    ));
}

/// Ids that do not ascend, are not live or come twice (P-013).
fn ids(drafts: &mut Vec<Draft>) {
    let entries = [3, 5, 9].map(|id| entry(id, WIDTHS[0]));
    let part = |id| Part {
        id,
        ..filled(&entries[0], &[(3, 9, some(&entries[0], 1, 2))])
    };
    let all = [part(3), part(5), part(9)];
    let frames = Frames::new(&entries).keyframe(&all).commit();
    let mut case = |id, name: &str, frames: &Frames, keyframe, parts: &[Part], comment: &str| {
        let (offset, bytes) = frames.clone().refused(&frames.payload(keyframe, parts));
        drafts.push(Draft::invalid(
            AREA,
            (id, name),
            offset,
            &["P-013"],
            comment,
            bytes,
        ));
    };
    for (name, keyframe) in [("keyframe", true), ("delta", false)] {
        let mut two = |id, what: &str, ids: &[u32], comment: &str| {
            let parts: Vec<Part> = ids.iter().map(|&id| part(id)).collect();
            case(
                id,
                &format!("{what}-{name}"),
                &frames,
                keyframe,
                &parts,
                comment,
            );
        };
        two(2004, "equal-ids", &[5, 5], "A track is in the table twice.");
        two(
            2004,
            "descending-ids",
            &[3, 9, 5],
            "The last id is below the one before.",
        );
        two(
            2019,
            "first-id-unknown",
            &[2, 5],
            "The first track was never declared.",
        );
        two(
            2019,
            "last-id-unknown",
            &[5, 10],
            "The last track was never declared.",
        );
        two(
            2019,
            "id-between-unknown",
            &[3, 4, 5],
            "A track between two others was never declared.",
        );
        two(2019, "id-0-unknown", &[0], "Track 0 was never declared.");
        two(
            2019,
            "id-maximum-unknown",
            &[9, u32::MAX],
            "Track 2^32 - 1 was never declared.",
        );
    }
    let removed = frames.clone().remove(&[5]);
    let parts = [part(3), part(5)];
    let comment = "A track is removed in the same frame, before the record.";
    case(
        2019,
        "removed-in-the-frame",
        &removed,
        true,
        &parts,
        comment,
    );
    let comment = "A track was removed, and the frame that ended it is committed.";
    case(
        2019,
        "removed-before",
        &removed.commit(),
        false,
        &parts,
        comment,
    );
    for (what, first, second) in [
        ("two-keyframes", true, true),
        ("two-deltas", false, false),
        ("keyframe-and-delta", true, false),
        ("delta-and-keyframe", false, true),
    ] {
        let open = match first {
            true => frames.clone().keyframe(&[part(3), part(9)]),
            false => frames.clone().delta(&[part(3), part(9)]),
        };
        let comment = "A frame has a track in two records.";
        case(4010, what, &open, second, &[part(5), part(9)], comment);
    }
    let empty = Part::of(&entries[1]);
    let open = frames.clone().delta(std::slice::from_ref(&empty));
    let comment = "A frame has a track in two records, both without content.";
    case(4010, "two-empty-parts", &open, false, &[empty], comment);
    let open = frames.delta(&[part(3)]).delta(&[part(5)]);
    let comment = "The track of a frame's first record is in the third again.";
    case(
        4010,
        "first-and-third-record",
        &open,
        false,
        &[part(3)],
        comment,
    );
}
