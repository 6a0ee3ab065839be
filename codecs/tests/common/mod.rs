//! A small server: a hash grid that changes at random, and the streams it writes.
#![allow(dead_code)]

use dapple_codec::points::*;
use dapple_codec::*;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hasher as _;

/// Linear congruential generator: the same numbers everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) as u32
    }

    pub fn below(&mut self, bound: u32) -> u32 {
        self.next() % bound
    }
}

pub fn track(id: u32, widths: PointWidths, buckets: u32, capacity: u32) -> Track {
    Track {
        id,
        target: Target {
            application_id: 7,
            path: format!("scene/node{id}"),
            content_hash: id.is_multiple_of(2).then_some(0xfeed),
        },
        aabb_min: [-1.0, 0.0, -1.0],
        aabb_max: [1.0, 2.0, 1.0],
        space: if id.is_multiple_of(2) {
            LookupSpace::Mesh
        } else {
            LookupSpace::Rest
        },
        model: Model::Points(Grid {
            grid_from_mesh: [
                [1.0, 0.0, 0.0, 1.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 1.0],
            ],
            dims: [9, 8, 7],
            cell_edge: 0.25,
            radius: 0.125,
            widths,
            bucket_count: buckets,
            cell_capacity: capacity,
            coding: Coding::Cells,
        }),
    }
}

/// One track's buckets and cells as a server keeps them.
#[derive(Clone)]
pub struct Table {
    pub track: Track,
    pub buckets: Vec<Bucket>,
    pub cells: Vec<Cell>,
    pub dirty_buckets: Vec<u32>,
    pub dirty_cells: Vec<u32>,
}

impl Table {
    pub fn new(track: Track) -> Table {
        let grid = *track.grid().unwrap();
        Table {
            track,
            buckets: vec![Bucket::EMPTY; grid.bucket_count as usize],
            cells: vec![Cell::FREE; grid.cell_capacity as usize],
            dirty_buckets: Vec::new(),
            dirty_cells: Vec::new(),
        }
    }

    /// Adds, changes or removes cells.
    pub fn change(&mut self, random: &mut Random, times: u32) {
        let grid = *self.track.grid().unwrap();
        for _ in 0..times {
            let index = random.below(grid.cell_capacity);
            let old = self.cells[index as usize];
            if old.key != EMPTY && random.below(3) == 0 {
                let bucket = grid.bucket_of_key(old.key);
                let entries = &mut self.buckets[bucket as usize].0;
                if let Some(at) = entries.iter().position(|&e| e == index) {
                    entries.copy_within(at + 1.., at);
                    entries[BUCKET_ENTRIES - 1] = EMPTY;
                    self.dirty_buckets.push(bucket);
                }
                self.cells[index as usize] = Cell::FREE;
                self.dirty_cells.push(index);
                continue;
            }
            let key = match old.key {
                EMPTY => random.below(grid.volume() as u32),
                key => key,
            };
            if old.key == EMPTY {
                let bucket = grid.bucket_of_key(key);
                let entries = &mut self.buckets[bucket as usize].0;
                let Some(at) = entries.iter().position(|&e| e == EMPTY) else {
                    continue;
                };
                entries[at] = index;
                self.dirty_buckets.push(bucket);
            }
            let mut points = [0; CELL_POINTS];
            let count = random.below(8) as usize;
            for point in &mut points[..count] {
                let unit = |r: &mut Random| r.below(1000) as f32 / 999.0;
                let position = [unit(random), unit(random), unit(random)];
                let normal = [0.0, if random.below(2) == 0 { 1.0 } else { -1.0 }, 0.0];
                *point = grid.widths.pack(position, normal, unit(random));
            }
            self.cells[index as usize] = Cell { key, points };
            self.dirty_cells.push(index);
        }
    }

    /// Everything that is in use.
    pub fn keyframe(&mut self) -> Change {
        self.dirty_buckets = (0..)
            .zip(&self.buckets)
            .filter(|(_, b)| **b != Bucket::EMPTY)
            .map(|p| p.0)
            .collect();
        self.dirty_cells = (0..)
            .zip(&self.cells)
            .filter(|(_, c)| **c != Cell::FREE)
            .map(|p| p.0)
            .collect();
        self.delta()
    }

    /// What changed.
    pub fn delta(&mut self) -> Change {
        for list in [&mut self.dirty_buckets, &mut self.dirty_cells] {
            list.sort_unstable();
            list.dedup();
        }
        let buckets = self
            .dirty_buckets
            .iter()
            .map(|&i| self.buckets[i as usize])
            .collect();
        let cells = self
            .dirty_cells
            .iter()
            .map(|&i| self.cells[i as usize])
            .collect();
        Change {
            track: self.track.id,
            bucket_indices: std::mem::take(&mut self.dirty_buckets),
            buckets,
            cell_indices: std::mem::take(&mut self.dirty_cells),
            cells,
        }
    }
}

/// An owned [`Update`].
pub struct Change {
    pub track: u32,
    pub bucket_indices: Vec<u32>,
    pub buckets: Vec<Bucket>,
    pub cell_indices: Vec<u32>,
    pub cells: Vec<Cell>,
}

impl Change {
    pub fn update(&self) -> Update<'_> {
        Update {
            track: self.track,
            bucket_indices: &self.bucket_indices,
            buckets: &self.buckets,
            cell_indices: &self.cell_indices,
            cells: &self.cells,
        }
    }
}

pub fn transform(x: f32) -> Transform {
    let mut transform = Transform::IDENTITY;
    transform.world_from_grid[0][3] = x;
    transform
}

/// A track with its transform, buckets and cells.
pub type ShownTrack = (Track, Option<Transform>, Vec<Bucket>, Vec<Cell>);

/// What a decoder shows of its state, to compare.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    pub tracks: Vec<ShownTrack>,
    pub last: Option<(u32, u64)>,
}

pub fn shown(decoder: &Decoder) -> Shown {
    let tracks = decoder.tracks().iter().map(|track| {
        (
            track.track.clone(),
            track.transform,
            decoder.points().buckets_of(track).to_vec(),
            decoder.points().cells_of(track).to_vec(),
        )
    });
    Shown {
        tracks: tracks.collect(),
        last: decoder.last_frame(),
    }
}

/// A stream of two groups, five frames and two or three tracks, with the state after each frame.
pub fn stream(compression: Compression, digests: bool) -> (Vec<u8>, Vec<Shown>) {
    // The encoder without `zstd-native` has no zstd; its records are packed afterwards.
    if cfg!(not(feature = "zstd-native")) && matches!(compression, Compression::Zstd { .. }) {
        let (bytes, states) = stream(Compression::None, digests);
        return (packed(&bytes, 2), states);
    }
    let mut random = Random(5);
    let mut tables = [
        Table::new(track(1, PointWidths::BITS_32, 31, 60)),
        Table::new(track(4, PointWidths::BITS_24, 17, 20)),
        Table::new(track(6, PointWidths::BITS_16, 7, 9)),
    ];
    let mut out = Vec::new();
    let mut encoder = Encoder::new(EncoderConfig::default(), &mut out).unwrap();
    let mut states: Vec<Shown> = Vec::new();
    for frame in 0..5u32 {
        let keyframe = frame == 0 || frame == 3;
        if keyframe {
            encoder.group(&mut out, GroupStart::Keyframes).unwrap();
            let tracks: Vec<_> = tables.iter().map(|t| t.track.clone()).collect();
            encoder.tracks(&mut out, &tracks).unwrap();
        }
        let transforms: Vec<_> = tables
            .iter()
            .map(|t| (t.track.id, transform(frame as f32)))
            .collect();
        encoder
            .transforms(&mut out, &transforms, compression)
            .unwrap();
        let mut changes = Vec::new();
        for table in &mut tables {
            table.change(&mut random, if keyframe { 30 } else { 6 });
            changes.push(if keyframe {
                table.keyframe()
            } else {
                table.delta()
            });
        }
        let updates: Vec<_> = changes.iter().map(Change::update).collect();
        let coverage = if keyframe {
            Coverage::Keyframe
        } else {
            Coverage::Delta
        };
        encoder
            .points(&mut out, coverage, &updates, compression)
            .unwrap();
        let digest = digests.then(|| {
            let mut digest = StateDigest::new();
            for (table, (id, transform)) in tables.iter().zip(&transforms) {
                digest.points(*id, Some(transform), &table.buckets, &table.cells);
            }
            digest.finish()
        });
        encoder
            .commit(&mut out, u64::from(frame) * 2, digest)
            .unwrap();
        let tracks = tables.iter().zip(&transforms).map(|(t, (_, transform))| {
            (
                t.track.clone(),
                Some(*transform),
                t.buckets.clone(),
                t.cells.clone(),
            )
        });
        states.push(Shown {
            tracks: tracks.collect(),
            last: Some((frame, u64::from(frame) * 2)),
        });
    }
    encoder.end(&mut out).unwrap();
    (out, states)
}

/// Copies of a decoder's arrays that are made from dirty ranges alone, as a renderer makes them.
#[derive(Default)]
pub struct Copies {
    arrays: BTreeMap<(Buffer, Option<u32>), Vec<u8>>,
    /// Buffers that were dirty at some time.
    pub seen: BTreeSet<Buffer>,
    /// Ranges that were not a whole array.
    pub partial: usize,
}

impl Copies {
    /// Copies what is dirty. Then every array of the decoder must be its copy.
    pub fn update(&mut self, decoder: &mut Decoder) {
        let tracks = decoder.tracks();
        let ids: Vec<Option<u32>> = tracks.iter().map(|track| Some(track.track.id)).collect();
        self.arrays
            .retain(|(_, track), _| track.is_none() || ids.contains(track));
        let mut last: Option<Dirty> = None;
        for dirty in decoder.dirty() {
            let source = decoder.array(dirty.buffer, dirty.track);
            let copy = self.arrays.entry((dirty.buffer, dirty.track)).or_default();
            copy.resize(source.len(), 0x99);
            let range = dirty.bytes();
            copy[range.clone()].copy_from_slice(&source[range.clone()]);
            self.seen.insert(dirty.buffer);
            self.partial += usize::from(range.len() < source.len());
            if let Some(last) = last.filter(|l| (l.buffer, l.track) == (dirty.buffer, dirty.track))
            {
                assert!(last.range.end <= dirty.range.start, "{last:?} {dirty:?}");
            }
            last = Some(dirty);
        }
        decoder.clear_dirty();
        assert_eq!(decoder.dirty().next(), None);
        for buffer in Buffer::ALL {
            for &track in [None].iter().chain(&ids) {
                let copy = self.arrays.get(&(buffer, track));
                let copy = copy.map_or(&[][..], |copy| &copy[..]);
                assert!(copy == decoder.array(buffer, track), "{buffer:?} {track:?}");
            }
        }
    }
}

/// Pushes everything, whole. Returns the events before the end or the error.
pub fn decode(decoder: &mut Decoder, bytes: &[u8]) -> (Vec<Event>, Result<()>) {
    let mut events = Vec::new();
    let pushed = decoder.push_all(bytes, |_, event| events.push(event));
    (events, pushed.and_then(|()| decoder.finish()))
}

/// Start of every record header.
pub fn records(bytes: &[u8]) -> Vec<usize> {
    let mut at = container::PREAMBLE_BYTES;
    let mut starts = Vec::new();
    while at < bytes.len() {
        starts.push(at);
        at += 32 + header(bytes, at).stored_bytes as usize;
    }
    starts
}

pub fn header(bytes: &[u8], at: usize) -> container::RecordHeader {
    container::RecordHeader::read(bytes[at..at + 32].try_into().unwrap()).unwrap()
}

/// A stream whose records are packed, where they were not before.
pub fn packed(bytes: &[u8], packing: u8) -> Vec<u8> {
    let mut out = bytes[..container::PREAMBLE_BYTES].to_vec();
    let mut digest = twox_hash::XxHash64::with_seed(0);
    digest.write(&out);
    for at in records(bytes) {
        let mut h = header(bytes, at);
        let mut payload = bytes[at + 32..at + 32 + h.stored_bytes as usize].to_vec();
        let packing = if h.packing == 0 { packing } else { 0 };
        if h.record_type == container::record_type::END && h.packing == 0 {
            // The number of records, and the digest of their headers.
            payload[8..].copy_from_slice(&digest.finish().to_le_bytes());
        }
        let stored = match packing {
            1 => lz4(&payload),
            2 => zstd::bulk::compress(&payload, 15).unwrap(),
            _ => payload,
        };
        h.packing = h.packing.max(packing);
        h.stored_bytes = stored.len() as u32;
        h.payload_crc = container::crc32c(&stored);
        digest.write(&h.to_bytes());
        out.extend(h.to_bytes());
        out.extend(stored);
    }
    out
}

fn lz4(payload: &[u8]) -> Vec<u8> {
    let mut block = vec![0; lz4_flex::block::get_maximum_output_size(payload.len())];
    let bytes = lz4_flex::block::compress_into(payload, &mut block).unwrap();
    block.truncate(bytes);
    block
}

/// Replaces a record's payload (uncompressed) and recomputes its checksums, so that only the content is
/// wrong.
pub fn with_payload(bytes: &[u8], at: usize, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut h = header(bytes, at);
    assert_eq!(h.packing, 0);
    let end = at + 32 + h.stored_bytes as usize;
    let mut payload = bytes[at + 32..end].to_vec();
    change(&mut payload);
    h.stored_bytes = payload.len() as u32;
    h.unpacked_bytes = payload.len() as u32;
    h.payload_crc = container::crc32c(&payload);
    [&bytes[..at], &h.to_bytes(), &payload, &bytes[end..]].concat()
}

pub fn with_header(
    bytes: &[u8],
    at: usize,
    change: impl FnOnce(&mut container::RecordHeader),
) -> Vec<u8> {
    let mut h = header(bytes, at);
    change(&mut h);
    [&bytes[..at], &h.to_bytes(), &bytes[at + 32..]].concat()
}
