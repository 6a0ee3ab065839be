//! What each record does to the state of a session: the decoder's inner half, after framing.

use alloc::vec::Vec;

use crate::Limits;
use crate::content::Base;
use crate::digest::StateDigest;
use crate::error::{ErrorDetail, ErrorKind, Limit};
use crate::frame::{FrameBytes, FrameInfo};
use crate::limits::TRACK_BYTES;
use crate::model::ModelKind;
use crate::parts::Parts;
use crate::reserve::reserve_bounded;
use crate::session::{Commit, GroupStart, TickRate};
use crate::track::{LiveTrack, Track, is_removed, read_removed, read_tracks};
use crate::transforms::{Transform, read_transforms};

// One more of each kind, in all the lists that a track is in. A free place, for buckets and for cells,
// is in a list twice, and the list is copied; a planned place is in one.
const _: () = assert!(
    size_of::<Track>()
        + size_of::<LiveTrack>()
        + size_of::<usize>()
        + size_of::<(usize, Transform)>()
        + Parts::TRACK_BYTES
        + 9 * size_of::<(u32, u32)>()
        <= TRACK_BYTES as usize
);

/// Tracks, committed state, and the pending frame.
#[derive(Default)]
pub(crate) struct Session {
    pub(crate) rate: Option<TickRate>,
    /// Ids ascending.
    pub(crate) tracks: Vec<LiveTrack>,
    pub(crate) parts: Parts,
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
    /// Payloads of model records.
    frame: FrameBytes,
    staged_transforms: Vec<(usize, Transform)>,
    has_transforms: bool,
    /// Tracks of a record in the making.
    declared: Vec<Track>,
    removed: Vec<usize>,
    /// Steps of work so far.
    work: u64,
    /// Digest of the committed state, where it is known.
    known_digest: Option<u64>,
    /// Some tracks wait for the commit that ends them.
    has_removed: bool,
    /// Some tracks may be marked as staged.
    has_content: bool,
}

/// How much of a frame there is, so that the content after it can be dropped.
#[derive(Clone, Copy)]
pub(crate) struct Pending {
    open: bool,
    frame_bytes: usize,
    /// Tracks with content, for each part.
    staged: [usize; 2],
}

impl Session {
    /// The size of the pending frame: what it can be taken back to.
    pub(crate) fn pending(&mut self) -> Pending {
        Pending {
            open: self.open,
            frame_bytes: self.frame.used(),
            staged: self.parts.all().map(|part| part.staged()),
        }
    }

    /// Drops the content that came after `pending`.
    pub(crate) fn go_back(&mut self, pending: Pending) {
        self.open = pending.open;
        self.frame.truncate(pending.frame_bytes);
        for (part, kept) in self.parts.all().into_iter().zip(pending.staged) {
            part.unstage(kept, self.emptied, &mut self.tracks);
        }
    }

    /// A declared track.
    pub(crate) fn live(&self, id: u32) -> Result<&LiveTrack, ErrorKind> {
        Ok(&self.tracks[find(&self.tracks, id)?])
    }

    pub(crate) fn is_open(&self) -> bool {
        self.open
    }

    pub(crate) fn stream(&mut self, payload: &[u8]) -> Result<TickRate, ErrorDetail> {
        let rate = TickRate::read(payload)?;
        self.rate = Some(rate);
        Ok(rate)
    }

    pub(crate) fn group(&mut self, payload: &[u8]) -> Result<(u32, GroupStart), ErrorDetail> {
        let (id, start) = GroupStart::read(payload)?;
        if self.open {
            return Err(ErrorKind::Uncommitted.into());
        }
        match start {
            GroupStart::Keyframes => {
                self.emptied = true;
                for live in self.tracks.iter().filter(|live| live.filled) {
                    let part = self.parts.of_mut(live.track.model.kind());
                    part.expect_nothing(live.track.id);
                }
            }
            GroupStart::State(digest) => {
                if self.last.is_none() {
                    return Err(ErrorKind::MissingGroupBase.into());
                }
                let known = self.known_digest.unwrap_or_else(|| {
                    let (known, work) = self.digest(false);
                    self.work += work;
                    known
                });
                self.known_digest = Some(known);
                if digest != known {
                    return Err(ErrorKind::MissingGroupBase.into());
                }
            }
        }
        self.in_group = true;
        self.open = true;
        Ok((id, start))
    }

    /// Declares tracks: all of the record, or none. Returns how many are new.
    pub(crate) fn declare(&mut self, payload: &[u8], limits: &Limits) -> Result<u32, ErrorDetail> {
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
                    false => Err(ErrorKind::TrackChanged.into()),
                };
            }
            if u64::from(track.id) < next_id {
                return Err(ErrorKind::TrackReused.into());
            }
            let asked = (tracks.len() + declared.len() + 1) as u64;
            let allowed = u64::from(limits.tracks);
            if asked > allowed {
                return Err(ErrorDetail::limit(
                    ErrorKind::TracksLimit,
                    Limit::Tracks,
                    asked,
                    allowed,
                ));
            }
            next_id = u64::from(track.id) + 1;
            reserve_bounded(declared, 1, limits.tracks as usize)?;
            declared.push(track);
            Ok(())
        })?;
        let known = self.tracks.len();
        self.add(limits)?;
        self.next_id = next_id;
        if self.tracks.len() > known {
            self.known_digest = None;
        }
        self.work += payload.len() as u64 / 16;
        Ok((self.tracks.len() - known) as u32)
    }

    /// Adds the tracks that a record declared, or none.
    fn add(&mut self, limits: &Limits) -> Result<(), ErrorDetail> {
        if self.declared.is_empty() {
            return Ok(());
        }
        let (most, limit) = (limits.state_bytes, limits.tracks as usize);
        let parts = self.parts.all();
        let mut asked = [0; 2];
        for (part, asked) in parts.into_iter().zip(&mut asked) {
            *asked = part.plan(&self.declared)?.unwrap_or(u64::MAX);
        }
        let sum = asked.iter().fold(0u64, |sum, &a| sum.saturating_add(a));
        if sum > most || asked.contains(&u64::MAX) {
            return Err(ErrorDetail::limit(
                ErrorKind::StateLimit,
                Limit::StateBytes,
                sum,
                most,
            ));
        }
        reserve_bounded(&mut self.tracks, self.declared.len(), limit)?;
        let added = (self.parts.all().into_iter().zip(asked))
            .try_for_each(|(part, asked)| part.add(&self.declared, most - (sum - asked), limit));
        if let Err(fault) = added {
            // Some may be there already. Their ids are above all others.
            let first = self.declared[0].id;
            for part in self.parts.all() {
                part.remove(&|id| id >= first);
            }
            return Err(fault.into());
        }
        self.tracks
            .extend(self.declared.drain(..).map(LiveTrack::new));
        Ok(())
    }

    pub(crate) fn remove(&mut self, payload: &[u8]) -> Result<(), ErrorDetail> {
        self.removed.clear();
        let (tracks, removed) = (&self.tracks, &mut self.removed);
        read_removed(payload, |id| {
            let at = find(tracks, id)?;
            reserve_bounded(removed, 1, tracks.len())?;
            removed.push(at);
            if tracks[at].staged {
                Err(ErrorKind::TrackTwice)
            } else {
                Ok(())
            }
        })?;
        for &at in &self.removed {
            self.tracks[at].removed = true;
        }
        self.has_removed |= !self.removed.is_empty();
        Ok(())
    }

    pub(crate) fn transforms(&mut self, payload: &[u8]) -> Result<(), ErrorDetail> {
        self.needs_group()?;
        if self.has_transforms {
            return Err(ErrorKind::TrackTwice.into());
        }
        let (tracks, staged) = (&self.tracks, &mut self.staged_transforms);
        let read = read_transforms(payload, |id, transform| {
            let at = find(tracks, id)?;
            reserve_bounded(staged, 1, tracks.len())?;
            staged.push((at, transform));
            Ok(())
        });
        read.inspect_err(|_| self.staged_transforms.clear())?;
        self.has_transforms = true;
        self.open = true;
        Ok(())
    }

    /// Room for a model record's payload, to be filled before [`Session::content`].
    pub(crate) fn reserve_content(
        &mut self,
        bytes: usize,
        limits: &Limits,
    ) -> Result<&mut [u8], ErrorDetail> {
        self.needs_group()?;
        let asked = self.frame.used() as u64 + bytes as u64;
        let allowed = u64::from(limits.frame_bytes);
        if asked > allowed {
            return Err(ErrorDetail::limit(
                ErrorKind::FrameLimit,
                Limit::FrameBytes,
                asked,
                allowed,
            ));
        }
        Ok(self.frame.reserve(bytes, limits.frame_bytes as usize)?)
    }

    pub(crate) fn content(&mut self, kind: ModelKind, bytes: usize) -> Result<(), ErrorDetail> {
        let base = Base {
            emptied: self.emptied,
            last_frame: self.last.map(|(frame, _)| frame),
        };
        self.open = true;
        self.has_content = true;
        let (frame, payload) = self.frame.keep(bytes);
        let part = self.parts.of_mut(kind);
        let result = part.stage(frame, payload, base, &mut self.tracks);
        self.work += bytes as u64 / 16 + part.take_work();
        Ok(result?)
    }

    pub(crate) fn commit(&mut self, payload: &[u8]) -> Result<FrameInfo, ErrorDetail> {
        let commit = Commit::read(payload)?;
        self.needs_group()?;
        if let Some((frame, tick)) = self.last {
            if commit.frame <= frame {
                return Err(ErrorKind::FrameNumber.into());
            }
            if commit.tick < tick {
                return Err(ErrorKind::Tick.into());
            }
        }
        self.parts.all().into_iter().for_each(|part| part.seal());
        let changes = self.has_content || self.has_transforms || self.emptied || self.has_removed;
        let mut known = self.known_digest.filter(|_| !changes);
        if let Some(digest) = commit.digest {
            let next = known.unwrap_or_else(|| {
                let (next, work) = self.digest(true);
                self.work += work;
                next
            });
            if digest != next {
                return Err(ErrorKind::StateDigest.into());
            }
            known = Some(next);
        }
        // From here on nothing fails.
        self.known_digest = known;
        let mut info = FrameInfo {
            number: commit.frame,
            tick: commit.tick,
            buckets: 0,
            cells: 0,
            probes: 0,
            transforms: self.staged_transforms.len() as u32,
        };
        for part in self.parts.all() {
            part.apply(self.frame.get(), &mut info);
        }
        if self.has_content || self.emptied {
            self.work += self.tracks.len() as u64;
            for live in &mut self.tracks {
                if live.staged {
                    live.filled = true;
                } else if self.emptied && live.filled {
                    let part = self.parts.of_mut(live.track.model.kind());
                    part.empty(live.track.id);
                    live.filled = false;
                }
            }
        }
        if self.emptied {
            self.tracks
                .iter_mut()
                .for_each(|live| live.transform = None);
        }
        for &(at, transform) in &self.staged_transforms {
            self.tracks[at].transform = Some(transform);
        }
        self.transforms_dirty |= self.has_transforms || self.emptied;
        if self.has_removed {
            self.work += 4 * self.tracks.len() as u64;
            let parts = self.parts.all().into_iter();
            parts.for_each(|part| part.remove(&|id| is_removed(&self.tracks, id)));
            self.tracks.retain(|live| !live.removed);
            self.has_removed = false;
        }
        for part in self.parts.all() {
            part.settle();
            self.work += part.take_work();
        }
        self.last = Some((commit.frame, commit.tick));
        self.close();
        Ok(info)
    }

    /// Steps of work so far ([`crate::Decoder::work`]).
    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    /// Digest of the committed state.
    pub(crate) fn state_digest(&self) -> u64 {
        self.known_digest.unwrap_or_else(|| self.digest(false).0)
    }

    /// Digest of the committed state, or of the state as the pending frame leaves it, and the steps
    /// of work that it took.
    fn digest(&self, staged: bool) -> (u64, u64) {
        let mut digest = StateDigest::new();
        for (slot, live) in self.tracks.iter().enumerate() {
            if staged && live.removed {
                continue;
            }
            let part = self.parts.of(live.track.model.kind());
            if !staged {
                digest.header(live.track.id, live.transform.as_ref());
                part.digest(live.track.id, &mut digest);
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
            part.digest_staged(live.track.id, self.frame.get(), self.emptied, &mut digest);
        }
        (digest.finish(), digest.work())
    }

    /// Drops the pending frame. Removals stay: a stream that goes on counts on them.
    pub(crate) fn revert(&mut self) {
        if self.has_content || self.emptied {
            for part in self.parts.all() {
                part.revert(self.emptied, &self.tracks);
            }
        }
        self.close();
    }

    /// Forgets everything but the memory.
    pub(crate) fn reset(&mut self) {
        self.revert();
        self.rate = None;
        self.tracks.clear();
        self.parts.all().into_iter().for_each(|part| part.reset());
        self.last = None;
        self.transforms_dirty = false;
        self.next_id = 0;
        self.in_group = false;
        self.has_removed = false;
        self.work = 0;
        self.known_digest = None;
    }

    pub(crate) fn clear_dirty(&mut self) {
        self.parts
            .all()
            .into_iter()
            .for_each(|part| part.clear_dirty());
        self.transforms_dirty = false;
    }

    fn close(&mut self) {
        if self.has_content {
            self.tracks.iter_mut().for_each(|live| live.staged = false);
        }
        self.has_content = false;
        self.frame.clear();
        self.open = false;
        self.emptied = false;
        self.has_transforms = false;
        self.staged_transforms.clear();
    }

    fn needs_group(&self) -> Result<(), ErrorKind> {
        if self.in_group {
            Ok(())
        } else {
            Err(ErrorKind::NoGroup)
        }
    }
}

fn find(tracks: &[LiveTrack], id: u32) -> Result<usize, ErrorKind> {
    let at = tracks.binary_search_by_key(&id, |live| live.track.id);
    let at = at.map_err(|_| ErrorKind::UnknownTrack)?;
    if tracks[at].removed {
        Err(ErrorKind::UnknownTrack)
    } else {
        Ok(at)
    }
}
