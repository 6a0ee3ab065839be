//! The memory of tracks, clause V-002.

use super::{Draft, Vertices, invalid, some, valid};
use crate::generate::frames::Frames;
use crate::models::entry::{Entry, tracks};
use crate::models::probes::writer::Volume;
use crate::stream_builder::{HEADER, StreamBuilder, commit, group, kind};

pub fn add(drafts: &mut Vec<Draft>) {
    let of = |list: &[Vertices]| -> Vec<Entry> {
        let numbered = (1..).zip(list.iter().cloned());
        numbered.map(|(id, v)| Entry::of_vertices(id, v)).collect()
    };
    let raw = Vertices::raw;
    let with_volume = [
        Entry::of_vertices(1, raw(3)),
        Entry::of_volume(2, Volume::raw([1, 1, 1])),
    ];
    let cases: [(&str, Vec<Entry>, u64, &str); 8] = [
        ("one-vertex", of(&[raw(1)]), 8, "One vertex counts as four."),
        ("four-vertices", of(&[raw(4)]), 8, "Four vertices."),
        (
            "five-vertices",
            of(&[raw(5)]),
            16,
            "Five vertices count as eight.",
        ),
        (
            "five-bits",
            of(&[raw(8).five()]),
            16,
            "Values of 5 bits count as those of 8.",
        ),
        (
            "two-signals",
            of(&[Vertices::packed(5).two()]),
            24,
            "Five vertices with two signals count as twelve.",
        ),
        (
            "two-tracks",
            of(&[raw(5), Vertices::packed(2)]),
            24,
            "Two tracks of a record count together.",
        ),
        (
            "with-a-volume",
            with_volume.to_vec(),
            8 + 184,
            "A track counts with the probes of a volume.",
        ),
        (
            "long-path",
            vec![Entry {
                path: vec![b'x'; 200],
                ..Entry::of_vertices(1, raw(4))
            }],
            8,
            "A path of 200 bytes counts nothing.",
        ),
    ];
    for (name, entries, bytes, comment) in cases {
        let contents: Vec<(u32, Vec<u8>)> = entries
            .iter()
            .filter_map(|entry| Some((entry.id, some(entry.vertices()?, 1))))
            .collect();
        let frames = Frames::new(&entries).vertices(&contents).commit();
        let at = format!("state-{name}-at-limit");
        let comment_at = format!("{comment} The limit is just enough.");
        let draft = valid(&at, &["V-002", "C-076"], &comment_at, &frames);
        drafts.push(draft.limit("state_bytes", bytes));
        let above = format!("state-{name}-above-limit");
        let comment = format!("{comment} The limit is one too low.");
        let draft = invalid((2018, &above), &["C-076"], &comment, declared(&entries));
        drafts.push(draft.limit("state_bytes", bytes - 1));
    }
    // Sums beyond 32 bits: a claim takes no memory.
    let most = raw(1 << 28).two();
    for (name, count, comment) in [
        (
            "two-2-28",
            1,
            "2^28 vertices with two signals, beyond the default limit.",
        ),
        (
            "two-2-28-nine-times",
            9,
            "Nine such tracks: more values than 32 bits count.",
        ),
    ] {
        let entries = of(&vec![most.clone(); count]);
        let name = format!("state-{name}");
        let clauses = ["C-076", "V-001"];
        let draft = invalid((2018, &name), &clauses, comment, declared(&entries));
        let draft = match count {
            1 => draft,
            _ => draft.limit("state_bytes", u64::MAX),
        };
        drafts.push(draft);
    }
    removed(drafts);
}

/// Tracks that take the place of one that was removed.
fn removed(drafts: &mut Vec<Draft>) {
    let first = [Entry::of_vertices(1, Vertices::raw(8))];
    let again = [
        Entry::of_vertices(2, Vertices::raw(3)),
        Entry::of_vertices(3, Vertices::raw(4)),
    ];
    let begun = Frames::new(&first)
        .vertices(&[(1, vec![9; 8])])
        .commit()
        .remove(&[1]);
    let frames = begun.clone().commit().declare(&again).commit();
    let comment = "Two tracks take the place of one that was removed, open.";
    drafts.push(
        valid(
            "state-removed-after-commit",
            &["V-002", "C-076"],
            comment,
            &frames,
        )
        .limit("state_bytes", 16),
    );
    let refused = begun.refused_of(kind::TRACK, &tracks(&again));
    let comment = "A removed track counts until the commit that ends it.";
    drafts.push(
        invalid(
            (2018, "state-removed-until-commit"),
            &["C-076"],
            comment,
            refused,
        )
        .limit("state_bytes", 16),
    );
}

/// A stream whose tracks are refused.
fn declared(entries: &[Entry]) -> (usize, Vec<u8>) {
    let mut builder = StreamBuilder::started();
    builder.put(kind::TRACK, &tracks(entries));
    let offset = builder.last() + HEADER;
    builder
        .put(kind::GROUP, &group(0, 0, 0))
        .put(kind::COMMIT, &commit(0, 0, None));
    (offset, builder.ended())
}
