//! A session: what each record does to tracks, committed state and the pending frame. The decoder's inner
//! half, after framing.

pub(crate) mod digest;
pub(crate) mod pending;
pub(crate) mod records;
pub(crate) mod track;
pub(crate) mod transforms;

use alloc::vec::Vec;

use crate::Limits;
use crate::dirty::{Buffer, Dirty, DirtyRange};
use crate::error::{ErrorDetail, ErrorKind, Limit};
use crate::limits::TRACK_BYTES;
use crate::memory::reserve::reserve_bounded;
use crate::models::payload_header::Base;
use crate::models::state::Rollback;
use crate::models::{ModelKind, ModelStates};
use digest::StateDigest;
use pending::{FrameInfo, PendingFrame};
use records::{Commit, GroupStart, TickRate};
use track::{Track, TrackState, read_removed, read_tracks};
use transforms::{Transform, read_transforms};

// One more of each kind, in all the lists that a track is in. A free place, for buckets, for cells and for
// vertices, is in a list twice, and the list is copied; a planned place is in one.
const _: () = assert!(
    size_of::<Track>()
        + size_of::<TrackState>()
        + size_of::<usize>()
        + size_of::<(usize, Transform)>()
        + ModelStates::TRACK_BYTES
        + 14 * size_of::<(u32, u32)>()
        <= TRACK_BYTES as usize
);

/// Tracks, committed state, and the pending frame.
#[derive(Default)]
pub(crate) struct Session {
    pub(crate) rate: Option<TickRate>,
    /// Ids ascending.
    pub(crate) tracks: Vec<TrackState>,
    pub(crate) models: ModelStates,
    /// Frame number and tick of the last commit.
    pub(crate) last: Option<(u32, u64)>,
    /// Every new track's id is at least this.
    next_id: u64,
    in_group: bool,
    pending: PendingFrame,
    /// Tracks of the record that is read.
    declared: Vec<Track>,
    removed: Vec<usize>,
    /// Steps of work so far.
    work: u64,
    /// Digest of the committed state, where it is known.
    known_digest: Option<u64>,
    /// Some tracks wait for the commit that ends them.
    has_removed: bool,
}

/// How much of the pending frame there is, so that the content after it can be dropped.
#[derive(Clone, Copy)]
pub(crate) struct Checkpoint {
    open: bool,
    payload_bytes: usize,
}

impl Session {
    /// The size of the pending frame.
    pub(crate) fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            open: self.pending.open,
            payload_bytes: self.pending.payloads.used(),
        }
    }

    /// Drops the content that came after `checkpoint` in the same frame.
    pub(crate) fn rollback_to(&mut self, checkpoint: Checkpoint) {
        self.pending.open = checkpoint.open;
        self.pending.payloads.truncate(checkpoint.payload_bytes);
        for kind in ModelKind::ALL {
            let to = Rollback::ToPayload(checkpoint.payload_bytes);
            self.models.of_mut(kind).rollback(to, &mut self.tracks);
        }
    }

    /// A declared track.
    pub(crate) fn track(&self, id: u32) -> Result<&TrackState, ErrorKind> {
        Ok(&self.tracks[find_declared(&self.tracks, id)?])
    }

    /// Something of the next frame came.
    pub(crate) fn is_open(&self) -> bool {
        self.pending.open
    }

    pub(crate) fn stream(&mut self, payload: &[u8]) -> Result<TickRate, ErrorDetail> {
        let rate = TickRate::read(payload)?;
        self.rate = Some(rate);
        Ok(rate)
    }

    pub(crate) fn group(&mut self, payload: &[u8]) -> Result<(u32, GroupStart), ErrorDetail> {
        let (id, start) = GroupStart::read(payload)?;
        if self.pending.open {
            return Err(ErrorKind::Uncommitted.into());
        }
        match start {
            GroupStart::Keyframes => {
                self.pending.emptied = true;
                for kind in ModelKind::ALL {
                    self.models.of_mut(kind).begin_empty(&self.tracks);
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
        self.pending.open = true;
        Ok((id, start))
    }

    /// Declares tracks: all of the record, or none. Returns how many are new.
    pub(crate) fn declare(&mut self, payload: &[u8], limits: &Limits) -> Result<u32, ErrorDetail> {
        self.declared.clear();
        let (tracks, declared) = (&self.tracks, &mut self.declared);
        let mut next_id = self.next_id;
        read_tracks(payload, limits, |track| {
            // A removed one counts as not declared, and its id stays used.
            let known = track::find(tracks, track.id).map(|at| &tracks[at]);
            if let Some(known) = known.filter(|known| !known.removed) {
                return match known.track == track {
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
        let (max_bytes, max_tracks) = (limits.state_bytes, limits.tracks as usize);
        let mut asked = [0; ModelKind::ALL.len()];
        for (kind, asked) in ModelKind::ALL.into_iter().zip(&mut asked) {
            let planned = self.models.of_mut(kind).plan(&self.declared)?;
            *asked = planned.unwrap_or(u64::MAX);
        }
        let sum = asked.iter().fold(0u64, |sum, &a| sum.saturating_add(a));
        if sum > max_bytes || asked.contains(&u64::MAX) {
            return Err(ErrorDetail::limit(
                ErrorKind::StateLimit,
                Limit::StateBytes,
                sum,
                max_bytes,
            ));
        }
        reserve_bounded(&mut self.tracks, self.declared.len(), max_tracks)?;
        let mut all = ModelKind::ALL.into_iter().zip(asked);
        let added = all.try_for_each(|(kind, asked)| {
            let model = self.models.of_mut(kind);
            model.add(&self.declared, max_bytes - (sum - asked), max_tracks)
        });
        if let Err(error) = added {
            // Some may be there already. Their ids are above all others.
            let first = self.declared[0].id;
            for kind in ModelKind::ALL {
                self.models.of_mut(kind).remove(&|id| id >= first);
            }
            return Err(error.into());
        }
        self.tracks
            .extend(self.declared.drain(..).map(TrackState::new));
        Ok(())
    }

    pub(crate) fn remove(&mut self, payload: &[u8]) -> Result<(), ErrorDetail> {
        self.removed.clear();
        let (tracks, removed) = (&self.tracks, &mut self.removed);
        read_removed(payload, |id| {
            let at = find_declared(tracks, id)?;
            reserve_bounded(removed, 1, tracks.len())?;
            removed.push(at);
            if tracks[at].staged.is_some() {
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
        if self.pending.has_transforms {
            return Err(ErrorKind::TrackTwice.into());
        }
        let (tracks, staged) = (&self.tracks, &mut self.pending.transforms);
        let read = read_transforms(payload, |id, transform| {
            let at = find_declared(tracks, id)?;
            reserve_bounded(staged, 1, tracks.len())?;
            staged.push((at, transform));
            Ok(())
        });
        read.inspect_err(|_| self.pending.transforms.clear())?;
        self.pending.has_transforms = true;
        self.pending.open = true;
        Ok(())
    }

    /// Memory for a model record's payload, to be filled before [`Session::content`].
    pub(crate) fn reserve_content(
        &mut self,
        bytes: usize,
        limits: &Limits,
    ) -> Result<&mut [u8], ErrorDetail> {
        self.needs_group()?;
        let asked = self.pending.payloads.used() as u64 + bytes as u64;
        let allowed = u64::from(limits.frame_bytes);
        if asked > allowed {
            return Err(ErrorDetail::limit(
                ErrorKind::FrameLimit,
                Limit::FrameBytes,
                asked,
                allowed,
            ));
        }
        Ok(self
            .pending
            .payloads
            .reserve(bytes, limits.frame_bytes as usize)?)
    }

    pub(crate) fn content(&mut self, kind: ModelKind, bytes: usize) -> Result<(), ErrorDetail> {
        let base = Base {
            emptied: self.pending.emptied,
            last_frame: self.last.map(|(frame, _)| frame),
        };
        self.pending.open = true;
        self.pending.has_content = true;
        let (payloads, payload) = self.pending.payloads.keep(bytes);
        let model = self.models.of_mut(kind);
        let result = model.stage(payloads, payload, base, &mut self.tracks);
        self.work += bytes as u64 / 16 + model.take_work();
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
        let changes = self.pending.has_changes() || self.has_removed;
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
        let info = self.apply(commit);
        self.last = Some((commit.frame, commit.tick));
        self.close();
        Ok(info)
    }

    /// Makes the pending frame the committed state.
    fn apply(&mut self, commit: Commit) -> FrameInfo {
        let frame = &self.pending;
        let pending = frame.view(self.has_removed);
        let mut items = [0; ModelKind::ALL.len()];
        for (kind, items) in ModelKind::ALL.into_iter().zip(&mut items) {
            let model = self.models.of_mut(kind);
            *items = model.commit(pending, &self.tracks);
            self.work += model.take_work();
        }
        if frame.has_content || frame.emptied {
            self.work += self.tracks.len() as u64;
            for state in &mut self.tracks {
                state.filled = state.staged.is_some() || (state.filled && !frame.emptied);
            }
        }
        if frame.emptied {
            for state in &mut self.tracks {
                state.set_transform(None);
            }
        }
        for &(at, transform) in &frame.transforms {
            self.tracks[at].set_transform(Some(transform));
        }
        if self.has_removed {
            self.work += 4 * self.tracks.len() as u64;
            self.tracks.retain(|state| !state.removed);
            self.has_removed = false;
        }
        FrameInfo {
            number: commit.frame,
            tick: commit.tick,
            transforms: frame.transforms.len() as u32,
            items,
        }
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
        let pending = staged.then(|| self.pending.view(self.has_removed));
        let mut digest = StateDigest::new();
        for (index, state) in self.tracks.iter().enumerate() {
            if staged && state.removed {
                continue;
            }
            let transform = match staged {
                true => self.pending.transform(index, state),
                false => state.transform.as_ref(),
            };
            digest.header(state.track.id, transform);
            let model = self.models.of(state.track.model.kind());
            model.digest(state, pending, &mut digest);
        }
        (digest.finish(), digest.work())
    }

    /// Drops the pending frame. Removals stay: a stream that goes on counts on them.
    pub(crate) fn rollback(&mut self) {
        if self.pending.has_content || self.pending.emptied {
            for kind in ModelKind::ALL {
                let model = self.models.of_mut(kind);
                model.rollback(Rollback::Frame, &mut self.tracks);
            }
        }
        self.close();
    }

    /// Forgets everything but the memory.
    pub(crate) fn reset(&mut self) {
        self.rollback();
        self.rate = None;
        self.tracks.clear();
        for kind in ModelKind::ALL {
            self.models.of_mut(kind).reset();
        }
        self.last = None;
        self.next_id = 0;
        self.in_group = false;
        self.has_removed = false;
        self.work = 0;
        self.known_digest = None;
    }

    /// What changed since [`Session::clear_dirty`], of all models, and transforms.
    pub(crate) fn dirty(&self) -> impl Iterator<Item = Dirty> {
        let changed = self.tracks.iter().filter(|state| state.transform_dirty);
        let transforms = changed.map(|state| Dirty {
            buffer: Buffer::Transforms,
            track: Some(state.track.id),
            range: DirtyRange {
                start: 0,
                end: u32::from(state.transform.is_some()),
            },
        });
        self.models.dirty().chain(transforms)
    }

    pub(crate) fn clear_dirty(&mut self) {
        for kind in ModelKind::ALL {
            self.models.of_mut(kind).clear_dirty();
        }
        for state in &mut self.tracks {
            state.transform_dirty = false;
        }
    }

    /// Ends the pending frame.
    fn close(&mut self) {
        if self.pending.has_content {
            for state in &mut self.tracks {
                state.staged = None;
            }
        }
        self.pending.clear();
    }

    fn needs_group(&self) -> Result<(), ErrorKind> {
        if self.in_group {
            Ok(())
        } else {
            Err(ErrorKind::NoGroup)
        }
    }
}

/// Index of a declared track. From its removal on a track counts as not declared.
fn find_declared(tracks: &[TrackState], id: u32) -> Result<usize, ErrorKind> {
    let at = track::find(tracks, id).ok_or(ErrorKind::UnknownTrack)?;
    match tracks[at].removed {
        true => Err(ErrorKind::UnknownTrack),
        false => Ok(at),
    }
}
