//! The usual stream as a list of records: a vector alters one of them, and the rest still fits, so
//! that a decoder which misses the fault comes to a good end.

use super::{Draft, expected};
use crate::models::entry::{Entry, tracks};
use crate::models::points::writer::{Part, points};
use crate::stream_builder::{
    HEADER, Header, IDENTITY, Pack, StreamBuilder, commit, group, kind, removal, transforms, words,
};

/// The area of all vectors that are built from here.
pub const AREA: &str = "container";

/// Records before an `end`.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// Type and payload of each.
    pub records: Vec<(u16, Vec<u8>)>,
}

/// Places of the records of [`Plan::usual`].
pub mod at {
    pub const STREAM: usize = 0;
    pub const TRACK: usize = 1;
    pub const GROUP: usize = 2;
    pub const POINTS: usize = 3;
    pub const TRANSFORMS: usize = 4;
    pub const COMMIT: usize = 5;
    pub const DELTA: usize = 6;
    pub const SECOND_TRANSFORMS: usize = 7;
    pub const SECOND_COMMIT: usize = 8;
    pub const REMOVE: usize = 9;
    pub const THIRD_COMMIT: usize = 10;
    /// The `end`, which a plan does not list.
    pub const END: usize = 11;
}

impl Plan {
    /// A plan from its records.
    pub fn of(records: impl IntoIterator<Item = (u16, Vec<u8>)>) -> Plan {
        let records = records.into_iter().collect();
        Plan { records }
    }

    /// Each defined type at least once: tracks 1 and 2; frame 1 from keyframes, with transforms;
    /// frame 2 of a delta and a transform; frame 3, with which track 1 ends.
    pub fn usual() -> Plan {
        let [first, second] = two_tracks();
        let keyframe = points(None, &[cell(&first, 0, 5, 200), cell(&second, 0, 7, 100)]);
        Plan::of([
            (kind::STREAM, words(&[60, 1])),
            (kind::TRACK, tracks(&[first.clone(), second])),
            (kind::GROUP, group(0, 0, 0)),
            (kind::POINTS, keyframe),
            (
                kind::TRANSFORMS,
                transforms(&[(1, moved(1.0)), (2, moved(2.0))]),
            ),
            (kind::COMMIT, commit(3, 1, None)),
            (kind::POINTS, points(Some(1), &[cell(&first, 1, 6, 50)])),
            (kind::TRANSFORMS, transforms(&[(2, moved(3.0))])),
            (kind::COMMIT, commit(4, 2, None)),
            (kind::TRACK_REMOVE, removal(&[1])),
            (kind::COMMIT, commit(5, 3, None)),
        ])
    }

    /// The stream with one header changed; with its `end` only if that is the one.
    pub fn builder(&self, at: usize, change: impl FnOnce(&mut Header)) -> StreamBuilder {
        let mut change = Some(change);
        let mut builder = StreamBuilder::new();
        for (index, (record_type, payload)) in self.records.iter().enumerate() {
            let change = change.take_if(|_| index == at);
            builder.put_with(*record_type, Pack::None, payload, |header| {
                if let Some(change) = change {
                    change(header);
                }
            });
        }
        if let Some(change) = change {
            let payload = builder.end_payload();
            builder.put_with(kind::END, Pack::None, &payload, change);
        }
        builder
    }

    /// The stream without its `end`.
    pub fn start(&self) -> StreamBuilder {
        let mut builder = StreamBuilder::new();
        for (record_type, payload) in &self.records {
            builder.put(*record_type, payload);
        }
        builder
    }

    /// The stream with its `end`.
    pub fn bytes(&self) -> Vec<u8> {
        self.start().ended()
    }

    /// With the payload of a record changed. Gives the offset of the payload too.
    pub fn with_payload(
        mut self,
        at: usize,
        change: impl FnOnce(&mut Vec<u8>),
    ) -> (usize, Vec<u8>) {
        let builder = if at < self.records.len() {
            change(&mut self.records[at].1);
            self.start().end().clone()
        } else {
            let mut builder = self.start();
            let mut payload = builder.end_payload();
            change(&mut payload);
            builder.put(kind::END, &payload).clone()
        };
        (builder.starts[at] + HEADER, builder.bytes)
    }

    /// With the header of a record changed. Gives the offset of the header too.
    pub fn with_header(&self, at: usize, change: impl FnOnce(&mut Header)) -> (usize, Vec<u8>) {
        let mut builder = self.builder(at, change);
        if at < self.records.len() {
            builder.end();
        }
        (builder.starts[at], builder.bytes)
    }

    /// With a record put in before place `at`.
    pub fn insert(mut self, at: usize, record_type: u16, payload: Vec<u8>) -> Plan {
        self.records.insert(at, (record_type, payload));
        self
    }

    /// The first `count` records.
    pub fn up_to(mut self, count: usize) -> Plan {
        self.records.truncate(count);
        self
    }

    /// With a further record.
    pub fn then(mut self, record_type: u16, payload: Vec<u8>) -> Plan {
        self.records.push((record_type, payload));
        self
    }
}

/// A fault in the payload of a record of the usual stream.
pub fn payload(
    (id, name): (u16, &str),
    clauses: &[&'static str],
    at: usize,
    comment: &str,
    change: impl FnOnce(&mut Vec<u8>),
) -> Draft {
    let (offset, bytes) = Plan::usual().with_payload(at, change);
    Draft::invalid(AREA, (id, name), offset, clauses, comment, bytes)
}

/// A fault in the header of a record of the usual stream.
pub fn header(
    (id, name): (u16, &str),
    clauses: &[&'static str],
    at: usize,
    comment: &str,
    change: impl FnOnce(&mut Header),
) -> Draft {
    let (offset, bytes) = Plan::usual().with_header(at, change);
    Draft::invalid(AREA, (id, name), offset, clauses, comment, bytes)
}

/// A stream that is refused for the payload of the record at place `at` of a plan.
pub fn refused(
    (id, name): (u16, &str),
    clauses: &[&'static str],
    at: usize,
    comment: &str,
    plan: Plan,
) -> Draft {
    let (offset, bytes) = plan.with_payload(at, |_| {});
    Draft::invalid(AREA, (id, name), offset, clauses, comment, bytes)
}

/// A stream that is decoded to its end.
pub fn valid(name: &str, clauses: &[&'static str], comment: &str, plan: &Plan) -> Draft {
    Draft::valid(AREA, name, clauses, comment, plan.bytes())
}

/// The tracks of the usual stream.
pub fn two_tracks() -> [Entry; 2] {
    let second = Entry {
        space: 1,
        has_hash: 1,
        hash: 0x0123_4567_89ab_cdef,
        application: 77,
        path: b"hall/box".to_vec(),
        ..Entry::new(2)
    };
    [Entry::new(1), second]
}

/// A track's part with one cell of one point, and the bucket that names it.
pub fn cell(entry: &Entry, index: u32, key: u32, ao: u32) -> Part {
    let point = entry.grid().point([1, 2, 3], [1, 3], ao);
    Part::of(entry)
        .bucket(entry.grid().bucket(key), &[index])
        .cell(index, key, &[point])
}

/// A translation.
pub fn moved(x: f32) -> [f32; 12] {
    let mut rows = IDENTITY;
    rows[3] = x;
    rows
}

/// What a track holds, for a digest: its transform and the part that a keyframe would give it.
pub type TrackContent<'p> = (u32, Option<[f32; 12]>, Option<&'p Part>);

/// State digest of tracks, ids ascending.
pub fn digest(tracks: &[TrackContent<'_>]) -> u64 {
    let tracks = tracks.iter().map(|&(id, transform, part)| {
        let mut content = expected::TrackContent::new(&Entry::new(id));
        content.transform = transform;
        if let Some(part) = part {
            content.cells_mut().write(true, part);
        }
        content
    });
    expected::digest(&tracks.collect::<Vec<_>>())
}
