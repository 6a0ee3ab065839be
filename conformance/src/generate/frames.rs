//! Streams of frames, and what each frame must leave, worked out here once more from
//! `spec/points.md` and `spec/probes.md`: every commit carries the digest of that, so that no vector
//! rests on what our decoder makes of it.

use std::collections::BTreeMap;
use std::hash::Hasher as _;

use dapple_codec::points::EMPTY;
use twox_hash::XxHash64;

use super::values;
use crate::forge::probes::{self, Probe, Section};
use crate::forge::{
    Entry, Forge, HEADER, Pack, Part, commit, floats, group, kind, points, removal, tracks,
    transforms, words,
};

/// Widths of a point of 32, 24 and 16 bits that are customary.
pub const WIDTHS: [[u8; 3]; 3] = [[5, 4, 8], [4, 3, 5], [2, 2, 5]];

/// What a track holds after a commit.
#[derive(Clone, Debug)]
pub struct Held {
    pub entry: Entry,
    pub transform: Option<[f32; 12]>,
    /// Entries of each bucket that has been written.
    pub buckets: BTreeMap<u32, Vec<u32>>,
    /// Key and points of each cell that has been written.
    pub cells: BTreeMap<u32, (u32, Vec<u32>)>,
    /// All probes of a volume.
    pub probes: Vec<Probe>,
    /// Visibility block of a volume, where it has come.
    pub visibility: Option<Vec<u8>>,
}

impl Held {
    /// An empty track.
    pub fn new(entry: &Entry) -> Held {
        Held {
            entry: entry.clone(),
            transform: None,
            buckets: BTreeMap::new(),
            cells: BTreeMap::new(),
            probes: match &entry.volume {
                Some(volume) => vec![Probe::ABSENT; volume.count()],
                None => Vec::new(),
            },
            visibility: None,
        }
    }

    fn clear(&mut self) {
        self.buckets.clear();
        self.cells.clear();
        self.probes.fill(Probe::ABSENT);
        self.visibility = None;
    }

    /// Takes in a part of a keyframe or delta.
    pub fn write(&mut self, keyframe: bool, part: &Part) {
        if keyframe {
            self.clear();
        }
        let buckets = part.buckets.iter().cloned();
        self.buckets.extend(buckets);
        for (index, key, points) in &part.cells {
            self.cells.insert(*index, (*key, points.clone()));
        }
    }

    /// Takes in probes of a keyframe or delta: all of them are in `content`.
    fn write_probes(&mut self, keyframe: bool, content: &Content) {
        if keyframe {
            self.clear();
        }
        self.probes.clone_from(&content.probes);
        if content.visibility.is_some() {
            self.visibility.clone_from(&content.visibility);
        }
    }

    /// The section that makes a track's probes what `content` says.
    pub fn section(&self, keyframe: bool, content: &Content) -> Section {
        let base = (!keyframe).then_some(&self.probes[..]);
        let coded = match &self.entry.volume {
            Some(volume) if volume.is_packed() => {
                let coded = probes::packed(volume, base, &content.probes, &content.touched);
                if content.whole {
                    coded.whole()
                } else {
                    coded.short()
                }
            }
            _ => probes::raw(base, &content.probes, &content.touched),
        };
        Section {
            id: content.id,
            visibility: content.visibility.clone(),
            probes: coded,
            ..Section::default()
        }
    }

    /// Key and used points of each cell that a bucket names, in its order.
    pub fn named(&self, bucket: u32) -> impl Iterator<Item = (u32, &[u32])> {
        let entries = self.buckets.get(&bucket).into_iter().flatten();
        let used = entries.take_while(|&&entry| entry != EMPTY);
        used.map(|entry| {
            let (key, points) = &self.cells[entry];
            let used = points.iter().take_while(|&&point| point != 0).count();
            (*key, &points[..used])
        })
    }

    fn digest(&self, digest: &mut XxHash64) {
        digest.write(&words(&[
            self.entry.id,
            u32::from(self.transform.is_some()),
        ]));
        digest.write(&floats(&self.transform.unwrap_or_default()));
        for &bucket in self.buckets.keys() {
            let count = self.named(bucket).count() as u32;
            if count == 0 {
                continue;
            }
            digest.write(&words(&[bucket, count]));
            for (key, points) in self.named(bucket) {
                let mut all = [0; 7];
                all[..points.len()].copy_from_slice(points);
                digest.write(&words(&[key]));
                digest.write(&words(&all));
            }
        }
        if self.entry.volume.is_some() {
            self.digest_probes(digest);
        }
    }

    /// `spec/probes.md` §11.
    fn digest_probes(&self, digest: &mut XxHash64) {
        for (index, probe) in (0..).zip(&self.probes) {
            if probe.level > 0 {
                digest.write(&words(&[index, probe.level.into()]));
                let codes = probe.codes.iter();
                codes.for_each(|&code| digest.write(&(code as u16).to_le_bytes()));
                digest.write(&[0; 2]);
            }
        }
        digest.write(&words(&[u32::from(self.visibility.is_some())]));
        digest.write(self.visibility.as_deref().unwrap_or_default());
    }
}

/// What a track's probes are after a frame.
#[derive(Clone, Debug)]
pub struct Content {
    pub id: u32,
    /// All probes.
    pub probes: Vec<Probe>,
    /// Its visibility block, where it is sent.
    pub visibility: Option<Vec<u8>>,
    /// Probes that are written as changing though they may not.
    pub touched: Vec<usize>,
    /// With all zeros at the end of packed probes.
    pub whole: bool,
}

impl Content {
    /// Probes of a track.
    pub fn new(id: u32, probes: Vec<Probe>) -> Content {
        Content {
            id,
            probes,
            visibility: None,
            touched: Vec::new(),
            whole: false,
        }
    }
}

/// Digest of a state, its tracks by ascending id (`spec/container.md` §7, `spec/points.md` §6).
pub fn digest(tracks: &[Held]) -> u64 {
    let mut digest = XxHash64::with_seed(0);
    tracks.iter().for_each(|held| held.digest(&mut digest));
    digest.finish()
}

/// A stream in the making. Its records are put as they are called for; what they mean is kept.
#[derive(Clone, Debug)]
pub struct Frames {
    pub forge: Forge,
    /// Committed content of the live tracks, ids ascending.
    pub held: Vec<Held>,
    /// Number of the frame in the making.
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
            forge: Forge::started(),
            held: Vec::new(),
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

    /// The frame in the making gets this number.
    pub fn numbered(mut self, number: u32) -> Frames {
        self.number = number;
        self
    }

    /// A `track` record; tracks that are there stay as they are.
    pub fn declare(mut self, entries: &[Entry]) -> Frames {
        self.forge.put(kind::TRACK, &tracks(entries));
        for entry in entries {
            if self.held.iter().all(|held| held.entry.id != entry.id) {
                self.held.push(Held::new(entry));
            }
        }
        self
    }

    /// A group that starts from keyframes.
    pub fn group(mut self) -> Frames {
        self.forge.put(kind::GROUP, &group(0, 0, 0));
        self.emptied = true;
        self
    }

    /// A group that builds on what is there.
    pub fn group_on_state(mut self) -> Frames {
        let digest = self.digest();
        self.forge.put(kind::GROUP, &group(1, 1, digest));
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
        self.forge.put_packed(kind::POINTS, self.pack, &payload);
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
        self.forge.put_packed(kind::PROBES, self.pack, &payload);
        let contents = contents.iter().map(|content| (keyframe, content.clone()));
        self.staged_probes.extend(contents);
        self
    }

    /// The sections that [`Frames::probes`] would put.
    pub fn sections(&self, keyframe: bool, contents: &[Content]) -> Vec<Section> {
        let held = |id| self.held.iter().find(|held| held.entry.id == id);
        let section = |content: &Content| Some(held(content.id)?.section(keyframe, content));
        contents.iter().filter_map(section).collect()
    }

    /// The payload that [`Frames::probes`] would put.
    pub fn probes_payload(&self, keyframe: bool, contents: &[Content]) -> Vec<u8> {
        let base = (!keyframe).then_some(self.last);
        probes::payload(base, &self.sections(keyframe, contents))
    }

    /// A `transforms` record.
    pub fn transforms(mut self, entries: &[(u32, [f32; 12])]) -> Frames {
        self.forge.put(kind::TRANSFORMS, &transforms(entries));
        self.moved.extend(entries);
        self
    }

    /// A `track remove` record.
    pub fn remove(mut self, ids: &[u32]) -> Frames {
        self.forge.put(kind::TRACK_REMOVE, &removal(ids));
        self.removed.extend(ids);
        self
    }

    /// Ends the frame.
    pub fn commit(mut self) -> Frames {
        for held in &mut self.held {
            if self.emptied {
                held.clear();
                held.transform = None;
            }
            let id = held.entry.id;
            for (keyframe, part) in self.staged.iter().filter(|(_, part)| part.id == id) {
                held.write(*keyframe, part);
            }
            let contents = self.staged_probes.iter();
            for (keyframe, content) in contents.filter(|(_, content)| content.id == id) {
                held.write_probes(*keyframe, content);
            }
            for (_, rows) in self.moved.iter().filter(|(track, _)| *track == id) {
                held.transform = Some(*rows);
            }
        }
        let removed = std::mem::take(&mut self.removed);
        self.held.retain(|held| !removed.contains(&held.entry.id));
        self.staged.clear();
        self.staged_probes.clear();
        self.shown.extend(self.held.iter().flat_map(values::lines));
        self.moved.clear();
        self.emptied = false;
        let digest = self.digests.then(|| self.digest());
        let payload = commit(self.tick, self.number, digest);
        self.forge.put(kind::COMMIT, &payload);
        self.last = self.number;
        self.number = self.number.wrapping_add(1);
        self.tick += 1;
        self
    }

    /// Digest of the committed state.
    pub fn digest(&self) -> u64 {
        digest(&self.held)
    }

    /// The whole stream.
    pub fn ended(&self) -> Vec<u8> {
        self.forge.ended()
    }

    /// The stream with a `points` record that must be refused, all else after it as it would be,
    /// and the offset of the error: the first byte after the record's header.
    pub fn refused(self, payload: &[u8]) -> (usize, Vec<u8>) {
        self.refused_of(kind::POINTS, payload)
    }

    /// The same with a record of another type.
    pub fn refused_of(mut self, record_type: u16, payload: &[u8]) -> (usize, Vec<u8>) {
        self.forge.put_packed(record_type, self.pack, payload);
        let offset = self.forge.last() + HEADER;
        self.forge
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
