//! A client that watches a decoder: it copies dirty ranges as a renderer would, and holds every
//! committed state against the rules of the format.

use std::collections::BTreeMap;

use dapple_codec::points::{BUCKET_ENTRIES, Bucket, Cell, EMPTY};
use dapple_codec::probes::{Probe, Texel};
use dapple_codec::{Decoder, Error, Event, Limits, Model, Track, Transform};

use crate::volumes;

/// An event, and the digest of the state after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// What came.
    pub event: Event,
    /// Digest of the state.
    pub digest: u64,
}

/// A track with its transform and content.
#[derive(Clone, Debug, PartialEq)]
pub struct ShownTrack {
    /// What was declared.
    pub track: Track,
    /// The last committed transform.
    pub transform: Option<Transform>,
    /// The buckets of the track.
    pub buckets: Vec<Bucket>,
    /// The cells of the track.
    pub cells: Vec<Cell>,
    /// The probes of the track.
    pub probes: Vec<Probe>,
    /// Its visibility block.
    pub visibility: Option<Vec<u8>>,
}

/// A decoder, and copies of its arrays that were made from dirty ranges alone.
pub struct Viewer {
    /// The decoder that is watched.
    pub decoder: Decoder,
    limits: Limits,
    buckets: Vec<Bucket>,
    cells: Vec<Cell>,
    /// Texels and visibility of volumes, by id.
    volumes: BTreeMap<u32, (Vec<Texel>, Option<Vec<u8>>)>,
    digest: u64,
    last: Option<(u32, u64)>,
}

impl Viewer {
    /// A fresh decoder.
    pub fn new(limits: Limits) -> Viewer {
        let decoder = Decoder::new(limits);
        let digest = decoder.state_digest();
        Viewer {
            decoder,
            limits,
            buckets: Vec::new(),
            cells: Vec::new(),
            volumes: BTreeMap::new(),
            digest,
            last: None,
        }
    }

    /// One push, and all that must hold after it.
    pub fn push(&mut self, input: &[u8]) -> Result<(usize, Seen), Error> {
        let before = self.decoder.position();
        let result = self.decoder.push(input);
        let used = (self.decoder.position() - before) as usize;
        assert!(used <= input.len());
        match result {
            Ok((consumed, event)) => {
                assert_eq!(consumed, used);
                match event {
                    Event::NeedInput => assert_eq!(consumed, input.len()),
                    Event::Tracks { .. } => self.sync(),
                    Event::Frame(frame) => {
                        let order = self.last.is_none_or(|(number, tick)| {
                            number < frame.number && tick <= frame.tick
                        });
                        assert!(order, "frames ascend");
                        self.last = Some((frame.number, frame.tick));
                        self.sync();
                    }
                    _ => {}
                }
                Ok((
                    consumed,
                    Seen {
                        event,
                        digest: self.digest,
                    },
                ))
            }
            Err(error) => {
                self.unchanged();
                assert_eq!(self.decoder.state_digest(), self.digest);
                for more in [&[][..], &[0]] {
                    let again = self
                        .decoder
                        .push(more)
                        .expect_err("a failed decoder stays failed");
                    assert_eq!(again.id, 4011);
                }
                assert_eq!(self.decoder.finish().map_err(|e| e.id), Err(4011));
                assert_eq!(self.decoder.finish_live().map_err(|e| e.id), Err(4011));
                Err(error)
            }
        }
    }

    /// Pushes everything, cut as `cut` says (it gets what is left and says how much comes now).
    /// The events, and the error or what `finish` says.
    pub fn feed(
        &mut self,
        bytes: &[u8],
        mut cut: impl FnMut(usize) -> usize,
    ) -> (Vec<Seen>, Result<(), Error>) {
        let mut seen = Vec::new();
        let mut rest = bytes;
        loop {
            let now = if rest.is_empty() {
                0
            } else {
                cut(rest.len()).clamp(1, rest.len())
            };
            let mut piece = &rest[..now];
            rest = &rest[now..];
            loop {
                match self.push(piece) {
                    Ok((consumed, got)) => {
                        piece = &piece[consumed..];
                        match got.event {
                            Event::NeedInput => break,
                            Event::End if piece.is_empty() => {
                                seen.push(got);
                                break;
                            }
                            _ => seen.push(got),
                        }
                    }
                    Err(error) => return (seen, Err(error)),
                }
            }
            if rest.is_empty() {
                return (seen, self.decoder.finish());
            }
        }
    }

    /// Pushes everything at once.
    pub fn feed_whole(&mut self, bytes: &[u8]) -> (Vec<Seen>, Result<(), Error>) {
        self.feed(bytes, |left| left)
    }

    /// Resets the decoder.
    pub fn reset(&mut self) {
        self.decoder.reset();
        assert_eq!(self.decoder.position(), 0);
        assert!(self.decoder.tracks().is_empty() && self.decoder.points().buckets().is_empty());
        assert!(self.decoder.points().cells().is_empty() && self.decoder.last_frame().is_none());
        self.buckets.clear();
        self.cells.clear();
        self.volumes.clear();
        self.last = None;
        self.digest = self.decoder.state_digest();
    }

    /// Every live track, ids ascending.
    pub fn shown(&self) -> Vec<ShownTrack> {
        self.decoder
            .tracks()
            .iter()
            .map(|live| ShownTrack {
                track: live.track.clone(),
                transform: live.transform,
                buckets: self.decoder.points().buckets_of(live).to_vec(),
                cells: self.decoder.points().cells_of(live).to_vec(),
                probes: self.decoder.probes().probes_of(live).to_vec(),
                visibility: self
                    .decoder
                    .probes()
                    .visibility_of(live)
                    .map(<[u8]>::to_vec),
            })
            .collect()
    }

    /// Copies what is dirty; then the copies must be the arrays.
    fn sync(&mut self) {
        let points = self.decoder.points();
        self.buckets
            .resize(points.buckets().len(), Bucket([7; BUCKET_ENTRIES]));
        self.cells.resize(
            points.cells().len(),
            Cell {
                key: 7,
                points: [7; 7],
            },
        );
        let ascending = |ranges: &[dapple_codec::points::DirtyRange]| {
            assert!(ranges.iter().all(|r| r.start < r.end), "{ranges:?}");
            assert!(ranges.is_sorted_by(|a, b| a.end < b.start), "{ranges:?}");
        };
        ascending(points.dirty_buckets());
        ascending(points.dirty_cells());
        for range in points.dirty_buckets() {
            let range = range.start as usize..range.end as usize;
            self.buckets[range.clone()].copy_from_slice(&points.buckets()[range]);
        }
        for range in points.dirty_cells() {
            let range = range.start as usize..range.end as usize;
            self.cells[range.clone()].copy_from_slice(&points.cells()[range]);
        }
        self.sync_volumes();
        self.decoder.clear_dirty();
        self.unchanged();
        self.digest = self.decoder.state_digest();
        check(&self.decoder, &self.limits);
    }

    fn sync_volumes(&mut self) {
        let state = self.decoder.probes();
        let tracks = self.decoder.tracks();
        self.volumes
            .retain(|id, _| tracks.iter().any(|live| live.track.id == *id));
        for live in tracks {
            let Some(volume) = live.track.volume() else {
                continue;
            };
            let texels = state.texels_of(live);
            let own = self.volumes.entry(live.track.id);
            let own = own.or_insert_with(|| (vec![[7; 4]; texels.len()], None));
            assert_eq!(own.0.len(), texels.len());
            for range in state.dirty_of(live) {
                assert!(range.start < range.end && range.end as usize <= volume.count());
                for plane in 0..texels.len() / volume.count() {
                    let start = plane * volume.count();
                    let range = start + range.start as usize..start + range.end as usize;
                    own.0[range.clone()].copy_from_slice(&texels[range]);
                }
            }
            if state.visibility_dirty_of(live) {
                own.1 = state.visibility_of(live).map(<[u8]>::to_vec);
            }
        }
    }

    /// Nothing but a commit or a declaration may change what is shown.
    fn unchanged(&self) {
        assert!(
            self.decoder.points().buckets() == self.buckets,
            "buckets changed unseen"
        );
        assert!(
            self.decoder.points().cells() == self.cells,
            "cells changed unseen"
        );
        for live in self.decoder.tracks() {
            if let Some((texels, visibility)) = self.volumes.get(&live.track.id) {
                let state = self.decoder.probes();
                assert!(state.texels_of(live) == texels, "texels changed unseen");
                assert!(
                    state.visibility_of(live) == visibility.as_deref(),
                    "visibility changed unseen"
                );
            }
        }
        assert_eq!(self.decoder.last_frame(), self.last);
    }
}

/// What holds of every committed state (`spec/points.md` §5, `spec/probes.md`, `spec/container.md`
/// §6.3).
fn check(decoder: &Decoder, limits: &Limits) {
    let tracks = decoder.tracks();
    assert!(tracks.len() <= limits.tracks as usize);
    assert!(tracks.is_sorted_by(|a, b| a.track.id < b.track.id));
    let points = decoder.points();
    let state = points.buckets().len() * 32 + points.cells().len() * 36;
    let volumes = tracks.iter().filter_map(|live| live.track.volume());
    let volumes: u64 = volumes.map(volumes::state_bytes).sum();
    assert!(state as u64 + volumes <= limits.state_bytes);
    let apart = |mut regions: Vec<(u32, u32)>| {
        regions.sort_unstable();
        assert!(
            regions.is_sorted_by(|a, b| a.0 + a.1 <= b.0),
            "regions overlap: {regions:?}"
        );
    };
    let places = || tracks.iter().filter_map(|live| points.place_of(live));
    apart(
        places()
            .map(|place| (place.first_bucket, place.grid.bucket_count))
            .collect(),
    );
    apart(
        places()
            .map(|place| (place.first_cell, place.grid.cell_capacity))
            .collect(),
    );
    for live in tracks {
        assert!(live.track.target.path.len() <= limits.path_bytes as usize);
        if let Some(transform) = live.transform {
            assert!(
                transform
                    .world_from_grid
                    .as_flattened()
                    .iter()
                    .all(|f| f.is_finite())
            );
        }
        let grid = match &live.track.model {
            Model::Points(grid) => grid,
            Model::Probes(volume) => {
                volumes::check(decoder.probes(), live, volume);
                continue;
            }
        };
        let (buckets, cells) = (points.buckets_of(live), points.cells_of(live));
        assert_eq!(buckets.len(), grid.bucket_count as usize);
        assert_eq!(cells.len(), grid.cell_capacity as usize);
        let there = 1u32 << (grid.widths.bits() - 1);
        for cell in cells {
            assert!(cell.key == EMPTY || u64::from(cell.key) < grid.volume());
            let used = cell.points.iter().take_while(|&&p| p != 0).count();
            assert!(used == 0 || cell.key != EMPTY, "a free cell with points");
            for point in &cell.points[..used] {
                assert!(point & there != 0 && u64::from(*point) < 2 * u64::from(there));
            }
            assert!(
                cell.points[used..].iter().all(|&p| p == 0),
                "points are not compact"
            );
        }
        for (index, Bucket(entries)) in (0u32..).zip(buckets) {
            let used = entries.iter().take_while(|&&e| e != EMPTY).count();
            assert!(
                entries[used..].iter().all(|&e| e == EMPTY),
                "entries are not compact"
            );
            for (i, &entry) in entries[..used].iter().enumerate() {
                assert!(entry < grid.cell_capacity);
                assert!(!entries[..i].contains(&entry), "a cell is named twice");
                let key = cells[entry as usize].key;
                assert!(key != EMPTY, "an entry names a free cell");
                assert_eq!(grid.bucket_of_key(key), index);
            }
        }
    }
}
