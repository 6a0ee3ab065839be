//! The memory of regions, clause R-004.

use super::{Content, Draft, Set, invalid, some, valid};
use crate::generate::frames::Frames;
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{HEADER, StreamBuilder, commit, group, kind};

pub fn add(drafts: &mut Vec<Draft>) {
    let of = |count, capacity| Set {
        capacity,
        ..Set::packed(count)
    };
    let cases: [(&str, Vec<Entry>, u64, &str); 5] = [
        (
            "one-region",
            vec![Entry::of_set(1, of(1, 63))],
            96 + 63 * 8,
            "One region.",
        ),
        (
            "raw",
            vec![Entry::of_set(1, Set::raw(5))],
            5 * 96 + 5 * 63 * 8,
            "Five raw regions.",
        ),
        (
            "long-path",
            vec![Entry {
                path: vec![b'x'; 200],
                ..Entry::of_set(1, of(3, 189))
            }],
            3 * 96 + 189 * 8,
            "A path of 200 bytes counts nothing.",
        ),
        (
            "two-tracks",
            vec![
                Entry::of_set(1, of(2, 126)),
                Entry::of_set(2, Set::raw(1).of_one()),
            ],
            3 * 96 + (126 + 63) * 8,
            "Two tracks of a record count together.",
        ),
        (
            "regions-and-grid",
            vec![Entry::new(1), Entry::of_set(2, of(4, 252))],
            5 * 32 + 6 * 36 + 4 * 96 + 252 * 8,
            "Regions count with the buckets and cells of a grid.",
        ),
    ];
    for (name, entries, bytes, comment) in cases {
        let contents = entries.iter();
        let contents = contents.filter_map(|e| Some(Content::new(e.id, some(e.set()?, 1))));
        let contents: Vec<Content> = contents.collect();
        let frames = Frames::new(&entries).regions(&contents).commit();
        let name_at = format!("state-{name}-at-limit");
        let comment_at = format!("{comment} The limit is just enough.");
        let at = valid(&name_at, &["R-004", "C-076"], &comment_at, &frames);
        drafts.push(at.limit("state_bytes", bytes));
        let name = format!("state-{name}-above-limit");
        let comment = format!("{comment} The limit is one too low.");
        let above = invalid((2018, &name), &["C-076"], &comment, declared(&entries));
        drafts.push(above.limit("state_bytes", bytes - 1));
    }
    // A claim takes no memory.
    let most = Set::packed(1 << 20);
    for (name, count, comment) in [
        (
            "2-20-regions",
            1,
            "2^20 regions with all the pairs that they may have: 629 MB.",
        ),
        ("forty-times", 40, "Forty tracks of 2^20 regions."),
    ] {
        let entries: Vec<Entry> = (1..=count)
            .map(|id| Entry::of_set(id, most.clone()))
            .collect();
        let name = format!("state-{name}");
        let refused = declared(&entries);
        drafts.push(invalid(
            (2018, &name),
            &["C-076", "R-001"],
            comment,
            refused,
        ));
    }
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
