//! Expected content of tracks, worked out here a second time from `spec/points.md` and `spec/probes.md`, and its
//! digest, so that no vector rests on what our decoder makes of it.

use std::collections::BTreeMap;
use std::hash::Hasher as _;

use dapple_codec::points::EMPTY;
use twox_hash::XxHash64;

use crate::stream_builder::probes::{self, Probe, Section};
use crate::stream_builder::{Entry, Part, floats, words};

/// What a track holds after a commit.
#[derive(Clone, Debug)]
pub struct TrackContent {
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

impl TrackContent {
    /// An empty track.
    pub fn new(entry: &Entry) -> TrackContent {
        TrackContent {
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

    /// Empties the track; its transform stays.
    pub fn clear(&mut self) {
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
    pub fn write_probes(&mut self, keyframe: bool, content: &Content) {
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
pub fn digest(tracks: &[TrackContent]) -> u64 {
    let mut digest = XxHash64::with_seed(0);
    tracks
        .iter()
        .for_each(|content| content.digest(&mut digest));
    digest.finish()
}
