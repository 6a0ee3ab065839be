//! The memory of volumes, clause B-006.

use super::{Content, Draft, Frames, Volume, invalid, some, valid};
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{HEADER, StreamBuilder, commit, group, kind};

pub fn add(drafts: &mut Vec<Draft>) {
    let at = |volume: Volume| vec![Entry::of_volume(1, volume)];
    let cases: [(&str, Vec<Entry>, u64, &str); 8] = [
        (
            "one-probe",
            at(Volume::raw([1, 1, 1])),
            184,
            "One raw probe.",
        ),
        (
            "one-packed-probe",
            at(Volume::packed([1, 1, 1])),
            184,
            "One packed probe.",
        ),
        (
            "side-4",
            at(Volume::packed([3, 2, 2]).seeing(4)),
            12 * (184 + 2 * 32),
            "12 probes with maps of 4 x 4, twice.",
        ),
        (
            "side-8",
            at(Volume::raw([3, 2, 2]).seeing(8)),
            12 * (184 + 128),
            "12 probes with maps of 8 x 8.",
        ),
        (
            "side-16",
            at(Volume::packed([3, 2, 2]).seeing(16)),
            12 * (184 + 2 * 512),
            "12 probes with maps of 16 x 16, twice.",
        ),
        (
            "long-path",
            vec![Entry {
                path: vec![b'x'; 200],
                ..Entry::of_volume(1, Volume::raw([2, 1, 1]))
            }],
            2 * 184,
            "A path of 200 bytes counts nothing.",
        ),
        (
            "two-volumes",
            vec![
                Entry::of_volume(1, Volume::raw([2, 1, 1])),
                Entry::of_volume(2, Volume::packed([1, 3, 1]).seeing(4)),
            ],
            2 * 184 + 3 * (184 + 2 * 32),
            "Two volumes of a record count together.",
        ),
        (
            "volume-and-grid",
            vec![
                Entry::new(1),
                Entry::of_volume(2, Volume::packed([2, 2, 1])),
            ],
            5 * 32 + 6 * 36 + 4 * 184,
            "A volume counts with the buckets and cells of a grid.",
        ),
    ];
    for (name, entries, bytes, comment) in cases {
        let contents: Vec<Content> = entries
            .iter()
            .filter_map(|entry| Some(Content::new(entry.id, some(entry.volume()?, 1))))
            .collect();
        let frames = Frames::new(&entries).probes(true, &contents).commit();
        let name_at = format!("state-{name}-at-limit");
        let comment_at = format!("{comment} The limit is just enough.");
        drafts.push(
            valid(&name_at, &["B-006", "C-076"], &comment_at, frames).limit("state_bytes", bytes),
        );
        let name = format!("state-{name}-above-limit");
        let comment = format!("{comment} The limit is one too low.");
        let draft = invalid((2018, &name), &["C-076"], &comment, declared(&entries));
        drafts.push(draft.limit("state_bytes", bytes - 1));
    }
    // Sums beyond 32 and 64 bits: a claim takes no memory.
    let most = Volume::packed([4096, 4096, 1]);
    for (name, count, volume, comment) in [
        (
            "2-24-probes",
            1,
            most.clone(),
            "2^24 probes, which is as many as there may be, and beyond the default limit.",
        ),
        (
            "2-24-probes-seeing",
            1,
            most.clone().seeing(16),
            "2^24 probes with maps of 16 x 16, twice: 20.3 GB.",
        ),
        (
            "forty-times",
            40,
            most.seeing(16),
            "Forty volumes of 2^24 probes.",
        ),
    ] {
        let entries: Vec<Entry> = (1..=count)
            .map(|id| Entry::of_volume(id, volume.clone()))
            .collect();
        let error = (2018, format!("state-{name}"));
        drafts.push(invalid(
            (error.0, &error.1),
            &["C-076", "B-001"],
            comment,
            declared(&entries),
        ));
    }
    let entries = [Entry::of_volume(1, Volume::raw([4, 1, 1]))];
    let again = [Entry::of_volume(2, Volume::raw([4, 1, 1]))];
    let frames = Frames::new(&entries)
        .commit()
        .remove(&[1])
        .commit()
        .declare(&again)
        .commit();
    let comment = "A volume takes the place of one that was removed.";
    drafts.push(
        valid(
            "state-removed-after-commit",
            &["B-006", "C-076"],
            comment,
            frames,
        )
        .limit("state_bytes", 4 * 184),
    );
    let frames = Frames::new(&entries).commit().remove(&[1]);
    let refused = frames.refused_of(kind::TRACK, &tracks(&again));
    let comment = "A removed volume counts until the commit that ends it.";
    drafts.push(
        invalid(
            (2018, "state-removed-until-commit"),
            &["C-076"],
            comment,
            refused,
        )
        .limit("state_bytes", 4 * 184),
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
