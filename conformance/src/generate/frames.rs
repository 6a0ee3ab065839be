//! Streams of frames: every commit carries the digest of what the frame must leave.

use std::collections::BTreeMap;

use super::expected::{Content, TrackContent, digest};
use super::values;
use crate::stream_builder::probes::{self, Section};
use crate::stream_builder::{
    Entry, HEADER, Pack, Part, StreamBuilder, commit, group, kind, points, removal, tracks,
    transforms,
};

/// Widths of a point of 32, 24 and 16 bits that are customary.
pub const WIDTHS: [[u8; 3]; 3] = [[5, 4, 8], [4, 3, 5], [2, 2, 5]];

/// A stream in the making. Its records are put as they are called for; what they mean is kept.
#[derive(Clone, Debug)]
pub struct Frames {
    pub builder: StreamBuilder,
    /// Committed content of the live tracks, ids ascending.
    pub tracks: Vec<TrackContent>,
    /// Number of the pending frame.
    number: u32,
    /// Number of the last frame, 0 before the first.
    last: u32,
    tick: u64,
    pack: Pack,
    digests: bool,
    emptied: bool,
    staged: Vec<(bool, Part)>,
    staged_probes: Vec<(bool, Content)>,
    /// The lines `values` and `visibility` of the dump up to here (`spec/dump.md`).
    pub shown: Vec<String>,
    moved: Vec<(u32, [f32; 12])>,
    removed: Vec<u32>,
}

impl Frames {
    /// A stream with tracks, in the first frame of a group that starts from keyframes.
    pub fn new(entries: &[Entry]) -> Frames {
        let frames = Frames {
            builder: StreamBuilder::started(),
            tracks: Vec::new(),
            number: 0,
            last: 0,
            tick: 0,
            pack: Pack::None,
            digests: true,
            emptied: false,
            staged: Vec::new(),
            staged_probes: Vec::new(),
            shown: Vec::new(),
            moved: Vec::new(),
            removed: Vec::new(),
        };
        frames.declare(entries).group()
    }

    /// Packs the model records from here on.
    pub fn packed(mut self, pack: Pack) -> Frames {
        self.pack = pack;
        self
    }

    /// Commits without a digest from here on.
    pub fn bare(mut self) -> Frames {
        self.digests = false;
        self
    }

    /// the pending frame gets this number.
    pub fn numbered(mut self, number: u32) -> Frames {
        self.number = number;
        self
    }

    /// A `track` record; tracks that are there stay as they are.
    pub fn declare(mut self, entries: &[Entry]) -> Frames {
        self.builder.put(kind::TRACK, &tracks(entries));
        for entry in entries {
            if self
                .tracks
                .iter()
                .all(|content| content.entry.id != entry.id)
            {
                self.tracks.push(TrackContent::new(entry));
            }
        }
        self
    }

    /// A group that starts from keyframes.
    pub fn group(mut self) -> Frames {
        self.builder.put(kind::GROUP, &group(0, 0, 0));
        self.emptied = true;
        self
    }

    /// A group that builds on what is there.
    pub fn group_on_state(mut self) -> Frames {
        let digest = self.digest();
        self.builder.put(kind::GROUP, &group(1, 1, digest));
        self
    }

    /// A `points` record with a keyframe of each track in it.
    pub fn keyframe(self, parts: &[Part]) -> Frames {
        self.record(true, parts)
    }

    /// A `points` record with a delta on the last frame of each track in it.
    pub fn delta(self, parts: &[Part]) -> Frames {
        self.record(false, parts)
    }

    fn record(mut self, keyframe: bool, parts: &[Part]) -> Frames {
        let payload = self.payload(keyframe, parts);
        self.builder.put_packed(kind::POINTS, self.pack, &payload);
        self.staged
            .extend(parts.iter().map(|part| (keyframe, part.clone())));
        self
    }

    /// The payload that [`Frames::keyframe`] or [`Frames::delta`] would put.
    pub fn payload(&self, keyframe: bool, parts: &[Part]) -> Vec<u8> {
        points((!keyframe).then_some(self.last), parts)
    }

    /// A `probes` record that leaves these tracks with these probes.
    pub fn probes(self, keyframe: bool, contents: &[Content]) -> Frames {
        let sections = self.sections(keyframe, contents);
        self.probes_as(keyframe, contents, &sections)
    }

    /// The same with sections of another form, which must come to the same.
    pub fn probes_as(
        mut self,
        keyframe: bool,
        contents: &[Content],
        sections: &[Section],
    ) -> Frames {
        let payload = probes::payload((!keyframe).then_some(self.last), sections);
        self.builder.put_packed(kind::PROBES, self.pack, &payload);
        let contents = contents.iter().map(|content| (keyframe, content.clone()));
        self.staged_probes.extend(contents);
        self
    }

    /// The sections that [`Frames::probes`] would put.
    pub fn sections(&self, keyframe: bool, contents: &[Content]) -> Vec<Section> {
        let track = |id| self.tracks.iter().find(|track| track.entry.id == id);
        let section = |content: &Content| Some(track(content.id)?.section(keyframe, content));
        contents.iter().filter_map(section).collect()
    }

    /// The payload that [`Frames::probes`] would put.
    pub fn probes_payload(&self, keyframe: bool, contents: &[Content]) -> Vec<u8> {
        let base = (!keyframe).then_some(self.last);
        probes::payload(base, &self.sections(keyframe, contents))
    }

    /// A `transforms` record.
    pub fn transforms(mut self, entries: &[(u32, [f32; 12])]) -> Frames {
        self.builder.put(kind::TRANSFORMS, &transforms(entries));
        self.moved.extend(entries);
        self
    }

    /// A `track remove` record.
    pub fn remove(mut self, ids: &[u32]) -> Frames {
        self.builder.put(kind::TRACK_REMOVE, &removal(ids));
        self.removed.extend(ids);
        self
    }

    /// Ends the frame.
    pub fn commit(mut self) -> Frames {
        for track in &mut self.tracks {
            if self.emptied {
                track.clear();
                track.transform = None;
            }
            let id = track.entry.id;
            for (keyframe, part) in self.staged.iter().filter(|(_, part)| part.id == id) {
                track.write(*keyframe, part);
            }
            let contents = self.staged_probes.iter();
            for (keyframe, content) in contents.filter(|(_, content)| content.id == id) {
                track.write_probes(*keyframe, content);
            }
            for (_, rows) in self.moved.iter().filter(|(moved, _)| *moved == id) {
                track.transform = Some(*rows);
            }
        }
        let removed = std::mem::take(&mut self.removed);
        self.tracks
            .retain(|track| !removed.contains(&track.entry.id));
        self.staged.clear();
        self.staged_probes.clear();
        self.shown
            .extend(self.tracks.iter().flat_map(values::lines));
        self.moved.clear();
        self.emptied = false;
        let digest = self.digests.then(|| self.digest());
        let payload = commit(self.tick, self.number, digest);
        self.builder.put(kind::COMMIT, &payload);
        self.last = self.number;
        self.number = self.number.wrapping_add(1);
        self.tick += 1;
        self
    }

    /// Digest of the committed state.
    pub fn digest(&self) -> u64 {
        digest(&self.tracks)
    }

    /// The whole stream.
    pub fn ended(&self) -> Vec<u8> {
        self.builder.ended()
    }

    /// The stream with a `points` record that must be refused, all else after it as it would be,
    /// and the offset of the error: the first byte after the record's header.
    pub fn refused(self, payload: &[u8]) -> (usize, Vec<u8>) {
        self.refused_of(kind::POINTS, payload)
    }

    /// The same with a record of another type.
    pub fn refused_of(mut self, record_type: u16, payload: &[u8]) -> (usize, Vec<u8>) {
        self.builder.put_packed(record_type, self.pack, payload);
        let offset = self.builder.last() + HEADER;
        self.builder
            .put(kind::COMMIT, &commit(self.tick, self.number, None));
        (offset, self.ended())
    }
}

/// A small grid of 4 x 3 x 2 cubes, 5 buckets and room for 12 cells.
///
/// `x + 3 y + 2 z` modulo 5 is the bucket of a cube.
pub fn entry(id: u32, widths: [u8; 3]) -> Entry {
    Entry {
        widths,
        capacity: 12,
        ..Entry::new(id)
    }
}

/// The `i`th of many points that all differ in some field; any two fields of one differ in period.
pub fn point(entry: &Entry, i: u32) -> u32 {
    let [p, n, a] = entry.widths.map(|bits| (1u32 << bits) - 1);
    entry.point(
        [i & p, (i * 3 + 1) & p, (i * 5 + 2) & p],
        [(i * 7 + 1) & n, (i * 11 + 3) & n],
        (i * 37 + 5) & a,
    )
}

/// So many points from the `i`th on.
pub fn some(entry: &Entry, i: u32, count: u32) -> Vec<u32> {
    (i..i + count).map(|i| point(entry, i)).collect()
}

/// A part with cells, each named by the bucket of its key, in the order of the cells.
pub fn filled(entry: &Entry, cells: &[(u32, u32, Vec<u32>)]) -> Part {
    let mut part = Part::of(entry);
    let mut buckets: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (index, key, points) in cells {
        part = part.cell(*index, *key, points);
        buckets.entry(entry.bucket(*key)).or_default().push(*index);
    }
    part.buckets = buckets.into_iter().collect();
    part
}
