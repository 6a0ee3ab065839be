//! Streams of frames: every commit carries the digest of what the frame must leave.

use super::expected::{TrackContent, digest};
use crate::models::entry::{Entry, tracks};
use crate::stream_builder::{
    HEADER, Pack, StreamBuilder, commit, group, kind, removal, transforms,
};

/// A stream that is being written, and the state that it must leave.
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
    /// Content of the live tracks after the pending frame.
    pending: Vec<TrackContent>,
    /// The lines with digests of content in the dump up to here (`spec/dump.md`).
    pub shown: Vec<String>,
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
            pending: Vec::new(),
            shown: Vec::new(),
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

    /// The pending frame gets this number.
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
                self.pending.push(TrackContent::new(entry));
            }
        }
        self
    }

    /// A group that starts from keyframes.
    pub fn group(mut self) -> Frames {
        self.builder.put(kind::GROUP, &group(0, 0, 0));
        self.pending.iter_mut().for_each(TrackContent::clear);
        self
    }

    /// A group that builds on what is there.
    pub fn group_on_state(mut self) -> Frames {
        let digest = self.digest();
        self.builder.put(kind::GROUP, &group(1, 1, digest));
        self
    }

    /// A record with content of some tracks, packed as set by [`Frames::packed`].
    pub fn content(mut self, record_type: u16, payload: &[u8]) -> Frames {
        self.builder.put_packed(record_type, self.pack, payload);
        self
    }

    /// The pending state of a track.
    pub fn pending_mut(&mut self, id: u32) -> Option<&mut TrackContent> {
        self.pending.iter_mut().find(|track| track.entry.id == id)
    }

    /// The entries of tracks, in the order of these ids.
    pub fn live(&self, ids: &[u32]) -> Vec<&Entry> {
        let track = |id| self.tracks.iter().find(|track| track.entry.id == id);
        let entries = ids.iter().filter_map(|&id| track(id));
        entries.map(|track| &track.entry).collect()
    }

    /// Frame number that a keyframe or a delta on the last frame states as its base.
    pub fn base(&self, keyframe: bool) -> Option<u32> {
        (!keyframe).then_some(self.last)
    }

    /// A `transforms` record.
    pub fn transforms(mut self, entries: &[(u32, [f32; 12])]) -> Frames {
        self.builder.put(kind::TRANSFORMS, &transforms(entries));
        for (id, rows) in entries {
            if let Some(track) = self.pending_mut(*id) {
                track.transform = Some(*rows);
            }
        }
        self
    }

    /// A `track remove` record.
    pub fn remove(mut self, ids: &[u32]) -> Frames {
        self.builder.put(kind::TRACK_REMOVE, &removal(ids));
        self.removed.extend(ids);
        self
    }

    /// Tracks that a record put by hand has removed.
    pub fn remove_silently(mut self, ids: &[u32]) -> Frames {
        self.removed.extend(ids);
        self
    }

    /// Ends the frame.
    pub fn commit(mut self) -> Frames {
        let removed = std::mem::take(&mut self.removed);
        self.pending
            .retain(|track| !removed.contains(&track.entry.id));
        self.tracks.clone_from(&self.pending);
        for track in &self.tracks {
            let lines = track.state.get().digest_lines(track.entry.id);
            self.shown.extend(lines);
        }
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

    /// The stream with a record that must be refused, all else after it as it would be, and the
    /// offset of the error: the first byte after the record's header.
    pub fn refused_of(mut self, record_type: u16, payload: &[u8]) -> (usize, Vec<u8>) {
        self.builder.put_packed(record_type, self.pack, payload);
        let offset = self.builder.last() + HEADER;
        self.builder
            .put(kind::COMMIT, &commit(self.tick, self.number, None));
        (offset, self.ended())
    }
}
