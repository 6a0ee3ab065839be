//! Calls of an encoder, right and wrong: a decoder with the same limits takes every byte that the
//! encoder wrote, and has the same state and what the calls said; a refused call writes nothing and
//! its error is one of the format.
#![no_main]

use std::collections::BTreeMap;

use arbitrary::{Result, Unstructured};
use dapple_codec::instances;
use dapple_codec::points::{Bucket, Cell, Coverage, EMPTY, Update};
use dapple_codec::probes::{self, Probe};
use dapple_codec::regions;
use dapple_codec::vertices;
use dapple_codec::{
    Decoder, Encoder, EncoderConfig, GroupStart, Limits, ModelKind, Track, TrackState, Transform,
};
use dapple_fuzz::{LIMITS, models, server};
use libfuzzer_sys::fuzz_target;

/// So small that most frames run into one of them.
const TIGHT: Limits = Limits {
    stored_bytes: 600,
    unpacked_bytes: 900,
    frame_bytes: 1200,
    zstd_window_bytes: 256,
    tracks: 3,
    path_bytes: 8,
    state_bytes: 8 << 10,
    work_per_byte: 400,
};

fuzz_target!(|data: &[u8]| {
    let _ = run(&mut Unstructured::new(data));
});

/// An encoder, a decoder that reads along, and what the pending frame says.
struct Pair {
    encoder: Encoder,
    decoder: Decoder,
    out: Vec<u8>,
    cells: BTreeMap<(u32, u32), Cell>,
    buckets: BTreeMap<(u32, u32), Bucket>,
    probes: BTreeMap<u32, Vec<Probe>>,
    visibility: BTreeMap<u32, Vec<u8>>,
    vertices: BTreeMap<u32, Vec<u8>>,
    instances: BTreeMap<u32, models::instances::Content>,
    regions: BTreeMap<u32, regions::Content>,
}

fn run(u: &mut Unstructured<'_>) -> Result<()> {
    let limits = if u.ratio(1, 4)? { TIGHT } else { LIMITS };
    let config = EncoderConfig {
        limits,
        ..EncoderConfig::default()
    };
    let mut out = Vec::new();
    let mut pair = Pair {
        encoder: Encoder::new(config, &mut out).expect("preamble"),
        decoder: Decoder::new(limits),
        out,
        cells: BTreeMap::new(),
        buckets: BTreeMap::new(),
        probes: BTreeMap::new(),
        visibility: BTreeMap::new(),
        vertices: BTreeMap::new(),
        instances: BTreeMap::new(),
        regions: BTreeMap::new(),
    };
    pair.read();
    let mut ended = false;
    while !u.is_empty() && !ended {
        match u.int_in_range(0..=15)? {
            0 | 1 => pair.group(u)?,
            2 | 3 => pair.tracks(u)?,
            4 => pair.remove(u)?,
            5 => pair.transforms(u)?,
            6..=10 => pair.content(u)?,
            11 if u.ratio(1, 8)? => ended = pair.call(|e, out| e.end(out)),
            _ => pair.commit(u)?,
        }
    }
    if ended {
        pair.decoder.finish().expect("a whole stream");
        assert!(!pair.call(|e, out| e.group(out, GroupStart::Keyframes)));
    }
    Ok(())
}

impl Pair {
    /// Makes a call; whether the encoder took it.
    fn call<T>(
        &mut self,
        call: impl FnOnce(&mut Encoder, &mut Vec<u8>) -> dapple_codec::Result<T>,
    ) -> bool {
        self.out.clear();
        let written = self.encoder.written();
        let result = call(&mut self.encoder, &mut self.out);
        let bytes = self.encoder.written() - written;
        assert_eq!(bytes, self.out.len() as u64);
        match result {
            Ok(_) => self.read(),
            Err(error) => {
                assert!(self.out.is_empty() && error.offset == written);
                assert_ne!(error.name(), "unknown");
                return false;
            }
        }
        true
    }

    /// The decoder reads what was written.
    fn read(&mut self) {
        let read = self.decoder.push_all(&self.out, |_, _| {});
        read.expect("the decoder takes what the encoder wrote");
    }

    fn group(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let start = match u.int_in_range(0..=3)? {
            0 => GroupStart::State(self.decoder.state_digest()),
            1 => GroupStart::State(u.arbitrary()?),
            _ => GroupStart::Keyframes,
        };
        self.call(|e, out| e.group(out, start));
        Ok(())
    }

    fn tracks(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let track: Vec<Track> = self
            .decoder
            .tracks()
            .iter()
            .map(|t| t.track.clone())
            .collect();
        let mut tracks = Vec::new();
        let mut id = track.last().map_or(0, |track| track.id.saturating_add(1));
        if u.ratio(1, 8)? {
            id = u.int_in_range(0..=9)?;
        }
        for _ in 0..u.int_in_range(0..=3)? {
            let mut track = server::track(u, id)?;
            if u.ratio(1, 16)? {
                track.aabb_min[u.choose_index(3)?] = *u.choose(&[f32::NAN, 1e9])?;
            }
            tracks.push(track);
            id = id.saturating_add(u.int_in_range(0..=3)?);
        }
        if u.ratio(1, 3)? && !track.is_empty() {
            tracks.insert(0, track[u.choose_index(track.len())?].clone());
        }
        self.call(|e, out| e.tracks(out, &tracks));
        Ok(())
    }

    fn remove(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let ids = self.ids(u)?;
        self.call(|e, out| e.remove_tracks(out, &ids));
        Ok(())
    }

    fn transforms(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let mut transforms = Vec::new();
        for id in self.ids(u)? {
            let mut transform = Transform::IDENTITY;
            transform.world_from_grid[0][3] = match u.ratio(1, 16)? {
                true => f32::INFINITY,
                false => u.arbitrary::<i8>()?.into(),
            };
            transforms.push((id, transform));
        }
        let compression = server::compression(u)?;
        self.call(|e, out| e.transforms(out, &transforms, compression));
        Ok(())
    }

    fn content(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        match *u.choose(&ModelKind::ALL)? {
            ModelKind::Points => self.points(u),
            ModelKind::Probes => self.probes(u),
            ModelKind::Vertices => self.vertices(u),
            ModelKind::Instances => self.instances(u),
            ModelKind::Regions => self.regions(u),
        }
    }

    fn points(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let coverage = coverage(u)?;
        let mut changes = Vec::new();
        for id in self.ids(u)? {
            let track = self.track(id).filter(|track| track.track.grid().is_some());
            let Some(track) = track else {
                changes.push((id, BTreeMap::new(), BTreeMap::new()));
                continue;
            };
            let grid = *track.track.grid().expect("points");
            let (cells, buckets) = match coverage {
                Coverage::Keyframe => (&[][..], &[][..]),
                Coverage::Delta => {
                    let state = self.decoder.points();
                    (state.cells_of(track), state.buckets_of(track))
                }
            };
            let old = |index: u32| cells.get(index as usize).copied().unwrap_or(Cell::FREE);
            let old_bucket = |index: u32| {
                let bucket = buckets.get(index as usize);
                bucket.copied().unwrap_or(Bucket::EMPTY)
            };
            let (mut buckets, mut cells) = models::points::changes(u, &grid, old, old_bucket)?;
            if u.ratio(1, 8)? {
                spoil(u, &mut buckets, &mut cells)?;
            }
            changes.push((id, buckets, cells));
        }
        let lists: Vec<_> = changes
            .iter()
            .map(|(id, buckets, cells)| {
                let bucket_indices: Vec<u32> = buckets.keys().copied().collect();
                let cell_indices: Vec<u32> = cells.keys().copied().collect();
                let buckets: Vec<Bucket> =
                    buckets.values().map(|&entries| Bucket(entries)).collect();
                let cells: Vec<Cell> = cells.values().copied().collect();
                (*id, bucket_indices, buckets, cell_indices, cells)
            })
            .collect();
        let updates: Vec<Update> = lists
            .iter()
            .map(|list| Update {
                track: list.0,
                bucket_indices: &list.1,
                buckets: &list.2,
                cell_indices: &list.3,
                cells: &list.4,
            })
            .collect();
        let compression = server::compression(u)?;
        if self.call(|e, out| e.points(out, coverage, &updates, compression)) {
            for (id, buckets, cells) in changes {
                let buckets = buckets.into_iter().map(|(i, b)| ((id, i), Bucket(b)));
                self.buckets.extend(buckets);
                self.cells
                    .extend(cells.into_iter().map(|(i, c)| ((id, i), c)));
            }
        }
        Ok(())
    }

    fn probes(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let coverage = coverage(u)?;
        let mut contents = Vec::new();
        for id in self.ids(u)? {
            let track = self
                .track(id)
                .filter(|track| track.track.volume().is_some());
            let Some(track) = track else {
                contents.push((id, Vec::new(), Vec::new(), None));
                continue;
            };
            let volume = track.track.volume().expect("probes");
            let mut base = self.decoder.probes().probes_of(track).to_vec();
            let mut probes = match coverage {
                Coverage::Keyframe => vec![Probe::ABSENT; base.len()],
                Coverage::Delta => base.clone(),
            };
            for _ in 0..u.int_in_range(0..=5)? {
                let at = u.choose_index(probes.len())?;
                probes[at] = models::probes::probe(u, volume)?;
            }
            if u.ratio(1, 16)? {
                let wrong = if u.arbitrary()? {
                    &mut base
                } else {
                    &mut probes
                };
                let at = u.choose_index(wrong.len())?;
                wrong[at].codes[u.choose_index(27)?] = u.arbitrary()?;
            }
            let mut visibility = None;
            if u.ratio(1, 3)? {
                visibility = Some(models::probes::visibility(u, volume)?);
            }
            contents.push((id, base, probes, visibility));
        }
        let updates: Vec<_> = contents
            .iter()
            .map(|(track, base, probes, visibility)| probes::Update {
                track: *track,
                base,
                probes,
                visibility: visibility.as_deref(),
            })
            .collect();
        let compression = server::compression(u)?;
        if self.call(|e, out| e.probes(out, coverage, &updates, compression)) {
            for (id, _, probes, visibility) in contents {
                self.probes.insert(id, probes);
                self.visibility.extend(visibility.map(|bytes| (id, bytes)));
            }
        }
        Ok(())
    }

    fn vertices(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let mut contents = Vec::new();
        for id in self.ids(u)? {
            let track = self.track(id).and_then(|track| track.track.vertices());
            let mut codes = match track {
                Some(track) => models::vertices::codes(u, track)?,
                None => Vec::new(),
            };
            let values = track.map(|track| models::vertices::values(track, &codes));
            if u.ratio(1, 16)? && !codes.is_empty() {
                match u.arbitrary()? {
                    true => codes.push(0),
                    false => _ = codes.pop(),
                }
            }
            contents.push((id, codes, values.unwrap_or_default()));
        }
        let updates: Vec<_> = contents
            .iter()
            .map(|(track, codes, _)| vertices::Update {
                track: *track,
                codes,
            })
            .collect();
        let compression = server::compression(u)?;
        if self.call(|e, out| e.vertices(out, &updates, compression)) {
            let values = contents.into_iter().map(|(id, _, values)| (id, values));
            self.vertices.extend(values);
        }
        Ok(())
    }

    fn instances(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let mut contents = Vec::new();
        for id in self.ids(u)? {
            let table = self
                .track(id)
                .and_then(|track| track.track.instance_table());
            let Some(table) = table else {
                contents.push((id, Vec::new(), Default::default()));
                continue;
            };
            let mut entries = models::instances::entries(u, table)?;
            let shown = models::instances::Content::of(table, &entries);
            if u.ratio(1, 16)? {
                let at = u.choose_index(entries.len())?;
                match u.int_in_range(0..=3)? {
                    0 => entries[at].key = u.arbitrary()?,
                    1 => entries[at].codes[1][3] = u.arbitrary()?,
                    2 => entries[at].codes[0][0] = u.arbitrary()?,
                    _ => _ = entries.pop(),
                }
                // What was taken is decoded below, and checked there.
                contents.push((id, entries, Default::default()));
                continue;
            }
            contents.push((id, entries, shown));
        }
        let updates: Vec<_> = contents
            .iter()
            .map(|(track, entries, _)| instances::Update {
                track: *track,
                entries,
            })
            .collect();
        let compression = server::compression(u)?;
        if self.call(|e, out| e.instances(out, &updates, compression)) {
            let shown = contents.into_iter().map(|(id, _, shown)| (id, shown));
            self.instances.extend(shown);
        }
        Ok(())
    }

    fn regions(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let mut contents = Vec::new();
        for id in self.ids(u)? {
            let set = self.track(id).and_then(|track| track.track.region_set());
            let mut content = match set {
                Some(set) => models::regions::content(u, set)?,
                None => regions::Content::default(),
            };
            if u.ratio(1, 16)? && !content.regions.is_empty() {
                let at = u.choose_index(content.regions.len())?;
                match u.int_in_range(0..=4)? {
                    0 => content.regions[at].form = u.arbitrary()?,
                    1 => content.regions[at].centre[0] = f32::from_bits(u.arbitrary()?),
                    2 => content.regions[at].max[1] = f32::from_bits(u.arbitrary()?),
                    3 => content.pairs[0][0] = u.arbitrary()?,
                    _ => _ = content.regions.pop(),
                }
            }
            contents.push((id, content));
        }
        let updates: Vec<_> = contents
            .iter()
            .map(|(track, content)| regions::Update {
                track: *track,
                regions: &content.regions,
                pairs: &content.pairs,
            })
            .collect();
        let compression = server::compression(u)?;
        if self.call(|e, out| e.regions(out, &updates, compression)) {
            self.regions.extend(contents);
        }
        Ok(())
    }

    fn commit(&mut self, u: &mut Unstructured<'_>) -> Result<()> {
        let last = self.decoder.last_frame().map_or(0, |(_, tick)| tick);
        let tick = match u.ratio(1, 16)? {
            true => u.arbitrary()?,
            false => last.saturating_add(u.int_in_range(0..=2)?),
        };
        // The right one where nothing is pending.
        let digest = match u.int_in_range(0..=5)? {
            0 => Some(self.decoder.state_digest()),
            1 => Some(u.arbitrary()?),
            _ => None,
        };
        if !self.call(|e, out| e.commit(out, tick, digest)) {
            return Ok(());
        }
        let decoder = &self.decoder;
        assert_eq!(
            decoder.last_frame().map(|(n, _)| n),
            self.encoder.last_frame()
        );
        assert_eq!(decoder.state_digest(), self.encoder.state_digest());
        for ((id, index), cell) in std::mem::take(&mut self.cells) {
            let track = self.track(id).expect("a declared track");
            assert_eq!(decoder_cell(&self.decoder, track, index), Some(cell));
        }
        for ((id, index), bucket) in std::mem::take(&mut self.buckets) {
            let track = self.track(id).expect("a declared track");
            let buckets = self.decoder.points().buckets_of(track);
            assert_eq!(buckets[index as usize], bucket);
        }
        for (id, probes) in std::mem::take(&mut self.probes) {
            let track = self.track(id).expect("a declared track");
            assert_eq!(self.decoder.probes().probes_of(track), probes);
        }
        for (id, bytes) in std::mem::take(&mut self.visibility) {
            let track = self.track(id).expect("a declared track");
            assert_eq!(self.decoder.probes().visibility_of(track), Some(&bytes[..]));
        }
        for (id, values) in std::mem::take(&mut self.vertices) {
            let track = self.track(id).expect("a declared track");
            assert_eq!(self.decoder.vertices().values_of(track), values);
        }
        for (id, content) in std::mem::take(&mut self.instances) {
            let track = self.track(id).expect("a declared track");
            let shown = models::instances::Content::shown(self.decoder.instances(), track);
            assert!(content.keys.is_empty() || shown == content);
        }
        for (id, content) in std::mem::take(&mut self.regions) {
            let track = self.track(id).expect("a declared track");
            let state = self.decoder.regions();
            assert_eq!(state.regions_of(track), content.regions);
            assert_eq!(state.pairs_of(track), content.pairs);
        }
        Ok(())
    }

    fn track(&self, id: u32) -> Option<&TrackState> {
        self.decoder
            .tracks()
            .iter()
            .find(|track| track.track.id == id)
    }

    /// Some ids, of declared tracks more often than not.
    fn ids(&self, u: &mut Unstructured<'_>) -> Result<Vec<u32>> {
        let mut ids = Vec::new();
        for track in self.decoder.tracks() {
            if u.ratio(1, 2)? {
                ids.push(track.track.id);
            }
        }
        if u.ratio(1, 12)? {
            let at = u.choose_index(ids.len() + 1)?;
            ids.insert(at, u.int_in_range(0..=12)?);
        }
        Ok(ids)
    }
}

fn decoder_cell(decoder: &Decoder, track: &TrackState, index: u32) -> Option<Cell> {
    decoder
        .points()
        .cells_of(track)
        .get(index as usize)
        .copied()
}

fn coverage(u: &mut Unstructured<'_>) -> Result<Coverage> {
    Ok(match u.ratio(1, 3)? {
        true => Coverage::Keyframe,
        false => Coverage::Delta,
    })
}

/// Makes content wrong in one place, more often than not.
fn spoil(
    u: &mut Unstructured<'_>,
    buckets: &mut BTreeMap<u32, [u32; 8]>,
    cells: &mut BTreeMap<u32, Cell>,
) -> Result<()> {
    let small = u.int_in_range(0..=30)?;
    match u.int_in_range(0..=4)? {
        0 => {
            buckets.insert(small, [EMPTY; 8]);
        }
        1 => {
            cells.insert(small, Cell::FREE);
        }
        2 => {
            if let Some(mut bucket) = buckets.first_entry() {
                bucket.get_mut()[u.choose_index(8)?] = small;
            }
        }
        3 => {
            if let Some(mut cell) = cells.first_entry() {
                cell.get_mut().key = if u.arbitrary()? { small } else { EMPTY };
            }
        }
        _ => {
            if let Some(mut cell) = cells.first_entry() {
                cell.get_mut().points[u.choose_index(7)?] = u.arbitrary()?;
            }
        }
    }
    Ok(())
}
