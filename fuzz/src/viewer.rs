//! A client that watches a decoder: it copies dirty ranges as a renderer would, and holds every
//! committed state against the rules of the format.

use std::collections::BTreeMap;

use dapple_codec::{Buffer, Decoder, Dirty, Error, Event, Limits, ModelKind, Track, Transform};

use crate::models::{self, Content};

/// An event, and the digest of the state after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EventDigest {
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
    /// What its model has of it.
    pub content: Content,
}

/// A decoder, and copies of its arrays that were made from dirty ranges alone.
pub struct Viewer {
    /// The decoder that is watched.
    pub decoder: Decoder,
    limits: Limits,
    /// The copies, by buffer and track.
    arrays: BTreeMap<(Buffer, Option<u32>), Vec<u8>>,
    digest: u64,
    last: Option<(u32, u64)>,
}

impl Viewer {
    /// A new decoder.
    pub fn new(limits: Limits) -> Viewer {
        let decoder = Decoder::new(limits);
        let digest = decoder.state_digest();
        Viewer {
            decoder,
            limits,
            arrays: BTreeMap::new(),
            digest,
            last: None,
        }
    }

    /// One push, and all that must hold after it.
    pub fn push(&mut self, input: &[u8]) -> Result<(usize, EventDigest), Error> {
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
                    EventDigest {
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
    ) -> (Vec<EventDigest>, Result<(), Error>) {
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
    pub fn feed_whole(&mut self, bytes: &[u8]) -> (Vec<EventDigest>, Result<(), Error>) {
        self.feed(bytes, |left| left)
    }

    /// Resets the decoder.
    pub fn reset(&mut self) {
        self.decoder.reset();
        assert_eq!(self.decoder.position(), 0);
        assert!(self.decoder.tracks().is_empty() && self.decoder.points().buckets().is_empty());
        assert!(self.decoder.points().cells().is_empty() && self.decoder.last_frame().is_none());
        assert_eq!(self.decoder.dirty().next(), None);
        self.arrays.clear();
        self.last = None;
        self.digest = self.decoder.state_digest();
    }

    /// Every track, ids ascending.
    pub fn shown(&self) -> Vec<ShownTrack> {
        self.decoder
            .tracks()
            .iter()
            .map(|track| ShownTrack {
                track: track.track.clone(),
                transform: track.transform,
                content: Content::shown(&self.decoder, track),
            })
            .collect()
    }

    /// Copies what is dirty; then the copies must be the arrays.
    fn sync(&mut self) {
        let tracks = self.decoder.tracks();
        let declared = |id| tracks.iter().any(|track| track.track.id == id);
        self.arrays
            .retain(|(_, track), _| track.is_none_or(declared));
        let mut last: Option<Dirty> = None;
        for dirty in self.decoder.dirty() {
            let array = self.decoder.array(dirty.buffer, dirty.track);
            let key = (dirty.buffer, dirty.track);
            let copy = self.arrays.entry(key).or_default();
            copy.resize(array.len(), 0x77);
            let range = dirty.bytes();
            copy[range.clone()].copy_from_slice(&array[range]);
            if let Some(last) = last.filter(|last| (last.buffer, last.track) == key) {
                assert!(last.range.end <= dirty.range.start, "{last:?}, {dirty:?}");
            }
            last = Some(dirty);
        }
        self.decoder.clear_dirty();
        self.unchanged();
        self.digest = self.decoder.state_digest();
        check(&self.decoder, &self.limits);
    }

    /// Nothing but a commit or a declaration may change what is shown.
    fn unchanged(&self) {
        let tracks = self.decoder.tracks().iter();
        let ids: Vec<_> = tracks.map(|track| Some(track.track.id)).collect();
        for buffer in Buffer::ALL {
            for &track in [None].iter().chain(&ids) {
                let copy = self.arrays.get(&(buffer, track)).map_or(&[][..], |c| c);
                let array = self.decoder.array(buffer, track);
                assert!(array == copy, "{buffer:?} of {track:?} changed unseen");
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
    let kinds = ModelKind::ALL.into_iter();
    let state: u64 = kinds.map(|kind| models::check(kind, decoder)).sum();
    assert!(state <= limits.state_bytes);
    for track in tracks {
        assert!(track.track.target.path.len() <= limits.path_bytes as usize);
        if let Some(transform) = track.transform {
            assert!(
                transform
                    .world_from_grid
                    .as_flattened()
                    .iter()
                    .all(|f| f.is_finite())
            );
        }
    }
}
