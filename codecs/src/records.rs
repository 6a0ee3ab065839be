//! What each record does to the state of a session: the decoder's inner half, after framing.

use alloc::vec::Vec;

use crate::Limits;
use crate::error::{Failure, Fault, Limit};
use crate::limits::TRACK_BYTES;
use crate::points::{Hasher, StagedPoints, State, StateDigest};
use crate::room::make_room;
use crate::session::{Commit, GroupStart, TickRate};
use crate::track::{LiveTrack, Track, read_removed, read_tracks};
use crate::transforms::{Transform, read_transforms};

// One more of each kind, in all the lists that a track is in; a free place is doubled, cloned and
// announced for buckets and for cells.
const _: () = assert!(
    size_of::<Track>()
        + size_of::<LiveTrack>()
        + size_of::<usize>()
        + size_of::<(usize, Transform)>()
        + StagedPoints::TRACK_BYTES
        + 7 * size_of::<(u32, u32)>()
        <= TRACK_BYTES as usize
);

/// A frame that was committed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameInfo {
    /// Frame number; ascends, and may leave numbers out.
    pub number: u32,
    /// Time in ticks of the stream's [`TickRate`].
    pub tick: u64,
    /// Buckets that the frame carried.
    pub buckets: u32,
    /// Cells that the frame carried.
    pub cells: u32,
    /// Transforms that the frame carried.
    pub transforms: u32,
}

/// Tracks, committed state, and the frame in the making.
#[derive(Default)]
pub(crate) struct Session {
    pub(crate) rate: Option<TickRate>,
    /// Ids ascending.
    pub(crate) tracks: Vec<LiveTrack>,
    pub(crate) state: State,
    /// Frame number and tick of the last commit.
    pub(crate) last: Option<(u32, u64)>,
    pub(crate) transforms_dirty: bool,
    /// Every new track's id is at least this.
    next_id: u64,
    in_group: bool,
    /// Something of the next frame came.
    open: bool,
    /// The next frame starts from an empty state.
    emptied: bool,
    staged: StagedPoints,
    staged_transforms: Vec<(usize, Transform)>,
    has_transforms: bool,
    /// Tracks of a record in the making.
    declared: Vec<Track>,
    removed: Vec<usize>,
}

impl Session {
    pub(crate) fn is_open(&self) -> bool {
        self.open
    }

    pub(crate) fn stream(&mut self, payload: &[u8]) -> Result<TickRate, Failure> {
        let rate = TickRate::read(payload)?;
        self.rate = Some(rate);
        Ok(rate)
    }

    pub(crate) fn group(&mut self, payload: &[u8]) -> Result<(u32, GroupStart), Failure> {
        let (id, start) = GroupStart::read(payload)?;
        if self.open {
            return Err(Fault::Uncommitted.into());
        }
        match start {
            GroupStart::Keyframes => {
                self.emptied = true;
                for live in self.tracks.iter().filter(|live| live.filled) {
                    self.state
                        .expect_nothing(live.track.grid(), live.first_cell);
                }
            }
            GroupStart::State(digest) => {
                if self.last.is_none() || digest != self.digest(false) {
                    return Err(Fault::MissingGroupBase.into());
                }
            }
        }
        self.in_group = true;
        self.open = true;
        Ok((id, start))
    }

    /// Declares tracks: all of the record, or none. Returns how many are new.
    pub(crate) fn declare(&mut self, payload: &[u8], limits: &Limits) -> Result<u32, Failure> {
        self.declared.clear();
        let (tracks, declared) = (&self.tracks, &mut self.declared);
        let mut next_id = self.next_id;
        read_tracks(payload, limits, |track| {
            // A removed one counts as not declared, and its id stays used.
            let known = tracks.binary_search_by_key(&track.id, |live| live.track.id);
            if let Some(live) = known
                .ok()
                .map(|at| &tracks[at])
                .filter(|live| !live.removed)
            {
                return match live.track == track {
                    true => Ok(()),
                    false => Err(Fault::TrackChanged.into()),
                };
            }
            if u64::from(track.id) < next_id {
                return Err(Fault::TrackReused.into());
            }
            let asked = (tracks.len() + declared.len() + 1) as u64;
            let allowed = u64::from(limits.tracks);
            if asked > allowed {
                return Err(Failure::limit(
                    Fault::TracksLimit,
                    Limit::Tracks,
                    asked,
                    allowed,
                ));
            }
            next_id = u64::from(track.id) + 1;
            make_room(declared, 1, limits.tracks as usize);
            declared.push(track);
            Ok(())
        })?;
        let known = self.tracks.len();
        let places = self.state.add_tracks(&self.declared, limits.state_bytes)?;
        make_room(&mut self.tracks, places.len(), limits.tracks as usize);
        for (track, (first_bucket, first_cell)) in self.declared.drain(..).zip(places) {
            self.tracks.push(LiveTrack {
                hasher: Hasher::new(track.grid()),
                track,
                first_bucket,
                first_cell,
                transform: None,
                staged: false,
                filled: false,
                removed: false,
            });
        }
        self.next_id = next_id;
        Ok((self.tracks.len() - known) as u32)
    }

    pub(crate) fn remove(&mut self, payload: &[u8]) -> Result<(), Failure> {
        self.removed.clear();
        let (tracks, removed) = (&self.tracks, &mut self.removed);
        read_removed(payload, |id| {
            let at = find(tracks, id)?;
            make_room(removed, 1, tracks.len());
            removed.push(at);
            if tracks[at].staged {
                Err(Fault::TrackTwice)
            } else {
                Ok(())
            }
        })?;
        for &at in &self.removed {
            self.tracks[at].removed = true;
        }
        Ok(())
    }

    pub(crate) fn transforms(&mut self, payload: &[u8]) -> Result<(), Failure> {
        self.needs_group()?;
        if self.has_transforms {
            return Err(Fault::TrackTwice.into());
        }
        let (tracks, staged) = (&self.tracks, &mut self.staged_transforms);
        read_transforms(payload, |id, transform| {
            let at = find(tracks, id)?;
            make_room(staged, 1, tracks.len());
            staged.push((at, transform));
            Ok(())
        })?;
        self.has_transforms = true;
        self.open = true;
        Ok(())
    }

    /// Room for a `points` payload of the frame, to be filled before [`Session::points`].
    pub(crate) fn points_room(
        &mut self,
        bytes: usize,
        limits: &Limits,
    ) -> Result<&mut [u8], Failure> {
        self.needs_group()?;
        let asked = self.staged.used() as u64 + bytes as u64;
        let allowed = u64::from(limits.frame_bytes);
        if asked > allowed {
            return Err(Failure::limit(
                Fault::FrameLimit,
                Limit::FrameBytes,
                asked,
                allowed,
            ));
        }
        Ok(self.staged.room(bytes, limits.frame_bytes as usize))
    }

    pub(crate) fn points(&mut self, bytes: usize) -> Result<(), Failure> {
        let last = self.last.map(|(frame, _)| frame);
        self.open = true;
        Ok(self
            .staged
            .stage(bytes, self.emptied, last, &mut self.state, &mut self.tracks)?)
    }

    pub(crate) fn commit(&mut self, payload: &[u8]) -> Result<FrameInfo, Failure> {
        let commit = Commit::read(payload)?;
        self.needs_group()?;
        if let Some((frame, tick)) = self.last {
            if commit.frame <= frame {
                return Err(Fault::FrameNumber.into());
            }
            if commit.tick < tick {
                return Err(Fault::Tick.into());
            }
        }
        self.staged.sort();
        if commit
            .digest
            .is_some_and(|digest| digest != self.digest(true))
        {
            return Err(Fault::StateDigest.into());
        }
        // From here on nothing fails.
        let counts = self
            .staged
            .apply(self.emptied, &mut self.state, &mut self.tracks);
        if self.emptied {
            self.tracks
                .iter_mut()
                .for_each(|live| live.transform = None);
        }
        for &(at, transform) in &self.staged_transforms {
            self.tracks[at].transform = Some(transform);
        }
        self.transforms_dirty |= self.has_transforms || self.emptied;
        let transforms = self.staged_transforms.len() as u32;
        for live in self.tracks.iter().filter(|live| live.removed) {
            self.state
                .remove_track(live.track.grid(), live.first_bucket, live.first_cell);
        }
        self.tracks.retain(|live| !live.removed);
        self.state.settle_dirty();
        self.last = Some((commit.frame, commit.tick));
        self.close();
        Ok(FrameInfo {
            number: commit.frame,
            tick: commit.tick,
            buckets: counts.buckets,
            cells: counts.cells,
            transforms,
        })
    }

    /// Digest of the committed state, or of the state as the frame in the making leaves it.
    pub(crate) fn digest(&self, staged: bool) -> u64 {
        let mut digest = StateDigest::new();
        for (slot, live) in self.tracks.iter().enumerate() {
            if staged && live.removed {
                continue;
            }
            if !staged {
                digest.track(
                    live.track.id,
                    live.transform.as_ref(),
                    self.state.buckets_of(live),
                    self.state.cells_of(live),
                );
                continue;
            }
            let found = self
                .staged_transforms
                .binary_search_by_key(&slot, |&(at, _)| at);
            let found = found.ok().map(|at| &self.staged_transforms[at]);
            let kept = if self.emptied {
                None
            } else {
                live.transform.as_ref()
            };
            digest.header(
                live.track.id,
                found.map(|(_, transform)| transform).or(kept),
            );
            self.staged
                .digest_track(slot, live, self.emptied, &self.state, &mut digest);
        }
        digest.finish()
    }

    /// Drops the frame in the making. Removals stay: a stream that goes on counts on them.
    pub(crate) fn revert(&mut self) {
        self.staged
            .revert(self.emptied, &mut self.state, &mut self.tracks);
        self.close();
    }

    /// Forgets everything but the memory.
    pub(crate) fn reset(&mut self) {
        self.revert();
        self.rate = None;
        self.tracks.clear();
        self.state.reset();
        self.last = None;
        self.transforms_dirty = false;
        self.next_id = 0;
        self.in_group = false;
    }

    fn close(&mut self) {
        self.open = false;
        self.emptied = false;
        self.has_transforms = false;
        self.staged_transforms.clear();
    }

    fn needs_group(&self) -> Result<(), Fault> {
        if self.in_group {
            Ok(())
        } else {
            Err(Fault::NoGroup)
        }
    }
}

fn find(tracks: &[LiveTrack], id: u32) -> Result<usize, Fault> {
    let at = tracks.binary_search_by_key(&id, |live| live.track.id);
    let at = at.map_err(|_| Fault::UnknownTrack)?;
    if tracks[at].removed {
        Err(Fault::UnknownTrack)
    } else {
        Ok(at)
    }
}
